/* hal/drive/slew_mcu/board.c - a board on its line: who it is, what it says,
 * and what it is told; see drive.h. */
#include "hal/drive/slew_mcu/parts.h"

#include "hal/support/container_of.h"
#include "hal/support/quotient.h"
#include "hal/support/text.h"
#include "motion/core/fixed.h"

#define BOARD_FAILURES   3
#define BOARD_RETRY_NS   INT64_C(1000000000)
#define BOARD_AXIS_SHIFT 4 /* a cookie is a job, and what it is about */

enum board_job {
    BOARD_JOB_IDENTITY,
    BOARD_JOB_STATE,
    BOARD_JOB_AXIS,
    BOARD_JOB_WHY,
    BOARD_JOB_SETUP,
    BOARD_JOB_COMMAND,
    BOARD_JOB_PIECE,
};

static struct drive_slew_mcu_board *board_of(struct modbus_node *node)
{
    return CONTAINER_OF(node, struct drive_slew_mcu_board, node);
}

static void board_say(struct drive_slew_mcu_board *board, const char *what,
                      const char *why)
{
    struct hal_text text;

    hal_text_init(&text, board->why, sizeof board->why);
    hal_text_put(&text, "the board ");
    hal_text_put(&text, what);
    hal_text_put(&text, why);
}

void drive_slew_mcu_fail(struct drive_slew_mcu_board *board, const char *what,
                         const char *why)
{
    if (board->is_fault)
        return;
    board_say(board, what, why);
    board->is_fault = true;
    drive_slew_mcu_stop(board);
}

static void board_lose(struct drive_slew_mcu_board *board, const char *what)
{
    board_say(board, what, "");
    board->phase = DRIVE_SLEW_MCU_LOST;
    board->is_known = false;
    board->command.sequence = 0;
    board->stops = board->enables = board->is_enabling = false;
    drive_slew_mcu_move_forget(board);
}

void drive_slew_mcu_find(struct drive_slew_mcu_board *board)
{
    board->phase = DRIVE_SLEW_MCU_FIND;
    board->is_known = false;
    board->is_fault = false;
    board->state_ns = board->ready_ns = 0;
    board->failures = 0;
    board->clocks = 0;
    board->told_ppb = 0;
    board->retry_ns = 0;
    board->why[0] = '\0';
}

/* --- clocks --------------------------------------------------------------- */

static void board_note_clock(struct drive_slew_mcu_board *board, int64_t t_ns)
{
    const int64_t own_ns =
        (int64_t)mcu_words_get(board->state + MCU_STATE_TIME, 4);

    board->apart_ns[board->clocks % DRIVE_SLEW_MCU_CLOCKS] = t_ns - own_ns;
    board->clocks++;
}

int64_t drive_slew_mcu_apart_ns(const struct drive_slew_mcu_board *board)
{
    const unsigned count = board->clocks < DRIVE_SLEW_MCU_CLOCKS
                               ? board->clocks
                               : DRIVE_SLEW_MCU_CLOCKS;
    int64_t least_ns = INT64_MAX;

    for (unsigned i = 0; i < count; i++)
        if (board->apart_ns[i] < least_ns)
            least_ns = board->apart_ns[i];
    return least_ns;
}

int64_t drive_slew_mcu_time_ns(const struct drive_slew_mcu_board *board,
                               int64_t t_ns)
{
    return board->clocks == 0 ? 0 : t_ns - drive_slew_mcu_apart_ns(board);
}

/* --- requests ------------------------------------------------------------- */

static void board_read(struct hal_modbus_request *request, unsigned address,
                       unsigned count)
{
    request->function = HAL_MODBUS_READ;
    request->address = (uint16_t)address;
    request->count = (uint16_t)count;
}

void drive_slew_mcu_write(struct hal_modbus_request *request, uint16_t address,
                          const uint16_t *value, unsigned count)
{
    request->function = HAL_MODBUS_WRITE_MANY;
    request->address = address;
    request->count = (uint16_t)count;
    for (unsigned i = 0; i < count; i++)
        request->value[i] = value[i];
}

static void board_write_command(const struct drive_slew_mcu_command *command,
                                struct hal_modbus_request *request)
{
    uint16_t word[MCU_COMMAND_RAMP_WORDS];
    uint16_t *to = word;

