/* sim/device/modbus/makers.c - see makers.h. */
#include "sim/device/modbus/makers.h"

#include <string.h>

#include "sim/util.h"

#define ILLEGAL_FUNCTION 0x01
#define ILLEGAL_ADDRESS  0x02

static const struct sim_modbus_maker *const makers[] = {
    &sim_modbus_leadshine_el7, &sim_modbus_leadshine_cs2rs,
    &sim_modbus_oriental_az,   &sim_modbus_delta_asda,
    &sim_modbus_lexium_32,
};
#define MAKERS (sizeof makers / sizeof makers[0])

const struct sim_modbus_maker *sim_modbus_maker_at(unsigned i)
{
    return i < MAKERS ? makers[i] : NULL;
}

const struct sim_modbus_maker *sim_modbus_maker_find(const char *name)
{
    for (unsigned i = 0; i < MAKERS; i++)
        if (strcmp(makers[i]->name, name) == 0)
            return makers[i];
    return NULL;
}

const struct sim_modbus_behaviour *
sim_modbus_maker_behaviour(const struct sim_modbus_maker *maker)
{
    return &maker->behaviour;
}

uint32_t sim_modbus_maker_functions(const struct sim_modbus_maker *maker)
{
    return maker->functions;
}

/* ---- values ---- */

int64_t sim_modbus_pair(const struct sim_modbus_servo *self, uint16_t at)
{
    return modbus_map_get(MODBUS_I32, self->config.maker->order,
                          &self->reg[at]);
}

void sim_modbus_put_pair(struct sim_modbus_servo *self, uint16_t at,
                         int64_t value)
{
    modbus_map_set(MODBUS_I32, self->config.maker->order, value,
                   &self->reg[at]);
}

bool sim_modbus_is_in(uint16_t which, uint16_t at, uint16_t count)
{
    return which >= at && which - at < count;
}

int64_t sim_modbus_rpm(const struct sim_modbus_servo *self, int64_t rpm)
{
    return rpm * self->config.maker->resolution / 60;
}

int64_t sim_modbus_ms_per_1000_rpm(const struct sim_modbus_servo *self,
                                   int64_t ms)
{
    return sim_modbus_rpm(self, 1000) * 1000 / (ms > 0 ? ms : 1);
}

uint32_t sim_modbus_alarm(const struct sim_modbus_servo *self)
{
    if (!self->fault)
        return 0;
    return self->alarm != 0 ? self->alarm : self->config.maker->alarm;
}

/* ---- the slave ---- */

/* 0, or the exception for a request for these registers. */
static uint8_t maker_refuses(const struct sim_modbus_servo *self,
                             enum modbus_space space, uint16_t at,
                             uint16_t count, bool writes)
{
    const struct sim_modbus_maker *maker = self->config.maker;
    const struct sim_modbus_range *range = maker->range;

    if (space != MODBUS_HOLDING)
        return ILLEGAL_FUNCTION;
    if (count > maker->registers_max)
        return maker->too_many;
    for (; range->count > 0; range++)
        if (at >= range->at && at - range->at + count <= range->count)
            return writes && range->read_only ? maker->read_only : 0;
    return ILLEGAL_ADDRESS;
}

static uint8_t maker_get(struct modbus_slave *slave, enum modbus_space space,
                         uint16_t address, uint16_t count, uint16_t *value)
{
    struct sim_modbus_servo *self =
        CONTAINER_OF(slave, struct sim_modbus_servo, slave);
    const uint8_t exception = maker_refuses(self, space, address, count, false);

    if (exception != 0)
        return exception;
    self->heard_ns = self->world->now_ns;
    self->config.maker->say(self);
    memcpy(value, &self->reg[address], count * sizeof *value);
    return 0;
}

static uint8_t maker_set(struct modbus_slave *slave, enum modbus_space space,
                         uint16_t address, uint16_t count,
                         const uint16_t *value)
{
    struct sim_modbus_servo *self =
        CONTAINER_OF(slave, struct sim_modbus_servo, slave);
    uint16_t before[HAL_MODBUS_WRITE_MAX];
    uint8_t exception = maker_refuses(self, space, address, count, true);

    if (exception != 0)
        return exception;
    self->heard_ns = self->world->now_ns;
    memcpy(before, &self->reg[address], count * sizeof *value);
    memcpy(&self->reg[address], value, count * sizeof *value);
    exception = self->config.maker->set(self, address, count);
    if (exception != 0)
        memcpy(&self->reg[address], before, count * sizeof *value);
    return exception;
}

const struct modbus_slave_ops sim_modbus_maker_slave = {
    .get = maker_get,
    .set = maker_set,
};
