/* motion/number/real.c - see real.h. */
#include "motion/number/real.h"

#include "motion/core/err.h"

#define REAL_TOP ((int64_t)1 << 62)

/* The upper 62 bits, to nearest; rounding up may make 2^62. */
struct motion_real motion_real_from_u128(struct motion_u128 wide, int32_t e)
{
    unsigned up;

    if (wide.hi == 0) {
        wide = (struct motion_u128){ wide.lo, 0 };
        e -= 64;
    }
    if (wide.hi == 0)
        return motion_real_zero();
    up = motion_fixed_clz_u64(wide.hi);
    wide = motion_fixed_shl_u128(wide, up);
    return motion_real_make((int64_t)((wide.hi >> 2) + (wide.hi >> 1 & 1)),
                            e + 66 - (int32_t)up);
}

struct motion_real motion_real_from_u64(uint64_t word, int32_t e)
{
    return motion_real_from_u128((struct motion_u128){ 0, word }, e);
}

/* a * 2^62 / b: the upper word, a/4, is below b, so the quotient fits; it is
 * in 2^61 .. 2^63. */
struct motion_real motion_real_div(struct motion_real a, struct motion_real b)
{
    const uint64_t n = (uint64_t)(a.m < 0 ? -a.m : a.m);
    const uint64_t d = (uint64_t)(b.m < 0 ? -b.m : b.m);
    uint64_t quotient = 0;

    if (n == 0)
        return motion_real_zero();
    (void)motion_fixed_div_u128((struct motion_u128){ n >> 2, n << 62 }, d,
                                &quotient, 0);
    return motion_real_make((a.m < 0) != (b.m < 0) ? -(int64_t)quotient
                                                   : (int64_t)quotient,
                            a.e - b.e - 62);
}

/* The mantissa, widened to 126 bits with an even exponent, has a root of 63. */
struct motion_real motion_real_sqrt(struct motion_real a)
{
    struct motion_u128 wide = { (uint64_t)a.m, 0 };
    int32_t e = a.e - 64;

    if (a.m <= 0)
        return motion_real_zero();
    if (e & 1) {
        wide = motion_fixed_shl_u128(wide, 1);
        e--;
    }
    return motion_real_from_u64(motion_fixed_isqrt_u128(wide), e / 2);
}

/* floor of the cube root, bit by bit; 2642245^3 is the last cube in 64 bits. */
static uint64_t real_icbrt(uint64_t n)
{
    uint64_t root = 0;

    for (int bit = 21; bit >= 0; bit--) {
        const uint64_t next = root | (uint64_t)1 << bit;
        if (next <= 2642245 && next * next * next <= n)
            root = next;
    }
    return root;
}

/* A 20-bit guess; a Newton step x <- (2x + a/x^2) / 3 squares the error, so
 * 2^-38, 2^-76. */
struct motion_real motion_real_cbrt(struct motion_real a)
{
    const struct motion_real size = motion_real_abs(a);
    struct motion_real x;
    int down = 0;

    if (a.m == 0)
        return a;
    while ((a.e + down) % 3 != 0)
        down++;
    x = motion_real_make((int64_t)real_icbrt((uint64_t)size.m >> down),
                         (a.e + down) / 3);
    for (int i = 0; i < 3; i++)
        x = motion_real_div(
            motion_real_add(motion_real_twice(x),
                            motion_real_div(size, motion_real_mul(x, x))),
            motion_real_int(3));
    return a.m < 0 ? motion_real_neg(x) : x;
}

/* --- quick ----------------------------------------------------------------- */

static uint32_t real_mulhi32(uint32_t a, uint32_t b)
{
    return (uint32_t)(((uint64_t)a * b) >> 32);
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
struct motion_real motion_real_rsqrt(struct motion_real a)
{
    int odd = a.e & 1;
    int64_t x = a.m >> odd;
    int32_t k = (a.e + 60 + odd) / 2;
    int64_t y = (int64_t)real_rsqrt32((uint32_t)(x >> 30)) << 30;
    int64_t rest =
        ((int64_t)1 << 54) - motion_real_mulhi(x, motion_real_mulhi(y, y));
    y += motion_real_mulhi(y, rest * 256) * 2;
    return motion_real_make(y, -61 - k);
}

/* --- to integers ----------------------------------------------------------- */

/* floor of a * 2^bits, and what is above it as Q0.64, not zero unless it is
 * exact.  |a.m| < 2^62, so a left shift by one is all that fits. */
static int real_split(struct motion_real a, int32_t bits, int64_t *whole,
                      uint64_t *part)
{
    const int32_t up = a.m == 0 ? 0 : a.e + bits;

    if (up > 1)
        return MOTION_E_RANGE;
    *part = 0;
    if (up >= 0) {
        *whole = a.m * (1 + up);
        return MOTION_OK;
    }
    *whole = a.m >> (up < -62 ? 62 : -up);
    if (up > -64)
        *part = (uint64_t)a.m << (64 + up);
    else if (up > -128)
        *part = (uint64_t)((a.m >> (up < -126 ? 62 : -up - 64)) | 1);
    else
        *part = a.m < 0 ? UINT64_MAX : 1;
    return MOTION_OK;
}

int motion_real_floor(struct motion_real a, int32_t bits, int64_t *result)
{
    uint64_t part;

    return real_split(a, bits, result, &part);
}

/* Whole parts that leave a fraction are below 2^62: adding 1 is safe. */
int motion_real_ceil(struct motion_real a, int32_t bits, int64_t *result)
{
    uint64_t part;
    int rc = real_split(a, bits, result, &part);

    if (rc == MOTION_OK)
        *result += part != 0;
    return rc;
}

int motion_real_round(struct motion_real a, int32_t bits, int64_t *result)
{
    const uint64_t half = UINT64_C(1) << 63;
    uint64_t part;
    int rc = real_split(a, bits, result, &part);

    if (rc == MOTION_OK)
        *result += a.m < 0 ? part > half : part >= half;
    return rc;
}

int64_t motion_real_floor_clamped(struct motion_real a, int32_t bits)
{
    const int64_t shift = (int64_t)a.e + bits;

    if (shift > 0)
        return a.m < 0 ? -REAL_TOP : a.m ? REAL_TOP : 0;
    return a.m >> (shift < -62 ? 62 : -shift);
}
