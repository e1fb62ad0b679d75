/* motion/plan/camera/plan_orient.c - see plan_orient.h.
 *
 * The rotation at a time is motion/path/orient.h's; motion/path/head.h turns it
 * into angles and bakes these within the tolerance.  Borders of the baker are
 * the keys, where a derivative of the rotation may step. */
#include "motion/plan/camera/plan_orient.h"

#include <stdlib.h>

#include "motion/core/err.h"
#include "motion/core/fixed.h"
#include "motion/number/trig.h"
#include "motion/plan/plan_error.h"
#include "motion/plan/plan_track.h"

/* Keys at least so far apart, so that segments and stencils fit between. */
#define ORIENT_SPAN_MIN (MOTION_FIXED_S_Q12 / 1000)
/* Segments, about 60 us: as a camera that looks at something. */
#define ORIENT_SHORTEST (MOTION_FIXED_S_Q12 >> 14)
/* Looks of the baker, at most: so many, and per key. */
#define ORIENT_LOOKS     20000
#define ORIENT_KEY_LOOKS 64
/* Segments per key for which there is room at once. */
#define ORIENT_CAPACITY 8
/* So near to the vertical, 10 degrees, it is what pan and roll suffer from. */
#define ORIENT_STEEP (MOTION_TRIG_QUARTER_TURN / 9 * 8)

/* --- keys ----------------------------------------------------------------- */

static int orient_key_fail(const struct plan_camera *camera, uint32_t i,
                           int code, const char *what, struct plan_error *error)
{
    return plan_error_set(error, code, camera->orient.key[i].place,
                          "orientation %u %s", (unsigned)i + 1, what);
}

static int orient_check_time(const struct plan_camera *camera, uint32_t i,
                             struct plan_error *error)
{
    const struct plan_orient_key *key = &camera->orient.key[i];
    const int64_t t = key->t_ns_q12;
    const int64_t span = i > 0 ? t - key[-1].t_ns_q12 : t;

    if (t < 0 || (i > 0 && span <= 0))
        return orient_key_fail(camera, i, MOTION_E_ORDER,
                               "is not later than the one before it", error);
    if (span < ORIENT_SPAN_MIN && t > 0)
        return orient_key_fail(camera, i, MOTION_E_RANGE,
                               i > 0 ? "is less than 1 ms after the one before"
                                     : "is less than 1 ms after the start",
                               error);
    if (span > MOTION_TRACK_SEGMENT_MAX_NS_Q12)
        return orient_key_fail(camera, i, MOTION_E_RANGE,
                               "is later than the longest segment lasts: give "
                               "one between",
                               error);
    return MOTION_OK;
}

/* Where a key is: its time, or its distance along the path. */
static int orient_place(const struct plan_camera *camera,
                        const struct plan_space *space, uint32_t i,
                        struct motion_orient_key *to, struct plan_error *error)
{
    const struct plan_orient_key *from = &camera->orient.key[i];

    if (space == NULL) {
        to->t = from->t_ns_q12;
        return orient_check_time(camera, i, error);
    }
    /* rounded down as the length is, so that 100 % is on the path */
    if (motion_real_floor(
            plan_speed_law_distance(&from->at, space->table.length), 32,
            &to->t) < 0 ||
        to->t > space->length_q32)
        return orient_key_fail(camera, i, MOTION_E_RANGE,
                               "is beyond the end of the path", error);
    if (i > 0 && to->t <= to[-1].t)
        return orient_key_fail(camera, i, MOTION_E_ORDER,
                               "is not further along the path than the one "
                               "before it",
                               error);
    return MOTION_OK;
}

static int orient_keys(const struct plan_camera *camera,
                       const struct plan_space *space,
                       struct motion_orient *orient, struct plan_error *error)
{
    struct motion_quat mount = MOTION_QUAT_ONE;
    int err = plan_camera_mount(camera, &mount);

    if (err < 0)
        return plan_error_set(error, err, camera->place,
                              "the camera has parallel forward and up");
    for (uint32_t i = 0; i < orient->count && err == MOTION_OK; i++) {
        const struct plan_orient_key *from = &camera->orient.key[i];
        orient->key[i].q =
            from->has_angles
                ? motion_head_quat(from->head.turn)
                : motion_quat_mul(motion_quat_inverse(mount), from->q);
        err = orient_place(camera, space, i, &orient->key[i], error);
    }
    return err;
}

int plan_turning_init(struct plan_turning *turning,
                      const struct plan_camera *camera,
                      const struct plan_space *space, struct plan_error *error)
{
    struct motion_orient *const orient = &turning->orient;
    const uint32_t count = camera->orient.count;
    int err;

    *turning = (struct plan_turning){
        .orient = { .curve = camera->orient.curve, .count = count },
        .start = camera->orient.key[0].head,
    };
    orient->key = calloc(count, sizeof *orient->key);
    orient->rotkey = calloc(count, sizeof *orient->rotkey);
    if (orient->key == NULL || orient->rotkey == NULL)
        return plan_error_set(error, MOTION_E_FULL, camera->place,
                              "the camera has no memory");
    err = orient_keys(camera, space, orient, error);
    if (err < 0)
        return err;
    err = motion_orient_plan(orient);
    return err < 0 ? plan_turning_refuse(camera, err, error) : MOTION_OK;
}

void plan_turning_free(struct plan_turning *turning)
{
    free(turning->orient.key);
    free(turning->orient.rotkey);
    *turning = (struct plan_turning){ .start = { .valid = false } };
}

