/* tests/sim/bus/sim_bus.h - a simulated bus with one drive, and a hand on its
 * wire.
 *
 * Frames are written and compared as candump writes them: "601#4041600000". */
#ifndef TESTS_SIM_BUS_SIM_BUS_H
#define TESTS_SIM_BUS_SIM_BUS_H

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
/* cmocka wants the four above first */
#include <cmocka.h>

#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "sim/bus/can.h"
#include "sim/device/cia402/servo.h"
#include "sim/util.h"
#include "sim/world.h"

#define MS INT64_C(1000000)

static inline struct hal_can_frame frame_of(const char *text)
{
    struct hal_can_frame frame = { 0 };
    char *at;

    frame.id = (uint32_t)strtoul(text, &at, 16);
    assert_int_equal(*at, '#');
    frame.extended = at - text > 3;
    at++;
    if (*at == 'R')
        frame.remote = true;
    else
        for (; *at; at += 2) {
            char byte[3] = { at[0], at[1], 0 };

            assert_true(frame.len < 8);
            frame.data[frame.len++] = (uint8_t)strtoul(byte, NULL, 16);
        }
    return frame;
}

static inline const char *text_of(const struct hal_can_frame *frame)
{
    static char text[32];
    int at = snprintf(text, sizeof(text), frame->extended ? "%08X#" : "%03X#",
                      (unsigned)frame->id);

    if (frame->remote)
        at += snprintf(text + at, sizeof(text) - (size_t)at, "R");
    for (unsigned i = 0; !frame->remote && i < frame->len; i++)
        at += snprintf(text + at, sizeof(text) - (size_t)at, "%02X",
                       frame->data[i]);
    return text;
}

#endif
