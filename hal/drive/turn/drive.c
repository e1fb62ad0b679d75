/* hal/drive/turn/drive.c - what the controller asks; see drive.h. */
#include "hal/drive/turn/parts.h"

#include <string.h>

#include "hal/support/container_of.h"
#include "hal/support/first.h"
#include "motion/core/fixed.h"

#define NS_PER_S INT64_C(1000000000)
#define MAX_Q32  ((int64_t)DRIVE_TURN_MAX << 32)
/* Two counts of an encoder as these drives have them. */
#define DRIVE_TURN_NEAR_Q32 (MOTION_FIXED_ONE_Q32 / 4096)

static int32_t clamp_i32(int64_t value)
{
    if (value > INT32_MAX)
        return INT32_MAX;
    return value < INT32_MIN ? INT32_MIN : (int32_t)value;
}

static struct drive_turn *drive_turn_of(struct hal_drive *drive)
{
    return CONTAINER_OF(drive, struct drive_turn, drive);
}

/* ---- config to numbers, once: this part divides ---- */

static bool init_is_legal(const struct drive_turn_config *config)
{
    return config->turns_num != 0 && config->turns_den > 0 &&
           config->period_ns >= 62500 && config->period_ns <= 20000000 &&
           config->latency_ns >= 0 && config->answer_ns >= 0 &&
           config->state_timeout_ns >= 0 && config->stop_acc_q32 > 0 &&
           config->first_step_max_q32 >= 0 && config->rated_torque_mnm >= 0 &&
           config->vel_max_q32 >= 0 && config->readings < 1u << HAL_READINGS;
}

static void init_defaults(struct drive_turn_config *config)
{
    if (config->latency_ns == 0)
        config->latency_ns = config->period_ns / 2;
    if (config->state_timeout_ns == 0)
        config->state_timeout_ns = NS_PER_S;
    if (config->first_step_max_q32 == 0)
        config->first_step_max_q32 = MOTION_FIXED_ONE_Q32;
}

static int init_ratios(struct drive_turn *self)
{
    const int64_t num = self->config.turns_num, den = self->config.turns_den;
    const int32_t rated_mnm = self->config.rated_torque_mnm;
    int err = hal_ratio_init(&self->to_turns, num, den, 0);

    if (err == MOTION_OK)
        err = hal_ratio_init(&self->to_unit, num < 0 ? -den : den,
                             num < 0 ? -num : num, 0);
    if (err == MOTION_OK)
        err = hal_ratio_init(&self->to_acc, num < 0 ? -num : num, den, 0);
    if (err == MOTION_OK && rated_mnm > 0)
        err = hal_ratio_init(&self->to_mnm, num < 0 ? -rated_mnm : rated_mnm,
                             1000, 0);
    if (err == MOTION_OK && rated_mnm > 0)
        err = hal_ratio_init(&self->to_permille, num < 0 ? -1000 : 1000,
                             rated_mnm, 0);
    return err;
}

/* What the axis makes in HAL_STANDSTILL_NS at a thousandth of its speed. */
static int64_t config_slow_q32(const struct drive_turn_config *config)
{
    return config->vel_max_q32 / 1000 / (NS_PER_S / HAL_STANDSTILL_NS);
}

static int init_steps(struct drive_turn *self)
{
    const int64_t acc_q32 =
        hal_ratio_scale(&self->to_acc, self->config.stop_acc_q32);
    int64_t first_q32 =
        hal_ratio_scale(&self->to_turns, self->config.first_step_max_q32);

    self->first_step_q32 = first_q32 < 0 ? -first_q32 : first_q32;
    if (motion_fixed_muldiv(self->config.period_ns, INT64_C(1) << 60, NS_PER_S,
                            &self->tick_s_q60) != MOTION_OK ||
        motion_fixed_mulshift(acc_q32, self->tick_s_q60, 60,
                              &self->stop_step_q32) != MOTION_OK)
        return MOTION_E_RANGE;
    if (self->stop_step_q32 == 0) /* it must end */
        self->stop_step_q32 = 1;
    self->near_q32 =
        DRIVE_TURN_NEAR_Q32 +
        hal_ratio_scale(&self->to_acc, config_slow_q32(&self->config));
    return MOTION_OK;
}

