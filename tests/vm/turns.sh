#!/bin/sh
# tests/vm/turns.sh BUILD - inside the machine of boot.sh: ODrive and moteus over
# real sockets.
#
# slew sim and slew run meet on virtual CAN, the moteus with FD frames; then the
# ODrive's bus is the emulated Kvaser cards, with its remote frames on a wire.
set -u
slew=${1:-build}/slew
dir=$(mktemp -d)
passed=0 failed=0

# A tick and a heartbeat that the emulator can keep.
mkdir "$dir/rig"
cp examples/odrive/move.yaml examples/odrive/endpoints.json "$dir/rig/"
sed -e 's/^tick: 1 ms/tick: 5 ms/' -e 's/^heartbeat: 20 ms/heartbeat: 100 ms/' \
    examples/odrive/rig.yaml >"$dir/rig/rig.yaml"

move() # move NAME INTERFACES-OF-THE-DRIVES INTERFACES-OF-THE-MASTER
{
    "$slew" sim --interface "$2" "$dir/rig" >"$dir/sim.out" 2>&1 &
    sim=$!
    until grep -q interrupt "$dir/sim.out" || ! kill -0 $sim; do sleep 0.1; done
    tests/again.sh "$slew" run --real --interface "$3" --telemetry "$dir/run.csv" \
        "$dir/rig" >"$dir/run.out" 2>&1
    status=$?
    kill $sim
    wait $sim
    if [ $status -eq 0 ] && grep -q "done after" "$dir/run.out"; then
        passed=$((passed + 1))
        echo "  $1"
    else
        failed=$((failed + 1))
        echo "  $1: FAILED, status $status"
        sed 's/^/    /' "$dir/sim.out" "$dir/run.out"
    fi
}

move "ODrive on vcan0, moteus on vcan1 with FD frames" \
    can0=vcan0,can1=vcan1 can0=vcan0,can1=vcan1
move "the ODrive over can0 and can1, Kvaser" \
    can0=can1,can1=vcan1 can0=can0,can1=vcan1

echo "$passed passed, $failed failed"
[ $failed -eq 0 ]
