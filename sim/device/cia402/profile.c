/* sim/device/cia402/profile.c - motions by the drive's own ramps: PP and PV.
 *
 * PP: a set point is taken with the rising edge of bit 4 and acknowledged by
 * bit 12, which falls with bit 4 once there is room for another.  Bit 5: at
 * once; else after the one under way.  Bit 6: from the target before.
 * The speed is the highest from which the distance that is left suffices to brake:
 *   v^2 = 2 d (distance left after this step).
 * Source: CiA 402-2 10 and 11. */
#include "sim/device/cia402/parts.h"

#define CIA402_MS          INT64_C(1000000)
#define CIA402_CW_NEW      0x0010
#define CIA402_CW_AT_ONCE  0x0020
#define CIA402_CW_RELATIVE 0x0040
#define CIA402_SW_REACHED  0x0400
#define CIA402_SW_TAKEN    0x1000 /* PP */
#define CIA402_SW_STANDS   0x1000 /* PV */
#define CIA402_SW_ERROR    0x2000

/* Floor of the root; value < 2^126. */
static int64_t cia402_profile_root(sim_i128 value)
{
    sim_i128 root = 0;

    for (int bit = 62; bit >= 0; bit--) {
        const sim_i128 next = root + ((sim_i128)1 << bit);

        if (next * next <= value)
            root = next;
    }
    return (int64_t)root;
}

/* One step of speed from `from` towards `to`: away from rest by acc, towards
 * it by dec. */
static int64_t cia402_profile_towards(struct sim_cia402 *self, int64_t from,
                                      int64_t to, int64_t dt_ns)
{
    const bool braking = from != 0 && (from > 0) != (to - from > 0);
    const int64_t step = cia402_motion_gain_q24(
        self, braking ? self->profile.dec_q8 : self->profile.acc_q8, dt_ns);

    if (braking && cia402_motion_abs(from) <= step &&
        (to == 0 || (to > 0) != (from > 0)))
        return 0;
    if (cia402_motion_abs(to - from) <= step)
        return to;
    return to > from ? from + step : from - step;
}

void cia402_profile_run(struct sim_cia402 *self, int64_t vel_q24, int64_t dt_ns)
{
    const int64_t before_q24 = self->demand_vel_q24;

    self->demand_vel_q24 =
        cia402_profile_towards(self, before_q24, vel_q24, dt_ns);
    self->demand_q24 += sim_plant_travel_q24(
        &self->base.plant, (before_q24 + self->demand_vel_q24) / 2, dt_ns);
}

/* ---- profile position -------------------------------------------------- */

void cia402_profile_begin(struct sim_cia402 *self)
{
    self->profile = (struct sim_cia402_profile){ .target_q24 = self->demand_q24,
                                                 .acc_q8 = 256,
                                                 .dec_q8 = 256 };
}

static void cia402_profile_take(struct sim_cia402 *self)
{
    struct sim_cia402_profile *profile = &self->profile;
    const uint32_t *value = self->value;
    const bool relative = (self->controlword & CIA402_CW_RELATIVE) != 0;
    const uint32_t from =
        relative ? cia402_motion_seen(self, profile->target_q24) : 0;
    const int32_t wanted = cia402_stream_inside(
        self, (int32_t)(value[CIA402_TARGET_POSITION] + from));
    const int64_t max_q24 = cia402_stream_vel_max_q24(self);
    const int64_t here_counts = cia402_motion_counts(self->demand_q24);
    const int32_t distance =
        (int32_t)((uint32_t)wanted -
                  (uint32_t)(here_counts - self->zero_counts));

    profile->target_q24 = (here_counts + distance) * (INT64_C(1) << 24);
    profile->vel_q24 = (int64_t)value[CIA402_PROFILE_VELOCITY] << 24;
    if (profile->vel_q24 > max_q24)
        profile->vel_q24 = max_q24;
    profile->acc_q8 = (int64_t)value[CIA402_PROFILE_ACCELERATION] << 8;
    profile->dec_q8 = (int64_t)value[CIA402_PROFILE_DECELERATION] << 8;
    profile->waiting = false;
    profile->reached_ns = 0;
}

static bool cia402_profile_is_there(const struct sim_cia402 *self)
{
    return self->demand_q24 == self->profile.target_q24 &&
           self->demand_vel_q24 == 0;
}

void cia402_profile_control_pp(struct sim_cia402 *self)
{
    struct sim_cia402_profile *profile = &self->profile;
    const uint16_t now = self->controlword;
    const bool was_new = (self->controlword_before & CIA402_CW_NEW) != 0;

    if (!(now & CIA402_CW_NEW)) {
        profile->acknowledged = profile->waiting;
    } else if (!was_new && !profile->acknowledged && !self->halted) {
        profile->acknowledged = true;
        if ((now & CIA402_CW_AT_ONCE) || cia402_profile_is_there(self))
            cia402_profile_take(self);
        else
            profile->waiting = true;
    }
}

/* Near the end the steps are finer than a ramp: the last one is taken whole. */
static bool cia402_profile_is_last(struct sim_cia402 *self,
                                   int64_t distance_q24, int64_t dt_ns)
{
    const int64_t step =
        cia402_motion_gain_q24(self, self->profile.dec_q8, dt_ns);
    const int64_t reach = sim_plant_travel_q24(&self->base.plant, step, dt_ns);

    return cia402_motion_abs(distance_q24) <= reach &&
           cia402_motion_abs(self->demand_vel_q24) <= 2 * step;
}

