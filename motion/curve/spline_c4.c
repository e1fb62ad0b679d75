/* motion/curve/spline_c4.c - quintic splines with continuous fourth derivative;
 * see spline.h.
 *
 * Unknown are velocity and acceleration (v, a) at every key where two pieces
 * meet; p''' and p'''' of both pieces must agree there: two equations that hold
 * the unknowns of three neighbours, so elimination goes through the keys with
 * 2 x 2 blocks, linear in time and space.  On a span of D units, T seconds
 *     p'''(0)  = ( 60 D - 36 T v0 - 24 T v1 -  9 T^2 a0 +  3 T^2 a1) / T^3
 *     p''''(0) = (-360 D + 192 T v0 + 168 T v1 + 36 T^2 a0 - 24 T^2 a1) / T^4
 * and at its end the same with the ends exchanged, D negated, and for p'''
 * the sign; seen from the end, time runs backwards, which is T < 0.
 *
 * Not-a-knot: the first three spans are one polynomial.  Seen from its far end,
 *     p = p3 + v s + a s^2 / 2 + s^3 (c3 + c4 s + c5 s^2)
 * and c3, c4, c5 follow from the three keys behind, linear in v and a. */
#include "motion/core/err.h"
#include "motion/curve/spline_internal.h"

#define C4_MACRO 3 /* spans in an end piece without knots */

/* sums[0] + sums[1] v + sums[2] a, of the key; and sums[3] v' + sums[4] a', of
 * the neighbour. */
struct c4_sum {
    struct motion_real of[5];
};

/* What one piece says at the key it is seen from: p''' and p''''. */
struct c4_side {
    struct c4_sum third, fourth;
};

static struct motion_real c4_power(struct motion_real a, int n)
{
    struct motion_real product = motion_real_int(1);

    for (; n > 0; n--)
        product = motion_real_mul(product, a);
    return product;
}

/* A span seen from `here`; `there` is the neighbour before or after. */
static struct c4_side c4_span_side(const struct motion_key *here,
                                   const struct motion_key *there)
{
    static const int16_t weight[2][5] = { { 60, -36, -9, -24, 3 },
                                          { -360, 192, 36, 168, -24 } };
    static const int8_t power[5] = { 0, 1, 2, 1, 2 };
    const bool back = there < here;
    const struct motion_real size = spline_span(back ? there : here);
    const struct motion_real dur = back ? motion_real_neg(size) : size;
    struct c4_side side;

    for (int n = 0; n < 5; n++) {
        side.third.of[n] = motion_real_div(motion_real_int(weight[0][n]),
                                           c4_power(dur, 3 - power[n]));
        side.fourth.of[n] = motion_real_div(motion_real_int(weight[1][n]),
                                            c4_power(dur, 4 - power[n]));
    }
    const struct motion_real displacement =
        spline_displacement(here->pos_q32, there->pos_q32);
    side.third.of[0] = motion_real_mul(side.third.of[0], displacement);
    side.fourth.of[0] = motion_real_mul(side.fourth.of[0], displacement);
    return side;
}

/* --- an end piece ------------------------------------------------------------ */

/* c3, c4, c5, each linear in v and a of the key it is seen from. */
struct c4_macro {
    struct motion_real s[C4_MACRO];
    struct motion_real c[3][3]; /* [power - 3][1, v, a] */
};

/* here to there, seconds, signed. */
static struct motion_real c4_time(const struct motion_key *here,
                                  const struct motion_key *there)
{
    struct motion_key pair[2] = { *here, *there };

    if (there > here)
        return spline_span(pair);
    pair[0] = *there;
    pair[1] = *here;
    return motion_real_neg(spline_span(pair));
}

