/* motion/curve/fcurve_append.c - a curve as a track.  See fcurve.h.
 *
 * The range is cut where the formula changes: at keys, at the ends of laps, at
 * breaks of easing equations.  Each piece is one polynomial, found from its
 * value and derivatives at both ends, or is baked. */
#include "motion/curve/fcurve.h"

#include <stddef.h>

#include "motion/core/err.h"
#include "motion/core/fixed.h"
#include "motion/curve/fcurve_internal.h"

struct fcurve_append {
    struct motion_track *track;
    const struct motion_fcurve *curve;
    const struct motion_fcurve_range *range;
    struct motion_fcurve_report *report;
};

/* --- cuts ----------------------------------------------------------------- */

static void fcurve_cut(int64_t cut, int64_t from, int64_t *to)
{
    if (cut > from && cut < *to)
        *to = cut;
}

/* A time between the keys, in a lap. */
static int64_t fcurve_in_lap(const struct motion_fcurve *curve,
                             const struct fcurve_lap *lap, int64_t local)
{
    const int64_t first = curve->key[0].at.t_ns_q12;
    const int64_t last = curve->key[curve->count - 1].at.t_ns_q12;
    const int64_t start = first + lap->number * (last - first);

    return start + (lap->back ? last - local : local - first);
}

static void fcurve_cut_span(const struct motion_fcurve *curve,
                            const struct fcurve_lap *lap,
                            const struct motion_fcurve_key *key, int64_t from,
                            int64_t *to)
{
    const int64_t start = key->at.t_ns_q12, dur = key[1].at.t_ns_q12 - start;
    int64_t at[FCURVE_BREAKS_MAX];
    int n = 0;

    fcurve_cut(fcurve_in_lap(curve, lap, start), from, to);
    fcurve_cut(fcurve_in_lap(curve, lap, start + dur), from, to);
    if (key->interpolation >= MOTION_FCURVE_SINE &&
        key->interpolation <= MOTION_FCURVE_ELASTIC)
        n = fcurve_ease_breaks(
            key, fcurve_difference(key[1].at.pos_q32, key->at.pos_q32, 32), dur,
            at);
    for (int i = 0; i < n; i++)
        fcurve_cut(fcurve_in_lap(curve, lap, start + at[i]), from, to);
}

/* From where the piece starts, *key is its span and *to its end. */
static void fcurve_next(const struct fcurve_append *append, int64_t from,
                        struct fcurve_piece *piece)
{
    const struct motion_fcurve *curve = append->curve;
    const int64_t first = curve->key[0].at.t_ns_q12;
    const int64_t last = curve->key[curve->count - 1].at.t_ns_q12;
    struct fcurve_lap lap;

    *piece = (struct fcurve_piece){ .curve = curve, .from = from };
    piece->to = append->range->to_ns_q12;
    if (curve->count > 1 &&
        fcurve_place(curve, from, MOTION_FCURVE_RIGHT, &lap)) {
        const uint32_t at = fcurve_find(curve, lap.t, lap.back);

        piece->key = &curve->key[at];
        piece->first = lap.back ? at + 1 : at;
        piece->last = lap.back ? at : at + 1;
        piece->is_back = lap.back;
        piece->span = fcurve_in_lap(curve, &lap,
                                    piece->key[lap.back ? 1 : 0].at.t_ns_q12);
        fcurve_cut_span(curve, &lap, piece->key, from, &piece->to);
    } else if (from < first) {
        /* further out than all laps, so these do not overflow */
        const int64_t laps =
            curve->before.mode == MOTION_FCURVE_ONCE ? 0 : curve->before.count;
        fcurve_cut(first - laps * (last - first), from, &piece->to);
    } else {
        piece->first = piece->last = curve->count - 1;
    }
}

/* --- a polynomial --------------------------------------------------------- */

static bool fcurve_is_third(int64_t handle, int64_t dur)
{
    const int64_t off = handle - dur / 3;
    return off >= -1 && off <= 1;
}

static bool fcurve_is_point(const struct motion_fcurve_point *handle,
                            const struct motion_fcurve_key *key)
{
    return handle->t_ns_q12 == key->at.t_ns_q12 &&
           handle->pos_q32 == key->at.pos_q32;
}

static bool fcurve_is_level(const struct motion_fcurve_key *a)
{
    const struct motion_fcurve_key *b = a + 1;

    return a->at.pos_q32 == b->at.pos_q32 &&
           a->right.pos_q32 == a->at.pos_q32 &&
           b->left.pos_q32 == b->at.pos_q32;
}

