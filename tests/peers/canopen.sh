#!/bin/sh
# tests/peers/canopen.sh - inside the machine of tests/vm/boot.sh: other
# people's CANopen against ours, over vcan, in both directions.
set -u
slew=$SLEW
python=$PEERS/venv/bin/python
export PYTHONDONTWRITEBYTECODE=1
dir=$(mktemp -d)
failed=0

fail()
{
    echo "  FAILED: $*"
    failed=1
}

# One axis, slow enough for a peer written in Python.
cat >"$dir/rig.yaml" <<'RIG'
title: One axis
tick: 20 ms
watchdog: 100 ms
buses:
  can0:
    {kind: canopen, bit_rate: 1 Mbit/s, interface: vcan0, sync_counter: 50}
axes:
  axis:
    unit: mm
    limits:
      position: [-1000 mm, 1000 mm]
      velocity: 100 mm/s
      acceleration: 200 mm/s2
    following_error: {floor: 5 mm, time: 100 ms}
    drive:
      kind: cia402
      bus: can0
      node: 5
      counts: 100 per mm
      revolution: 100 mm
      options: {quick_stop: 6, halt: 2}
    sim:
      home_switch: [20 mm, 30 mm]
      limit_switches: [-60 mm, 200 mm]
      index: 5 mm
RIG
cat >"$dir/move.yaml" <<'MOVE'
title: There and back
axes:
  axis:
    curve: quintic
    keys: [[0 s, 20 mm], [2 s, 80 mm], [4 s, 0 mm]]
MOVE
"$slew" sim --eds "$dir" >"$dir/servo.eds"

# And two of them behind one node.
mkdir "$dir/two"
awk '{ print } /^  axis:/ { on = 1 } on { text = text $0 "\n" }
    END { sub("axis:", "second:", text)
          sub("node: 5", "node: 5\n      axis: 2\n      pdo: {rx: 0x405, tx: 0x385}", text)
          printf "%s", text }' "$dir/rig.yaml" >"$dir/two/rig.yaml"
cat >"$dir/two/move.yaml" <<'MOVE'
title: There, and the other way
axes:
  axis:
    curve: quintic
    keys: [[0 s, 20 mm], [2 s, 60 mm]]
  second:
    curve: quintic
    keys: [[0 s, 20 mm], [2 s, -20 mm]]
MOVE

# The clock leaps over waiting for files: have them all read before time counts.
"$python" -c 'import canopen, canopen.profiles.p402, can.interfaces.socketcan
canopen.import_od("'"$dir/servo.eds"'", 1)
bus = canopen.Network()
bus.connect(channel="vcan1", interface="socketcan")
bus.sync.start(0.1)
bus.disconnect()' || fail "python-canopen"

echo "python-canopen as master, our simulated drive:"
"$slew" sim "$dir" >"$dir/sim.out" 2>&1 &
sim=$!
sleep 1
"$python" tests/peers/canopen_master.py vcan0 5 "$dir/servo.eds" ||
    fail "canopen_master.py"
"$slew" scan --listen 0.3s vcan0 2>"$dir/scan.log" | grep "kind: cia402" ||
    fail "slew scan"
kill $sim
wait $sim

echo "python-canopen as master, two axes behind our simulated node:"
"$slew" sim "$dir/two" >"$dir/sim.out" 2>&1 &
sim=$!
sleep 1
"$python" tests/peers/canopen_axes.py vcan0 5 "$dir/servo.eds" || {
    cat "$dir/sim.out"
    fail "canopen_axes.py"
}
"$slew" scan --listen 0.3s vcan0 2>"$dir/scan.log" |
    grep "kind: cia402, axis: 2" || fail "slew scan: the second axis"
kill $sim
wait $sim

echo "our master, python-canopen's LocalNode:"
mkfifo "$dir/hold"
"$python" tests/peers/canopen_servo.py vcan0 5 "$dir/servo.eds" \
    <"$dir/hold" >"$dir/servo.out" 2>&1 &
servo=$!
exec 3>"$dir/hold"
tries=0
until grep -q ready "$dir/servo.out" || [ $tries -gt 2000 ]; do
    sleep 1
    tries=$((tries + 1))
done
echo "slew scan and slew drive, python-canopen's LocalNode:"
tool() # tool TEXT WORD...: slew WORD... says it
{
    want=$1
    shift
    "$slew" "$@" >"$dir/tool.out" 2>&1
    if grep -q -- "$want" "$dir/tool.out"; then
        echo "  slew $1 $2: $want"
    else
        cat "$dir/tool.out"
        fail "slew $*: no \"$want\""
    fi
}
tool "CANopen  *0/192/10000/" scan --listen 0.3s vcan0
tool "kind: cia402" scan --listen 0.3s vcan0
tool "switch on disabled" drive get vcan0 5 statusword
tool "65536 *counts" drive get vcan0 5 6065 --eds "$dir/servo.eds"
tool "4321 *counts" drive set vcan0 5 6065 4321
tool "4321 *counts" drive get vcan0 5 "Following error window"
tool "expected 0 .. 240" drive set vcan0 5 1019 241 --eds "$dir/servo.eds"
tool "no such object" drive get vcan0 5 2F00
tool "node 9 does not answer" drive get vcan0 9 1000
tool "is up (vcan)" doctor --for 0
if "$slew" run --real --yes --can-log "$dir/frames.log" "$dir" >"$dir/run.out" 2>&1
then
    grep -E "^axis +4|done after" "$dir/run.out"
