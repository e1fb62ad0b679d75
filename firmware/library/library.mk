# firmware/library/library.mk - libslew for other programs, and make install.
#
#   PREFIX=/usr/local  DESTDIR=   where to; the other names below are GNU's
#
# The library is the part of slew that runs anywhere: motion, the protocols and
# drives of hal, the controller.  It links with libm alone.

VERSION   := $(shell sed -n 's/^.define SLEW_VERSION "\(.*\)"/\1/p' \
               firmware/library/version.h)
SOVERSION := $(shell echo $(VERSION) | \
               awk -F. '{ print $$1 ($$1 == 0 ? "." $$2 : "") }')

# What docs/API.md describes; what these include comes with them.
PUBLIC := \
    motion/core/err.h motion/core/track.h motion/core/clock_warp.h \
    motion/core/shaper.h \
    motion/curve/ease.h motion/curve/spline.h motion/curve/fcurve.h \
    motion/otg/otg.h motion/otg/sync.h motion/otg/replan.h \
    motion/plan/plan_pool.h motion/plan/move.h motion/plan/compose.h \
    motion/plan/check.h \
    motion/plan/topp/topp.h motion/plan/fit/fit.h motion/plan/shaper/shaper.h \
    hal/can.h hal/clock.h hal/gpio.h hal/modbus.h hal/drive.h hal/fieldbus.h \
    hal/can/bus.h \
    hal/canopen/canopen.h hal/canopen/lss.h \
    hal/modbus/bus.h hal/modbus/map.h \
    $(filter-out hal/drive/turn/%,$(wildcard hal/drive/*/drive.h)) \
    firmware/control/controller.h firmware/control/jog.h \
    firmware/control/homing.h firmware/control/trigger.h \
    firmware/library/version.h
PUBLIC_ALL = $(sort $(PUBLIC) $(wildcard motion/core/fixed*.h) \
    $(shell for header in $(PUBLIC); do $(CC) $(STD) -I. -MM $$header; done | \
            tr ' \\\\' '\n\n' | grep '\.h$$'))

PREFIX      ?= /usr/local
DESTDIR     ?=
BINDIR      ?= $(PREFIX)/bin
LIBDIR      ?= $(PREFIX)/lib
INCLUDEDIR  ?= $(PREFIX)/include
DATADIR     ?= $(PREFIX)/share
INSTALL     ?= install
LDCONFIG    ?= $(firstword $(wildcard /sbin/ldconfig) ldconfig)

SO := $(B)/libslew.so.$(VERSION)

# Only what a public header declares can be linked, with a version of its own.
$(SO): $(B)/libslew.a firmware/library/slew.map
	$(call say,link,$@)
	$(Q)$(CC) $(OPT) $(LDFLAGS) -shared -Wl,-soname,libslew.so.$(SOVERSION) \
	    -Wl,--version-script=firmware/library/slew.map -Wl,--whole-archive $< \
	    -Wl,--no-whole-archive $(if $(SAN),,-Wl$(comma)--no-undefined) -lm -o $@

.PHONY: library
## libslew.a and libslew.so
library: $(B)/libslew.a $(SO)

.PHONY: symbols
TO ?= firmware/library/slew.map
## write firmware/library/slew.map anew, after a public header has changed
symbols: $(B)/libslew.a
	@firmware/library/symbols.sh $(SOVERSION) $< $(PUBLIC) >$(B)/slew.map
	@cp $(B)/slew.map $(TO)

# What is installed, as FILE-OR-DIRECTORY TARGET MODE, a line each.
define INSTALLED
$(SLEW) $(BINDIR)/slew 755
$(B)/slew-fmu.so $(LIBDIR)/slew/slew-fmu.so 755
$(B)/libslew.a $(LIBDIR)/libslew.a 644
$(SO) $(LIBDIR)/$(notdir $(SO)) 755
$(B)/slew.pc $(LIBDIR)/pkgconfig/slew.pc 644
firmware/linux/install/slew.1 $(DATADIR)/man/man1/slew.1 644
firmware/linux/install/slew.bash $(DATADIR)/bash-completion/completions/slew 644
firmware/linux/install/_slew $(DATADIR)/zsh/site-functions/_slew 644
$(foreach h,$(PUBLIC_ALL),$h $(INCLUDEDIR)/slew/$h 644
)$(foreach f,$(wildcard hal/maps/*.yaml hal/quirks/*.yaml),$f $(DATADIR)/slew/$f 644
)$(foreach f,$(wildcard docs/*.md),$f $(DATADIR)/doc/slew/$(notdir $f) 644
)$(foreach f,$(wildcard docs/schema/*.json),$f $(DATADIR)/slew/$(f:docs/%=%) 644
)$(foreach f,$(shell git ls-files examples 2>/dev/null || find examples -type f),$f $(DATADIR)/doc/slew/$f 644
)
endef
LINKS = libslew.so.$(SOVERSION) libslew.so

.PHONY: installed
# their list
installed:
	$(file >$(B)/installed,$(INSTALLED))@:

$(B)/slew.pc: firmware/library/slew.pc.in firmware/library/version.h
	@sed -e 's|@PREFIX@|$(PREFIX)|; s|@LIBDIR@|$(LIBDIR)|' \
	    -e 's|@INCLUDEDIR@|$(INCLUDEDIR)|; s|@VERSION@|$(VERSION)|' $< >$@

# Programs find a new library by ldconfig's cache, where it looks for libraries.
define find_library
@if [ -n "$(DESTDIR)" ]; then \
    echo "  where it is used: ldconfig, so that programs find libslew.so"; \
elif ! $(LDCONFIG) 2>/dev/null; then \
    echo "  ldconfig could not run: as root, so that programs find libslew.so"; \
elif ! $(LDCONFIG) -p | grep -qF "$(LIBDIR)/libslew.so.$(SOVERSION)"; then \
    echo "  no program looks for libslew.so in $(LIBDIR): as root," \
        "echo $(LIBDIR) >/etc/ld.so.conf.d/slew.conf; ldconfig"; \
fi
endef

.PHONY: install
## the program, its files and the library, under PREFIX (/usr/local); DESTDIR
install: $(SLEW) $(B)/slew-fmu.so library installed
	@rm -f $(B)/slew.pc; $(MAKE) --no-print-directory $(B)/slew.pc
	@sed '/^$$/d' $(B)/installed | while read -r from to mode; do \
	    $(INSTALL) -D -m "$$mode" "$$from" "$(DESTDIR)$$to" || exit 1; done
	@ln -sf slew $(DESTDIR)$(BINDIR)/slewd
	@cd $(DESTDIR)$(LIBDIR) && \
	    for link in $(LINKS); do ln -sf $(notdir $(SO)) $$link; done
	$(find_library)

.PHONY: uninstall
## what make install has put there; directories that are empty then
uninstall: installed
	@rm -f $(DESTDIR)$(BINDIR)/slewd
	@sed '/^$$/d' $(B)/installed | while read -r from to mode; do \
	    rm -f "$(DESTDIR)$$to"; done
	@cd $(DESTDIR)$(LIBDIR) 2>/dev/null && rm -f $(LINKS) || true
	@sed '/^$$/d' $(B)/installed | while read -r from to mode; do \
	    rmdir -p --ignore-fail-on-non-empty "$(DESTDIR)$${to%/*}" 2>/dev/null; \
	    done || true
	@[ -n "$(DESTDIR)" ] || $(LDCONFIG) 2>/dev/null || true
