/* firmware/control/couple.c - see couple.h. */
#include "firmware/control/couple.h"

#include <stddef.h>

#include "firmware/control/jog.h"
#include "firmware/control/parts.h"
#include "motion/core/err.h"
#include "motion/core/fixed.h"

/* --- a cam --- */

int64_t controller_cam_ns_q12(const struct controller_cam *cam, int64_t m_q32)
{
    int64_t t_ns_q12;
    if (m_q32 <= cam->low_q32 ||
        motion_fixed_mulshift(m_q32 - cam->low_q32, MOTION_FIXED_S_Q12, 32,
                              &t_ns_q12) < 0)
        return 0;
    return t_ns_q12 < cam->track->end_ns_q12 ? t_ns_q12
                                             : cam->track->end_ns_q12;
}

/* Between two segments the slope goes on, but for rounding. */
static bool couple_is_smooth(const struct motion_track *track)
{
    struct motion_state before, after;
    int64_t step_q32, t_ns_q12 = 0;
    for (uint32_t i = 0; i + 1 < track->count; i++) {
        t_ns_q12 += track->segment[i].dur_ns_q12;
        motion_track_state(track, t_ns_q12 - 1, &before);
        motion_track_state(track, t_ns_q12, &after);
        if (motion_fixed_sub(after.vel_q32, before.vel_q32, &step_q32) < 0 ||
            motion_fixed_abs(step_q32) >
                motion_fixed_abs(after.vel_q32 >> 16) + 65536)
            return false;
    }
    return true;
}

int controller_cam_init(struct controller_cam *cam)
{
    int64_t long_ns_q12;
    if (cam->low_q32 >= cam->high_q32 || cam->track->count == 0 ||
        motion_fixed_mulshift(cam->high_q32 - cam->low_q32, MOTION_FIXED_S_Q12,
                              32, &long_ns_q12) < 0 ||
        motion_fixed_abs(cam->track->end_ns_q12 - long_ns_q12) >
            MOTION_FIXED_NS_Q12)
        return MOTION_E_ARG;
    if (!couple_is_smooth(cam->track))
        return MOTION_E_DISCONTINUITY;
    cam->slope_q32 = controller_largest(cam->track, MOTION_VEL);
    cam->second_q32 = controller_largest(cam->track, MOTION_ACC);
    cam->third_q32 = controller_largest(cam->track, MOTION_JERK);
    return MOTION_OK;
}

/* --- the tick --- */

void controller_coupled_at(const struct controller_cam *cam,
                           const struct hal_drive_target *master,
                           struct motion_cursor *cursor,
                           struct motion_sample *out)
{
    struct motion_sample curve;
    int64_t square_q32, part_q32;
    motion_track_sample(cam->track, cursor,
                        controller_cam_ns_q12(cam, master->pos_q32), &curve);
    *out = (struct motion_sample){ .pos_q32 = curve.pos_q32 };
    if (motion_fixed_mulshift(curve.vel_q32, master->vel_q32, 32,
                              &out->vel_q32) < 0)
        out->vel_q32 = 0;
    if (motion_fixed_mulshift(curve.vel_q32, master->acc_q32, 32,
                              &out->acc_q32) < 0)
        out->acc_q32 = 0;
    if (motion_fixed_mulshift(master->vel_q32, master->vel_q32, 32,
                              &square_q32) == MOTION_OK &&
        motion_fixed_mulshift(square_q32, curve.acc_q32, 32, &part_q32) ==
            MOTION_OK &&
        motion_fixed_add(out->acc_q32, part_q32, &part_q32) == MOTION_OK)
        out->acc_q32 = part_q32;
}

/* --- limits --- */

bool controller_any_coupled(const struct controller *controller)
{
    for (unsigned i = 0; i < controller->config.axis_count; i++)
        if (controller->axis[i].cam != NULL)
            return true;
    return false;
}

/* value / (by parts); by 0: there is no such limit. */
static int64_t couple_share(int64_t value, int64_t by_q32, int64_t parts)
{
    const int64_t share_q32 =
        motion_fixed_muldiv_sat(value / parts, MOTION_FIXED_ONE_Q32, by_q32);
    return share_q32 > 0 ? share_q32 : 1;
}

static int64_t couple_times(int64_t a_q32, int64_t b_q32)
{
    int64_t product_q32;
    return motion_fixed_mulshift(a_q32, b_q32, 32, &product_q32) < 0
               ? INT64_MAX
               : product_q32;
}

static void couple_least(int64_t *value, int64_t most)
{
    if (*value > most)
        *value = most;
}

/* C'' v^2 takes half of the follower's acceleration and C''' v^3 a third of its
 * jerk at most; a speed that is too high for that is lowered by eighths. */
