# tests/vm/vm.mk - checks on a kernel that has what this machine's may lack.

# Machines side by side, the longest first, as one counts instructions and runs on one
# processor: each with scripts of tests/vm, one after the other, SCRIPT-OPTION+SCRIPT.
VM_CHECKS := can lines lines-gpiod2 can-vcan0 turn+gpio+clock
# What of ours they need.
VM_NEED   := $(SLEW) $(call named,conform_can) $(call named,can_socketcan) \
             $(call named,conform_gpio) $(B)/gpiod2/test_conform_gpio \
             $(B)/gpiod2/slew

.PHONY: test-vm
## CAN, GPIO and a clock that is set, as they really are: a kernel in QEMU (4 min)
test-vm: $(VM_NEED)
	@tests/vm/boot.sh
	@$(MAKE) --no-print-directory --output-sync=target $(ALL_CPUS) \
	    $(VM_CHECKS:%=vm-%)

.PHONY: $(VM_CHECKS:%=vm-%)
$(VM_CHECKS:%=vm-%): vm-%:
	@tests/vm/boot.sh 'bad=0; \
	    for check in $(subst +, ,$*); do \
	        option=$${check#*-}; check=$${check%-*}; \
	        echo "$$check:"; \
	        tests/vm/$$check.sh $(B) \
	            $$([ $$option = $$check ] || echo $$option) || bad=1; \
	    done; exit $$bad'
