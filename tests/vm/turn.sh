#!/bin/sh
# tests/vm/turn.sh BUILD - inside the machine of boot.sh: drives that count
# turns over real sockets.
#
# slew sim and slew run meet on virtual CAN, once with FD frames; then the ODrive's
# bus is the emulated Kvaser cards, with its remote frames on a wire.
set -u
slew=${1:-build}/slew
. "${0%/*}/claims.sh"

# A tick and a heartbeat that the emulator can keep.
mkdir "$dir/rig"
cp examples/odrive/move.yaml examples/odrive/endpoints.json "$dir/rig/"
sed -e 's/^tick: 1 ms/tick: 5 ms/' -e 's/^heartbeat: 20 ms/heartbeat: 100 ms/' \
    examples/odrive/rig.yaml >"$dir/rig/rig.yaml"

move() # move INTERFACES-OF-THE-DRIVES INTERFACES-OF-THE-MASTER
{
    serve --interface "$1" "$dir/rig" || return 1
    start --interface "$2" "$dir/rig" && ended 0 && say "done after" "$dir/run.out"
    moved=$?
    unserve
    cat "$dir/sim.out"
    return $moved
}

preload "$slew"
claim "on vcan0, and on vcan1 with FD frames" \
    move can0=vcan0,can1=vcan1 can0=vcan0,can1=vcan1
claim "the ODrive over can0 and can1, Kvaser" \
    move can0=can1,can1=vcan1 can0=can0,can1=vcan1
claims_end