static int64_t cia402_profile_speed(struct sim_cia402 *self,
                                    int64_t distance_q24, int64_t dt_ns)
{
    const struct sim_cia402_profile *profile = &self->profile;
    const int64_t left_q24 =
        cia402_motion_abs(distance_q24) -
        cia402_motion_abs(sim_plant_travel_q24(&self->base.plant,
                                               self->demand_vel_q24, dt_ns));
    /* v^2 in Q48: 2 dec d = dec (Q8) x d (Q24) x 2^17, below 2^40 2^57 2^17 */
    int64_t vel_q24 =
        left_q24 <= 0
            ? 0
            : cia402_profile_root((sim_i128)profile->dec_q8 * left_q24 << 17);

    if (vel_q24 > profile->vel_q24)
        vel_q24 = profile->vel_q24;
    return distance_q24 < 0 ? -vel_q24 : vel_q24;
}

void cia402_profile_step_pp(struct sim_cia402 *self, int64_t dt_ns)
{
    struct sim_cia402_profile *profile = &self->profile;
    const int64_t distance_q24 = profile->target_q24 - self->demand_q24;

    if (cia402_profile_is_last(self, distance_q24, dt_ns)) {
        self->demand_q24 = profile->target_q24;
        self->demand_vel_q24 = 0;
    } else {
        cia402_profile_run(
            self, cia402_profile_speed(self, distance_q24, dt_ns), dt_ns);
    }
    if (!profile->waiting || !cia402_profile_is_there(self))
        return;
    cia402_profile_take(self);
    profile->acknowledged = (self->controlword & CIA402_CW_NEW) != 0;
}

void cia402_profile_watch_pp(struct sim_cia402 *self, int64_t dt_ns)
{
    const int64_t off_q24 =
        cia402_motion_abs(self->profile.target_q24 - self->base.plant.pos_q24);

    if (off_q24 <= (int64_t)self->value[CIA402_POSITION_WINDOW] << 24)
        self->profile.reached_ns += dt_ns;
    else
        self->profile.reached_ns = 0;
}

unsigned cia402_profile_status_pp(const struct sim_cia402 *self)
{
    const struct sim_cia402_profile *profile = &self->profile;
    const bool reached =
        profile->reached_ns > 0 && !profile->waiting &&
        profile->reached_ns >=
            (int64_t)self->value[CIA402_POSITION_TIME] * CIA402_MS;

    return (reached ? CIA402_SW_REACHED : 0) |
           (profile->acknowledged ? CIA402_SW_TAKEN : 0) |
           (self->following_error ? CIA402_SW_ERROR : 0);
}

/* ---- profile velocity -------------------------------------------------- */

static int64_t cia402_profile_target_pv(const struct sim_cia402 *self)
{
    const int64_t max_q24 = cia402_stream_vel_max_q24(self);
    const int64_t vel_q24 =
        cia402_od_signed(self, CIA402_TARGET_VELOCITY) * (INT64_C(1) << 24);

    if (vel_q24 > max_q24)
        return max_q24;
    return vel_q24 < -max_q24 ? -max_q24 : vel_q24;
}

/* The loop is around the speed alone. */
void cia402_profile_step_pv(struct sim_cia402 *self, int64_t dt_ns)
{
    self->profile.acc_q8 = (int64_t)self->value[CIA402_PROFILE_ACCELERATION]
                           << 8;
    self->profile.dec_q8 = (int64_t)self->value[CIA402_PROFILE_DECELERATION]
                           << 8;
    self->demand_vel_q24 = cia402_profile_towards(
        self, self->demand_vel_q24, cia402_profile_target_pv(self), dt_ns);
    cia402_stream_step_velocity(self, dt_ns);
}

void cia402_profile_watch_pv(struct sim_cia402 *self, int64_t dt_ns)
{
    struct sim_cia402_profile *profile = &self->profile;
    const int64_t vel_q24 = self->base.plant.vel_q24;
    const int64_t off_q24 = cia402_motion_abs(
        vel_q24 -
        cia402_od_signed(self, CIA402_TARGET_VELOCITY) * (INT64_C(1) << 24));
    const bool fits = off_q24 <= (int64_t)self->value[CIA402_VELOCITY_WINDOW]
                                     << 24;
    const bool stands = cia402_motion_abs(vel_q24) <=
                        (int64_t)self->value[CIA402_STANDING_WINDOW] << 24;

    profile->reached_ns = fits ? profile->reached_ns + dt_ns : 0;
    profile->standing_ns = stands ? profile->standing_ns + dt_ns : 0;
}

static bool cia402_profile_for(int64_t ns, uint32_t ms)
{
    return ns > 0 && ns >= ms * CIA402_MS;
}

unsigned cia402_profile_status_pv(const struct sim_cia402 *self)
{
    const struct sim_cia402_profile *profile = &self->profile;
    const uint32_t *value = self->value;

    return (cia402_profile_for(profile->reached_ns, value[CIA402_VELOCITY_TIME])
                ? CIA402_SW_REACHED
                : 0) |
           (cia402_profile_for(profile->standing_ns,
                               value[CIA402_STANDING_TIME])
                ? CIA402_SW_STANDS
                : 0);
}
