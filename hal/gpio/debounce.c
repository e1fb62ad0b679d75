/* hal/gpio/debounce.c - see debounce.h. */
#include "hal/gpio/debounce.h"

#include "hal/support/container_of.h"

#define RELEASE_MAX_NS INT64_C(10000000000)
#define EVENTS_MAX     16 /* looked at per step */
#define NEAR_NS        INT64_C(1000000000)

static int gpio_debounce_get(struct hal_gpio *gpio)
{
    return CONTAINER_OF(gpio, struct gpio_debounce, gpio)->level;
}

static int gpio_debounce_set(struct hal_gpio *gpio, bool active)
{
    (void)gpio;
    (void)active;
    return MOTION_E_STATE;
}

/* The last change of what get says. */
static int gpio_debounce_event(struct hal_gpio *gpio,
                               struct hal_gpio_event *event)
{
    struct gpio_debounce *self = CONTAINER_OF(gpio, struct gpio_debounce, gpio);
    if (!self->changed)
        return 0;
    self->changed = false;
    *event = (struct hal_gpio_event){ self->changed_ns, self->level != 0 };
    return 1;
}

static const struct hal_gpio_ops gpio_debounce_ops = {
    .get = gpio_debounce_get,
    .set = gpio_debounce_set,
    .event = gpio_debounce_event,
};

int gpio_debounce_init(struct gpio_debounce *self, struct hal_gpio *line,
                       int64_t release_ns)
{
    if (release_ns < 0 || release_ns > RELEASE_MAX_NS)
        return MOTION_E_ARG;
    *self = (struct gpio_debounce){
        .gpio.ops = &gpio_debounce_ops,
        .line = line,
        .release_ns = release_ns,
        .level = 1,
    };
    return MOTION_OK;
}

/* Did it become active since the last look, as far as its edges tell, and when
 * first?  Edges may be lost, come twice or out of order. */
static bool gpio_debounce_pulse(struct gpio_debounce *self, int64_t now_ns,
                                int64_t *since_ns)
{
    struct hal_gpio_event event;
    bool pulse = false;
    *since_ns = now_ns;
    for (unsigned i = 0; i < EVENTS_MAX; i++) {
        if (hal_gpio_event(self->line, &event) != 1)
            break;
        if (!event.active)
            continue;
        if (event.t_ns < now_ns - NEAR_NS || event.t_ns > now_ns + NEAR_NS)
            event.t_ns = now_ns;
        if (!pulse || event.t_ns < *since_ns)
            *since_ns = event.t_ns;
        pulse = true;
    }
    return pulse;
}

static void gpio_debounce_become(struct gpio_debounce *self, int level,
                                 int64_t t_ns)
{
    if ((level != 0) != (self->level != 0)) {
        self->changed = true;
        self->changed_ns = t_ns;
    }
    self->level = level;
}

void gpio_debounce_step(struct gpio_debounce *self, int64_t now_ns)
{
    int64_t since_ns;
    const bool pulse = gpio_debounce_pulse(self, now_ns, &since_ns);
    const int level = hal_gpio_get(self->line);
    const bool first = !self->looked;
    self->looked = true;
    if (level != 0 || (pulse && !first)) {
        self->active_ns = now_ns;
        gpio_debounce_become(self, level < 0 ? level : 1, since_ns);
    } else if (first || now_ns - self->active_ns >= self->release_ns) {
        gpio_debounce_become(self, 0, now_ns);
        self->changed = self->changed && !first;
    }
}
