/* motion/core/fixed.c - see fixed.h. */
#define MOTION_FIXED_SUMS
#include "motion/core/fixed.h"

#include <stddef.h>

#include "motion/core/err.h"

/* --- 128 bits, unsigned -------------------------------------------------- */

struct motion_u128 motion_fixed_mul_u64(uint64_t a, uint64_t b)
{
    return FIXED_BY(mul)(a, b);
}

uint64_t motion_fixed_mulhi_u64(uint64_t a, uint64_t b)
{
    return FIXED_BY(mul)(a, b).hi;
}

int motion_fixed_cmp_u128(struct motion_u128 a, struct motion_u128 b)
{
    return FIXED_BY(is_less)(b, a) - FIXED_BY(is_less)(a, b);
}

struct motion_u128 motion_fixed_shl_u128(struct motion_u128 a, unsigned bits)
{
    if (bits == 0)
        return a;
    if (bits >= 64)
        return (struct motion_u128){ a.lo << (bits - 64), 0 };
    return (struct motion_u128){ a.hi << bits | a.lo >> (64 - bits),
                                 a.lo << bits };
}

struct motion_u128 motion_fixed_shr_u128(struct motion_u128 a, unsigned bits)
{
    if (bits == 0)
        return a;
    if (bits >= 64)
        return (struct motion_u128){ 0, a.hi >> (bits - 64) };
    return (struct motion_u128){ a.hi >> bits,
                                 a.lo >> bits | a.hi << (64 - bits) };
}

/* Of a d whose upper bit is set: floor((2^96 - 1) / d) - 2^32.  From that of
 * its upper word; at most three too many.  [Moeller & Granlund, Improved
 * division by invariant integers, 2011, algorithm 6] */
static uint32_t fixed_reciprocal(uint64_t d)
{
    const uint32_t high = (uint32_t)(d >> 32), low = (uint32_t)d;
    /* less 2^32; the bit is set, and an analyser sees that it divides */
    uint32_t v = (uint32_t)(UINT64_MAX / (high | UINT32_C(1) << 31));
    uint32_t p = high * v + low;

    if (p < low) {
        v--;
        if (p >= high) {
            v--;
            p -= high;
        }
        p -= high;
    }
    uint64_t t = (uint64_t)v * low;
    p += (uint32_t)(t >> 32);
    if (p < (uint32_t)(t >> 32)) {
        v--;
        v -= ((uint64_t)p << 32 | (uint32_t)t) >= d;
    }
    return v;
}

/* One 32-bit digit of (*rest 2^32 + next) / d, *rest < d.  The same source,
 * algorithm 4. */
static uint32_t fixed_digit(const struct motion_divisor *by, uint64_t *rest,
                            uint32_t next)
{
    const uint32_t low = (uint32_t)by->d;
    uint64_t q = (*rest >> 32) * by->per + *rest;
    uint32_t digit = (uint32_t)(q >> 32);
    uint32_t high = (uint32_t)*rest - digit * (uint32_t)(by->d >> 32);
    uint64_t r = ((uint64_t)high << 32 | next) - (uint64_t)digit * low - by->d;

    digit++;
    if ((uint32_t)(r >> 32) >= (uint32_t)q) {
        digit--;
        r += by->d;
    }
    if (r >= by->d) {
        digit++;
        r -= by->d;
    }
    *rest = r;
    return digit;
}

void motion_divisor_init(struct motion_divisor *by, uint64_t d)
{
    by->up = motion_fixed_clz_u64(d) & 63;
    by->d = d << by->up;
    by->per = fixed_reciprocal(by->d);
}

uint64_t motion_divisor_apply(const struct motion_divisor *by,
                              struct motion_u128 n, uint64_t *rest)
{
    uint64_t r = n.hi;
    uint64_t high = fixed_digit(by, &r, (uint32_t)(n.lo >> 32));
    uint32_t low = fixed_digit(by, &r, (uint32_t)n.lo);

    if (rest != NULL)
        *rest = r;
    return high << 32 | low;
}

int motion_fixed_div_u128(struct motion_u128 n, uint64_t d, uint64_t *quotient,
                          uint64_t *rest)
{
    if (d == 0 || n.hi >= d)
        return MOTION_E_RANGE;
#ifdef FIXED_DIVIDES
    uint64_t left;
    *quotient = FIXED_BY(div)(n, d, &left);
    if (rest != NULL)
        *rest = left;
#else
    struct motion_divisor by;
    motion_divisor_init(&by, d);
    *quotient =
        motion_divisor_apply(&by, motion_fixed_shl_u128(n, by.up), rest);
    if (rest != NULL)
        *rest >>= by.up;
#endif
    return MOTION_OK;
}

