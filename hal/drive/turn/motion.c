/* hal/drive/turn/motion.c - set points: where to, from one cycle to the next.
 * See drive.h. */
#include "hal/drive/turn/parts.h"

#include "hal/support/float32.h"
#include "motion/core/err.h"
#include "motion/core/fixed.h"

#define NS_PER_S INT64_C(1000000000)
/* Slower is standing: 1/64 turn/s, above the noise of a velocity estimate. */
#define STANDING_Q32 (MOTION_FIXED_ONE_Q32 / 64)
/* Turns, and turns/s: more is no motor. */
#define REAL_MAX_Q32 (8 * ((int64_t)DRIVE_TURN_MAX << 32))

void drive_turn_stand(struct drive_turn *self)
{
    self->motion = DRIVE_TURN_FOLLOW;
    self->target_q32 = self->actual_q32;
    self->target_vel_q32 = 0;
    self->target_torque_mnm = 0;
    self->home.broken_off = false;
    self->given = false;
    self->past_count = 0;
}

/* From where it was measured to where it is when a set point of now reaches
 * it. */
static int64_t motion_since_q32(const struct drive_turn *self)
{
    const int64_t since_ns =
        self->now_ns - self->actual_ns + self->config.latency_ns;
    int64_t distance_q32 = 0;

    if (since_ns > 0 && since_ns < NS_PER_S)
        (void)motion_fixed_mulshift(since_ns * 2305843009, self->actual_vel_q32,
                                    61, &distance_q32); /* 1e-9 2^61 */
    return distance_q32;
}

void drive_turn_brake(struct drive_turn *self)
{
    if (self->motion == DRIVE_TURN_HOME) {
        self->home.broken_off = true;
        self->home.told = false;
        self->home.deadline_ns = self->now_ns + self->config.state_timeout_ns;
    }
    if (self->motion != DRIVE_TURN_FOLLOW || self->home.broken_off) {
        self->target_q32 = self->actual_q32 + motion_since_q32(self);
        self->target_vel_q32 = self->actual_vel_q32;
    }
    self->motion =
        self->target_vel_q32 == 0 ? DRIVE_TURN_FOLLOW : DRIVE_TURN_RAMP;
    self->ramped_ns = self->now_ns;
    self->target_torque_mnm = 0;
    self->given = false;
    self->past_count = 0;
}

bool drive_turn_is_standing(const struct drive_turn *self)
{
    return self->actual_vel_q32 <= STANDING_Q32 &&
           self->actual_vel_q32 >= -STANDING_Q32 && !drive_turn_ramps(self);
}

bool drive_turn_rolls(const struct drive_turn *self)
{
    return self->armed && self->now_ns - self->ramped_ns <= HAL_DRIVE_ROLL_NS &&
           !hal_standstill_is(&self->standstill, self->actual_ns);
}

bool drive_turn_ramps(const struct drive_turn *self)
{
    return self->motion == DRIVE_TURN_RAMP || self->motion == DRIVE_TURN_SLOW;
}

/* v goes to 0 by a step a tick; the displacement is that of the mean speed.  |v| stays
 * below 2^15 turns/s x 2^32, the displacement of a tick below that. */
static void motion_ramp(struct drive_turn *self)
{
    const int64_t before_q32 = self->target_vel_q32;
    const int64_t step_q32 = self->stop_step_q32;
    int64_t after_q32 = 0, displacement_q32 = 0;

    if (before_q32 > step_q32)
        after_q32 = before_q32 - step_q32;
    else if (before_q32 < -step_q32)
        after_q32 = before_q32 + step_q32;
    if (motion_fixed_mulshift((before_q32 >> 1) + (after_q32 >> 1),
                              self->tick_s_q60, 60,
                              &displacement_q32) == MOTION_OK)
        self->target_q32 += displacement_q32;
    self->target_vel_q32 = after_q32;
    self->ramped_ns = self->now_ns;
    if (after_q32 == 0)
        self->motion = DRIVE_TURN_FOLLOW;
}

static void motion_remember(struct drive_turn *self)
{
    struct drive_turn_past *past = &self->past[self->past_at];

    *past = (struct drive_turn_past){ self->now_ns, self->target_q32,
                                      self->target_vel_q32 };
    self->past_at = (self->past_at + 1) % DRIVE_TURN_HISTORY;
    if (self->past_count < DRIVE_TURN_HISTORY)
        self->past_count++;
}

