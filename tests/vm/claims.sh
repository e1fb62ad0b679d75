# tests/vm/claims.sh - to be sourced by checks in the machine: claims and
# how they are counted, programs that run meanwhile, a drive as others see it.
#
# No claim is about how long something takes, and nothing is waited for by a
# time alone: whoever is late is waited for.  While a file of the host is waited
# for the machine has nothing to do, and its clock leaps: so what a script calls
# while an axis moves is in memory, and programs are read before time counts.
# $slew is the program; $dir is for files.
dir=$(mktemp -d)
passed=0 failed=0
mkdir "$dir/bin"
cp /bin/busybox "$dir/bin"
for tool in awk cat cp grep kill mkdir rm sed sleep sort wc xargs; do
    ln -s busybox "$dir/bin/$tool"
done
PATH=$dir/bin:$PATH

claim() # claim NAME COMMAND...
{
    name=$1
    shift
    if "$@" >"$dir/log" 2>&1; then
        passed=$((passed + 1))
        echo "  $name"
    else
        failed=$((failed + 1))
        echo "  $name: FAILED"
        sed 's/^/    /' "$dir/log"
    fi
}

claims_end()
{
    echo "$passed passed, $failed failed"
    [ $failed -eq 0 ]
}

preload() # preload PROGRAM...
{
    for program; do
        command -v "$program"
        ldd "$(command -v "$program")" | grep -o '/[^ ]*'
    done | sort -u | xargs cat >/dev/null
}

say() # say TEXT FILE...: one of the files has the text
{
    grep -q -- "$1" "$2" "${3:-/dev/null}" && return 0
    echo "no \"$1\" in:"
    cat "$@" 2>/dev/null
    return 1
}

comes() # comes COMMAND...: it holds now, or within a minute
{
    tries=0
    until "$@" >/dev/null 2>&1; do
        tries=$((tries + 1))
        [ $tries -le 600 ] || { echo "never: $*"; return 1; }
        sleep 0.1
    done
}

#---- programs

serve() # serve ARGUMENT...: slew sim, until unserve
{
    "$slew" sim "$@" >"$dir/sim.out" 2>&1 &
    sim=$!
    comes grep interrupt "$dir/sim.out"
}

unserve()
{
    kill $sim
    wait $sim
}

# slew run begins, and is let go on once it is in the move; its status is that
# of `wait $run`.
start() # start ARGUMENT...
{
    : >"$dir/run.out"
    "$slew" run --real --yes --telemetry "$dir/run.csv" "$@" >"$dir/run.out" 2>&1 &
    run=$!
    comes grep moving "$dir/run.out" || { cat "$dir/run.out"; return 1; }
}

runs()
{
    kill -0 $run || { cat "$dir/run.out"; return 1; }
}

ended() # ended STATUS: so ends slew run
{
    wait $run
    end=$?
    [ $end -eq "$1" ] && return 0
    echo "status $end"
    cat "$dir/run.out"
    return 1
}

# From the first row of the fault on it is a fault.
latched()
{
    awk -F, 'NR == 1 { for (i = 1; i <= NF; i++) if ($i == "state") c = i }
        NR > 1 && $c == "fault" { on = 1 }
        NR > 1 && on && $c != "fault" { bad++ }
        END { print on + 0, bad + 0; exit !on || bad }' "$dir/run.csv"
}

#---- drive $node on $bus

asked() # asked INDEX: one SDO upload
{
    id=$(printf %X $((0x580 + node)))
    candump -L -n 1 -T 2000 "$bus,$id:7FF" >"$dir/answer" &
    dump=$!
    sleep 0.3
    cansend "$bus" \
        "$(printf %X $((0x600 + node)))#40${1#??}${1%??}0000000000"
    wait $dump
    grep -q . "$dir/answer"
}

# 0xINDEX:0 as 8 hex digits, by other programs.
ask()
{
    asked "$1" || asked "$1" || asked "$1"
    sed -n "s/.*$id#........\\(........\\).*/\\1/p" "$dir/answer"
}

# The axis stands and has no torque.
at_rest()
{
    first=$(ask 6064)
    sleep 1
    second=$(ask 6064)
    status=$(ask 6041)
    echo "6064 $first then $second, 6041 $status"
    [ -n "$first" ] && [ "$first" = "$second" ] || return 1
    [ $((0x${status%??????} & 0x0F)) -ne 7 ] # low byte: operation enabled
}