/* Both handles at a third: x(u) is linear.  Both without length: x and y are
 * the same cubic of u, so y is linear in x.  All at one height: y stays. */
static int fcurve_bezier_degree(const struct motion_fcurve_key *a)
{
    const struct motion_fcurve_key *b = a + 1;
    const int64_t dur = b->at.t_ns_q12 - a->at.t_ns_q12;

    if (fcurve_is_level(a) ||
        (fcurve_is_point(&a->right, a) && fcurve_is_point(&b->left, b)))
        return 1;
    return fcurve_is_third(a->right.t_ns_q12 - a->at.t_ns_q12, dur) &&
                   fcurve_is_third(b->at.t_ns_q12 - b->left.t_ns_q12, dur)
               ? 3
               : 0;
}

/* 0: not a polynomial of time. */
static int fcurve_degree(const struct fcurve_piece *piece)
{
    static const uint8_t degree[] = {
        [MOTION_FCURVE_CONSTANT] = 1, [MOTION_FCURVE_LINEAR] = 1,
        [MOTION_FCURVE_QUAD] = 2,     [MOTION_FCURVE_CUBIC] = 3,
        [MOTION_FCURVE_QUART] = 4,    [MOTION_FCURVE_QUINT] = 5,
        [MOTION_FCURVE_BACK] = 3,     [MOTION_FCURVE_BOUNCE] = 2,
        [MOTION_FCURVE_ELASTIC] = 0,
    };

    if (!piece->key)
        return 1;
    return piece->key->interpolation == MOTION_FCURVE_BEZIER
               ? fcurve_bezier_degree(piece->key)
               : degree[piece->key->interpolation];
}

/* k0 a + k1 b + .. */
static struct motion_real fcurve_sum(const struct motion_real term[5],
                                     const int8_t factor[5])
{
    struct motion_real sum = motion_real_zero();

    for (int i = 0; i < 5; i++)
        sum = motion_real_add(sum, curve_times(term[i], factor[i]));
    return sum;
}

/* The quintic of u with the piece's ends, from rise, velocities times T and
 * accelerations times T^2/2; of lower degree when they are. */
static void fcurve_coefficients(const struct fcurve_piece *piece,
                                struct motion_real coef[MOTION_TRACK_DEGREE])
{
    static const int8_t factor[MOTION_TRACK_DEGREE][5] = {
        { 0, 1, 0, 0, 0 },
        { 0, 0, 0, 1, 0 },
        { 10, -6, -4, -3, 1 },
        { -15, 8, 7, 3, -2 },
        { 6, -3, -3, -1, 1 }
    };
    const struct motion_real dur = motion_bake_seconds(piece->to - piece->from);
    const struct motion_real half = motion_real_half(motion_real_sqr(dur));
    const struct motion_real term[5] = {
        motion_real_sub(piece->end.pos, piece->start.pos),
        motion_real_mul(piece->start.vel, dur),
        motion_real_mul(piece->end.vel, dur),
        motion_real_mul(piece->start.acc, half),
        motion_real_mul(piece->end.acc, half),
    };

    for (int k = 0; k < MOTION_TRACK_DEGREE; k++)
        coef[k] = fcurve_sum(term, factor[k]);
}

/* The finest step in which all coefficients stay under 2^62. */
static int fcurve_frac(const struct motion_real coef[], int degree)
{
    int frac = 31;

    for (int k = 0; k < degree; k++)
        if (!motion_real_is_zero(coef[k]) && -coef[k].e - 32 < frac)
            frac = -coef[k].e - 32;
    return frac < 0 ? 0 : frac;
}

/* What of a position is below 2^-32 is left out, and comes back in the next
 * piece, which starts where this one ends. */
static int fcurve_append_poly(struct fcurve_append *append,
                              const struct fcurve_piece *piece, int degree)
{
    struct motion_real coef[MOTION_TRACK_DEGREE];
    int64_t whole[MOTION_TRACK_DEGREE], end;
    int frac, rc = motion_real_round(piece->shown, 32, &end);

    fcurve_coefficients(piece, coef);
    frac = fcurve_frac(coef, degree);
    for (int k = 0; k < degree && rc == MOTION_OK; k++)
        rc = motion_real_round(coef[k], 32 + frac, &whole[k]);
    if (rc != MOTION_OK)
        return rc;
    return motion_track_append_poly(append->track, piece->to - piece->from,
                                    degree, whole, (unsigned)frac, end, 0);
}

