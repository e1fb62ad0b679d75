/* motion/kinematics/arc.c - a circular rail; see carrier.h. */
#include "motion/core/err.h"
#include "motion/kinematics/carrier.h"
#include "motion/number/elementary.h"
#include "motion/number/trig.h"

static uint32_t arc_axes(const struct motion_carrier *carrier)
{
    (void)carrier;
    return 1;
}

int motion_arc_plane(struct motion_arc *arc, struct motion_vec normal,
                     struct motion_vec start)
{
    struct motion_dir from;
    int err = motion_vec_unit(normal, &arc->normal);

    if (err == MOTION_OK)
        err = motion_vec_unit(start, &from);
    if (err == MOTION_OK)
        err = motion_dir_perpendicular(from, arc->normal, &arc->start);
    return err;
}

static struct motion_real arc_radius(const struct motion_arc *arc)
{
    return motion_real_from_q(arc->radius_q32, 32);
}

static struct motion_real arc_round(const struct motion_arc *arc)
{
    return motion_real_twice(
        motion_real_mul(motion_elementary_pi(), arc_radius(arc)));
}

static int arc_place(const struct motion_carrier *carrier,
                     const int64_t *axis_q32, struct motion_mount *mount)
{
    const struct motion_arc *const arc = &carrier->as.arc;
    int64_t at_q32, s, c, angle_turn;
    int err = motion_axis_coordinate(&arc->axis, axis_q32[0], &at_q32);

    if (arc->radius_q32 <= 0)
        return MOTION_E_ARG;
    if (err < 0)
        return err;
    angle_turn = motion_trig_from_rad(
        motion_real_div(motion_real_from_q(at_q32, 32), arc_radius(arc)));
    motion_trig_sincos(angle_turn, &s, &c);
    mount->pivot = motion_vec_add(
        arc->centre, motion_vec_scale(motion_vec_from_dir(motion_dir_turn(
                                          arc->start, arc->normal, s, c)),
                                      arc_radius(arc)));
    mount->level = carrier->level;
    if (arc->is_turning)
        mount->level = motion_quat_mul(
            motion_quat_about(arc->normal, angle_turn), mount->level);
    return MOTION_OK;
}

/* `at`, a whole number of rounds further, as near to the axis before as can
 * be. */
static int arc_nearest(const struct motion_arc *arc, struct motion_real at,
                       const int64_t *before_q32, int64_t *axis_q32)
{
    int64_t near_q32, rounds;
    int err;

    if (before_q32 == NULL)
        return motion_axis_position_real(&arc->axis, at, axis_q32);
    err = motion_axis_coordinate(&arc->axis, before_q32[0], &near_q32);
    if (err == MOTION_OK)
        err = motion_real_round(
            motion_real_div(
                motion_real_sub(motion_real_from_q(near_q32, 32), at),
                arc_round(arc)),
            0, &rounds);
    if (err != MOTION_OK)
        return err;
    return motion_axis_position_real(
        &arc->axis,
        motion_real_add(
            at, motion_real_mul(motion_real_int(rounds), arc_round(arc))),
        axis_q32);
}

static int arc_find(const struct motion_carrier *carrier,
                    struct motion_vec pivot, const int64_t *before_q32,
                    int64_t *axis_q32)
{
    const struct motion_arc *const arc = &carrier->as.arc;
    const struct motion_vec normal = motion_vec_from_dir(arc->normal),
                            start = motion_vec_from_dir(arc->start),
                            from = motion_vec_sub(pivot, arc->centre);
    const struct motion_real x = motion_vec_dot(from, start),
                             y = motion_vec_dot(
                                 from, motion_vec_cross(normal, start));
    const struct motion_real off =
        motion_real_sub(motion_real_sqrt(motion_real_add(motion_real_sqr(x),
                                                         motion_real_sqr(y))),
                        arc_radius(arc));

    if (arc->radius_q32 <= 0)
        return MOTION_E_ARG;
    if (!motion_mount_is_near(motion_vec_dot(from, normal)) ||
        !motion_mount_is_near(off))
        return MOTION_E_UNREACHABLE;
    return arc_nearest(
        arc,
        motion_real_mul(motion_trig_rad(motion_trig_atan2_real(y, x)),
                        arc_radius(arc)),
        before_q32, axis_q32);
}

const struct motion_carrier_kind motion_carrier_arc = {
    .axes = arc_axes,
    .place = arc_place,
    .find = arc_find,
};
