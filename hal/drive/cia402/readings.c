/* hal/drive/cia402/readings.c - temperature, DC link voltage, current.
 *
 *   temperature   the object of the config, which is the maker's own
 *   voltage       0x6079, mV
 *   current       0x6078, thousandths of 0x6075 (mA), which is read once
 *
 * One SDO at a time, each every HAL_READING_NS, and only while no list needs the
 * channel: while one runs nothing is asked, and nothing is missing.  One that is
 * refused or does not come in time is asked for again in its turn: it grows old.
 * Source: CiA 402-2 6.5, 0x6075, 0x6078, 0x6079. */
#include "hal/drive/cia402/parts.h"

static uint16_t readings_index(const struct drive_cia402 *self,
                               enum hal_reading reading)
{
    if (reading == HAL_READING_TEMPERATURE)
        return self->config.temperature.index;
    if (reading == HAL_READING_VOLTAGE)
        return drive_cia402_object(self, 0x6079);
    return drive_cia402_object(self, self->rated_ma == 0 ? 0x6075 : 0x6078);
}

/* As it is signed in its own size. */
static int64_t readings_signed(uint32_t value, uint8_t size)
{
    if (size == 1)
        return (int8_t)(uint8_t)value;
    return size == 2 ? (int16_t)(uint16_t)value : (int32_t)value;
}

/* 1/1000 = 4294968 / 2^32, to 2e-7. */
static int64_t readings_current_milli(const struct drive_cia402 *self,
                                      uint32_t value)
{
    const int64_t permille = (int16_t)(uint16_t)value;

    return (permille * self->rated_ma * 4294968) >> 32;
}

static void readings_answer(struct drive_cia402 *self, uint32_t value,
                            uint8_t size, int64_t now_ns)
{
    const enum hal_reading reading = self->reading;
    int64_t milli = value;

    if (reading == HAL_READING_CURRENT && self->rated_ma == 0) {
        self->rated_ma = value <= INT16_MAX * 1000 ? (int32_t)value : 0;
        return;
    }
    if (reading == HAL_READING_TEMPERATURE)
        milli = readings_signed(value, size) * self->config.temperature.milli;
    else if (reading == HAL_READING_CURRENT)
        milli = readings_current_milli(self, value);
    (void)hal_readings_put(&self->readings, reading, milli, now_ns);
}

/* True: the channel is ours, and its answer is not there yet. */
static bool readings_wait(struct drive_cia402 *self, int64_t now_ns)
{
    uint32_t value = 0;
    uint8_t size = 0;
    int err;

    if (!self->reading_asked)
        return false;
    err = canopen_sdo_take(&self->node, &value, &size);
    if (err == MOTION_E_AGAIN)
        return true;
    if (err == MOTION_OK)
        readings_answer(self, value, size, now_ns);
    self->reading_asked = false;
    self->reading = HAL_READINGS;
    return false;
}

bool drive_cia402_readings_step(struct drive_cia402 *self, int64_t now_ns)
{
    if (readings_wait(self, now_ns))
        return true;
    if (self->reading == HAL_READINGS)
        self->reading = hal_readings_next(&self->readings, now_ns);
    if (self->reading == HAL_READINGS)
        return false;
    self->reading_asked =
        canopen_sdo_read(&self->node, now_ns,
                         readings_index(self, self->reading),
                         self->reading == HAL_READING_TEMPERATURE
                             ? self->config.temperature.sub
                             : 0) == MOTION_OK;
    return self->reading_asked;
}

void drive_cia402_readings_pause(struct drive_cia402 *self, int64_t now_ns)
{
    self->readings.from_ns = now_ns;
    self->reading_asked = false;
}
