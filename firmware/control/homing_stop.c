/* firmware/control/homing_stop.c - homing to a hard stop; see homing.h. */
#include "firmware/control/homing_parts.h"
#include "motion/core/err.h"
#include "motion/core/fixed.h"

/* So long does the set point go on before the stop counts: a hard place in a
 * guide lets the axis through. */
#define HOMING_PRESS_NS INT64_C(30000000)

static void homing_mark(struct homing *homing)
{
    homing->far_q32 = homing_axis(homing)->feedback.pos_q32;
    homing->told_q32 = homing_axis(homing)->target.pos_q32;
}

/* Since the mark the axis has stood where it is, with the torque that the stop
 * is known by, while the set point has gone on by what this speed covers in
 * HOMING_PRESS_NS.  It stands when it has come a quarter of that at most; while
 * the set point speeds up, where a load has that torque and lags too, a
 * sixteenth. */
static bool homing_meets_stop(struct homing *homing, int64_t vel_q32)
{
    const struct homing_config *config = homing_of(homing);
    const struct controller_axis *axis = homing_axis(homing);
    const struct hal_drive_feedback *feedback = &axis->feedback;
    const int32_t torque = config->direction < 0 ? -feedback->torque_permille
                                                 : feedback->torque_permille;
    const unsigned shift = axis->target.acc_q32 != 0 ? 4 : 2;
    int64_t moved_q32, told_q32, least_q32;
    if (torque >= config->push_permille &&
        motion_fixed_sub(feedback->pos_q32, homing->far_q32, &moved_q32) ==
            MOTION_OK &&
        motion_fixed_sub(axis->target.pos_q32, homing->told_q32, &told_q32) ==
            MOTION_OK &&
        motion_fixed_abs(moved_q32) <=
            (motion_fixed_abs(told_q32) >> shift) + 1)
        return motion_fixed_muldiv(vel_q32, HOMING_PRESS_NS,
                                   INT64_C(1000000000),
                                   &least_q32) == MOTION_OK &&
               motion_fixed_abs(told_q32) >= (uint64_t)least_q32;
    homing_mark(homing);
    return false;
}

static void homing_seek_stop(struct homing *homing, enum homing_state state,
                             int64_t vel_q32, int64_t distance_q32)
{
    homing_mark(homing);
    homing_run(homing, state, homing_of(homing)->direction, vel_q32,
               distance_q32);
}

void homing_begin_stop(struct homing *homing)
{
    const struct homing_config *config = homing_of(homing);
    homing_axis(homing)->seeking = true;
    if (!homing_axis(homing)->feedback.torque_known)
        homing_fail(homing, HOMING_NO_TORQUE);
    else
        homing_seek_stop(homing, HOMING_PRESS, config->fast_q32,
                         config->distance_q32);
}

/* True: the stop; else a failure, or not yet. */
static bool homing_step_press(struct homing *homing, int64_t vel_q32)
{
    if (homing_meets_stop(homing, vel_q32))
        return true;
    if (homing_bad_limit(homing, homing_of(homing)->direction))
        homing_fail(homing, HOMING_WRONG_LIMIT);
    else if (homing_at_rest(homing))
        homing_fail(homing, HOMING_NO_STOP);
    return false;
}

void homing_press(struct homing *homing)
{
    if (!homing_step_press(homing, homing_of(homing)->fast_q32))
        return;
    homing->met_q32 = homing_axis(homing)->feedback.pos_q32;
    homing_rest(homing, HOMING_PRESSED);
}

/* The set point has run on beyond the stop by now: that is taken back, and the
 * clearance beside it. */
void homing_pressed(struct homing *homing)
{
    const struct homing_config *config = homing_of(homing);
    int64_t beyond_q32;
    if (!homing_at_rest(homing))
        return;
    if (motion_fixed_sub(homing_axis(homing)->target.pos_q32, homing->met_q32,
                         &beyond_q32) < 0 ||
        motion_fixed_add((int64_t)motion_fixed_abs(beyond_q32),
                         config->clear_q32, &beyond_q32) < 0)
        homing_fail(homing, HOMING_JOG);
    else
        homing_run(homing, HOMING_CLEAR, -config->direction, config->fast_q32,
                   beyond_q32);
}

void homing_clear(struct homing *homing)
{
    const struct homing_config *config = homing_of(homing);
    int64_t distance_q32;
    if (homing_bad_limit(homing, -config->direction)) {
        homing_fail(homing, HOMING_WRONG_LIMIT);
        return;
    }
    if (!homing_at_rest(homing))
        return;
    if (motion_fixed_add(config->clear_q32, config->distance_q32,
                         &distance_q32) < 0)
        distance_q32 = config->distance_q32;
    homing_seek_stop(homing, HOMING_PRESS_AGAIN, config->slow_q32,
                     distance_q32);
}

/* What counts is where the axis is: the set point is further on. */
void homing_press_again(struct homing *homing)
{
    if (!homing_step_press(homing, homing_of(homing)->slow_q32))
        return;
    homing->edge_q32[0] = homing_axis(homing)->feedback.pos_q32;
    homing->edge_ns = homing_axis(homing)->feedback.t_ns;
    homing_rest(homing, HOMING_SETTLE);
}
