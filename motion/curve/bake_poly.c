/* motion/curve/bake_poly.c - see bake_poly.h. */
#include "motion/curve/bake_poly.h"

#include <stddef.h>

#include "motion/core/err.h"
#include "motion/curve/spline_internal.h"

/* Of the powers alone. */
static void bake_horner(const struct motion_bake_poly *poly,
                        struct motion_real u, struct motion_real jet[3])
{
    jet[0] = jet[1] = jet[2] = motion_real_zero();
    for (int k = poly->degree; k >= 0; k--) {
        jet[2] = motion_real_add(motion_real_mul(jet[2], u), jet[1]);
        jet[1] = motion_real_add(motion_real_mul(jet[1], u), jet[0]);
        jet[0] = motion_real_add(motion_real_mul(jet[0], u), poly->c[k]);
    }
}

static void bake_quiet(struct motion_real jet[3],
                       const struct motion_real noise[2])
{
    for (int i = 0; i < 2; i++)
        if (motion_real_cmp(motion_real_abs(jet[i + 1]), noise[i]) <= 0)
            jet[i + 1] = motion_real_zero();
}

/* The chain rule; the second derivatives are halves. */
static void bake_chain(const struct motion_bake_poly_chain *chain,
                       struct motion_real u, struct motion_real jet[3])
{
    struct motion_real in[3], out[3];

    bake_horner(&chain->inner, u, in);
    bake_quiet(in, chain->inner_noise);
    bake_horner(&chain->outer, in[0], out);
    bake_quiet(out, chain->outer_noise);
    jet[0] = out[0];
    jet[1] = motion_real_mul(out[1], in[1]);
    jet[2] = motion_real_add(motion_real_mul(out[1], in[2]),
                             motion_real_mul(out[2], motion_real_sqr(in[1])));
}

/* p (relative to base), p', p'' / 2 at u, with respect to u. */
static void motion_bake_poly_jet(const struct motion_bake_poly *poly,
                                 struct motion_real u,
                                 struct motion_real jet[3])
{
    if (poly->chain != NULL)
        bake_chain(poly->chain, u, jet);
    else
        bake_horner(poly, u, jet);
}

/* Taylor's coefficients at u, by repeated synthetic division. */
static void bake_shift(struct motion_bake_poly *poly, struct motion_real u)
{
    for (int i = 0; i < poly->degree; i++)
        for (int k = poly->degree - 1; k >= i; k--)
            poly->c[k] =
                motion_real_add(poly->c[k], motion_real_mul(poly->c[k + 1], u));
}

void motion_bake_poly_part(const struct motion_bake_poly *poly,
                           struct motion_real from, struct motion_real to,
                           struct motion_bake_poly *part)
{
    const struct motion_real length = motion_real_sub(to, from);
    struct motion_real power = length;

    *part = *poly;
    bake_shift(part, from);
    for (int k = 1; k <= part->degree; k++) {
        part->c[k] = motion_real_mul(part->c[k], power);
        power = motion_real_mul(power, length);
    }
}

/* Of max|f''''''| on the middle half-widths around the middle of from .. to;
 * a hundredth on top for what rounds here. */
static struct motion_real bake_sixth(const struct motion_bake_poly *poly,
                                     struct motion_real from,
                                     struct motion_real to)
{
    const struct motion_real half = motion_real_half(motion_real_sub(to, from));
    struct motion_bake_poly local = *poly;
    struct motion_real sum = motion_real_zero();

    bake_shift(&local, motion_real_add(from, half));
    for (int k = local.degree; k >= 6; k--) {
        const int falling = k * (k - 1) * (k - 2) * (k - 3) * (k - 4) * (k - 5);
        sum =
            motion_real_add(motion_real_mul(sum, half),
                            curve_times(motion_real_abs(local.c[k]), falling));
    }
    return motion_real_div(curve_times(sum, 101), motion_real_int(100));
}

/* What the quintic over from .. to misses, p, v, a. */
static struct motion_bake_poly_tolerance
bake_residual(const struct motion_bake_poly *poly, struct motion_real from,
              struct motion_real to, struct motion_real dur)
{
    const struct motion_real h = motion_real_sub(to, from);
    const struct motion_real h2 = motion_real_sqr(h);
    const struct motion_real acc =
        motion_real_mul(bake_sixth(poly, from, to), motion_real_sqr(h2));
    const struct motion_real vel = motion_real_mul(acc, h);
    struct motion_bake_poly_tolerance residual;

    /* sqrt(5) / 30000 < 1 / 13416 */
    residual.pos =
        motion_real_div(motion_real_mul(acc, h2), motion_real_int(46080));
    residual.vel =
        motion_real_div(vel, motion_real_mul(dur, motion_real_int(13416)));
    residual.acc = motion_real_div(
        acc, motion_real_mul(motion_real_sqr(dur), motion_real_int(1920)));
    return residual;
}

static bool bake_fits(const struct motion_bake_poly_tolerance *residual,
                      const struct motion_bake_poly_tolerance *allowed)
{
    return motion_real_cmp(residual->pos, allowed->pos) <= 0 &&
           motion_real_cmp(residual->vel, allowed->vel) <= 0 &&
           motion_real_cmp(residual->acc, allowed->acc) <= 0;
}

struct motion_u128 spline_fixed(int64_t base_q32,
                                struct motion_real displacement)
{
    const struct motion_real size = motion_real_abs(displacement);
    const int32_t up = size.e + 96;
    struct motion_u128 wide = { 0, (uint64_t)size.m };

