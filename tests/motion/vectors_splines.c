/* tests/motion/vectors_splines.c - splines.json; see vectors.h.
 *
 * A case says nothing about its unit, so it is taken in one that makes the
 * largest value about 2^20 units, as micrometres or counts do for a machine: a
 * power of two, which changes no digit.  Where keys are so close that an
 * acceleration would leave the format (2^31 unit/s2), the unit is larger: a
 * machine's accelerations fit.  Times are rounded to 2^-12 ns. */
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "motion/core/err.h"
#include "motion/core/fixed.h"
#include "motion/curve/spline.h"
#include "motion/curve/time_warp.h"
#include "tests/motion/vectors_json.h"

#define TOLERANCE    1e-8
#define UNIT_BITS    20
#define RATE_BITS    29
#define KEYS_MAX     4096
#define SEGMENTS_MAX 65536

/* A case on its way. */
struct spline_case {
    const cJSON *json, *params;
    int scale; /* units = value * 2^scale */
    uint32_t count;
    struct motion_key key[KEYS_MAX];
    struct motion_spline_work work[KEYS_MAX];
    struct motion_segment segment[SEGMENTS_MAX], f_segment[KEYS_MAX],
        w_segment[KEYS_MAX];
    struct motion_track track;
    double dur_s; /* from the first key to the last; 0: not in time */
    double worst[3], largest[3];
};

static struct spline_case the_case; /* large */

/* --- reading ---------------------------------------------------------------- */

static int64_t ticks(double seconds)
{
    return (int64_t)llroundl((long double)seconds * MOTION_FIXED_S_Q12);
}

static int64_t units(const struct spline_case *c, double value)
{
    return (int64_t)llround(ldexp(value, c->scale + 32));
}

static struct motion_real real_of(const struct spline_case *c, double value)
{
    int e;
    const double m = frexp(value, &e);

    return motion_real_make((int64_t)ldexp(m, 60), e - 60 + c->scale);
}

static double size_of(const cJSON *item)
{
    return cJSON_IsNumber(item) ? fabs(item->valuedouble) : 0;
}

/* Of numbers, or of points. */
static double largest_of(const cJSON *list)
{
    const cJSON *item, *part;
    double largest = 0;

    cJSON_ArrayForEach(item, list)
    {
        largest = fmax(largest, size_of(item));
        cJSON_ArrayForEach(part, item)
        {
            largest = fmax(largest, size_of(part));
        }
    }
    return largest;
}

/* Bits left of the point that the largest of a list takes. */
static int bits_of(const cJSON *list)
{
    int e;

    frexp(largest_of(list), &e);
    return e;
}

static void choose_scale(struct spline_case *c, const cJSON *values)
{
    static const char *const rates[] = { "dy", "ddy" };

    c->scale = UNIT_BITS - bits_of(values);
    for (int i = 0; i < 2; i++) {
        const cJSON *rate = vectors_get(c->json, rates[i]);
        if (rate != NULL && RATE_BITS - bits_of(rate) < c->scale)
            c->scale = RATE_BITS - bits_of(rate);
    }
}

/* Keys from lists of times and values; false when they are no keys. */
static bool read_keys(struct spline_case *c, const cJSON *t, const cJSON *p)
{
    c->count = (uint32_t)cJSON_GetArraySize(t);
    if (c->count == 0 || c->count > KEYS_MAX ||
        cJSON_GetArraySize(p) != (int)c->count)
        return false;
    memset(c->key, 0, sizeof c->key);
    for (uint32_t i = 0; i < c->count; i++) {
        c->key[i].t_ns_q12 = ticks(vectors_number_at(t, i));
        c->key[i].pos_q32 = units(c, vectors_number_at(p, i));
    }
    return true;
}

/* --- comparing ---------------------------------------------------------------- */

