/* motion/ease.c - see ease.h.
 *
 * Every law is a list of pieces, each a polynomial in u = t/T of its own
 * duration T with integer coefficients of 2^-(32 + frac) unit.  One number
 * scales them all, the speed V in the middle: V = distance / reach, where the
 * reach of a phase is the distance it covers at V = 1:
 *
 *     middle                    T
 *     ramp, constant acc        T/2
 *     ramp, sine                2T/pi
 *     ramp, jerk (up, hold, down), acceleration a = 2V / (up + 2 hold + down):
 *         a (up^2/6 + up hold/2 + hold^2/2 + (up/2 + hold) down + down^2/3)
 *
 * No reach but the sum is divided by, so k1 = 0, k2 = 1 and k1 = k2 need no
 * cases: the phase is not there.  With T from k1, k2 the sine's sum is the
 * normaliser f = 2 k1/pi + (k2 - k1) + 2 (1 - k2)/pi, times the duration.
 *
 * Only the ramp from rest is computed; the ramp to rest is its mirror image.
 * Lengths are counted in 2^-32 unit, times in 2^-12 ns, signs put on last. */
#include "motion/ease.h"

#include <stdbool.h>
#include <stddef.h>

#include "motion/err.h"
#include "motion/fixed.h"
#include "motion/real.h"

#define EASE_SINE_PIECES_MIN 9
#define EASE_SINE_PIECES_MAX 13
#define EASE_QUARTER_Q62     ((int64_t)1 << 62)
#define EASE_PI_2_Q62        UINT64_C(7244019458077122842) /* pi/2 * 2^62 */

#define EASE_SLACK_MAX ((int64_t)1 << 40) /* 0.27 s */

/* Shorter phases are rounding: 8 ps. */
#define EASE_PHASE_MIN 32

/* Coefficients are kept below 2^EASE_COEF_BITS where frac can do it. */
#define EASE_COEF_BITS 61
#define EASE_COEF_MAX  ((int64_t)1 << 62)

struct ease_piece {
    int64_t dur;
    int degree;
    unsigned frac;
    int64_t coef[MOTION_TRACK_DEGREE]; /* of u^1 .. u^degree */
};

/* The ramps and the middle that will be appended. */
struct ease_shape {
    struct ease_piece piece[MOTION_EASE_SEGMENTS];
    uint32_t count;
};

/* A signed way to go. */
struct ease_way {
    struct motion_u128 from, to; /* Q64.64, two's complement, in 2^-32 unit */
    struct motion_real length;
    bool down;
};

static struct motion_real ease_whole(int64_t a)
{
    return motion_real_from_u64((uint64_t)a, 0);
}

static struct motion_real ease_half(struct motion_real a)
{
    a.exponent--;
    return a;
}

static struct motion_real ease_pi_2(void)
{
    return motion_real_from_u64(EASE_PI_2_Q62, -62);
}

static struct motion_u128 ease_sub(struct motion_u128 a, struct motion_u128 b)
{
    return motion_fixed_sub_u128(a, b);
}

static void ease_way_init(struct ease_way *way,
                          const struct motion_track *track, int64_t to_q32)
{
    const int64_t from_q32 = track->end.pos_q32;

    way->from = (struct motion_u128){ (uint64_t)from_q32, track->end_frac };
    way->to = (struct motion_u128){ (uint64_t)to_q32, 0 };
    way->down = to_q32 <= from_q32;
    way->length = motion_real_from_u128(
        way->down ? ease_sub(way->from, way->to) : ease_sub(way->to, way->from),
        -64);
}

/* A new last piece with the finest frac for values up to `largest`. */
static struct ease_piece *ease_piece_add(struct ease_shape *shape, int64_t dur,
                                         int degree, struct motion_real largest)
{
    struct ease_piece *piece = &shape->piece[shape->count++];
    int32_t frac = EASE_COEF_BITS - 64 - largest.exponent;

    frac = frac < 0 ? 0 : frac > 31 ? 31 : frac;
    if (largest.mantissa == 0)
        frac = 31;
    *piece = (struct ease_piece){ .dur = dur,
                                  .degree = degree,
                                  .frac = (unsigned)frac };
    return piece;
}

