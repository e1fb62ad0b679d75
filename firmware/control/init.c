/* firmware/control/init.c - a controller from its configuration: what is refused,
 * what 0 stands for, and what the tick would have to divide for. */
#include <stddef.h>
#include <string.h>

#include "firmware/control/parts.h"
#include "motion/core/err.h"
#include "motion/core/fixed.h"

#define ENABLE_TIMEOUT_NS INT64_C(5000000000)
/* A tick of six axes takes 12,000 instructions, of which the search has what is left
 * beside their set points; with more axes as much for each. */
#define EFFORT          103
#define EFFORT_AXIS     10
#define EFFORT_MORE     7
#define STOP_TIMEOUT_NS INT64_C(5000000000)

static bool controller_limit_ok(const struct motion_clock_limit *limit)
{
    return limit->vel_q32 > 0 && limit->acc_q32 > 0 && limit->jerk_q32 >= 0;
}

static bool controller_axis_ok(const struct controller_axis_config *axis)
{
    return axis->pos_min_q32 < axis->pos_max_q32 &&
           axis->pos_min_q32 >= INT64_MIN + MOTION_TRACK_POS_ROUNDING &&
           axis->pos_max_q32 <= INT64_MAX - MOTION_TRACK_POS_ROUNDING &&
           controller_limit_ok(&axis->limit) &&
           controller_limit_ok(&axis->stop) && axis->following_floor_q32 > 0 &&
           axis->following_k_ns >= 0;
}

static bool controller_config_ok(const struct controller_config *config)
{
    if (config->period_ns < 62500 || config->period_ns > 20000000 ||
        config->axis_count < 1 || config->axis_count > CONTROLLER_AXES_MAX)
        return false;
    for (unsigned i = 0; i < config->axis_count; i++)
        if (!controller_axis_ok(&config->axis[i]))
            return false;
    return true;
}

static void controller_defaults(struct controller_config *config)
{
    if (config->feedback_max_age_ns == 0)
        config->feedback_max_age_ns = 4 * config->period_ns;
    if (config->enable_timeout_ns == 0)
        config->enable_timeout_ns = ENABLE_TIMEOUT_NS;
    const int axes = (int)config->axis_count;
    const int left = EFFORT - axes * EFFORT_AXIS;
    if (config->effort == 0)
        config->effort = left > axes * EFFORT_MORE ? left : axes * EFFORT_MORE;
    if (config->stop_timeout_ns == 0)
        config->stop_timeout_ns = STOP_TIMEOUT_NS;
}

/* k in ns: v k / 1e9, and 1e-9 is 4611686018 / 2^62; INT64_MAX beyond. */
static int64_t controller_following_k(int64_t k_ns)
{
    int64_t k_q62;
    return motion_fixed_mulshift(k_ns, INT64_C(4611686018), 0, &k_q62) < 0
               ? INT64_MAX
               : k_q62;
}

int controller_init(struct controller *controller,
                    const struct controller_config *config,
                    struct controller_axis axis[],
                    struct hal_drive *const drive[],
                    const struct controller_inputs *inputs)
{
    if (!controller_config_ok(config))
        return MOTION_E_ARG;
    memset(controller, 0, sizeof *controller);
    controller->config = *config;
    controller_defaults(&controller->config);
    controller->axis = axis;
    if (inputs != NULL)
        controller->estop = (struct controller_estop){
            .channel = { inputs->estop[0], inputs->estop[1] },
            .discrepancy_ns = inputs->discrepancy_ns,
        };
    controller->override_q30 = MOTION_CLOCK_WARP_ONE_Q30;
    controller->override_max_q30 = MOTION_CLOCK_WARP_MAX_Q30;
    for (unsigned i = 0; i < config->axis_count; i++) {
        axis[i] = (struct controller_axis){
            .drive = drive[i],
            .homed = !config->axis[i].needs_homing,
            .following_k_q62 =
                controller_following_k(config->axis[i].following_k_ns),
        };
        if (inputs != NULL && inputs->axis != NULL)
            axis[i].switches = inputs->axis[i];
        controller_gate_init(controller, i);
    }
    return MOTION_OK;
}
