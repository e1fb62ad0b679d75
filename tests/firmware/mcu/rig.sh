#!/bin/sh
# tests/firmware/mcu/rig.sh - a board as axes of a rig: `slew run --real` moves an
# image in QEMU together with a servo that the PC drives itself.
#
#     slew run --libmodbus--> UART 0, image: pan and tilt
#           |                          '- UART 1 --Modbus--> their servos, `slew sim`
#           '----libmodbus--> TCP, `slew sim`: lift
#
# Every set point of the board is that of the recording.  Then a run that is killed
# in the middle, alone and with its guardian: the board stops, and has no torque.
#
# Reads the real clock: following error and time-outs allow for a busy machine, and a
# run that says that ticks were lost is done again.
set -eu

# rig DEVICE PORT [PAN TILT]: what the axes of the board have more.
rig()
{
    cat <<RIG
title: A lift, and a head on a board
tick: 5 ms
buses:
  own: {kind: modbus-tcp, host: 127.0.0.1, port: $2, timeout: 2 s}
  line: {kind: modbus-rtu, device: $1, baud: 115200, parity: none, timeout: 500 ms}
axes:
  lift:
    unit: rev
    limits: {position: [-10 rev, 500 rev], velocity: 600 rpm, acceleration: 30 rev/s2}
    following_error: {floor: 8 rev, time: 3 s}
    drive: {kind: modbus, bus: own, node: 3, map: lexium-32, counts: {num: 16384, den: 1}}
    sim: {velocity: 100 rev/s, acceleration: 5000 rev/s2}
  pan:
    unit: deg
    limits: {position: [-180 deg, 180 deg], velocity: 90 deg/s, acceleration: 200 deg/s2}
    following_error: {floor: 60 deg, time: 3 s}
    drive: {kind: slew-mcu, bus: line, node: 1, axis: 0${3-}}
  tilt:
    unit: deg
    limits: {position: [-90 deg, 90 deg], velocity: 90 deg/s, acceleration: 200 deg/s2}
    following_error: {floor: 60 deg, time: 3 s}
    drive: {kind: slew-mcu, bus: line, node: 1, axis: 1${4-}}
RIG
}

# In a leg: $dir, and the board on $device.
at_board()
{
    run=
    trap 'kill -9 $run 2>/dev/null || true' EXIT
    # QEMU looks once a second whether a terminal that everybody has left is open again;
    # a serial line is heard at once.
    exec 3<>"$device"
    rig "$device" "$port" "$@" >"$dir/$leg.yaml"
}

# With servos on the board's own line.
servos()
{
    sed 's/timeout: 50 ms/timeout: 250 ms/' hal/maps/leadshine-el7.yaml >"$dir/servo.yaml"
    grep -q 'timeout: 250 ms' "$dir/servo.yaml"
    more=', map: servo.yaml, counts: 100 per deg, unsupervised: yes'
    whole ", servo: 3$more" ", servo: 4$more"
}

# Held on its way and resumed: all rest at one place, and the board's ramps are those
# of the recording.
held()
{
    options="--hold-at 1.2s --resume-after 1s"
    whole
    # at one place of the path for a second: 200 rows
    awk -F, 'NR == 1 { for (i = 1; i <= NF; i++) if ($i == "path_ns") path = i }
        $path > 0 && ++at[$path] > most { most = at[$path]; where = $path }
        END { print "held at", where, "for", most, "rows"; exit most < 200 }' "$dir/$leg.csv"
}

options=

whole()
{
    at_board "$@"
    status=0
    # shellcheck disable=SC2086 # words
    "$SLEW" run --real --yes "$dir/$leg.yaml" "$dir/move.yaml" $options \
        --telemetry "$dir/$leg.csv" >"$dir/$leg.out" 2>&1 || status=$?
    [ $status = 0 ] || { cat "$dir/$leg.out"; exit $status; }
    "$LOG" "$device" >"$dir/$leg.log"
    "$PYTHON" tests/firmware/mcu/same.py "$dir/$leg.csv" "$dir/$leg.log" pan tilt
    grep -q '^state 0 silent 0' "$dir/$leg.log" || { tail -1 "$dir/$leg.log"; exit 1; }
}

# moving: a run in the middle of a move
moving()
{
    at_board
    : >"$dir/$leg.out"
    "$SLEW" run --real --yes "$dir/$leg.yaml" "$dir/move.yaml" --loop 0 \
        >"$dir/$leg.out" 2>&1 </dev/null &
    run=$!
    for _ in $(seq 600); do
        ! grep -q '^moving' "$dir/$leg.out" || break
        kill -0 $run 2>/dev/null || break
        sleep 0.1
    done
    sleep 1
}