/* Within 2^62, so that the sums of the mirror image fit. */
static int64_t ease_round(const struct ease_piece *piece,
                          struct motion_real value, int *rc)
{
    int64_t result = 0;

    if (motion_real_round(value, (int32_t)piece->frac, &result) ||
        result > EASE_COEF_MAX)
        *rc = MOTION_E_RANGE;
    return result;
}

static int ease_line(struct ease_shape *shape, int64_t dur,
                     struct motion_real speed)
{
    const struct motion_real way = motion_real_mul(speed, ease_whole(dur));
    struct ease_piece *piece;
    int rc = MOTION_OK;

    if (dur == 0)
        return MOTION_OK;
    piece = ease_piece_add(shape, dur, 1, way);
    piece->coef[0] = ease_round(piece, way, &rc);
    return rc;
}

/* Acceleration from `acc0` to `acc1`, one of them `acc` and the other that or
 * zero: p = v T u + a0 T^2/2 u^2 + (a1 - a0) T^2/6 u^3.  Adds to *speed. */
static int ease_push(struct ease_shape *shape, int64_t dur,
                     struct motion_real acc, bool from_zero, bool to_zero,
                     struct motion_real *speed)
{
    const struct motion_real time = ease_whole(dur);
    const struct motion_real gain = motion_real_mul(acc, time);
    const struct motion_real bend = motion_real_mul(gain, time);
    const struct motion_real sixth =
        motion_real_div(bend, motion_real_from_u64(6, 0));
    const struct motion_real way = motion_real_mul(*speed, time);
    struct ease_piece *piece;
    int rc = MOTION_OK;

    if (dur == 0)
        return MOTION_OK;
    *speed =
        motion_real_add(*speed, from_zero || to_zero ? ease_half(gain) : gain);
    piece = ease_piece_add(shape, dur, from_zero || to_zero ? 3 : 2,
                           motion_real_mul(*speed, time));
    piece->coef[0] = ease_round(piece, way, &rc);
    if (!from_zero)
        piece->coef[1] = ease_round(piece, ease_half(bend), &rc);
    if (from_zero || to_zero)
        piece->coef[2] = ease_round(piece, sixth, &rc);
    if (to_zero)
        piece->coef[2] = -piece->coef[2];
    return rc;
}

/* Ramp from rest: acceleration rises for `up`, stays, falls for `down`; or,
 * with `sine`, a quarter sine of speed over `hold`. */
struct ease_ramp {
    int64_t up, hold, down;
    bool sine;
};

static struct motion_real ease_product(int64_t a, int64_t b)
{
    return motion_real_mul(ease_whole(a), ease_whole(b));
}

/* up + 2 hold + down; twice the time that a is worth.  A ramp takes 2^60 at
 * most, so that no sum of eight such times overflows. */
static int64_t ease_ramp_weight(const struct ease_ramp *ramp)
{
    return ramp->up + 2 * ramp->hold + ramp->down;
}

/* The sum at the top of this file, times 6, over 3 (up + 2 hold + down):
 *   up (up + 3 hold + 3 down) + down (2 down + 6 hold) + 3 hold^2 */
static struct motion_real ease_ramp_reach(const struct ease_ramp *ramp)
{
    const int64_t up = ramp->up, hold = ramp->hold, down = ramp->down;
    struct motion_real sum = ease_product(up, up + 3 * hold + 3 * down);

    if (ease_ramp_weight(ramp) == 0)
        return ease_whole(0);
    if (ramp->sine)
        return motion_real_div(ease_whole(hold), ease_pi_2());
    sum = motion_real_add(sum, ease_product(down, 2 * down + 6 * hold));
    sum = motion_real_add(sum, ease_product(hold, 3 * hold));
    return motion_real_div(sum, ease_product(3, ease_ramp_weight(ramp)));
}

