/* firmware/linux/machine/warnings.c - see warnings.h. */
#include "firmware/linux/machine/warnings.h"

#include "motion/core/fixed.h"

/* Where it is now: at least so far for a warning to begin, below that far for it
 * to be over. */
struct warnings_level {
    int64_t value_q32, limit_q32;
    bool is_over, is_below;
};

static struct warnings_level
warnings_following(const struct rig_axis *rig,
                   const struct controller_axis *axis)
{
    const uint64_t speed_q32 = motion_fixed_abs(axis->target.vel_q32);
    const uint64_t off_q32 = motion_fixed_abs(axis->following_q32);
    const int64_t limit_q32 =
        speed_q32 > INT64_MAX ? INT64_MAX
                              : rig_axis_following_q32(rig, (int64_t)speed_q32);
    return (struct warnings_level){
        .value_q32 = axis->following_q32,
        .limit_q32 = limit_q32,
        .is_over = off_q32 > (uint64_t)limit_q32 / 2,
        .is_below = off_q32 < (uint64_t)limit_q32 / 8 * 3,
    };
}

/* False: it is not known. */
static bool warnings_reading(const struct drive_monitor *monitor,
                             enum hal_reading reading,
                             struct warnings_level *level)
{
    struct drive_monitor_level of;
    if (!drive_monitor_level(monitor, reading, &of))
        return false;
    *level = (struct warnings_level){
        .value_q32 = of.milli * MOTION_FIXED_ONE_Q32 / 1000,
        .limit_q32 = of.limit_milli * MOTION_FIXED_ONE_Q32 / 1000,
        .is_over = of.is_over,
        .is_below = of.is_below,
    };
    return true;
}

struct warning machine_warning_found(const struct hal_drive_found *found)
{
    return (struct warning){
        .kind = found->goes_on ? WARNING_FOUND_GOING : WARNING_FOUND,
        .value_q32 = found->vel_q32,
    };
}

/* True: it is said now; not while it is being stopped. */
static bool warnings_found(struct machine_warnings *warnings,
                           enum hal_drive_state state,
                           const struct hal_drive_found *found)
{
    const uint32_t number = warnings->newest.number + 1;
    if (found == NULL || found->count == warnings->found ||
        state == HAL_DRIVE_OFFLINE || state == HAL_DRIVE_QUICK_STOP)
        return false;
    warnings->found = found->count;
    warnings->newest = machine_warning_found(found);
    warnings->newest.number = number;
    return true;
}

/* True: it begins. */
static bool warnings_take(struct machine_warnings *warnings,
                          enum warning_kind kind,
                          const struct warnings_level *level)
{
    if (level->is_below)
        warnings->is_on[kind] = false;
    if (!level->is_over || warnings->is_on[kind])
        return false;
    warnings->is_on[kind] = true;
    warnings->newest = (struct warning){
        .number = warnings->newest.number + 1,
        .kind = kind,
        .value_q32 = level->value_q32,
        .limit_q32 = level->limit_q32,
    };
    return true;
}

void machine_warnings_step(struct machine_warnings *warnings,
                           const struct rig_axis *rig,
                           const struct controller_axis *axis,
                           const struct drive_monitor *monitor,
                           const struct hal_drive_found *found)
{
    const struct warnings_level following = warnings_following(rig, axis);
    bool begun = warnings_found(warnings, axis->feedback.state, found) ||
                 warnings_take(warnings, WARNING_FOLLOWING, &following);
    for (unsigned i = 0; i < HAL_READINGS && monitor != NULL && !begun; i++) {
        struct warnings_level level;
        if (warnings_reading(monitor, (enum hal_reading)i, &level))
            begun = warnings_take(warnings, WARNING_OF_READING(i), &level);
    }
}
