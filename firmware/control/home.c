/* firmware/control/home.c - the drive's coordinates and the axis's.
 *
 * A drive counts from wherever it was switched on, or from its own zero.  The
 * axis's position is that plus an offset, which is 0 until homing finds
 * another.  Everything of the controller is in the axis's coordinates; only the
 * three functions before the drive deal with the offset. */
#include <stddef.h>

#include "firmware/control/parts.h"
#include "motion/core/err.h"
#include "motion/core/fixed.h"

void controller_from_drive(const struct controller_axis *axis,
                           struct hal_drive_feedback *feedback)
{
    feedback->pos_q32 =
        motion_fixed_add_sat(feedback->pos_q32, axis->offset_q32);
    feedback->demand_q32 =
        motion_fixed_add_sat(feedback->demand_q32, axis->offset_q32);
    feedback->probe_pos_q32 =
        motion_fixed_add_sat(feedback->probe_pos_q32, axis->offset_q32);
}

int controller_to_drive(struct controller_axis *axis,
                        const struct hal_drive_target *target)
{
    struct hal_drive_target own = *target;
    int err = motion_fixed_sub(target->pos_q32, axis->offset_q32, &own.pos_q32);
    return err < 0 ? err : hal_drive_set_target(axis->drive, &own);
}

int controller_go_to_drive(struct controller_axis *axis,
                           const struct hal_drive_go *go)
{
    struct hal_drive_go own = *go;
    int err = motion_fixed_sub(go->pos_q32, axis->offset_q32, &own.pos_q32);
    return err < 0 ? err : hal_drive_go(axis->drive, &own);
}

int64_t controller_place_q32(const struct controller_axis *axis)
{
    return axis->drive->ops->tracks != NULL ? axis->feedback.demand_q32
                                            : axis->feedback.pos_q32;
}

bool controller_range_counts(const struct controller *controller,
                             unsigned index)
{
    const struct controller_axis *axis = &controller->axis[index];
    return axis->homed && !axis->seeking;
}

enum hal_drive_mode controller_usual_mode(const struct controller *controller,
                                          unsigned index)
{
    return controller->config.axis[index].by_goals ? HAL_DRIVE_PROFILE_POSITION
                                                   : HAL_DRIVE_STREAM_POSITION;
}

bool controller_any_by_profile(const struct controller *controller,
                               bool samples)
{
    for (unsigned i = 0; i < controller->config.axis_count; i++)
        if (controller->axis[i].by_profile &&
            (samples || controller->axis[i].drive->ops->tracks == NULL))
            return true;
    return controller_goals_are_running(controller);
}

/* Ask whether the drive's counter reaches both ends of the range with this offset; an
 * end that is no position is none. */
static int home_reaches(const struct controller *controller, unsigned index,
                        int64_t offset_q32, struct hal_drive_reach *reach)
{
    const struct controller_axis_config *config =
        &controller->config.axis[index];
    const int64_t end_q32[] = { config->pos_min_q32, config->pos_max_q32 };
    for (unsigned i = 0; i < 2; i++) {
        int64_t own_q32;
        if (motion_fixed_sub(end_q32[i], offset_q32, &own_q32) == MOTION_OK &&
            hal_drive_reach(controller->axis[index].drive, own_q32, reach) < 0)
            return MOTION_E_RANGE;
    }
    return MOTION_OK;
}

int controller_set_position(struct controller *controller, unsigned index,
                            int64_t from_q32, int64_t to_q32,
                            struct hal_drive_reach *reach)
{
    struct controller_axis *axis = &controller->axis[index];
    int64_t shift_q32, offset_q32;
    *reach = (struct hal_drive_reach){ .counts = 0 };
    if (controller->state != CONTROLLER_READY &&
        controller->state != CONTROLLER_OFF)
        return MOTION_E_STATE;
    if (motion_fixed_sub(to_q32, from_q32, &shift_q32) < 0 ||
        motion_fixed_add(axis->offset_q32, shift_q32, &offset_q32) < 0 ||
        home_reaches(controller, index, offset_q32, reach) < 0)
        return MOTION_E_RANGE;
    axis->offset_q32 = offset_q32;
    axis->homed = true;
    axis->stands_q32 = motion_fixed_add_sat(axis->stands_q32, shift_q32);
    axis->target.pos_q32 =
        motion_fixed_add_sat(axis->target.pos_q32, shift_q32);
    axis->feedback.pos_q32 =
        motion_fixed_add_sat(axis->feedback.pos_q32, shift_q32);
    for (unsigned i = 0; i < axis->sent_count; i++)
        axis->sent_q32[i] = motion_fixed_add_sat(axis->sent_q32[i], shift_q32);
    axis->highest_q32 = axis->target.pos_q32;
    axis->lowest_q32 = axis->target.pos_q32;
    return MOTION_OK;
}
