/* tests/motion/kinematics/rig_inverse.c - see rig_inverse.h. */
#include "tests/motion/kinematics/rig_inverse.h"

#include "motion/core/err.h"
#include "motion/double/double_math.h"

int rig_inverse_pose(const struct motion_rig *rig,
                     const struct motion_camera *camera,
                     const int64_t *before_q32, int64_t *axis_q32)
{
    const uint32_t carried = motion_rig_axes(rig) - MOTION_HEAD_AXES;
    const struct motion_vec pivot = motion_vec_sub(
        camera->pupil, motion_pan_tilt_nodal(&rig->head, camera->q));
    struct motion_head head = { .valid = false };
    struct motion_mount mount;
    int err =
        rig->carrier.kind->find(&rig->carrier, pivot, before_q32, axis_q32);

    if (err == MOTION_OK)
        err = rig->carrier.kind->place(&rig->carrier, axis_q32, &mount);
    for (int i = 0; i < MOTION_HEAD_AXES && before_q32 != NULL; i++) {
        int64_t deg_q32;
        if (err == MOTION_OK)
            err = motion_axis_coordinate(&rig->head.axis[i],
                                         before_q32[carried + (uint32_t)i],
                                         &deg_q32);
        if (err == MOTION_OK)
            motion_head_set_deg_q32(&head, (enum motion_head_axis)i, deg_q32);
    }
    if (err == MOTION_OK)
        err = motion_head_follow(
            &head,
            motion_quat_mul(motion_quat_inverse(mount.level), camera->q));
    for (int i = 0; i < MOTION_HEAD_AXES && err == MOTION_OK; i++)
        err = motion_axis_position(
            &rig->head.axis[i],
            motion_head_deg_q32(&head, (enum motion_head_axis)i),
            &axis_q32[carried + (uint32_t)i]);
    return err;
}

int rig_inverse_level_view(struct motion_vec pupil, struct motion_vec subject,
                           struct motion_camera *camera)
{
    const struct motion_vec up =
        motion_vec_from_dir((struct motion_dir){ { 0, 0, (int64_t)1 << 62 } });
    const struct motion_vec view = motion_vec_sub(subject, pupil);

    camera->pupil = pupil;
    return motion_mount_is_near(motion_vec_length(view)) ||
                   motion_mount_level(view, up, &camera->q) < 0
               ? MOTION_E_SINGULAR
               : MOTION_OK;
}

#define DEGREES (1 / DOUBLE_RADIAN)

/* --- a subject ------------------------------------------------------------- */

struct track {
    struct motion_nodal nodal;
    struct plan_rig_frame mount;
    struct plan_jet_vec off; /* of the subject from the pivot */
    struct plan_jet roll;
    double pan, tilt; /* before, degrees */
    bool has_before;
    double best[2], distance, cost; /* cost: -1 without an answer */
};

static void track_judge(struct track *track, double pan, double tilt,
                        double distance)
{
    const double got[2] = {
        track->pan + remainder(pan * DEGREES - track->pan, 360),
        track->tilt + remainder(tilt * DEGREES - track->tilt, 360),
    };
    const double by_pan = track->has_before ? got[0] - track->pan : 0,
                 by_tilt = got[1] - track->tilt,
                 cost = by_pan * by_pan + by_tilt * by_tilt;

    if (!(distance > ldexp((double)MOTION_KINEMATICS_NEAR_Q32, -32)) ||
        (track->cost >= 0 && cost >= track->cost))
        return;
    track->cost = cost;
    track->best[0] = got[0];
    track->best[1] = got[1];
    track->distance = distance;
}

/* A head whose up and forward turned over pans the other way, and its tilt counts
 * from behind; one that looks backwards rolls the other way, too. */
