# tests/qemu/qemu.mk - images for bare processors, run in QEMU.

QEMU_DIR  := build/qemu
QEMU_CC   := $(STD) $(WARN) -I. -MMD -MP
QEMU_BARE := $(QEMU_CC) -O2 -ffreestanding \
             -fno-tree-loop-distribute-patterns -ffunction-sections
QEMU_RUN  := -nographic -monitor none -serial none -chardev stdio,id=out \
             -semihosting-config enable=on,target=native,chardev=out
RV        ?= riscv64-unknown-elf-

# Per processor: compiler, start-up, what ends the line, and how QEMU runs it.
QEMU_CC_m0   := $(CROSS)gcc -mcpu=cortex-m0 -mthumb
QEMU_CC_m4   := $(CROSS)gcc -mcpu=cortex-m4 -mthumb
QEMU_CC_rv32 := $(RV)gcc -march=rv32imac -mabi=ilp32 -mcmodel=medany \
                -isystem firmware/mcu/board/rv32
QEMU_CC_rv64 := $(RV)gcc -march=rv64imac -mabi=lp64 -mcmodel=medany \
                -isystem firmware/mcu/board/rv32
QEMU_ON_m0   := tests/qemu/start_arm.c
QEMU_ON_m4   := $(QEMU_ON_m0)
QEMU_ON_rv32 := tests/qemu/start_riscv.c
QEMU_ON_rv64 := $(QEMU_ON_rv32)
QEMU_LD_m0   := -T tests/qemu/arm.ld -lgcc
QEMU_LD_m4   := $(QEMU_LD_m0)
QEMU_LD_rv32 := -T tests/qemu/riscv.ld -lgcc -Wl,--no-warn-rwx-segments
QEMU_LD_rv64 := $(QEMU_LD_rv32)
QEMU_m0      := qemu-system-arm -M microbit -global nrf51-soc.sram-size=32768 \
                -global nrf51-soc.flash-size=1048576
QEMU_m4      := qemu-system-arm -M mps2-an386
QEMU_rv32    := qemu-system-riscv32 -M virt -bios none
QEMU_rv64    := qemu-system-riscv64 -M virt -bios none
QEMU_CPUS    := m0 m4 rv32 rv64

