/* firmware/linux/service/commands_move.c - the commands that load and start
 * moves; see command_line.h. */
#include <math.h>
#include <string.h>

#include "firmware/host/base/number.h"
#include "firmware/host/job/job_shots.h"
#include "firmware/linux/service/command_line.h"
#include "motion/core/err.h"
#include "motion/core/fixed.h"

static void command_plan(const struct command_line *line, bool loads)
{
    const char *text = cJSON_GetStringValue(command_line_member(line, "text"));
    struct service_client *client = line->client;
    if (text == NULL) {
        command_line_refuse(line, "ARG",
                            "\"text\": expected the text of a move "
                            "file");
        return;
    }
    if (client->planning ||
        !service_planner_ask(&line->control->planner, text)) {
        command_line_refuse(line, "BUSY", "another move is being planned");
        return;
    }
    client->planning = true;
    client->plan_loads = loads;
    memcpy(client->plan_id, line->id, sizeof client->plan_id);
}

void command_load(const struct command_line *line)
{
    command_plan(line, true);
}

void command_check(const struct command_line *line)
{
    command_plan(line, false);
}

/* What is loaded is played no more, and nothing of it was named since two
 * loads. */
static bool command_may_load(const struct service_control *control)
{
    const enum controller_state state = control->state->state;
    return !control->waits &&
           (state == CONTROLLER_OFF || state == CONTROLLER_READY ||
            state == CONTROLLER_FAULT);
}

static struct service_client *command_planner(struct service_control *control)
{
    for (unsigned i = 0; i < SERVICE_CLIENTS; i++)
        if (control->clients.client[i].file >= 0 &&
            control->clients.client[i].planning)
            return &control->clients.client[i];
    return NULL;
}

static void command_loaded(struct service_control *control,
                           struct service_move *move)
{
    service_move_free(control->old_move);
    control->old_move = control->move;
    control->move = move;
    control->loads++;
}

static void command_say_plan(struct service_client *client,
                             const struct service_move *move)
{
    cJSON *object =
        command_line_object(client->plan_id, move->status == STATUS_OK);
    if (move->status != STATUS_OK) {
        cJSON_AddStringToObject(
            object, "error", move->status == STATUS_INPUT ? "INPUT" : "LIMIT");
        cJSON_AddStringToObject(object, "text", move->text);
    }
    if (move->status != STATUS_INPUT) {
        cJSON_AddStringToObject(object, "title", move->job.move.title);
        cJSON_AddNumberToObject(object, "duration",
                                number_double(move->job.end_ns_q12, 12) / 1e9);
        job_json_violations(&move->job, object);
    }
    command_line_answer(client, object);
}

void service_command_planned(struct service_control *control,
                             struct service_move *move)
{
    struct service_client *client = command_planner(control);
    const bool loads = client != NULL && client->plan_loads &&
                       client == control->holder && move->status == STATUS_OK;
    char text[SERVICE_COUPLE_TEXT_MAX];
    if (client == NULL) {
        service_move_free(move);
        return;
    }
    client->planning = false;
    if (move->status == STATUS_OK &&
        !service_couplings_keep(control, &move->motion, text, sizeof text)) {
        command_line_fail(client, client->plan_id, "STATE", text);
        service_move_free(move);
        return;
    }
    if (loads && !command_may_load(control)) {
        command_line_fail(client, client->plan_id, "STATE",
                          "a move is loaded at rest only");
        service_move_free(move);
        return;
    }
    if (client->plan_loads && client != control->holder) {
        command_line_fail(client, client->plan_id, "CONTROL",
                          "control was lost while the move was planned");
        service_move_free(move);
        return;
    }
    command_say_plan(client, move);
    if (loads)
        command_loaded(control, move);
    else
        service_move_free(move);
}

static bool command_has_move(const struct command_line *line)
{
    if (line->control->move != NULL)
        return true;
    command_line_refuse(line, "EMPTY", "no move is loaded");
    return false;
}

/* Events have the times of one play of the move from its start. */
bool command_may_repeat(const struct command_line *line)
{
    const struct service_move *move = line->control->move;
    if (command_is_steered(line))
        return false;
    if (move == NULL || move->motion.shots == NULL)
        return true;
    command_line_refuse(line, "ARG",
                        "the move has events, it is played once, from its "
                        "start to its end");
    return false;
}

bool command_keeps_shots(const struct command_line *line, int64_t rate_q30)
{
    const struct service_move *move = line->control->move;
    struct messages messages = { .text = NULL };
    enum message_kind kind;
    size_t at = 0;
    if (move == NULL || move->motion.shots == NULL || rate_q30 <= 0 ||
        job_shots_check(&move->job, rate_q30, &messages))
        return true;
    command_line_refuse(line, "LIMIT", messages_next(&messages, &at, &kind));
    messages_free(&messages);
    return false;
}

