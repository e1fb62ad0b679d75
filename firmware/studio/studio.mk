# firmware/studio/studio.mk - the planner for a browser, and the page.

STUDIO      := build/studio
STUDIO_MOVES ?= 200
STUDIO_OWN  := $(wildcard hal/maps/*.yaml hal/quirks/*.yaml)
STUDIO_WASM := $(WASM) build/wasm/firmware/studio/wasm/module.o \
               build/wasm/own.o
# cJSON and the half of libyaml that reads, of Debian's sources.
STUDIO_LIBRARY := $(addprefix build/wasm/library/,api.o reader.o scanner.o \
                 parser.o cJSON.o)

.PHONY: studio
## install what is missing, build slew with the studio's planner in it
studio:
	@.ci/deps run studio
	@$(MAKE) --no-print-directory $(STUDIO)/source/done
	@$(MAKE) --no-print-directory wasm-headers
	@$(MAKE) --no-print-directory $(ALL_CPUS) $(STUDIO)/planner.wasm
	@mkdir -p $(STUDIO)/built
	@cmp -s $(STUDIO)/planner.wasm $(STUDIO)/built/planner.wasm || \
	    cp $(STUDIO)/planner.wasm $(STUDIO)/built
	@$(MAKE) --no-print-directory $(ALL_CPUS) build

$(STUDIO)/source/done:
	@firmware/studio/wasm/sources.sh $(@D)

# Output to a file of this shell's own, and that to the target: builds of one tree
# with other flags beside each other write the same one, each whole.
STUDIO_WHOLE = >$@.$$$$ && mv $@.$$$$ $@ || { rm -f $@.$$$$; exit 1; }
$(STUDIO)/own.c: firmware/studio/embed.sh $(STUDIO_OWN)
	@mkdir -p $(@D)
	$(Q)$< embedded_own cat $(foreach f,$(STUDIO_OWN),$f=$f) $(STUDIO_WHOLE)
build/wasm/own.o: $(STUDIO)/own.c
	$(Q)$(WASM_CC) $(STD) -O2 -I. -c $< -o $@
# The page, and the planner once it was built: make build needs no clang.
STUDIO_PAGE := $(shell find firmware/studio/web -type f | LC_ALL=C sort)
# Its copy has no rule, so that nothing is compiled for a browser on the way.
STUDIO_BUILT := $(wildcard $(STUDIO)/built/planner.wasm)
$(STUDIO)/page.c: firmware/studio/embed.sh $(STUDIO_PAGE) $(STUDIO_BUILT) \
    firmware/studio/wasm/planner.mjs
	$(call say,embed,$@)
	@mkdir -p $(@D)
	$(Q)$< embedded_page 'gzip -n9' \
	    $(foreach f,$(STUDIO_PAGE),/$(f:firmware/studio/web/%=%)=$f) \
	    /planner.mjs=firmware/studio/wasm/planner.mjs \
	    $(STUDIO_BUILT:%=/planner.wasm=%) $(STUDIO_WHOLE)
# What slew studio opens where no rig is named.
$(STUDIO)/example.c: firmware/studio/embed.sh examples/dolly/rig.yaml \
    examples/dolly/move.yaml
	@mkdir -p $(@D)
	$(Q)$< embedded_example cat rig.yaml=examples/dolly/rig.yaml \
	    move.yaml=examples/dolly/move.yaml $(STUDIO_WHOLE)
$(B)/own.o $(B)/page.o $(B)/example.o: $(B)/%.o: $(STUDIO)/%.c
	$(Q)mkdir -p $(@D); $(CC) $(ALL_CFLAGS) -fPIC -c $< -o $@

build/wasm/library/%.o: $(STUDIO)/source/libyaml/src/%.c
	$(call say,wasm,$<)
	@mkdir -p $(@D)
	$(Q)$(WASM_CC) -O2 -w -DYAML_VERSION_MAJOR=0 -DYAML_VERSION_MINOR=2 \
	    -DYAML_VERSION_PATCH=5 '-DYAML_VERSION_STRING="0.2.5"' \
	    -I$(STUDIO)/source/libyaml/include -c $< -o $@
build/wasm/library/cJSON.o: $(STUDIO)/source/cjson/cJSON.c
	$(call say,wasm,$<)
	@mkdir -p $(@D)
	$(Q)$(WASM_CC) -O2 -w -c $< -o $@

# Debian's clang does not find its own builtins for wasm32 when it links.
$(STUDIO)/planner.wasm: $(STUDIO_WASM) $(STUDIO_LIBRARY)
	$(call say,link,$@)
	$(Q)wasm-ld --no-entry --gc-sections --strip-all \
	    --export=_initialize --export-dynamic -z stack-size=1048576 \
	    /usr/lib/wasm32-wasi/crt1-reactor.o $^ -L/usr/lib/wasm32-wasi -lc \
	    "$$(clang -print-resource-dir)/lib/wasi/libclang_rt.builtins-wasm32.a" \
	    -o $@.partial
	$(Q)mv $@.partial $@

.PHONY: test-studio test-planner
## the browser's planner is slew's (STUDIO_MOVES=200 and examples); server and page
test-studio: studio $(PAGE_NPM)/done
	@SLEW=$(SLEW) node --test tests/firmware/studio/server.test.mjs \
	    tests/firmware/studio/danger.test.mjs
	@$(MAKE) --no-print-directory -k --output-sync=target $(ALL_CPUS) \
	    test-browser test-planner vendor-check page-format-check test-page

# A browser waits more than it works; what only computes has what it leaves.
test-planner: studio
	@rm -rf $(STUDIO)/moves
	@nice -n 19 $(PYTHON) -B tests/firmware/studio/moves.py $(STUDIO)/moves $(STUDIO_MOVES)
	@nice -n 19 node tests/firmware/studio/same.mjs $(STUDIO)/planner.wasm $(SLEW) \
	    $(patsubst %/move.yaml,%,$(wildcard examples/*/move.yaml)) \
	    $(STUDIO)/moves/*
	@nice -n 19 node --test tests/firmware/studio/again.test.mjs
