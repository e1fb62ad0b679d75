/* firmware/linux/machine/modbus_device.h - the simulated servos of one Modbus
 * bus of a rig, in real time, where any Modbus master can reach them.
 *
 * An RTU line becomes a pseudo-terminal, with its bit times; TCP a port on
 * 127.0.0.1. */
#ifndef FIRMWARE_LINUX_MACHINE_MODBUS_DEVICE_H
#define FIRMWARE_LINUX_MACHINE_MODBUS_DEVICE_H

#include "firmware/host/rig/rig.h"
#include "firmware/linux/machine/modbus_host.h"
#include "sim/device/modbus/servo.h"

struct modbus_device {
    struct sim_world world;
    struct sim_modbus_line line;
    struct sim_modbus_servo *servo; /* one per axis of the rig */
    struct modbus_host host;
};

/* host.path or host.port says where it is (TCP: the rig's port, or any when
 * `any_port`).  On an error returns its code and writes a sentence. */
int modbus_device_start(struct modbus_device *device, const struct rig *rig,
                        unsigned bus, bool any_port,
                        char message[YAML_MESSAGE_MAX]);
void modbus_device_stop(struct modbus_device *device);

#endif
