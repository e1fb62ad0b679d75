/* motion/plan/topp/topp.c - see topp.h. */
#include "motion/plan/topp/topp.h"

#include <math.h>
#include <stdbool.h>
#include <string.h>

#include "motion/core/err.h"
#include "motion/plan/topp/topp_divide.h"
#include "motion/plan/topp/topp_rows.h"
#include "motion/plan/topp/topp_time.h"

/* Intervals to begin with where the caller does not say: so many in all, and
 * so many in each piece.  They are doubled until the duration has converged:
 * what is over the optimum falls by 4 each time, so that the last step is three
 * times what is left.  On a path with near-cusps a coarse grid may give any
 * duration, a longer one than a coarser still: one small step proves nothing,
 * two do. */
#define TOPP_INTERVALS       250
#define TOPP_PIECE_INTERVALS 4
#define TOPP_CONVERGED       9e-5
#define TOPP_STEPS           2
#define TOPP_DOUBLINGS       10

/* Slopes that count as none, of the largest on the path, and steps of the slope
 * that count as none, of the slopes: what rounding leaves. */
#define TOPP_STILL  1e-9
#define TOPP_CORNER 1e-6

/* Of the limits, for the sweep from the end: what the sweep from the start must
 * be able to do is then not lost in rounding. */
#define TOPP_MARGIN 2e-8

struct topp {
    const struct plan_topp_request *request; /* with borders at caps */
    struct plan_topp *out;
    uint32_t *piece;    /* of each interval */
    double *low, *high; /* x at grid points from which the end can be reached */
    double (*u)[2];     /* of each interval, from `high` at its start */
    double wanted;      /* intervals */
    double least;       /* in a piece: a short one may hold a whole corner */
    double still;       /* q' in the axes' velocities; below it they stand */
    struct plan_pool *pool, *scratch;
    struct topp_lp lp;
};

/* --- grid -------------------------------------------------------------------- */

static uint32_t topp_share(const struct topp *self, uint32_t piece)
{
    const struct plan_topp_path *path = &self->request->path;
    const double all = path->border[path->pieces] - path->border[0];
    const double part = path->border[piece + 1] - path->border[piece];

    return (uint32_t)fmax(ceil(self->wanted * part / all), self->least);
}

static int topp_allocate(struct topp *self)
{
    struct plan_topp *out = self->out;
    const size_t n = (size_t)out->intervals + 1;

    out->s = plan_pool_take(self->pool, n, sizeof *out->s);
    out->x = plan_pool_take(self->pool, n, sizeof *out->x);
    out->t = plan_pool_take(self->pool, n, sizeof *out->t);
    self->low = plan_pool_take(self->scratch, n, sizeof *self->low);
    self->high = plan_pool_take(self->scratch, n, sizeof *self->high);
    self->u = plan_pool_take(self->scratch, n, sizeof *self->u);
    self->piece = plan_pool_take(self->scratch, n, sizeof *self->piece);
    return out->s && out->x && out->t && self->low && self->high && self->u &&
                   self->piece
               ? MOTION_OK
               : MOTION_E_FULL;
}

static int topp_grid(struct topp *self)
{
    const struct plan_topp_path *path = &self->request->path;
    struct plan_topp *out = self->out;
    uint64_t count = 0;
    uint32_t at = 0;

    for (uint32_t i = 0; i < path->pieces; i++)
        count += topp_share(self, i);
    if (count > PLAN_TOPP_INTERVALS_MAX)
        return MOTION_E_ARG;
    out->intervals = (uint32_t)count;
    if (topp_allocate(self) < 0)
        return MOTION_E_FULL;
    for (uint32_t i = 0; i < path->pieces; i++) {
        const uint32_t parts = topp_share(self, i);
        const double from = path->border[i], to = path->border[i + 1];
        for (uint32_t k = 0; k < parts; k++, at++) {
            out->s[at] = from + (to - from) * k / parts;
            self->piece[at] = i;
        }
    }
    out->s[at] = path->border[path->pieces];
    return MOTION_OK;
}

