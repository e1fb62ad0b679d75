/* hal/drive/slew_mcu/drive.c - what the controller asks of an axis of a board;
 * see drive.h. */
#include "hal/drive/slew_mcu/parts.h"

#include "hal/support/container_of.h"
#include "hal/support/text.h"

static struct drive_slew_mcu *drive_slew_mcu_of(struct hal_drive *drive)
{
    return CONTAINER_OF(drive, struct drive_slew_mcu, drive);
}

static int64_t drive_word_q32(const struct drive_slew_mcu *self, unsigned at)
{
    return (int64_t)mcu_words_get(self->word + at, 4);
}

/* --- requests --- */

static void drive_reset(struct drive_slew_mcu_board *board)
{
    if (board->phase == DRIVE_SLEW_MCU_LOST) {
        drive_slew_mcu_find(board);
        return;
    }
    board->resets = drive_slew_mcu_state(board) == BOARD_FAULT;
    board->is_fault = false;
    board->is_off = true;
}

static void drive_slew_mcu_request(struct hal_drive *drive,
                                   enum hal_drive_request request)
{
    struct drive_slew_mcu_board *board = drive_slew_mcu_of(drive)->board;

    switch (request) {
    case HAL_DRIVE_REQUEST_ENABLE:
        board->enables = !board->is_fault;
        board->is_off = board->is_quick = false;
        return;
    case HAL_DRIVE_REQUEST_RESET:
        drive_reset(board);
        return;
    case HAL_DRIVE_REQUEST_QUICK_STOP:
        board->is_quick = true;
        break;
    case HAL_DRIVE_REQUEST_OFF:
    case HAL_DRIVE_REQUEST_TORQUE_OFF: /* it has no other way than its stop */
        break;
    }
    board->enables = false;
    board->is_off = true;
    drive_slew_mcu_stop(board);
}

/* --- set points --- */

static int drive_slew_mcu_set_target(struct hal_drive *drive,
                                     const struct hal_drive_target *target)
{
    struct drive_slew_mcu *self = drive_slew_mcu_of(drive);

    self->past[self->past_count++ % DRIVE_SLEW_MCU_HISTORY] =
        (struct drive_slew_mcu_past){ self->board->now_ns, target->pos_q32 };
    return MOTION_OK;
}

/* The newest that had been given by then, or the first of all. */
static bool drive_demand(const struct drive_slew_mcu *self, int64_t t_ns,
                         int64_t *pos_q32)
{
    const unsigned count = self->past_count < DRIVE_SLEW_MCU_HISTORY
                               ? self->past_count
                               : DRIVE_SLEW_MCU_HISTORY;

    for (unsigned back = 1; back <= count; back++) {
        const struct drive_slew_mcu_past *past =
            &self->past[(self->past_count - back) % DRIVE_SLEW_MCU_HISTORY];
        *pos_q32 = past->pos_q32;
        if (past->t_ns <= t_ns)
            return true;
    }
    return count > 0;
}

/* --- feedback --- */

static enum hal_drive_state
drive_state_of(const struct drive_slew_mcu_board *board,
               const struct drive_slew_mcu *self)
{
    const enum hal_drive_state own =
        (enum hal_drive_state)self->word[MCU_AXIS_DRIVE];
    const enum board_state state = drive_slew_mcu_state(board);

    if (board->phase != DRIVE_SLEW_MCU_RUN || self->word_ns == 0 ||
        own == HAL_DRIVE_OFFLINE)
        return HAL_DRIVE_OFFLINE;
    if (board->is_fault || state == BOARD_FAULT)
        return HAL_DRIVE_FAULT;
    if (board->is_quick && board->stops)
        return HAL_DRIVE_QUICK_STOP;
    if (state == BOARD_OFF && own == HAL_DRIVE_OFF)
        return board->enables || board->is_enabling ? HAL_DRIVE_ENABLING
                                                    : HAL_DRIVE_OFF;
    /* its set point is known once the board is ready */
    if (state == BOARD_OFF ||
        (!self->is_up && self->word_ns <= board->ready_ns))
        return HAL_DRIVE_ENABLING;
    return own;
}

