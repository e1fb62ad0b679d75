/* motion/otg_wide.h - 128 and 192 bits, for the exact half of the planner.
 *
 * Two's complement, from 64-bit words; products from 32-bit halves, inline,
 * because a plan's cost is mostly these.  Plan-time, no division. */
#ifndef MOTION_OTG_WIDE_H
#define MOTION_OTG_WIDE_H

#include <stdbool.h>
#include <stdint.h>

/* Also when optimising for size: where a plan spends its time. */
#define WIDE_INLINE static inline __attribute__((always_inline))

/* 128 bits. */
struct wide {
    uint64_t hi, lo;
};

/* 192 bits. */
struct wider {
    uint64_t hi, mid, lo;
};

WIDE_INLINE struct wide wide_from(int64_t a)
{
    return (struct wide){ (uint64_t)(a >> 63), (uint64_t)a };
}

WIDE_INLINE struct wide wide_add(struct wide a, struct wide b)
{
    uint64_t lo = a.lo + b.lo;
    return (struct wide){ a.hi + b.hi + (lo < a.lo), lo };
}

static inline struct wide wide_neg(struct wide a)
{
    uint64_t lo = 0 - a.lo;
    return (struct wide){ ~a.hi + (lo == 0), lo };
}

WIDE_INLINE struct wide wide_sub(struct wide a, struct wide b)
{
    return (struct wide){ a.hi - b.hi - (a.lo < b.lo), a.lo - b.lo };
}

WIDE_INLINE bool wide_is_negative(struct wide a)
{
    return (int64_t)a.hi < 0;
}

static inline struct wide wide_abs(struct wide a)
{
    return wide_is_negative(a) ? wide_neg(a) : a;
}

static inline int wide_cmp(struct wide a, struct wide b)
{
    if (a.hi != b.hi)
        return (int64_t)a.hi < (int64_t)b.hi ? -1 : 1;
    return (a.lo > b.lo) - (a.lo < b.lo);
}

/* a b, both without a sign: 2^64 - 2^33 + 1 + 2^32 - 1 fits each middle sum. */
WIDE_INLINE struct wide wide_mul_inline(uint64_t a, uint64_t b)
{
    uint32_t al = (uint32_t)a, ah = (uint32_t)(a >> 32);
    uint32_t bl = (uint32_t)b, bh = (uint32_t)(b >> 32);
    uint64_t low = (uint64_t)al * bl;
    uint64_t mid = (uint64_t)ah * bl + (low >> 32);
    uint64_t more = (uint64_t)al * bh + (uint32_t)mid;
    return (struct wide){ (uint64_t)ah * bh + (mid >> 32) + (more >> 32),
                          more << 32 | (uint32_t)low };
}

/* a n, n >= 0. */
WIDE_INLINE struct wide wide_mul_i64_inline(int64_t a, int64_t n)
{
    struct wide p = wide_mul_inline((uint64_t)a, (uint64_t)n);
    p.hi -= (uint64_t)(a >> 63) & (uint64_t)n;
    return p;
}

/* The same, called. */
struct wide wide_mul_u64(uint64_t a, uint64_t b);
struct wide wide_mul_i64(int64_t a, int64_t n);

WIDE_INLINE struct wider wider_from(struct wide a)
{
    return (struct wider){ (uint64_t)((int64_t)a.hi >> 63), a.hi, a.lo };
}

WIDE_INLINE struct wider wider_add(struct wider a, struct wider b)
{
    uint64_t lo = a.lo + b.lo, mid = a.mid + b.mid;
    uint64_t carry = mid < a.mid;
    mid += lo < a.lo;
    carry += mid < (uint64_t)(lo < a.lo);
    return (struct wider){ a.hi + b.hi + carry, mid, lo };
}

static inline struct wider wider_neg(struct wider a)
{
    uint64_t lo = 0 - a.lo, mid = ~a.mid + (lo == 0);
    return (struct wider){ ~a.hi + (mid == 0 && lo == 0), mid, lo };
}

static inline struct wider wider_sub(struct wider a, struct wider b)
{
    return wider_add(a, wider_neg(b));
}

WIDE_INLINE bool wider_is_negative(struct wider a)
{
    return (int64_t)a.hi < 0;
}

static inline struct wider wider_abs(struct wider a)
{
    return wider_is_negative(a) ? wider_neg(a) : a;
}

static inline int wider_cmp(struct wider a, struct wider b)
{
    if (a.hi != b.hi)
        return (int64_t)a.hi < (int64_t)b.hi ? -1 : 1;
    if (a.mid != b.mid)
        return a.mid < b.mid ? -1 : 1;
    return (a.lo > b.lo) - (a.lo < b.lo);
}

/* a n, n >= 0; the product fits when |a| n < 2^191. */
WIDE_INLINE struct wider wider_mul_inline(struct wide a, int64_t n)
{
    struct wide low = wide_mul_inline(a.lo, (uint64_t)n);
    struct wide high = wide_mul_i64_inline((int64_t)a.hi, n);
    uint64_t mid = low.hi + high.lo;
    return (struct wider){ high.hi + (mid < low.hi), mid, low.lo };
}
struct wider wider_mul(struct wide a, int64_t n);

/* sum + a n, n >= 0, modulo 2^128; sum + a x modulo 2^192. */
void wide_add_mul(struct wide *sum, int64_t a, int64_t n);
void wider_add_mul(struct wider *sum, int64_t a, const struct wide *x);

/* a * n modulo 2^128, n >= 0; exact when the product fits. */
struct wide wide_mul(struct wide a, int64_t n);
/* a * 2^bits, 0..127, modulo 2^128; floor(a / 2^bits). */
struct wide wide_shl(struct wide a, unsigned bits);
struct wide wide_shr(struct wide a, unsigned bits);
/* a * 2^bits, 0..127, modulo 2^192; floor(a / 2^bits), 0..191. */
struct wider wider_shl(struct wider a, unsigned bits);
struct wider wider_shr(struct wider a, unsigned bits);
/* Leading zeros of an a >= 0; 192 for zero. */
unsigned wider_clz(struct wider a);

#endif
