/* motion/plan/topp/topp_path.c - tracks as a path; see topp.h. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "motion/core/err.h"
#include "motion/double/double_math.h"
#include "motion/plan/topp/topp.h"
#include "motion/plan/topp/topp_poly.h"

static double path_seconds(int64_t t_ns_q12)
{
    return (double)t_ns_q12 / (1e9 * 4096);
}

static int path_order(const void *a, const void *b)
{
    const int64_t x = *(const int64_t *)a, y = *(const int64_t *)b;

    return (x > y) - (x < y);
}

/* Where the first of them begins: what is a part of a track keeps its times. */
static int64_t path_start(const struct motion_track *const track[],
                          unsigned axes)
{
    int64_t start = INT64_MAX;

    for (unsigned k = 0; k < axes; k++)
        if (track[k]->count > 0 && track[k]->segment[0].start_ns_q12 < start)
            start = track[k]->segment[0].start_ns_q12;
    return start;
}

/* All borders of all tracks once, in 2^-12 ns; NULL without memory. */
static int64_t *path_borders(const struct motion_track *const track[],
                             unsigned axes, struct plan_pool *pool,
                             uint32_t *count)
{
    size_t all = 1, kept = 1;
    int64_t *border;

    for (unsigned k = 0; k < axes; k++)
        all += track[k]->count;
    border = plan_pool_take(pool, all, sizeof *border);
    if (border == NULL)
        return NULL;
    all = 1;
    border[0] = path_start(track, axes);
    for (unsigned k = 0; k < axes; k++) {
        const struct motion_track *one = track[k];
        for (uint32_t i = 0; i < one->count; i++)
            border[all++] =
                one->segment[i].start_ns_q12 + one->segment[i].dur_ns_q12;
    }
    qsort(border, all, sizeof *border, path_order);
    for (size_t i = 1; i < all; i++)
        if (border[i] != border[kept - 1])
            border[kept++] = border[i];
    *count = (uint32_t)kept;
    return border;
}

/* The powers of t in s from `at` on, within the segment. */
static void path_powers(const struct motion_segment *segment, int64_t at,
                        double power[MOTION_TRACK_DEGREE + 1])
{
    const double dur = path_seconds(segment->dur_ns_q12);
    const double t = path_seconds(at - segment->start_ns_q12);

    for (unsigned k = 0; k <= MOTION_TRACK_DEGREE; k++)
        power[k] =
            ldexp((double)segment->coef[k], -32 - segment->frac - (int)k) /
            double_power(dur, k);
    power[0] += ldexp((double)segment->pos_q32, -32);
    power[1] += ldexp((double)segment->remainder, -32) / dur;
    topp_poly_shift(MOTION_TRACK_DEGREE, power, t);
}

static void path_axis(const struct motion_track *track, const int64_t border[],
                      const struct plan_topp_path *path, double *coef)
{
    const size_t size = path->degree + 1;
    double power[MOTION_TRACK_DEGREE + 1];
    uint32_t at = 0;

    for (uint32_t i = 0; i < path->pieces; i++, coef += path->axes * size) {
        while (at < track->count &&
               border[i] >= track->segment[at].start_ns_q12 +
                                track->segment[at].dur_ns_q12)
            at++;
        if (at < track->count) {
            path_powers(&track->segment[at], border[i], power);
            memcpy(coef, power, size * sizeof *coef);
        } else {
            coef[0] = ldexp((double)track->end.pos_q32, -32);
        }
    }
}

static unsigned path_degree(const struct motion_track *const track[],
                            unsigned axes)
{
    unsigned degree = 1;

    for (unsigned k = 0; k < axes; k++)
        for (uint32_t i = 0; i < track[k]->count; i++)
            if (track[k]->segment[i].degree > degree)
                degree = track[k]->segment[i].degree;
    return degree;
}

static int path_fill(const struct motion_track *const track[],
                     const int64_t border[], struct plan_pool *pool,
                     struct plan_topp_path *path)
{
    const size_t size = path->degree + 1;
    double *s = plan_pool_take(pool, (size_t)path->pieces + 1, sizeof *s);
    double *coef = plan_pool_take(
        pool, (size_t)path->pieces * path->axes * size, sizeof *coef);

    path->border = s;
    path->coef = coef;
    if (s == NULL || coef == NULL)
        return MOTION_E_FULL;
    for (uint32_t i = 0; i <= path->pieces; i++)
        s[i] = path_seconds(border[i]);
    for (unsigned k = 0; k < path->axes; k++)
        path_axis(track[k], border, path, coef + k * size);
    return MOTION_OK;
}

int plan_topp_path_of(const struct motion_track *const track[], unsigned axes,
                      struct plan_pool *pool, struct plan_topp_path *path)
{
    struct plan_pool scratch = { NULL };
    uint32_t count = 0;
    int64_t *border;
    int err = MOTION_E_FULL;

    *path = (struct plan_topp_path){ 0 };
    if (axes < 1 || axes > PLAN_TOPP_AXES_MAX)
        return MOTION_E_ARG;
    border = path_borders(track, axes, &scratch, &count);
    if (border != NULL) {
        *path = (struct plan_topp_path){ .axes = axes,
                                         .degree = path_degree(track, axes),
                                         .pieces = count - 1 };
        err = count < 2 ? MOTION_E_EMPTY : path_fill(track, border, pool, path);
    }
    plan_pool_free(&scratch);
    return err;
}
