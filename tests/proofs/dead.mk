# tests/proofs/dead.mk - make dead: functions and tables of the product that no product
# uses.
#
# One link of everything, each function and each variable a section of its own and
# nothing inlined, that keeps what the program, the FMU, libslew, the page's planner and
# the boards call.  What the linker leaves out has no user but tests, if any.

DEAD_MAKE    = $(MAKE) --no-print-directory $(ALL_CPUS) VARIANT=dead CC=gcc OPT=-O0 \
               WARN=-w CFLAGS='-ffunction-sections -fdata-sections -fno-inline \
               -fkeep-inline-functions'
DEAD_OBJECTS = $(patsubst %.c,$(B)/%.o,$(ROOMS) $(MAIN) $(FMU_SRC) \
                 firmware/studio/wasm/module.c) $(B)/own.o $(B)/page.o $(B)/example.o

DEAD_NARROW  = $(filter build/rt/m4/%,$(RT))

.PHONY: dead dead-link
## functions and tables that the program, libslew, the FMU, the page, the boards never use
dead: $(MCU_BOARDS:%=$(MCU_DIR)/%.elf) $(DEAD_NARROW)
	@+$(DEAD_MAKE) dead-link

dead-link: $(DEAD_OBJECTS)
	@CC="$(CC)" LIBRARIES="$(LDLIBS)" BOARDS="$(MCU_DIR)/firmware/mcu/board" \
	    NARROW="$(DEAD_NARROW)" \
	    IMAGES="$(MCU_BOARDS:%=$(MCU_DIR)/%.elf)" tests/proofs/dead.sh $(B)/dead $^
