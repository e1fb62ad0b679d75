# slew - see README.md.  `make` prints what there is.

VARIANT ?=
CC      ?= gcc
B       := build$(if $(VARIANT),/$(VARIANT))
OPT     ?= -O2
SAN     ?=

ifneq ($(SAN),)
B   := build/san
OPT := -O1 -fno-omit-frame-pointer -fsanitize=$(SAN) -fno-sanitize-recover=all
endif

PKGS     := yaml-0.1 libcjson cairo
PKG_INC   = $(shell pkg-config --cflags $(PKGS) 2>/dev/null)
PKG_LIB   = $(shell pkg-config --libs $(PKGS) 2>/dev/null)
CMOCKA    = $(shell pkg-config --libs cmocka 2>/dev/null)

WARN     := -Wall -Wextra -Wconversion -Wshadow -Wstrict-prototypes -Werror
CFLAGS   ?= -g
ALL_CFLAGS = -std=c11 -D_POSIX_C_SOURCE=200809L $(WARN) $(OPT) $(CFLAGS) -I. \
             -MMD -MP
LDLIBS    = $(PKG_LIB) -lm -lpthread

# Rooms: one archive each, from whatever .c files stand there.
MOTION   := $(wildcard motion/*.c)
PLAN     := $(wildcard motion/plan/*.c)
HAL      := $(wildcard hal/*.c)
SIM      := $(wildcard sim/*.c)
FIRMWARE := $(wildcard firmware/*.c)
LINUX    := $(filter-out firmware/linux/main.c,$(wildcard firmware/linux/*.c))
ROOMS    := $(LINUX) $(FIRMWARE) $(SIM) $(HAL) $(PLAN) $(MOTION)
TESTS    := $(patsubst tests/%.c,$(B)/tests/%,$(wildcard tests/test_*.c))
OBJ      := $(ROOMS:%.c=$(B)/%.o)
SLEW     := $(B)/slew

.DEFAULT_GOAL := help
.PHONY: help
## this list
help:
	@awk '/^## /{text=substr($$0,4);next} \
	      text&&/^[a-z-]+:/{sub(":.*","");printf "  make %-14s %s\n",$$0,text} \
	      {text=""}' $(MAKEFILE_LIST)

.PHONY: build
## compile the program, build/slew
build: $(SLEW)

$(SLEW): $(B)/firmware/linux/main.o $(B)/libslew.a
	$(CC) $(OPT) $(LDFLAGS) $^ $(LDLIBS) -o $@

$(B)/libslew.a: $(OBJ)
	rm -f $@; $(AR) rcs $@ $^

$(B)/firmware/linux/%.o: firmware/linux/%.c
	@mkdir -p $(@D)
	$(CC) $(ALL_CFLAGS) $(PKG_INC) -c $< -o $@

$(B)/%.o: %.c
	@mkdir -p $(@D)
	$(CC) $(ALL_CFLAGS) -c $< -o $@

$(B)/tests/%: $(B)/tests/%.o $(B)/libslew.a
	$(CC) $(OPT) $(LDFLAGS) $^ $(LDLIBS) $(CMOCKA) -o $@

.PHONY: check
## run the unit tests alone: make check T=track for one
check: $(if $(T),$(T:%=$(B)/tests/test_%),$(TESTS))
	@set -e; for t in $^; do $$t; done

.PHONY: clean
## remove everything that was built
clean:
	rm -rf build

.SECONDARY:
-include $(OBJ:.o=.d) $(B)/firmware/linux/main.d $(TESTS:=.d)
