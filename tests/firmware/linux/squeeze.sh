#!/bin/sh
# tests/firmware/linux/squeeze.sh - little memory, no disk, a kill: $SLEW says a sentence, leaves
# nothing half behind, and what a killed run has recorded can be read.
#
# Takes long.
set -eu
ulimit -c 0
slew=${SLEW:-build/slew}
dir=$(mktemp -d)
run=
trap 'test -z "$run" || kill -9 "$run" 2>/dev/null || true; rm -rf "$dir"' EXIT

fail()
{
    echo "squeeze.sh: $*"
    exit 1
}

move="examples/dolly"
one="examples/gallery" # a move of one axis
{
    echo t,dolly
    seq 0 99 | awk '{ print $1 "," 120 + 5 * $1 }'
} >"$dir/in.csv"

# --- memory ---

# Of a program with sanitizers neither says anything.
if ! nm "$slew" | grep -q __asan_init; then
    bss=$(size "$slew" | awk 'NR == 2 { print $3 }')
    [ "$bss" -lt 1000000 ] || fail "$bss bytes of bss, expected below 1 MB"
    # What make demo runs.
    peak=$(python3 - "$slew" run "$move" --telemetry "$dir/d.csv" \
        --plot "$dir/d.png" <<'PEAK'
import os, subprocess, sys
run = subprocess.Popen(sys.argv[1:], stdout=subprocess.DEVNULL,
                       stderr=subprocess.DEVNULL)
_, status, usage = os.wait4(run.pid, 0)
print(usage.ru_maxrss if status == 0 else "failed")
PEAK
    )
    [ "$peak" -lt 24000 ] || fail "the demo: $peak kB resident, expected below 24 MB"
    while read -r words; do
        want=0
        # shellcheck disable=SC2086 # words
        "$slew" $words >/dev/null 2>"$dir/err" </dev/null || want=$?
        got=0
        # shellcheck disable=SC2086
        (ulimit -v 200000 && "$slew" $words) >/dev/null 2>"$dir/err" \
            </dev/null || got=$?
        [ "$got" -eq "$want" ] ||
            fail "200 MB: $words: status $got, expected $want: $(cat "$dir/err")"
    done <<COMMANDS
check $move
plan $move
sample --rate 10 $move
plot --out $dir/m.png $move
run $move
run --telemetry $dir/m.csv --can-log $dir/m.log --plot $dir/m.svg examples/dolly
run --modbus-log $dir/m.pcap examples/modbus
otg --to 1 --vmax 1 --amax 1 --jmax 1
gallery --out $dir/m.md $one
import csv --rig examples/dolly/rig.yaml --out $dir/m.yaml $dir/in.csv
export csv --fps 24 --out $dir/m2.csv $move
compile --out $dir/m.slt $move
sim --for 100ms examples/modbus
drive info examples/dolly pan
drive lss examples/dolly scan
off examples/modbus
home examples/dolly
jog examples/dolly pan +1deg
monitor --once examples/dolly
scan examples/dolly
doctor --for 0s
COMMANDS
fi

# --- no room on the disk ---

rm -f "$dir"/m*
mkdir "$dir/out"

