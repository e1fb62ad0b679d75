#!/bin/sh
# tests/firmware/linux/capture.sh - slew capture: what axes did while nobody told
# them to, as far as capture is concerned, becomes a move of few keys.
#
# Reads the real clock.  Gains nothing from sanitizers.
set -eu
dir=$(mktemp -d)
run=
trap 'kill $run 2>/dev/null || true; wait; rm -rf "$dir"' EXIT
export SLEW_RUN_DIR="$dir/run"
mkdir "$SLEW_RUN_DIR" "$dir/dolly"
sed 's/^tick: 1 ms /tick: 20 ms /' examples/dolly/rig.yaml >"$dir/dolly/rig.yaml"
cat >"$dir/dolly/move.yaml" <<'MOVE'
title: A bit
axes:
  tilt: {curve: s-curve, keys: [[0 s, -7 deg], [4 s, -3 deg]]}
MOVE

fail()
{
    echo "capture.sh: $*"
    cat "$dir/out" "$dir/err" "$dir/taught.yaml" 2>/dev/null
    exit 1
}

"$SLEW" service run --sim "$dir/dolly/rig.yaml" >"$dir/begun" 2>"$dir/err" &
run=$!
for _ in $(seq 100); do
    [ ! -s "$dir/begun" ] || break
    sleep 0.1
done
"$SLEW" run "$dir/dolly" >"$dir/out" 2>"$dir/err" & # something moves them
move=$!
"$SLEW" capture --for 9s --tolerance '0.05 deg, 1 mm' --out "$dir/taught.yaml" \
    "$dir/dolly/rig.yaml" >"$dir/said" 2>"$dir/err" || fail "status $?"
wait "$move" || fail "the move: status $?"
grep -q '^tilt: [0-9]* of [0-9]* keys, within 0.05 deg$' "$dir/said" || fail "$(cat "$dir/said")"
! grep -q '^dolly:' "$dir/said" || fail "an axis that stood is in it"
awk '/keys, within/ { exit !($2 >= 3 && $2 <= 30 && $4 >= 100) }' "$dir/said" ||
    fail "$(cat "$dir/said")"
tail -1 "$dir/taught.yaml" | grep -qE ', -(3\.0[0-4]|2\.9[6-9])' || fail "it ends elsewhere"
"$SLEW" plan "$dir/dolly/rig.yaml" "$dir/taught.yaml" >"$dir/out" 2>&1 || fail "it is no move"
kill "$run"
wait "$run" || fail "the service: status $?"

# From the end of its range, where it stands first: what comes of it stays inside, and
# slew fit finds its times, on frames too.
mkdir "$dir/end"
cat >"$dir/end/rig.yaml" <<'RIG'
tick: 20 ms
buses: {can0: {kind: canopen, bit_rate: 1 Mbit/s}}
axes:
  slide:
    unit: mm
    limits: {position: [0, 1800], velocity: 400, acceleration: 350, jerk: 1500}
    following_error: {floor: 5 mm, time: 50 ms}
    drive: {kind: cia402, bus: can0, node: 1, counts: 1000 per mm}
RIG
"$SLEW" service run --sim "$dir/end/rig.yaml" >"$dir/begun" 2>"$dir/err" &
run=$!
for _ in $(seq 100); do
    [ ! -s "$dir/begun" ] || break
    sleep 0.1
done
{ sleep 1; "$SLEW" jog "$dir/end/rig.yaml" slide to 250mm; } >"$dir/out" 2>"$dir/err" &
move=$!
"$SLEW" capture --for 7s --out "$dir/taught.yaml" "$dir/end/rig.yaml" \
    >"$dir/said" 2>"$dir/err" || fail "status $?"
wait "$move" || fail "the jog: status $?"
"$SLEW" check "$dir/end/rig.yaml" "$dir/taught.yaml" >"$dir/out" 2>&1 || true
! grep -q 'position' "$dir/out" || fail "it leaves its range"
"$SLEW" fit --output "$dir/fits.yaml" "$dir/end/rig.yaml" "$dir/taught.yaml" \
    >"$dir/out" 2>&1 || fail "fit"
"$SLEW" check "$dir/end/rig.yaml" "$dir/fits.yaml" >"$dir/out" 2>&1 || fail "check"
sed 's/^axes:/fps: 30000\/1001\n&/' "$dir/taught.yaml" >"$dir/frames.yaml"
"$SLEW" fit --frames --output "$dir/fits.yaml" "$dir/end/rig.yaml" \
    "$dir/frames.yaml" >"$dir/out" 2>&1 || fail "fit --frames"
"$SLEW" check "$dir/end/rig.yaml" "$dir/fits.yaml" >"$dir/out" 2>&1 || fail "check"
tail -1 "$dir/fits.yaml" | grep -q 'frame [0-9]*,' || fail "$(cat "$dir/fits.yaml")"
kill "$run"
wait "$run" || fail "the service: status $?"
run=