int drive_turn_init(struct drive_turn *self, const struct drive_turn_ops *ops,
                    const struct drive_turn_config *config)
{
    int err;

    memset(self, 0, sizeof *self);
    if (!init_is_legal(config))
        return MOTION_E_ARG;
    self->drive.ops = &drive_turn_drive_ops;
    self->ops = ops;
    self->config = *config;
    self->readings.wanted = config->readings;
    init_defaults(&self->config);
    err = init_ratios(self);
    if (err == MOTION_OK)
        err = init_steps(self);
    if (err == MOTION_OK)
        drive_turn_start(self);
    return err;
}

/* ---- requests ---- */

static void request_reset(struct drive_turn *self)
{
    if (self->phase == DRIVE_TURN_LOST) {
        self->reset = true; /* once it has been ramped down */
    } else if (self->phase == DRIVE_TURN_LATCHED) {
        if (self->armed && self->motion != DRIVE_TURN_RAMP)
            drive_turn_brake(self);
        drive_turn_enter(self, DRIVE_TURN_RESET);
    }
}

static void drive_turn_request(struct hal_drive *drive,
                               enum hal_drive_request request)
{
    struct drive_turn *self = drive_turn_of(drive);
    const bool latched =
        self->phase != DRIVE_TURN_RUN && self->phase != DRIVE_TURN_START;

    if (request == HAL_DRIVE_REQUEST_RESET) {
        request_reset(self);
        return;
    }
    if (request == HAL_DRIVE_REQUEST_TORQUE_OFF &&
        self->phase != DRIVE_TURN_RUN)
        request = HAL_DRIVE_REQUEST_OFF;
    if (request == self->request ||
        (request == HAL_DRIVE_REQUEST_OFF &&
         self->request == HAL_DRIVE_REQUEST_TORQUE_OFF) ||
        (latched && request != HAL_DRIVE_REQUEST_OFF))
        return;
    self->request = request;
    drive_turn_pursue(self);
}

/* ---- set points ---- */

static bool is_reachable(int64_t pos_q32)
{
    return pos_q32 <= MAX_Q32 && pos_q32 >= -MAX_Q32;
}

static int drive_turn_set_target(struct hal_drive *drive,
                                 const struct hal_drive_target *target)
{
    struct drive_turn *self = drive_turn_of(drive);
    const int64_t pos_q32 = hal_ratio_scale(&self->to_turns, target->pos_q32);

    if (!is_reachable(pos_q32))
        return MOTION_E_RANGE;
    if (self->state != HAL_DRIVE_ENABLED ||
        self->mode != HAL_DRIVE_STREAM_POSITION)
        return MOTION_OK;
    if (!hal_first_fits(&self->first_target, pos_q32 - self->actual_q32,
                        self->first_step_q32)) { /* both small */
        drive_turn_say(self, HAL_FIRST_AWAY);
        drive_turn_latch(self);
        return MOTION_E_AWAY;
    }
    self->target_q32 = pos_q32;
    self->target_vel_q32 = hal_ratio_scale(&self->to_turns, target->vel_q32);
    if (self->config.rated_torque_mnm > 0)
        self->target_torque_mnm =
            clamp_i32(hal_ratio_scale(&self->to_mnm, target->torque_permille));
    self->given = true;
    return MOTION_OK;
}

/* ---- modes ---- */

static unsigned drive_turn_modes(struct hal_drive *drive)
{
    const struct drive_turn *self = drive_turn_of(drive);

    return self->phase == DRIVE_TURN_START || self->phase == DRIVE_TURN_LOST
               ? 0
               : self->ops->modes;
}

