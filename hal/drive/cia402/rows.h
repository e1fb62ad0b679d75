/* hal/drive/cia402/rows.h - private to drive_cia402*.c: how the rows of a list
 * of SDO steps are written. */
#ifndef HAL_DRIVE_CIA402_ROWS_H
#define HAL_DRIVE_CIA402_ROWS_H

#include "hal/drive/cia402/parts.h"

/* clang-format off */
#define READ(need, index, sub, check) \
    { STEP_READ, need, index, sub, 0, 0, VALUE_FIXED, check }
#define WRITE(need, index, sub, size, value) \
    { STEP_WRITE, need, index, sub, size, value, VALUE_FIXED, CHECK_NOTHING }
#define WRITE_OF(need, index, sub, size, value_of) \
    { STEP_WRITE, need, index, sub, size, 0, value_of, CHECK_NOTHING }
#define COMPARE(need, index, sub, size, value) \
    { STEP_COMPARE, need, index, sub, size, value, VALUE_FIXED, CHECK_NOTHING }
#define COMPARE_OF(need, index, sub, size, value_of) \
    { STEP_COMPARE, need, index, sub, size, 0, value_of, CHECK_NOTHING }
/* Written and read back: some drives take a value and keep another. */
#define SET(need, index, sub, size, value) \
    WRITE(need, index, sub, size, value), \
    COMPARE(need, index, sub, size, value)
#define SET_OF(need, index, sub, size, value_of) \
    WRITE_OF(need, index, sub, size, value_of), \
    COMPARE_OF(need, index, sub, size, value_of)
/* Of a map. */
#define WRITE_ENTRY(need, index, sub, value) \
    { STEP_WRITE, need, index, sub, 4, value, VALUE_ENTRY, CHECK_NOTHING }
#define COMPARE_ENTRY(need, index, sub, value) \
    { STEP_COMPARE, need, index, sub, 4, value, VALUE_ENTRY, CHECK_NOTHING }
#define MATCH_ENTRY(need, index, sub, value) \
    { STEP_MATCH, need, index, sub, 4, value, VALUE_ENTRY, CHECK_NOTHING }
#define MATCH(need, index, sub, size, value) \
    { STEP_MATCH, need, index, sub, size, value, VALUE_FIXED, CHECK_NOTHING }
#define MATCH_OF(need, index, sub, size, value_of) \
    { STEP_MATCH, need, index, sub, size, 0, value_of, CHECK_NOTHING }
#define COB(kind, need, index, value) \
    { kind, need, index, 1, 4, value, VALUE_COB, CHECK_NOTHING }
/* Off, with the identifier and bit 30 as they are: neither may change while the
 * PDO exists, and some drives do not let bit 30 change at all. */
#define COB_OFF(need, write, index) \
    READ(need, index, 1, CHECK_COB), \
    WRITE_OF((write) | STEP_IF_VALID, index, 1, 4, VALUE_COB_OFF)
/* Nobody else's frame moves the axis. */
#define RPDO_OFF(index) \
    COB_OFF(STEP_IF_THERE, STEP_NEEDED, index), \
    COMPARE_OF(STEP_IF_VALID, index, 1, 4, VALUE_COB_OFF)
#define NMT(command) \
    { STEP_NMT, STEP_NEEDED, 0, 0, 0, command, VALUE_FIXED, CHECK_NOTHING }
#define UNTIL(check) UNTIL_IN(STEP_NEEDED, check)
#define UNTIL_IN(need, check) \
    { STEP_UNTIL, need, 0, 0, 0, 0, VALUE_FIXED, check }
#define OPTION(index) \
    SET_OF(STEP_IF_OPTION, index, 0, 2, VALUE_OPTION)
/* One that slew relies on. */
#define BRAKES(index, value) \
    READ(STEP_IF_THERE, index, 0, CHECK_OPTION), \
    WRITE(STEP_IF_UNSAFE | STEP_OR_LEAVE, index, 0, 2, value)
#define PARAMETERS \
    { STEP_PARAMETERS, STEP_NEEDED, 0, 0, 0, 0, VALUE_FIXED, CHECK_NOTHING }
#define LIMITS \
    READ(STEP_IF_LIMITS, 0x6064, 0, CHECK_ACTUAL), \
    WRITE_OF(STEP_IF_LIMITS | STEP_IF_THERE, 0x607D, 1, 4, VALUE_LIMIT), \
    WRITE_OF(STEP_IF_LIMITS | STEP_IF_THERE, 0x607D, 2, 4, VALUE_LIMIT), \
    READ(STEP_IF_LIMITS | STEP_IF_THERE, 0x607D, 1, CHECK_LIMIT), \
    READ(STEP_IF_LIMITS | STEP_IF_THERE, 0x607D, 2, CHECK_LIMIT)
/* The same once it has them, where they are to be others. */
#define LIMITS_AGAIN \
    WRITE_OF(STEP_IF_OTHER, 0x607D, 1, 4, VALUE_LIMIT), \
    WRITE_OF(STEP_IF_OTHER, 0x607D, 2, 4, VALUE_LIMIT), \
    READ(STEP_IF_OTHER, 0x607D, 1, CHECK_LIMIT), \
    READ(STEP_IF_OTHER, 0x607D, 2, CHECK_LIMIT)
/* The target is where the axis is, the speed 0. */
#define PRELOAD \
    READ(STEP_NEEDED, 0x6064, 0, CHECK_ACTUAL), \
    WRITE_OF(STEP_UNLESS_IP, 0x607A, 0, 4, VALUE_PRELOAD), \
    READ(STEP_UNLESS_IP, 0x607A, 0, CHECK_PRELOAD), \
    WRITE_OF(STEP_IF_IP, 0x60C1, 1, 4, VALUE_PRELOAD), \
    READ(STEP_IF_IP, 0x60C1, 1, CHECK_PRELOAD), \
    WRITE(STEP_IF_SPEED, 0x60FF, 0, 4, 0)
#define END \
    { STEP_END, STEP_NEEDED, 0, 0, 0, 0, VALUE_FIXED, CHECK_NOTHING }
/* clang-format on */

#endif
