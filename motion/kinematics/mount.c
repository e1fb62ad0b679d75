/* motion/kinematics/mount.c - see mount.h. */
#include "motion/kinematics/mount.h"

#include "motion/core/err.h"
#include "motion/number/trig.h"

#define MOUNT_ONE_Q62    ((int64_t)1 << 62)
#define MOUNT_ROUND_BITS 40 /* of a difference of squares */

int motion_axis_coordinate(const struct motion_axis_map *map, int64_t axis_q32,
                           int64_t *coordinate_q32)
{
    return map->is_reversed
               ? motion_fixed_sub(map->offset_q32, axis_q32, coordinate_q32)
               : motion_fixed_add(axis_q32, map->offset_q32, coordinate_q32);
}

int motion_axis_position(const struct motion_axis_map *map,
                         int64_t coordinate_q32, int64_t *axis_q32)
{
    return map->is_reversed
               ? motion_fixed_sub(map->offset_q32, coordinate_q32, axis_q32)
               : motion_fixed_sub(coordinate_q32, map->offset_q32, axis_q32);
}

int motion_axis_position_real(const struct motion_axis_map *map,
                              struct motion_real coordinate, int64_t *axis_q32)
{
    int64_t coordinate_q32;
    int err = motion_real_round(coordinate, 32, &coordinate_q32);

    return err < 0 ? err : motion_axis_position(map, coordinate_q32, axis_q32);
}

int motion_axis_nearest_deg(int64_t angle_turn, int64_t near_deg_q32,
                            int64_t *deg_q32)
{
    const int64_t more =
        motion_trig_diff(angle_turn, motion_trig_from_deg_q32(near_deg_q32));

    return motion_fixed_add(near_deg_q32, motion_trig_deg_q32(more), deg_q32);
}

int motion_mount_level(struct motion_vec forward, struct motion_vec up,
                       struct motion_quat *level)
{
    struct motion_dir axis[3], view, upwards; /* right, up, backwards */
    int err = motion_vec_unit(forward, &view);

    if (err == MOTION_OK)
        err = motion_vec_unit(up, &upwards);
    if (err == MOTION_OK)
        err = motion_dir_perpendicular(upwards, view, &axis[1]);
    if (err < 0)
        return err;
    axis[0] = motion_dir_cross(view, axis[1]);
    axis[2] = motion_dir_neg(view);
    return motion_quat_from_axes(axis, level);
}

struct motion_vec motion_mount_turn(struct motion_quat q, struct motion_vec v)
{
    struct motion_vec sum = motion_vec_zero();

    for (int i = 0; i < 3; i++) {
        struct motion_dir axis = { { 0, 0, 0 } };

        if (motion_real_is_zero(v.x[i]))
            continue;
        axis.q62[i] = MOUNT_ONE_Q62;
        axis = motion_quat_turn(q, axis);
        sum = motion_vec_add(
            sum, motion_vec_scale(motion_vec_from_dir(axis), v.x[i]));
    }
    return sum;
}

struct motion_real motion_mount_leg(struct motion_real side,
                                    struct motion_real leg_sqr)
{
    const struct motion_real square = motion_real_sqr(side);
    const struct motion_real rest = motion_real_sub(square, leg_sqr);
    const struct motion_real small =
        motion_real_scale(motion_real_max(square, leg_sqr), -MOUNT_ROUND_BITS);

    if (motion_real_lt(rest, motion_real_neg(small)))
        return motion_real_int(-1);
    return motion_real_sqrt(rest);
}

bool motion_mount_is_near(struct motion_real distance)
{
    return motion_real_cmp(
               motion_real_abs(distance),
               motion_real_from_q(MOTION_KINEMATICS_NEAR_Q32, 32)) <= 0;
}
