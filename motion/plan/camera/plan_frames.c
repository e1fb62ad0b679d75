/* motion/plan/camera/plan_frames.c - see plan_frames.h.
 *
 * Rotation-minimising frames are carried along the path once, by steps that are
 * as long as one and two halves of it agree; they are kept.  A frame between
 * two is one step from the one before it, so that it is the same however often
 * it is asked for, and costs one look at the curve. */
#include "motion/plan/camera/plan_frames.h"

#include <stdlib.h>

#include "motion/core/err.h"
#include "motion/core/fixed.h"
#include "motion/curve/interval.h"
#include "motion/number/trig.h"

#define FRAMES_CHECKS    1024 /* of a Frenet frame along the path */
#define FRAMES_STEPS     256  /* at least */
#define FRAMES_ROWS_MAX  ((uint32_t)1 << 20)
#define FRAMES_TOLERANCE 40000 /* of 2^-64 turn: 2^-46 rad a step */

/* The curve by its length: P, T and dT/ds. */
static int frames_curve(const void *context, int64_t u, int order,
                        struct motion_curve_point *point)
{
    const struct plan_space *space = context;
    struct motion_arclen_place place;
    struct motion_arclen_point by;

    (void)order;
    motion_arclen_find(&space->table, motion_real_from_q(u, 32), &place);
    motion_arclen_by_length(&space->curve, place.piece, place.x, &by);
    point->pos = point->d1 = point->d2 = point->d3 = motion_vec_zero();
    for (uint32_t i = 0; i < space->curve.axes; i++) {
        point->pos.x[i] = by.pos[i];
        point->d1.x[i] = by.d1[i];
        point->d2.x[i] = by.d2[i];
    }
    return MOTION_OK;
}

/* The first frame is level; r is right. */
static int frames_first(const struct plan_frames *self,
                        struct plan_frames_row *row)
{
    struct motion_vec across;
    struct motion_dir along, right;
    int err = plan_space_at(self->space, 0, &row->pos, &along);

    if (err < 0)
        return err;
    across = motion_vec_cross(motion_vec_from_dir(along),
                              motion_vec_from_dir(self->up));
    if (motion_real_lt(motion_vec_length(across), motion_real_from_q(1, 20)))
        across = motion_vec_cross(motion_vec_from_dir(self->forward),
                                  motion_vec_from_dir(self->up));
    err = motion_vec_unit(across, &right);
    return err < 0 ? err : motion_frame_start(along, right, &row->frame);
}

/* One step from a row to a distance. */
static int frames_step(const struct plan_frames *self,
                       const struct plan_frames_row *from, int64_t distance_q32,
                       struct plan_frames_row *to)
{
    struct motion_dir along;
    int err = plan_space_at(self->space, distance_q32, &to->pos, &along);

    to->distance_q32 = distance_q32;
    return err < 0 ? err
                   : motion_frame_step(&from->frame,
                                       motion_vec_sub(to->pos, from->pos),
                                       along, &to->frame);
}

/* Two halves, and how far one step is from them. */
static int frames_halves(const struct plan_frames *self,
                         const struct plan_frames_row *from,
                         int64_t distance_q32, struct plan_frames_row *to,
                         uint64_t *off_turn)
{
    const int64_t middle =
        from->distance_q32 + (distance_q32 - from->distance_q32) / 2;
    struct plan_frames_row half, one;
    int err = frames_step(self, from, distance_q32, &one);

    if (err == MOTION_OK)
        err = frames_step(self, from, middle, &half);
    if (err == MOTION_OK)
        err = frames_step(self, &half, distance_q32, to);
    if (err == MOTION_OK)
        *off_turn =
            motion_fixed_abs(motion_frame_twist(&one.frame, &to->frame));
    return err;
}

static int frames_grow(struct plan_frames *self, uint32_t *capacity)
{
    struct plan_frames_row *row;

    if (self->rows < *capacity)
        return MOTION_OK;
    if (*capacity >= FRAMES_ROWS_MAX)
        return MOTION_E_WORK;
    *capacity = *capacity == 0 ? FRAMES_STEPS : 2 * *capacity;
    row = realloc(self->row, *capacity * sizeof *row);
    if (row == NULL)
        return MOTION_E_FULL;
    self->row = row;
    return MOTION_OK;
}

/* As far as halves agree, from the last row; halves the step where they do not,
 * and where a tangent turns back in it. */
static int frames_next(struct plan_frames *self, int64_t *step_q32,
                       struct plan_frames_row *next)
{
    const struct plan_frames_row *last = &self->row[self->rows - 1];
    const int64_t length = self->space->length_q32;