static void drive_fault_text(const struct drive_slew_mcu *self,
                             struct hal_drive_feedback *feedback)
{
    const struct drive_slew_mcu_board *board = self->board;
    struct hal_text text;

    hal_text_init(&text, feedback->fault_text, sizeof feedback->fault_text);
    if (board->why[0] != '\0') {
        hal_text_put(&text, board->why);
    } else if (feedback->state == HAL_DRIVE_FAULT) {
        const unsigned fault = board->state[MCU_STATE_FAULT];
        hal_text_put(&text, "the board: ");
        if (fault < self->config.fault_count)
            hal_text_put(&text, self->config.fault_text[fault]);
        else
            hal_text_dec(&text, fault);
    }
}

/* Its own set point is what it stands at: the first of ours is that then, and not what
 * the axis droops by. */
static void drive_place(const struct drive_slew_mcu *self,
                        struct hal_drive_feedback *feedback)
{
    feedback->pos_q32 = drive_word_q32(self, MCU_AXIS_ACTUAL);
    feedback->vel_q32 = self->vel_q32;
    feedback->t_ns = self->word_ns;
    feedback->demand_known = true;
    if (!drive_slew_mcu_is_ours(self->board) ||
        !drive_demand(self, self->word_ns, &feedback->demand_q32))
        feedback->demand_q32 = drive_word_q32(self, MCU_AXIS_TARGET);
}

static void drive_slew_mcu_feedback(struct hal_drive *drive,
                                    struct hal_drive_feedback *feedback)
{
    struct drive_slew_mcu *self = drive_slew_mcu_of(drive);
    const struct drive_slew_mcu_board *board = self->board;

    *feedback = (struct hal_drive_feedback){
        .state = drive_state_of(board, self),
        .mode = board->stops ? HAL_DRIVE_PROFILE_POSITION
                             : HAL_DRIVE_STREAM_POSITION,
        .following = true,
        .steps = board->steps | 1,
        .fault_code = board->state[MCU_STATE_FAULT],
    };
    feedback->torque_off = feedback->state == HAL_DRIVE_OFF ||
                           (feedback->state == HAL_DRIVE_FAULT &&
                            self->word[MCU_AXIS_DRIVE] == HAL_DRIVE_OFF);
    self->is_up = feedback->state == HAL_DRIVE_ENABLED;
    drive_place(self, feedback);
    drive_fault_text(self, feedback);
}

static const struct hal_drive_found *
drive_slew_mcu_found(struct hal_drive *drive)
{
    return &drive_slew_mcu_of(drive)->board->found;
}

static const struct hal_drive_ops drive_slew_mcu_ops = {
    .request = drive_slew_mcu_request,
    .set_target = drive_slew_mcu_set_target,
    .feedback = drive_slew_mcu_feedback,
    .tracks = &drive_slew_mcu_tracks,
    .found = drive_slew_mcu_found,
};

int drive_slew_mcu_init(struct drive_slew_mcu *self, struct modbus_bus *bus,
                        struct drive_slew_mcu *first,
                        const struct drive_slew_mcu_config *config)
{
    struct drive_slew_mcu_board *board;
    int err = MOTION_OK;

    *self = (struct drive_slew_mcu){ .drive.ops = &drive_slew_mcu_ops,
                                     .config = *config };
    if (config->axis >= MCU_AXES_MAX || config->watch_ms < 1 ||
        config->watch_ms > MCU_WATCH_MAX || config->lead_ns <= 0)
        return MOTION_E_ARG;
    board = first != NULL ? first->board : &self->own;
    if (first == NULL) {
        drive_slew_mcu_board_init(board, config->unit);
        err = modbus_bus_add(bus, &board->node);
    }
    if (err < 0)
        return err;
    if (board->axis[config->axis] != NULL)
        return MOTION_E_ARG;
    self->board = board;
    board->axis[config->axis] = self;
    if (config->axis >= board->axis_count)
        board->axis_count = config->axis + 1;
    return MOTION_OK;
}