/* The parabola g through (s_j, g_j), by divided differences. */
static void c4_parabola(const struct motion_real s[3],
                        const struct motion_real g[3], struct motion_real c[3])
{
    const struct motion_real d01 = motion_real_div(motion_real_sub(g[1], g[0]),
                                                   motion_real_sub(s[1], s[0]));
    const struct motion_real d12 = motion_real_div(motion_real_sub(g[2], g[1]),
                                                   motion_real_sub(s[2], s[1]));

    c[2] =
        motion_real_div(motion_real_sub(d12, d01), motion_real_sub(s[2], s[0]));
    c[1] = motion_real_sub(d01,
                           motion_real_mul(c[2], motion_real_add(s[0], s[1])));
    c[0] = motion_real_sub(motion_real_sub(g[0], motion_real_mul(c[1], s[0])),
                           motion_real_mul(c[2], motion_real_sqr(s[0])));
}

/* The three keys in direction `step` from `here`. */
static struct c4_macro c4_macro(const struct motion_key *here, int step)
{
    struct c4_macro macro;
    struct motion_real g[3][C4_MACRO], c[3];

    for (int j = 0; j < C4_MACRO; j++) {
        const struct motion_key *there = here + (int64_t)(j + 1) * step;
        const struct motion_real s = c4_time(here, there);

        macro.s[j] = s;
        g[0][j] = motion_real_div(
            spline_displacement(here->pos_q32, there->pos_q32), c4_power(s, 3));
        g[1][j] = motion_real_div(motion_real_int(-1), motion_real_sqr(s));
        g[2][j] = motion_real_half(motion_real_div(motion_real_int(-1), s));
    }
    for (int n = 0; n < 3; n++) {
        c4_parabola(macro.s, g[n], c);
        for (int k = 0; k < 3; k++)
            macro.c[k][n] = c[k];
    }
    return macro;
}

static struct c4_side c4_macro_side(const struct motion_key *here, int step)
{
    const struct c4_macro macro = c4_macro(here, step);
    struct c4_side side;

    for (int n = 0; n < 5; n++)
        side.third.of[n] = side.fourth.of[n] = motion_real_zero();
    for (int n = 0; n < 3; n++) {
        side.third.of[n] = curve_times(macro.c[0][n], 6);
        side.fourth.of[n] = curve_times(macro.c[1][n], 24);
    }
    return side;
}

/* v and a at the keys inside and at the end of the piece. */
static void c4_macro_fill(struct motion_key *here, int step)
{
    const struct c4_macro macro = c4_macro(here, step);
    struct motion_real c[6] = { motion_real_zero(), here->vel,
                                motion_real_half(here->acc) };

    for (int k = 0; k < 3; k++)
        c[3 + k] = motion_real_add(
            macro.c[k][0],
            motion_real_add(motion_real_mul(macro.c[k][1], here->vel),
                            motion_real_mul(macro.c[k][2], here->acc)));
    for (int j = 0; j < C4_MACRO; j++) {
        struct motion_key *there = here + (int64_t)(j + 1) * step;
        there->vel = there->acc = motion_real_zero();
        for (int k = 5; k >= 1; k--) {
            there->acc = motion_real_mul(there->acc, macro.s[j]);
            there->vel = motion_real_mul(there->vel, macro.s[j]);
            there->vel = motion_real_add(there->vel, curve_times(c[k], k));
            if (k >= 2)
                there->acc = motion_real_add(
                    there->acc, curve_times(c[k], (int64_t)k * (k - 1)));
        }
        /* the acceleration has one power less: its last step was one too
         * many */
        there->acc = motion_real_div(there->acc, macro.s[j]);
    }
}

/* --- blocks ------------------------------------------------------------------ */

/* Two equations: low of the key before, diag of the key, up of the one
 * after. */
struct c4_row {
    struct motion_real low[2][2], diag[2][2], up[2][2], rhs[2];
};

