/* motion/track.c - the tick's half of track.h: sampling.
 *
 * Bounds.  track_append.c chooses frac so that every partial sum of the three
 * Horner schemes below, for 0 <= w < 1/2, stays under 2^62:
 *     p_k = c_k + w p_(k+1)
 *     v_k = p_(k+1) + w v_(k+1)         v_0 = dp/dw
 *     a_k = v_(k+1) + w a_(k+1)         a_0 = p''/2, upper 32 bits kept
 * Each step rounds down by less than 2 units, far inside the factor of two
 * that is left to 2^63. */
#include "motion/track.h"

#include "motion/track_internal.h"

void motion_track_init(struct motion_track *track,
                       struct motion_segment *segment, uint32_t capacity,
                       int64_t pos_q32)
{
    *track = (struct motion_track){
        .segment = segment,
        .capacity = capacity,
        .end = { .pos_q32 = pos_q32 },
    };
}

/* The casts by way of unsigned make 32-bit compilers see 32 x 32 -> 64. */
static inline int32_t track_high(int64_t a)
{
    return (int32_t)(uint32_t)((uint64_t)a >> 32);
}

/* c w / 2^32, rounded down; 0 <= w < 2^31, |c| < 2^63: no overflow. */
static inline int64_t track_mul(int64_t c, int32_t w)
{
    uint64_t low = (uint64_t)(uint32_t)c * (uint32_t)w >> 32;
    return (int64_t)track_high(c) * w + (int64_t)low;
}

static inline int32_t track_mul_high(int32_t a, int32_t b)
{
    return track_high((int64_t)a * b);
}

/* 64-bit arithmetic shift by 0..31 without the branches for 32..63. */
static inline int64_t track_shift_right(int64_t a, uint32_t bits)
{
    uint32_t low = (uint32_t)a >> bits | (uint32_t)track_high(a)
                                             << 1 << (31 - bits);
    uint32_t high = (uint32_t)(track_high(a) >> bits);
    return (int64_t)((uint64_t)high << 32 | low);
}

/* d/dw to unit/s: v * scale / 2^64.  |v| < 2^62, scale < 2^62. */
static inline int64_t track_scale_vel(const struct motion_segment *segment,
                                      int64_t v)
{
    uint64_t low =
        (uint64_t)(uint32_t)v * (uint32_t)segment->vel_scale_high >> 32;
    int32_t mid = track_mul_high(track_high(v), segment->vel_scale_low);
    return (int64_t)track_high(v) * segment->vel_scale_high + (int64_t)low +
           mid;
}

/* a * scale / 2^32.  |a| < 2^30, scale < 2^62. */
static inline int64_t track_scale_acc(const struct motion_segment *segment,
                                      int32_t a)
{
    return (int64_t)a * segment->acc_scale_high +
           track_mul_high(a, segment->acc_scale_low);
}

static inline int64_t track_shift_left(int64_t a, unsigned bits)
{
    return (int64_t)((uint64_t)a << bits);
}

/* What hardly any segment needs: travel beyond 2^21 units (position in steps
 * of 2^-frac, the remainder of the travel laid over it in a straight line), or
 * a duration so short that the scales need more than their 62 bits. */
static void track_special(const struct motion_segment *segment, int64_t p,
                          int32_t w, struct motion_sample *sample)
{
    if (segment->frac < 0) {
        p = track_shift_left(p, (unsigned)-segment->frac);
        p += ((int64_t)segment->remainder * w) >> 31;
        sample->pos_q32 = (int64_t)((uint64_t)segment->pos_q32 + (uint64_t)p);
    }
    sample->vel_q32 = track_shift_left(sample->vel_q32, segment->vel_shift);
    sample->acc_q16 = track_shift_left(sample->acc_q16, segment->acc_shift);
}

/* u has 63 bits: w = u/2 as Q0.32 in 31, and `rest` the 31 below, which enter
 * to first order (rest/2^63: the second-order term is under one unit). */