static bool is_at_rest(const struct drive_turn *self)
{
    return self->state == HAL_DRIVE_OFF ||
           (self->state == HAL_DRIVE_ENABLED && !self->home.broken_off &&
            drive_turn_is_standing(self) &&
            (self->motion == DRIVE_TURN_FOLLOW ||
             (self->motion == DRIVE_TURN_GO && self->go_done)));
}

static int drive_turn_set_mode(struct hal_drive *drive,
                               enum hal_drive_mode mode)
{
    struct drive_turn *self = drive_turn_of(drive);

    if ((unsigned)mode >= HAL_DRIVE_MODES ||
        (self->ops->modes & 1u << mode) == 0)
        return MOTION_E_EMPTY;
    if (!is_at_rest(self))
        return MOTION_E_STATE;
    if (mode == self->mode)
        return MOTION_OK;
    self->mode = mode;
    drive_turn_stand(self);
    self->first_target = true;
    return MOTION_OK;
}

static int go_convert(struct drive_turn *self, const struct hal_drive_go *go)
{
    const int64_t pos_q32 = hal_ratio_scale(&self->to_turns, go->pos_q32);
    const int64_t vel_q32 = hal_ratio_scale(&self->to_turns, go->vel_q32);
    const bool to_a_place = self->mode == HAL_DRIVE_PROFILE_POSITION;

    if (go->acc_q32 < 0 || go->dec_q32 < 0 || (to_a_place && go->vel_q32 <= 0))
        return MOTION_E_ARG;
    if (!is_reachable(vel_q32) || (to_a_place && !is_reachable(pos_q32)))
        return MOTION_E_RANGE;
    self->go.pos_q32 = pos_q32;
    self->go.vel_q32 = to_a_place && vel_q32 < 0 ? -vel_q32 : vel_q32;
    self->go.acc_q32 = hal_ratio_scale(&self->to_acc, go->acc_q32);
    self->go.dec_q32 = hal_ratio_scale(&self->to_acc, go->dec_q32);
    return MOTION_OK;
}

static int drive_turn_go(struct hal_drive *drive, const struct hal_drive_go *go)
{
    struct drive_turn *self = drive_turn_of(drive);
    int err;

    if (self->state != HAL_DRIVE_ENABLED ||
        (self->mode != HAL_DRIVE_PROFILE_POSITION &&
         self->mode != HAL_DRIVE_PROFILE_VELOCITY))
        return MOTION_E_STATE;
    err = go_convert(self, go);
    if (err != MOTION_OK)
        return err;
    self->motion = DRIVE_TURN_GO;
    self->go.sent_ns = 0;
    self->go_done = false;
    return MOTION_OK;
}

static int drive_turn_home(struct hal_drive *drive,
                           const struct hal_drive_home *home)
{
    struct drive_turn *self = drive_turn_of(drive);
    const int64_t pos_q32 = hal_ratio_scale(&self->to_turns, home->pos_q32);

    if (self->ops->seek == NULL)
        return MOTION_E_EMPTY;
    if (self->mode != HAL_DRIVE_HOMING || self->state != HAL_DRIVE_ENABLED ||
        !is_at_rest(self))
        return MOTION_E_STATE;
    if (home->timeout_ns <= 0)
        return MOTION_E_ARG;
    if (!is_reachable(pos_q32))
        return MOTION_E_RANGE;
    self->home.step = 0;
    self->home.halted = false;
    self->home.pos_q32 = pos_q32;
    self->home.since_ns = self->now_ns;
    self->retry_ns = self->now_ns;
    self->home.deadline_ns = self->now_ns + home->timeout_ns;
    self->homing = HAL_DRIVE_HOMING_RUNNING;
    self->motion = DRIVE_TURN_HOME;
    return MOTION_OK;
}