static void c4_join(struct c4_row *row, int i, const struct c4_sum *left,
                    const struct c4_sum *right)
{
    row->rhs[i] = motion_real_sub(right->of[0], left->of[0]);
    for (int n = 0; n < 2; n++) {
        row->diag[i][n] = motion_real_sub(left->of[1 + n], right->of[1 + n]);
        row->low[i][n] = left->of[3 + n];
        row->up[i][n] = motion_real_neg(right->of[3 + n]);
    }
}

/* Equation i says that unknown n is known. */
static void c4_known(struct c4_row *row, int i, int n, struct motion_real value)
{
    for (int k = 0; k < 2; k++) {
        row->low[i][k] = row->up[i][k] = motion_real_zero();
        row->diag[i][k] = k == n ? motion_real_int(1) : motion_real_zero();
    }
    row->rhs[i] = spline_read(value);
}

/* The pieces between keys `from` and `to`: the knots of the curve. */
struct c4_range {
    uint32_t from, to;
    bool free_first, free_last; /* an end piece of three spans follows */
};

/* A given value takes the place of an equation, the fourth derivative's first.
 */
static struct c4_row c4_row(const struct motion_key *key,
                            const struct c4_range *range, uint32_t i)
{
    const bool first = i == range->from && !range->free_first;
    const bool last = i == range->to && !range->free_last;
    struct c4_side left, right;
    struct c4_row row;

    if (first || last || (key[i].has_vel && key[i].has_acc)) {
        c4_known(&row, 0, 0, key[i].has_vel ? key[i].vel : motion_real_zero());
        c4_known(&row, 1, 1, key[i].has_acc ? key[i].acc : motion_real_zero());
        return row;
    }
    left = i == range->from ? c4_macro_side(&key[i], -1)
                            : c4_span_side(&key[i], &key[i - 1]);
    right = i == range->to ? c4_macro_side(&key[i], 1)
                           : c4_span_side(&key[i], &key[i + 1]);
    c4_join(&row, 0, &left.third, &right.third);
    c4_join(&row, 1, &left.fourth, &right.fourth);
    if (key[i].has_vel)
        c4_known(&row, 1, 0, key[i].vel);
    if (key[i].has_acc)
        c4_known(&row, 1, 1, key[i].acc);
    return row;
}

static struct motion_real c4_dot(const struct motion_real a[2],
                                 struct motion_real x, struct motion_real y)
{
    return motion_real_add(motion_real_mul(a[0], x), motion_real_mul(a[1], y));
}

/* m x = y, by Cramer. */
static void c4_solve(const struct motion_real m[2][2], struct motion_real y0,
                     struct motion_real y1, struct motion_real *x0,
                     struct motion_real *x1)
{
    const struct motion_real det = motion_real_sub(
        motion_real_mul(m[0][0], m[1][1]), motion_real_mul(m[0][1], m[1][0]));

    *x0 = motion_real_div(motion_real_sub(motion_real_mul(y0, m[1][1]),
                                          motion_real_mul(m[0][1], y1)),
                          det);
    *x1 = motion_real_div(motion_real_sub(motion_real_mul(m[0][0], y1),
                                          motion_real_mul(m[1][0], y0)),
                          det);
}

/* slot[0 .. 3]: (v, a) of the key depend on (v, a) of the next by minus this
 * matrix, row by row; key: and on this constant. */
static void c4_eliminate(struct motion_key *key,
                         struct motion_spline_work *work, struct c4_row *row,
                         bool alone)
{
    for (int i = 0; i < 2 && !alone; i++) {
        const struct motion_real *above = work[-1].slot;
        for (int n = 0; n < 2; n++)
            row->diag[i][n] = motion_real_sub(
                row->diag[i][n], c4_dot(row->low[i], above[n], above[2 + n]));
        row->rhs[i] = motion_real_sub(
            row->rhs[i], c4_dot(row->low[i], key[-1].vel, key[-1].acc));
    }
    for (int n = 0; n < 2; n++)
        c4_solve(row->diag, row->up[0][n], row->up[1][n], &work->slot[n],
                 &work->slot[2 + n]);
    c4_solve(row->diag, row->rhs[0], row->rhs[1], &key->vel, &key->acc);
}

