/* motion/curve/ease_internal.h - what the files of ease.h share.
 *
 * Lengths are counted in 2^-32 unit, times in 2^-12 ns. */
#ifndef MOTION_CURVE_EASE_INTERNAL_H
#define MOTION_CURVE_EASE_INTERNAL_H

#include <stdbool.h>
#include <stdint.h>

#include "motion/core/fixed.h"
#include "motion/core/track.h"
#include "motion/curve/ease.h"
#include "motion/number/real.h"

/* A polynomial in u = t/dur: coef[k - 1] / 2^frac is that of u^k. */
struct ease_piece {
    int64_t dur;
    int degree;
    unsigned frac;
    int64_t coef[MOTION_TRACK_DEGREE];
};

/* Ramp, middle and ramp, before they are appended. */
struct ease_shape {
    struct ease_piece piece[MOTION_EASE_SEGMENTS];
    uint32_t count;
};

/* Ramp from rest: acceleration rises for `up`, stays, falls for `down`; or,
 * with `sine`, a quarter sine of speed over `hold`. */
struct ease_ramp {
    int64_t up, hold, down;
    bool sine;
};

/* A signed displacement. */
struct ease_displacement {
    struct motion_u128 from, to; /* Q64.64, two's complement */
    struct motion_real length;
    bool down;
};

static inline struct motion_real ease_whole(int64_t a)
{
    return motion_real_int(a);
}

static inline struct motion_real ease_half(struct motion_real a)
{
    return motion_real_half(a);
}

static inline struct motion_real ease_pi_2(void)
{
    /* pi/2 * 2^62 */
    return motion_real_from_q(INT64_C(7244019458077122842), 62);
}

/* From the track's end to `to_q32`. */
void ease_displacement_init(struct ease_displacement *displacement,
                            const struct motion_track *track, int64_t to_q32);

/* Append a ramp, a line of `middle`, and a ramp in reverse.  The times must not
 * all be zero and not be more than 2^60 together. */
int ease_append(struct motion_track *track,
                const struct ease_displacement *displacement,
                const struct ease_ramp *in, int64_t middle,
                const struct ease_ramp *out);

/* A new last piece of the shape, with the finest frac for values up to
 * `largest`. */
struct ease_piece *ease_piece_add(struct ease_shape *shape, int64_t dur,
                                  int degree, struct motion_real largest);

/* value * 2^frac to nearest; sets *rc to MOTION_E_RANGE, and leaves it alone
 * otherwise, beyond 2^62, so that the sums of the mirror image fit. */
int64_t ease_round(const struct ease_piece *piece, struct motion_real value,
                   int *rc);

/* The pieces of a sine ramp from rest to `speed`, in a move of `length`. */
int ease_sine_pieces(struct ease_shape *shape, int64_t dur,
                     struct motion_real speed, struct motion_real length);

#endif
