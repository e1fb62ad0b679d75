/* motion/curve/spline_append.c - spans to segments; see spline_internal.h. */
#include "motion/core/err.h"
#include "motion/curve/spline_internal.h"

/* c1 = T v0, c2 = 3 D - 2 T v0 - T v1, c3 = T v0 + T v1 - 2 D */
struct spline_poly spline_cubic(struct motion_real displacement,
                                struct motion_real dur, struct motion_real vel0,
                                struct motion_real vel1)
{
    const struct motion_real a = motion_real_mul(dur, vel0);
    const struct motion_real b = motion_real_mul(dur, vel1);
    const struct motion_real ends = motion_real_add(a, b);
    struct spline_poly poly = { .degree = 3 };

    poly.c[1] = a;
    poly.c[2] =
        motion_real_sub(curve_times(displacement, 3), motion_real_add(ends, a));
    poly.c[3] = motion_real_sub(ends, motion_real_twice(displacement));
    return poly;
}

/* weight . (D, T v0, T v1, T^2 a0 / 2, T^2 a1 / 2) */
static struct motion_real spline_weigh(const struct motion_real given[5],
                                       const int8_t weight[5])
{
    struct motion_real sum = motion_real_zero();

    for (int i = 0; i < 5; i++)
        if (weight[i])
            sum = motion_real_add(sum, curve_times(given[i], weight[i]));
    return sum;
}

struct spline_poly spline_quintic(struct motion_real displacement,
                                  struct motion_real dur,
                                  const struct motion_real vel[2],
                                  const struct motion_real acc[2])
{
    static const int8_t weight[SPLINE_DEGREE + 1][5] = {
        { 0 },
        { 0, 1, 0, 0, 0 },
        { 0, 0, 0, 1, 0 },
        { 10, -6, -4, -3, 1 },
        { -15, 8, 7, 3, -2 },
        { 6, -3, -3, -1, 1 },
    };
    const struct motion_real half = motion_real_half(motion_real_sqr(dur));
    const struct motion_real given[5] = {
        displacement,
        motion_real_mul(dur, vel[0]),
        motion_real_mul(dur, vel[1]),
        motion_real_mul(half, acc[0]),
        motion_real_mul(half, acc[1]),
    };
    struct spline_poly poly = { .degree = SPLINE_DEGREE };

    for (int k = 1; k <= SPLINE_DEGREE; k++)
        poly.c[k] = spline_weigh(given, weight[k]);
    return poly;
}

/* The most fraction bits with which all coefficients stay below 2^61;
 * |c| < 2^(62 + e).  Below 0: the span goes too far for integers of 2^-32. */
static int spline_frac(const struct spline_poly *poly)
{
    int e = MOTION_REAL_ZERO_E;

    for (int k = 1; k <= poly->degree; k++)
        if (poly->c[k].m != 0 && poly->c[k].e > e)
            e = poly->c[k].e;
    return -33 - e > 31 ? 31 : -33 - e;
}

int spline_emit(struct motion_track *track, int64_t dur_ns_q12,
                const struct spline_poly *poly, int64_t end_pos_q32,
                uint64_t end_frac)
{
    int64_t coef[SPLINE_DEGREE] = { 0 };
    const int most = spline_frac(poly), frac = most < 0 ? 0 : most;

    for (int k = 1; k <= poly->degree; k++)
        if (motion_real_round(poly->c[k], 32 + frac, &coef[k - 1]))
            return MOTION_E_RANGE;
    return motion_track_append_poly(track, dur_ns_q12, poly->degree, coef,
                                    (unsigned)frac, end_pos_q32, end_frac);
}

/* --- the pieces between two keys --------------------------------------------- */

static int64_t spline_dur(const struct motion_key *key)
{
    return (int64_t)((uint64_t)key[1].t_ns_q12 - (uint64_t)key[0].t_ns_q12);
}

static int spline_span_linear(struct motion_track *track,
                              const struct motion_key *key, const void *with)
{
    (void)with;
    return motion_track_append_line(track, spline_dur(key), key[1].pos_q32);
}

