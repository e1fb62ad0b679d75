/* motion/number/trig.c - see trig.h.
 *
 * The arc tangent is found from the sine: for a unit vector (c, s) at angle a
 * and a guess g, s cos g - c sin g = sin(a - g) = d, and a = g + d + d^3/6 + ..
 * The guess pi/4 t + 0.273 t (1 - t) is within 0.004 rad of atan(t) (Rajan et
 * al., IEEE Signal Processing Magazine 23(3), 2006, eq. 9); the first step
 * leaves 0.004^3 / 6 = 1e-8, the second the error of the sine. */
#include "motion/number/trig.h"

#include <stdbool.h>

#include "motion/core/err.h"
#include "motion/core/fixed.h"

#define TRIG_ONE_Q62      ((int64_t)1 << 62)
#define TRIG_TWO_PI_Q61   UINT64_C(14488038916154245685)
#define TRIG_RAD_TURN_Q66 UINT64_C(11743562013128004906) /* 2^66 / 2 pi */
#define TRIG_GUESS_Q16    17891                          /* 0.273 */

void motion_trig_sincos(int64_t angle_turn, int64_t *sin_q62, int64_t *cos_q62)
{
    const uint64_t quarter = (uint64_t)angle_turn >> 62;
    const uint64_t phase = (uint64_t)angle_turn & (TRIG_ONE_Q62 - 1);
    int64_t s, c;

    motion_fixed_sincos_q62(phase, &s, &c);
    *sin_q62 = quarter & 1 ? c : s;
    *cos_q62 = quarter & 1 ? s : c;
    if (quarter >= 2)
        *sin_q62 = -*sin_q62;
    if (quarter == 1 || quarter == 2)
        *cos_q62 = -*cos_q62;
}

uint64_t motion_trig_hypot(int64_t x, int64_t y)
{
    const uint64_t a = motion_fixed_abs(x), b = motion_fixed_abs(y);

    return motion_fixed_isqrt_u128(motion_fixed_add_u128(
        motion_fixed_mul_u64(a, a), motion_fixed_mul_u64(b, b)));
}

/* a b - c d of Q2.62 */
static int64_t trig_cross(int64_t a, int64_t b, int64_t c, int64_t d)
{
    int64_t left = 0, right = 0;

    (void)motion_fixed_mulshift(a, b, 62, &left);
    (void)motion_fixed_mulshift(c, d, 62, &right);
    return left - right;
}

/* Radian Q2.62 to turns: 2^62 rad is 2^64 / 2 pi units. */
static int64_t trig_small_turn(int64_t d)
{
    int64_t turn = 0;

    (void)motion_fixed_mulshift(d, (int64_t)(TRIG_RAD_TURN_Q66 >> 1), 63,
                                &turn);
    return turn;
}

/* 0 <= s <= c, the unit vector in Q2.62: an angle up to an eighth of a turn. */
static int64_t trig_octant(int64_t s, int64_t c)
{
    int64_t t_q32 = 0, turn;

    (void)motion_fixed_muldiv(s, INT64_C(1) << 32, c, &t_q32);
    const int64_t t = t_q32 >> 16, one = 1 << 16;
    /* 0.273 rad is 2847 / 2^16 turn */
    turn =
        (t * (one / 8) + ((TRIG_GUESS_Q16 * t >> 16) * (one - t) * 10430 >> 16))
        << 32;
    for (int i = 0; i < 2; i++) {
        int64_t gs, gc;
        motion_trig_sincos(turn, &gs, &gc);
        turn += trig_small_turn(trig_cross(s, gc, c, gs));
    }
    return turn;
}

int64_t motion_trig_atan2(int64_t y, int64_t x)
{
    uint64_t a = motion_fixed_abs(x), b = motion_fixed_abs(y);
    const bool steep = b > a;
    int64_t c = 0, s = 0, length, turn;

    if (a == 0 && b == 0)
        return 0;
    /* the larger one into [2^61, 2^62): the length stays below 2^63 */
    const unsigned zeros = motion_fixed_clz_u64(steep ? b : a);
    if (zeros < 2) {
        a >>= 2 - zeros;
        b >>= 2 - zeros;
    } else {
        a <<= zeros - 2;
        b <<= zeros - 2;
    }
    length = (int64_t)motion_trig_hypot((int64_t)a, (int64_t)b);
    (void)motion_fixed_muldiv((int64_t)(steep ? b : a), TRIG_ONE_Q62, length,
                              &c);
    (void)motion_fixed_muldiv((int64_t)(steep ? a : b), TRIG_ONE_Q62, length,
                              &s);
    turn = trig_octant(s, c);
    if (steep)
        turn = MOTION_TRIG_QUARTER_TURN - turn;
    if (x < 0)
        turn = motion_trig_diff(MOTION_TRIG_HALF_TURN, turn);
    return y < 0 ? motion_trig_diff(0, turn) : turn;
}

int64_t motion_trig_atan2_real(struct motion_real y, struct motion_real x)
{
    const struct motion_real large =
        motion_real_lt(motion_real_abs(x), motion_real_abs(y)) ? y : x;
    int64_t xs = 0, ys = 0;

    if (motion_real_is_zero(large))
        return 0;
    /* the larger one becomes its mantissa, 2^61 .. 2^62 */
    (void)motion_real_round(x, -large.e, &xs);
    (void)motion_real_round(y, -large.e, &ys);
    return motion_trig_atan2(ys, xs);
}

int64_t motion_trig_deg_q32(int64_t angle_turn)
{
    int64_t deg = 0;

    (void)motion_fixed_mulshift(angle_turn, 360, 32, &deg);
    return deg;
}

int64_t motion_trig_from_deg_q32(int64_t deg_q32)
{
    const int64_t circle_q32 = (int64_t)360 << 32;
    int64_t turn = 0;

    deg_q32 %= circle_q32;
    if (deg_q32 >= circle_q32 / 2)
        deg_q32 -= circle_q32;
    else if (deg_q32 < -circle_q32 / 2)
        deg_q32 += circle_q32;
    /* deg 2^32 / 360; + half a turn rounds to -half a turn */
    if (motion_fixed_muldiv(deg_q32, (int64_t)1 << 32, 360, &turn) < 0)
        return MOTION_TRIG_HALF_TURN;
    return turn;
}

struct motion_real motion_trig_rad(int64_t angle_turn)
{
    const struct motion_real size = motion_real_from_u128(
        motion_fixed_mul_u64(motion_fixed_abs(angle_turn), TRIG_TWO_PI_Q61),
        -64 - 61);

    return angle_turn < 0 ? motion_real_neg(size) : size;
}

/* rad / 2 pi as Q.64 with 128 bits; what is above the fraction is dropped. */
int64_t motion_trig_from_rad(struct motion_real rad)
{
    const struct motion_u128 product =
        motion_fixed_mul_u64(motion_fixed_abs(rad.m), TRIG_RAD_TURN_Q66);
    /* units of 2^(exponent - 66) turn; wanted 2^-64 */
    const int32_t down = 66 - rad.e - 64;
    uint64_t turn;

    if (down > 127 || motion_real_is_zero(rad))
        return 0;
    if (down < 1)
        turn =
            down < -63 ? 0 : motion_fixed_shl_u128(product, (unsigned)-down).lo;
    else
        turn =
            motion_fixed_shr_u128(
                motion_fixed_add_u128(
                    product, motion_fixed_shl_u128((struct motion_u128){ 0, 1 },
                                                   (unsigned)down - 1)),
                (unsigned)down)
                .lo;
    return (int64_t)(rad.m < 0 ? 0 - turn : turn);
}
