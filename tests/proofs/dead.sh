#!/bin/sh
# tests/proofs/dead.sh OUT OBJECT... - link all of the product and print the functions
# and tables that the link leaves out.  CC, LIBRARIES; BOARDS: the folder of the objects
# that an image has beside the product's, what these call is called; IMAGES: the images;
# NARROW: objects of the product for 32 bits, what only these call is called.
set -eu
export LC_ALL=C

out=$1
shift
nm --defined-only "$@" | awk '$2 ~ /[TDRB]/ { print $3 }' | sort -u >"$out.global"
{
    echo main
    grep -E '^fmi[23][A-Z]' "$out.global"
    grep -hoE '^ +[a-z][a-z0-9_]*;' firmware/library/slew.map
    # the page's planner: what its module is made of, and what the page calls of it
    grep -hoE 'module_[a-z_]+|memory_fail' firmware/studio/wasm/module.c
    grep -hoE 'studio_[a-z_]+' firmware/studio/wasm/planner.mjs
    # what the proof of the schema reads of the rows (make schema)
    grep -hoE '[a-z_]+\[\]' firmware/host/yaml/yaml_shapes.h
    nm -u "$BOARDS"/*.o
    # shellcheck disable=SC2086
    nm -u $NARROW | sort -u >"$out.narrow"
    nm -u "$@" | sort -u | comm -23 "$out.narrow" -
} | grep -oE '[A-Za-z_][A-Za-z0-9_]*' | sort -u | comm -12 - "$out.global" |
    sed 's/^/-Wl,-u,/' >"$out.args"
# shellcheck disable=SC2046,SC2086
$CC -o "$out.program" $(cat "$out.args") "$@" $LIBRARIES -Wl,--gc-sections \
    -Wl,--print-gc-sections,-z,muldefs,--unresolved-symbols=ignore-all 2>"$out.left"

# NAME FILE of each section that is left out, and of each that there is.
named='s/\.[0-9]+ / /; s/^\.(text|rodata|bss|data(\.rel(\.ro)?(\.local)?)?)\.([A-Za-z_][A-Za-z0-9_]*) /\5 /p'
sed -nE "s/.*removing unused section '([^']*)' in file '(.*)'/\1 \2/p" "$out.left" |
    sed -nE "$named" | sort -u >"$out.removed"
for object; do
    objdump -h "$object" | awk -v file="$object" '$1 ~ /^[0-9]+$/ { print $2, file }'
done | sed -nE "$named" | sort -u | comm -23 - "$out.removed" | cut -d' ' -f1 |
    sort -u >"$out.kept"

# What a header defines is in every file that includes it, and kept once it is kept in
# one; what a system's header defines is not ours.
words='[A-Za-z_][A-Za-z0-9_]*'
grep -rhoE --include='*.h' "$words" motion hal sim firmware | sort -u |
    comm -12 - "$out.kept" >"$out.shared"
grep -rhoE --include='*.[ch]' "$words" motion hal sim firmware | sort -u >"$out.ours"
# A compiler puts the value of a static constant where it is used, and says which static
# ones have no use at all.
nm --defined-only "$@" | awk '$2 ~ /[TtDRB]/ { print $3 }' | sort -u >"$out.named"
join -v 1 "$out.removed" "$out.shared" | join - "$out.ours" | join - "$out.named" |
    sort -u -k 1,1 >"$out.dead"
# A board's own objects are linked into its image alone.
nm --defined-only "$BOARDS"/*.o | awk '$2 ~ /[TtDdRrBb]/ && $3 !~ /[$.]/ { print $3 }' |
    sort -u >"$out.board"
# shellcheck disable=SC2086
nm $IMAGES | awk '{ print $NF }' | sort -u | comm -23 "$out.board" - |
    sed 's/$/ image/' >>"$out.dead"
awk '{ print "dead: " $1 " (" $2 ")" }' "$out.dead"
echo "dead: $(wc -l <"$out.kept") functions and tables kept, $(wc -l <"$out.dead") that" \
    "only tests use"
[ ! -s "$out.dead" ]
