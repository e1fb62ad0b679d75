#!/bin/sh
# tests/vm/clock.sh BUILD - inside the machine of boot.sh, whose clock may be set: the
# wall clock goes an hour on, or back, in the middle of a move.
#
# What moves goes by the monotonic clock: the set points are those of a run whose clock
# was left alone, to the bit, and the recording reads back.  The same of a service, whose
# client keeps control and whose jog stops when it is told to.  A start at a time of
# the wall clock goes along with it and says so, and one that is over is not made up for.
set -u
build=${1:-build}
slew=$build/slew
. "${0%/*}/claims.sh"
bus=vcan0 node=1
rig=$dir/rig
hour=3600

# One axis, at a tick that the emulator can keep.
mkdir "$rig"
cat >"$rig/rig.yaml" <<'RIG'
title: One axis
tick: 5 ms
buses:
  can0: {kind: canopen, interface: vcan0, bit_rate: 1 Mbit/s}
axes:
  slide:
    unit: mm
    limits: {position: [-100 mm, 600 mm], velocity: 200 mm/s, acceleration: 400 mm/s2}
    following_error: {floor: 5 mm, time: 50 ms}
    drive: {kind: cia402, bus: can0, node: 1, counts: 4096 per mm}
RIG
cat >"$rig/move.yaml" <<'MOVE'
title: There and back
axes:
  slide: {curve: quintic, keys: [[0 s, 0 mm], [4 s, 300 mm], [8 s, 0 mm]]}
MOVE

set_clock() # set_clock SECONDS: the wall clock, by so much
{
    date -s "$1 seconds" >/dev/null
}

crc() # of all set points that were sent
{
    sed -n 's/^set points: CRC-32 \([0-9a-f]*\).*/\1/p' "$dir/run.out"
}

# A whole move, whose recording has every tick of it; $1 is done in its middle.
whole() # whole NAME COMMAND...
{
    report=$dir/$1.json
    shift
    rm -f "$dir/run.mcap"
    start --record "$dir/run.mcap" "$rig" &&
        comes grep " 25 %" "$dir/run.out" && runs && "$@" && ended 0 &&
        say "done after" "$dir/run.out" && say "ticks, 0 lost" "$dir/run.out" &&
        at_rest && "$slew" report --json "$dir/run.mcap" >"$report" &&
        every_tick
}

# 1601 rows of the move, one every 5 ms, none twice and none left out.
every_tick()
{
    awk -F, 'NR == 1 { for (i = 1; i <= NF; i++) at[$i] = i; next }
        { t = $at["t_ns"]; if (before && t - before != 5000000) bad++
          before = t; rows += $at["phase"] == "move" }
        END { print rows + 0, bad + 0; exit bad || rows < 1600 }' "$dir/run.csv"
}

left_alone()
{
    whole plain true && crc >"$dir/crc" && [ -s "$dir/crc" ]
}

steps() # steps SECONDS
{
    whole stepped set_clock "$1" && [ "$(crc)" = "$(cat "$dir/crc")" ]
}

#---- a service

# A client of the service: its lines go in by a pipe, what it hears is $dir/client.
client()
{
    mkfifo "$dir/in" 2>/dev/null
    "$slew" service send "$rig" <"$dir/in" >"$dir/client" 2>&1 &
    client=$!
    exec 3>"$dir/in"
}

send() # send JSON
{
    printf '%s\n' "$1" >&3
}

served()
{
    : >"$dir/service"
    "$slew" service run --real --yes "$rig" >"$dir/service" 2>&1 &
    service=$!
    comes grep socket "$dir/service" || { cat "$dir/service"; return 1; }
    client
    send '{"id": 1, "command": "take", "lease": 60}'
    comes grep '"id":1,"ok":true' "$dir/client" || { cat "$dir/client" "$dir/service"; return 1; }
    send '{"id": 2, "command": "enable"}'
    comes grep '"state":"ready"' "$dir/client"
}

