/* tests/support/quat_real.h - rotations in long double, and random ones. */
#ifndef TESTS_SUPPORT_QUAT_REAL_H
#define TESTS_SUPPORT_QUAT_REAL_H

#include <math.h>

#include "motion/core/err.h"
#include "motion/number/quat.h"
#include "tests/support/check.h"

struct quat {
    long double w, x, y, z;
};

static inline struct quat real(struct motion_quat q)
{
    return (struct quat){ ldexpl((long double)q.w, -62),
                          ldexpl((long double)q.x, -62),
                          ldexpl((long double)q.y, -62),
                          ldexpl((long double)q.z, -62) };
}

static inline long double scalar(struct motion_real a)
{
    return ldexpl((long double)a.m, a.e);
}

static inline long double difference(struct quat a, struct quat b)
{
    return fmaxl(fmaxl(fabsl(a.w - b.w), fabsl(a.x - b.x)),
                 fmaxl(fabsl(a.y - b.y), fabsl(a.z - b.z)));
}

static inline long double rotation_between(struct motion_quat a,
                                           struct motion_quat b)
{
    const struct quat p = real(a), q = real(b);
    const struct quat n = { -q.w, -q.x, -q.y, -q.z };
    return fminl(difference(p, q), difference(p, n));
}

static inline struct motion_quat any(uint64_t *seed)
{
    int64_t part[4];
    struct motion_quat q = MOTION_QUAT_ONE;

    for (int i = 0; i < 4; i++)
        part[i] = check_random_in(seed, -1000000000, 1000000000);
    assert_int_equal(motion_quat_unit(part, &q), MOTION_OK);
    return q;
}

#endif
