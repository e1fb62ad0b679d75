/* motion/number/elementary.c - see elementary.h. */
#include "motion/number/elementary.h"

#include "motion/core/fixed.h"

struct motion_real motion_elementary_ln2(void)
{
    return motion_real_from_q(INT64_C(6393154322601327830), 63);
}

struct motion_real motion_elementary_pi(void)
{
    return motion_real_from_q(INT64_C(7244019458077122842), 61);
}

/* e^x for |x| <= ln 2 / 2: the first term left out, x^17 / 17!, is below
 * 2^-74. */
static struct motion_real elementary_exp(struct motion_real x)
{
    struct motion_real sum = motion_real_int(1);

    for (int k = 16; k >= 1; k--) {
        sum = motion_real_div(motion_real_mul(sum, x), motion_real_int(k));
        sum = motion_real_add(motion_real_int(1), sum);
    }
    return sum;
}

/* 2^a = 2^n e^((a - n) ln 2) with n next to a.  a - n is exact to 2^-46 of a's
 * last place, for a there are 15 bits before the point. */
struct motion_real motion_elementary_exp2(struct motion_real a)
{
    int64_t whole = 0;

    (void)motion_real_round(a, 0, &whole);
    a = motion_real_sub(a, motion_real_int(whole));
    a = motion_real_mul(a, motion_elementary_ln2());
    return motion_real_scale(elementary_exp(a), (int)whole);
}

/* The turn's quarter picks which of the two it is, and the signs. */
void motion_elementary_sincos(struct motion_real quarters,
                              struct motion_real *sine,
                              struct motion_real *cosine)
{
    int64_t quarter = 0, phase = 0, sin_q62, cos_q62;
    struct motion_real s, c;

    (void)motion_real_floor(quarters, 0, &quarter);
    quarters = motion_real_sub(quarters, motion_real_int(quarter));
    (void)motion_real_round(quarters, 62, &phase);
    motion_fixed_sincos_q62((uint64_t)phase, &sin_q62, &cos_q62);
    s = motion_real_from_q(sin_q62, 62);
    c = motion_real_from_q(cos_q62, 62);
    *sine = quarter & 1 ? c : s;
    *cosine = quarter & 1 ? s : c;
    if (quarter & 2)
        *sine = motion_real_neg(*sine);
    if ((quarter + 1) & 2)
        *cosine = motion_real_neg(*cosine);
}

/* For 0 <= a <= 0.71, by Newton's method on the sine: x = a is within 0.08 and
 * the error is squared and at most halved five times, 2^-3.6 -> 2^-120. */
static struct motion_real elementary_asin_small(struct motion_real a)
{
    const struct motion_real turn =
        motion_real_half(motion_elementary_pi()); /* radian of a quarter */
    struct motion_real x = motion_real_div(a, turn);

    for (int i = 0; i < 5; i++) {
        struct motion_real s, c, step;

        motion_elementary_sincos(x, &s, &c);
        step = motion_real_div(motion_real_sub(s, a), motion_real_mul(c, turn));
        x = motion_real_sub(x, step);
    }
    return x;
}

/* Near 1 from the cosine, sqrt((1 - a)(1 + a)): there the sine is flat. */
struct motion_real motion_elementary_asin(struct motion_real a)
{
    const struct motion_real one = motion_real_int(1);
    const struct motion_real size = motion_real_min(motion_real_abs(a), one);
    struct motion_real x;

    if (motion_real_cmp(size, motion_real_from_q(182, 8)) < 0) {
        x = elementary_asin_small(size);
    } else {
        x = motion_real_mul(motion_real_sub(one, size),
                            motion_real_add(one, size));
        x = elementary_asin_small(motion_real_sqrt(x));
        x = motion_real_sub(one, x);
    }
    return a.m < 0 ? motion_real_neg(x) : x;
}