unserved()
{
    exec 3>&-
    wait $client
    kill $service
    wait $service
}

load()
{
    text=$(sed ':a;N;$!ba;s/\n/\\n/g' "$rig/move.yaml")
    send "{\"id\": 3, \"command\": \"load\", \"text\": \"$text\\n\"}"
    comes grep '"id":3,"ok":true' "$dir/client" || { cat "$dir/client"; return 1; }
}

status() # status WHAT: in the next answer to status
{
    send '{"id": 9, "command": "status"}'
    comes grep '"id":9,' "$dir/client"
    grep '"id":9,' "$dir/client" | tail -n 1 | grep -q "$1"
}

served_steps()
{
    if ! served || ! load; then
        unserved
        return 1
    fi
    send '{"id": 4, "command": "start"}'
    comes grep '"state":"moving"' "$dir/client" && sleep 2
    set_clock $hour
    sleep 2
    set_clock -$((2 * hour))
    sleep 1
    send '{"id": 5, "command": "renew"}'
    comes grep '"id":5,"ok":true' "$dir/client" &&
        comes ended_ready && status '"held":true' && status '"ticks_lost":0'
    came=$?
    set_clock $hour
    [ $came -eq 0 ] || cat "$dir/client" "$dir/service"
    unserved
    return $came
}

# Once at rest after the move: no fault on the way.
ended_ready()
{
    [ "$(grep -c '"state":"ready"' "$dir/client")" -ge 2 ] &&
        ! grep -q '"event":"fault"' "$dir/client"
}

#---- a start at a time of the wall clock

# slew run that waits; its status is that of `wait $run`.
armed() # armed SECONDS: so far ahead
{
    : >"$dir/run.out"
    "$slew" run --real --yes --telemetry "$dir/run.csv" \
        --at "$(date -u -d "@$(($(date +%s) + $1))" +%Y-%m-%dT%H:%M:%SZ)" "$rig" \
        >"$dir/run.out" 2>&1 &
    run=$!
    comes grep homing "$dir/run.out" && sleep 4 && runs
}

never_moved()
{
    awk -F, 'NR == 1 { for (i = 1; i <= NF; i++) at[$i] = i; next }
        $at["phase"] == "move" { bad++ } END { exit bad > 0 }' "$dir/run.csv" &&
        at_rest
}

# Past its time: it neither begins at once nor stays armed.
past()
{
    armed 30 && set_clock $hour && ended 1
    came=$?
    set_clock -$hour
    [ $came -eq 0 ] &&
        say "the wall clock was set past the time of the start" "$dir/run.out" &&
        never_moved
}

# Back: it is said that it will take longer, and it begins by the new time.
back()
{
    armed 15 && set_clock -20 && comes grep "was set by -\(20\|19.9\)" "$dir/run.out" &&
        runs && ! grep -q moving "$dir/run.out" && ended 0
    came=$?
    set_clock 20
    [ $came -eq 0 ] && say "done after" "$dir/run.out" && at_rest
}

# On: so much sooner, as the clock that the start was told by says.
on()
{
    armed 60 && set_clock 20 && comes grep "was set by +\(20\|19.9\)" "$dir/run.out" &&
        runs && ended 0
    came=$?
    set_clock -20
    [ $came -eq 0 ] && say "done after" "$dir/run.out" && at_rest
}

export SLEW_RUN_DIR="$dir"
preload "$slew" candump cansend date
serve --interface vcan0 "$rig"
claim "a move whose clock is left alone" left_alone
claim "the clock goes an hour on in mid-move: the same set points" steps $hour
claim "the clock goes an hour back in mid-move: the same set points" steps -$hour
claim "the same of a service: no tick is lost, and control is kept" served_steps
claim "a start at a time that the clock is set past: nothing moves" past
claim "a start whose clock is set back waits as much longer, and says so" back
claim "a start whose clock is set on comes sooner, and is said" on
unserve
claims_end
