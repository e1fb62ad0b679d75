/* motion/plan/path/plan_space.c - see plan_space.h.
 *
 * A closed curve is C2 with periodic ends; the curves that only look at their
 * neighbours are planned over WRAP points more on either side, and the spans of
 * those are left out. */
#include "motion/plan/path/plan_space.h"

#include <stdlib.h>

#include "motion/core/err.h"
#include "motion/path/path.h"
#include "motion/plan/plan_error.h"
#include "motion/plan/rig/plan_rig.h"

#define SPACE_WRAP     3
#define SPACE_ROWS     16 /* of the length table per piece, to begin with */
#define SPACE_ROWS_MAX ((size_t)1 << 24)

struct plan_space_rules plan_space_rules(enum plan_curve curve)
{
    static const struct plan_space_rules none = { .is = false };
    static const struct plan_space_rules rules[] = {
        [PLAN_CURVE_LINEAR] = { .is = true },
        [PLAN_CURVE_ROUNDED] = { .is = true, .corner = true, .smooth = 1 },
        [PLAN_CURVE_SMOOTHED] = { .is = true, .corner = true, .smooth = 2 },
        [PLAN_CURVE_CATMULL_ROM] = { .is = true, .closed = true, .smooth = 1 },
        [PLAN_CURVE_AKIMA] = { .is = true, .closed = true, .smooth = 1 },
        [PLAN_CURVE_C2] = { .is = true, .closed = true, .smooth = 2 },
        [PLAN_CURVE_QUINTIC] = { .is = true, .closed = true, .smooth = 2 },
        [PLAN_CURVE_BSPLINE] = { .is = true, .smooth = 2 },
        [PLAN_CURVE_C4] = { .is = true, .smooth = 2 },
    };
    return (size_t)curve < sizeof rules / sizeof rules[0] ? rules[curve] : none;
}

/* Points as they are planned, those around a closed curve included. */
struct space {
    const struct plan_points *points;
    struct plan_error *error;
    uint32_t wrap, count;
    int64_t *pos[PLAN_SPACE_AXES];
    int64_t *t_ns_q12;
    struct plan_key *key;
};

static uint32_t space_index(const struct space *self, uint32_t i)
{
    const uint32_t n = self->points->count;

    return (i + n - self->wrap % n) % n;
}

static int space_no_memory(const struct space *self)
{
    return plan_error_set(self->error, MOTION_E_FULL, self->points->place,
                          "no memory for the path's points");
}

static int space_check(const struct space *self)
{
    const struct plan_points *points = self->points;
    const struct plan_space_rules rules = plan_space_rules(points->curve);

    if (points->count < (points->closed ? 3u : 2u))
        return plan_error_set(self->error, MOTION_E_EMPTY, points->place,
                              "a path has at least 2 points, a closed one 3");
    if (!rules.is || (points->closed && !rules.closed) || points->axes < 2 ||
        points->axes > PLAN_SPACE_AXES)
        return plan_error_set(self->error, MOTION_E_ARG, points->place,
                              "the path's curve is none through space, or "
                              "cannot be closed");
    return MOTION_OK;
}

static int space_copy(struct space *self)
{
    const struct plan_points *points = self->points;
    const bool local = points->closed && points->curve != PLAN_CURVE_C2;

    self->wrap = local ? SPACE_WRAP : 0;
    self->count = points->count + (points->closed ? 1 : 0) + 2 * self->wrap;
    self->t_ns_q12 = calloc(self->count, sizeof *self->t_ns_q12);
    self->key = calloc(self->count, sizeof *self->key);
    if (self->t_ns_q12 == NULL || self->key == NULL)
        return space_no_memory(self);
    for (uint32_t axis = 0; axis < points->axes; axis++) {
        self->pos[axis] = calloc(self->count, sizeof *self->pos[axis]);
        if (self->pos[axis] == NULL)
            return space_no_memory(self);
        for (uint32_t i = 0; i < self->count; i++)
            self->pos[axis][i] = points->point[space_index(self, i)].q32[axis];
    }
    return MOTION_OK;
}

