/* sim/device/cia402/motion.c - the inner loop: demand, ramps, plant.
 *
 * The mode of operation says where the demand goes (mode.c); leaving
 * operation, halt and faults ramp it down.  The plant gets the demand and its
 * slope at every inner step; the inner loop is locked to SYNC, so what SYNC
 * latches as actual position is of that very instant.
 *
 * Demand and plant: Q24 counts as they were at power-on; what the bus sees is
 * less by zero_counts, which homing sets.  The sums made here stay below 2^62
 * because plant.c keeps positions below 2^62 and a latch is at most 2^31 counts
 * away. */
#include <math.h>

#include "sim/device/cia402/parts.h"

#define CIA402_MS INT64_C(1000000)

/* A ramp is over when the demand rests and the axis is slower than 1 / 2^10 of
 * its top speed. */
#define CIA402_REST_SHIFT 10

int64_t cia402_motion_counts(int64_t q24)
{
    return (q24 + (1 << 23)) >> 24;
}

int64_t cia402_motion_abs(int64_t value)
{
    return value < 0 ? -value : value;
}

/* The change of speed that acc (Q8, < 2^48) makes in dt <= 1 ms. */
int64_t cia402_motion_gain_q24(struct sim_cia402 *self, int64_t acc_q8,
                               int64_t dt_ns)
{
    /* Q8 to Q24 below 2^60 by 12 bits, the other 4 after dt */
    return sim_plant_travel_q24(&self->base.plant, acc_q8 * 4096, dt_ns) * 16;
}

/* ---- what the motor does ----------------------------------------------- */

static void cia402_motion_demand_actual(struct sim_cia402 *self)
{
    self->demand_q24 = self->base.plant.pos_q24;
    self->demand_vel_q24 = 0;
    self->target_q24 = self->demand_q24;
    self->target_end_ns = self->base.plant_ns;
}

void cia402_motion_stop_watching(struct sim_cia402 *self)
{
    self->target_fresh = false;
    self->targets_late = false;
    self->limited = false;
    self->following_error_ns = 0;
    cia402_timer_stop(self, SIM_CIA402_TARGET);
}

void cia402_motion_off(struct sim_cia402 *self)
{
    sim_servo_advance(&self->base);
    cia402_motion_stop_watching(self);
    cia402_motion_demand_actual(self);
    self->motion = CIA402_MOTION_OFF;
}

void cia402_motion_stand(struct sim_cia402 *self)
{
    sim_servo_advance(&self->base);
    cia402_motion_demand_actual(self);
    self->motion = CIA402_MOTION_STAND;
}

/* From where the demand is, as the mode says: a cyclic one moves from the next
 * SYNC on. */
void cia402_motion_follow(struct sim_cia402 *self)
{
    sim_servo_advance(&self->base);
    if (self->motion == CIA402_MOTION_OFF)
        cia402_motion_demand_actual(self);
    if (cia402_mode_is_cyclic(self))
        self->demand_vel_q24 = 0;
    self->target_q24 = self->demand_q24;
    self->target_end_ns = self->base.plant_ns;
    self->motion = CIA402_MOTION_FOLLOW;
}

/* From the actual speed: after a jump of the target the demand's own speed may
 * be one that the axis never had. */
void cia402_motion_ramp(struct sim_cia402 *self, int64_t acc_counts_s2)
{
    sim_servo_advance(&self->base);
    cia402_motion_stop_watching(self);
    cia402_motion_demand_actual(self);
    self->demand_vel_q24 = self->base.plant.vel_q24;
    self->ramp_acc_q8 = acc_counts_s2 * 256;
    self->motion = CIA402_MOTION_RAMP;
}

/* ---- one inner step ---------------------------------------------------- */

/* v goes to 0 by a dt; the displacement is that of the mean speed. */
static void cia402_motion_step_ramp(struct sim_cia402 *self, int64_t dt_ns)
{
    int64_t before_q24 = self->demand_vel_q24;
    int64_t loss_q24 = cia402_motion_gain_q24(self, self->ramp_acc_q8, dt_ns);

    if (cia402_motion_abs(before_q24) <= loss_q24)
        self->demand_vel_q24 = 0;
    else
        self->demand_vel_q24 -= before_q24 > 0 ? loss_q24 : -loss_q24;
    self->demand_q24 += sim_plant_travel_q24(
        &self->base.plant, (before_q24 + self->demand_vel_q24) / 2, dt_ns);
}

bool cia402_motion_is_resting(const struct sim_cia402 *self)
{
    int64_t slow_q24 =
        (self->config.plant.vel_max_counts_s << 24) >> CIA402_REST_SHIFT;

    return self->demand_vel_q24 == 0 &&
           cia402_motion_abs(self->base.plant.vel_q24) <= slow_q24;
}