static inline void track_evaluate(const struct motion_segment *segment,
                                  uint64_t dt, struct motion_sample *sample)
{
    const int64_t *c = segment->coef;
    uint64_t u = track_fraction_q63(segment, dt);
    int32_t w = (int32_t)(uint32_t)(u >> 32);
    int32_t rest = (int32_t)((uint32_t)u >> 1);
    int64_t p = c[3], v = 0;
    int32_t a = 0;

    if (segment->degree > 3) {
        v = c[5];
        p = track_mul(c[5], w) + c[4];
        a = track_high(v);
        v = track_mul(v, w) + p;
        p = track_mul(p, w) + c[3];
    }
    a = track_mul_high(a, w) + track_high(v);
    v = track_mul(v, w) + p;
    p = track_mul(p, w) + c[2];

    a = track_mul_high(a, w) + track_high(v);
    v = track_mul(v, w) + p;
    p = track_mul(p, w) + c[1];

    a = track_mul_high(a, w) + track_high(v);
    v = track_mul(v, w) + p;
    p = track_mul(p, w) + c[0];

    p += (int64_t)track_mul_high(track_high(v), rest) * 2;
    v += (int64_t)track_mul_high(a, rest) * 4;

    uint64_t travel =
        (uint64_t)track_shift_right(p, (uint32_t)segment->frac & 31);
    sample->pos_q32 = (int64_t)((uint64_t)segment->pos_q32 + travel);
    sample->vel_q32 = track_scale_vel(segment, v);
    sample->acc_q16 = track_scale_acc(segment, a);
    if (segment->special)
        track_special(segment, p, w, sample);
}

void track_segment_sample(const struct motion_segment *segment, uint64_t dt,
                          struct motion_sample *sample)
{
    track_evaluate(segment, dt, sample);
}

uint32_t track_find(const struct motion_track *track, int64_t t_ns_q12)
{
    uint32_t first = 0, last = track->count - 1;

    while (first < last) { /* segment[first].start <= t */
        uint32_t middle = last - (last - first) / 2;
        if (track->segment[middle].start_ns_q12 <= t_ns_q12)
            first = middle;
        else
            last = middle - 1;
    }
    return first;
}

/* Before the start, at or after the end. */
static void track_sample_outside(const struct motion_track *track,
                                 int64_t t_ns_q12, struct motion_sample *sample)
{
    *sample = (struct motion_sample){ .pos_q32 = track->end.pos_q32 };
    if (track->count == 0)
        return;
    if (t_ns_q12 < 0) {
        sample->pos_q32 = track->segment[0].pos_q32;
    } else if (t_ns_q12 == track->end_ns_q12) {
        sample->vel_q32 = track->end.vel_q32;
        sample->acc_q16 = track->end.acc_q16;
    }
}

static bool track_holds(const struct motion_track *track, uint32_t index,
                        int64_t t_ns_q12)
{
    const struct motion_segment *segment = &track->segment[index];
    return index < track->count && segment->start_ns_q12 <= t_ns_q12 &&
           t_ns_q12 - segment->start_ns_q12 < segment->dur_ns_q12;
}

/* The cursor is elsewhere: try the next segment, else search. */
static void track_sample_seek(const struct motion_track *track,
                              struct motion_cursor *cursor, int64_t t_ns_q12,
                              struct motion_sample *sample)
{
    if (t_ns_q12 < 0 || t_ns_q12 >= track->end_ns_q12) {
        track_sample_outside(track, t_ns_q12, sample);
        return;
    }
    if (cursor->index < track->count &&
        track_holds(track, cursor->index + 1, t_ns_q12))
        cursor->index++;
    else
        cursor->index = track_find(track, t_ns_q12);

    const struct motion_segment *segment = &track->segment[cursor->index];
    track_segment_sample(segment, (uint64_t)(t_ns_q12 - segment->start_ns_q12),
                         sample);
}

/* start <= MOTION_TRACK_MAX < 2^63 - 2^61, so a t before the start gives a
 * difference that, modulo 2^64, is over 2^60 and thus over any duration. */
void motion_track_sample(const struct motion_track *track,
                         struct motion_cursor *cursor, int64_t t_ns_q12,
                         struct motion_sample *sample)
{
    uint32_t index = cursor->index;

    if (index < track->count) {
        const struct motion_segment *segment = &track->segment[index];
        uint64_t dt = (uint64_t)t_ns_q12 - (uint64_t)segment->start_ns_q12;
        if (dt < (uint64_t)segment->dur_ns_q12) {
            track_evaluate(segment, dt, sample);
            return;
        }
    }
    track_sample_seek(track, cursor, t_ns_q12, sample);
}
