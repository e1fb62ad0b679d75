/* hal/drive/modbus/init.c - config and map to numbers, once: this part divides.
 * See drive.h. */
#include <stddef.h>
#include <string.h>

#include "hal/drive/modbus/parts.h"
#include "motion/core/fixed.h"

#define NS_PER_S      INT64_C(1000000000)
#define PAST_PER_STEP 16 /* set points remembered per cycle */
#define JUMP_FACTOR   2  /* of the axis's highest speed */

#define STOP_MARGIN_NS (NS_PER_S / 2) /* until it begins */
#define STOP_MAX_NS    (10 * NS_PER_S)

/* A velocity in counts/s (Q16) to the field's unit. */
static int init_velocity(struct hal_ratio *ratio, const struct modbus_map *map,
                         const struct modbus_map_field *field)
{
    int64_t num = field->num, den = field->den;

    if (field->unit == MODBUS_RPM) {
        num *= 60;
        den *= map->resolution;
    }
    return hal_ratio_init(ratio, num, den, -16);
}

/* For ramps that are told with a motion; go.c has no division. */
static int init_ramp_scale(struct drive_modbus_ramp *ramp,
                           const struct modbus_map *map,
                           const struct modbus_map_field *field)
{
    int64_t num = field->num, den = field->den;

    ramp->field = field;
    if (field->unit == MODBUS_MS_PER_1000_RPM)
        return motion_fixed_muldiv(map->resolution, num * INT64_C(1000000),
                                   den * 60, &ramp->over);
    if (field->unit == MODBUS_RPM) {
        num *= 60;
        den *= map->resolution;
    }
    return hal_ratio_init(&ramp->to_field, num, den, 0);
}

static int init_ramp_scales(struct drive_modbus *self)
{
    const struct modbus_map *map = self->config.map;
    int err = MOTION_OK;

    for (unsigned i = 0; i < map->move.count && err == MOTION_OK; i++) {
        const struct modbus_map_field *field = &map->move.field[i];

        if (field->quantity == MODBUS_ACCELERATION)
            err = init_ramp_scale(&self->move_scale[0], map, field);
        else if (field->quantity == MODBUS_DECELERATION)
            err = init_ramp_scale(&self->move_scale[1], map, field);
    }
    return err;
}

/* What all of them can say. */
static int init_position(struct drive_modbus *self,
                         struct drive_modbus_scale *scale,
                         const struct modbus_map_field *field)
{
    if (field->min > self->pos_min)
        self->pos_min = field->min;
    if (field->max < self->pos_max)
        self->pos_max = field->max;
    return hal_ratio_init(&scale->to_position, field->num, field->den, 0);
}

static int init_group(struct drive_modbus *self,
                      const struct modbus_map_group *group,
                      struct drive_modbus_scale *scale)
{
    const struct modbus_map *map = self->config.map;
    int err = MOTION_OK;

    for (unsigned i = 0; i < group->count && err == MOTION_OK; i++) {
        const struct modbus_map_field *field = &group->field[i];

        if (field->quantity == MODBUS_VELOCITY)
            err = init_velocity(&scale->to_velocity, map, field);
        else if (field->quantity == MODBUS_POSITION)
            err = init_position(self, scale, field);
        else if (field->quantity == MODBUS_ACCELERATION)
            self->ramp[0] = drive_modbus_ramp(&self->config, field);
        else if (field->quantity == MODBUS_DECELERATION)
            self->ramp[1] = drive_modbus_ramp(&self->config, field);
    }
    return err;
}

static int init_scale(struct drive_modbus *self)
{
    const struct drive_modbus_config *config = &self->config;
    const int64_t num = config->counts_num, den = config->counts_den;
    int err = hal_ratio_init(&self->to_counts, num, den, -32);

    if (err == MOTION_OK)
        err = hal_ratio_init(&self->to_speed, num, den, -16);
    if (err == MOTION_OK)
        err = hal_ratio_init(&self->to_pos, num < 0 ? -den : den,
                             num < 0 ? -num : num, 32);
    return err;
}

static int64_t init_seconds_q32(int64_t dur_ns)
{
    int64_t q32 = 0;

    (void)motion_fixed_muldiv(dur_ns, MOTION_FIXED_ONE_Q32, NS_PER_S, &q32);
    return q32;
}

/* From full speed by the stop's acceleration, and half as long again. */
static int64_t init_stop_ns(const struct drive_modbus_config *config)
{
    int64_t dur_ns;

    if (motion_fixed_muldiv(config->vel_max_q32, 3 * NS_PER_S / 2,
                            config->acc_q32, &dur_ns) < 0 ||
        dur_ns > STOP_MAX_NS)
        return STOP_MAX_NS;
    return dur_ns + STOP_MARGIN_NS;
}

