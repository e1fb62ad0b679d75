/* firmware/linux/machine/off.c - see off.h. */
#include "firmware/linux/machine/off.h"

#include <stdio.h>
#include <string.h>
#include <time.h>

#include "firmware/host/base/memory.h"
#include "firmware/linux/machine/machine_real.h"
#include "firmware/linux/machine/machine_sim.h"
#include "firmware/linux/machine/pace.h"
#include "motion/core/err.h"

#define OFF_LEAST_NS INT64_C(100000000) /* the last words get there */
#define OFF_PAUSE_NS INT64_C(20000000)  /* between tries to open */

enum off_phase { OFF_CLOSED, OFF_TICKING, OFF_OVER };

struct off_bus {
    enum off_phase phase;
    struct rig rig;                 /* that bus alone */
    unsigned axis_of[RIG_AXES_MAX]; /* in the whole one */
    struct machine machine;
    struct machine_sim sim;
    struct machine_real real;
    int64_t start_ns, now_ns;
    char message[YAML_MESSAGE_MAX]; /* why it is not open */
};

static void off_part(struct off_bus *bus, const struct rig *rig, unsigned which)
{
    bus->rig = *rig;
    bus->rig.bus[0] = rig->bus[which];
    bus->rig.bus_count = 1;
    bus->rig.line_count = 0;
    bus->rig.axis_count = 0;
    for (unsigned i = 0; i < rig->axis_count; i++) {
        if (rig->axis[i].bus != which)
            continue;
        bus->axis_of[bus->rig.axis_count] = i;
        bus->rig.axis[bus->rig.axis_count] = rig->axis[i];
        bus->rig.axis[bus->rig.axis_count++].bus = 0;
    }
    bus->phase = bus->rig.axis_count > 0 ? OFF_CLOSED : OFF_OVER;
}

static void off_open(struct off_bus *bus, bool real)
{
    struct machine_ports ports;
    int err =
        real ? machine_real_init(&bus->real, &bus->rig, &ports, bus->message)
             : machine_sim_init(&bus->sim, &bus->rig, false, &ports,
                                bus->message);
    if (err < 0)
        return;
    if (machine_init(&bus->machine, &bus->rig, &ports, bus->message) < 0) {
        machine_real_close(&bus->real);
        return;
    }
    bus->machine.powered = UINT64_MAX >> (64 - bus->rig.axis_count);
    bus->start_ns = bus->now_ns = hal_clock_now_ns(ports.clock);
    bus->phase = OFF_TICKING;
}

static void off_tick(struct off_bus *bus, int64_t timeout_ns)
{
    const int64_t period_ns = bus->rig.period_ns;
    int64_t late_ns;
    bus->now_ns = pace_wait(bus->machine.ports.clock, bus->now_ns + period_ns,
                            period_ns, &late_ns);
    machine_tick_off(&bus->machine, bus->now_ns);
    const int64_t so_far_ns = bus->now_ns - bus->start_ns;
    if (so_far_ns >= timeout_ns ||
        (so_far_ns >= OFF_LEAST_NS && machine_is_off(&bus->machine)))
        bus->phase = OFF_OVER;
}

static void off_answer(const struct off_bus *bus, struct off_axis axis[])
{
    for (unsigned i = 0; i < bus->rig.axis_count; i++) {
        struct off_axis *to = &axis[bus->axis_of[i]];
        *to = (struct off_axis){ .state = HAL_DRIVE_OFFLINE };
        if (bus->message[0] != '\0') {
            snprintf(to->text, sizeof to->text,
                     "torque is not confirmed off: %.*s", YAML_MESSAGE_MAX - 40,
                     bus->message);
            continue;
        }
        to->state = bus->machine.controller.axis[i].feedback.state;
        machine_torque_text(&bus->machine, i, to->text);
        to->is_off = to->text[0] == '\0';
        if (to->is_off)
            snprintf(to->text, sizeof to->text, "torque is off");
    }
}

/* Now that the lamps say what is true. */
static void off_light(const struct rig *rig, bool lit)
{
    static struct rig lamps;
    static struct machine_gpio gpio;
    struct machine_ports ports = { .clock = NULL };
    char message[YAML_MESSAGE_MAX];
    lamps.line_count = 0;
    for (unsigned i = 0; i < rig->line_count; i++)
        if (rig->line[i].kind == RIG_LINE_LAMP)
            lamps.line[lamps.line_count++] = rig->line[i];
    if (machine_gpio_open(&gpio, &lamps, &ports, message) < 0)
        return; /* torque is what counts */
    for (unsigned i = 0; i < lamps.line_count; i++) {
        (void)hal_gpio_set(ports.line[i], lit);
        if (lit)
            machine_gpio_leave(&gpio, i);
    }
    machine_gpio_close(&gpio);
}

static void off_run(struct off_bus bus[], unsigned count,
                    const struct off_config *config,
                    const volatile sig_atomic_t *interrupts)
{
    const struct timespec pause = { .tv_nsec = OFF_PAUSE_NS };
    bool busy = true;
    for (int64_t tried_ns = 0; busy; tried_ns += OFF_PAUSE_NS) {
        bool ticks = false;
        busy = false;
        for (unsigned i = 0; i < count; i++) {
            if (bus[i].phase == OFF_CLOSED) {
                bus[i].message[0] = '\0';
                off_open(&bus[i], config->real);
                if (bus[i].phase == OFF_CLOSED && tried_ns >= config->open_ns)
                    bus[i].phase = OFF_OVER;
            }
            if (bus[i].phase == OFF_TICKING) {
                off_tick(&bus[i], config->timeout_ns);
                ticks = true;
            }
            busy |= bus[i].phase != OFF_OVER;
        }
        if (interrupts != NULL && *interrupts > 0)
            return;
        if (busy && !ticks)
            nanosleep(&pause, NULL);
    }
}

bool off_all(const struct rig *rig, const struct off_config *config,
             struct off_axis axis[RIG_AXES_MAX],
             const volatile sig_atomic_t *interrupts)
{
    struct off_bus *bus = memory_new(rig->bus_count, sizeof *bus);
    bool all = true;
    for (unsigned i = 0; i < rig->bus_count; i++)
        off_part(&bus[i], rig, i);
    off_run(bus, rig->bus_count, config, interrupts);
    for (unsigned i = 0; i < rig->bus_count; i++) {
        off_answer(&bus[i], axis);
        machine_real_close(&bus[i].real);
    }
    memory_free(bus);
    for (unsigned i = 0; i < rig->axis_count; i++)
        all &= axis[i].is_off;
    if (config->real)
        off_light(rig, !all);
    return all;
}
