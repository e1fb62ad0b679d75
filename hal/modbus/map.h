/* hal/modbus/map.h - a servo drive on Modbus, described: where its registers
 * are, what they mean, and what must be written in which order.
 *
 * Plain data; firmware/host/device/modbus_map_load.c reads it from a file
 * (docs/MODBUS.md describes it), hal/drive/modbus/drive.c drives a servo by it,
 * and sim/device/modbus/servo.c behaves like one. */
#ifndef HAL_MODBUS_MAP_H
#define HAL_MODBUS_MAP_H

#include <stdbool.h>

#include "hal/modbus/rtu.h"

MOTION_C_BEGIN

#define MODBUS_MAP_TITLE_MAX  96
#define MODBUS_MAP_NAME_MAX   32
#define MODBUS_MAP_TEXT_MAX   64
#define MODBUS_MAP_ITEMS_MAX  24
#define MODBUS_MAP_FIELDS_MAX 16
#define MODBUS_MAP_STEPS_MAX  12
#define MODBUS_MAP_ALARMS_MAX 48
#define MODBUS_MAP_APART_MAX  16
#define MODBUS_MAP_NO_ITEM    255

/* F32: IEEE 754 single, of which slew takes and writes whole numbers.  A BIT is
 * a coil or a discrete input; its addresses are those of bits. */
enum modbus_map_type {
    MODBUS_U16,
    MODBUS_I16,
    MODBUS_U32,
    MODBUS_I32,
    MODBUS_F32,
    MODBUS_BIT,
};

/* Of the four bytes of a 32-bit value, A the uppermost, as they come. */
enum modbus_map_order { MODBUS_ABCD, MODBUS_CDAB, MODBUS_BADC, MODBUS_DCBA };

enum modbus_map_poll {
    MODBUS_POLL_NEVER, /* only when a step asks, or to write it */
    MODBUS_POLL_FAST,  /* in every cycle */
    MODBUS_POLL_SLOW,
    MODBUS_POLL_MONITOR, /* in every cycle of a drive that is monitored */
};

struct modbus_map_item {
    char name[MODBUS_MAP_NAME_MAX];
    uint16_t at; /* as in the frame, from 0 */
    enum modbus_map_type type;
    enum modbus_map_order order;
    uint8_t read;  /* function: 3 or 4; of a bit 1 or 2 */
    uint8_t write; /* function: 5, 6 or 16; of a bit 5 or 15 */
    enum modbus_map_poll poll;
    /* POLL_MONITOR: 1 + enum hal_reading, and thousandths of its unit that one
     * count is, != 0; else 0 */
    uint8_t reading;
    int32_t milli;
};

enum modbus_map_quantity {
    MODBUS_CONST,
    MODBUS_POSITION,     /* counts */
    MODBUS_VELOCITY,     /* how fast, never negative */
    MODBUS_ACCELERATION, /* of the drive's own ramps */
    MODBUS_DECELERATION,
};

enum modbus_map_unit {
    MODBUS_COUNTS,          /* of the motor; per s, per s2 */
    MODBUS_RPM,             /* per s for accelerations */
    MODBUS_MS_PER_1000_RPM, /* a time: the larger, the softer */
};

/* One value of a group: constant, or quantity in unit times num / den. */
struct modbus_map_field {
    enum modbus_map_type type;
    enum modbus_map_order order;
    enum modbus_map_quantity quantity;
    enum modbus_map_unit unit;
    int64_t constant;
    int64_t num, den; /* 1 .. 10^9 */
    int64_t min, max; /* of the register */
};

/* What is written in one request, from `at` on. */
struct modbus_map_group {
    uint16_t at;
    uint8_t count; /* 0: the drive cannot */
    uint8_t registers;
    struct modbus_map_field field[MODBUS_MAP_FIELDS_MAX];
};

/* X(name): conditions on what is polled. */
#define MODBUS_MAP_STATUS_LIST(X)                                              \
    X(ready)                                                                   \
    X(enabled)                                                                 \
    X(torque) /* also while it stops by itself; not said: as enabled */        \
    X(moving)                                                                  \
    X(in_position)                                                             \
    X(homed)                                                                   \
    X(fault)                                                                   \
    X(limit_negative)                                                          \
    X(limit_positive)

enum modbus_map_status {
#define MODBUS_MAP_STATUS_ENUM(name) MODBUS_STATUS_##name,
    MODBUS_MAP_STATUS_LIST(MODBUS_MAP_STATUS_ENUM)
#undef MODBUS_MAP_STATUS_ENUM
        MODBUS_STATUS_COUNT
};

struct modbus_map_condition {
    uint8_t item; /* MODBUS_MAP_NO_ITEM: the drive does not say */
    uint32_t mask, equals;
};

enum modbus_map_step_kind {
    MODBUS_STEP_WRITE, /* value into item */
    MODBUS_STEP_UNTIL, /* status is value, for at most dur_ns */
    MODBUS_STEP_DELAY, /* dur_ns */
    MODBUS_STEP_CHECK, /* item reads back as value, or it is a fault */
};

struct modbus_map_step {
    enum modbus_map_step_kind kind;
    uint8_t item;
    enum modbus_map_status status;
    int64_t value;
    int64_t dur_ns;
};

