#!/bin/sh
# tests/proofs/wasm.sh OBJECT... - what the objects for a browser call that is
# not in them: arithmetic, text, the heap, streams that they are given, libyaml
# and cJSON.  Nothing opens a file, a socket or a thread, ends the program, or
# has a stream of its own.
set -eu
export LC_ALL=C

# Of the compiler: wide integers, long double.
allowed='__(multi3|stack_pointer|(add|sub|mul|div)tf3|(gt|lt)tf2|extenddftf2|fixtfdi
    |float(un)?ditf|trunctfdf2)'
# errno is a variable: what strtod leaves there.
allowed="$allowed
    |errno|str(error|to(d|f|l|ll|ul))|is(xdigit)|tolower
    |mem(chr|cmp|cpy|move|set)
    |str(chr|cmp|cspn|len|ncmp|pbrk|rchr|spn|str|casecmp|ncasecmp)
    |a(cos|sin|tan[2h]?)|cos|exp|log|sinh?|tan|cbrt|pow|hypot|fmax|fmin|frexp|ldexpl?|llroundl?
    |malloc|calloc|realloc|free|qsort|v?snprintf"
# Into a stream of the caller's.
allowed="$allowed|fprintf|fputc|fputs|fwrite|fflush|ftell"
# Files that come with the program, in memory (firmware/studio/embedded.h).
allowed="$allowed|embedded_own"
# The end of the heap is the program's to handle (host/base/memory.h).
allowed="$allowed|memory_fail|yaml_(event|parser)_[a-z_]+|cJSON_[A-Za-z]+"
allowed=$(printf '%s' "$allowed" | tr -d ' \n')

llvm-nm --print-file-name "$@" | awk -v allowed="^($allowed)\$" '
{ file = $1; sub(/:$/, "", file) }
$(NF - 1) == "U" { users[$NF] = users[$NF] " " file; next }
{ defined[$NF] = 1 }
END {
    for (name in users) {
        if (name in defined) continue
        outside++
        if (name !~ allowed) {
            printf "wasm: %s calls %s\n", substr(users[name], 2), name
            bad++
        }
    }
    printf "wasm: %d symbols from outside, %d that may not be\n", outside, bad
    exit bad > 0 || outside == 0
}'