/* --- a baked piece -------------------------------------------------------- */

void fcurve_add_residual(const struct fcurve_piece *piece, int64_t t,
                         struct motion_bake_point *point)
{
    const struct motion_real slant =
        motion_real_sub(piece->residual[1], piece->residual[0]);
    const struct motion_real dur = fcurve_whole(piece->to - piece->from);

    point->pos = motion_real_add(point->pos, piece->residual[0]);
    if (motion_real_is_zero(slant))
        return;
    const struct motion_real past =
        motion_real_div(fcurve_whole(t - piece->from), dur);
    point->pos = motion_real_add(point->pos, motion_real_mul(past, slant));
    point->vel = motion_real_add(
        point->vel,
        motion_real_div(curve_times(slant, MOTION_FIXED_S_Q12), dur));
}

static int fcurve_source(void *context, int64_t t, enum motion_bake_side side,
                         struct motion_bake_point point[])
{
    const struct fcurve_piece *piece = context;
    struct motion_fcurve_value value;
    int rc = motion_fcurve_at(piece->curve, t,
                              side == MOTION_BAKE_LEFT ? MOTION_FCURVE_LEFT
                                                       : MOTION_FCURVE_RIGHT,
                              &value);

    if (rc != MOTION_OK)
        return rc;
    if (value.steep)
        return MOTION_E_SINGULAR;
    *point = (struct motion_bake_point){ value.pos, value.vel, value.acc };
    fcurve_add_residual(piece, t, point);
    return MOTION_OK;
}

static void fcurve_note(struct fcurve_append *append,
                        const struct fcurve_piece *piece,
                        const struct motion_bake_bound *bound)
{
    struct motion_bake_bound *worst = &append->report->bound;
    const struct motion_real slant = motion_real_abs(
        motion_real_sub(piece->residual[1], piece->residual[0]));
    const struct motion_real residual =
        motion_real_max(motion_real_abs(piece->residual[0]),
                        motion_real_abs(piece->residual[1]));
    const struct motion_real dur = motion_bake_seconds(piece->to - piece->from);

    worst->pos =
        motion_real_max(worst->pos, motion_real_add(bound->pos, residual));
    worst->vel = motion_real_max(
        worst->vel, motion_real_add(bound->vel, motion_real_div(slant, dur)));
    worst->acc = motion_real_max(worst->acc, bound->acc);
}

/* Measured, whatever it is. */
static int fcurve_append_measured(struct fcurve_append *append,
                                  struct fcurve_piece *piece)
{
    const int64_t border[2] = { piece->from, piece->to };
    const struct motion_bake job = {
        .source = { fcurve_source, piece },
        .axes = 1,
        .border_ns_q12 = border,
        .borders = 2,
        .pos = append->range->within.pos,
        .vel = append->range->within.vel,
        .acc = append->range->within.acc,
    };
    struct motion_track *track[1] = { append->track };
    struct motion_bake_report report;
    int rc = motion_bake(&job, track, &report);

    if (rc == MOTION_OK)
        fcurve_note(append, piece, &report.bound[0]);
    return rc;
}

static int fcurve_append_baked(struct fcurve_append *append,
                               struct fcurve_piece *piece)
{
    const struct motion_track before = *append->track;
    struct motion_bake_bound bound;
    int rc;

    if (piece->key->interpolation != MOTION_FCURVE_BEZIER)
        return fcurve_append_measured(append, piece);
    rc = fcurve_bezier_bake(append->track, piece, &append->range->within,
                            &bound);
    if (rc == MOTION_E_TOLERANCE) {
        *append->track = before;
        return fcurve_append_measured(append, piece);
    }
    if (rc == MOTION_OK)
        fcurve_note(append, piece, &bound);
    return rc;
}

/* --- pieces --------------------------------------------------------------- */

static struct motion_real fcurve_end(const struct motion_track *track)
{
    return motion_real_add(motion_real_from_q(track->end.pos_q32, 32),
                           motion_real_from_u64(track->end_frac, -96));
}

/* How far the limit misses what is shown there; MOTION_E_DISCONTINUITY where
 * that is a step, and not rounding, also of the time of a cut: `vel` is how fast the
 * curve is there. */
