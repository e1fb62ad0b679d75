#!/bin/sh
# tests/vm/boot.sh [COMMAND...] - run a command on a kernel that has real CAN and
# real GPIO; without one make that kernel ready, once for machines side by side.
#
# Boots Debian's stock kernel in QEMU (software emulation: no KVM, no root, a few
# seconds) on top of this machine's own files: the root directory is mounted
# read-only over 9p, with /tmp and /run empty and writable, so whatever is
# installed or built here runs there, by the same paths.  The command is run by
# sh in the present directory; its exit status is that of this script.
#
#   can0 <-> can1   two Kvaser PCI cards (SJA1000) on one emulated bus: the real
#                   driver, bit rate, error states, hardware queues
#   vcan0, vcan1    virtual CAN, classic and FD frames
#   gpiochip0       gpio-sim, lines rig0 .. rig7; the other side of line N are the
#                   files pull and value in
#                   /sys/devices/platform/gpio-sim.0/gpiochip0/sim_gpioN
#
# The machine has no disk; nothing of this one is changed.  Its clock counts
# instructions (icount) and leaps over idle time, so a busy host does not make
# ticks late, and a minute may be over in seconds; its times say nothing about
# real time.
#
# VM_CACHE    where the kernel is kept (build/vm); VM_TIMEOUT  seconds (1000)
set -eu
cache=${VM_CACHE:-build/vm}
modules='virtio_pci 9p 9pnet_virtio overlay can can-raw can-bcm can-dev vcan kvaser_pci slcan
    configfs'

die()
{
    echo "boot.sh: $*" >&2
    exit 125
}

[ -x /bin/busybox ] && command -v qemu-system-x86_64 cpio >/dev/null ||
    die "expected qemu-system-x86, busybox-static and cpio; make deps installs them"

# The kernel that linux-image-amd64 stands for, unpacked once.
kernel=$(apt-cache depends linux-image-amd64 2>/dev/null |
    sed -n 's/.*Depends: linux-image-//p' | head -n 1)
[ -n "$kernel" ] || die "apt has no linux-image-amd64; apt-get update may help"
base=$cache/$kernel
if [ ! -e "$base/ready" ]; then
    rm -rf "$base"
    mkdir -p "$base/deb" "$base/root"
    (cd "$base/deb" && apt-get -qq download "linux-image-$kernel" 2>/dev/null) ||
        die "cannot download linux-image-$kernel"
    dpkg-deb --fsys-tarfile "$base"/deb/*.deb |
        tar -x -C "$base/root" ./boot ./lib/modules
    /sbin/depmod -b "$base/root" "$kernel"
    rm -rf "$base/deb"
    touch "$base/ready"
fi
[ -e "$base/gpio/gpio-simulator.ko" ] ||
    "${0%/*}/gpio_sim.sh" "$kernel" "$base/gpio" || die "no gpio-sim"
[ $# -gt 0 ] || exit 0

work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
trap 'exit 130' INT TERM

# The first file system: busybox, the modules, and init, which moves on to the
# host's.
root=$work/root
library=lib/modules/$kernel
mkdir -p "$root/bin" "$root/$library" "$root/host" "$root/proc"
cp /bin/busybox "$root/bin/"
cp "$base/gpio/gpio-simulator.ko" "$root/"
cp "$base/root/$library"/modules.* "$root/$library/"
for module in $modules; do
    /sbin/modprobe -d "$base/root" -S "$kernel" --show-depends "$module" |
        sed -n "s|^insmod .*/$library/\([^ ]*\).*|\1|p"
done | sort -u | while read -r file; do
    mkdir -p "$root/$library/$(dirname "$file")"
    cp "$base/root/$library/$file" "$root/$library/$file"
done
{
    printf 'cd "%s" || exit 125\n' "$PWD"
    printf 'export VM=1 HOME=/tmp LANG=C.UTF-8 PATH="%s"\n' "$PATH"
    printf '%s\n' "$*"
} >"$work/root/command"
echo "$PWD" >"$work/root/place"
cat >"$root/init" <<'INIT'
#!/bin/busybox sh
/bin/busybox mount -t proc proc /proc
/bin/busybox --install -s /bin
mount -t devtmpfs dev /dev
for module in virtio_pci 9pnet_virtio 9p can can-raw can-bcm vcan kvaser_pci slcan; do
    modprobe "$module" || echo "vm: no module $module"
done
modprobe configfs
insmod /gpio-simulator.ko
mount -t 9p -o trans=virtio,version=9p2000.L,ro,cache=loose,msize=512000 \
    root /host || poweroff -f
mount -t proc proc /host/proc
mount -t sysfs sys /host/sys
mount -t devtmpfs dev /host/dev
place=$(cat /place) # stays to be seen where it is below /tmp or /run
mkdir /here
mount -o bind "/host$place" /here
for dir in tmp run; do
    mount -t tmpfs "$dir" "/host/$dir"
done
[ -d "/host$place" ] || {
    mkdir -p "/host$place"
    mount -o bind /here "/host$place"
}
mkdir -p /host/dev/pts /host/dev/shm
mount -t devpts pts /host/dev/pts
mount -t tmpfs shm /host/dev/shm
cp /command /host/run/command
run="chroot /host" # by full path: busybox prefers its own ip
ip="$run /sbin/ip"
$ip link set lo up
for i in 0 1; do
    $ip link add dev "vcan$i" type vcan
    $ip link set "vcan$i" mtu 72
    $ip link set "vcan$i" up
    $ip link set "can$i" txqueuelen 128
    $ip link set "can$i" up type can bitrate 1000000 restart-ms 0
done
mount -t configfs config /host/sys/kernel/config
bank=/host/sys/kernel/config/gpio-sim/rig/bank0
mkdir -p $bank
echo 8 >$bank/num_lines
for i in 0 1 2 3 4 5 6 7; do
    mkdir $bank/line$i
    echo rig$i >$bank/line$i/name
done
echo 1 >$bank/../live
echo "vm: begin"
$run /usr/bin/setsid /bin/sh /run/command </dev/null
echo "vm: exit $?"
poweroff -f
INIT
chmod +x "$root/init"
(cd "$root" && find . | cpio -o -H newc --quiet | gzip -1) >"$work/initrd"

nice -n 19 timeout "${VM_TIMEOUT:-1000}" qemu-system-x86_64 -accel tcg -icount shift=2,sleep=off -m 768 \
    -nographic -no-reboot -nodefaults -serial stdio \
    -object can-bus,id=bus -device kvaser_pci,canbus=bus \
    -device kvaser_pci,canbus=bus \
    -virtfs local,path=/,mount_tag=root,security_model=none,readonly=on,multidevs=remap \
    -kernel "$base/root/boot/vmlinuz-$kernel" -initrd "$work/initrd" \
    -append 'console=ttyS0 quiet loglevel=3 panic=-1' </dev/null |
    awk -v out="$work/out" '{ gsub("\r", ""); print >out }
        /vm: begin/ { on = 1; next } /vm: exit/ { on = 0 }
        on { print; fflush() }' || true
grep -q 'vm: begin' "$work/out" || { cat "$work/out" >&2; die "did not boot"; }
status=$(sed -n 's/.*vm: exit //p' "$work/out" | tail -n 1)
exit "${status:-125}"
