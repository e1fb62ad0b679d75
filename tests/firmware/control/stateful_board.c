/* tests/firmware/control/stateful_board.c - a board that samples tracks by itself, as
 * hal/drive.h has it, and its drive on the PC; of the bench's own, in double.
 *
 * Its line has one question at a time: what it is told, or how it is; whoever asks
 * hears of it `turn_ticks` later.  From the tick that it was told on its clock reads the
 * path, changes its rate in the ticks that it was told, and ends where its tracks do.
 * A stop takes the place of whatever it was to be told: it slows down to rest in a time
 * of its own, sooner or later than any axis beside it.  Told too late it does nothing
 * of it.  Hearing nothing for long it stops, and takes torque off at rest. */
#include <math.h>

#include "motion/core/err.h"
#include "motion/core/fixed.h"
#include "motion/core/track.h"
#include "tests/firmware/control/stateful_machine.h"

#define SECOND_NS 1e9
#define STOOD     2 /* looks until it is known where it stands */

static struct stateful_axis *axis_of(struct hal_drive *drive)
{
    return (struct stateful_axis *)drive;
}

static struct stateful_board *board_of(struct hal_drive *drive)
{
    return axis_of(drive)->board;
}

static double tick_s(const struct stateful_board *board)
{
    return (double)board->period_ns / SECOND_NS;
}

bool stateful_board_moves(const struct stateful_board *board)
{
    return board->does == STATEFUL_BOARD_PLAYS ||
           board->does == STATEFUL_BOARD_RESTS;
}

bool stateful_board_plays(const struct stateful_board *board)
{
    return board->state == HAL_DRIVE_TRACK_WAITING ||
           board->state == HAL_DRIVE_TRACK_PLAYING;
}

/* --- what it is asked for ------------------------------------------------------ */

static void board_forget(struct stateful_board *board)
{
    board->state = HAL_DRIVE_TRACK_NONE;
    board->is_told = false;
    board->clock.ramp.at_ns = 0;
    if (board->order != STATEFUL_BOARD_STOP)
        board->order = STATEFUL_BOARD_NOTHING;
}

void stateful_board_stop(struct stateful_board *board)
{
    const bool goes = board->state == HAL_DRIVE_TRACK_WAITING ||
                      board->state == HAL_DRIVE_TRACK_PLAYING ||
                      stateful_board_moves(board);
    board_forget(board);
    if (!goes)
        return;
    board->order = STATEFUL_BOARD_STOP;
    board->stops = true;
    board->stood = 0;
    for (unsigned i = 0; i < board->count; i++)
        board->axis[i]->mode = HAL_DRIVE_PROFILE_POSITION;
}

static void tracks_stop(struct hal_drive *drive)
{
    stateful_board_stop(board_of(drive));
}

static int tracks_load(struct hal_drive *drive,
                       const struct motion_track *track)
{
    struct stateful_axis *axis = axis_of(drive);
    struct stateful_board *board = axis->board;
    if (track != NULL && track->outline != NULL)
        return MOTION_E_ARG;
    /* until it has been heard that it stands */
    if (axis->state != HAL_DRIVE_ENABLED || board->stops ||
        stateful_board_plays(board))
        return MOTION_E_STATE;
    if (board->order != STATEFUL_BOARD_LOAD) {
        board->end_s = 0;
        for (unsigned i = 0; i < board->count; i++)
            board->axis[i]->track = NULL;
    }
    axis->track = track;
    if (track != NULL)
        board->end_s = fmax(board->end_s, (double)track->end_ns_q12 /
                                              (double)MOTION_FIXED_S_Q12);
    board->order = STATEFUL_BOARD_LOAD;
    board->wait = 1 + (int)board->count;
    board->state = HAL_DRIVE_TRACK_LOADING;
    return MOTION_OK;
}

static enum hal_drive_track tracks_state(struct hal_drive *drive)
{
    const struct stateful_board *board = board_of(drive);
    return board->state == HAL_DRIVE_TRACK_WAITING && !board->is_told
               ? HAL_DRIVE_TRACK_LOADED
               : board->state;
}

