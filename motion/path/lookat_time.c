/* motion/path/lookat_time.c - see lookat_time.h. */
#include "motion/path/lookat_time.h"

#include <stddef.h>

#include "motion/core/err.h"
#include "motion/number/trig.h"

static int64_t lookat_time_within(int64_t a, int64_t low, int64_t high)
{
    if (a < low)
        return low;
    return a > high ? high : a;
}

static int lookat_time_view(const struct motion_lookat_time *time, int64_t t,
                            struct motion_lookat_state *state,
                            struct motion_view *view)
{
    struct motion_state at, tilt = { .pos_q32 = 0 };

    motion_track_state(time->distance, t, &at);
    if (time->tilt != NULL)
        motion_track_state(time->tilt, t, &tilt);
    return motion_lookat_at(
        time->lookat, state, time->target, time->path,
        lookat_time_within(at.pos_q32, 0, time->path->length_q32),
        motion_trig_from_deg_q32(tilt.pos_q32), view);
}

/* When step i of the walk is: end * i / states, the state of which is kept in
 * slot i. */
static int64_t lookat_time_step(const struct motion_lookat_time *time,
                                uint32_t i)
{
    int64_t t = 0;

    (void)motion_fixed_muldiv(time->distance->end_ns_q12, i, time->states, &t);
    return t;
}

int motion_lookat_time_init(struct motion_lookat_time *time,
                            struct motion_lookat_state *state, uint32_t states)
{
    struct motion_lookat_state now = { .valid = false };

    if (states == 0)
        return MOTION_E_ARG;
    if (time->distance->count == 0)
        return MOTION_E_EMPTY;
    time->state = state;
    time->states = states;
    for (uint32_t i = 0; i < states; i++) {
        struct motion_view view;
        int err =
            lookat_time_view(time, lookat_time_step(time, i), &now, &view);
        if (err < 0)
            return err;
        state[i] = now;
    }
    return MOTION_OK;
}

int motion_lookat_time_at(void *context, int64_t t_ns_q12,
                          struct motion_quat *q)
{
    const struct motion_lookat_time *const time = context;
    const int64_t t =
        lookat_time_within(t_ns_q12, 0, time->distance->end_ns_q12);
    struct motion_lookat_state state;
    struct motion_view view;
    int64_t i = 0;
    int err;

    (void)motion_fixed_muldiv(t, time->states, time->distance->end_ns_q12, &i);
    i = lookat_time_within(i, 0, (int64_t)time->states - 1);
    if (i > 0 && lookat_time_step(time, (uint32_t)i) > t)
        i--; /* the quotient was rounded up */
    state = time->state[i];
    err = lookat_time_view(time, t, &state, &view);
    if (err == MOTION_OK)
        *q = motion_quat_mul(motion_quat_inverse(time->mount),
                             motion_view_quat(&view));
    return err;
}