    for (;; *step_q32 /= 2) {
        const int64_t left = length - last->distance_q32;
        const int64_t step = *step_q32 < left ? *step_q32 : left;
        uint64_t off = 0;
        int err =
            frames_halves(self, last, last->distance_q32 + step, next, &off);
        if (err < 0 && err != MOTION_E_RANGE)
            return err;
        if (err == MOTION_OK && off <= FRAMES_TOLERANCE) {
            if (off < FRAMES_TOLERANCE / 64 &&
                *step_q32 < length / FRAMES_STEPS)
                *step_q32 *= 2;
            return MOTION_OK;
        }
        if (step < 4)
            return MOTION_E_TOLERANCE;
    }
}

static int frames_carry(struct plan_frames *self)
{
    const int64_t length = self->space->length_q32;
    int64_t step_q32 = length / FRAMES_STEPS + 1;
    struct plan_frames_row next = { .distance_q32 = 0 };
    uint32_t capacity = 0;
    int err = frames_first(self, &next);

    while (err == MOTION_OK) {
        err = frames_grow(self, &capacity);
        if (err < 0)
            return err;
        self->row[self->rows++] = next;
        if (next.distance_q32 >= length)
            break;
        err = frames_next(self, &step_q32, &next);
    }
    if (err == MOTION_OK && self->space->closed)
        self->twist_turn = motion_frame_twist(&self->row[0].frame, &next.frame);
    return err;
}

static int frames_frenet(const struct plan_frames *self, int64_t distance_q32,
                         struct motion_frame *frame)
{
    struct motion_curve_point point;
    struct motion_frenet frenet;

    (void)frames_curve(self->space, distance_q32, 2, &point);
    if (motion_frame_frenet(&point, &frenet) != MOTION_FRENET_OK)
        return MOTION_E_STATE;
    frame->t = frenet.t;
    frame->r = motion_dir_neg(frenet.n); /* up = r x t is the binormal */
    frame->s = motion_dir_cross(frame->t, frame->r);
    return MOTION_OK;
}

/* It must exist all along, and not flip. */
static int frames_check(const struct plan_frames *self)
{
    struct motion_frame frame, before = { .t = { { 0 } } };
    int err = MOTION_OK;

    for (uint32_t i = 0; i <= FRAMES_CHECKS && err == MOTION_OK; i++) {
        int64_t distance = 0;
        (void)motion_fixed_muldiv(self->space->length_q32, i, FRAMES_CHECKS,
                                  &distance);
        err = frames_frenet(self, distance, &frame);
        if (err == MOTION_OK && i > 0 &&
            motion_dir_dot_q62(before.r, frame.r) < 0)
            err = MOTION_E_STATE;
        before = frame;
    }
    return err;
}

int plan_frames_init(struct plan_frames *self)
{
    return self->frenet ? frames_check(self) : frames_carry(self);
}

void plan_frames_free(struct plan_frames *self)
{
    free(self->row);
    self->row = NULL;
}

/* The last row at or before a distance. */
static const struct plan_frames_row *frames_find(const struct plan_frames *self,
                                                 int64_t distance_q32)
{
    return &self->row[motion_interval_find(
        &self->row->distance_q32, sizeof *self->row, self->rows, distance_q32)];
}

static int frames_at_distance(const struct plan_frames *self,
                              int64_t distance_q32, struct motion_frame *frame)
{
    const struct plan_frames_row *row;
    struct plan_frames_row at;
    int64_t share = 0;
    int err = MOTION_OK;

    if (self->frenet)
        return frames_frenet(self, distance_q32, frame);
    row = frames_find(self, distance_q32);
    at = *row;
    if (row->distance_q32 < distance_q32)
        err = frames_step(self, row, distance_q32, &at);
    *frame = at.frame;
    if (err < 0 || self->twist_turn == 0)
        return err;
    (void)motion_fixed_muldiv(self->twist_turn, distance_q32,
                              self->space->length_q32, &share);
    motion_frame_turn(frame, motion_trig_diff(0, share));
    return MOTION_OK;
}

int plan_frames_at(const struct plan_frames *self, int64_t distance_q32,
                   struct motion_quat *q)
{
    struct motion_frame frame;
    int err = frames_at_distance(self, distance_q32, &frame);

    if (err < 0)
        return err;
    const struct motion_dir axis[3] = { frame.r, motion_dir_neg(frame.s),
                                        motion_dir_neg(frame.t) };
    return motion_quat_from_axes(axis, q);
}
