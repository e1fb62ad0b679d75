/* motion/core/fixed_thumb.h - fixed_halves.h for Cortex-M4, M7, M33: Thumb-2
 * with the multiplications of the DSP extension.
 *
 * The compiler keeps the carry of a longer sum in a register, compares to find
 * it, and has no umaal; the four instructions below take 16 to 30 then.  Only
 * for compilers that take a result from the flags: gcc does, clang 14 not.
 * %Q is the lower half of a word's two registers, %R the upper one. */
#ifndef MOTION_CORE_FIXED_THUMB_H
#define MOTION_CORE_FIXED_THUMB_H

/* umaal low, high, x, y makes high:low = x y + low + high. */
FIXED_INLINE struct motion_u128 fixed_thumb_mul_add(uint64_t a, uint64_t b,
                                                    uint64_t lo, uint64_t hi)
{
    __asm__("umaal %Q0, %Q1, %Q2, %Q3\n\t"
            "umaal %R0, %Q1, %Q2, %R3\n\t"
            "umaal %R0, %R1, %R2, %Q3\n\t"
            "umaal %Q1, %R1, %R2, %R3"
            : "+&r"(lo), "+&r"(hi)
            : "r"(a), "r"(b));
    return (struct motion_u128){ hi, lo };
}

FIXED_INLINE struct motion_u128 fixed_thumb_mul(uint64_t a, uint64_t b)
{
    uint64_t lo, hi;
    __asm__("umull %Q0, %Q1, %Q2, %Q3\n\t"
            "umull %R0, %R1, %Q2, %R3\n\t"
            "umaal %R0, %Q1, %R2, %Q3\n\t"
            "umaal %Q1, %R1, %R2, %R3"
            : "=&r"(lo), "=&r"(hi)
            : "r"(a), "r"(b));
    return (struct motion_u128){ hi, lo };
}

FIXED_INLINE struct motion_u128 fixed_thumb_add(struct motion_u128 a,
                                                struct motion_u128 b)
{
    __asm__("adds %Q0, %Q0, %Q2\n\t"
            "adcs %R0, %R0, %R2\n\t"
            "adcs %Q1, %Q1, %Q3\n\t"
            "adc %R1, %R1, %R3"
            : "+&r"(a.lo), "+&r"(a.hi)
            : "r"(b.lo), "r"(b.hi)
            : "cc");
    return a;
}

FIXED_INLINE struct motion_u128 fixed_thumb_sub(struct motion_u128 a,
                                                struct motion_u128 b)
{
    __asm__("subs %Q0, %Q0, %Q2\n\t"
            "sbcs %R0, %R0, %R2\n\t"
            "sbcs %Q1, %Q1, %Q3\n\t"
            "sbc %R1, %R1, %R3"
            : "+&r"(a.lo), "+&r"(a.hi)
            : "r"(b.lo), "r"(b.hi)
            : "cc");
    return a;
}

/* The flags of a - b. */
#define FIXED_THUMB_COMPARE                                                    \
    "cmp %Q2, %Q4\n\t"                                                         \
    "sbcs %1, %R2, %R4\n\t"                                                    \
    "sbcs %1, %Q3, %Q5\n\t"                                                    \
    "sbcs %1, %R3, %R5"

FIXED_INLINE bool fixed_thumb_is_less(struct motion_u128 a,
                                      struct motion_u128 b)
{
    uint32_t rest;
    bool is_less;
    __asm__(FIXED_THUMB_COMPARE
            : "=@cccc"(is_less), "=&r"(rest)
            : "r"(a.lo), "r"(a.hi), "r"(b.lo), "r"(b.hi));
    return is_less;
}

FIXED_INLINE bool fixed_thumb_is_less_i128(struct motion_u128 a,
                                           struct motion_u128 b)
{
    uint32_t rest;
    bool is_less;
    __asm__(FIXED_THUMB_COMPARE
            : "=@cclt"(is_less), "=&r"(rest)
            : "r"(a.lo), "r"(a.hi), "r"(b.lo), "r"(b.hi));
    return is_less;
}

#endif
