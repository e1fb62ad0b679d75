#!/bin/sh
# tests/firmware/linux/service_stop.sh - a stop of another client of a service ends
# what slew run, home and jog have begun through it, in whatever phase: nothing that
# they had still to do is done, torque goes off, and their status is not that of
# what succeeds.
#
# Reads the real clock.
set -eu
dir=$(mktemp -d)
run=
trap 'kill $run 2>/dev/null || true; wait; rm -rf "$dir"' EXIT
export SLEW_RUN_DIR="$dir/run"
mkdir "$SLEW_RUN_DIR"
cat >"$dir/rig.yaml" <<'END'
tick: 20 ms
buses: {can0: {kind: canopen, bit_rate: 1 Mbit/s}}
gpio: {home: {kind: home, axis: x, line: GPIO1, sim: [-20 mm, 0 mm]}}
axes:
  x:
    unit: mm
    limits: {position: [0 mm, 1000 mm], velocity: 200 mm/s, acceleration: 400 mm/s2, jerk: 4000 mm/s3}
    following_error: {floor: 20 mm, time: 100 ms}
    homing: {by: switch, direction: negative, speed: 20 mm/s, slow: 10 mm/s}
    drive: {kind: cia402, bus: can0, node: 1, counts: 1000 per mm}
    sim: {start: 10 mm, quirks: {boot: 4 s}}
END
cat >"$dir/move.yaml" <<'END'
axes:
  x: {curve: s-curve, keys: [[0 s, 100 mm], [60 s, 900 mm]]}
END
stop='{"command": "stop"}'

fail()
{
    echo "service_stop.sh: $*"
    cat "$dir/out" "$dir/err" 2>/dev/null
    exit 1
}

sends() # sends LINE: of another client, whose answers go to $dir/sent
{
    echo "$1" | "$SLEW" service send "$dir/rig.yaml" >"$dir/sent"
}

where() # the position, once torque is off
{
    "$SLEW" service status --json "$dir/rig.yaml" >"$dir/state"
    grep -qF '"torque_off":	true' "$dir/state" || fail "$1: torque is not off"
    awk '/"position":/ { print $2 + 0 }' "$dir/state"
}

# The other client stops once WORDS are in the output, or 1 s after it where LATE is.
stopped() # stopped LATE WORDS COMMAND...
{
    late=$1 words=$2 status=0
    shift 2
    "$SLEW" "$@" >"$dir/out" 2>"$dir/err" &
    command=$!
    for _ in $(seq 300); do
        ! grep -qF "$words" "$dir/out" "$dir/err" || break
        sleep 0.05
    done
    grep -qF "$words" "$dir/out" "$dir/err" || fail "$*: no '$words'"
    sleep "$late"
    sends "$stop"
    for _ in $(seq 200); do
        kill -0 "$command" 2>/dev/null || break
        sleep 0.05
    done
    ! kill -0 "$command" 2>/dev/null || { kill "$command"; fail "$*: goes on after the stop"; }
    wait "$command" || status=$?
    [ "$status" -eq 1 ] || fail "$*: status $status after '$words'"
    grep -qxF "slew $1: another client of the service has stopped it" "$dir/err" ||
        fail "$*: who has stopped it after '$words'?"
    [ "$(grep -c "^slew $1:" "$dir/err")" -eq 1 ] || fail "$*: two reasons"
}

"$SLEW" service run --sim "$dir/rig.yaml" >"$dir/begun" 2>&1 &
run=$!
for _ in $(seq 100); do
    [ ! -s "$dir/begun" ] || break
    sleep 0.1
done

# While drives are waited for, nothing has moved yet, and nothing will.
stopped 0.2 "enabling drives" run "$dir/rig.yaml" "$dir/move.yaml"
at=$(where enabling)
[ "$at" = "$(where again)" ] || fail "it has moved"
sleep 4

stopped 0.2 "x: searching" home "$dir/rig.yaml" x
"$SLEW" home "$dir/rig.yaml" x >"$dir/out" 2>"$dir/err" || fail "home"
sends "$stop" # at rest, before anything else is begun
stopped 0.3 "going to the start" run "$dir/rig.yaml" "$dir/move.yaml"
! grep -qxF moving "$dir/out" || fail "it went to the start, and then on"
# Homed before, it is so still; the homing that was asked for has not been done.
stopped 0.2 "x: searching" home "$dir/rig.yaml" x
stopped 0.3 "enabling drives" jog "$dir/rig.yaml" x at 5mm/s for 60s
stopped 0.3 "enabling drives" jog "$dir/rig.yaml" x to 900mm
"$SLEW" jog "$dir/rig.yaml" x to 100mm >"$dir/out" 2>"$dir/err" || fail "jog"
stopped 1 "moving" run "$dir/rig.yaml" "$dir/move.yaml"
where end >"$dir/at"