/* One that is not new has been reached: it stands there. */
static void motion_follow(struct drive_turn *self)
{
    if (self->given) {
        motion_remember(self);
        self->given = false;
        return;
    }
    self->target_torque_mnm = 0;
    if (self->target_vel_q32 == 0)
        return;
    self->target_vel_q32 = 0;
    if (self->extrapolates && self->past_count > 0)
        motion_remember(self); /* it goes on no farther */
}

bool drive_turn_next(struct drive_turn *self)
{
    const bool lost = self->phase == DRIVE_TURN_LOST;
    const bool slows = self->motion == DRIVE_TURN_SLOW;
    const bool wanted = lost ? drive_turn_ramps(self)
                             : self->armed || self->home.broken_off ||
                                   (self->phase == DRIVE_TURN_RUN &&
                                    self->request == HAL_DRIVE_REQUEST_ENABLE);

    if (self->motion == DRIVE_TURN_FOLLOW)
        motion_follow(self);
    else if (drive_turn_ramps(self))
        motion_ramp(self);
    if (slows && self->motion == DRIVE_TURN_FOLLOW)
        return false; /* it has no place to follow to */
    return wanted && self->phase != DRIVE_TURN_START &&
           self->request != HAL_DRIVE_REQUEST_TORQUE_OFF;
}

int64_t drive_turn_raw_q32(const struct drive_turn *self, int64_t pos_q32)
{
    return pos_q32 - self->origin_q32; /* both within 2^15 turns */
}

struct drive_turn_point drive_turn_point(const struct drive_turn *self)
{
    return (struct drive_turn_point){
        .pos_q32 = drive_turn_raw_q32(self, self->target_q32),
        .vel_q32 = self->target_vel_q32,
        .torque_mnm = self->target_torque_mnm,
    };
}

void drive_turn_homed(struct drive_turn *self)
{
    const int64_t before_q32 = self->origin_q32;

    self->actual_q32 -= self->origin_q32;
    self->origin_q32 = self->home.pos_q32;
    self->actual_q32 += self->origin_q32;
    hal_standstill_shift(&self->standstill, self->origin_q32 - before_q32);
    self->homing = HAL_DRIVE_HOMING_DONE;
}

static bool motion_is_real(int64_t value_q32)
{
    return value_q32 <= REAL_MAX_Q32 && value_q32 >= -REAL_MAX_Q32;
}

bool drive_turn_note(struct drive_turn *self, int64_t pos_q32, int64_t vel_q32,
                     int64_t t_ns)
{
    if (!motion_is_real(pos_q32) || !motion_is_real(vel_q32))
        return false;
    self->actual_q32 = pos_q32 + self->origin_q32;
    self->actual_vel_q32 = vel_q32;
    self->actual_ns = t_ns - self->config.answer_ns;
    if (!self->positioned)
        hal_standstill_rest(&self->standstill, self->actual_q32,
                            self->actual_ns);
    hal_standstill_note(&self->standstill, self->actual_q32, self->near_q32,
                        self->actual_ns);
    self->positioned = true;
    return true;
}

void drive_turn_forget_torque(struct drive_turn *self)
{
    self->torque_known = false;
    self->torque_mnm = 0;
}

void drive_turn_note_torque(struct drive_turn *self, uint32_t heard,
                            int64_t nm_q32)
{
    int64_t mnm_q32, torque_mnm;

    drive_turn_forget_torque(self);
    if (!hal_float32_is_finite(heard) ||
        motion_fixed_mulshift(nm_q32, 1000, 0, &mnm_q32) < 0 ||
        motion_fixed_mulshift(hal_float32_to_fixed(heard, 16), mnm_q32, 48,
                              &torque_mnm) < 0 ||
        torque_mnm < INT32_MIN || torque_mnm > INT32_MAX)
        return;
    self->torque_known = true;
    self->torque_mnm = (int32_t)torque_mnm;
}

bool drive_turn_in_force(const struct drive_turn *self, int64_t t_ns,
                         struct drive_turn_past *past)
{
    unsigned at = self->past_at;

    for (unsigned i = 0; i < self->past_count; i++) {
        at = (at + DRIVE_TURN_HISTORY - 1) % DRIVE_TURN_HISTORY;
        if (self->past[at].given_ns + self->config.latency_ns <= t_ns) {
            *past = self->past[at];
            return true;
        }
    }
    return false;
}
