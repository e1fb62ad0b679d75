/* firmware/linux/player/following_warning.c - see following_warning.h. */
#include "firmware/linux/player/following_warning.h"

#include <inttypes.h>

#include "firmware/host/base/json.h"
#include "firmware/host/base/number.h"
#include "firmware/linux/base/json_print.h"
#include "motion/core/fixed.h"

static int64_t warning_limit_q32(const struct rig_axis *axis, int64_t vel_q32)
{
    const uint64_t speed_q32 = motion_fixed_abs(vel_q32);
    return speed_q32 > INT64_MAX
               ? INT64_MAX
               : rig_axis_following_q32(axis, (int64_t)speed_q32);
}

void following_warning_take(struct following_warning *warning,
                            const struct rig_axis *axis,
                            const struct telemetry_axis *at, int64_t t_ns)
{
    const uint64_t off = motion_fixed_abs(at->following_q32);
    const int64_t limit_q32 = warning_limit_q32(axis, at->demand.vel_q32);
    if (off > (uint64_t)limit_q32 / 2 && !warning->is_on) {
        warning->is_on = true;
        if (warning->count++ > 0)
            return;
        warning->t_ns = t_ns;
        warning->following_q32 = at->following_q32;
        warning->limit_q32 = limit_q32;
    } else if (off < (uint64_t)limit_q32 / 8 * 3) {
        warning->is_on = false;
    }
}

void following_warning_print(const struct following_warning *warning,
                             const struct rig_axis *axis, FILE *file)
{
    char off[NUMBER_MAX], limit[NUMBER_MAX], when[NUMBER_MAX];
    if (warning->count == 0)
        return;
    number_short(off, warning->following_q32, 32);
    number_short(limit, warning->limit_q32, 32);
    number_seconds(when, warning->t_ns * MOTION_FIXED_NS_Q12);
    fprintf(file,
            "events: %s: following error over half of its limit %" PRIu32
            " (first %s of %s %s after %s s of the run)\n",
            axis->name, warning->count, off, limit, units_axis_text(axis->unit),
            when);
}

void following_warning_json(const struct following_warning *warning,
                            struct cJSON *item)
{
    struct cJSON *object;
    if (warning->count == 0)
        return;
    object = cJSON_AddObjectToObject(item, "following_error_warning");
    cJSON_AddNumberToObject(object, "count", warning->count);
    json_add_fixed(object, "following_error", warning->following_q32, 32);
    json_add_fixed(object, "limit", warning->limit_q32, 32);
    cJSON_AddNumberToObject(object, "after_s", (double)warning->t_ns / 1e9);
}
