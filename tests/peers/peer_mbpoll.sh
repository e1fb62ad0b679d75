#!/bin/sh
# tests/peers/peer_mbpoll.sh - mbpoll as client of our simulated servos.
set -eu
. tests/peers/device.sh

rtu()
{
    mbpoll -q -m rtu -a 3 -b 115200 -P even -0 -1 "$@"
}

expect() # expect TEXT COMMAND...: it must be in what the command says
{
    want=$1
    shift
    "$@" >"$dir/said" 2>&1 || { cat "$dir/said"; exit 1; }
    grep -q -- "$want" "$dir/said" ||
        { echo "no \"$want\" in:"; cat "$dir/said"; exit 1; }
}

# 36 deg of 500000 counts per revolution: 50000 = 0xC350, upper word first
expect '\[24620\]:[[:space:]]*0x0000' rtu -t 4:hex -r 24620 -c 2 "$rtu"
expect '\[24621\]:[[:space:]]*0xC350' rtu -t 4:hex -r 24620 -c 2 "$rtu"
# enable by its DI function, and see that it is written
expect 'Written 1 reference' rtu -t 4 -r 1025 "$rtu" 131
expect '\[1025\]:[[:space:]]*131' rtu -t 4 -r 1025 -c 1 "$rtu"
# an address that it has not
! rtu -t 4 -r 100 -c 1 "$rtu" >"$dir/said" 2>&1 ||
    { echo "an address that is not there was read"; exit 1; }
grep -q 'Illegal data address' "$dir/said" || { cat "$dir/said"; exit 1; }
echo "  RTU: read, written, refused"

# 100 mm of 4096 counts: 409600 = 0x64000
expect '\[7706\]:[[:space:]]*409600' mbpoll -q -m tcp -p "$tcp" -a 5 -0 -1 \
    -t 4:int -B -r 7706 -c 1 127.0.0.1
expect 'Written 2 references' mbpoll -q -m tcp -p "$tcp" -a 5 -0 -1 \
    -t 4 -r 282 127.0.0.1 0 1 # AccessExcl
expect 'Written 2 references' mbpoll -q -m tcp -p "$tcp" -a 5 -0 -1 \
    -t 4 -r 6914 127.0.0.1 0 6
echo "  TCP: read, written"

# another address of this machine, and that one alone
kill "$device"
wait "$device" || true
"$SLEW" sim --address 127.0.0.9 --for 20s tests/peers/tcp.yaml >"$dir/there" &
there=$!
trap 'kill $there 2>/dev/null; rm -rf "$dir"' EXIT
for i in $(seq 300); do
    grep -q "interrupt" "$dir/there" && break
    sleep 0.1
done
grep -q '^tcp on 127.0.0.9 port 15020: lift' "$dir/there"
at()
{
    mbpoll -q -m tcp -p 15020 -a 5 -0 -1 -t 4:int -B -r 7706 -c 1 "$1"
}
expect '\[7706\]:[[:space:]]*409600' at 127.0.0.9
! at 127.0.0.1 >"$dir/said" 2>&1 ||
    { echo "an address that it was not told to serve was served"; exit 1; }
echo "  TCP: at another address"
