/* firmware/linux/machine/off.c - see off.h. */
#include "firmware/linux/machine/off.h"

#include <stdio.h>
#include <string.h>
#include <time.h>

#include "firmware/host/base/memory.h"
#include "firmware/linux/machine/machine_real.h"
#include "firmware/linux/machine/machine_sim.h"
#include "firmware/linux/machine/pace.h"
#include "firmware/linux/machine/shutdown.h"
#include "motion/core/err.h"

#define OFF_LEAST_NS INT64_C(100000000) /* no move came before */
#define OFF_PAUSE_NS INT64_C(20000000)  /* between tries to open, */
#define OFF_EAGER_NS INT64_C(200000000) /* and after so long as much as this */

enum off_phase { OFF_CLOSED, OFF_TICKING, OFF_OVER };

struct off_bus {
    enum off_phase phase;
    struct rig rig; /* that bus alone */
    struct machine machine;
    struct machine_sim sim;
    struct machine_real real;
    struct shutdown shutdown;
    int64_t now_ns;
    int64_t next_ns;                /* of the next try to open it */
    char message[YAML_MESSAGE_MAX]; /* why it is not open */
};

static int64_t off_clock_ns(void)
{
    struct timespec now = { 0 };
    (void)clock_gettime(CLOCK_MONOTONIC, &now);
    return now.tv_sec * INT64_C(1000000000) + now.tv_nsec;
}

static void off_part(struct off_bus *bus, const struct rig *rig, unsigned which,
                     bool takes_over)
{
    rig_part(&bus->rig, rig, which);
    bus->rig.bus[0].modbus.takes_over = takes_over;
    bus->phase = bus->rig.axis_count > 0 ? OFF_CLOSED : OFF_OVER;
}

static void off_open(struct off_bus *bus, const struct off_config *of,
                     int64_t tried_ns)
{
    const struct machine_real_config config = {
        .lock = { .numeric = true, .takes_over = of->kills }
    };
    struct machine_ports ports;
    bus->message[0] = '\0';
    int err = of->real ? machine_real_init(&bus->real, &bus->rig, &config,
                                           &ports, bus->message)
                       : machine_sim_init(&bus->sim, &bus->rig, false, &ports,
                                          bus->message);
    const int64_t most_ns = err == MOTION_E_STATE && of->open_ns < OFF_TAKEN_NS
                                ? OFF_TAKEN_NS
                                : of->open_ns;
    if (err == MOTION_OK) {
        err = machine_init(&bus->machine, &bus->rig, &ports, bus->message);
        if (err < 0)
            machine_real_close(&bus->real);
    }
    if (err < 0) {
        bus->phase = tried_ns >= most_ns ? OFF_OVER : OFF_CLOSED;
        return;
    }
    bus->machine.powered = UINT64_MAX >> (64 - bus->rig.axis_count);
    bus->now_ns = hal_clock_now_ns(ports.clock);
    shutdown_init(&bus->shutdown, &bus->machine);
    bus->shutdown.least_ns = OFF_LEAST_NS;
    bus->shutdown.off_ns = of->timeout_ns;
    bus->shutdown.gives_up = true; /* after that */
    shutdown_begin(&bus->shutdown, bus->now_ns, 0);
    bus->phase = OFF_TICKING;
}

static void off_tick(struct off_bus *bus, int signals)
{
    const int64_t period_ns = bus->rig.period_ns;
    int64_t late_ns;
    bus->now_ns = pace_wait(bus->machine.ports.clock, bus->now_ns + period_ns,
                            period_ns, &late_ns);
    (void)shutdown_stops(&bus->shutdown, bus->now_ns, signals);
    if (shutdown_tick(&bus->shutdown, bus->now_ns))
        bus->phase = OFF_OVER;
}

/* "torque is off; found enabled: stopped, then torque off, moving at 30 mm/s" */
static void off_answer_found(const struct off_bus *bus, unsigned i,
                             struct off_axis *to)
{
    const struct hal_drive_found *found = machine_found(&bus->machine, i);
    const size_t length = strlen(to->text);
    char amount[WARNING_TEXT_MAX];
    if (found == NULL || found->count == 0)
        return;
    const struct warning warning = machine_warning_found(found);
    warning_amount(&warning, &bus->rig.axis[i], amount);
    to->found = true;
    snprintf(to->text + length, sizeof to->text - length, "; %s%s%s",
             warning_words(warning.kind), amount[0] != '\0' ? ", " : "",
             amount);
}