/* A second per span on average. */
static int space_times(const struct space *self)
{
    const struct plan_points *points = self->points;
    const bool straight = points->curve == PLAN_CURVE_LINEAR ||
                          plan_space_rules(points->curve).corner;
    const int err = motion_spline_space(
        (const int64_t *const *)self->pos, points->axes, self->count,
        straight ? MOTION_SPLINE_CHORDAL : points->spacing,
        (int64_t)(self->count - 1) * MOTION_FIXED_S_Q12, self->t_ns_q12);

    if (err == MOTION_E_ORDER)
        return plan_error_set(self->error, err, points->place,
                              "two neighbouring points of the path are the "
                              "same");
    if (err < 0)
        return plan_error_set(self->error, err, points->place,
                              "two points of the path are too near to each "
                              "other for its size");
    return MOTION_OK;
}

/* The parameter's share of a corner: it goes as the length does. */
static int64_t space_corner(const struct space *self)
{
    struct motion_real length = motion_real_zero();
    int64_t t = 0;

    for (uint32_t i = 0; i + 1 < self->count; i++) {
        struct motion_real sum = motion_real_zero();
        for (uint32_t axis = 0; axis < self->points->axes; axis++)
            sum = motion_real_add(
                sum, motion_real_sqr(motion_real_sub(
                         motion_real_from_q(self->pos[axis][i + 1], 32),
                         motion_real_from_q(self->pos[axis][i], 32))));
        length = motion_real_add(length, motion_real_sqrt(sum));
    }
    if (motion_real_round(
            motion_real_div(
                motion_real_mul(
                    motion_real_from_q(self->points->corner_q32, 32),
                    motion_real_int(self->t_ns_q12[self->count - 1])),
                length),
            0, &t) < 0 ||
        t > self->t_ns_q12[self->count - 1])
        return self->t_ns_q12[self->count - 1];
    return t;
}

static enum motion_spline_end space_end(const struct plan_points *points)
{
    if (points->curve == PLAN_CURVE_C2)
        return points->closed ? MOTION_SPLINE_PERIODIC : MOTION_SPLINE_NATURAL;
    return points->curve == PLAN_CURVE_BSPLINE  ? MOTION_SPLINE_NATURAL
           : points->curve == PLAN_CURVE_C4     ? MOTION_SPLINE_NOT_A_KNOT
           : points->curve == PLAN_CURVE_LINEAR ? MOTION_SPLINE_REST
                                                : MOTION_SPLINE_ONE_SIDED;
}

static int space_plan(const struct space *self, uint32_t axis,
                      struct motion_track *track)
{
    const struct plan_points *points = self->points;
    struct plan_axis curve = {
        .curve = points->curve,
        .first = space_end(points),
        .last = space_end(points),
        .key = self->key,
        .key_count = self->count,
    };

    if (plan_space_rules(points->curve).corner)
        curve.blend_ns_q12 = space_corner(self);
    for (uint32_t i = 0; i < self->count; i++)
        self->key[i] = (struct plan_key){
            .key = { .t_ns_q12 = self->t_ns_q12[i],
                     .pos_q32 = self->pos[axis][i] },
        };
    if (plan_axis_track(&curve, track, self->error) < 0)
        return plan_error_set(self->error, self->error->code, points->place,
                              "the curve through the path's points leaves the "
                              "range of the formats");
    return MOTION_OK;
}

static int space_tracks(const struct space *self, struct plan_space *space)
{
    const uint32_t axes = self->points->axes;
    int err = MOTION_OK;

    for (uint32_t i = 0; i < axes && err == MOTION_OK; i++) {
        err = space_plan(self, i, &space->track[i]);
        if (err < 0)
            return err;
        space->part[i] = space->track[i];
        space->list[i] = &space->part[i];
        if (self->wrap == 0)
            continue;
        space->part[i].segment += self->wrap;
        space->part[i].count -= 2 * self->wrap;
        space->part[i].end_ns_q12 =
            space->track[i]
                .segment[self->wrap + self->points->count]
                .start_ns_q12;
    }
    return err;
}

static int space_measure(const struct space *self, struct plan_space *space)
{
    size_t rows = SPACE_ROWS * ((size_t)space->curve.pieces + 1);
    int err = MOTION_E_FULL;

    for (; err == MOTION_E_FULL && rows <= SPACE_ROWS_MAX; rows *= 2) {
        struct motion_arclen_row *row = realloc(space->row, rows * sizeof *row);
        if (row == NULL)
            break;
        space->row = row;
        err = motion_arclen_build(&space->table, &space->curve,
                                  motion_real_zero(), row, (uint32_t)rows);
    }
    if (err == MOTION_OK &&
        motion_real_floor(space->table.length, 32, &space->length_q32) < 0)
        err = MOTION_E_RANGE;
    if (err < 0)
        return plan_error_set(self->error, err, self->points->place,
                              "the path cannot be measured (%s)",
                              motion_err_text(err));
    return MOTION_OK;
}

