/* firmware/linux/machine/sim_server.h - the simulated drives of a rig, on real
 * CAN interfaces, in real time; those on Modbus on pseudo-terminals and TCP
 * ports.
 *
 * Whoever speaks their language on the interface meets drives: another slew
 * with
 * --real, python-canopen, a PLC.  The simulated wire follows the clock; what
 * comes from an interface is put on the wire of its bus, and what the drives
 * say goes out.  A frame so takes its bit time twice, and a little for this
 * program to wake up.  While an interface is down nothing reaches its drives:
 * their own watchdogs act. */
#ifndef FIRMWARE_LINUX_MACHINE_SIM_SERVER_H
#define FIRMWARE_LINUX_MACHINE_SIM_SERVER_H

#include "firmware/linux/machine/machine_sim.h"
#include "firmware/linux/machine/modbus_device.h"
#include "hal/linux/socketcan.h"

struct pollfd;

struct sim_server {
    const struct rig *rig;
    struct in_addr address; /* of drives on TCP */
    struct machine_sim sim;
    struct machine_ports wire; /* our end of each simulated wire */
    unsigned bus_count;        /* open so far */
    struct memory_pool memory; /* of the arrays: one per bus */
    bool *is_modbus;
    struct modbus_device *device;         /* of those, real time */
    struct sim_modbus_servo **served;     /* of each axis; NULL: on CAN */
    struct sim_modbus_line **served_line; /* of each bus */
    struct can_socketcan *port;
    struct pollfd *poll_fd;
    uint64_t frames_in, frames_out;
};

/* Opens the interface of every bus, for a server that is all zero; drives on
 * TCP listen on `address` (in network order).  On an error returns its code and
 * writes a sentence; nothing is left open then. */
int sim_server_open(struct sim_server *server, const struct rig *rig,
                    struct in_addr address, char message[YAML_MESSAGE_MAX]);
/* Bring everything up to now, then wait until something comes or is due, a
 * millisecond at most. */
void sim_server_step(struct sim_server *server);
void sim_server_close(struct sim_server *server);

/* The drives on Modbus are run by threads: nobody else may look at them, or
 * change them, but between these two. */
void sim_server_lock(struct sim_server *server);
void sim_server_unlock(struct sim_server *server);
int64_t sim_server_now_ns(struct sim_server *server);

#endif
