/* motion/core/fixed_halves.h - the few operations on two words of 64 bits that
 * all wider arithmetic is made of, from 32-bit halves: for every machine.
 *
 * fixed_thumb.h and fixed_int128.h have the same operations, the same bits, in
 * the instructions of one machine; fixed.h chooses.  Only fixed.h includes
 * these three. */
#ifndef MOTION_CORE_FIXED_HALVES_H
#define MOTION_CORE_FIXED_HALVES_H

/* a b + lo + hi, which fits 64 bits: (2^32 - 1)^2 + 2 (2^32 - 1) = 2^64 - 1 */
FIXED_INLINE uint64_t fixed_halves_sum(uint32_t a, uint32_t b, uint32_t lo,
                                       uint32_t hi)
{
    return (uint64_t)a * b + lo + hi;
}

/* a b + lo + hi, which fits 128 bits as it does above. */
FIXED_INLINE struct motion_u128 fixed_halves_mul_add(uint64_t a, uint64_t b,
                                                     uint64_t lo, uint64_t hi)
{
    uint32_t al = (uint32_t)a, ah = (uint32_t)(a >> 32);
    uint32_t bl = (uint32_t)b, bh = (uint32_t)(b >> 32);
    uint64_t low = fixed_halves_sum(al, bl, (uint32_t)lo, (uint32_t)hi);
    uint64_t mid =
        fixed_halves_sum(al, bh, (uint32_t)(lo >> 32), (uint32_t)(low >> 32));
    uint64_t more =
        fixed_halves_sum(ah, bl, (uint32_t)(hi >> 32), (uint32_t)mid);
    uint64_t high =
        fixed_halves_sum(ah, bh, (uint32_t)(mid >> 32), (uint32_t)(more >> 32));
    return (struct motion_u128){ high, more << 32 | (uint32_t)low };
}

/* a b. */
FIXED_INLINE struct motion_u128 fixed_halves_mul(uint64_t a, uint64_t b)
{
    return fixed_halves_mul_add(a, b, 0, 0);
}

/* a + b, a - b, modulo 2^128. */
FIXED_INLINE struct motion_u128 fixed_halves_add(struct motion_u128 a,
                                                 struct motion_u128 b)
{
    uint64_t lo = a.lo + b.lo;
    return (struct motion_u128){ a.hi + b.hi + (lo < a.lo), lo };
}
FIXED_INLINE struct motion_u128 fixed_halves_sub(struct motion_u128 a,
                                                 struct motion_u128 b)
{
    return (struct motion_u128){ a.hi - b.hi - (a.lo < b.lo), a.lo - b.lo };
}

/* a < b, without a sign; as two's complement. */
FIXED_INLINE bool fixed_halves_is_less(struct motion_u128 a,
                                       struct motion_u128 b)
{
    return a.hi < b.hi || (a.hi == b.hi && a.lo < b.lo);
}
FIXED_INLINE bool fixed_halves_is_less_i128(struct motion_u128 a,
                                            struct motion_u128 b)
{
    return (int64_t)a.hi < (int64_t)b.hi || (a.hi == b.hi && a.lo < b.lo);
}

#endif
