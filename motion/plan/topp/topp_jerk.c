/* motion/plan/topp/topp_jerk.c - see topp_jerk.h. */
#include "motion/plan/topp/topp_jerk.h"

#include <math.h>

#include "motion/core/err.h"
#include "motion/double/double_interval.h"
#include "motion/plan/topp/topp_curve.h"
#include "motion/plan/topp/topp_divide.h"
#include "motion/plan/topp/topp_rows.h"
#include "motion/plan/topp/topp_straight.h"

struct plan_topp_run {
    double start; /* s */
    bool is_straight;
    struct topp_straight straight;
    struct topp_line line;
    struct topp_chain chain; /* else: w over time, and the path over w */
    struct plan_topp curve;
};

struct jerk_plan {
    struct plan_topp_request request; /* of the law's path */
    const double *jerk;
    const enum topp_border *border;
    struct plan_pool *pool;
    struct plan_topp_law *law;
};

/* --- runs -------------------------------------------------------------------- */

static bool jerk_is_capped(const struct plan_topp_request *request, double from,
                           double to)
{
    for (uint32_t i = 0; i < request->cap_count; i++)
        if (request->cap[i].from < to && request->cap[i].to > from)
            return true;
    return false;
}

/* |q'| at a border, of the piece after or before it. */
static double jerk_slope(const struct plan_topp_path *path, uint32_t piece,
                         double s)
{
    double sum = 0;

    for (unsigned k = 0; k < path->axes; k++) {
        double q[4];
        topp_chain_powers(path, piece, k, s, q);
        sum += q[1] * q[1];
    }
    return sqrt(sum);
}

static int jerk_straight(const struct jerk_plan *self, uint32_t first,
                         uint32_t last, double start_speed, double end_speed,
                         struct plan_topp_run *run)
{
    const struct plan_topp_path *path = &self->request.path;
    const double h = path->border[last + 1] - path->border[last];
    struct topp_line_limit limit;

    topp_straight_limit(&run->straight, path->axes, self->request.limit,
                        self->jerk, &limit);
    return topp_line_plan(&limit, run->straight.length,
                          start_speed * jerk_slope(path, first, 0),
                          end_speed * jerk_slope(path, last, h), &run->line);
}

static int jerk_curve(const struct jerk_plan *self, uint32_t first,
                      uint32_t last, struct plan_topp_run *run)
{
    topp_chain_init(&run->chain, &self->request, first, last);
    return topp_curve_solve(&run->chain, &self->request, self->jerk, self->pool,
                            &run->curve);
}

/* Whether pieces first .. last are a straight line without a cap. */
static bool jerk_is_straight(const struct jerk_plan *self, uint32_t first,
                             uint32_t last, struct topp_straight *straight)
{
    const struct plan_topp_path *path = &self->request.path;

    return !jerk_is_capped(&self->request, path->border[first],
                           path->border[last + 1]) &&
           topp_straight_of(path, first, last, straight);
}

/* Pieces first .. last without a stop between. */
static int jerk_run(struct jerk_plan *self, uint32_t first, uint32_t last)
{
    const struct plan_topp_request *request = &self->request;
    const uint32_t all = request->path.pieces;
    const double start = first == 0 ? request->start_speed : 0;
    const double end = last + 1 == all ? request->end_speed : 0;
    struct plan_topp_law *law = self->law;
    struct plan_topp_run *run = &law->run[law->runs];
    int err;

    *run = (struct plan_topp_run){ .start = law->duration };
    run->is_straight = jerk_is_straight(self, first, last, &run->straight);
    err = run->is_straight ? jerk_straight(self, first, last, start, end, run)
                           : jerk_curve(self, first, last, run);
    if (err < 0)
        return err;
    law->duration += run->is_straight ? topp_line_duration(&run->line)
                                      : plan_topp_duration(&run->curve);
    law->runs++;
    return MOTION_OK;
}

/* No motion from rest to rest over a piece is shorter: what the axis that takes longest
 * takes from one end to the other. */
