#!/bin/sh
# tests/support/run.sh LOGDIR TEST... - run every test, then say how many claims held.
#
# A TEST is a cmocka program, whose claims are counted from its output, or a
# script, which is one claim.  All run even when one fails.  What a test says goes
# to LOGDIR/<name>.log and is shown when it failed (V=1: always).
set -eu
export CMOCKA_MESSAGE_OUTPUT=stdout
export LSAN_OPTIONS=suppressions=tests/proofs/lsan.supp:print_suppressions=0

# Claims that were started, held, and were skipped.  Between the first and the
# last line of a group each mark stands once; after it cmocka repeats some.
claims()
{
    awk '/\[=+\] Running/ { on = 1 }
        /\[=+\] .* run\.$/ { on = 0 }
        on && /\[ RUN      \] / { run++ }
        on && /\[       OK \] / { ok++ }
        on && /\[  SKIPPED \] / { skip++ }
        END { print run + 0, ok + 0, skip + 0 }' "$1"
}

# One test; its counts go to <name>.count, what is said of it in one piece.
one()
{
    name=$(basename "$1" .sh)
    out=$log/$name.log
    status=0
    began=$(date +%s)
    timeout "${TEST_TIMEOUT:-600}" "$1" >"$out" 2>&1 || status=$?
    took=$(($(date +%s) - began))
    case $1 in
    *.sh) run=1 ok=$((status == 0)) skip=0 ;;
    *)
        read -r run ok skip <<COUNTS
$(claims "$out")
COUNTS
        ;;
    esac
    bad=$((run - ok - skip))
    # A test that died or leaked outside its claims, or made none.
    if [ "$bad" -le 0 ] && { [ "$status" -ne 0 ] || [ "$run" -eq 0 ]; }; then
        bad=1
    fi
    said=$(printf '  %-28s %4d passed' "$name" "$ok")
    [ "$took" -lt 5 ] || said=$(printf '%s %6d s' "$said" "$took")
    [ "$bad" -eq 0 ] || said="$said, $bad FAILED (exit status $status)"
    if [ "$bad" -gt 0 ] || [ -n "${V:-}" ]; then
        said=$(cat "$out"; echo "$said")
    fi
    printf '%s\n' "$said"
    echo "$ok" "$bad" "$skip" >"$log/$name.count"
    times >"$log/$name.times"
}

if [ "$1" = --one ]; then
    log=$2
    one "$3"
    exit 0
fi

log=$1
shift
mkdir -p "$log"
rm -f "$log"/*.count "$log"/*.times
# What their sources say of themselves: those that read the real clock wait more
# than they work, two per processor, and have a processor whenever they ask for one;
# those that only compute have the rest.  Of both the long ones begin, so that none is
# left over.
marked() # marked TEXT TEST...: those whose source has it
{
    text=$1
    shift
    for test; do
        source=tests/${test#*tests/}
        [ -e "$source" ] || source=$source.c
        ! grep -qF "$text" "$source" || echo "$test"
    done
}
long_first() # the tests on stdin
{
    cat >"$log/now"
    grep -xF -f "$log/long" "$log/now" || true
    grep -vxF -f "$log/long" "$log/now" || true
}
marked 'Takes long.' "$@" >"$log/long"
marked 'Reads the real clock.' "$@" | long_first >"$log/clock"
printf '%s\n' "$@" | grep -vxF -f "$log/clock" | long_first >"$log/computes"
processes=${PROCESSES:-$(nproc)}
each() # each PROCESSES [PRIORITY...]: the tests on stdin, so many at a time
{
    count=$1
    shift
    xargs -r -P "$count" -n 1 "$@" "$0" --one "$log"
}
each $((2 * processes)) <"$log/clock" &
each "$processes" nice -n 19 <"$log/computes"
wait $!
# One of these that failed may have been paused by the machine for longer than it
# waits: once more, alone, and both runs are shown.
while read -r test; do
    read -r _ bad _ <"$log/$(basename "$test" .sh).count"
    [ "$bad" -eq 0 ] || { echo "  once more, alone:"; one "$test" </dev/null; }
done <"$log/clock"
# Their own time, which a loaded machine does not change: of the children of the
# shell that ran them, "0m1.25s 0m0.10s" in the second line.
if [ $# -gt 10 ]; then
    echo "most processor time, s:"
    awk 'FNR == 2 { split($1 "m" $2, t, /m|s/)
                    name = FILENAME; sub(".*/", "", name); sub("[.]times", "", name)
                    printf "  %-28s %6.1f\n", name, 60 * t[1] + t[2] + 60 * t[4] + t[5] }' \
        "$log"/*.times | sort -k2 -rn | sed 10q
fi
awk -v tests=$# '{ passed += $1; failed += $2; skipped += $3 }
     END { failed += tests - NR    # died without a word
           if (skipped > 0) print skipped " skipped"
           print passed + 0 " passed, " failed + 0 " failed"
           exit failed > 0 }' "$log"/*.count
