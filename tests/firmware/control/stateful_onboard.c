/* tests/firmware/control/stateful_onboard.c - axes that a board samples by itself
 * (stateful_board.c): which they are, what goes wrong with them, and the judge.
 *
 * An axis has one owner of its set point.  From the time that was said to a stop, a
 * fault or the end of the move it is the path's: the board's own is where ours is, but
 * for a tick, and at rest in the same place.  Else it is the board's, and what its drive
 * is told is that, to the bit.  In the tick of a stop or a fault every board has been
 * told to stop; READY is not said before all of them stand; and whatever an operator
 * asks for, in whatever order, no board is in fault for it. */
#include <math.h>

#include "motion/core/err.h"
#include "tests/firmware/control/stateful.h"

#define MS        INT64_C(1000000)
#define APART_S   1e-8 /* of the path, at rest */
#define TURN_NS   INT64_C(30000000)
#define END_TICKS 3
#define DEAF_S    60 /* until one that does not stop is braked by its quick stop */

/* --- what they are like ------------------------------------------------------------ */

static void draw_board(struct stateful *bench, struct stateful_board *board)
{
    board->period_ns = bench->config.period_ns;
    /* some 30 ms at the most, in which no axis comes to rest from full speed */
    board->turn_ticks = (int)stateful_in(
        bench, 1,
        1 + (TURN_NS / board->period_ns > 11 ? 11
                                             : TURN_NS / board->period_ns));
    board->lag_ticks = (int)stateful_in(bench, 0, 1);
    board->watch_ticks = 20 * board->turn_ticks;
    board->rest_s = 0.003 * pow(150, stateful_between(bench, 0, 1));
    board->has_ramps = !stateful_one_in(bench, 8);
}

/* One to three, of one axis or more; the others are the PC's. */
void stateful_draw_boards(struct stateful *bench)
{
    const unsigned count = (unsigned)stateful_in(bench, 1, STATEFUL_BOARDS);
    for (unsigned k = 0; k < count; k++)
        draw_board(bench, &bench->board[k]);
    for (unsigned i = 0; i < bench->axes; i++) {
        struct controller_axis_config *config = &bench->axis_config[i];
        struct stateful_board *board =
            &bench->board[stateful_in(bench, 0, count - 1)];
        if (stateful_one_in(bench, 3))
            continue;
        config->by_goals = config->needs_homing = false;
        /* a tick apart, and a tick until that is known, at any speed */
        config->following_floor_q32 +=
            stateful_q32(3 * stateful_unit(config->limit.vel_q32) *
                         (double)bench->config.period_ns / 1e9);
        config->feedback_max_age_ns =
            (8 * board->turn_ticks + 20) * bench->config.period_ns;
        bench->axis[i].profile.there = bench->axis[i].homes = false;
        bench->axis[i].has_stops = false;
        for (int which = 0; which < STATEFUL_SWITCHES; which++)
            bench->axis[i].zone[which].by_drive = false;
        bench->home[i].by = HOMING_NONE;
        board->axis[board->count++] = &bench->axis[i];
    }
}

void stateful_begin_boards(struct stateful *bench)
{
    for (unsigned k = 0; k < STATEFUL_BOARDS; k++)
        if (bench->board[k].count > 0)
            stateful_board_init(&bench->board[k]);
}

bool stateful_any_boards(const struct stateful *bench)
{
    for (unsigned i = 0; i < bench->axes; i++)
        if (bench->axis[i].board != NULL)
            return true;
    return false;
}

/* --- what goes wrong ----------------------------------------------------------------- */

