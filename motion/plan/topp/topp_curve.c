/* motion/plan/topp/topp_curve.c - see topp_curve.h. */
#include "motion/plan/topp/topp_curve.h"

#include <math.h>
#include <string.h>

#include "motion/core/err.h"
#include "motion/plan/topp/topp_bound.h"
#include "motion/plan/topp/topp_grid.h"
#include "motion/plan/topp/topp_time.h"

/* Each grid: intervals in all and in a piece at least; up to what share of the
 * time the barrier may cost at the end. */
static const struct {
    double intervals, per_piece, gap;
} curve_grid[] = {
    { 150, 4, 1e-2 },
    { 600, 6, 1e-3 },
    { 1500, 8, 1e-5 },
};
/* A stretch of a path has its part of them, and at least this. */
#define CURVE_PART 0.2

#define CURVE_GRIDS (sizeof curve_grid / sizeof curve_grid[0])

/* A bound of the work: intervals times axes. */
#define CURVE_WORK_MAX 4000000

/* From one weight of the barrier to the next. */
#define CURVE_WEIGHT 0.2

/* Speed of the uniform law, of the largest; w' at most, of the uniform law's:
 * sections that cost less than this of the time need not be faster. */
#define CURVE_SLOW 0.9
#define CURVE_FAST 1e4

/* What is over a limit between points is stretched away when it is less than
 * this; before that so many times limits are tightened where it is more, and
 * the barrier begins again with this gap. */
#define CURVE_OVER      1e-5
#define CURVE_AHEAD     1.5
#define CURVE_TIGHTENED 6
#define CURVE_BEGINS    2e-4

/* Of all limits, of what is over them in velocity, three times that in jerk. */
#define CURVE_AHEAD_ALL 4

/* The gap of the barrier while a law is led to its speeds. */
#define CURVE_LEADS 0.1

/* Parts of an interval in which the uniform law is looked at; what rounding
 * leaves. */
#define CURVE_PARTS    8
#define CURVE_ROUNDING 2e-8

struct curve {
    const struct topp_chain *chain;
    const struct plan_topp_request *request;
    const double *jerk;
    struct topp_barrier_limit limit[PLAN_TOPP_AXES_MAX];
    double unit; /* of time, in s */
    double part; /* of all intervals that this stretch has */
    struct topp_barrier barrier;
    struct topp_grid grid;
    double *cap; /* of s' in each interval */
    struct plan_pool scratch, *pool;
};

/* --- limits ------------------------------------------------------------------ */

static double curve_share(double value, double min, double max)
{
    return value > 0 ? value / max : value / min;
}

/* At w, of w' = 1 and no w'', in s. */
static double curve_uniform_at(const struct curve *self, uint32_t piece,
                               double w)
{
    struct topp_shares shares = { 0 };
    double s[4];

    topp_chain_s(self->chain, w, s);
    for (unsigned k = 0; k < self->request->path.axes; k++) {
        const struct plan_topp_limit *limit = &self->request->limit[k];
        double r[4];
        topp_chain_axis(self->chain, piece, k, s, r);
        shares.vel =
            fmax(shares.vel, curve_share(r[1], limit->vel_min, limit->vel_max));
        shares.acc =
            fmax(shares.acc, curve_share(r[2], limit->acc_min, limit->acc_max));
        shares.jerk = fmax(shares.jerk, fabs(r[3]) / self->jerk[k]);
    }
    for (uint32_t k = 0; k < self->request->cap_count; k++) {
        const struct plan_topp_cap *cap = &self->request->cap[k];
        if (cap->from <= s[0] && s[0] <= cap->to && cap->speed > 0)
            shares.vel = fmax(shares.vel, s[1] / cap->speed);
    }
    return topp_bound_stretch(&shares);
}

/* The unit of time is that in which the uniform law takes 1. */
static void curve_unit(struct curve *self)
{
    double slowest = 0;

    for (uint32_t i = 0; i < self->grid.intervals; i++)
        for (unsigned k = 0; k <= CURVE_PARTS; k++)
            slowest = fmax(slowest, curve_uniform_at(self, self->grid.piece[i],
                                                     self->grid.w[i] +
                                                         (self->grid.w[i + 1] -
                                                          self->grid.w[i]) *
                                                             k / CURVE_PARTS));
    self->unit = slowest / CURVE_SLOW;
}

