#!/bin/sh
# tests/firmware/mcu/processors.sh COMMAND... - every example that a board can
# play, on its portable parts on other processors and in their own time: the
# checksum of every tick's set points is that of `slew run`.
#
# Each command plays the move in FILE (QEMU_PLAY_RUN of tests/qemu/qemu.mk); SLEW
# and PACK are in the environment.  What a board has no drive, no output or too few axes for is
# named with the reason; nothing else is left out.
set -eu

dir=$(mktemp -d)
trap 'rm -rf "$dir"' EXIT

pack() # pack EXAMPLE: what `slew run` does with it, and the move as FILE
{
    rig=examples/$1/rig.yaml
    "$SLEW" compile --out "$dir/slt" "examples/$1" &&
        "$SLEW" run "$rig" "$dir/slt" --telemetry "$dir/csv" &&
        "$PACK" "$rig" "$dir/slt" "$dir/csv" >"$dir/move"
}

# on COMMAND OUT: no word if it went well
on()
{
    timeout 300 sh -c "$(echo "$1" | sed "s|FILE|$dir/move|")" </dev/null >"$2" 2>&1 ||
        echo "$name: $(cat "$2"): $1" | tee -a "$dir/failed"
}

examples=0
for rig in examples/*/rig.yaml; do
    name=$(basename "${rig%/rig.yaml}")
    if ! pack "$name" >"$dir/out" 2>&1; then
        echo "$name: not played: $(tail -1 "$dir/out")"
        grep -Eq "by its own profile|more than 6 axes" "$dir/out" || echo "$name" >>"$dir/failed"
        continue
    fi
    examples=$((examples + 1))
    number=0
    for command in "$@"; do
        number=$((number + 1))
        on "$command" "$dir/out$number" &
    done
    wait
done
[ ! -e "$dir/failed" ] || exit 1
echo "$examples examples on $# processors: the set points of every tick are the PC's"
