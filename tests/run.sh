#!/bin/sh
# tests/run.sh LOGDIR TEST... - run every test, then say how many claims held.
#
# A TEST is a cmocka program, whose claims are counted from its output, or a
# script, which is one claim.  All run even when one fails.  What a test says
# goes to LOGDIR/<name>.log and is shown when it failed (V=1: always).
set -eu
log=$1
shift
mkdir -p "$log"
export CMOCKA_MESSAGE_OUTPUT=stdout
export LSAN_OPTIONS=suppressions=tests/lsan.supp:print_suppressions=0
passed=0 failed=0 skipped=0

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

for test in "$@"; do
    name=$(basename "$test" .sh)
    out=$log/$name.log
    status=0
    timeout "${TEST_TIMEOUT:-300}" "$test" >"$out" 2>&1 || status=$?
    case $test in
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
    if [ "$bad" -gt 0 ] || [ -n "${V:-}" ]; then
        cat "$out"
    fi
    printf '  %-28s %4d passed' "$name" "$ok"
    [ "$bad" -eq 0 ] || printf ', %d FAILED (exit status %d)' "$bad" "$status"
    echo
    passed=$((passed + ok)) failed=$((failed + bad))
    skipped=$((skipped + skip))
done
[ "$skipped" -eq 0 ] || echo "$skipped skipped"
echo "$passed passed, $failed failed"
[ "$failed" -eq 0 ]