/* --- signed, with a range ------------------------------------------------ */

/* magnitude and sign to int64 */
static int fixed_signed(uint64_t magnitude, bool negative, int64_t *result)
{
    if (magnitude > (uint64_t)INT64_MAX + (negative ? 1 : 0))
        return MOTION_E_RANGE;
    *result = (int64_t)(negative ? 0 - magnitude : magnitude);
    return MOTION_OK;
}

int motion_fixed_muldiv(int64_t a, int64_t b, int64_t c, int64_t *result)
{
    struct motion_u128 product =
        motion_fixed_mul_u64(motion_fixed_abs(a), motion_fixed_abs(b));
    uint64_t d = motion_fixed_abs(c), quotient, rest;

    if (motion_fixed_div_u128(product, d, &quotient, &rest) < 0)
        return MOTION_E_RANGE;
    if (rest >= d - rest && ++quotient == 0)
        return MOTION_E_RANGE;
    return fixed_signed(quotient, (a < 0) != ((b < 0) != (c < 0)), result);
}

int64_t motion_fixed_muldiv_sat(int64_t a, int64_t b, int64_t c)
{
    int64_t result;
    if (motion_fixed_muldiv(a, b, c, &result) < 0)
        return (a < 0) != ((b < 0) != (c < 0)) ? INT64_MIN : INT64_MAX;
    return result;
}

int motion_fixed_mulshift(int64_t a, int64_t b, unsigned bits, int64_t *result)
{
    struct motion_u128 product =
        motion_fixed_mul_u64(motion_fixed_abs(a), motion_fixed_abs(b));

    if (bits > 127)
        return MOTION_E_ARG;
    product = motion_fixed_round_i128(product, bits); /* <= 2^126 */
    if (product.hi != 0)
        return MOTION_E_RANGE;
    return fixed_signed(product.lo, (a < 0) != (b < 0), result);
}

extern inline int motion_fixed_add(int64_t a, int64_t b, int64_t *result);
extern inline int motion_fixed_sub(int64_t a, int64_t b, int64_t *result);

/* --- 128 bits, two's complement ------------------------------------------ */

struct motion_u128 motion_fixed_round_i128(struct motion_u128 a, unsigned bits)
{
    struct motion_u128 m = motion_fixed_abs_i128(a);

    if (bits == 0)
        return a;
    if (bits > 127)
        return (struct motion_u128){ 0, 0 };
    m = motion_fixed_shr_u128(m, bits - 1);
    m = motion_fixed_add_u128(m, (struct motion_u128){ 0, 1 });
    m = motion_fixed_shr_u128(m, 1);
    return motion_fixed_sign_i128(m, (uint64_t)((int64_t)a.hi >> 63));
}

struct motion_u128 motion_fixed_mul_i128(struct motion_u128 a, int32_t b)
{
    struct motion_u128 m = motion_fixed_abs_i128(a);
    uint64_t k = motion_fixed_abs(b);
    struct motion_u128 product = motion_fixed_mul_u64(m.lo, k);

    product.hi += m.hi * k;
    return motion_fixed_is_neg_i128(a) != (b < 0)
               ? motion_fixed_neg_i128(product)
               : product;
}

int motion_fixed_to_i64(struct motion_u128 a, int64_t *result)
{
    if (a.hi != (a.lo >> 63 ? UINT64_MAX : 0))
        return MOTION_E_RANGE;
    *result = (int64_t)a.lo;
    return MOTION_OK;
}

/* --- roots --------------------------------------------------------------- */

uint32_t motion_fixed_isqrt_u64(uint64_t n)
{
    return (uint32_t)motion_fixed_isqrt_u128((struct motion_u128){ 0, n });
}

#ifdef FIXED_DIVIDES
uint64_t motion_fixed_isqrt_u128(struct motion_u128 n)
{
    const unsigned up = (n.hi != 0 ? motion_fixed_clz_u64(n.hi)
                                   : 64 + motion_fixed_clz_u64(n.lo)) /
                        2;

    /* The root of n 4^up is that of n times 2^up, and a bit below. */
    return up == 64 ? 0
                    : FIXED_BY(root)(motion_fixed_shl_u128(n, 2 * up)) >> up;
}
#else
/* Digits of a root that a word is enough for: before digit i the root is below
 * 2^i and the rest at most twice that, so that with two more bits it is below
 * 2^(i+3). */
#define FIXED_ROOT_DIGITS 61

/* Digit by digit in base 2.  root < 2^64; at each step the rest is below
 * 2 root + 1 < 2^65, times four plus two bits below 2^67: 128 bits do. */
