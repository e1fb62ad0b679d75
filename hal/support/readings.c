/* hal/support/readings.c - see hal/readings.h. */
#include "hal/readings.h"

static const struct {
    const char *text, *unit;
    int32_t low_milli, high_milli; /* what a drive may have at all */
} readings_table[HAL_READINGS] = {
    [HAL_READING_TEMPERATURE] = { "temperature", "degC", -100000, 400000 },
    [HAL_READING_VOLTAGE] = { "bus voltage", "V", -1000, 2000000 },
    [HAL_READING_CURRENT] = { "current", "A", -2000000, 2000000 },
};

const char *hal_reading_text(enum hal_reading reading)
{
    return readings_table[reading].text;
}

const char *hal_reading_unit(enum hal_reading reading)
{
    return readings_table[reading].unit;
}

bool hal_readings_put(struct hal_readings *readings, enum hal_reading reading,
                      int64_t milli, int64_t t_ns)
{
    if (milli < readings_table[reading].low_milli ||
        milli > readings_table[reading].high_milli)
        return false;
    readings->value[reading] =
        (struct hal_reading_value){ (int32_t)milli, t_ns };
    return true;
}

bool hal_readings_put_q16(struct hal_readings *readings,
                          enum hal_reading reading, int64_t value_q16,
                          int64_t t_ns)
{
    const int64_t most_q16 = INT64_C(1) << 40;

    return value_q16 <= most_q16 && value_q16 >= -most_q16 &&
           hal_readings_put(readings, reading,
                            (value_q16 * 1000 + (1 << 15)) >> 16, t_ns);
}

/* Whoever is late by more than a round goes on from now. */
enum hal_reading hal_readings_next(struct hal_readings *readings,
                                   int64_t now_ns)
{
    if (readings->wanted == 0)
        return HAL_READINGS;
    if (now_ns - readings->due_ns > HAL_READING_NS)
        readings->due_ns = now_ns;
    while (readings->due_ns <= now_ns) {
        const enum hal_reading reading = (enum hal_reading)readings->at;

        readings->due_ns += HAL_READING_NS / HAL_READINGS;
        readings->at = readings->at + 1 < HAL_READINGS ? readings->at + 1 : 0;
        if (hal_readings_want(readings, reading))
            return reading;
    }
    return HAL_READINGS;
}
