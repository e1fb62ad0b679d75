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
# A stack in a report needs lines alone.  Sweeps over arithmetic have a quarter of their
# cases here, all in make nightly: check_cases of tests/support/check.h.
CFLAGS   ?= -g1
endif
# Half the time of a link is ld's.  What is for a user is linked by it all the same.
LLD      := $(if $(shell command -v ld.lld),-fuse-ld=lld)
LDFLAGS  += $(if $(SAN),$(if $(findstring clang,$(CC)),$(LLD)))

# Of the libraries; asked when used, so that `make deps` can come first.
PKGS      = yaml-0.1 libcjson cairo fontconfig expat libmodbus libgpiod zlib libpng libzip \
            libwebsockets ltc
PKG_INC   = $(patsubst -I%,-isystem %,$(shell pkg-config --cflags $(PKGS)))
PKG_LIB   = $(shell pkg-config --libs $(PKGS))
CMOCKA    = $(shell pkg-config --libs cmocka)

WARN     := -Wall -Wextra -Wconversion -Wshadow -Wstrict-prototypes -Werror
STD      := -std=c11 -D_POSIX_C_SOURCE=200809L
CFLAGS   ?= -g
ALL_CFLAGS = $(STD) $(WARN) $(OPT) $(CFLAGS) -I. -MMD -MP
LDLIBS    = $(PKG_LIB) -lm -lpthread

# Rooms, from whatever .c files stand there.  PORTABLE also runs on a
# microcontroller: all of hal/ but hal/linux, all of motion/ but what is in double.
sources   = $(sort $(shell find $(1) -name '*.c'))
MAIN     := firmware/linux/main.c
MOTION   := $(filter-out motion/plan/% motion/double/%,$(call sources,motion))
PORTABLE := $(MOTION) $(filter-out hal/linux/%,$(call sources,hal)) \
            $(call sources,firmware/control)
# Of a board only what needs none; firmware/fmu is a program of its own.
ROOMS    := $(filter-out $(MAIN) firmware/mcu/board/% firmware/fmu/% \
              firmware/studio/wasm/module.c,\
              $(call sources,motion hal sim firmware)) \
            firmware/mcu/board/port.c
