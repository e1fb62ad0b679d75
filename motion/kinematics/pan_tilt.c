/* motion/kinematics/pan_tilt.c - see pan_tilt.h.
 *
 * Tracking in closed form.  With roll given, the pupil is at (n, l, u) from the
 * pivot in the frame that tilts (forward, left, up) and the view runs along its
 * first axis, so a subject at distance t is at v = (n + t, l, u) there and at
 * d = Rz(pan) Ry(-tilt) v in the mount.  Then
 *
 *     |d|^2 = X^2 + l^2 + u^2                       X = n + t
 *     d_up  = A sin(tilt + phi)                     X = A cos phi, u = A sin phi
 *     W     = A cos(tilt + phi), W^2 + l^2 = d_forward^2 + d_left^2
 *     pan   = angle(d_forward, d_left) - angle(W, l)
 *
 * with two signs of X (a pupil behind the pivot may see a near subject in both)
 * and two of W (upright and over the top). */
#include "motion/kinematics/pan_tilt.h"

#include "motion/core/err.h"
#include "motion/number/trig.h"

#define PAN_TILT_POLE_BITS 36 /* 2^-36 of the distance: above the pivot */

enum { FORWARD, LEFT, UP };

/* --- forward ------------------------------------------------------------- */

static int pan_tilt_turns(const struct motion_pan_tilt *head,
                          const int64_t axis_q32[MOTION_HEAD_AXES],
                          int64_t turn[MOTION_HEAD_AXES])
{
    for (int i = 0; i < MOTION_HEAD_AXES; i++) {
        int64_t deg_q32;
        int err = motion_axis_coordinate(&head->axis[i], axis_q32[i], &deg_q32);
        if (err < 0)
            return err;
        turn[i] = motion_trig_from_deg_q32(deg_q32);
    }
    return MOTION_OK;
}

struct motion_vec motion_pan_tilt_nodal(const struct motion_pan_tilt *head,
                                        struct motion_quat q)
{
    const struct motion_vec nodal = { {
        motion_real_from_q(head->nodal.right_q32, 32),
        motion_real_from_q(head->nodal.up_q32, 32),
        motion_real_neg(motion_real_from_q(head->nodal.forward_q32, 32)),
    } };

    return motion_mount_turn(q, nodal);
}

int motion_pan_tilt_camera(const struct motion_pan_tilt *head,
                           const struct motion_mount *mount,
                           const int64_t axis_q32[MOTION_HEAD_AXES],
                           struct motion_camera *camera)
{
    int64_t turn[MOTION_HEAD_AXES];
    int err = pan_tilt_turns(head, axis_q32, turn);

    if (err < 0)
        return err;
    camera->q = motion_quat_mul(mount->level, motion_head_quat(turn));
    camera->pupil =
        motion_vec_add(mount->pivot, motion_pan_tilt_nodal(head, camera->q));
    return MOTION_OK;
}

/* --- a rotation ---------------------------------------------------------- */

/* The angles of the head before, as motion_head counts them. */
static int pan_tilt_before(const struct motion_pan_tilt *head,
                           const int64_t before_q32[MOTION_HEAD_AXES],
                           struct motion_head *state)
{
    const int64_t circle_q32 = (int64_t)360 << 32;

    *state = (struct motion_head){ .valid = before_q32 != NULL };
    for (int i = 0; i < MOTION_HEAD_AXES && before_q32 != NULL; i++) {
        int64_t deg_q32, rest_q32;
        int err =
            motion_axis_coordinate(&head->axis[i], before_q32[i], &deg_q32);
        if (err < 0)
            return err;
        state->turn[i] = motion_trig_from_deg_q32(deg_q32);
        err = motion_fixed_sub(deg_q32, motion_trig_deg_q32(state->turn[i]),
                               &rest_q32);
        if (err < 0)
            return err;
        /* a whole number of turns but for a bit of rounding */
        state->whole[i] =
            (rest_q32 / 2 + (rest_q32 < 0 ? -1 : 1) * (circle_q32 / 4)) /
            (circle_q32 / 2);
    }
    return MOTION_OK;
}

