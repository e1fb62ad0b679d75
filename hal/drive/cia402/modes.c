/* hal/drive/cia402/modes.c - modes of operation: a row for each; changing
 * them; jobs, the lists of SDO steps that are run meanwhile.
 *
 * A change: target = actual and speed = 0 are written, then 0x6060, then 0x6061
 * is asked until it agrees.  From the first of these steps on the image of
 * RPDO1 stands still, so that whichever mode is in force holds the axis. */
#include "hal/drive/cia402/rows.h"

#define INTERPOLATE 0x0010

static uint16_t modes_no_word(const struct drive_cia402 *self)
{
    (void)self;
    return 0;
}

static uint16_t modes_word_ip(const struct drive_cia402 *self)
{
    (void)self;
    return INTERPOLATE;
}

static void modes_no_step(struct drive_cia402 *self, int64_t now_ns)
{
    (void)self;
    (void)now_ns;
}

static void modes_no_cancel(struct drive_cia402 *self)
{
    (void)self;
}

static bool modes_never_busy(const struct drive_cia402 *self)
{
    (void)self;
    return false;
}

static const struct drive_cia402_mode_ops modes_stream_ops = {
    .mode_word = modes_no_word,
    .mode_step = modes_no_step,
    .mode_cancel = modes_no_cancel,
    .mode_is_busy = modes_never_busy,
};
static const struct drive_cia402_mode_ops modes_ip_ops = {
    .mode_word = modes_word_ip,
    .mode_step = modes_no_step,
    .mode_cancel = modes_no_cancel,
    .mode_is_busy = modes_never_busy,
};

/* clang-format off */
static const struct drive_cia402_mode modes_of_stream[] = {
    [DRIVE_CIA402_CSP] = { 8, true, true, false, &modes_stream_ops },
    [DRIVE_CIA402_IP] = { 7, true, true, false, &modes_ip_ops },
    [DRIVE_CIA402_CSV] = { 9, true, false, true, &modes_stream_ops },
};
/* STREAM_POSITION is one of the three above. */
static const struct drive_cia402_mode modes_of[] = {
    [HAL_DRIVE_STREAM_VELOCITY] = { 9, true, false, true, &modes_stream_ops },
    [HAL_DRIVE_PROFILE_POSITION] = { 1, false, true, false,
                                     &drive_cia402_go_ops },
    [HAL_DRIVE_PROFILE_VELOCITY] = { 3, false, false, true,
                                     &drive_cia402_go_ops },
    [HAL_DRIVE_HOMING] = { 6, false, false, false, &drive_cia402_home_ops },
};
/* clang-format on */

static const struct drive_cia402_mode *
modes_row(const struct drive_cia402 *self, enum hal_drive_mode mode)
{
    return mode == HAL_DRIVE_STREAM_POSITION
               ? &modes_of_stream[self->config.stream]
               : &modes_of[mode];
}

const struct drive_cia402_mode *
drive_cia402_mode(const struct drive_cia402 *self)
{
    return modes_row(self, self->mode);
}

const struct drive_cia402_mode *
drive_cia402_mode_wanted(const struct drive_cia402 *self)
{
    return modes_row(self, self->mode_wanted);
}

/* ---- which there are --------------------------------------------------- */

static bool modes_has(const struct drive_cia402 *self, enum hal_drive_mode mode)
{
    const bool told =
        (self->modes >> (modes_row(self, mode)->code - 1) & 1) != 0;

    if (mode == HAL_DRIVE_STREAM_POSITION)
        return true; /* start-up has seen to that */
    if (mode == HAL_DRIVE_STREAM_VELOCITY)
        return told && self->config.velocity;
    return told && self->speeds_fit;
}

static bool modes_is_found(const struct drive_cia402 *self)
{
    return self->phase != DRIVE_CIA402_START_UP &&
           self->phase != DRIVE_CIA402_LOST;
}

unsigned drive_cia402_modes(struct hal_drive *drive)
{
    const struct drive_cia402 *self = drive_cia402_of(drive);
    unsigned modes = 0;

    if (!modes_is_found(self))
        return 0;
    for (unsigned i = 0; i < HAL_DRIVE_MODES; i++)
        if (modes_has(self, (enum hal_drive_mode)i))
            modes |= 1u << i;
    return modes;
}

