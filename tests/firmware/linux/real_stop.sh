#!/bin/sh
# tests/firmware/linux/real_stop.sh - no way out of slew leaves torque on a real line: simulated
# servos in another process, behind a real pseudo-terminal and a real socket, are
# asked themselves what they were left with.
#
# These servos have no watchdog of their own.  Ticks are long, as in real_modbus.sh,
# and what found this machine busy is done again: each way out is a run of this
# script with the words of that way, DIR and PORT in the environment.
#
# Reads the real clock.
set -eu
ulimit -c 0
. tests/support/servos.sh
run=
if [ $# -eq 0 ]; then
    dir=$(mktemp -d)
    trap 'gone; rm -rf "$dir"' EXIT
else
    dir=$DIR port=$PORT
    trap 'kill -9 $run 2>/dev/null || true' EXIT
fi

fail()
{
    echo "real_stop.sh: $*"
    cat "$dir/sim.yaml.said" "$dir/out" "$dir/err" 2>/dev/null
    exit 1
}

rig() # rig LINE: one axis on it
{
    cat <<RIG
title: Lift
tick: 20 ms
buses:
  line: $1
axes:
  lift:
    unit: rev
    limits: {position: [-500 rev, 500 rev], velocity: 600 rpm, acceleration: 30 rev/s2}
    following_error: {floor: 5 rev, time: 1 s}
    drive: {kind: modbus, bus: line, node: 3, map: leadshine-el7, unsupervised: yes, counts: {num: 10000, den: 1}}
    sim: {velocity: 100 rev/s, acceleration: 5000 rev/s2}
RIG
}

# Far away first, then a move of a minute.
cat >"$dir/move.yaml" <<'MOVE'
title: Up
axes:
  lift: {curve: s-curve, keys: [[0 s, 4 rev], [60 s, 204 rev]]}
MOVE

comes() # comes TEXT FILE: within half a minute
{
    for _ in $(seq 300); do
        ! grep -q "$1" "$2" || return 0
        sleep 0.1
    done
    fail "no '$1'"
}

show() # show LINE: the servos on it
{
    rig "$1" >"$dir/sim.yaml"
    servos "$dir/sim.yaml" || exit 1
}

# What SRV-ON of the servo is, by its own register: 3 off, 131 on.
servo_on()
{
    "$SLEW" drive get "$port" 3 di1 --map leadshine-el7 --parity none \
        --timeout 2s >"$dir/di1" 2>&1 || fail "the servo does not answer"
    awk '$2 == "di1" { print $4 }' "$dir/di1"
}

is_off()
{
    [ "$(servo_on)" = 3 ] || fail "$*: the servo has torque: $(servo_on)"
}

# Those whose status is not awaited end soon, too.
ended() # ended STATUS
{
    status=0
    wait "$run" 2>/dev/null || status=$?
    run=
    [ "$status" -eq "$1" ] || fail "status $status, expected $1"
}

begin() # begin TEXT COMMAND ARGUMENT...: until it says so
{
    said=$1
    shift
    : >"$dir/err"
    "$SLEW" "$@" >"$dir/out" 2>"$dir/err" </dev/null &
    run=$!
    comes "$said" "$dir/err"
}

stop_by() # stop_by STATUS SIGNAL...: half a second apart
{
    wanted=$1
    shift
    for signal; do
        kill "-$signal" "$run" 2>/dev/null || true
        sleep 0.5
    done
    ended "$wanted"
}

# The ways out, one run of this script each.

# by_signal TEXT SIGNAL...: once it says TEXT
by_signal()
{
    begin "$1" run --real --yes "$dir/rig.yaml" "$dir/move.yaml"
    sleep 0.5
    at=$1
    shift
    stop_by 130 "$@"
    is_off "$at, $*"
}

# guarded SIGNAL STATUS TEXT: the guardian, and what became of the servo
guarded()
{
    begin "moving" run --real --yes "$dir/rig.yaml" "$dir/move.yaml"
    sleep 0.5
    kill "-$1" "$run"
    comes "it ended without\|its loop hung" "$dir/err"
    comes "lift: torque is off" "$dir/err"
    grep -q "$3" "$dir/err" ||
        fail "ticks were lost before the signal: its loop hung"
    ended "$2"
    is_off "$1"
}

# What slew and its guardian have to say is read until it moves, and then no more: a
# pager, a terminal that Ctrl-S has stopped.
guarded_unread()
{
    rm -f "$dir/said"
    mkfifo "$dir/said"
    exec 9<>"$dir/said"
    cat <&9 >"$dir/err" &
    reader=$!
    "$SLEW" run --real --yes "$dir/rig.yaml" "$dir/move.yaml" >"$dir/out" 2>&9 \
        </dev/null &
    run=$!
    comes "moving" "$dir/err"
    sleep 0.5
    kill "$reader"
    timeout 1 dd if=/dev/zero of="$dir/said" bs=4096 2>"$dir/dd" || true
    kill -KILL "$run"
    ended 137
    for _ in $(seq 50); do
        [ "$(servo_on 2>&1)" != 3 ] || break
        sleep 0.2
    done
    is_off "killed, and nobody reads"
    cat <&9 >>"$dir/err" &
    reader=$!
    comes "lift: torque is off" "$dir/err"
    kill "$reader"
}

# The line is pulled as slew is killed, and is plugged in again five seconds later.
guarded_unplugged()
{
    sed "s|device: [^,]*|device: $dir/port|" "$dir/rig.yaml" >"$dir/unplugged.yaml"
    ln -sf "$port" "$dir/port"
    begin "moving" run --real --yes "$dir/unplugged.yaml" "$dir/move.yaml"
    sleep 0.5
    rm "$dir/port"
    kill -KILL "$run"
    ended 137
    sleep 5
    ln -s "$port" "$dir/port"
    comes "lift: torque is" "$dir/err"
    is_off "killed, and unplugged for five seconds"
}

jog() # jog until it moves
{
    "$SLEW" jog --real --yes "$dir/rig.yaml" lift at 1rev/s for 60s \
        >"$dir/out" 2>"$dir/err" </dev/null &
    run=$!
    comes "REAL" "$dir/out"
    sleep 2
}

jog_by_signal()
{
    jog
    stop_by 130 INT INT
    is_off "jog, two Ctrl-C"
}

jog_guarded()
{
    jog
    kill -STOP "$run"
    comes "lift: torque is off" "$dir/err"
    ended 137
    is_off "jog, hung"
}

# refused COMMAND...: as the first one has it, which it does not disturb
refused()
{
    status=0
    "$SLEW" "$@" >"$dir/second" 2>&1 || status=$?
    [ "$status" -ne 0 ] || fail "$*: not refused"
    grep -q "is in use by process $run, \"$SLEW run" "$dir/second" ||
        fail "$*: $(cat "$dir/second")"
    kill -0 "$run" || fail "$*: the first one ended"
}

# Two programs; then slew off, which gets there in the end.
second()
{
    sed 's/^title: .*/title: Another/; s/127\.0\.0\.1/localhost/' "$dir/rig.yaml" \
        >"$dir/another.yaml"
    begin "moving" run --real --yes "$dir/rig.yaml" "$dir/move.yaml"
    refused run --real --yes "$dir/rig.yaml" "$dir/move.yaml"
    refused run --real --yes "$dir/another.yaml" "$dir/move.yaml"
    refused jog --real --yes "$dir/another.yaml" lift +1rev
    refused drive get "$port" 3 di1 --map leadshine-el7 --parity none
    refused off --real "$dir/another.yaml"
    ! grep -q "fault" "$dir/err" || fail "a fault"
    "$SLEW" off --real --take-over "$dir/another.yaml" >"$dir/second" 2>&1 ||
        fail "taken over: $(cat "$dir/second")"
    ended 138
    is_off "taken over"
}

if [ $# -gt 0 ]; then
    "$@"
    exit
fi

way() # way WORDS...: one of the above, again where this machine was busy
{
    DIR=$dir PORT=$port tests/support/again.sh "$0" "$@" || exit 1
}

guardian()
{
    way guarded STOP 137 "its loop hung"
    way guarded KILL 137 "it ended without"
    way guarded ABRT 134 "it ended without"
    way guarded_unread
}

# Without anything that slew could have put right: torque is on, then off.
left_on()
{
    "$SLEW" drive set "$port" 3 di1 0x83 --map leadshine-el7 --parity none \
        --yes >"$dir/out" 2>"$dir/err" || fail "cannot enable the servo"
    [ "$(servo_on)" = 131 ] || fail "the servo is not on"
    "$SLEW" off --real "$dir/rig.yaml" >"$dir/out" 2>"$dir/err" || fail "off"
    is_off "slew off"
    gone
    status=0
    "$SLEW" off --real --timeout 1s "$dir/rig.yaml" >"$dir/out" \
        2>"$dir/err" || status=$?
    [ "$status" -eq 1 ] || fail "status $status with nobody there"
    grep -q "lift: torque is not confirmed off" "$dir/err" || fail "not named"
    status=0
    "$SLEW" run --real --dry-run "$dir/rig.yaml" "$dir/move.yaml" >"$dir/out" \
        2>"$dir/err" || status=$?
    [ "$status" -ne 0 ] || fail "a dry run with nobody there is fine"
    echo "slew off: done"
}

show "{kind: modbus-rtu, device: /dev/null, baud: 115200, parity: none}"
port=$(terminal_of "$dir/sim.yaml")
rig "{kind: modbus-rtu, device: $port, baud: 115200, parity: none, timeout: 2 s}" \
    >"$dir/rig.yaml"
"$SLEW" run --real --dry-run "$dir/rig.yaml" "$dir/move.yaml" >"$dir/out" \
    2>"$dir/err" || fail "a dry run"
for signal in INT TERM HUP TSTP QUIT; do
    way by_signal "going to the start" $signal
done
way by_signal "moving" INT INT INT INT
way by_signal "enabling" INT
echo "RTU: stopped"
guardian
way guarded_unplugged
way second
way jog_by_signal
way jog_guarded
echo "jog: stopped"
left_on

show "{kind: modbus-tcp, host: 127.0.0.1, port: $((20000 + $$ % 12000))}"
tcp=$(port_of "$dir/sim.yaml")
port=127.0.0.1:$tcp
rig "{kind: modbus-tcp, host: 127.0.0.1, port: $tcp, timeout: 2 s}" \
    >"$dir/rig.yaml"
guardian
way second
echo "TCP: stopped"