    to = mcu_words_put(to, command->sequence, 1);
    to = mcu_words_put(to, command->command, 1);
    to = mcu_words_put(to, command->value, 2);
    to = mcu_words_put(to, command->at, 2);
    if (command->ramp != NULL) {
        to = mcu_words_put(to, (uint64_t)command->ramp->tick_ns, 2);
        to = mcu_words_put(to, (uint64_t)command->ramp->change, 2);
        mcu_words_put(to, (uint64_t)command->ramp->flat, 2);
    }
    drive_slew_mcu_write(request, MCU_AT_COMMAND, word,
                         command->ramp != NULL ? MCU_COMMAND_RAMP_WORDS
                         : command->has_at     ? MCU_COMMAND_AT
                                               : MCU_COMMAND_WORDS);
}

/* What makes it off; 0: it is, or is on its way there. */
static uint16_t board_off_command(const struct drive_slew_mcu_board *board)
{
    switch (drive_slew_mcu_state(board)) {
    case BOARD_MOVING:
    case BOARD_HOLDING:
        return MCU_COMMAND_STOP;
    case BOARD_READY:
        return MCU_COMMAND_OFF;
    case BOARD_OFF: /* enabling, perhaps */
        return board->is_enabling ? MCU_COMMAND_OFF : 0;
    case BOARD_STOPPING:
    case BOARD_FAULT:
        break;
    }
    return 0;
}

static uint16_t board_find_command(const struct drive_slew_mcu_board *board)
{
    return drive_slew_mcu_state(board) == BOARD_FAULT
               ? MCU_COMMAND_RESET
               : board_off_command(board);
}

static bool board_run_command(struct drive_slew_mcu_board *board,
                              struct drive_slew_mcu_command *command)
{
    if (drive_slew_mcu_move_command(board, command))
        return true;
    if (board->resets) {
        board->resets = false;
        if (drive_slew_mcu_state(board) == BOARD_FAULT)
            command->command = MCU_COMMAND_RESET;
    } else if (board->is_off) {
        command->command = board_off_command(board);
        board->is_enabling = false;
    } else if (board->enables && drive_slew_mcu_state(board) == BOARD_OFF) {
        board->enables = false;
        board->is_enabling = true;
        command->command = MCU_COMMAND_ENABLE;
    }
    return command->command != 0;
}

static bool board_setup_command(const struct drive_slew_mcu_board *board,
                                struct drive_slew_mcu_command *command)
{
    command->value = board->axis[0]->config.watch_ms;
    command->command = MCU_COMMAND_WATCH;
    return board->state[MCU_STATE_WATCH] != command->value;
}

/* By what it said last, and only once by the same. */
static bool board_command(struct drive_slew_mcu_board *board)
{
    struct drive_slew_mcu_command command = { 0 };
    bool any = false;

    if (board->command.sequence != 0)
        return true;
    if (!board->is_new)
        return false;
    if (board->phase == DRIVE_SLEW_MCU_FIND) {
        command.command = board_find_command(board);
        any = command.command != 0;
    } else if (board->phase == DRIVE_SLEW_MCU_SETUP) {
        any = board_setup_command(board, &command);
    } else if (board->phase == DRIVE_SLEW_MCU_RUN) {
        any = board_run_command(board, &command);
    }
    if (!any)
        return false;
    board->sequence++;
    if (board->sequence == 0)
        board->sequence = 1;
    command.sequence = board->sequence;
    board->command = command;
    board->is_new = false;
    return true;
}

static bool board_wants_why(const struct drive_slew_mcu_board *board)
{
    return drive_slew_mcu_state(board) == BOARD_FAULT &&
           board->why[0] == '\0' &&
           board->state[MCU_STATE_FAULT_AXIS] < board->axis_count;
}