static void note_error(struct spline_case *c, int order, double got,
                       double want)
{
    const double error = fabs(got - want);

    if (!(error <= c->worst[order])) /* a NaN stays */
        c->worst[order] = error;
    if (fabs(want) > c->largest[order])
        c->largest[order] = fabs(want);
}

static struct motion_state state_at(const struct motion_track *track, int64_t t)
{
    const struct motion_segment *last = &track->segment[track->count - 1];
    struct motion_state state;

    if (t >= track->end_ns_q12)
        motion_segment_state(last, last->dur_ns_q12, &state);
    else
        motion_track_state(track, t, &state);
    return state;
}

/* `rate`: derivatives are asked for with respect to time * rate. */
static void compare_at(struct spline_case *c, const struct motion_state *s,
                       double rate, double y, double dy, double ddy)
{
    note_error(c, 0, ldexp((double)s->pos_q32, -32 - c->scale), y);
    note_error(c, 1, ldexp((double)s->vel_q32, -32 - c->scale) / rate, dy);
    note_error(c, 2, ldexp((double)s->acc_q32, -32 - c->scale) / rate / rate,
               ddy);
}

static bool compare_all(struct spline_case *c, int64_t origin)
{
    const cJSON *x = vectors_get(c->json, "x"), *y = vectors_get(c->json, "y");
    const cJSON *dy = vectors_get(c->json, "dy"),
                *ddy = vectors_get(c->json, "ddy");
    const uint32_t n = (uint32_t)cJSON_GetArraySize(x);

    for (uint32_t i = 0; i < n; i++) {
        const struct motion_state s =
            state_at(&c->track, ticks(vectors_number_at(x, i)) - origin);
        compare_at(c, &s, 1, vectors_number_at(y, i), vectors_number_at(dy, i),
                   vectors_number_at(ddy, i));
    }
    return n > 0;
}

/* --- curves in time ------------------------------------------------------------ */

static void start_track(struct spline_case *c)
{
    motion_track_init(&c->track, c->segment, SEGMENTS_MAX, c->key[0].pos_q32);
}

static int cubic(struct spline_case *c, int rc)
{
    return rc ? rc
              : motion_spline_append_cubic(&c->track, c->key, c->count, NULL);
}

static int run_linear(struct spline_case *c)
{
    return motion_spline_append_linear(&c->track, c->key, c->count, NULL);
}

static int run_lagrange(struct spline_case *c)
{
    return motion_spline_append_lagrange(&c->track, c->key, c->count, NULL,
                                         NULL);
}

static int run_hermite(struct spline_case *c)
{
    const cJSON *tangent = vectors_get(c->params, "tangent");

    for (uint32_t i = 0; i < c->count; i++) {
        c->key[i].vel = real_of(c, vectors_number_at(tangent, i));
        c->key[i].has_vel = true;
    }
    return cubic(c, MOTION_OK);
}

static int run_cardinal(struct spline_case *c)
{
    const double mu = cJSON_GetNumberValue(vectors_get(c->params, "mu"));

    return cubic(c, motion_spline_tangents_cardinal(
                        c->key, c->count, llround(ldexp(mu, 32)),
                        MOTION_SPLINE_ONE_SIDED, MOTION_SPLINE_ONE_SIDED));
}

static int run_catmull_rom(struct spline_case *c)
{
    return cubic(c, motion_spline_tangents_parabola(c->key, c->count,
                                                    MOTION_SPLINE_ONE_SIDED,
                                                    MOTION_SPLINE_ONE_SIDED));
}

static int run_pchip(struct spline_case *c)
{
    return cubic(c, motion_spline_monotone(c->key, c->count,
                                           MOTION_SPLINE_ONE_SIDED,
                                           MOTION_SPLINE_ONE_SIDED));
}

static int run_akima(struct spline_case *c)
{
    return cubic(c,
                 motion_spline_akima(c->key, c->count, MOTION_SPLINE_ONE_SIDED,
                                     MOTION_SPLINE_ONE_SIDED));
}

