/* motion/plan/camera/plan_view_border.c - where a derivative of the view may step: see
 * plan_view.h.
 *
 * At a point of a path its tangent is continuous (all but linear), its
 * curvature (c2, quintic, b-spline, smoothed) or neither; the third derivative
 * always steps.  Looking along the path follows its tangent, so that where the
 * curvature steps the speed of turning does.  Looking at a place is one
 * derivative smoother.
 *
 * Where speed or more steps is a break, with derivatives from one side.  Where
 * acceleration alone does is none: the stencil of the derivatives, a few parts
 * in 2^16 of the path long, makes a ramp of the step, inside the tolerance, and
 * a head whose jerk is limited follows that when it is slow. */
#include <stdlib.h>

#include "motion/core/err.h"
#include "motion/core/fixed.h"
#include "motion/plan/camera/plan_view.h"

/* Breaks nearer to each other than this part of the length are one. */
#define BORDER_NEAR_BITS 22

struct view_borders {
    struct plan_view *view;
    bool breaks; /* what is added are breaks, too */
};

static void border_add(struct view_borders *self, int64_t at_q32)
{
    struct plan_view *view = self->view;

    if (at_q32 <= 0 || at_q32 >= view->path.length_q32)
        return;
    view->border_q32[view->borders++] = at_q32;
    if (self->breaks)
        view->break_q32[view->breaks++] = at_q32;
}

/* Where the camera is when what it looks at is at a place of the path: `ahead`
 * less, on a closed one also from the other side of its start. */
static int64_t border_before(const struct plan_view *view, int64_t at_q32)
{
    const struct plan_camera *camera = view->camera;
    const int64_t length = view->path.length_q32;

    if (camera->end != MOTION_AHEAD_CLOSED)
        return at_q32 - camera->ahead_q32;
    at_q32 = (at_q32 - camera->ahead_q32) % length;
    return at_q32 < 0 ? at_q32 + length : at_q32;
}

static void border_knots(struct view_borders *self,
                         const struct plan_space *space)
{
    const struct plan_view *view = self->view;
    const struct plan_camera *camera = view->camera;

    for (uint32_t i = 0; i <= space->curve.pieces; i++) {
        int64_t at = 0;
        if (motion_real_round(motion_arclen_border(&space->table, i), 32, &at) <
                0 ||
            (space != view->space &&
             motion_fixed_muldiv(at, view->path.length_q32, space->length_q32,
                                 &at) < 0))
            continue;
        border_add(self, at);
        if (camera->look == PLAN_LOOK_AHEAD)
            border_add(self, border_before(view, at));
    }
}

static void border_dwells(struct view_borders *self)
{
    const struct plan_view *view = self->view;

    self->breaks = false;
    for (uint32_t i = 0; i < view->camera->dwells; i++) {
        border_add(self, view->dwell[i].from_q32);
        border_add(self, view->dwell[i].to_q32);
    }
}

static void border_orientations(struct view_borders *self)
{
    const struct motion_orient *orient = &self->view->turning.orient;

    self->breaks = false;
    for (uint32_t i = 0; i < orient->count; i++)
        border_add(self, orient->key[i].t);
}

static int border_compare(const void *a, const void *b)
{
    const int64_t x = *(const int64_t *)a, y = *(const int64_t *)b;

    return (x > y) - (x < y);
}

/* In order, from 0 to the length, `near` apart: how many are left. */
static uint32_t border_sort(int64_t at[], uint32_t count, int64_t length,
                            int64_t near)
{
    uint32_t kept = 1;

    at[count++] = 0;
    qsort(at, count, sizeof *at, border_compare);
    for (uint32_t i = 1; i < count; i++)
        if (at[i] - at[kept - 1] >= near && length - at[i] >= near)
            at[kept++] = at[i];
    at[kept++] = length;
    return kept;
}

/* At the points of a curve that is so smooth. */
static bool border_is_break(const struct plan_view *view, int smooth)
{
    switch (view->camera->look) {
    case PLAN_LOOK_FRENET:
        return true;
    case PLAN_LOOK_LEVEL:
    case PLAN_LOOK_MINIMISING:
        return smooth < 2;
    default:
        return smooth < 1;
    }
}

/* Lengths are rounded: so far from a break no place is on its other side. */
static int64_t border_margin(const struct plan_view *view)
{
    int64_t more = 0;

    if (view->camera->look == PLAN_LOOK_PATH)
        more = 2 * (view->path.length_q32 / view->other_space.length_q32);
    return more + 4;
}

int plan_view_borders(struct plan_view *view)
{
    const struct plan_camera *camera = view->camera;
    const int64_t length = view->path.length_q32;
    const size_t capacity = 2 * ((size_t)view->space->curve.pieces + 1) +
                            view->other_space.curve.pieces + 1 +
                            2 * (size_t)camera->dwells + camera->orient.count +
                            3;
    struct view_borders self = { view,
                                 border_is_break(view, view->space->smooth) };

    view->border_q32 = malloc(capacity * sizeof *view->border_q32);
    view->break_q32 = malloc(capacity * sizeof *view->break_q32);
    if (view->border_q32 == NULL || view->break_q32 == NULL)
        return plan_view_no_memory(view);
    border_knots(&self, view->space);
    self.breaks = border_is_break(view, view->other_space.smooth);
    if (camera->look == PLAN_LOOK_PATH)
        border_knots(&self, &view->other_space);
    self.breaks = true; /* what it looks at stops there */
    if (camera->look == PLAN_LOOK_AHEAD && camera->end == MOTION_AHEAD_HOLD)
        border_add(&self, length - camera->ahead_q32);
    if (view->dwell != NULL)
        border_dwells(&self);
    border_orientations(&self);
    view->margin_q32 = border_margin(view);
    view->borders = border_sort(view->border_q32, view->borders, length, 1);
    view->breaks =
        border_sort(view->break_q32, view->breaks, length,
                    (length >> BORDER_NEAR_BITS) + 16 * view->margin_q32);
    return MOTION_OK;
}
