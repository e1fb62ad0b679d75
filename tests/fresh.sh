#!/bin/sh
# tests/fresh.sh [TARGET...] - what a user sees on a new machine.
#
# Puts a minimal Debian 12 with only git and make into a temporary directory,
# clones the last commit into it and makes the targets there (demo and test
# when none is named).  Needs root, debootstrap, a network and 1 GB of room, and
# leaves nothing behind.
set -eu
[ $# -gt 0 ] || set -- demo test
root=$(mktemp -d "${TMPDIR:-/var/tmp}/fresh.XXXXXX")
trap 'rm -rf "$root"' EXIT
chmod 755 "$root" # apt fetches as a user of its own

debootstrap --variant=minbase --include=git,make,ca-certificates bookworm \
    "$root" >"$root.log" || {
    tail "$root.log"
    exit 1
}
rm "$root.log"
cp /etc/resolv.conf "$root/etc/resolv.conf"
git clone -q . "$root/slew"

# Its own mounts and processes: /proc and the pseudo-terminals are gone when the
# last of them is.
for target in "$@"; do
    unshare --mount --pid --fork --mount-proc="$root/proc" \
        sh -c 'mount -t devpts -o newinstance,ptmxmode=666 devpts "$0/dev/pts"
               exec env -i PATH=/usr/sbin:/usr/bin:/sbin:/bin HOME=/root \
                   chroot "$0" make --no-print-directory -C /slew "$1"' \
        "$root" "$target"
done
