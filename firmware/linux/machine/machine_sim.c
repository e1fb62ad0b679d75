/* firmware/linux/machine/machine_sim.c - see machine_sim.h. */
#include "firmware/linux/machine/machine_sim.h"

#include <stddef.h>
#include <stdio.h>
#include <string.h>

#include "firmware/linux/machine/kind.h"
#include "motion/core/err.h"
#include "motion/core/fixed.h"

/* Virtual time starts here: 0 means "never" in many places. */
#define MACHINE_SIM_START_NS INT64_C(1000000000)

static struct machine_sim *machine_sim_of(struct hal_clock *clock)
{
    return (
        struct machine_sim *)(void *)((char *)clock -
                                      offsetof(struct machine_sim, follower));
}

static int64_t machine_sim_now_ns(struct hal_clock *clock)
{
    return hal_clock_now_ns(&machine_sim_of(clock)->real.clock);
}

static int machine_sim_wait_until(struct hal_clock *clock, int64_t t_ns)
{
    struct machine_sim *sim = machine_sim_of(clock);
    int err = hal_clock_wait_until(&sim->real.clock, t_ns);
    sim_world_run(&sim->world, hal_clock_now_ns(&sim->real.clock));
    return err;
}

static const struct hal_clock_ops machine_sim_follower_ops = {
    .now_ns = machine_sim_now_ns,
    .wait_until = machine_sim_wait_until,
};

static int machine_sim_fail(char message[YAML_MESSAGE_MAX], const char *name,
                            int err)
{
    snprintf(message, YAML_MESSAGE_MAX, "simulated %s: %s", name,
             motion_err_text(err));
    return err;
}

int machine_sim_counts(const struct rig_axis *axis, int64_t value_q32,
                       int64_t *counts)
{
    /* counts per rad is a quotient of long numbers: then in two steps */
    if (axis->counts_den <= INT64_MAX >> 32)
        return motion_fixed_muldiv(value_q32, axis->counts_num,
                                   axis->counts_den << 32, counts);
    const int err = motion_fixed_muldiv(value_q32, axis->counts_num,
                                        axis->counts_den, counts);
    if (err == MOTION_OK)
        *counts /= MOTION_FIXED_ONE_Q32;
    return err;
}

static int64_t machine_sim_magnitude(int64_t value)
{
    return value < 0 ? -value : value;
}

int machine_sim_plant(const struct rig_axis *axis,
                      struct sim_plant_config *plant, int32_t *start_counts)
{
    int64_t start = 0, vel = 0, acc = 0;
    /* an encoder that is to be homed counts from where it is switched on */
    int err = machine_sim_counts(
        axis, axis->homing.by != HOMING_NONE ? 0 : axis->sim.start_q32, &start);
    if (err < 0 || start < INT32_MIN || start > INT32_MAX)
        return MOTION_E_RANGE;
    err = machine_sim_counts(axis, axis->sim.vel_max_q32, &vel);
    if (err == MOTION_OK)
        err = machine_sim_counts(axis, axis->sim.acc_max_q32, &acc);
    *plant = (struct sim_plant_config){
        .omega_mrad_s = axis->sim.omega_mrad_s,
        .zeta_permille = axis->sim.zeta_permille,
        .vel_max_counts_s = machine_sim_magnitude(vel),
        .acc_max_counts_s2 = machine_sim_magnitude(acc),
    };
    *start_counts = (int32_t)start;
    return err;
}

int machine_sim_place(const struct rig_axis *axis, int64_t pos_q32,
                      int32_t *counts)
{
    const bool homed = axis->homing.by != HOMING_NONE;
    int64_t wide;
    int err = machine_sim_counts(
        axis, pos_q32 - (homed ? axis->sim.start_q32 : 0), &wide);
    if (err < 0 || wide <= INT32_MIN || wide >= INT32_MAX)
        return MOTION_E_RANGE;
    *counts = (int32_t)wide;
    return MOTION_OK;
}

static int machine_sim_wire(struct machine_sim *sim, const struct rig_bus *bus,
                            unsigned i)
{
    int err = sim_can_bus_init(&sim->wire[i], &sim->world, bus->bit_rate);
    if (err == MOTION_OK && bus->data_bit_rate > 0)
        err = sim_can_bus_set_fd(&sim->wire[i],
                                 bus->data_bit_rate / bus->bit_rate);
    if (err < 0)
        return err;
    sim_can_port_init(&sim->port[i], &sim->wire[i]);
    return MOTION_OK;
}

/* Switches begin as nothing would press them. */
static struct hal_gpio *machine_sim_line(struct machine_sim *sim,
                                         const struct rig_line *line,
                                         unsigned i)
{
    const struct sim_gpio_config config = {
        .clock = &sim->world.clock,
        .output = rig_line_is_output(line),
        .active_low = line->active_low,
        .pull_up = line->bias == HAL_GPIO_PULL_UP,
    };
    struct hal_gpio *gpio = sim_gpio_init(&sim->line[i], &config);
    if (!config.output)
        sim_gpio_drive(&sim->line[i],
                       line->active_low ? SIM_GPIO_HIGH : SIM_GPIO_LOW);
    return gpio;
}

