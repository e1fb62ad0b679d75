/* motion/kinematics/jib.c - a boom that pans, tilts and extends; see carrier.h.
 *
 * With p from the foot to the pivot, drop (x, y, z), h^2 = p_x^2 + p_y^2 and
 * W = +-sqrt(h^2 - y^2):
 *
 *     pan = angle(p_x, p_y) - angle(W, y)
 *     head turns with the boom:  X = length + extend + x, X^2 = |p|^2 - y^2 - z^2
 *                                tilt = angle(W, p_z) - angle(X, z)
 *     levelled:                  (length + extend) (cos, sin)(tilt)
 *                                     = (W - x, p_z - z)
 *     counter-rotating:          levelled without drop, from p - drop */
#include "motion/core/err.h"
#include "motion/kinematics/carrier.h"
#include "motion/number/trig.h"

#define JIB_OVER_TURN ((int64_t)1 << 20) /* beyond the vertical: rounding */

enum { PAN, TILT, EXTEND };

static uint32_t jib_axes(const struct motion_carrier *carrier)
{
    (void)carrier;
    return 3;
}

/* In the frame x forward, y left, z up of the foot. */
static const struct motion_dir jib_y = { { 0, (int64_t)1 << 62, 0 } },
                               jib_z = { { 0, 0, (int64_t)1 << 62 } };

static int jib_check(const struct motion_jib *jib, const int64_t at_q32[3])
{
    const int64_t right_angle_q32 = (int64_t)90 << 32;
    int64_t boom_q32;

    if (at_q32[TILT] > right_angle_q32 || at_q32[TILT] < -right_angle_q32 ||
        at_q32[EXTEND] < jib->extend_min_q32 ||
        at_q32[EXTEND] > jib->extend_max_q32)
        return MOTION_E_LIMIT;
    if (motion_fixed_add(jib->length_q32, at_q32[EXTEND], &boom_q32) < 0)
        return MOTION_E_RANGE;
    return boom_q32 > 0 ? MOTION_OK : MOTION_E_LIMIT;
}

static int jib_place(const struct motion_carrier *carrier,
                     const int64_t *axis_q32, struct motion_mount *mount)
{
    const struct motion_jib *const jib = &carrier->as.jib;
    struct motion_vec boom = motion_vec_zero();
    struct motion_quat pan, turned, frame = MOTION_QUAT_ONE;
    int64_t at_q32[3];
    int err = MOTION_OK;

    for (int i = 0; i < 3 && err == MOTION_OK; i++)
        err = motion_axis_coordinate(&jib->axis[i], axis_q32[i], &at_q32[i]);
    if (err == MOTION_OK)
        err = jib_check(jib, at_q32);
    if (err < 0)
        return err;
    pan = motion_quat_about(jib_z, motion_trig_from_deg_q32(at_q32[PAN]));
    turned = motion_quat_mul(
        pan, motion_quat_about(
                 jib_y,
                 motion_trig_diff(0, motion_trig_from_deg_q32(at_q32[TILT]))));
    if (jib->mount == MOTION_JIB_BOOM)
        frame = turned;
    else if (jib->mount == MOTION_JIB_LEVEL)
        frame = pan;
    boom.x[0] = motion_real_from_q(jib->length_q32 + at_q32[EXTEND], 32);
    mount->pivot = motion_vec_add(
        motion_vec_add(jib->foot, motion_mount_turn(turned, boom)),
        motion_mount_turn(frame, jib->drop));
    mount->level = motion_quat_mul(frame, carrier->level);
    return MOTION_OK;
}

/* --- inverse ------------------------------------------------------------- */

struct jib_find {
    const struct motion_jib *jib;
    struct motion_vec p, drop;
    const int64_t *before_q32; /* coordinates of pan and tilt, or NULL */
    bool is_found;
    struct motion_real cost; /* of the best answer */
    int64_t best_q32[3];
};

/* Length of the boom and its tilt; false when there are none. */
static bool jib_boom(const struct jib_find *find, struct motion_real w,
                     bool back, struct motion_real *length, int64_t *tilt_turn)
{
    const struct motion_real x = find->drop.x[0], z = find->drop.x[2],
                             up = find->p.x[2];

    if (find->jib->mount == MOTION_JIB_BOOM) {
        struct motion_real along =
            motion_mount_leg(motion_vec_length(find->p),
                             motion_real_add(motion_real_sqr(find->drop.x[1]),
                                             motion_real_sqr(z)));
        if (motion_real_sign(along) < 0)
            return false;
        along = back ? motion_real_neg(along) : along;
        *length = motion_real_sub(along, x);
        *tilt_turn = motion_trig_diff(motion_trig_atan2_real(up, w),
                                      motion_trig_atan2_real(z, along));
    } else {
        const struct motion_real over = motion_real_sub(w, x),
                                 rise = motion_real_sub(up, z);
        if (back)
            return false;
        *length = motion_real_sqrt(
            motion_real_add(motion_real_sqr(over), motion_real_sqr(rise)));
        *tilt_turn = motion_trig_atan2_real(rise, over);
    }
    return *tilt_turn <= MOTION_TRIG_QUARTER_TURN + JIB_OVER_TURN &&
           *tilt_turn >= -MOTION_TRIG_QUARTER_TURN - JIB_OVER_TURN;
}

