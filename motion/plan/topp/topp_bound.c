/* motion/plan/topp/topp_bound.c - see topp_bound.h. */
#include "motion/plan/topp/topp_bound.h"

#include <math.h>
#include <string.h>

#include "motion/double/double_math.h"
#include "motion/plan/topp/topp_poly.h"

#define BOUND_AXIS (PLAN_TOPP_DEGREE_MAX * TOPP_CHAIN_DEGREE) /* degree */

/* Of the size of a polynomial: a value that counts as 0. */
#define BOUND_ROUNDING 1e-14

/* A part of an interval, between joins of the chain: w from `from` on, h long. */
struct bound_part {
    double from, h;
    double s[TOPP_CHAIN_DEGREE + 1];
    double z[3]; /* powers */
    double z_most;
};

/* One axis over it, by w as it moves: derivatives of q(s(w)). */
struct bound_axis {
    unsigned degree; /* of the first */
    double d[3][BOUND_AXIS];
};

double topp_bound_stretch(const struct topp_shares *shares)
{
    return fmax(shares->vel,
                fmax(sqrt(shares->acc), double_cbrt(shares->jerk)));
}

/* --- polynomials ------------------------------------------------------------- */

/* q(s(w)) without its constant: in powers of s - s(from), by Horner. */
static unsigned bound_compose(const struct plan_topp_path *path, uint32_t piece,
                              unsigned axis, const double s[],
                              double out[BOUND_AXIS + 1])
{
    const unsigned n = path->degree;
    const double *coef =
        path->coef + ((size_t)piece * path->axes + axis) * (n + 1);
    const double step[TOPP_CHAIN_DEGREE] = { s[1], s[2], s[3], s[4], s[5] };
    double q[PLAN_TOPP_DEGREE_MAX + 1];
    unsigned steps = TOPP_CHAIN_DEGREE - 1, degree = 0;

    while (steps > 0 && step[steps] == 0)
        steps--;
    memcpy(q, coef, (n + 1) * sizeof *q);
    topp_poly_shift(n, q, s[0]);
    memset(out, 0, (BOUND_AXIS + 1) * sizeof *out);
    for (unsigned k = n; k > 0; k--) {
        double next[BOUND_AXIS + 1] = { 0 };
        out[0] += q[k];
        topp_poly_add_product(degree, out, steps, step, next + 1);
        degree += steps + 1;
        memcpy(out, next, sizeof next);
    }
    return degree;
}

static void bound_derive(unsigned degree, const double c[], double h,
                         double out[])
{
    for (unsigned n = 0; n < degree; n++)
        out[n] = (n + 1) * c[n + 1] / h;
}

static void bound_axis(const struct topp_chain *chain, uint32_t piece,
                       unsigned axis, const struct bound_part *part,
                       struct bound_axis *out)
{
    double r[BOUND_AXIS + 1];
    const unsigned degree =
        bound_compose(&chain->path, piece, axis, part->s, r);

    memset(out, 0, sizeof *out);
    out->degree = degree - 1;
    bound_derive(degree, r, part->h, out->d[0]);
    bound_derive(degree - 1, out->d[0], part->h, out->d[1]);
    if (degree > 1)
        bound_derive(degree - 2, out->d[1], part->h, out->d[2]);
}

static double bound_size(unsigned degree, const double c[])
{
    double sum = 0;

    for (unsigned n = 0; n <= degree; n++)
        sum += fabs(c[n]);
    return sum;
}

/* --- limits ------------------------------------------------------------------ */

/* The limit of c, which is the smaller one where its sign may change. */
static double bound_limit(unsigned degree, const double c[], double size,
                          double min, double max)
{
    double less[TOPP_POLY_MAX];

    for (unsigned n = 0; n <= degree; n++)
        less[n] = -c[n];
    if (!(topp_poly_top(degree, c, 0) > BOUND_ROUNDING * size))
        return -min;
    if (!(topp_poly_top(degree, less, 0) > BOUND_ROUNDING * size))
        return max;
    return fmin(max, -min);
}

