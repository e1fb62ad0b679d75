/* hal/drive_cia402_home.c - the drive's own homing.
 *
 *   WRITE    method, speeds, ramp and offset by SDO
 *   START    bit 4 up, until a statusword must know of it
 *   RUNNING  bits 13, 12, 10: 0 1 1 is home and standing, 1 x 1 is not
 *   STOP     halted: bit 8 up and bit 4 down, until bit 10
 *
 * Bit 4 goes down at the end.  Position is then the offset at the home point,
 * so it jumps; software limits that wait for it are written.
 * Source: CiA 402-2 9. */
#include "hal/drive_cia402_rows.h"

#define START        0x0010
#define HALT         0x0100
#define STANDS       0x0400
#define ATTAINED     0x1000
#define FAILED       0x2000
#define SYNCS_BEHIND 3 /* as in drive_cia402_go.c */

enum home_step { HOME_NONE, HOME_WRITE, HOME_START, HOME_RUNNING, HOME_STOP };

/* clang-format off */
static const struct drive_cia402_step home_write[] = {
    SET_OF(STEP_NEEDED, 0x6098, 0, 1, VALUE_HOME_METHOD),
    WRITE_OF(STEP_IF_SET, 0x6099, 1, 4, VALUE_HOME_FAST),
    WRITE_OF(STEP_IF_SET, 0x6099, 2, 4, VALUE_HOME_SLOW),
    WRITE_OF(STEP_IF_SET, 0x609A, 0, 4, VALUE_HOME_ACCELERATION),
    SET_OF(STEP_NEEDED, 0x607C, 0, 4, VALUE_HOME_OFFSET),
    END,
};
const struct drive_cia402_step drive_cia402_limits[] = {
    LIMITS,
    END,
};
/* clang-format on */

static void home_enter(struct drive_cia402 *self, enum home_step step)
{
    self->home.step = (uint8_t)step;
    self->home.syncs = 0;
}

/* ---- what the controller asks ------------------------------------------ */

static int home_convert(const struct drive_cia402 *self,
                        const struct hal_drive_home *home,
                        struct drive_cia402_home *to)
{
    int err = drive_cia402_counts(self, home->pos_q32, &to->offset_counts);

    if (err == MOTION_OK)
        err = drive_cia402_speed_of(self, home->fast_q32, &to->fast);
    if (err == MOTION_OK)
        err = drive_cia402_speed_of(self, home->slow_q32, &to->slow);
    if (err == MOTION_OK)
        err = drive_cia402_ramp_of(self, home->acc_q16, &to->acc);
    return err;
}

int drive_cia402_home(struct hal_drive *drive,
                      const struct hal_drive_home *home)
{
    struct drive_cia402 *self = drive_cia402_of(drive);
    struct drive_cia402_home to = { .step = HOME_WRITE };
    int err;

    if (!drive_cia402_is_enabled(self) || self->mode != HAL_DRIVE_HOMING ||
        self->job != DRIVE_CIA402_NO_JOB || self->home.step != HOME_NONE ||
        !drive_cia402_stands(self))
        return MOTION_E_STATE;
    if (home->method < INT8_MIN || home->method > INT8_MAX ||
        home->fast_q32 < 0 || home->slow_q32 < 0 || home->acc_q16 < 0 ||
        home->timeout_ns <= 0)
        return MOTION_E_ARG;
    err = home_convert(self, home, &to);
    if (err != MOTION_OK)
        return err;
    to.method = (int8_t)home->method;
    to.timeout_ns = home->timeout_ns;
    to.since_ns = self->now_ns;
    self->home = to;
    self->homing = HAL_DRIVE_HOMING_RUNNING;
    drive_cia402_job_begin(self, DRIVE_CIA402_JOB_HOME, home_write,
                           self->now_ns);
    return MOTION_OK;
}

static bool home_is_busy(const struct drive_cia402 *self)
{
    return self->home.step != HOME_NONE;
}

int drive_cia402_home_halt(struct drive_cia402 *self)
{
    if (!drive_cia402_is_enabled(self) || self->home.step == HOME_NONE)
        return MOTION_E_STATE;
    if (self->job == DRIVE_CIA402_JOB_HOME)
        drive_cia402_drop_list(self);
    home_enter(self, HOME_STOP);
    return MOTION_OK;
}

/* ---- every cycle ------------------------------------------------------- */

void drive_cia402_home_written(struct drive_cia402 *self, int64_t now_ns)
{
    (void)now_ns;
    home_enter(self, HOME_START);
}

void drive_cia402_home_done(struct drive_cia402 *self, int64_t now_ns)
{
    (void)now_ns;
    home_enter(self, HOME_NONE);
    self->homing = HAL_DRIVE_HOMING_DONE;
}

static uint16_t home_word(const struct drive_cia402 *self)
{
    if (self->home.step == HOME_STOP)
        return HALT;
    return self->home.step == HOME_START || self->home.step == HOME_RUNNING
               ? START
               : 0;
}

static void home_look(struct drive_cia402 *self, int64_t now_ns)
{
    const uint16_t word = self->statusword;

    if ((word & STANDS) == 0)
        return;
    if ((word & FAILED) != 0) {
        home_enter(self, HOME_NONE);
        self->homing = HAL_DRIVE_HOMING_FAILED;
    } else if ((word & ATTAINED) != 0 && self->config.limits_when_homed) {
        home_enter(self, HOME_WRITE); /* bit 4 down; the job ends it */
        drive_cia402_job_begin(self, DRIVE_CIA402_JOB_LIMITS,
                               drive_cia402_limits, now_ns);
    } else if ((word & ATTAINED) != 0) {
        drive_cia402_home_done(self, now_ns);
    }
}

/* Nothing is known of where it stands. */
static void home_stopping(struct drive_cia402 *self)
{
    if ((self->statusword & STANDS) == 0)
        return;
    home_enter(self, HOME_NONE);
    self->homing = HAL_DRIVE_HOMING_NONE;
}

static void home_on(struct drive_cia402 *self, int64_t now_ns)
{
    struct drive_cia402_home *home = &self->home;

    if (home->step != HOME_NONE && now_ns - home->since_ns > home->timeout_ns) {
        drive_cia402_say(self, "homing took longer than it may");
        drive_cia402_latch(self);
    } else if (home->syncs < SYNCS_BEHIND) {
        home->syncs++;
    } else if (home->step == HOME_START) {
        home_enter(self, HOME_RUNNING);
    } else if (home->step == HOME_RUNNING) {
        home_look(self, now_ns);
    } else if (home->step == HOME_STOP) {
        home_stopping(self);
    }
}

static void home_cancel(struct drive_cia402 *self)
{
    self->home = (struct drive_cia402_home){ .step = HOME_NONE };
    if (self->homing == HAL_DRIVE_HOMING_RUNNING)
        self->homing = HAL_DRIVE_HOMING_FAILED;
}

const struct drive_cia402_mode_ops drive_cia402_home_ops = {
    .mode_word = home_word,
    .mode_step = home_on,
    .mode_cancel = home_cancel,
    .mode_is_busy = home_is_busy,
};