/* Over millions of units, beyond what coefficients of 2^-32 can hold, the
 * formats of velocity and acceleration are fine enough. */
static int spline_span_far(struct motion_track *track,
                           const struct motion_key *key, int order)
{
    struct motion_state end[2] = { { .pos_q32 = key[0].pos_q32 },
                                   { .pos_q32 = key[1].pos_q32 } };

    for (int i = 0; i < 2; i++)
        if (motion_real_round(key[i].vel, 32, &end[i].vel_q32) ||
            (order > 2 && motion_real_round(key[i].acc, 32, &end[i].acc_q32)))
            return MOTION_E_RANGE;
    return motion_track_append_constraints(track, spline_dur(key), order,
                                           &end[0], order, &end[1]);
}

static int spline_span_cubic(struct motion_track *track,
                             const struct motion_key *key, const void *with)
{
    const struct spline_poly poly = spline_cubic(
        spline_displacement(key[0].pos_q32, key[1].pos_q32), spline_span(key),
        spline_read(key[0].vel), spline_read(key[1].vel));

    (void)with;
    if (spline_frac(&poly) < 0)
        return spline_span_far(track, key, 2);
    return spline_emit(track, spline_dur(key), &poly, key[1].pos_q32, 0);
}

static int spline_span_quintic(struct motion_track *track,
                               const struct motion_key *key, const void *with)
{
    const struct motion_real vel[2] = { spline_read(key[0].vel),
                                        spline_read(key[1].vel) };
    const struct motion_real acc[2] = { spline_read(key[0].acc),
                                        spline_read(key[1].acc) };
    const struct spline_poly poly =
        spline_quintic(spline_displacement(key[0].pos_q32, key[1].pos_q32),
                       spline_span(key), vel, acc);

    (void)with;
    if (spline_frac(&poly) < 0)
        return spline_span_far(track, key, 3);
    return spline_emit(track, spline_dur(key), &poly, key[1].pos_q32, 0);
}

/* --- key constraints -------------------------------------------------------
 *
 * With N values given at the two ends, of p, v, a each, the polynomial of
 * degree N - 1 that meets them is the only one: p is given at both ends, which
 * is Polya's condition for two points.  What is given at the start is a
 * coefficient; the other coefficients, at most three, follow from the end. */
struct spline_birkhoff {
    int degree, unknown; /* how many of */
    int of[3];           /* their powers */
    struct motion_real row[3][4];
    struct spline_poly poly;
};

/* The derivative of u^k at u = 1. */
static int spline_slope(int k, int order)
{
    return order == 0 ? 1 : order == 1 ? k : k * (k - 1);
}

/* sum over all powers of c_k slope = value, for what is unknown. */
static void spline_birkhoff_row(struct spline_birkhoff *b, int i, int order,
                                struct motion_real value)
{
    for (int k = 1; k <= b->degree; k++)
        value = motion_real_sub(
            value, curve_times(b->poly.c[k], spline_slope(k, order)));
    for (int n = 0; n < b->unknown; n++)
        b->row[i][n] = motion_real_int(spline_slope(b->of[n], order));
    b->row[i][b->unknown] = value;
}

static void spline_row_reduce(struct motion_real *row,
                              const struct motion_real *by, int at, int size)
{
    const struct motion_real times = motion_real_div(row[at], by[at]);

    for (int n = at; n <= size; n++)
        row[n] = motion_real_sub(row[n], motion_real_mul(times, by[n]));
}

/* Gauss.  The rows are ordered p, v, a over rising powers: no pivot is zero
 * but where v and a are the rows and the first power is 1, so pivots are
 * sought. */
