/* motion/curve/time_warp.c - see time_warp.h. */
#include "motion/curve/time_warp.h"

#include <stdbool.h>

#include "motion/core/err.h"
#include "motion/core/track_internal.h"
#include "motion/curve/bake_poly.h"
#include "motion/curve/spline_internal.h"

#define WARP_DEGREE MOTION_TRACK_DEGREE
#define WARP_STEPS  60 /* of halving: u to 2^-60 */
/* What rounding may leave of a time, 2^-32 ms: 15 ps.  Where w comes to rest its
 * derivative has a double root, which rounding parts in two or takes away; what
 * would be cut off there is a piece so short that no acceleration can be read
 * from its ends.  At 1 unit/s 15 ps are 2^-36 unit. */
#define WARP_NOISE 64
/* So short a piece is joined to the one before or behind it where that is the
 * same position: coefficients to 2^-57 of a unit are no jerk to rely on in less,
 * and a jerk of 10^4 unit/s3 goes 2^-32 unit in 5 us. */
#define WARP_SHORT_NS_Q12 (INT64_C(5000) << 12)

/* 1 ms is 2^32 or 10^6 * 2^12: t * 2^20 / 10^6 = t * 2^14 / 5^6. */
int64_t motion_time_warp_ms(int64_t t_ns_q12)
{
    int64_t ms_q32 = 0;

    if (motion_fixed_muldiv(t_ns_q12, 1 << 14, 15625, &ms_q32))
        return t_ns_q12 < 0 ? INT64_MIN : INT64_MAX;
    return ms_q32;
}

/* 2^-32 ms to 2^-12 ns. */
static int64_t warp_ticks(int64_t ms_q32)
{
    int64_t t = 0;

    (void)motion_fixed_muldiv(ms_q32, 15625, 1 << 14, &t);
    return t;
}

/* A segment's polynomial, relative to its pos: coef[k] is of (u/2)^k. */
static struct motion_bake_poly warp_poly(const struct motion_segment *segment)
{
    struct motion_bake_poly poly = { .base_q32 = segment->pos_q32,
                                     .degree = WARP_DEGREE };

    for (int k = 0; k <= WARP_DEGREE; k++)
        poly.c[k] =
            motion_real_from_q(segment->coef[k], 32 + segment->frac + k);
    return poly;
}

static struct motion_real warp_value(const struct motion_real *c, int degree,
                                     struct motion_real u)
{
    struct motion_real sum = motion_real_zero();

    for (int k = degree; k >= 0; k--)
        sum = motion_real_add(motion_real_mul(sum, u), c[k]);
    return sum;
}

/* --- monotone parts ----------------------------------------------------------
 *
 * Between the roots of the derivative a polynomial is monotone and has one root
 * at most, which halving finds: from the highest derivative down. */
struct warp_roots {
    int count;
    struct motion_real u[WARP_DEGREE + 2]; /* with 0 and 1 */
};

/* Where the sign of c changes between a and b: a root, if there is one. */
static bool warp_halve(const struct motion_real *c, int degree,
                       struct motion_real a, struct motion_real b,
                       struct motion_real *root)
{
    const int sign = motion_real_sign(warp_value(c, degree, a));

    if (sign * motion_real_sign(warp_value(c, degree, b)) >= 0)
        return false;
    for (int i = 0; i < WARP_STEPS; i++) {
        const struct motion_real m = motion_real_half(motion_real_add(a, b));
        if (motion_real_sign(warp_value(c, degree, m)) == sign)
            a = m;
        else
            b = m;
    }
    *root = b;
    return true;
}

/* Roots of the n-th derivative, between those of the one above. */
static struct warp_roots warp_roots(const struct motion_bake_poly *poly, int n)
{
    struct warp_roots above = { 2, { motion_real_zero(), motion_real_int(1) } };

    for (int order = WARP_DEGREE - 1; order >= n; order--) {
        struct motion_real c[WARP_DEGREE + 1];
        struct warp_roots roots = { 1, { motion_real_zero() } };
        const int degree = WARP_DEGREE - order;

        for (int k = 0; k <= degree; k++) {
            int falling = 1;
            for (int i = 0; i < order; i++)
                falling *= k + order - i;
            c[k] = curve_times(poly->c[k + order], falling);
        }
        for (int i = 0; i + 1 < above.count; i++)
            if (warp_halve(c, degree, above.u[i], above.u[i + 1],
                           &roots.u[roots.count]))
                roots.count++;
        roots.u[roots.count++] = motion_real_int(1);
        above = roots;
    }
    return above;
}

