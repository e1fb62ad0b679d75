/* motion/core/track_enclose.c - see track_enclose.h.
 *
 * As in track.h p = c[0] + c[1] w + ..., w = u / 2 < 1/2, |c[k]| < 2^62.  Of c[2]
 * to c[5] the 27 bits from the first on that one of them has are taken, so that
 * |e[k]| < 2^27; with |w| < 1/2 and |x| <= 1/4
 *
 *     |p''/2| <= (1 + 3/2 + 6/4 + 10/8) 2^27 < 2^30
 *     3 |p'''/6| <= 3 (1 + 4/2 + 10/4) 2^27 < 2^32
 *     6 |p''''/24| <= 6 (1 + 5/2) 2^27 < 2^32
 *
 * and every sum below stays under that, too.  Each product is rounded down, by 1;
 * a coefficient at the middle adds up fewer than 8 of these. */
#include "motion/core/track_enclose.h"

#include "motion/core/fixed.h"
#include "motion/core/track_internal.h"

/* Of ranges before they are told, and what products of factors are off by. */
#define ENCLOSE_BITS     26
#define ENCLOSE_ROUNDING 4
#define ENCLOSE_SUM      8
/* Bits that f''' has fewer than f'', where it is told by itself. */
#define ENCLOSE_SHORT 6

static inline int32_t enclose_mul(int32_t a, int32_t b)
{
    return (int32_t)(uint32_t)((uint64_t)((int64_t)a * b) >> 32);
}

static inline uint32_t enclose_mul_u(uint32_t a, uint32_t b)
{
    return (uint32_t)((uint64_t)a * b >> 32);
}

static inline uint32_t enclose_size(int32_t a)
{
    return (uint32_t)(a < 0 ? -a : a);
}

/* --- when a track is loaded ------------------------------------------------ */

/* S / 2, S^2 / 4 and 6 S^3 / 8 as mantissas, with S = 2^21 5^9 steps of time per
 * second, and what they are times, with the constants of the exponents below. */
static const struct {
    uint64_t mantissa;
    int16_t exponent;
} enclose_seconds[3] = {
    { UINT64_C(1953125) << 43, 9 - 31 },
    { UINT64_C(3814697265625) << 22, 52 - 31 - 64 },
    { UINT64_C(11175870895385742188), 97 - 31 - 129 },
};

void motion_track_unit_init(struct motion_track_unit *unit,
                            const int64_t one_q32[3])
{
    for (unsigned i = 0; i < 3; i++) {
        unit->factor[i] = 0;
        unit->exponent[i] = 0;
        if (one_q32[i] <= 0)
            continue;
        const unsigned bits = motion_fixed_clz_u64((uint64_t)one_q32[i]) & 63;
        uint64_t quotient; /* mantissas' ratio, from 1/2 to 2, Q63 */
        motion_fixed_div_u128(
            (struct motion_u128){ enclose_seconds[i].mantissa >> 1, 0 },
            (uint64_t)one_q32[i] << bits, &quotient, NULL);
        const unsigned below = motion_fixed_clz_u64(quotient) & 63;
        unit->factor[i] = (uint32_t)(quotient << below >> 32);
        unit->exponent[i] =
            (int16_t)(enclose_seconds[i].exponent + (int)bits - (int)below);
    }
}

/* --- on the tick ----------------------------------------------------------- */

static inline void enclose_widen(struct motion_range *range, int32_t low,
                                 int32_t high)
{
    if (low < range->low)
        range->low = low;
    if (high > range->high)
        range->high = high;
}

static inline int32_t enclose_clip(int32_t value, int32_t most)
{
    return value > most ? most : value < -most ? -most : value;
}

/* To what is left of 32 bits: one instruction of a Cortex-M4. */
static inline int32_t enclose_cut(int32_t value)
{
    const int32_t most = (1 << ENCLOSE_BITS) - 1;
    return value > most ? most : value < -most - 1 ? -most - 1 : value;
}

/* mid +- radius, times factor 2^(left - 32), in 2^-26; of a small product the
 * factor is exact.  Its negative, because a compiler that can prove it positive
 * would multiply the long way. */