/* --- what bounds x ---------------------------------------------------------- */

/* q' at s from the border of a piece, of the axis that is nearest to its
 * velocity limit, in s of that velocity: 1 / s' at most. */
static double topp_pace(const struct topp *self, uint32_t piece, double s)
{
    const struct plan_topp_path *path = &self->request->path;
    const double *coef =
        path->coef + (size_t)piece * path->axes * (path->degree + 1);
    double pace = 0;

    for (unsigned k = 0; k < path->axes; k++, coef += path->degree + 1) {
        const struct plan_topp_limit *limit = &self->request->limit[k];
        const double slope = topp_slope(path->degree, coef, s);
        const double share =
            slope / (slope > 0 ? limit->vel_max : limit->vel_min);
        pace = share > pace ? share : pace;
    }
    return pace;
}

/* At share 0 .. 1 of interval i. */
static double topp_pace_in(const struct topp *self, uint32_t i, double share)
{
    const struct plan_topp *out = self->out;
    const double h = out->s[i + 1] - out->s[i];

    return topp_pace(self, self->piece[i],
                     out->s[i] - self->request->path.border[self->piece[i]] +
                         h * share);
}

static double topp_x_of(double pace)
{
    return 1 / (pace * pace);
}

/* All axes stand all along interval i: it takes no time. */
static bool topp_is_still(const struct topp *self, uint32_t i)
{
    return topp_pace_in(self, i, 0) <= self->still &&
           topp_pace_in(self, i, 0.5) <= self->still &&
           topp_pace_in(self, i, 1) <= self->still;
}

/* All axes stand at grid point i, so that s' may step there. */
static bool topp_is_rest(const struct topp *self, uint32_t i)
{
    return (i == 0 || topp_pace_in(self, i - 1, 1) <= self->still) &&
           (i == self->out->intervals ||
            topp_pace_in(self, i, 0) <= self->still);
}

/* The velocity limits, for the coefficients of interval i.  As none is negative,
 * the middle one is at most twice and the others four times what x may be
 * half-way; the rows of the interval then bound it everywhere. */
static void topp_velocity_caps(struct topp *self, uint32_t i)
{
    double *x = self->out->x[i];
    const double half =
        topp_x_of(fmax(topp_pace_in(self, i, 0.5), self->still));

    x[0] = fmin(4 * half, topp_x_of(topp_pace_in(self, i, 0)));
    x[1] = 2 * half;
    x[2] = fmin(4 * half, topp_x_of(topp_pace_in(self, i, 1)));
}

static void topp_cap(struct topp *self, const struct plan_topp_cap *cap)
{
    const struct plan_topp *out = self->out;
    const double x = cap->speed * cap->speed;

    for (uint32_t i = 0; i < out->intervals; i++) {
        const bool begins = cap->from <= out->s[i] && out->s[i] <= cap->to;
        const bool ends =
            cap->from <= out->s[i + 1] && out->s[i + 1] <= cap->to;
        const bool crosses = cap->from < out->s[i + 1] && cap->to > out->s[i];
        if (begins || crosses)
            out->x[i][0] = fmin(out->x[i][0], x);
        if (crosses)
            out->x[i][1] = fmin(out->x[i][1], x);
        if (ends || crosses)
            out->x[i][2] = fmin(out->x[i][2], x);
    }
}

/* Whether q' steps between interval i - 1 and i. */
static bool topp_is_corner(const struct topp *self, uint32_t i)
{
    const struct plan_topp_path *path = &self->request->path;
    const size_t size = path->degree + 1;
    const uint32_t piece = self->piece[i];
    double step = 0, slope = 0;

    if (piece == self->piece[i - 1])
        return false;
    for (unsigned k = 0; k < path->axes; k++) {
        const struct plan_topp_limit *limit = &self->request->limit[k];
        const double v = fmin(limit->vel_max, -limit->vel_min);
        const double *after = path->coef + (piece * path->axes + k) * size;
        const double *before = after - path->axes * size;
        const double in =
            topp_slope(path->degree, before,
                       path->border[piece] - path->border[piece - 1]);
        step = fmax(step, fabs(in - after[1]) / v);
        slope = fmax(slope, fmax(fabs(in), fabs(after[1])) / v);
    }
    return step > fmax(TOPP_CORNER * slope, self->still);
}

