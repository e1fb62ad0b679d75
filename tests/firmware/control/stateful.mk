# tests/firmware/control/stateful.mk - the controller under random commands, judged tick by tick
# (tests/firmware/control/stateful.h).  make check runs some 200,000 ticks of it.

STATEFUL := $(call named,stateful)
SOAK     ?= 3600
RAMPS    ?= 50000

.PHONY: stateful
## N=1000000 ticks of random commands, mishaps and machines; SEED=n for one
stateful: $(STATEFUL)
	@TICKS=$(N) $<

.PHONY: ramps
## RAMPS=50000 random slow-downs: rises, times to rest, beside the shortest
ramps: $(call named,ramp)
	@EVERY=1 N=$(RAMPS) $<

.PHONY: soak
## the same for SOAK=3600 seconds, from another seed every time; FIRST=n
soak: $(STATEFUL)
	@TICKS=0 TIME=$(SOAK) $(if $(filter-out 0,$(FIRST)),,FIRST=$$(date +%s)) $<