static const struct {
    const char *name;
    enum motion_spline_end end;
} rules[] = {
    { "natural", MOTION_SPLINE_NATURAL },
    { "clamped", MOTION_SPLINE_REST },
    { "rest", MOTION_SPLINE_REST },
    { "not-a-knot", MOTION_SPLINE_NOT_A_KNOT },
    { "periodic", MOTION_SPLINE_PERIODIC },
};

static bool read_rule(const char *name, enum motion_spline_end *end)
{
    for (size_t i = 0; i < sizeof rules / sizeof rules[0]; i++)
        if (strcmp(rules[i].name, name) == 0) {
            *end = rules[i].end;
            return true;
        }
    return false;
}

/* A rule's name, or ["velocity" or "acceleration", number] for this key. */
static bool read_end(const struct spline_case *c, const cJSON *bc,
                     struct motion_key *key, enum motion_spline_end *end)
{
    const char *what = vectors_string(cJSON_GetArrayItem(bc, 0));

    if (cJSON_IsString(bc))
        return read_rule(vectors_string(bc), end);
    if (isnan(vectors_number_at(bc, 1)))
        return false;
    *end = MOTION_SPLINE_NATURAL;
    key->has_vel = strcmp(what, "velocity") == 0;
    key->has_acc = strcmp(what, "acceleration") == 0;
    key->vel = key->acc = real_of(c, vectors_number_at(bc, 1));
    return key->has_vel || key->has_acc;
}

static bool read_ends(struct spline_case *c, enum motion_spline_end ends[2])
{
    const cJSON *bc = vectors_get(c->json, "bc");
    const bool one = cJSON_IsString(bc);

    return read_end(c, one ? bc : vectors_get(bc, "start"), &c->key[0],
                    &ends[0]) &&
           read_end(c, one ? bc : vectors_get(bc, "end"), &c->key[c->count - 1],
                    &ends[1]);
}

static int run_c2(struct spline_case *c)
{
    enum motion_spline_end ends[2];

    if (!read_ends(c, ends))
        return MOTION_E_ARG;
    return cubic(c,
                 motion_spline_c2(c->key, c->count, ends[0], ends[1], c->work));
}

static int run_c4(struct spline_case *c)
{
    enum motion_spline_end ends[2];
    int rc;

    if (!read_ends(c, ends))
        return MOTION_E_ARG;
    rc = motion_spline_c4(c->key, c->count, ends[0], ends[1], c->work);
    return rc ? rc
              : motion_spline_append_quintic(&c->track, c->key, c->count, NULL);
}

static int run_constraints(struct spline_case *c)
{
    const cJSON *order = vectors_get(c->params, "key_order");

    for (uint32_t i = 0; i < c->count; i++) {
        const double n = vectors_number_at(order, i);
        const double v = vectors_number_at(vectors_get(c->params, "v"), i);
        const double a = vectors_number_at(vectors_get(c->params, "a"), i);
        c->key[i].has_vel = n >= 2 && !isnan(v);
        c->key[i].has_acc = n >= 3 && !isnan(a);
        if (c->key[i].has_vel)
            c->key[i].vel = real_of(c, v);
        if (c->key[i].has_acc)
            c->key[i].acc = real_of(c, a);
    }
    return motion_spline_append_constraints(&c->track, c->key, c->count, NULL);
}