/* What velocity limits, caps, corners and ends leave of x. */
static void topp_caps(struct topp *self)
{
    const struct plan_topp_request *request = self->request;
    struct plan_topp *out = self->out;
    const uint32_t last = out->intervals - 1;
    double pace = 0;

    for (uint32_t i = 0; i < out->intervals; i++)
        pace = fmax(pace, topp_pace_in(self, i, 0.5));
    self->still = pace > 0 ? pace * TOPP_STILL : 1;
    for (uint32_t i = 0; i < out->intervals; i++)
        topp_velocity_caps(self, i);
    for (uint32_t k = 0; k < request->cap_count; k++)
        topp_cap(self, &request->cap[k]);
    for (uint32_t i = 1; i < out->intervals; i++)
        if (topp_is_corner(self, i))
            out->x[i - 1][2] = out->x[i][0] = 0;
    if (!topp_is_rest(self, 0))
        out->x[0][0] =
            fmin(out->x[0][0], request->start_speed * request->start_speed);
    if (!topp_is_rest(self, out->intervals))
        out->x[last][2] =
            fmin(out->x[last][2], request->end_speed * request->end_speed);
}

/* --- the two sweeps ----------------------------------------------------------- */

/* Interval i with x at its start from low to high. */
static void topp_interval_rows(struct topp *self, uint32_t i, double low,
                               double high, double share)
{
    const struct plan_topp *out = self->out;
    const struct topp_interval interval = {
        .path = &self->request->path,
        .limit = self->request->limit,
        .piece = self->piece[i],
        .s = out->s[i],
        .h = out->s[i + 1] - out->s[i],
        .low = { low, 0, self->low[i + 1] },
        .high = { high, out->x[i][1], out->x[i][2] },
        .share = share,
    };

    topp_rows(&interval, &self->lp);
}

/* Between which x each grid point must be, from the end on; what is beyond a
 * point of rest does not matter. */
static int topp_backward(struct topp *self, double *failed)
{
    static const double up[TOPP_VARIABLES] = { 1, 0, 0 },
                        down[TOPP_VARIABLES] = { -1, 0, 0 };
    struct plan_topp *out = self->out;
    const uint32_t n = out->intervals;

    self->high[n] = out->x[n - 1][2];
    if (!topp_is_rest(self, n))
        self->low[n] = self->high[n];
    for (uint32_t i = n; i-- > 0;) {
        double x[TOPP_VARIABLES];
        *failed = out->s[i];
        self->high[i] = out->x[i][0];
        if (topp_is_still(self, i))
            continue;
        if (i + 1 == n || !topp_is_rest(self, i + 1))
            out->x[i][2] = fmin(out->x[i][2], self->high[i + 1]);
        else
            self->low[i + 1] = 0;
        topp_interval_rows(self, i, 0, out->x[i][0], 1 - TOPP_MARGIN);
        if (!topp_lp_solve(&self->lp, 3, up, x))
            return MOTION_E_LIMIT;
        self->high[i] = fmax(x[TOPP_X], 0);
        self->u[i][0] = x[TOPP_U0];
        self->u[i][1] = x[TOPP_U1];
        if (self->low[i + 1] == 0)
            continue;
        if (!topp_lp_solve(&self->lp, 3, down, x))
            return MOTION_E_LIMIT;
        self->low[i] = fmin(fmax(x[TOPP_X], 0), self->high[i]);
    }
    return MOTION_OK;
}

