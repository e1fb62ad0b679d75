#!/bin/sh
# tests/firmware/linux/progress.sh - planning that takes over a second says how far it is on a
# terminal, nothing elsewhere, and leaves no trace (tests/firmware/linux/progress.py).
#
# Gains nothing from sanitizers.  Takes long.
set -eu
exec python3 tests/firmware/linux/progress.py "$SLEW"
