/* tests/motion/vectors_topp.c - topp_*.json; see vectors.h.
 *
 * The waypoints become keys of the integer core's natural cubic spline, in
 * units of 2^-16 of the file's, so that a key is within 2^-48.  Judged: the
 * duration on the default grid (1e-4) and on a fine one (1e-6) against the
 * converged one, and the limits at 100,000 even times on both (1e-6). */
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "motion/core/err.h"
#include "motion/core/fixed.h"
#include "motion/curve/spline.h"
#include "motion/plan/topp/topp.h"
#include "tests/motion/plan/topp/topp_judge.h"
#include "tests/motion/vectors_json.h"

#define UNIT          65536.
#define LINE_BYTES    4096
#define WAYPOINTS_MAX 100000
#define FINE          200000
#define POINTS        100000
#define COARSE_REL    1e-4
#define FINE_REL      1e-6
#define EXCESS        1e-6

struct topp_case {
    unsigned axes;
    uint32_t count;
    double *s, *q; /* q: count x axes */
    struct motion_track track[PLAN_TOPP_AXES_MAX];
    struct plan_topp_limit limit[PLAN_TOPP_AXES_MAX];
};

/* The file beside `path`. */
static FILE *open_beside(const char *path, const char *name)
{
    const char *slash = strrchr(path, '/');
    const int folder = slash ? (int)(slash - path) + 1 : 0;
    char full[LINE_BYTES];

    if (snprintf(full, sizeof full, "%.*s%s", folder, path, name) >=
        (int)sizeof full)
        return NULL;
    return fopen(full, "r");
}

/* s,q1,q2...: a row, or false at the end and at what is no row. */
static bool read_row(FILE *file, struct topp_case *c)
{
    char line[LINE_BYTES], *at = line;

    if (c->count == WAYPOINTS_MAX || fgets(line, sizeof line, file) == NULL)
        return false;
    c->s[c->count] = strtod(at, &at);
    for (unsigned k = 0; k < c->axes; k++) {
        if (*at != ',')
            return false;
        c->q[c->count * c->axes + k] = strtod(at + 1, &at);
    }
    c->count++;
    return true;
}

static bool read_waypoints(const cJSON *json, const char *path,
                           struct topp_case *c)
{
    const uint32_t wanted = (uint32_t)vectors_value_of(json, "waypoints");
    FILE *file =
        open_beside(path, vectors_get(json, "waypoint_file")->valuestring);
    char head[LINE_BYTES];

    c->s = calloc(WAYPOINTS_MAX, sizeof *c->s);
    c->q = calloc((size_t)WAYPOINTS_MAX * c->axes, sizeof *c->q);
    if (file == NULL || c->s == NULL || c->q == NULL ||
        fgets(head, sizeof head, file) == NULL) {
        if (file != NULL)
            fclose(file);
        return false;
    }
    while (read_row(file, c))
        ;
    fclose(file);
    return c->count == wanted && c->count >= 2;
}

static bool read_limits(const cJSON *json, struct topp_case *c)
{
    static const char *const name[] = { "vmin", "vmax", "amin", "amax" };

    for (unsigned k = 0; k < c->axes; k++) {
        double value[4];
        for (unsigned i = 0; i < 4; i++)
            value[i] = UNIT * vectors_number_at(vectors_get(json, name[i]), k);
        c->limit[k] =
            (struct plan_topp_limit){ value[0], value[1], value[2], value[3] };
    }
    return true;
}

