/* firmware/control/trigger.h - pulses on an output at times of the path.
 *
 * The times are known before the move (motion/plan/shoot/plan_event.h) and are looked
 * at once per tick: a shot whose time has come makes a pulse.  Each shot makes
 * one pulse, in order: none is left out and none comes twice, whatever hold and
 * override do to the path's time.  Shots that are closer than a pulse and the
 * rest after it follow one another as fast as the line can, and are late.
 *
 * No heap, no clock: time is an argument. */
#ifndef FIRMWARE_CONTROL_TRIGGER_H
#define FIRMWARE_CONTROL_TRIGGER_H

#include <stdbool.h>
#include <stdint.h>

#include "hal/gpio.h"

MOTION_C_BEGIN

struct trigger_config {
    int64_t width_ns; /* of a pulse, >= 0: at least one tick */
    int64_t rest_ns;  /* not active for so long after one, >= 0: one tick */
};

struct trigger {
    struct hal_gpio *line;
    struct trigger_config config;
    const int64_t *t_ns_q12; /* rising; the caller's, as long as it is armed */
    uint32_t count, next;    /* shots; how many have been fired */
    bool active;
    int64_t until_ns;  /* when the pulse, or the rest after it, is over */
    uint32_t failures; /* the line could not be set */
};

/* MOTION_E_ARG for a time below 0.  The line is an output and inactive. */
int trigger_init(struct trigger *trigger, struct hal_gpio *line,
                 const struct trigger_config *config);

/* From the first shot; before a move starts.  A pulse under way goes on. */
void trigger_arm(struct trigger *trigger, const int64_t t_ns_q12[],
                 uint32_t count);
/* No more shots; a pulse under way goes on. */
void trigger_disarm(struct trigger *trigger);

/* The tick, with the path's time in it.  The number of the shot, from 1, when
 * one was fired now, else 0. */
uint32_t trigger_step(struct trigger *trigger, int64_t s_ns_q12,
                      int64_t now_ns);

/* Nothing is under way: no pulse, and no shot whose time has come. */
bool trigger_is_idle(const struct trigger *trigger, int64_t s_ns_q12);

/* No more shots, and a pulse ends now. */
void trigger_end(struct trigger *trigger);

MOTION_C_END

#endif