/* --- pieces ------------------------------------------------------------------- */

struct warp {
    struct motion_track *out;
    const struct motion_track *f, *w;
    struct motion_bake_poly_tolerance tolerance;
    struct motion_real *bound;
    /* the segment of w, and how far it has been appended */
    const struct motion_segment *segment;
    struct motion_bake_poly poly;
    int64_t done;
};

/* sum <- sum * by + add, polynomials both; by's degree is 5. */
static void warp_multiply(struct motion_bake_poly *sum,
                          const struct motion_real *by, struct motion_real add)
{
    struct motion_real product[MOTION_BAKE_POLY_DEGREE + 1];
    const int degree = sum->degree + WARP_DEGREE;

    for (int k = 0; k <= degree; k++) {
        product[k] = motion_real_zero();
        for (int i = k > WARP_DEGREE ? k - WARP_DEGREE : 0;
             i <= k && i <= sum->degree; i++)
            product[k] = motion_real_add(product[k],
                                         motion_real_mul(sum->c[i], by[k - i]));
    }
    for (int k = 0; k <= degree; k++)
        sum->c[k] = product[k];
    sum->c[0] = motion_real_add(sum->c[0], add);
    sum->degree = degree;
}

/* From a time of f to one in 2^-32 ms, in ms and to the last digit: an odd tick
 * is no whole 2^-32 ms, and half of one at 1e4 unit/s2 is 5 steps of velocity.
 *     ms - t 2^14 / 5^6, both times 5^6 in 128 bits */
static struct motion_real warp_ahead(int64_t t_ns_q12, int64_t ms_q32)
{
    const struct motion_u128 ms =
        motion_fixed_mul_i128(motion_fixed_from_i64(ms_q32), 15625);
    const struct motion_u128 t =
        motion_fixed_shl_u128(motion_fixed_from_i64(t_ns_q12), 14);
    const struct motion_u128 ahead = motion_fixed_sub_u128(ms, t);
    const struct motion_real size = motion_real_div(
        motion_real_from_u128(motion_fixed_abs_i128(ahead), -32),
        motion_real_int(15625));

    return motion_fixed_is_neg_i128(ahead) ? motion_real_neg(size) : size;
}

/* ms to ticks of 2^-12 ns, per duration of f's segment. */
static struct motion_real warp_rate(const struct motion_segment *f)
{
    return motion_real_div(motion_real_int(INT64_C(1000000) << 12),
                           motion_real_int(f->dur_ns_q12));
}

/* Time of f in units of its segment, for the part a .. b of w's. */
static struct motion_bake_poly warp_inner(const struct warp *warp, int64_t a,
                                          int64_t b,
                                          const struct motion_segment *f)
{
    const struct motion_real dur = motion_real_int(warp->segment->dur_ns_q12);
    const struct motion_real rate = warp_rate(f);
    struct motion_bake_poly part;

    motion_bake_poly_part(&warp->poly, motion_real_div(motion_real_int(a), dur),
                          motion_real_div(motion_real_int(b), dur), &part);
    part.c[0] =
        motion_real_add(part.c[0], warp_ahead(f->start_ns_q12, part.base_q32));
    for (int k = 0; k <= part.degree; k++)
        part.c[k] = motion_real_mul(part.c[k], rate);
    return part;
}

/* Powers that are there only as zeros. */
static void warp_trim(struct motion_bake_poly *poly)
{
    while (poly->degree > 1 && motion_real_is_zero(poly->c[poly->degree]))
        poly->degree--;
}

/* What rounding leaves at most in the first and half the second derivative of a
 * segment, by u: 9 and 16 steps of 2^-(32 + frac) (motion/plan/check.c). */
static void warp_noise(const struct motion_segment *segment,
                       struct motion_real noise[2])
{
    noise[0] = motion_real_make(9, -32 - segment->frac);
    noise[1] = motion_real_make(16, -32 - segment->frac);
}

static struct motion_bake_poly_chain
warp_chain(const struct warp *warp, int64_t to, const struct motion_segment *f)
{
    const struct motion_real part =
        motion_real_div(motion_real_int(to - warp->done),
                        motion_real_int(warp->segment->dur_ns_q12));
    const struct motion_real scale = motion_real_mul(part, warp_rate(f));
    struct motion_bake_poly_chain chain = {
        .inner = warp_inner(warp, warp->done, to, f),
        .outer = warp_poly(f),
    };

    warp_noise(f, chain.outer_noise);
    warp_noise(warp->segment, chain.inner_noise);
    chain.inner_noise[0] = motion_real_mul(chain.inner_noise[0], scale);
    chain.inner_noise[1] =
        motion_real_mul(chain.inner_noise[1], motion_real_mul(scale, part));
    return chain;
}

