# firmware/studio/page.mk - the page of the studio, its third-party code and its
# tests.  Only these targets need npm or a browser.

PAGE_NPM := build/studio/npm
PAGE_LOCK := firmware/studio/bundle/package.json \
             firmware/studio/bundle/package-lock.json
PAGE_VENDOR := firmware/studio/web/vendor

# No script of any package is run.
$(PAGE_NPM)/done: $(PAGE_LOCK)
	@mkdir -p $(@D)
	@cp $(PAGE_LOCK) $(@D)
	@command -v npm >/dev/null || .ci/deps npm
	@cd $(@D) && npm ci --ignore-scripts --no-audit --no-fund --loglevel=error
	@touch $@

.PHONY: studio-vendor
## bundle the page's third-party code anew, from npm by the lock file
studio-vendor: $(PAGE_NPM)/done
	@node firmware/studio/bundle/bundle.mjs $(PAGE_NPM)/node_modules \
	    $(PAGE_VENDOR)

.PHONY: vendor-check
## bundle it elsewhere: the bytes must be those of the tree
vendor-check: $(PAGE_NPM)/done
	@node firmware/studio/bundle/bundle.mjs $(PAGE_NPM)/node_modules \
	    build/studio/vendor >/dev/null
	@diff -rq build/studio/vendor $(PAGE_VENDOR)
	@echo "vendor: $$(ls $(PAGE_VENDOR) | wc -l) files are what the lock file makes"

PAGE_OURS = $(shell find firmware/studio/web firmware/studio/bundle \
              tests/firmware/studio/page tests/firmware/studio/browser -name '*.js' -o -name '*.mjs' \
              -o -name '*.css' -o -name '*.html' | grep -v web/vendor)
PRETTIER  = $(PAGE_NPM)/node_modules/.bin/prettier --log-level warn \
            --config firmware/studio/bundle/prettier.json
.PHONY: page-format page-format-check
## reformat the page's sources
page-format: $(PAGE_NPM)/done
	@$(PRETTIER) --write $(PAGE_OURS)
## fail where make page-format would change something
page-format-check: $(PAGE_NPM)/done
	@$(PRETTIER) --check $(PAGE_OURS)

.PHONY: test-page
## the parts of the page that need no browser
test-page:
	@node --test tests/firmware/studio/page

.PHONY: test-browser
## the page in headless Chromium, on simulated rigs; PART=edit for one file
test-browser: $(PAGE_NPM)/done studio
	@SLEW=$(SLEW) node --test --test-concurrency=1 --import \
	    ./tests/firmware/studio/browser/modules.mjs \
	    $(if $(PART),tests/firmware/studio/browser/$(PART).test.mjs,\
	    tests/firmware/studio/browser)

.PHONY: bench-studio
## what dragging a key costs in the page, beside its limits; on a quiet machine
bench-studio: $(PAGE_NPM)/done studio
	@BENCH=1 SLEW=$(SLEW) node --test --test-name-pattern='within|fluid' --import \
	    ./tests/firmware/studio/browser/modules.mjs \
	    tests/firmware/studio/browser/page.test.mjs

.PHONY: page-pictures
# the pictures of docs/STUDIO.md, of the last make test-browser
page-pictures:
	@mkdir -p docs/studio
	@sed -n 's|.*(studio/\(.*\.png\)).*|\1|p' docs/STUDIO.md | while read -r name; do \
	    cp build/studio/pictures/$$name docs/studio || exit 1; done
