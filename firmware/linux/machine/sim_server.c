/* firmware/linux/machine/sim_server.c - see sim_server.h. */
#define _GNU_SOURCE /* ppoll */
#include "firmware/linux/machine/sim_server.h"

#include <poll.h>
#include <stdio.h>
#include <string.h>
#include <time.h>

#include "motion/core/err.h"

#define SERVER_WAIT_NS INT64_C(1000000)

static int sim_server_bus(struct sim_server *server, unsigned i,
                          char message[YAML_MESSAGE_MAX])
{
    const struct rig_bus *bus = &server->rig->bus[i];
    const struct can_socketcan_config config = { .interface = bus->interface,
                                                 .bit_rate = bus->bit_rate,
                                                 .fd = bus->data_bit_rate > 0 };
    const struct modbus_device_at at = { .address = server->address };
    char reason[CAN_SOCKETCAN_MESSAGE_MAX];
    int err = MOTION_E_ARG;

    if (!rig_bus_is_can(bus)) {
        server->is_modbus[i] = true;
        err = modbus_device_start(&server->device[i], server->rig, i, &at,
                                  message);
        server->bus_count += err == MOTION_OK;
        server->served_line[i] = &server->device[i].line;
        for (unsigned axis = 0;
             err == MOTION_OK && axis < server->rig->axis_count; axis++)
            if (server->rig->axis[axis].bus == i)
                server->served[axis] = &server->device[i].servo[axis];
        return err;
    }
    if (bus->interface[0] == '\0') {
        snprintf(message, YAML_MESSAGE_MAX,
                 "bus %s has no interface, expected a line such as interface: "
                 "can0, or --interface",
                 bus->name);
        return err;
    }
    err = can_socketcan_open(&server->port[i], &config, reason);
    if (err < 0)
        snprintf(message, YAML_MESSAGE_MAX, "bus %s: %s", bus->name, reason);
    else
        server->bus_count++;
    return err;
}

int sim_server_open(struct sim_server *server, const struct rig *rig,
                    struct in_addr address, char message[YAML_MESSAGE_MAX])
{
    int err;

    if (rig->bus_count == 0) {
        snprintf(message, YAML_MESSAGE_MAX,
                 "the rig has no bus that its drives could be shown on");
        return MOTION_E_EMPTY;
    }
    server->rig = rig;
    server->address = address;
#define CAPACITY(array)                                                        \
    server->array = memory_pool_new(&server->memory, rig->bus_count,           \
                                    sizeof *server->array)
    CAPACITY(is_modbus);
    CAPACITY(device);
    CAPACITY(port);
    CAPACITY(poll_fd);
#undef CAPACITY
    server->served = memory_pool_new(&server->memory, rig->axis_count,
                                     sizeof(struct sim_modbus_servo *));
    server->served_line = memory_pool_new(&server->memory, rig->bus_count,
                                          sizeof(struct sim_modbus_line *));
    err = machine_sim_init(&server->sim, rig, true, &server->wire, message);
    for (unsigned i = 0; err == MOTION_OK && i < rig->bus_count; i++)
        err = sim_server_bus(server, i, message);
    server->sim.served = server->served;
    server->sim.served_line = server->served_line;
    if (err < 0)
        sim_server_close(server);
    return err;
}

void sim_server_close(struct sim_server *server)
{
    for (unsigned i = 0; i < server->bus_count; i++)
        if (server->is_modbus[i])
            modbus_device_stop(&server->device[i]);
        else
            can_socketcan_close(&server->port[i]);
    server->bus_count = 0;
    machine_sim_free(&server->sim);
    memory_pool_free(&server->memory);
}

/* What the wire has no room for stays in the interface's queue. */
static void sim_server_take_in(struct sim_server *server, unsigned i)
{
    const struct sim_can_queue *queue = &server->sim.port[i].tx;
    struct hal_can_frame frame;

    while (queue->count < SIM_CAN_QUEUE &&
           hal_can_recv(&server->port[i].can, &frame) == 1)
        if (hal_can_send(server->wire.can[i], &frame) == MOTION_OK)
            server->frames_in++;
}

static void sim_server_give_out(struct sim_server *server, unsigned i)
{
    struct hal_can_frame frame;

    while (hal_can_recv(server->wire.can[i], &frame) == 1)
        if (hal_can_send(&server->port[i].can, &frame) == MOTION_OK)
            server->frames_out++;
    (void)hal_can_flush(&server->port[i].can);
}

void sim_server_lock(struct sim_server *server)
{
    for (unsigned i = 0; i < server->bus_count; i++)
        if (server->is_modbus[i])
            pthread_mutex_lock(&server->device[i].host.lock);
}

void sim_server_unlock(struct sim_server *server)
{
    for (unsigned i = 0; i < server->bus_count; i++)
        if (server->is_modbus[i])
            pthread_mutex_unlock(&server->device[i].host.lock);
}

int64_t sim_server_now_ns(struct sim_server *server)
{
    return hal_clock_now_ns(&server->sim.real.clock);
}

/* Only the wires are worth waking up for: the drives catch up by themselves. */
static void sim_server_wait(struct sim_server *server)
{
    struct pollfd *poll_fd = server->poll_fd;
    struct timespec timeout = { 0 };
    const int64_t now_ns = sim_server_now_ns(server);
    int64_t wait_ns = SERVER_WAIT_NS;

    for (unsigned i = 0; i < server->bus_count; i++) {
        if (server->is_modbus[i]) { /* has a thread of its own */
            poll_fd[i] = (struct pollfd){ .fd = -1 };
            continue;
        }
        const int64_t due_ns = server->sim.wire[i].due_ns - now_ns;

        wait_ns = due_ns < wait_ns ? due_ns : wait_ns;
        poll_fd[i] = (struct pollfd){ .fd = can_socketcan_fd(&server->port[i]),
                                      .events = POLLIN };
        /* one that is down would be ready all the time */
        if (hal_can_state(&server->port[i].can) == HAL_CAN_DOWN)
            poll_fd[i].fd = -1;
    }
    if (wait_ns <= 0)
        return;
    timeout.tv_nsec = (long)wait_ns;
    (void)ppoll(poll_fd, server->bus_count, &timeout, NULL);
}

void sim_server_step(struct sim_server *server)
{
    sim_world_run(&server->sim.world, sim_server_now_ns(server));
    for (unsigned i = 0; i < server->bus_count; i++)
        if (!server->is_modbus[i])
            sim_server_give_out(server, i);
    sim_server_wait(server);
    sim_world_run(&server->sim.world, sim_server_now_ns(server));
    for (unsigned i = 0; i < server->bus_count; i++)
        if (!server->is_modbus[i])
            sim_server_take_in(server, i);
}
