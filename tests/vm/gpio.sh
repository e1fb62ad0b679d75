#!/bin/sh
# tests/vm/gpio.sh BUILD - inside the machine of boot.sh: GPIO as it really is.
#
# The claims every line keeps to, on gpio-sim through libgpiod 1.6 and, where it
# was built (test_conform_gpio of BUILD/gpiod2), 2.x.
set -u
build=${1:-build}
files=$(ls -d /sys/devices/platform/gpio-sim.*/gpiochip*)
failed=0

for program in "$build/tests/conform/test_conform_gpio" "$build/gpiod2/test_conform_gpio"; do
    [ -x "$program" ] || continue
    ldd "$program" | grep -o 'libgpiod[^ ]*' | head -n 1 | grep . || echo "libgpiod 2, linked in"
    "$program" rig0 "$files/sim_gpio0" >/tmp/gpio.log 2>&1 || {
        failed=1
        cat /tmp/gpio.log
    }
    grep -E 'PASSED|FAILED' /tmp/gpio.log
done
exit $failed
