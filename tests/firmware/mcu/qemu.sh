#!/bin/sh
# tests/firmware/mcu/qemu.sh IMAGE MACHINE COMMAND... - start an image in QEMU
# and run COMMAND with the terminal of its serial port as its first argument.  The
# board's second port is the terminal QEMU_DRIVES, if there is one.
#
# Time in the image is that of its instructions (8 ns each) and of this machine
# while it waits: a busy machine makes it slower and loses it no tick.
set -eu

image=$1 machine=$2
shift 2
log=$(mktemp)
qemu-system-arm -M "$machine" -display none -monitor none \
    -icount shift=3,sleep=on -serial pty -serial "${QEMU_DRIVES:-null}" \
    -kernel "$image" >"$log" 2>&1 &
qemu=$!
trap 'kill $qemu 2>/dev/null || true; rm -f "$log"' EXIT
device=
for _ in $(seq 50); do
    device=$(sed -n 's|.*redirected to \(/dev/pts/[0-9]*\).*|\1|p' "$log")
    [ -n "$device" ] && break
    sleep 0.1
done
[ -n "$device" ] || { cat "$log"; exit 1; }
command=$1
shift
status=0
"$command" "$device" "$@" || status=$?
exit $status
