#!/bin/sh
# tests/vm/can.sh BUILD [vcan0] - inside the machine of boot.sh: CAN as it really is.
#
# The claims every port keeps to, on virtual and on emulated interfaces; the
# demo move over can0 to simulated drives that listen on can1; what happens when
# the interface goes down in mid-move, or the program is killed; and who takes
# torque off when nobody moves the drives any more.
#
# vcan0: the claims on the virtual interface; without it those on the emulated cards.
set -u
build=${1:-build}
interface=${2:-can0}
slew=$build/slew
. "${0%/*}/claims.sh"
bus=can0 node=1
rig=$dir/rig

#---- drives on can1, their master on can0

# The demo's four axes on one bus, at a tick that the emulator can keep.
mkdir "$rig"
cp examples/dolly/move.yaml "$rig/"
sed -e 's/^tick: 1 ms /tick: 5 ms /' -e '/^ *can1:/d' \
    -e 's/bus: can1, node: 1/bus: can0, node: 3/' \
    -e 's/bus: can1, node: 2/bus: can0, node: 4/' \
    examples/dolly/rig.yaml >"$rig/rig.yaml"

set_can0()
{
    ip link set can0 "$1"
}

demo()
{
    "$slew" run --real --yes --telemetry "$dir/demo.csv" "$rig" \
        >"$dir/demo.out" 2>&1 || { cat "$dir/demo.out"; return 1; }
    grep clock "$dir/demo.out"
    say "done after" "$dir/demo.out" && at_rest
}

# A quarter of the way: the dolly goes fast.
in_mid_move() # in_mid_move OPTION...
{
    start "$@" "$rig" && comes grep " 25 %" "$dir/run.out" && runs
}

# A drive that was left alone may be in fault, and nothing enables it then but
# its reset.
reset_drives() # reset_drives OPTION...
{
    for axis in dolly pan tilt focus; do
        "$slew" drive reset --real "$@" "$rig/rig.yaml" $axis || return 1
    done
}

down_and_up() # down_and_up SECONDS
{
    in_mid_move || return 1
    set_can0 down
    sleep "$1"
    set_can0 up
    ended 1 && say "the bus is down" "$dir/run.out" &&
        say "reason: bus can0: interface down" "$dir/run.out" &&
        latched && at_rest && reset_drives
}

killed()
{
    in_mid_move || return 1
    kill -9 $run
    wait $run
    sleep 2 # the guardian asks them too, until they say that they are off
    at_rest && reset_drives
}

second_master()
{
    start "$rig" || return 1
    "$slew" run --real --yes "$rig" >"$dir/second.out" 2>&1
    status=$?
    kill -INT $run
    wait $run
    [ $status -eq 1 ] && say "is in use by process $run, \"$slew run" \
        "$dir/second.out"
}

# The same interface in another rig, and for a tool.
second_rig()
{
    start "$rig" || return 1
    sed 's/^title: .*/title: Another/' "$rig/rig.yaml" >"$dir/another.yaml"
    "$slew" off --real "$dir/another.yaml" >"$dir/second.out" 2>&1
    status=$?
    "$slew" scan can0 >"$dir/scan.out" 2>&1
    runs || return 1
    kill -INT $run
    wait $run
    [ $status -eq 1 ] &&
        say "bus can0 (can0) is in use by process $run" "$dir/second.out" &&
        say "bus can0 (can0) is in use by process $run" "$dir/scan.out"
}

on_can0()
{
    claim "ports on can0 and can1, Kvaser" \
        "$build/tests/conform/test_conform_can" can0 can1 remote-empty
    claim "ports on can1 and can0, Kvaser" \
        "$build/tests/conform/test_conform_can" can1 can0 remote-empty
    claim "errors, time stamps, queues" "$build/tests/hal/linux/test_can_socketcan" vm
    preload "$slew" candump cansend ip
    serve --interface can1 "$rig"
    claim "the demo over can0 to drives on can1" demo
    claim "can0 down for 0.1 s in mid-move, and up" down_and_up 0.1
    claim "can0 down for 2 s in mid-move, and up" down_and_up 2
    claim "killed in mid-move: the drives stop by themselves" killed
    claim "a second master on this host is refused" second_master
    claim "so is one with another rig, slew off, and a tool" second_rig
    claim "the demo again" demo
    unserve
}

