/* sim/device/modbus/mapped.c - a servo made from the map file of its driver,
 * the other way round: what the driver is told to write it does, once all of it
 * was written, in that order; it makes up the status bits that the driver is
 * told to look at.  A register that the map does not name is an illegal address.
 *
 * It stands in for a drive whose manual nobody has written down in makers.h.  A
 * mistake in the map is a mistake in this drive as well, so it shows none. */
#include "sim/device/modbus/parts.h"

#include <math.h>
#include <string.h>

#include "hal/readings.h"
#include "motion/core/fixed.h"
#include "sim/util.h"

#define ILLEGAL_ADDRESS 0x02
#define ILLEGAL_VALUE   0x03
#define DEVICE_FAILURE  0x04

#define REST_DEGC 30.0
#define SUPPLY_V  24.0
#define MOST_A    5.0 /* at its current limit */

static struct sim_modbus_servo *servo_of(struct modbus_slave *slave)
{
    return CONTAINER_OF(slave, struct sim_modbus_servo, slave);
}

/* ---- registers ---- */

static void servo_know(struct sim_modbus_servo *self, uint32_t at,
                       uint32_t count)
{
    for (; count > 0 && at < 65536; at++, count--)
        self->known[at / 8] = (uint8_t)(self->known[at / 8] | 1u << at % 8);
}

static bool servo_knows(const struct sim_modbus_servo *self, uint32_t at,
                        uint32_t count)
{
    for (; count > 0; at++, count--)
        if ((self->known[at / 8] >> at % 8 & 1) == 0)
            return false;
    return true;
}

static int64_t servo_get(const struct sim_modbus_servo *self, unsigned index)
{
    const struct modbus_map_item *item = &self->config.map->item[index];

    return modbus_map_get(item->type, item->order,
                          item->type == MODBUS_BIT ? &self->bit[item->at]
                                                   : &self->reg[item->at]);
}

static void servo_put(struct sim_modbus_servo *self, unsigned index,
                      int64_t value)
{
    const struct modbus_map_item *item = &self->config.map->item[index];

    modbus_map_set(item->type, item->order, value,
                   item->type == MODBUS_BIT ? &self->bit[item->at]
                                            : &self->reg[item->at]);
}

/* ---- what it says ---- */

static void servo_say(struct sim_modbus_servo *self,
                      enum modbus_map_status status, bool is)
{
    const struct modbus_map_condition *condition =
        &self->config.map->status[status];
    const uint32_t bits = is ? condition->equals : ~condition->equals;
    uint32_t value;

    if (condition->item == MODBUS_MAP_NO_ITEM)
        return;
    value = (uint32_t)servo_get(self, condition->item);
    servo_put(self, condition->item,
              (value & ~condition->mask) | (bits & condition->mask));
}

/* In the unit of the reading. */
static double servo_reading(const struct sim_modbus_servo *self,
                            unsigned reading)
{
    if (reading == HAL_READING_TEMPERATURE)
        return REST_DEGC +
               sim_readings_warmth_degc(&self->readings, &self->plant);
    if (reading == HAL_READING_VOLTAGE)
        return SUPPLY_V + self->readings.more_v;
    return MOST_A * (double)self->plant.acc_q8 / 256 /
           (double)self->plant.config.acc_max_counts_s2;
}

static void servo_say_readings(struct sim_modbus_servo *self)
{
    const struct modbus_map *map = self->config.map;

    for (unsigned i = 0; i < map->item_count; i++)
        if (map->item[i].reading > 0)
            servo_put(self, i,
                      llround(servo_reading(self, map->item[i].reading - 1u) *
                              1000 / map->item[i].milli));
}

