/* motion/curve/ease_shape.c - speed profiles to segments; see ease_internal.h.
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
 * Only the ramp from rest is computed; the ramp to rest is its mirror image,
 * and a displacement down is one up with other signs. */
#include "motion/curve/ease_internal.h"

#include "motion/core/err.h"

/* Coefficients are kept below 2^EASE_COEF_BITS where frac can do it. */
#define EASE_COEF_BITS 61
#define EASE_COEF_MAX  ((int64_t)1 << 62)

static struct motion_u128 ease_sub(struct motion_u128 a, struct motion_u128 b)
{
    return motion_fixed_sub_u128(a, b);
}

void ease_displacement_init(struct ease_displacement *displacement,
                            const struct motion_track *track, int64_t to_q32)
{
    const int64_t from_q32 = track->end.pos_q32;

    displacement->from =
        (struct motion_u128){ (uint64_t)from_q32, track->end_frac };
    displacement->to = (struct motion_u128){ (uint64_t)to_q32, 0 };
    displacement->down = to_q32 <= from_q32;
    displacement->length = motion_real_from_u128(
        displacement->down ? ease_sub(displacement->from, displacement->to)
                           : ease_sub(displacement->to, displacement->from),
        -64);
}

struct ease_piece *ease_piece_add(struct ease_shape *shape, int64_t dur,
                                  int degree, struct motion_real largest)
{
    struct ease_piece *piece = &shape->piece[shape->count++];
    int32_t frac = EASE_COEF_BITS - 62 - largest.e;

    frac = frac < 0 ? 0 : frac > 31 ? 31 : frac;
    *piece = (struct ease_piece){ .dur = dur,
                                  .degree = degree,
                                  .frac = (unsigned)frac };
    return piece;
}

int64_t ease_round(const struct ease_piece *piece, struct motion_real value,
                   int *rc)
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
    const struct motion_real displacement =
        motion_real_mul(speed, ease_whole(dur));
    struct ease_piece *piece;
    int rc = MOTION_OK;

    if (dur == 0)
        return MOTION_OK;
    piece = ease_piece_add(shape, dur, 1, displacement);
    piece->coef[0] = ease_round(piece, displacement, &rc);
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
    const struct motion_real sixth = motion_real_div(bend, ease_whole(6));
    const struct motion_real displacement = motion_real_mul(*speed, time);
    struct ease_piece *piece;
    int rc = MOTION_OK;

    if (dur == 0)
        return MOTION_OK;
    *speed =
        motion_real_add(*speed, from_zero || to_zero ? ease_half(gain) : gain);
    piece = ease_piece_add(shape, dur, from_zero || to_zero ? 3 : 2,
                           motion_real_mul(*speed, time));
    piece->coef[0] = ease_round(piece, displacement, &rc);
    if (!from_zero)
        piece->coef[1] = ease_round(piece, ease_half(bend), &rc);
    if (from_zero || to_zero)
        piece->coef[2] = ease_round(piece, sixth, &rc);
    if (to_zero)
        piece->coef[2] = -piece->coef[2];
    return rc;
}

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

/* Where a change of the displacement changes the velocity least: degree/duration. */
static uint32_t ease_softest(const struct ease_shape *shape)
{
    uint32_t softest = 0;

    for (uint32_t i = 1; i < shape->count; i++)
        if (shape->piece[i].dur / shape->piece[i].degree >
            shape->piece[softest].dur / shape->piece[softest].degree)
            softest = i;
    return softest;
}

/* The displacement of a piece, to the last bit of its coefficients. */
static struct motion_u128
ease_piece_displacement(const struct ease_piece *piece, bool down)
{
    int64_t sum = 0;
    struct motion_u128 displacement;

    for (int k = 0; k < piece->degree; k++)
        sum += piece->coef[k];
    displacement = motion_fixed_shl_u128(
        motion_fixed_from_i64(down ? -sum : sum), 64 - piece->frac);
    return displacement;
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
                     const struct ease_displacement *displacement)
{
    const struct motion_track before = *track;
    const uint32_t softest = ease_softest(shape);
    struct motion_u128 end[MOTION_EASE_SEGMENTS + 1];
    struct motion_u128 at = displacement->from;

    for (uint32_t i = 0; i < softest; i++) {
        at = motion_fixed_add_u128(
            at, ease_piece_displacement(&shape->piece[i], displacement->down));
        end[i] = at;
    }
    at = displacement->to;
    for (uint32_t i = shape->count; i > softest; i--) {
        end[i - 1] = at;
        at = ease_sub(at, ease_piece_displacement(&shape->piece[i - 1],
                                                  displacement->down));
    }
    for (uint32_t i = 0; i < shape->count; i++) {
        int rc = ease_emit_piece(track, &shape->piece[i], displacement->down,
                                 end[i]);
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

int ease_append(struct motion_track *track,
                const struct ease_displacement *displacement,
                const struct ease_ramp *in, int64_t middle,
                const struct ease_ramp *out)
{
    struct ease_shape shape = { .count = 0 };
    const struct motion_real reach = motion_real_add(
        motion_real_add(ease_ramp_reach(in), ease_whole(middle)),
        ease_ramp_reach(out));
    const struct motion_real speed =
        motion_real_div(displacement->length, reach);
    uint32_t first_out;
    int rc;

    rc = ease_ramp_pieces(&shape, in, speed, displacement->length);
    if (rc == MOTION_OK)
        rc = ease_line(&shape, middle, speed);
    first_out = shape.count;
    if (rc == MOTION_OK)
        rc = ease_ramp_pieces(&shape, out, speed, displacement->length);
    if (rc != MOTION_OK)
        return rc;
    ease_mirror(&shape, first_out);
    return ease_emit(track, &shape, displacement);
}
