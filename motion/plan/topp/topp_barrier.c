/* motion/plan/topp/topp_barrier.c - see topp_barrier.h. */
#include "motion/plan/topp/topp_barrier.h"

#include <math.h>
#include <string.h>

#include "motion/core/err.h"
#include "motion/double/double_math.h"
#include "motion/plan/topp/topp_band.h"

#define BARRIER_POINTS   3 /* of an interval */
#define BARRIER_STEPS    200
#define BARRIER_HALVINGS 30

/* Of the weight: decrease of a Newton step that ends a centering. */
#define BARRIER_CENTERED 0.05

/* Of the objective's curvature, what is left of it at least. */
#define BARRIER_CURVATURE 0.1

/* Of a step to a speed that is held: less leads nowhere. */
#define BARRIER_LEADS 1e-3

/* Of a speed that is at its limit where z is held. */
#define BARRIER_ROUNDING 1e-9

static const double point_weight[BARRIER_POINTS] = { 1. / 6, 4. / 6, 1. / 6 };

/* z and its derivatives at a point, from the three coefficients of z that an
 * interval depends on. */
typedef double barrier_map[3][3];

/* What a point adds to the objective, by z, z', z''. */
struct barrier_point {
    double gradient[3];
    double matrix[3][3]; /* lower triangle */
    double concave;      /* left out of matrix[0][0] */
};

/* --- the spline -------------------------------------------------------------- */

static double barrier_width(const struct topp_barrier *self, int64_t i)
{
    return i < 0 || i >= self->intervals ? 0 : self->w[i + 1] - self->w[i];
}

/* Bernstein coefficients of interval i from coefficients i, i + 1, i + 2. */
static void barrier_bernstein(const struct topp_barrier *self, uint32_t i,
                              double b[3][3])
{
    const double h = barrier_width(self, i);
    const double before = h / (h + barrier_width(self, (int64_t)i - 1));
    const double after = h / (h + barrier_width(self, (int64_t)i + 1));

    memset(b, 0, sizeof(barrier_map));
    b[0][0] = before;
    b[0][1] = 1 - before;
    b[1][1] = 1;
    b[2][1] = 1 - after;
    b[2][2] = after;
}

void topp_barrier_z(const struct topp_barrier *self, uint32_t i, double z[3])
{
    const double *c = self->z + i;
    double b[3][3];

    barrier_bernstein(self, i, b);
    for (int k = 0; k < 3; k++)
        z[k] = b[k][0] * c[0] + b[k][1] * c[1] + b[k][2] * c[2];
}

/* At point 0, 1, 2: the start, the middle, the end of interval i. */
static void barrier_at(const struct topp_barrier *self, uint32_t i,
                       unsigned point, barrier_map map)
{
    const double h = barrier_width(self, i), x = point / 2., y = 1 - x;
    const double by[3][3] = {
        { y * y, 2 * x * y, x * x },
        { -2 * y / h, 2 * (y - x) / h, 2 * x / h },
        { 2 / (h * h), -4 / (h * h), 2 / (h * h) },
    };
    double b[3][3];

    barrier_bernstein(self, i, b);
    for (int m = 0; m < 3; m++)
        for (int k = 0; k < 3; k++)
            map[m][k] =
                by[m][0] * b[0][k] + by[m][1] * b[1][k] + by[m][2] * b[2][k];
}

static void barrier_apply(const barrier_map map, const double c[3], double y[3])
{
    for (int m = 0; m < 3; m++)
        y[m] = map[m][0] * c[0] + map[m][1] * c[1] + map[m][2] * c[2];
}

/* --- rows -------------------------------------------------------------------- */

static double barrier_vel_bound(double vel, double slope)
{
    const double pace = slope / vel;

    return pace > 0 ? 1 / (pace * pace) : INFINITY;
}

static void barrier_rows(struct topp_barrier *self, const uint32_t piece[],
                         const double cap[], double most)
{
    const uint32_t points = self->intervals * BARRIER_POINTS;

    for (uint32_t p = 0; p < points; p++) {
        const uint32_t i = p / BARRIER_POINTS;
        const double share = (p % BARRIER_POINTS) / 2.;
        double s[4], r[4];
        topp_chain_s(self->chain,
                     self->w[i] * (1 - share) + self->w[i + 1] * share, s);
        self->bound[p] = fmin(most, barrier_vel_bound(cap[i], s[1]));
        for (unsigned k = 0; k < self->axes; k++) {
            const struct topp_barrier_limit *limit = &self->limit[k];
            topp_chain_axis(self->chain, piece[i], k, s, r);
            memcpy(self->r[(size_t)p * self->axes + k], r + 1,
                   sizeof self->r[0]);
            self->bound[p] =
                fmin(self->bound[p],
                     barrier_vel_bound(
                         r[1] > 0 ? limit->vel_max : limit->vel_min, r[1]));
        }
    }
}