static void curve_limits(struct curve *self)
{
    const double t = self->unit;

    for (unsigned k = 0; k < self->request->path.axes; k++) {
        const struct plan_topp_limit *limit = &self->request->limit[k];
        self->limit[k] = (struct topp_barrier_limit){
            limit->vel_min * t,        limit->vel_max * t,
            limit->acc_min * t * t,    limit->acc_max * t * t,
            self->jerk[k] * t * t * t,
        };
    }
}

/* z at an end of the stretch, as the chain is linear there; 0 at rest. */
static double curve_held(const struct curve *self,
                         const struct topp_chain_end *end)
{
    const double w = end->speed * self->unit / self->chain->scale;

    return w * w;
}

/* Of z anywhere. */
static double curve_most(const struct curve *self)
{
    const double held = fmax(curve_held(self, &self->chain->start),
                             curve_held(self, &self->chain->end));

    return fmax(CURVE_FAST * CURVE_FAST, 4 * held);
}

/* The least cap of s' on each interval. */
static void curve_caps(struct curve *self)
{
    const struct plan_topp_request *request = self->request;

    for (uint32_t i = 0; i < self->grid.intervals; i++) {
        double from[4], to[4];
        topp_chain_s(self->chain, self->grid.w[i], from);
        topp_chain_s(self->chain, self->grid.w[i + 1], to);
        self->cap[i] = INFINITY;
        for (uint32_t k = 0; k < request->cap_count; k++) {
            const struct plan_topp_cap *cap = &request->cap[k];
            if (cap->from < to[0] && cap->to > from[0])
                self->cap[i] = fmin(self->cap[i], cap->speed * self->unit);
        }
    }
}

/* --- laws on a grid ---------------------------------------------------------- */

/* z of another grid at w, where interval i of it is at or before. */
static double curve_z(const struct topp_barrier *from, uint32_t *i, double w)
{
    double z[3], x;

    while (*i + 1 < from->intervals && from->w[*i + 1] <= w)
        ++*i;
    topp_barrier_z(from, *i, z);
    x = (w - from->w[*i]) / (from->w[*i + 1] - from->w[*i]);
    return (z[0] * (1 - x) + 2 * z[1] * x) * (1 - x) + z[2] * x * x;
}

/* A spline's coefficient is near its value in the middle of an interval. */
static void curve_carry(const struct topp_barrier *from,
                        struct topp_barrier *to)
{
    const uint32_t n = to->intervals;
    uint32_t i = 0;

    to->z[0] = curve_z(from, &i, 0);
    for (uint32_t k = 0; k < n; k++)
        to->z[k + 1] = curve_z(from, &i, (to->w[k] + to->w[k + 1]) / 2);
    to->z[n + 1] = curve_z(from, &i, 1);
    if (to->start > 0)
        to->z[1] = to->z[0];
    if (to->end > 0)
        to->z[n] = to->z[n + 1];
}

/* Slower until it is inside. */
static bool curve_slow_down(struct topp_barrier *barrier)
{
    for (int k = 0; k < 400; k++) {
        if (topp_barrier_is_inside(barrier))
            return true;
        for (uint32_t i = 0; i < barrier->intervals + 2; i++)
            barrier->z[i] *= 0.97;
    }
    return false;
}

static double curve_duration(const struct topp_barrier *barrier)
{
    double sum = 0;

    for (uint32_t i = 0; i < barrier->intervals; i++)
        sum += topp_grid_time(barrier, i);
    return sum;
}

static void curve_scale_limits(struct topp_barrier *barrier, double share)
{
    for (uint32_t i = 0; i < barrier->intervals; i++)
        topp_barrier_tighten(barrier, i, share);
}

/* Of the barrier, for a gap of the whole time. */
static double curve_weight(const struct topp_barrier *barrier)
{
    return curve_duration(barrier) / (4 * barrier->axes + 1);
}