static int64_t tracks_lead_ns(struct hal_drive *drive)
{
    const struct stateful_board *board = board_of(drive);
    return (4 * board->turn_ticks + 4) * board->period_ns;
}

static int tracks_start(struct hal_drive *drive, int64_t start_ns,
                        int64_t rate_q30)
{
    struct stateful_board *board = board_of(drive);
    if (board->state == HAL_DRIVE_TRACK_WAITING &&
        board->start_ns == start_ns && board->rate_q30 == rate_q30)
        return MOTION_OK;
    if (board->state != HAL_DRIVE_TRACK_LOADED)
        return MOTION_E_STATE;
    board->start_ns = start_ns;
    board->rate_q30 = rate_q30;
    board->is_told = false;
    board->order = STATEFUL_BOARD_START;
    board->state = HAL_DRIVE_TRACK_WAITING;
    return MOTION_OK;
}

static int tracks_ramp(struct hal_drive *drive,
                       const struct hal_drive_ramp *ramp)
{
    struct stateful_board *board = board_of(drive);
    struct stateful_board_clock *clock = &board->clock;
    if (board->state == HAL_DRIVE_TRACK_ENDED)
        return MOTION_OK;
    if (board->state == HAL_DRIVE_TRACK_WAITING)
        return MOTION_E_AGAIN;
    if (board->state != HAL_DRIVE_TRACK_PLAYING)
        return MOTION_E_STATE;
    if (clock->ramp.at_ns == ramp->at_ns)
        return board->is_told ? MOTION_OK : MOTION_E_AGAIN;
    if (clock->ramp_waits || clock->ramp_on)
        return MOTION_E_AGAIN;
    clock->ramp = *ramp;
    board->is_told = false;
    board->order = STATEFUL_BOARD_RAMP;
    return MOTION_E_AGAIN;
}

static const struct hal_drive_tracks board_tracks = {
    .load = tracks_load,
    .state = tracks_state,
    .lead_ns = tracks_lead_ns,
    .start = tracks_start,
    .ramp = tracks_ramp,
    .stop = tracks_stop,
};

static const struct hal_drive_tracks board_tracks_without_ramps = {
    .load = tracks_load,
    .state = tracks_state,
    .lead_ns = tracks_lead_ns,
    .start = tracks_start,
    .stop = tracks_stop,
};

/* Off, of whatever kind, is a stop first. */
static void board_request(struct hal_drive *drive,
                          enum hal_drive_request request)
{
    struct stateful_board *board = board_of(drive);
    if (request == HAL_DRIVE_REQUEST_QUICK_STOP)
        board->is_deaf = false;
    if (request != HAL_DRIVE_REQUEST_ENABLE &&
        request != HAL_DRIVE_REQUEST_RESET && !board->stops)
        stateful_board_stop(board);
    stateful_axis_request(drive, request);
}

static int board_set_target(struct hal_drive *drive,
                            const struct hal_drive_target *target)
{
    struct stateful_axis *axis = axis_of(drive);
    const unsigned slot = axis->told_count++ % STATEFUL_TOLD;
    axis->told_ns[slot] = axis->now_ns;
    axis->told_then_q32[slot] = target->pos_q32;
    if (!stateful_axis_follows(axis))
        return MOTION_OK;
    axis->told = true;
    axis->told_q32 = target->pos_q32;
    return MOTION_OK;
}

/* Of ours, the one that was due when the position was measured. */
static int64_t told_at_q32(const struct stateful_axis *axis, int64_t t_ns)
{
    for (unsigned back = 1; back <= axis->told_count && back < STATEFUL_TOLD;
         back++) {
        const unsigned slot = (axis->told_count - back) % STATEFUL_TOLD;
        if (axis->told_ns[slot] <= t_ns)
            return axis->told_then_q32[slot];
    }
    return axis->seen.demand_q32;
}

