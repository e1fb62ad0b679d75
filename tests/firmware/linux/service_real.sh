#!/bin/sh
# tests/firmware/linux/service_real.sh - a service of real drives that is killed or hangs in
# mid-move: a simulated servo in another process, behind a real socket, is asked
# itself what it was left with.
#
# All the while it records, and what it has recorded is read back afterwards.
#
# The servo has a watchdog of its own, 500 ms.  A kill of the service alone leaves the
# guardian, which takes torque off; a kill of both leaves the servo's watchdog.  Ticks
# are long, as in real_modbus.sh, and what found this machine busy is done again.
#
# Reads the real clock.
set -eu
ulimit -c 0
sim= run=
if [ $# -eq 0 ]; then
    dir=$(mktemp -d)
    trap 'kill -9 $sim 2>/dev/null || true; rm -rf "$dir"' EXIT
else
    dir=$DIR port=$PORT
    trap 'kill -9 $run 2>/dev/null || true' EXIT
fi
export SLEW_RUN_DIR="$dir"

fail()
{
    echo "service_real.sh: $*"
    "$SLEW" service status "$dir/rig.yaml" 2>&1 || true # that ticks were lost, too
    cat "$dir/said" "$dir/begun" "$dir/err" "$dir/out" 2>/dev/null
    exit 1
}

rig() # rig PORT
{
    cat <<RIG
title: Lift
tick: 20 ms
buses:
  line: {kind: modbus-tcp, host: 127.0.0.1, port: $1, timeout: 2 s}
axes:
  lift:
    unit: rev
    limits: {position: [-500 rev, 500 rev], velocity: 600 rpm, acceleration: 30 rev/s2}
    following_error: {floor: 5 rev, time: 1 s}
    drive: {kind: modbus, bus: line, node: 3, map: lexium-32, counts: {num: 16384, den: 1}}
    sim: {velocity: 100 rev/s, acceleration: 5000 rev/s2}
RIG
}

comes() # comes TEXT FILE: within a minute
{
    for _ in $(seq 600); do
        ! grep -q "$1" "$2" || return 0
        sleep 0.1
    done
    fail "no '$1'"
}

# A bit of the servo's own status word: 4 has torque (operation enabled), 8 a fault.
# Not by slew, which leaves alone what another slew has.
status()
{
    for _ in $(seq 20); do
        tests/support/register.py "$port" 3 0x1B05 2>"$dir/status" &&
            return
    done
    fail "the servo does not answer"
}

has_torque()
{
    [ $(($(status) & 4)) -ne 0 ]
}

is_off() # is_off: soon, and it stays so
{
    for _ in $(seq 100); do
        has_torque || break
        sleep 0.1
    done
    ! has_torque || fail "$*: the servo has torque"
    sleep 1
    ! has_torque || fail "$*: it has torque again"
}

answers()
{
    grep -c '"ok"' "$dir/out" || true
}

# ask LINE...: each once the one before it was answered, whatever that takes.
ask()
{
    asked=0
    rm -f "$dir/in"
    mkfifo "$dir/in"
    : >"$dir/out"
    "$SLEW" service send "$dir/rig.yaml" <"$dir/in" >"$dir/out" 2>&1 &
    send=$!
    exec 3>"$dir/in"
    for line; do
        printf '%s\n' "$line" >&3
        asked=$((asked + 1))
        for _ in $(seq 600); do
            [ "$(answers)" -lt $asked ] || break
            kill -0 $send 2>/dev/null || break
            sleep 0.1
        done
    done
    exec 3>&-
    wait $send || true
    [ "$(answers)" -eq $asked ] && ! grep -qE '"ok":[[:space:]]*false' "$dir/out" ||
        fail "no answer, or no: $*"
}

is_state() # is_state STATE: within a minute
{
    for _ in $(seq 600); do
        "$SLEW" service status --json "$dir/rig.yaml" >"$dir/out" 2>&1 || true
        ! grep -qE "\"state\":[[:space:]]\"$1\"" "$dir/out" || return 0
        ! grep -F "ticks were lost" "$dir/out" || exit 1
        sleep 0.1
    done
    fail "the service is not $1"
}

# In a session of its own, so that a kill of the group is one of the guardian too.
up()
{
    : >"$dir/begun"
    rm -f "$dir"/rig-*.mcap
    setsid "$SLEW" service run --real --yes --recordings "$dir" \
        --record-always "$dir/rig.yaml" >"$dir/begun" \
        2>"$dir/err" </dev/null &
    run=$!
    comes socket "$dir/begun"
    ask '{"command":"take"}' '{"command":"enable"}'
    is_state ready
    ask '{"command":"take"}' "{\"command\":\"load\",\"text\":\"axes: {lift: {curve: \
s-curve, keys: [[0, 0 rev], [60, 200 rev]]}}\"}"
    ask '{"command":"take"}' '{"command":"approach"}'
    is_state ready
    ask '{"command":"take"}' '{"command":"start"}'
    is_state moving
    sleep 1
    has_torque || fail "it moves without torque"
}

# The recording up to the last second: the service moved for longer than that.
is_recorded()
{
    "$SLEW" report --json "$dir"/rig-*.mcap >"$dir/out" 2>&1 ||
        fail "$*: the recording is not read back"
    rows=$(sed -n 's/.*"rows":[[:space:]]*\([0-9]*\).*/\1/p' "$dir/out")
    [ "${rows:-0}" -gt 50 ] || fail "$*: ${rows:-no} rows in the recording"
    grep -qE '"move":[[:space:]]*(0\.[0-9]|[1-9])' "$dir/out" ||
        fail "$*: the move is not in the recording"
}

# The ways it may end, one run of this script each.

killed() # killed: the guardian is left
{
    up
    kill -9 "$run"
    wait "$run" 2>/dev/null || true
    comes "lift: torque is off" "$dir/err"
    is_off killed
    is_recorded killed
}

all_killed() # the servo's watchdog is left
{
    up
    kill -9 "-$run"
    wait "$run" 2>/dev/null || true
    is_off "killed with its guardian"
    is_recorded "killed with its guardian"
}

# Longer than the watchdog, and then it goes on: not by itself into a move.
hung()
{
    up
    kill -STOP "$run"
    sleep 2
    kill -CONT "$run" 2>/dev/null || true
    is_off hung
    kill "$run" 2>/dev/null || true
    wait "$run" || true
    is_off "hung and ended"
    is_recorded "hung and ended"
}

if [ $# -gt 0 ]; then
    "$@"
    exit
fi

port=$((20000 + $$ % 12000))
rig "$port" >"$dir/rig.yaml"
"$SLEW" sim "$dir/rig.yaml" >"$dir/said" 2>&1 &
sim=$!
comes ' on ' "$dir/said"
port=$(sed -n 's/.* port \([0-9]*\):.*/\1/p' "$dir/said")
rig "$port" >"$dir/rig.yaml"
for way in killed all_killed hung; do
    DIR=$dir PORT=$port tests/support/again.sh "$0" $way || exit 1
    echo "$way: torque is off"
done
