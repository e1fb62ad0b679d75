#!/bin/sh
# tests/firmware/linux/few_moves.sh - the first of make random-moves (tests/firmware/linux/random_moves.py).
set -eu
exec python3 tests/firmware/linux/random_moves.py "$SLEW" 16
