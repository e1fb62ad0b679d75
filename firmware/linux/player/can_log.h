/* firmware/linux/player/can_log.h - every frame on our buses, as candump -L
 * writes it.
 *
 *   (1436509052.249713) can0 201#0F0010270000
 *
 * A hand between the master and its ports: what is sent is noted when it is
 * handed over, what is received with its time stamp.  The loop only puts frames
 * into a ring; drain writes them, on another thread or between ticks.  Times
 * are of the wall clock; of virtual time where that runs.  Read by candump's
 * own tools (log2asc, canplayer), tshark, python-can. */
#ifndef FIRMWARE_LINUX_PLAYER_CAN_LOG_H
#define FIRMWARE_LINUX_PLAYER_CAN_LOG_H

#include <stdatomic.h>
#include <stdio.h>

#include "firmware/host/recording/rows.h"
#include "firmware/linux/machine/machine.h"

#define CAN_LOG_FRAMES 8192 /* a second of a full 1 Mbit/s bus */

struct can_log_row {
    uint8_t bus;
    struct hal_can_frame frame;
};

struct can_log;

struct can_log_port {
    struct hal_can can, *inner;
    struct can_log *log;
    uint8_t bus;
};

struct can_log {
    struct rows rows;
    const struct rig *rig;
    struct hal_clock *clock;
    int64_t epoch_ns; /* from the clock to what is written */
    struct memory_pool memory;
    struct can_log_port *port; /* of each bus of the rig */
    _Atomic uint64_t put, taken;
    uint64_t dropped;
    struct can_log_row row[CAN_LOG_FRAMES];
};

/* A log that is all zero, or that was made before and is given back.  Takes the
 * place of every CAN port in *ports.  `realtime`: the ports' clock is
 * CLOCK_MONOTONIC. */
void can_log_init(struct can_log *log, FILE *file, const struct rig *rig,
                  bool realtime, struct machine_ports *ports);
void can_log_free(struct can_log *log);
/* Write what has come together.  Waiting: how many frames that is. */
void can_log_drain(struct can_log *log);
uint64_t can_log_waiting(const struct can_log *log);

/* One line with its end. */
#define CAN_LOG_LINE_MAX 224
void can_log_line(char line[CAN_LOG_LINE_MAX], int64_t t_ns, const char *bus,
                  const struct hal_can_frame *frame);

#endif