static void couple_speed(const struct controller_cam *cam,
                         const struct motion_clock_limit *own,
                         struct motion_clock_limit *limit)
{
    couple_least(&limit->vel_q32,
                 couple_share(own->vel_q32, cam->slope_q32, 1));
    for (int i = 0; i < 512 && limit->vel_q32 > 8; i++) {
        const int64_t square_q32 = couple_times(limit->vel_q32, limit->vel_q32);
        const int64_t cube_q32 = couple_times(square_q32, limit->vel_q32);
        const bool fits =
            couple_times(square_q32, cam->second_q32) <= own->acc_q32 / 2 &&
            (own->jerk_q32 == 0 ||
             couple_times(cube_q32, cam->third_q32) <= own->jerk_q32 / 3);
        if (fits)
            return;
        limit->vel_q32 -= limit->vel_q32 / 8;
    }
}

/* What is left for C' m'' and, of the jerk, for 3 C'' m' m'' and C' m'''. */
static void couple_reduce(const struct controller_cam *cam,
                          const struct motion_clock_limit *own,
                          struct motion_clock_limit *limit)
{
    const bool bends = cam->second_q32 != 0;
    couple_speed(cam, own, limit);
    couple_least(&limit->acc_q32,
                 couple_share(own->acc_q32, cam->slope_q32, bends ? 2 : 1));
    if (own->jerk_q32 == 0)
        return;
    if (bends)
        couple_least(&limit->acc_q32,
                     couple_share(own->jerk_q32,
                                  couple_times(cam->second_q32, limit->vel_q32),
                                  9));
    const int64_t jerk_q32 =
        couple_share(own->jerk_q32, cam->slope_q32, bends ? 3 : 1);
    if (limit->jerk_q32 == 0)
        limit->jerk_q32 = jerk_q32;
    couple_least(&limit->jerk_q32, jerk_q32);
}

void controller_coupled_limit(const struct controller *controller,
                              unsigned master, bool hard,
                              struct motion_clock_limit *limit)
{
    for (unsigned i = 0; i < controller->config.axis_count; i++) {
        const struct controller_axis_config *own = &controller->config.axis[i];
        const struct controller_cam *cam = controller->axis[i].cam;
        if (cam != NULL && cam->master == master)
            couple_reduce(cam, hard ? &own->stop : &own->limit, limit);
    }
}

int64_t controller_coupled_place(const struct controller *controller,
                                 unsigned master, int64_t pos_q32)
{
    for (unsigned i = 0; i < controller->config.axis_count; i++) {
        const struct controller_cam *cam = controller->axis[i].cam;
        if (cam == NULL || cam->master != master)
            continue;
        if (pos_q32 < cam->low_q32)
            pos_q32 = cam->low_q32;
        if (pos_q32 > cam->high_q32)
            pos_q32 = cam->high_q32;
    }
    return pos_q32;
}

/* --- commands --- */

static bool couple_is_master(const struct controller *controller, unsigned axis)
{
    for (unsigned i = 0; i < controller->config.axis_count; i++)
        if (controller->axis[i].cam != NULL &&
            controller->axis[i].cam->master == axis)
            return true;
    return false;
}

/* Nearer than what the gate lets pass where the curve goes on by itself. */
static bool couple_is_near(const struct controller_axis *axis, int64_t pos_q32,
                           int64_t curve_q32)
{
    int64_t off_q32;
    return motion_fixed_sub(curve_q32, pos_q32, &off_q32) == MOTION_OK &&
           motion_fixed_abs(off_q32) <= (uint64_t)axis->gate_acc_q32 / 4;
}

static int64_t couple_place_q32(const struct motion_track *track,
                                struct motion_cursor *cursor, int64_t t_ns_q12)
{
    struct motion_sample sample;
    motion_track_sample(track, cursor, t_ns_q12, &sample);
    return sample.pos_q32;
}

static bool couple_agrees(const struct controller_axis *axis,
                          const struct motion_track *own,
                          const struct motion_track *master)
{
    struct motion_cursor at[3] = { 0 };
    int64_t t_ns_q12 = 0;
    for (uint32_t i = 0; i <= own->count; i++) {
        const int64_t m_q32 = couple_place_q32(master, &at[0], t_ns_q12);
        const int64_t curve_q32 = couple_place_q32(
            axis->cam->track, &at[1], controller_cam_ns_q12(axis->cam, m_q32));
        if (m_q32 < axis->cam->low_q32 - MOTION_TRACK_POS_ROUNDING ||
            m_q32 > axis->cam->high_q32 + MOTION_TRACK_POS_ROUNDING ||
            !couple_is_near(axis, couple_place_q32(own, &at[2], t_ns_q12),
                            curve_q32))
            return false;
        if (i < own->count)
            t_ns_q12 += own->segment[i].dur_ns_q12;
    }
    return true;
}