static void board_feedback(struct hal_drive *drive,
                           struct hal_drive_feedback *feedback)
{
    const struct stateful_axis *axis = axis_of(drive);
    const struct stateful_board *board = axis->board;
    *feedback = (struct hal_drive_feedback){
        .state = axis->state == HAL_DRIVE_ENABLED && !axis->is_known
                     ? HAL_DRIVE_ENABLING
                     : axis->state,
        .pos_q32 = axis->seen.pos_q32,
        .vel_q32 = axis->seen.vel_q32,
        .t_ns = axis->seen.t_ns,
        .demand_known = true,
        .demand_q32 = stateful_board_plays(board)
                          ? told_at_q32(axis, axis->seen.t_ns)
                          : axis->seen.demand_q32,
        .following = true,
        .mode = axis->mode,
        .fault_code = axis->state == HAL_DRIVE_FAULT ? 0x2310 : 0,
    };
}

static const struct hal_drive_ops board_ops = {
    .request = board_request,
    .set_target = board_set_target,
    .feedback = board_feedback,
    .tracks = &board_tracks,
};

static const struct hal_drive_ops board_ops_without_ramps = {
    .request = board_request,
    .set_target = board_set_target,
    .feedback = board_feedback,
    .tracks = &board_tracks_without_ramps,
};

/* --- what it is told ------------------------------------------------------------ */

static int64_t ramp_step_of(const struct stateful_board *board,
                            const struct hal_drive_ramp *ramp)
{
    const int64_t since_ns =
        ramp->since_ns < 0
            ? ramp->at_ns - board->now_ns + board->lag_ticks * board->period_ns
            : ramp->since_ns;
    return since_ns / board->period_ns +
           (ramp->since_ns < 0 ? board->clock.steps : 0);
}

static void told_ramp(struct stateful_board *board)
{
    struct stateful_board_clock *clock = &board->clock;
    clock->ramp_step = ramp_step_of(board, &clock->ramp);
    clock->ramp_waits =
        board->does == STATEFUL_BOARD_PLAYS && clock->ramp_step >= clock->steps;
    board->is_told = clock->ramp_waits || board->does == STATEFUL_BOARD_STANDS;
    board->was_refused = board->was_refused || !board->is_told;
}

static void told_start(struct stateful_board *board)
{
    board->is_told = board->now_ns < board->start_ns;
    board->was_refused = board->was_refused || !board->is_told;
    if (board->is_told)
        board->does = STATEFUL_BOARD_WAITS;
    else
        board->state = HAL_DRIVE_TRACK_NONE;
}

static void told_stop(struct stateful_board *board)
{
    if (board->is_deaf)
        return;
    if (stateful_board_moves(board))
        board->does = STATEFUL_BOARD_RESTS;
    else
        board->does = STATEFUL_BOARD_STANDS;
    board->clock.ramp_waits = board->clock.ramp_on = false;
}

/* Its turn: what it was to be told. */
static void board_is_told(struct stateful_board *board)
{
    const enum stateful_order_of_board order = board->order;
    if (order == STATEFUL_BOARD_LOAD && --board->wait > 0)
        return;
    board->order = STATEFUL_BOARD_NOTHING;
    switch (order) {
    case STATEFUL_BOARD_LOAD:
        board->state = HAL_DRIVE_TRACK_LOADED;
        break;
    case STATEFUL_BOARD_START:
        told_start(board);
        break;
    case STATEFUL_BOARD_RAMP:
        told_ramp(board);
        break;
    case STATEFUL_BOARD_STOP:
        told_stop(board);
        break;
    case STATEFUL_BOARD_NOTHING:
        break;
    }
}

/* At the end of its tracks; or it stopped by itself, as it heard nothing. */
static void board_has_ended(struct stateful_board *board)
{
    if (board->clock.s * tick_s(board) < board->end_s)
        stateful_board_fault(board);
    else
        board->state = HAL_DRIVE_TRACK_ENDED;
}

