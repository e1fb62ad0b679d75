/* motion/otg_math.c - see otg_math.h. */
#include "motion/otg_math.h"

static uint32_t real_mulhi32(uint32_t a, uint32_t b)
{
    return (uint32_t)(((uint64_t)a * b) >> 32);
}

/* d = x 2^32, x in 1/2 .. 1: y = 2^30 / x from below, to 2^-28.  The quotient
 * by the upper half is good to 2^-14; one Newton step y <- y (2 - x y)
 * squares that. */
static uint32_t real_inv32(uint32_t d)
{
    uint32_t y = (0x7fffffffu / ((d >> 16) + 1)) << 15;
    uint32_t rest = (uint32_t)(0 - (((uint64_t)d * y) >> 30)); /* 1 - xy, Q32 */
    return y + real_mulhi32(y, rest);
}

/* a = x 2^62 2^e: 1/a = y 2^-61 2^(-e - 62) with y = 2^61 / x. */
struct real real_inv(struct real a)
{
    int64_t x = a.m < 0 ? -a.m : a.m;
    if (x == 0)
        return (struct real){ (int64_t)1 << 61, 10000 };
    int64_t y = (int64_t)real_inv32((uint32_t)(x >> 30)) << 31;
    int64_t rest = ((int64_t)1 << 59) - real_mulhi(x, y); /* 1 - x y, Q59 */
    y += real_mulhi(y, rest * 16) * 2;
    return real_make(a.m < 0 ? -y : y, -a.e - 123);
}

/* 1/sqrt(x), x in 1 .. 4 as Q30, result Q31, to 2^-26: from the middle of each
 * quarter (6 %), three Newton steps y <- y (3 - x y^2) / 2. */
static uint32_t real_rsqrt32(uint32_t x)
{
    static const uint16_t guess[12] = { 61788, 55889, 51411, 47861,
                                        44957, 42525, 40450, 38651,
                                        37073, 35673, 34421, 33292 };
    uint32_t y = (uint32_t)guess[(x >> 28) - 4] << 15;
    for (int i = 0; i < 3; i++) {
        uint32_t xyy = real_mulhi32(x, real_mulhi32(y, y)); /* Q28, about 1 */
        y = (uint32_t)(((uint64_t)y * (((uint32_t)3 << 28) - xyy)) >> 29);
    }
    return y;
}

/* a = x 4^k with x in 1 .. 4 as Q60: 1/sqrt(a) = y 2^-k, y = 1/sqrt(x) as Q61
 * after one more step in 64 bits. */
struct real real_rsqrt(struct real a)
{
    int odd = a.e & 1;
    int64_t x = a.m >> odd;
    int32_t k = (a.e + 60 + odd) / 2;
    int64_t y = (int64_t)real_rsqrt32((uint32_t)(x >> 30)) << 30;
    int64_t rest = ((int64_t)1 << 54) - real_mulhi(x, real_mulhi(y, y));
    y += real_mulhi(y, rest * 256) * 2;
    return real_make(y, -61 - k);
}

struct real real_sqrt(struct real a)
{
    return a.m <= 0 ? real_zero() : real_mul(a, real_rsqrt(a));
}

/* a < 2^(62 + e): the exponent rounded up to a third in three steps. */
struct real real_cbrt_above(struct real a)
{
    static const int64_t root[3] = { 1073741824, 1352829927, 1704458901 };
    int32_t e = a.e + 62 + 30000;
    return real_make(root[e % 3], e / 3 - 10000 - 30);
}

int64_t real_floor(struct real a, int bits)
{
    int64_t shift = (int64_t)a.e + bits;
    if (shift > 0)
        return a.m < 0 ? -((int64_t)1 << 62) : a.m ? (int64_t)1 << 62 : 0;
    return a.m >> (shift < -63 ? 63 : -shift);
}

struct real wide_real(struct wide a, int32_t e)
{
    bool negative = wide_is_negative(a);
    if (negative)
        a = wide_neg(a);
    if (a.hi == 0 && a.lo == 0)
        return real_zero();
    unsigned lead = a.hi ? real_clz(a.hi) : 64 + real_clz(a.lo);
    int64_t m = (int64_t)(wide_shl(a, lead).hi >> 2);
    return (struct real){ negative ? -m : m, e + 66 - (int32_t)lead };
}

struct wide wide_floor(struct real a)
{
    struct wide m = wide_from(a.m);
    if (a.e >= 0)
        return wide_shl(m, (unsigned)a.e);
    return wide_shr(m, a.e < -127 ? 127 : (unsigned)-a.e);
}