static inline void enclose_tell(struct motion_range *range, int32_t mid,
                                int32_t radius, uint32_t factor, int left)
{
    const int32_t half = -(int32_t)(factor >> 1);
    int32_t low = enclose_mul(radius - mid, half);
    int32_t high = enclose_mul(-radius - mid, half) + 1;
    int shift = 30 - ENCLOSE_BITS;
    if (left <= 0) {
        const int right = left > -31 ? -left : 31;
        low = enclose_cut((low - ENCLOSE_ROUNDING) >> right);
        high = enclose_cut(((high + ENCLOSE_ROUNDING) >> right) + 1);
    } else if ((mid | radius) == 0) {
        low = high = 0;
    } else {
        const int more = left < ENCLOSE_BITS ? left : ENCLOSE_BITS;
        const int32_t most = (1 << ENCLOSE_BITS) >> more;
        low = enclose_clip(low - 1, most);
        high = enclose_clip(high + 1, most);
        shift += more;
    }
    enclose_widen(range, low * (1 << shift), high * (1 << shift));
}

/* So many bits are not used. */
static inline unsigned enclose_spare(uint32_t bits)
{
    return (unsigned)__builtin_clz(bits | 1) - 1;
}

/* Of the upper half those that are not sign. */
static inline uint32_t enclose_bits(int64_t c)
{
    const int32_t high = (int32_t)(c >> 32);
    return (uint32_t)(high ^ (high >> 31));
}

/* Of c 2^spare, which is below 2^63, the upper 28 bits. */
static inline int32_t enclose_coef(int64_t c, unsigned spare)
{
    const uint32_t high = (uint32_t)((uint64_t)c >> 32) << spare;
    const uint32_t low = (uint32_t)c >> 1 >> (31 - spare);
    return (int32_t)(high | low) >> 4;
}

/* Around w, up to x on both sides: the coefficients and how far they are from what
 * the derivatives are there. */
struct enclose_series {
    int32_t b1, b2, b3; /* b1 without c[1] */
    int32_t r1, r2, r3;
};

static inline struct enclose_series
enclose_series(const int64_t c[], unsigned spare, int32_t w, uint32_t x)
{
    const int32_t e5 = enclose_coef(c[5], spare);
    const int32_t p4 = enclose_coef(c[4], spare) + enclose_mul(e5, w);
    const int32_t p3 = enclose_coef(c[3], spare) + enclose_mul(p4, w);
    const int32_t p2 = enclose_coef(c[2], spare) + enclose_mul(p3, w);
    const int32_t v3 = p4 + enclose_mul(e5, w);
    const int32_t v2 = p3 + enclose_mul(v3, w);
    const int32_t v1 = p2 + enclose_mul(v2, w);
    const int32_t a2 = v3 + enclose_mul(e5, w);
    const int32_t a1 = v2 + enclose_mul(a2, w);
    const int32_t b2 = v1 + enclose_mul(a1, w);
    const int32_t j1 = a2 + enclose_mul(e5, w);
    const int32_t b3 = a1 + enclose_mul(j1, w);
    const int32_t b4 = j1 + enclose_mul(e5, w);
    const uint32_t size2 = enclose_size(b2), size3 = enclose_size(b3);
    const uint32_t size4 = enclose_size(b4) + ENCLOSE_SUM;
    const uint32_t fifth = enclose_mul_u(10 * enclose_size(e5), x) + 1;
    uint32_t r1 = enclose_mul_u(4 * size4 + fifth / 2, x) + 1;
    r1 = enclose_mul_u(3 * (size3 + ENCLOSE_SUM) + r1, x) + 1;
    r1 = enclose_mul_u(2 * (size2 + ENCLOSE_SUM) + r1, x) + 1;
    uint32_t r2 = enclose_mul_u(6 * size4 + fifth, x) + 1;
    r2 = enclose_mul_u(3 * (size3 + ENCLOSE_SUM) + r2, x) + 1;
    const uint32_t r3 = enclose_mul_u(4 * size4 + fifth, x) + 1;
    return (struct enclose_series){
        enclose_mul(p2 + v1, w),
        b2,
        b3,
        (int32_t)r1 + ENCLOSE_SUM,
        (int32_t)r2 + ENCLOSE_SUM,
        (int32_t)r3 + ENCLOSE_SUM,
    };
}