static void cia402_motion_end_ramp(struct sim_cia402 *self)
{
    if (self->motion != CIA402_MOTION_RAMP || !cia402_motion_is_resting(self))
        return;
    self->motion = CIA402_MOTION_STAND;
    cia402_power_at_rest(self);
}

static void cia402_motion_check_following(struct sim_cia402 *self,
                                          int64_t dt_ns)
{
    uint32_t window = self->value[CIA402_FOLLOWING_WINDOW];
    int64_t error_q24 = cia402_motion_abs(
        self->demand_q24 - sim_plant_measured_q24(&self->base.plant));

    if (self->power == CIA402_POWER_REACTION || /* bit 13 says what it was */
        !cia402_mode_watches(self))
        return;
    self->following_error = window != UINT32_MAX && error_q24 > (int64_t)window
                                                                    << 24;
    if (!self->following_error) {
        self->following_error_ns = 0;
        return;
    }
    self->following_error_ns += dt_ns;
    if (self->following_error_ns >=
        self->value[CIA402_FOLLOWING_TIME] * CIA402_MS)
        cia402_power_fault(self, CIA402_EMCY_FOLLOWING, CIA402_ERROR_PROFILE);
}

/* 0x60B2, 0.1 % of the torque at the current limit. */
static void cia402_motion_push(struct sim_cia402 *self)
{
    const int64_t permille =
        self->motion == CIA402_MOTION_FOLLOW && cia402_mode_is_cyclic(self)
            ? cia402_od_signed(self, CIA402_TORQUE_OFFSET)
            : 0;

    /* < 2^15 x 2^40 x 2^8 / 2^9; usually there is none, without a division */
    self->base.plant.push_q8 =
        permille == 0
            ? 0
            : permille * (self->config.plant.acc_max_counts_s2 * 256 / 1000);
}

void cia402_motion_step(struct sim_servo *base, int64_t dt_ns)
{
    struct sim_cia402 *self = CONTAINER_OF(base, struct sim_cia402, base);

    if (self->motion == CIA402_MOTION_FOLLOW)
        cia402_mode_step(self, dt_ns);
    else if (self->motion == CIA402_MOTION_RAMP)
        cia402_motion_step_ramp(self, dt_ns);
    cia402_motion_push(self);
    sim_servo_turn(base, self->motion != CIA402_MOTION_OFF, self->demand_q24,
                   self->demand_vel_q24, dt_ns);
    cia402_inputs_watch(self);
    if (self->motion == CIA402_MOTION_OFF) {
        self->demand_q24 = self->base.plant.pos_q24;
        return;
    }
    cia402_motion_check_following(self, dt_ns);
    cia402_motion_end_ramp(self);
    cia402_mode_watch(self, dt_ns);
}

/* ---- what can be read -------------------------------------------------- */

uint32_t cia402_motion_seen(const struct sim_cia402 *self, int64_t q24)
{
    return (uint32_t)(cia402_motion_counts(q24) - self->zero_counts);
}

int64_t cia402_motion_actual_q24(const struct sim_cia402 *self)
{
    return sim_servo_reported_q24(&self->base);
}

/* 0.1 % of the torque at the current limit. */
static uint32_t cia402_motion_torque(const struct sim_cia402 *self)
{
    int64_t permille =
        self->base.plant.acc_q8 * 1000 /
        (self->config.plant.acc_max_counts_s2 << 8); /* 2^48 x 2^10 */

    return (uint16_t)permille;
}

void cia402_motion_refresh(struct sim_cia402 *self)
{
    int64_t actual_q24 = cia402_motion_actual_q24(self);
    uint32_t *value = self->value;

    value[CIA402_STATUSWORD] = cia402_power_statusword(self);
    value[CIA402_POSITION] = cia402_motion_seen(self, actual_q24);
    value[CIA402_POSITION_INTERNAL] = value[CIA402_POSITION];
    value[CIA402_POSITION_DEMAND] = cia402_motion_seen(self, self->demand_q24);
    value[CIA402_FOLLOWING_ERROR] =
        (uint32_t)cia402_motion_counts(self->demand_q24 - actual_q24);
    value[CIA402_VELOCITY] =
        self->base.frozen
            ? 0
            : (uint32_t)cia402_motion_counts(self->base.plant.vel_q24);
    value[CIA402_VELOCITY_DEMAND] =
        (uint32_t)cia402_motion_counts(self->demand_vel_q24);
    value[CIA402_TORQUE] = cia402_motion_torque(self);
    value[CIA402_CURRENT] = value[CIA402_TORQUE]; /* both of the rated ones */
    value[CIA402_DC_LINK_VOLTAGE] =
        (uint32_t)lround(24000 + 1000 * self->base.readings.more_v);
    value[CIA402_TEMPERATURE] = (uint16_t)(int16_t)lround(
        300 +
        10 * sim_readings_warmth_degc(&self->base.readings, &self->base.plant));
    value[CIA402_INPUTS] = cia402_inputs(self);
}
