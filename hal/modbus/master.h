/* hal/modbus/master.h - the master of an RTU line, byte by byte.
 *
 *             request in the mailbox, line silent
 *   IDLE ---------------------------------------> SENDING
 *    ^ ^                                             | last bit out
 *    | |  3.5 characters             whole answer    v
 *    | '-------------- ENDING <------------------ WAITING
 *    |                                               | late, broken,
 *    |   silent for drain_ns                         | not an answer
 *    '------------------ DRAINING <------------------'
 *
 * Which bytes are the answer listener.h has; what follows it is dropped.
 *
 * An RTU answer does not say which request it belongs to.  One that comes after
 * its time-out would be taken for the answer to the next request; so after
 * every failure the master listens until the line has been silent for drain_ns,
 * which must be longer than the slowest slave may be late. */
#ifndef HAL_MODBUS_MASTER_H
#define HAL_MODBUS_MASTER_H

#include "hal/modbus/listener.h"
#include "hal/modbus/station.h"

struct modbus_master_config {
    struct modbus_rtu_line line;
    bool echo;            /* it hears what it sends, always */
    int64_t timeout_ns;   /* from the end of the request to the answer, beyond
                             its time on the wire, 1 ms .. 10 s; 0: 50 ms */
    int64_t drain_ns;     /* 1 ms .. 10 s; 0: twice timeout_ns */
    int64_t broadcast_ns; /* slaves may need this to do what a broadcast says;
                              0: 10 ms */
};

enum modbus_master_state {
    MODBUS_MASTER_IDLE,
    MODBUS_MASTER_SENDING,
    MODBUS_MASTER_WAITING,
    MODBUS_MASTER_ENDING,
    MODBUS_MASTER_DRAINING,
};

struct modbus_master_box {
    struct hal_modbus_request request;
    uint32_t tag;
};

/* Visible so that it can be static; use the functions. */
struct modbus_master {
    struct hal_modbus modbus;
    struct modbus_station station;
    struct modbus_master_config config;
    struct modbus_rtu_time time;
    enum modbus_master_state state;
    struct modbus_master_box box[HAL_MODBUS_MAILBOX];
    unsigned box_head, box_count; /* not finished, oldest first */
    struct hal_modbus_reply reply[HAL_MODBUS_MAILBOX];
    unsigned reply_head, reply_count; /* not collected */
    struct modbus_listener listener;
    struct modbus_echo echo;
    bool down; /* of whoever has the port: it is gone, and what is asked fails
                  with MOTION_E_IO */
    int64_t free_ns;              /* nothing is sent before */
    int64_t sent_ns, sent_end_ns; /* the request's first bit, its last */
    int64_t deadline_ns;          /* of the state */
    int64_t limit_ns;             /* of the deadline, while bytes come */
    int64_t heard_ns;             /* the last of them */
    int64_t drain_limit_ns;       /* a line that is never silent */
    struct hal_modbus_stats stats;
};

/* MOTION_E_ARG for a value outside its range. */
int modbus_master_init(struct modbus_master *self,
                       const struct modbus_master_config *config);

#endif