#---- nobody at the drives: drives and masters on vcan0

# The guardian is another process, whose standard error is that of the run.
guarded()
{
    in_mid_move --interface vcan0 || return 1
    kill -9 $run
    wait $run
    say_off "$dir/run.out" && at_rest && reset_drives --interface vcan0
}

say_off() # say_off FILE: the guardian, of each axis
{
    for axis in dolly pan tilt focus; do
        comes grep "^$axis: torque is off" "$1" || { cat "$1"; return 1; }
    done
    say "it ended without switching its drives off; taking torque off" "$1"
}

write() # write INDEX VALUE: one word, by another program
{
    cansend vcan0 "$(printf %X $((0x600 + node)))#2B${1#??}${1%??}00${2#??}${2%??}0000"
    sleep 0.2
}

has_torque()
{
    status=$(ask 6041)
    echo "6041 $status"
    [ $((0x${status%??????} & 0x6F)) -eq $((0x27)) ]
}

# A drive that nobody watches over, as one is left that has no watchdog.
switch_on()
{
    write 6040 0080 && write 6040 0006 && write 6040 0007 && write 6040 000F
    has_torque
}

off()
{
    for node in 1 2 3 4; do
        switch_on || return 1
    done
    "$slew" off --real --interface vcan0 "$rig" || return 1
    for node in 1 2 3 4; do
        at_rest || return 1
    done
}

#---- a node in NMT Stopped: neither SDO nor PDO, only heartbeats

nmt() # nmt COMMAND: to $node
{
    cansend $bus "000#$1$(printf %02X $node)"
    sleep 0.1
}

is_mute()
{
    ! asked 6041 || { cat "$dir/answer"; return 1; }
}

found_stopped()
{
    nmt 02
    is_mute && demo_vcan0
}

demo_vcan0()
{
    "$slew" run --real --yes --interface vcan0 "$rig" >"$dir/demo.out" 2>&1 ||
        { cat "$dir/demo.out"; return 1; }
    say "done after" "$dir/demo.out" && at_rest
}

# A master that is not ours is a fault too; whatever is seen first, no torque is left.
stopped_in_motion()
{
    in_mid_move --interface vcan0 || return 1
    nmt 02
    ended 1 && latched || return 1
    say "another master\|the drive does not answer\|left NMT operational\|TPDO1" \
        "$dir/run.out" || return 1
    ! grep "not confirmed off" "$dir/run.out" && at_rest &&
        reset_drives --interface vcan0 && demo_vcan0
}

# Torque that somebody else has left on, and a node that hears nothing of it.
off_stopped()
{
    switch_on || return 1
    nmt 02
    is_mute || return 1
    "$slew" off --real --interface vcan0 "$rig" >"$dir/off.out" 2>&1 ||
        { cat "$dir/off.out"; return 1; }
    at_rest
}

on_vcan0()
{
    claim "ports on vcan0, FD" "$build/tests/conform/test_conform_can" vcan0 vcan0
    preload "$slew" candump cansend ip
    bus=vcan0
    serve --interface vcan0 "$rig"
    claim "vcan0: killed in mid-move: the guardian takes torque off" guarded
    claim "vcan0: slew off takes it off drives that others left on" off
    node=1
    claim "vcan0: a node in NMT Stopped is found, and moves" found_stopped
    claim "vcan0: one that is stopped in motion, and again" stopped_in_motion
    claim "vcan0: slew off takes torque off a node in NMT Stopped" off_stopped
    unserve
}

on_$interface
claims_end
