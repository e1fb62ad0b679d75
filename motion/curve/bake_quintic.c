/* motion/curve/bake_quintic.c - what a baker is made of, quintics in reals and in
 * the integers of a track: see bake.h. */

#include "motion/core/err.h"
#include "motion/core/fixed.h"
#include "motion/core/track_internal.h"
#include "motion/curve/bake.h"
#include "motion/curve/interval.h"

#define BAKE_BITS 61 /* of a coefficient */

struct motion_real motion_bake_seconds(int64_t t_ns_q12)
{
    return motion_real_div(motion_real_int(t_ns_q12),
                           motion_real_int(MOTION_FIXED_S_Q12));
}

struct motion_bake_point motion_bake_horner(const struct motion_real coef[],
                                            int degree, struct motion_real u,
                                            struct motion_real dur_s)
{
    struct motion_real p = coef[degree], d = motion_real_zero(), dd = d;

    for (int k = degree - 1; k >= 0; k--) {
        dd = motion_real_add(motion_real_mul(dd, u), d);
        d = motion_real_add(motion_real_mul(d, u), p);
        p = motion_real_add(motion_real_mul(p, u), coef[k]);
    }
    d = motion_real_div(d, dur_s);
    dd = motion_real_div(motion_real_twice(dd), motion_real_sqr(dur_s));
    return (struct motion_bake_point){ p, d, dd };
}

/* Where the track ends. */
struct motion_real motion_bake_end(const struct motion_track *track)
{
    return motion_real_add(motion_real_from_q(track->end.pos_q32, 32),
                           motion_real_from_u64(track->end_frac, -96));
}

/* The integer and the fraction below 2^-32 of a position; within 2^-48 of a
 * whole number it is that number, so that a key is met to the bit. */
static int bake_split(struct motion_real pos, int64_t *pos_q32, uint64_t *frac)
{
    int64_t fine;
    int err = motion_real_round(pos, 32, pos_q32);
    struct motion_real rest =
        motion_real_sub(pos, motion_real_from_q(*pos_q32, 32));

    *frac = 0;
    if (err < 0 ||
        motion_real_lt(motion_real_abs(rest), motion_real_from_q(1, 48)))
        return err;
    if (motion_real_sign(rest) < 0) {
        *pos_q32 -= 1;
        rest = motion_real_add(rest, motion_real_from_q(1, 32));
    }
    err = motion_real_floor(rest, 32 + 62, &fine);
    *frac = (uint64_t)fine << 2;
    return err;
}

/* The exponent of 2 above all of them. */
static int bake_exponent(const struct motion_real a[], int count)
{
    int e = MOTION_REAL_ZERO_E;

    for (int i = 0; i < count; i++)
        e = a[i].e + 62 > e ? a[i].e + 62 : e;
    return e;
}

void motion_bake_quintic(const struct motion_real w[5], struct motion_real c[5])
{
    static const int row[3][5] = { { 10, -6, -4, -3, 1 },
                                   { -15, 8, 7, 3, -2 },
                                   { 6, -3, -3, -1, 1 } };
    c[0] = w[1];
    c[1] = w[3];
    for (int i = 0; i < 3; i++) {
        c[2 + i] = motion_real_zero();
        for (int k = 0; k < 5; k++)
            c[2 + i] = motion_real_add(
                c[2 + i], motion_real_mul(w[k], motion_real_int(row[i][k])));
    }
}

/* The same in integers, exact, so that the derivatives at the end miss theirs
 * by one rounding and not by that of five coefficients.  Sums modulo 2^64; what
 * comes out is small. */
static void bake_solve_whole(const int64_t whole[5], int64_t c[5])
{
    const uint64_t d = (uint64_t)whole[0], v0 = (uint64_t)whole[1],
                   v1 = (uint64_t)whole[2], a0 = (uint64_t)whole[3],
                   a1 = (uint64_t)whole[4];

    c[0] = whole[1];
    c[1] = whole[3];
    c[2] = (int64_t)(10 * d - 6 * v0 - 4 * v1 - 3 * a0 + a1);
    c[3] = (int64_t)(8 * v0 + 7 * v1 + 3 * a0 - 2 * a1 - 15 * d);
    c[4] = (int64_t)(6 * d - 3 * v0 - 3 * v1 - a0 + a1);
}