static int ease_jerk_pieces(struct ease_shape *shape,
                            const struct ease_ramp *ramp,
                            struct motion_real top_speed)
{
    struct motion_real acc, speed = ease_whole(0);
    int rc;

    acc = motion_real_div(motion_real_mul(top_speed, ease_whole(2)),
                          ease_whole(ease_ramp_weight(ramp)));
    rc = ease_push(shape, ramp->up, acc, true, false, &speed);
    if (rc == MOTION_OK)
        rc = ease_push(shape, ramp->hold, acc, false, false, &speed);
    if (rc == MOTION_OK)
        rc = ease_push(shape, ramp->down, acc, false, true, &speed);
    return rc;
}

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
        motion_real_from_u64(UINT64_C(6013488908255226), -64);
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
    return motion_real_from_u64(a_q62 < 0 ? 0 : (uint64_t)a_q62, -62);
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
    border.height.exponent++;
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

static int ease_sine_pieces(struct ease_shape *shape, int64_t dur,
                            struct motion_real speed, struct motion_real length)
{
    const struct ease_sine sine = {
        dur, speed,
        motion_real_div(motion_real_mul(speed, ease_whole(dur)), ease_pi_2())
    };
    const int n = ease_sine_count(sine.height, length);
    struct ease_border a = ease_border(&sine, 0, n);

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

/* q(u) = p(1) - p(1 - u): by the binomial theorem, in the same integers,
 *     q_k = -(-1)^k sum over j >= k of (j choose k) p_j */
static void ease_mirror_piece(struct ease_piece *piece)
{
    static const int8_t choose[MOTION_TRACK_DEGREE][MOTION_TRACK_DEGREE] = {
        { 1, 2, 3, 4, 5 }, { 0, 1, 3, 6, 10 }, { 0, 0, 1, 4, 10 },
        { 0, 0, 0, 1, 5 }, { 0, 0, 0, 0, 1 },
    };
    const struct ease_piece old = *piece;

    for (int k = 0; k < old.degree; k++) {
        int64_t sum = 0;
        for (int j = k; j < old.degree; j++)
            sum += choose[k][j] * old.coef[j];
        piece->coef[k] = k % 2 == 0 ? sum : -sum;
    }
}

/* The pieces from `first` on, which speed up from rest, now come to rest. */
static void ease_mirror(struct ease_shape *shape, uint32_t first)
{
    uint32_t i = first, k = shape->count;

    for (uint32_t m = first; m < shape->count; m++)
        ease_mirror_piece(&shape->piece[m]);
    for (; i + 1 < k; i++, k--) {
        const struct ease_piece swap = shape->piece[i];
        shape->piece[i] = shape->piece[k - 1];
        shape->piece[k - 1] = swap;
    }
}

/* Where a change of the way changes the velocity least: degree/duration. */
static uint32_t ease_softest(const struct ease_shape *shape)
{
    uint32_t softest = 0;

    for (uint32_t i = 1; i < shape->count; i++)
        if (shape->piece[i].dur / shape->piece[i].degree >
            shape->piece[softest].dur / shape->piece[softest].degree)
            softest = i;
    return softest;
}

/* The way a piece goes, to the last bit of its coefficients. */
static struct motion_u128 ease_piece_way(const struct ease_piece *piece,
                                         bool down)
{
    int64_t sum = 0;
    struct motion_u128 way;

    for (int k = 0; k < piece->degree; k++)
        sum += piece->coef[k];
    way = motion_fixed_shl_u128(motion_fixed_from_i64(down ? -sum : sum),
                                64 - piece->frac);
    return way;
}

static int ease_emit_piece(struct motion_track *track,
                           const struct ease_piece *piece, bool down,
                           struct motion_u128 end)
{
    int64_t coef[MOTION_TRACK_DEGREE];

