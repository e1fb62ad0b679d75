#!/bin/sh
# firmware/linux/install/_slew in a real zsh: what Tab makes of a line.
set -eu
command -v zsh >/dev/null || { echo "  FAILED: no zsh; make deps installs it"; exit 1; }
dir=$(mktemp -d)
trap 'rm -rf "$dir"' EXIT
mkdir "$dir/bin" "$dir/site-functions" "$dir/work"
ln -s "$(realpath "$SLEW")" "$dir/bin/slew"
cp firmware/linux/install/_slew "$dir/site-functions/"
touch "$dir/work/rig.yaml"

# A terminal with a zsh in it that has nothing but the completion, and a key
# that writes the line down.
cat >"$dir/rc" <<RC
PROMPT= PATH="$dir/bin:$PATH"
cd "$dir/work"
fpath=("$dir/site-functions" \$fpath)
autoload -Uz compinit && compinit -u -d "$dir/dump"
show() { print -r -- "\$BUFFER" >"$dir/part" && mv "$dir/part" "$dir/line" }
zle -N show
bindkey '^X' show
RC
cat >"$dir/type" <<'TYPE'
zmodload zsh/zpty
zpty shell "TERM=xterm zsh -f -i"
zpty -w shell "source $1/rc; : >$1/ready"
wait_for() {
    local tries=0 said
    until [[ -e $1 ]] || (( tries++ > 600 )); do
        zpty -rt shell said || true
        sleep 0.05
    done
}
wait_for $1/ready
while read -r line; do
    rm -f $1/line
    zpty -w -n shell $'\C-u'"$line"$'\t\C-x'
    wait_for $1/line
    print -r -- "$(cat $1/line 2>/dev/null)"
done
zpty -d shell
TYPE

failed=0
sed -n 's/^# types: \(.*\) => .*/\1/p' "$0" >"$dir/typed"
sed -n 's/^# types: .* => \(.*\)/\1/p' "$0" >"$dir/wanted"
zsh -f "$dir/type" "$dir" <"$dir/typed" 2>&1 | sed 's/ *$//' >"$dir/got"
# types: slew ot => slew otg
# types: slew otg --thr => slew otg --through
# types: slew run --overr => slew run --override
# types: slew check ri => slew check rig.yaml
diff "$dir/wanted" "$dir/got" && sed 's/^/  /' "$dir/got" || {
    echo "  FAILED: the first are wanted, the others are what zsh made"
    failed=1
}
exit $failed
