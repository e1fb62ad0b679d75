/* tests/support/spline_keys.h - random keys, and cubics and quintics in long
 * double. */
#ifndef TESTS_SUPPORT_SPLINE_KEYS_H
#define TESTS_SUPPORT_SPLINE_KEYS_H

#include <inttypes.h>
#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "motion/core/err.h"
#include "motion/core/fixed.h"
#include "motion/curve/spline.h"
#include "tests/support/check.h"

#define ONE           MOTION_FIXED_ONE_Q32
#define SEC           MOTION_FIXED_S_Q12
#define KEYS          24
#define KEYS_CAPACITY 8192

static struct motion_key key[KEYS];
static struct motion_segment storage[KEYS_CAPACITY];
static struct motion_track track;

/* `count` keys, neighbouring spans up to 10^decades different. */
static inline void draw_keys(uint32_t count, long double decades)
{
    int64_t t = (int64_t)(draw() % (uint64_t)(10 * SEC)) - SEC;

    memset(key, 0, sizeof key);
    for (uint32_t i = 0; i < count; i++) {
        key[i].t_ns_q12 = t;
        key[i].pos_q32 =
            (int64_t)((draw_unit() * 2 - 1) * 300 * (long double)ONE);
        t += (int64_t)(0.05L * powl(10, draw_unit() * decades) *
                       (long double)SEC);
    }
}

static inline void start_track(void)
{
    motion_track_init(&track, storage, ARRAY_LEN(storage), key[0].pos_q32);
}

static inline long double value(struct motion_real a)
{
    return ldexpl((long double)a.m, a.e);
}

static inline long double span(uint32_t i)
{
    return (long double)(key[i + 1].t_ns_q12 - key[i].t_ns_q12) / SEC;
}

static inline long double displacement(uint32_t i)
{
    return ldexpl((long double)(key[i + 1].pos_q32 - key[i].pos_q32), -32);
}

static inline long double vel(uint32_t i)
{
    return value(key[i].vel);
}

static inline long double acc(uint32_t i)
{
    return value(key[i].acc);
}

static inline void assert_equal_to(long double got, long double want,
                                   long double scale, const char *what)
{
    if (!(fabsl(got - want) <= 1e-12L * scale))
        fail_msg("%s: got %.18Lg, want %.18Lg of %Lg", what, got, want, scale);
}

/* Keys are hit to the bit by the track. */
static inline void assert_keys_hit(uint32_t count)
{
    for (uint32_t i = 0; i < count; i++) {
        struct motion_cursor cursor = { 0 };
        struct motion_sample s;
        motion_track_sample(&track, &cursor, key[i].t_ns_q12 - key[0].t_ns_q12,
                            &s);
        assert_int_equal(s.pos_q32, key[i].pos_q32);
    }
}

#endif