/* The rows with x where it is: u0, u1 are left. */
static void topp_fix_x(struct topp_lp *lp, double x)
{
    for (unsigned i = 0; i < lp->count; i++) {
        struct topp_lp_row *row = &lp->row[i];
        row->b -= row->a[TOPP_X] * x;
        row->a[0] = row->a[TOPP_U0];
        row->a[1] = row->a[TOPP_U1];
    }
    for (unsigned j = 0; j < 2; j++) {
        lp->low[j] = lp->low[j + 1];
        lp->high[j] = lp->high[j + 1];
    }
}

/* The largest u0 with u0 + u1 = sum: as fast as can be in between. */
static double topp_first(const struct topp_lp *lp, double u0, double sum)
{
    double most = INFINITY;

    for (unsigned i = 0; i < lp->count; i++) {
        const struct topp_lp_row *row = &lp->row[i];
        const double a = row->a[0] - row->a[1];
        if (a > 0)
            most = fmin(most, (row->b - row->a[1] * sum) / a);
    }
    return isfinite(most) ? fmax(most, u0) : u0;
}

/* Where rounding leaves no answer: what the sweep from the end found, slower.
 * All limits are homogeneous or have rest inside. */
static void topp_slower(const struct topp *self, uint32_t i, double x,
                        double u[2])
{
    const double share = self->high[i] > 0 ? fmin(x / self->high[i], 1) : 0;

    u[0] = self->u[i][0] * share;
    u[1] = self->u[i][1] * share;
}

/* From the start: the largest x that can be reached. */
static void topp_forward(struct topp *self)
{
    static const double up[TOPP_VARIABLES] = { 1, 1 };
    struct plan_topp *out = self->out;
    double x = self->high[0];

    for (uint32_t i = 0; i < out->intervals; i++) {
        const double h = out->s[i + 1] - out->s[i];
        double u[TOPP_VARIABLES];
        if (topp_is_still(self, i)) {
            x = self->high[i + 1];
            continue;
        }
        topp_interval_rows(self, i, x, x, 1);
        topp_fix_x(&self->lp, x);
        const bool is_solved = topp_lp_solve(&self->lp, 2, up, u);
        if (!is_solved)
            topp_slower(self, i, x, u);
        const double sum = u[0] + u[1];
        out->x[i][0] = x;
        if (is_solved)
            u[0] = topp_first(&self->lp, u[0], sum);
        out->x[i][1] = fmax(x + h * u[0], 0);
        out->x[i][2] = fmin(fmax(x + h * sum, 0), out->x[i][2]);
        x = topp_is_rest(self, i + 1) ? self->high[i + 1] : out->x[i][2];
    }
}

/* --- time -------------------------------------------------------------------- */

static int topp_times(struct topp *self, double *failed)
{
    struct plan_topp *out = self->out;

    for (uint32_t i = 0; i < out->intervals; i++) {
        const double dt = topp_is_still(self, i)
                              ? 0
                              : topp_time(out->x[i], out->s[i + 1] - out->s[i]);
        *failed = out->s[i];
        if (!isfinite(dt))
            return MOTION_E_LIMIT;
        out->t[i + 1] = out->t[i] + dt;
    }
    return MOTION_OK;
}

/* --- all ---------------------------------------------------------------------- */

static bool topp_is_positive(double value)
{
    return isfinite(value) && value > 0;
}

