/* motion/plan/topp/topp_rows.c - see topp_rows.h. */
#include "motion/plan/topp/topp_rows.h"

#include <math.h>
#include <stdbool.h>
#include <string.h>

#include "motion/plan/topp/topp_poly.h"

/* Rows of the last program that are taken first. */
#define TOPP_LAST 6

/* Highest degree of a product: q'^2 x. */
#define TOPP_PRODUCT_MAX (2 * PLAN_TOPP_DEGREE_MAX)

/* --- Bernstein polynomials --------------------------------------------------
 *
 * Scaled: coefficient i times binomial (n, i), so that products are sums of
 * products as those of powers are. */

static const double binomial[TOPP_PRODUCT_MAX + 1][TOPP_PRODUCT_MAX + 1] = {
    { 1 },
    { 1, 1 },
    { 1, 2, 1 },
    { 1, 3, 3, 1 },
    { 1, 4, 6, 4, 1 },
    { 1, 5, 10, 10, 5, 1 },
    { 1, 6, 15, 20, 15, 6, 1 },
    { 1, 7, 21, 35, 35, 21, 7, 1 },
    { 1, 8, 28, 56, 70, 56, 28, 8, 1 },
    { 1, 9, 36, 84, 126, 126, 84, 36, 9, 1 },
    { 1, 10, 45, 120, 210, 252, 210, 120, 45, 10, 1 },
};

/* q' of one axis over an interval of width h from s on, as scaled
 * Bernstein coefficients, from the powers of the piece. */
static void topp_derivative(unsigned degree, const double coef[], double s,
                            double h, double out[])
{
    double power[PLAN_TOPP_DEGREE_MAX + 1];

    memcpy(power, coef, (degree + 1) * sizeof power[0]);
    topp_poly_shift(degree, power, s);
    double scale = 1;
    for (unsigned k = 0; k < degree; k++, scale *= h)
        power[k] = (k + 1) * power[k + 1] * scale;
    for (unsigned j = 0; j < degree; j++) {
        out[j] = 0;
        for (unsigned k = 0; k <= j; k++)
            out[j] += binomial[degree - 1 - k][j - k] * power[k];
    }
}

double topp_slope(unsigned degree, const double coef[], double s)
{
    double sum = 0;

    for (unsigned k = degree; k > 0; k--)
        sum = sum * s + k * coef[k];
    return sum;
}

/* Of numbers, and inline: fmax and fmin are calls that mind what is none. */
static double topp_larger(double a, double b)
{
    return a < b ? b : a;
}

static double topp_smaller(double a, double b)
{
    return a < b ? a : b;
}

/* --- limits -------------------------------------------------------------------- */

/* Rows as they come; each has a number, whether it is needed or not. */
struct topp_list {
    struct topp_lp *lp;
    double h; /* of the interval */
    unsigned id;
};

/* scale a <= b, where something in the box can break it; `most`: of a. */
static void topp_row(struct topp_list *list, const double a[], double most,
                     double scale, double b)
{
    struct topp_lp *lp = list->lp;
    const unsigned id = list->id++;

    if (most * scale <= b)
        return;
    lp->row[lp->count++] = (struct topp_lp_row){
        .a = { a[TOPP_X] * scale, a[TOPP_U0] * scale, a[TOPP_U1] * scale },
        .b = b,
        .id = id,
    };
}

/* What the terms of a are together at least and at most in the box. */
static void topp_range(const struct topp_lp *lp, const double a[],
                       double *least, double *most)
{
    const double u = lp->high[TOPP_U0] * (fabs(a[TOPP_U0]) + fabs(a[TOPP_U1]));
    const double p = a[TOPP_X] * lp->low[TOPP_X];
    const double q = a[TOPP_X] * lp->high[TOPP_X];

    *least = (p < q ? p : q) - u;
    *most = (p < q ? q : p) + u;
}

/* Add `share` times Bernstein coefficient j of x. */
static void topp_add_x(double a[], double h, unsigned j, double share)
{
    a[TOPP_X] += share;
    if (j > 0)
        a[TOPP_U0] += h * share;
    if (j > 1)
        a[TOPP_U1] += h * share;
}

/* q'^2 x <= v^2, of the limit of the direction, of the smaller one where the
 * axis turns round.  `x_most`: x at most. */
static void topp_velocity(struct topp_list *list, unsigned n, const double d1[],
                          const struct plan_topp_limit *limit, double x_most,
                          double b)
{
    double square[TOPP_PRODUCT_MAX + 1] = { 0 }, v = INFINITY, fastest = 0;

    for (unsigned i = 0; i <= n; i++) {
        const double size = fabs(d1[i]) / binomial[n][i];
        if (d1[i] > 0 && v > limit->vel_max)
            v = limit->vel_max;
        else if (d1[i] < 0 && v > -limit->vel_min)
            v = -limit->vel_min;
        fastest = fastest < size ? size : fastest;
    }
    if (fastest * fastest * x_most <= v * v * b) {
        list->id += 2 * n + 3;
        return;
    }
    for (unsigned i = 0; i <= n; i++)
        for (unsigned j = 0; j <= n; j++)
            square[i + j] += d1[i] * d1[j];
    for (unsigned k = 0; k <= 2 * n + 2; k++) {
        double a[TOPP_VARIABLES] = { 0 }, least, most;
        for (unsigned j = 0; j <= 2; j++)
            if (k >= j && k - j <= 2 * n)
                topp_add_x(a, list->h, j, binomial[2][j] * square[k - j]);
        topp_range(list->lp, a, &least, &most);
        topp_row(list, a, most, 1 / (v * v * binomial[2 * n + 2][k]), b);
    }
}

