/* tests/motion/vectors_jerk_paths.c - jerk_paths.json; see vectors.h.
 *
 * The path is computed here from its definition, in double: the natural spline
 * by its second derivatives, the circle by its sine; a circle is given to the
 * solver as quintics, 512 to the turn.  Judged: the duration against the
 * optimum or between the bounds, the excess over each limit at 100,000 even
 * times, whether velocity, acceleration and jerk are the derivatives of the
 * positions from each of these times to the next, and whether the law begins
 * and ends where the path does. */
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "motion/core/err.h"
#include "motion/plan/topp/topp_jerk.h"
#include "tests/motion/plan/topp/topp_judge.h"
#include "tests/motion/vectors_json.h"

#define WAYPOINTS_MAX 1000
#define ARCS          512
#define POINTS        100000
#define EXCESS        1e-6
#define LOWER_REL     2e-6

struct jerk_case {
    struct plan_topp_path path;
    struct plan_topp_limit limit[PLAN_TOPP_AXES_MAX];
    double jerk[PLAN_TOPP_AXES_MAX];
    struct plan_topp_cap stop[WAYPOINTS_MAX];
    uint32_t stops;
    double start_speed, end_speed;
    double knot[WAYPOINTS_MAX];
    double *q; /* waypoints x axes */
    uint32_t count;
};

static bool allocate(struct jerk_case *c, uint32_t pieces, unsigned degree)
{
    c->path.pieces = pieces;
    c->path.degree = degree;
    c->path.border = calloc(pieces + 1, sizeof *c->path.border);
    c->path.coef = calloc((size_t)pieces * c->path.axes * (degree + 1),
                          sizeof *c->path.coef);
    return c->path.border && c->path.coef;
}

/* --- splines ------------------------------------------------------------------ */

/* Second derivatives m of the natural spline of one axis over waypoints
 * from .. to: (h0 m0 + 2 (h0 + h1) m1 + h1 m2) / 6 = d1 - d0. */
static void natural(const struct jerk_case *c, uint32_t from, uint32_t to,
                    unsigned axis, double m[])
{
    double pivot[WAYPOINTS_MAX] = { 0 };

#define Q(i) c->q[(size_t)(i)*c->path.axes + axis]
    m[from] = m[to] = 0;
    for (uint32_t i = from + 1; i < to; i++) {
        const double h0 = c->knot[i] - c->knot[i - 1];
        const double h1 = c->knot[i + 1] - c->knot[i];
        const double d = 6 * ((Q(i + 1) - Q(i)) / h1 - (Q(i) - Q(i - 1)) / h0);
        const double by =
            2 * (h0 + h1) - (i > from + 1 ? h0 * pivot[i - 1] : 0);
        pivot[i] = h1 / by;
        m[i] = (d - (i > from + 1 ? h0 * m[i - 1] : 0)) / by;
    }
    for (uint32_t i = to; i-- > from + 1;)
        m[i] -= pivot[i] * m[i + 1];
}

static void spline_axis(struct jerk_case *c, uint32_t from, uint32_t to,
                        unsigned axis)
{
    double m[WAYPOINTS_MAX];

    natural(c, from, to, axis, m);
    for (uint32_t i = from; i < to; i++) {
        const double h = c->knot[i + 1] - c->knot[i];
        double *coef = c->path.coef + ((size_t)i * c->path.axes + axis) * 4;
        coef[0] = Q(i);
        coef[1] = (Q(i + 1) - Q(i)) / h - h * (2 * m[i] + m[i + 1]) / 6;
        coef[2] = m[i] / 2;
        coef[3] = (m[i + 1] - m[i]) / (6 * h);
    }
#undef Q
}

