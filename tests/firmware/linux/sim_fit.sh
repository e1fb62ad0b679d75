#!/bin/sh
# tests/firmware/linux/sim_fit.sh - what a recorded servo was like is found from
# its recording by slew sim fit, and stands in the rig file afterwards.
#
# Gains nothing from sanitizers.
set -eu
slew=${SLEW:-build/slew}
dir=$(mktemp -d)
trap 'rm -rf "$dir"' EXIT

rig() # rig NAME SIM
{
    cat >"$dir/$1.yaml" <<END
tick: 1 ms
buses:
  can0: {kind: canopen, bit_rate: 1 Mbit/s}
axes:
  boom:       # of the jib
    unit: deg
    limits: {position: [-10 deg, 90 deg], velocity: 120 deg/s, acceleration: 600 deg/s2, jerk: 20000 deg/s3}
    following_error: {floor: 5 deg, time: 50 ms}
    drive: {kind: cia402, bus: can0, node: 1, counts: 1048576 per rev}
    sim: $2   # as commissioned
  idle:
    unit: deg
    limits: {position: [-10 deg, 90 deg], velocity: 120 deg/s, acceleration: 600 deg/s2, jerk: 20000 deg/s3}
    following_error: {floor: 5 deg, time: 50 ms}
    drive: {kind: cia402, bus: can0, node: 2, counts: 1048576 per rev}
END
}
rig real '{bandwidth: 18 Hz, damping: 0.8, start: 10 deg, encoder: {noise: 0.001 deg}, load: {inertia: 2.5, frequency: 9 Hz, damping: 0.03, friction: 25 deg/s2, backlash: 0.15 deg}}'
rig guess '{bandwidth: 25 Hz, start: 10 deg}'
cat >"$dir/move.yaml" <<'END'
axes:
  boom: {curve: quintic, ends: rest, keys: [[0 s, 10 deg], [0.4 s, 20 deg], [0.6 s, 20 deg], [1.2 s, 45 deg], [1.8 s, 20 deg]]}
END
"$slew" run --record "$dir/run.mcap" "$dir/real.yaml" "$dir/move.yaml" \
    >"$dir/said" 2>&1 || { cat "$dir/said"; exit 1; }
cp "$dir/guess.yaml" "$dir/kept.yaml"
"$slew" sim fit --json --plot "$dir/fit.svg" --out "$dir/fitted.yaml" \
    "$dir/guess.yaml" "$dir/run.mcap" >"$dir/fit.json"
cmp "$dir/guess.yaml" "$dir/kept.yaml" # --out leaves it alone
test -s "$dir/fit.svg"
python3 - "$dir" <<'END'
import json, sys

with open(f"{sys.argv[1]}/fit.json") as file:
    axes = json.load(file)["axes"]
assert [axis["axis"] for axis in axes] == ["boom"], axes
boom = axes[0]
assert boom["model"] == "compliant", boom
assert boom["rms"] < 0.005 < boom["rms_before"], boom
wanted = {"bandwidth_hz": 18, "damping": 0.8, "load_inertia": 2.5,
          "load_frequency_hz": 9, "load_damping": 0.03, "load_friction": 25,
          "load_backlash": 0.15}
for name, value in wanted.items():
    found = boom["parameters"][name]
    off = abs(found["value"] - value)
    print(f"  {name}: {found['value']:.4g}, wanted {value}, "
          f"+- {found['deviation']:.2g}")
    assert found["known"] and found["deviation"] < 0.1 * value, name
    assert off < 5 * found["deviation"] and off < 0.1 * value, name
END
grep -q '# of the jib' "$dir/fitted.yaml"
grep -q 'start: 10 deg,.*load: {inertia: .*   # as commissioned' "$dir/fitted.yaml"
# what was fitted is a rig, and does again what was recorded
"$slew" sim fit --dry-run --json "$dir/fitted.yaml" "$dir/run.mcap" |
    python3 -c '
import json, sys
boom = json.load(sys.stdin)["axes"][0]
assert boom["rms_before"] < 1.05 * boom["rms"], boom'

# a cascade: its two outer loops are found; what a recording does not hold is said
loops() # loops POSITION VELOCITY
{
    echo "{start: 10 deg, encoder: {noise: 0.001 deg}, loops: {position: $1, velocity: $2, reset_time: 30 ms}, motor: {stall: 20000 deg/s2, no_load_speed: 900 deg/s}}"
}
rig real "$(loops '7 Hz' '45 Hz')"
rig guess "$(loops '11 Hz' '80 Hz')"
"$slew" run --record "$dir/loops.mcap" "$dir/real.yaml" "$dir/move.yaml" \
    >"$dir/said" 2>&1 || { cat "$dir/said"; exit 1; }