/* q' u + q'' x, as a row for either limit. */
static void topp_acceleration(struct topp_list *list, unsigned n,
                              const double d1[],
                              const struct plan_topp_limit *limit, double b)
{
    const double up = 1 / limit->acc_max, down = 1 / limit->acc_min;
    double d2[PLAN_TOPP_DEGREE_MAX] = { 0 };

    for (unsigned i = 0; i < n; i++)
        d2[i] = ((i + 1) * d1[i + 1] - (n - i) * d1[i]) / list->h;
    for (unsigned k = 0; k <= n + 1; k++) {
        const double per = 1 / binomial[n + 1][k];
        double a[TOPP_VARIABLES] = { 0 }, least, most;
        for (unsigned j = 0; j <= 1; j++)
            if (k >= j && k - j <= n)
                a[TOPP_U0 + j] += d1[k - j];
        for (unsigned j = 0; j <= 2; j++)
            if (k >= j && k - j < n)
                topp_add_x(a, list->h, j, binomial[2][j] * d2[k - j]);
        topp_range(list->lp, a, &least, &most);
        topp_row(list, a, most, per * up, b);
        topp_row(list, a, least, per * down, b);
    }
}

/* low <= coefficient j of x <= high, in units of u times `scale`. */
static void topp_between(struct topp_list *list, unsigned j, double scale,
                         double low, double high)
{
    double a[TOPP_VARIABLES] = { 0 }, least, most;

    scale /= list->h;
    topp_add_x(a, list->h, j, 1);
    topp_range(list->lp, a, &least, &most);
    topp_row(list, a, most, scale, high * scale);
    topp_row(list, a, least, -scale, -low * scale);
}

/* From or to rest, coefficient `rest` of x, in a finite time: the middle one is
 * at least a quarter of the other end's, where it is half for a constant u. */
static void topp_leave(struct topp_list *list, unsigned rest, double scale)
{
    double a[TOPP_VARIABLES] = { 0 };

    topp_add_x(a, list->h, 2 - rest, 0.25);
    topp_add_x(a, list->h, 1, -1);
    topp_row(list, a, INFINITY, scale / list->h, 0);
}

/* The row with a number; lp->count: there is none.  Numbers increase. */
static unsigned topp_find(const struct topp_lp *lp, unsigned id)
{
    unsigned low = 0, high = lp->count;

    while (low < high) {
        const unsigned middle = low + (high - low) / 2;
        if (lp->row[middle].id < id)
            low = middle + 1;
        else
            high = middle;
    }
    return low < lp->count && lp->row[low].id == id ? low : lp->count;
}

/* To the front what counted in the last program. */
static void topp_sort(struct topp_lp *lp, const unsigned last[], unsigned count)
{
    unsigned at[TOPP_LAST], found = 0;

    for (unsigned k = 0; k < count; k++) {
        at[found] = topp_find(lp, last[k]);
        found += at[found] < lp->count;
    }
    for (unsigned front = 0; front < found; front++) {
        const struct topp_lp_row row = lp->row[at[front]];
        lp->row[at[front]] = lp->row[front];
        lp->row[front] = row;
        for (unsigned k = front + 1; k < found; k++)
            if (at[k] == front)
                at[k] = at[front];
    }
}

/* The box: coefficients of x, and what they leave of u. */
static double topp_box(const struct topp_interval *interval, struct topp_lp *lp)
{
    double most = 0;

    for (unsigned j = 0; j < 3; j++)
        most = topp_larger(most, interval->high[j]);
    lp->low[TOPP_X] = interval->low[0];
    lp->high[TOPP_X] = interval->high[0];
    lp->low[TOPP_U0] = lp->low[TOPP_U1] = -most / interval->h;
    lp->high[TOPP_U0] = lp->high[TOPP_U1] = most / interval->h;
    return most;
}

void topp_rows(const struct topp_interval *interval, struct topp_lp *lp)
{
    const struct plan_topp_path *path = interval->path;
    const unsigned n = path->degree - 1;
    const double *coef =
        path->coef + (size_t)interval->piece * path->axes * (path->degree + 1);
    const double s = interval->s - path->border[interval->piece];
    const double most = topp_box(interval, lp);
    struct topp_list list = { lp, interval->h, 0 };
    unsigned last[TOPP_LAST], last_count = 0;
    double scale = 0;

    for (; last_count < TOPP_LAST && last_count < lp->count; last_count++)
        last[last_count] = lp->row[last_count].id;
    lp->count = 0;
    for (unsigned k = 0; k < path->axes; k++, coef += path->degree + 1) {
        const struct plan_topp_limit *limit = &interval->limit[k];
        double d1[PLAN_TOPP_DEGREE_MAX] = { 0 };
        topp_derivative(path->degree, coef, s, interval->h, d1);
        topp_velocity(&list, n, d1, limit, most, interval->share);
        topp_acceleration(&list, n, d1, limit, interval->share);
        scale = topp_larger(scale,
                            topp_larger(fabs(d1[0]), fabs(d1[n])) /
                                topp_smaller(limit->acc_max, -limit->acc_min));
    }
    if (scale == 0)
        scale = interval->h / (most + interval->h);
    for (unsigned j = 1; j < 3; j++)
        topp_between(&list, j, scale, interval->low[j], interval->high[j]);
    for (unsigned j = 0; j < 3; j += 2)
        if (interval->high[j] == 0)
            topp_leave(&list, j, scale);
    topp_sort(lp, last, last_count);
}
