# tests/peers/peers.mk - other people's programs must understand ours, and we
# them.  One script per peer: tests/peers/NAME.sh or NAME.py, run with
# SLEW (the program), PEERS (a directory for what is built and the virtual
# environment) in the environment; it says what it saw, status 0 when all agreed.

PEERS       := $(B)/peers
PEER_CHECKS := $(sort $(wildcard tests/peers/peer_*))
# What of ours they talk to.
PEER_PROGRAMS := $(patsubst tests/peers/%.c,$(PEERS)/%,$(wildcard tests/peers/*.c))
# What they say of themselves: those that read no clock run beside each other, the long
# ones first; the others alone.
PEER_LONG   := $(shell grep -lF 'Takes long.' $(PEER_CHECKS))
PEER_BESIDE := $(PEER_LONG) $(filter-out $(PEER_LONG),\
                 $(shell grep -lF 'Reads no clock.' $(PEER_CHECKS)))

$(PEERS)/venv/done: tests/peers/requirements.txt
	$(Q)rm -rf $(PEERS)/venv
	$(Q)$(PYTHON) -m venv $(PEERS)/venv
	$(Q)$(PEERS)/venv/bin/pip -q --disable-pip-version-check install -r $<
	$(Q)touch $@

$(PEER_PROGRAMS): $(PEERS)/%: $(B)/tests/peers/%.o \
                                 $(LIBS)
	$(call say,link,$@)
	$(Q)mkdir -p $(@D)
	$(Q)$(CC) $(OPT) $(LDFLAGS) $^ $(LDLIBS) -o $@

.PHONY: peers-space
## cameras of the examples, placed by matrices in Python: is the subject seen
peers-space: $(SLEW)
	@$(PYTHON) tests/peers/space.py $(SLEW)

.PHONY: peers-physics
## spheres against boxes, folded cloths: beside formulae in Python
peers-physics: $(VECTORS)
	@mkdir -p $(PEERS)
	@$(PYTHON) tests/peers/physics_vectors.py >$(PEERS)/physics.json
	@$(VECTORS) $(PEERS)/physics.json

.PHONY: test-peers $(PEER_CHECKS:%=run-%)
## other people's masters, drives, readers and simulators against ours
test-peers: build $(SLEW) $(PEER_PROGRAMS) \
    $(PEERS)/venv/done
	@bad=0; \
	$(MAKE) --no-print-directory -k --output-sync=target $(ALL_CPUS) \
	    $(PEER_BESIDE:%=run-%) || bad=1; \
	$(MAKE) --no-print-directory -k -j1 \
	    $(patsubst %,run-%,$(filter-out $(PEER_BESIDE),$(PEER_CHECKS))) || bad=1; \
	exit $$bad

$(PEER_CHECKS:%=run-%): run-%:
	@echo "$(notdir $*):"
	@SLEW=$(SLEW) PEERS=$(PEERS) PYTHONDONTWRITEBYTECODE=1 timeout 600 \
	    $(if $(filter %.py,$*),$(PEERS)/venv/bin/python,sh) $* || \
	    { echo "$(notdir $*): FAILED"; exit 1; }
