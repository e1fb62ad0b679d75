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

/* The three Horner schemes side by side; one step takes in coefficient k. */
struct track_sums {
    int64_t p, v;
    int32_t a;
};

static inline struct track_sums track_step(struct track_sums s, int32_t w,
                                           int64_t c)
{
    return (struct track_sums){
        .a = track_mul_high(s.a, w) + track_high(s.v),
        .v = track_mul(s.v, w) + s.p,
        .p = track_mul(s.p, w) + c,
    };
}

/* u has 63 bits: w = u/2 takes 31; the 31 below enter to first order, as
 * their complement -rest - 1 (one instruction, and a compiler that knew rest
 * to be positive would multiply it the long way).  The one too many adds at
 * most 2 to p, which frac >= 2 hides: c[0] is a multiple of 4. */
static inline void track_store(const struct motion_segment *segment,
                               struct motion_sample *sample, uint64_t u,
                               struct track_sums s)
{
    int32_t rest = (int32_t) ~((uint32_t)u >> 1);

    s.p += (int64_t)track_mul_high(track_high(s.v), rest) * -2;
    s.v += (int64_t)track_mul_high(s.a, rest) * -4;
    sample->acc_q16 = track_scale_acc(segment, s.a);
    sample->vel_q32 = track_scale_vel(segment, s.v);
    sample->pos_q32 = (int64_t)((uint64_t)segment->pos_q32 +
                                (uint64_t)track_mul(s.p, segment->pos_scale));
}

static inline int64_t track_shift_left(int64_t a, unsigned bits)
{
    return (int64_t)((uint64_t)a << bits);
}

/* Where the scale lacks vel_shift bits: |v| 2^vel_shift < 2^66 since the
 * velocity fits and the scale is at least 2^61; so all but 3 of them can be
 * had before the scaling, where they do not cost precision. */
static int64_t track_special_vel(const struct motion_segment *segment,
                                 int64_t v)
{
    unsigned after = segment->vel_shift < 3 ? segment->vel_shift : 3;

    v = track_shift_left(v, segment->vel_shift - after);
    return track_shift_left(track_scale_vel(segment, v), after);
}

/* What hardly any segment needs: travel over 2^19 units (frac < 2; below zero
 * in steps of 2^-frac, the remainder of the travel laid over it in a straight
 * line), or a duration under 100 ns, whose scales need more than 62 bits. */
static void track_sample_special(const struct motion_segment *segment,
                                 struct motion_sample *sample, uint64_t u)
{
    struct track_sums s = { .p = segment->coef[MOTION_TRACK_DEGREE] };
    int32_t w = (int32_t)(uint32_t)(u >> 32);
    int32_t rest = (int32_t)((uint32_t)u >> 1);

    for (int k = MOTION_TRACK_DEGREE - 1; k >= 0; k--)
        s = track_step(s, w, segment->coef[k]);
    s.p += (int64_t)track_mul_high(track_high(s.v), rest) * 2;
    s.v += (int64_t)track_mul_high(s.a, rest) * 4;
    if (segment->frac >= 0) {
        s.p >>= segment->frac;
    } else {
        s.p = track_shift_left(s.p, (unsigned)-segment->frac);
        s.p += (segment->remainder * (int64_t)w) >> 31;
    }
    sample->pos_q32 = (int64_t)((uint64_t)segment->pos_q32 + (uint64_t)s.p);
    sample->vel_q32 = track_special_vel(segment, s.v);
    sample->acc_q16 =
        track_shift_left(track_scale_acc(segment, s.a), segment->acc_shift);
}

/* Cubics skip two steps.  Each way has its own tail: joined, a 32-bit compiler
 * no longer knows that w is 32 bits. */
void track_segment_sample(const struct motion_segment *segment,
                          struct motion_sample *sample, uint64_t dt)
{
    const int64_t *c = segment->coef;
    uint64_t u = track_fraction_q63(segment, dt);
    int32_t w = (int32_t)(uint32_t)(u >> 32);

    if (segment->kind == MOTION_SEGMENT_QUINTIC) {
        struct track_sums s = { .p = c[5] };
        s = track_step(s, w, c[4]);
        s = track_step(s, w, c[3]);
        s = track_step(s, w, c[2]);
        s = track_step(s, w, c[1]);
        s = track_step(s, w, c[0]);
        track_store(segment, sample, u, s);
    } else if (segment->kind == MOTION_SEGMENT_CUBIC) {
        struct track_sums s = { .p = c[3] };
        s = track_step(s, w, c[2]);
        s = track_step(s, w, c[1]);
        s = track_step(s, w, c[0]);
        track_store(segment, sample, u, s);
    } else {
        track_sample_special(segment, sample, u);
    }
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

/* The cursor is elsewhere: try the next segment, else search.  Not inlined,
 * so that the usual way needs no stack. */
__attribute__((noinline)) static void
track_sample_seek(const struct motion_track *track,
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
    track_segment_sample(segment, sample,
                         (uint64_t)(t_ns_q12 - segment->start_ns_q12));
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
            track_segment_sample(segment, sample, dt);
            return;
        }
    }
    track_sample_seek(track, cursor, t_ns_q12, sample);
}