uint64_t motion_fixed_isqrt_u128(struct motion_u128 n)
{
    struct motion_u128 rest = { 0, 0 };
    uint64_t root = 0, bits = n.hi;

    for (int i = 0; i < FIXED_ROOT_DIGITS; i++, bits <<= 2) {
        const uint64_t trial = root << 2 | 1;
        if (i == 32)
            bits = n.lo;
        rest.lo = rest.lo << 2 | bits >> 62;
        root <<= 1;
        if (rest.lo >= trial) {
            rest.lo -= trial;
            root |= 1;
        }
    }
    for (int i = FIXED_ROOT_DIGITS; i < 64; i++, bits <<= 2) {
        rest = motion_fixed_shl_u128(rest, 2);
        rest.lo |= bits >> 62;

        struct motion_u128 trial =
            motion_fixed_shl_u128((struct motion_u128){ 0, root }, 2);
        trial.lo |= 1; /* (2 root + 1)^2 - (2 root)^2 = 4 root + 1 */
        root <<= 1;
        if (motion_fixed_cmp_u128(rest, trial) >= 0) {
            rest = motion_fixed_sub_u128(rest, trial);
            root |= 1;
        }
    }
    return root;
}
#endif

/* --- sine ---------------------------------------------------------------- */

#define FIXED_PI_4_Q64 UINT64_C(0xC90FDAA22168C234)
#define FIXED_TERMS    10

/* 1 - x2/(k+1)(k+2) (1 - x2/(k+3)(k+4) (1 - ...)), k = first, in Q0.63.  With
 * x2 <= (pi/4)^2 ten terms leave less than (pi/4)^21/21! = 2^-72.  Each step
 * rounds down by under 2 units of 2^-63 and the next shrinks that by x2/2 or
 * more, so the sum is within 3 units. */
static uint64_t fixed_series_q63(uint64_t x2_q64, const uint64_t *inverse_q64)
{
    const uint64_t one = UINT64_C(1) << 63;
    uint64_t sum = one;

    for (int i = FIXED_TERMS - 1; i >= 0; i--) {
        uint64_t term = motion_fixed_mulhi_u64(x2_q64, sum);
        sum = one - motion_fixed_mulhi_u64(term, inverse_q64[i]);
    }
    return sum;
}

#define FIXED_INVERSE(k) (UINT64_MAX / ((uint64_t)(k) * ((k) + 1)))

void motion_fixed_sincos_q62(uint64_t phase_q62, int64_t *sin_q62,
                             int64_t *cos_q62)
{
    static const uint64_t sin_inverse[FIXED_TERMS] = {
        FIXED_INVERSE(2),  FIXED_INVERSE(4),  FIXED_INVERSE(6),
        FIXED_INVERSE(8),  FIXED_INVERSE(10), FIXED_INVERSE(12),
        FIXED_INVERSE(14), FIXED_INVERSE(16), FIXED_INVERSE(18),
        FIXED_INVERSE(20),
    };
    static const uint64_t cos_inverse[FIXED_TERMS] = {
        FIXED_INVERSE(1),  FIXED_INVERSE(3),  FIXED_INVERSE(5),
        FIXED_INVERSE(7),  FIXED_INVERSE(9),  FIXED_INVERSE(11),
        FIXED_INVERSE(13), FIXED_INVERSE(15), FIXED_INVERSE(17),
        FIXED_INVERSE(19),
    };
    const uint64_t one = UINT64_C(1) << 62;
    uint64_t phase = phase_q62 < one ? phase_q62 : one;
    bool upper = phase > one / 2; /* fold at an eighth of a turn */

    if (upper)
        phase = one - phase;
    /* phase <= 2^61: x = phase / 2^61 * pi/4 */
    uint64_t x_q64 = motion_fixed_shr_u128(
                         motion_fixed_mul_u64(phase << 2, FIXED_PI_4_Q64), 63)
                         .lo;
    uint64_t x2_q64 = motion_fixed_mulhi_u64(x_q64, x_q64);
    /* x Q64 * series Q63 / 2^64 is Q63 */
    uint64_t s =
        motion_fixed_mulhi_u64(x_q64, fixed_series_q63(x2_q64, sin_inverse));
    uint64_t c = fixed_series_q63(x2_q64, cos_inverse);
    int64_t s_q62 = (int64_t)((s + 1) >> 1);
    int64_t c_q62 = (int64_t)((c + 1) >> 1);

    *sin_q62 = upper ? c_q62 : s_q62;
    *cos_q62 = upper ? s_q62 : c_q62;
}
