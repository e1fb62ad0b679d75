/* firmware/linux/machine/machine_real.c - see machine_real.h. */
#include "firmware/linux/machine/machine_real.h"

#include <stdio.h>
#include <string.h>

#include "motion/core/err.h"

static int machine_real_judge(const struct rig *rig,
                              char message[YAML_MESSAGE_MAX])
{
    for (uint32_t i = 0; i < rig->bus_count; i++) {
        const struct rig_bus *bus = &rig->bus[i];
        if (!rig_bus_is_can(bus) || bus->interface[0] != '\0')
            continue;
        snprintf(message, YAML_MESSAGE_MAX,
                 "bus %s has no interface, expected a line such as interface: "
                 "can0, or --interface",
                 bus->name);
        return MOTION_E_ARG;
    }
    return MOTION_OK;
}

static int machine_real_bus(struct machine_real *real, const struct rig *rig,
                            unsigned i, char message[YAML_MESSAGE_MAX])
{
    const struct rig_bus *bus = &rig->bus[i];
    const struct can_socketcan_config config = { .interface = bus->interface,
                                                 .bit_rate = bus->bit_rate,
                                                 .fd = bus->data_bit_rate > 0 };
    char reason[CAN_SOCKETCAN_MESSAGE_MAX];
    const int err = can_socketcan_open(&real->port[i], &config, reason);
    if (err < 0)
        snprintf(message, YAML_MESSAGE_MAX, "bus %s: %s", bus->name, reason);
    real->is_open[i] = err == MOTION_OK;
    return err;
}

/* Digital lines first: the kernel gives each to one program only. */
static int machine_real_open(struct machine_real *real, const struct rig *rig,
                             const struct machine_real_config *config,
                             struct machine_ports *ports,
                             char message[YAML_MESSAGE_MAX])
{
    int err = machine_gpio_open(&real->gpio, rig, ports, message);

    if (err == MOTION_OK && config->reaches)
        err = machine_modbus_reach(rig, message);
    for (unsigned i = 0; i < rig->bus_count && err == MOTION_OK; i++) {
        real->bus_count = i + 1;
        if (!rig_bus_is_can(&rig->bus[i]))
            continue;
        err = machine_real_bus(real, rig, i, message);
        ports->can[i] = &real->port[i].can;
    }
    return err == MOTION_OK
               ? machine_modbus_open(&real->modbus, rig, false, ports, message)
               : err;
}

int machine_real_init(struct machine_real *real, const struct rig *rig,
                      const struct machine_real_config *config,
                      struct machine_ports *ports,
                      char message[YAML_MESSAGE_MAX])
{
    memset(real, 0, sizeof *real);
    machine_ports_init(ports, rig, &real->memory);
    ports->clock = clock_linux_init(&real->clock);
    ports->is_real = true;
    real->is_open =
        memory_pool_new(&real->memory, rig->bus_count, sizeof *real->is_open);
    real->port =
        memory_pool_new(&real->memory, rig->bus_count, sizeof *real->port);
    int err = machine_real_judge(rig, message);
    if (err == MOTION_OK)
        err = machine_lock_take(&real->lock, rig, &config->lock, message);
    if (err == MOTION_OK)
        err = machine_real_open(real, rig, config, ports, message);
    if (err < 0)
        machine_real_close(real);
    return err;
}

void machine_real_close(struct machine_real *real)
{
    for (unsigned i = 0; i < real->bus_count; i++)
        if (real->is_open[i])
            can_socketcan_close(&real->port[i]);
    real->bus_count = 0;
    machine_gpio_close(&real->gpio);
    machine_modbus_close(&real->modbus);
    machine_lock_release(&real->lock);
    memory_pool_free(&real->memory);
}