/* As often as the command says, or else the move. */
void command_start(const struct command_line *line)
{
    struct service_request request = { .kind = SERVICE_START };
    const cJSON *ping_pong = command_line_member(line, "ping_pong");
    double times;
    if (!command_has_move(line) || !command_keeps_couplings(line))
        return;
    const struct plan_move *move = &line->control->move->job.move;
    const bool by_move =
        ping_pong == NULL && command_line_member(line, "times") == NULL;
    if (!command_line_number(line, "times", 0, 1e9, 1, &times))
        return;
    if (by_move)
        times = move->times < 0 ? 0 : move->times > 0 ? move->times : 1;
    request.is_ping_pong =
        by_move ? move->is_ping_pong : cJSON_IsTrue(ping_pong);
    request.times = llrint(times);
    request.motion = &line->control->move->motion;
    if (((request.times == 1 && !request.is_ping_pong) ||
         command_may_repeat(line)) &&
        command_keeps_shots(line, line->control->state->override_q30) &&
        command_follow(line, &request))
        command_line_request(line, &request);
}

/* Also while it is played: from the next end on. */
void command_loop(const struct command_line *line)
{
    struct mailbox_entry entry = {
        .command = cJSON_IsTrue(command_line_member(line, "ping_pong"))
                       ? MAILBOX_PING_PONG
                       : MAILBOX_LOOP,
    };
    double times;
    if (!command_line_number(line, "times", 0, 1e9, (double)NAN, &times))
        return;
    entry.value = llrint(times);
    if ((entry.value == 1 && entry.command == MAILBOX_LOOP) ||
        command_may_repeat(line))
        command_line_send(line, &entry);
}

/* Of the move: seconds, or a text such as "2.5 s", "f48", "00:00:02:12". */
static bool command_go_time(const struct command_line *line, int64_t *t_ns_q12)
{
    const struct plan_move *move = &line->control->move->job.move;
    const struct units_context units = { .fps = { move->fps_num,
                                                  move->fps_den } };
    const char *text = cJSON_GetStringValue(command_line_member(line, "to"));
    char sentence[UNITS_SENTENCE_MAX];
    double t_s;
    if (text == NULL) {
        if (!command_line_number(line, "to", 0, 1e6, (double)NAN, &t_s))
            return false;
        *t_ns_q12 = llrint(t_s * 1e9) * MOTION_FIXED_NS_Q12;
        return true;
    }
    if (units_parse(text, UNITS_TIME, &units, t_ns_q12, sentence) == 0)
        return true;
    command_line_refuse(line, "ARG", sentence);
    return false;
}

/* Of an axis, counted from 1. */
static bool command_go_key(const struct command_line *line, int64_t *t_ns_q12)
{
    const struct job *job = &line->control->move->job;
    const int axis = command_line_axis(
        line, cJSON_GetStringValue(command_line_member(line, "axis")));
    double key;
    if (axis < 0 ||
        !command_line_number(line, "key", 1, PLAN_KEYS_MAX, (double)NAN, &key))
        return false;
    for (unsigned i = 0; i < job->move.axis_count && job->move.warp == NULL;
         i++) {
        const struct plan_axis *own = &job->move.axis[i];
        if (job->rig_axis[i] != (unsigned)axis ||
            llrint(key) > (long long)own->key_count)
            continue;
        *t_ns_q12 = own->key[llrint(key) - 1].key.t_ns_q12;
        return true;
    }
    command_line_refuse(line, "ARG",
                        job->move.warp != NULL
                            ? "\"key\": the move's time is warped, expected "
                              "\"to\" with a time"
                            : "\"key\": the axis has no such key in this move");
    return false;
}

void command_go(const struct command_line *line)
{
    struct service_request request = { .kind = SERVICE_GO, .times = 1 };
    if (!command_has_move(line) || !command_keeps_couplings(line) ||
        !command_may_repeat(line) ||
        !(command_line_member(line, "key") != NULL
              ? command_go_key(line, &request.at_ns_q12)
              : command_go_time(line, &request.at_ns_q12)))
        return;
    request.motion = &line->control->move->motion;
    command_line_request(line, &request);
}

void command_approach(const struct command_line *line)
{
    struct service_control *control = line->control;
    struct service_request request = { .kind = SERVICE_START, .times = 1 };
    if (!command_has_move(line) || !command_keeps_couplings(line))
        return;
    if (control->state->state != CONTROLLER_READY || control->state->homing) {
        command_line_refuse(line, "STATE", motion_err_text(MOTION_E_STATE));
        return;
    }
    if (service_is_coupled(control)) { /* those that follow are taken along */
        request.kind = SERVICE_GO;
        request.stands = true;
        request.motion = &control->move->motion;
        command_line_request(line, &request);
        return;
    }
    const int any =
        service_move_approach(control->move, control->state->view.axis);
    if (any < 0)
        command_line_refuse(line, command_line_error(any),
                            motion_err_text(any));
    if (any == 0)
        command_line_done(line);
    if (any <= 0)
        return;
    request.motion = &control->move->approach;
    command_line_request(line, &request);
}
