#!/bin/sh
# tests/real_modbus.sh - slew run --real on Modbus lines: simulated servos in
# another process, behind a real pseudo-terminal and a real socket.
set -eu
dir=$(mktemp -d)
sim=
trap 'test -z "$sim" || kill "$sim" 2>/dev/null || true; rm -rf "$dir"' EXIT

# rig LINE MAP COUNTS: one axis on it.
rig()
{
    cat <<RIG
title: Lift
buses:
  line: $1
axes:
  lift:
    unit: rev
    limits: {position: [-1 rev, 20 rev], velocity: 600 rpm, acceleration: 30 rev/s2}
    following_error: {floor: 1 rev, time: 200 ms}
    drive: {kind: modbus, bus: line, node: 3, map: $2, unsupervised: yes, counts: {num: $3, den: 1}}
RIG
}

cat >"$dir/move.yaml" <<'MOVE'
title: Up
axes:
  lift: {curve: s-curve, keys: [[0 s, 0 rev], [1.5 s, 4 rev], [2.5 s, 3 rev]]}
MOVE

# show SIMULATED-LINE MAP COUNTS: start it; what it says is in $dir/said.
show()
{
    rig "$1" "$2" "$3" >"$dir/sim.yaml"
    "$SLEW" sim "$dir/sim.yaml" >"$dir/said" 2>&1 &
    sim=$!
    for _ in 1 2 3 4 5 6 7 8 9 10 11 12 13 14 15 16 17 18 19 20; do
        grep -q ' on ' "$dir/said" && return
        sleep 0.1
    done
    cat "$dir/said"
    exit 1
}

# move LINE MAP COUNTS: run on it, and expect it done.
move()
{
    rig "$1" "$2" "$3" >"$dir/rig.yaml"
    "$SLEW" run --real --json "$dir/rig.yaml" "$dir/move.yaml" >"$dir/report" \
        2>"$dir/progress" || { cat "$dir/report" "$dir/progress"; exit 1; }
    grep -q '"end":[[:space:]]*"done"' "$dir/report"
    kill "$sim"
    wait "$sim" || true
    sim=
}

show "{kind: modbus-rtu, device: /dev/null, baud: 115200, parity: none}" \
    leadshine-el7 10000
terminal=$(sed -n 's/.* on terminal \([^:]*\):.*/\1/p' "$dir/said")
move "{kind: modbus-rtu, device: $terminal, baud: 115200, parity: none}" \
    leadshine-el7 10000
echo "RTU, $terminal: done"

show "{kind: modbus-tcp, host: 127.0.0.1, port: 15021}" lexium-32 16384
port=$(sed -n 's/.* port \([0-9]*\):.*/\1/p' "$dir/said")
move "{kind: modbus-tcp, host: 127.0.0.1, port: $port}" lexium-32 16384
echo "TCP, port $port: done"

# Nobody there: a fault, and no move.
rig "{kind: modbus-tcp, host: 127.0.0.1, port: $port}" lexium-32 16384 \
    >"$dir/rig.yaml"
status=0
"$SLEW" run --real --json "$dir/rig.yaml" "$dir/move.yaml" >"$dir/report" \
    2>"$dir/said" || status=$?
test "$status" -eq 1 || { echo "status $status"; cat "$dir/report" "$dir/said"; exit 1; }
