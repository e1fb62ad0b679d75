/* motion/number/quat.h - rotations as unit quaternions, and curves between
 * them.
 *
 * A quaternion is w, x, y, z in Q2.62; it turns the body frame into the world
 * frame: v_world = q v_body q*.  q and -q are the same rotation.  A rotation
 * vector is axis times angle in radian; in q1 = q0 exp(r) it is seen from the
 * body.  Angles of half-turns and identical quaternions are no special cases:
 * every curve here goes through logarithm and exponential, which keep their
 * precision at 0 and at 180 degrees alike.  The results are unit quaternions
 * within 2^-58.
 * Sources: K. Shoemake, Animating rotation with quaternion curves, SIGGRAPH
 * 1985 (slerp); Quaternion calculus and fast animation, SIGGRAPH course 1987
 * (squad).  Plan-time. */
#ifndef MOTION_NUMBER_QUAT_H
#define MOTION_NUMBER_QUAT_H

#include <stdint.h>

#include "motion/number/vec.h"

struct motion_quat {
    int64_t w, x, y, z; /* Q2.62 */
};

#define MOTION_QUAT_ONE ((struct motion_quat){ (int64_t)1 << 62, 0, 0, 0 })

/* The unit quaternion along w, x, y, z of any size, all in the same format;
 * MOTION_E_RANGE when all are zero. */
int motion_quat_unit(const int64_t wxyz[4], struct motion_quat *q);

struct motion_quat motion_quat_mul(struct motion_quat a, struct motion_quat b);
/* The inverse rotation. */
struct motion_quat motion_quat_inverse(struct motion_quat q);
struct motion_quat motion_quat_neg(struct motion_quat q);
int64_t motion_quat_dot_q62(struct motion_quat a, struct motion_quat b);

/* `v` in the body frame as seen from the world. */
struct motion_dir motion_quat_turn(struct motion_quat q, struct motion_dir v);

/* The frame whose x, y, z axes are these three perpendicular directions,
 * w >= 0; MOTION_E_ARG when they are not right-handed and perpendicular within
 * 2^-20. */
int motion_quat_from_axes(const struct motion_dir axis[3],
                          struct motion_quat *q);

/* Rotation vector of q: 0 <= angle <= pi where w >= 0, up to 2 pi where w < 0.
 * MOTION_E_RANGE at q = -1, whose axis can be any. */
int motion_quat_log(struct motion_quat q, struct motion_vec *rotation);
/* Angles up to 2^20 rad. */
struct motion_quat motion_quat_exp(struct motion_vec rotation);
/* About an axis by an angle (trig.h). */
struct motion_quat motion_quat_about(struct motion_dir axis,
                                     int64_t angle_turn);

/* Constant speed on the great circle from a to b, x = 0 .. 1 as Q2.62: the
 * shorter way, so the result may be -b at x = 1.  At exactly 180 degrees the
 * way of b as given.  MOTION_E_ARG for x outside. */
int motion_quat_slerp(struct motion_quat a, struct motion_quat b, int64_t x_q62,
                      struct motion_quat *q);
/* From a to b itself, even if -b is nearer; MOTION_E_RANGE for b = -a, where
 * there is no one way. */
int motion_quat_slerp_signed(struct motion_quat a, struct motion_quat b,
                             int64_t x_q62, struct motion_quat *q);

/* Inner points of squad for a chain of keys, each nearer to the one before than its
 * opposite is:
 *   s_i = q_i exp(-(log(q_i* q_i+1) + log(q_i* q_i-1)) / 4),
 * the first and last key themselves.  MOTION_E_EMPTY for no key. */
int motion_quat_squad_inner(const struct motion_quat *key, uint32_t count,
                            struct motion_quat *inner);
/* slerp(slerp(q0, q1, u), slerp(s0, s1, u), 2u (1 - u)), signs as given: C1
 * for keys at even times.  Errors as motion_quat_slerp_signed. */
int motion_quat_squad(const struct motion_quat key[2],
                      const struct motion_quat inner[2], int64_t u_q62,
                      struct motion_quat *q);

#endif
