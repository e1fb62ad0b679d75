/* motion/plan/path/plan_joints.c - see plan_joints.h. */
#include "motion/plan/path/plan_joints.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "motion/core/err.h"
#include "motion/core/fixed.h"
#include "motion/plan/path/plan_timing.h"
#include "motion/plan/plan_error.h"

/* A span of less than this part of the mean is none. */
#define JOINTS_LEAST 1e-6

struct joints {
    const struct plan_move *move;
    const struct plan_joints *joints;
    struct plan_error *error;
    int64_t *t_ns_q12; /* the parameter at each key */
    uint32_t keys;
    struct motion_track curve[PLAN_JOINTS_MAX]; /* over it */
};

static const struct plan_axis *joints_axis(const struct joints *self,
                                           uint32_t i)
{
    return &self->move->axis[self->joints->axis[i]];
}

static int joints_check(const struct joints *self)
{
    for (uint32_t i = 0; i < self->joints->axes; i++) {
        const struct plan_axis *axis = joints_axis(self, i);
        if (axis->profile.vel_q32 > 0)
            return plan_error_set(self->error, MOTION_E_ARG, axis->place,
                                  "axis %s has its times found, but its drive "
                                  "goes from key to key by its own profile",
                                  axis->name);
        if (self->keys < 2)
            return plan_error_set(self->error, MOTION_E_ARG, axis->place,
                                  "axis %s has one key, and timing goes from "
                                  "key to key: two at least are expected",
                                  axis->name);
        if (axis->key_count != self->keys)
            return plan_error_set(
                self->error, MOTION_E_ARG, axis->place,
                "axis %s has %u keys, expected %u as axis %s: timing takes all "
                "axes from key to key together",
                axis->name, axis->key_count, self->keys,
                joints_axis(self, 0)->name);
    }
    return MOTION_OK;
}

/* From key k to the next, in seconds at the largest velocities. */
static double joints_distance(const struct joints *self, uint32_t k)
{
    double sum = 0;

    for (uint32_t i = 0; i < self->joints->axes; i++) {
        const struct plan_key *key = &joints_axis(self, i)->key[k];
        const double d =
            ((double)key[1].key.pos_q32 - (double)key[0].key.pos_q32) /
            (double)self->joints->limit[i].vel_q32;
        sum += d * d;
    }
    return sqrt(sum);
}

/* A second from key to key in the mean. */
static int joints_parameter(struct joints *self)
{
    double sum = 0, at = 0;

    for (uint32_t k = 0; k + 1 < self->keys; k++)
        sum += sqrt(joints_distance(self, k));
    const double mean = sum / (self->keys - 1);
    for (uint32_t k = 0; k + 1 < self->keys; k++) {
        const double step = sqrt(joints_distance(self, k));
        if (!(step > JOINTS_LEAST * mean))
            return plan_error_set(
                self->error, MOTION_E_ORDER,
                joints_axis(self, 0)->key[k + 1].place,
                "key %u is the same as the one before it in all axes",
                (unsigned)k + 2);
        at += step / mean;
        self->t_ns_q12[k + 1] = llround(at * (double)MOTION_FIXED_S_Q12);
    }
    return MOTION_OK;
}

static int joints_curve(struct joints *self, uint32_t i)
{
    struct plan_axis axis = *joints_axis(self, i);
    struct plan_key *key = malloc(self->keys * sizeof *key);
    int err;

    if (key == NULL)
        return plan_error_set(self->error, MOTION_E_FULL, axis.place,
                              "no memory for axis %s", axis.name);
    memcpy(key, axis.key, self->keys * sizeof *key);
    for (uint32_t k = 0; k < self->keys; k++)
        key[k].key.t_ns_q12 = self->t_ns_q12[k];
    axis.key = key;
    err = plan_axis_track(&axis, &self->curve[i], self->error);
    free(key);
    return err;
}

static int joints_refuse(const struct joints *self, int code, double failed)
{
    uint32_t key = 0;

    if (code != MOTION_E_LIMIT || isnan(failed))
        return plan_error_set(self->error, code, self->joints->place,
                              "the fastest times cannot be found (%s)",
                              motion_err_text(code));
    while (key + 2 < self->keys && (double)self->t_ns_q12[key + 1] <=
                                       failed * (double)MOTION_FIXED_S_Q12)
        key++;
    return plan_error_set(self->error, code, self->joints->place,
                          "no speed is inside the limits after key %u",
                          (unsigned)key + 1);
}

static int joints_time(struct joints *self, struct motion_track own[])
{
    const struct plan_joints *joints = self->joints;
    const struct motion_track *list[PLAN_JOINTS_MAX];
    int64_t start_q32[PLAN_JOINTS_MAX], end_q32[PLAN_JOINTS_MAX];
    struct motion_real bound[PLAN_JOINTS_MAX];
    struct plan_timing timing;
    double failed, stretch = 1;
    int err;

    for (uint32_t i = 0; i < joints->axes; i++) {
        const struct plan_axis *axis = joints_axis(self, i);
        list[i] = &self->curve[i];
        start_q32[i] = axis->key[0].key.pos_q32;
        end_q32[i] = axis->key[self->keys - 1].key.pos_q32;
    }
    err = plan_timing_solve(list, joints->axes, joints->limit, NULL, 0, NULL,
                            &timing, &failed);
    if (err < 0)
        return joints_refuse(self, err, failed);
    err = plan_timing_inside(
        &timing, &stretch, joints->limit, start_q32, end_q32,
        motion_real_from_q(joints->tolerance_q32, 32), own, bound);
    plan_timing_free(&timing);
    return err < 0 ? joints_refuse(self, err, NAN) : err;
}

static int joints_run(struct joints *self, struct motion_track track[])
{
    const struct plan_joints *joints = self->joints;
    struct motion_track own[PLAN_JOINTS_MAX] = { 0 };
    int err = joints_parameter(self);

    for (uint32_t i = 0; err == MOTION_OK && i < joints->axes; i++)
        err = joints_curve(self, i);
    if (err == MOTION_OK)
        err = joints_time(self, own);
    for (uint32_t i = 0; err == MOTION_OK && i < joints->axes; i++)
        track[joints->axis[i]] = own[i];
    return err;
}

int plan_joints_tracks(const struct plan_move *move,
                       struct motion_track track[], struct plan_error *error)
{
    struct joints *self = calloc(1, sizeof *self);
    int err;

    if (self == NULL)
        return plan_error_set(error, MOTION_E_FULL, move->joints->place,
                              "no memory for the times");
    self->move = move;
    self->joints = move->joints;
    self->error = error;
    self->keys = joints_axis(self, 0)->key_count;
    self->t_ns_q12 = calloc(self->keys + 1, sizeof *self->t_ns_q12);
    err = self->t_ns_q12 == NULL
              ? plan_error_set(error, MOTION_E_FULL, move->joints->place,
                               "no memory for the times")
              : joints_check(self);
    if (err == MOTION_OK && self->t_ns_q12 != NULL)
        err = joints_run(self, track);
    for (uint32_t i = 0; i < self->joints->axes; i++)
        plan_track_free(&self->curve[i]);
    free(self->t_ns_q12);
    free(self);
    return err;
}