int topp_barrier_init(struct topp_barrier *self, const struct topp_chain *chain,
                      const struct topp_barrier_limit limit[],
                      uint32_t intervals, const double w[],
                      const uint32_t piece[], const double cap[], double most)
{
    struct plan_pool *pool = self->pool;
    const size_t n = (size_t)intervals + 2, points = n * BARRIER_POINTS;

    *self = (struct topp_barrier){ .chain = chain,
                                   .limit = limit,
                                   .pool = pool,
                                   .axes = chain->path.axes,
                                   .intervals = intervals };
    self->w = plan_pool_take(pool, n, sizeof *self->w);
    self->r = plan_pool_take(pool, points * self->axes, sizeof *self->r);
    self->bound = plan_pool_take(pool, points, sizeof *self->bound);
    self->z = plan_pool_take(pool, n, sizeof *self->z);
    self->gradient = plan_pool_take(pool, n, sizeof *self->gradient);
    self->step = plan_pool_take(pool, n, sizeof *self->step);
    self->trial = plan_pool_take(pool, n, sizeof *self->trial);
    self->matrix = plan_pool_take(pool, n, sizeof *self->matrix);
    if (!self->w || !self->r || !self->bound || !self->z || !self->gradient ||
        !self->step || !self->trial || !self->matrix)
        return MOTION_E_FULL;
    memcpy(self->w, w, (n - 1) * sizeof *w);
    barrier_rows(self, piece, cap, most);
    return MOTION_OK;
}

bool topp_barrier_hold(struct topp_barrier *self, double start, double end)
{
    const size_t last = (size_t)self->intervals * BARRIER_POINTS - 1;
    const double most = 1 + BARRIER_ROUNDING;

    self->start = start;
    self->end = end;
    if (start > self->bound[0] * most || end > self->bound[last] * most)
        return false;
    if (start > 0)
        self->bound[0] = INFINITY;
    if (end > 0)
        self->bound[last] = INFINITY;
    return true;
}

void topp_barrier_tighten(struct topp_barrier *self, uint32_t i, double share)
{
    const size_t first = (size_t)i * BARRIER_POINTS;

    for (size_t p = first; p < first + BARRIER_POINTS; p++) {
        self->bound[p] *= share * share;
        for (unsigned k = 0; k < self->axes; k++)
            for (int m = 0; m < 3; m++)
                self->r[p * self->axes + k][m] /= share;
    }
}

/* --- value ------------------------------------------------------------------- */

static double barrier_acc(const double r[3], const double y[3])
{
    return r[0] * y[1] / 2 + r[1] * y[0];
}

static double barrier_jerk(const double r[3], const double y[3])
{
    return r[0] * y[2] / 2 + 1.5 * r[1] * y[1] + r[2] * y[0];
}

/* Product of what is left up to each limit of one axis; 0 outside. */
static double barrier_left(const struct topp_barrier_limit *limit,
                           const double r[3], const double y[3])
{
    const double a = barrier_acc(r, y), j = barrier_jerk(r, y) / limit->jerk;
    const double up = 1 - a / limit->acc_max, down = 1 - a / limit->acc_min;
    const double jerk = 1 / y[0] - j * j;

    return up > 0 && down > 0 && jerk > 0 ? up * down * jerk : 0;
}

/* The objective at z; infinite outside.  Coefficients above 0 keep z above 0
 * between points. */
