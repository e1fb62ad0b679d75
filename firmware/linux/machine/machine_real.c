/* firmware/linux/machine/machine_real.c - see machine_real.h. */
#include "firmware/linux/machine/machine_real.h"

#include <stddef.h>
#include <stdio.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include "motion/core/err.h"

/* A name without a file: it is free again when the process is gone, however it
 * went. */
static int machine_real_lock(const char *interface)
{
    struct sockaddr_un address = { .sun_family = AF_UNIX };
    const int lock = socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0);
    const int length =
        snprintf(address.sun_path + 1, sizeof address.sun_path - 1,
                 "slew/master/%s", interface);
    const socklen_t size = (socklen_t)(offsetof(struct sockaddr_un, sun_path) +
                                       1 + (size_t)length);

    if (lock >= 0 && bind(lock, (const struct sockaddr *)&address, size) == 0)
        return lock;
    if (lock >= 0)
        close(lock);
    return -1;
}

static int machine_real_bus(struct machine_real *real, const struct rig *rig,
                            unsigned i, char message[YAML_MESSAGE_MAX])
{
    const struct rig_bus *bus = &rig->bus[i];
    const struct can_socketcan_config config = { .interface = bus->interface,
                                                 .bit_rate = bus->bit_rate,
                                                 .fd = bus->data_bit_rate > 0 };
    char reason[CAN_SOCKETCAN_MESSAGE_MAX];
    int err;

    if (bus->interface[0] == '\0') {
        snprintf(message, YAML_MESSAGE_MAX,
                 "bus %s has no interface, expected a line such as interface: "
                 "can0, or --interface",
                 bus->name);
        return MOTION_E_ARG;
    }
    for (unsigned other = 0; other < i; other++)
        if (real->is_open[other] &&
            strcmp(real->port[other].interface, bus->interface) == 0) {
            snprintf(message, YAML_MESSAGE_MAX,
                     "bus %s: interface %s is another bus's already", bus->name,
                     bus->interface);
            return MOTION_E_ARG;
        }
    err = can_socketcan_open(&real->port[i], &config, reason);
    if (err < 0) {
        snprintf(message, YAML_MESSAGE_MAX, "bus %s: %s", bus->name, reason);
        return err;
    }
    real->lock[i] = machine_real_lock(bus->interface);
    real->is_open[i] = true;
    if (real->lock[i] >= 0)
        return MOTION_OK;
    snprintf(message, YAML_MESSAGE_MAX,
             "bus %s: another slew moves drives on interface %s", bus->name,
             bus->interface);
    return MOTION_E_STATE;
}

int machine_real_init(struct machine_real *real, const struct rig *rig,
                      struct machine_ports *ports,
                      char message[YAML_MESSAGE_MAX])
{
    memset(real, 0, sizeof *real);
    machine_ports_init(ports, rig, &real->memory);
    ports->clock = clock_linux_init(&real->clock);
    real->is_open =
        memory_pool_new(&real->memory, rig->bus_count, sizeof *real->is_open);
    real->port =
        memory_pool_new(&real->memory, rig->bus_count, sizeof *real->port);
    real->lock =
        memory_pool_new(&real->memory, rig->bus_count, sizeof *real->lock);
    for (unsigned i = 0; i < rig->bus_count; i++) {
        real->bus_count = i + 1;
        if (!rig_bus_is_can(&rig->bus[i]))
            continue;
        int err = machine_real_bus(real, rig, i, message);
        if (err < 0) {
            machine_real_close(real);
            return err;
        }
        ports->can[i] = &real->port[i].can;
    }
    int err = machine_gpio_open(&real->gpio, rig, ports, message);
    if (err == MOTION_OK)
        err = machine_modbus_open(&real->modbus, rig, false, ports, message);
    if (err < 0)
        machine_real_close(real);
    return err;
}

void machine_real_close(struct machine_real *real)
{
    for (unsigned i = 0; i < real->bus_count; i++) {
        if (!real->is_open[i])
            continue;
        can_socketcan_close(&real->port[i]);
        if (real->lock[i] >= 0)
            close(real->lock[i]);
    }
    real->bus_count = 0;
    machine_gpio_close(&real->gpio);
    machine_modbus_close(&real->modbus);
    memory_pool_free(&real->memory);
}
