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
	@$(MAKE) --no-print-directory $(ALL_CPUS) build

$(STUDIO)/source/done:
	@firmware/studio/wasm/sources.sh $(@D)

$(STUDIO)/own.c: firmware/studio/embed.sh $(STUDIO_OWN)
	@mkdir -p $(@D)
	$(Q)$< embedded_own cat $(foreach f,$(STUDIO_OWN),$f=$f) >$@.partial
	$(Q)mv $@.partial $@
build/wasm/own.o: $(STUDIO)/own.c
	$(Q)$(WASM_CC) $(STD) -O2 -I. -c $< -o $@
$(B)/own.o: $(STUDIO)/own.c
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

.PHONY: test-studio
## STUDIO_MOVES=200 random moves and the examples: the planner for the browser is slew's
test-studio: studio
	@rm -rf $(STUDIO)/moves
	@$(PYTHON) -B tests/firmware/studio/moves.py $(STUDIO)/moves $(STUDIO_MOVES)
	@node tests/firmware/studio/same.mjs $(STUDIO)/planner.wasm $(SLEW) \
	    $(patsubst %/move.yaml,%,$(wildcard examples/*/move.yaml)) \
	    $(STUDIO)/moves/*
