#!/bin/sh
# tests/vm/gpio_sim.sh KERNEL OUT - the kernel's simulated GPIO chip, as a module.
#
# gpio-sim is part of the kernel's source, but Debian's kernels are built without
# it: compiled from Debian's linux-source against the headers of KERNEL, into
# OUT/gpio-simulator.ko.  Needs linux-source-6.1 and linux-headers-amd64.
set -eu
kernel=$1
out=$2
source=/usr/src/linux-source-6.1.tar.xz
headers=/usr/src/linux-headers-$kernel

for needed in "$source" "$headers"; do
    [ -e "$needed" ] || {
        echo "gpio_sim.sh: no $needed; make deps installs it" >&2
        exit 1
    }
done
rm -rf "$out"
mkdir -p "$out"
tar -xJf "$source" -C "$out" --strip-components=3 --wildcards \
    '*/drivers/gpio/gpio-sim.c' '*/drivers/gpio/gpiolib.h' \
    '*/kernel/irq/irq_sim.c'
# a module may not call irq_to_desc
sed -i 's/handle_simple_irq(irq_to_desc(irqnum))/generic_handle_irq(irqnum)/' \
    "$out/irq_sim.c"
printf '%s\n' 'obj-m := gpio-simulator.o' \
    'gpio-simulator-y := gpio-sim.o irq_sim.o' >"$out/Makefile"
make -s -C "$headers" M="$(cd "$out" && pwd)" modules >"$out/log" 2>&1 || {
    cat "$out/log" >&2
    exit 1
}
