/* hal/drive/cia402/init.c - config to numbers, once: this part divides.
 * See drive.h. */
#include "hal/drive/cia402/parts.h"

#include <string.h>

#include "motion/core/fixed.h"

#define NS_PER_S       INT64_C(1000000000)
#define NS_PER_MS      INT64_C(1000000)
#define NS_PER_US      INT64_C(1000)
#define PDO_NUMBER_MAX 512
/* One count per SYNC period. */
#define VEL_MAX_Q32 (UINT64_C(1) << 58)

/* Counts per period to unit/s, by counts/s in Q16. */
static int init_velocity(struct drive_cia402 *self, int64_t per_count,
                         int64_t num)
{
    int64_t one_q32;
    int err = hal_ratio_init(&self->to_rate, NS_PER_S,
                             self->config.sync_period_ns, 16);

    if (err == MOTION_OK)
        err = hal_ratio_init(&self->to_vel, per_count, num, 16);
    if (err != MOTION_OK)
        return err;
    one_q32 =
        hal_ratio_scale(&self->to_vel, hal_ratio_scale(&self->to_rate, 1));
    return motion_fixed_abs(one_q32) <= VEL_MAX_Q32 ? MOTION_OK
                                                    : MOTION_E_RANGE;
}

static int init_scale(struct drive_cia402 *self)
{
    const struct drive_cia402_config *config = &self->config;
    const uint64_t num = motion_fixed_abs(config->counts_num);
    const uint64_t den = (uint64_t)config->counts_den;
    const struct motion_u128 finest =
        motion_fixed_shl_u128((struct motion_u128){ 0, den }, 32);
    int64_t per_count;
    int err;

    if (config->counts_num == 0 || num > INT64_MAX || config->counts_den <= 0)
        return MOTION_E_ARG;
    if (motion_fixed_cmp_u128((struct motion_u128){ 0, num }, finest) > 0)
        return MOTION_E_RANGE; /* a count is finer than a position can say */
    per_count =
        config->counts_num < 0 ? -config->counts_den : config->counts_den;
    err = hal_ratio_init(&self->to_counts, config->counts_num,
                         config->counts_den, -32);
    if (err == MOTION_OK)
        err = hal_ratio_init(&self->to_pos, per_count, (int64_t)num, 32);
    return err == MOTION_OK ? init_velocity(self, per_count, (int64_t)num)
                            : err;
}

/* 0x60C2: period = count x 10^exponent s, count 1..255, in ms where it can be:
 * some drives take no other unit. */
static int init_interpolation(struct drive_cia402 *self)
{
    int64_t unit_ns = NS_PER_MS;
    int8_t exponent = -3;

    while (self->config.sync_period_ns > 255 * unit_ns && exponent < -1) {
        unit_ns *= 10;
        exponent++;
    }
    while (exponent >= -6) {
        if (self->config.sync_period_ns % unit_ns == 0 &&
            self->config.sync_period_ns / unit_ns <= 255) {
            self->interpolation_count =
                (uint8_t)(self->config.sync_period_ns / unit_ns);
            self->interpolation_exponent = exponent;
            return MOTION_OK;
        }
        unit_ns /= 10;
        exponent--;
    }
    return MOTION_E_ARG;
}

static void init_defaults(struct drive_cia402_config *config)
{
    if (config->heartbeat_period_ns == 0)
        config->heartbeat_period_ns = 20 * NS_PER_MS;
    if (config->watchdog_ns == 0)
        config->watchdog_ns = 50 * NS_PER_MS;
    if (config->first_step_max_q32 == 0)
        config->first_step_max_q32 = MOTION_FIXED_ONE_Q32;
    if (config->vel_num == 0 && config->vel_den == 0)
        config->vel_num = config->vel_den = 1;
    if (config->acc_num == 0 && config->acc_den == 0)
        config->acc_num = config->acc_den = 1;
}

/* Whole milliseconds, 1 .. max_ms. */
static bool init_is_ms(int64_t t_ns, int64_t max_ms)
{
    return t_ns > 0 && t_ns % NS_PER_MS == 0 && t_ns / NS_PER_MS <= max_ms;
}

/* Who hears whom: heartbeats both ways, or our questions. */
static int init_watch(struct drive_cia402 *self, const struct canopen *master)
{
    const struct drive_cia402_config *config = &self->config;
    const int64_t requested_ns = config->guard_period_ns > 0
                                     ? config->guard_period_ns
                                     : master->config.heartbeat_period_ns;

    if (!init_is_ms(config->heartbeat_period_ns, 20000) ||
        !init_is_ms(config->watchdog_ns, 100) || requested_ns == 0 ||
        requested_ns > config->watchdog_ns / 2 ||
        (config->guard_period_ns != 0 &&
         !init_is_ms(config->guard_period_ns, 100)))
        return MOTION_E_ARG;
    self->heartbeat_ms = (uint16_t)(config->heartbeat_period_ns / NS_PER_MS);
    self->watchdog_ms = (uint16_t)(config->watchdog_ns / NS_PER_MS);
    self->guard_given_ms = (uint16_t)(config->guard_period_ns / NS_PER_MS);
    self->life_factor = 2; /* of quirks */
    if (self->guard_given_ms > 0)
        self->life_factor = (uint8_t)(self->watchdog_ms / self->guard_given_ms);
    return MOTION_OK;
}