/* Or how it is. */
static void board_is_seen(struct stateful_board *board)
{
    for (unsigned i = 0; i < board->count; i++) {
        struct stateful_axis *axis = board->axis[i];
        axis->seen.pos_q32 = axis->pos_q32 + axis->slip_q32;
        axis->seen.vel_q32 =
            (int64_t)(axis->vel * (double)MOTION_FIXED_ONE_Q32);
        axis->seen.demand_q32 = axis->own_q32;
        axis->seen.t_ns = board->now_ns;
        if (axis->state == HAL_DRIVE_ENABLED && !axis->is_known)
            axis->is_first = axis->is_known = true;
    }
    if (board->state == HAL_DRIVE_TRACK_WAITING && board->is_told &&
        board->does != STATEFUL_BOARD_WAITS)
        board->state = HAL_DRIVE_TRACK_PLAYING;
    else if (board->state == HAL_DRIVE_TRACK_PLAYING &&
             board->does == STATEFUL_BOARD_STANDS)
        board_has_ended(board);
    if (board->stops && board->does == STATEFUL_BOARD_PLAYS)
        board->order = STATEFUL_BOARD_STOP; /* it has not done it */
    board->stood = board->does == STATEFUL_BOARD_STANDS ? board->stood + 1 : 0;
    if (!board->stops || board->order == STATEFUL_BOARD_STOP ||
        board->stood < STOOD)
        return;
    board->stops = false;
    for (unsigned i = 0; i < board->count; i++) {
        board->axis[i]->mode = HAL_DRIVE_STREAM_POSITION;
        board->axis[i]->is_first = true;
    }
}

static void board_line(struct stateful_board *board)
{
    if (board->late_ticks > 0 || board->axis[0]->away) {
        board->late_ticks -= board->late_ticks > 0;
        board->unheard++;
        return;
    }
    board->unheard = 0;
    if (--board->turn > 0)
        return;
    board->turn = board->turn_ticks;
    if (board->order != STATEFUL_BOARD_NOTHING)
        board_is_told(board);
    else
        board_is_seen(board);
}

/* --- its clock ------------------------------------------------------------------- */

/* A tick of a ramp: r'' is constant in it. */
static double clock_jerk(const struct stateful_board_clock *clock)
{
    const struct hal_drive_ramp *ramp = &clock->ramp;
    const int64_t at = clock->steps - clock->ramp_step;
    const double by = (double)ramp->rate_q30 * 0x1p-30 - clock->from;
    const double jerk =
        by / (ramp->change * (double)(ramp->change + ramp->flat));
    if (at < ramp->change)
        return jerk;
    return at < ramp->change + ramp->flat ? 0 : -jerk;
}

static void clock_ramp(struct stateful_board_clock *clock)
{
    const struct hal_drive_ramp *ramp = &clock->ramp;
    const double jerk = clock_jerk(clock);
    clock->s += clock->rate + clock->accel / 2 + jerk / 6;
    clock->rate += clock->accel + jerk / 2;
    clock->accel += jerk;
    clock->steps++;
    if (clock->steps - clock->ramp_step < 2 * ramp->change + ramp->flat)
        return;
    clock->ramp_on = false;
    clock->accel = 0;
    clock->rate = (double)ramp->rate_q30 * 0x1p-30;
}

/* Path time counts in ticks here. */
static void clock_play(struct stateful_board *board)
{
    struct stateful_board_clock *clock = &board->clock;
    if (clock->ramp_waits && clock->steps == clock->ramp_step) {
        clock->ramp_waits = false;
        clock->ramp_on = true;
        clock->from = clock->rate;
        if (clock->ramp.since_ns < 0)
            clock->steps = clock->ramp_step = 0;
    }
    if (clock->ramp_on) {
        clock_ramp(clock);
        return;
    }
    clock->s += clock->rate;
    clock->steps++;
}

static void clock_rest(struct stateful_board *board)
{
    struct stateful_board_clock *clock = &board->clock;
    const double loss = tick_s(board) / board->rest_s;
    clock->s += clock->rate;
    clock->rate = fmax(0, clock->rate - loss);
    if (clock->rate == 0)
        board->does = STATEFUL_BOARD_STANDS;
}

/* Has it moved on? */
static bool board_clock(struct stateful_board *board)
{
    struct stateful_board_clock *clock = &board->clock;
    if (board->does == STATEFUL_BOARD_WAITS &&
        board->now_ns > board->start_ns + board->lag_ticks * board->period_ns) {
        board->does = STATEFUL_BOARD_PLAYS;
        *clock = (struct stateful_board_clock){
            .rate = (double)board->rate_q30 * 0x1p-30, .ramp = clock->ramp
        };
    }
    if (!stateful_board_moves(board))
        return false;
    if (board->does == STATEFUL_BOARD_PLAYS)
        clock_play(board);
    else
        clock_rest(board);
    if (clock->s * tick_s(board) >= board->end_s) {
        clock->s = board->end_s / tick_s(board) + 1;
        board->does = STATEFUL_BOARD_STANDS;
    }
    return true;
}

