#!/bin/sh
# tests/firmware/mcu/hil.sh - hardware in the loop: the image in QEMU moves servos of
# its own.
#
#     play --libmodbus--> UART 0, image, UART 1 --Modbus--> servos of `slew sim`
#
# The PC uploads the register map, the drives and the move and starts it; every set
# point of the image is that of `slew run` with the same servos, and the servos
# themselves say at the end that they are there.  Then the same with servos that go
# silent in the middle: the board stops with a fault that names the axis.
#
# Reads the real clock: this machine may pause either, so the line's silence and
# time-outs and the following error allow for it; a move that failed because the
# machine was too slow for it is played again, three times at most.
set -eu
. tests/support/servos.sh

dir=$(mktemp -d)
trap 'rm -rf "$dir"' EXIT

cat >"$dir/rig.yaml" <<'RIG'
title: Two servos behind a board
tick: 1 ms
buses:
  line: {kind: modbus-rtu, device: /dev/null, baud: 115200, parity: none, timeout: 250 ms, gap: 20 ms}
axes:
  pan:
    unit: rev
    limits: {position: [-1 rev, 20 rev], velocity: 200 rpm, acceleration: 10 rev/s2}
    following_error: {floor: 8 rev, time: 3 s}
    drive: {kind: modbus, bus: line, node: 3, map: leadshine-el7, unsupervised: yes, counts: {num: 10000, den: 1}}
    sim: {velocity: 100 rev/s, acceleration: 5000 rev/s2}
  tilt:
    unit: rev
    limits: {position: [-1 rev, 20 rev], velocity: 200 rpm, acceleration: 10 rev/s2}
    following_error: {floor: 8 rev, time: 3 s}
    drive: {kind: modbus, bus: line, node: 4, map: leadshine-el7, unsupervised: yes, counts: {num: 10000, den: 1}}
    sim: {velocity: 100 rev/s, acceleration: 5000 rev/s2}
RIG
# It rests for a while, so that the last set point gets there.
cat >"$dir/move.yaml" <<'MOVE'
title: Up
axes:
  pan: {curve: s-curve, keys: [[0 s, 0 rev], [1.5 s, 2 rev], [2.5 s, 1.5 rev], [4 s, 1.5 rev]]}
  tilt: {curve: s-curve, keys: [[0 s, 0 rev], [2 s, 1 rev], [4 s, 1 rev]]}
MOVE

show() # show SAID: the servos of such a board on $terminal
{
    cp "$dir/rig.yaml" "$1.yaml"
    servos "$1.yaml" || return 1
    terminal=$(terminal_of "$1.yaml")
}

board() # board IMAGE MACHINE SAID: play the move on it, with the servos of $terminal
{
    QEMU_DRIVES=$terminal timeout 120 tests/firmware/mcu/qemu.sh \
        "$IMAGES/$1.elf" "$2" "$PLAY" "$dir/rig.yaml" "$dir/move.slt" \
        "$dir/csv" 0 0.002 >"$3.out" 2>"$3.error"
}

at() # at NODE COUNTS: what the servo itself says
{
    counts=$("$SLEW" drive get "$terminal" "$1" position --map leadshine-el7 \
        --parity none --timeout 2s | awk '{ for (i = 1; i <= NF; i++)
            if ($i ~ /^-?[0-9]+$/) n = $i } END { print n }')
    off=$((counts - $2))
    [ "${off#-}" -le 20 ] || { echo "node $1 is at $counts counts, not $2"; return 1; }
}

whole() # whole IMAGE MACHINE
{
    said=$dir/$1
    trap gone EXIT
    for _ in 1 2 3; do
        show "$said" || return 1
        status=0
        board "$1" "$2" "$said" || status=$?
        if [ $status = 0 ]; then
            at 3 15000 && at 4 10000 || return 1
            printf 'hardware in the loop, %s: ' "$1"
            cat "$said.out"
            return 0
        fi
        cat "$said.out" "$said.error"
        [ $status != 2 ] || return 1 # not of this machine's making
        gone
    done
    return 1
}

silent() # silent IMAGE MACHINE: the servos' line goes silent in the middle
{
    said=$dir/$1.silent
    trap gone EXIT
    for _ in 1 2 3; do
        show "$said" || return 1
        rm -f "$said.error"
        board "$1" "$2" "$said" &
        board=$!
        for _ in $(seq 300); do
            ! grep -q started "$said.error" 2>/dev/null || break
            sleep 0.1
        done
        sleep 0.5
        kill -STOP "$sim"
        status=0
        wait $board || status=$?
        gone
        if [ $status = 3 ] && grep -qE 'is fault: (pan|tilt): ' "$said.error"; then
            echo "servos gone silent, $1: $(tail -1 "$said.error")"
            return 0
        fi
        cat "$said.out" "$said.error"
        [ $status != 2 ] || return 1
    done
    return 1
}

"$SLEW" compile --out "$dir/move.slt" "$dir/rig.yaml" "$dir/move.yaml" >/dev/null
"$SLEW" run "$dir/rig.yaml" "$dir/move.slt" --telemetry "$dir/csv" >"$dir/run" 2>&1 ||
    { cat "$dir/run"; exit 1; }

# All wait more than they work: side by side.
jobs=
for do in "whole mps2_an386 mps2-an386" "whole netduinoplus2 netduinoplus2" \
    "silent mps2_an386 mps2-an386"; do
    # shellcheck disable=SC2086
    (set -e; $do) >"$dir/$(echo "$do" | tr ' ' -).job" 2>&1 &
    jobs="$jobs $!"
done
bad=0
for job in $jobs; do
    wait "$job" || bad=1
done
cat "$dir"/*.job
exit $bad
