/* motion/plan/camera/plan_follow.c - see plan_follow.h.
 *
 * Pan is unique but for whole turns.  The move is walked once in even steps, in
 * each of which the head turns by less than half a turn, and a time takes the
 * turns of the step it is in. */
#include "motion/plan/camera/plan_follow.h"

#include <stdlib.h>

#include "motion/core/err.h"
#include "motion/core/fixed.h"
#include "motion/double/double_math.h"
#include "motion/plan/camera/plan_bake.h"
#include "motion/plan/camera/plan_keyed.h"
#include "motion/plan/plan_error.h"
#include "motion/plan/plan_track.h"

/* Steps of the walk, at least, and per border. */
#define FOLLOW_ROWS        4096
#define FOLLOW_BORDER_ROWS 16
#define FOLLOW_TRACKS_MAX                                                      \
    (MOTION_CARRIER_AXES_MAX + 1 + PLAN_SPACE_AXES +                           \
     1) /* carrier, table,     \
                                                           subject, roll */

struct follow {
    const struct plan_camera *camera;
    const struct plan_rig *rig;
    const struct motion_track *track; /* of the move */
    struct plan_error *error;
    struct plan_keyed keyed;
    const struct motion_track *cause[FOLLOW_TRACKS_MAX];
    uint32_t causes;
    struct plan_bake bake;
    double *pan; /* degrees, of the axis, at rows + 1 even times */
    uint32_t rows;
    double focal; /* per distance */
    int64_t last_ns_q12;
    enum plan_lens lens; /* that is baked */
};

static double follow_s(int64_t t_ns_q12)
{
    return (double)t_ns_q12 / (double)MOTION_FIXED_S_Q12;
}

static int follow_no_memory(const struct follow *self)
{
    return plan_error_set(self->error, MOTION_E_FULL, self->camera->place,
                          "the camera has no memory");
}

/* ---- what the camera sees ------------------------------------------------ */

static struct plan_jet_vec follow_subject(const struct follow *self, int64_t t,
                                          int side)
{
    const struct plan_jet_vec at =
        plan_keyed_subject(&self->keyed, self->camera, t, side);

    if (self->camera->look != PLAN_LOOK_TABLE)
        return at;
    return plan_rig_on_table(
        self->rig, plan_rig_track(&self->track[self->rig->table.axis], t, side),
        at);
}

static int follow_aim(const struct follow *self, int64_t t, int side,
                      struct plan_rig_aim *aim)
{
    const struct plan_rig *rig = self->rig;
    struct plan_jet axis[MOTION_CARRIER_AXES_MAX] = { { 0, 0, 0 } };
    struct plan_jet_vec pivot;
    struct plan_rig_frame mount;

    for (int i = 0; i < MOTION_CARRIER_AXES_MAX; i++)
        if (rig->carrier[i].is_given)
            axis[i] =
                plan_rig_track(&self->track[rig->carrier[i].axis], t, side);
    plan_rig_mount(&rig->rig.carrier, axis, &pivot, &mount);
    return plan_rig_look(&rig->rig.head.nodal, &mount,
                         plan_jet_vec_sub(follow_subject(self, t, side), pivot),
                         plan_keyed_roll(&self->keyed, t, side), aim);
}

static struct plan_jet follow_axis(const struct follow *self,
                                   enum motion_head_axis axis,
                                   struct plan_jet angle)
{
    return plan_rig_position(&self->rig->rig.head.axis[axis],
                             plan_jet_scale(angle, 1 / DOUBLE_RADIAN));
}

/* Is the carrier within the limits that its kind has? */
static int follow_check_carrier(const struct follow *self, int64_t t)
{
    const struct plan_rig *rig = self->rig;
    int64_t axis_q32[MOTION_CARRIER_AXES_MAX] = { 0 };
    struct motion_mount mount;

    for (int i = 0; i < MOTION_CARRIER_AXES_MAX; i++)
        if (rig->carrier[i].is_given)
            axis_q32[i] =
                llround(ldexp(plan_rig_track(&self->track[rig->carrier[i].axis],
                                             t, MOTION_BAKE_LEFT)
                                  .p,
                              32));
    return rig->rig.carrier.kind->place(&rig->rig.carrier, axis_q32, &mount);
}

