/* hal/drive/slew_mcu/tracks.c - a move goes to the board: loaded, started in a
 * tick of its own clock, sent on while it is played, stopped. */
#include "hal/drive/slew_mcu/parts.h"

#include "hal/support/container_of.h"
#include "motion/core/fixed.h"

#define TRACKS_BEGIN_NS INT64_C(1000000000)
#define TRACKS_CLOCK_NS INT64_C(1000000000)
/* Its clock is told what has been added since the start by 1 / 2^3 s; smaller
 * changes are not worth a command. */
#define TRACKS_CLOCK_SHIFT 3
#define TRACKS_CLOCK_LEAST 2000
#define TRACKS_ONE_Q30     (INT64_C(1) << 30)

/* A cookie: the axis, and how many segments; none: its head. */
#define TRACKS_COUNT_SHIFT 8

static struct drive_slew_mcu *tracks_of(struct hal_drive *drive)
{
    return CONTAINER_OF(drive, struct drive_slew_mcu, drive);
}

void drive_slew_mcu_move_forget(struct drive_slew_mcu_board *board)
{
    board->track = HAL_DRIVE_TRACK_NONE;
    board->ramp_state = DRIVE_SLEW_MCU_NO_RAMP;
    for (unsigned i = 0; i < board->axis_count; i++)
        board->axis[i]->track = NULL;
}

/* --- what is asked for --- */

void drive_slew_mcu_stop(struct drive_slew_mcu_board *board)
{
    const bool goes = board->track == HAL_DRIVE_TRACK_WAITING ||
                      board->track == HAL_DRIVE_TRACK_PLAYING ||
                      drive_slew_mcu_moves(board);

    drive_slew_mcu_move_forget(board);
    if (!goes || board->stops)
        return;
    board->stops = true;
    board->is_stop_asked = false;
    board->command.sequence = 0;
    board->is_new = true;
}

bool drive_slew_mcu_is_ours(const struct drive_slew_mcu_board *board)
{
    return board->track == HAL_DRIVE_TRACK_WAITING ||
           board->track == HAL_DRIVE_TRACK_PLAYING;
}

/* All axes stand where they are, until one is told otherwise. */
static void tracks_anew(struct drive_slew_mcu_board *board)
{
    drive_slew_mcu_move_forget(board);
    for (unsigned i = 0; i < board->axis_count; i++) {
        struct drive_slew_mcu *axis = board->axis[i];

        axis->head = (struct mcu_head){ .end_ns_q12 = 0 };
        axis->head.end.pos_q32 =
            (int64_t)mcu_words_get(axis->word + MCU_AXIS_TARGET, 4);
        axis->sent = axis->room = 0;
    }
    board->move_id++;
    if (board->move_id == 0)
        board->move_id = 1;
    board->heads = 0;
    board->is_fresh = true;
}

static int tracks_load(struct hal_drive *drive,
                       const struct motion_track *track)
{
    struct drive_slew_mcu *self = tracks_of(drive);
    struct drive_slew_mcu_board *board = self->board;

    if (track != NULL && track->outline != NULL)
        return MOTION_E_ARG;
    if (board->phase != DRIVE_SLEW_MCU_RUN || board->stops ||
        drive_slew_mcu_state(board) != BOARD_READY)
        return MOTION_E_STATE;
    if (!board->is_fresh)
        tracks_anew(board);
    self->track = track;
    if (track != NULL)
        mcu_head_of(track, &self->head);
    board->track = HAL_DRIVE_TRACK_LOADING;
    return MOTION_OK;
}

static enum hal_drive_track tracks_state(struct hal_drive *drive)
{
    const struct drive_slew_mcu_board *board = tracks_of(drive)->board;

    return board->track == HAL_DRIVE_TRACK_WAITING &&
                   (!board->is_told || board->command.sequence != 0)
               ? HAL_DRIVE_TRACK_LOADED /* it has not said that it will */
               : board->track;
}

static int64_t tracks_lead_ns(struct hal_drive *drive)
{
    return tracks_of(drive)->config.lead_ns;
}

static int tracks_start(struct hal_drive *drive, int64_t start_ns,
                        int64_t rate_q30)
{
    struct drive_slew_mcu_board *board = tracks_of(drive)->board;
    int64_t ticks;

    if (board->track == HAL_DRIVE_TRACK_WAITING &&
        board->start_ns == start_ns && board->rate_q30 == rate_q30)
        return MOTION_OK; /* said by another axis of it */
    if (board->track != HAL_DRIVE_TRACK_LOADED)
        return MOTION_E_STATE;
    /* its first set point, in the tick of a start, is a tick after path time
     * 0 */
    if (motion_fixed_muldiv(drive_slew_mcu_time_ns(board, start_ns), 1,
                            board->period_ns, &ticks) < 0)
        return MOTION_E_RANGE;
    board->start_at = board->anchor_at = (uint32_t)(ticks + 1);
    board->start_ns = start_ns;
    board->rate_q30 = rate_q30;
    board->start_apart_ns = drive_slew_mcu_apart_ns(board);
    board->start_ppb = board->told_ppb;
    board->is_told = false;
    board->track = HAL_DRIVE_TRACK_WAITING;
    return MOTION_OK;
}