static void servo_say_all(struct sim_modbus_servo *self)
{
    const struct modbus_map *map = self->config.map;
    const uint32_t code = self->alarm != 0       ? self->alarm
                          : map->alarm_count > 0 ? map->alarms[0].code
                                                 : 1;

    servo_say(self, MODBUS_STATUS_ready, !self->fault);
    servo_say(self, MODBUS_STATUS_enabled, self->enabled);
    servo_say(self, MODBUS_STATUS_torque, self->enabled);
    servo_say(self, MODBUS_STATUS_moving, sim_modbus_servo_moves(self));
    servo_say(self, MODBUS_STATUS_in_position, sim_modbus_servo_arrived(self));
    servo_say(self, MODBUS_STATUS_homed, self->homed);
    servo_say(self, MODBUS_STATUS_fault, self->fault);
    servo_say(self, MODBUS_STATUS_limit_negative, false);
    servo_say(self, MODBUS_STATUS_limit_positive, false);
    servo_put(self, map->position, sim_modbus_servo_reported(self));
    servo_say_readings(self);
    if (map->alarm != MODBUS_MAP_NO_ITEM)
        servo_put(self, map->alarm, self->fault ? code : 0);
}

/* ---- what it does ---- */

static void servo_go(struct sim_modbus_servo *self)
{
    if (!self->enabled || !self->armed)
        return;
    self->target_q16 = self->armed_q16;
    self->targets++;
}

static bool servo_has(const struct modbus_map_group *group,
                      enum modbus_map_quantity quantity)
{
    for (unsigned i = 0; i < group->count; i++)
        if (group->field[i].quantity == quantity)
            return true;
    return false;
}

/* Point to point with what the group does not say as somebody has set it up who
 * knows the motor: it can follow. */
static void servo_move(struct sim_modbus_servo *self)
{
    const struct modbus_map_group *group = &self->config.map->move;
    const struct sim_plant_config *motor = &self->config.plant;

    if (!servo_has(group, MODBUS_VELOCITY))
        self->speed_q16 = motor->vel_max_counts_s * 65536 / 3 * 2;
    if (!servo_has(group, MODBUS_ACCELERATION))
        self->acc = motor->acc_max_counts_s2 / 2 + 1;
    if (!servo_has(group, MODBUS_DECELERATION))
        self->dec = motor->acc_max_counts_s2 / 2 + 1;
    servo_go(self);
}

static void servo_reset(struct sim_modbus_servo *self)
{
    self->fault = false;
}

static void servo_begin(struct sim_modbus_servo *self)
{
    self->streaming = self->armed;
    servo_go(self);
}

static void servo_nothing(struct sim_modbus_servo *self)
{
    (void)self;
}

static void (*const servo_do[MODBUS_SEQUENCE_COUNT])(
    struct sim_modbus_servo *self) = {
    [MODBUS_SEQUENCE_init] = servo_nothing,
    [MODBUS_SEQUENCE_enable] = sim_modbus_servo_enable,
    [MODBUS_SEQUENCE_disable] = sim_modbus_servo_torque_off,
    [MODBUS_SEQUENCE_stop] = sim_modbus_servo_stop,
    [MODBUS_SEQUENCE_halt] = sim_modbus_servo_stop,
    [MODBUS_SEQUENCE_home] = sim_modbus_servo_home,
    [MODBUS_SEQUENCE_reset] = servo_reset,
    [MODBUS_SEQUENCE_move_go] = servo_move,
    [MODBUS_SEQUENCE_stream_begin] = servo_begin,
    [MODBUS_SEQUENCE_stream_go] = servo_go,
};

/* ---- sequences, seen from the other side ---- */

/* The n-th write of a sequence, NULL: it has fewer.  What comes after the wait
 * for its home is not needed to find it. */
static const struct modbus_map_step *
servo_write_of(const struct modbus_map_sequence *sequence, unsigned n)
{
    for (unsigned i = 0; i < sequence->count; i++) {
        const struct modbus_map_step *step = &sequence->step[i];

        if (step->kind == MODBUS_STEP_UNTIL &&
            step->status == MODBUS_STATUS_homed)
            return NULL;
        if (step->kind == MODBUS_STEP_WRITE && n-- == 0)
            return step;
    }
    return NULL;
}