void stateful_break_board(struct stateful *bench, struct stateful_board *board)
{
    const int64_t which = stateful_in(bench, 0, 9);
    if (which < 3) {
        stateful_board_fault(board);
        board->axis[0]->ill = stateful_one_in(bench, 2);
        stateful_may_come(bench, CONTROLLER_FAULT_DRIVE);
        stateful_note(bench, "(board: fault)");
    } else if (which < 5) {
        for (unsigned i = 0; i < board->count; i++) {
            board->axis[i]->away = true;
            board->axis[i]->state = HAL_DRIVE_OFFLINE;
        }
        stateful_may_come(bench, CONTROLLER_FAULT_OFFLINE);
        stateful_note(bench, "(board: gone)");
    } else if (which < 9) {
        board->late_ticks =
            (int)stateful_in(bench, 1, 12 * board->turn_ticks + 24);
        bench->judge.late = true;
        if (bench->judge.stop.kind > STATEFUL_HOLD)
            bench->judge.stop.by_ns +=
                (board->late_ticks + board->turn_ticks) * bench->period_ns;
        stateful_may_come(bench, CONTROLLER_FAULT_STALE);
        stateful_may_come(bench, CONTROLLER_FAULT_DRIVE);
        stateful_may_come(bench, CONTROLLER_FAULT_STATE);
        stateful_may_come(bench, CONTROLLER_FAULT_FOLLOWING);
        stateful_note(bench, "(board: late by %d)", board->late_ticks);
    } else {
        board->is_deaf = true;
        stateful_note(bench, "(board: does not stop)");
    }
}

void stateful_heal_boards(struct stateful *bench)
{
    for (unsigned k = 0; k < STATEFUL_BOARDS; k++)
        bench->board[k].is_deaf = false;
}

/* --- the judge -------------------------------------------------------------------------- */

/* The longest that one of them takes to stand, and to say so. */
double stateful_board_rest_s(const struct stateful *bench)
{
    double longest = 0;
    for (unsigned k = 0; k < STATEFUL_BOARDS; k++) {
        const struct stateful_board *board = &bench->board[k];
        const double turns = (double)(8 * board->turn_ticks + 2) *
                             (double)bench->period_ns / 1e9;
        const double late =
            (double)board->late_ticks * (double)bench->period_ns / 1e9;
        if (board->is_deaf)
            return DEAF_S;
        if (board->count > 0 && (stateful_board_moves(board) || board->stops ||
                                 board->does == STATEFUL_BOARD_WAITS))
            longest = fmax(longest, 2 * board->rest_s + turns + late);
    }
    return longest;
}

int stateful_board_ticks(const struct stateful *bench, unsigned i)
{
    const struct stateful_board *board = bench->axis[i].board;
    if (board == NULL)
        return 0;
    const double s = 2 * board->rest_s * 1e9 / (double)bench->period_ns;
    return (int)s + 8 * board->turn_ticks + board->late_ticks +
           board->watch_ticks;
}

/* What our clock was told and the board does are to be the same from here. */
static bool is_in_step(const struct stateful *bench,
                       const struct stateful_board *board)
{
    return stateful_board_plays(board) && !board->stops &&
           (bench->controller.state == CONTROLLER_MOVING ||
            bench->controller.state == CONTROLLER_HOLDING);
}

static void judge_told(struct stateful *bench, struct stateful_board *board)
{
    const enum controller_state state = bench->controller.state;
    const bool is_over = state == CONTROLLER_STOPPING ||
                         state == CONTROLLER_FAULT || state == CONTROLLER_OFF;
    if (is_over && !board->stops && board->does != STATEFUL_BOARD_STANDS &&
        board->axis[0]->state != HAL_DRIVE_OFFLINE)
        stateful_violate(bench, STATEFUL_UNTOLD, -1, "in %s",
                         controller_state_text(state));
}

/* Its last ticks may come after ours. */
static void judge_stands(struct stateful *bench, struct stateful_board *board)
{
    const double left_s =
        board->end_s - board->clock.s * (double)bench->period_ns / 1e9;
    const double tick_s =
        (double)bench->period_ns / 1e9 * fmax(board->clock.rate, 1);
    if (bench->controller.state == CONTROLLER_READY &&
        board->does != STATEFUL_BOARD_STANDS && left_s > END_TICKS * tick_s)
        stateful_violate(bench, STATEFUL_STANDS, -1, "a board, in %s",
                         controller_state_text(bench->controller.state));
}

