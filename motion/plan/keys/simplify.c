/* motion/plan/keys/simplify.c - see simplify.h. */
#include "motion/plan/keys/simplify.h"

#include <stdlib.h>
#include <string.h>

#include "motion/core/err.h"
#include "motion/core/fixed.h"
#include "motion/plan/keys/stand.h"

struct simplify {
    const struct plan_axis *axis; /* all of its keys */
    struct plan_axis kept;        /* those that are */
    uint32_t *which;              /* of kept: index in axis */
    bool *keep;                   /* of axis */
    uint64_t tolerance_q32;
    const struct plan_limit *limit; /* of position; NULL: none */
    struct plan_error *error;
};

static void simplify_collect(struct simplify *self)
{
    self->kept.key_count = 0;
    for (uint32_t i = 0; i < self->axis->key_count; i++) {
        if (!self->keep[i])
            continue;
        self->which[self->kept.key_count] = i;
        self->kept.key[self->kept.key_count++] = self->axis->key[i];
    }
}

static uint64_t simplify_off_q32(const struct motion_track *track,
                                 struct motion_cursor *cursor,
                                 const struct motion_key *key)
{
    struct motion_sample sample;
    int64_t off_q32;
    motion_track_sample(track, cursor, key->t_ns_q12, &sample);
    return motion_fixed_sub(sample.pos_q32, key->pos_q32, &off_q32) < 0
               ? UINT64_MAX
               : motion_fixed_abs(off_q32);
}

/* Those that are kept, and the track through them; where it would leave the range at a
 * key, that one stands. */
static int simplify_plan(struct simplify *self, struct motion_track *track)
{
    int err;

    simplify_collect(self);
    while (
        (err = plan_axis_track(&self->kept, track, self->error)) == MOTION_OK &&
        self->limit != NULL && plan_stand(&self->kept, track, self->limit) > 0)
        plan_track_free(track);
    return err;
}

/* The middle of a span, when the track leaves the range in it at that time and there
 * is something between; else 0. */
static uint32_t simplify_middle(const struct simplify *self, uint32_t k,
                                int64_t at_ns_q12)
{
    const uint32_t from = self->which[k], to = self->which[k + 1];

    return to - from > 1 && at_ns_q12 > self->axis->key[from].key.t_ns_q12 &&
                   at_ns_q12 < self->axis->key[to].key.t_ns_q12
               ? from + (to - from) / 2
               : 0;
}

/* The furthest of each span becomes a key, where `adds`; how many are too far. */
static int simplify_judge(struct simplify *self, bool adds)
{
    struct motion_track track;
    struct motion_cursor cursor = { 0 };
    int far = 0;
    int64_t at_ns_q12 = 0;
    const int err = simplify_plan(self, &track);
    if (err < 0)
        return err;
    const bool leaves = self->limit != NULL &&
                        plan_stand_leaves(&track, self->limit, &at_ns_q12);
    for (uint32_t k = 0; k + 1 < self->kept.key_count; k++) {
        uint64_t most_q32 = self->tolerance_q32;
        uint32_t furthest = leaves ? simplify_middle(self, k, at_ns_q12) : 0;
        for (uint32_t i = self->which[k] + 1; i < self->which[k + 1]; i++) {
            const uint64_t off_q32 =
                simplify_off_q32(&track, &cursor, &self->axis->key[i].key);
            if (off_q32 <= most_q32)
                continue;
            most_q32 = off_q32;
            furthest = i;
        }
        far += furthest > 0;
        if (adds && furthest > 0)
            self->keep[furthest] = true;
    }
    plan_track_free(&track);
    return far;
}

static int simplify_add(struct simplify *self)
{
    int far;
    do
        far = simplify_judge(self, true);
    while (far > 0);
    return far;
}

static int simplify_drop(struct simplify *self)
{
    for (uint32_t i = 1; i + 1 < self->axis->key_count; i++) {
        if (!self->keep[i])
            continue;
        self->keep[i] = false;
        const int far = simplify_judge(self, false);
        if (far < 0)
            return far;
        self->keep[i] = far > 0;
    }
    const int far = simplify_judge(self, false); /* as they stay */
    return far < 0 ? far : MOTION_OK;
}

static int simplify_run(struct simplify *self)
{
    const uint32_t count = self->axis->key_count;
    self->keep[0] = self->keep[count - 1] = true;
    const int err = simplify_add(self);
    return err < 0 ? err : simplify_drop(self);
}

int plan_simplify(struct plan_axis *axis, int64_t tolerance_q32,
                  const struct plan_limit *limit, struct plan_error *error)
{
    const uint32_t count = axis->key_count;
    struct simplify self = { .axis = axis,
                             .kept = *axis,
                             .tolerance_q32 = (uint64_t)tolerance_q32,
                             .limit = limit,
                             .error = error };
    int err = MOTION_E_FULL;
    if (axis->curve == PLAN_CURVE_BSPLINE || axis->curve == PLAN_CURVE_BEZIER ||
        axis->curve == PLAN_CURVE_ROUNDED ||
        axis->curve == PLAN_CURVE_SMOOTHED || tolerance_q32 < 0)
        return MOTION_E_ARG;
    if (count < 3)
        return MOTION_OK;
    self.kept.key = malloc(count * sizeof *self.kept.key);
    self.which = malloc(count * sizeof *self.which);
    self.keep = calloc(count, sizeof *self.keep);
    if (self.kept.key != NULL && self.which != NULL && self.keep != NULL)
        err = simplify_run(&self);
    if (err == MOTION_OK) {
        memcpy(axis->key, self.kept.key,
               self.kept.key_count * sizeof *axis->key);
        axis->key_count = self.kept.key_count;
    }
    free(self.kept.key);
    free(self.which);
    free(self.keep);
    return err;
}