static bool spline(struct jerk_case *c)
{
    uint32_t from = 0;

    if (!allocate(c, c->count - 1, 3))
        return false;
    memcpy(c->path.border, c->knot, c->count * sizeof *c->knot);
    for (uint32_t k = 0; k <= c->stops; k++) {
        uint32_t to = c->count - 1;
        for (uint32_t i = from + 1; k < c->stops && i < c->count; i++)
            if (c->knot[i] == c->stop[k].from)
                to = i;
        for (unsigned axis = 0; axis < c->path.axes; axis++)
            spline_axis(c, from, to, axis);
        from = to;
    }
    return true;
}

/* --- circles ------------------------------------------------------------------ */

/* The quintic with these ends, derivatives by u, over h. */
static void quintic(const double a[3], const double b[3], double h,
                    double coef[6])
{
    const double p = b[0] - a[0] - h * a[1] - h * h * a[2] / 2;
    const double v = (b[1] - a[1] - h * a[2]) * h;
    const double s = (b[2] - a[2]) * h * h;

    coef[0] = a[0];
    coef[1] = a[1];
    coef[2] = a[2] / 2;
    coef[3] = (10 * p - 4 * v + s / 2) / pow(h, 3);
    coef[4] = (-15 * p + 7 * v - s) / pow(h, 4);
    coef[5] = (6 * p - 3 * v + s / 2) / pow(h, 5);
}

static bool circle(struct jerk_case *c, const cJSON *json)
{
    const double r = vectors_value_of(json, "radius");
    const double phase = vectors_value_of(json, "phase");
    const double all = vectors_number_at(vectors_get(json, "knots"), 1);
    const uint32_t n = (uint32_t)(ARCS * fmax(1, all / (2 * acos(-1))));

    if (c->path.axes != 2 || !allocate(c, n, 5))
        return false;
    for (uint32_t i = 0; i <= n; i++)
        c->path.border[i] = all * i / n;
    for (uint32_t i = 0; i < n; i++) {
        const double u0 = c->path.border[i] + phase;
        const double u1 = c->path.border[i + 1] + phase;
        for (unsigned k = 0; k < 2; k++) {
            const double turn =
                k ? -acos(0) : 0; /* sin = cos a quarter later */
            const double p = vectors_number_at(vectors_get(json, "centre"), k);
            quintic((double[]){ p + r * cos(u0 + turn), -r * sin(u0 + turn),
                                -r * cos(u0 + turn) },
                    (double[]){ p + r * cos(u1 + turn), -r * sin(u1 + turn),
                                -r * cos(u1 + turn) },
                    u1 - u0, c->path.coef + ((size_t)i * 2 + k) * 6);
        }
    }
    return true;
}

/* --- reading ------------------------------------------------------------------ */

static bool read_limits(const cJSON *json, struct jerk_case *c)
{
    static const char *const name[] = { "vmin", "vmax", "amin", "amax",
                                        "jmax" };
    double value[5][PLAN_TOPP_AXES_MAX];

    for (int i = 0; i < 5; i++)
        if (!vectors_numbers(vectors_get(json, name[i]), (int)c->path.axes,
                             value[i]))
            return false;
    for (unsigned k = 0; k < c->path.axes; k++) {
        c->limit[k] = (struct plan_topp_limit){ value[0][k], value[1][k],
                                                value[2][k], value[3][k] };
        c->jerk[k] = value[4][k];
    }
    return true;
}

static bool read_waypoints(const cJSON *json, struct jerk_case *c)
{
    const cJSON *rows = vectors_get(json, "waypoints");
    const int n = cJSON_GetArraySize(rows);

    if (n < 2 || n > WAYPOINTS_MAX ||
        !vectors_numbers(vectors_get(json, "knots"), n, c->knot))
        return false;
    c->count = (uint32_t)n;
    c->q = calloc((size_t)n * c->path.axes, sizeof *c->q);
    for (int i = 0; c->q != NULL && i < n; i++)
        if (!vectors_numbers(cJSON_GetArrayItem(rows, i), (int)c->path.axes,
                             c->q + (size_t)i * c->path.axes))
            return false;
    return c->q != NULL;
}

