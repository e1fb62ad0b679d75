#!/bin/sh
# tests/firmware/linux/sim_view.sh - slew sim on a terminal: see sim_view.py.
#
# Gains nothing from sanitizers.
set -eu
python3 "$(dirname "$0")/sim_view.py" "${SLEW:-build/slew}"