# refused HOW TEXT PATH COMMAND...: status 3, one sentence with PATH and TEXT, and
# nothing left but what a run has recorded.
refused()
{
    how=$1 text=$2 path=$3
    shift 3
    said=$({
        ($how && exec "$slew" "$@") >/dev/null </dev/null || echo "status $?" >&2
    } 2>&1)
    case $said in
    *"$path: cannot "*"$text"*"status 3") ;;
    *) fail "$how: $*: $said" ;;
    esac
    [ "$(printf '%s\n' "$said" | grep -c "$path: cannot ")" -eq 1 ] ||
        fail "$how: $*: said twice: $said"
    for left in "$dir"/out/*; do
        case $left in
        *"*") continue ;;
        *.csv.partial | *.log.partial | *.pcap.partial) ;;
        *) fail "$how: $*: left $left" ;;
        esac
        [ "$(stat -c %s "$left")" -le 1024 ] || fail "$left is too large"
        rm "$left"
    done
}

limit() { ulimit -f 2; } # blocks of 512 bytes, by SIGXFSZ

while read -r path words; do
    # shellcheck disable=SC2086 # words
    refused limit "File too large" "$dir/out/$path" $words "$dir/out/$path"
    # shellcheck disable=SC2086
    refused true "No such file" "$dir/no/$path" $words "$dir/no/$path"
    # shellcheck disable=SC2086
    refused true "Not a directory" "/dev/null/$path" $words "/dev/null/$path"
    case $path in
    *.svg | *.png | *.md) ;; # by their names pictures, with a folder
    *) # shellcheck disable=SC2086
        refused true "No space left" /dev/full $words /dev/full ;;
    esac
done <<COMMANDS
a.csv run $move --telemetry
a.log run $move --can-log
a.pcap run examples/modbus --modbus-log
a.png run $move --plot
a.svg run $move --plot
a.svg plot $move --out
a.png plot $move --out
a.json plan $move --out
a.slt compile $move --out
a.csv2 export csv --fps 24 $move --out
a.py export blender --fps 24 $move --out
a.yaml import csv --rig examples/dolly/rig.yaml $dir/in.csv --out
a.svg otg --to 1 --vmax 1 --amax 1 --jmax 1 --plot
COMMANDS

# A picture has a name of its own, so it takes a disk that is full: 16 KB, in a
# name space where this user may mount one.
if unshare -rm mount -t tmpfs -o size=16k none "$dir/out" 2>/dev/null; then
    while read -r path words; do
        # shellcheck disable=SC2016,SC2086 # words; the inner shell's own
        unshare -rm sh -c '
            disk=$1 path=$2
            shift 2
            mount -t tmpfs -o size=16k none "$disk"
            head -c 8192 /dev/zero >"$disk/half"
            said=$("$@" "$disk/$path" 2>&1 >/dev/null) && exit 1
            case $said in
            *"$path: cannot "*"$path: cannot "*) ;;
            *"$path: cannot write: No space left on device"*) said= ;;
            esac
            want=half
            [ "$path" != a.csv ] || want="a.csv.partial half" # its rows
            left=$(echo $(ls "$disk"))
            [ -z "$said" ] && [ "$left" = "$want" ] ||
                { echo "$said; left $left" && exit 1; }' \
            full "$dir/out" "$path" "$slew" $words ||
            fail "full disk: $path: $words"
    done <<COMMANDS
a.csv run $move --telemetry
a.svg run $move --plot
a.svg plot $move --out
a.png plot $move --out
a.csv2 export csv --fps 1000 $move --out
COMMANDS
fi

while read -r words; do
    # shellcheck disable=SC2086 # words
    said=$("$slew" $words 2>&1 >/dev/full) && fail "full: $words: status 0"
    case $said in
    *"standard output: No space left on device") ;;
    *) fail "full: $words: $said" ;;
    esac
    # shellcheck disable=SC2086 # nobody reads any more
    (
        sleep 0.1
        status=0
        "$slew" $words 2>"$dir/err" || status=$?
        echo "$status" >"$dir/status"
    ) | :
    [ "$(cat "$dir/status" "$dir/err")" = 3 ] ||
        fail "nobody reads: $words: $(cat "$dir/status" "$dir/err")"
done <<COMMANDS
--help
check $move
check --json $move
plan --segments $move
sample --rate 1000 $move
otg --to 1 --vmax 1 --amax 1 --jmax 1
sim --eds $move
COMMANDS

# --- a kill ---

# On the clock, with a tick that a busy machine keeps.
slow=$dir/slow
cp -r "$move" "$slow"
sed -i 's/^tick: 1 ms /tick: 20 ms /' "$slow/rig.yaml"

begin() # begin ROWS: a run, so many rows of its telemetry in its move
{
    for _ in 1 2 3 4 5; do
        "$slew" run --realtime "$slow" --telemetry "$dir/k.csv" \
            --can-log "$dir/k.log" >"$dir/k.out" 2>"$dir/k.err" &
        run=$!
        until grep -q '^State:.Z' "/proc/$run/status"; do
            rows=$(grep -c ",move," "$dir/k.csv.partial" 2>/dev/null || true)
            [ "${rows:-0}" -lt "$1" ] || return 0
            sleep 0.1
        done
        # Stopped, as this machine was busy with something else.
        wait "$run" || true
        rm -f "$dir/k.csv" "$dir/k.log"
    done
    fail "no run of $1 rows: $(cat "$dir/k.out" "$dir/k.err")"
}

begin 60
# Nobody else writes to what is being written.
said=$("$slew" run "$move" --telemetry "$dir/k.csv" 2>&1 >/dev/null) &&
    fail "two runs wrote one file"
case $said in
*"$dir/k.csv: another program is writing it"*) ;;
*) fail "two runs, one file: $said" ;;
esac
grep -q "telemetry: $dir/k.csv.partial until the end" "$dir/k.out" ||
    fail "the name is not said: $(cat "$dir/k.out")"
kill -9 "$run"
wait "$run" 2>/dev/null || true
run=
[ ! -e "$dir/k.csv" ] && [ ! -e "$dir/k.log" ] || fail "killed, and complete?"
awk -F, 'NR == 1 { columns = NF }
    NF != columns { print "line " NR " has " NF " of " columns; bad = 1 }
    $2 == "move" { rows++ }
    END { if (rows < 50) { print rows " rows"; bad = 1 }; exit bad }' \
    "$dir/k.csv.partial" || fail "telemetry of a killed run"
[ "$(tail -c 1 "$dir/k.csv.partial" | od -An -c | tr -d ' ')" = '\n' ] ||
    fail "the last row is cut"
"$slew" plot --telemetry "$dir/k.csv.partial" --out "$dir/k.svg" "$move" \
    >/dev/null || fail "no plot of a killed run"

# The next run to the same name takes the place of what was left.
"$slew" run "$move" --telemetry "$dir/k.csv" >/dev/null 2>&1 || fail "status $?"
[ -e "$dir/k.csv" ] && [ ! -e "$dir/k.csv.partial" ] || fail "leftovers"
