/* sim/cia402_motion.c - set points, ramps, the inner loop.
 *
 * At SYNC k the target that came since SYNC k-1 is latched, and the demand goes
 * in a straight line from where it is to that target within one SYNC period, so
 * it is reached at SYNC k+1.  The plant gets the demand and its slope at every
 * inner step; the inner loop is locked to SYNC, so what SYNC latches as actual
 * position is of that very instant.
 *
 * Demand: Q24 counts; the sums made here stay below 2^62 because plant.c keeps
 * positions below 2^62 and a latch is at most 2^31 counts away. */
#include "sim/cia402.h"

#define CIA402_US INT64_C(1000)
#define CIA402_MS INT64_C(1000000)
#define CIA402_S  INT64_C(1000000000)

/* Before the first period has been measured, and where nobody said. */
#define CIA402_SYNC_PERIOD_NS CIA402_MS
/* A longer time between two SYNCs was a pause. */
#define CIA402_SYNC_PAUSE_NS (200 * CIA402_MS)
/* A ramp is over when the demand rests and the axis is slower than 1 / 2^10 of
 * its top speed. */
#define CIA402_REST_SHIFT 10

static int64_t cia402_motion_counts(int64_t q24)
{
    return (q24 + (1 << 23)) >> 24;
}

static int64_t cia402_motion_abs(int64_t value)
{
    return value < 0 ? -value : value;
}

/* ---- what the motor does ----------------------------------------------- */

static void cia402_motion_demand_actual(struct sim_cia402 *self)
{
    self->demand_q24 = self->plant.pos_q24;
    self->demand_vel_q24 = 0;
    self->target_q24 = self->demand_q24;
    self->target_end_ns = self->plant_ns;
}

static void cia402_motion_stop_watching(struct sim_cia402 *self)
{
    self->target_fresh = false;
    self->targets_late = false;
    self->limited = false;
    self->following_error_ns = 0;
    cia402_timer_stop(self, SIM_CIA402_TARGET);
}

void cia402_motion_off(struct sim_cia402 *self)
{
    cia402_motion_advance(self);
    cia402_motion_stop_watching(self);
    cia402_motion_demand_actual(self);
    self->motion = CIA402_MOTION_OFF;
}

void cia402_motion_stand(struct sim_cia402 *self)
{
    cia402_motion_advance(self);
    cia402_motion_demand_actual(self);
    self->motion = CIA402_MOTION_STAND;
}

/* From where the demand is; moves from the next SYNC on. */
void cia402_motion_follow(struct sim_cia402 *self)
{
    cia402_motion_advance(self);
    if (self->motion == CIA402_MOTION_OFF)
        cia402_motion_demand_actual(self);
    self->demand_vel_q24 = 0;
    self->target_q24 = self->demand_q24;
    self->target_end_ns = self->plant_ns;
    self->motion = CIA402_MOTION_FOLLOW;
}

/* From the actual speed: after a jump of the target the demand's own speed may
 * be one that the axis never had. */
void cia402_motion_ramp(struct sim_cia402 *self, int64_t acc_counts_s2)
{
    cia402_motion_advance(self);
    cia402_motion_stop_watching(self);
    cia402_motion_demand_actual(self);
    self->demand_vel_q24 = self->plant.vel_q24;
    self->ramp_acc_q8 = acc_counts_s2 * 256;
    self->motion = CIA402_MOTION_RAMP;
}

/* ---- one inner step ---------------------------------------------------- */

/* Along the line to the target, exactly on it at its end. */
static void cia402_motion_step_follow(struct sim_cia402 *self, int64_t dt_ns)
{
    if (self->plant_ns >= self->target_end_ns)
        self->demand_vel_q24 = 0;
    if (self->plant_ns + dt_ns >= self->target_end_ns)
        self->demand_q24 = self->target_q24;
    else
        self->demand_q24 +=
            sim_plant_travel_q24(&self->plant, self->demand_vel_q24, dt_ns);
}

/* v goes to 0 by a dt; the way is that of the mean speed. */
static void cia402_motion_step_ramp(struct sim_cia402 *self, int64_t dt_ns)
{
    int64_t before_q24 = self->demand_vel_q24;
    /* Q8 < 2^48 to Q24 below 2^60 by 12 bits, the other 4 after dt <= 1 ms */
    int64_t loss_q24 =
        sim_plant_travel_q24(&self->plant, self->ramp_acc_q8 * 4096, dt_ns) *
        16;

    if (cia402_motion_abs(before_q24) <= loss_q24)
        self->demand_vel_q24 = 0;
    else
        self->demand_vel_q24 -= before_q24 > 0 ? loss_q24 : -loss_q24;
    self->demand_q24 += sim_plant_travel_q24(
        &self->plant, (before_q24 + self->demand_vel_q24) / 2, dt_ns);
}

