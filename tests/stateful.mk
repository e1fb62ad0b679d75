# tests/stateful.mk - the controller under random commands, judged tick by tick
# (tests/stateful.h).  make check runs some 200,000 ticks of it.

STATEFUL := $(B)/tests/test_stateful
SOAK     ?= 3600

.PHONY: stateful
## N=1000000 ticks of random commands, mishaps and machines; SEED=n for one
stateful: $(STATEFUL)
	@TICKS=$(N) $<

.PHONY: soak
## the same for SOAK=3600 seconds, from another seed every time; FIRST=n
soak: $(STATEFUL)
	@TICKS=0 TIME=$(SOAK) $(if $(filter-out 0,$(FIRST)),,FIRST=$$(date +%s)) $<
