#!/bin/sh
# tests/firmware/linux/sim_quirks.sh - a simulated drive that is not as slew's own
# moves, or is refused by a sentence that names the object; a camera on a trigger
# line says what it saw.
#
# Gains nothing from sanitizers.
set -eu
slew=${SLEW:-build/slew}
dir=$(mktemp -d)
trap 'rm -rf "$dir"' EXIT

cat >"$dir/move.yaml" <<'END'
axes:
  slide: {curve: quintic, ends: rest, keys: [[0 s, 10 mm], [1 s, 40 mm]]}
events:
  - {line: shutter, every: 200 ms, from: 100 ms, to: 900 ms}
END

run() # run QUIRKS SAYS; "": it moves
{
    cat >"$dir/rig.yaml" <<END
buses:
  can0: {kind: canopen, bit_rate: 1 Mbit/s}
axes:
  slide:
    unit: mm
    limits: {position: [0 mm, 600 mm], velocity: 200 mm/s, acceleration: 400 mm/s2, jerk: 4000 mm/s3}
    stop: {acceleration: 1600 mm/s2, jerk: 24000 mm/s3}
    following_error: {floor: 2 mm, time: 20 ms}
    drive: {kind: cia402, bus: can0, node: 1, counts: 4096 per mm}
    sim: {start: 10 mm, quirks: $1}
gpio:
  shutter: {kind: trigger, line: GPIO23}
END
    status=0
    "$slew" run "$dir/rig.yaml" "$dir/move.yaml" >"$dir/said" 2>&1 || status=$?
    if [ -z "$2" ]; then
        [ "$status" -eq 0 ] || { echo "$1: status $status"; cat "$dir/said"; exit 1; }
    elif [ "$status" -eq 0 ] || ! grep -q -- "$2" "$dir/said"; then
        echo "$1: status $status, expected '$2'"; cat "$dir/said"; exit 1
    fi
}
run '{boot: 2 s}' ''
grep 'camera:    on shutter took 5 pictures, .* 0.200 s apart at least; pulses of 50 ms' "$dir/said"
run '{emergency: 0x3210}' ''
run '{missing: [60C2]}' ''
run '{shipped: {605A: 0}}' ''
run '{shipped: {605A: 0}, read_only: [605A]}' '0x605A'
run '{missing: [1016:1]}' '0x1016'
run '{missing: [6007]}' '0x6007'
run '{boot: 8 s}' 'slide'
run '{fixed_mapping: yes}' '0x1600:00 refused'
