/* firmware/linux/machine/modbus_device.c - see modbus_device.h. */
#include "firmware/linux/machine/modbus_device.h"

#include <arpa/inet.h>
#include <errno.h>
#include <stdio.h>
#include <string.h>

#include "firmware/host/base/memory.h"
#include "firmware/host/rig/modbus_budget.h"
#include "firmware/linux/machine/kind.h"
#include "hal/linux/clock.h"

static int modbus_device_servo(struct modbus_device *device,
                               const struct rig *rig, unsigned i)
{
    struct sim_modbus_servo_config config;
    const struct rig_axis *axis = &rig->axis[i];
    const bool rtu = rig->bus[axis->bus].kind == RIG_MODBUS_RTU;
    int err;

    if (machine_kinds[axis->kind]->serve != NULL)
        return machine_kinds[axis->kind]->serve(device, rig, i);
    err = machine_sim_servo_config(rig, i, &config);

    if (err == MOTION_OK)
        err = sim_modbus_servo_init(&device->servo[i], &device->world,
                                    rtu ? &device->line : NULL, &config);
    if (err == MOTION_OK)
        err = machine_sim_attach(axis, i, &device->servo[i].plant,
                                 &device->mechanics[i]);
    device->host.slave[axis->node_id] = &device->servo[i].slave;
    device->host.faulty[axis->node_id] = &device->servo[i].faulty;
    return err;
}

static int modbus_device_build(struct modbus_device *device,
                               const struct rig *rig, unsigned bus)
{
    const struct modbus_rtu_line line = modbus_budget_line(rig, bus);
    struct clock_linux clock;
    int err;

    device->servo = memory_new(rig->axis_count, sizeof *device->servo);
    device->mechanics = memory_new(rig->axis_count, sizeof *device->mechanics);
    sim_world_init(&device->world, hal_clock_now_ns(clock_linux_init(&clock)));
    modbus_host_init(&device->host, &device->world);
    device->host.wire = &device->line;
    err = sim_modbus_line_init(&device->line, &device->world, &line);
    device->line.echo = rig->bus[bus].modbus.echo;
    for (unsigned i = 0; err == MOTION_OK && i < rig->axis_count; i++)
        if (rig->axis[i].bus == bus)
            err = modbus_device_servo(device, rig, i);
    return err;
}

static int modbus_device_show(struct modbus_device *device,
                              const struct rig_bus *bus,
                              const struct modbus_device_at *at)
{
    const uint16_t port = at->any_port ? 0 : bus->modbus.port;

    if ((bus->kind == RIG_MODBUS_RTU
             ? modbus_host_pty(&device->host, &device->line)
             : modbus_host_tcp(&device->host, at->address, port)) < 0 ||
        modbus_host_start(&device->host) < 0)
        return MOTION_E_IO;
    return MOTION_OK;
}

/* Why it cannot be shown: of a port on TCP, `error` says it. */
static void modbus_device_say(const struct rig_bus *bus, struct in_addr address,
                              int error, const char *reason,
                              char message[YAML_MESSAGE_MAX])
{
    const unsigned port = bus->modbus.port;
    char text[INET_ADDRSTRLEN] = "";

    (void)inet_ntop(AF_INET, &address, text, sizeof text);
    if (error == EADDRINUSE)
        snprintf(message, YAML_MESSAGE_MAX,
                 "bus %s: TCP port %u of %s is in use by another program, "
                 "expected one that is free",
                 bus->name, port, text);
    else if (error == EADDRNOTAVAIL)
        snprintf(message, YAML_MESSAGE_MAX,
                 "bus %s: %s is no address of this machine, expected one that "
                 "ip address shows, or 0.0.0.0 for all of them",
                 bus->name, text);
    else if (error == EACCES)
        snprintf(message, YAML_MESSAGE_MAX,
                 "bus %s: no permission for TCP port %u, expected one above "
                 "1023",
                 bus->name, port);
    else
        snprintf(message, YAML_MESSAGE_MAX,
                 "bus %s: its drives cannot be shown (%s)", bus->name,
                 error != 0 ? strerror(error) : reason);
}

int modbus_device_start(struct modbus_device *device, const struct rig *rig,
                        unsigned bus, const struct modbus_device_at *at,
                        char message[YAML_MESSAGE_MAX])
{
    int err, error = 0;

    memset(device, 0, sizeof *device);
    err = modbus_device_build(device, rig, bus);
    if (err == MOTION_OK) {
        errno = 0;
        err = modbus_device_show(device, &rig->bus[bus], at);
        error = errno;
    }
    if (err < 0) {
        modbus_device_say(&rig->bus[bus], at->address, error,
                          motion_err_text(err), message);
        modbus_device_stop(device);
    }
    return err;
}

void modbus_device_stop(struct modbus_device *device)
{
    modbus_host_stop(&device->host);
    memory_free(device->servo);
    memory_free(device->mechanics);
    memory_pool_free(&device->memory);
    device->servo = NULL;
    device->mechanics = NULL;
}