/* X(name): lists of steps. */
#define MODBUS_MAP_SEQUENCE_LIST(X)                                            \
    X(init) /* after the drive was found */                                    \
    X(enable)                                                                  \
    X(disable)                                                                 \
    X(stop)                                                                    \
    X(halt) /* a motion ends by its ramp; the next one may come */             \
    X(home)                                                                    \
    X(reset)        /* clear an alarm */                                       \
    X(move_go)      /* after the group move */                                 \
    X(stream_begin) /* once, after the first group stream */                   \
    X(stream_go)    /* after every group stream */

enum modbus_map_sequence_name {
#define MODBUS_MAP_SEQUENCE_ENUM(name) MODBUS_SEQUENCE_##name,
    MODBUS_MAP_SEQUENCE_LIST(MODBUS_MAP_SEQUENCE_ENUM)
#undef MODBUS_MAP_SEQUENCE_ENUM
        MODBUS_SEQUENCE_COUNT
};

struct modbus_map_sequence {
    uint8_t count;
    struct modbus_map_step step[MODBUS_MAP_STEPS_MAX];
};

struct modbus_map_alarm {
    uint32_t code;
    char text[MODBUS_MAP_TEXT_MAX - 16];
};

/* Two items that no request may read together: there is a hole between them, or
 * they are of two tables of the drive. */
struct modbus_map_apart {
    uint8_t item[2];
};

struct modbus_map {
    char title[MODBUS_MAP_TITLE_MAX];
    bool is_unverified; /* not compared with the maker's words in whole */
    struct modbus_rtu_line line; /* as the drive leaves the factory; its gap is
                                    the least it takes */
    int64_t turnaround_ns; /* from the end of a request, silence included, to
                              its answer */
    int64_t timeout_ns;
    int64_t watchdog_ns;    /* it stops by itself when it hears nothing for so
                              long; 0: it does not */
    uint16_t registers_max; /* in one request */
    int64_t resolution;     /* counts per revolution of the motor */
    struct modbus_map_item item[MODBUS_MAP_ITEMS_MAX];
    uint8_t item_count;
    struct modbus_map_apart apart[MODBUS_MAP_APART_MAX];
    uint8_t apart_count;
    uint8_t position, alarm; /* items; alarm may be MODBUS_MAP_NO_ITEM */
    struct modbus_map_condition identify; /* item may be _NO_ITEM */
    char identify_else[MODBUS_MAP_TEXT_MAX];
    struct modbus_map_condition status[MODBUS_STATUS_COUNT];
    struct modbus_map_group move, stream;
    struct modbus_map_sequence sequence[MODBUS_SEQUENCE_COUNT];
    struct modbus_map_alarm alarms[MODBUS_MAP_ALARMS_MAX];
    uint8_t alarm_count;
};

static inline unsigned modbus_map_registers(enum modbus_map_type type)
{
    return type >= MODBUS_U32 && type <= MODBUS_F32 ? 2 : 1;
}

/* The least and the most a register of the type can say; F32: between them it
 * says every whole number. */
void modbus_map_range(enum modbus_map_type type, int64_t *min, int64_t *max);

/* One or two registers from and to a value (two's complement for I16, I32; F32
 * to the nearest whole number, ties away from zero, 0 when it is none). */
int64_t modbus_map_get(enum modbus_map_type type, enum modbus_map_order order,
                       const uint16_t *reg);
void modbus_map_set(enum modbus_map_type type, enum modbus_map_order order,
                    int64_t value, uint16_t *reg);

/* False for an F32 that is NaN, infinite, or beyond what an I32 can say:
 * nothing that a drive has counted. */
bool modbus_map_is_number(enum modbus_map_type type,
                          enum modbus_map_order order, const uint16_t *reg);

/* Does the raw value of its item meet it? */
bool modbus_map_meets(const struct modbus_map_condition *condition,
                      int64_t value);

/* The text of an alarm code, NULL: not in the table. */
const char *modbus_map_alarm_text(const struct modbus_map *map, uint32_t code);

/* A request that reads, or writes, one item. */
void modbus_map_put_read(const struct modbus_map_item *item,
                         struct hal_modbus_request *request);
void modbus_map_put_write(const struct modbus_map_item *item, int64_t value,
                          struct hal_modbus_request *request);

/* Items polled together, one request each block. */
#define MODBUS_MAP_BLOCKS_MAX 6
struct modbus_map_block {
    uint16_t at, count; /* bits with function 1 and 2 */
    uint8_t read;
};
/* Blocks of all items of one poll class, by function and address: neighbours up
 * to four registers, or 64 bits, apart are read in one request, unless they, or
 * what is read with them, must not be.  How many; the rest beyond the maximum is
 * left out (the loader refuses such a map). */
unsigned
modbus_map_blocks(const struct modbus_map *map, enum modbus_map_poll poll,
                  struct modbus_map_block block[MODBUS_MAP_BLOCKS_MAX]);

/* Does a request of this function read two items that must not be read
 * together? */
bool modbus_map_splits(const struct modbus_map *map,
                       const struct modbus_map_block *request);

/* How long one cycle of one drive keeps the line busy: when it is streamed the
 * group stream and what goes after it, and every fast block; turn-around
 * included.  `n` is how many transactions that is. */
int64_t modbus_map_cycle_ns(const struct modbus_map *map,
                            const struct modbus_rtu_time *time, bool streamed,
                            unsigned *n);
/* What it is longer by when the drive is monitored; n grows likewise. */
int64_t modbus_map_monitor_ns(const struct modbus_map *map,
                              const struct modbus_rtu_time *time, unsigned *n);

MOTION_C_END

#endif
