# tests/vm/gpiod2.mk - the GPIO driver against libgpiod 2.x, beside Debian's 1.6.
#
# PyPI's source distribution of gpiod carries the library; both major versions
# run the same claims in the emulated machine (tests/vm/gpio.sh).

GPIOD2     ?= gpiod==2.5.0
GPIOD2_DIR := $(B)/gpiod2
GPIOD2_OWN := $(wildcard hal/linux/libgpiod*.c)

$(GPIOD2_DIR)/unpacked: tests/vm/gpiod2.mk
	$(call say,pip,$(GPIOD2))
	@rm -rf $(GPIOD2_DIR); mkdir -p $(GPIOD2_DIR)
	$(Q)timeout 120 pip3 download --quiet --disable-pip-version-check \
	    --no-deps --no-binary :all: --dest $(GPIOD2_DIR) $(GPIOD2)
	@tar -xzf $(GPIOD2_DIR)/*.tar.gz -C $(GPIOD2_DIR) --strip-components=1
	@touch $@

$(GPIOD2_DIR)/libgpiod.a: $(GPIOD2_DIR)/unpacked
	$(call say,cc,$@)
	@cd $(GPIOD2_DIR)/lib && rm -f *.o && \
	    $(CC) -O2 -D_GNU_SOURCE -DGPIOD_API_VERSION_STR='"2"' -I../include -I. \
	    -c *.c && ar rcs ../libgpiod.a *.o

$(GPIOD2_DIR)/%.o: %.c $(GPIOD2_DIR)/unpacked Makefile
	$(call say,cc,$@)
	@mkdir -p $(@D)
	$(Q)$(CC) $(ALL_CFLAGS) -isystem $(GPIOD2_DIR)/include -c $< -o $@

$(GPIOD2_DIR)/slew: $(MAIN:%.c=$(B)/%.o)
$(GPIOD2_DIR)/test_conform_gpio: $(B)/tests/conform/test_conform_gpio.o $(B)/libtests.a
$(GPIOD2_DIR)/slew $(GPIOD2_DIR)/test_conform_gpio: \
    $(GPIOD2_OWN:%.c=$(GPIOD2_DIR)/%.o) $(LIBS) $(GPIOD2_DIR)/libgpiod.a
	$(call say,link,$@)
	$(Q)$(CC) $(OPT) $(LDFLAGS) $(filter %.o,$^) -Wl,--start-group \
	    $(filter %.a,$^) -Wl,--end-group $(filter-out -lgpiod,$(LDLIBS)) \
	    $(CMOCKA) -o $@

.PHONY: test-gpiod2
# compile and run what needs no chip
test-gpiod2: $(GPIOD2_DIR)/test_conform_gpio
	@$< >$(GPIOD2_DIR)/log 2>&1 || { cat $(GPIOD2_DIR)/log; exit 1; }
