#!/bin/sh
# tests/firmware/linux/sim_commands.sh - faults that are typed to slew sim, as a
# master sees them on the drive.  Reads the real clock.
set -eu
slew=${SLEW:-build/slew}
dir=$(mktemp -d)
device=
trap '[ -z "$device" ] || kill "$device" 2>/dev/null; rm -rf "$dir"' EXIT

fail()
{
    echo "sim_commands.sh: $*"
    cat "$dir/out"
    exit 1
}

cat >"$dir/rig.yaml" <<EOF
buses:
  net: {kind: modbus-tcp, host: 127.0.0.1, port: 15037}
axes:
  lift:
    unit: mm
    limits: {position: [0 mm, 500 mm], velocity: 30 mm/s, acceleration: 40 mm/s2}
    following_error: {floor: 1 mm}
    drive: {kind: modbus, bus: net, node: 5, map: lexium-32, counts: 4096 per mm}
    sim: {start: 100 mm}
EOF

until_said() # until_said TEXT: within 20 s
{
    for i in $(seq 200); do
        grep -q -- "$1" "$dir/out" && return
        sleep 0.1
    done
    fail "never said: $1"
}

# until_is REGISTER TEXT: what the drive says, within 20 s
until_is()
{
    for i in $(seq 40); do
        if "$slew" drive get 127.0.0.1:15037 5 "$1" --map lexium-32 \
            >"$dir/get" 2>&1 && grep -q -- "$2" "$dir/get"; then
            return
        fi
        sleep 0.4
    done
    fail "$1 is not $2: $(cat "$dir/get")"
}

mkfifo "$dir/in"
"$slew" sim "$dir/rig.yaml" <"$dir/in" >"$dir/out" 2>&1 &
device=$!
exec 3>"$dir/in"
until_said 'net on 127.0.0.1 port 15037: lift (node 5, Schneider Lexium 32)'
until_is position ' 409600 '
echo "encoder_jump lift by 10 mm" >&3
until_is position ' 450560 '
echo "list" >&3
until_said '^ 1  encoder_jump of lift, by 10 mm$'
echo "end 1" >&3
until_is position ' 409600 '
echo "drive_fault lift code 0x0100" >&3
until_is alarm 'following error'
echo "drive_fault nobody" >&3
until_said "'nobody' is no axis, bus or gpio line of the rig"
is_mute()
{
    if "$slew" drive get 127.0.0.1:15037 5 position --map lexium-32 \
        >"$dir/get" 2>&1; then
        fail "answered: $(cat "$dir/get")"
    fi
}
# The connection itself: half open it is made anew; a server that hangs up, and
# requests that never come, are no answer.
echo "half_open net" >&3
until_is position ' 409600 '
echo "hang_up net for 2 s" >&3
until_said 'hang_up of net'
is_mute
until_is position ' 409600 '
echo "loss lift rate 100 % direction to for 3 s" >&3
until_said 'loss of lift, 100 % of the frames, to it'
is_mute
until_is position ' 409600 '
echo "echo net" >&3
until_said 'bus is no Modbus RTU line'
echo "status" >&3
until_said '^lift  *100.0000 mm'
echo "quit" >&3
wait "$device" || fail "status $?"
device=

# A script's times count from the start; its events are those of a run.
echo 'faults: [{fault: encoder_jump, axis: lift, by: 10 mm, at: 300 ms}]' \
    >"$dir/faults.yaml"
"$slew" sim --for 2s --faults "$dir/faults.yaml" "$dir/rig.yaml" </dev/null \
    >"$dir/out" 2>&1 || fail "status $?"
grep -q ' s: 1: encoder_jump of lift, by 10 mm$' "$dir/out" || fail "no fault"
echo 'faults: [{fault: reboot, axis: lift, event: hold}]' >"$dir/faults.yaml"
status=0
"$slew" sim --for 2s --faults "$dir/faults.yaml" "$dir/rig.yaml" </dev/null \
    >"$dir/out" 2>&1 || status=$?
[ $status -eq 2 ] || fail "status $status"
grep -q "faults.yaml:1:10: 'hold' is an event of slew run" "$dir/out" ||
    fail "no sentence"

# Terminals by fixed names, as long as they are there; their lines are said.
cat >"$dir/rtu.yaml" <<EOF
buses:
  a: {kind: modbus-rtu, device: $dir/one, baud: 19200 bit/s}
  b: {kind: modbus-rtu, device: $dir/two, baud: 115200 bit/s, parity: none, stop_bits: 2}
axes:
$(for bus in a b; do
    echo "  lift_$bus:"
    sed -n '/    unit: mm/,$p' "$dir/rig.yaml" | sed "s/bus: net/bus: $bus/"
done)
EOF
ln -s /dev/gone "$dir/two" # of one that was killed
"$slew" sim --link "a=$dir/one,b=$dir/two" "$dir/rtu.yaml" </dev/null \
    >"$dir/out" 2>&1 &
device=$!
until_said 'a on terminal /dev/pts/[0-9]*: 19200 bit/s, 8E1; lift_a (node 5'
until_said 'b on terminal /dev/pts/[0-9]*: 115200 bit/s, 8N2; lift_b (node 5'
until_said 'interrupt (Ctrl-C) to end'
"$slew" drive get "$dir/one" 5 position --map lexium-32 >"$dir/get" 2>&1 ||
    fail "by its name: $(cat "$dir/get")"
kill -INT "$device"
wait "$device" || fail "status $?"
device=
[ ! -L "$dir/one" ] && [ ! -L "$dir/two" ] || fail "its names are left"

# What cannot be a name, before anything can be reached; what was made goes.
refused() # refused LINK SENTENCE
{
    status=0
    "$slew" sim --for 1s --link "$1" "$dir/rtu.yaml" </dev/null >"$dir/out" 2>&1 ||
        status=$?
    [ $status -eq 2 ] || fail "--link $1: status $status"
    grep -q -- "^slew sim: --link: '[^']*': $2" "$dir/out" || fail "--link $1"
    [ ! -L "$dir/one" ] || fail "--link $1: a name is left"
}
refused "$dir/one" 'does not say of which terminal'
refused "a=$dir/one,c=$dir/two" 'does not say of which terminal'
refused "a=$dir/one,b=$dir/rtu.yaml" 'leads to a file that is no symbolic link'
refused "a=$dir/one,b=$dir/no/two" 'No such file'
refused 'a=' 'has no path'
