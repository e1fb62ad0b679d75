/* motion/plan/plan_frames.c - see plan_frames.h.
 *
 * Rotation-minimising frames are carried from one even distance to the next
 * once; a frame between two goes on from the one before it, so that it is the
 * same however often it is asked for. */
#include "motion/plan/plan_frames.h"

#include <stdlib.h>

#include "motion/err.h"
#include "motion/fixed.h"
#include "motion/trig.h"

#define FRAMES_ROWS      1024
#define FRAMES_TOLERANCE ((int64_t)1 << 16) /* 2^-46 rad a step */

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

static struct motion_curve frames_of(const struct plan_frames *self)
{
    return (struct motion_curve){ frames_curve, self->space, 0,
                                  self->space->length_q32 };
}

static int64_t frames_distance(const struct plan_frames *self, uint32_t i)
{
    int64_t distance = 0;

    (void)motion_fixed_muldiv(self->space->length_q32, i, FRAMES_ROWS,
                              &distance);
    return distance;
}

/* The first frame is level; r is right. */
static int frames_first(const struct plan_frames *self,
                        struct motion_frame *frame)
{
    struct motion_vec pos, across;
    struct motion_dir along, right;
    int err = plan_space_at(self->space, 0, &pos, &along);

    if (err < 0)
        return err;
    across = motion_vec_cross(motion_vec_from_dir(along),
                              motion_vec_from_dir(self->up));
    if (motion_real_lt(motion_vec_length(across), motion_real_from_q(1, 20)))
        across = motion_vec_cross(motion_vec_from_dir(self->forward),
                                  motion_vec_from_dir(self->up));
    err = motion_vec_unit(across, &right);
    return err < 0 ? err : motion_frame_start(along, right, frame);
}

static int frames_carry(struct plan_frames *self)
{
    const struct motion_curve curve = frames_of(self);
    int err = frames_first(self, &self->frame[0]);

    for (uint32_t i = 1; i < self->frames && err == MOTION_OK; i++) {
        self->frame[i] = self->frame[i - 1];
        err = motion_frame_carry(&curve, frames_distance(self, i - 1),
                                 frames_distance(self, i), FRAMES_TOLERANCE,
                                 &self->frame[i]);
    }
    if (err == MOTION_OK && self->space->closed)
        self->twist_turn =
            motion_frame_twist(&self->frame[0], &self->frame[self->frames - 1]);
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

    for (uint32_t i = 0; i <= FRAMES_ROWS && err == MOTION_OK; i++) {
        err = frames_frenet(self, frames_distance(self, i), &frame);
        if (err == MOTION_OK && i > 0 &&
            motion_dir_dot_q62(before.r, frame.r) < 0)
            err = MOTION_E_STATE;
        before = frame;
    }
    return err;
}

int plan_frames_init(struct plan_frames *self)
{
    if (self->frenet)
        return frames_check(self);
    self->frames = FRAMES_ROWS + 1;
    self->frame = calloc(self->frames, sizeof *self->frame);
    return self->frame == NULL ? MOTION_E_FULL : frames_carry(self);
}

void plan_frames_free(struct plan_frames *self)
{
    free(self->frame);
    self->frame = NULL;
}

static int frames_at_distance(const struct plan_frames *self,
                              int64_t distance_q32, struct motion_frame *frame)
{
    const struct motion_curve curve = frames_of(self);
    int64_t row = 0, share = 0;
    int err = MOTION_OK;

    if (self->frenet)
        return frames_frenet(self, distance_q32, frame);
    (void)motion_fixed_muldiv(distance_q32, FRAMES_ROWS,
                              self->space->length_q32, &row);
    if (row > 0 && frames_distance(self, (uint32_t)row) > distance_q32)
        row--; /* the quotient was rounded up */
    *frame = self->frame[row];
    if (frames_distance(self, (uint32_t)row) < distance_q32)
        err = motion_frame_carry(&curve, frames_distance(self, (uint32_t)row),
                                 distance_q32, FRAMES_TOLERANCE, frame);
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