    for (int k = 0; k < piece->degree; k++)
        coef[k] = down ? -piece->coef[k] : piece->coef[k];
    return motion_track_append_poly(track, piece->dur, piece->degree, coef,
                                    piece->frac, (int64_t)end.hi, end.lo);
}

/* Lay the pieces from the start forwards and from the target backwards; what
 * rounding leaves between is absorbed by the softest piece.  Starts and ends
 * to the bit. */
static int ease_emit(struct motion_track *track, const struct ease_shape *shape,
                     const struct ease_way *way)
{
    const struct motion_track before = *track;
    const uint32_t softest = ease_softest(shape);
    struct motion_u128 end[MOTION_EASE_SEGMENTS + 1];
    struct motion_u128 at = way->from;

    for (uint32_t i = 0; i < softest; i++) {
        at = motion_fixed_add_u128(at,
                                   ease_piece_way(&shape->piece[i], way->down));
        end[i] = at;
    }
    at = way->to;
    for (uint32_t i = shape->count; i > softest; i--) {
        end[i - 1] = at;
        at = ease_sub(at, ease_piece_way(&shape->piece[i - 1], way->down));
    }
    for (uint32_t i = 0; i < shape->count; i++) {
        int rc = ease_emit_piece(track, &shape->piece[i], way->down, end[i]);
        if (rc) {
            *track = before;
            return rc;
        }
    }
    return MOTION_OK;
}

static int ease_ramp_pieces(struct ease_shape *shape,
                            const struct ease_ramp *ramp,
                            struct motion_real speed, struct motion_real length)
{
    if (ease_ramp_weight(ramp) == 0)
        return MOTION_OK;
    if (ramp->sine)
        return ease_sine_pieces(shape, ramp->hold, speed, length);
    return ease_jerk_pieces(shape, ramp, speed);
}

static int ease_append(struct motion_track *track, const struct ease_way *way,
                       const struct ease_ramp *in, int64_t middle,
                       const struct ease_ramp *out)
{
    struct ease_shape shape = { .count = 0 };
    const struct motion_real reach = motion_real_add(
        motion_real_add(ease_ramp_reach(in), ease_whole(middle)),
        ease_ramp_reach(out));
    const struct motion_real speed = motion_real_div(way->length, reach);
    uint32_t first_out;
    int rc;

    rc = ease_ramp_pieces(&shape, in, speed, way->length);
    if (rc == MOTION_OK)
        rc = ease_line(&shape, middle, speed);
    first_out = shape.count;
    if (rc == MOTION_OK)
        rc = ease_ramp_pieces(&shape, out, speed, way->length);
    if (rc != MOTION_OK)
        return rc;
    ease_mirror(&shape, first_out);
    return ease_emit(track, &shape, way);
}

static struct ease_ramp ease_law_ramp(enum motion_ease_law law, int64_t dur)
{
    if (law == MOTION_EASE_SCURVE)
        return (struct ease_ramp){ .up = dur / 2, .down = dur - dur / 2 };
    return (struct ease_ramp){ .hold = dur, .sine = law == MOTION_EASE_SINE };
}

int motion_ease_append(struct motion_track *track, enum motion_ease_law law,
                       int64_t to_q32, int64_t dur_ns_q12, int64_t k1_q32,
                       int64_t k2_q32)
{
    struct ease_ramp in, out;
    struct ease_way way;
    int64_t k1, k2;

    if ((unsigned)law > MOTION_EASE_SCURVE || k1_q32 < 0 || k2_q32 < k1_q32 ||
        k2_q32 > MOTION_FIXED_ONE_Q32)
        return MOTION_E_ARG;
    if (dur_ns_q12 <= 0 || dur_ns_q12 > MOTION_TRACK_SEGMENT_MAX_NS_Q12)
        return MOTION_E_ARG;
    ease_way_init(&way, track, to_q32);
    if (way.length.mantissa == 0)
        return motion_track_append_dwell(track, dur_ns_q12);
    (void)motion_fixed_mulshift(dur_ns_q12, k1_q32, 32, &k1);
    (void)motion_fixed_mulshift(dur_ns_q12, k2_q32, 32, &k2);
    in = ease_law_ramp(law, k1);
    out = ease_law_ramp(law, dur_ns_q12 - k2);
    return ease_append(track, &way, &in, k2 - k1, &out);
}

/* The limited ease.
 *
 *   acc  |   ___                    ramp: jerk time, hold time, jerk time
 *        |  /   \                   with v = a (jerk + hold), a = j jerk
 *        | /     \_______           cruise at v
 *        |               \     /    and the mirror image
 *        |                \___/     length = v (2 jerk + hold + cruise)
 *
 * Which limits are reached follows from their order:
 *   v j >= a^2    acceleration is reached before speed:  jerk = a/j,
 *                 hold = v/a - jerk; else jerk = sqrt(v/j), hold = 0
 *   length >= v (2 jerk + hold)      speed is reached: cruise = length/v - ...
 *   length >= 2 a^3/j^2              only acceleration is: jerk = a/j and
 *                 length = a (jerk + hold)(2 jerk + hold), so
 *                 hold = (sqrt(jerk^2 + 4 length/a) - 3 jerk) / 2
 *   else          only jerk is: length = 2 j jerk^3
 * (Biagiotti & Melchiorri 3.4.)  Without a jerk limit jerk = 0 and the hold is
 * v/a or sqrt(length/a).  Longer phases mean less of v, a and j, each of them,
 * so phase times rounded up never break a limit. */
struct ease_times {
    struct motion_real jerk, hold, cruise;
};

/* The limits in 2^-32 unit and 2^-12 ns. */
struct ease_limits {
    struct motion_real vel, acc, jerk;
};

static struct ease_limits ease_limits(const struct motion_ease_limit *limit)
{
    const struct motion_real second = ease_whole(MOTION_FIXED_S_Q12);
    const struct motion_real second2 = motion_real_mul(second, second);
    const struct motion_real second3 = motion_real_mul(second2, second);

