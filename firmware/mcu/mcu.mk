# firmware/mcu/mcu.mk - images of the controller for microcontrollers.

MCU_DIR    := build/mcu
MCU_BOARDS := mps2_an386 netduinoplus2
MCU_CC     := $(CROSS)gcc -mcpu=cortex-m4 -mthumb
MCU_OPT    := -O2
# What every image has; bytes.c in the place of a C library.
MCU_SRC    := $(wildcard firmware/mcu/*.c) firmware/mcu/board/main.c \
              firmware/mcu/board/port.c firmware/mcu/board/cortex_m.c \
              firmware/mcu/board/bytes.c $(PORTABLE)

# Small where the tick never comes, or only once per request; smaller still
# with products of 128 bits as calls, where there are many.
MCU_SMALL  := $(addprefix firmware/control/,command.c couple.c goal.c home.c \
                homing.c homing_stop.c init.c jog.c mailbox.c playback.c \
                ramp_span.c ramp_step.c) \
              $(addprefix motion/core/,clock_warp_plan.c fixed.c track_state.c \
                track_summary.c) \
              $(call sources,motion/otg hal/drive/modbus)
MCU_CALLS  := $(addprefix firmware/control/,ramp_bound.c ramp_load.c ramp_rest.c \
                ramp_scheduled.c) \
              motion/core/track_append.c
$(MCU_SMALL:%.c=$(MCU_DIR)/%.o): MCU_OPT := -Os
# So does make bench-tick count them.
$(MCU_SMALL:%.c=build/qemu/m4/%.o): QEMU_BARE += -Os
$(MCU_CALLS:%.c=$(MCU_DIR)/%.o): MCU_OPT := -Os -fno-inline

$(MCU_DIR)/%.o: %.c Makefile firmware/mcu/mcu.mk
	$(call say,mcu,$<)
	@mkdir -p $(@D)
	$(Q)$(MCU_CC) $(STD) $(WARN) $(MCU_OPT) -I. -MMD -MP -ffreestanding \
	    -fno-tree-loop-distribute-patterns -ffunction-sections \
	    -fdata-sections -c $< -o $@

define mcu_image
$(MCU_DIR)/$(1).elf: $(patsubst %.c,$(MCU_DIR)/%.o,$(MCU_SRC) \
    firmware/mcu/board/$(1).c) $(wildcard firmware/mcu/board/*.ld)
	$$(call say,image,$$@)
	$$(Q)$(MCU_CC) -nostdlib -Wl,--gc-sections,-Map=$(MCU_DIR)/$(1).map \
	    $$(filter %.o,$$^) -Lfirmware/mcu/board \
	    -T firmware/mcu/board/$(1).ld -lgcc -o $$@
	@! nm $$@ | grep -E ' [Tt] (malloc|calloc|free|__aeabi_[df]|__.*[sd]f[0-9])'
endef
$(foreach b,$(MCU_BOARDS),$(eval $(call mcu_image,$(b))))

.PHONY: firmware
## images for microcontrollers, build/mcu/*.elf; flash, RAM and stack of each
firmware: $(MCU_BOARDS:%=$(MCU_DIR)/%.elf) mcu-portable
	@CROSS=$(CROSS) $(PYTHON) tests/firmware/mcu/size.py \
	    $(MCU_BOARDS:%=$(MCU_DIR)/%.map)

# What is independent of a board is compiled for other processors too, for a Cortex-M0 as
# make rt does.
MCU_PORTABLE := $(wildcard firmware/mcu/*.c) $(PORTABLE)
MCU_OTHER    := $(MCU_PORTABLE:%.c=build/rt/m0/%.o)
define mcu_other
MCU_OTHER += $(patsubst %.c,$(MCU_DIR)/$(1)/%.o,$(MCU_PORTABLE))
$(MCU_DIR)/$(1)/%.o: %.c Makefile firmware/mcu/mcu.mk
	$$(call say,$(1),$$<)
	@mkdir -p $$(@D)
	$$(Q)$(2) $(STD) $(WARN) -O2 -I. -MMD -MP -ffreestanding -c $$< -o $$@
endef
$(eval $(call mcu_other,rv32,$$(RV)gcc -march=rv32imac -mabi=ilp32 \
    -isystem firmware/mcu/board/rv32))
.PHONY: mcu-portable
mcu-portable: $(MCU_OTHER)

MCU_PLAY := $(B)/tests/firmware/mcu/play
MCU_PACK := $(B)/tests/firmware/mcu/pack
MCU_LOG  := $(B)/tests/firmware/mcu/log
MCU_PROCESSORS := m0 m4 rv32
.PHONY: test-firmware test-processors
## the images in QEMU, moved by libmodbus and moving servos: the PC's set points
test-firmware: $(MCU_BOARDS:%=$(MCU_DIR)/%.elf) $(SLEW) $(MCU_PLAY) \
    $(MCU_LOG) test-processors
	@SLEW=$(SLEW) PLAY=$(MCU_PLAY) IMAGES=$(MCU_DIR) \
	    tests/firmware/mcu/play.sh
	@SLEW=$(SLEW) PLAY=$(MCU_PLAY) IMAGES=$(MCU_DIR) \
	    tests/firmware/mcu/hil.sh
	@SLEW=$(SLEW) LOG=$(MCU_LOG) IMAGES=$(MCU_DIR) PYTHON=$(PYTHON) \
	    tests/firmware/mcu/rig.sh
	@$(PYTHON) tests/firmware/mcu/clock.py $(MCU_DIR)/mps2_an386.elf mps2-an386 25000000
	@$(PYTHON) tests/firmware/mcu/clock.py $(MCU_DIR)/netduinoplus2.elf netduinoplus2 168000000

## every example a board can play on Cortex-M0, M4 and RV32: the PC's set points
test-processors: $(MCU_PROCESSORS:%=build/qemu/play-%.elf) $(SLEW) $(MCU_PACK)
	@SLEW=$(SLEW) PACK=$(MCU_PACK) tests/firmware/mcu/processors.sh \
	    $(foreach p,$(MCU_PROCESSORS),'$(call QEMU_PLAY_RUN,$(p))')
