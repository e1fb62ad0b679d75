/* motion/plan/plan_roll.c - see plan_roll.h. */
#include "motion/plan/plan_roll.h"

#include <math.h>

#include "motion/core/err.h"
#include "motion/core/fixed.h"
#include "motion/plan/move.h"
#include "motion/plan/plan_track.h"

/* How far away rest is, before (`side` -1) or after (1) a state. */
static int roll_rest(const struct motion_state *state, int64_t dur_ns_q12,
                     int side, struct motion_state *rest)
{
    const double t = (double)dur_ns_q12 / (double)MOTION_FIXED_S_Q12;
    const double off = side * t * (double)state->vel_q32 / 2 +
                       t * t * (double)state->acc_q32 / 12;

    *rest = (struct motion_state){ .pos_q32 = state->pos_q32 };
    return fabs(off) < 0x1p62
               ? motion_fixed_add(state->pos_q32, llround(off), &rest->pos_q32)
               : MOTION_E_RANGE;
}

static bool roll_is_at_rest(const struct motion_state *state)
{
    return state->vel_q32 == 0 && state->acc_q32 == 0;
}

/* One segment between two states, where one stands. */
static int roll_append(struct motion_track *track, int64_t dur_ns_q12,
                       const struct motion_state *from,
                       const struct motion_state *to)
{
    return roll_is_at_rest(from) && roll_is_at_rest(to)
               ? motion_track_append_dwell(track, dur_ns_q12)
               : motion_track_append_quintic(track, dur_ns_q12, from, to);
}

static int roll_make(const struct motion_track *track, int64_t before_ns_q12,
                     int64_t after_ns_q12, struct motion_track *made)
{
    struct motion_state start, from, to;
    int err;

    motion_segment_state(&track->segment[0], 0, &start);
    err = roll_rest(&start, before_ns_q12, -1, &from);
    if (err < 0 || track->end_ns_q12 > MOTION_TRACK_MAX_NS_Q12 - before_ns_q12)
        return MOTION_E_RANGE;
    plan_track_init(made, from.pos_q32);
    plan_track_reserve(made, (size_t)track->count + 2);
    if (made->capacity < track->count + 2)
        return MOTION_E_FULL;
    if (before_ns_q12 > 0)
        err = roll_append(made, before_ns_q12, &from, &start);
    for (uint32_t i = 0; i < track->count && err == MOTION_OK; i++) {
        struct motion_segment *segment = &made->segment[made->count++];
        *segment = track->segment[i];
        segment->start_ns_q12 += before_ns_q12;
    }
    made->end_ns_q12 = track->end_ns_q12 + before_ns_q12;
    made->end = track->end;
    made->end_frac = track->end_frac;
    if (err == MOTION_OK && after_ns_q12 > 0) {
        err = roll_rest(&made->end, after_ns_q12, 1, &to);
        from = made->end;
        if (err == MOTION_OK)
            err = roll_append(made, after_ns_q12, &from, &to);
    }
    return err;
}

int plan_roll_track(struct motion_track *track, int64_t before_ns_q12,
                    int64_t after_ns_q12)
{
    struct motion_track made;
    int err;

    if (track->count == 0 || (before_ns_q12 == 0 && after_ns_q12 == 0))
        return MOTION_OK;
    plan_track_init(&made, 0);
    err = roll_make(track, before_ns_q12, after_ns_q12, &made);
    if (err < 0) {
        plan_track_free(&made);
        return err;
    }
    plan_track_free(track);
    plan_track_trim(&made);
    *track = made;
    return MOTION_OK;
}