/* f is a natural C2 spline over params f_t, f_p; w is pchip through (t, p). */
static int run_time_warp(struct spline_case *c)
{
    const int64_t origin =
        ticks(vectors_number_at(vectors_get(c->params, "f_t"), 0));
    struct motion_track f, w;
    struct motion_state start;
    int rc;

    if (strcmp(vectors_text(c->params, "f"), "cubic_c2 natural") != 0 ||
        strncmp(vectors_text(c->params, "w"), "pchip", 5) != 0)
        return MOTION_E_ARG;
    for (uint32_t i = 0; i < c->count; i++)
        c->key[i].pos_q32 = motion_time_warp_ms(
            ticks(vectors_number_at(vectors_get(c->json, "p"), i)) - origin);
    motion_track_init(&w, c->w_segment, KEYS_MAX, c->key[0].pos_q32);
    rc = motion_spline_monotone(c->key, c->count, MOTION_SPLINE_ONE_SIDED,
                                MOTION_SPLINE_ONE_SIDED);
    if (rc == MOTION_OK)
        rc = motion_spline_append_cubic(&w, c->key, c->count, NULL);
    if (rc != MOTION_OK)
        return rc;
    choose_scale(c, vectors_get(c->params, "f_p"));
    if (!read_keys(c, vectors_get(c->params, "f_t"),
                   vectors_get(c->params, "f_p")))
        return MOTION_E_ARG;
    motion_track_init(&f, c->f_segment, KEYS_MAX, c->key[0].pos_q32);
    rc = motion_spline_c2(c->key, c->count, MOTION_SPLINE_NATURAL,
                          MOTION_SPLINE_NATURAL, c->work);
    if (rc == MOTION_OK)
        rc = motion_spline_append_cubic(&f, c->key, c->count, NULL);
    if (rc != MOTION_OK)
        return rc;
    motion_time_warp_state(&f, &w, 0, &start);
    motion_track_init(&c->track, c->segment, SEGMENTS_MAX, start.pos_q32);
    return motion_time_warp_append(&c->track, &f, &w, NULL);
}

static int run_in_time(struct spline_case *c, int (*run)(struct spline_case *c))
{
    const cJSON *t = vectors_get(c->json, "t"), *p = vectors_get(c->json, "p");
    int rc;

    choose_scale(c, p);
    if (!read_keys(c, t, p))
        return MOTION_E_ARG;
    start_track(c);
    rc = run(c);
    if (rc != MOTION_OK)
        return rc;
    c->dur_s = vectors_number_at(t, cJSON_GetArraySize(t) - 1) -
               vectors_number_at(t, 0);
    return compare_all(c, ticks(vectors_number_at(t, 0))) ? MOTION_OK
                                                          : MOTION_E_ARG;
}

/* --- curves in space -------------------------------------------------------------- */

static double coordinate(const cJSON *points, uint32_t i, int axis)
{
    return vectors_number_at(cJSON_GetArrayItem(points, (int)i), axis);
}

/* Rows of x, y, dy, ddy against the track of one axis. */
static void compare_axis(struct spline_case *c, int axis, double zero)
{
    const cJSON *x = vectors_get(c->json, "x");
    const uint32_t n = (uint32_t)cJSON_GetArraySize(x);

    for (uint32_t i = 0; i < n; i++) {
        const struct motion_state s =
            state_at(&c->track, ticks(vectors_number_at(x, i) - zero));
        compare_at(c, &s, 1, coordinate(vectors_get(c->json, "y"), i, axis),
                   coordinate(vectors_get(c->json, "dy"), i, axis),
                   coordinate(vectors_get(c->json, "ddy"), i, axis));
    }
}

static int run_bezier(struct spline_case *c)
{
    const cJSON *ctrl = vectors_get(c->json, "ctrl");

    if (cJSON_GetArraySize(ctrl) != 4)
        return MOTION_E_ARG;
    choose_scale(c, ctrl);
    for (int axis = 0; axis < 3; axis++) {
        double p[4];
        int rc;

        for (uint32_t i = 0; i < 4; i++)
            p[i] = coordinate(ctrl, i, axis);
        c->count = 2;
        c->key[0] = (struct motion_key){
            .pos_q32 = units(c, p[0]),
            .vel = real_of(c, 3 * (p[1] - p[0])),
        };
        c->key[1] = (struct motion_key){
            .t_ns_q12 = MOTION_FIXED_S_Q12,
            .pos_q32 = units(c, p[3]),
            .vel = real_of(c, 3 * (p[3] - p[2])),
        };
        start_track(c);
        rc = cubic(c, MOTION_OK);
        if (rc != MOTION_OK)
            return rc;
        compare_axis(c, axis, 0);
    }
    return MOTION_OK;
}

