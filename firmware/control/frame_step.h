/* firmware/control/frame_step.h - a shoot frame by frame on demand: the clock of
 * the move stands before every frame until it is told to go on.
 *
 * All axes rest where the clock is to stand, from `first` + k `period` on for as
 * long as a hold takes (motion/plan/shoot/plan_shoot.h), so that it is the hold of
 * an operator and is resumed like one: by an edge of a line, by a key, by a
 * command.  An edge counts once the clock stands; one before is too early, is
 * counted, and starts nothing.  In reverse, and on the way to another place,
 * nothing waits.
 *
 * Between ticks.  No heap, no clock: time is the controller's. */
#ifndef FIRMWARE_CONTROL_FRAME_STEP_H
#define FIRMWARE_CONTROL_FRAME_STEP_H

#include <stdbool.h>
#include <stdint.h>

#include "firmware/control/playback.h"
#include "hal/gpio.h"

struct frame_step_config {
    int64_t first_ns_q12, period_ns_q12; /* path time; period > 0 */
    uint32_t count;                      /* frames; 0: nothing waits */
};

struct frame_step {
    struct frame_step_config config;
    struct hal_gpio *line; /* NULL: none */
    uint32_t frame;        /* as many are at or before the path time, */
    int64_t next_ns_q12;   /* and where the one after them is */
    bool waits;            /* at `frame`, or slows down to it */
    bool stands;           /* there */
    bool failed;           /* the line cannot be read */
    uint32_t early;        /* edges that came while nothing waited */
};

/* Before a move starts.  What the line did before does not count. */
void frame_step_begin(struct frame_step *self,
                      const struct frame_step_config *config,
                      struct hal_gpio *line);

/* After the controller's step, and the playback's. */
void frame_step_tick(struct frame_step *self, struct playback *playback);

#endif