/* In which of its ticks: 0 or more, of 2^32; else MOTION_E_RANGE. */
static int64_t tracks_ramp_at(struct drive_slew_mcu_board *board,
                              const struct hal_drive_ramp *ramp)
{
    const int64_t ns = ramp->since_ns < 0
                           ? drive_slew_mcu_time_ns(board, ramp->at_ns)
                           : ramp->since_ns;
    int64_t ticks, pieces;

    if (motion_fixed_muldiv(ns, 1, board->period_ns, &ticks) < 0 ||
        motion_fixed_muldiv(ramp->tick_ns, 1, board->period_ns, &pieces) < 0 ||
        pieces * board->period_ns != ramp->tick_ns ||
        (ramp->since_ns >= 0 && ticks * board->period_ns != ns))
        return MOTION_E_RANGE;
    if (ramp->since_ns < 0)
        board->anchor_at = (uint32_t)(ticks + 1);
    return (uint32_t)(ramp->since_ns < 0 ? ticks + 1
                                         : board->anchor_at + ticks);
}

static int tracks_ramp(struct hal_drive *drive,
                       const struct hal_drive_ramp *ramp)
{
    struct drive_slew_mcu_board *board = tracks_of(drive)->board;

    if (board->track == HAL_DRIVE_TRACK_ENDED)
        return MOTION_OK;
    if (board->ramp_state == DRIVE_SLEW_MCU_RAMP_REFUSED)
        return MOTION_E_STATE;
    if (board->ramp_state != DRIVE_SLEW_MCU_NO_RAMP &&
        board->ramp.at_ns == ramp->at_ns) /* this one */
        return board->ramp_state == DRIVE_SLEW_MCU_RAMP_DONE ||
                       (board->ramp_state == DRIVE_SLEW_MCU_RAMP_TOLD &&
                        board->command.sequence == 0)
                   ? MOTION_OK
                   : MOTION_E_AGAIN;
    /* it has not said yet that it has begun, or taken the one before */
    if (board->track == HAL_DRIVE_TRACK_WAITING ||
        board->ramp_state == DRIVE_SLEW_MCU_RAMP_ASKED ||
        board->ramp_state == DRIVE_SLEW_MCU_RAMP_TOLD)
        return MOTION_E_AGAIN;
    if (board->track != HAL_DRIVE_TRACK_PLAYING)
        return MOTION_E_STATE;
    const int64_t at = tracks_ramp_at(board, ramp);
    if (at < 0)
        return (int)at;
    board->ramp_at = (uint32_t)at;
    board->ramp = *ramp;
    board->ramp_state = DRIVE_SLEW_MCU_RAMP_ASKED;
    return MOTION_E_AGAIN;
}

static void tracks_stop(struct hal_drive *drive)
{
    drive_slew_mcu_stop(tracks_of(drive)->board);
}

const struct hal_drive_tracks drive_slew_mcu_tracks = {
    .load = tracks_load,
    .state = tracks_state,
    .lead_ns = tracks_lead_ns,
    .start = tracks_start,
    .ramp = tracks_ramp,
    .stop = tracks_stop,
};

/* --- pieces --- */

static void tracks_request_segments(struct drive_slew_mcu_board *board,
                                    struct drive_slew_mcu *axis,
                                    struct hal_modbus_request *request,
                                    uint16_t *cookie)
{
    uint16_t piece[MCU_PIECE_MAX];
    uint32_t count;

    count = axis->track->count - axis->sent;
    if (count > axis->room)
        count = axis->room;
    if (count > MCU_PIECE_SEGMENTS)
        count = MCU_PIECE_SEGMENTS;
    drive_slew_mcu_write(request, MCU_AT_PIECE, piece,
                         mcu_piece_put_track(piece, board->move_id,
                                             axis->config.axis, axis->sent,
                                             axis->track->segment + axis->sent,
                                             count));
    *cookie = (uint16_t)(axis->config.axis | count << TRACKS_COUNT_SHIFT);
}

