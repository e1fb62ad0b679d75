#!/bin/sh
# tests/firmware/linux/service.sh - slew service as a person uses it: a unit is
# written, said and taken away; a service is asked by its rig's name; slewd is the
# same program.
#
# Reads the real clock.
set -eu
dir=$(mktemp -d)
run=
trap 'kill $run 2>/dev/null || true; wait; rm -rf "$dir"' EXIT
export SLEW_RUN_DIR="$dir/run"
mkdir "$SLEW_RUN_DIR" "$dir/dolly"
sed 's/^tick: 1 ms /tick: 20 ms /' examples/dolly/rig.yaml >"$dir/dolly/rig.yaml"
unit=$dir/root/etc/systemd/system/slew-dolly.service

fail()
{
    echo "service.sh: $*"
    cat "$dir/out" "$dir/err" 2>/dev/null
    exit 1
}

slew() # its answers
{
    "$SLEW" service "$@" >"$dir/out" 2>"$dir/err"
}

said() # said TEXT: by the last answer
{
    grep -qF -- "$1" "$dir/out" || fail "no '$1'"
}

# A unit.
slew install --real --cpu 1 --dry-run --root "$dir/root" "$dir/dolly" || fail "dry run"
said "write $unit"
said "NoNewPrivileges=yes"
said "run   systemctl enable --now slew-dolly.service"
[ ! -e "$dir/root" ] || fail "a dry run has written something"
slew install --real --cpu 1 --root "$dir/root" "$dir/dolly" || fail "install"
grep -qF "service run --real --yes --group --recordings \"%S/%N\" --cpu 1 \"$dir/dolly/rig.yaml\"" \
    "$unit" || fail "$(cat "$unit")"
grep -qxF 'StateDirectory=%N' "$unit" || fail "it has no place to record in"
grep -qxF 'CapabilityBoundingSet=' "$unit" || fail "capabilities"
verify()
{
    command -v systemd-analyze >"$dir/out" || return 0
    systemd-analyze verify "$unit" >"$dir/out" 2>&1 || true
    ! grep -v "Command 'man" "$dir/out" || fail "systemd-analyze"
}
verify
# Recordings elsewhere, and nothing else of the disk.
mkdir "$dir/my takes"
slew install --sim --record-always --recordings "$dir/my takes" --root "$dir/root" "$dir/dolly" ||
    fail "install --recordings"
grep -qF -- "--recordings \"$dir/my takes\" --record-always \"$dir" "$unit" || fail "$(cat "$unit")"
grep -qxF "ReadWritePaths=\"$dir/my takes\"" "$unit" || fail "it cannot write there"
! grep -q StateDirectory "$unit" || fail "two places to record in"
verify
! slew install --sim --recordings "$dir/nowhere" --root "$dir/root" "$dir/dolly" ||
    fail "a directory that is not there"
slew remove --root "$dir/root" "$dir/dolly" || fail "remove"
[ ! -e "$unit" ] || fail "the unit is still there"
! slew remove --root "$dir/root" "$dir/dolly" || fail "removed twice"

# A service that cannot record does not begin.
for words in "--recordings $dir/nowhere" "--record-always --recordings $dir/dolly/rig.yaml" "--record-always"; do
    status=0
    # shellcheck disable=SC2086
    timeout 10 "$SLEW" service run --sim $words "$dir/dolly" >"$dir/out" 2>"$dir/err" || status=$?
    [ "$status" -eq 2 ] || fail "$words: status $status"
    [ "$(wc -l <"$dir/err")" -eq 1 ] || fail "$words: not one line"
done

# A service, by the name that has no words after it.
! slew status "$dir/dolly" || fail "there is none yet"
ln -s "$(realpath "$SLEW")" "$dir/slewd"
"$dir/slewd" --sim "$dir/dolly" >"$dir/begun" 2>"$dir/err" &
run=$!
for _ in $(seq 100); do
    [ ! -s "$dir/begun" ] || break
    sleep 0.1
done
slew status "$dir/dolly/rig.yaml" || fail "status"
said "simulated drives, off, torque off"
slew status --json "$dir/dolly" || fail "status --json"
said '"ticks_lost"'
printf '%s\n' '{"id": 1, "command": "take"}' '{"id": 2, "command": "enable"}' \
    '{"id": 3, "command": "start"}' | slew send "$dir/dolly" || fail "send"
said '{"id":2,"ok":true}'
said '"error":"EMPTY"'

# slew run goes through it, but not with what only a run of its own does.
cat >"$dir/dolly/move.yaml" <<'MOVE'
title: A bit
axes:
  tilt: {curve: s-curve, keys: [[0 s, -7 deg], [4 s, -3 deg]]}
MOVE
runs() # runs STATUS WORDS...
{
    wanted=$1 status=0
    shift
    "$SLEW" run "$@" "$dir/dolly" >"$dir/out" 2>"$dir/err" || status=$?
    [ "$status" -eq "$wanted" ] || fail "run $*: status $status"
}
runs 0
said "the move is played by it"
slew status --json "$dir/dolly" || fail "status"
said '"move":	"A bit"'
said '"torque_off":	true'
awk '/"position":/ { at = $2 + 0 } END { exit !(at > -3.1 && at < -2.9) }' "$dir/out" ||
    fail "it is elsewhere"
runs 0 --telemetry "$dir/csv"
said "done after 4.000 s"
sed -i 's/keys: .*/keys: [[0 s, -7 deg], [0.1 s, -3 deg]]}/' "$dir/dolly/move.yaml"
runs 1
grep -qF "breaks limits" "$dir/err" || fail "no word of limits"
sed -i 's/keys: .*/keys: [[0 s, -3 deg], [60 s, 40 deg]]}/' "$dir/dolly/move.yaml"
"$SLEW" run "$dir/dolly" >"$dir/out" 2>"$dir/err" &
move=$!
for _ in $(seq 100); do
    ! grep -qF moving "$dir/out" || break
    sleep 0.1
done
sleep 1
kill "$move" # SIGTERM: SIGINT is ignored in the background of a shell
status=0
wait "$move" || status=$?
[ "$status" -eq 130 ] || fail "stopped: status $status"
slew status "$dir/dolly" || fail "status"
said "simulated drives, off, torque off"
echo "# changed" >>"$dir/dolly/rig.yaml"
runs 1
grep -qF "has changed" "$dir/err" || fail "a changed rig"
printf '%s\n' '{"command": "take"}' '{"command": "enable"}' |
    slew send "$dir/dolly" || fail "send"

# It ends by SIGTERM, with torque on, and takes it off.
kill "$run"
wait "$run" || fail "status $?"
run=
[ -z "$(ls "$SLEW_RUN_DIR")" ] || fail "the socket is still there"
