/* firmware/linux/machine/machine_sim_modbus.c - simulated Modbus lines
 * of a rig; see machine_sim.h. */
#include "firmware/host/rig/modbus_budget.h"
#include "firmware/linux/machine/machine_sim.h"

#include <string.h>

#include "firmware/linux/machine/kind.h"
#include "sim/device/modbus/makers.h"

#define MACHINE_SIM_ENABLE_NS INT64_C(80000000) /* its brake lets go */
#define TCP_DRAIN_NS          INT64_C(1000000)

int machine_sim_modbus_line(struct machine_sim *sim, const struct rig *rig,
                            unsigned i)
{
    const struct modbus_master_config config = {
        .line = modbus_budget_line(rig, i),
        .echo = rig->bus[i].modbus.echo,
        .timeout_ns = modbus_budget_timeout_ns(rig, i),
        /* TCP knows an answer of before by its number */
        .drain_ns = rig->bus[i].kind == RIG_MODBUS_TCP ? TCP_DRAIN_NS : 0,
    };
    int err =
        sim_modbus_line_init(&sim->modbus_line[i], &sim->world, &config.line);

    if (err < 0)
        return err;
    err = modbus_master_init(&sim->master[i], &config);
    if (err < 0)
        return err;
    sim->modbus_line[i].adapter = &sim->seat[i];
    sim->modbus_line[i].echo = rig->bus[i].modbus.echo;
    return sim_modbus_seat_init(&sim->seat[i], &sim->modbus_line[i],
                                &sim->master[i].station);
}

struct sim_modbus_line *machine_sim_modbus_wire(const struct machine_sim *sim,
                                                unsigned i)
{
    return sim->served_line != NULL && sim->served_line[i] != NULL
               ? sim->served_line[i]
               : &sim->modbus_line[i];
}

struct sim_modbus_servo *machine_sim_modbus_servo(const struct machine_sim *sim,
                                                  unsigned i)
{
    return sim->served != NULL && sim->served[i] != NULL ? sim->served[i]
                                                         : sim->servo[i];
}

const struct sim_modbus_maker *machine_sim_maker(const struct rig *rig,
                                                 unsigned i)
{
    const struct rig_axis *axis = &rig->axis[i];
    const char *path = rig->map_path[axis->map];
    const char *slash = strrchr(path, '/');
    const char *base = slash == NULL ? path : slash + 1;
    const struct sim_modbus_maker *maker;

    if (axis->sim.device > 0)
        return sim_modbus_maker_find(
            rig_sim_device_words[axis->sim.device - 1]);
    for (unsigned n = 0; (maker = sim_modbus_maker_at(n)) != NULL; n++) {
        const size_t length = strlen(maker->name);
        if (strncmp(base, maker->name, length) == 0 &&
            (base[length] == '.' || base[length] == '\0'))
            return maker;
    }
    return NULL;
}

int machine_sim_servo_config(const struct rig *rig, unsigned i,
                             struct sim_modbus_servo_config *config)
{
    const struct rig_axis *axis = &rig->axis[i];

    *config = (struct sim_modbus_servo_config){
        .maker = machine_sim_maker(rig, i),
        .map = &rig->map[axis->map],
        .unit = axis->node_id,
        .line = modbus_budget_line(rig, axis->bus),
        .turnaround_ns = rig->map[axis->map].turnaround_ns,
        .enable_ns = MACHINE_SIM_ENABLE_NS,
    };
    return machine_sim_plant(axis, &config->plant, &config->start_counts);
}
