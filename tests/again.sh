#!/bin/sh
# tests/again.sh SLEW run ... - a move on the clock of a machine that others use
# too.
#
# Where it stopped because that machine lost ticks, which is right of it, it is run
# again, five times at most.  For no other reason, and what it says is shown.
set -u
dir=$(mktemp -d)
trap 'rm -rf "$dir"' EXIT
trap 'exit 130' INT TERM

for _ in 1 2 3 4 5; do
    { "$@"; echo $? >"$dir/status"; } | tee "$dir/out"
    status=$(cat "$dir/status")
    [ "$status" -eq 1 ] && grep -q "ticks were lost" "$dir/out" || break
    echo "again.sh: this machine was busy with something else; once more"
done
exit "$status"