static bool warp_is_near(int64_t a_ms_q32, int64_t b_ms_q32)
{
    return a_ms_q32 - b_ms_q32 <= WARP_NOISE &&
           b_ms_q32 - a_ms_q32 <= WARP_NOISE;
}

/* Where a segment of w ends at a border of f the position is that border's, to
 * the bit. */
static const int64_t *warp_end(const struct warp *warp, int64_t to,
                               const struct motion_segment *f,
                               struct motion_state *border)
{
    const int64_t end_ns_q12 = f->start_ns_q12 + f->dur_ns_q12;
    struct motion_state at;

    motion_segment_state(warp->segment, to, &at);
    if (to < warp->segment->dur_ns_q12 ||
        !warp_is_near(at.pos_q32, motion_time_warp_ms(end_ns_q12)))
        return NULL;
    motion_segment_state(f, f->dur_ns_q12, border);
    return &border->pos_q32;
}

/* Append from where it is done to `to`, within segment f of f. */
static int warp_piece(struct warp *warp, int64_t to,
                      const struct motion_segment *f)
{
    struct motion_bake_poly_chain chain;
    struct motion_bake_poly sum;
    struct motion_state border;
    int rc;

    if (to <= warp->done)
        return MOTION_OK;
    chain = warp_chain(warp, to, f);
    sum = (struct motion_bake_poly){ .base_q32 = chain.outer.base_q32,
                                     .c = { chain.outer.c[WARP_DEGREE] },
                                     .chain = &chain };
    for (int k = WARP_DEGREE - 1; k >= 0; k--)
        warp_multiply(&sum, chain.inner.c, chain.outer.c[k]);
    warp_trim(&sum);
    rc = motion_bake_poly_append(warp->out, to - warp->done, &sum,
                                 warp_end(warp, to, f, &border),
                                 &warp->tolerance, warp->bound);
    warp->done = to;
    return rc;
}

/* u of w's segment to its ticks. */
static int64_t warp_at(const struct warp *warp, struct motion_real u)
{
    int64_t t = 0;

    (void)motion_real_round(
        motion_real_mul(u, motion_real_int(warp->segment->dur_ns_q12)), 0, &t);
    return t;
}

/* Where w, monotone from a to b, is at the time of f's border, in ticks. */
static int64_t warp_crossing(const struct warp *warp, struct motion_real a,
                             struct motion_real b, int64_t border_ns_q12)
{
    struct motion_real c[WARP_DEGREE + 1], u = b;

    for (int k = 0; k <= WARP_DEGREE; k++)
        c[k] = warp->poly.c[k];
    c[0] = motion_real_add(
        c[0], spline_displacement(motion_time_warp_ms(border_ns_q12),
                                  warp->poly.base_q32));
    (void)warp_halve(c, WARP_DEGREE, a, b, &u);
    return warp_at(warp, u);
}

/* Time of f where w's segment is at u; INT64_MIN when it is too far off. */
static int64_t warp_time(const struct warp *warp, struct motion_real u)
{
    const struct motion_real displacement =
        warp_value(warp->poly.c, WARP_DEGREE, u);
    int64_t ms_q32 = 0;

    if (motion_real_round(displacement, 32, &ms_q32) ||
        motion_fixed_add(ms_q32, warp->poly.base_q32, &ms_q32) ||
        ms_q32 > motion_time_warp_ms(warp->f->end_ns_q12))
        return INT64_MIN;
    return warp_ticks(ms_q32);
}

static uint32_t warp_find(const struct motion_track *f, int64_t t)
{
    if (t < 0)
        return 0;
    return t >= f->end_ns_q12 ? f->count - 1 : track_find(f, t);
}

/* Position of the polynomial of a segment at a time beside it. */
static struct motion_real warp_beside(const struct motion_segment *f,
                                      struct motion_real ms, int64_t base_q32)
{
    const struct motion_bake_poly poly = warp_poly(f);
    const struct motion_real u = motion_real_mul(
        motion_real_add(ms, warp_ahead(f->start_ns_q12, 0)), warp_rate(f));