/* In a segment so short that f''' hardly shows in f'' it has bits of its own. */
static void enclose_third(const int64_t c[], unsigned spare, int32_t w,
                          uint32_t x, struct enclose_series *series)
{
    const int32_t e5 = enclose_coef(c[5], spare);
    const int32_t e4 = enclose_coef(c[4], spare);
    const int32_t e3 = enclose_coef(c[3], spare);
    const int32_t b4 = e4 + 5 * enclose_mul(e5, w);
    const uint32_t fifth = enclose_mul_u(10 * enclose_size(e5), x);
    series->b3 =
        e3 + 4 * enclose_mul(e4, w) + 10 * enclose_mul(enclose_mul(e5, w), w);
    series->r3 = (int32_t)enclose_mul_u(4 * enclose_size(b4) + fifth, x) +
                 4 * ENCLOSE_SUM;
}

/* Of as many coefficients as there are; what is 0 is so to the bit. */
static inline struct enclose_series
enclose_around(const struct motion_segment *segment, int32_t w, uint32_t x,
               unsigned *spare, unsigned *third)
{
    const int64_t *c = segment->coef;
    struct enclose_series s = { 0 };
    *spare = *third = 0;
    if (segment->degree < 2)
        return s;
    const uint32_t bits =
        enclose_bits(c[3]) | enclose_bits(c[4]) | enclose_bits(c[5]);
    *spare = *third = enclose_spare(bits | enclose_bits(c[2]));
    s = enclose_series(c, *spare, w, x);
    if (segment->degree < 3) {
        s.b3 = s.r3 = 0;
    } else if (enclose_spare(bits) > *spare + ENCLOSE_SHORT) {
        *third = enclose_spare(bits);
        enclose_third(c, *third, w, x, &s);
    }
    return s;
}

/* From `from` to `to`, from the segment's start.  Its duration is dur = 2^(127 -
 * normalise) / inverse, so 1 / dur^k = i^k 2^(k (normalise - 95)) with i the upper
 * half of the inverse, and i^k times a factor is told as its upper 32 bits. */
static void enclose_segment(const struct motion_segment *segment,
                            const struct motion_track_unit *unit, int64_t from,
                            int64_t to, struct motion_range range[3])
{
    const uint32_t i = (uint32_t)(segment->inverse >> 32);
    const uint32_t i2 = enclose_mul_u(i, i), i3 = enclose_mul_u(i2, i);
    const unsigned n = segment->normalise;
    const uint64_t half = (uint64_t)(to - from) / 2;
    const uint64_t mid = ((uint64_t)from + half) << n;
    const int32_t w = (int32_t)enclose_mul_u((uint32_t)(mid >> 32), i);
    /* both are down by 2 at most, and half by 1 step of time */
    const uint32_t x = enclose_mul_u((uint32_t)((half + 1) << n >> 32), i) + 5;
    unsigned spare, third;
    const struct enclose_series s =
        enclose_around(segment, w, x, &spare, &third);
    const int left = (int)n - segment->frac;
    enclose_tell(&range[0],
                 ((int32_t)(segment->coef[1] >> 32) >> 4) + (s.b1 >> spare),
                 (s.r1 >> spare) + 3, enclose_mul_u(i, unit->factor[0]),
                 left + unit->exponent[0]);
    enclose_tell(&range[1], s.b2, s.r2, enclose_mul_u(i2, unit->factor[1]),
                 left + (int)n - (int)spare + unit->exponent[1]);
    enclose_tell(&range[2], s.b3, s.r3, enclose_mul_u(i3, unit->factor[2]),
                 left + 2 * (int)n - (int)third + unit->exponent[2]);
}

static void enclose_stands(struct motion_range range[3])
{
    for (unsigned i = 0; i < 3; i++)
        enclose_widen(&range[i], 0, 0);
}

bool motion_track_enclose(const struct motion_track *track,
                          struct motion_cursor *cursor,
                          const struct motion_track_unit *unit,
                          int64_t *from_ns_q12, int64_t to_ns_q12,
                          struct motion_range range[3])
{
    const int64_t from = *from_ns_q12;
    if (from < 0 || from >= track->end_ns_q12) {
        enclose_stands(range);
        *from_ns_q12 = from < 0 && to_ns_q12 > 0 ? 0 : to_ns_q12;
        return true;
    }
    const struct motion_segment *segment = track_seek(track, cursor, from);
    if (segment == NULL)
        return false;
    const int64_t start = segment->start_ns_q12;
    const int64_t end = start + segment->dur_ns_q12;
    const int64_t to = to_ns_q12 < end ? to_ns_q12 : end;
    enclose_segment(segment, unit, from - start, to - start, range);
    *from_ns_q12 = to;
    return true;
}
