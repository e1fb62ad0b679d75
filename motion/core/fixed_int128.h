/* motion/core/fixed_int128.h - fixed_halves.h for 64-bit machines, where the
 * compiler has 128 bits: a product is one instruction there, a sum two.
 *
 * Division by the compiler's own would be a function of its library; x86-64 has
 * an instruction. */
#ifndef MOTION_CORE_FIXED_INT128_H
#define MOTION_CORE_FIXED_INT128_H

__extension__ typedef unsigned __int128 fixed_int128;
__extension__ typedef __int128 fixed_signed_int128;

FIXED_INLINE fixed_int128 fixed_int128_of(struct motion_u128 a)
{
    return (fixed_int128)a.hi << 64 | a.lo;
}

FIXED_INLINE struct motion_u128 fixed_int128_words(fixed_int128 a)
{
    return (struct motion_u128){ (uint64_t)(a >> 64), (uint64_t)a };
}

FIXED_INLINE struct motion_u128 fixed_int128_mul_add(uint64_t a, uint64_t b,
                                                     uint64_t lo, uint64_t hi)
{
    return fixed_int128_words((fixed_int128)a * b + lo + hi);
}

FIXED_INLINE struct motion_u128 fixed_int128_mul(uint64_t a, uint64_t b)
{
    return fixed_int128_words((fixed_int128)a * b);
}

/* The upper 64 bits, rounded down. */
FIXED_INLINE int64_t fixed_int128_mulhi(int64_t a, int64_t b)
{
    return (int64_t)((fixed_signed_int128)a * b >> 64);
}

#ifdef __x86_64__
#define FIXED_DIVIDES
/* n.hi < d */
FIXED_INLINE uint64_t fixed_int128_div(struct motion_u128 n, uint64_t d,
                                       uint64_t *rest)
{
    uint64_t quotient;

    __asm__("divq %4"
            : "=a"(quotient), "=d"(*rest)
            : "0"(n.lo), "1"(n.hi), "r"(d)
            : "cc");
    return quotient;
}

#define FIXED_ROOT_STEPS 8

/* floor(sqrt(n)), n.hi >= 2^62: Newton's method from the tangent at 2^128,
 * 2^63 + n / 2^65, which is above the root by a quarter of it at most, so that
 * six steps leave less than 2^-64.  Rounded down they stay at or above the
 * root; where one would not lead down, x is it. */
FIXED_INLINE uint64_t fixed_int128_root(struct motion_u128 n)
{
    uint64_t x = (UINT64_C(1) << 63) + (n.hi >> 1);

    for (int i = 0; i < FIXED_ROOT_STEPS && n.hi < x; i++) {
        uint64_t rest;
        const uint64_t per = fixed_int128_div(n, x, &rest);
        if (per >= x)
            break;
        x -= (x - per + 1) >> 1;
    }
    return x;
}
#endif

FIXED_INLINE struct motion_u128 fixed_int128_add(struct motion_u128 a,
                                                 struct motion_u128 b)
{
    return fixed_int128_words(fixed_int128_of(a) + fixed_int128_of(b));
}

FIXED_INLINE struct motion_u128 fixed_int128_sub(struct motion_u128 a,
                                                 struct motion_u128 b)
{
    return fixed_int128_words(fixed_int128_of(a) - fixed_int128_of(b));
}

FIXED_INLINE bool fixed_int128_is_less(struct motion_u128 a,
                                       struct motion_u128 b)
{
    return fixed_int128_of(a) < fixed_int128_of(b);
}

FIXED_INLINE bool fixed_int128_is_less_i128(struct motion_u128 a,
                                            struct motion_u128 b)
{
    return (fixed_signed_int128)fixed_int128_of(a) <
           (fixed_signed_int128)fixed_int128_of(b);
}

#endif