static int track_try(struct track *track, bool is_over, bool is_behind)
{
    const double forward = ldexp((double)track->nodal.forward_q32, -32);
    struct motion_nodal nodal = track->nodal;
    struct plan_rig_frame mount = track->mount;
    const double sign = is_over ? -1 : 1;
    struct plan_rig_aim aim;
    double pan, tilt;

    if (is_behind)
        nodal = (struct motion_nodal){ 0, -nodal.right_q32, nodal.up_q32 };
    mount.forward = plan_jet_vec_mul(mount.forward, plan_jet_of(sign));
    mount.up = plan_jet_vec_mul(mount.up, plan_jet_of(sign));
    const int err =
        plan_rig_look(&nodal, &mount, track->off,
                      plan_jet_scale(track->roll, is_behind ? -1 : 1), &aim);
    if (err < 0)
        return err;
    pan = sign * aim.pan.p;
    tilt = aim.tilt.p + (is_over ? DOUBLE_PI : 0);
    if (is_behind) {
        pan += DOUBLE_PI;
        tilt = -tilt;
    }
    track_judge(track, pan, tilt,
                is_behind ? -aim.distance.p - forward : aim.distance.p);
    return MOTION_OK;
}

/* On the axis of pan there is no answer but beside it, where pan was before: so
 * far, of the distance. */
#define ASIDE 1.2e-9

static void track_aside(struct track *track)
{
    const struct plan_jet length =
        plan_jet_sqrt(plan_jet_vec_dot(track->off, track->off));
    struct plan_jet_vec aside = track->mount.forward, left = track->mount.left;

    plan_jet_vec_swing(&aside, &left, plan_jet_of(track->pan / DEGREES));
    track->off = plan_jet_vec_add(
        track->off, plan_jet_vec_mul(aside, plan_jet_scale(length, ASIDE)));
}

int rig_inverse_track(const struct motion_rig *rig, struct motion_vec subject,
                      const int64_t *before_q32, int64_t *axis_q32,
                      double *distance)
{
    const uint32_t carried = motion_rig_axes(rig) - MOTION_HEAD_AXES;
    const struct motion_axis_map *const map = rig->head.axis;
    struct track track = { .nodal = rig->head.nodal,
                           .has_before = before_q32 != NULL,
                           .cost = -1 };
    struct plan_jet axis[MOTION_RIG_AXES_MAX], before[2] = { { 0, 0, 0 } };
    struct plan_jet_vec pivot;
    int err = MOTION_E_UNREACHABLE;

    for (uint32_t i = 0; i < motion_rig_axes(rig); i++)
        axis[i] = plan_jet_of(ldexp((double)axis_q32[i], -32));
    for (uint32_t i = 0; i < 2 && before_q32 != NULL; i++)
        before[i] = plan_rig_coordinate(
            &map[i], plan_jet_of(ldexp((double)before_q32[carried + i], -32)));
    track.pan = before[0].p;
    track.tilt = before[1].p;
    plan_rig_mount(&rig->carrier, axis, &pivot, &track.mount);
    track.off = plan_jet_vec_of((const double[]){
        plan_rig_real(subject.x[0]), plan_rig_real(subject.x[1]),
        plan_rig_real(subject.x[2]) });
    track.off = plan_jet_vec_sub(track.off, pivot);
    track.roll =
        plan_jet_scale(plan_rig_coordinate(&map[MOTION_HEAD_ROLL],
                                           axis[carried + MOTION_HEAD_ROLL]),
                       1 / DEGREES);
    err = track_try(&track, false, false);
    const bool is_pole = err == MOTION_E_SINGULAR;
    if (is_pole) {
        track_aside(&track);
        err = track_try(&track, false, false);
        if (err == MOTION_OK && before_q32 == NULL)
            err = MOTION_E_SINGULAR;
    }
    for (int way = 1; way < 4 && err == MOTION_OK; way++)
        (void)track_try(&track, way & 1, way & 2);
    if (err < 0 || track.cost < 0)
        return err < 0 ? err : MOTION_E_UNREACHABLE;
    if (is_pole) { /* pan keeps, and tilt is as far off again, twice as far */
        struct track farther = track;
        farther.cost = -1;
        track_aside(&farther);
        for (int way = 0; way < 4; way++)
            (void)track_try(&farther, way & 1, way & 2);
        track.best[0] = track.pan;
        track.best[1] += track.best[1] - farther.best[1];
    }
    for (int i = 0; i < 2; i++)
        axis_q32[carried + (uint32_t)i] = llround(ldexp(
            plan_rig_position(&map[i], plan_jet_of(track.best[i])).p, 32));
    *distance = track.distance;
    return MOTION_OK;
}
