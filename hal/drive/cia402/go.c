/* hal/drive/cia402/go.c - motions by the drive's own ramps: PP and PV.
 *
 *   WRITE    ramps, speed and target by SDO
 *   READY    PP: bit 12 must be low, else the drive's buffer is full
 *   SET      PP: bit 4 up, until bit 12 is
 *   CLEAR    PP: bit 4 down, until bit 12 is; bit 10 now is that of this motion
 *   SETTLE   PV: until a statusword must reflect the new speed
 *   MOVING   until bit 10
 *   ARRIVED  bit 10 has been seen
 *   HALTING  bit 8 up, until bit 10; it stays up until the next motion, so that
 *            the one that was halted is never resumed
 *
 * A new motion begins with WRITE from any of them.  Bit 5: it takes the place
 * of the one under way.  Source: CiA 402-2 10.2, 11.2. */
#include "hal/drive/cia402/rows.h"

#define NEW_SET_POINT 0x0010
#define AT_ONCE       0x0020
#define HALT          0x0100
#define REACHED       0x0400
#define ACKNOWLEDGED  0x1000
/* SYNCs until the TPDO of a statusword made after an SDO or an RPDO of ours. */
#define SYNCS_BEHIND 3
#define BRAKING_NS   INT64_C(60000000000) /* no ramp takes longer */

enum go_step {
    GO_NONE,
    GO_WRITE,
    GO_READY,
    GO_SET,
    GO_CLEAR,
    GO_SETTLE,
    GO_MOVING,
    GO_ARRIVED,
    GO_HALTING,
};

/* clang-format off */
static const struct drive_cia402_step go_position[] = {
    WRITE_OF(STEP_NEEDED, 0x6081, 0, 4, VALUE_GO_VELOCITY),
    WRITE_OF(STEP_IF_SET, 0x6083, 0, 4, VALUE_GO_ACCELERATION),
    WRITE_OF(STEP_IF_SET, 0x6084, 0, 4, VALUE_GO_DECELERATION),
    WRITE_OF(STEP_NEEDED, 0x607A, 0, 4, VALUE_GO_TARGET),
    END,
};
static const struct drive_cia402_step go_velocity[] = {
    WRITE_OF(STEP_IF_SET, 0x6083, 0, 4, VALUE_GO_ACCELERATION),
    WRITE_OF(STEP_IF_SET, 0x6084, 0, 4, VALUE_GO_DECELERATION),
    WRITE_OF(STEP_NEEDED, 0x60FF, 0, 4, VALUE_GO_SPEED),
    END,
};
/* clang-format on */

static void go_enter(struct drive_cia402 *self, enum go_step step,
                     int64_t now_ns)
{
    self->go.step = (uint8_t)step;
    self->go.since_ns = now_ns;
    self->go.syncs = 0;
}

/* ---- what the controller asks ------------------------------------------ */

static int go_set_position(struct drive_cia402 *self,
                           struct drive_cia402_go *to,
                           const struct hal_drive_go *go)
{
    const int err = drive_cia402_counts(self, go->pos_q32, &to->target_counts);

    if (go->vel_q32 <= 0)
        return MOTION_E_ARG;
    return err == MOTION_OK ? drive_cia402_speed_of(self, go->vel_q32, &to->vel)
                            : err;
}

static int go_set_velocity(struct drive_cia402 *self,
                           struct drive_cia402_go *to,
                           const struct hal_drive_go *go)
{
    return drive_cia402_speed(
        self, hal_ratio_scale(&self->to_speed, go->vel_q32), &to->speed);
}

int drive_cia402_go(struct hal_drive *drive, const struct hal_drive_go *go)
{
    struct drive_cia402 *self = drive_cia402_of(drive);
    const bool position = self->mode == HAL_DRIVE_PROFILE_POSITION;
    struct drive_cia402_go to = self->go;
    int err;

    if (!drive_cia402_is_enabled(self) ||
        (!position && self->mode != HAL_DRIVE_PROFILE_VELOCITY) ||
        (self->job != DRIVE_CIA402_NO_JOB && self->job != DRIVE_CIA402_JOB_GO))
        return MOTION_E_STATE;
    if (go->acc_q32 < 0 || go->dec_q32 < 0 || go->timeout_ns < 0)
        return MOTION_E_ARG;
    err = position ? go_set_position(self, &to, go)
                   : go_set_velocity(self, &to, go);
    if (err == MOTION_OK)
        err = drive_cia402_ramp_of(self, go->acc_q32, &to.acc);
    if (err == MOTION_OK)
        err = drive_cia402_ramp_of(self, go->dec_q32, &to.dec);
    if (err != MOTION_OK)
        return err;
    to.timeout_ns = go->timeout_ns;
    to.begun_ns = self->now_ns;
    self->go = to;
    if (position) {
        self->target_counts = to.target_counts;
        self->target_ns = 0;
    }
    go_enter(self, GO_WRITE, self->now_ns);
    drive_cia402_job_begin(self, DRIVE_CIA402_JOB_GO,
                           position ? go_position : go_velocity, self->now_ns);
    return MOTION_OK;
}

