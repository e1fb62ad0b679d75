#!/bin/sh
# tests/vm/can.sh BUILD - inside the machine of boot.sh: CAN as it really is.
#
# The claims every port keeps to, on virtual and on emulated interfaces; the
# demo move over can0 to simulated drives that listen on can1; what happens when
# the interface goes down in mid-move, or the program is killed.
set -u
build=${1:-build}
slew=$build/slew
dir=$(mktemp -d)
passed=0 failed=0

claim() # claim NAME COMMAND...
{
    name=$1
    shift
    if "$@" >"$dir/log" 2>&1; then
        passed=$((passed + 1))
        echo "  $name"
    else
        failed=$((failed + 1))
        echo "  $name: FAILED"
        sed 's/^/    /' "$dir/log"
    fi
}

claim "ports on vcan0, FD" "$build/tests/test_conform_can" vcan0 vcan0
claim "ports on can0 and can1, Kvaser" \
    "$build/tests/test_conform_can" can0 can1 remote-empty
claim "ports on can1 and can0, Kvaser" \
    "$build/tests/test_conform_can" can1 can0 remote-empty
claim "errors, time stamps, queues" "$build/tests/test_can_socketcan" vm

#---- drives on can1, their master on can0

# The demo's four axes on one bus, at a tick that the emulator can keep.
mkdir "$dir/rig"
cp examples/dolly/move.yaml "$dir/rig/"
sed -e 's/^tick: 1 ms /tick: 5 ms /' -e '/^ *can1:/d' \
    -e 's/bus: can1, node: 1/bus: can0, node: 3/' \
    -e 's/bus: can1, node: 2/bus: can0, node: 4/' \
    examples/dolly/rig.yaml >"$dir/rig/rig.yaml"

"$slew" sim --interface can1 "$dir/rig" >"$dir/sim.out" 2>&1 &
sim=$!
sleep 1

say() # say TEXT FILE...: one of the files has the text
{
    grep -q -- "$1" "$2" "${3:-/dev/null}" && return 0
    echo "no \"$1\" in:"
    cat "$@" 2>/dev/null
    return 1
}

# SDO upload of 0xINDEX:0 from node 1 as 8 hex digits, by other programs.
ask()
{
    candump -L -n 1 -T 2000 can0,581:7FF >"$dir/answer" &
    dump=$!
    sleep 0.3
    cansend can0 "601#40${1#??}${1%??}0000000000"
    wait $dump
    sed -n 's/.*581#........\(........\).*/\1/p' "$dir/answer"
}

# The axis stands and has no torque.
at_rest()
{
    first=$(ask 6064)
    sleep 1
    second=$(ask 6064)
    status=$(ask 6041)
    echo "6064 $first then $second, 6041 $status"
    [ -n "$first" ] && [ "$first" = "$second" ] || return 1
    [ $((0x${status%??????} & 0x0F)) -ne 7 ] # low byte: operation enabled
}

demo()
{
    "$slew" run --real --telemetry "$dir/demo.csv" "$dir/rig" \
        >"$dir/demo.out" 2>&1 || { cat "$dir/demo.out"; return 1; }
    grep clock "$dir/demo.out"
    say "done after" "$dir/demo.out" && at_rest
}

start()
{
    rm -f "$dir/run.out"
    "$slew" run --real --telemetry "$dir/run.csv" "$dir/rig" \
        >"$dir/run.out" 2>&1 &
    run=$!
    sleep "$1"
}

set_can0()
{
    ip link set can0 "$1"
}

# Down for DOWN seconds in mid-move, and up again.
down_and_up() # down_and_up DOWN
{
    start 9
    kill -0 $run || { cat "$dir/run.out"; return 1; }
    set_can0 down
    sleep "$1"
    set_can0 up
    wait $run
    status=$?
    [ $status -eq 1 ] || { echo "status $status"; cat "$dir/run.out"; return 1; }
    say "the bus is down" "$dir/run.out" &&
        say "reason: bus can0: interface down" "$dir/run.out" || return 1
    # from the first row of the fault on it is a fault
    awk -F, 'NR == 1 { for (i = 1; i <= NF; i++) if ($i == "state") c = i }
        NR > 1 && $c == "fault" { on = 1 }
        NR > 1 && on && $c != "fault" { bad++ }
        END { print on + 0, bad + 0; exit !on || bad }' "$dir/run.csv" ||
        return 1
    at_rest
}

killed()
{
    start 9
    kill -9 $run
    wait $run
    sleep 0.5
    at_rest
}

second_master()
{
    start 6
    "$slew" run --real "$dir/rig" >"$dir/second.out" 2>&1
    status=$?
    kill -INT $run
    wait $run
    [ $status -eq 2 ] && say "another slew moves drives" "$dir/second.out"
}

claim "the demo over can0 to drives on can1" demo
claim "can0 down for 0.1 s in mid-move, and up" down_and_up 0.1
claim "can0 down for 2 s in mid-move, and up" down_and_up 2
claim "killed in mid-move: the drives stop by themselves" killed
claim "a second master on this host is refused" second_master
claim "the demo again" demo

kill $sim
wait $sim
echo "$passed passed, $failed failed"
[ $failed -eq 0 ]
