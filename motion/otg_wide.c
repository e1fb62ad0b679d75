/* motion/otg_wide.c - see otg_wide.h. */
#include "motion/otg_wide.h"

#include "motion/fixed.h"

struct wide wide_mul_u64(uint64_t a, uint64_t b)
{
    return wide_mul_inline(a, b);
}

struct wide wide_mul_i64(int64_t a, int64_t n)
{
    return wide_mul_i64_inline(a, n);
}

struct wider wider_mul(struct wide a, int64_t n)
{
    return wider_mul_inline(a, n);
}

void wide_add_mul(struct wide *sum, int64_t a, int64_t n)
{
    *sum = wide_add(*sum, wide_mul_i64_inline(a, n));
}

/* Both as what they are modulo 2^64, 2^128; what is too much is taken off. */
void wider_add_mul(struct wider *sum, int64_t a, const struct wide *x)
{
    struct wide low = wide_mul_inline((uint64_t)a, x->lo);
    struct wide high = wide_mul_inline((uint64_t)a, x->hi);
    low.lo += sum->lo;
    low.hi += low.lo < sum->lo; /* a product has room for it */
    high = wide_add(high, (struct wide){ 0, low.hi });
    high = wide_add(high, (struct wide){ sum->hi, sum->mid });
    if (a < 0)
        high = wide_sub(high, *x);
    if (wide_is_negative(*x))
        high.hi -= (uint64_t)a;
    *sum = (struct wider){ high.hi, high.lo, low.lo };
}

struct wide wide_mul(struct wide a, int64_t n)
{
    struct wide p = wide_mul_u64(a.lo, (uint64_t)n);
    p.hi += a.hi * (uint64_t)n;
    return p;
}

struct wide wide_shl(struct wide a, unsigned bits)
{
    if (bits >= 64)
        return (struct wide){ bits < 128 ? a.lo << (bits - 64) : 0, 0 };
    if (bits == 0)
        return a;
    return (struct wide){ a.hi << bits | a.lo >> (64 - bits), a.lo << bits };
}

struct wide wide_shr(struct wide a, unsigned bits)
{
    int64_t hi = (int64_t)a.hi;
    if (bits >= 64)
        return (struct wide){ (uint64_t)(hi >> 63),
                              (uint64_t)(hi >> (bits < 127 ? bits - 64 : 63)) };
    if (bits == 0)
        return a;
    return (struct wide){ (uint64_t)(hi >> bits),
                          a.hi << (64 - bits) | a.lo >> bits };
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