static void judge_owner(struct stateful *bench, unsigned i)
{
    const struct stateful_axis *axis = &bench->axis[i];
    const struct stateful_board *board = axis->board;
    if (!axis->told || axis->state != HAL_DRIVE_ENABLED || board->stops ||
        stateful_board_plays(board) || board->does != STATEFUL_BOARD_STANDS ||
        board->late_ticks > 0 ||
        (board->state == HAL_DRIVE_TRACK_ENDED && /* ours comes there too */
         stateful_in_motion(bench->controller.state)))
        return;
    if (axis->told_q32 != axis->own_q32)
        stateful_violate(bench, STATEFUL_OWNER, (int)i, "%.9f, its own %.9f",
                         stateful_unit(axis->told_q32),
                         stateful_unit(axis->own_q32));
}

/* Both at rest, where nothing is under way. */
static void judge_place(struct stateful *bench, unsigned i)
{
    const struct stateful_axis *axis = &bench->axis[i];
    const struct stateful_board *board = axis->board;
    const struct controller *controller = &bench->controller;
    const double vel = stateful_unit(bench->axis_config[i].limit.vel_q32);
    const double off = stateful_unit(axis->told_q32 - axis->own_q32);
    if (!is_in_step(bench, board) || !axis->told ||
        board->does != STATEFUL_BOARD_PLAYS || board->clock.rate != 0 ||
        board->clock.ramp_on || controller->rate.rate_q30 != 0 ||
        controller->state != CONTROLLER_HOLDING)
        return;
    if (fabs(off) > vel * APART_S + 4 * 0x1p-32)
        stateful_violate(bench, STATEFUL_APART, (int)i, "by %.9f", off);
}

/* A hold is not forgotten, whatever is asked for after it; what is held does not go on
 * by itself. */
static void judge_held(struct stateful *bench)
{
    struct stateful_judge *judge = &bench->judge;
    const enum controller_state state = bench->controller.state;
    if (state != CONTROLLER_MOVING)
        judge->hold_by_ns = 0;
    if (judge->hold_by_ns != 0 && bench->clock_ns > judge->hold_by_ns)
        stateful_violate(bench, STATEFUL_LATE, -1, "a hold has not begun");
}

/* The operator's commands have begun, some ticks after they were accepted. */
static void follow_ramps(struct stateful *bench)
{
    struct stateful_judge *judge = &bench->judge;
    const enum controller_state state = bench->controller.state;
    if (judge->before_play == CONTROLLER_MOVING && state == CONTROLLER_HOLDING)
        stateful_stop_requested(bench, STATEFUL_HOLD);
    if (judge->before_play == CONTROLLER_HOLDING &&
        state == CONTROLLER_MOVING) {
        if (!judge->is_resumed)
            stateful_violate(bench, STATEFUL_RESUMED, -1, "rate %.4f",
                             (double)bench->controller.rate.rate_q30 * 0x1p-30);
        stateful_motion_begins(bench, STATEFUL_REST, CONTROLLER_HOLDING);
    }
}

/* What could begin did not: there has to be a reason. */
static void judge_refused(struct stateful *bench)
{
    struct stateful_judge *judge = &bench->judge;
    const int err = bench->playback.err;
    bool reason = judge->late || bench->skipped > 0 || judge->lost ||
                  stateful_any_coupled(bench);
    for (unsigned k = 0; k < STATEFUL_BOARDS; k++)
        reason = reason || bench->board[k].was_refused;
    if (err < 0 && err != judge->play_err && !reason && err != MOTION_E_LIMIT &&
        err != MOTION_E_UNHOMED)
        stateful_violate(bench, STATEFUL_REFUSED, -1, "%s",
                         motion_err_text(err));
    if (err < 0 && err != judge->play_err &&
        bench->controller.state == CONTROLLER_STOPPING)
        stateful_stop_requested(bench, STATEFUL_STOP);
    judge->play_err = err;
}

void stateful_judge_boards(struct stateful *bench)
{
    if (!stateful_any_boards(bench))
        return;
    follow_ramps(bench);
    judge_held(bench);
    judge_refused(bench);
    for (unsigned k = 0; k < STATEFUL_BOARDS; k++) {
        struct stateful_board *board = &bench->board[k];
        if (board->count == 0)
            continue;
        bench->tally.on_board += stateful_board_moves(board);
        judge_told(bench, board);
        judge_stands(bench, board);
    }
    for (unsigned i = 0; i < bench->axes; i++)
        if (bench->axis[i].board != NULL) {
            judge_owner(bench, i);
            judge_place(bench, i);
        }
}