static int follow_refuse(const struct follow *self, int err, int64_t t)
{
    const char *what = motion_err_text(err);

    if (err == MOTION_E_SINGULAR)
        what = "the subject is in the camera or on the axis of pan, where "
               "there is no direction to it: pass farther from it";
    if (err == MOTION_E_UNREACHABLE)
        what = "the subject is nearer than the entrance pupil goes round the "
               "head: pass farther from it";
    if (err == MOTION_E_LIMIT)
        what = self->rig->rig.carrier.kind == &motion_carrier_rail
                   ? "the carriage is beyond the end of its rail"
                   : "the boom is beyond its extension, or beyond the vertical";
    return plan_error_set(self->error, err, self->camera->look_place,
                          "at %.3f s %s", follow_s(t), what);
}

/* ---- the walk ------------------------------------------------------------ */

static int64_t follow_end(const struct follow *self)
{
    return self->bake.border_ns_q12[self->bake.borders - 1];
}

static int64_t follow_row_at(const struct follow *self, uint32_t row)
{
    int64_t t = 0;

    (void)motion_fixed_muldiv(follow_end(self), row, self->rows, &t);
    return t;
}

static double follow_nearest(double angle, double to)
{
    return angle + 360 * floor((to - angle) / 360 + 0.5);
}

/* Whole turns of pan with which its positions fit the limits, the fewest. */
static double follow_turns(const struct follow *self, double low, double high)
{
    const struct plan_limit *limit = &self->camera->limit[MOTION_HEAD_PAN];
    const double min = ldexp((double)limit->pos_min_q32, -32),
                 max = ldexp((double)limit->pos_max_q32, -32);
    const double least = ceil((min - low) / 360);

    if (low >= min && high <= max)
        return 0;
    const double most = floor((max - high) / 360);
    if (least > most)
        return 0;
    return 360 * (least > 0 ? least : most);
}

static int follow_walk(struct follow *self)
{
    double low = 0, high = 0;

    self->rows = FOLLOW_BORDER_ROWS * self->bake.borders;
    self->rows = self->rows > FOLLOW_ROWS ? self->rows : FOLLOW_ROWS;
    self->pan = calloc((size_t)self->rows + 1, sizeof *self->pan);
    if (self->pan == NULL)
        return follow_no_memory(self);
    for (uint32_t i = 0; i <= self->rows; i++) {
        const int64_t t = follow_row_at(self, i);
        struct plan_rig_aim aim;
        int err = follow_check_carrier(self, t);
        if (err == MOTION_OK)
            err = follow_aim(self, t, MOTION_BAKE_LEFT, &aim);
        if (err < 0)
            return follow_refuse(self, err, t);
        const double pan = follow_axis(self, MOTION_HEAD_PAN, aim.pan).p;
        self->pan[i] = i == 0 ? pan : follow_nearest(pan, self->pan[i - 1]);
        low = i == 0 ? self->pan[i] : fmin(low, self->pan[i]);
        high = i == 0 ? self->pan[i] : fmax(high, self->pan[i]);
    }
    const double turns = follow_turns(self, low, high);
    for (uint32_t i = 0; i <= self->rows; i++)
        self->pan[i] += turns;
    return MOTION_OK;
}

static double follow_pan_near(const struct follow *self, int64_t t)
{
    int64_t row = 0;

    (void)motion_fixed_muldiv(t, self->rows, follow_end(self), &row);
    return self->pan[row];
}

/* ---- borders ------------------------------------------------------------- */

static void follow_cause(struct follow *self, const struct motion_track *track)
{
    self->cause[self->causes++] = track;
}

static void follow_causes(struct follow *self)
{
    for (int i = 0; i < MOTION_CARRIER_AXES_MAX; i++)
        if (self->rig->carrier[i].is_given)
            follow_cause(self, &self->track[self->rig->carrier[i].axis]);
    if (self->camera->look == PLAN_LOOK_TABLE)
        follow_cause(self, &self->track[self->rig->table.axis]);
    for (int i = 0;
         self->camera->look == PLAN_LOOK_SUBJECT && i < PLAN_SPACE_AXES; i++)
        follow_cause(self, &self->keyed.subject[i]);
    follow_cause(self, &self->keyed.roll);
}

