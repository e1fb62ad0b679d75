# tests/fuzz/fuzz.mk - targets for every decoder, see tests/fuzz/fuzz.h.  make
# check replays the corpus (make check T=fuzz_rig for one of them); corpus.py
# makes it.

FUZZ_SECONDS ?= 5
FUZZ_SEED    ?= 1
FUZZ_MAIN    ?= $(B)/tests/fuzz/replay.o
FUZZ_FOUND   := build/fuzz/found

$(B)/libfuzz.a: $(patsubst %,$(B)/tests/fuzz/%.o,fuzz import port)
$(B)/tests/fuzz/fuzz_%: $(B)/tests/fuzz/fuzz_%.o $(FUZZ_MAIN) $(B)/libfuzz.a \
    $(LIBS)
	$(call say,link,$@)
	$(Q)$(CC) $(OPT) $(FUZZ_LINK) $(LDFLAGS) $(LLD) $^ $(LDLIBS) \
	    $(if $(FUZZ_MAIN),$(CMOCKA)) -o $@

# Rooms from which no decoder has anything are not compiled for them; a target that
# comes to need one does not link.
FUZZ_WITHOUT := $(addprefix firmware/,linux/commands/% linux/batch/% linux/fmu/% \
    linux/tools/% host/plot/% host/fault/% studio/%) sim/identify/%

.PHONY: fuzz fuzz-run
## fuzz every decoder for FUZZ_SECONDS=5 each; F=rig for one, FUZZ_SEED=0: anew
fuzz:
	@$(MAKE) --no-print-directory CC=clang VARIANT=fuzz FUZZ_MAIN= \
	    PROGRAM='$(filter-out $(FUZZ_WITHOUT),$(PROGRAM))' \
	    FUZZ_LINK=-fsanitize=fuzzer CFLAGS=-g1 OPT="-O1 -fno-omit-frame-pointer \
	    -fsanitize=fuzzer-no-link,address,undefined \
	    -fno-sanitize-recover=all" fuzz-run

# What makes one fail is left in $(FUZZ_FOUND), and added to the corpus once it
# is mended.
fuzz-run: $(if $(F),$(F:%=$(B)/tests/fuzz/fuzz_%),$(FUZZ))
	@printf '%s\n' $^ | xargs -P "$$(nproc)" -I {} sh -c ' \
	    target={} name=$${target##*/fuzz_} bad=0; \
	    mkdir -p $(FUZZ_FOUND) build/fuzz/corpus/$$name; \
	    $$target -seed=$(FUZZ_SEED) -max_total_time=$(FUZZ_SECONDS) -max_len=4096 -timeout=10 \
	        -rss_limit_mb=2048 -artifact_prefix=$(FUZZ_FOUND)/$$name- \
	        build/fuzz/corpus/$$name tests/fuzz/corpus/$$name \
	        >build/fuzz/$$name.log 2>&1 || { bad=1; cat build/fuzz/$$name.log; }; \
	    printf "  fuzz   %-16s %s\n" $$name "$$(tail -n 1 build/fuzz/$$name.log)"; \
	    exit $$bad'

# Tests whose number of corrupted answers CORRUPTIONS says; they run some thousand in
# make check.
CORRUPT_TESTS := $(filter %_corrupt,$(TESTS))
.PHONY: corrupt
## corrupt CORRUPTIONS=100000 answers of every protocol; SAN=address,undefined too
corrupt: CORRUPTIONS ?= 100000
corrupt: $(CORRUPT_TESTS)
	@CORRUPTIONS=$(CORRUPTIONS) TEST_TIMEOUT=550 tests/support/run.sh $(B)/log $^
	@sed -n 's/^/  /; /corrupted/p' $(patsubst %,$(B)/log/%.log,$(notdir $(CORRUPT_TESTS)))
