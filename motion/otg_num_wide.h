/* motion/otg_num_wide.h - the operations of otg_num.h for 64-bit machines.
 *
 * The same bits as the functions of otg_num.c, which suit 32-bit ones: inline,
 * because registers are there for both words, and without branches, because
 * which of two operands is larger is a coin's side, and guessing it wrong costs
 * more than the sum.  Only otg_num.h includes this. */
#ifndef MOTION_OTG_NUM_WIDE_H
#define MOTION_OTG_NUM_WIDE_H

#include <stdbool.h>
#include <stdint.h>

/* -1 where a < 0, else 0. */
NUM_INLINE int64_t num_wide_sign(int64_t a)
{
    return a >> 63;
}

/* Zero has its own exponent. */
NUM_INLINE uint64_t num_wide_pack(int32_t m, int32_t e)
{
    int32_t none = -(m == 0);
    return num_pack((struct num){ m, (e & ~none) | (NUM_ZERO_E & none) });
}

NUM_INLINE uint64_t num_wide_make(int64_t m, int32_t e)
{
    int64_t minus = num_wide_sign(m);
    uint64_t size = (uint64_t)(m ^ minus) - (uint64_t)minus;
    int lead = __builtin_clzll(size | 1);
    int64_t cut = (int64_t)(size << lead >> 34); /* zero stays zero */
    return num_wide_pack((int32_t)((cut ^ minus) - minus), e + 34 - lead);
}

NUM_INLINE uint64_t num_wide_add(uint64_t a, uint64_t b)
{
    int64_t d = (int64_t)num_unpack(a).e - num_unpack(b).e;
    int64_t minus = num_wide_sign(d);
    uint64_t swap = (a ^ b) & (uint64_t)minus;
    struct num x = num_unpack(a ^ swap), y = num_unpack(b ^ swap);
    d = (d ^ minus) - minus;
    int64_t m = (int64_t)x.m + (y.m >> (d < 31 ? d : 31));
    if (m == 0)
        return num_pack((struct num){ 0, NUM_ZERO_E });
    minus = num_wide_sign(m);
    int up = __builtin_clzll((uint64_t)(m ^ minus) - (uint64_t)minus) - 33;
    m = (int64_t)((uint64_t)m << up) >> 1;
    return num_pack((struct num){ (int32_t)m, x.e - up + 1 });
}

NUM_INLINE uint64_t num_wide_mul(uint64_t a, uint64_t b)
{
    struct num x = num_unpack(a), y = num_unpack(b);
    int64_t product = (int64_t)x.m * y.m;
    if (product == 0)
        return num_pack((struct num){ 0, NUM_ZERO_E });
    int32_t m = (int32_t)(product >> 30);
    int32_t up = (uint32_t)(m + (NUM_ONE - 1)) < 2 * (uint32_t)NUM_ONE - 1;
    return num_pack(
        (struct num){ (int32_t)(product >> (30 - up)), x.e + y.e + 30 - up });
}

/* A whole number that is ordered as the num is. */
NUM_INLINE int64_t num_wide_order(uint64_t word)
{
    struct num a = num_unpack(word);
    int64_t minus = num_wide_sign(a.m);
    int64_t size = ((int64_t)a.e + (1 << 20)) * ((int64_t)1 << 30) +
                   (((int64_t)a.m ^ minus) - minus);
    return ((size ^ minus) - minus) & -(int64_t)(a.m != 0);
}

NUM_INLINE bool num_wide_lt(uint64_t a, uint64_t b)
{
    return num_wide_order(a) < num_wide_order(b);
}

#endif