static bool servo_is_step(const struct sim_modbus_servo *self,
                          const struct modbus_map_step *step, uint16_t at,
                          bool coil)
{
    const struct modbus_map_item *item =
        step == NULL ? NULL : &self->config.map->item[step->item];

    return item != NULL && item->at == at &&
           coil == (item->type == MODBUS_BIT || item->write == 5);
}

/* Where the sequence is now that the item at `at` has its value. */
static void servo_follow(struct sim_modbus_servo *self, unsigned name,
                         uint16_t at, bool coil)
{
    const struct modbus_map_sequence *sequence =
        &self->config.map->sequence[name];
    const struct modbus_map_step *step =
        servo_write_of(sequence, self->progress[name]);

    if (!servo_is_step(self, step, at, coil))
        return;
    if (servo_get(self, step->item) != step->value) {
        self->progress[name] = 0;
        step = servo_write_of(sequence, 0);
        if (!servo_is_step(self, step, at, coil) ||
            servo_get(self, step->item) != step->value)
            return;
    }
    if (servo_write_of(sequence, ++self->progress[name]) != NULL)
        return;
    self->progress[name] = 0;
    servo_do[name](self);
}

/* ---- groups ---- */

static int64_t servo_fraction(int64_t value, int64_t num, int64_t den)
{
    int64_t result = INT32_MAX;

    (void)motion_fixed_muldiv(value, num, den, &result);
    return result;
}

/* The register's value in counts, counts/s or counts/s2. */
static int64_t servo_physical(const struct modbus_map *map,
                              const struct modbus_map_field *field,
                              int64_t value)
{
    const int64_t per_minute = map->resolution;

    if (field->unit == MODBUS_MS_PER_1000_RPM) {
        value = servo_fraction(value < 1 ? 1 : value, field->den, field->num);
        return servo_fraction(INT64_C(1000000), per_minute, 60 * value);
    }
    value = servo_fraction(value, field->den, field->num);
    return field->unit == MODBUS_RPM ? servo_fraction(value, per_minute, 60)
                                     : value;
}

static void servo_take_field(struct sim_modbus_servo *self,
                             const struct modbus_map_field *field,
                             int64_t value)
{
    value = servo_physical(self->config.map, field, value);
    if (field->quantity == MODBUS_POSITION)
        self->armed_q16 = value * 65536;
    else if (field->quantity == MODBUS_VELOCITY)
        self->speed_q16 = value * 65536;
    else if (field->quantity == MODBUS_ACCELERATION)
        self->acc = value > 0 ? value : 1;
    else if (field->quantity == MODBUS_DECELERATION)
        self->dec = value > 0 ? value : 1;
}

/* All of it, with its constants: false when it is not this group. */
static bool servo_is_group(const struct sim_modbus_servo *self,
                           const struct modbus_map_group *group, uint16_t at,
                           uint16_t count)
{
    unsigned offset = group->at;

    if (group->count == 0 || at != group->at || count != group->registers)
        return false;
    for (unsigned i = 0; i < group->count; i++) {
        const struct modbus_map_field *field = &group->field[i];

        if (field->quantity == MODBUS_CONST &&
            modbus_map_get(field->type, field->order, &self->reg[offset]) !=
                field->constant)
            return false;
        offset += modbus_map_registers(field->type);
    }
    return true;
}

static void servo_take_group(struct sim_modbus_servo *self,
                             const struct modbus_map_group *group)
{
    unsigned at = group->at;

    for (unsigned i = 0; i < group->count; i++) {
        const struct modbus_map_field *field = &group->field[i];

        if (field->quantity != MODBUS_CONST)
            servo_take_field(
                self, field,
                modbus_map_get(field->type, field->order, &self->reg[at]));
        at += modbus_map_registers(field->type);
    }
    self->armed = true;
}

