#!/bin/sh
# tests/firmware/linux/follow.sh - see follow.py.
#
# Reads the real clock.  Takes long.  Gains nothing from sanitizers.
set -eu
exec tests/support/again.sh python3 tests/firmware/linux/follow.py "$SLEW"
