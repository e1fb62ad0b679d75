# tests/support/servos.sh - for scripts: simulated servos in another process.
#
# SLEW is the program; $sim is their process, or empty: the caller's EXIT trap calls
# gone.
sim=

# servos FILE: those of a rig file, once they say where they are, in FILE.said.
servos()
{
    : >"$1.said" # not that of servos before these
    "$SLEW" sim "$1" >"$1.said" 2>&1 &
    sim=$!
    for _ in $(seq 300); do
        ! grep -q ' on ' "$1.said" || return 0
        kill -0 "$sim" 2>/dev/null || break
        sleep 0.1
    done
    echo "no servos:"
    cat "$1.said"
    return 1
}

terminal_of() # terminal_of FILE
{
    sed -n 's/.* on terminal \([^:]*\):.*/\1/p' "$1.said"
}

port_of() # port_of FILE
{
    sed -n 's/.* port \([0-9]*\):.*/\1/p' "$1.said"
}

gone() # also where they were paused
{
    [ -z "$sim" ] || kill -KILL "$sim" 2>/dev/null || true
    wait "$sim" 2>/dev/null || true
    sim=
}
