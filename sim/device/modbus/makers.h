/* sim/device/modbus/makers.h - Modbus servos as their makers describe them.
 *
 * One file per drive.  Registers, words and units stand beside the parameter of
 * the maker's manual that gives them, and none of it is read from hal/maps: a
 * map with a wrong address, scale or word order fails against these, as it would
 * on the drive.  A register that is not listed is an illegal address.
 *
 * What no source was found for is marked "unverified" beside it.  Not modelled:
 * storing to EEPROM, jogging by registers, torque modes, and search moves of a
 * homing: home is where the drive stands, but for an absolute encoder. */
#ifndef SIM_DEVICE_MODBUS_MAKERS_H
#define SIM_DEVICE_MODBUS_MAKERS_H

#include "sim/device/modbus/parts.h"

/* Functions 3, 6 and 16, which all of them have; 8 is a loop-back, of the line
 * and not modelled. */
#define SIM_MODBUS_PLAIN      (1u << 3 | 1u << 6 | 1u << 16)
#define SIM_MODBUS_WRITE_READ (1u << 23)

/* Registers that exist, from `at` on. */
struct sim_modbus_range {
    uint16_t at, count; /* count 0: the end of the list */
    bool read_only;
};

struct sim_modbus_maker {
    const char *name, *title;
    enum modbus_map_order order; /* of its 32-bit values */
    int64_t resolution;          /* counts per revolution, as shipped */
    uint32_t alarm;              /* when the cause does not matter */
    uint32_t functions;          /* bit n: function n */
    uint16_t registers_max;      /* in one request */
    uint8_t too_many, read_only; /* exceptions */
    const struct sim_modbus_range *range;
    /* Registers [at, at + count) were written: do what they say.  An exception
     * code: nothing was done, and they get their old values back. */
    uint8_t (*set)(struct sim_modbus_servo *self, uint16_t at, uint16_t count);
    void (*say)(struct sim_modbus_servo *self); /* before they are read */
    struct sim_modbus_behaviour behaviour;
};

/* NULL: there is none of that name. */
const struct sim_modbus_maker *sim_modbus_maker_find(const char *name);
/* All of them in turn, NULL at the end. */
const struct sim_modbus_maker *sim_modbus_maker_at(unsigned i);

extern const struct sim_modbus_maker sim_modbus_leadshine_el7;
extern const struct sim_modbus_maker sim_modbus_leadshine_cs2rs;
extern const struct sim_modbus_maker sim_modbus_oriental_az;
extern const struct sim_modbus_maker sim_modbus_delta_asda;
extern const struct sim_modbus_maker sim_modbus_lexium_32;

/* ---- for their files: makers.c, and the PR block of Leadshine ---- */

extern const struct modbus_slave_ops sim_modbus_maker_slave;

/* A 32-bit value in the maker's order, signed. */
int64_t sim_modbus_pair(const struct sim_modbus_servo *self, uint16_t at);
void sim_modbus_put_pair(struct sim_modbus_servo *self, uint16_t at,
                         int64_t value);
/* Is register `which` among [at, at + count)? */
bool sim_modbus_is_in(uint16_t which, uint16_t at, uint16_t count);
/* counts/s of r/min, counts/s2 of milliseconds per 1000 r/min. */
int64_t sim_modbus_rpm(const struct sim_modbus_servo *self, int64_t rpm);
int64_t sim_modbus_ms_per_1000_rpm(const struct sim_modbus_servo *self,
                                   int64_t ms);
/* The code that the alarm register shows; 0: none. */
uint32_t sim_modbus_alarm(const struct sim_modbus_servo *self);

/* leadshine_pr.c: registers 0x6000 .. 0x627F and 0x1801.  `interrupts`: bit 4
 * of a path's mode (INS) lets it take over from one that runs; else it is the
 * other way round. */
#define SIM_LEADSHINE_PR_RANGES                                                \
    { .at = 0x1801, .count = 1 },                                              \
        { .at = 0x1901, .count = 1, .read_only = 1 },                          \
        { .at = 0x6000, .count = 0x15 },                                       \
        { .at = 0x602A, .count = 6, .read_only = 1 },                          \
    {                                                                          \
        .at = 0x6200, .count = 0x80                                            \
    }
void sim_leadshine_pr_set(struct sim_modbus_servo *self, uint16_t at,
                          uint16_t count, bool interrupts);
void sim_leadshine_pr_say(struct sim_modbus_servo *self);

#endif