# libslew: what another program may link; the rest of slew is the program's.
LIBRARY  := $(PORTABLE) $(call sources,motion/double motion/plan)
PROGRAM  := $(filter-out $(LIBRARY),$(ROOMS))
# Programs of their own: images, peers, fuzz targets, what is run beside a peer.
TEST_OWN := $(call sources,tests/bench tests/fuzz tests/peers tests/qemu)
TEST_ALL := $(filter-out $(TEST_OWN),$(call sources,tests))
TEST_SRC := $(foreach t,$(TEST_ALL),$(if $(filter test_%,$(notdir $t)),$t))
TEST_LIB := $(filter-out $(TEST_SRC),$(TEST_ALL))
SOURCES  := $(ROOMS) $(MAIN) $(wildcard firmware/fmu/*.c) $(TEST_ALL) \
            $(call sources,tests/peers tests/fuzz)
# What is compiled for a bare machine or beside a peer is laid out like the rest.
LAID_OUT := $(sort $(shell find motion hal sim firmware tests examples \
              -name '*.[ch]'))

# named NAME: the program of a test by the last part of its name.
named     = $(or $(filter %/test_$(1) %/$(1),$(TESTS) $(FUZZ)),\
              $(error there is no test $(1)))

SLEW     := $(B)/slew
LIBS     := $(B)/libprogram.a $(B)/libslew.a
TESTS    := $(TEST_SRC:%.c=$(B)/%)
FUZZ     := $(patsubst %.c,$(B)/%,$(wildcard tests/fuzz/fuzz_*.c))
VECTORS  := $(B)/tests/vectors
SCRIPTS  := $(wildcard tests/firmware/linux/*.sh)
ifneq ($(SAN),)
# Those that say so run without sanitizers, and with them in make nightly.
SCRIPTS  := $(if $(EVERY),$(SCRIPTS),$(shell \
              grep -L 'Gains nothing from sanitizers.' $(SCRIPTS)))
endif

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
	tests/support/again.sh $(SLEW) run --pty examples/modbus \
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
build: $(SLEW) $(B)/slewd

.PHONY: vectors
## compile build/tests/vectors, which compares a file of reference values
vectors: $(VECTORS)

.PHONY: check
## run the tests, installing nothing; make check T=track for one
check: $(if $(T),$(foreach t,$(T),$(call named,$t)),\
    $(TESTS) $(FUZZ) $(SCRIPTS:%=$(SLEW)))
	@SLEW=$(SLEW) tests/support/run.sh $(B)/log $(filter $(B)/tests/%,$^) \
	      $(if $(T),,$(SCRIPTS))

.PHONY: wrong
## where the answers to wrong input are not those of tests/wrong, as a diff
wrong: $(call named,wrong)
	@mkdir -p $(B)/wrong
	@WRONG_TO=$(abspath $(B)/wrong) $< >$(B)/wrong.log 2>&1 || true
	@diff -ru --exclude=base tests/wrong $(B)/wrong

.PHONY: all
# everything that is compiled with CC
all: $(SLEW) $(TESTS) $(FUZZ) $(VECTORS)

.PHONY: clean
## remove everything that was built
clean:
	rm -rf build

#---- how things are built

$(SLEW): $(MAIN:%.c=$(B)/%.o) $(LIBS)
	$(call say,link,$@)
	$(Q)$(CC) $(OPT) $(LDFLAGS) $^ $(LDLIBS) -o $@

# The service under a name of its own.
$(B)/slewd: $(SLEW)
	@ln -sf slew $@

$(B)/tests/%: $(B)/tests/%.o $(B)/libtests.a $(LIBS)
	$(call say,link,$@)
	$(Q)$(CC) $(OPT) $(LDFLAGS) $(LLD) $^ $(LDLIBS) $(CMOCKA) -o $@

$(VECTORS): $(B)/tests/motion/vectors.o $(B)/libtests.a $(LIBS)
	$(call say,link,$@)
	$(Q)$(CC) $(OPT) $(LDFLAGS) $^ $(LDLIBS) $(CMOCKA) -o $@

$(B)/libslew.a: $(LIBRARY:%.c=$(B)/%.o)
$(B)/libprogram.a: $(PROGRAM:%.c=$(B)/%.o) $(B)/own.o $(B)/page.o \
    $(B)/example.o
$(B)/libtests.a: $(TEST_LIB:%.c=$(B)/%.o)
$(B)/lib%.a:
	$(Q)rm -f $@; mkdir -p $(@D); $(AR) qcs $@ $^

$(B)/firmware/host/%.o $(B)/firmware/linux/%.o $(B)/firmware/studio/%.o \
    $(B)/hal/linux/%.o $(B)/tests/%.o: ALL_CFLAGS += $(PKG_INC)
# Plants and plans in double: the same bits with every compiler, so no
# multiply-add that only some machines have.
$(B)/sim/%.o $(B)/motion/double/%.o $(B)/motion/plan/%.o $(B)/firmware/host/%.o \
    $(B)/firmware/linux/batch/%.o: ALL_CFLAGS += -ffp-contract=off
# Position-independent, so that one set of objects serves the program and
# libslew.so; none of our functions is there to be replaced by another's, so a
# file may inline its own.
$(B)/%.o: %.c Makefile
	$(call say,cc,$<)
	@mkdir -p $(@D)
	$(Q)$(CC) $(ALL_CFLAGS) -fPIC -fno-semantic-interposition -c $< -o $@

#---- checks; .ci/run runs them all

.PHONY: compilers
## build everything with gcc and with clang
compilers:
	$(MAKE) CC=gcc VARIANT=gcc all
	$(MAKE) CC=clang VARIANT=clang all

SAME     ?= gcc-O0 gcc-O2 gcc-O3 clang-O0 clang-O2 clang-O3
.PHONY: same-bytes
## the same telemetry with every compiler and optimisation (SAME=), and run
same-bytes:
	@for same in $(SAME); do \
	    $(MAKE) --no-print-directory CC=$${same%-*} OPT=-$${same#*-} \
	        VARIANT=same/$$same WARN= build/same/$$same/slew || exit 1; done
	@tests/proofs/same_bytes.sh build/same/runs $(SAME:%=build/same/%/slew)

# Plans, files and simulations; pictures may differ in a last digit.
LIBM_OF  = $(filter-out firmware/host/plot/%,$(filter motion/% sim/% firmware/host/%,\
              $(ROOMS)) $(call sources,firmware/linux/batch firmware/linux/fmu))
.PHONY: libm
## what of libm plans and simulations call: only what is rounded exactly
libm: $(LIBS)
	@tests/proofs/libm.sh "$$($(CC) -print-file-name=libm.so.6)" $(LIBM_OF:%.c=$(B)/%.o)

.PHONY: tidy clang-tidy cppcheck
## clang-tidy and cppcheck, nothing let through
tidy: clang-tidy cppcheck
# The analyzer follows so many states through a function; its own default of
# 225000 takes three times as long.  Nine tenths of the time are its, so that it
# follows tests only when told: TIDY_TESTS= as make nightly does.
TIDY_STATES ?= 75000
TIDY_TESTS  ?= --checks=-clang-analyzer-*
tidy_files   = printf '%s\n' $(1) | xargs -r -P "$$(nproc)" -I {} \
    clang-tidy --quiet $(2) {} -- $(STD) $(WARN) -I. $(PKG_INC) \
    -Xclang -analyzer-config -Xclang max-nodes=$(TIDY_STATES) \
    2>build/tidy.log || { cat build/tidy.log; exit 1; }
clang-tidy:
	@mkdir -p build
	@$(call tidy_files,$(filter-out tests/%,$(SOURCES)))
	@$(call tidy_files,$(filter tests/%,$(SOURCES)),\
	    $(if $(TIDY_TESTS),'$(TIDY_TESTS)'))
# Style is clang-tidy's.  Right shifts of negative numbers are arithmetic with
# every compiler we use; version 2.10 overlooks compound literals and sees
# divisions by zero that the analyzer of clang-tidy proves away.
# It takes every combination of macros that a file tests, headers included, and most
# test the same ones of motion/core: all files as on this machine, and each way
# through an #if in those that have one, or stand beside a header that has.
CPPCHECK = cppcheck --quiet -j "$$(nproc)" -I. --error-exitcode=1 --std=c11 \
    --inline-suppr --enable=warning$(comma)performance$(comma)portability \
    --suppress=shiftTooManyBitsSigned --suppress=legacyUninitvar \
    --suppress=zerodivcond
HAVE_IF  = $(shell grep -rlE --include='*.[ch]' '^\# *if.*[^H]$$' motion hal sim \
    firmware tests)
EACH_WAY = $(filter $(addsuffix %,$(sort $(dir $(filter %.h,$(HAVE_IF))))) \
    $(filter %.c,$(HAVE_IF)),$(SOURCES))
cppcheck:
	@$(if $(strip $(SOURCES)),$(CPPCHECK) -D__SIZEOF_INT128__=16 -D__x86_64__=1 \
	    $(SOURCES))
	@$(if $(strip $(EACH_WAY)),$(CPPCHECK) $(EACH_WAY))

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
	@tests/proofs/arch.sh

# What may run on the tick, compiled for a PC without floating-point registers
# and for two microcontrollers, where every division, float operation and
# library call is a symbol.  -fcallgraph-info writes who calls whom, and stack.
# Of a board what its tick runs; the rest is between ticks.
RT_SRC := $(PORTABLE) $(addprefix firmware/mcu/,servos.c unit.c window.c)
# Images for these are made of the same objects (tests/qemu/qemu.mk,
# firmware/mcu/mcu.mk).  ccache keeps no call graphs.
define rt_target
RT += $(RT_SRC:%.c=build/rt/$(1)/%.o)
build/rt/$(1)/%.o: %.c Makefile
	$$(call say,$(1),$$<)
	@mkdir -p $$(@D)
	$$(Q)CCACHE_DISABLE=1 $(2) $(STD) $(WARN) -O2 -I. -MMD -MP \
	    -ffreestanding -fno-tree-loop-distribute-patterns \
	    -ffunction-sections -fcallgraph-info=su -c $$< -o $$@
endef
$(eval $(call rt_target,pc,gcc -mgeneral-regs-only -fno-pie))
$(eval $(call rt_target,m0,$(CROSS)gcc -mcpu=cortex-m0 -mthumb))
$(eval $(call rt_target,m4,$(CROSS)gcc -mcpu=cortex-m4 -mthumb))

.PHONY: rt
## prove the tick's objects: no division, float, heap, recursion; worst stack
rt:
	@$(MAKE) --no-print-directory $(ALL_CPUS) rt-objects
	@CROSS=$(CROSS) $(PYTHON) tests/proofs/rt.py $(RT_SRC)

.PHONY: rt-objects
rt-objects: $(RT)

# What runs in a browser: motion, host and the planner of the studio, and what
# these call of hal and firmware/control.  Plots are drawn by cairo.  clang finds the C library's
# headers; those of /usr/include are not this machine's.
WASM_SRC := $(LIBRARY) $(filter-out firmware/host/plot/% %/module.c,\
              $(call sources,firmware/host firmware/studio/wasm))
WASM     := $(WASM_SRC:%.c=build/wasm/%.o)
WASM_CC   = clang --target=wasm32-wasi -nostdlibinc -isystem \
            /usr/include/wasm32-wasi -isystem build/wasm/include
.PHONY: wasm-objects
## motion/ and firmware/host for a browser; prove that they open and print nothing
wasm-objects: wasm-headers
	@$(MAKE) --no-print-directory $(ALL_CPUS) $(WASM)
	@tests/proofs/wasm.sh $(WASM)
.PHONY: wasm-headers
wasm-headers:
	@mkdir -p build/wasm/include
	@for library in yaml-0.1:yaml.h libcjson:cjson; do \
	    ln -sfn "$$(pkg-config --variable=includedir $${library%:*})/$${library#*:}" \
	        build/wasm/include/ || exit 1; done
build/wasm/%.o: %.c Makefile
	$(call say,wasm,$<)
	@mkdir -p $(@D)
	$(Q)$(WASM_CC) $(STD) $(WARN) -O2 -ffp-contract=off -I. -MMD -MP -c $< \
	    -o $@

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
## hold and resume two examples at HOLDS random times: same path, inside limits
hold: $(SLEW)
	@for move in dolly gears; do $(PYTHON) tests/firmware/linux/hold.py $(SLEW) \
	    examples/$$move $(HOLDS) || exit 1; done

.PHONY: faults
## every fault a machine must survive: detection, reaction, worst time beside its bound
faults: $(SLEW)
	@$(PYTHON) tests/firmware/linux/faults.py $(SLEW)

.PHONY: fault-pairs
## N=200 random pairs of faults, the controller's invariants in every tick; FIRST=n
fault-pairs: $(SLEW)
	@$(PYTHON) -B tests/firmware/linux/fault_pairs.py $(SLEW) $(or $(N),200) \
	    $(or $(FIRST),0)

.PHONY: random-moves
## N=500 random moves: slew check and every format against a judge of its own
random-moves: $(SLEW)
	@$(PYTHON) tests/firmware/linux/random_moves.py $(SLEW) $(or $(N),500)

.PHONY: examples-back
## every example through every format and back: limits, and what a format cannot hold
examples-back: $(SLEW)
	@$(PYTHON) tests/firmware/linux/examples_back.py $(SLEW)

.PHONY: nightly
## what takes too long for every change: the same checks with larger numbers
nightly:
	@$(MAKE) corrupt CC=clang SAN=address,undefined CORRUPTIONS=100000
	@$(MAKE) hold HOLDS=400
	@N=10000 $(MAKE) check T="homing_random service_random"
	@TRIES=100000 TEST_TIMEOUT=7200 $(MAKE) check T=stop
	@N=1000000 TEST_TIMEOUT=7200 $(MAKE) check T=sim_particles_spheres
	@$(MAKE) peers-physics
	@$(MAKE) random-moves N=5000
	@$(MAKE) examples-back
	@$(MAKE) fault-pairs N=10000
	@$(MAKE) ramps
	@$(MAKE) stateful N=10000000
	@$(MAKE) clang-tidy TIDY_TESTS=
	@$(MAKE) test EVERY=1
	@$(MAKE) test CC=clang SAN=address,undefined EVERY=1
	@N=2000 TEST_TIMEOUT=7200 $(MAKE) check T=plan_path_random CC=clang SAN=address,undefined
	@$(MAKE) otg-many N=2000000 MISSED=60 BAD=0 LONG=9600 \
	    PROCESSES="$$(nproc)"
	@$(MAKE) fuzz FUZZ_SECONDS=120 FUZZ_SEED=0
	@$(MAKE) soak
	@$(MAKE) same-bytes

PEERS    := build/peers
.PHONY: peers-blender
## install Blender as a Python module (400 MB), compare random actions with it
peers-blender: $(SLEW)
	@test -x $(PEERS)/blender/bin/python || \
	    $(PYTHON) -m venv $(PEERS)/blender
	@$(PEERS)/blender/bin/pip install --quiet bpy==5.0.1
	@$(PEERS)/blender/bin/python tests/peers/fcurve_blender.py $(SLEW)

.PHONY: picture
# draw the pictures of the README and of docs/FILES.md anew
picture: demo
	cp $(B)/demo/dolly.png docs/dolly.png
	for move in tripod gears; do \
	    $(SLEW) plot --out docs/$$move.svg examples/$$move || exit 1; done
	for move in $(notdir $(wildcard docs/camera/*.svg)); do \
	    $(SLEW) plot --space --out docs/camera/$$move \
	        examples/$${move%.svg} || exit 1; done

.PHONY: schema
## the examples and register maps against docs/schema
schema:
	@$(PYTHON) tests/proofs/check_schema.py

.PHONY: fresh
## as root: make demo and make test in a Debian 12 with only git and make
fresh:
	tests/fresh.sh

# Also: library, symbols, install, uninstall.
-include firmware/library/library.mk
# Also: studio-vendor, vendor-check, test-page.
-include firmware/studio/page.mk
# What slew sim export needs.
-include firmware/fmu/fmu.mk
# Also: studio, test-studio.
-include firmware/studio/studio.mk
# Also: firmware, test-firmware.
-include firmware/mcu/mcu.mk
# Also: bench-tick, golden (tests/qemu/qemu.mk).
-include tests/qemu/qemu.mk
# Also: test-vm, test-gpiod2.
-include tests/vm/vm.mk tests/vm/gpiod2.mk
# Also: bench-plan, bench-otg, bench-curves, bench-bake, peers-curves,
# peers-orient, bake-bounds.
-include tests/bench/bench.mk
# Also: peers-space, peers-physics, test-peers.
-include tests/peers/peers.mk
# Also: stateful, soak.
-include tests/firmware/control/stateful.mk
# Also: fuzz.
-include tests/fuzz/fuzz.mk
# Also: dead.
-include tests/proofs/dead.mk

.PHONY: fetched
# what these take from others' servers
fetched: $(PEERS)/installed $(PEERS)/venv/done $(PAGE_NPM)/done \
    $(STUDIO)/source/done $(GPIOD2_DIR)/unpacked
	@tests/vm/boot.sh

.SECONDARY:
# FRESH=1: nothing changes while .ci/run goes from step to step, and what each make
# would read here takes it two seconds in the end.
ifndef FRESH
-include $(shell find build $(filter-out build build/%,$(B)) -name '*.d' 2>/dev/null)
endif