bool controller_coupled_agree(const struct controller *controller,
                              const struct motion_track *const track[])
{
    for (unsigned i = 0; i < controller->config.axis_count; i++) {
        const struct controller_axis *axis = &controller->axis[i];
        if (axis->cam == NULL ||
            (track[i] == NULL && track[axis->cam->master] == NULL))
            continue;
        if (track[i] == NULL || track[axis->cam->master] == NULL ||
            track[i]->outline != NULL ||
            !couple_agrees(axis, track[i], track[axis->cam->master]))
            return false;
    }
    return true;
}

static int couple_check(const struct controller *controller, unsigned axis,
                        const struct controller_cam *cam)
{
    const struct controller_axis *own = &controller->axis[axis];
    const struct controller_axis *master = &controller->axis[cam->master];
    const struct controller_axis_config *config =
        &controller->config.axis[axis];
    struct motion_cursor cursor = { 0 };
    struct motion_extreme pos;
    if (!own->homed || !master->homed)
        return MOTION_E_UNHOMED;
    motion_track_extreme(cam->track, MOTION_POS, &pos);
    if (pos.min < config->pos_min_q32 - MOTION_TRACK_POS_ROUNDING ||
        pos.max > config->pos_max_q32 + MOTION_TRACK_POS_ROUNDING ||
        master->target.pos_q32 < cam->low_q32 ||
        master->target.pos_q32 > cam->high_q32)
        return MOTION_E_LIMIT;
    return couple_is_near(own, own->target.pos_q32,
                          couple_place_q32(cam->track, &cursor,
                                           controller_cam_ns_q12(
                                               cam, master->target.pos_q32)))
               ? MOTION_OK
               : MOTION_E_AWAY;
}

/* The axis stands, and so it does where the curve is now. */
static bool couple_stands(const struct controller *controller, unsigned axis,
                          const struct controller_cam *cam)
{
    const struct controller_axis *master = &controller->axis[cam->master];
    const struct controller_axis *own = &controller->axis[axis];
    struct motion_cursor cursor = { 0 };
    struct motion_sample curve;
    motion_track_sample(cam->track, &cursor,
                        controller_cam_ns_q12(cam, master->target.pos_q32),
                        &curve);
    return own->target.vel_q32 == 0 && own->target.acc_q32 == 0 &&
           curve.vel_q32 == 0 && curve.acc_q32 == 0;
}

/* The jog of the master is planned anew, by what the cam leaves of its limits and
 * of its range; it must be within the former now. */
static int couple_on_the_way(struct controller *controller, unsigned axis,
                             const struct controller_cam *cam)
{
    const struct controller_axis *master = &controller->axis[cam->master];
    struct motion_clock_limit most = controller->config.axis[cam->master].limit;
    const struct controller_jog_goal goal = {
        .axis = cam->master,
        .pos_q32 = master->track->end.pos_q32,
        .vel_q32 = controller_peak(master->track, MOTION_VEL),
        .until_ns = controller->jog->until_ns,
    };
    if (!couple_stands(controller, axis, cam))
        return MOTION_E_AWAY;
    couple_reduce(cam, &controller->config.axis[axis].limit, &most);
    if (motion_fixed_abs(master->target.vel_q32) > (uint64_t)most.vel_q32 ||
        motion_fixed_abs(master->target.acc_q32) > (uint64_t)most.acc_q32)
        return MOTION_E_LIMIT;
    controller->axis[axis].cam = cam;
    const int err = controller_jog_run(controller, controller->jog, &goal);
    if (err < 0)
        controller->axis[axis].cam = NULL;
    return err;
}

int controller_couple(struct controller *controller, unsigned axis,
                      const struct controller_cam *cam)
{
    const unsigned count = controller->config.axis_count;
    const bool moves = controller->state == CONTROLLER_MOVING &&
                       controller->jog != NULL &&
                       controller->jog->axis == cam->master;
    if ((controller->state != CONTROLLER_READY && !moves) || controller->homing)
        return MOTION_E_STATE;
    if (axis >= count || cam->master >= count || cam->master == axis ||
        couple_is_master(controller, axis) ||
        controller->axis[cam->master].cam != NULL ||
        controller->config.axis[axis].by_goals ||
        controller->config.axis[cam->master].by_goals)
        return MOTION_E_ARG;
    if (controller->axis[axis].cam != NULL)
        return MOTION_E_STATE;
    const int err = couple_check(controller, axis, cam);
    if (err == MOTION_OK && moves)
        return couple_on_the_way(controller, axis, cam);
    if (err == MOTION_OK)
        controller->axis[axis].cam = cam;
    return err;
}

int controller_uncouple(struct controller *controller, unsigned axis)
{
    if (controller->state != CONTROLLER_READY ||
        axis >= controller->config.axis_count)
        return MOTION_E_STATE;
    controller->axis[axis].cam = NULL;
    return MOTION_OK;
}