/* Down to a gap between the time and its minimum on this grid. */
static void curve_descend(struct topp_barrier *barrier, double *gap, double to)
{
    for (;;) {
        topp_barrier_center(barrier, *gap * curve_weight(barrier));
        if (*gap <= to)
            return;
        *gap = fmax(*gap * CURVE_WEIGHT, to);
    }
}

static bool curve_is_held(const struct curve *self)
{
    return self->chain->start.speed > 0 || self->chain->end.speed > 0;
}

/* The barrier of the grid, with z to be filled in. */
static int curve_barrier(struct curve *self, struct topp_barrier *barrier)
{
    int err;

    self->cap =
        plan_pool_take(&self->scratch, self->grid.intervals, sizeof *self->cap);
    if (self->cap == NULL)
        return MOTION_E_FULL;
    curve_caps(self);
    barrier->pool = &self->scratch;
    err = topp_barrier_init(barrier, self->chain, self->limit,
                            self->grid.intervals, self->grid.w,
                            self->grid.piece, self->cap, curve_most(self));
    if (err == MOTION_OK &&
        !topp_barrier_hold(barrier, curve_held(self, &self->chain->start),
                           curve_held(self, &self->chain->end)))
        err = MOTION_E_LIMIT;
    return err;
}

static void curve_uniform(struct topp_barrier *barrier)
{
    for (uint32_t i = 0; i < barrier->intervals + 2; i++)
        barrier->z[i] = 1;
}

/* The first grid, with the uniform law. */
static int curve_first(struct curve *self)
{
    int err =
        topp_grid_even(self->chain, curve_grid[0].intervals * self->part,
                       curve_grid[0].per_piece, &self->scratch, &self->grid);

    if (err < 0)
        return err;
    curve_unit(self);
    curve_limits(self);
    err = curve_barrier(self, &self->barrier);
    if (err == MOTION_OK)
        curve_uniform(&self->barrier);
    return err;
}

static int curve_refine(struct curve *self, double intervals, double per_piece)
{
    struct topp_barrier next = { 0 };
    int err;

    err = topp_grid_by_time(&self->barrier, intervals, per_piece,
                            &self->scratch, &self->grid);
    if (err == MOTION_OK)
        err = curve_barrier(self, &next);
    if (err != MOTION_OK)
        return err;
    curve_carry(&self->barrier, &next);
    self->barrier = next;
    return MOTION_OK;
}

/* --- what is over the limits between points ---------------------------------- */

static void curve_interval(const struct curve *self, uint32_t i,
                           struct topp_shares *shares)
{
    topp_bound(&self->barrier, i, self->grid.piece[i], self->cap[i], shares);
}

static double curve_over(const struct curve *self)
{
    struct topp_shares shares = { 0 };

    for (uint32_t i = 0; i < self->barrier.intervals; i++)
        curve_interval(self, i, &shares);
    return topp_bound_stretch(&shares);
}

/* Less of the limits on the intervals that are over, by more than they are, as
 * what is over moves to the next; whether any was. */
static bool curve_tighten(struct curve *self)
{
    bool is_over = false;

    for (uint32_t i = 0; i < self->barrier.intervals; i++) {
        struct topp_shares shares = { 1, 1, 1 };
        double most;
        curve_interval(self, i, &shares);
        most = fmax(shares.vel, fmax(shares.acc, shares.jerk));
        if (most <= 1 + CURVE_OVER)
            continue;
        is_over = true;
        topp_barrier_tighten(&self->barrier, i,
                             fmax(1 - CURVE_AHEAD * (most - 1), 0.5));
    }
    return is_over;
}

/* --- all --------------------------------------------------------------------- */

static int curve_output(const struct curve *self, double stretch,
                        struct plan_topp *out)
{
    const struct topp_barrier *barrier = &self->barrier;
    const uint32_t n = barrier->intervals;
    const double unit = self->unit * stretch;