static int run_bspline(struct spline_case *c)
{
    const cJSON *ctrl = vectors_get(c->json, "ctrl"),
                *knots = vectors_get(c->params, "knots");

    c->count = (uint32_t)cJSON_GetArraySize(ctrl);
    if (c->count < 4 || c->count > KEYS_MAX ||
        cJSON_GetArraySize(knots) != (int)c->count + 4)
        return MOTION_E_ARG;
    choose_scale(c, ctrl);
    for (int axis = 0; axis < 3; axis++) {
        int64_t start;
        int rc;

        memset(c->key, 0, sizeof c->key);
        for (uint32_t i = 0; i < c->count; i++) {
            c->key[i].t_ns_q12 = ticks(vectors_number_at(knots, i + 2));
            c->key[i].pos_q32 = units(c, coordinate(ctrl, i, axis));
        }
        rc = motion_spline_bspline_start(c->key, c->count, &start);
        if (rc != MOTION_OK)
            return rc;
        motion_track_init(&c->track, c->segment, SEGMENTS_MAX, start);
        rc = motion_spline_append_bspline_open(&c->track, c->key, c->count,
                                               NULL);
        if (rc != MOTION_OK)
            return rc;
        compare_axis(c, axis, vectors_number_at(knots, 3));
    }
    return MOTION_OK;
}

/* Times of the points: a second per point on average. */
static int space_times(struct spline_case *c, const cJSON *p, int64_t *t)
{
    static int64_t pos[3][KEYS_MAX];
    const int64_t *const axes[3] = { pos[0], pos[1], pos[2] };
    const double alpha = cJSON_GetNumberValue(vectors_get(c->params, "alpha"));

    for (int axis = 0; axis < 3; axis++)
        for (uint32_t i = 0; i < c->count; i++)
            pos[axis][i] = units(c, coordinate(p, i, axis));
    if (alpha != 0 && alpha != 0.5 && alpha != 1)
        return MOTION_E_ARG;
    return motion_spline_space(axes, 3, c->count,
                               (enum motion_spline_spacing)(2 * alpha),
                               c->count * MOTION_FIXED_S_Q12, t);
}

/* One span in u = 0 .. 1, up to its own end; derivatives with respect to a
 * parameter that grows by knot_span over it. */
static int compare_span(struct spline_case *c, const cJSON *row, int axis)
{
    const double from = cJSON_GetNumberValue(vectors_get(row, "from_key"));
    const double knots = cJSON_GetNumberValue(vectors_get(row, "knot_span"));
    const cJSON *u = vectors_get(row, "u");
    const uint32_t n = (uint32_t)cJSON_GetArraySize(u);

    if (!(from >= 0) || !(from + 1 < c->count) || !(knots > 0))
        return MOTION_E_ARG;
    const struct motion_segment *segment = &c->track.segment[(uint32_t)from];
    const double dur = (double)segment->dur_ns_q12;
    const double rate = knots / (dur / (double)MOTION_FIXED_S_Q12);
    for (uint32_t i = 0; i < n; i++) {
        struct motion_state s;
        motion_segment_state(
            segment, (int64_t)llround(vectors_number_at(u, i) * dur), &s);
        compare_at(c, &s, rate, coordinate(vectors_get(row, "y"), i, axis),
                   coordinate(vectors_get(row, "dy"), i, axis),
                   coordinate(vectors_get(row, "ddy"), i, axis));
    }
    return n > 0 ? MOTION_OK : MOTION_E_ARG;
}

