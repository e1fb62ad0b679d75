/* hal/readings.h - what a drive measures of itself beside its motion.
 *
 * A driver that offers some is told which to read (`wanted`), reads each every
 * HAL_READING_NS, and stamps a value with the time of the answer that carried it.
 * A value that no such drive can have (not a number, 1000 degC) is no answer.
 * Whether it is within its limits is judged by hal/support/monitor.h, from
 * outside of the driver.
 *
 * A value that stays the same is not taken for a frozen one: a bus voltage in
 * steps of 0.5 V and a temperature in whole degrees stand for minutes on a sound
 * drive.  What shows that a value is old is the age of its answer. */
#ifndef HAL_READINGS_H
#define HAL_READINGS_H

#include <stdbool.h>
#include <stdint.h>

/* Three fit into 100 ms: what is missing for three periods is known by then, and
 * so is what two answers in a row say. */
#define HAL_READING_NS INT64_C(30000000)

enum hal_reading {
    HAL_READING_TEMPERATURE, /* of the power stage, or as its kind says; degC */
    HAL_READING_VOLTAGE,     /* of the supply: the DC link; V */
    HAL_READING_CURRENT,     /* of the motor, what makes torque; A, signed */
    HAL_READINGS,            /* how many */
};
/* "temperature", "degC". */
const char *hal_reading_text(enum hal_reading reading);
const char *hal_reading_unit(enum hal_reading reading);

struct hal_reading_value {
    int32_t milli; /* thousandths of its unit */
    int64_t t_ns;  /* when it was heard; 0: never */
};

/* All zero: nothing is wanted. */
struct hal_readings {
    unsigned wanted;    /* 1 << enum hal_reading */
    int64_t from_ns;    /* its driver asks since then: what is older is not
                        missing */
    int64_t missing_ns; /* without an answer for so long it is; 0: three
                           periods */
    struct hal_reading_value value[HAL_READINGS];
    /* private to hal_readings_next */
    int64_t due_ns;
    unsigned at;
};

static inline bool hal_readings_want(const struct hal_readings *readings,
                                     enum hal_reading reading)
{
    return (readings->wanted >> (unsigned)reading & 1) != 0;
}

/* value / 2^16 of its unit.  False: no drive has that; it is left out. */
bool hal_readings_put_q16(struct hal_readings *readings,
                          enum hal_reading reading, int64_t value_q16,
                          int64_t t_ns);
/* Thousandths of its unit.  False as above. */
bool hal_readings_put(struct hal_readings *readings, enum hal_reading reading,
                      int64_t milli, int64_t t_ns);

/* For a driver that asks for each by a question of its own: the next one that
 * is to be asked for by now; HAL_READINGS: no more.  They take turns, so that
 * their questions spread over HAL_READING_NS. */
enum hal_reading hal_readings_next(struct hal_readings *readings,
                                   int64_t now_ns);

#endif