int plan_turning_refuse(const struct plan_camera *camera, int err,
                        struct plan_error *error)
{
    if (err == MOTION_E_DIVERGED || err == MOTION_E_RANGE)
        return plan_error_set(error, err, camera->look_place,
                              "the camera has no curve through orientations "
                              "that are almost half a turn apart: give one "
                              "between them, or curve slerp");
    return plan_error_set(error, err, camera->look_place,
                          "the camera cannot turn like this (%s)",
                          motion_err_text(err));
}

/* --- tracks --------------------------------------------------------------- */

struct orient_run {
    const struct plan_camera *camera;
    struct plan_turning turning;
    const struct plan_progress *progress;
    struct plan_error *error;
    int64_t last_ns_q12, told_ns_q12; /* asked for last; the latest of these */
};

static int orient_run_at(void *context, int64_t t_ns_q12, struct motion_quat *q)
{
    struct orient_run *self = context;
    const struct motion_orient *orient = &self->turning.orient;

    self->last_ns_q12 = t_ns_q12;
    if (t_ns_q12 > self->told_ns_q12)
        self->told_ns_q12 = t_ns_q12;
    plan_progress_tell(self->progress, "planning", "camera", self->told_ns_q12,
                       orient->key[orient->count - 1].t);
    return motion_orient_at(orient, t_ns_q12, q);
}

/* Does the camera look almost straight up or down there? */
static bool orient_is_steep(struct orient_run *self)
{
    struct motion_head head = { .valid = false };
    struct motion_quat q = MOTION_QUAT_ONE;

    (void)motion_orient_at(&self->turning.orient, self->last_ns_q12, &q);
    (void)motion_head_follow(&head, q);
    return head.turn[MOTION_HEAD_TILT] > ORIENT_STEEP ||
           head.turn[MOTION_HEAD_TILT] < -ORIENT_STEEP;
}

static int orient_refuse(struct orient_run *self, int err)
{
    const struct plan_camera *camera = self->camera;
    const double t_s = (double)self->last_ns_q12 / (double)MOTION_FIXED_S_Q12;
    const double tolerance =
        (double)camera->tolerance_q32 / (double)MOTION_FIXED_ONE_Q32;

    if (err == MOTION_E_WORK)
        return plan_error_set(self->error, err, camera->place,
                              "the camera takes too much work to plan: it came "
                              "to %.3f s, so give it a larger tolerance than "
                              "%.3g deg",
                              t_s, tolerance);
    if (err != MOTION_E_TOLERANCE)
        return plan_turning_refuse(camera, err, self->error);
    if (orient_is_steep(self))
        return plan_error_set(self->error, err, camera->look_place,
                              "at %.3f s the camera turns past straight up or "
                              "down faster than pan and roll can follow: give "
                              "it orientations farther from there",
                              t_s);
    return plan_error_set(self->error, err, camera->place,
                          "at %.3f s the camera cannot be kept within its "
                          "tolerance of %.3g deg: give a larger one",
                          t_s, tolerance);
}

/* From the start of the move, where it waits for a first key that is later. */
static uint32_t orient_borders(const struct motion_orient *orient,
                               int64_t border_ns_q12[])
{
    uint32_t count = 0;

    if (orient->key[0].t > 0)
        border_ns_q12[count++] = 0;
    for (uint32_t i = 0; i < orient->count; i++)
        border_ns_q12[count++] = orient->key[i].t;
    return count;
}

static int orient_grow(struct motion_track *list[])
{
    for (int i = 0; i < MOTION_HEAD_AXES; i++)
        if (plan_track_grow(list[i]) < 0)
            return MOTION_E_FULL;
    return MOTION_OK;
}

static int orient_bake(struct orient_run *self, const int64_t border_ns_q12[],
                       uint32_t borders, struct motion_track *list[],
                       int64_t bound_q32[])
{
    const struct motion_turning turning = { orient_run_at, self };
    const struct motion_head_bake job = {
        .border_ns_q12 = border_ns_q12,
        .borders = borders,
        .tolerance_q32 = self->camera->tolerance_q32,
        .shortest_ns_q12 = ORIENT_SHORTEST,
        .evaluations = ORIENT_LOOKS + ORIENT_KEY_LOOKS * borders,
        .is_rest = true,
    };
    struct motion_head head = self->turning.start;
    int err = motion_head_follow(&head, self->turning.orient.key[0].q);

    for (int i = 0; i < MOTION_HEAD_AXES && err == MOTION_OK; i++) {
        plan_track_init(list[i],
                        motion_head_deg_q32(&head, (enum motion_head_axis)i));
        plan_track_reserve(list[i], ORIENT_CAPACITY * (size_t)borders);
    }
    if (err < 0)
        return err;
    do
        err = motion_head_bake(&job, &turning, &head, list, bound_q32);
    while (err == MOTION_E_FULL && orient_grow(list) == MOTION_OK);
    return err;
}

int plan_orient_tracks(const struct plan_camera *camera,
                       struct motion_track *list[MOTION_HEAD_AXES],
                       int64_t bound_q32[MOTION_HEAD_AXES],
                       const struct plan_progress *progress,
                       struct plan_error *error)
{
    struct orient_run self = { .camera = camera,
                               .progress = progress,
                               .error = error };
    int64_t *border_ns_q12;
    int err = plan_turning_init(&self.turning, camera, NULL, error);

    if (err == MOTION_OK) {
        border_ns_q12 =
            malloc(((size_t)camera->orient.count + 1) * sizeof *border_ns_q12);
        err = border_ns_q12 == NULL ? MOTION_E_FULL : MOTION_OK;
        if (err == MOTION_OK)
            err =
                orient_bake(&self, border_ns_q12,
                            orient_borders(&self.turning.orient, border_ns_q12),
                            list, bound_q32);
        if (err < 0)
            err = orient_refuse(&self, err);
        free(border_ns_q12);
    }
    plan_turning_free(&self.turning);
    return err;
}
