/* firmware/control/gantry.c - see gantry.h. */
#include "firmware/control/gantry.h"

#include <stddef.h>

#include "firmware/control/parts.h"
#include "motion/core/err.h"
#include "motion/core/fixed.h"

struct controller_gantry *
controller_gantry_of(const struct controller *controller, unsigned axis)
{
    for (unsigned i = 0; i < controller->gantry_count; i++) {
        struct controller_gantry *gantry = &controller->gantry[i];
        if (gantry->axis[0] == axis || gantry->axis[1] == axis)
            return gantry;
    }
    return NULL;
}

unsigned controller_gantry_other(const struct controller_gantry *gantry,
                                 unsigned axis)
{
    return gantry->axis[gantry->axis[0] == axis ? 1 : 0];
}

/* How far a rail is from the other, by the set points of the motion under way. */
static int64_t gantry_beside_q32(const struct controller_gantry *gantry,
                                 unsigned axis)
{
    return gantry->axis[1] == axis ? gantry->apart_q32 : -gantry->apart_q32;
}

static int64_t gantry_apart_q32(const struct controller *controller,
                                const struct controller_gantry *gantry)
{
    const struct controller_axis *axis = controller->axis;
    return motion_fixed_add_sat(axis[gantry->axis[1]].target.pos_q32,
                                -axis[gantry->axis[0]].target.pos_q32);
}

/* --- the tick --- */

static void gantry_follow(struct controller *controller)
{
    for (unsigned i = 0; i < 2 * controller->gantry_count; i++) {
        const struct controller_gantry *gantry = &controller->gantry[i / 2];
        const unsigned own = gantry->axis[i % 2];
        struct controller_axis *axis = &controller->axis[own];
        const struct controller_axis *leader =
            &controller->axis[controller_gantry_other(gantry, own)];
        if (axis->along == NULL)
            continue;
        const struct motion_sample sample = {
            .pos_q32 = motion_fixed_add_sat(leader->target.pos_q32,
                                            gantry_beside_q32(gantry, own)),
            .vel_q32 = leader->target.vel_q32,
            .acc_q32 = leader->target.acc_q32,
        };
        axis->cursor = leader->cursor;
        controller_tell(controller, own, &sample);
    }
}

/* Set points of rails that are not homed say nothing of each other, and go together. */
static void gantry_judge_one(struct controller *controller,
                             const struct controller_gantry *gantry)
{
    const struct controller_axis *one = &controller->axis[gantry->axis[0]];
    const struct controller_axis *two = &controller->axis[gantry->axis[1]];
    const unsigned worse = motion_fixed_abs(one->following_q32) >
                                   motion_fixed_abs(two->following_q32)
                               ? 0
                               : 1;
    int64_t racking_q32 =
        motion_fixed_add_sat(one->following_q32, -two->following_q32);
    if (one->sent_count == 0 || two->sent_count == 0)
        return;
    if (one->homed && two->homed)
        racking_q32 = motion_fixed_add_sat(
            racking_q32, gantry_apart_q32(controller, gantry));
    if (motion_fixed_abs(racking_q32) > (uint64_t)gantry->racking_q32)
        controller_raise(controller, CONTROLLER_FAULT_RACKING,
                         (int)gantry->axis[worse], racking_q32,
                         gantry->racking_q32);
}

static void gantry_judge(struct controller *controller)
{
    for (unsigned i = 0; i < controller->gantry_count; i++)
        gantry_judge_one(controller, &controller->gantry[i]);
}

/* --- before a motion --- */

static void gantry_reduce(const struct controller *controller, unsigned axis,
                          bool stop, struct motion_clock_limit *limit)
{
    const struct controller_gantry *gantry =
        controller_gantry_of(controller, axis);
    if (gantry == NULL)
        return;
    const unsigned other = controller_gantry_other(gantry, axis);
    const struct controller_axis_config *config =
        &controller->config.axis[other];
    const struct motion_clock_limit *most =
        stop ? &config->stop : &config->limit;
    if (controller->axis[other].track != NULL)
        return;
    limit->vel_q32 = motion_fixed_least(limit->vel_q32, most->vel_q32);
    limit->acc_q32 = motion_fixed_least(limit->acc_q32, most->acc_q32);
    if (limit->jerk_q32 == 0 ||
        (most->jerk_q32 != 0 && most->jerk_q32 < limit->jerk_q32))
        limit->jerk_q32 = most->jerk_q32;
}

int controller_gantry_follow(struct controller *controller, unsigned leader,
                             const struct motion_track *track)
{
    struct controller_gantry *gantry = controller_gantry_of(controller, leader);
    if (gantry == NULL || gantry->is_alone)
        return MOTION_OK;
    const unsigned own = controller_gantry_other(gantry, leader);
    if (controller->state == CONTROLLER_READY)
        gantry->apart_q32 = gantry_apart_q32(controller, gantry);
    if (!controller_admit(controller, own, track,
                          gantry_beside_q32(gantry, own)))
        return MOTION_E_LIMIT;
    controller->axis[own].along = track;
    return MOTION_OK;
}

/* A rail that moves while the other stands: an approach that squares the bridge. */
static bool gantry_keeps(const struct controller *controller,
                         const struct controller_gantry *gantry,
                         unsigned stands, const struct motion_track *track)
{
    const int64_t at_q32 = controller->axis[stands].target.pos_q32;
    const int64_t most_q32 = gantry->racking_q32;
    struct motion_extreme pos;
    motion_track_extreme(track, MOTION_POS, &pos);
    return pos.min >= motion_fixed_add_sat(at_q32, -most_q32) &&
           pos.max <= motion_fixed_add_sat(at_q32, most_q32);
}

static int gantry_admit(struct controller *controller,
                        const struct motion_track *const track[], int *axis)
{
    for (unsigned i = 0; i < 2 * controller->gantry_count; i++) {
        const struct controller_gantry *gantry = &controller->gantry[i / 2];
        const unsigned own = gantry->axis[i % 2];
        const unsigned other = controller_gantry_other(gantry, own);
        *axis = (int)own;
        if (track[own] != NULL && track[other] == NULL &&
            !gantry_keeps(controller, gantry, other, track[own]))
            return MOTION_E_LIMIT;
    }
    *axis = -1;
    return MOTION_OK;
}

static const struct controller_gantry_ops gantry_ops = {
    .follow = gantry_follow,
    .judge = gantry_judge,
};

static const struct controller_gantries gantries = {
    .ops = &gantry_ops,
    .reduce = gantry_reduce,
    .admit = gantry_admit,
};

static bool gantry_may_be(const struct controller *controller,
                          const struct controller_gantry *gantry,
                          unsigned before)
{
    for (unsigned k = 0; k < 2; k++) {
        const unsigned axis = gantry->axis[k];
        if (axis >= controller->config.axis_count ||
            controller->config.axis[axis].by_goals ||
            controller->axis[axis].drive->ops->tracks != NULL)
            return false;
        for (unsigned i = 0; i < before; i++)
            if (controller->gantry[i].axis[0] == axis ||
                controller->gantry[i].axis[1] == axis)
                return false;
    }
    return gantry->axis[0] != gantry->axis[1] && gantry->racking_q32 > 0;
}

int controller_set_gantries(struct controller *controller,
                            struct controller_gantry gantry[], unsigned count)
{
    controller->gantry = gantry;
    for (unsigned i = 0; i < count; i++)
        if (!gantry_may_be(controller, &gantry[i], i))
            return MOTION_E_ARG;
    controller->gantry_count = count;
    controller->gantries = count > 0 ? &gantries : NULL;
    return MOTION_OK;
}
