/* motion/kinematics/mount.h - what the axes of a camera rig have in common:
 * direction and zero of an axis, and the place where a head is mounted.
 *
 * Positions of axes are Q32.32, in degrees where they turn and in the rig's unit
 * of length (mm, m) where they slide; points are motion_vec in that unit, the
 * origin motion_vec_zero() and not zero bytes.  Space is right-handed, z up.
 * A rotation of the camera is a quaternion from its own frame (x right, y up, z
 * backwards) into space, as in quat.h.  Plan-time. */
#ifndef MOTION_KINEMATICS_MOUNT_H
#define MOTION_KINEMATICS_MOUNT_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "motion/number/quat.h"
#include "motion/number/vec.h"

/* Two points nearer than this, 2^-16 of the unit, are one: a demand may be off
 * a rail by so much, and a subject so near to the pupil has no direction. */
#define MOTION_KINEMATICS_NEAR_Q32 ((int64_t)1 << 16)

/* coordinate = axis + offset, or -axis + offset.  All zero: as the axis. */
struct motion_axis_map {
    bool is_reversed;
    int64_t offset_q32;
};

/* MOTION_E_RANGE when the result does not fit Q32.32. */
int motion_axis_coordinate(const struct motion_axis_map *map, int64_t axis_q32,
                           int64_t *coordinate_q32);
int motion_axis_position(const struct motion_axis_map *map,
                         int64_t coordinate_q32, int64_t *axis_q32);
/* The position of an axis whose coordinate is this number. */
int motion_axis_position_real(const struct motion_axis_map *map,
                              struct motion_real coordinate, int64_t *axis_q32);

/* Degrees, whole turns included, of the angle that is nearest to `near`;
 * MOTION_E_RANGE when they do not fit. */
int motion_axis_nearest_deg(int64_t angle_turn, int64_t near_deg_q32,
                            int64_t *deg_q32);

/* Where pan and tilt axes meet, and the rotation of the camera with pan, tilt
 * and roll at 0. */
struct motion_mount {
    struct motion_vec pivot;
    struct motion_quat level;
};

/* The rotation of a camera that looks along `forward`, with its up where `up`
 * is; only the part of `up` at right angles to `forward` counts.  Any lengths.
 * MOTION_E_RANGE when one is zero or they are parallel. */
int motion_mount_level(struct motion_vec forward, struct motion_vec up,
                       struct motion_quat *level);

/* `v` of the camera's frame in space. */
struct motion_vec motion_mount_turn(struct motion_quat q, struct motion_vec v);

/* sqrt(side^2 - leg_sqr): the other leg of a right-angled triangle.  0 where the
 * root is of rounding alone, -1 where there is none. */
struct motion_real motion_mount_leg(struct motion_real side,
                                    struct motion_real leg_sqr);

/* Below the tolerance above. */
bool motion_mount_is_near(struct motion_real distance);

#endif
