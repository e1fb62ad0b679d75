/* motion/number/vec.h - points, differences and directions in space.
 *
 * A motion_vec has three components of any size (real.h), so tiny and huge
 * vectors keep their 60 bits; a motion_dir is a unit vector in Q2.62, each
 * component within 2 units of 2^-62.  Points come in as Q32.32 of the path's
 * unit.  Right-handed: x cross y is z.  Plan-time. */
#ifndef MOTION_NUMBER_VEC_H
#define MOTION_NUMBER_VEC_H

#include <stdbool.h>
#include <stdint.h>

#include "motion/number/real.h"

struct motion_vec {
    struct motion_real x[3];
};

struct motion_dir {
    int64_t q62[3];
};

struct motion_vec motion_vec_zero(void);
struct motion_vec motion_vec_from_q32(const int64_t point_q32[3]);
struct motion_vec motion_vec_from_dir(struct motion_dir dir);

struct motion_vec motion_vec_add(struct motion_vec a, struct motion_vec b);
struct motion_vec motion_vec_sub(struct motion_vec a, struct motion_vec b);
struct motion_vec motion_vec_neg(struct motion_vec a);
struct motion_vec motion_vec_scale(struct motion_vec a, struct motion_real k);
struct motion_vec motion_vec_shift(struct motion_vec a, int32_t bits);
struct motion_real motion_vec_dot(struct motion_vec a, struct motion_vec b);
struct motion_vec motion_vec_cross(struct motion_vec a, struct motion_vec b);
struct motion_real motion_vec_length(struct motion_vec a);

/* a / |a|; MOTION_E_RANGE for the zero vector, nothing written then. */
int motion_vec_unit(struct motion_vec a, struct motion_dir *unit);

/* Every component * 2^bits to nearest (32 for Q32.32); MOTION_E_RANGE when one
 * does not fit. */
int motion_vec_round(struct motion_vec a, int32_t bits, int64_t result[3]);

struct motion_dir motion_dir_neg(struct motion_dir a);
/* No component differs by more than `off`. */
bool motion_dir_is_near(struct motion_dir a, struct motion_dir b,
                        int64_t off_q62);
/* a . b, a x b; the cross product is not a unit vector unless a and b are
 * perpendicular. */
int64_t motion_dir_dot_q62(struct motion_dir a, struct motion_dir b);
struct motion_dir motion_dir_cross(struct motion_dir a, struct motion_dir b);
/* `dir`, perpendicular to `axis`, turned about it by an angle whose sine and
 * cosine are given: dir cos + (axis x dir) sin. */
struct motion_dir motion_dir_turn(struct motion_dir dir, struct motion_dir axis,
                                  int64_t sin_q62, int64_t cos_q62);
/* The part of `a` perpendicular to `axis`, as a unit vector; MOTION_E_RANGE
 * when they are parallel within 2^-30. */
int motion_dir_perpendicular(struct motion_dir a, struct motion_dir axis,
                             struct motion_dir *unit);

#endif