    return (struct ease_limits){
        motion_real_div(ease_whole(limit->vel_q32), second),
        motion_real_div(motion_real_from_u64((uint64_t)limit->acc_q16, 16),
                        second2),
        motion_real_div(motion_real_from_u64((uint64_t)limit->jerk_q16, 16),
                        second3),
    };
}

/* A phase that is, but for rounding, not there.  Leaving it out puts the speed
 * or the acceleration over its limit by as little; see
 * motion_ease_append_limited for what becomes of that. */
static bool ease_is_short(struct motion_real time)
{
    return motion_real_cmp(time, ease_whole(EASE_PHASE_MIN)) < 0;
}

/* Up to the speed limit and back; `cruise` is left to the caller. */
static struct ease_times ease_solve_long(const struct ease_limits *limit)
{
    const struct motion_real to_speed = motion_real_div(limit->vel, limit->acc);
    struct ease_times times = { .hold = to_speed };

    if (limit->jerk.mantissa == 0)
        return times;
    times.jerk = motion_real_div(limit->acc, limit->jerk);
    if (motion_real_cmp(to_speed, times.jerk) < 0)
        times.jerk = motion_real_sqrt(motion_real_div(limit->vel, limit->jerk));
    times.hold = motion_real_sub(to_speed, times.jerk);
    return times;
}

/* There and back to rest before the speed limit. */
static struct ease_times ease_solve_short(struct motion_real length,
                                          const struct ease_limits *limit)
{
    const struct motion_real length_acc = motion_real_div(length, limit->acc);
    struct ease_times times = { .jerk = { 0, 0 } };
    struct motion_real cube, root;

    if (limit->jerk.mantissa) {
        cube = ease_half(motion_real_div(length, limit->jerk));
        times.jerk = motion_real_div(limit->acc, limit->jerk);
        if (motion_real_cmp(motion_real_cbrt(cube), times.jerk) <= 0) {
            times.jerk = motion_real_cbrt(cube);
            return times;
        }
    }
    root = motion_real_sqrt(
        motion_real_add(motion_real_mul(times.jerk, times.jerk),
                        motion_real_mul(length_acc, ease_whole(4))));
    times.hold = ease_half(
        motion_real_sub(root, motion_real_mul(times.jerk, ease_whole(3))));
    return times;
}

static struct ease_times ease_solve(struct motion_real length,
                                    const struct ease_limits *limit)
{
    const struct motion_real whole = motion_real_div(length, limit->vel);
    struct ease_times times = ease_solve_long(limit);
    const struct motion_real ramp =
        motion_real_add(motion_real_add(times.jerk, times.jerk), times.hold);

    times.cruise = motion_real_sub(whole, ramp);
    if (ease_is_short(times.cruise))
        return ease_solve_short(length, limit);
    return times;
}

/* `slack` more than rounded up. */
static int ease_phase(struct motion_real time, int64_t slack, int64_t *dur)
{
    *dur = 0;
    if (time.mantissa == 0)
        return MOTION_OK;
    if (motion_real_ceil(time, 0, dur) ||
        *dur > MOTION_TRACK_SEGMENT_MAX_NS_Q12 - slack)
        return MOTION_E_RANGE;
    *dur += slack;
    return MOTION_OK;
}

static bool ease_over(const struct motion_segment *segment,
                      enum motion_quantity quantity, int64_t limit)
{
    struct motion_extreme extreme;