else
    cat "$dir/run.out"
    fail "slew run"
fi

tool "i32 *0 *counts" drive get vcan0 5 6064

echo "our master, python-canopen's LocalNode in NMT Stopped:"
cansend vcan0 000#0205
tool "node 5 does not answer" drive get vcan0 5 statusword
if "$slew" run --real --yes "$dir" >"$dir/run.out" 2>&1; then
    grep -E "done after" "$dir/run.out"
else
    cat "$dir/run.out"
    fail "slew run, a node in NMT Stopped"
fi

# This servo has no watchdog: it stops for the guardian alone, and for slew off.
torque() # torque yes|no: in its statusword
{
    "$slew" drive get vcan0 5 statusword >"$dir/tool.out" 2>&1
    case $1 in
    yes) grep -q "operation enabled" "$dir/tool.out" ;;
    no) grep -q "switch on disabled" "$dir/tool.out" ;;
    esac || { cat "$dir/tool.out" "$dir/run.out"; fail "torque: not $1"; }
}
left_on() # slew run, killed in mid-move
{
    "$slew" run --real --yes "$dir" >"$dir/run.out" 2>&1 &
    run=$!
    tries=0
    until grep -q " 50 %" "$dir/run.out" || [ $tries -gt 600 ]; do
        sleep 0.1
        tries=$((tries + 1))
    done
    kill -9 $run
    wait $run 2>/dev/null
}
echo "slew run, killed in mid-move:"
left_on
tries=0
until grep -q "^axis: torque" "$dir/run.out" || [ $tries -gt 600 ]; do
    sleep 0.1
    tries=$((tries + 1))
done
grep "torque" "$dir/run.out"
grep -q "without switching its drives off" "$dir/run.out" || fail "no guardian"
torque no
echo "slew off, a drive that was left on:"
for word in 06 07 0F; do
    cansend vcan0 "605#2B406000${word}000000"
    sleep 0.2
done
torque yes
"$slew" off --real "$dir/rig.yaml" || fail "slew off"
torque no
echo "slew off, a drive that was left on, whose node is in NMT Stopped:"
for word in 06 07 0F; do
    cansend vcan0 "605#2B406000${word}000000"
    sleep 0.2
done
torque yes
cansend vcan0 000#0205
tool "node 5 does not answer" drive get vcan0 5 statusword
"$slew" off --real "$dir/rig.yaml" || fail "slew off, NMT Stopped"
torque no

exec 3>&-
wait $servo
tail -n 2 "$dir/servo.out"
grep -q "limits -100001 .. 100001, following error 2000 for 40 ms, options 6 2, \
SYNC counts to 50" "$dir/servo.out" || fail "it was told something else"

echo "our master, two axes behind python-canopen's LocalNode:"
"$python" tests/peers/canopen_servo.py vcan0 5 "$dir/servo.eds" 2 \
    <"$dir/hold" >"$dir/servo.out" 2>&1 &
servo=$!
exec 3>"$dir/hold"
tries=0
until grep -q ready "$dir/servo.out" || [ $tries -gt 2000 ]; do
    sleep 1
    tries=$((tries + 1))
done
tool "kind: cia402, axis: 2" scan --listen 0.3s vcan0
if "$slew" run --real --yes "$dir/two" >"$dir/run.out" 2>&1; then
    grep -E "^(axis|second) +2|done after" "$dir/run.out"
else
    cat "$dir/run.out"
    fail "slew run, two axes"
fi
exec 3>&-
wait $servo
cat "$dir/servo.out"
grep -q "at 6000" "$dir/servo.out" && grep -q "at -2000" "$dir/servo.out" ||
    fail "the axes are not where they were sent"

echo "can-utils and python-can, our recording:"
lines=$(wc -l <"$dir/frames.log")
ascs=$(log2asc -I "$dir/frames.log" vcan0 2>/dev/null | grep -c ' Rx ')
reads=$("$python" -c '
import sys, can
print(sum(1 for m in can.LogReader(sys.argv[1])))' "$dir/frames.log")
echo "  $lines lines, log2asc reads $ascs, python-can $reads"
[ "$lines" -gt 500 ] && [ "$lines" = "$ascs" ] && [ "$lines" = "$reads" ] ||
    fail "they do not agree"
exit $failed
