/* motion/kinematics/turntable.c - see turntable.h.
 *
 * Without a nodal offset the pupil is the pivot, and table and slide are closed
 * forms.  With one the pupil goes round the pivot as the head tracks: assume the
 * offset, find the axes, take the offset that they give, until it stays.  The
 * error shrinks by the ratio of offset and distance each time. */
#include "motion/kinematics/turntable.h"

#include "motion/core/err.h"
#include "motion/number/trig.h"

#define TURNTABLE_STEPS      200
#define TURNTABLE_STAYS_BITS 28 /* of the unit; axes are rounded to 2^-33 deg */

static const struct motion_dir turntable_up = { { 0, 0, (int64_t)1 << 62 } };

int motion_turntable_camera(const struct motion_turntable *table,
                            const int64_t *axis_q32,
                            struct motion_camera *camera)
{
    struct motion_camera inside;
    struct motion_quat back;
    int64_t at_q32;
    int err = motion_axis_coordinate(&table->axis, axis_q32[0], &at_q32);

    if (err == MOTION_OK)
        err = motion_rig_camera(table->camera, axis_q32 + 1, &inside);
    if (err != MOTION_OK)
        return err;
    back = motion_quat_about(
        turntable_up, motion_trig_diff(0, motion_trig_from_deg_q32(at_q32)));
    camera->pupil =
        motion_mount_turn(back, motion_vec_sub(inside.pupil, table->centre));
    camera->q = motion_quat_mul(back, inside.q);
    return MOTION_OK;
}

struct turntable_demand {
    const struct motion_turntable *table;
    int64_t azimuth_turn;
    const int64_t *radius_q32, *before_q32;
};

/* The position of the table that puts the pupil at the azimuth. */
static int turntable_turn(const struct turntable_demand *demand,
                          struct motion_vec pupil, int64_t *axis_q32)
{
    const struct motion_turntable *const table = demand->table;
    const struct motion_vec from = motion_vec_sub(pupil, table->centre);
    int64_t near_q32 = 0, at_q32;
    int err = MOTION_OK;

    if (motion_mount_is_near(from.x[0]) && motion_mount_is_near(from.x[1]))
        return MOTION_E_SINGULAR;
    if (demand->before_q32 != NULL)
        err = motion_axis_coordinate(&table->axis, demand->before_q32[0],
                                     &near_q32);
    if (err == MOTION_OK)
        err = motion_axis_nearest_deg(
            motion_trig_diff(motion_trig_atan2_real(from.x[1], from.x[0]),
                             demand->azimuth_turn),
            near_q32, &at_q32);
    if (err != MOTION_OK)
        return err;
    return motion_axis_position(&table->axis, at_q32, axis_q32);
}

/* The subject in space. */
static int turntable_subject(const struct motion_turntable *table,
                             int64_t axis_q32, struct motion_vec *subject)
{
    int64_t at_q32;
    int err = motion_axis_coordinate(&table->axis, axis_q32, &at_q32);

    if (err < 0)
        return err;
    *subject = motion_vec_add(
        table->centre,
        motion_mount_turn(
            motion_quat_about(turntable_up, motion_trig_from_deg_q32(at_q32)),
            table->subject));
    return MOTION_OK;
}

/* All axes, with the pupil `beside` the pivot; and where it is then. */
static int turntable_step(const struct turntable_demand *demand,
                          struct motion_vec beside, int64_t *axis_q32,
                          struct motion_vec *beside_then,
                          struct motion_real *distance)
{
    const struct motion_rig *const rig = demand->table->camera;
    struct motion_vec subject;
    struct motion_camera camera;
    struct motion_mount mount;
    int err = MOTION_OK;

    if (demand->radius_q32 != NULL) {
        const struct motion_slide_demand slide = {
            beside, demand->table->centre, true,
            motion_real_from_q(*demand->radius_q32, 32)
        };
        err = motion_carrier_slide(
            &rig->carrier, &slide,
            demand->before_q32 != NULL ? &demand->before_q32[1] : NULL,
            &axis_q32[1]);
    }
    if (err == MOTION_OK)
        err = rig->carrier.kind->place(&rig->carrier, axis_q32 + 1, &mount);
    if (err == MOTION_OK)
        err = turntable_turn(demand, motion_vec_add(mount.pivot, beside),
                             &axis_q32[0]);
    if (err == MOTION_OK)
        err = turntable_subject(demand->table, axis_q32[0], &subject);
    if (err == MOTION_OK)
        err = motion_rig_track(
            rig, subject,
            demand->before_q32 != NULL ? demand->before_q32 + 1 : NULL,
            axis_q32 + 1, distance);
    if (err == MOTION_OK)
        err = motion_rig_camera(rig, axis_q32 + 1, &camera);
    if (err == MOTION_OK)
        *beside_then = motion_vec_sub(camera.pupil, mount.pivot);
    return err;
}

int motion_turntable_relative(const struct motion_turntable *table,
                              int64_t azimuth_q32, const int64_t *radius_q32,
                              const int64_t *before_q32, int64_t *axis_q32,
                              struct motion_real *distance)
{
    struct turntable_demand demand = { table,
                                       motion_trig_from_deg_q32(azimuth_q32),
                                       radius_q32, before_q32 };
    struct motion_vec beside = motion_vec_zero(), then;

    if (radius_q32 != NULL && *radius_q32 < 0)
        return MOTION_E_UNREACHABLE;
    for (int i = 0; i < TURNTABLE_STEPS; i++) {
        int err = turntable_step(&demand, beside, axis_q32, &then, distance);
        if (err < 0)
            return err;
        const struct motion_real off =
            motion_vec_length(motion_vec_sub(then, beside));
        if (motion_real_lt(off, motion_real_make(1, -TURNTABLE_STAYS_BITS)))
            return MOTION_OK;
        beside = then;
        demand.before_q32 = axis_q32; /* stay with the answer chosen first */
    }
    return MOTION_E_WORK;
}
