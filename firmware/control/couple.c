/* firmware/control/couple.c - see couple.h. */
#include "firmware/control/couple.h"

#include <stddef.h>

#include "firmware/control/jog.h"
#include "firmware/control/parts.h"
#include "motion/core/err.h"
#include "motion/core/fixed.h"

#define COUPLE_SECOND_NS  INT64_C(1000000000)
#define COUPLE_WINDOW_Q32 ((int64_t)1 << 12)
#define COUPLE_SHIFT_MAX  13
/* log2 s: as time no curve is much longer, so that its slopes have enough bits where a
 * master counts and its follower goes in metres. */
#define COUPLE_LONG 6

/* --- a cam --- */

int64_t controller_cam_ns_q12(const struct controller_cam *cam, int64_t m_q32)
{
    int64_t t_ns_q12;
    if (m_q32 <= cam->low_q32 ||
        motion_fixed_mulshift(m_q32 - cam->low_q32, MOTION_FIXED_S_Q12,
                              32u + cam->shift, &t_ns_q12) < 0)
        return 0;
    return t_ns_q12 < cam->track->end_ns_q12 ? t_ns_q12
                                             : cam->track->end_ns_q12;
}

uint8_t controller_cam_shift(int64_t low_q32, int64_t high_q32)
{
    uint8_t shift = 0;
    while (shift < COUPLE_SHIFT_MAX &&
           ((uint64_t)high_q32 - (uint64_t)low_q32) >>
                   (32 + COUPLE_LONG + shift) !=
               0)
        shift++;
    return shift;
}

/* No less than it is: a state is rounded by a unit. */
static int64_t couple_largest(const struct controller_cam *cam,
                              enum motion_quantity quantity, unsigned shift)
{
    const int64_t largest = controller_largest(cam->track, quantity);
    return largest > 0 && largest < INT64_MAX ? (largest >> shift) + 1
                                              : largest;
}

int controller_cam_init(struct controller_cam *cam)
{
    struct motion_extreme pos;
    int64_t long_ns_q12;
    if (cam->low_q32 >= cam->high_q32 || cam->track->count == 0 ||
        motion_fixed_mulshift(cam->high_q32 - cam->low_q32, MOTION_FIXED_S_Q12,
                              32u + cam->shift, &long_ns_q12) < 0 ||
        motion_fixed_abs(cam->track->end_ns_q12 - long_ns_q12) >
            MOTION_FIXED_NS_Q12)
        return MOTION_E_ARG;
    cam->slope_q32 = couple_largest(cam, MOTION_VEL, cam->shift);
    cam->second_q32 = couple_largest(cam, MOTION_ACC, 0);
    cam->third_q32 = couple_largest(cam, MOTION_JERK, 0);
    motion_track_extreme(cam->track, MOTION_POS, &pos);
    cam->window_q32 = COUPLE_WINDOW_Q32 + ((pos.max - pos.min) >> 30);
    return MOTION_OK;
}

void controller_cam_at(const struct controller_cam *cam,
                       struct motion_cursor *cursor, int64_t m_q32,
                       struct motion_sample *curve)
{
    motion_track_sample(cam->track, cursor, controller_cam_ns_q12(cam, m_q32),
                        curve);
}

/* --- the tick --- */

static void couple_at(const struct controller_cam *cam,
                      const struct hal_drive_target *master,
                      struct motion_cursor *cursor, struct motion_sample *out)
{
    struct motion_sample curve;
    const unsigned shift = cam->shift;
    int64_t bend_q32, part_q32;
    controller_cam_at(cam, cursor, master->pos_q32, &curve);
    *out = (struct motion_sample){ .pos_q32 = curve.pos_q32 + cam->offset_q32 };
    if (motion_fixed_mulshift(curve.vel_q32, master->vel_q32, 32 + shift,
                              &out->vel_q32) < 0)
        out->vel_q32 = 0;
    if (motion_fixed_mulshift(curve.vel_q32, master->acc_q32, 32 + shift,
                              &out->acc_q32) < 0)
        out->acc_q32 = 0;
    if (motion_fixed_mulshift(curve.acc_q32, master->vel_q32, 32 + shift,
                              &bend_q32) == MOTION_OK &&
        motion_fixed_mulshift(bend_q32, master->vel_q32, 32 + shift,
                              &part_q32) == MOTION_OK &&
        motion_fixed_add(out->acc_q32, part_q32, &part_q32) == MOTION_OK)
        out->acc_q32 = part_q32;
}

