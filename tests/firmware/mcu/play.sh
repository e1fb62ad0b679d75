#!/bin/sh
# tests/firmware/mcu/play.sh - examples on the images in QEMU: compiled, sent over
# Modbus, played; every set point is that of `slew run`.
#
# A machine that is busy with something else may send too late what a small
# window needs.  The board then stops and says so, which is right of it, and the
# move is played again, three times at most.  For no other reason.
set -eu

STACK=12288 # bytes of an image's: image_stack of firmware/mcu/board/*.ld
dir=$(mktemp -d)
trap 'rm -rf "$dir"' EXIT

painted() # painted BOARD FILE: keep what was used of the stack, for `make firmware`
{
    cat "$2"
    free=$(sed -n 's/.* \([0-9]*\) words of stack never used.*/\1/p' "$2")
    echo $((STACK - 4 * free)) >"$IMAGES/$1.painted"
}

play() # play BOARD MACHINE EXAMPLE DAMAGED-PER-EIGHT
{
    rig=examples/$3/rig.yaml
    "$SLEW" compile --out "$dir/$3.slt" "examples/$3" >/dev/null
    "$SLEW" run "$rig" "$dir/$3.slt" --telemetry "$dir/$3.csv" >/dev/null 2>&1
    for _ in 1 2 3; do
        printf '%s, %s: ' "$1" "$3"
        timeout 120 tests/firmware/mcu/qemu.sh "$IMAGES/$1.elf" "$2" \
            "$PLAY" "$rig" "$dir/$3.slt" "$dir/$3.csv" "$4" >"$dir/$3.said" 2>"$dir/$3.error" &&
            painted "$1" "$dir/$3.said" && return
        cat "$dir/$3.error"
        grep -q "the move was not read in time" "$dir/$3.error" || return 1
    done
    return 1
}

# A move that a window holds as a whole, and, on the small board, a longer one.
# What is streamed has a time to be there by: a damaged frame before every fourth
# piece.  Both wait more than they work: side by side.
play mps2_an386 mps2-an386 odrive 320 >"$dir/whole" &
whole=$!
bad=0
play netduinoplus2 netduinoplus2 flyby 2 || bad=1
wait $whole || bad=1
cat "$dir/whole"
exit $bad