# comes STATE WORDS: what the board says in the end.  A look is a question, which it
# hears: so not more often than it may hear nothing.
comes()
{
    for _ in $(seq 20); do
        sleep 3
        "$LOG" "$device" >"$dir/$leg.log"
        ! grep -q "^state $1" "$dir/$leg.log" || { echo "$2"; return 0; }
    done
    cat "$dir/$leg.out"
    tail -1 "$dir/$leg.log"
    exit 1
}

# The guardian is left, and takes torque off before the watch of the board, 1 s, does:
# the board is told to stop first, whatever the run that was killed left on the line.
killed()
{
    moving
    kill -9 $run || { cat "$dir/$leg.out"; exit 1; }
    comes '0 silent 0' "slew run killed: torque is off"
}

# Nobody is left: the board's own watch.
all_killed()
{
    moving
    keeper=$(pgrep -P "$run")
    kill -STOP "$keeper" # so that it replaces nobody
    # shellcheck disable=SC2046
    kill -9 $(pgrep -P "$keeper") "$keeper" "$run" ||
        { cat "$dir/$leg.out"; exit 1; }
    comes '0 silent 1' "killed with its guardian: the board has stopped by itself"
}

if [ $# -gt 0 ]; then
    leg=$2 device=$1 dir=$RIG_DIR port=$RIG_PORT
    $leg
    exit
fi

dir=$(mktemp -d)
sims=
# shellcheck disable=SC2086
trap 'test -z "$sims" || kill $sims 2>/dev/null || true; rm -rf "$dir"' EXIT
cat >"$dir/move.yaml" <<'MOVE'
title: Up and round
axes:
  lift: {curve: s-curve, keys: [[0 s, 0 rev], [4 s, 6 rev]]}
  pan: {curve: catmull-rom, keys: [[0 s, 0 deg], [1 s, 20 deg], [2.5 s, -10 deg], [4 s, 5 deg]]}
  tilt: {curve: s-curve, keys: [[0 s, 0 deg], [3 s, -10 deg], [4 s, 0 deg]]}
MOVE
# show FILE: simulated servos; what it says is in FILE.said, its number in $sim.
show()
{
    "$SLEW" sim "$1" >"$1.said" 2>&1 &
    sim=$!
    sims="$sims $sim"
    for _ in $(seq 300); do
        ! grep -q ' on ' "$1.said" || return 0
        kill -0 $sim 2>/dev/null || break
        sleep 0.1
    done
    cat "$1.said"
    exit 1
}

port=$((20000 + $$ % 12000))
rig /dev/null $port | sed '/^  line:/d; /^  pan:/,$d' >"$dir/own.yaml"
show "$dir/own.yaml"
port=$(sed -n 's/.* port \([0-9]*\):.*/\1/p' "$dir/own.yaml.said")
export RIG_DIR="$dir" RIG_PORT="$port"

# Servos for the board on a terminal: 3 and 4, as axes of their own.
cat >"$dir/servos.yaml" <<'RIG'
title: Two servos
buses:
  line: {kind: modbus-rtu, device: /dev/null, baud: 115200, parity: none}
axes:
  pan:
    unit: deg
    limits: {position: [-180 deg, 180 deg], velocity: 90 deg/s, acceleration: 200 deg/s2}
    following_error: {floor: 60 deg, time: 3 s}
    drive: {kind: modbus, bus: line, node: 3, map: leadshine-el7, unsupervised: yes, counts: 100 per deg}
    sim: {velocity: 20000 deg/s, acceleration: 1000000 deg/s2}
  tilt:
    unit: deg
    limits: {position: [-180 deg, 180 deg], velocity: 90 deg/s, acceleration: 200 deg/s2}
    following_error: {floor: 60 deg, time: 3 s}
    drive: {kind: modbus, bus: line, node: 4, map: leadshine-el7, unsupervised: yes, counts: 100 per deg}
    sim: {velocity: 20000 deg/s, acceleration: 1000000 deg/s2}
RIG
for leg in "servos netduinoplus2 netduinoplus2" "whole mps2_an386 mps2-an386" \
    "held mps2_an386 mps2-an386" "killed mps2_an386 mps2-an386" "all_killed netduinoplus2 netduinoplus2"; do
    # shellcheck disable=SC2086
    set -- $leg
    unset QEMU_DRIVES
    if [ "$1" = servos ]; then
        show "$dir/servos.yaml"
        QEMU_DRIVES=$(sed -n 's/.* on terminal \([^:]*\):.*/\1/p' "$dir/servos.yaml.said")
        export QEMU_DRIVES
    fi
    printf 'a rig with a board, %s: ' "$2"
    tests/support/again.sh timeout 120 tests/firmware/mcu/qemu.sh \
        "$IMAGES/$2.elf" "$3" "$0" "$1" || exit 1
done
