/* hal/linux/libmodbus.h - a Modbus line by libmodbus: RTU on a serial device,
 * or TCP.
 *
 * One thread per line owns the port; the tick only puts requests into the
 * mailbox and takes replies out of it, without lock or wait.  The thread keeps
 * the silences, the time-outs and the connection: one that fails is opened
 * anew, at most every 200 ms.
 *
 * libmodbus opens and sets the port, switches the direction, sends RTU frames and
 * connects.  What is heard is judged by hal/modbus/listener.h and tcp.h: libmodbus
 * takes the first bytes that come for the answer, reads as many as they say, and has
 * no transaction numbers.  Its own error recovery may block for ever: it is off.
 *
 * No answer is taken for another request's: every answer is checked in full
 * (unit, function, length, echo, CRC or transaction number), RTU is drained
 * after a failure (see hal/modbus/master.h), TCP drops by the number what is late.
 *
 * TCP.  A connection is kept until its other end closes or resets it: servers with few
 * of them may refuse the next.  Then it is connected again, for three time-outs; the
 * request that was under way, and one that waits for longer than a time-out, has
 * MOTION_E_TIMEOUT, as it may have been done.  A connection that is not had again in
 * that time is gone: MOTION_E_IO.  One that has brought nothing for three requests
 * in a row may be gone without a word, and is made anew.
 *
 * RTU, takes_over.  Half a request may be in the device, and the answer to a whole
 * one may still come, so the first requests may fail, and must not cost the time that
 * a failure costs otherwise: drives have torque meanwhile.  The line is silent for
 * 20 ms, longer than adapters keep bytes, before the first one; this one and the next two wait for
 * 100 ms at most, and what they leave is drained for 20 ms.  The first good answer
 * ends that; if others failed before it, it may have been theirs, and the line is
 * silent for timeout_ns before what comes next. */
#ifndef HAL_LINUX_LIBMODBUS_H
#define HAL_LINUX_LIBMODBUS_H

#include <pthread.h>
#include <stdatomic.h>

#include "hal/modbus/line.h"
#include "hal/modbus/listener.h"
#include "hal/modbus/tcp.h"

struct modbus_libmodbus_box {
    struct hal_modbus_request request;
    struct hal_modbus_reply reply;
};

struct _modbus;

/* Visible so that it can be static; use the functions. */
struct modbus_libmodbus {
    struct hal_modbus modbus;
    struct modbus_line_config config;
    struct modbus_rtu_time time;
    /* Box n is n % HAL_MODBUS_MAILBOX; collected <= finished <= submitted <=
     * collected + HAL_MODBUS_MAILBOX. */
    struct modbus_libmodbus_box box[HAL_MODBUS_MAILBOX];
    _Atomic uint64_t submitted, finished;
    uint64_t collected;
    struct hal_modbus_stats stats; /* the caller's */
    _Atomic uint64_t stray, echoes, late, reconnects;
    _Atomic bool up, stop;

    /* the thread's */
    pthread_t thread;
    int wake; /* eventfd */
    struct _modbus *context;
    int64_t free_ns, retry_ns;
    struct modbus_listener listener; /* of a serial line */
    struct modbus_echo echo;
    struct modbus_tcp_stream stream; /* of TCP, and what follows */
    uint16_t transaction;
    int64_t since_ns; /* the transaction under way, or the last */
    int64_t
        broke_ns; /* the one in which it was closed, where none was good since;
                         0: it is sound */
    unsigned silent; /* requests in a row that brought nothing */
    bool was_up;
    unsigned hurried; /* requests that may still fail while it takes over */
};

/* Starts the thread, which connects by itself: whether it could is not waited
 * for.  MOTION_E_ARG for a value outside its range, MOTION_E_IO when no thread
 * could be started. */
int modbus_libmodbus_open(struct modbus_libmodbus *self,
                          const struct modbus_line_config *config);
/* Ends the thread, after at most one transaction. */
void modbus_libmodbus_close(struct modbus_libmodbus *self);

#endif
