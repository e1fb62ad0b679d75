# slew - see README.md.  `make` prints what there is.
#
#   CC=clang VARIANT=clang   another compiler, under build/clang
#   SAN=address,undefined    with sanitizers
#   T=track                  one test, for make check
#   V=1                      show commands and all test output

.DEFAULT_GOAL := help
ifeq ($(origin CC),default)
CC       := gcc
endif
CROSS    ?= arm-none-eabi-
PYTHON   ?= /usr/bin/python3
VARIANT  ?=
SAN      ?=
T        ?=
OPT      ?= -O2
comma    := ,
B        := build$(VARIANT:%=/%)
ifneq ($(SAN),)
B        := $(B)/san-$(subst $(comma),-,$(SAN))
OPT      := -O1 -fno-omit-frame-pointer -fsanitize=$(SAN) \
            -fno-sanitize-recover=all
endif

# Of the libraries; asked when used, so that `make deps` can come first.
PKGS      = yaml-0.1 libcjson cairo fontconfig libmodbus libgpiod zlib
PKG_INC   = $(patsubst -I%,-isystem %,$(shell pkg-config --cflags $(PKGS)))
PKG_LIB   = $(shell pkg-config --libs $(PKGS))
CMOCKA    = $(shell pkg-config --libs cmocka)

WARN     := -Wall -Wextra -Wconversion -Wshadow -Wstrict-prototypes -Werror
STD      := -std=c11 -D_POSIX_C_SOURCE=200809L
CFLAGS   ?= -g
ALL_CFLAGS = $(STD) $(WARN) $(OPT) $(CFLAGS) -I. -MMD -MP
LDLIBS    = $(PKG_LIB) -lm -lpthread

