/* sim/device/cia402/stream.c - the cyclic modes: CSP, IP and CSV.
 *
 * At SYNC k the target that came since SYNC k-1 is latched.  A position: the
 * demand goes in a straight line from where it is to that target within one
 * SYNC period, so it is reached at SYNC k+1.  A velocity: the loop around the
 * position is open, and the demand's speed is it from then on.
 * Source: CiA 402-2 12 to 15. */
#include "sim/device/cia402/parts.h"

#define CIA402_US INT64_C(1000)
#define CIA402_MS INT64_C(1000000)
#define CIA402_S  INT64_C(1000000000)

/* Before the first period has been measured, and where nobody said. */
#define CIA402_SYNC_PERIOD_NS CIA402_MS
/* A longer time between two SYNCs was a pause. */
#define CIA402_SYNC_PAUSE_NS (200 * CIA402_MS)

#define CIA402_CW_INTERPOLATE 0x0010
#define CIA402_SW_FOLLOWS     0x1000
#define CIA402_SW_ERROR       0x2000

/* ---- the inner step ---------------------------------------------------- */

/* Along the line to the target, exactly on it at its end. */
void cia402_stream_step(struct sim_cia402 *self, int64_t dt_ns)
{
    if (self->base.plant_ns >= self->target_end_ns)
        self->demand_vel_q24 = 0;
    if (self->base.plant_ns + dt_ns >= self->target_end_ns)
        self->demand_q24 = self->target_q24;
    else
        self->demand_q24 += sim_plant_travel_q24(&self->base.plant,
                                                 self->demand_vel_q24, dt_ns);
}

/* The plant closes a loop around the speed alone. */
void cia402_stream_step_velocity(struct sim_cia402 *self, int64_t dt_ns)
{
    self->demand_q24 =
        self->base.plant.pos_q24 +
        sim_plant_travel_q24(&self->base.plant, self->demand_vel_q24, dt_ns);
}

/* ---- SYNC -------------------------------------------------------------- */
static int64_t cia402_stream_told_period_ns(const struct sim_cia402 *self)
{
    int64_t told_ns =
        cia402_axes_first(self)->value[CIA402_SYNC_PERIOD] * CIA402_US;

    return told_ns > 0 ? told_ns : CIA402_SYNC_PERIOD_NS;
}

/* Follows the measured period slowly, a new one at once. */
void cia402_stream_sync(struct sim_cia402 *self)
{
    int64_t now_ns = cia402_now_ns(self);
    int64_t period_ns = now_ns - self->sync_ns;
    int64_t change_ns = period_ns - self->sync_period_ns;
    bool is_first = self->sync_ns < 0;

    self->sync_ns = now_ns;
    if (is_first)
        self->sync_period_ns = cia402_stream_told_period_ns(self);
    else if (period_ns > CIA402_SYNC_PAUSE_NS)
        return;
    else if (cia402_motion_abs(change_ns) > self->sync_period_ns / 2)
        self->sync_period_ns = period_ns;
    else
        self->sync_period_ns += change_ns / 8;
}

/* 0x60C2 when set, else as measured. */
static int64_t cia402_stream_interpolation_ns(const struct sim_cia402 *self)
{
    int64_t period_ns = self->value[CIA402_INTERPOLATION_TIME] * CIA402_S;

    if (period_ns == 0)
        return self->sync_period_ns;
    for (int64_t i = cia402_od_signed(self, CIA402_INTERPOLATION_EXPONENT);
         i < 0; i++)
        period_ns /= 10;
    return period_ns;
}

/* Inside 0x607D where that is set. */
int32_t cia402_stream_inside(struct sim_cia402 *self, int32_t wanted)
{
    int32_t min = (int32_t)self->value[CIA402_LIMIT_MIN];
    int32_t max = (int32_t)self->value[CIA402_LIMIT_MAX];

    self->limited = min < max && (wanted < min || wanted > max);
    if (!self->limited)
        return wanted;
    return wanted < min ? min : max;
}