int topp_check(const struct plan_topp_request *request)
{
    const struct plan_topp_path *path = &request->path;

    if (path->axes < 1 || path->axes > PLAN_TOPP_AXES_MAX || path->degree < 1 ||
        path->degree > PLAN_TOPP_DEGREE_MAX || path->pieces < 1 ||
        path->pieces > PLAN_TOPP_INTERVALS_MAX ||
        request->intervals > PLAN_TOPP_INTERVALS_MAX)
        return MOTION_E_ARG;
    for (uint32_t i = 0; i < path->pieces; i++)
        if (!topp_is_positive(path->border[i + 1] - path->border[i]))
            return MOTION_E_ARG;
    for (unsigned k = 0; k < path->axes; k++) {
        const struct plan_topp_limit *limit = &request->limit[k];
        if (!topp_is_positive(limit->vel_max) ||
            !topp_is_positive(-limit->vel_min) ||
            !topp_is_positive(limit->acc_max) ||
            !topp_is_positive(-limit->acc_min))
            return MOTION_E_ARG;
    }
    if (!(request->start_speed >= 0) || !(request->end_speed >= 0) ||
        !isfinite(request->start_speed) || !isfinite(request->end_speed))
        return MOTION_E_ARG;
    for (uint32_t i = 0; i < request->cap_count; i++)
        if (!(request->cap[i].speed >= 0))
            return MOTION_E_ARG;
    return MOTION_OK;
}

/* The speed asked for at the start can be braked, and does not keep the path
 * from being as fast as the end asks for. */
static int topp_start(const struct topp *self, double *failed)
{
    const struct plan_topp_request *request = self->request;
    const double x = request->start_speed * request->start_speed;

    *failed = self->out->s[0];
    return topp_is_rest(self, 0) ||
                   (self->high[0] >= x * (1 - 1e-7) && self->low[0] <= x)
               ? MOTION_OK
               : MOTION_E_LIMIT;
}

/* Solve on a grid of about so many intervals, at least so many in a piece. */
static int topp_solve(struct topp *self, double wanted, double least,
                      double *failed)
{
    int err;

    self->wanted = wanted;
    self->least = least;
    self->lp.count = 0;
    err = topp_grid(self);
    if (err == MOTION_OK) {
        topp_caps(self);
        err = topp_backward(self, failed);
    }
    if (err == MOTION_OK)
        err = topp_start(self, failed);
    if (err == MOTION_OK) {
        topp_forward(self);
        err = topp_times(self, failed);
    }
    return err;
}

static int topp_converge(struct topp *self, double *failed)
{
    const uint32_t pieces = self->request->path.pieces;
    double wanted = fmax(TOPP_INTERVALS, (double)TOPP_PIECE_INTERVALS * pieces);
    double least = TOPP_PIECE_INTERVALS;
    int err = topp_solve(self, wanted, least, failed);
    int steps = 0; /* that were small, in a row */

    for (int i = 0; err == MOTION_OK && i < TOPP_DOUBLINGS; i++) {
        const double before = plan_topp_duration(self->out);
        wanted *= 2;
        least *= 2;
        if (wanted + least * pieces > PLAN_TOPP_INTERVALS_MAX)
            break;
        err = topp_solve(self, wanted, least, failed);
        if (err == MOTION_OK && fabs(before - plan_topp_duration(self->out)) >
                                    TOPP_CONVERGED * before)
            steps = 0;
        else if (++steps == TOPP_STEPS)
            break;
    }
    return err;
}

int plan_topp_solve(const struct plan_topp_request *request,
                    struct plan_pool *pool, struct plan_topp *topp,
                    double *failed)
{
    struct plan_topp_request divided;
    struct plan_pool scratch = { NULL };
    struct topp *self;
    int err = topp_check(request);

    *topp = (struct plan_topp){ 0 };
    *failed = NAN;
    if (err < 0)
        return err;
    self = plan_pool_take(&scratch, 1, sizeof *self);
    err =
        self != NULL ? topp_divide(request, &scratch, &divided) : MOTION_E_FULL;
    if (err == MOTION_OK) {
        self->request = &divided;
        self->out = topp;
        self->pool = pool;
        self->scratch = &scratch;
        err = request->intervals > 0
                  ? topp_solve(self, request->intervals, 1, failed)
                  : topp_converge(self, failed);
    }
    if (err == MOTION_OK)
        *failed = NAN;
    else
        *topp = (struct plan_topp){ 0 };
    plan_pool_free(&scratch);
    return err;
}
