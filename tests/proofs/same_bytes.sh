#!/bin/sh
# same_bytes.sh DIRECTORY SLEW ...: what each of these programs, made by other
# compilers, records of the same moves: the same bytes, as often as it is run.
set -eu

directory=$1
shift
mkdir -p "$directory"
status=0

# record SLEW MOVE TO
record() {
    "$1" run --telemetry "$3.csv" --can-log "$3.log" "$2" >"$3.out" 2>&1 ||
        { cat "$3.out"; exit 1; }
}

for move in dolly odrive modbus orbit payload; do
    record "$1" "examples/$move" "$directory/$move-first"
    for slew in "$@"; do
        to=$directory/$move
        record "$slew" "examples/$move" "$to"
        for kind in csv log; do
            cmp "$directory/$move-first.$kind" "$to.$kind" || {
                echo "$slew: $move.$kind is not what $1 wrote first"
                status=1
            }
        done
    done
done
test $status = 0 && echo "$#" programs, the same telemetry and frames
exit $status