static void spline_birkhoff_solve(struct spline_birkhoff *b)
{
    const int size = b->unknown;

    for (int i = 0; i < size; i++) {
        int pivot = i;
        while (pivot + 1 < size && b->row[pivot][i].m == 0)
            pivot++;
        for (int n = 0; n <= size && pivot != i; n++) {
            const struct motion_real swap = b->row[i][n];
            b->row[i][n] = b->row[pivot][n];
            b->row[pivot][n] = swap;
        }
        for (int k = 0; k < size; k++)
            if (k != i)
                spline_row_reduce(b->row[k], b->row[i], i, size);
    }
    for (int i = 0; i < size; i++)
        b->poly.c[b->of[i]] = motion_real_div(b->row[i][size], b->row[i][i]);
}

static int spline_span_constraints(struct motion_track *track,
                                   const struct motion_key *key,
                                   const void *with)
{
    const struct motion_real dur = spline_span(key);
    const struct motion_real square = motion_real_sqr(dur);
    const bool given[SPLINE_DEGREE + 1] = { true, key[0].has_vel,
                                            key[0].has_acc };
    struct spline_birkhoff b = { .degree = 1 + key[0].has_vel + key[0].has_acc +
                                           key[1].has_vel + key[1].has_acc };
    int row = 0;

    (void)with;
    b.poly.degree = b.degree;
    for (int k = 0; k <= SPLINE_DEGREE; k++) {
        b.poly.c[k] = motion_real_zero();
        if (k <= b.degree && !given[k])
            b.of[b.unknown++] = k;
    }
    if (key[0].has_vel)
        b.poly.c[1] = motion_real_mul(dur, spline_read(key[0].vel));
    if (key[0].has_acc)
        b.poly.c[2] =
            motion_real_half(motion_real_mul(square, spline_read(key[0].acc)));
    spline_birkhoff_row(&b, row++, 0,
                        spline_displacement(key[0].pos_q32, key[1].pos_q32));
    if (key[1].has_vel)
        spline_birkhoff_row(&b, row++, 1,
                            motion_real_mul(dur, spline_read(key[1].vel)));
    if (key[1].has_acc)
        spline_birkhoff_row(&b, row, 2,
                            motion_real_mul(square, spline_read(key[1].acc)));
    spline_birkhoff_solve(&b);
    return spline_emit(track, spline_dur(key), &b.poly, key[1].pos_q32, 0);
}

/* --- lists ------------------------------------------------------------------ */

int spline_each(struct motion_track *track, const struct motion_key *key,
                uint32_t count, spline_append_span *append, const void *with,
                uint32_t *failed)
{
    const struct motion_track before = *track;

    if (failed)
        *failed = 0;
    if (count == 0)
        return MOTION_E_EMPTY;
    if (track->end.pos_q32 != key[0].pos_q32 || track->end_frac != 0)
        return MOTION_E_ARG;
    for (uint32_t i = 0; i + 1 < count; i++) {
        int rc = MOTION_E_ARG;
        if (key[i + 1].t_ns_q12 > key[i].t_ns_q12 && spline_dur(&key[i]) > 0)
            rc = append(track, &key[i], with);
        if (rc == MOTION_OK)
            continue;
        *track = before;
        if (failed)
            *failed = i;
        return rc;
    }
    return MOTION_OK;
}

int motion_spline_append_linear(struct motion_track *track,
                                const struct motion_key *key, uint32_t count,
                                uint32_t *failed)
{
    return spline_each(track, key, count, spline_span_linear, 0, failed);
}

int motion_spline_append_cubic(struct motion_track *track,
                               const struct motion_key *key, uint32_t count,
                               uint32_t *failed)
{
    return spline_each(track, key, count, spline_span_cubic, 0, failed);
}

int motion_spline_append_quintic(struct motion_track *track,
                                 const struct motion_key *key, uint32_t count,
                                 uint32_t *failed)
{
    return spline_each(track, key, count, spline_span_quintic, 0, failed);
}

int motion_spline_append_constraints(struct motion_track *track,
                                     const struct motion_key *key,
                                     uint32_t count, uint32_t *failed)
{
    return spline_each(track, key, count, spline_span_constraints, 0, failed);
}