/* Within 0x607F and 0x6080. */
int64_t cia402_stream_vel_max_q24(const struct sim_cia402 *self)
{
    uint32_t profile = self->value[CIA402_PROFILE_VELOCITY_MAX];
    uint32_t motor = self->value[CIA402_MOTOR_SPEED_MAX];

    return (int64_t)(profile < motor ? profile : motor) << 24;
}

/* Slope towards target_q24, and target_q24 itself, within 0x607F, 0x6080. */
static void cia402_stream_limit_slope(struct sim_cia402 *self,
                                      int64_t duration_ns)
{
    int64_t max_q24 = cia402_stream_vel_max_q24(self);
    int64_t distance_q24 = self->target_q24 - self->demand_q24;
    /* |displacement| <= 2^56; a ramp of 2^32 counts in 1 us is beyond 2^60: the
     * comparison is made wide */
    sim_i128 vel_q24 = (sim_i128)distance_q24 * CIA402_S / duration_ns;

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

static void cia402_stream_watch_targets(struct sim_cia402 *self)
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

static void cia402_stream_latch(struct sim_cia402 *self, uint32_t target)
{
    int64_t duration_ns = cia402_stream_interpolation_ns(self);
    int64_t from_counts = cia402_motion_counts(self->demand_q24);
    int32_t wanted, step;

    cia402_stream_watch_targets(self);
    /* Counts on the wire wrap at 2^32: the nearer way round. */
    wanted = cia402_stream_inside(self, (int32_t)target);
    step = (int32_t)((uint32_t)wanted -
                     (uint32_t)(from_counts - self->zero_counts));
    self->target_q24 = (from_counts + step) * (INT64_C(1) << 24);
    self->target_end_ns = cia402_now_ns(self) + duration_ns;
    cia402_stream_limit_slope(self, duration_ns);
}

void cia402_stream_latch_csp(struct sim_cia402 *self)
{
    cia402_stream_latch(self, self->value[CIA402_TARGET_POSITION] +
                                  self->value[CIA402_POSITION_OFFSET]);
}

/* While it is not switched on it stands. */
void cia402_stream_latch_ip(struct sim_cia402 *self)
{
    if (self->controlword & CIA402_CW_INTERPOLATE)
        cia402_stream_latch(self, self->value[CIA402_INTERPOLATION_TARGET]);
    else
        cia402_motion_stop_watching(self);
}

void cia402_stream_latch_csv(struct sim_cia402 *self)
{
    int64_t max_q24 = cia402_stream_vel_max_q24(self);
    int64_t vel_q24 = (cia402_od_signed(self, CIA402_TARGET_VELOCITY) +
                       cia402_od_signed(self, CIA402_VELOCITY_OFFSET)) *
                      (INT64_C(1) << 24);

    cia402_stream_watch_targets(self);
    self->limited = cia402_motion_abs(vel_q24) > max_q24;
    if (self->limited)
        vel_q24 = vel_q24 > 0 ? max_q24 : -max_q24;
    self->demand_vel_q24 = vel_q24;
}

void cia402_stream_targets_late(struct sim_cia402 *self)
{
    self->targets_late = true;
    cia402_com_error(self, CIA402_EMCY_RPDO_LATE, CIA402_ERROR_COM);
    cia402_power_connection_lost(self);
}

/* ---- statusword -------------------------------------------------------- */

unsigned cia402_stream_status(const struct sim_cia402 *self)
{
    return (self->motion == CIA402_MOTION_FOLLOW ? CIA402_SW_FOLLOWS : 0) |
           (self->following_error ? CIA402_SW_ERROR : 0);
}

unsigned cia402_stream_status_ip(const struct sim_cia402 *self)
{
    return self->controlword & CIA402_CW_INTERPOLATE
               ? cia402_stream_status(self)
               : 0;
}