int motion_pan_tilt_rotation(const struct motion_pan_tilt *head,
                             struct motion_quat level, struct motion_quat q,
                             const int64_t before_q32[MOTION_HEAD_AXES],
                             int64_t axis_q32[MOTION_HEAD_AXES])
{
    struct motion_head state;
    int err = pan_tilt_before(head, before_q32, &state);

    if (err == MOTION_OK)
        err = motion_head_follow(
            &state, motion_quat_mul(motion_quat_inverse(level), q));
    for (int i = 0; i < MOTION_HEAD_AXES && err == MOTION_OK; i++)
        err = motion_axis_position(
            &head->axis[i],
            motion_head_deg_q32(&state, (enum motion_head_axis)i),
            &axis_q32[i]);
    return err;
}

/* --- distances ----------------------------------------------------------- */

static struct motion_real pan_tilt_aside_sqr(const struct motion_pan_tilt *head)
{
    return motion_real_add(
        motion_real_sqr(motion_real_from_q(head->nodal.right_q32, 32)),
        motion_real_sqr(motion_real_from_q(head->nodal.up_q32, 32)));
}

struct motion_real motion_pan_tilt_reach(const struct motion_pan_tilt *head,
                                         struct motion_real distance)
{
    const struct motion_real x = motion_real_add(
        motion_real_from_q(head->nodal.forward_q32, 32), distance);

    return motion_real_sqrt(
        motion_real_add(motion_real_sqr(x), pan_tilt_aside_sqr(head)));
}

/* The distance for X; 0 or less is none. */
static struct motion_real pan_tilt_beyond(const struct motion_pan_tilt *head,
                                          struct motion_real x)
{
    return motion_real_sub(x, motion_real_from_q(head->nodal.forward_q32, 32));
}

int motion_pan_tilt_distance(const struct motion_pan_tilt *head,
                             struct motion_real reach,
                             struct motion_real *distance)
{
    const struct motion_real x =
        motion_mount_leg(reach, pan_tilt_aside_sqr(head));

    *distance = pan_tilt_beyond(head, x);
    if (motion_real_sign(x) < 0)
        return MOTION_E_UNREACHABLE;
    if (motion_mount_is_near(*distance))
        return MOTION_E_SINGULAR;
    return motion_real_sign(*distance) < 0 ? MOTION_E_UNREACHABLE : MOTION_OK;
}

/* --- tracking ------------------------------------------------------------ */

struct pan_tilt_track {
    struct motion_real d[3];     /* the subject in the mount */
    struct motion_real left, up; /* the pupil, turned by roll */
    bool is_pole;                /* pan is not determined */
    bool has_before;
    int64_t before_deg_q32[2]; /* pan and tilt; upright: 0 */
    struct motion_real cost;   /* of the best answer; below 0: none */
    int64_t best_deg_q32[2];
    struct motion_real distance;
    int err;
};

static void pan_tilt_in_mount(struct pan_tilt_track *track,
                              const struct motion_mount *mount,
                              struct motion_vec subject)
{
    const struct motion_vec d =
        motion_mount_turn(motion_quat_inverse(mount->level),
                          motion_vec_sub(subject, mount->pivot));

    track->d[FORWARD] = motion_real_neg(d.x[2]);
    track->d[LEFT] = motion_real_neg(d.x[0]);
    track->d[UP] = d.x[1];
}

static void pan_tilt_rolled(struct pan_tilt_track *track,
                            const struct motion_nodal *nodal, int64_t roll_turn)
{
    const struct motion_real right = motion_real_from_q(nodal->right_q32, 32),
                             up = motion_real_from_q(nodal->up_q32, 32);
    int64_t s, c;

    motion_trig_sincos(roll_turn, &s, &c);
    const struct motion_real sine = motion_real_from_q(s, 62),
                             cosine = motion_real_from_q(c, 62);
    track->left = motion_real_neg(motion_real_add(
        motion_real_mul(right, cosine), motion_real_mul(up, sine)));
    track->up = motion_real_sub(motion_real_mul(up, cosine),
                                motion_real_mul(right, sine));
}

/* Judge the answer for one sign of X and one of W. */
static void pan_tilt_try(struct pan_tilt_track *track, struct motion_real x,
                         struct motion_real w, struct motion_real distance)
{
    const int64_t tilt_turn =
        motion_trig_diff(motion_trig_atan2_real(track->d[UP], w),
                         motion_trig_atan2_real(track->up, x));
    const int64_t pan_turn = motion_trig_diff(
        motion_trig_atan2_real(track->d[LEFT], track->d[FORWARD]),
        motion_trig_atan2_real(track->left, w));
    int64_t deg_q32[2] = { track->before_deg_q32[0] };
    struct motion_real cost = motion_real_zero();
    int err = MOTION_OK;