static void couple_tell(struct controller *controller)
{
    for (unsigned i = 0; i < controller->config.axis_count; i++) {
        struct controller_axis *axis = &controller->axis[i];
        struct motion_sample sample;
        if (axis->cam == NULL ||
            controller->axis[axis->cam->master].track == NULL)
            continue;
        if (axis->track != NULL) {
            axis->target.pos_q32 += axis->cam->offset_q32;
            continue;
        }
        couple_at(axis->cam, &controller->axis[axis->cam->master].target,
                  &axis->cursor, &sample);
        controller_tell(controller, i, &sample);
    }
}

/* --- limits --- */

bool controller_any_coupled(const struct controller *controller)
{
    for (unsigned i = 0; i < controller->config.axis_count; i++)
        if (controller->axis[i].cam != NULL)
            return true;
    return false;
}

/* value / (by parts), rounded down; by 0: there is no such limit. */
static int64_t couple_share(int64_t value, int64_t by_q32, int64_t parts)
{
    const int64_t share_q32 =
        motion_fixed_muldiv_sat(value / parts, MOTION_FIXED_ONE_Q32, by_q32);
    return share_q32 > 1 ? share_q32 - 1 : 1;
}

/* What is beyond the format stays there. */
static int64_t couple_times(int64_t a_q32, int64_t b_q32)
{
    int64_t product_q32;
    return a_q32 == INT64_MAX ||
                   motion_fixed_mulshift(a_q32, b_q32, 32, &product_q32) < 0
               ? INT64_MAX
               : product_q32;
}

static int64_t couple_sum(int64_t a, int64_t b)
{
    int64_t sum;
    return motion_fixed_add(a, b, &sum) < 0 ? INT64_MAX : sum;
}

static void couple_least(int64_t *value, int64_t most)
{
    if (*value > most)
        *value = most;
}

/* A speed of the master, by the track's time. */
static int64_t couple_by_track(const struct controller_cam *cam,
                               int64_t vel_q32)
{
    return (vel_q32 >> cam->shift) + 1;
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
        /* a square of counts/s is beyond the format */
        const int64_t vel_q32 = couple_by_track(cam, limit->vel_q32);
        const int64_t acc_q32 =
            couple_times(couple_times(cam->second_q32, vel_q32), vel_q32);
        const int64_t jerk_q32 = couple_times(
            couple_times(couple_times(cam->third_q32, vel_q32), vel_q32),
            vel_q32);
        const bool fits = acc_q32 <= own->acc_q32 / 2 &&
                          (own->jerk_q32 == 0 || jerk_q32 <= own->jerk_q32 / 3);
        if (fits)
            return;
        limit->vel_q32 -= limit->vel_q32 / 8;
    }
}

/* What is left for C' m'' and, of the jerk, for 3 C'' m' m'' and C' m'''.  A stop
 * begins at the speed that the limits allow: no more of it is to be kept, and what
 * is left by the stop limits is then no less than by the limits. */
static void couple_reduce(const struct controller_cam *cam,
                          const struct controller_axis_config *own, bool stop,
                          struct motion_clock_limit *limit)
{
    const struct motion_clock_limit *keep = stop ? &own->stop : &own->limit;
    const bool bends = cam->second_q32 != 0;
    couple_speed(cam, &own->limit, limit);
    couple_least(&limit->acc_q32,
                 couple_share(keep->acc_q32, cam->slope_q32, bends ? 2 : 1));
    if (keep->jerk_q32 == 0)
        return;
    if (bends) {
        const int64_t by_q32 =
            couple_times(cam->second_q32, couple_by_track(cam, limit->vel_q32));
        const int64_t acc_q32 = couple_share(keep->jerk_q32, by_q32, 9);
        if (acc_q32 <= INT64_MAX >> cam->shift)
            couple_least(&limit->acc_q32, acc_q32 << cam->shift);
    }
    const int64_t jerk_q32 =
        couple_share(keep->jerk_q32, cam->slope_q32, bends ? 3 : 1);
    if (limit->jerk_q32 == 0)
        limit->jerk_q32 = jerk_q32;
    couple_least(&limit->jerk_q32, jerk_q32);
}

