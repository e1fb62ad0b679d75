/* motion/core/track.c - the tick's half of track.h: sampling.
 *
 * Bounds.  track_append.c chooses frac so that every partial sum of the three
 * Horner schemes below, for 0 <= w < 1/2, stays under 2^62:
 *     p_k = c_k + w p_(k+1)
 *     v_k = p_(k+1) + w v_(k+1)         v_0 = dp/dw
 *     a_k = v_(k+1) + w a_(k+1)         a_0 = p''/2, upper 32 bits kept
 * Each step rounds down by less than 2 units, far inside the factor of two
 * that is left to 2^63. */
#include "motion/core/track.h"

#include "motion/core/track_internal.h"

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

/* Inlined whatever the compiler thinks: a call would pass sums in memory. */
#define TRACK_INLINE static inline __attribute__((always_inline))

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

TRACK_INLINE struct track_sums track_step(struct track_sums s, int32_t w,
                                          int64_t c)
{
    return (struct track_sums){
        .a = track_mul_high(s.a, w) + track_high(s.v),
        .v = track_mul(s.v, w) + s.p,
        .p = track_mul(s.p, w) + c,
    };
}

static inline uint64_t track_shift_left(int64_t a, unsigned bits)
{
    return (uint64_t)a << bits;
}

/* a k, where it is known to fit. */
static inline int64_t track_times(int64_t a, uint32_t k)
{
    return (int64_t)((uint64_t)a * k);
}

/* The sum as travel in 2^-32.  Far (frac <= 0) its steps are 2^-frac, and the
 * remainder of the travel is laid over it in a straight line. */
static inline int64_t track_travel(const struct motion_segment *segment,
                                   bool far, int64_t p, int32_t w)
{
    if (!far)
        return track_mul(p, segment->pos_scale);
    return track_times(p, (uint32_t)segment->pos_scale) +
           track_mul_high(segment->remainder * 2, w);
}

/* u has 63 bits: w = u/2 takes 31; the 31 below enter to first order.  Their
 * negative, because a compiler that can prove them positive would multiply
 * the long way. */
TRACK_INLINE struct track_sums track_refine(struct track_sums s, uint64_t u)
{
    int32_t rest = -(int32_t)((uint32_t)u >> 1);

    s.p += (int64_t)track_mul_high(track_high(s.v), rest) * -2;
    s.v += (int64_t)track_mul_high(s.a, rest) * -4;
    return s;
}

TRACK_INLINE void track_store(const struct motion_segment *segment, bool far,
                              uint64_t u, struct track_sums s,
                              struct motion_sample *sample)
{
    int32_t w = (int32_t)(uint32_t)(u >> 32);

    s = track_refine(s, u);
    sample->acc_q32 = track_scale_acc(segment, s.a);
    sample->vel_q32 = track_scale_vel(segment, s.v);
    if (far)
        sample->vel_q32 = track_times(sample->vel_q32, segment->vel_factor);
    sample->pos_q32 = (int64_t)((uint64_t)segment->pos_q32 +
                                (uint64_t)track_travel(segment, far, s.p, w));
}

TRACK_INLINE struct track_sums
track_sum_cubic(const struct motion_segment *segment, int32_t w)
{
    struct track_sums s = { .p = segment->coef[3] };

    s = track_step(s, w, segment->coef[2]);
    s = track_step(s, w, segment->coef[1]);
    return track_step(s, w, segment->coef[0]);
}

TRACK_INLINE struct track_sums
track_sum_quintic(const struct motion_segment *segment, int32_t w)
{
    struct track_sums s = { .p = segment->coef[5] };

    s = track_step(s, w, segment->coef[4]);
    s = track_step(s, w, segment->coef[3]);
    s = track_step(s, w, segment->coef[2]);
    s = track_step(s, w, segment->coef[1]);
    return track_step(s, w, segment->coef[0]);
}

/* Four ways to sample, each a function of its own that takes its arguments in
 * registers: where two share code a 32-bit compiler joins them, no longer
 * knows that w is 32 bits, and multiplies the long way. */
typedef void track_displacement(const struct motion_segment *segment,
                                struct motion_sample *sample, uint64_t dt);
__attribute__((noinline)) static track_displacement track_sample_cubic;
__attribute__((noinline)) static track_displacement track_sample_quintic;
__attribute__((noinline)) static track_displacement track_sample_far;
__attribute__((noinline)) static track_displacement track_sample_short;

static void track_sample_cubic(const struct motion_segment *segment,
                               struct motion_sample *sample, uint64_t dt)
{
    uint64_t u = track_fraction_q63(segment, dt);
    int32_t w = (int32_t)(uint32_t)(u >> 32);

    track_store(segment, false, u, track_sum_cubic(segment, w), sample);
}

static void track_sample_quintic(const struct motion_segment *segment,
                                 struct motion_sample *sample, uint64_t dt)
{
    uint64_t u = track_fraction_q63(segment, dt);
    int32_t w = (int32_t)(uint32_t)(u >> 32);

