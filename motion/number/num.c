/* motion/number/num.c - see num.h. */
#include "motion/number/num.h"

/* |m|, by a mask: two instructions on ARM, and no branch. */
static uint32_t num_size(int32_t m)
{
    const int32_t minus = m >> 31;
    return (uint32_t)((m ^ minus) - minus);
}

uint64_t motion_num_make(int64_t m, int32_t e)
{
    const int64_t minus = m >> 63;
    const uint64_t size = (uint64_t)(m ^ minus) - (uint64_t)minus;
    uint32_t high = (uint32_t)(size >> 32), low = (uint32_t)size;
    if (high == 0) {
        if (low == 0)
            return num_pack(num_zero());
        high = low;
        low = 0;
        e -= 32;
    }
    const int32_t lead = __builtin_clz(high);
    high = high << lead | low >> 1 >> (31 - lead);
    /* the upper 30 of 64 bits, cut towards zero */
    const int32_t cut = (int32_t)(high >> 2), back = (int32_t)minus;
    return num_pack((struct num){ (cut ^ back) - back, e + 34 - lead });
}

/* m 2^-(to - from), to >= from; the clamp is one instruction on ARM, where the
 * compiler cannot see that half of it is idle. */
static int32_t num_down(int32_t m, int32_t to, int32_t from)
{
    int32_t by = (int32_t)((uint32_t)to - (uint32_t)from);
    by = by < 0 ? 0 : by;
    return m >> (by > 31 ? 31 : by);
}

/* |sum| < 2^31: one bit too many at most.  Written so that four registers
 * suffice. */
uint64_t motion_num_add(uint64_t a, uint64_t b)
{
    struct num x = num_unpack(a), y = num_unpack(b);
    if (x.e >= y.e) {
        x.m += num_down(y.m, x.e, y.e);
    } else {
        x.m = num_down(x.m, y.e, x.e) + y.m;
        x.e = y.e;
    }
    if (x.m == 0)
        return num_pack(num_zero());
    int32_t up = (int32_t)__builtin_clz(num_size(x.m)) - 1;
    x.m = (int32_t)((uint32_t)x.m << up) >> 1;
    x.e -= up - 1;
    return num_pack(x);
}

/* The product is in 2^60 .. 2^62, its upper word the one that is wanted. */
uint64_t motion_num_mul(uint64_t a, uint64_t b)
{
    struct num x = num_unpack(a), y = num_unpack(b);
    const int32_t m = x.m * 2, n = y.m * 2;
    int64_t product = (int64_t)m * n;
    x.e += y.e + 30;
    x.m = (int32_t)(product >> 32);
    if (x.m == 0)
        return num_pack(num_zero());
    if (num_size(x.m) < (uint32_t)NUM_ONE) {
        product *= 2;
        x.e--;
    }
    x.m = (int32_t)(product >> 32);
    return num_pack(x);
}

/* Of one sign the words themselves are ordered, exponent first; where both are
 * negative the larger exponent is below.  Zero's is below all others, but may
 * differ from another zero's. */
bool motion_num_lt(uint64_t a, uint64_t b)
{
    struct num x = num_unpack(a), y = num_unpack(b);
    if ((x.m ^ y.m) < 0 || y.m == 0)
        return x.m < y.m;
    if (x.m >= 0)
        return (int64_t)a < (int64_t)b;
    return (int64_t)num_pack((struct num){ x.m, y.e }) <
           (int64_t)num_pack((struct num){ y.m, x.e });
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
uint64_t motion_num_inv(uint64_t a)
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
uint64_t motion_num_rsqrt(uint64_t a)
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

uint64_t motion_num_sqrt(uint64_t a)
{
    struct num n = num_unpack(a);
    if (n.m <= 0)
        return num_pack(num_zero());
    return motion_num_mul(a, motion_num_rsqrt(a));
}

/* a = y 2^(30 + e), y in 1/2 .. 1: a tangent of the root of y, times that of
 * the power of two. */
struct num motion_num_cbrt_above(struct num a)
{
    static const int32_t root[3] = { 536870912, 676414963, 852229450 };
    int32_t e = a.e + 30 + 30000;
    int64_t line = 641582896 + (((int64_t)a.m * 445543677) >> 30); /* Q30 */
    return num_make(line * root[e % 3], e / 3 - 10000 - 59);
}