int motion_bake_append(struct motion_track *track, int64_t dur,
                       const struct motion_bake_point *from,
                       const struct motion_bake_point *to)
{
    const struct motion_real seconds = motion_bake_seconds(dur);
    const struct motion_real half_square =
        motion_real_half(motion_real_sqr(seconds));
    int64_t end_q32, whole[5], coef[5];
    uint64_t end_frac;
    int err = bake_split(to->pos, &end_q32, &end_frac);

    if (err < 0)
        return err;
    const struct motion_real end = motion_real_add(
        motion_real_from_q(end_q32, 32), motion_real_from_u64(end_frac, -96));
    struct motion_real w[10] = { motion_real_sub(end, motion_bake_end(track)),
                                 motion_real_mul(from->vel, seconds),
                                 motion_real_mul(to->vel, seconds),
                                 motion_real_mul(from->acc, half_square),
                                 motion_real_mul(to->acc, half_square) };
    motion_bake_quintic(w, w + 5);
    int frac = BAKE_BITS - 32 - bake_exponent(w, 10);
    frac = frac < 0 ? 0 : frac > 31 ? 31 : frac;
    for (int i = 0; i < 5 && err == MOTION_OK; i++)
        err = motion_real_round(w[i], 32 + frac, &whole[i]);
    if (err < 0)
        return err;
    bake_solve_whole(whole, coef);
    return motion_track_append_poly(track, dur, 5, coef, (unsigned)frac,
                                    end_q32, end_frac);
}

void motion_bake_coefficients(const struct motion_segment *seg,
                              struct motion_real coef[])
{
    for (int k = 0; k <= MOTION_TRACK_DEGREE; k++)
        coef[k] = motion_real_from_q(seg->coef[k], 32 + seg->frac + k);
    if (seg->frac <= 0)
        coef[1] =
            motion_real_add(coef[1], motion_real_from_q(seg->remainder, 32));
    coef[0] = motion_real_add(coef[0], motion_real_from_q(seg->pos_q32, 32));
}

struct motion_bake_point
motion_bake_segment(const struct motion_segment *segment, int64_t dt_ns_q12)
{
    const struct motion_real u = motion_real_div(
        motion_real_int(dt_ns_q12), motion_real_int(segment->dur_ns_q12));
    struct motion_real coef[MOTION_TRACK_DEGREE + 1];

    motion_bake_coefficients(segment, coef);
    return motion_bake_horner(coef, MOTION_TRACK_DEGREE, u,
                              motion_bake_seconds(segment->dur_ns_q12));
}

/* Times are whole: what begins before t begins at t - 1 at the latest. */
uint32_t motion_bake_span(const int64_t start_ns_q12[], uint32_t spans,
                          int64_t t_ns_q12, enum motion_bake_side side)
{
    const int64_t last = side == MOTION_BAKE_LEFT ? t_ns_q12 - 1 : t_ns_q12;

    return motion_interval_find(start_ns_q12, sizeof *start_ns_q12, spans,
                                last);
}

const struct motion_segment *motion_bake_find(const struct motion_track *track,
                                              int64_t t_ns_q12,
                                              enum motion_bake_side side)
{
    const int64_t last = side == MOTION_BAKE_LEFT ? t_ns_q12 - 1 : t_ns_q12;

    return &track->segment[track_find(track, last)];
}

struct motion_bake_point motion_bake_track(const struct motion_track *track,
                                           int64_t t_ns_q12,
                                           enum motion_bake_side side)
{
    const struct motion_segment *segment =
        motion_bake_find(track, t_ns_q12, side);

    return motion_bake_segment(segment, t_ns_q12 - segment->start_ns_q12);
}

struct motion_real motion_bake_rounding(const struct motion_segment *seg,
                                        struct motion_real pos)
{
    const int coarse = seg->frac < 0 ? -seg->frac : 0;

    return motion_real_add(motion_real_from_q(2, 32 - coarse),
                           motion_real_scale(motion_real_abs(pos), -56));
}
