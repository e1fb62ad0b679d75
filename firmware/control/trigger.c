/* firmware/control/trigger.c - see trigger.h. */
#include "firmware/control/trigger.h"

int trigger_init(struct trigger *trigger, struct hal_gpio *line,
                 const struct trigger_config *config)
{
    if (config->width_ns < 0 || config->rest_ns < 0)
        return MOTION_E_ARG;
    *trigger = (struct trigger){
        .line = line,
        .config = *config,
        .until_ns = INT64_MIN,
    };
    return MOTION_OK;
}

void trigger_arm(struct trigger *trigger, const int64_t t_ns_q12[],
                 uint32_t count)
{
    trigger->t_ns_q12 = t_ns_q12;
    trigger->count = count;
    trigger->next = 0;
}

void trigger_disarm(struct trigger *trigger)
{
    trigger_arm(trigger, 0, 0);
}

/* A line that cannot be set stops nothing: the pulse runs its course unseen and
 * is counted. */
static void trigger_set(struct trigger *trigger, bool active)
{
    if (hal_gpio_set(trigger->line, active) < 0)
        trigger->failures++;
    trigger->active = active;
}

static bool trigger_is_due(const struct trigger *trigger, int64_t s_ns_q12)
{
    return trigger->next < trigger->count &&
           trigger->t_ns_q12[trigger->next] <= s_ns_q12;
}

uint32_t trigger_step(struct trigger *trigger, int64_t s_ns_q12, int64_t now_ns)
{
    if (now_ns < trigger->until_ns)
        return 0;
    if (trigger->active) {
        trigger_set(trigger, false);
        trigger->until_ns = now_ns + trigger->config.rest_ns;
        return 0;
    }
    if (!trigger_is_due(trigger, s_ns_q12))
        return 0;
    trigger_set(trigger, true);
    trigger->until_ns = now_ns + trigger->config.width_ns;
    return ++trigger->next;
}

bool trigger_is_idle(const struct trigger *trigger, int64_t s_ns_q12)
{
    return !trigger->active && !trigger_is_due(trigger, s_ns_q12);
}

void trigger_end(struct trigger *trigger)
{
    trigger_disarm(trigger);
    if (trigger->active)
        trigger_set(trigger, false);
}