    *out = (struct plan_topp){ .intervals = n };
    out->s = plan_pool_take(self->pool, (size_t)n + 1, sizeof *out->s);
    out->t = plan_pool_take(self->pool, (size_t)n + 1, sizeof *out->t);
    out->x = plan_pool_take(self->pool, n, sizeof *out->x);
    if (out->s == NULL || out->t == NULL || out->x == NULL)
        return MOTION_E_FULL;
    for (uint32_t i = 0; i < n; i++) {
        topp_barrier_z(barrier, i, out->x[i]);
        for (int k = 0; k < 3; k++)
            out->x[i][k] /= unit * unit;
        out->s[i + 1] = barrier->w[i + 1];
        out->t[i + 1] =
            out->t[i] + topp_time(out->x[i], barrier->w[i + 1] - barrier->w[i]);
    }
    return isfinite(out->t[n]) ? MOTION_OK : MOTION_E_LIMIT;
}

/* On one grid. */
static int curve_settle(struct curve *self, double *gap, double to)
{
    if (!curve_slow_down(&self->barrier))
        return MOTION_E_LIMIT;
    if (curve_is_held(self)) {
        *gap = fmax(*gap, CURVE_LEADS);
        if (!topp_barrier_lead(&self->barrier,
                               *gap * curve_weight(&self->barrier)))
            return MOTION_E_LIMIT;
    }
    curve_descend(&self->barrier, gap, to);
    return MOTION_OK;
}

static int curve_law(struct curve *self)
{
    const size_t last = CURVE_GRIDS - 1;
    double gap = 1;
    int err = curve_first(self);

    if (err == MOTION_OK)
        err = curve_settle(self, &gap, curve_grid[0].gap);
    for (size_t k = 1; err == MOTION_OK && k < CURVE_GRIDS; k++) {
        err = curve_refine(self,
                           fmax(curve_grid[k].intervals * self->part,
                                self->request->intervals),
                           curve_grid[k].per_piece);
        if (err == MOTION_OK)
            err = curve_settle(self, &gap, curve_grid[k].gap);
    }
    for (int k = 0; err == MOTION_OK && k < CURVE_TIGHTENED; k++) {
        if (!curve_tighten(self))
            break;
        gap = CURVE_BEGINS;
        err = curve_settle(self, &gap, curve_grid[last].gap);
    }
    return err;
}

/* With a speed held at an end time cannot be stretched: what is over is taken
 * from all limits instead, until nothing is. */
static int curve_run_held(struct curve *self, struct plan_topp *out)
{
    int err = curve_law(self);

    for (int k = 0; err == MOTION_OK && k < CURVE_TIGHTENED; k++) {
        const double over = curve_over(self) - 1;
        double gap = CURVE_BEGINS;
        if (over <= CURVE_ROUNDING)
            return curve_output(self, 1, out);
        curve_scale_limits(&self->barrier, 1 - CURVE_AHEAD_ALL * over);
        err = curve_settle(self, &gap, curve_grid[CURVE_GRIDS - 1].gap);
    }
    return err < 0 ? err : MOTION_E_LIMIT;
}

/* Where rounding leaves no law, the uniform one. */
static int curve_run(struct curve *self, struct plan_topp *out)
{
    int err = curve_law(self);

    if (err == MOTION_OK)
        err =
            curve_output(self, fmax(curve_over(self) + CURVE_ROUNDING, 1), out);
    if (err != MOTION_E_LIMIT)
        return err;
    curve_uniform(&self->barrier);
    return curve_output(self, curve_over(self) + CURVE_ROUNDING, out);
}

int topp_curve_solve(const struct topp_chain *chain,
                     const struct plan_topp_request *request,
                     const double jerk[], struct plan_pool *pool,
                     struct plan_topp *out)
{
    const uint32_t pieces = chain->last - chain->first + 1;
    struct curve self = { .chain = chain,
                          .request = request,
                          .jerk = jerk,
                          .part = fmax((double)pieces / request->path.pieces,
                                       CURVE_PART),
                          .pool = pool };
    int err;

    if ((curve_grid[CURVE_GRIDS - 1].per_piece * pieces + request->intervals) *
            request->path.axes >
        CURVE_WORK_MAX)
        return MOTION_E_WORK;
    err = curve_is_held(&self) ? curve_run_held(&self, out)
                               : curve_run(&self, out);
    plan_pool_free(&self.scratch);
    return err;
}
