/* motion/otg_num.c - see otg_num.h. */
#include "motion/otg_num.h"

static uint32_t num_size(int32_t m)
{
    return m < 0 ? 0 - (uint32_t)m : (uint32_t)m;
}

uint64_t motion_otg_num_make(int64_t m, int32_t e)
{
    uint64_t size = m < 0 ? 0 - (uint64_t)m : (uint64_t)m;
    uint32_t hi = (uint32_t)(size >> 32);
    unsigned lead;
    if (m == 0)
        return num_pack(num_zero());
    lead = motion_real_clz(size);
    if (hi)
        size = size << lead >> 32;
    else
        size = (uint32_t)size << (lead - 32);
    /* the upper 30 of 64 bits, cut towards zero */
    int32_t cut = (int32_t)(size >> 2);
    return num_pack((struct num){ m < 0 ? -cut : cut, e + 34 - (int32_t)lead });
}

static int32_t num_down(int32_t m, int32_t by)
{
    return m >> (by > 31 ? 31 : by);
}

/* |sum| < 2^31: one bit too many at most.  Written so that four registers
 * suffice. */
uint64_t motion_otg_num_add(uint64_t a, uint64_t b)
{
    struct num x = num_unpack(a), y = num_unpack(b);
    if (x.e >= y.e) {
        x.m += num_down(y.m, x.e - y.e);
    } else {
        x.m = num_down(x.m, y.e - x.e) + y.m;
        x.e = y.e;
    }
    if (x.m == 0)
        return num_pack(num_zero());
    int32_t up = (int32_t)__builtin_clz(num_size(x.m)) - 1;
    x.m = (int32_t)((uint32_t)x.m << up) >> 1;
    x.e -= up - 1;
    return num_pack(x);
}

/* The product is in 2^58 .. 2^60. */
uint64_t motion_otg_num_mul(uint64_t a, uint64_t b)
{
    struct num x = num_unpack(a), y = num_unpack(b);
    int64_t product = (int64_t)x.m * y.m;
    x.e += y.e + 30;
    x.m = (int32_t)(product >> 30);
    if (x.m == 0)
        return num_pack(num_zero());
    /* |m| < 2^29 */
    if ((uint32_t)(x.m + (NUM_ONE - 1)) < 2 * (uint32_t)NUM_ONE - 1) {
        x.m = (int32_t)(product >> 29);
        x.e--;
    }
    return num_pack(x);
}

bool motion_otg_num_lt(uint64_t a, uint64_t b)
{
    struct num x = num_unpack(a), y = num_unpack(b);
    if ((x.m ^ y.m) < 0 || x.m == 0 || y.m == 0 || x.e == y.e)
        return x.m < y.m;
    return (x.e < y.e) == (x.m > 0);
}

static uint32_t num_mulhi(uint32_t a, uint32_t b)
{
    return (uint32_t)(((uint64_t)a * b) >> 32);
}

/* To 30 bits; what came out beside 2^30 .. 2^31 by its last bits ends there. */
static int32_t num_cut(uint32_t y)
{
    y >>= 1;
    if (y < (uint32_t)NUM_ONE)
        return NUM_ONE;
    return y < 2 * (uint32_t)NUM_ONE ? (int32_t)y : 2 * NUM_ONE - 1;
}

/* x 2^32 in 1/2 .. 1: y = 2^30 / x from below, to 2^-28.  The quotient by the
 * upper half is good to 2^-14; a Newton step y <- y (2 - x y) squares that. */
uint64_t motion_otg_num_inv(uint64_t a)
{
    struct num n = num_unpack(a);
    uint32_t x = num_size(n.m) << 2;
    if (n.m == 0)
        return num_pack((struct num){ NUM_ONE, 10000 });
    uint32_t y = (0x7fffffffu / ((x >> 16) + 1)) << 15;
    uint32_t rest = (uint32_t)(0 - (((uint64_t)x * y) >> 30)); /* 1 - xy, Q32 */
    int32_t m = num_cut(y + num_mulhi(y, rest));
    return num_pack((struct num){ n.m < 0 ? -m : m, -n.e - 59 });
}

/* a = x 4^k, x in 1 .. 4 as Q30; y = 1/sqrt(x) as Q31: from the middle of each
 * quarter (6 %) three Newton steps y <- y (3 - x y^2) / 2. */
uint64_t motion_otg_num_rsqrt(uint64_t a)
{
    static const uint16_t guess[12] = { 61788, 55889, 51411, 47861,
                                        44957, 42525, 40450, 38651,
                                        37073, 35673, 34421, 33292 };
    struct num n = num_unpack(a);
    int32_t odd = (n.e + 29) & 1;
    uint32_t x = (uint32_t)n.m << (1 + odd);
    uint32_t y = (uint32_t)guess[((x >> 28) - 4) % 12] << 15;
    for (int i = 0; i < 3; i++) {
        uint32_t xyy = num_mulhi(x, num_mulhi(y, y)); /* Q28, about 1 */
        y = (uint32_t)(((uint64_t)y * (((uint32_t)3 << 28) - xyy)) >> 29);
    }
    return num_pack((struct num){ num_cut(y), -(n.e + 29 - odd) / 2 - 30 });
}

uint64_t motion_otg_num_sqrt(uint64_t a)
{
    struct num n = num_unpack(a);
    if (n.m <= 0)
        return num_pack(num_zero());
    return motion_otg_num_mul(a, motion_otg_num_rsqrt(a));
}

/* a = y 2^(30 + e), y in 1/2 .. 1: a tangent of the root of y, times that of the
 * power of two. */
struct num motion_otg_num_cbrt_above(struct num a)
{
    static const int32_t root[3] = { 536870912, 676414963, 852229450 };
    int32_t e = a.e + 30 + 30000;
    int64_t line = 641582896 + (((int64_t)a.m * 445543677) >> 30); /* Q30 */
    return num_make(line * root[e % 3], e / 3 - 10000 - 59);
}
