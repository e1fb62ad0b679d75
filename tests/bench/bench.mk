# tests/bench/bench.mk - what planning costs: on microcontrollers, counted in
# QEMU (variables of tests/qemu/qemu.mk), and on this machine beside Ruckig and
# SciPy.

BENCH      := build/bench
BENCH_OPT  ?= -Os
# Bytes that the planner may have on a Cortex-M4.
CODE       ?= 24576
BENCH_IMAGE := tests/bench/plan_image.c tests/bench/otg_random.c
# A nanosecond per instruction where the counter counts those.
BENCH_ICOUNT_m4 := -icount shift=6,sleep=off
BENCH_ICOUNT_m0 := $(BENCH_ICOUNT_m4)
BENCH_ICOUNT_rv32 := -icount shift=0,sleep=off
BENCH_START_m4 := tests/qemu/start_arm.c
BENCH_START_m0 := $(BENCH_START_m4)
BENCH_START_rv32 := tests/qemu/start_riscv.c

# Objects for their size and stack, and the image made of them.
define bench_image
$(BENCH)/$(1)/%.o: %.c Makefile tests/bench/bench.mk
	@mkdir -p $$(@D)
	$$(Q)$(QEMU_CC_$(1)) $(STD) $(WARN) $(BENCH_OPT) -I. -MMD -MP \
	    -ffreestanding -fno-tree-loop-distribute-patterns \
	    -fcallgraph-info=su -c $$< -o $$@
$(BENCH)/plan-$(1).elf: $(foreach c,$(MOTION) $(BENCH_IMAGE) \
    $(BENCH_START_$(1)) tests/qemu/start.c,$(BENCH)/$(1)/$(c:.c=.o))
	$$(call say,image,$$@)
	$$(Q)$(QEMU_CC_$(1)) -nostdlib $$^ \
	    $(filter-out %.c,$(QEMU_LD_$(1))) -o $$@
$(BENCH)/plan-$(1).txt: $(BENCH)/plan-$(1).elf
	@timeout 120 $(QEMU_$(1)) $(QEMU_RUN) $(BENCH_ICOUNT_$(1)) -kernel $$< \
	    </dev/null >$$@.part || { cat $$@.part; exit 1; }
	@mv $$@.part $$@
endef
$(foreach p,m4 m0 rv32,$(eval $(call bench_image,$(p))))

.PHONY: bench-plan
# ccache keeps no call graphs.
bench-plan: export CCACHE_DISABLE := 1
## instructions, code, stack of a plan on Cortex-M4, M0, RV32, and limits (CODE=)
bench-plan: $(foreach p,m4 m0 rv32,$(BENCH)/plan-$(p).txt)
	@CODE=$(CODE) CROSS=$(CROSS) RV=$(RV) $(PYTHON) tests/bench/plan.py $(BENCH) $(MOTION)

#---- what curves cost; the image is one of tests/qemu/qemu.mk

QEMU_ROOM_cost_m4   := -Wl,--defsym=image_ram=4M
QEMU_ROOM_cost_rv64 := -Wl,--defsym=image_ram=100M
$(QEMU_DIR)/rv64/tests/bench/curves_image.o: \
    QEMU_BARE += -DKEYS_MOST=100000 -DKEYS_SINE=1000
$(QEMU_DIR)/cost-%.txt: $(QEMU_DIR)/cost-%.elf
	@timeout 300 $(QEMU_$*) $(QEMU_RUN) -icount shift=0,sleep=off \
	    -kernel $< </dev/null >$@.part || { cat $@.part; exit 1; }
	@mv $@.part $@

.PHONY: bench-curves
## instructions per key to plan, per tick to play: linear, and constant
bench-curves: $(QEMU_DIR)/cost-m4.txt $(QEMU_DIR)/cost-rv64.txt
	@$(PYTHON) tests/bench/curves.py Cortex-M4=$(QEMU_DIR)/cost-m4.txt \
	    RV64=$(QEMU_DIR)/cost-rv64.txt

#---- what planning with curves costs on a PC

.PHONY: bench-bake
## a path with a camera, a bezier span: ms, and instructions within what is asked
bench-bake: $(SLEW)
	@$(PYTHON) tests/bench/bake.py $(SLEW) $(BENCH)/bake

#---- virtual time

.PHONY: bench-sim
## how many times faster than the clock virtual time is; instructions per axis
bench-sim: $(SLEW)
	@$(PYTHON) tests/bench/sim.py $(SLEW) $(BENCH)/sim

#---- beside Ruckig: its source distribution from PyPI, the same flags

PIP        ?= pip3
RUCKIG     ?= ruckig==0.19.4
RUCKIG_DIR := $(BENCH)/ruckig
BENCH_CXX  := g++ -std=c++20 -O2
BENCH_SIDE := $(foreach c,otg_beside otg_random,$(BENCH)/pc/tests/bench/$(c).o) \
              $(BENCH)/pc/firmware/host/exchange/otg_rows.o \
              $(BENCH)/pc/firmware/host/exchange/otg_scale.o \
              $(MOTION:%.c=$(BENCH)/pc/%.o)

$(BENCH)/pc/%.o: %.c Makefile tests/bench/bench.mk
	@mkdir -p $(@D)
	$(Q)gcc $(STD) $(WARN) -O2 -I. -MMD -MP -c $< -o $@