static void servo_groups(struct sim_modbus_servo *self, uint16_t at,
                         uint16_t count)
{
    const struct modbus_map *map = self->config.map;
    const struct modbus_map_sequence *sequence = map->sequence;

    if (servo_is_group(self, &map->stream, at, count)) {
        servo_take_group(self, &map->stream);
        if (sequence[MODBUS_SEQUENCE_stream_go].count == 0 &&
            (sequence[MODBUS_SEQUENCE_stream_begin].count == 0 ||
             self->streaming))
            servo_go(self);
    } else if (servo_is_group(self, &map->move, at, count)) {
        servo_take_group(self, &map->move);
        if (sequence[MODBUS_SEQUENCE_move_go].count == 0)
            servo_go(self);
    }
}

/* ---- the slave ---- */

/* It has none to say just now. */
static bool servo_misses(const struct sim_modbus_servo *self, uint32_t at,
                         uint32_t count)
{
    const struct modbus_map *map = self->config.map;

    for (unsigned i = 0; i < map->item_count && self->readings.missing; i++)
        if (map->item[i].reading > 0 && map->item[i].at >= at &&
            map->item[i].at < at + count)
            return true;
    return false;
}

/* Tell whether a read takes items together that the drive does not read together. */
static bool servo_splits(const struct sim_modbus_servo *self,
                         enum modbus_space space, uint16_t at, uint16_t count)
{
    static const uint8_t read[] = {
        [MODBUS_HOLDING] = HAL_MODBUS_READ,
        [MODBUS_INPUT] = HAL_MODBUS_READ_INPUT,
        [MODBUS_COILS] = HAL_MODBUS_READ_COILS,
        [MODBUS_DISCRETE] = HAL_MODBUS_READ_DISCRETE,
    };
    const struct modbus_map_block request = { at, count, read[space] };

    return modbus_map_splits(self->config.map, &request);
}

static uint8_t servo_on_get(struct modbus_slave *slave, enum modbus_space space,
                            uint16_t address, uint16_t count, uint16_t *value)
{
    struct sim_modbus_servo *self = servo_of(slave);

    const bool bits = space == MODBUS_COILS || space == MODBUS_DISCRETE;

    if (!servo_knows(self, address, count) ||
        servo_splits(self, space, address, count))
        return ILLEGAL_ADDRESS;
    if (!bits && servo_misses(self, address, count))
        return DEVICE_FAILURE;
    servo_say_all(self);
    if (bits)
        memset(value, 0, (count + 15u) / 16 * sizeof *value);
    else
        memcpy(value, &self->reg[address], count * sizeof *value);
    for (unsigned i = 0; bits && i < count; i++)
        value[i / 16] =
            (uint16_t)(value[i / 16] | (self->bit[address + i] & 1u) << i % 16);
    self->heard_ns = self->world->now_ns;
    return 0;
}

/* An item of one register that is written as a coil is. */
static bool servo_is_word(const struct sim_modbus_servo *self, uint32_t at)
{
    const struct modbus_map *map = self->config.map;

    for (unsigned i = 0; i < map->item_count; i++)
        if (map->item[i].at == at && map->item[i].write == 5 &&
            map->item[i].type != MODBUS_BIT)
            return true;
    return false;
}

static bool servo_is_group_number(const struct sim_modbus_servo *self,
                                  const struct modbus_map_group *group,
                                  uint16_t at, uint16_t count)
{
    unsigned offset = at;

    if (!servo_is_group(self, group, at, count))
        return true;
    for (unsigned i = 0; i < group->count; i++) {
        const struct modbus_map_field *field = &group->field[i];

        if (!modbus_map_is_number(field->type, field->order,
                                  &self->reg[offset]))
            return false;
        offset += modbus_map_registers(field->type);
    }
    return true;
}