static bool go_is_busy(const struct drive_cia402 *self)
{
    return self->go.step != GO_NONE && self->go.step != GO_ARRIVED;
}

bool drive_cia402_go_has_arrived(const struct drive_cia402 *self)
{
    return self->go.step == GO_ARRIVED;
}

int drive_cia402_go_halt(struct drive_cia402 *self)
{
    if (!drive_cia402_is_enabled(self) || self->go.step == GO_NONE ||
        (self->go.step == GO_ARRIVED &&
         self->mode == HAL_DRIVE_PROFILE_POSITION))
        return MOTION_E_STATE;
    if (self->job == DRIVE_CIA402_JOB_GO)
        drive_cia402_drop_list(self);
    self->go.halted = true;
    self->go.begun_ns = self->now_ns;
    self->go.timeout_ns = 0;
    go_enter(self, GO_HALTING, self->now_ns);
    return MOTION_OK;
}

/* ---- every cycle ------------------------------------------------------- */

void drive_cia402_go_written(struct drive_cia402 *self, int64_t now_ns)
{
    if (self->mode == HAL_DRIVE_PROFILE_POSITION) {
        go_enter(self, GO_READY, now_ns);
    } else {
        self->go.halted = false;
        go_enter(self, GO_SETTLE, now_ns);
    }
}

static uint16_t go_word(const struct drive_cia402 *self)
{
    const struct drive_cia402_go *go = &self->go;
    uint16_t word = go->halted ? HALT : 0;

    if (self->mode == HAL_DRIVE_PROFILE_POSITION)
        word |= AT_ONCE;
    return go->step == GO_SET ? word | NEW_SET_POINT : word;
}

static void go_fault(struct drive_cia402 *self, const char *words)
{
    drive_cia402_say(self, words);
    drive_cia402_latch(self);
}

/* The handshake: wait for bit 12 to be `level`, then on. */
static void go_shake(struct drive_cia402 *self, bool level, enum go_step next,
                     int64_t now_ns)
{
    const bool acknowledged = (self->statusword & ACKNOWLEDGED) != 0;

    if (acknowledged == level) {
        go_enter(self, next, now_ns);
        if (next == GO_SET)
            self->go.halted = false;
    } else if (now_ns - self->go.since_ns > self->config.state_timeout_ns) {
        go_fault(self, level ? "set point not acknowledged, bit 12 stays low"
                             : "set point not taken, bit 12 stays high");
    }
}

static void go_wait(struct drive_cia402 *self, enum go_step next,
                    int64_t now_ns)
{
    if (self->go.syncs < SYNCS_BEHIND)
        self->go.syncs++;
    else if (next != GO_NONE || (self->statusword & REACHED) != 0)
        go_enter(self, next, now_ns);
    else if (now_ns - self->go.since_ns > BRAKING_NS)
        go_fault(self, "halted, but bit 10 does not report standstill");
}

/* Bit 10 may still be that of the motion before. */
static void go_arrive(struct drive_cia402 *self, int64_t now_ns)
{
    if (self->go.syncs < SYNCS_BEHIND)
        self->go.syncs++;
    else if ((self->statusword & REACHED) != 0)
        go_enter(self, GO_ARRIVED, now_ns);
}

static void go_on(struct drive_cia402 *self, int64_t now_ns)
{
    const struct drive_cia402_go *go = &self->go;

    if (go->timeout_ns > 0 && go->step < GO_ARRIVED && go->step != GO_NONE &&
        now_ns - go->begun_ns > go->timeout_ns)
        go_fault(self, "the motion took longer than it may");
    else if (go->step == GO_READY)
        go_shake(self, false, GO_SET, now_ns);
    else if (go->step == GO_SET)
        go_shake(self, true, GO_CLEAR, now_ns);
    else if (go->step == GO_CLEAR)
        go_shake(self, false, GO_MOVING, now_ns);
    else if (go->step == GO_SETTLE)
        go_wait(self, GO_MOVING, now_ns);
    else if (go->step == GO_MOVING)
        go_arrive(self, now_ns);
    else if (go->step == GO_HALTING)
        go_wait(self, GO_NONE, now_ns);
}

static void go_cancel(struct drive_cia402 *self)
{
    self->go = (struct drive_cia402_go){ .step = GO_NONE };
}

const struct drive_cia402_mode_ops drive_cia402_go_ops = {
    .mode_word = go_word,
    .mode_step = go_on,
    .mode_cancel = go_cancel,
    .mode_is_busy = go_is_busy,
};
