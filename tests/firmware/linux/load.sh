#!/bin/sh
# tests/firmware/linux/load.sh - the load of a simulated axis swings at the end of
# a fast move, and less behind an input shaper for its frequency.
#
# Gains nothing from sanitizers.
set -eu
slew=${SLEW:-build/slew}
dir=$(mktemp -d)
trap 'rm -rf "$dir"' EXIT

rig() # rig NAME SHAPER
{
    cat >"$dir/$1.yaml" <<EOF
tick: 1 ms
buses:
  can0: {kind: canopen, bit_rate: 1 Mbit/s}
axes:
  boom:
    unit: deg
    limits: {position: [0 deg, 90 deg], velocity: 120 deg/s, acceleration: 600 deg/s2, jerk: 20000 deg/s3}
    following_error: {floor: 5 deg, time: 50 ms}
    drive: {kind: cia402, bus: can0, node: 1, counts: 131072 per rev}
    sim: {bandwidth: 25 Hz, start: 10 deg, load: {inertia: 3, frequency: 4 Hz, damping: 0.01}}
$2
EOF
}
cat >"$dir/move.yaml" <<EOF
axes:
  boom: {curve: quintic, ends: rest, keys: [[0 s, 10 deg], [0.6 s, 40 deg]]}
EOF
rig plain ''
rig shaped '    shaper: {kind: zvd, frequency: 4 Hz, damping: 0.01}'
for name in plain shaped; do
    "$slew" run --json "$dir/$name.yaml" "$dir/move.yaml" >"$dir/$name.json" \
        2>"$dir/said" || { cat "$dir/said"; exit 1; }
done
python3 - "$dir" <<'EOF'
import json, sys

def swing(name):
    with open(f"{sys.argv[1]}/{name}.json") as file:
        loads = json.load(file)["loads"]
    assert [load["axis"] for load in loads] == ["boom"], loads
    return loads[0]["swing_at_end"]

plain, shaped = swing("plain"), swing("shaped")
print(f"  swings by {plain:.4f} deg at the end, shaped by {shaped:.4f} deg")
if not plain > 0.2 or not shaped < plain / 10:
    sys.exit("the shaper takes no vibration out of the load")
EOF