    return motion_real_add(warp_value(poly.c, WARP_DEGREE, u),
                           spline_displacement(base_q32, poly.base_q32));
}

/* Does the border between s and next make no difference from there to where w is
 * at u? */
static bool warp_joins(const struct warp *warp, const struct motion_segment *s,
                       const struct motion_segment *next, struct motion_real u)
{
    const struct motion_real ms =
        motion_real_add(motion_real_from_q(warp->poly.base_q32, 32),
                        warp_value(warp->poly.c, WARP_DEGREE, u));
    const struct motion_real apart = motion_real_sub(
        warp_beside(s, ms, s->pos_q32), warp_beside(next, ms, s->pos_q32));

    return motion_real_lt(motion_real_abs(apart), motion_real_make(1, -32));
}

/* Is the border, which w comes to at `crossing`, so near to where w is at u that
 * it is not passed? */
static bool warp_skips(const struct warp *warp, uint32_t i, bool back,
                       int64_t crossing, struct motion_real u)
{
    const struct motion_segment *s = &warp->f->segment[i];
    const int64_t apart = crossing - warp_at(warp, u);

    return apart <= WARP_SHORT_NS_Q12 && -apart <= WARP_SHORT_NS_Q12 &&
           warp_joins(warp, s, back ? s - 1 : s + 1, u);
}

/* From u = a to b, where w is monotone: through every segment of f between; a
 * border that is where w begins or ends is not passed. */
static int warp_monotone(struct warp *warp, struct motion_real a,
                         struct motion_real b)
{
    const struct motion_track *f = warp->f;
    const int64_t from = warp_time(warp, a), to = warp_time(warp, b);
    const bool back = to < from;
    uint32_t i, last;
    int rc = MOTION_OK;

    /* a crest may be rounded to just outside */
    if (from < -1 || to < -1 || from > f->end_ns_q12 + 1 ||
        to > f->end_ns_q12 + 1)
        return MOTION_E_RANGE;
    i = warp_find(f, from);
    last = warp_find(f, to);
    while (rc == MOTION_OK && i != last) {
        const struct motion_segment *s = &f->segment[i];
        const int64_t border =
            back ? s->start_ns_q12 : s->start_ns_q12 + s->dur_ns_q12;
        const int64_t border_ms = motion_time_warp_ms(border);
        if (warp_is_near(border_ms, motion_time_warp_ms(to)))
            break;
        /* where w begins there is no crossing to be found */
        if (!warp_is_near(border_ms, motion_time_warp_ms(from))) {
            const int64_t crossing = warp_crossing(warp, a, b, border);
            if (warp_skips(warp, i, back, crossing, b))
                break;
            if (!warp_skips(warp, i, back, crossing, a))
                rc = warp_piece(warp, crossing, s);
        }
        i += back ? UINT32_MAX : 1;
    }
    if (rc == MOTION_OK)
        rc = warp_piece(warp, warp_at(warp, b), &f->segment[i]);
    return rc;
}

/* Does w move between two roots of its derivative? */
static bool warp_moves(const struct warp *warp, struct motion_real a,
                       struct motion_real b)
{
    const struct motion_real travel =
        motion_real_sub(warp_value(warp->poly.c, WARP_DEGREE, b),
                        warp_value(warp->poly.c, WARP_DEGREE, a));

    return motion_real_lt(motion_real_make(WARP_NOISE, -32),
                          motion_real_abs(travel));
}

/* Without the roots between which it does not. */
static void warp_turns(const struct warp *warp, struct warp_roots *turn)
{
    const struct motion_real one = motion_real_int(1);
    int count = 1;

    for (int i = 1; i + 1 < turn->count; i++)
        if (warp_moves(warp, turn->u[count - 1], turn->u[i]) &&
            warp_moves(warp, turn->u[i], one))
            turn->u[count++] = turn->u[i];
    turn->u[count++] = one;
    turn->count = count;
}

static int warp_segment(struct warp *warp, const struct motion_segment *segment)
{
    struct warp_roots turn;
    int rc = MOTION_OK;

    warp->segment = segment;
    warp->poly = warp_poly(segment);
    warp->done = 0;
    turn = warp_roots(&warp->poly, 1);
    warp_turns(warp, &turn);
    for (int i = 0; rc == MOTION_OK && i + 1 < turn.count; i++)
        rc = warp_monotone(warp, turn.u[i], turn.u[i + 1]);
    return rc;
}

/* --- all of it ------------------------------------------------------------------ */