static bool read_stops(const cJSON *json, struct jerk_case *c)
{
    const cJSON *item;

    cJSON_ArrayForEach(item, vectors_get(json, "stops"))
    {
        const double at = vectors_value(item);
        if (!(at > 0 && at < c->count - 1) || c->stops == WAYPOINTS_MAX)
            return false;
        const double s = c->knot[(uint32_t)at];
        c->stop[c->stops++] = (struct plan_topp_cap){ s, s, 0 };
    }
    return true;
}

static bool read_case(const cJSON *json, struct jerk_case *c)
{
    const double axes = vectors_value_of(json, "dof");

    if (!(axes >= 1 && axes <= PLAN_TOPP_AXES_MAX))
        return false;
    c->path.axes = (unsigned)axes;
    c->start_speed = vectors_value_of(json, "start_path_speed");
    c->end_speed = vectors_value_of(json, "end_path_speed");
    if (!read_limits(json, c))
        return false;
    if (strcmp(vectors_text(json, "kind"), "circle") == 0)
        return circle(c, json);
    return read_waypoints(json, c) && read_stops(json, c) && spline(c);
}

/* --- judging ------------------------------------------------------------------ */

static bool judge(const cJSON *json, const struct plan_topp_request *request,
                  const double jerk[], const struct plan_topp_law *law,
                  struct vectors_row *row)
{
    const double t = law->duration,
                 excess = topp_judge_law(request, jerk, law, POINTS);
    const double want = vectors_value_of(json, "duration");

    if (isfinite(want)) {
        const double tol = vectors_value_of(json, "tol_rel");
        snprintf(row->text, sizeof row->text,
                 "%.9f s, optimum %+.2g, excess %.2g", t, t / want - 1, excess);
        return fabs(t / want - 1) <= tol && excess <= EXCESS;
    }
    const double lower = vectors_value_of(json, "duration_lower");
    const double upper = vectors_value_of(json, "duration_upper");
    snprintf(row->text, sizeof row->text,
             "%.9f s, lower %+.4f, best %+.4f, upper %+.4f, excess %.2g", t,
             t / lower - 1, t / vectors_value_of(json, "duration_best") - 1,
             t / upper - 1, excess);
    return t >= lower * (1 - LOWER_REL) && t <= upper && excess <= EXCESS;
}

static int run(const cJSON *json, struct jerk_case *c, struct vectors_row *row)
{
    const struct plan_topp_request request = {
        .path = c->path,
        .limit = c->limit,
        .cap = c->stop,
        .cap_count = c->stops,
        .start_speed = c->start_speed,
        .end_speed = c->end_speed,
    };
    struct plan_pool pool = { NULL };
    struct plan_topp_law law;
    double failed;
    const int err =
        plan_topp_jerk_solve(&request, c->jerk, &pool, &law, &failed);

    if (err == MOTION_OK)
        row->pass = judge(json, &request, c->jerk, &law, row);
    else
        snprintf(row->text, sizeof row->text, "%s at u = %g",
                 motion_err_text(err), failed);
    plan_pool_free(&pool);
    return err;
}

int vectors_jerk_paths(const cJSON *file, struct vectors_row *rows,
                       int capacity)
{
    const cJSON *json;
    int n = 0;

    cJSON_ArrayForEach(json, vectors_get(file, "cases"))
    {
        struct jerk_case *c = calloc(1, sizeof *c);
        struct vectors_row *row = &rows[n];
        bool is_read;
        if (c == NULL || n == capacity) {
            free(c);
            return -1;
        }
        *row = (struct vectors_row){ .cases = 1 };
        snprintf(row->method, sizeof row->method, "%.*s",
                 (int)sizeof row->method - 1, vectors_text(json, "name"));
        is_read = read_case(json, c);
        if (is_read)
            run(json, c, row);
        n++;
        free(c->path.border);
        free(c->path.coef);
        free(c->q);
        free(c);
        if (!is_read) {
            fprintf(stderr, "%s: cannot be read\n", row->method);
            return -1;
        }
    }
    return n;
}