/* State, axes, state ...; between two of them a piece. */
static enum board_job board_turn(struct drive_slew_mcu_board *board,
                                 struct hal_modbus_request *request,
                                 uint16_t *about)
{
    if (board->is_piece) {
        board->is_piece = false;
        if (drive_slew_mcu_piece_request(board, request, about))
            return BOARD_JOB_PIECE;
    }
    board->is_piece = true;
    if (board->turn > 0 && board->turn <= board->axis_count) {
        *about = (uint16_t)(board->turn - 1);
        board->turn++;
        board_read(request, MCU_AT_AXIS + MCU_AXIS_STEP * (unsigned)*about,
                   MCU_AXIS_WORDS);
        return BOARD_JOB_AXIS;
    }
    board->turn = 1;
    board_read(request, MCU_AT_STATE, MCU_STATE_WORDS);
    return BOARD_JOB_STATE;
}

static enum board_job board_request(struct drive_slew_mcu_board *board,
                                    struct hal_modbus_request *request,
                                    uint16_t *about)
{
    if (!board->is_known) {
        board_read(request, 0, MCU_IDENTITY_WORDS);
        return BOARD_JOB_IDENTITY;
    }
    if (board->phase == DRIVE_SLEW_MCU_SETUP &&
        drive_slew_mcu_setup_request(board, request))
        return BOARD_JOB_SETUP;
    if (board_command(board)) {
        board_write_command(&board->command, request);
        return BOARD_JOB_COMMAND;
    }
    if (board->phase != DRIVE_SLEW_MCU_RUN) {
        board_read(request, MCU_AT_STATE, MCU_STATE_WORDS);
        return BOARD_JOB_STATE;
    }
    if (board->is_new && board_wants_why(board)) {
        *about = board->state[MCU_STATE_FAULT_AXIS];
        board_read(request, MCU_AT_WHY + MCU_AXIS_STEP * (unsigned)*about,
                   MCU_WHY_WORDS);
        return BOARD_JOB_WHY;
    }
    return board_turn(board, request, about);
}

static bool board_next_request(struct modbus_node *node, int64_t now_ns,
                               struct hal_modbus_request *request,
                               uint16_t *cookie)
{
    struct drive_slew_mcu_board *board = board_of(node);
    uint16_t about = 0;

    board->now_ns = now_ns;
    if (board->is_asked || board->phase == DRIVE_SLEW_MCU_LOST ||
        now_ns < board->retry_ns)
        return false;
    const enum board_job job = board_request(board, request, &about);
    *cookie = (uint16_t)(job | (unsigned)about << BOARD_AXIS_SHIFT);
    board->is_asked = true;
    return true;
}

/* --- replies -------------------------------------------------------------- */

static void board_take_identity(struct drive_slew_mcu_board *board,
                                const uint16_t *word)
{
    if (word[0] != MCU_MAP_MAGIC) {
        board_lose(board, "is none that runs slew");
        return;
    }
    if (word[1] != MCU_MAP_VERSION) {
        board_lose(board, "has an image of another version");
        return;
    }
    if (word[3] < board->axis_count) {
        board_lose(board, "has fewer axes than the rig");
        return;
    }
    board->period_ns = (int64_t)mcu_words_get(word + 4, 2);
    if (board->period_ns <= 0) {
        board_lose(board, "has no tick");
        return;
    }
    for (unsigned i = 0; i < board->axis_count; i++)
        if (board->axis[i]->config.servo != NULL && word[8] == 0) {
            board_lose(board, "has no port to servos");
            return;
        }
    board->is_known = true;
}

static bool board_is_set_up(const struct drive_slew_mcu_board *board)
{
    return board->state[MCU_STATE_AXES] == board->axis_count &&
           board->state[MCU_STATE_SETUP_AXES] == (1u << board->axis_count) - 1;
}

static void board_take_ready(struct drive_slew_mcu_board *board, int64_t t_ns)
{
    if (drive_slew_mcu_state(board) != BOARD_READY)
        board->ready_ns = 0;
    else if (board->ready_ns == 0)
        board->ready_ns = t_ns;
    if (board->is_enabling && drive_slew_mcu_state(board) != BOARD_OFF)
        board->is_enabling = false;
    if (drive_slew_mcu_state(board) != BOARD_FAULT && !board->is_fault)
        board->why[0] = '\0';
    if (board->state[MCU_STATE_SILENT] != 0)
        board_say(board, "has heard nothing for too long", "");
}