/* No NaN and no infinity has been written into the registers. */
static bool servo_is_number(const struct sim_modbus_servo *self, uint16_t at,
                            uint16_t count)
{
    const struct modbus_map *map = self->config.map;

    for (unsigned i = 0; i < map->item_count; i++) {
        const struct modbus_map_item *item = &map->item[i];

        if (item->at >= at && item->at < at + count &&
            !modbus_map_is_number(item->type, item->order,
                                  &self->reg[item->at]))
            return false;
    }
    return servo_is_group_number(self, &map->stream, at, count) &&
           servo_is_group_number(self, &map->move, at, count);
}

static uint8_t servo_on_set(struct modbus_slave *slave, enum modbus_space space,
                            uint16_t address, uint16_t count,
                            const uint16_t *value)
{
    struct sim_modbus_servo *self = servo_of(slave);
    const uint32_t end = (uint32_t)address + count;

    const bool coil = space == MODBUS_COILS;

    if (!servo_knows(self, address, count))
        return ILLEGAL_ADDRESS;
    if (!coil) {
        uint16_t before[HAL_MODBUS_WRITE_MAX];

        memcpy(before, &self->reg[address], count * sizeof *value);
        memcpy(&self->reg[address], value, count * sizeof *value);
        if (!servo_is_number(self, address, count)) {
            memcpy(&self->reg[address], before, count * sizeof *value);
            return ILLEGAL_VALUE;
        }
    }
    for (unsigned i = 0; coil && i < count; i++) {
        self->bit[address + i] = value[i / 16] >> i % 16 & 1;
        if (servo_is_word(self, address + i)) /* a register that 05 writes */
            self->reg[address + i] = self->bit[address + i];
    }
    self->heard_ns = self->world->now_ns;
    if (!coil)
        servo_groups(self, address, count);
    for (uint32_t at = address; at < end; at++)
        for (unsigned name = 0; name < MODBUS_SEQUENCE_COUNT; name++)
            servo_follow(self, name, (uint16_t)at, coil);
    return 0;
}

static const struct modbus_slave_ops servo_slave_ops = {
    .get = servo_on_get,
    .set = servo_on_set,
};

/* ---- set-up ---- */

/* It is set up as init requires. */
static void servo_know_checks(struct sim_modbus_servo *self)
{
    const struct modbus_map_sequence *init =
        &self->config.map->sequence[MODBUS_SEQUENCE_init];

    for (unsigned i = 0; i < init->count; i++)
        if (init->step[i].kind == MODBUS_STEP_CHECK)
            servo_put(self, init->step[i].item, init->step[i].value);
}

static void servo_know_map(struct sim_modbus_servo *self)
{
    const struct modbus_map *map = self->config.map;
    struct modbus_map_block block[MODBUS_MAP_BLOCKS_MAX];

    for (unsigned i = 0; i < map->item_count; i++)
        servo_know(self, map->item[i].at,
                   modbus_map_registers(map->item[i].type));
    for (unsigned poll = MODBUS_POLL_FAST; poll <= MODBUS_POLL_SLOW; poll++) {
        const unsigned count =
            modbus_map_blocks(map, (enum modbus_map_poll)poll, block);

        for (unsigned i = 0; i < count; i++)
            servo_know(self, block[i].at, block[i].count);
    }
    servo_know(self, map->move.at, map->move.registers);
    servo_know(self, map->stream.at, map->stream.registers);
    if (map->identify.item != MODBUS_MAP_NO_ITEM)
        servo_put(self, map->identify.item, map->identify.equals);
    servo_know_checks(self);
}

static void servo_watch(struct sim_modbus_servo *self, int64_t now_ns)
{
    const int64_t watchdog_ns = self->config.map->watchdog_ns;

    if (watchdog_ns > 0 && self->enabled &&
        now_ns - self->heard_ns > watchdog_ns) {
        self->fault = true;
        sim_modbus_servo_torque_off(self);
    }
}

const struct sim_modbus_behaviour sim_modbus_mapped = {
    .slave = &servo_slave_ops,
    .set_up = servo_know_map,
    .loop = servo_watch,
};