# Rooms, from whatever .c files stand there.  HOSTED: drivers that need an
# operating system; the rest of hal/ also runs on a microcontroller.
MAIN     := firmware/linux/main.c
HOSTED   := $(wildcard $(foreach on,linux socketcan libmodbus libgpiod,\
              hal/*_$(on).[ch]))
MOTION   := $(wildcard motion/*.c)
HAL      := $(wildcard hal/*.c)
FIRMWARE := $(wildcard firmware/*.c)
LINUX    := $(wildcard firmware/linux/*/*.c)
ROOMS    := $(MOTION) $(wildcard motion/plan/*.c) $(HAL) $(wildcard sim/*.c) \
            $(FIRMWARE) $(LINUX)
PORTABLE := $(MOTION) $(filter-out $(HOSTED),$(HAL)) $(FIRMWARE)
TEST_SRC := $(wildcard tests/test_*.c)
TEST_LIB := $(filter-out $(TEST_SRC),$(wildcard tests/*.c))
SOURCES  := $(ROOMS) $(wildcard $(MAIN)) $(TEST_SRC) $(TEST_LIB) \
            $(wildcard tests/peers/*.c tests/fuzz/*.c)
HEADERS  := $(wildcard $(foreach d,motion motion/plan hal sim firmware \
              firmware/linux/* tests tests/fuzz,$(d)/*.h))
# What is compiled for a bare machine or beside a peer is laid out like the rest.
LAID_OUT := $(SOURCES) $(HEADERS) $(wildcard tests/qemu/*.[ch] \
              tests/bench/*.[ch])

SLEW     := $(B)/slew
TESTS    := $(TEST_SRC:%.c=$(B)/%)
FUZZ     := $(patsubst %.c,$(B)/%,$(wildcard tests/fuzz/fuzz_*.c))
VECTORS  := $(B)/tests/vectors
SCRIPTS  := $(wildcard tests/demo.sh tests/real_modbus.sh tests/real_stop.sh)

Q        := $(if $(V),,@)
ALL_CPUS  = $(if $(findstring jobserver,$(MAKEFLAGS)),,-j"$$(nproc)")
say       = @$(if $(V),:,printf '  %-6s %s\n' $(1) $(2))

.PHONY: help
## this list
help:
	@awk '/^## /{text=substr($$0,4);next} \
	      text&&/^[a-z-]+:/{sub(":.*","");printf "  make %-14s %s\n",$$0,text} \
	      {text=""}' $(filter-out %.d,$(MAKEFILE_LIST))

#---- what a user runs

.PHONY: demo
## install what is missing, build, run a camera move on simulated servos
demo:
	@.ci/deps run
	@$(MAKE) --no-print-directory $(ALL_CPUS) build
	@mkdir -p $(B)/demo
	$(SLEW) run examples/dolly --telemetry $(B)/demo/telemetry.csv \
	        --plot $(B)/demo/dolly.png
	@echo; echo "The opening of the same move, in real time: the pan axis is a" \
	    "Modbus RTU servo behind a real pseudo-terminal."
	tests/again.sh $(SLEW) run --pty examples/modbus \
	        --telemetry $(B)/demo/modbus.csv

.PHONY: test
## install what is missing, build, run all tests; SAN=address,undefined too
test:
	@.ci/deps run test
	@$(MAKE) --no-print-directory $(ALL_CPUS) build check

.PHONY: deps
## install the Debian packages of .ci/packages, those for the checks too
deps:
	@.ci/deps

.PHONY: build
## compile the program, build/slew
build: $(SLEW)

.PHONY: vectors
## compile build/tests/vectors, which compares a file of reference values
vectors: $(VECTORS)

.PHONY: check
## run the tests, installing nothing; make check T=track for one
check: $(if $(T),$(foreach t,$(T),$(B)/tests/$(if \
    $(filter fuzz_%,$t),fuzz/$t,test_$t)),$(TESTS) $(FUZZ) $(SCRIPTS:%=$(SLEW)))
	@SLEW=$(SLEW) tests/run.sh $(B)/log $(filter $(B)/tests/%,$^) \
	      $(if $(T),,$(SCRIPTS))

.PHONY: all
# everything that is compiled with CC
all: $(SLEW) $(TESTS) $(FUZZ) $(VECTORS)

.PHONY: clean
## remove everything that was built
clean:
	rm -rf build

#---- how things are built

$(SLEW): $(MAIN:%.c=$(B)/%.o) $(B)/libslew.a
	$(call say,link,$@)
	$(Q)$(CC) $(OPT) $(LDFLAGS) $^ $(LDLIBS) -o $@

$(B)/tests/%: $(B)/tests/%.o $(B)/libtests.a $(B)/libslew.a
	$(call say,link,$@)
	$(Q)$(CC) $(OPT) $(LDFLAGS) $^ $(LDLIBS) $(CMOCKA) -o $@

$(B)/libslew.a: $(ROOMS:%.c=$(B)/%.o)
$(B)/libtests.a: $(TEST_LIB:%.c=$(B)/%.o)
$(B)/lib%.a:
	$(Q)rm -f $@; mkdir -p $(@D); $(AR) rcs $@ $^

$(B)/firmware/linux/%.o $(B)/tests/%.o $(B)/hal/%_libmodbus.o: \
    ALL_CFLAGS += $(PKG_INC)
$(B)/%.o: %.c Makefile
	$(call say,cc,$<)
	@mkdir -p $(@D)
	$(Q)$(CC) $(ALL_CFLAGS) -c $< -o $@

#---- checks; .ci/run runs them all

.PHONY: compilers
## build everything with gcc and with clang
compilers:
	$(MAKE) CC=gcc VARIANT=gcc all
	$(MAKE) CC=clang VARIANT=clang all

.PHONY: tidy clang-tidy cppcheck
## clang-tidy and cppcheck, nothing let through
tidy: clang-tidy cppcheck
# The analyzer follows so many states through a function; its own default of
# 225000 takes three times as long.
TIDY_STATES ?= 75000
clang-tidy:
	@mkdir -p build
	@printf '%s\n' $(SOURCES) | xargs -r -P "$$(nproc)" -I {} \
	    clang-tidy --quiet {} -- $(STD) $(WARN) -I. $(PKG_INC) \
	    -Xclang -analyzer-config -Xclang max-nodes=$(TIDY_STATES) \
	    2>build/tidy.log || { cat build/tidy.log; exit 1; }
# Style is clang-tidy's.  Right shifts of negative numbers are arithmetic with
# every compiler we use; version 2.10 overlooks compound literals and sees
# divisions by zero that the analyzer of clang-tidy proves away.
cppcheck:
	@$(if $(strip $(SOURCES)),cppcheck --quiet -j "$$(nproc)" -I. \
	    --error-exitcode=1 --std=c11 --inline-suppr \
	    --enable=warning$(comma)performance$(comma)portability \
	    --suppress=shiftTooManyBitsSigned --suppress=legacyUninitvar \
	    --suppress=zerodivcond $(SOURCES))

.PHONY: format
## reformat the sources
format:
	@clang-format -i $(LAID_OUT)

.PHONY: format-check
## fail where make format would change something
format-check:
	@clang-format --dry-run --Werror $(LAID_OUT)

.PHONY: arch
## who includes whom: only the arrows of docs/ARCHITECTURE.md
arch:
	@HOSTED="$(HOSTED)" tests/arch.sh

# What may run on the tick, compiled for a PC without floating-point registers
# and for two microcontrollers, where every division, float operation and
# library call is a symbol.  -fcallgraph-info writes who calls whom, and stack.
define rt_target
RT += $(PORTABLE:%.c=build/rt/$(1)/%.o)
build/rt/$(1)/%.o: %.c Makefile
	$$(call say,$(1),$$<)
	@mkdir -p $$(@D)
	$$(Q)$(2) $(STD) $(WARN) -O2 -I. -MMD -MP -ffreestanding \
	    -fcallgraph-info=su -c $$< -o $$@
endef
$(eval $(call rt_target,pc,gcc -mgeneral-regs-only))
$(eval $(call rt_target,m0,$(CROSS)gcc -mcpu=cortex-m0 -mthumb))
$(eval $(call rt_target,m4,$(CROSS)gcc -mcpu=cortex-m4 -mthumb))

.PHONY: rt
## prove the tick's objects: no division, float, heap, recursion; worst stack
rt:
	@$(MAKE) --no-print-directory $(ALL_CPUS) rt-objects
	@CROSS=$(CROSS) $(PYTHON) tests/rt.py $(PORTABLE)

.PHONY: rt-objects
# ccache keeps no call graphs.
rt-objects: export CCACHE_DISABLE := 1
rt-objects: $(RT)

.PHONY: cover
## line coverage of the tests, room by room
cover:
	@find build/cover -name '*.gcda' -delete 2>/dev/null || true
	@$(MAKE) --no-print-directory CC=gcc VARIANT=cover OPT='-O0 --coverage' \
	    check
	@gcovr -r . build/cover --exclude tests/ --csv -o build/cover/lines.csv
	@awk -F, 'NR>1&&$$2{room=$$1;sub("/[^/]*$$","",room);all[room]+=$$2;hit[room]+=$$3} \
	    END{for(r in all)printf "%-16s %6d of %6d lines  %5.1f %%\n", \
	    r,hit[r],all[r],100*hit[r]/all[r]}' build/cover/lines.csv | sort

.PHONY: gallery
## draw docs/GALLERY.md anew: every kind of curve on the same keys
gallery: $(SLEW)
	$(SLEW) gallery --out docs/GALLERY.md examples/gallery

HOLDS    ?= 40
.PHONY: hold
## hold and resume the demo at HOLDS random times: same path, inside limits
hold: $(SLEW)
	@$(PYTHON) tests/hold.py $(SLEW) examples/dolly $(HOLDS)

PEERS    := build/peers
.PHONY: peers-blender
## install Blender as a Python module (400 MB), compare random actions with it
peers-blender: $(SLEW)
	@test -x $(PEERS)/blender/bin/python || \
	    $(PYTHON) -m venv $(PEERS)/blender
	@$(PEERS)/blender/bin/pip install --quiet bpy==5.0.1
	@$(PEERS)/blender/bin/python tests/peers_blender.py $(SLEW)

.PHONY: picture
# draw the picture of the README anew
picture: demo
	cp $(B)/demo/dolly.png docs/dolly.png

.PHONY: schema
## the examples and register maps against docs/schema
schema:
	@$(PYTHON) tests/check_schema.py

.PHONY: fresh
## as root: make demo and make test in a Debian 12 with only git and make
fresh:
	tests/fresh.sh

# Also: bench-tick, golden (tests/qemu/qemu.mk).
-include tests/qemu/qemu.mk
# Also: test-vm, test-gpiod2.
-include tests/vm/vm.mk tests/vm/gpiod2.mk
# Also: bench-plan, bench-otg, bench-curves, peers-curves, bake-bounds.
-include tests/bench/bench.mk
# Also: test-peers.
-include tests/peers/peers.mk
# Also: stateful, soak.
-include tests/stateful.mk
# Also: fuzz.
-include tests/fuzz/fuzz.mk

.SECONDARY:
-include $(shell find build -name '*.d' 2>/dev/null)