    if (up >= 0)
        wide = motion_fixed_shl_u128(wide, up > 127 ? 127 : (unsigned)up);
    else
        wide = motion_fixed_round_i128(wide, up < -127 ? 128 : (unsigned)-up);
    if (displacement.m < 0)
        wide = motion_fixed_neg_i128(wide);
    return motion_fixed_add_u128(wide,
                                 (struct motion_u128){ (uint64_t)base_q32, 0 });
}

struct motion_real spline_fixed_displacement(const struct motion_track *track,
                                             struct motion_u128 to)
{
    const struct motion_u128 from = { (uint64_t)track->end.pos_q32,
                                      track->end_frac };
    const struct motion_u128 displacement = motion_fixed_sub_u128(to, from);
    const struct motion_real size =
        motion_real_from_u128(motion_fixed_abs_i128(displacement), -96);

    return motion_fixed_is_neg_i128(displacement) ? motion_real_neg(size)
                                                  : size;
}

/* The piece from tick a to tick b. */
struct bake_piece {
    int64_t a, b;
    struct motion_real from, to; /* a/dur, b/dur */
};

static struct bake_piece bake_piece(int64_t a, int64_t b, int64_t dur)
{
    const struct motion_real whole = motion_real_int(dur);

    return (struct bake_piece){ a, b,
                                motion_real_div(motion_real_int(a), whole),
                                motion_real_div(motion_real_int(b), whole) };
}

static int bake_emit(struct motion_track *track, const struct bake_piece *piece,
                     const struct motion_bake_poly *poly,
                     struct motion_u128 end)
{
    const struct motion_real h = motion_real_sub(piece->to, piece->from);
    struct motion_real vel[2], acc[2], jet[2][3];
    struct spline_poly quintic;

    motion_bake_poly_jet(poly, piece->from, jet[0]);
    motion_bake_poly_jet(poly, piece->to, jet[1]);
    for (int i = 0; i < 2; i++) {
        vel[i] = jet[i][1];
        acc[i] = motion_real_twice(jet[i][2]);
    }
    quintic =
        spline_quintic(spline_fixed_displacement(track, end), h, vel, acc);
    return spline_emit(track, piece->b - piece->a, &quintic, (int64_t)end.hi,
                       end.lo);
}

static struct motion_u128 bake_end(const struct motion_bake_poly *poly,
                                   struct motion_real to)
{
    struct motion_real jet[3];

    motion_bake_poly_jet(poly, to, jet);
    return spline_fixed(poly->base_q32, jet[0]);
}

/* The longest piece from a that fits: of 1, 1/2, 1/4 .. of the whole, at a
 * multiple of its length. */
static struct bake_piece
bake_next(const struct motion_bake_poly *poly, int64_t dur, uint32_t at,
          const struct motion_bake_poly_tolerance *allowed, uint32_t *step,
          struct motion_bake_poly_tolerance *residual)
{
    const struct motion_real seconds = motion_real_div(
        motion_real_int(dur), motion_real_int(MOTION_FIXED_S_Q12));

    *step = MOTION_BAKE_POLY_PIECES;
    while (at % *step != 0)
        *step /= 2;
    for (;; *step /= 2) {
        int64_t a = 0, b = 0;
        (void)motion_fixed_muldiv(dur, at, MOTION_BAKE_POLY_PIECES, &a);
        (void)motion_fixed_muldiv(dur, at + *step, MOTION_BAKE_POLY_PIECES, &b);
        const struct bake_piece piece = bake_piece(a, b, dur);
        *residual = bake_residual(poly, piece.from, piece.to, seconds);
        if (*step == 1 || b - a < 2 || bake_fits(residual, allowed))
            return piece;
    }
}

static int bake_pieces(struct motion_track *track, int64_t dur,
                       const struct motion_bake_poly *poly,
                       const int64_t *end_q32,
                       const struct motion_bake_poly_tolerance *allowed,
                       struct motion_real *bound)
{
    const struct motion_real rounding = motion_real_make(1, -32);
    uint32_t step = 0;
    int rc = MOTION_OK;

    for (uint32_t at = 0; rc == MOTION_OK && at < MOTION_BAKE_POLY_PIECES;
         at += step) {
        struct motion_bake_poly_tolerance residual;
        const struct bake_piece piece =
            bake_next(poly, dur, at, allowed, &step, &residual);
        struct motion_u128 end;

        if (piece.b == piece.a)
            continue;
        end = bake_end(poly, piece.to);
        if (at + step == MOTION_BAKE_POLY_PIECES && end_q32)
            end = (struct motion_u128){ (uint64_t)*end_q32, 0 };
        rc = bake_emit(track, &piece, poly, end);
        if (bound)
            *bound = motion_real_max(*bound,
                                     motion_real_add(residual.pos, rounding));
    }
    return rc;
}

int motion_bake_poly_append(struct motion_track *track, int64_t dur_ns_q12,
                            const struct motion_bake_poly *poly,
                            const int64_t *end_q32,
                            const struct motion_bake_poly_tolerance *tolerance,
                            struct motion_real *bound)
{
    const struct motion_track before = *track;
    int rc;

    if (poly->degree < 1 || poly->degree > MOTION_BAKE_POLY_DEGREE ||
        dur_ns_q12 < 1 || dur_ns_q12 > MOTION_TRACK_SEGMENT_MAX_NS_Q12)
        return MOTION_E_ARG;
    rc = bake_pieces(track, dur_ns_q12, poly, end_q32, tolerance, bound);
    if (rc != MOTION_OK)
        *track = before;
    return rc;
}
