/* motion/plan/camera/plan_bake.c - see plan_bake.h. */
#include "motion/plan/camera/plan_bake.h"

#include <stdlib.h>

#include "motion/core/err.h"
#include "motion/core/fixed.h"
#include "motion/plan/plan_track.h"
#include "motion/plan/rig/plan_rig.h"

/* Borders nearer than this, about 2 us, are one. */
#define BAKE_NEAR (MOTION_FIXED_S_Q12 >> 19)
/* Evaluations of the baker, at most: so many, and per border. */
#define BAKE_LOOKS        20000
#define BAKE_BORDER_LOOKS 48
/* Segments from one border to the next for which there is room at once. */
#define BAKE_CAPACITY 4

static int bake_compare(const void *a, const void *b)
{
    const int64_t x = *(const int64_t *)a, y = *(const int64_t *)b;

    return (x > y) - (x < y);
}

int plan_bake_borders(struct plan_bake *bake,
                      const struct motion_track *const cause[], uint32_t causes,
                      const int64_t time_ns_q12[], uint32_t times)
{
    size_t capacity = (size_t)times + 1;
    uint32_t count = 0, kept = 1;
    int64_t *border;

    for (uint32_t i = 0; i < causes; i++)
        capacity += cause[i]->count + 1;
    border = bake->border_ns_q12 = malloc(capacity * sizeof *border);
    if (border == NULL)
        return MOTION_E_FULL;
    border[count++] = 0;
    for (uint32_t i = 0; i < causes; i++) {
        for (uint32_t k = 0; k < cause[i]->count; k++)
            border[count++] = cause[i]->segment[k].start_ns_q12;
        border[count++] = cause[i]->end_ns_q12;
    }
    for (uint32_t i = 0; i < times; i++)
        border[count++] = time_ns_q12[i];
    qsort(border, count, sizeof *border, bake_compare);
    for (uint32_t i = 1; i < count; i++)
        if (border[i] - border[kept - 1] > BAKE_NEAR)
            border[kept++] = border[i];
    if (kept > 1) /* the end is the end */
        border[kept - 1] = border[count - 1];
    bake->borders = kept;
    return MOTION_OK;
}

void plan_bake_free(struct plan_bake *bake)
{
    free(bake->border_ns_q12);
    *bake = (struct plan_bake){ .borders = 0 };
}

uint32_t plan_bake_looks(const struct plan_bake *bake)
{
    return BAKE_LOOKS + BAKE_BORDER_LOOKS * bake->borders;
}

/* The tracks begin where the source does. */
static int bake_begin(const struct plan_bake *bake, struct motion_track *list[])
{
    struct motion_bake_point point[MOTION_BAKE_AXES];
    int err =
        bake->source.at(bake->source.context, 0, MOTION_BAKE_RIGHT, point);

    for (uint32_t i = 0; i < bake->axes && err == MOTION_OK; i++) {
        int64_t pos_q32 = 0;
        err = motion_real_round(point[i].pos, 32, &pos_q32);
        plan_track_init(list[i], pos_q32);
        plan_track_reserve(list[i], BAKE_CAPACITY * (size_t)bake->borders);
    }
    return err;
}

static bool bake_grow(const struct plan_bake *bake, struct motion_track *list[])
{
    for (uint32_t i = 0; i < bake->axes; i++)
        if (plan_track_grow(list[i]) < 0)
            return false;
    return true;
}

int plan_bake_tracks(const struct plan_bake *bake, struct motion_track *list[],
                     struct motion_bake_report *report)
{
    const struct motion_bake job = {
        .source = bake->source,
        .axes = bake->axes,
        .border_ns_q12 = bake->border_ns_q12,
        .borders = bake->borders,
        .pos = motion_real_from_q(bake->tolerance_q32, 32),
        .vel = motion_real_zero(),
        .acc = motion_real_zero(),
        .evaluations = plan_bake_looks(bake),
    };
    int err = bake_begin(bake, list);

    *report = (struct motion_bake_report){ .segments = 0 };
    if (err < 0 || bake->borders < 2)
        return err;
    do
        err = motion_bake(&job, list, report);
    while (err == MOTION_E_FULL && bake_grow(bake, list));
    return err;
}

struct motion_bake_point plan_bake_point(struct plan_jet jet)
{
    return (struct motion_bake_point){ plan_rig_from_double(jet.p),
                                       plan_rig_from_double(jet.v),
                                       plan_rig_from_double(jet.a) };
}

void plan_bake_bound(const struct motion_bake_report *report, uint32_t axis,
                     int64_t *bound_q32)
{
    int64_t bound = 0;

    if (report->segments > 0 &&
        motion_real_ceil(report->bound[axis].pos, 32, &bound) == MOTION_OK &&
        bound > *bound_q32)
        *bound_q32 = bound;
}
