# tests/vm/vm.mk - checks on a kernel that has what this machine's may lack.

# Scripts of tests/vm that run in there, one after the other, and what of ours
# they need.
VM_CHECKS := can gpio lines turns
VM_NEED   := $(SLEW) $(call named,conform_can) $(call named,can_socketcan) \
             $(call named,conform_gpio) $(B)/gpiod2/test_conform_gpio \
             $(B)/gpiod2/slew

.PHONY: test-vm
## CAN and GPIO as they really are: a kernel in QEMU, drives on can0 (4 min)
test-vm: $(VM_NEED)
	@tests/vm/boot.sh 'bad=0; \
	    for check in $(VM_CHECKS); do \
	        echo "$$check:"; tests/vm/$$check.sh $(B) || bad=1; \
	    done; exit $$bad'
