/* firmware/linux/machine/modbus_device.h - the simulated servos of one Modbus
 * bus of a rig, in real time, where any Modbus master can reach them.
 *
 * An RTU line becomes a pseudo-terminal, with its bit times; TCP a port of this
 * machine. */
#ifndef FIRMWARE_LINUX_MACHINE_MODBUS_DEVICE_H
#define FIRMWARE_LINUX_MACHINE_MODBUS_DEVICE_H

#include "firmware/host/base/memory.h"
#include "firmware/host/rig/rig.h"
#include "firmware/linux/machine/modbus_host.h"
#include "sim/device/modbus/servo.h"
#include "sim/physics/mechanics.h"

struct modbus_device {
    struct sim_world world;
    struct sim_modbus_line line;
    struct sim_modbus_servo *servo; /* one per axis of the rig */
    struct sim_mechanics *mechanics;
    struct memory_pool memory; /* of what other kinds have */
    struct modbus_host host;
};

/* Where those on TCP listen. */
struct modbus_device_at {
    struct in_addr address; /* in network order */
    bool any_port;          /* a free one instead of the rig's */
};

/* host.path or host.port says where it is.  On an error returns its code and
 * writes a sentence. */
int modbus_device_start(struct modbus_device *device, const struct rig *rig,
                        unsigned bus, const struct modbus_device_at *at,
                        char message[YAML_MESSAGE_MAX]);
void modbus_device_stop(struct modbus_device *device);

#endif
