# tests/peers/peers.mk - other people's programs must understand ours, and we
# them.  One script per peer: tests/peers/NAME.sh or NAME.py, run with
# SLEW (the program), PEERS (a directory for what is built and the virtual
# environment) in the environment; it says what it saw, status 0 when all agreed.

PEERS       := $(B)/peers
PEER_CHECKS := $(sort $(wildcard tests/peers/peer_*))
# What of ours they talk to.
PEER_PROGRAMS := $(patsubst tests/peers/%.c,$(PEERS)/%,$(wildcard tests/peers/*.c))
# Without the real clock: these two run beside each other, the others alone.
PEER_BESIDE := $(filter tests/peers/peer_canopen.sh tests/peers/peer_otg.py,\
                 $(PEER_CHECKS))

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

.PHONY: test-peers
## other people's masters, drives, readers and simulators against ours
test-peers: build $(SLEW) $(PEER_PROGRAMS) \
    $(PEERS)/venv/done
	@bad=0; one() { \
	    echo "$$(basename $$1):"; \
	    case $$1 in \
	    *.py) run=$(PEERS)/venv/bin/python ;; \
	    *) run=sh ;; \
	    esac; \
	    SLEW=$(SLEW) PEERS=$(PEERS) PYTHONDONTWRITEBYTECODE=1 \
	        timeout 600 $$run $$1; \
	}; \
	for check in $(PEER_BESIDE); do \
	    log=$(PEERS)/$$(basename $$check).log; \
	    (one $$check >$$log 2>&1; echo $$? >$$log.status) & \
	done; wait; \
	for check in $(PEER_BESIDE); do \
	    log=$(PEERS)/$$(basename $$check).log; cat $$log; \
	    [ "$$(cat $$log.status)" = 0 ] || \
	        { echo "$$(basename $$check): FAILED"; bad=1; }; \
	done; \
	for check in $(filter-out $(PEER_BESIDE),$(PEER_CHECKS)); do \
	    one $$check || { echo "$$(basename $$check): FAILED"; bad=1; }; \
	done; exit $$bad