static int init_times(struct drive_cia402 *self, const struct canopen *master)
{
    const struct drive_cia402_config *config = &self->config;

    if (config->sync_period_ns <= 0 ||
        config->sync_period_ns != master->config.sync_period_ns ||
        config->sdo_timeout_ns < 0 || config->state_timeout_ns < 0 ||
        config->brake_timeout_ns < 0 || config->precharge_timeout_ns < 0 ||
        (config->quirk_is_given && config->quirk_count == 0) ||
        init_watch(self, master) != MOTION_OK)
        return MOTION_E_ARG;
    if (config->sync_period_ns % NS_PER_US == 0)
        self->sync_us = (uint32_t)(config->sync_period_ns / NS_PER_US);
    return init_interpolation(self);
}

/* At least one count, at most half the range that i32 differences can tell. */
static int init_first_step(struct drive_cia402 *self)
{
    int64_t counts;

    if (self->config.first_step_max_q32 < 0)
        return MOTION_E_ARG;
    if (motion_fixed_mulshift(self->config.first_step_max_q32,
                              self->to_counts.mantissa, self->to_counts.shift,
                              &counts) != MOTION_OK)
        counts = INT64_MAX;
    counts = counts < 0 ? -counts : counts;
    if (counts > INT32_MAX / 2)
        counts = INT32_MAX / 2;
    self->first_step_counts = counts > 0 ? counts : 1;
    return MOTION_OK;
}

/* Two counts, and a thousandth of the axis's speed. */
static int init_near(struct drive_cia402 *self)
{
    const int64_t slow_q32 = self->config.vel_max_q32 / 1000 /
                             (INT64_C(1000000000) / HAL_STANDSTILL_NS);
    int64_t counts;

    if (slow_q32 < 0)
        return MOTION_E_ARG;
    if (motion_fixed_mulshift(slow_q32, self->to_counts.mantissa,
                              self->to_counts.shift, &counts) != MOTION_OK)
        counts = INT32_MAX / 2;
    self->near_counts = (int64_t)motion_fixed_abs(counts) + 2;
    return MOTION_OK;
}

/* Speeds and ramps in the drive's units. */
static int init_units(struct drive_cia402 *self)
{
    const struct drive_cia402_config *config = &self->config;
    const int64_t num = config->counts_num, den = config->counts_den;
    int err = hal_ratio_init(&self->to_speed, num, den, -16);

    if (config->vel_num <= 0 || config->acc_num <= 0)
        return MOTION_E_ARG;
    if (err == MOTION_OK)
        err = hal_ratio_init(&self->to_ramp, num, den, -16);
    if (err == MOTION_OK)
        err = hal_ratio_init(&self->to_vel_unit, config->vel_num,
                             config->vel_den, -16);
    if (err == MOTION_OK)
        err = hal_ratio_init(&self->to_acc_unit, config->acc_num,
                             config->acc_den, -16);
    return err;
}

/* A count more each way, so that a set point at the very end is inside. */
static int32_t init_limit(const struct drive_cia402 *self, int64_t pos_q32,
                          int more)
{
    int64_t counts = hal_ratio_scale(&self->to_counts, pos_q32);

    if (counts > INT32_MAX - 1)
        counts = INT32_MAX - 1;
    if (counts < INT32_MIN + 1)
        counts = INT32_MIN + 1;
    return (int32_t)(counts + more);
}

static int init_limits(struct drive_cia402 *self)
{
    const struct drive_cia402_config *config = &self->config;
    const bool reversed = config->counts_num < 0;

    if (config->pos_min_q32 > config->pos_max_q32 || config->travel_q32 < 0 ||
        (unsigned)config->stream > DRIVE_CIA402_CSV ||
        (config->stream == DRIVE_CIA402_CSV && config->gain_q16 <= 0))
        return MOTION_E_ARG;
    self->limit_counts[reversed] =
        init_limit(self, config->pos_min_q32, reversed ? 1 : -1);
    self->limit_counts[!reversed] =
        init_limit(self, config->pos_max_q32, reversed ? -1 : 1);
    return motion_fixed_muldiv(config->travel_q32,
                               (int64_t)motion_fixed_abs(config->counts_num),
                               config->counts_den, &self->turn_q32);
}

static int init_pdos(struct drive_cia402 *self)
{
    const struct drive_cia402_config *config = &self->config;

    return config->axis < DRIVE_CIA402_AXES &&
                   config->readings < 1u << HAL_READINGS &&
                   config->pdo.number <= PDO_NUMBER_MAX - 3
               ? MOTION_OK
               : MOTION_E_ARG;
}

int drive_cia402_init(struct drive_cia402 *self, struct canopen *master,
                      const struct drive_cia402_config *config)
{
    int err;

    memset(self, 0, sizeof *self);
    self->given = self->config = *config;
    self->readings.wanted = config->readings;
    self->reading = HAL_READINGS;
    init_defaults(&self->config);
    err = init_times(self, master);
    if (err == MOTION_OK)
        err = init_scale(self);
    if (err == MOTION_OK)
        err = init_first_step(self);
    if (err == MOTION_OK)
        err = init_near(self);
    if (err == MOTION_OK)
        err = init_units(self);
    if (err == MOTION_OK)
        err = init_limits(self);
    if (err == MOTION_OK)
        err = init_pdos(self);
    if (err != MOTION_OK)
        return err;
    self->drive.ops = &drive_cia402_ops;
    self->node.ops = &drive_cia402_node_ops;
    self->node.id = config->node_id;
    self->node.axis = config->axis;
    self->node.guard_due_ns = INT64_MIN / 2;
    drive_cia402_start_anew(self, 0);
    return canopen_add(master, &self->node);
}