static double jerk_least(const struct jerk_plan *self, uint32_t piece)
{
    const struct plan_topp_path *path = &self->request.path;
    const double h = path->border[piece + 1] - path->border[piece];
    double most = 0;

    for (unsigned k = 0; k < path->axes; k++) {
        const struct plan_topp_limit *limit = &self->request.limit[k];
        double from[4], to[4];
        struct topp_line line;
        topp_chain_powers(path, piece, k, 0, from);
        topp_chain_powers(path, piece, k, h, to);
        const bool is_up = to[0] > from[0];
        const struct topp_line_limit along = {
            is_up ? limit->vel_max : -limit->vel_min,
            is_up ? limit->acc_max : -limit->acc_min,
            is_up ? -limit->acc_min : limit->acc_max, self->jerk[k]
        };
        if (topp_line_plan(&along, fabs(to[0] - from[0]), 0, 0, &line) ==
            MOTION_OK)
            most = fmax(most, topp_line_duration(&line));
    }
    return most;
}

/* Pieces first .. last with a stop at every border between. */
static int jerk_pieces(struct jerk_plan *self, uint32_t first, uint32_t last)
{
    int err = MOTION_OK;

    for (uint32_t i = first; err == MOTION_OK && i <= last; i++)
        err = jerk_run(self, i, i);
    return err;
}

/* Pieces first .. last without a stop that is asked for.  What is found for a curve is a
 * local minimum, or where a corner of a micrometre is between lines of a metre far from
 * one: where stops at all borders could be faster they are tried. */
static int jerk_stretch(struct jerk_plan *self, uint32_t first, uint32_t last)
{
    struct plan_topp_law *law = self->law;
    const struct plan_topp_law before = *law;
    double least = before.duration, duration;
    struct plan_topp_run whole;
    int err = jerk_run(self, first, last);

    for (uint32_t i = first; i <= last; i++)
        least += jerk_least(self, i);
    whole = law->run[before.runs];
    duration = law->duration;
    if (err < 0 || first == last || whole.is_straight || least >= duration)
        return err;
    law->runs = before.runs;
    law->duration = before.duration;
    if (jerk_pieces(self, first, last) == MOTION_OK && law->duration < duration)
        return MOTION_OK;
    law->runs = before.runs + 1;
    law->duration = duration;
    law->run[before.runs] = whole;
    return MOTION_OK;
}

/* Pieces first .. last between two stops: straight, or divided further where q''
 * steps. */
static int jerk_between(struct jerk_plan *self, uint32_t first, uint32_t last,
                        double *failed)
{
    const struct plan_topp_path *path = &self->request.path;
    struct topp_straight straight;
    uint32_t from = first;
    int err = MOTION_OK;

    *failed = path->border[first];
    if (first == last && topp_divide_is_still(path, first))
        return MOTION_OK;
    if (jerk_is_straight(self, first, last, &straight))
        return jerk_stretch(self, first, last);
    for (uint32_t i = first; err == MOTION_OK && i <= last; i++) {
        if (i < last && self->border[i + 1] == TOPP_BORDER_SMOOTH)
            continue;
        *failed = path->border[from];
        err = jerk_stretch(self, from, i);
        from = i + 1;
    }
    return err;
}

/* --- all --------------------------------------------------------------------- */

static int jerk_solve(struct jerk_plan *self, double *failed)
{
    const uint32_t pieces = self->request.path.pieces;
    uint32_t first = 0;
    int err = MOTION_OK;

    self->law->run = plan_pool_take(self->pool, pieces, sizeof *self->law->run);
    if (self->law->run == NULL)
        return MOTION_E_FULL;
    for (uint32_t i = 0; err == MOTION_OK && i < pieces; i++) {
        if (self->border[i + 1] != TOPP_BORDER_STOP)
            continue;
        err = jerk_between(self, first, i, failed);
        first = i + 1;
    }
    return err;
}

/* No cap is 0 over more than a point. */
static int jerk_check(const struct plan_topp_request *request,
                      const double jerk[])
{
    const int err = topp_check(request);
    const size_t powers = (size_t)request->path.pieces * request->path.axes *
                          (request->path.degree + 1);

    if (err < 0)
        return err;
    for (unsigned k = 0; k < request->path.axes; k++)
        if (!isfinite(jerk[k]) || !(jerk[k] > 0))
            return MOTION_E_ARG;
    for (size_t i = 0; i < powers; i++)
        if (!isfinite(request->path.coef[i]))
            return MOTION_E_ARG;
    for (uint32_t i = 0; i < request->cap_count; i++)
        if (request->cap[i].speed == 0 &&
            request->cap[i].from != request->cap[i].to)
            return MOTION_E_ARG;
    return MOTION_OK;
}