static double barrier_value(const struct topp_barrier *self, const double z[],
                            double weight)
{
    double time = 0, barrier = 0;

    for (uint32_t i = 0; i < self->intervals; i++) {
        if (!(z[i + 1] > 0))
            return INFINITY;
        barrier -= barrier_width(self, i) * double_log(z[i + 1]);
        for (unsigned j = 0; j < BARRIER_POINTS; j++) {
            const size_t p = (size_t)i * BARRIER_POINTS + j;
            const double by = point_weight[j] * barrier_width(self, i);
            barrier_map map;
            double y[3], sum;
            barrier_at(self, i, j, map);
            barrier_apply(map, z + i, y);
            if (!(y[0] > 0) || !(y[0] < self->bound[p]))
                return INFINITY;
            sum = double_log(1 - y[0] / self->bound[p]);
            for (unsigned k = 0; k < self->axes; k++) {
                const double left = barrier_left(
                    &self->limit[k], self->r[p * self->axes + k], y);
                if (!(left > 0))
                    return INFINITY;
                sum += double_log(left);
            }
            time += by / sqrt(y[0]);
            barrier -= by * sum;
        }
    }
    return time + weight * barrier;
}

bool topp_barrier_is_inside(const struct topp_barrier *self)
{
    return isfinite(barrier_value(self, self->z, 1));
}

/* --- Newton's step ----------------------------------------------------------- */

/* A limit v y <= left: its barrier's gradient and curvature. */
static void barrier_add(struct barrier_point *at, const double v[3],
                        double left, double weight)
{
    const double first = weight / left, second = first / left;

    for (int m = 0; m < 3; m++) {
        at->gradient[m] += first * v[m];
        for (int n = 0; n <= m; n++)
            at->matrix[m][n] += second * v[m] * v[n];
    }
}

static void barrier_axis(struct barrier_point *at,
                         const struct topp_barrier_limit *limit,
                         const double r[3], const double y[3], double weight)
{
    const double a = barrier_acc(r, y), j = barrier_jerk(r, y);
    const double most = limit->jerk / sqrt(y[0]), fall = most / (2 * y[0]);
    const double up[3] = { r[1], r[0] / 2, 0 };
    const double down[3] = { -r[1], -r[0] / 2, 0 };
    const double high[3] = { r[2] + fall, 1.5 * r[1], r[0] / 2 };
    const double low[3] = { -r[2] + fall, -1.5 * r[1], -r[0] / 2 };

    barrier_add(at, up, limit->acc_max - a, weight);
    barrier_add(at, down, a - limit->acc_min, weight);
    barrier_add(at, high, most - j, weight);
    barrier_add(at, low, most + j, weight);
    at->concave +=
        weight * (1 / (most - j) + 1 / (most + j)) * 1.5 * fall / y[0];
}

static void barrier_point(const struct topp_barrier *self, size_t p,
                          const double y[3], double by, double weight,
                          struct barrier_point *at)
{
    const double root = sqrt(y[0]), curve = 0.75 * by / (y[0] * y[0] * root);
    const double up[3] = { 1, 0, 0 };

    *at = (struct barrier_point){ 0 };
    barrier_add(at, up, self->bound[p] - y[0], by * weight);
    for (unsigned k = 0; k < self->axes; k++)
        barrier_axis(at, &self->limit[k], self->r[p * self->axes + k], y,
                     by * weight);
    at->gradient[0] -= by / (2 * y[0] * root);
    at->matrix[0][0] += fmax(curve - at->concave, BARRIER_CURVATURE * curve);
    at->matrix[0][1] = at->matrix[1][0];
    at->matrix[0][2] = at->matrix[2][0];
    at->matrix[1][2] = at->matrix[2][1];
}

/* By the coefficients of z instead of z, z', z''. */
static void barrier_spread(struct topp_barrier *self, uint32_t i,
                           const barrier_map map,
                           const struct barrier_point *at)
{
    for (uint32_t a = 0; a < 3; a++) {
        double row[3];
        for (int n = 0; n < 3; n++)
            row[n] = map[0][a] * at->matrix[0][n] +
                     map[1][a] * at->matrix[1][n] +
                     map[2][a] * at->matrix[2][n];
        for (uint32_t b = 0; b <= a; b++)
            self->matrix[i + a][a - b] +=
                row[0] * map[0][b] + row[1] * map[1][b] + row[2] * map[2][b];
        self->gradient[i + a] += map[0][a] * at->gradient[0] +
                                 map[1][a] * at->gradient[1] +
                                 map[2][a] * at->gradient[2];
    }
}

/* Coefficient i moves by `step`, and the others as that makes them. */
static void barrier_fix(struct topp_barrier *self, size_t i, double step)
{
    const size_t n = (size_t)self->intervals + 2;
    double(*m)[3] = self->matrix;

    for (size_t k = 1; k < 3; k++) {
        if (i + k < n) {
            self->gradient[i + k] += m[i + k][k] * step;
            m[i + k][k] = 0;
        }
        if (i >= k) {
            self->gradient[i - k] += m[i][k] * step;
            m[i][k] = 0;
        }
    }
    self->gradient[i] = -step;
    m[i][0] = 1;
}