enum motion_quantity controller_cam_over(
    const struct controller_cam *cam, const struct controller_axis_config *own,
    const struct controller_axis_config *master,
    const struct motion_track *track, int64_t *peak_q32, int64_t *most_q32)
{
    struct motion_clock_limit limit = master->limit;
    couple_reduce(cam, own, false, &limit);
    const int64_t most[] = { 0, limit.vel_q32, limit.acc_q32, limit.jerk_q32 };
    for (int k = MOTION_VEL; k <= MOTION_JERK; k++) {
        *peak_q32 = controller_peak(track, (enum motion_quantity)k);
        *most_q32 = most[k];
        if (*most_q32 != 0 && *peak_q32 - (*peak_q32 >> 28) > *most_q32)
            return (enum motion_quantity)k;
    }
    return MOTION_POS;
}

static void couple_limit(const struct controller *controller, unsigned master,
                         bool stop, struct motion_clock_limit *limit)
{
    for (unsigned i = 0; i < controller->config.axis_count; i++) {
        const struct controller_axis *axis = &controller->axis[i];
        if (axis->cam != NULL && axis->cam->master == master &&
            axis->track == NULL)
            couple_reduce(axis->cam, &controller->config.axis[i], stop, limit);
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

/* A cam is of one follower: it has its offset. */
static bool couple_has(const struct controller *controller,
                       const struct controller_cam *cam)
{
    for (unsigned i = 0; i < controller->config.axis_count; i++)
        if (controller->axis[i].cam == cam)
            return true;
    return false;
}

static bool couple_is_inside(const struct motion_extreme *pos, int64_t low_q32,
                             int64_t high_q32)
{
    return pos->min >= low_q32 - MOTION_TRACK_POS_ROUNDING &&
           pos->max <= high_q32 + MOTION_TRACK_POS_ROUNDING;
}

/* So much of a step of speed, and of acceleration, does the plan's check let pass
 * (motion/plan/check.c): a hundredth of what the limits let happen in a period. */
static struct motion_sample couple_steps(const struct controller *controller,
                                         const struct motion_clock_limit *limit)
{
    const int64_t period_ns = controller->config.period_ns;
    const int64_t hundred = 100 * COUPLE_SECOND_NS;
    struct motion_sample most = { .acc_q32 = INT64_MAX };
    most.vel_q32 = motion_fixed_muldiv_sat(limit->acc_q32, period_ns, hundred);
    if (limit->jerk_q32 == 0)
        return most;
    most.acc_q32 = motion_fixed_muldiv_sat(limit->jerk_q32, period_ns, hundred);
    couple_least(&most.vel_q32, motion_fixed_muldiv_sat(most.acc_q32, period_ns,
                                                        COUPLE_SECOND_NS));
    return most;
}

/* One side of a border: speed and acceleration, and what rounding made of them: of the
 * coefficients, and of places, a half of 2^-32, as in motion/plan/check.c. */
static void couple_side(const struct motion_segment *segment, int64_t at_ns_q12,
                        struct motion_state *state, struct motion_sample *most)
{
    const int64_t per_q32 =
        motion_fixed_muldiv_sat(1, MOTION_FIXED_S_Q12, segment->dur_ns_q12) + 1;
    motion_segment_state(segment, at_ns_q12, state);
    most->vel_q32 = couple_sum(
        most->vel_q32,
        couple_sum(motion_segment_rounding(segment, MOTION_VEL), 3 * per_q32));
    most->acc_q32 = couple_sum(
        most->acc_q32,
        couple_sum(motion_segment_rounding(segment, MOTION_ACC),
                   motion_fixed_muldiv_sat(12 * per_q32, MOTION_FIXED_S_Q12,
                                           segment->dur_ns_q12)));
}

static bool couple_is_near(int64_t a, int64_t b, int64_t most)
{
    int64_t step;
    return motion_fixed_sub(a, b, &step) == MOTION_OK &&
           motion_fixed_abs(step) <= (uint64_t)most;
}

/* Between segments, and, of one that rests there, at its start and its end. */
static bool couple_joins(const struct motion_track *track,
                         const struct motion_sample *most, bool rests)
{
    const uint32_t ends = rests ? 1 : 0;
    for (uint32_t i = 1 - ends; i < track->count + ends; i++) {
        struct motion_state before = { 0 }, after = { 0 };
        struct motion_sample may = *most;
        if (i > 0)
            couple_side(&track->segment[i - 1],
                        track->segment[i - 1].dur_ns_q12, &before, &may);
        if (i < track->count)
            couple_side(&track->segment[i], 0, &after, &may);
        if (!couple_is_near(before.vel_q32, after.vel_q32, may.vel_q32) ||
            !couple_is_near(before.acc_q32, after.acc_q32, may.acc_q32))
            return false;
    }
    return true;
}

/* Steps of the curve at the highest speed of the master. */
static bool couple_curve_joins(const struct controller *controller,
                               unsigned axis, const struct controller_cam *cam)
{
    const struct controller_axis_config *config = controller->config.axis;
    struct motion_sample most = couple_steps(controller, &config[axis].limit);
    struct motion_clock_limit limit = config[cam->master].limit;
    couple_speed(cam, &config[axis].limit, &limit);
    most.vel_q32 = couple_share(most.vel_q32, limit.vel_q32, 1);
    most.acc_q32 = couple_share(couple_share(most.acc_q32, limit.vel_q32, 1),
                                limit.vel_q32, 1);
    most.vel_q32 =
        motion_fixed_muldiv_sat(most.vel_q32, (int64_t)1 << cam->shift, 1);
    most.acc_q32 =
        motion_fixed_muldiv_sat(most.acc_q32, (int64_t)1 << 2 * cam->shift, 1);
    return couple_joins(cam->track, &most, false);
}

/* How far the axis stands from a place; MOTION_E_AWAY: too far. */
static int couple_offset(const struct controller *controller, unsigned axis,
                         const struct controller_cam *cam, int64_t from_q32,
                         int64_t *offset_q32)
{
    return motion_fixed_sub(controller->axis[axis].target.pos_q32, from_q32,
                            offset_q32) == MOTION_OK &&
                   motion_fixed_abs(*offset_q32) <= (uint64_t)cam->window_q32
               ? MOTION_OK
               : MOTION_E_AWAY;
}

/* From the curve. */
static int couple_stand(const struct controller *controller, unsigned axis,
                        struct controller_cam *cam)
{
    struct motion_cursor cursor = { 0 };
    struct motion_sample curve;
    controller_cam_at(cam, &cursor,
                      controller->axis[cam->master].target.pos_q32, &curve);
    return couple_offset(controller, axis, cam, curve.pos_q32,
                         &cam->offset_q32);
}

/* A follower goes along with what its master is to play. */
static int couple_follow(struct controller *controller, unsigned axis,
                         const struct motion_track *master)
{
    struct controller_cam *cam = controller->axis[axis].cam;
    struct motion_extreme pos;
    motion_track_extreme(master, MOTION_POS, &pos);
    if (!couple_is_inside(&pos, cam->low_q32, cam->high_q32))
        return MOTION_E_LIMIT;
    return controller->state == CONTROLLER_READY
               ? couple_stand(controller, axis, cam)
               : MOTION_OK;
}

int controller_coupled_follow(struct controller *controller, unsigned master,
                              const struct motion_track *track)
{
    int err = MOTION_OK;
    for (unsigned i = 0; i < controller->config.axis_count && err == MOTION_OK;
         i++)
        if (controller->axis[i].cam != NULL &&
            controller->axis[i].cam->master == master)
            err = couple_follow(controller, i, track);
    return err;
}

/* By a track of its own, from where it stands: that has to be on the curve, and the
 * axis at its start and on the curve too. */
static int couple_lead(struct controller *controller, unsigned axis,
                       const struct motion_track *own,
                       const struct motion_track *master, int64_t at_ns_q12)
{
    const struct controller_axis_config *config =
        &controller->config.axis[axis];
    struct controller_cam *cam = controller->axis[axis].cam;
    struct controller_couple_off off;
    struct motion_cursor cursor = { 0 };
    struct motion_sample start;
    struct motion_extreme pos;
    if (!controller_couple_judge(cam, own, master, &off))
        return MOTION_E_STATE;
    motion_track_sample(own, &cursor, at_ns_q12, &start);
    motion_track_extreme(own, MOTION_POS, &pos);
    int err = couple_stand(controller, axis, cam);
    if (err == MOTION_OK)
        err = couple_offset(controller, axis, cam, start.pos_q32,
                            &cam->offset_q32);
    pos.min += cam->offset_q32;
    pos.max += cam->offset_q32;
    return err < 0 || couple_is_inside(&pos, config->pos_min_q32,
                                       config->pos_max_q32)
               ? err
               : MOTION_E_LIMIT;
}

/* One follower in a move; a window does not show the whole of it. */
static int couple_begin_axis(struct controller *controller, unsigned axis,
                             const struct motion_track *own,
                             const struct motion_track *master,
                             int64_t at_ns_q12)
{
    if (own == NULL && master == NULL)
        return MOTION_OK;
    if (master == NULL || master->outline != NULL ||
        (own != NULL && own->outline != NULL))
        return MOTION_E_STATE;
    if (own != NULL)
        return couple_lead(controller, axis, own, master, at_ns_q12);
    const struct motion_clock_limit limit =
        controller_limit(controller, controller->axis[axis].cam->master, false);
    const struct motion_sample most = couple_steps(controller, &limit);
    return couple_joins(master, &most, true)
               ? couple_follow(controller, axis, master)
               : MOTION_E_LIMIT;
}

static int couple_begin(struct controller *controller,
                        const struct motion_track *const track[],
                        int64_t at_ns_q12, int *axis)
{
    for (*axis = 0; *axis < (int)controller->config.axis_count; ++*axis) {
        const struct controller_cam *cam = controller->axis[*axis].cam;
        if (cam == NULL)
            continue;
        const int err =
            couple_begin_axis(controller, (unsigned)*axis, track[*axis],
                              track[cam->master], at_ns_q12);
        if (err < 0)
            return err;
    }
    *axis = -1;
    return MOTION_OK;
}

static const struct controller_couple_ops couple_ops = {
    .follow = couple_tell,
};

static const struct controller_couplings couplings = {
    .ops = &couple_ops,
    .reduce = couple_limit,
    .admit = couple_begin,
};

static int couple_check(const struct controller *controller, unsigned axis,
                        struct controller_cam *cam)
{
    const struct controller_axis *own = &controller->axis[axis];
    const struct controller_axis *master = &controller->axis[cam->master];
    const struct controller_axis_config *config =
        &controller->config.axis[axis];
    struct motion_extreme pos;
    if (!own->homed || !master->homed)
        return MOTION_E_UNHOMED;
    if (!couple_curve_joins(controller, axis, cam))
        return MOTION_E_DISCONTINUITY;
    if (master->target.pos_q32 < cam->low_q32 ||
        master->target.pos_q32 > cam->high_q32)
        return MOTION_E_LIMIT;
    const int err = couple_stand(controller, axis, cam);
    motion_track_extreme(cam->track, MOTION_POS, &pos);
    if (err == MOTION_OK) {
        pos.min += cam->offset_q32;
        pos.max += cam->offset_q32;
    }
    return couple_is_inside(&pos, config->pos_min_q32, config->pos_max_q32)
               ? err
               : MOTION_E_LIMIT;
}

/* The axis stands, and so it does where the curve is now. */
static bool couple_stands(const struct controller *controller, unsigned axis,
                          const struct controller_cam *cam)
{
    const struct controller_axis *master = &controller->axis[cam->master];
    const struct controller_axis *own = &controller->axis[axis];
    struct motion_cursor cursor = { 0 };
    struct motion_sample curve;
    controller_cam_at(cam, &cursor, master->target.pos_q32, &curve);
    return own->target.vel_q32 == 0 && own->target.acc_q32 == 0 &&
           curve.vel_q32 == 0 && curve.acc_q32 == 0;
}

/* Also once its acceleration has been led to 0, which adds a^2 / 2j to its speed. */
static bool couple_is_within(const struct hal_drive_target *master,
                             const struct motion_clock_limit *most)
{
    const uint64_t acc = motion_fixed_abs(master->acc_q32);
    uint64_t vel = motion_fixed_abs(master->vel_q32);
    if (most->jerk_q32 > 0)
        vel += (uint64_t)motion_fixed_muldiv_sat((int64_t)acc, (int64_t)acc,
                                                 most->jerk_q32) /
                   2 +
               1;
    return vel <= (uint64_t)most->vel_q32 && acc <= (uint64_t)most->acc_q32;
}

/* The jog of the master is planned anew, by what the cam leaves of its limits and
 * of its range; it must be within the former now. */
static int couple_on_the_way(struct controller *controller,
                             const struct controller_cam *cam)
{
    const struct controller_axis *master = &controller->axis[cam->master];
    const struct controller_jog_goal goal = {
        .axis = cam->master,
        .pos_q32 = master->track->end.pos_q32,
        .vel_q32 = controller_peak(master->track, MOTION_VEL),
        .until_ns = controller->jog->until_ns,
    };
    const struct motion_clock_limit most =
        controller_limit(controller, cam->master, false);
    int err = MOTION_E_LIMIT;
    if (couple_is_within(&master->target, &most))
        err = controller_jog_run(controller, controller->jog, &goal);
    if (err == MOTION_OK) /* also where the plan that there is has been kept */
        err = controller_coupled_follow(controller, cam->master, master->track);
    if (err == MOTION_OK)
        controller_step_load(controller);
    return err;
}

/* MOTION_E_ARG, or MOTION_E_STATE. */
static int couple_may(const struct controller *controller, unsigned axis,
                      const struct controller_cam *cam, bool moves)
{
    const unsigned count = controller->config.axis_count;
    if ((controller->state != CONTROLLER_READY && !moves) ||
        controller->homing ||
        (axis < count && controller->axis[axis].cam != NULL))
        return MOTION_E_STATE;
    if (axis >= count || cam->master >= count || cam->master == axis ||
        couple_is_master(controller, axis) || couple_has(controller, cam) ||
        controller->axis[cam->master].cam != NULL ||
        controller->config.axis[axis].by_goals ||
        controller->config.axis[cam->master].by_goals ||
        controller_gantry_of(controller, axis) != NULL ||
        controller_gantry_of(controller, cam->master) != NULL)
        return MOTION_E_ARG;
    return MOTION_OK;
}

int controller_couple(struct controller *controller, unsigned axis,
                      struct controller_cam *cam)
{
    const bool moves = controller->state == CONTROLLER_MOVING &&
                       controller->jog != NULL &&
                       controller->jog->axis == cam->master;
    int err = couple_may(controller, axis, cam, moves);
    if (err == MOTION_OK)
        err = couple_check(controller, axis, cam);
    if (err == MOTION_OK && moves && !couple_stands(controller, axis, cam))
        err = MOTION_E_AWAY;
    if (err < 0)
        return err;
    controller->axis[axis].cam = cam;
    controller->couplings = &couplings;
    if (moves)
        err = couple_on_the_way(controller, cam);
    if (err < 0)
        controller->axis[axis].cam = NULL;
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
