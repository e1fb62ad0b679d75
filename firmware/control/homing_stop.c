/* firmware/control/homing_stop.c - homing to a hard stop; see homing.h. */
#include "firmware/control/homing_parts.h"
#include "motion/core/err.h"
#include "motion/core/fixed.h"

/* It presses for so long before it counts: a hard place in a guide lets the
 * axis through, and the torque of speeding up is over before. */
#define HOMING_PRESS_NS INT64_C(30000000)

/* Since far_ns the axis has stood where it is, while the set point went on at
 * its speed and the torque was what the stop is known by. */
static bool homing_meets_stop(struct homing *homing)
{
    const struct homing_config *config = homing_of(homing);
    const struct controller_axis *axis = homing_axis(homing);
    const struct hal_drive_feedback *feedback = &axis->feedback;
    const int64_t now_ns = homing->controller->now_ns;
    const int32_t torque = config->direction < 0 ? -feedback->torque_permille
                                                 : feedback->torque_permille;
    int64_t moved_q32, part_q32;
    if (torque < config->push_permille || axis->target.acc_q32 != 0 ||
        axis->target.vel_q32 == 0) {
        homing->far_ns = now_ns;
        homing->far_q32 = feedback->pos_q32;
        return false;
    }
    /* a quarter of what it should have moved by now */
    if (motion_fixed_sub(feedback->pos_q32, homing->far_q32, &moved_q32) < 0 ||
        motion_fixed_muldiv(axis->target.vel_q32, now_ns - homing->far_ns,
                            INT64_C(4000000000), &part_q32) < 0 ||
        motion_fixed_abs(moved_q32) > motion_fixed_abs(part_q32) + 1) {
        homing->far_ns = now_ns;
        homing->far_q32 = feedback->pos_q32;
        return false;
    }
    return now_ns - homing->far_ns >= HOMING_PRESS_NS;
}

static void homing_seek_stop(struct homing *homing, enum homing_state state,
                             int64_t vel_q32, int64_t distance_q32)
{
    homing->far_ns = homing->controller->now_ns;
    homing->far_q32 = homing_axis(homing)->feedback.pos_q32;
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
static bool homing_step_press(struct homing *homing)
{
    if (homing_meets_stop(homing))
        return true;
    if (homing_bad_limit(homing, homing_of(homing)->direction))
        homing_fail(homing, HOMING_WRONG_LIMIT);
    else if (homing_at_rest(homing))
        homing_fail(homing, HOMING_NO_STOP);
    return false;
}

void homing_press(struct homing *homing)
{
    if (!homing_step_press(homing))
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
    if (!homing_step_press(homing))
        return;
    homing->edge_q32 = homing_axis(homing)->feedback.pos_q32;
    homing->edge_ns = homing_axis(homing)->feedback.t_ns;
    homing_rest(homing, HOMING_SETTLE);
}
