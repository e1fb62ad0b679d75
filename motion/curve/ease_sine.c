/* motion/curve/ease_sine.c - the sine ramp, baked; see ease_internal.h. */
#include "motion/curve/ease_internal.h"

#include "motion/core/err.h"

#define EASE_SINE_PIECES_MIN 9
#define EASE_SINE_PIECES_MAX 13
#define EASE_QUARTER_Q62     ((int64_t)1 << 62)

/* Number of pieces for a sine ramp of height `reach` in a move of `length`.
 *
 * The quintic with p, v, a right at both ends of h misses f by
 *     f h^6 / 6! * (u (1-u))^3  <=  max|f| h^6 / 46080
 * (Hermite's remainder; (1/4)^3 / 720), in f' by max|f| h^5 sqrt(5)/30000
 * and in f'' by max|f| h^4 / 1920 (Birkhoff & Priver 1967).  For
 * f = A (1 - cos(pi x/2)) and h = 1/n, with b = pi/2/n, these are
 *     p: A b^6 / 46080                             13 pieces: 6.8e-11 A
 *     v: b^5 sqrt(5)/30000 of the peak A pi/2       9 pieces: 1.3e-8
 *     a: b^4/1920 of the peak A (pi/2)^2            9 pieces: 4.9e-7
 * so position chooses and nine is the fewest. */
static int ease_sine_count(struct motion_real reach, struct motion_real length)
{
    /* (pi/2)^6 / 46080 rounded up */
    const struct motion_real constant =
        motion_real_from_q(INT64_C(6013488908255226), 64);
    const struct motion_real bound = motion_real_mul(reach, constant);
    const struct motion_real allowed = motion_real_add(
        ease_whole(1), motion_real_div(length, ease_whole(10000000000)));
    int n = EASE_SINE_PIECES_MIN;

    while (n < EASE_SINE_PIECES_MAX &&
           motion_real_cmp(
               bound, motion_real_mul(allowed, ease_whole((int64_t)n * n * n *
                                                          n * n * n))) > 0)
        n++;
    return n;
}

/* Rounding may leave the sine of zero, or the cosine of a quarter turn, a few
 * units below zero. */
static struct motion_real ease_q62(int64_t a_q62)
{
    return motion_real_from_q(a_q62 < 0 ? 0 : a_q62, 62);
}

static struct motion_real ease_sin(int64_t phase_q62)
{
    int64_t sin_q62, cos_q62;

    motion_fixed_sincos_q62((uint64_t)phase_q62, &sin_q62, &cos_q62);
    return ease_q62(sin_q62);
}

static struct motion_real ease_cos(int64_t phase_q62)
{
    int64_t sin_q62, cos_q62;

    motion_fixed_sincos_q62((uint64_t)phase_q62, &sin_q62, &cos_q62);
    return ease_q62(cos_q62);
}

/* A sine ramp: speed V sin(pi/2 t/dur), height 2 V dur/pi. */
struct ease_sine {
    int64_t dur;
    struct motion_real speed, height;
};

/* A border between two pieces: t after the start, phase and height there. */
struct ease_border {
    int64_t t, phase_q62;
    struct motion_real height;
};

/* 1 - cos x = 2 sin(x/2)^2 does not cancel.  The last border is the ramp's
 * height itself, so that the pieces add up to it whatever sines round. */
static struct ease_border ease_border(const struct ease_sine *sine, int i,
                                      int n)
{
    struct ease_border border;
    struct motion_real half;

    /* dur <= 2^60 and i <= 13: below 2^64 */
    border.t = (int64_t)((uint64_t)sine->dur * (uint64_t)i / (uint64_t)n);
    (void)motion_fixed_muldiv(border.t, EASE_QUARTER_Q62, sine->dur,
                              &border.phase_q62);
    half = ease_sin(border.phase_q62 / 2);
    border.height = motion_real_mul(sine->height, motion_real_mul(half, half));
    border.height = motion_real_twice(border.height);
    if (i == n)
        border.height = sine->height;
    return border;
}

/* The quintic is solved from p, v, a at its ends in integers of the piece, so
 * the derivatives at its end miss theirs by one rounding, not by the rounding
 * of five coefficients.  The sums may pass 2^63 on the way, so they are taken
 * modulo 2^64; what comes out is small. */
static int ease_sine_piece(struct ease_shape *shape,
                           const struct ease_sine *sine,
                           const struct ease_border *a,
                           const struct ease_border *b)
{
    const struct motion_real dur = ease_whole(b->t - a->t);
    const struct motion_real full = motion_real_mul(sine->speed, dur);
    const struct motion_real bend = motion_real_mul(
        full, ease_half(motion_real_div(motion_real_mul(ease_pi_2(), dur),
                                        ease_whole(sine->dur))));
    struct ease_piece *piece = ease_piece_add(shape, b->t - a->t, 5, full);
    const struct motion_real want[5] = {
        motion_real_sub(b->height, a->height),
        motion_real_mul(full, ease_sin(a->phase_q62)),
        motion_real_mul(full, ease_sin(b->phase_q62)),
        motion_real_mul(bend, ease_cos(a->phase_q62)),
        motion_real_mul(bend, ease_cos(b->phase_q62)),
    };
    uint64_t w[5]; /* d, v0, v1, a0/2, a1/2 */
    int rc = MOTION_OK;

    for (int i = 0; i < 5; i++)
        w[i] = (uint64_t)ease_round(piece, want[i], &rc);
    piece->coef[0] = (int64_t)w[1];
    piece->coef[1] = (int64_t)w[3];
    piece->coef[2] =
        (int64_t)(10 * w[0] - 6 * w[1] - 4 * w[2] - 3 * w[3] + w[4]);
    piece->coef[3] =
        (int64_t)(8 * w[1] + 7 * w[2] + 3 * w[3] - 2 * w[4] - 15 * w[0]);
    piece->coef[4] = (int64_t)(6 * w[0] - 3 * w[1] - 3 * w[2] - w[3] + w[4]);
    return rc;
}

int ease_sine_pieces(struct ease_shape *shape, int64_t dur,
                     struct motion_real speed, struct motion_real length)
{
    const struct ease_sine sine = {
        dur, speed,
        motion_real_div(motion_real_mul(speed, ease_whole(dur)), ease_pi_2())
    };
    const int n = ease_sine_count(sine.height, length);
    struct ease_border a = { 0, 0, motion_real_zero() };

    for (int i = 1; i <= n; i++) {
        const struct ease_border b = ease_border(&sine, i, n);
        int rc = MOTION_OK;

        if (b.t > a.t)
            rc = ease_sine_piece(shape, &sine, &a, &b);
        if (rc != MOTION_OK)
            return rc;
        a = b;
    }
    return MOTION_OK;
}
