#!/bin/sh
# tests/firmware/linux/start.sh - types what docs/START.md says, and compares what comes.
#
# Every "## " of the page is an empty directory.  A fenced block is the file that was
# last named as `NAME.yaml` or `NAME.csv` above it; one that is "console" has
# commands, after "$ ", and below each what it says, "..." for any lines and at the end of
# a line for the rest of it.  Blanks count as one.  A command with "&" goes on while
# the others run.
set -eu
SLEW=${SLEW:-build/slew}
page=$PWD/docs/START.md
dir=$(mktemp -d)
trap 'rm -rf "$dir"' EXIT
mkdir "$dir/bin"
ln -s "$(realpath "$SLEW")" "$dir/bin/slew"
PATH=$dir/bin:$PATH
export PATH
port=$((20000 + $$ % 10000)) # two of this test can run at one time

# A directory and a script per section.
sed "s/15502/$port/g" "$page" | awk -v dir="$dir" '
    /^## / { section++; to = dir "/" section; system("mkdir " to)
             script = to ".run"; print "name '\''" $0 "'\''" >script; next }
    /^```console/ { console = 1; next }
    /^```/ && console { console = 0; if (said) close(said); said = ""; next }
    /^```/ && file { close(file); file = ""; next }
    /^```/ { file = to "/" name; next }
    console && /^\$ / {
        if (said) close(said)
        commands++; said = dir "/" commands ".said"; printf "" >said
        command = substr($0, 3); background = sub(/ *&$/, "", command)
        kind = background ? "show" : "type_in"
        # a quote of the shell in single quotes
        gsub(/'\''/, "'\''\\'\'''\''", command)
        print kind " " commands " '\''" command "'\''" >script; next }
    console { print >said; next }
    file { print >file; next }
    match($0, /`[a-z0-9]+\.(yaml|csv)`/) {
        name = substr($0, RSTART + 1, RLENGTH - 2) }'

cat >"$dir/lib" <<'LIB'
set -u
jobs=
trap 'for job in $jobs; do kill "$job" 2>/dev/null; done' EXIT
name() { echo "start.sh: $1"; }

# compare N: what came, with what the page says.
compare()
{
    awk 'function plain(text) { gsub(/[ \t]+/, " ", text); sub(/ $/, "", text)
                                return text }
        NR == FNR { want[++wants] = plain($0); next }
        { got[++gots] = plain($0) }
        function fits(w, g,    end) {
            if (w > wants) return g > gots
            if (want[w] == "...") {
                for (; g <= gots + 1; g++) if (fits(w + 1, g)) return 1
                return 0
            }
            if (g > gots) return 0
            end = length(want[w]) - 3
            if (substr(want[w], end + 1) == "...")
                return substr(got[g], 1, end) == substr(want[w], 1, end) &&
                    fits(w + 1, g + 1)
            return got[g] == want[w] && fits(w + 1, g + 1)
        }
        END { while (gots && got[gots] == "") gots--; exit !fits(1, 1) }' \
        "../$1.said" "../$1.out"
}

fail()
{
    echo "start.sh: $2: $3"
    echo "the page says:"
    cat "../$1.said"
    echo "it says:"
    cat "../$1.out" "../$1.err"
    exit 1
}

type_in() # N COMMAND
{
    case $2 in
    "kill %1") kill $jobs; wait $jobs; jobs=; return ;;
    esac
    (eval "$2") >"../$1.out" 2>"../$1.err" </dev/null || fail "$1" "$2" "status $?"
    compare "$1" || fail "$1" "$2" "says something else"
}

show() # N COMMAND: until it says so
{
    : >"../$1.err"
    eval "$2 >../$1.out 2>../$1.err &"
    jobs="$jobs $!"
    for _ in $(seq 100); do
        ! compare "$1" || return 0
        sleep 0.1
    done
    fail "$1" "$2" "says something else"
}
LIB

sections=0
for script in "$dir"/*.run; do
    sections=$((sections + 1))
    (cd "${script%.run}" && cat ../lib "$script" >../all && sh ../all)
done
[ "$sections" -eq 3 ] || { echo "start.sh: $sections sections"; exit 1; }
commands=$(ls "$dir"/*.said | wc -l)
[ "$commands" -ge 10 ] || { echo "start.sh: $commands commands"; exit 1; }