$(RUCKIG_DIR)/unpacked: tests/bench/bench.mk
	$(call say,pip,$(RUCKIG))
	@rm -rf $(RUCKIG_DIR); mkdir -p $(RUCKIG_DIR)
	$(Q)timeout 120 $(PIP) download --quiet --disable-pip-version-check \
	    --no-deps --no-binary :all: --dest $(RUCKIG_DIR) $(RUCKIG)
	@tar -xzf $(RUCKIG_DIR)/*.tar.gz -C $(RUCKIG_DIR) --strip-components=1
	@touch $@

# Without the client that asks a server.
$(RUCKIG_DIR)/libruckig.a: $(RUCKIG_DIR)/unpacked
	$(call say,c++,$@)
	@cd $(RUCKIG_DIR) && rm -f *.o && \
	    ls src/ruckig/*.cpp | grep -v cloud_client | \
	    xargs -P "$$(nproc)" -n 1 $(BENCH_CXX) -Iinclude -c && \
	    ar rcs libruckig.a *.o

$(BENCH)/otg-beside: tests/bench/ruckig_side.cpp tests/bench/ruckig_side.h \
    $(BENCH_SIDE) $(RUCKIG_DIR)/libruckig.a
	$(call say,link,$@)
	$(Q)$(BENCH_CXX) -Wall -Wextra -Werror -I. -isystem $(RUCKIG_DIR)/include \
	    $< $(BENCH_SIDE) $(RUCKIG_DIR)/libruckig.a -lm -o $@

.PHONY: bench-otg
## planning, sampling beside Ruckig (from PyPI); ROWS=directory of CSV too
bench-otg: $(BENCH)/otg-beside
	@timeout 180 $< $(ROWS)

#---- a great many problems, judged

MANY_SRC  := tests/bench/otg_many.c $(filter %/big.c %/big_poly.c $(wildcard tests/motion/otg/otg_*.c),$(TEST_LIB))
N         ?= 200000
SEED      ?= 1
FIRST     ?= 0
PROCESSES ?= 1
MISSED    ?= 0
BAD       ?= 0
LONG      ?= 0

$(B)/otg-many: $(MANY_SRC:%.c=$(B)/%.o) $(B)/libslew.a
	$(call say,link,$@)
	$(Q)$(CC) $(OPT) $(LDFLAGS) $^ -lm -o $@

.PHONY: otg-many
## N=10000000 random problems planned and judged exactly; SEED, PROCESSES, SAN
otg-many: $(B)/otg-many
	@$< -n $(N) -s $(SEED) -f $(FIRST) -j $(PROCESSES) \
	    -m $(MISSED) -b $(BAD) -l $(LONG)

#---- beside SciPy, from PyPI

SCIPY      ?= scipy==1.17.1
PEERS      := build/peers
PEER_CASES ?= 100

$(PEERS)/installed: tests/bench/bench.mk
	$(call say,pip,$(SCIPY))
	@rm -rf $(PEERS)/site; mkdir -p $(PEERS)/cases
	$(Q)timeout 300 $(PIP) install --quiet --disable-pip-version-check \
	    --target $(PEERS)/site $(SCIPY)
	@touch $@

.PHONY: peers-curves
## random splines, rotations, arc lengths beside SciPy (from PyPI); PEER_CASES=N
peers-curves: $(VECTORS) $(PEERS)/installed
	@PYTHONPATH=$(PEERS)/site $(PYTHON) tests/peers/curves_scipy.py $(VECTORS) \
	    $(PEERS)/cases $(PEER_CASES)

.PHONY: peers-orient
## random heads that turn through keyed orientations beside SciPy; PEER_CASES=N
peers-orient: $(SLEW) $(PEERS)/installed
	@PYTHONPATH=$(PEERS)/site $(PYTHON) tests/peers/orient_scipy.py $(SLEW) \
	    $(PEER_CASES)

#---- beside toppra, from PyPI

TOPPRA     ?= toppra==0.6.10
TOPPRA_DIR := $(BENCH)/toppra
TOPP_SIDE  := $(patsubst %.c,$(BENCH)/pc/%.o,tests/bench/topp_beside.c \
              $(MOTION) $(call sources,motion/double motion/plan))

$(TOPPRA_DIR)/installed: tests/bench/bench.mk
	$(call say,pip,$(TOPPRA))
	@rm -rf $(TOPPRA_DIR); mkdir -p $(TOPPRA_DIR)
	$(Q)timeout 600 $(PIP) install --quiet --disable-pip-version-check \
	    --target $(TOPPRA_DIR)/site $(TOPPRA)
	@touch $@

$(BENCH)/topp-beside: $(TOPP_SIDE)
	$(call say,link,$@)
	$(Q)gcc $^ -lm -o $@

.PHONY: bench-topp
## timing a path beside toppra (from PyPI): its time, and growth with intervals
bench-topp: $(BENCH)/topp-beside $(TOPPRA_DIR)/installed
	@PYTHONPATH=$(TOPPRA_DIR)/site $(PYTHON) tests/bench/topp_beside.py $<

.PHONY: bake-bounds
## what baking promises against what is seen, at a million times each
bake-bounds: $(call named,bake_bounds) $(call named,speed_law)
	@SLEW_SAMPLES=1000000 $<
	@$(call named,speed_law)

#---- a service beside cyclictest

.PHONY: bench-latency
## wake-ups of slewd beside cyclictest; SECONDS_LONG=20 WINDOWS=6, 0: counts alone
bench-latency: $(SLEW) $(call named,loop)
	@$(PYTHON) tests/bench/latency.py $^ $(or $(SECONDS_LONG),20) $(or $(WINDOWS),6)

.PHONY: bench-stop
## how long a stop takes on this machine's clock, 64 clients; TRIES=1000
bench-stop: $(SLEW)
	@$(PYTHON) tests/bench/stop.py $< --tries $(or $(TRIES),1000)
