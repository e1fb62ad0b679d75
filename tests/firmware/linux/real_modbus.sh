#!/bin/sh
# tests/firmware/linux/real_modbus.sh - slew run --real on Modbus lines: simulated servos in
# another process, behind a real pseudo-terminal and a real socket.
#
# This machine may pause either: ticks are long, time-outs and following error allow
# for it, the simulated motor makes up for it, and the second drive has no watchdog.
# A move that was stopped because ticks were lost all the same is run again.
#
# Reads the real clock.
set -eu
. tests/support/servos.sh
dir=$(mktemp -d)
trap 'gone; rm -rf "$dir"' EXIT

fail()
{
    echo "real_modbus.sh: $*"
    cat "$dir/sim.yaml.said" "$dir/report" "$dir/progress" 2>/dev/null
    exit 1
}

# rig LINE MAP COUNTS: one axis on it.
rig()
{
    cat <<RIG
title: Lift
tick: 20 ms
buses:
  line: $1
axes:
  lift:
    unit: rev
    limits: {position: [-1 rev, 20 rev], velocity: 600 rpm, acceleration: 30 rev/s2}
    following_error: {floor: 5 rev, time: 1 s}
    drive: {kind: modbus, bus: line, node: 3, map: $2, unsupervised: yes, counts: {num: $3, den: 1}}
    sim: {velocity: 100 rev/s, acceleration: 5000 rev/s2}
RIG
}

# It rests for a while, so that the last set point gets there.
cat >"$dir/move.yaml" <<'MOVE'
title: Up
axes:
  lift: {curve: s-curve, keys: [[0 s, 0 rev], [1.5 s, 4 rev], [2.5 s, 3 rev], [4.5 s, 3 rev]]}
MOVE

sed '/^watchdog:/d' hal/maps/lexium-32.yaml >"$dir/lexium.yaml"

show() # show SIMULATED-LINE MAP COUNTS
{
    rig "$1" "$2" "$3" >"$dir/sim.yaml"
    servos "$dir/sim.yaml" || exit 1
}

# move LINE MAP COUNTS: run on it, and expect it done.
move()
{
    rig "$1" "$2" "$3" >"$dir/rig.yaml"
    tests/support/again.sh "$SLEW" run --real --yes --json "$dir/rig.yaml" \
        "$dir/move.yaml" >"$dir/report" 2>"$dir/progress" || fail "not done"
    grep -q '"end":[[:space:]]*"done"' "$dir/report" || fail "not done"
}

# at WHERE COUNTS MAP: what the servo itself says, soon: 3 revolutions.
at()
{
    for _ in $(seq 100); do
        counts=$("$SLEW" drive get "$1" 3 position --map "$3" --parity none \
            --timeout 2s | awk '{ for (i = 1; i <= NF; i++)
                if ($i ~ /^-?[0-9]+$/) n = $i } END { print n }') ||
            fail "the servo does not answer"
        off=$((counts - 3 * $2))
        [ "${off#-}" -gt 20 ] || return 0
        sleep 0.1
    done
    fail "the servo is at $counts counts"
}

show "{kind: modbus-rtu, device: /dev/null, baud: 115200, parity: none}" \
    leadshine-el7 10000
terminal=$(terminal_of "$dir/sim.yaml")
move "{kind: modbus-rtu, device: $terminal, baud: 115200, parity: none, timeout: 2 s}" \
    leadshine-el7 10000
at "$terminal" 10000 leadshine-el7
gone
echo "RTU, $terminal: done"

show "{kind: modbus-tcp, host: 127.0.0.1, port: $((20000 + $$ % 12000))}" lexium.yaml 16384
port=$(port_of "$dir/sim.yaml")
move "{kind: modbus-tcp, host: 127.0.0.1, port: $port, timeout: 2 s}" \
    lexium.yaml 16384
at "127.0.0.1:$port" 16384 lexium-32
gone
echo "TCP, port $port: done"

# Nobody there: nothing to enable, and no move.
rig "{kind: modbus-tcp, host: 127.0.0.1, port: $port}" lexium.yaml 16384 \
    >"$dir/rig.yaml"
status=0
tests/support/again.sh "$SLEW" run --real --yes --json "$dir/rig.yaml" "$dir/move.yaml" \
    >"$dir/report" 2>"$dir/progress" || status=$?
[ "$status" -eq 1 ] || fail "status $status with nobody there"
grep -q '"error":.*Connection refused' "$dir/report" ||
    fail "another error with nobody there"
if grep -q played_s "$dir/report"; then fail "a move with nobody there"; fi