/* The extension of a boom of this length, clamped to a limit that it is at. */
static int jib_extend(const struct motion_jib *jib, struct motion_real length,
                      int64_t *extend_q32)
{
    const int64_t near_q32 = MOTION_KINEMATICS_NEAR_Q32;
    int64_t over_q32, under_q32;

    if (motion_real_round(
            motion_real_sub(length, motion_real_from_q(jib->length_q32, 32)),
            32, extend_q32) < 0 ||
        motion_fixed_sub(*extend_q32, jib->extend_max_q32, &over_q32) < 0 ||
        motion_fixed_sub(jib->extend_min_q32, *extend_q32, &under_q32) < 0 ||
        motion_real_sign(length) <= 0 || over_q32 > near_q32 ||
        under_q32 > near_q32)
        return MOTION_E_UNREACHABLE;
    if (over_q32 > 0)
        *extend_q32 = jib->extend_max_q32;
    if (under_q32 > 0)
        *extend_q32 = jib->extend_min_q32;
    return MOTION_OK;
}

static struct motion_real jib_cost(const struct jib_find *find,
                                   const int64_t at_q32[3])
{
    struct motion_real cost = motion_real_zero();

    for (int i = PAN; i <= TILT && find->before_q32 != NULL; i++)
        cost = motion_real_add(
            cost, motion_real_sqr(motion_real_sub(
                      motion_real_from_q(at_q32[i], 32),
                      motion_real_from_q(find->before_q32[i], 32))));
    return cost;
}

static int jib_try(struct jib_find *find, struct motion_real w, bool back)
{
    const int64_t right_angle_q32 = (int64_t)90 << 32;
    const int64_t pan_turn =
        motion_trig_diff(motion_trig_atan2_real(find->p.x[1], find->p.x[0]),
                         motion_trig_atan2_real(find->drop.x[1], w));
    struct motion_real length, cost;
    int64_t tilt_turn, at_q32[3];

    if (!jib_boom(find, w, back, &length, &tilt_turn) ||
        jib_extend(find->jib, length, &at_q32[EXTEND]) < 0)
        return MOTION_OK;
    int err = motion_axis_nearest_deg(
        pan_turn, find->before_q32 ? find->before_q32[PAN] : 0, &at_q32[PAN]);
    if (err < 0)
        return err;
    at_q32[TILT] = motion_trig_deg_q32(tilt_turn);
    if (at_q32[TILT] > right_angle_q32)
        at_q32[TILT] = right_angle_q32;
    if (at_q32[TILT] < -right_angle_q32)
        at_q32[TILT] = -right_angle_q32;
    cost = jib_cost(find, at_q32);
    if (find->is_found && motion_real_cmp(cost, find->cost) >= 0)
        return MOTION_OK;
    find->is_found = true;
    find->cost = cost;
    for (int i = 0; i < 3; i++)
        find->best_q32[i] = at_q32[i];
    return MOTION_OK;
}

static int jib_solve(struct jib_find *find)
{
    const struct motion_real level = motion_real_sqrt(motion_real_add(
        motion_real_sqr(find->p.x[0]), motion_real_sqr(find->p.x[1])));
    struct motion_real w =
        motion_mount_leg(level, motion_real_sqr(find->drop.x[1]));

    if (motion_real_sign(w) < 0)
        return MOTION_E_UNREACHABLE;
    for (int i = 0; i < 4; i++) {
        int err = jib_try(find, w, i % 2 == 1);
        if (err < 0)
            return err;
        if (i == 1)
            w = motion_real_neg(w);
    }
    if (!find->is_found)
        return MOTION_E_UNREACHABLE;
    return motion_mount_is_near(level) ? MOTION_E_SINGULAR : MOTION_OK;
}

static int jib_find(const struct motion_carrier *carrier,
                    struct motion_vec pivot, const int64_t *before_q32,
                    int64_t *axis_q32)
{
    const struct motion_jib *const jib = &carrier->as.jib;
    struct jib_find find = { .jib = jib,
                             .p = motion_vec_sub(pivot, jib->foot),
                             .drop = jib->drop };
    int64_t before_at_q32[2];
    int err = MOTION_OK;

    if (jib->mount == MOTION_JIB_SPACE) {
        find.p = motion_vec_sub(find.p, jib->drop);
        find.drop = motion_vec_zero();
    }
    if (before_q32 != NULL) {
        for (int i = PAN; i <= TILT && err == MOTION_OK; i++)
            err = motion_axis_coordinate(&jib->axis[i], before_q32[i],
                                         &before_at_q32[i]);
        find.before_q32 = before_at_q32;
    }
    if (err == MOTION_OK)
        err = jib_solve(&find);
    for (int i = 0; i < 3 && err == MOTION_OK; i++)
        err =
            motion_axis_position(&jib->axis[i], find.best_q32[i], &axis_q32[i]);
    return err;
}

const struct motion_carrier_kind motion_carrier_jib = {
    .axes = jib_axes,
    .place = jib_place,
    .find = jib_find,
};