    motion_segment_extreme(segment, quantity, &extreme);
    return extreme.max > limit || extreme.min < -limit;
}

/* MOTION_E_LIMIT when a segment from `first` on is over a limit. */
static int ease_judge(const struct motion_track *track, uint32_t first,
                      const struct motion_ease_limit *limit)
{
    for (uint32_t i = first; i < track->count; i++) {
        const struct motion_segment *segment = &track->segment[i];
        if (ease_over(segment, MOTION_VEL, limit->vel_q32) ||
            ease_over(segment, MOTION_ACC, limit->acc_q16) ||
            (limit->jerk_q16 &&
             ease_over(segment, MOTION_JERK, limit->jerk_q16)))
            return MOTION_E_LIMIT;
    }
    return MOTION_OK;
}

static int ease_try(struct motion_track *track, const struct ease_way *way,
                    const struct ease_times *times, int64_t slack,
                    const struct motion_ease_limit *limit)
{
    const struct motion_track before = *track;
    struct ease_ramp ramp = { .sine = false };
    int64_t middle;
    int rc;

    if (ease_phase(times->jerk, slack, &ramp.up) ||
        ease_phase(times->hold, slack, &ramp.hold) ||
        ease_phase(times->cruise, slack, &middle))
        return MOTION_E_RANGE;
    if (4 * ramp.up + 2 * ramp.hold + middle > MOTION_TRACK_SEGMENT_MAX_NS_Q12)
        return MOTION_E_RANGE;
    ramp.down = ramp.up;
    rc = ease_append(track, way, &ramp, middle, &ramp);
    if (rc == MOTION_OK)
        rc = ease_judge(track, before.count, limit);
    if (rc != MOTION_OK)
        *track = before;
    return rc;
}

/* Coefficients are multiples of 2^-63 unit at the finest, so in a phase of T
 * the jerk is a multiple of 6 * 2^-63 / T^3: in a very short one that is coarse
 * and rounding may end above the limit.  Judge, and take a little longer, twice
 * as much each time; from microseconds up the first try fits. */
int motion_ease_append_limited(struct motion_track *track, int64_t to_q32,
                               const struct motion_ease_limit *limit)
{
    struct ease_limits limits;
    struct ease_times times;
    struct ease_way way;
    int rc = MOTION_E_LIMIT;

    if (limit->vel_q32 <= 0 || limit->acc_q16 <= 0 || limit->jerk_q16 < 0)
        return MOTION_E_ARG;
    ease_way_init(&way, track, to_q32);
    if (way.length.mantissa == 0)
        return MOTION_OK;
    limits = ease_limits(limit);
    times = ease_solve(way.length, &limits);
    if (limit->jerk_q16 && ease_is_short(times.hold))
        times.hold = ease_whole(0);
    rc = ease_try(track, &way, &times, 0, limit);
    for (int64_t slack = 1; rc == MOTION_E_LIMIT && slack <= EASE_SLACK_MAX;
         slack *= 2)
        rc = ease_try(track, &way, &times, slack, limit);
    return rc;
}