static void board_take_run(struct drive_slew_mcu_board *board, int64_t t_ns)
{
    if (!board_is_set_up(board)) {
        board_lose(board, "was reset");
        return;
    }
    board_take_ready(board, t_ns);
    drive_slew_mcu_move_look(board);
}

/* By what it says of itself. */
static void board_walk(struct drive_slew_mcu_board *board, int64_t t_ns)
{
    switch (board->phase) {
    case DRIVE_SLEW_MCU_FIND:
        if (board_find_command(board) != 0 ||
            drive_slew_mcu_state(board) != BOARD_OFF)
            return;
        board->sequence = board->state[MCU_STATE_SEQUENCE];
        board->move_id =
            (uint32_t)mcu_words_get(board->state + MCU_STATE_MOVE_ID, 2);
        drive_slew_mcu_setup_begin(board);
        board->phase = DRIVE_SLEW_MCU_SETUP;
        return;
    case DRIVE_SLEW_MCU_SETUP:
        if (!board_is_set_up(board)) {
            drive_slew_mcu_setup_begin(board);
            return;
        }
        if (board->state[MCU_STATE_WATCH] != board->axis[0]->config.watch_ms)
            return;
        board->told_q30 = 0;
        board->turn = 0;
        board->phase = DRIVE_SLEW_MCU_RUN;
        board_take_ready(board, t_ns);
        return;
    case DRIVE_SLEW_MCU_RUN:
        board_take_run(board, t_ns);
        return;
    case DRIVE_SLEW_MCU_LOST:
        return;
    }
}

static void board_take_state(struct drive_slew_mcu_board *board,
                             const struct hal_modbus_reply *reply)
{
    const int64_t before_ns =
        (int64_t)mcu_words_get(board->state + MCU_STATE_TIME, 4);
    const bool is_first = board->state_ns == 0;

    for (unsigned i = 0; i < MCU_STATE_WORDS; i++)
        board->state[i] = reply->value[i];
    board->state_ns = reply->answer_ns;
    board->is_new = true;
    if (is_first) { /* a command of who was here before is not ours */
        board->sequence = board->state[MCU_STATE_SEQUENCE];
        if (drive_slew_mcu_state(board) == BOARD_READY ||
            drive_slew_mcu_moves(board))
            board->found.count++;
    }
    if (!is_first &&
        (int64_t)mcu_words_get(board->state + MCU_STATE_TIME, 4) < before_ns) {
        board_lose(board, "was reset");
        return;
    }
    board_note_clock(board, reply->answer_ns);
    board_walk(board, reply->answer_ns);
}

static void board_take_axis(struct drive_slew_mcu *axis,
                            const struct hal_modbus_reply *reply)
{
    const int64_t before_q32 =
        (int64_t)mcu_words_get(axis->word + MCU_AXIS_ACTUAL, 4);
    const int64_t dt_ns = reply->answer_ns - axis->word_ns;
    int64_t distance_q32;

    for (unsigned i = 0; i < MCU_AXIS_WORDS; i++)
        axis->word[i] = reply->value[i];
    if (axis->word_ns == 0 || dt_ns <= 0 ||
        motion_fixed_sub(
            (int64_t)mcu_words_get(axis->word + MCU_AXIS_ACTUAL, 4), before_q32,
            &distance_q32) < 0 ||
        motion_fixed_mulshift(distance_q32, hal_per_second_q20(dt_ns), 20,
                              &axis->vel_q32) < 0)
        axis->vel_q32 = 0;
    axis->word_ns = reply->answer_ns;
    axis->room = (uint32_t)mcu_words_get(axis->word + MCU_AXIS_FREE, 2);
}

/* Two characters in a register, the first one upper. */
static void board_take_why(struct drive_slew_mcu_board *board,
                           const uint16_t *word)
{
    char words[2 * MCU_WHY_WORDS + 1] = "";

    for (unsigned i = 0; i < 2 * MCU_WHY_WORDS; i++)
        words[i] = (char)(word[i / 2] >> (i % 2 == 0 ? 8 : 0));
    board_say(board, "is in fault: ", words);
}

