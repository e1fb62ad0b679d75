/* hal/drive/cia402/home.c - the drive's own homing.
 *
 *   WRITE    method, speeds and ramp by SDO; no offset (0x607C = 0), since
 *            makers do not agree on its sign
 *   START    bit 4 up, until bits 12 and 13 have been seen low: those of the
 *            last homing, or of the mode before, stay for a while
 *   RUNNING  bits 13, 12, 10: 0 1 1 is home and standing, 1 x 1 is not
 *   CHECK    bit 4 down; 0x6064 must be near 0; software limits
 *   STOP     halted: bit 8 up and bit 4 down, until bit 10
 *
 * The drive counts from its home point then, and the position of that point is
 * added here, so the position jumps.  Methods 35 and 37 take the place where
 * the axis stands, at once: their bits may never be low, and 0x6064 decides.
 * Source: CiA 402-2 9. */
#include "hal/drive/cia402/rows.h"

#include "motion/core/fixed.h"

#define START        0x0010
#define HALT         0x0100
#define STANDS       0x0400
#define ATTAINED     0x1000
#define FAILED       0x2000
#define SYNCS_BEHIND 3 /* as in go.c */

#define HERE_OLD 35
#define HERE     37

enum home_step {
    HOME_NONE,
    HOME_WRITE,
    HOME_START,
    HOME_RUNNING,
    HOME_CHECK,
    HOME_STOP,
};

/* clang-format off */
static const struct drive_cia402_step home_write[] = {
    SET_OF(STEP_NEEDED, 0x6098, 0, 1, VALUE_HOME_METHOD),
    WRITE_OF(STEP_IF_SET, 0x6099, 1, 4, VALUE_HOME_FAST),
    WRITE_OF(STEP_IF_SET, 0x6099, 2, 4, VALUE_HOME_SLOW),
    WRITE_OF(STEP_IF_SET, 0x609A, 0, 4, VALUE_HOME_ACCELERATION),
    SET(STEP_IF_THERE, 0x607C, 0, 4, 0),
    END,
};
static const struct drive_cia402_step home_check[] = {
    READ(STEP_NEEDED, 0x6064, 0, CHECK_HOME),
    LIMITS,
    END,
};
/* clang-format on */

static void home_enter(struct drive_cia402 *self, enum home_step step)
{
    self->home.step = (uint8_t)step;
    self->home.step_ns = self->now_ns;
    self->home.syncs = 0;
}

/* ---- what the controller asks ------------------------------------------ */

static bool home_is_here(const struct drive_cia402_home *home)
{
    return home->method == HERE || home->method == HERE_OLD;
}

/* It stops beyond the edge that it met at the slow speed: half a second at that
 * speed is far more than it needs, and the first step is allowed anyway. */
static int64_t home_off_max(const struct drive_cia402 *self,
                            const struct hal_drive_home *home)
{
    const int64_t vel_q32 =
        home->slow_q32 > 0 ? home->slow_q32 : home->fast_q32;
    const int64_t counts_q16 = hal_ratio_scale(&self->to_speed, vel_q32);

    return self->first_step_counts +
           (int64_t)(motion_fixed_abs(counts_q16) >> 17);
}

static int home_convert(const struct drive_cia402 *self,
                        const struct hal_drive_home *home,
                        struct drive_cia402_home *to)
{
    int err = drive_cia402_counts_of(self, home->pos_q32, &to->zero_counts);

    if (err == MOTION_OK)
        err = drive_cia402_speed_of(self, home->fast_q32, &to->fast);
    if (err == MOTION_OK)
        err = drive_cia402_speed_of(self, home->slow_q32, &to->slow);
    if (err == MOTION_OK)
        err = drive_cia402_ramp_of(self, home->acc_q32, &to->acc);
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
        home->fast_q32 < 0 || home->slow_q32 < 0 || home->acc_q32 < 0 ||
        home->timeout_ns <= 0)
        return MOTION_E_ARG;
    err = home_convert(self, home, &to);
    if (err != MOTION_OK)
        return err;
    to.method = (int8_t)home->method;
    to.off_max_counts =
        home_is_here(&to) ? self->first_step_counts : home_off_max(self, home);
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

/* "homing does not begin, 0x6041=0637" */
static void home_fault(struct drive_cia402 *self, const char *words)
{
    struct hal_text text = drive_cia402_say(self, words);

    drive_cia402_put_status(self, &text);
    drive_cia402_latch(self);
}

static bool home_waited(const struct drive_cia402 *self)
{
    return self->now_ns - self->home.step_ns > self->config.state_timeout_ns;
}

static void home_begin(struct drive_cia402 *self)
{
    if ((self->statusword & (ATTAINED | FAILED)) == 0 ||
        home_is_here(&self->home))
        home_enter(self, HOME_RUNNING);
    else if (home_waited(self))
        home_fault(self, "homing: bits 12, 13 of the last one stay");
}

/* Where the drive does not say it in homing, by its position: once it has come
 * to an end. */
static uint16_t home_bits(const struct drive_cia402 *self)
{
    const uint16_t bits = self->statusword & (STANDS | ATTAINED | FAILED);

    if (!drive_cia402_homes_without_bit_10(self))
        return bits;
    return (bits & (ATTAINED | FAILED)) != 0 && drive_cia402_stands(self)
               ? bits | STANDS
               : bits & (uint16_t)~STANDS;
}

/* Bit 10 alone: not begun, or broken off. */
static void home_look(struct drive_cia402 *self, int64_t now_ns)
{
    const uint16_t word = home_bits(self);

    if (word != STANDS)
        self->home.step_ns = now_ns;
    if ((word & STANDS) == 0)
        return;
    if ((word & FAILED) != 0) {
        home_enter(self, HOME_NONE);
        self->homing = HAL_DRIVE_HOMING_FAILED;
    } else if ((word & ATTAINED) != 0) {
        home_enter(self, HOME_CHECK);
        drive_cia402_job_begin(self, DRIVE_CIA402_JOB_HOMED, home_check,
                               now_ns);
    } else if (home_waited(self)) {
        home_fault(self, "homing does not begin");
    }
}

/* Nothing is known of where it stands. */
static void home_stopping(struct drive_cia402 *self)
{
    if (drive_cia402_homes_without_bit_10(self)
            ? !drive_cia402_stands(self)
            : (self->statusword & STANDS) == 0)
        return;
    home_enter(self, HOME_NONE);
    self->homing = HAL_DRIVE_HOMING_NONE;
}

static void home_on(struct drive_cia402 *self, int64_t now_ns)
{
    struct drive_cia402_home *home = &self->home;

    if (home->step != HOME_NONE && now_ns - home->since_ns > home->timeout_ns) {
        home_fault(self, "homing took longer than it may");
    } else if (home->syncs < SYNCS_BEHIND) {
        home->syncs++;
    } else if (home->step == HOME_START) {
        home_begin(self);
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
