#!/bin/sh
# tests/vm/lines.sh BUILD [gpiod2] - inside the machine of boot.sh: the whole program on
# real GPIO lines.
#
# slew run and slew home with the lines of gpio-sim, against slew sim on virtual
# CAN: a shutter and a flash, a lamp, a home switch, limit switches, an e-stop.
# The other side of an input is its file pull; every level that an output is set
# to is in the kernel's own record (tracepoint gpio_value), with its time.  With
# the libgpiod that is installed or, by the slew of BUILD/gpiod2, 2.x.
set -u
build=${1:-build}
slew=$build/${2:+$2/}slew
. "${0%/*}/claims.sh"
. "${0%/*}/lines_rig.sh"
bus=vcan0 node=5
chip=$(ls -d /sys/devices/platform/gpio-sim.*/gpiochip*)
record=/sys/kernel/tracing

mountpoint -q $record || mount -t tracefs tracefs $record
echo mono >$record/trace_clock
echo 1 >$record/events/gpio/gpio_value/enable

set_line() # set_line N pull-up|pull-down
{
    echo "$2" >"$chip/sim_gpio$1/pull"
}

forget()
{
    echo >$record/trace
}

# What the outputs were set to since: SECONDS LINE LEVEL, a line each.
levels()
{
    base=$(cat /sys/class/gpio/gpiochip*/base)
    sed -n 's/.* \([0-9.]*\): gpio_value: \([0-9]*\) set \([01]\)$/\1 \2 \3/p' \
        $record/trace | awk -v base="$base" '{ print $1, $2 - base, $3 }'
}

pulses() # pulses LINE: how often it became high
{
    levels | awk -v line="$1" '$2 == line && $3 == 1' | wc -l
}

pulsed() # pulsed LINE COUNT: so often or more
{
    [ "$(pulses "$1")" -ge "$2" ]
}

lamp_went_off()
{
    levels | awk -v line=$LAMP '$2 == line { level = $3; on += $3 }
        END { exit !(on > 0 && level == 0) }'
}

#---- outputs

triggers()
{
    forget
    "$slew" run --real --yes --json "$dir/plain" >"$dir/run.json" \
        2>"$dir/run.out" || { cat "$dir/run.out"; return 1; }
    levels >"$dir/levels"
    /usr/bin/python3 tests/vm/lines.py "$dir/levels" "$dir/run.json" \
        shutter=$SHUTTER:high flash=$FLASH:low lamp=$LAMP
}

#---- inputs in mid-move

# The move goes to the positive side until the seventh pulse.
mid_move()
{
    forget
    start "$dir/plain" && comes pulsed $SHUTTER 2 && runs
}

fault() # fault TEXT: latched, named, the axis off, the lamp out
{
    ended 1 && say "$1" "$dir/run.out" && latched && lamp_went_off && at_rest
}

estop()
{
    mid_move || return 1
    set_line $STOP pull-up
    fault "all axes: the e-stop input is active" || return 1
    set_line $STOP pull-down
    [ "$(pulses $SHUTTER)" -lt 13 ] && at_rest
}

# Shorter than a tick: its edges are what tells of it.
estop_blip()
{
    mid_move || return 1
    set_line $STOP pull-up
    set_line $STOP pull-down
    fault "all axes: the e-stop input is active"
}

no_torque_while_pressed()
{
    forget
    set_line $STOP pull-up
    "$slew" run --real --yes "$dir/plain" >"$dir/run.out" 2>&1
    status=$?
    set_line $STOP pull-down
    levels
    [ $status -eq 1 ] && [ "$(pulses $LAMP)" -eq 0 ] &&
        say "the e-stop input is active" "$dir/run.out"
}

limit_ahead()
{
    mid_move || return 1
    set_line $HIGH pull-down # active low
    fault "slide: a limit switch is active" || return 1
    set_line $HIGH pull-up
    [ "$(pulses $SHUTTER)" -lt 7 ] && at_rest
}

# Away from it is allowed, so it is the turn that is too far.
limit_behind()
{
    mid_move || return 1
    set_line $LOW pull-up
    fault "slide: a limit switch is active" || return 1
    set_line $LOW pull-down
    count=$(pulses $SHUTTER)
    echo "$count pulses"
    [ "$count" -ge 6 ] && [ "$count" -lt 13 ]
}

taken()
{
    start "$dir/plain" || return 1
    sed "s/vcan0/vcan1/" "$dir/plain/rig.yaml" >"$dir/other.yaml"
    "$slew" run --real --yes "$dir/other.yaml" "$dir/plain/move.yaml" \
        >"$dir/other.out" 2>&1
    status=$?
    kill -INT $run
    ended 130 &&
        say "line stop: GPIO line 'rig0' is taken by 'slew $run'" \
            "$dir/other.out" &&
        [ $status -eq 1 ]
}

# By its name and by its number: only the chip can tell.
twice()
{
    sed 's/^gpio:/&\n  again: {kind: start, chip: gpiochip0, line: 0}/' \
        "$dir/plain/rig.yaml" >"$dir/twice.yaml"
    "$slew" run --real --yes "$dir/twice.yaml" "$dir/plain/move.yaml" \
        >"$dir/twice.out" 2>&1
    status=$?
    say "is the same as line" "$dir/twice.out" && [ $status -eq 2 ]
}

#---- the switch on the rail

# Pressed from -10 mm down: the axis stands at 150 mm, which its drive calls 0.
home()
{
    /usr/bin/python3 tests/vm/switch.py $bus $node "$chip/sim_gpio$HOME_SWITCH/pull" \
        -16000 >"$dir/switch.out" &
    switch=$!
    comes grep ready "$dir/switch.out"
    "$slew" home --real --yes "$dir/homing/rig.yaml" >"$dir/home.out" 2>&1
    status=$?
    kill $switch
    wait $switch
    cat "$dir/home.out" "$dir/switch.out"
    [ $status -eq 0 ] && [ "$(grep -c pressed "$dir/switch.out")" -eq 2 ] &&
        awk '$1 == "slide" && $NF == "homed" { found = 1
                off = $3 - 160 }
            END { exit !(found && off > -1 && off < 1) }' "$dir/home.out" &&
        at_rest
}

no_switch()
{
    set_line $HOME_SWITCH pull-down
    "$slew" home --real --yes "$dir/homing/rig.yaml" >"$dir/home.out" 2>&1
    status=$?
    [ $status -eq 1 ] &&
        say "was not met within the search distance" "$dir/home.out" && at_rest
}

all() # all CLAIM-SUFFIX
{
    serve "$dir/plain"
    claim "shutter, flash and lamp on their lines$1" triggers
    claim "e-stop in mid-move$1" estop
    claim "an e-stop that is over at once$1" estop_blip
    claim "no torque while the e-stop is pressed$1" no_torque_while_pressed
    claim "the limit switch ahead in mid-move$1" limit_ahead
    claim "the limit switch behind: at the turn$1" limit_behind
    claim "lines that another one has are refused$1" taken
    claim "one line by two names is refused$1" twice
    claim "all lines again$1" triggers
    unserve
    serve "$dir/homing"
    claim "home switch$1" home
    unserve
    serve "$dir/homing"
    claim "a home switch that never comes$1" no_switch
    unserve
}

write_rigs
set_line $HIGH pull-up
preload "$slew" candump cansend /usr/bin/python3
all ", $("$slew" doctor --for 0 | sed -n 's/.*\(libgpiod [0-9.]*\).*/\1/p')"
claims_end