static void init_times(struct drive_modbus *self)
{
    const int64_t cycle_ns = self->config.cycle_ns;
    const int64_t latency_ns = self->config.latency_ns;
    int64_t lead_q32;

    self->feed_q32 = init_seconds_q32(latency_ns + cycle_ns);
    self->lead_q32 = lead_q32 = init_seconds_q32(
        latency_ns + (self->law.is_near ? cycle_ns / 2 : 2 * cycle_ns));
    (void)motion_fixed_mulshift(lead_q32, lead_q32, 33, &self->half_lead2_q32);
    self->stop_ns = init_stop_ns(&self->config);
    self->past_step_ns = cycle_ns / PAST_PER_STEP;
}

/* How far a motor can have got, per ns in 2^-48 counts; the first step; and what is
 * standing: two counts, and a thousandth of the speed. */
static int init_bounds(struct drive_modbus *self)
{
    const struct drive_modbus_config *config = &self->config;
    int64_t vel_q16 =
        hal_ratio_scale(&self->to_speed, JUMP_FACTOR * config->vel_max_q32);
    int64_t step =
        hal_ratio_scale(&self->to_counts, config->first_step_max_q32);

    vel_q16 = vel_q16 < 0 ? -vel_q16 : vel_q16;
    step = step < 0 ? -step : step;
    if (vel_q16 > INT64_MAX / 2 ||
        motion_fixed_muldiv(vel_q16, INT64_C(1) << 32, NS_PER_S,
                            &self->jump_q16) < 0)
        return MOTION_E_RANGE;
    self->first_step_counts = step > 0 ? step : 1;
    self->near_counts = 2 + (vel_q16 >> 16) / (JUMP_FACTOR * INT64_C(1000)) /
                                (NS_PER_S / HAL_STANDSTILL_NS);
    return MOTION_OK;
}

static bool init_is_sound(const struct drive_modbus_config *config)
{
    return config->counts_num != 0 && config->counts_num != INT64_MIN &&
           config->counts_den > 0 && config->vel_max_q32 > 0 &&
           config->vel_max_q32 <= INT64_MAX / JUMP_FACTOR &&
           config->acc_q32 > 0 && config->cycle_ns >= 100000 &&
           config->cycle_ns <= 2 * NS_PER_S && config->latency_ns >= 0 &&
           config->latency_ns <= NS_PER_S && config->first_step_max_q32 >= 0 &&
           (config->mode == HAL_DRIVE_STREAM_POSITION ||
            config->mode == HAL_DRIVE_PROFILE_POSITION);
}

static int init_monitor(struct drive_modbus *self)
{
    struct modbus_map_block block[MODBUS_MAP_BLOCKS_MAX];
    const unsigned count =
        modbus_map_blocks(self->config.map, MODBUS_POLL_MONITOR, block);

    self->readings.wanted = self->config.readings;
    if (self->config.readings == 0)
        return MOTION_OK;
    if (self->fast_count + count > MODBUS_MAP_BLOCKS_MAX)
        return MOTION_E_RANGE;
    for (unsigned i = 0; i < count; i++)
        self->fast[self->fast_count + self->monitor_count++] = block[i];
    return MOTION_OK;
}

int drive_modbus_init(struct drive_modbus *self, struct modbus_bus *bus,
                      const struct drive_modbus_config *config)
{
    const struct modbus_map *map = config->map;
    int err = MOTION_OK;

    memset(self, 0, sizeof *self);
    self->config = *config;
    if (!init_is_sound(config))
        return MOTION_E_ARG;
    if (map->move.count == 0 &&
        (map->stream.count == 0 || config->mode != HAL_DRIVE_STREAM_POSITION))
        return MOTION_E_EMPTY;
    if (self->config.latency_ns == 0)
        self->config.latency_ns = config->cycle_ns / 2;
    if (self->config.first_step_max_q32 == 0)
        self->config.first_step_max_q32 = MOTION_FIXED_ONE_Q32;
    self->pos_min = INT32_MIN;
    self->pos_max = UINT32_MAX;
    err = init_scale(self);
    if (err == MOTION_OK)
        err = init_group(self, &map->move, &self->to_move);
    if (err == MOTION_OK && map->stream.count > 0)
        err = init_group(self, &map->stream, &self->to_stream);
    if (err == MOTION_OK)
        err = init_ramp_scales(self);
    if (err == MOTION_OK)
        err = init_bounds(self);
    if (err == MOTION_OK)
        err = drive_modbus_law(&self->config, &self->law);
    if (err != MOTION_OK)
        return err;
    init_times(self);
    self->mode = drive_modbus_first_mode(config);
    self->fast_count =
        (uint8_t)modbus_map_blocks(map, MODBUS_POLL_FAST, self->fast);
    err = init_monitor(self);
    if (err != MOTION_OK)
        return err;
    self->slow_count =
        (uint8_t)modbus_map_blocks(map, MODBUS_POLL_SLOW, self->slow);
    self->drive.ops = &drive_modbus_ops;
    self->node.ops = &drive_modbus_node_ops;
    self->node.unit = config->unit;
    drive_modbus_start(self);
    return modbus_bus_add(bus, &self->node);
}