static int space_curve(const struct space *self, struct plan_space *space)
{
    int err;

    space->tracks = calloc(1, sizeof *space->tracks);
    space->coef = malloc((size_t)space->part[0].count * self->points->axes *
                         (MOTION_TRACK_DEGREE + 1) * sizeof *space->coef);
    space->border =
        malloc(((size_t)space->part[0].count + 1) * sizeof *space->border);
    if (space->tracks == NULL || space->border == NULL || space->coef == NULL)
        return space_no_memory(self);
    *space->tracks = (struct motion_path_tracks){ .track = space->list,
                                                  .axes = self->points->axes,
                                                  .coef = space->coef };
    err = motion_path_from_tracks(&space->curve, space->tracks, space->border);
    if (err < 0)
        return plan_error_set(self->error, err, self->points->place,
                              "the path's coordinates do not go together");
    return space_measure(self, space);
}

/* The parameters of the points belong to the space from now on. */
static void space_close(const struct space *self, struct plan_space *space)
{
    space->point_ns_q12 = self->t_ns_q12;
    space->wrap = self->wrap;
    space->points = self->count - 2 * self->wrap;
    free(self->key);
    for (uint32_t i = 0; i < PLAN_SPACE_AXES; i++)
        free(self->pos[i]);
}

int plan_space_init(struct plan_space *space, const struct plan_points *points,
                    struct plan_error *error)
{
    struct space self = { .points = points, .error = error };
    int err = space_check(&self);

    *space = (struct plan_space){
        .closed = points->closed,
        .smooth = plan_space_rules(points->curve).smooth,
    };
    if (err == MOTION_OK)
        err = space_copy(&self);
    if (err == MOTION_OK)
        err = space_times(&self);
    if (err == MOTION_OK)
        err = space_tracks(&self, space);
    if (err == MOTION_OK)
        err = space_curve(&self, space);
    space_close(&self, space);
    if (err < 0)
        plan_space_free(space);
    return err;
}

void plan_space_free(struct plan_space *space)
{
    for (uint32_t i = 0; i < PLAN_SPACE_AXES; i++)
        plan_track_free(&space->track[i]);
    free(space->tracks);
    free(space->border);
    free(space->coef);
    free(space->row);
    free(space->point_ns_q12);
    *space = (struct plan_space){ .length_q32 = 0 };
}

int plan_space_at(const void *context, int64_t distance_q32,
                  struct motion_vec *pos, struct motion_dir *tangent)
{
    const struct plan_space *space = context;
    struct motion_vec along = motion_vec_zero();
    struct motion_arclen_place place;
    struct motion_arclen_point point;

    motion_arclen_find(&space->table, motion_real_from_q(distance_q32, 32),
                       &place);
    motion_arclen_by_length(&space->curve, place.piece, place.x, &point);
    *pos = motion_vec_zero();
    for (uint32_t i = 0; i < space->curve.axes; i++) {
        pos->x[i] = point.pos[i];
        along.x[i] = point.d1[i];
    }
    return tangent == NULL ? MOTION_OK : motion_vec_unit(along, tangent);
}

double plan_space_parameter(const struct plan_space *space,
                            struct motion_real distance)
{
    struct motion_arclen_place place;

    motion_arclen_find(&space->table, distance, &place);
    return plan_rig_real(space->curve.border[place.piece]) +
           plan_rig_real(place.x);
}

uint32_t plan_space_point(const struct plan_space *space, double parameter)
{
    const int64_t *point_ns_q12 = space->point_ns_q12 + space->wrap;
    const double t = parameter * (double)MOTION_FIXED_S_Q12;
    uint32_t i = 0;

    while (i + 2 < space->points && (double)point_ns_q12[i + 1] <= t)
        i++;
    return i;
}

int64_t plan_space_start_q32(const struct plan_space *space, uint32_t axis)
{
    return space->part[axis].segment[0].pos_q32;
}