    if (!track->is_pole)
        err = motion_axis_nearest_deg(pan_turn, track->before_deg_q32[0],
                                      &deg_q32[0]);
    if (err == MOTION_OK)
        err = motion_axis_nearest_deg(tilt_turn, track->before_deg_q32[1],
                                      &deg_q32[1]);
    if (err < 0) {
        track->err = err;
        return;
    }
    for (int i = track->has_before ? 0 : 1; i < 2; i++)
        cost = motion_real_add(
            cost, motion_real_sqr(motion_real_sub(
                      motion_real_from_q(deg_q32[i], 32),
                      motion_real_from_q(track->before_deg_q32[i], 32))));
    if (motion_real_sign(track->cost) >= 0 &&
        motion_real_cmp(cost, track->cost) >= 0)
        return;
    track->cost = cost;
    track->best_deg_q32[0] = deg_q32[0];
    track->best_deg_q32[1] = deg_q32[1];
    track->distance = distance;
}

/* All answers for a subject in the mount; track->err when there is none. */
static void pan_tilt_solve(struct pan_tilt_track *track,
                           const struct motion_pan_tilt *head)
{
    const struct motion_real level = motion_real_sqrt(motion_real_add(
        motion_real_sqr(track->d[FORWARD]), motion_real_sqr(track->d[LEFT])));
    const struct motion_real reach = motion_real_sqrt(
        motion_real_add(motion_real_sqr(level), motion_real_sqr(track->d[UP])));
    const struct motion_real small =
        motion_real_scale(reach, -PAN_TILT_POLE_BITS);
    struct motion_real x = motion_mount_leg(reach, pan_tilt_aside_sqr(head));
    struct motion_real w =
        motion_mount_leg(level, motion_real_sqr(track->left));

    track->is_pole = motion_real_cmp(level, small) <= 0 &&
                     motion_real_cmp(motion_real_abs(track->left), small) <= 0;
    if (track->is_pole)
        w = motion_real_zero();
    track->err = MOTION_E_UNREACHABLE;
    if (motion_real_sign(x) < 0 || motion_real_sign(w) < 0)
        return;
    track->cost = motion_real_int(-1);
    for (int i = 0; i < 4; i++) {
        const struct motion_real distance = pan_tilt_beyond(head, x);

        if (motion_mount_is_near(distance))
            track->err = MOTION_E_SINGULAR;
        else if (motion_real_sign(distance) > 0)
            pan_tilt_try(track, x, w, distance);
        w = motion_real_neg(w);
        if (i == 1)
            x = motion_real_neg(x);
    }
    if (motion_real_sign(track->cost) >= 0)
        track->err = track->is_pole && !track->has_before ? MOTION_E_SINGULAR
                                                          : MOTION_OK;
}

int motion_pan_tilt_track(const struct motion_pan_tilt *head,
                          const struct motion_mount *mount,
                          struct motion_vec subject,
                          const int64_t before_q32[MOTION_HEAD_AXES],
                          int64_t axis_q32[MOTION_HEAD_AXES],
                          struct motion_real *distance)
{
    struct pan_tilt_track track = { .has_before = before_q32 != NULL };
    int64_t roll_deg_q32;
    int err = motion_axis_coordinate(&head->axis[MOTION_HEAD_ROLL],
                                     axis_q32[MOTION_HEAD_ROLL], &roll_deg_q32);

    for (int i = 0; i < 2 && err == MOTION_OK && track.has_before; i++)
        err = motion_axis_coordinate(&head->axis[i], before_q32[i],
                                     &track.before_deg_q32[i]);
    if (err < 0)
        return err;
    pan_tilt_in_mount(&track, mount, subject);
    pan_tilt_rolled(&track, &head->nodal,
                    motion_trig_from_deg_q32(roll_deg_q32));
    pan_tilt_solve(&track, head);
    if (track.err < 0)
        return track.err;
    for (int i = 0; i < 2 && err == MOTION_OK; i++)
        err = motion_axis_position(&head->axis[i], track.best_deg_q32[i],
                                   &axis_q32[i]);
    *distance = track.distance;
    return err;
}
