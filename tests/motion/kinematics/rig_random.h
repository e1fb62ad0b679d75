/* tests/motion/kinematics/rig_random.h - rigs, axes and points at random, and
 * numbers between double and the formats of motion/kinematics. */
#ifndef TESTS_MOTION_KINEMATICS_RIG_RANDOM_H
#define TESTS_MOTION_KINEMATICS_RIG_RANDOM_H

#include <math.h>
#include <string.h>

#include "motion/core/err.h"
#include "motion/kinematics/rig.h"
#include "tests/support/check.h"

#define DEG 57.29577951308232

static inline double uniform(double low, double high)
{
    return low + (high - low) * ldexp((double)(draw() >> 11), -53);
}

static inline struct motion_real real_of(double a)
{
    int exponent;
    const double mantissa = frexp(a, &exponent);

    return motion_real_make((int64_t)ldexp(mantissa, 60), exponent - 60);
}

static inline double number_of(struct motion_real a)
{
    return ldexp((double)a.m, a.e);
}

static inline struct motion_vec vec_of(double x, double y, double z)
{
    return (struct motion_vec){ { real_of(x), real_of(y), real_of(z) } };
}

static inline int64_t q32_of(double a)
{
    return (int64_t)llrint(ldexp(a, 32));
}

static inline double from_q32(int64_t a)
{
    return ldexp((double)a, -32);
}

/* A point, each coordinate within `far` of 0. */
static inline struct motion_vec random_point(double far)
{
    return vec_of(uniform(-far, far), uniform(-far, far), uniform(-far, far));
}

static inline struct motion_dir random_dir(void)
{
    struct motion_dir dir;

    while (motion_vec_unit(random_point(1), &dir) < 0)
        continue;
    return dir;
}

static inline struct motion_axis_map random_map(double far)
{
    return (struct motion_axis_map){ .is_reversed = draw() & 1,
                                     .offset_q32 = q32_of(uniform(-far, far)) };
}

/* `nodal`: how far the pupil may be from the axes. */
static inline void random_head(struct motion_rig *rig, double nodal)
{
    while (motion_mount_level(random_point(1), random_point(1),
                              &rig->carrier.level) < 0)
        continue;
    for (int i = 0; i < MOTION_HEAD_AXES; i++)
        rig->head.axis[i] = random_map(60);
    rig->head.nodal = (struct motion_nodal){ q32_of(uniform(-nodal, nodal)),
                                             q32_of(uniform(-nodal, nodal)),
                                             q32_of(uniform(-nodal, nodal)) };
}

static inline void random_linear(struct motion_carrier *carrier, uint32_t count)
{
    struct motion_linear *const linear = &carrier->as.linear;

    carrier->kind = &motion_carrier_linear;
    linear->count = count;
    linear->origin = random_point(1000);
    for (uint32_t i = 0; i < count; i++) {
        linear->direction[i] = random_dir();
        linear->axis[i] = random_map(500);
    }
}

static inline void random_arc(struct motion_carrier *carrier)
{
    struct motion_arc *const arc = &carrier->as.arc;

    carrier->kind = &motion_carrier_arc;
    arc->centre = random_point(1000);
    arc->radius_q32 = q32_of(uniform(200, 4000));
    arc->is_turning = draw() & 1;
    arc->axis = random_map(500);
    while (motion_arc_plane(arc, random_point(1), random_point(1)) < 0)
        continue;
}

static inline void random_gantry(struct motion_carrier *carrier)
{
    struct motion_gantry *const gantry = &carrier->as.gantry;

    carrier->kind = &motion_carrier_gantry;
    gantry->at_y_q32[0] = q32_of(uniform(-2000, -500));
    gantry->at_y_q32[1] = q32_of(uniform(500, 2000));
    for (int i = 0; i < 4; i++)
        gantry->axis[i] = random_map(500);
}

static inline void random_jib(struct motion_carrier *carrier,
                              enum motion_jib_mount mount)
{
    struct motion_jib *const jib = &carrier->as.jib;

    carrier->kind = &motion_carrier_jib;
    jib->foot = random_point(1000);
    jib->length_q32 = q32_of(uniform(1500, 3000));
    jib->extend_min_q32 = 0;
    jib->extend_max_q32 = q32_of(1200);
    jib->drop = vec_of(uniform(-80, 80), uniform(-80, 80), uniform(-300, 300));
    jib->mount = mount;
    for (int i = 0; i < 2; i++)
        jib->axis[i] = random_map(30);
    jib->axis[2] = (struct motion_axis_map){ .offset_q32 = 0 };
}

#endif
