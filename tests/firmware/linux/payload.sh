#!/bin/sh
# tests/firmware/linux/payload.sh - what hangs on an axis swings with its move and
# works against it, and is drawn.
#
# Gains nothing from sanitizers.
set -eu
slew=${SLEW:-build/slew}
dir=$(mktemp -d)
trap 'rm -rf "$dir"' EXIT

rig() # rig NAME INERTIA
{
    cat >"$dir/$1.yaml" <<END
buses:
  can0: {kind: canopen, bit_rate: 1 Mbit/s}
axes:
  trolley:
    unit: mm
    limits: {position: [0 mm, 3000 mm], velocity: 1200 mm/s, acceleration: 2000 mm/s2, jerk: 20000 mm/s3}
    following_error: {floor: 20 mm, time: 30 ms}
    drive: {kind: cia402, bus: can0, node: 1, counts: 1000 per mm}
    sim: {bandwidth: 10 Hz, start: 500 mm}
payload:
  lamp: {kind: pendulum, axis: trolley, length: 0.9 m, mass: 4$2}
END
}
cat >"$dir/move.yaml" <<'END'
axes:
  trolley: {curve: quintic, ends: rest, keys: [[0 s, 500 mm], [1.6 s, 1300 mm]]}
END
rig apart ''
rig acts ', inertia: 10'
for name in apart acts; do
    "$slew" run --json "$dir/$name.yaml" "$dir/move.yaml" >"$dir/$name.json" \
        2>"$dir/said" || { cat "$dir/said"; exit 1; }
done
"$slew" plot --film --out "$dir/film.svg" "$dir/acts.yaml" "$dir/move.yaml"
"$slew" plot --film --out "$dir/film.png" "$dir/acts.yaml" "$dir/move.yaml"
"$slew" plot --space --out "$dir/strip.svg" "$dir/acts.yaml" "$dir/move.yaml"
test "$(find "$dir" -name 'film-*.png' | wc -l)" -eq 46 # 3.6 s, every 80 ms
python3 - "$dir" <<'END'
import json, sys
import xml.dom.minidom

def run(name):
    with open(f"{sys.argv[1]}/{name}.json") as file:
        report = json.load(file)
    [lamp] = report["payloads"]
    assert (lamp["name"], lamp["axis"]) == ("lamp", "trolley"), lamp
    return lamp, report["axes"][0]

lamp, apart = run("apart")
assert lamp["off_m"] > 0.1 and lamp["off_at_end_m"] > 0.02, lamp
again, acts = run("acts")
# the rod hangs by its angle: force = m g tan(angle) about, at most
assert abs(again["force_n"] - 4 * 9.81 * again["off_m"] / 0.9) < 6, again
print("  following error", apart["following_error"], "mm alone,",
      acts["following_error"], "mm with the lamp")
assert acts["following_error"] > 1.25 * apart["following_error"]
frames = xml.dom.minidom.parse(f"{sys.argv[1]}/film.svg")
assert len(frames.getElementsByTagName("g")) == 46
END
