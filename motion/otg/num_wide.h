/* motion/otg/num_wide.h - the operations of num.h for 64-bit machines.
 *
 * The same bits as the functions of num.c, which suit 32-bit ones: inline,
 * because registers are there for both words, and without branches but for
 * zero, because which of two operands is larger is a coin's side, and guessing
 * it wrong costs more than the sum.  Only num.h includes this. */
#ifndef MOTION_OTG_NUM_WIDE_H
#define MOTION_OTG_NUM_WIDE_H

#include <stdbool.h>
#include <stdint.h>

NUM_INLINE struct num num_wide_make(int64_t m, int32_t e)
{
    int64_t minus = m >> 63;
    uint64_t size = (uint64_t)(m ^ minus) - (uint64_t)minus;
    if (m == 0)
        return num_zero();
    int lead = __builtin_clzll(size);
    int64_t cut = (int64_t)(size << lead >> 34);
    return (struct num){ (int32_t)((cut ^ minus) - minus), e + 34 - lead };
}

NUM_INLINE struct num num_wide_add(struct num a, struct num b)
{
    int32_t d = a.e - b.e, below = d >> 31; /* all ones where a is smaller */
    int32_t size = (d ^ below) - below;
    size = size < 31 ? size : 31;
    int32_t m = (a.m >> (size & below)) + (b.m >> (size & ~below));
    if (m == 0)
        return num_zero();
    int32_t minus = m >> 31;
    int up = __builtin_clz((uint32_t)((m ^ minus) - minus)) - 1;
    return (struct num){ (int32_t)((uint32_t)m << up) >> 1,
                         a.e - (d & below) - up + 1 };
}

NUM_INLINE struct num num_wide_mul(struct num a, struct num b)
{
    int64_t product = (int64_t)a.m * b.m;
    if (product == 0)
        return num_zero();
    int32_t m = (int32_t)(product >> 30);
    int32_t up = (uint32_t)(m + (NUM_ONE - 1)) < 2 * (uint32_t)NUM_ONE - 1;
    return (struct num){ (int32_t)(product >> (30 - up)), a.e + b.e + 30 - up };
}

/* A whole number that is ordered as the num is. */
NUM_INLINE int64_t num_wide_order(struct num a)
{
    int64_t minus = a.m >> 31;
    int64_t e = (((int64_t)a.e + (1 << 20)) ^ minus) - minus;
    return a.m == 0 ? 0 : e * ((int64_t)1 << 30) + a.m;
}

NUM_INLINE bool num_wide_lt(struct num a, struct num b)
{
    return num_wide_order(a) < num_wide_order(b);
}

#endif
