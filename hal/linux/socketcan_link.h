/* hal/linux/socketcan_link.h - what the kernel says about a CAN interface.
 *
 * Asked by netlink (RTM_GETLINK); needs no rights.  Not for the tick: it may
 * allocate inside the kernel and takes some 50 us. */
#ifndef HAL_LINUX_SOCKETCAN_LINK_H
#define HAL_LINUX_SOCKETCAN_LINK_H

#include <stdbool.h>
#include <stdint.h>

#include "hal/can.h"

#define CAN_LINK_NAME_MAX 16 /* with its 0, as the kernel's IFNAMSIZ */

struct can_link {
    unsigned index;
    bool is_can;                  /* of the CAN family at all */
    char kind[CAN_LINK_NAME_MAX]; /* "can" (hardware), "vcan", ... or "" */
    bool up, running;             /* set up; has its carrier */
    bool fd;                      /* takes FD frames */
    unsigned tx_queue;            /* frames the interface queues */
    uint32_t bit_rate;            /* bit/s; 0: has none (vcan) */
    uint32_t data_bit_rate;       /* of FD frames; 0: none */
    uint16_t sample_permille; /* of a bit, where it is sampled; 0: not told */
    uint16_t tx_errors, rx_errors; /* counters; 0 when not told */
    uint32_t
        restart_ms; /* comes back by itself after bus-off; 0: it does not */
    enum hal_can_state state;
};

/* MOTION_OK; MOTION_E_EMPTY: no interface of that name; MOTION_E_ARG: no name
 * at all, or too long; MOTION_E_IO: the kernel does not answer. */
int can_link_read(const char *name, struct can_link *link);

#endif
