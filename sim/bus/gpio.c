/* sim/bus/gpio.c - see gpio.h. */
#include "sim/bus/gpio.h"

#include "sim/util.h"

static int sim_gpio_get(struct hal_gpio *gpio)
{
    const struct sim_gpio *line = CONTAINER_OF(gpio, struct sim_gpio, gpio);
    bool high = line->level == SIM_GPIO_OPEN ? line->config.pull_up
                                             : line->level == SIM_GPIO_HIGH;

    if (line->level == SIM_GPIO_DEAD)
        return MOTION_E_IO;
    return high != line->config.active_low;
}

static void sim_gpio_see(struct sim_gpio *line, bool active)
{
    struct sim_gpio_camera *const camera = &line->camera;
    const int64_t now_ns = hal_clock_now_ns(line->config.clock);
    const int64_t since_ns = now_ns - camera->last_ns;

    if (!active) {
        if (camera->shortest_ns == 0 || since_ns < camera->shortest_ns)
            camera->shortest_ns = since_ns;
        return;
    }
    if (camera->pictures++ == 0)
        camera->first_ns = now_ns;
    else if (camera->closest_ns == 0 || since_ns < camera->closest_ns)
        camera->closest_ns = since_ns;
    camera->last_ns = now_ns;
}

static int sim_gpio_set(struct hal_gpio *gpio, bool active)
{
    struct sim_gpio *line = CONTAINER_OF(gpio, struct sim_gpio, gpio);

    if (!line->config.output)
        return MOTION_E_STATE;
    if (line->level == SIM_GPIO_DEAD)
        return MOTION_E_IO;
    if (line->level != SIM_GPIO_OPEN && active != (sim_gpio_get(gpio) > 0))
        sim_gpio_see(line, active);
    line->level =
        active != line->config.active_low ? SIM_GPIO_HIGH : SIM_GPIO_LOW;
    return MOTION_OK;
}

static int sim_gpio_event(struct hal_gpio *gpio, struct hal_gpio_event *event)
{
    struct sim_gpio *line = CONTAINER_OF(gpio, struct sim_gpio, gpio);

    if (line->config.output)
        return MOTION_E_STATE;
    if (line->level == SIM_GPIO_DEAD)
        return MOTION_E_IO;
    if (line->count == 0)
        return 0;
    *event = line->event[line->head];
    line->head = (line->head + 1) % SIM_GPIO_EVENTS;
    line->count--;
    return 1;
}

static const struct hal_gpio_ops sim_gpio_ops = {
    .get = sim_gpio_get,
    .set = sim_gpio_set,
    .event = sim_gpio_event,
};

static void sim_gpio_edge(struct sim_gpio *line, bool active)
{
    unsigned at = (line->head + line->count) % SIM_GPIO_EVENTS;

    if (line->count == SIM_GPIO_EVENTS)
        return;
    line->count++;
    line->event[at] =
        (struct hal_gpio_event){ hal_clock_now_ns(line->config.clock), active };
}

struct hal_gpio *sim_gpio_init(struct sim_gpio *line,
                               const struct sim_gpio_config *config)
{
    *line = (struct sim_gpio){ .gpio.ops = &sim_gpio_ops,
                               .config = *config,
                               .level = SIM_GPIO_OPEN };
    if (config->output)
        (void)sim_gpio_set(&line->gpio, false);
    return &line->gpio;
}

void sim_gpio_drive(struct sim_gpio *line, enum sim_gpio_level level)
{
    int before = sim_gpio_get(&line->gpio), after;

    line->level = level;
    after = sim_gpio_get(&line->gpio);
    if (!line->config.output && before >= 0 && after >= 0 && before != after)
        sim_gpio_edge(line, after != 0);
}
