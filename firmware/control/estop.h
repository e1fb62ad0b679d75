/* firmware/control/estop.h - an e-stop of one channel, or of two that must
 * agree.
 *
 * Either channel stops.  Two contacts of one button open and close together:
 * where they differ for longer than the discrepancy time, or where one opens
 * and closes while the other does not open at all, a contact or a wire is
 * broken.  That is said by a fault of its own, and there is no reset before the
 * button was pressed and let go once with both channels in time, which shows
 * that both work.
 *
 * This is supervision, no safety function: see docs/FAULTS.md.  On the tick. */
#ifndef FIRMWARE_CONTROL_ESTOP_H
#define FIRMWARE_CONTROL_ESTOP_H

#include <stdbool.h>
#include <stdint.h>

#include "hal/gpio.h"

struct controller_estop {
    struct hal_gpio *channel[2]; /* NULL: not there; unreadable is active */
    int64_t discrepancy_ns;      /* of two channels, > 0 */
    bool is_active;              /* either is, at the last look */
    bool disagrees; /* until both were pressed and released in time */
    /* since either became active */
    bool both;         /* have been active at once */
    bool is_late;      /* they differed for too long */
    bool differs;      /* at the last look, */
    int64_t differ_ns; /* since then */
};

void controller_estop_look(struct controller_estop *estop, int64_t now_ns);
/* At the last look: no reset may begin, nor end. */
bool controller_estop_bars(const struct controller_estop *estop);

#endif