static int plan_axis(struct topp_case *c, unsigned axis)
{
    struct motion_key *key = calloc(c->count, sizeof *key);
    struct motion_spline_work *work = calloc(c->count, sizeof *work);
    struct motion_segment *segment = calloc(c->count, sizeof *segment);
    int err = key && work && segment ? MOTION_OK : MOTION_E_FULL;

    for (uint32_t i = 0; err == MOTION_OK && i < c->count; i++) {
        const double p = c->q[i * c->axes + axis] * UNIT;
        key[i].t_ns_q12 = llround((c->s[i] - c->s[0]) * MOTION_FIXED_S_Q12);
        key[i].pos_q32 = llround(ldexp(p, 32));
    }
    if (err == MOTION_OK) {
        motion_track_init(&c->track[axis], segment, c->count, key[0].pos_q32);
        err = motion_spline_c2(key, c->count, MOTION_SPLINE_NATURAL,
                               MOTION_SPLINE_NATURAL, work);
    }
    if (err == MOTION_OK)
        err = motion_spline_append_cubic(&c->track[axis], key, c->count, NULL);
    free(key);
    free(work);
    return err;
}

/* Duration and worst excess on a grid. */
static int judge(const cJSON *json, const struct topp_case *c,
                 const struct plan_topp_path *path, uint32_t intervals,
                 double *duration, double *excess)
{
    const struct plan_topp_request request = {
        .path = *path,
        .limit = c->limit,
        .start_speed = vectors_value_of(json, "start_path_speed"),
        .end_speed = vectors_value_of(json, "end_path_speed"),
        .intervals = intervals,
    };
    struct plan_pool pool = { NULL };
    struct plan_topp topp;
    double failed;
    const int err = plan_topp_solve(&request, &pool, &topp, &failed);

    if (err == MOTION_OK) {
        *duration = plan_topp_duration(&topp);
        *excess = fmax(*excess, topp_judge_excess(&request, &topp, POINTS));
    }
    plan_pool_free(&pool);
    return err;
}

static int run(const cJSON *json, struct topp_case *c, struct vectors_row *row)
{
    const double want = vectors_value_of(json, "duration_converged");
    const struct motion_track *track[PLAN_TOPP_AXES_MAX];
    struct plan_topp_path path = { 0 };
    struct plan_pool pool = { NULL };
    double coarse = 0, fine = 0, excess = 0;
    int err = MOTION_OK;

    for (unsigned k = 0; err == MOTION_OK && k < c->axes; k++) {
        track[k] = &c->track[k];
        err = plan_axis(c, k);
    }
    if (err == MOTION_OK)
        err = plan_topp_path_of(track, c->axes, &pool, &path);
    if (err == MOTION_OK)
        err = judge(json, c, &path, 0, &coarse, &excess);
    if (err == MOTION_OK)
        err = judge(json, c, &path, FINE, &fine, &excess);
    plan_pool_free(&pool);
    if (err != MOTION_OK)
        return err;
    snprintf(row->text, sizeof row->text,
             "default %.9f s (%+.2g), fine %.9f s (%+.2g), excess %.2g", coarse,
             coarse / want - 1, fine, fine / want - 1, excess);
    row->pass = fabs(coarse / want - 1) <= COARSE_REL &&
                fabs(fine / want - 1) <= FINE_REL && excess <= EXCESS;
    return MOTION_OK;
}

int vectors_topp(const cJSON *file, const char *path, struct vectors_row *row)
{
    struct topp_case *c = calloc(1, sizeof *c);
    int err = MOTION_E_ARG;

    *row = (struct vectors_row){ .cases = 1 };
    snprintf(row->method, sizeof row->method, "topp_%s",
             vectors_get(file, "name")->valuestring);
    if (c == NULL)
        return -1;
    c->axes = (unsigned)vectors_value_of(file, "dof");
    if (c->axes >= 1 && c->axes <= PLAN_TOPP_AXES_MAX &&
        read_waypoints(file, path, c) && read_limits(file, c))
        err = run(file, c, row);
    if (err != MOTION_OK)
        fprintf(stderr, "%s: %s\n", row->method, motion_err_text(err));
    for (unsigned k = 0; k < c->axes && k < PLAN_TOPP_AXES_MAX; k++)
        free(c->track[k].segment);
    free(c->s);
    free(c->q);
    free(c);
    return err == MOTION_OK ? 1 : -1;
}
