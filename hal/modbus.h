/* hal/modbus.h - a Modbus line as its master sees it: transactions, never
 * blocking.
 *
 * The caller submits requests into a small mailbox and collects replies, one
 * for every request that was taken, in the same order.  The line keeps its own
 * silences and time-outs, and after a transaction that failed it makes sure
 * that no late answer can be taken for the next one.  Nothing is repeated: only
 * the caller decides what may be done twice.
 *
 * Implementations: hal/modbus/master.c (RTU, by bytes: simulated lines and
 * microcontrollers), hal/linux/libmodbus.c (serial and TCP).  A line is not
 * shared between threads.
 *
 * Source: MODBUS Application Protocol Specification V1.1b3; MODBUS over Serial
 * Line V1.02. */
#ifndef HAL_MODBUS_H
#define HAL_MODBUS_H

#include <stdbool.h>
#include <stdint.h>

#include "motion/core/err.h"

MOTION_C_BEGIN

#define HAL_MODBUS_READ_MAX  125  /* registers in one reply */
#define HAL_MODBUS_WRITE_MAX 123  /* registers in one request; 121 with 0x17 */
#define HAL_MODBUS_BITS_MAX  1968 /* coils written in one request */
#define HAL_MODBUS_BITS_READ 2000 /* coils or inputs in one reply */

#define HAL_MODBUS_BROADCAST 0 /* unit: all hear it, nobody answers */

/* The mailbox: requests not yet collected. */
#define HAL_MODBUS_MAILBOX 8

enum hal_modbus_function {
    HAL_MODBUS_READ_COILS = 0x01,    /* bits, as WRITE_COILS has them */
    HAL_MODBUS_READ_DISCRETE = 0x02, /* the same of discrete inputs */
    HAL_MODBUS_READ = 0x03,          /* holding registers */
    HAL_MODBUS_READ_INPUT = 0x04,    /* input registers */
    HAL_MODBUS_WRITE_COIL = 0x05,    /* value[0]: 0 or not */
    HAL_MODBUS_WRITE = 0x06,         /* one register, value[0] */
    HAL_MODBUS_WRITE_COILS = 0x0F,   /* bit i is bit i % 16 of value[i / 16] */
    HAL_MODBUS_WRITE_MANY = 0x10,
    HAL_MODBUS_REPORT = 0x11,     /* who are you, as the maker likes; count 0 */
    HAL_MODBUS_MASK = 0x16,       /* register = (it and value[0]) or
                               (value[1] and not value[0]) */
    HAL_MODBUS_WRITE_READ = 0x17, /* writes first */
    HAL_MODBUS_IDENTIFY = 0x2B,   /* basic device identification (0x0E, 1);
                                     count 0 */
};

struct hal_modbus_request {
    uint8_t unit;     /* 1..247; 255 for a TCP device; HAL_MODBUS_BROADCAST only
                     for what writes */
    uint8_t function; /* enum hal_modbus_function */
    uint16_t address; /* from 0, as in the frame; 0x17: of what is read */
    uint16_t count;   /* registers read or written, coils; 1 with 05, 06, 16; 0
                         with 11, 2B */
    uint16_t write_address, write_count; /* 0x17 only */
    uint16_t value[HAL_MODBUS_WRITE_MAX];
};

struct hal_modbus_reply {
    uint32_t tag; /* of the request */
    /* MOTION_OK; MOTION_E_TIMEOUT; MOTION_E_PROTOCOL: broken, of somebody else
     * or not an answer to this; MOTION_E_REFUSED: `exception` says why;
     * MOTION_E_IO: port or connection gone. */
    int err;
    uint8_t exception; /* Modbus exception code */
    uint16_t count;    /* registers, or bits, that were read */
    uint8_t bytes;     /* 11, 2B: so many came after the function; they fill
                          `value`, each register its upper byte first */
    uint16_t value[HAL_MODBUS_READ_MAX];
    /* On the clock of hal_clock: the request's first bit, when the answer began
     * (values are from just before), when the line was free again. */
    int64_t sent_ns, answer_ns, done_ns;
};

struct hal_modbus_stats {
    uint64_t transactions; /* finished, whatever came of them */
    /* by err; timeouts: those that a gateway tells of too */
    uint64_t timeouts, broken, exceptions, failures;
    uint64_t reconnects;
    uint64_t stray;    /* bytes that nobody had asked for */
    uint64_t echoes;   /* requests that came back as they were sent */
    uint64_t late;     /* TCP: answers to requests of before, dropped */
    uint64_t busy_ns;  /* from request to free line, answered ones */
    uint64_t ideal_ns; /* the same ones at the baud rate and the silent
                          intervals, a slave answering at once; 0: no rate
                          to go by (TCP) */
    uint64_t refused;  /* submits refused with MOTION_E_FULL */
};

struct hal_modbus;

struct hal_modbus_ops {
    /* MOTION_OK; MOTION_E_FULL: the mailbox is full, nothing taken;
     * MOTION_E_ARG: no such request. */
    int (*submit)(struct hal_modbus *line,
                  const struct hal_modbus_request *request, uint32_t tag);
    /* The oldest reply.  1 when there was one, 0 when not. */
    int (*collect)(struct hal_modbus *line, struct hal_modbus_reply *reply);
    /* 1: port open, connected; 0: not, it tries by itself. */
    int (*is_up)(struct hal_modbus *line);
    void (*stats)(struct hal_modbus *line, struct hal_modbus_stats *stats);
};

struct hal_modbus {
    const struct hal_modbus_ops *ops;
};

static inline int hal_modbus_submit(struct hal_modbus *line,
                                    const struct hal_modbus_request *request,
                                    uint32_t tag)
{
    return line->ops->submit(line, request, tag);
}

static inline int hal_modbus_collect(struct hal_modbus *line,
                                     struct hal_modbus_reply *reply)
{
    return line->ops->collect(line, reply);
}

static inline int hal_modbus_is_up(struct hal_modbus *line)
{
    return line->ops->is_up(line);
}

static inline void hal_modbus_stats(struct hal_modbus *line,
                                    struct hal_modbus_stats *stats)
{
    line->ops->stats(line, stats);
}

/* "illegal data address" ...; never NULL. */
const char *hal_modbus_exception_text(uint8_t exception);

/* A gateway in between says that nothing came of the device (exceptions 0A, no
 * path, and 0B, no answer): an answer is missing, none was refused. */
bool hal_modbus_is_missing(const struct hal_modbus_reply *reply);
/* Put into words why a reply is no answer. */
#define HAL_MODBUS_BROKE "there is no connection"
const char *hal_modbus_reply_text(const struct hal_modbus_reply *reply);

/* Counts a finished transaction. */
void hal_modbus_count(struct hal_modbus_stats *stats,
                      const struct hal_modbus_reply *reply);

MOTION_C_END

#endif
