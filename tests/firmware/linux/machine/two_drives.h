/* tests/firmware/linux/machine/two_drives.h - a rig with a CiA 402 axis and a
 * Modbus axis, and the data sheet of the simulated CiA 402 drive, in the
 * directory of run_slew.h. */
#ifndef TESTS_FIRMWARE_LINUX_MACHINE_TWO_DRIVES_H
#define TESTS_FIRMWARE_LINUX_MACHINE_TWO_DRIVES_H

#include "sim/device/cia402/servo.h"
#include "tests/support/run_slew.h"

/* What comes after the last key of each drive, ", key: value" or nothing, and
 * the slide's position at power-on in mm. */
static inline void two_drives_put(const char *of_slide, int start_mm,
                                  const char *of_turn)
{
    char text[2048];
    const int length = snprintf(
        text, sizeof text,
        "buses:\n"
        "  can0: {kind: canopen, bit_rate: 1 Mbit/s}\n"
        "  line: {kind: modbus-rtu, device: /dev/none, baud: 115200}\n"
        "axes:\n"
        "  slide:\n"
        "    unit: mm\n"
        "    limits: {position: [-5 mm, 600 mm], velocity: 400, acceleration: "
        "800}\n"
        "    following_error: {floor: 2 mm, time: 20 ms}\n"
        "    drive: {kind: cia402, bus: can0, node: 3, counts: 4096 per mm%s}\n"
        "    sim: {start: %d mm}\n"
        "  turn:\n"
        "    unit: deg\n"
        "    limits: {position: [-90, 90], velocity: 10, acceleration: 20}\n"
        "    following_error: {floor: 2, time: 200 ms}\n"
        "    drive: {kind: modbus, bus: line, node: 7, map: leadshine-el7,\n"
        "            unsupervised: yes, counts: {num: 10000, den: 360}%s}\n",
        of_slide, start_mm, of_turn);

    assert_in_range(length, 1, sizeof text - 1);
    run_put("rig.yaml", text);
}

/* servo.eds; 0, or -1. */
static inline int two_drives_put_sheet(void)
{
    FILE *file = fopen(run_path("servo.eds"), "wb");

    if (file == NULL)
        return -1;
    sim_cia402_write_eds(file);
    return fclose(file);
}

#endif