# What an image is made of beside the motion library and the start-up.
QEMU_IMAGES     := bench control golden orient curves fcurve wide cost play
QEMU_SRC_bench  := tests/qemu/bench_tick.c
QEMU_SRC_control := tests/qemu/bench_control.c hal/drive/drive.c \
    $(filter-out %/homing.c %/mailbox.c %/trigger.c,$(wildcard firmware/control/*.c))
QEMU_SRC_play   := tests/qemu/mcu_play.c hal/drive/drive.c \
    $(filter-out %/registers.c,$(wildcard firmware/mcu/*.c)) \
    $(wildcard firmware/control/*.c) \
    $(wildcard hal/drive/modbus/*.c hal/drive/virtual/*.c hal/mcu/*.c hal/support/*.c) \
    $(addprefix hal/modbus/,bus.c listener.c map.c master.c modbus.c pdu.c rtu.c \
      serial.c)
QEMU_SRC_golden := tests/qemu/golden.c tests/bench/otg_random.c
QEMU_SRC_orient := tests/qemu/golden_orient.c
QEMU_SRC_cost   := tests/bench/curves_image.c
QEMU_SRC_curves := tests/qemu/golden_curves.c
QEMU_SRC_fcurve := tests/qemu/golden_fcurve.c
QEMU_SRC_wide   := tests/qemu/golden_wide.c
GOLDEN_IMAGES   := golden orient curves fcurve wide
GOLDEN_TOOLS    := tests/qemu/golden_tools.c
$(foreach i,$(GOLDEN_IMAGES),$(eval QEMU_SRC_$(i) += $(GOLDEN_TOOLS)))
$(QEMU_DIR)/m4/tests/qemu/bench_tick.o: QEMU_BARE += -DLIMIT=150 \
    -DLIMIT_ENCLOSE=480
$(QEMU_DIR)/m4/tests/qemu/bench_control.o: QEMU_BARE += -DLIMIT_MOVING=12000 \
    -DLIMIT_SEEK=12000
QEMU_ROOM_control_m4 := -Wl,--defsym=image_ram=1M
# More RAM than a micro:bit has, for six windows; the move lies behind the image.
QEMU_FILE_m0   := 0x80000
QEMU_FILE_m4   := 0x200000
QEMU_FILE_rv32 := 0x81000000
QEMU_FILE_rv64 := 0x81000000
$(foreach p,$(QEMU_CPUS),$(eval QEMU_ROOM_play_$(p) := \
    -Wl,--defsym=image_ram=256K,--defsym=play_file=$(QEMU_FILE_$(p))))

# The library is that of make rt where there is one for the processor.
QEMU_LIB_m0 := build/rt/m0
QEMU_LIB_m4 := build/rt/m4

# qemu_objects CPU,COMPILER AND FLAGS: the library, and objects for images.
define qemu_objects
$(QEMU_DIR)/$(1)/%.o: %.c Makefile tests/qemu/qemu.mk firmware/mcu/mcu.mk
	@mkdir -p $$(@D)
	$$(Q)$(2) -c $$< -o $$@
$(QEMU_DIR)/$(1)/libmotion.a: \
    $(MOTION:%.c=$(or $(QEMU_LIB_$(1)),$(QEMU_DIR)/$(1))/%.o)
	$$(call say,ar,$$@)
	$$(Q)rm -f $$@; $(AR) qcs $$@ $$^
endef
$(foreach p,$(QEMU_CPUS),\
  $(eval $(call qemu_objects,$(p),$(QEMU_CC_$(p)) $$(QEMU_BARE))))

# An image may not bring float or a heap with it.
define qemu_image
$(QEMU_DIR)/$(2)-$(1).elf: tests/qemu/arm.ld tests/qemu/riscv.ld \
    $(patsubst %.c,$(QEMU_DIR)/$(1)/%.o,\
      $(QEMU_SRC_$(2)) tests/qemu/start.c $(QEMU_ON_$(1))) \
    $(QEMU_DIR)/$(1)/libmotion.a
	$$(call say,image,$$@)
	$$(Q)$(QEMU_CC_$(1)) -nostdlib -Wl,--gc-sections \
	    $$(filter %.o %.a,$$^) $(QEMU_LD_$(1)) $$(QEMU_ROOM_$(2)_$(1)) -o $$@
	@! nm $$@ | grep -E ' [Tt] (malloc|calloc|free|__aeabi_[df]|__.*[sd]f[0-9])'
endef
$(foreach p,$(QEMU_CPUS),$(foreach i,$(QEMU_IMAGES),\
  $(eval $(call qemu_image,$(p),$(i)))))

.PHONY: bench-tick
## instructions on Cortex-M4 and M0 per sample (M4: 150), stretch (480) and tick (12,000), in QEMU
bench-tick: $(QEMU_DIR)/bench-m4.elf $(QEMU_DIR)/bench-m0.elf \
    $(QEMU_DIR)/control-m4.elf
	@echo "Cortex-M4, instructions per motion_track_sample:"
	@timeout 60 $(QEMU_m4) $(QEMU_RUN) -icount shift=10,sleep=off \
	    -kernel $(QEMU_DIR)/bench-m4.elf </dev/null
	@echo "Cortex-M4, instructions per tick of the controller, six axes:"
	@timeout 900 $(QEMU_m4) $(QEMU_RUN) -icount shift=10,sleep=off \
	    -kernel $(QEMU_DIR)/control-m4.elf </dev/null
	@echo "Cortex-M0:"
	@timeout 60 $(QEMU_m0) $(QEMU_RUN) -icount shift=10,sleep=off \
	    -kernel $(QEMU_DIR)/bench-m0.elf </dev/null

# The same programs on a PC.
GOLDEN_HOSTS := gcc-O2 gcc-O0 clang-O2 clang-O0
define qemu_host
$(QEMU_DIR)/$(2)-$(1): $(patsubst %.c,$(QEMU_DIR)/$(1)/%.o,\
    $(QEMU_SRC_$(2)) tests/qemu/start_host.c) $(QEMU_DIR)/$(1)/libmotion.a
	$$(call say,link,$$@)
	$$(Q)$(subst -, -,$(1)) $$^ -o $$@
$(QEMU_DIR)/$(2)-$(1).txt: $(QEMU_DIR)/$(2)-$(1)
	@$$< >$$@.part && mv $$@.part $$@
endef
$(foreach h,$(GOLDEN_HOSTS),\
  $(eval $(call qemu_objects,$(h),$(subst -, -,$(h)) $(QEMU_CC)))\
  $(foreach i,$(GOLDEN_IMAGES),$(eval $(call qemu_host,$(h),$(i)))))

define qemu_golden
$(QEMU_DIR)/$(2)-$(1).txt: $(QEMU_DIR)/$(2)-$(1).elf
	@timeout 60 $(QEMU_$(1)) $(QEMU_RUN) -kernel $$< </dev/null >$$@.part \
	    || { cat $$@.part; exit 1; }
	@mv $$@.part $$@
endef
$(foreach p,$(QEMU_CPUS),$(foreach i,$(GOLDEN_IMAGES),\
  $(eval $(call qemu_golden,$(p),$(i)))))

GOLDEN_ON := $(GOLDEN_HOSTS) $(QEMU_CPUS)

.PHONY: images
# what the checks run in QEMU beside firmware/mcu's boards
images: $(patsubst %,$(QEMU_DIR)/%.elf,bench-m4 bench-m0 control-m4 \
    play-m0 play-m4 play-rv32)

.PHONY: golden
## the same bits from every compiler and processor
golden: $(foreach i,$(GOLDEN_IMAGES),$(foreach on,$(GOLDEN_ON),\
          $(QEMU_DIR)/$(i)-$(on).txt))
	@for i in $(GOLDEN_IMAGES); do \
	    cat $(QEMU_DIR)/$$i-gcc-O2.txt; \
	    for on in $(GOLDEN_ON); do \
	        cmp $(QEMU_DIR)/$$i-gcc-O2.txt $(QEMU_DIR)/$$i-$$on.txt || exit 1; \
	    done; \
	done
	@echo "equal: $(GOLDEN_ON)"

# How play-CPU.elf plays the move in FILE.
QEMU_RAM_m0   := -global nrf51-soc.sram-size=262144
QEMU_PLAY_RUN = $(QEMU_$(1)) $(QEMU_RAM_$(1)) $(QEMU_RUN) -kernel $(QEMU_DIR)/play-$(1).elf \
    -device loader,file=FILE,addr=$(QEMU_FILE_$(1)),force-raw=on
