#!/bin/sh
# tests/firmware/linux/demo.sh - the demo from end to end: $SLEW runs examples/dolly twice.
set -eu
slew=${SLEW:-build/slew}
dir=$(mktemp -d)
trap 'rm -rf "$dir"' EXIT

fail()
{
    echo "demo.sh: $*"
    exit 1
}

for i in 1 2; do
    "$slew" run examples/dolly --telemetry "$dir/$i.csv" \
        --plot "$dir/$i.png" >"$dir/$i.out" 2>"$dir/$i.err" ||
        fail "status $?: $(cat "$dir/$i.out" "$dir/$i.err")"
done

# The same bytes each time.
cmp "$dir/1.csv" "$dir/2.csv" || fail "telemetry differs between two runs"
cmp "$dir/1.png" "$dir/2.png" || fail "pictures differ between two runs"

# It says what it will do, how far it is, and what came out.
for text in "set point every 1 ms" "done after 24.000 s" "bus load: can0"; do
    grep -q "$text" "$dir/1.out" || fail "no \"$text\" in $(cat "$dir/1.out")"
done
grep -q "50 %  12.0 s left" "$dir/1.err" || fail "no progress"
for axis in dolly pan tilt focus; do
    grep -Eq "^$axis .* s .* %" "$dir/1.out" || fail "no result for $axis"
done

# A row per tick of the move, a picture that is one.
rows=$(grep -c ',move,' "$dir/1.csv")
[ "$rows" -eq 24000 ] || fail "$rows rows of the move, expected 24000"
[ "$(head -c 4 "$dir/1.png" | tail -c 3)" = PNG ] || fail "no picture"

# Every axis ends at its last key, in the plan to the bit.
"$slew" sample --rate 1000 --from 24s examples/dolly | tail -n 1 >"$dir/end"
[ "$(cat "$dir/end")" = "24000000000,2310,0,0,48,0,0,-10,0,0,262,0,0" ] ||
    fail "the plan ends at $(cat "$dir/end")"

# Nothing is left over.
[ "$(ls "$dir" | wc -l)" -eq 9 ] || fail "leftovers: $(ls "$dir")"
