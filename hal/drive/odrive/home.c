/* hal/drive/odrive/home.c - homing; see drive.h.
 *
 *   ask for state 11 until a heartbeat says so -> wait until it is left, with
 *   no error and (0.6) procedure result "success" -> closed loop again
 *
 * It may be so short that no heartbeat ever says 11: idle in a heartbeat that
 * left the drive after the question is its end too. */
#include "hal/drive/odrive/parts.h"

#include "hal/support/container_of.h"

enum odrive_seek_step { SEEK_REQUEST, SEEK_RUN, SEEK_ARM };

#define AGAIN_NS INT64_C(500000000)

static struct drive_odrive *odrive_of(struct drive_turn *turn)
{
    return CONTAINER_OF(turn, struct drive_odrive, turn);
}

static void seek_next(struct drive_turn *turn, enum odrive_seek_step step)
{
    turn->home.step = (unsigned)step;
    turn->home.since_ns = turn->now_ns;
    turn->retry_ns = turn->now_ns;
}

static bool seek_again(struct drive_turn *turn)
{
    if (turn->now_ns < turn->retry_ns)
        return false;
    turn->retry_ns = turn->now_ns + AGAIN_NS;
    return true;
}

/* Has a heartbeat come that left the drive after this step began? */
static bool seek_is_told(const struct drive_odrive *self)
{
    return self->heartbeat_ns >
           self->turn.home.since_ns + 2 * self->turn.config.period_ns;
}

static int seek_request(struct drive_odrive *self)
{
    struct drive_turn *turn = &self->turn;
    const bool over = seek_is_told(self) && self->axis_state == ODRIVE_IDLE;

    if (self->axis_state == ODRIVE_HOMING || over)
        seek_next(turn, SEEK_RUN);
    else if (seek_again(turn))
        (void)odrive_send_u32(self, ODRIVE_SET_AXIS_STATE, ODRIVE_HOMING, 0, 1);
    return MOTION_E_AGAIN;
}

static int seek_fail(struct drive_odrive *self)
{
    struct hal_text text = drive_turn_say(&self->turn, "homing failed: ");

    hal_text_put(&text, drive_odrive_result_text(self->result));
    hal_text_put(&text, " (");
    hal_text_dec(&text, self->result);
    hal_text_put(&text, ")");
    return MOTION_E_PROTOCOL;
}

static int seek_run(struct drive_odrive *self)
{
    struct drive_turn *turn = &self->turn;

    if (self->axis_state == ODRIVE_HOMING)
        return MOTION_E_AGAIN;
    if (self->family == DRIVE_ODRIVE_06 && self->result != 0)
        return seek_fail(self);
    drive_turn_homed(turn);
    seek_next(turn, SEEK_ARM);
    return MOTION_E_AGAIN;
}

static int seek_arm(struct drive_odrive *self)
{
    struct drive_turn *turn = &self->turn;

    if (turn->armed && seek_is_told(self))
        return turn->home.halted ? MOTION_E_REFUSED : MOTION_OK;
    if (seek_again(turn)) {
        odrive_arm(turn, true);
        turn->motion = DRIVE_TURN_HOME; /* until it is armed */
    }
    return MOTION_E_AGAIN;
}

int odrive_seek(struct drive_turn *turn)
{
    struct drive_odrive *self = odrive_of(turn);

    if (turn->home.step == SEEK_REQUEST)
        return seek_request(self);
    return turn->home.step == SEEK_RUN ? seek_run(self) : seek_arm(self);
}