/* ---- jobs -------------------------------------------------------------- */

void drive_cia402_job_begin(struct drive_cia402 *self,
                            enum drive_cia402_job job,
                            const struct drive_cia402_step *list,
                            int64_t now_ns)
{
    self->job = job;
    drive_cia402_list_begin(self, list, now_ns);
}

static void modes_go_on(struct drive_cia402 *self, int64_t now_ns)
{
    (void)self;
    (void)now_ns;
}

static void modes_changed(struct drive_cia402 *self, int64_t now_ns)
{
    (void)now_ns;
    drive_cia402_modes_reset(self);
    self->mode = self->mode_wanted;
    self->mode_known = true;
    self->target_counts = self->preload_counts;
    self->target_ns = 0;
    self->target_speed_q16 = 0;
    self->first_target = true;
}

void drive_cia402_job_step(struct drive_cia402 *self, int64_t now_ns)
{
    static void (*const done[])(struct drive_cia402 * self, int64_t now_ns) = {
        [DRIVE_CIA402_NO_JOB] = NULL,
        [DRIVE_CIA402_JOB_MODE] = modes_changed,
        [DRIVE_CIA402_JOB_GO] = drive_cia402_go_written,
        [DRIVE_CIA402_JOB_HOME] = drive_cia402_home_written,
        [DRIVE_CIA402_JOB_HOMED] = drive_cia402_home_done,
        [DRIVE_CIA402_JOB_LIMITS] = modes_go_on,
    };
    const enum drive_cia402_job job = self->job;
    const int err = drive_cia402_list_step(self, now_ns);

    if (err == MOTION_E_AGAIN)
        return;
    if (err != MOTION_OK) {
        drive_cia402_latch(self);
        return;
    }
    self->list = NULL;
    self->job = DRIVE_CIA402_NO_JOB;
    done[job](self, now_ns);
}

/* ---- changing ---------------------------------------------------------- */

/* clang-format off */
static const struct drive_cia402_step modes_change[] = {
    PRELOAD,
    WRITE_OF(STEP_NEEDED, 0x6060, 0, 1, VALUE_MODE),
    READ(STEP_NEEDED, 0x6061, 0, CHECK_MODE),
    END,
};
/* clang-format on */

void drive_cia402_modes_change(struct drive_cia402 *self, int64_t now_ns)
{
    self->mode_known = false;
    drive_cia402_job_begin(self, DRIVE_CIA402_JOB_MODE, modes_change, now_ns);
}

int drive_cia402_set_mode(struct hal_drive *drive, enum hal_drive_mode mode)
{
    struct drive_cia402 *self = drive_cia402_of(drive);
    const struct drive_cia402_mode *now = drive_cia402_mode(self);

    if ((unsigned)mode >= HAL_DRIVE_MODES)
        return MOTION_E_ARG;
    if (self->phase != DRIVE_CIA402_RUN ||
        (self->state != HAL_DRIVE_OFF && self->state != HAL_DRIVE_ENABLED) ||
        drive_cia402_is_busy(self) || !drive_cia402_stands(self) ||
        now->ops->mode_is_busy(self))
        return MOTION_E_STATE;
    if (!modes_has(self, mode))
        return MOTION_E_EMPTY;
    if (mode == self->mode)
        return MOTION_OK;
    self->mode_wanted = mode;
    drive_cia402_modes_change(self, self->now_ns);
    return MOTION_OK;
}

void drive_cia402_modes_reset(struct drive_cia402 *self)
{
    const struct drive_cia402_mode *mode = drive_cia402_mode(self);

    mode->ops->mode_cancel(self);
}

int drive_cia402_halt(struct hal_drive *drive)
{
    struct drive_cia402 *self = drive_cia402_of(drive);

    return self->mode == HAL_DRIVE_HOMING ? drive_cia402_home_halt(self)
                                          : drive_cia402_go_halt(self);
}
