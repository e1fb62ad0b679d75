/* sim/sim_gpio.c - see sim_gpio.h. */
#include "sim/sim_gpio.h"

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

static int sim_gpio_set(struct hal_gpio *gpio, bool active)
{
    struct sim_gpio *line = CONTAINER_OF(gpio, struct sim_gpio, gpio);

    if (!line->config.output)
        return MOTION_E_STATE;
    if (line->level == SIM_GPIO_DEAD)
        return MOTION_E_IO;
    line->level =
        active != line->config.active_low ? SIM_GPIO_HIGH : SIM_GPIO_LOW;
    return MOTION_OK;
}

static const struct hal_gpio_ops sim_gpio_ops = {
    .get = sim_gpio_get,
    .set = sim_gpio_set,
};

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
    line->level = level;
}