static int drive_turn_halt(struct hal_drive *drive)
{
    struct drive_turn *self = drive_turn_of(drive);

    if (self->state != HAL_DRIVE_ENABLED ||
        (self->motion != DRIVE_TURN_GO && self->motion != DRIVE_TURN_HOME))
        return MOTION_E_STATE;
    if (self->motion == DRIVE_TURN_HOME)
        self->homing = HAL_DRIVE_HOMING_FAILED;
    if (self->motion == DRIVE_TURN_GO || self->torque)
        drive_turn_brake(self);
    else /* it has come home: once it is armed again */
        self->home.halted = true;
    return MOTION_OK;
}

/* ---- feedback ---- */

static void put_demand(const struct drive_turn *self,
                       struct hal_drive_feedback *feedback)
{
    struct drive_turn_past past;
    int64_t since_ns, displacement_q32 = 0;

    if (self->motion != DRIVE_TURN_FOLLOW ||
        !drive_turn_in_force(self, self->actual_ns, &past))
        return;
    since_ns = self->actual_ns - past.given_ns - self->config.latency_ns;
    feedback->demand_age_ns = self->actual_ns - past.given_ns;
    if (!self->extrapolates)
        return;
    if (since_ns > NS_PER_S) /* long since at rest */
        since_ns = NS_PER_S;
    /* 1e-9 = 2305843009 / 2^61 */
    if (motion_fixed_mulshift(since_ns * 2305843009, past.vel_q32, 61,
                              &displacement_q32) != MOTION_OK)
        return;
    feedback->demand_known = true;
    feedback->demand_q32 =
        hal_ratio_scale(&self->to_unit, past.pos_q32 + displacement_q32);
}

/* What is done about its torque, then why. */
static void put_text(const struct drive_turn *self,
                     struct hal_drive_feedback *feedback)
{
    struct hal_text text;

    hal_text_init(&text, feedback->fault_text, sizeof feedback->fault_text);
    if (self->phase == DRIVE_TURN_LOST && self->left)
        hal_text_put(&text, self->torque ? "lost; trying to switch it off: "
                                         : "lost, then switched off: ");
    hal_text_put(&text, self->fault_text);
}

static void drive_turn_feedback(struct hal_drive *drive,
                                struct hal_drive_feedback *feedback)
{
    const struct drive_turn *self = drive_turn_of(drive);

    *feedback = (struct hal_drive_feedback){
        .state = self->state,
        .torque_off = drive_turn_is_watched(self) && !self->torque,
        .pos_q32 = hal_ratio_scale(&self->to_unit, self->actual_q32),
        .vel_q32 = hal_ratio_scale(&self->to_unit, self->actual_vel_q32),
        .t_ns = self->actual_ns,
        .following = self->state == HAL_DRIVE_ENABLED &&
                     self->motion == DRIVE_TURN_FOLLOW,
        .mode = self->mode,
        .arrived = self->motion != DRIVE_TURN_GO || self->go_done,
        .homing = self->homing,
        .fault_code = self->fault_code,
        .fault_code_awaited = self->code_awaited,
    };
    if (self->torque_known && self->config.rated_torque_mnm > 0) {
        feedback->torque_known = true;
        feedback->torque_permille =
            clamp_i32(hal_ratio_scale(&self->to_permille, self->torque_mnm));
    }
    put_demand(self, feedback);
    put_text(self, feedback);
}

static const struct hal_drive_found *drive_turn_found(struct hal_drive *drive)
{
    return &drive_turn_of(drive)->found;
}

const struct hal_drive_ops drive_turn_drive_ops = {
    .request = drive_turn_request,
    .set_target = drive_turn_set_target,
    .feedback = drive_turn_feedback,
    .modes = drive_turn_modes,
    .set_mode = drive_turn_set_mode,
    .go = drive_turn_go,
    .home = drive_turn_home,
    .halt = drive_turn_halt,
    .found = drive_turn_found,
};
