#!/bin/sh
# tests/firmware/linux/batch.sh - a batch gives the same bytes on one process or
# three, in shards that are joined, and when it was killed and goes on.
#
# Gains nothing from sanitizers.
set -eu
slew=${SLEW:-build/slew}
dir=$(mktemp -d)
trap 'rm -rf "$dir"' EXIT
move=tests/data/fmu

fail()
{
    echo "batch.sh: $*"
    exit 1
}

batch() # batch NAME WORDS...: of 40 runs, to NAME.csv
{
    to=$1
    shift
    "$slew" batch --vary '*.mass=0.5..4,pan.friction=0..60,pan.delay=0..1 ms' \
        --runs 40 --seed 7 --out "$dir/$to.csv" "$@" "$move" >"$dir/said" \
        2>"$dir/err"
}

batch one --jobs 1 || fail "one process: $(cat "$dir/err")"
batch three --jobs 3 --parquet "$dir/three.parquet" --plot "$dir/three.svg" ||
    fail "three processes: $(cat "$dir/err")"
cmp "$dir/one.csv" "$dir/three.csv" || fail "three processes: other bytes"
[ "$(wc -l <"$dir/one.csv")" -eq 41 ] || fail "$(wc -l <"$dir/one.csv") lines"
[ "$(cut -d, -f4 "$dir/one.csv" | sort -u | wc -l)" -eq 41 ] ||
    fail "masses are not drawn for every run"
[ "$(head -c 4 "$dir/three.parquet")$(tail -c 4 "$dir/three.parquet")" = \
    PAR1PAR1 ] || fail "three.parquet"
grep -q "</svg>" "$dir/three.svg" || fail "three.svg"

for k in 1 2 3; do
    batch "shard$k" --shard $k/3 || fail "shard $k: $(cat "$dir/err")"
done
"$slew" batch --merge --out "$dir/all.csv" "$dir"/shard[123].csv >"$dir/said" ||
    fail "merge: status $?"
cmp "$dir/one.csv" "$dir/all.csv" || fail "shards: other bytes"
status=0
"$slew" batch --merge --out "$dir/part.csv" "$dir"/shard[12].csv >"$dir/said" ||
    status=$?
[ "$status" -eq 1 ] || fail "a shard is missing: status $status, expected 1"
grep -q "^13 runs of the batch are missing" "$dir/said" || fail "$(cat "$dir/said")"

# Killed with some runs done, and a line cut short: the next one goes on.
killed() # one try; false: it was done before it could be killed
{
    rm -f "$dir/killed.csv" "$dir/killed.csv.runs"
    batch killed --jobs 1 &
    run=$!
    at=0
    until [ "$at" -ge 600 ] || { [ -e "$dir/killed.csv.runs" ] &&
        [ "$(wc -l <"$dir/killed.csv.runs")" -ge 4 ]; }; do
        sleep 0.02
        at=$((at + 1))
    done
    # slew, below the shell that runs the function
    pkill -KILL -P "$run" || { wait "$run" && return 1; }
    if wait "$run"; then return 1; fi
}
try=0
until killed; do
    try=$((try + 1))
    [ "$try" -lt 10 ] || fail "could not be killed while it was running"
done
[ ! -e "$dir/killed.csv" ] || fail "a killed batch left killed.csv"
printf 'b00' >>"$dir/killed.csv.runs"
at=0 # its processes end with it
until batch killed; do
    if [ "$at" -ge 100 ] || ! grep -q "another slew is writing it" "$dir/err"; then
        fail "going on: $(cat "$dir/err")"
    fi
    sleep 0.1
    at=$((at + 1))
done
grep -q "runs are done, going on" "$dir/said" || fail "it began anew"
cmp "$dir/one.csv" "$dir/killed.csv" || fail "after a kill: other bytes"
[ ! -e "$dir/killed.csv.runs" ] || fail "killed.csv.runs is left"

# Of another seed: not mixed.
head -5 "$dir/one.csv" >"$dir/other.csv.runs"
status=0
"$slew" batch --vary 'pan.mass=1..2' --runs 40 --out "$dir/other.csv" "$move" \
    >"$dir/said" 2>"$dir/err" || status=$?
[ "$status" -eq 2 ] || fail "another batch's journal: status $status"