/* A bound of c sqrt(z) in shares of its limits. */
static double bound_root(unsigned degree, const double c[],
                         const struct bound_part *part, double min, double max,
                         double most)
{
    const double size = bound_size(degree, c), pace = sqrt(part->z_most);
    double square[TOPP_POLY_MAX] = { 0 }, value[TOPP_POLY_MAX] = { 0 };

    double limit;

    if (size * pace <= most * fmin(max, -min))
        return most;
    limit = bound_limit(degree, c, size, min, max);
    topp_poly_add_product(degree, c, degree, c, square);
    topp_poly_add_product(2 * degree, square, 2, part->z, value);
    for (unsigned n = 0; n <= 2 * degree + 2; n++)
        value[n] /= limit * limit;
    return sqrt(topp_poly_top(2 * degree + 2, value, most * most));
}

static double bound_acc(const struct bound_axis *axis,
                        const struct bound_part *part, double min, double max,
                        double most)
{
    const double slope[2] = { part->z[1] / part->h / 2, part->z[2] / part->h };
    const unsigned n = axis->degree;
    double acc[TOPP_POLY_MAX] = { 0 }, share[TOPP_POLY_MAX];
    const double limit[2] = { max, min };

    topp_poly_add_product(n, axis->d[0], 1, slope, acc);
    topp_poly_add_product(n, axis->d[1], 2, part->z, acc);
    if (bound_size(n + 2, acc) <= most * fmin(max, -min))
        return most;
    for (int k = 0; k < 2; k++) {
        for (unsigned i = 0; i <= n + 2; i++)
            share[i] = acc[i] / limit[k];
        most = topp_poly_top(n + 2, share, most);
    }
    return most;
}

/* The jerk over sqrt(z). */
static unsigned bound_jerk(const struct bound_axis *axis,
                           const struct bound_part *part, double jerk[])
{
    const double h = part->h;
    const double bend[1] = { part->z[2] / (h * h) };
    const double slope[2] = { 1.5 * part->z[1] / h, 3 * part->z[2] / h };
    const unsigned n = axis->degree;

    topp_poly_add_product(n, axis->d[0], 0, bend, jerk);
    topp_poly_add_product(n, axis->d[1], 1, slope, jerk);
    topp_poly_add_product(n, axis->d[2], 2, part->z, jerk);
    /* d[1] has one power less than d[0], d[2] two. */
    return n;
}

static void bound_part(const struct topp_barrier *barrier, uint32_t piece,
                       double cap, const struct bound_part *part,
                       struct topp_shares *shares)
{
    double pace[TOPP_CHAIN_DEGREE];

    bound_derive(TOPP_CHAIN_DEGREE, part->s, part->h, pace);
    shares->vel =
        bound_root(TOPP_CHAIN_DEGREE - 1, pace, part, -cap, cap, shares->vel);
    for (unsigned k = 0; k < barrier->axes; k++) {
        const struct topp_barrier_limit *limit = &barrier->limit[k];
        double jerk[TOPP_POLY_MAX] = { 0 };
        struct bound_axis axis;
        unsigned degree;

        bound_axis(barrier->chain, piece, k, part, &axis);
        shares->vel = bound_root(axis.degree, axis.d[0], part, limit->vel_min,
                                 limit->vel_max, shares->vel);
        shares->acc =
            bound_acc(&axis, part, limit->acc_min, limit->acc_max, shares->acc);
        degree = bound_jerk(&axis, part, jerk);
        shares->jerk = bound_root(degree, jerk, part, -limit->jerk, limit->jerk,
                                  shares->jerk);
    }
}

/* --- all --------------------------------------------------------------------- */

void topp_bound(const struct topp_barrier *barrier, uint32_t i, uint32_t piece,
                double cap, struct topp_shares *shares)
{
    const double end = barrier->w[i + 1];
    double b[3], z[3], join[2], from = barrier->w[i];
    const double h = end - from;
    const unsigned joins = topp_chain_joins(barrier->chain, join);

    topp_barrier_z(barrier, i, b);
    z[0] = b[0];
    z[1] = 2 * (b[1] - b[0]);
    z[2] = b[0] - 2 * b[1] + b[2];
    for (unsigned k = 0; k <= joins; k++) {
        const double to = k < joins ? fmin(join[k], end) : end;
        struct bound_part part = { .from = from, .h = to - from };
        if (!(to > from))
            continue;
        memcpy(part.z, z, sizeof z);
        topp_poly_shift(2, part.z, (from - barrier->w[i]) / h);
        part.z[1] *= part.h / h;
        part.z[2] *= part.h / h * (part.h / h);
        part.z_most = fmax(b[0], fmax(b[1], b[2]));
        topp_chain_part(barrier->chain, piece, from, part.h, part.s);
        bound_part(barrier, piece, cap, &part, shares);
        from = to;
    }
}