static void off_answer_axis(const struct off_bus *bus, unsigned i,
                            struct off_axis *to)
{
    *to = (struct off_axis){ .state = HAL_DRIVE_OFFLINE };
    if (bus->message[0] != '\0') {
        snprintf(to->text, sizeof to->text, "torque is not confirmed off: %.*s",
                 YAML_MESSAGE_MAX - 40, bus->message);
        return;
    }
    to->state = bus->machine.controller.axis[i].feedback.state;
    machine_torque_text(&bus->machine, i, to->text);
    to->is_off = to->text[0] == '\0';
    if (to->is_off)
        snprintf(to->text, sizeof to->text, "torque is off");
    off_answer_found(bus, i, to);
}

/* Of the axes of the whole rig that are on the bus. */
static void off_answer(const struct off_bus *bus, const struct rig *rig,
                       unsigned which, struct off_axis axis[])
{
    unsigned i = 0;
    for (unsigned of = 0; of < rig->axis_count; of++)
        if (rig->axis[of].bus == which)
            off_answer_axis(bus, i++, &axis[of]);
}

/* Now that the lamps say what is true. */
static void off_light(const struct rig *rig, bool lit)
{
    static struct machine_gpio gpio;
    struct rig lamps = { .line_count = 0 };
    struct machine_ports ports;
    char message[YAML_MESSAGE_MAX];
    lamps.line =
        memory_pool_new(&lamps.memory, rig->line_count, sizeof *lamps.line);
    for (unsigned i = 0; i < rig->line_count; i++)
        if (rig->line[i].kind == RIG_LINE_LAMP)
            lamps.line[lamps.line_count++] = rig->line[i];
    machine_ports_init(&ports, &lamps, &lamps.memory);
    /* torque is what counts: lamps that are not there are left alone */
    if (machine_gpio_open(&gpio, &lamps, &ports, message) == MOTION_OK) {
        for (unsigned i = 0; i < lamps.line_count; i++) {
            (void)hal_gpio_set(ports.line[i], lit);
            if (lit)
                machine_gpio_leave(&gpio, i);
        }
        machine_gpio_close(&gpio);
    }
    rig_free(&lamps);
}

static void off_run(struct off_bus bus[], unsigned count,
                    const struct off_config *config,
                    const volatile sig_atomic_t *interrupts)
{
    const struct timespec pause = { .tv_nsec = OFF_PAUSE_NS };
    const int64_t since_ns = off_clock_ns();
    bool busy = true;
    while (busy) {
        const int signals = interrupts != NULL ? *interrupts : 0;
        const int64_t tried_ns = off_clock_ns() - since_ns;
        bool ticks = false;
        busy = false;
        for (unsigned i = 0; i < count; i++) {
            if (bus[i].phase == OFF_CLOSED && tried_ns >= bus[i].next_ns) {
                off_open(&bus[i], config, tried_ns);
                bus[i].next_ns =
                    tried_ns +
                    (tried_ns < OFF_EAGER_NS ? OFF_PAUSE_NS : OFF_EAGER_NS);
            }
            if (bus[i].phase == OFF_CLOSED && signals >= 2)
                bus[i].phase = OFF_OVER;
            if (bus[i].phase == OFF_TICKING) {
                off_tick(&bus[i], signals);
                ticks = true;
            }
            busy |= bus[i].phase != OFF_OVER;
        }
        if (busy && !ticks)
            nanosleep(&pause, NULL);
    }
}

bool off_all(const struct rig *rig, const struct off_config *config,
             struct off_axis axis[], const volatile sig_atomic_t *interrupts)
{
    struct off_bus *bus = memory_new(rig->bus_count, sizeof *bus);
    bool all = true;
    for (unsigned i = 0; i < rig->bus_count; i++)
        off_part(&bus[i], rig, i, config->takes_over);
    off_run(bus, rig->bus_count, config, interrupts);
    for (unsigned i = 0; i < rig->bus_count; i++) {
        off_answer(&bus[i], rig, i, axis);
        shutdown_free(&bus[i].shutdown);
        machine_free(&bus[i].machine);
        machine_sim_free(&bus[i].sim);
        machine_real_close(&bus[i].real);
        rig_free(&bus[i].rig);
    }
    memory_free(bus);
    for (unsigned i = 0; i < rig->axis_count; i++) {
        if (rig_axis_is_virtual(&rig->axis[i]))
            axis[i] = (struct off_axis){ .state = HAL_DRIVE_OFF,
                                         .is_off = true,
                                         .text = "is virtual: no torque" };
        all &= axis[i].is_off;
    }
    if (config->real)
        off_light(rig, !all);
    return all;
}
