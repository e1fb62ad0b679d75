# tests/qemu/qemu.mk - images for bare processors, run in QEMU.

QEMU_DIR  := build/qemu
QEMU_CC   := -std=c11 $(WARN) -g -I.
QEMU_BARE := $(QEMU_CC) -O2 -ffreestanding -nostdlib \
             -fno-tree-loop-distribute-patterns -ffunction-sections \
             -Wl,--gc-sections tests/qemu/start.c
QEMU_NEED := $(MOTION) $(wildcard motion/*.h tests/qemu/*) \
             $(wildcard tests/bench/otg_random.*) Makefile
QEMU_RUN  := -nographic -monitor none -serial none -chardev stdio,id=out \
             -semihosting-config enable=on,target=native,chardev=out
RV        ?= riscv64-unknown-elf-

# Per processor: compiler, what ends the line, and how QEMU runs the image.
QEMU_CC_m0   := $(CROSS)gcc -mcpu=cortex-m0 -mthumb
QEMU_CC_m4   := $(CROSS)gcc -mcpu=cortex-m4 -mthumb
QEMU_CC_rv32 := $(RV)gcc -march=rv32imac -mabi=ilp32 -mcmodel=medany
QEMU_CC_rv64 := $(RV)gcc -march=rv64imac -mabi=lp64 -mcmodel=medany
QEMU_LD_m0   := tests/qemu/start_arm.c -T tests/qemu/arm.ld -lgcc
QEMU_LD_m4   := $(QEMU_LD_m0)
QEMU_LD_rv32 := tests/qemu/start_riscv.c -T tests/qemu/riscv.ld -lgcc \
                -Wl,--no-warn-rwx-segments
QEMU_LD_rv64 := $(QEMU_LD_rv32)
QEMU_m0      := qemu-system-arm -M microbit -global nrf51-soc.sram-size=32768 \
                -global nrf51-soc.flash-size=1048576
QEMU_m4      := qemu-system-arm -M mps2-an386
QEMU_rv32    := qemu-system-riscv32 -M virt -bios none
QEMU_rv64    := qemu-system-riscv64 -M virt -bios none

# An image may not bring float or a heap with it.
$(QEMU_DIR)/bench-m4.elf: QEMU_DEF := -DLIMIT=150
define qemu_image
$(QEMU_DIR)/$(2)-$(1).elf: $(QEMU_NEED)
	$$(call say,image,$$@)
	@mkdir -p $$(@D)
	$$(Q)$(QEMU_CC_$(1)) $(QEMU_BARE) $$(QEMU_DEF) $(3) \
	    $(MOTION) $(QEMU_LD_$(1)) -o $$@
	@! nm $$@ | grep -E ' [Tt] (malloc|calloc|free|__aeabi_[df]|__.*[sd]f[0-9])'
endef
GOLDEN_SRC := tests/qemu/golden.c tests/bench/otg_random.c
$(foreach p,m0 m4,$(eval $(call qemu_image,$(p),bench,tests/qemu/bench_tick.c)))
$(foreach p,m0 m4 rv32 rv64,$(eval $(call qemu_image,$(p),golden,$(GOLDEN_SRC))))

.PHONY: bench-tick
## instructions per sample on Cortex-M4 (at most 150) and M0, counted in QEMU
bench-tick: $(QEMU_DIR)/bench-m4.elf $(QEMU_DIR)/bench-m0.elf
	@echo "Cortex-M4, instructions per motion_track_sample:"
	@timeout 60 $(QEMU_m4) $(QEMU_RUN) -icount shift=10,sleep=off \
	    -kernel $(QEMU_DIR)/bench-m4.elf </dev/null
	@echo "Cortex-M0:"
	@timeout 60 $(QEMU_m0) $(QEMU_RUN) -icount shift=10,sleep=off \
	    -kernel $(QEMU_DIR)/bench-m0.elf </dev/null

# The same program on a PC.
define qemu_host
$(QEMU_DIR)/golden-$(1): $(QEMU_NEED)
	$$(call say,link,$$@)
	@mkdir -p $$(@D)
	$$(Q)$(2) $(QEMU_CC) $(GOLDEN_SRC) tests/qemu/start_host.c \
	    $(MOTION) -o $$@
$(QEMU_DIR)/golden-$(1).txt: $(QEMU_DIR)/golden-$(1)
	@$$< >$$@.part && mv $$@.part $$@
endef
$(eval $(call qemu_host,gcc-O2,gcc -O2))
$(eval $(call qemu_host,gcc-O0,gcc -O0))
$(eval $(call qemu_host,clang-O2,clang -O2))

$(QEMU_DIR)/golden-%.txt: $(QEMU_DIR)/golden-%.elf
	@timeout 60 $(QEMU_$*) $(QEMU_RUN) -kernel $< </dev/null >$@.part
	@mv $@.part $@

GOLDEN := $(foreach on,gcc-O2 gcc-O0 clang-O2 m0 m4 rv32 rv64,\
            $(QEMU_DIR)/golden-$(on).txt)

.PHONY: golden
## the same bits from every compiler and processor
golden: $(GOLDEN)
	@cat $(QEMU_DIR)/golden-gcc-O2.txt
	@for f in $(GOLDEN); do cmp $(QEMU_DIR)/golden-gcc-O2.txt $$f || exit 1; \
	    done
	@echo "equal: $(patsubst $(QEMU_DIR)/golden-%.txt,%,$(GOLDEN))"