static int fcurve_residual(const struct fcurve_append *append,
                           const struct fcurve_piece *piece,
                           struct motion_real shown, struct motion_real limit,
                           struct motion_real vel, struct motion_real *residual)
{
    const struct motion_real ticks =
        fcurve_over(motion_real_abs(vel), MOTION_FIXED_S_Q12 / 4);
    struct motion_real allowed =
        motion_real_max(motion_real_scale(fcurve_whole(1), -30),
                        motion_real_scale(motion_real_abs(shown), -50));

    allowed = motion_real_max(allowed, ticks);
    if (piece->key && piece->key->interpolation == MOTION_FCURVE_ELASTIC)
        allowed = motion_real_max(allowed, append->range->step);
    *residual = motion_real_sub(shown, limit);
    return motion_real_cmp(motion_real_abs(*residual), allowed) <= 0
               ? MOTION_OK
               : MOTION_E_DISCONTINUITY;
}

/* What the track shows at the start must be the curve's limit there. */
static int fcurve_measure_start(struct fcurve_append *append,
                                struct fcurve_piece *piece)
{
    int rc = motion_fcurve_at(piece->curve, piece->from, MOTION_FCURVE_RIGHT,
                              &piece->start);

    append->report->failed = piece->first;
    if (rc != MOTION_OK)
        return rc;
    return fcurve_residual(append, piece, fcurve_end(append->track),
                           piece->start.pos, piece->start.vel,
                           &piece->residual[0]);
}

/* And what the curve shows at the end, the key's value. */
static int fcurve_measure_end(struct fcurve_append *append,
                              struct fcurve_piece *piece)
{
    struct motion_fcurve_value shown;
    int rc = motion_fcurve_at(piece->curve, piece->to, MOTION_FCURVE_LEFT,
                              &piece->end);

    append->report->failed = piece->last;
    if (rc == MOTION_OK)
        rc =
            motion_fcurve_at(piece->curve, piece->to, MOTION_FCURVE_AT, &shown);
    if (rc != MOTION_OK)
        return rc;
    piece->shown = shown.pos;
    return fcurve_residual(append, piece, shown.pos, piece->end.pos,
                           motion_real_max(motion_real_abs(shown.vel),
                                           motion_real_abs(piece->end.vel)),
                           &piece->residual[1]);
}

static int fcurve_append_piece(struct fcurve_append *append,
                               struct fcurve_piece *piece)
{
    int degree, rc = fcurve_measure_start(append, piece);

    if (rc == MOTION_OK)
        rc = fcurve_measure_end(append, piece);
    if (rc != MOTION_OK)
        return rc;
    append->report->failed =
        piece->start.steep || !piece->end.steep ? piece->first : piece->last;
    if (piece->start.steep || piece->end.steep)
        return MOTION_E_SINGULAR;
    degree = fcurve_degree(piece);
    return degree > 0 ? fcurve_append_poly(append, piece, degree)
                      : fcurve_append_baked(append, piece);
}

static int fcurve_check_range(const struct fcurve_append *append)
{
    const struct motion_fcurve_range *range = append->range;
    struct motion_fcurve_value at;
    struct motion_real off;
    int rc;

    if (range->from_ns_q12 >= range->to_ns_q12 || range->within.pos.m <= 0)
        return MOTION_E_ARG;
    rc = motion_fcurve_at(append->curve, range->from_ns_q12, MOTION_FCURVE_AT,
                          &at);
    if (rc != MOTION_OK)
        return rc;
    off = motion_real_sub(fcurve_end(append->track), at.pos);
    return motion_real_cmp(motion_real_abs(off),
                           motion_real_scale(fcurve_whole(1), -30)) <= 0
               ? MOTION_OK
               : MOTION_E_ARG;
}

int motion_fcurve_append(struct motion_track *track,
                         const struct motion_fcurve *curve,
                         const struct motion_fcurve_range *range,
                         struct motion_fcurve_report *report)
{
    const struct motion_track before = *track;
    struct motion_fcurve_report unused;
    struct fcurve_append append = { track, curve, range,
                                    report ? report : &unused };
    struct fcurve_piece piece;
    int rc;

    *append.report = (struct motion_fcurve_report){
        .bound = { motion_real_zero(), motion_real_zero(), motion_real_zero() }
    };
    rc = fcurve_check_range(&append);
    for (int64_t t = range->from_ns_q12;
         rc == MOTION_OK && t < range->to_ns_q12; t = piece.to) {
        fcurve_next(&append, t, &piece);
        rc = fcurve_append_piece(&append, &piece);
    }
    if (rc != MOTION_OK)
        *track = before;
    else
        append.report->failed = 0;
    append.report->segments = track->count - before.count;
    return rc;
}
