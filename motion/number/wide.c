/* motion/number/wide.c - see wide.h. */
#include "motion/number/wide.h"

#if !FIXED_IS_SHORT
struct motion_u128 wide_mul_u64(uint64_t a, uint64_t b)
{
    return wide_mul_inline(a, b);
}

struct motion_u128 wide_mul_i64(int64_t a, int64_t n)
{
    return wide_mul_i64_inline(a, n);
}
#endif

struct wider wider_mul(struct motion_u128 a, int64_t n)
{
    return wider_mul_inline(a, n);
}

void wide_add_mul(struct motion_u128 *sum, int64_t a, int64_t n)
{
    struct motion_u128 low =
        FIXED_BY(mul_add)((uint64_t)a, (uint64_t)n, sum->lo, 0);
    sum->lo = low.lo;
    sum->hi += low.hi - ((uint64_t)(a >> 63) & (uint64_t)n);
}

/* As if neither had a sign; what is too much is taken off. */
void wider_add_mul(struct wider *sum, int64_t a, const struct motion_u128 *x)
{
    uint64_t k = (uint64_t)a, hi = sum->hi;
    struct motion_u128 low = FIXED_BY(mul_add)(k, x->lo, sum->lo, 0);
    struct motion_u128 high = FIXED_BY(mul_add)(k, x->hi, sum->mid, low.hi);
    sum->lo = low.lo;
    high.hi += hi - ((uint64_t)((int64_t)x->hi >> 63) & k);
    if (a < 0)
        high = wide_sub(high, *x);
    sum->mid = high.lo;
    sum->hi = high.hi;
}

struct motion_u128 wide_shr(struct motion_u128 a, unsigned bits)
{
    uint64_t minus = (uint64_t)((int64_t)a.hi >> 63);
    a = motion_fixed_shr_u128(
        (struct motion_u128){ a.hi ^ minus, a.lo ^ minus }, bits);
    return (struct motion_u128){ a.hi ^ minus, a.lo ^ minus };
}

struct wider wider_shl(struct wider a, unsigned bits)
{
    for (; bits >= 64; bits -= 64)
        a = (struct wider){ a.mid, a.lo, 0 };
    if (bits == 0)
        return a;
    return (struct wider){ a.hi << bits | a.mid >> (64 - bits),
                           a.mid << bits | a.lo >> (64 - bits), a.lo << bits };
}

struct wider wider_shr(struct wider a, unsigned bits)
{
    int64_t hi = (int64_t)a.hi;
    for (; bits >= 64; bits -= 64) {
        a = (struct wider){ (uint64_t)(hi >> 63), a.hi, a.mid };
        hi = (int64_t)a.hi;
    }
    if (bits == 0)
        return a;
    return (struct wider){ (uint64_t)(hi >> bits),
                           a.hi << (64 - bits) | a.mid >> bits,
                           a.mid << (64 - bits) | a.lo >> bits };
}

unsigned wider_clz(struct wider a)
{
    if (a.hi)
        return motion_fixed_clz_u64(a.hi);
    if (a.mid)
        return 64 + motion_fixed_clz_u64(a.mid);
    return 128 + motion_fixed_clz_u64(a.lo);
}