"$slew" sim fit "$dir/guess.yaml" "$dir/loops.mcap" >"$dir/said"
cat "$dir/said"
grep -q 'boom: current and reset_time of its loops and its motor are the rig.s' \
    "$dir/said"
grep -q 'loops: {position: [67]\.[0-9]* Hz, velocity: 4[0-9.]* Hz, reset_time: 30 ms}, motor' \
    "$dir/guess.yaml"
python3 - "$dir/guess.yaml" <<'END'
import sys, yaml

with open(sys.argv[1]) as file:
    loops = yaml.safe_load(file)["axes"]["boom"]["sim"]["loops"]
for name, value in (("position", 7), ("velocity", 45)):
    assert abs(float(loops[name].split()[0]) / value - 1) < 0.05, loops
END

# of a drive on Modbus there is none, and why is said with the figures of the rig
"$slew" run --record "$dir/modbus.mcap" examples/modbus >"$dir/said" 2>&1 ||
    { cat "$dir/said"; exit 1; }
cycle=$("$slew" check examples/modbus 2>&1 |
    sed -n 's/.*pan: a set point every \([0-9.]* ms\).*/\1/p')
test -n "$cycle"
"$slew" sim fit --dry-run examples/modbus "$dir/modbus.mcap" >"$dir/said" 2>&1
grep "pan: left out, its drive is on Modbus: in which moment of $cycle a set" \
    "$dir/said"
"$slew" sim fit --dry-run --json examples/modbus "$dir/modbus.mcap" 2>"$dir/said" |
    python3 -c '
import json, math, sys
report = json.load(sys.stdin)
assert [axis["axis"] for axis in report["axes"]] == ["dolly", "focus", "tilt"]
[pan] = report["left_out"]
assert pan["axis"] == "pan", pan
words = pan["why"].replace(";", "").split()
goes, shows = float(words[words.index("to") + 1]), float(words[-2])
assert abs(goes / (30 * float(words[words.index("of") + 1]) / 1000) - 1) < 0.02
assert abs(shows / (10 / (2 * math.pi * 20) ** 2) - 1) < 0.02, pan'

# an axis that homes to a hard stop, whose drive tells its torque for that, is fitted;
# one with feed-forward of torque is not, nor is one that stands, and why is said
cat >"$dir/lift.yaml" <<'RIG'
buses: {can0: {kind: canopen, bit_rate: 1 Mbit/s}}
axes:
  lift:
    unit: mm
    limits: {position: [0, 600], velocity: 150, acceleration: 200, jerk: 1000}
    following_error: {floor: 1 mm}
    homing: {by: hard-stop, direction: negative, torque: 60 %, speed: 8 mm/s, position: -3 mm, go: 0 mm}
    drive: {kind: cia402, bus: can0, node: 1, counts: 13107 per mm}
    sim: {hard_stops: [-3, 605], start: 20}
RIG
sed 's/node: 1,/& torque: 10 %,/' "$dir/lift.yaml" >"$dir/forward.yaml"
echo 'axes: {lift: {curve: s-curve, keys: [[0 s, 50], [5 s, 400]]}}' >"$dir/up.yaml"
echo 'axes: {lift: {keys: [[0 s, 0]]}}' >"$dir/stand.yaml"
fit_lift() { # RIG MOVE
    rm -f "$dir/lift.csv"
    "$slew" run --telemetry "$dir/lift.csv" "$dir/$1" "$dir/$2" >"$dir/said" 2>&1 ||
        { cat "$dir/said"; exit 1; }
    "$slew" sim fit --dry-run "$dir/$1" "$dir/lift.csv" >"$dir/said" 2>&1
}
fit_lift lift.yaml up.yaml
grep -q '^lift  *bandwidth  *25 Hz  *25 Hz' "$dir/said"
if fit_lift forward.yaml up.yaml; then exit 1; fi
grep -q 'no axis can be fitted: lift: its drive has torque feed-forward$' "$dir/said"
if fit_lift lift.yaml stand.yaml; then exit 1; fi
grep -q 'no axis can be fitted: lift: it does not move in the recording after a' \
    "$dir/said"