int plan_topp_jerk_solve(const struct plan_topp_request *request,
                         const double jerk[], struct plan_pool *pool,
                         struct plan_topp_law *law, double *failed)
{
    struct jerk_plan self = { .jerk = jerk, .pool = pool, .law = law };
    struct plan_pool scratch = { NULL };
    int err = jerk_check(request, jerk);

    *law = (struct plan_topp_law){ 0 };
    *failed = NAN;
    if (err == MOTION_OK)
        err = topp_divide(request, pool, &self.request);
    if (err == MOTION_OK) {
        law->path = self.request.path;
        self.border = topp_divide_borders(&self.request, &scratch);
        err = self.border != NULL ? jerk_solve(&self, failed) : MOTION_E_FULL;
    }
    plan_pool_free(&scratch);
    if (err == MOTION_OK)
        *failed = NAN;
    else
        *law = (struct plan_topp_law){ 0 };
    return err;
}

/* --- reading ----------------------------------------------------------------- */

static const struct plan_topp_run *jerk_find(const struct plan_topp_law *law,
                                             double t_s)
{
    return &law->run[double_interval_find(&law->run->start, sizeof *law->run,
                                          law->runs, t_s)];
}

static void jerk_on_line(const struct plan_topp_run *run, unsigned axes,
                         double t_s, struct plan_topp_axis_state axis[])
{
    struct topp_line_state at;

    topp_line_at(&run->line, t_s, &at);
    for (unsigned k = 0; k < axes; k++) {
        const double d = run->straight.along[k];
        axis[k] =
            (struct plan_topp_axis_state){ run->straight.start[k] + d * at.pos,
                                           d * at.vel, d * at.acc,
                                           d * at.jerk };
    }
}

uint32_t plan_topp_law_knots(const struct plan_topp_law *law, uint32_t run,
                             double knot[])
{
    const struct plan_topp_run *self = &law->run[run];
    const uint32_t count =
        (self->is_straight ? TOPP_LINE_PHASES : self->curve.intervals) + 1;
    double t = self->start;

    for (uint32_t i = 0; knot != NULL && i < count; i++) {
        knot[i] = self->is_straight ? t : self->start + self->curve.t[i];
        if (self->is_straight && i + 1 < count)
            t += self->line.dur[i];
    }
    return count;
}

static uint32_t jerk_piece(const struct topp_chain *chain, double s)
{
    const double *border = chain->path.border;

    return chain->first +
           double_interval_find(border + chain->first, sizeof *border,
                                chain->last + 1 - chain->first, s);
}

static void jerk_on_curve(const struct plan_topp_run *run, double t_s,
                          struct plan_topp_axis_state axis[])
{
    struct plan_topp_state at;
    double s[4];

    plan_topp_at(&run->curve, t_s, &at);
    topp_chain_s(&run->chain, fmin(at.s, 1), s);
    const uint32_t piece = jerk_piece(&run->chain, s[0]);
    for (unsigned k = 0; k < run->chain.path.axes; k++) {
        double r[4];
        topp_chain_axis(&run->chain, piece, k, s, r);
        axis[k] = (struct plan_topp_axis_state){
            r[0], r[1] * at.vel, r[1] * at.acc + r[2] * at.vel * at.vel,
            r[1] * at.jerk + 3 * r[2] * at.vel * at.acc +
                r[3] * at.vel * at.vel * at.vel
        };
    }
}

void plan_topp_law_at(const struct plan_topp_law *law, double t_s,
                      struct plan_topp_axis_state axis[])
{
    const struct plan_topp_run *run;

    if (law->runs == 0) {
        for (unsigned k = 0; k < law->path.axes; k++)
            axis[k] = (struct plan_topp_axis_state){
                .pos = law->path.coef[(size_t)k * (law->path.degree + 1)]
            };
        return;
    }
    t_s = t_s > 0 ? fmin(t_s, law->duration) : 0;
    run = jerk_find(law, t_s);
    if (run->is_straight)
        jerk_on_line(run, law->path.axes, t_s - run->start, axis);
    else
        jerk_on_curve(run, t_s - run->start, axis);
}
