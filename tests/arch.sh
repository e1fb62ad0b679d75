#!/bin/sh
# tests/arch.sh - who may include whom, see docs/ARCHITECTURE.md.
#
# Every include is written from the root, so names alone prove the arrows.
# HOSTED lists the drivers in hal/ that need an operating system.
set -eu
export LC_ALL=C

# Room, what it may include of ours, and what it may include in <>.
# shellcheck disable=SC2016  # the $ are those of regular expressions
rules='
motion/[^/]*        motion/[^/]*                                  freestanding
motion/plan/.*      motion/.*                                     any
hal/.*              hal/.*|motion/(err|fixed).h                   bytes
sim/.*              sim/.*|hal/.*|motion/(err|fixed).h            any
firmware/[^/]*      firmware/[^/]*|motion/[^/]*|hal/(can|gpio|clock|drive|fieldbus).h  bytes
firmware/linux/[^/]*  firmware/linux/commands/command.h           any
tests/.*            .*                                            any
'
# The rooms of the program: each knows itself and those before it.
known=
for room in base yaml rig move exchange machine plot tools commands; do
    known=$known${known:+|}$room
    rules="$rules firmware/linux/$room/.*
           firmware/linux/($known)/.*|firmware/[^/]*|(hal|sim|motion)/.*  any"
done

find motion hal sim firmware tests -name '*.[ch]' 2>/dev/null | sort |
    RULES=$rules awk '
# "bytes" is freestanding and string.h: the compiler itself calls memcpy and
# memset, so every image has them.
function may_include(name) {
    return system_headers == "any" ||
           name ~ /^(std(int|bool|def|arg|align|noreturn)|limits)\.h$/ ||
           (system_headers == "bytes" && name == "string.h")
}

# The line without comments and strings; comments may run over lines.
function code_of(line,    out, at) {
    gsub(/"([^"\\]|\\.)*"/, "\"\"", line)
    out = ""
    while (line != "") {
        at = index(line, in_comment ? "*/" : "/*")
        if (at == 0) {
            if (!in_comment) out = out line
            break
        }
        if (!in_comment) out = out substr(line, 1, at - 1) " "
        line = substr(line, at + 2)
        in_comment = !in_comment
    }
    sub(/\/\/.*/, "", out)
    return out
}

function complain(what) {
    printf "%s:%d: %s\n", file, nr, what
    bad++
}

function check_include(line,    name) {
    name = line
    if (match(line, /"[^"]*"/)) {
        name = substr(line, RSTART + 1, RLENGTH - 2)
        if (system("test -f \"" name "\"") != 0)
            complain("\"" name "\" is not a path from the root")
        else if (name !~ "^(" ours ")$")
            complain("may not know \"" name "\"")
    } else if (match(line, /<[^>]*>/)) {
        name = substr(line, RSTART + 1, RLENGTH - 2)
        if (!may_include(name))
            complain("<" name "> is not a freestanding header")
    } else
        complain("an include must be written out")
}

function find_room(    i) {
    for (i = 1; i <= rules; i++)
        if (file ~ "^(" room[i] ")$") {
            ours = may[i]
            system_headers = hosted[file] ? "any" : angle[i]
            return 1
        }
    return 0
}

BEGIN {
    n = split(ENVIRON["RULES"], word)
    for (i = 1; i <= n; i += 3) {
        room[++rules] = word[i]
        may[rules] = word[i + 1]
        angle[rules] = word[i + 2]
    }
    n = split(ENVIRON["HOSTED"], word)
    for (i = 1; i <= n; i++)
        hosted[word[i]] = 1
}

{
    file = $0
    nr = 0
    in_comment = 0
    files++
    if (!find_room()) {
        complain("belongs to no room")
        next
    }
    integer_only = file ~ /^motion\/[^\/]*$/
    # The one back end whose machines have 128 bits; its twin has halves.
    has_int128 = file == "motion/fixed_int128.h"
    while ((getline line < file) > 0) {
        nr++
        code = code_of(line)
        if (code ~ /^[ \t]*#[ \t]*include/)
            check_include(line)
        if (integer_only &&
            (code ~ /(^|[^A-Za-z0-9_])(float|double)($|[^A-Za-z0-9_])/ ||
             (!has_int128 && code ~ /__u?int128/)))
            complain("motion/ is integer only, and not wider than 64 bits")
    }
    close(file)
}

END {
    printf "arch: %d files, %d violations\n", files, bad
    exit bad > 0
}'