/* The ends that are held: what is left up to there, times `share`. */
static void barrier_fix_ends(struct topp_barrier *self, double share)
{
    const size_t n = (size_t)self->intervals + 2;

    for (size_t k = 0; k < 2; k++) {
        const size_t last = n - 1 - k;
        if (self->start > 0)
            barrier_fix(self, k, share * (self->start - self->z[k]));
        if (self->end > 0)
            barrier_fix(self, last, share * (self->end - self->z[last]));
    }
}

static void barrier_assemble(struct topp_barrier *self, double weight)
{
    const size_t n = (size_t)self->intervals + 2;

    memset(self->gradient, 0, n * sizeof *self->gradient);
    memset(self->matrix, 0, n * sizeof *self->matrix);
    for (uint32_t i = 0; i < self->intervals; i++) {
        const double by = weight * barrier_width(self, i) / self->z[i + 1];
        self->gradient[i + 1] -= by;
        self->matrix[i + 1][0] += by / self->z[i + 1];
        for (unsigned j = 0; j < BARRIER_POINTS; j++) {
            struct barrier_point at;
            barrier_map map;
            double y[3];
            barrier_at(self, i, j, map);
            barrier_apply(map, self->z + i, y);
            barrier_point(self, (size_t)i * BARRIER_POINTS + j, y,
                          point_weight[j] * barrier_width(self, i), weight,
                          &at);
            barrier_spread(self, i, map, &at);
        }
    }
}

/* As much of the step as lowers the objective; whether any does. */
static bool barrier_search(struct topp_barrier *self, double weight,
                           double *value, double slope)
{
    const size_t n = (size_t)self->intervals + 2;
    double share = 1;

    for (int k = 0; k < BARRIER_HALVINGS; k++, share /= 2) {
        double next;
        for (size_t i = 0; i < n; i++)
            self->trial[i] = self->z[i] + share * self->step[i];
        next = barrier_value(self, self->trial, weight);
        if (next <= *value + 0.01 * share * slope) {
            memcpy(self->z, self->trial, n * sizeof *self->z);
            *value = next;
            return true;
        }
    }
    return false;
}

void topp_barrier_center(struct topp_barrier *self, double weight)
{
    const size_t n = (size_t)self->intervals + 2;
    double value = barrier_value(self, self->z, weight);

    for (int k = 0; k < BARRIER_STEPS; k++) {
        double slope = 0;
        barrier_assemble(self, weight);
        barrier_fix_ends(self, 0);
        if (!topp_band_solve((uint32_t)n, self->matrix, self->gradient,
                             self->step))
            return;
        for (size_t i = 0; i < n; i++)
            slope += self->gradient[i] * self->step[i];
        if (-slope < BARRIER_CENTERED * weight ||
            !barrier_search(self, weight, &value, slope))
            return;
    }
}

/* As much of the step as is inside, and half of that where it is not all. */
static double barrier_follow(struct topp_barrier *self)
{
    const size_t n = (size_t)self->intervals + 2;
    double share = 1;

    for (int k = 0; k < BARRIER_HALVINGS; k++, share /= 2) {
        for (size_t i = 0; i < n; i++)
            self->trial[i] = self->z[i] + share * self->step[i];
        if (!isfinite(barrier_value(self, self->trial, 1)))
            continue;
        if (share < 1)
            share /= 2;
        for (size_t i = 0; i < n; i++)
            self->z[i] += share * self->step[i];
        return share;
    }
    return 0;
}

bool topp_barrier_lead(struct topp_barrier *self, double weight)
{
    const size_t n = (size_t)self->intervals + 2;

    for (int k = 0; k < BARRIER_STEPS; k++) {
        double share;
        topp_barrier_center(self, weight);
        barrier_assemble(self, weight);
        barrier_fix_ends(self, 1);
        if (!topp_band_solve((uint32_t)n, self->matrix, self->gradient,
                             self->step))
            return false;
        share = barrier_follow(self);
        if (share == 1)
            return topp_barrier_is_inside(self);
        if (share < BARRIER_LEADS)
            return false;
    }
    return false;
}