static int run_catmull_rom_axis(struct spline_case *c, const cJSON *p,
                                const int64_t *t, int axis)
{
    const cJSON *row;
    int rc;

    memset(c->key, 0, sizeof c->key);
    for (uint32_t i = 0; i < c->count; i++) {
        c->key[i].t_ns_q12 = t[i];
        c->key[i].pos_q32 = units(c, coordinate(p, i, axis));
    }
    start_track(c);
    rc = run_catmull_rom(c);
    cJSON_ArrayForEach(row, vectors_get(c->json, "segments"))
    {
        if (rc == MOTION_OK)
            rc = compare_span(c, row, axis);
    }
    return rc;
}

static int run_catmull_rom_3d(struct spline_case *c)
{
    static int64_t t[KEYS_MAX];
    const cJSON *p = vectors_get(c->json, "p");
    int rc;

    c->count = (uint32_t)cJSON_GetArraySize(p);
    if (c->count < 2 || c->count > KEYS_MAX)
        return MOTION_E_ARG;
    choose_scale(c, p);
    rc = space_times(c, p, t);
    for (int axis = 0; rc == MOTION_OK && axis < 3; axis++)
        rc = run_catmull_rom_axis(c, p, t, axis);
    return rc;
}

/* --- all ------------------------------------------------------------------------ */

static const struct {
    const char *method;
    bool in_time;
    int (*run)(struct spline_case *c);
} methods[] = {
    { "linear", true, run_linear },
    { "lagrange", true, run_lagrange },
    { "hermite", true, run_hermite },
    { "cardinal", true, run_cardinal },
    { "catmull_rom_nonuniform", true, run_catmull_rom },
    { "cubic_c2", true, run_c2 },
    { "pchip", true, run_pchip },
    { "akima", true, run_akima },
    { "spline_k5", true, run_c4 },
    { "key_constraints", true, run_constraints },
    { "time_warp", true, run_time_warp },
    { "catmull_rom_3d", false, run_catmull_rom_3d },
    { "bezier_3d", false, run_bezier },
    { "bspline_uniform_3d", false, run_bspline },
};

static int run_case(struct spline_case *c, const char *method)
{
    for (size_t i = 0; i < sizeof methods / sizeof methods[0]; i++)
        if (strcmp(methods[i].method, method) == 0)
            return methods[i].in_time ? run_in_time(c, methods[i].run)
                                      : methods[i].run(c);
    return MOTION_E_ARG;
}

/* Against the largest value of the case; a derivative also against what the
 * largest value over the whole duration gives: on a straight line the second is
 * zero, and in the reference what rounding left. */
static void judge(struct vectors_row *row, const struct spline_case *c)
{
    double *worst[3] = { &row->worst_p, &row->worst_v, &row->worst_a };

    row->cases++;
    for (int i = 0; i < 3; i++) {
        const double natural =
            c->dur_s > 0 ? c->largest[0] / pow(c->dur_s, i) : 0;
        const double largest = fmax(c->largest[i], natural);
        const double error = c->worst[i] == 0 ? 0
                             : largest > 0    ? c->worst[i] / largest
                                              : INFINITY;
        if (!(error <= *worst[i]))
            *worst[i] = error;
        if (!(error <= TOLERANCE * pow(10, i)))
            row->pass = false;
    }
}

int vectors_splines(const cJSON *file, struct vectors_row *rows, int capacity)
{
    const cJSON *json;
    int count = 0;

    cJSON_ArrayForEach(json, vectors_get(file, "cases"))
    {
        struct spline_case *c = &the_case;
        const char *method = vectors_text(json, "method");
        struct vectors_row *row =
            vectors_row_of(rows, capacity, &count, method, TOLERANCE);
        int rc;

        if (row == NULL)
            return -1;
        c->json = json;
        c->params = vectors_get(json, "params");
        c->dur_s = 0;
        memset(c->worst, 0, sizeof c->worst);
        memset(c->largest, 0, sizeof c->largest);
        rc = run_case(c, method);
        if (rc != MOTION_OK) {
            fprintf(stderr, "%s (%s): %s\n", vectors_text(json, "name"), method,
                    motion_err_text(rc));
            return -1;
        }
        judge(row, c);
    }
    return count;
}
