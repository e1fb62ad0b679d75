/* hal/drive/odrive/home.c - homing; see drive.h.
 *
 *   ask for state 11 until a heartbeat says so -> wait until it is left, with
 *   no error and (0.6) procedure result "success" -> closed loop again
 *
 * It may be so short that no heartbeat ever says 11: idle in a heartbeat that
 * left the drive after the question is its end too. */
#include "hal/drive/odrive/parts.h"

#include "hal/support/container_of.h"

enum odrive_seek_step { SEEK_ASK, SEEK_RUN, SEEK_ARM };

#define AGAIN_NS INT64_C(500000000)

static struct drive_odrive *odrive_of(struct drive_turns *turns)
{
    return CONTAINER_OF(turns, struct drive_odrive, turns);
}

static void seek_next(struct drive_turns *turns, enum odrive_seek_step step)
{
    turns->home.step = (unsigned)step;
    turns->home.since_ns = turns->now_ns;
    turns->retry_ns = turns->now_ns;
}

static bool seek_again(struct drive_turns *turns)
{
    if (turns->now_ns < turns->retry_ns)
        return false;
    turns->retry_ns = turns->now_ns + AGAIN_NS;
    return true;
}

/* Has a heartbeat come that left the drive after this step began? */
static bool seek_is_told(const struct drive_odrive *self)
{
    return self->heartbeat_ns >
           self->turns.home.since_ns + 2 * self->turns.config.period_ns;
}

static int seek_ask(struct drive_odrive *self)
{
    struct drive_turns *turns = &self->turns;
    const bool over = seek_is_told(self) && self->axis_state == ODRIVE_IDLE;

    if (turns->home.halted)
        seek_next(turns, SEEK_ARM);
    else if (self->axis_state == ODRIVE_HOMING || over)
        seek_next(turns, SEEK_RUN);
    else if (seek_again(turns))
        (void)odrive_send_u32(self, ODRIVE_SET_AXIS_STATE, ODRIVE_HOMING, 0, 1);
    return MOTION_E_AGAIN;
}

static int seek_fail(struct drive_odrive *self)
{
    struct hal_text text = drive_turns_say(&self->turns, "homing failed: ");

    hal_text_put(&text, drive_odrive_result_text(self->result));
    hal_text_put(&text, " (");
    hal_text_dec(&text, self->result);
    hal_text_put(&text, ")");
    return MOTION_E_PROTOCOL;
}

static int seek_run(struct drive_odrive *self)
{
    struct drive_turns *turns = &self->turns;

    if (!turns->home.halted) {
        if (self->axis_state == ODRIVE_HOMING)
            return MOTION_E_AGAIN;
        if (self->family == DRIVE_ODRIVE_06 && self->result != 0)
            return seek_fail(self);
        drive_turns_homed(turns);
    }
    seek_next(turns, SEEK_ARM);
    return MOTION_E_AGAIN;
}

static int seek_arm(struct drive_odrive *self)
{
    struct drive_turns *turns = &self->turns;

    if (turns->armed && seek_is_told(self))
        return turns->home.halted ? MOTION_E_REFUSED : MOTION_OK;
    if (seek_again(turns)) {
        odrive_arm(turns, true);
        turns->motion = DRIVE_TURNS_HOME; /* until it is armed */
    }
    return MOTION_E_AGAIN;
}

int odrive_seek(struct drive_turns *turns)
{
    struct drive_odrive *self = odrive_of(turns);

    if (turns->home.step == SEEK_ASK)
        return seek_ask(self);
    return turns->home.step == SEEK_RUN ? seek_run(self) : seek_arm(self);
}