/* Told too late it begins nothing, and nobody does (firmware/control/arm.c). */
static void board_refused(struct drive_slew_mcu_board *board, uint16_t command)
{
    if (board->stops)
        return;
    switch (command) {
    case MCU_COMMAND_ENABLE:
        drive_slew_mcu_fail(board, "refused to enable", "");
        return;
    case MCU_COMMAND_START:
        drive_slew_mcu_move_forget(board);
        return;
    case MCU_COMMAND_OVERRIDE:
        drive_slew_mcu_fail(board, "refused the override", "");
        return;
    case MCU_COMMAND_RAMP:
        board->ramp_state = DRIVE_SLEW_MCU_RAMP_REFUSED;
        return;
    case MCU_COMMAND_WATCH:
        board_lose(board, "refused its watch");
        return;
    default:
        return; /* its state has changed meanwhile: by the next one */
    }
}

static bool board_failed(struct drive_slew_mcu_board *board,
                         const struct hal_modbus_reply *reply)
{
    if (reply->err == MOTION_OK || reply->err == MOTION_E_REFUSED) {
        board->failures = 0;
        board->steps++;
        return false;
    }
    board->failures++;
    if (board->phase == DRIVE_SLEW_MCU_FIND) {
        board->retry_ns = board->now_ns + BOARD_RETRY_NS;
        board_say(board, "does not answer", "");
    } else if (board->failures >= BOARD_FAILURES) {
        board_lose(board, "does not answer");
    }
    return true;
}

static void board_answer(struct drive_slew_mcu_board *board, enum board_job job,
                         uint16_t about, const struct hal_modbus_reply *reply)
{
    const bool is_refused = reply->err == MOTION_E_REFUSED;
    const uint16_t command = board->command.command;

    switch (job) {
    case BOARD_JOB_IDENTITY:
    case BOARD_JOB_STATE:
    case BOARD_JOB_AXIS:
        if (is_refused)
            board_lose(board, "is none that runs slew");
        else if (job == BOARD_JOB_IDENTITY)
            board_take_identity(board, reply->value);
        else if (job == BOARD_JOB_STATE)
            board_take_state(board, reply);
        else
            board_take_axis(board->axis[about], reply);
        return;
    case BOARD_JOB_WHY:
        if (!is_refused)
            board_take_why(board, reply->value);
        return;
    case BOARD_JOB_SETUP:
        if (is_refused)
            board_lose(board, board->setup_at > board->axis_count
                                  ? "refused an axis, or its servo's line"
                                  : "refused its servos or their map");
        else
            drive_slew_mcu_setup_done(board);
        return;
    case BOARD_JOB_COMMAND:
        board->command.sequence = 0;
        board->turn = 0;
        if (is_refused)
            board_refused(board, command);
        return;
    case BOARD_JOB_PIECE:
        drive_slew_mcu_piece_reply(board, about, reply);
        return;
    }
}

static void board_reply(struct modbus_node *node, uint16_t cookie,
                        const struct hal_modbus_reply *reply)
{
    struct drive_slew_mcu_board *board = board_of(node);

    board->is_asked = false;
    if (!board_failed(board, reply) && board->phase != DRIVE_SLEW_MCU_LOST)
        board_answer(board,
                     (enum board_job)(cookie & ((1 << BOARD_AXIS_SHIFT) - 1)),
                     (uint16_t)(cookie >> BOARD_AXIS_SHIFT), reply);
}

/* --- ticks ---------------------------------------------------------------- */

static void board_step(struct modbus_node *node, int64_t now_ns)
{
    struct drive_slew_mcu_board *board = board_of(node);

    board->now_ns = now_ns;
    board->is_fresh = false;
}

/* Its answer will not come. */
static void board_down(struct modbus_node *node)
{
    struct drive_slew_mcu_board *board = board_of(node);

    if (board->phase != DRIVE_SLEW_MCU_FIND)
        board_lose(board, "cannot be reached: its line is down");
}

static const struct modbus_node_ops board_ops = {
    .step = board_step,
    .next_request = board_next_request,
    .reply = board_reply,
    .down = board_down,
};

void drive_slew_mcu_board_init(struct drive_slew_mcu_board *board, uint8_t unit)
{
    *board = (struct drive_slew_mcu_board){
        .node = { .ops = &board_ops, .unit = unit },
    };
    drive_slew_mcu_find(board);
}
