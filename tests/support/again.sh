#!/bin/sh
# tests/support/again.sh COMMAND ... - a move on the clock of a machine that others use too.
#
# Where it stopped and says that ticks were lost (slew ends with it, or a drive did
# because our silence was longer than its watchdog), which is right of it, it is run
# again, five times at most.  For no other reason, and what it says is shown.
set -u
dir=$(mktemp -d)
trap 'rm -rf "$dir"' EXIT
trap 'exit 130' INT TERM

for _ in 1 2 3 4 5; do
    { "$@"; echo $? >"$dir/status"; } | tee "$dir/out"
    status=$(cat "$dir/status")
    [ "$status" -eq 1 ] &&
        grep -qE "ticks were lost|ticks, [1-9][0-9]* lost" "$dir/out" || break
    echo "again.sh: this machine was busy with something else; once more"
done
exit "$status"