/* Which has room, and of whose move the least is there: it is needed first. */
static struct drive_slew_mcu *
tracks_behind(const struct drive_slew_mcu_board *board)
{
    struct drive_slew_mcu *behind = NULL;
    int64_t least_ns_q12 = INT64_MAX;

    for (unsigned i = 0; i < board->axis_count; i++) {
        struct drive_slew_mcu *axis = board->axis[i];
        const struct motion_track *track = axis->track;

        if (track == NULL || axis->sent >= track->count || axis->room == 0 ||
            track->segment[axis->sent].start_ns_q12 >= least_ns_q12)
            continue;
        least_ns_q12 = track->segment[axis->sent].start_ns_q12;
        behind = axis;
    }
    return behind;
}

bool drive_slew_mcu_piece_request(struct drive_slew_mcu_board *board,
                                  struct hal_modbus_request *request,
                                  uint16_t *cookie)
{
    uint16_t piece[MCU_PIECE_MAX];
    struct drive_slew_mcu *behind;

    if (board->track == HAL_DRIVE_TRACK_NONE ||
        board->track == HAL_DRIVE_TRACK_ENDED || board->is_fresh ||
        board->stops || board->is_fault)
        return false;
    if (board->heads < board->axis_count) {
        const struct drive_slew_mcu *axis = board->axis[board->heads];
        drive_slew_mcu_write(request, MCU_AT_PIECE, piece,
                             mcu_piece_put_head(piece, board->move_id,
                                                axis->config.axis,
                                                &axis->head));
        *cookie = (uint16_t)axis->config.axis;
        return true;
    }
    behind = tracks_behind(board);
    if (behind != NULL)
        tracks_request_segments(board, behind, request, cookie);
    return behind != NULL;
}

static void tracks_sent(struct drive_slew_mcu *axis, uint32_t count)
{
    axis->sent += count;
    axis->room -= count < axis->room ? count : axis->room;
}

void drive_slew_mcu_piece_reply(struct drive_slew_mcu_board *board,
                                uint16_t cookie,
                                const struct hal_modbus_reply *reply)
{
    const unsigned count = cookie >> TRACKS_COUNT_SHIFT;
    struct drive_slew_mcu *axis =
        board->axis[cookie & ((1u << TRACKS_COUNT_SHIFT) - 1)];

    if (board->track == HAL_DRIVE_TRACK_NONE || board->is_fresh)
        return; /* of a move that is not wanted any more */
    if (reply->err == MOTION_E_REFUSED && reply->exception == 6) {
        axis->room = 0; /* until it says otherwise */
    } else if (reply->err == MOTION_E_REFUSED) {
        drive_slew_mcu_fail(board, "refused a piece of the move: ",
                            hal_modbus_exception_text(reply->exception));
    } else if (reply->err == MOTION_OK) {
        if (count == 0)
            board->heads++;
        else
            tracks_sent(axis, count);
    }
}

/* --- commands --- */

/* Faster, where it has fallen behind since the start. */
static bool tracks_clock_command(struct drive_slew_mcu_board *board,
                                 struct drive_slew_mcu_command *command)
{
    int64_t ppb = board->start_ppb +
                  ((drive_slew_mcu_apart_ns(board) - board->start_apart_ns) >>
                   TRACKS_CLOCK_SHIFT);

    if (board->now_ns < board->clock_due_ns ||
        board->ramp_state == DRIVE_SLEW_MCU_RAMP_TOLD)
        return false;
    ppb = ppb > MCU_CLOCK_MAX    ? MCU_CLOCK_MAX
          : ppb < -MCU_CLOCK_MAX ? -MCU_CLOCK_MAX
                                 : ppb;
    if (ppb - board->told_ppb < TRACKS_CLOCK_LEAST &&
        board->told_ppb - ppb < TRACKS_CLOCK_LEAST)
        return false;
    board->told_ppb = (int32_t)ppb;
    board->clock_due_ns = board->now_ns + TRACKS_CLOCK_NS;
    command->command = MCU_COMMAND_CLOCK;
    command->value = (uint32_t)board->told_ppb;
    return true;
}

static void tracks_ramp_command(struct drive_slew_mcu_board *board,
                                struct drive_slew_mcu_command *command)
{
    command->command = MCU_COMMAND_RAMP;
    command->value = (uint32_t)board->ramp.rate_q30;
    command->at = board->ramp_at;
    command->has_at = true;
    command->ramp = &board->ramp;
    board->ramp_state = DRIVE_SLEW_MCU_RAMP_TOLD;
    board->told_q30 = 0; /* its override is the ramp's, once it has begun */
}

