/* hal/linux/libmodbus_port.h - private to libmodbus*.c: the port, for the line's
 * thread only. */
#ifndef HAL_LINUX_LIBMODBUS_PORT_H
#define HAL_LINUX_LIBMODBUS_PORT_H

#include "hal/linux/libmodbus.h"

#define MODBUS_LIBMODBUS_RETRY_NS INT64_C(200000000)
#define MODBUS_LIBMODBUS_HURRIED  3 /* requests of a line that is taken over */

/* Times of a line that is taken over. */
#define HURRIED_SILENT_NS  INT64_C(20000000)
#define HURRIED_TIMEOUT_NS INT64_C(100000000)

int64_t modbus_libmodbus_now_ns(void);
void modbus_libmodbus_sleep_until(int64_t t_ns);

/* ---- libmodbus_port.c ---- */

bool modbus_libmodbus_is_rtu(const struct modbus_libmodbus *self);
/* Open and connect, unless done or tried a moment ago. */
void modbus_libmodbus_up(struct modbus_libmodbus *self);
void modbus_libmodbus_down(struct modbus_libmodbus *self);
/* Return dur_ns, and no more than hurried_ns while the line is taken over. */
int64_t modbus_libmodbus_hurry(const struct modbus_libmodbus *self,
                               int64_t dur_ns, int64_t hurried_ns);
/* Read away what comes until nothing has for `silent_ns`. */
void modbus_libmodbus_drain(struct modbus_libmodbus *self, int64_t silent_ns);
/* Leave no answer of old behind a transaction that ended with `err`. */
void modbus_libmodbus_recover(struct modbus_libmodbus *self, int err);

/* TCP.  Read what is there into the stream; false: the other end has closed. */
bool modbus_libmodbus_read(struct modbus_libmodbus *self);
/* It has: the connection is gone. */
void modbus_libmodbus_broke(struct modbus_libmodbus *self);
/* Is there a connection that the other end has not closed?  Had again where it is
 * gone: MOTION_E_TIMEOUT when it was not until end_ns, MOTION_E_IO when it was not
 * for three time-outs, or has never been. */
int modbus_libmodbus_ready(struct modbus_libmodbus *self,
                           const struct hal_modbus_request *request,
                           int64_t end_ns);

/* ---- libmodbus_exchange.c ---- */

/* One transaction, its silence before it waited for. */
void modbus_libmodbus_transact(struct modbus_libmodbus *self,
                               struct modbus_libmodbus_box *box);

#endif