    track_store(segment, false, u, track_sum_quintic(segment, w), sample);
}

static void track_sample_far(const struct motion_segment *segment,
                             struct motion_sample *sample, uint64_t dt)
{
    uint64_t u = track_fraction_q63(segment, dt);
    int32_t w = (int32_t)(uint32_t)(u >> 32);

    track_store(segment, true, u, track_sum_quintic(segment, w), sample);
}

/* A duration under 30 us or an acceleration over 1e8: the scales lack vel_shift
 * and acc_shift bits.  |v| 2^vel_shift < 2^66, since the velocity fits and the
 * scale is at least 2^61; so all but 3 of its bits can be had before the
 * scaling, where they do not cost precision. */
static void track_sample_short(const struct motion_segment *segment,
                               struct motion_sample *sample, uint64_t dt)
{
    unsigned after = segment->vel_shift < 3 ? segment->vel_shift : 3;
    uint64_t u = track_fraction_q63(segment, dt);
    int32_t w = (int32_t)(uint32_t)(u >> 32);
    struct track_sums s = track_refine(track_sum_quintic(segment, w), u);

    s.p = track_travel(segment, segment->frac <= 0, s.p, w);
    s.v = (int64_t)track_shift_left(s.v, segment->vel_shift - after);
    s.v = track_scale_vel(segment, s.v);
    sample->pos_q32 = (int64_t)((uint64_t)segment->pos_q32 + (uint64_t)s.p);
    sample->vel_q32 = (int64_t)track_shift_left(s.v, after);
    sample->acc_q32 = (int64_t)track_shift_left(track_scale_acc(segment, s.a),
                                                segment->acc_shift);
}

/* Each call is the last thing its caller does: a jump. */
TRACK_INLINE void track_sample_kind(const struct motion_segment *segment,
                                    struct motion_sample *sample, uint64_t dt)
{
    if (segment->kind == MOTION_SEGMENT_QUINTIC)
        track_sample_quintic(segment, sample, dt);
    else if (segment->kind == MOTION_SEGMENT_FAR)
        track_sample_far(segment, sample, dt);
    else if (segment->kind == MOTION_SEGMENT_CUBIC)
        track_sample_cubic(segment, sample, dt);
    else
        track_sample_short(segment, sample, dt);
}

void track_segment_sample(const struct motion_segment *segment,
                          struct motion_sample *sample, uint64_t dt)
{
    track_sample_kind(segment, sample, dt);
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
        sample->acc_q32 = track->end.acc_q32;
    }
}

static bool track_holds(const struct motion_track *track, uint32_t index,
                        int64_t t_ns_q12)
{
    if (index >= track->count)
        return false;
    const struct motion_segment *segment = &track->segment[index];
    return segment->start_ns_q12 <= t_ns_q12 &&
           t_ns_q12 - segment->start_ns_q12 < segment->dur_ns_q12;
}

int64_t motion_track_ahead(const struct motion_track *track, int64_t t_ns_q12)
{
    if (track->outline == NULL || track->count == 0 || t_ns_q12 < 0 ||
        t_ns_q12 >= track->end_ns_q12)
        return INT64_MAX;
    const struct motion_segment *last = &track->segment[track->count - 1];
    const int64_t to = last->start_ns_q12 + last->dur_ns_q12;
    if (t_ns_q12 < track->segment[0].start_ns_q12)
        return -1;
    return to >= track->end_ns_q12 ? INT64_MAX : to - t_ns_q12;
}

const struct motion_segment *track_seek(const struct motion_track *track,
                                        struct motion_cursor *cursor,
                                        int64_t t_ns_q12)
{
    if (track_holds(track, cursor->index, t_ns_q12))
        return &track->segment[cursor->index];
    if (track_holds(track, cursor->index + 1, t_ns_q12))
        cursor->index++;
    else if (track_holds(track, cursor->index - 1, t_ns_q12))
        cursor->index--;
    else
        cursor->index = track_find(track, t_ns_q12);
    return track_holds(track, cursor->index, t_ns_q12)
               ? &track->segment[cursor->index]
               : NULL;
}

/* The cursor is elsewhere.  Not inlined, so that the usual way needs no stack. */
__attribute__((noinline)) static void
track_sample_seek(const struct motion_track *track,
                  struct motion_cursor *cursor, int64_t t_ns_q12,
                  struct motion_sample *sample)
{
    if (t_ns_q12 < 0 || t_ns_q12 >= track->end_ns_q12) {
        track_sample_outside(track, t_ns_q12, sample);
        return;
    }
    const struct motion_segment *segment = track_seek(track, cursor, t_ns_q12);
    if (segment != NULL)
        track_segment_sample(segment, sample,
                             (uint64_t)(t_ns_q12 - segment->start_ns_q12));
    else
        *sample =
            (struct motion_sample){ .pos_q32 =
                                        track->segment[cursor->index].pos_q32 };
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
            track_sample_kind(segment, sample, dt);
            return;
        }
    }
    track_sample_seek(track, cursor, t_ns_q12, sample);
}