/* ---- sources of the baker ------------------------------------------------ */

static int follow_head_at(void *context, int64_t t, enum motion_bake_side side,
                          struct motion_bake_point point[])
{
    struct follow *self = context;
    struct plan_rig_aim aim;
    int err = follow_aim(self, t, side, &aim);

    self->last_ns_q12 = t;
    if (err < 0)
        return err;
    struct plan_jet pan = follow_axis(self, MOTION_HEAD_PAN, aim.pan);
    pan.p = follow_nearest(pan.p, follow_pan_near(self, t));
    point[MOTION_HEAD_PAN] = plan_bake_point(pan);
    point[MOTION_HEAD_TILT] =
        plan_bake_point(follow_axis(self, MOTION_HEAD_TILT, aim.tilt));
    point[MOTION_HEAD_ROLL] = plan_bake_point(follow_axis(
        self, MOTION_HEAD_ROLL, plan_keyed_roll(&self->keyed, t, side)));
    return MOTION_OK;
}

static struct plan_jet follow_lens(const struct follow *self,
                                   struct plan_jet distance)
{
    return self->lens == PLAN_LENS_FOCUS
               ? distance
               : plan_jet_scale(distance, self->focal);
}

static int follow_lens_at(void *context, int64_t t, enum motion_bake_side side,
                          struct motion_bake_point point[])
{
    struct follow *self = context;
    struct plan_rig_aim aim;
    int err = follow_aim(self, t, side, &aim);

    self->last_ns_q12 = t;
    if (err == MOTION_OK)
        *point = plan_bake_point(follow_lens(self, aim.distance));
    return err;
}

/* ---- baking -------------------------------------------------------------- */

static int follow_refuse_bake(const struct follow *self, int err)
{
    const int64_t t = self->last_ns_q12;
    struct plan_rig_aim aim;

    if (err == MOTION_E_WORK)
        return plan_error_set(
            self->error, err, self->camera->place,
            "the camera takes too much work to plan: it came to %.3f s in the "
            "%u evaluations that it may take, so give it a larger tolerance",
            follow_s(t), plan_bake_looks(&self->bake));
    if (err != MOTION_E_TOLERANCE ||
        follow_aim(self, t, MOTION_BAKE_LEFT, &aim) < 0)
        return follow_refuse(self, err, t);
    return plan_error_set(
        self->error, err, self->camera->look_place,
        "at %.3f s the camera would have to pan at %.4g deg/s and tilt at %.4g "
        "deg/s, too fast to be planned: pass farther from the subject, or "
        "slower",
        follow_s(t), fabs(aim.pan.v) / DOUBLE_RADIAN,
        fabs(aim.tilt.v) / DOUBLE_RADIAN);
}

static int follow_bake(struct follow *self, struct motion_track *list[],
                       struct motion_bake_report *report)
{
    int err = plan_bake_tracks(&self->bake, list, report);

    return err < 0 ? follow_refuse_bake(self, err) : MOTION_OK;
}

static int follow_head(struct follow *self, struct motion_track track[],
                       int64_t bound_q32[])
{
    const struct plan_camera *camera = self->camera;
    struct motion_track spare;
    struct motion_track *list[MOTION_HEAD_AXES] = {
        &track[camera->axis[MOTION_HEAD_PAN]],
        &track[camera->axis[MOTION_HEAD_TILT]],
        camera->has_roll ? &track[camera->axis[MOTION_HEAD_ROLL]] : &spare,
    };
    struct motion_bake_report report;

    plan_track_init(&spare, 0);
    self->bake.source = (struct motion_bake_source){ follow_head_at, self };
    self->bake.axes = MOTION_HEAD_AXES;
    self->bake.tolerance_q32 = camera->tolerance_q32;
    int err = follow_bake(self, list, &report);
    plan_track_free(&spare);
    for (uint32_t i = 0; i < MOTION_HEAD_AXES; i++)
        plan_bake_bound(&report, i, &bound_q32[i]);
    return err;
}