static void machine_sim_clock(struct machine_sim *sim, bool realtime,
                              struct machine_ports *ports)
{
    clock_linux_init(&sim->real);
    sim->follower.ops = &machine_sim_follower_ops;
    ports->clock = realtime ? &sim->follower : &sim->world.clock;
    sim_world_init(&sim->world, realtime ? hal_clock_now_ns(ports->clock)
                                         : MACHINE_SIM_START_NS);
}

static void machine_sim_storage(struct machine_sim *sim, const struct rig *rig)
{
    struct memory_pool *memory = &sim->memory;
#define CAPACITY(array, count)                                                 \
    sim->array = memory_pool_new(memory, count, sizeof *sim->array)
    CAPACITY(wire, rig->bus_count);
    CAPACITY(port, rig->bus_count);
    CAPACITY(modbus_line, rig->bus_count);
    CAPACITY(master, rig->bus_count);
    CAPACITY(seat, rig->bus_count);
    CAPACITY(zero_q32, rig->axis_count);
    for (uint32_t i = 0; i < rig->axis_count && sim->mechanics == NULL; i++)
        if (rig->axis[i].sim.load.given)
            CAPACITY(mechanics, rig->axis_count);
    CAPACITY(payload, rig->payload_count);
    CAPACITY(line, rig->line_count);
    CAPACITY(pressed, rig->line_count);
    CAPACITY(stuck, rig->line_count);
#undef CAPACITY
    sim->servo = memory_pool_new(memory, rig->axis_count, sizeof(void *));
    for (uint32_t i = 0; i < rig->axis_count; i++) {
        const size_t size = machine_kinds[rig->axis[i].kind]->sim_size;
        sim->servo[i] = size > 0 ? memory_pool_new(memory, 1, size) : NULL;
    }
}

/* Lower and upper as counts, which fall where the axis is reversed. */
static int machine_sim_stops(struct machine_sim *sim, const struct rig *rig,
                             unsigned i)
{
    const struct rig_axis *axis = &rig->axis[i];
    struct sim_plant *plant =
        &machine_kinds[axis->kind]->sim_servo(sim, i)->plant;
    const bool reversed = axis->counts_num < 0;
    int32_t low, high;
    int err = machine_sim_place(axis, axis->sim.stop_q32[reversed], &low);
    if (err == MOTION_OK)
        err = machine_sim_place(axis, axis->sim.stop_q32[!reversed], &high);
    if (err < 0)
        return err;
    plant->low_q24 = low * (INT64_C(1) << 24);
    plant->high_q24 = high * (INT64_C(1) << 24);
    plant->has_stops = true;
    return MOTION_OK;
}

void machine_sim_free(struct machine_sim *sim)
{
    memory_pool_free(&sim->memory);
    memset(sim, 0, sizeof *sim);
}

int machine_sim_init(struct machine_sim *sim, const struct rig *rig,
                     bool realtime, struct machine_ports *ports,
                     char message[YAML_MESSAGE_MAX])
{
    machine_sim_free(sim);
    sim->rig = rig;
    machine_sim_storage(sim, rig);
    machine_ports_init(ports, rig, &sim->memory);
    machine_sim_clock(sim, realtime, ports);
    for (unsigned i = 0; i < rig->bus_count; i++) {
        const bool can = rig_bus_is_can(&rig->bus[i]);
        int err = can ? machine_sim_wire(sim, &rig->bus[i], i)
                      : machine_sim_modbus_line(sim, rig, i);
        if (err < 0)
            return machine_sim_fail(message, rig->bus[i].name, err);
        ports->can[i] = can ? &sim->port[i].can : NULL;
        ports->modbus[i] = can ? NULL : &sim->master[i].modbus;
    }
    for (unsigned i = 0; i < rig->axis_count; i++) {
        int err = machine_kinds[rig->axis[i].kind]->sim_init(sim, rig, i);
        if (err == MOTION_OK && rig->axis[i].sim.has_stops)
            err = machine_sim_stops(sim, rig, i);
        if (err < 0)
            return machine_sim_fail(message, rig->axis[i].name, err);
    }
    unsigned loaded = 0;
    const int err = machine_sim_loads(sim, &loaded);
    if (err < 0)
        return machine_sim_fail(message, rig->axis[loaded].name, err);
    for (unsigned i = 0; i < rig->line_count; i++)
        ports->line[i] = machine_sim_line(sim, &rig->line[i], i);
    for (unsigned i = 0; i < rig->axis_count; i++)
        if (rig->axis[i].homing.by != HOMING_NONE)
            sim->zero_q32[i] = rig->axis[i].sim.start_q32;
    const int hung = machine_sim_payloads(sim, &loaded);
    if (hung < 0)
        return machine_sim_fail(message, rig->axis[loaded].name, hung);
    return machine_sim_switches(sim);
}
