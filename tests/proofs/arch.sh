#!/bin/sh
# tests/proofs/arch.sh - who may include whom, see docs/ARCHITECTURE.md.
#
# Every include is written from the root, so names alone prove the arrows.
set -eu
export LC_ALL=C

# Room, what it may include of ours, and what it may include in <>.
# shellcheck disable=SC2016  # the $ are those of regular expressions
rules='
motion/core/.*      motion/core/.*                                freestanding
motion/number/.*    motion/(core|number)/.*                       freestanding
motion/curve/.*     motion/(core|number|curve)/.*                 freestanding
motion/path/.*      motion/(core|number|curve|path)/.*            freestanding
motion/otg/.*       motion/(core|number|otg)/.*                   freestanding
motion/kinematics/.* motion/(core|number|kinematics)/.*|motion/path/(arclen|head).h freestanding
motion/double/.*    motion/double/.*                              any
motion/plan/topp/.* motion/core/.*|motion/plan/(topp/.*|plan_pool.h)|motion/double/.* any
motion/plan/(keys|rig)/.* motion/(core|number|curve|path|otg|kinematics|double)/.*|motion/plan/([^/]*|keys/.*|rig/.*) any
motion/plan/.*      motion/.*                                     any
tests/.*            .*                                            any
'
rule() # rule ROOM WHAT-OF-OURS SYSTEM-HEADERS
{
    rules="$rules $1 $2 $3
"
}
# hal/ is interfaces at its top; protocols and kinds of drive include these, what
# they share, and numbers.
hal='hal/[^/]*|hal/support/.*|motion/core/(err|fixed).h'
rule 'hal/[^/]*' 'hal/[^/]*|motion/core/(err|fixed).h' bytes
rule 'hal/support/.*' "$hal" bytes
rule 'hal/can/.*' "$hal|hal/can/.*" bytes
rule 'hal/canopen/.*' "$hal|hal/(can|canopen)/.*" bytes
rule 'hal/modbus/.*' "$hal|hal/modbus/.*" bytes
rule 'hal/gpio/.*' "$hal|hal/gpio/.*" bytes
rule 'hal/drive/drive.c' "$hal" bytes
rule 'hal/drive/cia402/.*' "$hal|hal/(can|canopen|drive/cia402)/.*" bytes
rule 'hal/drive/modbus/.*' "$hal|hal/(modbus|drive/modbus)/.*" bytes
# What a board and who moves it say to each other, tracks among it.
mcu="$hal|hal/mcu/.*|motion/core/track.h"
rule 'hal/mcu/.*' "$mcu|hal/modbus/map.h|hal/drive/modbus/drive.h" bytes
rule 'hal/drive/slew_mcu/.*' "$mcu|hal/(modbus|drive/slew_mcu)/.*" bytes
# A kind on a plain CAN bus includes what these have in common, and no other kind.
rule 'hal/drive/turn/.*' "$hal|hal/(can|drive/turn)/.*" bytes
for kind in hal/drive/*/; do
    rule "$kind.*" "$hal|hal/(can|drive/turn)/.*|$kind.*" bytes
done
rule 'hal/linux/.*' "$hal|hal/(can|modbus|gpio|linux)/.*" any
rule 'sim/.*' 'sim/.*|hal/.*|motion/core/(err|fixed).h|motion/double/.*' any
rule 'firmware/control/.*' \
    'firmware/control/.*|motion/(core|number|curve|path|otg)/.*|hal/(can|gpio|clock|drive|fieldbus).h' \
    bytes
rule 'firmware/studio/embedded.h' none freestanding
# The rooms of the program: each includes itself and those before it.
rule 'firmware/linux/[^/]*' 'firmware/linux/commands/command.h' any
# host has neither an operating system nor a simulation; it runs in a browser
# too, but for the plots that cairo draws.
host='hal/([^/]*|(support|can|canopen|modbus|mcu|gpio|drive)/.*)|motion/.*'
known=
for room in library host/base host/timecode host/yaml host/device host/rig host/fault \
    host/track host/move host/job host/exchange host/recording host/plot studio/wasm \
    linux/base linux/xml linux/machine linux/player linux/batch linux/fmu linux/service linux/tools studio/server; do
    known=$known${known:+|}$room
    below='(hal|sim|motion)/.*' headers=any
    case $room in
    host/*) below=$host headers=portable ;;
    studio/server) below="$below|firmware/studio/embedded.h" ;;
    studio/wasm) below="$host|firmware/studio/embedded.h" headers=portable ;;
    esac
    [ "$room" = host/plot ] && headers=any
    rule "firmware/$room/.*" \
        "firmware/($known)/.*|firmware/control/.*|$below" "$headers"
done
# A group of commands includes what all of them share, and no other group.
for group in firmware/linux/commands/ firmware/linux/commands/*/; do
    rule "$group[^/]*" \
        "firmware/($known)/.*|firmware/control/.*|(hal|sim|motion)/.*|(firmware/linux/commands/|$group)[^/]*" \
        any
done
known="$known|linux/commands"
# What other programs load: a simulated rig.
rule 'firmware/fmu/.*' \
    'firmware/(fmu|host/base|linux/fmu)/.*' any
# A board has the controller and drives without an operating system.
rule 'firmware/mcu/.*' \
    'firmware/(mcu|control)/.*|hal/([^/]*|(support|modbus|mcu|drive/(modbus|virtual))/.*)|motion/(core|number)/.*' \
    bytes
# A kind of drive includes the rooms, and no room includes it; of the kinds it includes
# itself and what those that count turns share.
for folder in firmware/host/kind/*/ firmware/linux/kind/*/; do
    kind=$(basename "$folder")
    rooms="$known|(host|linux)/kind/($kind|turn)"
    below='(hal|sim|motion)/.*' headers=any
    # A simulated board is the program of the real one.
    [ "$folder" = firmware/linux/kind/slew_mcu/ ] && below="$below|firmware/mcu/[^/]*"
    case $folder in
    firmware/host/*)
        rooms="host/(base|yaml|device|rig|kind/($kind|turn))"
        below=$host headers=portable
        ;;
    esac
    rule "$folder.*" "firmware/($rooms)/.*|firmware/control/.*|$below" "$headers"
done

find motion hal sim firmware tests -name '*.[ch]' 2>/dev/null | sort |
    RULES=$rules awk '
# "bytes" is freestanding and string.h: the compiler itself calls memcpy and
# memset, so every image has them.  "portable" is what every C library has, and
# the two libraries that read and write text.
function may_include(name) {
    return system_headers == "any" ||
           (system_headers == "portable" &&
            name ~ /^((ctype|errno|inttypes|math|stdatomic|stdio|stdlib|strings?|yaml)\.h|cjson\/cJSON\.h)$/) ||
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
            complain("may not include \"" name "\"")
    } else if (match(line, /<[^>]*>/)) {
        name = substr(line, RSTART + 1, RLENGTH - 2)
        if (!may_include(name))
            complain("<" name "> is not a " \
                     (system_headers == "portable" ? "portable" : "freestanding") \
                     " header")
    } else
        complain("an include must be written out")
}

function find_room(    i) {
    for (i = 1; i <= rules; i++)
        if (file ~ "^(" room[i] ")$") {
            ours = may[i]
            system_headers = angle[i]
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
    integer_only = file ~ /^motion\// && file !~ /^motion\/(plan|double)\//
    # The one back end whose machines have 128 bits; its twin has halves.
    has_int128 = file == "motion/core/fixed_int128.h"
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