/* --- its axes ---------------------------------------------------------------------- */

static void axis_sample(struct stateful_board *board,
                        struct stateful_axis *axis)
{
    const double s_ns_q12 =
        board->clock.s * tick_s(board) * (double)MOTION_FIXED_S_Q12;
    struct motion_cursor cursor = { 0 };
    struct motion_sample sample;
    if (axis->track == NULL)
        return;
    motion_track_sample(axis->track, &cursor,
                        s_ns_q12 < (double)axis->track->end_ns_q12
                            ? (int64_t)llround(s_ns_q12)
                            : axis->track->end_ns_q12,
                        &sample);
    axis->own_q32 = sample.pos_q32;
}

/* It gives way under its load as those beside it do, and follows at once. */
static void axis_move(struct stateful_axis *axis, int64_t before_q32)
{
    const double dt = (double)axis->period_ns / SECOND_NS;
    if (axis->state != HAL_DRIVE_ENABLED &&
        axis->state != HAL_DRIVE_QUICK_STOP) {
        axis->own_q32 = axis->pos_q32;
        axis->sag_q32 = 0;
        axis->vel = 0;
        return;
    }
    axis->sag_q32 += (int64_t)((1 - exp(-dt / 5e-3)) *
                               (double)(axis->droop_q32 - axis->sag_q32));
    axis->pos_q32 = axis->own_q32 + axis->sag_q32;
    axis->vel = (double)(axis->own_q32 - before_q32) /
                (double)MOTION_FIXED_ONE_Q32 / dt;
}

/* Where nobody asks any more it stops; at rest torque goes off. */
static void board_watch(struct stateful_board *board)
{
    if (board->unheard < board->watch_ticks)
        return;
    if (stateful_board_moves(board))
        board->does = STATEFUL_BOARD_RESTS;
    else
        board->does = STATEFUL_BOARD_STANDS;
    for (unsigned i = 0; i < board->count && !stateful_board_moves(board); i++)
        if (stateful_axis_has_torque(board->axis[i])) {
            board->axis[i]->state = HAL_DRIVE_OFF;
            board->axis[i]->request = HAL_DRIVE_REQUEST_OFF;
        }
}

void stateful_board_fault(struct stateful_board *board)
{
    board->does = STATEFUL_BOARD_STANDS;
    for (unsigned i = 0; i < board->count; i++)
        board->axis[i]->state = HAL_DRIVE_FAULT;
}

void stateful_board_advance(struct stateful_board *board)
{
    board->now_ns += board->period_ns;
    board->heard_ticks = board->is_deaf ? 0 : board->heard_ticks + 1;
    board_line(board);
    const bool moved = board_clock(board);
    board_watch(board);
    for (unsigned i = 0; i < board->count; i++) {
        struct stateful_axis *axis = board->axis[i];
        const int64_t before_q32 = axis->own_q32;
        const bool was_off = !stateful_axis_has_torque(axis);
        axis->now_ns += axis->period_ns;
        stateful_axis_walk(axis);
        if (axis->state != HAL_DRIVE_ENABLED)
            axis->is_known = false;
        if (stateful_axis_has_torque(axis) && was_off)
            axis->own_q32 = axis->pos_q32;
        else if (moved)
            axis_sample(board, axis);
        axis_move(axis, before_q32);
    }
}

void stateful_board_init(struct stateful_board *board)
{
    board->turn = 1;
    for (unsigned i = 0; i < board->count; i++) {
        struct stateful_axis *axis = board->axis[i];
        axis->board = board;
        axis->drive.ops =
            board->has_ramps ? &board_ops : &board_ops_without_ramps;
        axis->own_q32 = axis->pos_q32;
        axis->seen.demand_q32 = axis->pos_q32;
    }
    board->now_ns = board->axis[0]->now_ns;
}