static void c4_back(struct motion_key *key,
                    const struct motion_spline_work *work)
{
    key->vel = motion_real_sub(key->vel,
                               c4_dot(&work->slot[0], key[1].vel, key[1].acc));
    key->acc = motion_real_sub(key->acc,
                               c4_dot(&work->slot[2], key[1].vel, key[1].acc));
}

/* --- few keys ---------------------------------------------------------------- */

/* Without a knot anywhere: the one polynomial through at most six keys, by
 * divided differences; its derivatives at every key. */
static void c4_whole(struct motion_key *key, uint32_t count)
{
    struct motion_real d[6];

    for (uint32_t i = 0; i < count; i++)
        d[i] = spline_displacement(key[0].pos_q32, key[i].pos_q32);
    for (uint32_t n = 1; n < count; n++)
        for (uint32_t i = count - 1; i >= n; i--)
            d[i] = motion_real_div(motion_real_sub(d[i], d[i - 1]),
                                   c4_time(&key[i - n], &key[i]));
    for (uint32_t i = 0; i < count; i++) {
        struct motion_real p = motion_real_zero(), v = p, half = p;
        for (uint32_t n = count; n-- > 0;) {
            const struct motion_real s =
                n == i ? motion_real_zero() : c4_time(&key[n], &key[i]);
            half = motion_real_add(motion_real_mul(half, s), v);
            v = motion_real_add(motion_real_mul(v, s), p);
            p = motion_real_add(motion_real_mul(p, s), d[n]);
        }
        key[i].vel = v;
        key[i].acc = motion_real_twice(half);
    }
}

static bool c4_is_free(const struct motion_key *key,
                       enum motion_spline_end rule)
{
    return rule == MOTION_SPLINE_NOT_A_KNOT && !key->has_vel && !key->has_acc;
}

static void c4_range_solve(struct motion_key *key, const struct c4_range *range,
                           struct motion_spline_work *work)
{
    for (uint32_t i = range->from; i <= range->to; i++) {
        struct c4_row row = c4_row(key, range, i);
        c4_eliminate(&key[i], &work[i], &row, i == range->from);
    }
    for (uint32_t i = range->to; i-- > range->from;)
        c4_back(&key[i], &work[i]);
    if (range->free_first)
        c4_macro_fill(&key[range->from], -1);
    if (range->free_last)
        c4_macro_fill(&key[range->to], 1);
}

static int c4_within(const struct motion_key *key, uint32_t count)
{
    for (uint32_t i = 0; i < count; i++)
        if (spline_within(key[i].acc, 47))
            return MOTION_E_RANGE;
    return spline_velocities_within(key, count);
}

int motion_spline_c4(struct motion_key *key, uint32_t count,
                     enum motion_spline_end first, enum motion_spline_end last,
                     struct motion_spline_work *work)
{
    struct c4_range range = { 0 };
    int rc = spline_order(key, count);

    if ((first != MOTION_SPLINE_REST && first != MOTION_SPLINE_NOT_A_KNOT) ||
        (last != MOTION_SPLINE_REST && last != MOTION_SPLINE_NOT_A_KNOT))
        return MOTION_E_ARG;
    if (rc != MOTION_OK)
        return rc;
    range.to = count - 1;
    range.free_first = c4_is_free(&key[0], first);
    range.free_last = c4_is_free(&key[count - 1], last);
    if (range.free_first && range.free_last && count <= 2 * C4_MACRO) {
        c4_whole(key, count);
        return c4_within(key, count);
    }
    if (count <= C4_MACRO && (range.free_first || range.free_last))
        return MOTION_E_ARG;
    range.from += range.free_first ? C4_MACRO : 0;
    range.to -= range.free_last ? C4_MACRO : 0;
    c4_range_solve(key, &range, work);
    return c4_within(key, count);
}