static int follow_size(struct follow *self)
{
    const struct plan_following *following = &self->camera->following;
    struct plan_rig_aim aim;

    if (!following->has_lens[PLAN_LENS_ZOOM])
        return MOTION_OK;
    int err = follow_aim(self, following->focal_ns_q12, MOTION_BAKE_LEFT, &aim);
    if (err < 0)
        return follow_refuse(self, err, following->focal_ns_q12);
    self->focal = ldexp((double)following->focal_q32, -32) / aim.distance.p;
    return MOTION_OK;
}

static int follow_lenses(struct follow *self, struct motion_track track[],
                         int64_t *bound_q32)
{
    int err = follow_size(self);

    self->bake.source = (struct motion_bake_source){ follow_lens_at, self };
    self->bake.axes = 1;
    self->bake.tolerance_q32 = PLAN_FOLLOW_LENS_Q32;
    for (int i = 0; i < PLAN_LENSES && err == MOTION_OK; i++) {
        struct motion_track *lens = &track[self->rig->lens[i].axis];
        struct motion_bake_report report;
        if (!self->camera->following.has_lens[i])
            continue;
        self->lens = (enum plan_lens)i;
        err = follow_bake(self, &lens, &report);
        plan_bake_bound(&report, 0, bound_q32);
    }
    return err;
}

/* ---- from keys ----------------------------------------------------------- */

static int follow_open(struct follow *self)
{
    plan_keyed_init(&self->keyed);
    return plan_keyed_open(&self->keyed, self->camera, self->error);
}

static void follow_close(struct follow *self)
{
    plan_keyed_free(&self->keyed);
    plan_bake_free(&self->bake);
    free(self->pan);
}

static void follow_end_track(struct motion_track *track, int err)
{
    if (err < 0)
        plan_track_free(track);
    else
        plan_track_trim(track);
}

int plan_follow_tracks(const struct plan_camera *camera,
                       struct motion_track track[],
                       int64_t bound_q32[MOTION_HEAD_AXES],
                       int64_t *lens_bound_q32, struct plan_error *error)
{
    struct follow self = { .camera = camera,
                           .rig = camera->following.rig,
                           .track = track,
                           .error = error };
    int err = follow_open(&self);

    if (err == MOTION_OK) {
        follow_causes(&self);
        err = plan_bake_borders(&self.bake, self.cause, self.causes, NULL, 0);
        err = err < 0 ? follow_no_memory(&self) : err;
    }
    if (err == MOTION_OK && follow_end(&self) > 0)
        err = follow_walk(&self);
    else if (err == MOTION_OK)
        err = plan_error_set(error, MOTION_E_EMPTY, camera->place,
                             "the camera follows nothing: neither its rig nor "
                             "its subject moves");
    if (err == MOTION_OK)
        err = follow_head(&self, track, bound_q32);
    if (err == MOTION_OK)
        err = follow_lenses(&self, track, lens_bound_q32);
    follow_close(&self);
    for (int i = 0; i < MOTION_HEAD_AXES; i++)
        if (i != MOTION_HEAD_ROLL || camera->has_roll)
            follow_end_track(&track[camera->axis[i]], err);
    for (int i = 0; i < PLAN_LENSES; i++)
        if (camera->following.has_lens[i])
            follow_end_track(&track[self.rig->lens[i].axis], err);
    return err;
}

bool plan_follow_subject(const struct plan_camera *camera,
                         const struct motion_track track[], int64_t t_ns_q12,
                         struct plan_jet_vec *subject)
{
    struct plan_error error;
    struct follow self = { .camera = camera,
                           .rig = camera->following.rig,
                           .track = track,
                           .error = &error };

    if (camera->look != PLAN_LOOK_AT && camera->look != PLAN_LOOK_SUBJECT &&
        (self.rig == NULL || camera->look != PLAN_LOOK_TABLE))
        return false;
    const int err = follow_open(&self);
    if (err == MOTION_OK)
        *subject = follow_subject(&self, t_ns_q12, MOTION_BAKE_LEFT);
    follow_close(&self);
    return err == MOTION_OK;
}
