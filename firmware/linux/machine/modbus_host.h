/* firmware/linux/machine/modbus_host.h - simulated Modbus devices, shown to the
 * outside world in real time.
 *
 * A pseudo-terminal is a seat on a simulated RTU line: what a program writes to
 * it takes its bit time there, and so do the answers.  A TCP socket serves the
 * registers directly, by unit, through what is wrong on the way to it.  One thread runs the simulated world on
 * CLOCK_MONOTONIC; nobody else may touch it between start and stop, but who has
 * the lock, and for a moment. */
#ifndef FIRMWARE_LINUX_MACHINE_MODBUS_HOST_H
#define FIRMWARE_LINUX_MACHINE_MODBUS_HOST_H

#include <netinet/in.h>
#include <pthread.h>
#include <stdatomic.h>

#include "hal/modbus/slave.h"
#include "hal/modbus/tcp.h"
#include "sim/bus/modbus.h"

#define MODBUS_HOST_UNITS   248
#define MODBUS_HOST_CLIENTS 8
#define MODBUS_HOST_PATH    64

/* A station that carries bytes between the line and a descriptor. */
struct modbus_host_bridge {
    struct modbus_station station;
    uint8_t pending[4096]; /* read, to be sent in pieces of a frame */
    unsigned length;
    int fd;
};

struct modbus_host_client {
    int fd;          /* -1: none */
    uint32_t number; /* of all that have come */
    bool deaf;       /* what it says is not heard any more */
    uint8_t frame[MODBUS_TCP_FRAME_MAX];
    unsigned length;
};

struct modbus_host {
    struct sim_world *world;
    /* the pseudo-terminal */
    struct sim_modbus_seat seat;
    struct modbus_host_bridge bridge; /* fd -1: none */
    int other_end;
    char path[MODBUS_HOST_PATH]; /* what to open */
    /* TCP */
    int listener; /* -1: none */
    uint16_t port;
    struct modbus_slave *slave[MODBUS_HOST_UNITS];
    struct sim_modbus_faulty *faulty[MODBUS_HOST_UNITS]; /* NULL: none is */
    uint32_t clients;                                    /* that have come */
    /* Whose `deaf` and `closed` are those of the connections; NULL: none's. */
    struct sim_modbus_line *wire;
    struct modbus_host_client client[MODBUS_HOST_CLIENTS];

    pthread_t thread;
    pthread_mutex_t lock; /* the thread has it but while it waits */
    _Atomic bool stop;
};

/* Nothing shown yet.  The world's now should be CLOCK_MONOTONIC's. */
void modbus_host_init(struct modbus_host *host, struct sim_world *world);
/* Make a pseudo-terminal on the line; host->path names it.  0, or -1. */
int modbus_host_pty(struct modbus_host *host, struct sim_modbus_line *line);
/* Listen on an address of this machine, in network order; port 0 takes any,
 * host->port says which.  The devices: host->slave[unit].  0, or -1. */
int modbus_host_tcp(struct modbus_host *host, struct in_addr address,
                    uint16_t port);
/* 0, or -1. */
int modbus_host_start(struct modbus_host *host);
/* Ends the thread and closes everything; also when it was never started. */
void modbus_host_stop(struct modbus_host *host);

#endif