bool drive_slew_mcu_move_command(struct drive_slew_mcu_board *board,
                                 struct drive_slew_mcu_command *command)
{
    if (board->stops) {
        if (board->is_stop_asked &&
            (drive_slew_mcu_state(board) == BOARD_STOPPING ||
             (!drive_slew_mcu_moves(board) &&
              board->state[MCU_STATE_WAITING] == 0)))
            return false;
        command->command = MCU_COMMAND_STOP;
        board->is_stop_asked = true;
        return true;
    }
    if (board->track == HAL_DRIVE_TRACK_PLAYING &&
        board->ramp_state == DRIVE_SLEW_MCU_RAMP_ASKED) {
        tracks_ramp_command(board, command);
        return true;
    }
    if (board->track == HAL_DRIVE_TRACK_PLAYING)
        return tracks_clock_command(board, command);
    if (board->track != HAL_DRIVE_TRACK_WAITING || board->is_told)
        return false;
    if (board->told_q30 != board->rate_q30) {
        command->command = MCU_COMMAND_OVERRIDE;
        command->value = (uint32_t)board->rate_q30;
        board->told_q30 = board->rate_q30;
        return true;
    }
    command->command = MCU_COMMAND_START;
    command->value = board->move_id;
    command->at = board->start_at;
    command->has_at = true;
    board->is_told = true;
    return true;
}

/* --- what came of it --- */

/* Where its set points are at rest. */
static bool tracks_are_known(const struct drive_slew_mcu_board *board)
{
    for (unsigned i = 0; i < board->axis_count && board->ready_ns != 0; i++)
        if (board->axis[i]->word_ns <= board->ready_ns)
            return false;
    return true;
}

/* Where its tracks end, or it has stopped by itself: heard nothing for too long, or was
 * told by somebody else. */
static void tracks_end(struct drive_slew_mcu_board *board)
{
    for (unsigned i = 0; i < board->axis_count; i++)
        if ((int64_t)mcu_words_get(board->axis[i]->word + MCU_AXIS_TARGET, 4) !=
            board->axis[i]->head.end.pos_q32) {
            drive_slew_mcu_fail(board, "stopped before its move had ended",
                                board->state[MCU_STATE_SILENT] != 0
                                    ? ": it heard nothing for too long"
                                    : "");
            return;
        }
    drive_slew_mcu_move_forget(board);
    board->track = HAL_DRIVE_TRACK_ENDED;
}

/* Begun in its tick, or not at all. */
static void tracks_ramp_look(struct drive_slew_mcu_board *board)
{
    if (board->ramp_state != DRIVE_SLEW_MCU_RAMP_TOLD ||
        board->command.sequence != 0 ||
        board->state[MCU_STATE_SEQUENCE] != board->sequence ||
        board->state[MCU_STATE_WAITING] != 0)
        return;
    board->ramp_state = DRIVE_SLEW_MCU_RAMP_DONE;
    if (board->state[MCU_STATE_RESULT] != MCU_RESULT_DONE &&
        drive_slew_mcu_moves(board)) /* else it came to its end before */
        drive_slew_mcu_fail(board, "did not follow the rate of the move", "");
}

void drive_slew_mcu_move_look(struct drive_slew_mcu_board *board)
{
    const bool moves = drive_slew_mcu_moves(board);
    const uint32_t id =
        (uint32_t)mcu_words_get(board->state + MCU_STATE_MOVE_ID, 2);
    const uint32_t began =
        (uint32_t)mcu_words_get(board->state + MCU_STATE_BEGAN, 2);

    if (board->stops && board->is_stop_asked && !moves &&
        board->state[MCU_STATE_WAITING] == 0 && board->command.sequence == 0 &&
        tracks_are_known(board))
        board->stops = false;
    tracks_ramp_look(board);
    switch (board->track) {
    case HAL_DRIVE_TRACK_LOADING:
        if (!board->is_fresh && board->heads == board->axis_count &&
            id == board->move_id && board->state[MCU_STATE_READY] == 1)
            board->track = HAL_DRIVE_TRACK_LOADED;
        return;
    case HAL_DRIVE_TRACK_WAITING:
        if (board->is_told && began == board->start_at)
            board->track = HAL_DRIVE_TRACK_PLAYING;
        else if (board->now_ns - board->start_ns > TRACKS_BEGIN_NS)
            drive_slew_mcu_fail(board, "did not begin in its tick", "");
        return;
    case HAL_DRIVE_TRACK_PLAYING:
        if (drive_slew_mcu_state(board) == BOARD_READY &&
            began == board->start_at && tracks_are_known(board))
            tracks_end(board);
        return;
    case HAL_DRIVE_TRACK_ENDED:
    case HAL_DRIVE_TRACK_NONE:
    case HAL_DRIVE_TRACK_LOADED:
        return;
    }
}
