#!/bin/sh
# tests/bench/latency.sh - how late the ticks of a service come, beside cyclictest.
#
#   SLEW=build/slew SECONDS_LONG=20 tests/bench/latency.sh
#
# Both wake every ms for the same time, at priority 40, memory locked, each on a
# processor of its own where there are two, and then each on the other's, as one
# processor may be disturbed more than the other: once while the service stands idle,
# torque off, and once while it plays a move, again and again.  What is compared is the
# mean of the two.  Its drives are simulated, which is work that real ones do not need.
set -eu
long=${SECONDS_LONG:-20}
command -v cyclictest >/dev/null || {
    echo "latency.sh: no cyclictest, expected the package rt-tests"
    exit 1
}
dir=$(mktemp -d)
run=
trap 'kill $run 2>/dev/null || true; wait; rm -rf "$dir"' EXIT
export SLEW_RUN_DIR="$dir"
last=$(($(nproc) - 1))

move='axes: {dolly: {curve: s-curve, keys: [[0 s, 120 mm], [4 s, 240 mm], [8 s, 120 mm]]}}'

say() # say COMMAND...: lines for the service, each answered by yes
{
    { printf '%s\n' "$@"; sleep 1; } | "$SLEW" service send examples/dolly >"$dir/said" ||
        return 1
    ! grep -F '"ok":false' "$dir/said"
}

# All but one in a thousand within so many whole us, rounded up as slew does.
cyclic() # cyclic: of the histogram
{
    awk '/^[0-9]/ { us[++n] = $1; count[n] = $2; all += $2 }
        END { for (i = n; i > 0 && (later += count[i]) * 1000 <= all;) i--
              print us[i] + 1 }' "$dir/cyclic"
}

figure() # figure NAME: of the service
{
    tr -d '\t,' <"$dir/status" | sed -n "s/^\"$1\"://p" | head -n 1
}

up() # up PROCESSOR: a service of its own for each measurement
{
    : >"$dir/begun"
    "$SLEW" service run --sim --cpu "$1" examples/dolly >"$dir/begun" &
    run=$!
    while [ ! -s "$dir/begun" ]; do
        kill -0 "$run"
        sleep 0.1
    done
}

until_state() # until_state STATE
{
    for _ in $(seq 100); do
        "$SLEW" service status --json examples/dolly >"$dir/status"
        ! grep -qE "\"state\":[[:space:]]\"$1\"" "$dir/status" || return 0
        sleep 0.1
    done
    echo "latency.sh: the service is not $1: $(figure fault)"
    exit 1
}

play() # play: there and back without end
{
    say '{"command": "take"}' '{"command": "enable"}'
    until_state ready
    say '{"command": "take"}' "{\"command\": \"load\", \"text\": \"$move\"}"
    say '{"command": "take"}' '{"command": "approach"}'
    until_state ready
    say '{"command": "take"}' '{"command": "start", "times": 0}'
    until_state moving
}

measure() # measure WHAT PROCESSOR OTHER: the service on one beside cyclictest on the other
{
    cyclictest -m -q -t 1 -a "$3" -p 40 -i 1000 -D "$long" -h 20000 >"$dir/cyclic"
    until_state "$1"
    echo "$(cyclic) $(figure late_us_p999)" >>"$dir/$1"
    tail -n 1 "$dir/$1" | awk -v what="$1" -v cpu="$2" -v ticks="$(figure ticks)" \
        -v lost="$(figure ticks_lost)" -v faults="$(figure page_faults)" '{
        printf "  %-8s slewd on processor %d: cyclictest %d, slewd %d; " \
               "%d ticks, %d lost, %d page faults\n", what, cpu, $1, $2, ticks, lost, faults }'
    kill "$run"
    wait "$run" || true
    run=
}

ratio() # ratio WHAT
{
    awk -v what="$1" '{ b += $1; a += $2 }
        END { printf "  %-8s ratio %.2f, wanted 1.5 at most\n", what, a / b }' "$dir/$1"
}

echo "wake-ups every ms for $long s: all but 1 in 1000 within, us"
for place in "$last 0" "0 $last"; do
    cpu=${place% *} other=${place#* }
    up "$cpu"
    measure off "$cpu" "$other"
    up "$cpu"
    play
    measure moving "$cpu" "$other"
done
ratio off
ratio moving