static bool cia402_motion_is_resting(const struct sim_cia402 *self)
{
    int64_t slow_q24 =
        (self->config.plant.vel_max_counts_s << 24) >> CIA402_REST_SHIFT;

    return self->demand_vel_q24 == 0 &&
           cia402_motion_abs(self->plant.vel_q24) <= slow_q24;
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
    int64_t error_q24 =
        cia402_motion_abs(self->demand_q24 - self->plant.pos_q24);

    if (self->power == CIA402_POWER_REACTION) /* bit 13 says what it was */
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

static void cia402_motion_step_plant(struct sim_cia402 *self, int64_t dt_ns)
{
    if (self->blocked)
        sim_plant_block(&self->plant);
    else if (self->motion == CIA402_MOTION_OFF)
        sim_plant_coast(&self->plant, dt_ns);
    else
        sim_plant_step(&self->plant, self->demand_q24, self->demand_vel_q24,
                       dt_ns);
}

static void cia402_motion_step(struct sim_cia402 *self, int64_t dt_ns)
{
    if (self->motion == CIA402_MOTION_FOLLOW)
        cia402_motion_step_follow(self, dt_ns);
    else if (self->motion == CIA402_MOTION_RAMP)
        cia402_motion_step_ramp(self, dt_ns);
    cia402_motion_step_plant(self, dt_ns);
    /* Before anything may look at the state again. */
    self->plant_ns += dt_ns;
    if (self->motion == CIA402_MOTION_OFF) {
        self->demand_q24 = self->plant.pos_q24;
        return;
    }
    cia402_motion_check_following(self, dt_ns);
    cia402_motion_end_ramp(self);
}

void cia402_motion_advance(struct sim_cia402 *self)
{
    int64_t now_ns = cia402_now_ns(self);

    while (self->plant_ns < now_ns) {
        int64_t dt_ns = now_ns - self->plant_ns;

        if (dt_ns > self->config.loop_ns)
            dt_ns = self->config.loop_ns;
        cia402_motion_step(self, dt_ns);
    }
}

/* ---- SYNC -------------------------------------------------------------- */

static int64_t cia402_motion_told_period_ns(const struct sim_cia402 *self)
{
    int64_t told_ns = self->value[CIA402_SYNC_PERIOD] * CIA402_US;

    return told_ns > 0 ? told_ns : CIA402_SYNC_PERIOD_NS;
}

/* Follows the measured period slowly, a new one at once. */
void cia402_motion_sync(struct sim_cia402 *self)
{
    int64_t now_ns = cia402_now_ns(self);
    int64_t period_ns = now_ns - self->sync_ns;
    int64_t change_ns = period_ns - self->sync_period_ns;
    bool is_first = self->sync_ns < 0;

    self->sync_ns = now_ns;
    if (is_first)
        self->sync_period_ns = cia402_motion_told_period_ns(self);
    else if (period_ns > CIA402_SYNC_PAUSE_NS)
        return;
    else if (cia402_motion_abs(change_ns) > self->sync_period_ns / 2)
        self->sync_period_ns = period_ns;
    else
        self->sync_period_ns += change_ns / 8;
}

/* 0x60C2 when set, else as measured. */
static int64_t cia402_motion_interpolation_ns(const struct sim_cia402 *self)
{
    int64_t period_ns = self->value[CIA402_INTERPOLATION_TIME] * CIA402_S;

    if (period_ns == 0)
        return self->sync_period_ns;
    for (int64_t i = cia402_od_signed(self, CIA402_INTERPOLATION_EXPONENT);
         i < 0; i++)
        period_ns /= 10;
    return period_ns;
}

/* 0x607A + 0x60B0, inside 0x607D where that is set. */
static int32_t cia402_motion_wanted_counts(struct sim_cia402 *self)
{
    int32_t min = (int32_t)self->value[CIA402_LIMIT_MIN];
    int32_t max = (int32_t)self->value[CIA402_LIMIT_MAX];
    int32_t wanted = (int32_t)(self->value[CIA402_TARGET_POSITION] +
                               self->value[CIA402_POSITION_OFFSET]);

    self->limited = min < max && (wanted < min || wanted > max);
    if (!self->limited)
        return wanted;
    return wanted < min ? min : max;
}

/* Slope towards target_q24, and target_q24 itself, within 0x607F, 0x6080. */
static void cia402_motion_limit_slope(struct sim_cia402 *self,
                                      int64_t duration_ns)
{
    uint32_t profile = self->value[CIA402_PROFILE_VELOCITY_MAX];
    uint32_t motor = self->value[CIA402_MOTOR_SPEED_MAX];
    int64_t max_q24 = (int64_t)(profile < motor ? profile : motor) << 24;
    int64_t way_q24 = self->target_q24 - self->demand_q24;
    /* |way| <= 2^56; a ramp of 2^32 counts in 1 us is beyond 2^60: the
     * comparison is made wide */
    sim_i128 vel_q24 = (sim_i128)way_q24 * CIA402_S / duration_ns;

    if (vel_q24 <= max_q24 && vel_q24 >= -(sim_i128)max_q24) {
        self->demand_vel_q24 = (int64_t)vel_q24;
        return;
    }
    self->limited = true;
    self->demand_vel_q24 = vel_q24 > 0 ? max_q24 : -max_q24;
    self->target_q24 =
        self->demand_q24 +
        (int64_t)((sim_i128)self->demand_vel_q24 * duration_ns / CIA402_S);
}

static void cia402_motion_watch_targets(struct sim_cia402 *self)
{
    int64_t timeout_ns =
        self->target_timeout_ns > 0
            ? self->target_timeout_ns
            : self->value[CIA402_TARGETS_MISSED_MAX] * self->sync_period_ns;

    if (!self->target_fresh)
        return;
    self->target_fresh = false;
    if (self->targets_late) {
        self->targets_late = false;
        cia402_com_error_gone(self, CIA402_ERROR_COM);
    }
    cia402_timer_stop(self, SIM_CIA402_TARGET);
    if (timeout_ns > 0)
        cia402_timer_set(self, SIM_CIA402_TARGET,
                         cia402_now_ns(self) + timeout_ns);
}

void cia402_motion_latch(struct sim_cia402 *self)
{
    int64_t duration_ns = cia402_motion_interpolation_ns(self);
    int64_t from_counts = cia402_motion_counts(self->demand_q24);
    int32_t wanted, step;

    if (self->motion != CIA402_MOTION_FOLLOW)
        return;
    cia402_motion_watch_targets(self);
    /* Counts on the wire wrap at 2^32: the nearer way round. */
    wanted = cia402_motion_wanted_counts(self);
    step = (int32_t)((uint32_t)wanted - (uint32_t)from_counts);
    self->target_q24 = (from_counts + step) * (INT64_C(1) << 24);
    self->target_end_ns = cia402_now_ns(self) + duration_ns;
    cia402_motion_limit_slope(self, duration_ns);
}

void cia402_motion_targets_late(struct sim_cia402 *self)
{
    self->targets_late = true;
    cia402_com_error(self, CIA402_EMCY_RPDO_LATE, CIA402_ERROR_COM);
    cia402_power_connection_lost(self);
}

/* ---- what can be read -------------------------------------------------- */

int64_t cia402_motion_actual_q24(const struct sim_cia402 *self)
{
    return self->frozen ? self->frozen_pos_q24 : self->plant.pos_q24;
}

/* 0.1 % of the torque at the current limit. */
static uint32_t cia402_motion_torque(const struct sim_cia402 *self)
{
    int64_t permille =
        self->plant.acc_q8 * 1000 /
        (self->config.plant.acc_max_counts_s2 << 8); /* 2^48 x 2^10 */

    return (uint16_t)permille;
}

void cia402_motion_refresh(struct sim_cia402 *self)
{
    int64_t actual_q24 = cia402_motion_actual_q24(self);
    uint32_t *value = self->value;

    value[CIA402_STATUSWORD] = cia402_power_statusword(self);
    value[CIA402_POSITION] = (uint32_t)cia402_motion_counts(actual_q24);
    value[CIA402_POSITION_INTERNAL] = value[CIA402_POSITION];
    value[CIA402_POSITION_DEMAND] =
        (uint32_t)cia402_motion_counts(self->demand_q24);
    value[CIA402_FOLLOWING_ERROR] =
        (uint32_t)cia402_motion_counts(self->demand_q24 - actual_q24);
    value[CIA402_VELOCITY] =
        self->frozen ? 0 : (uint32_t)cia402_motion_counts(self->plant.vel_q24);
    value[CIA402_VELOCITY_DEMAND] =
        (uint32_t)cia402_motion_counts(self->demand_vel_q24);
    value[CIA402_TORQUE] = cia402_motion_torque(self);
    value[CIA402_INPUTS] = self->inputs | (self->no_power ? 1u << 3 : 0);
}
