/* motion/plan/shaper/plan_shape.c - see plan_shape.h. */
#include "motion/plan/shaper/plan_shape.h"

#include <math.h>

#include "motion/core/err.h"
#include "motion/core/fixed.h"
#include "motion/curve/pose.h"
#include "motion/plan/plan_error.h"
#include "motion/plan/plan_track.h"

/* Segments have their own start, everything else of them is by duration. */
static int shape_copy(const struct motion_track *track, int64_t wait_ns_q12,
                      struct motion_track *copy)
{
    int err;

    plan_track_init(copy, track->count > 0 ? track->segment[0].pos_q32
                                           : track->end.pos_q32);
    if (track->end_ns_q12 > MOTION_TRACK_MAX_NS_Q12 - wait_ns_q12)
        return MOTION_E_RANGE;
    plan_track_reserve(copy, (size_t)track->count + 1);
    if (copy->capacity < track->count + 1)
        return MOTION_E_FULL;
    err = plan_track_wait(copy, wait_ns_q12);
    if (err < 0)
        return err;
    for (uint32_t i = 0; i < track->count; i++) {
        struct motion_segment *to = &copy->segment[copy->count++];
        *to = track->segment[i];
        to->start_ns_q12 += wait_ns_q12;
    }
    copy->end_ns_q12 = track->end_ns_q12 + wait_ns_q12;
    copy->end = track->end;
    copy->end_frac = track->end_frac;
    return MOTION_OK;
}

/* `made` takes the place of the track, or is dropped after an error. */
static int shape_replace(struct motion_track *track, struct motion_track *made,
                         int err)
{
    if (err < 0) {
        plan_track_free(made);
        return err;
    }
    plan_track_free(track);
    plan_track_trim(made);
    *track = *made;
    return MOTION_OK;
}

int plan_shape_delay(struct motion_track *track, int64_t wait_ns_q12)
{
    struct motion_track made;

    if (track->count == 0 || wait_ns_q12 == 0)
        return MOTION_OK;
    const int err = shape_copy(track, wait_ns_q12, &made);
    return shape_replace(track, &made, err);
}

/* Amplitudes as factors, which add up to one again. */
static void shape_factors(const struct motion_shaper *shaper,
                          struct motion_pose_term term[])
{
    int64_t left = MOTION_FIXED_ONE_Q32;

    for (uint32_t i = 0; i < shaper->count; i++) {
        term[i].factor_q32 = i + 1 == shaper->count
                                 ? left
                                 : (int64_t)(shaper->amplitude_q62[i] >> 30);
        left -= term[i].factor_q32;
    }
}

int plan_shape_track(const struct motion_shaper *shaper,
                     struct motion_track *track)
{
    struct motion_track delayed[MOTION_SHAPER_IMPULSES_MAX], sum;
    struct motion_pose_term term[MOTION_SHAPER_IMPULSES_MAX];
    uint32_t copies = 0;
    int err = MOTION_OK;

    if (track->count == 0)
        return MOTION_OK;
    plan_track_init(&sum, 0);
    shape_factors(shaper, term);
    while (err == MOTION_OK && copies < shaper->count) {
        term[copies].track = &delayed[copies];
        err = shape_copy(track, shaper->delay_ns_q12[copies], &delayed[copies]);
        copies++;
    }
    while (err == MOTION_OK &&
           (err = motion_pose_sum(&sum, 0, term, shaper->count)) ==
               MOTION_E_FULL)
        err = plan_track_grow(&sum);
    for (uint32_t i = 0; i < copies; i++)
        plan_track_free(&delayed[i]);
    return shape_replace(track, &sum, err);
}

static int64_t shape_ticks(double s)
{
    return llround(s * (double)MOTION_FIXED_S_Q12);
}

static int64_t shape_end(const struct motion_track track[], uint32_t axes)
{
    int64_t end_ns_q12 = 0;

    for (uint32_t i = 0; i < axes; i++)
        if (track[i].end_ns_q12 > end_ns_q12)
            end_ns_q12 = track[i].end_ns_q12;
    return end_ns_q12;
}

/* An axis with the shaper, or without one, that far behind. */
static int shape_axis(const struct plan_shaper *shaper, int64_t lag_ns_q12,
                      struct motion_track *track)
{
    struct motion_shaper tick;

    if (shaper == NULL)
        return plan_shape_delay(track, lag_ns_q12);
    const int64_t own = shape_ticks(plan_shaper_delay(shaper));
    const int err = plan_shaper_to_tick(shaper, lag_ns_q12 - own, &tick);
    return err < 0 ? err : plan_shape_track(&tick, track);
}

int plan_shape_move(const struct plan_shaper *const shaper[], uint32_t axes,
                    struct motion_track track[], struct plan_outcome *outcome,
                    struct plan_shape_cost *cost, struct plan_error *error)
{
    const int64_t before_ns_q12 = shape_end(track, axes);
    int64_t lag_ns_q12 = 0;
    int err = MOTION_OK;

    *cost = (struct plan_shape_cost){ 0, 0 };
    for (uint32_t i = 0; i < axes; i++)
        if (shaper[i] != NULL) {
            const int64_t own = shape_ticks(plan_shaper_delay(shaper[i]));
            lag_ns_q12 = own > lag_ns_q12 ? own : lag_ns_q12;
        }
    if (lag_ns_q12 == 0)
        return MOTION_OK;
    for (uint32_t i = 0; i < axes && err == MOTION_OK; i++)
        err = shape_axis(shaper[i], lag_ns_q12, &track[i]);
    if (err == MOTION_OK && outcome->has_path)
        err = plan_shape_delay(&outcome->distance, lag_ns_q12);
    if (err < 0)
        return plan_error_set(error, err, (struct plan_place){ 0, 0 },
                              "the move cannot be shaped (%s)",
                              motion_err_text(err));
    const int64_t longer_ns_q12 = shape_end(track, axes) - before_ns_q12;
    outcome->lag_ns_q12 += lag_ns_q12;
    outcome->tail_ns_q12 += longer_ns_q12 - lag_ns_q12;
    cost->lag_s = (double)lag_ns_q12 / (double)MOTION_FIXED_S_Q12;
    cost->longer_s = (double)longer_ns_q12 / (double)MOTION_FIXED_S_Q12;
    return MOTION_OK;
}