/* Sizes that p, v, a reach somewhere: at the borders and middles of w. */
static struct motion_bake_poly_tolerance
warp_sizes(const struct motion_track *f, const struct motion_track *w)
{
    const struct motion_real none = motion_real_zero();
    struct motion_bake_poly_tolerance size = { none, none, none };

    for (uint32_t i = 0; i < w->count; i++)
        for (int n = 0; n < 4; n++) {
            const struct motion_segment *s = &w->segment[i];
            struct motion_state state;
            motion_time_warp_state(
                f, w, s->start_ns_q12 + s->dur_ns_q12 / 4 * n, &state);
            size.pos = motion_real_max(
                size.pos, motion_real_abs(spline_displacement(
                              f->segment[0].pos_q32, state.pos_q32)));
            size.vel = motion_real_max(
                size.vel,
                motion_real_abs(motion_real_from_q(state.vel_q32, 32)));
            size.acc = motion_real_max(
                size.acc,
                motion_real_abs(motion_real_from_q(state.acc_q32, 32)));
        }
    return size;
}

static struct motion_bake_poly_tolerance
warp_tolerance(const struct motion_track *f, const struct motion_track *w)
{
    struct motion_bake_poly_tolerance size = warp_sizes(f, w);

    size.pos =
        motion_real_add(motion_real_div(size.pos, motion_real_int(10000000000)),
                        motion_real_make(1, -33));
    size.vel =
        motion_real_add(motion_real_div(size.vel, motion_real_int(100000000)),
                        motion_real_make(1, -32));
    size.acc =
        motion_real_add(motion_real_div(size.acc, motion_real_int(10000000)),
                        motion_real_make(1, -32));
    return size;
}

int motion_time_warp_append(struct motion_track *out,
                            const struct motion_track *f,
                            const struct motion_track *w,
                            struct motion_real *bound)
{
    const struct motion_track before = *out;
    struct warp warp = { .out = out, .f = f, .w = w, .bound = bound };
    struct motion_state start;
    int rc = MOTION_OK;

    if (f->count == 0 || w->count == 0)
        return MOTION_E_EMPTY;
    motion_time_warp_state(f, w, 0, &start);
    if (start.pos_q32 - out->end.pos_q32 > 1 ||
        out->end.pos_q32 - start.pos_q32 > 1)
        return MOTION_E_ARG;
    if (bound)
        *bound = motion_real_make(1, -32);
    warp.tolerance = warp_tolerance(f, w);
    for (uint32_t i = 0; rc == MOTION_OK && i < w->count; i++)
        rc = warp_segment(&warp, &w->segment[i]);
    if (rc != MOTION_OK)
        *out = before;
    return rc;
}

static int64_t warp_saturate(struct motion_real a)
{
    int64_t result;

    if (motion_real_round(a, 32, &result))
        return a.m < 0 ? INT64_MIN : INT64_MAX;
    return result;
}

void motion_time_warp_state(const struct motion_track *f,
                            const struct motion_track *w, int64_t t_ns_q12,
                            struct motion_state *state)
{
    const struct motion_real k = motion_real_int(1000); /* ms in a second */
    struct motion_state at, in;
    struct motion_real v, a, j, w1, w2, w3, jerk;

    motion_track_state(w, t_ns_q12, &at);
    motion_track_state(f, warp_ticks(at.pos_q32), &in);
    v = motion_real_from_q(in.vel_q32, 32);
    a = motion_real_from_q(in.acc_q32, 32);
    j = motion_real_from_q(in.jerk_q32, 32);
    w1 = motion_real_div(motion_real_from_q(at.vel_q32, 32), k);
    w2 = motion_real_div(motion_real_from_q(at.acc_q32, 32), k);
    w3 = motion_real_div(motion_real_from_q(at.jerk_q32, 32), k);
    jerk = motion_real_mul(j, motion_real_mul(w1, motion_real_sqr(w1)));
    jerk = motion_real_add(
        jerk, curve_times(motion_real_mul(a, motion_real_mul(w1, w2)), 3));
    jerk = motion_real_add(jerk, motion_real_mul(v, w3));
    state->pos_q32 = in.pos_q32;
    state->vel_q32 = warp_saturate(motion_real_mul(v, w1));
    state->acc_q32 = warp_saturate(motion_real_add(
        motion_real_mul(a, motion_real_sqr(w1)), motion_real_mul(v, w2)));
    state->jerk_q32 = warp_saturate(jerk);
}
