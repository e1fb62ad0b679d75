/* firmware/linux/service/commands_move.c - the commands that load and start
 * moves; see command_line.h. */
#include <math.h>
#include <string.h>

#include "firmware/host/base/number.h"
#include "firmware/host/job/job_shots.h"
#include "firmware/linux/service/command_line.h"
#include "motion/core/err.h"
#include "motion/core/fixed.h"

/* --- planning --- */

#define PLAN_TELL_NS INT64_C(500000000) /* between two events */

static struct service_client *plan_asker(struct service_control *control)
{
    return service_asker(control, control->plan.asker, control->plan.seat);
}

static void plan_fail(struct service_control *control, const char *error,
                      const char *text)
{
    struct service_client *client = plan_asker(control);
    if (client != NULL)
        service_client_answer(
            &control->clients, client,
            command_line_failure(control->plan.id, error, text));
}

void service_plan_give_up(struct service_control *control, const char *why)
{
    service_planner_give_up(&control->planner);
    if (why != NULL)
        plan_fail(control, "CANCELLED", why);
    control->plan.asker = 0;
}

static void command_plan(const struct command_line *line, bool loads)
{
    struct service_control *control = line->control;
    const char *text = cJSON_GetStringValue(command_line_member(line, "text"));
    if (text == NULL) {
        command_line_refuse(line, "ARG",
                            "\"text\": expected the text of a move "
                            "file");
        return;
    }
    if (control->plan.asker == line->client->number)
        service_plan_give_up(control, "another move has taken its place");
    if (control->plan.asker != 0) {
        command_line_refuse(line, "BUSY", "another move is being planned");
        return;
    }
    if (!service_planner_ask(&control->planner, text)) {
        command_line_refuse(line, "PLANNER",
                            "the planner has ended, expected the service "
                            "started anew");
        return;
    }
    control->plan.asker = line->client->number;
    control->plan.seat = (unsigned)(line->client - control->clients.client);
    control->plan.loads = loads;
    control->plan.since_ns = control->plan.told_ns = control->now_ns;
    snprintf(control->plan.id, sizeof control->plan.id, "%s", line->id);
}

void command_load(const struct command_line *line)
{
    command_plan(line, true);
}

void command_check(const struct command_line *line)
{
    command_plan(line, false);
}

void command_cancel(const struct command_line *line)
{
    struct service_control *control = line->control;
    if (control->plan.asker == 0 ||
        (control->plan.asker != line->client->number &&
         control->holder != line->client)) {
        command_line_refuse(line, "STATE",
                            "nothing is being planned for this client");
        return;
    }
    service_plan_give_up(control, "planning was cancelled");
    command_line_done(line);
}

/* What is loaded is played no more, and nothing of it was named since two
 * loads. */
static bool plan_may_load(const struct service_control *control)
{
    const enum controller_state state = control->state->state;
    return control->flights == 0 &&
           (state == CONTROLLER_OFF || state == CONTROLLER_READY ||
            state == CONTROLLER_FAULT);
}

static void plan_load(struct service_control *control,
                      struct service_move *move)
{
    service_move_free(control->old_move);
    control->old_move = control->move;
    control->move = move;
    control->loads++;
}

static void plan_answer(struct service_control *control,
                        struct service_client *client,
                        const struct service_move_facts *facts)
{
    cJSON *object =
        command_line_object(control->plan.id, facts->status == STATUS_OK);
    cJSON *said = cJSON_Parse(facts->said);
    if (facts->status != STATUS_OK) {
        cJSON_AddStringToObject(
            object, "error", facts->status == STATUS_INPUT ? "INPUT" : "LIMIT");
        cJSON_AddStringToObject(object, "text", facts->text);
    }
    if (facts->status != STATUS_INPUT) {
        cJSON_AddStringToObject(object, "title", facts->title);
        cJSON_AddNumberToObject(object, "duration",
                                number_double(facts->end_ns_q12, 12) / 1e9);
    }
    while (said != NULL && said->child != NULL) {
        cJSON *item = cJSON_DetachItemViaPointer(said, said->child);
        cJSON_AddItemToObject(object, item->string, item);
    }
    cJSON_Delete(said);
    service_client_answer(&control->clients, client, object);
}

static void plan_done(struct service_control *control,
                      struct service_move *move)
{
    struct service_client *client = plan_asker(control);
    const bool loads = control->plan.loads && move->facts.status == STATUS_OK;
    char text[SERVICE_COUPLE_TEXT_MAX];
    if (client != NULL && control->plan.loads && client != control->holder) {
        plan_fail(control, "CONTROL",
                  "control was lost while the move was planned");
    } else if (client != NULL && move->facts.status == STATUS_OK &&
               !service_couplings_keep(control, &move->motion, text,
                                       sizeof text)) {
        plan_fail(control, "STATE", text);
    } else if (client != NULL && loads && !plan_may_load(control)) {
        plan_fail(control, "STATE", "a move is loaded at rest only");
    } else if (client != NULL) {
        plan_answer(control, client, &move->facts);
        if (loads) {
            plan_load(control, move);
            return;
        }
    }
    service_move_free(move);
}

static void plan_tell(struct service_control *control)
{
    struct service_plan_progress progress;
    if (control->now_ns - control->plan.told_ns < PLAN_TELL_NS)
        return;
    control->plan.told_ns = control->now_ns;
    service_planner_progress(&control->planner, &progress);
    cJSON *object = service_event_object("plan", control->now_ns);
    cJSON_AddStringToObject(object, "doing", progress.doing);
    cJSON_AddStringToObject(object, "what", progress.what);
    if (progress.of > 0)
        cJSON_AddNumberToObject(object, "share",
                                (double)progress.done / (double)progress.of);
    cJSON_AddNumberToObject(object, "seconds",
                            (double)(control->now_ns - control->plan.since_ns) /
                                1e9);
    service_tell_all(control, object);
    cJSON_Delete(object);
}

void service_plan_step(struct service_control *control)
{
    static const struct {
        const char *error, *text;
    } row[] = {
        [SERVICE_PLAN_TIME] = { "TIME",
                                "planning took longer than the service allows "
                                "(--plan-time), expected a smaller move" },
        [SERVICE_PLAN_MEMORY] = { "MEMORY",
                                  "planning needs more memory than the service "
                                  "allows (--plan-memory), expected a smaller "
                                  "move" },
        [SERVICE_PLAN_FAILED] = { "PLANNER", "the planner has failed" },
    };
    struct service_move *move;
    if (control->plan.asker == 0)
        return;
    if (control->loop->end != 0) {
        service_plan_give_up(control, "the service ends");
        return;
    }
    const enum service_plan_state state =
        service_planner_take(&control->planner, &move);
    if (state == SERVICE_PLAN_NONE) {
        plan_tell(control);
        return;
    }
    if (state == SERVICE_PLAN_DONE)
        plan_done(control, move);
    else
        plan_fail(control, row[state].error, row[state].text);
    control->plan.asker = 0;
}

/* --- what is loaded --- */

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
        job_shots_keep_up(line->control->rig, move->shots, NULL,
                          SERVICE_MOVE_NAME, rate_q30, &messages))
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
    const struct service_move_facts *facts = &line->control->move->facts;
    const bool by_move =
        ping_pong == NULL && command_line_member(line, "times") == NULL;
    if (!command_line_number(line, "times", 0, 1e9, 1, &times))
        return;
    if (by_move)
        times = (double)facts->times;
    request.is_ping_pong =
        by_move ? facts->is_ping_pong : cJSON_IsTrue(ping_pong);
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
    const struct units_context units = { .fps =
                                             line->control->move->facts.fps };
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
    const struct service_move *move = line->control->move;
    double key;
    const int axis = command_line_axis(
        line, cJSON_GetStringValue(command_line_member(line, "axis")));
    if (axis < 0 ||
        !command_line_number(line, "key", 1, PLAN_KEYS_MAX, (double)NAN, &key))
        return false;
    const struct service_move_axis *own = &move->axis[axis];
    if (!move->facts.is_warped && llrint(key) <= (long long)own->key_count) {
        *t_ns_q12 = own->key_ns_q12[llrint(key) - 1];
        return true;
    }
    command_line_refuse(line, "ARG",
                        move->facts.is_warped
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
    char why[JOB_APPROACH_TEXT_MAX];
    const int any = service_move_approach(control->move, control->rig,
                                          control->state->view.axis, why);
    if (any < 0)
        command_line_refuse(line, command_line_error(any), why);
    if (any == 0)
        command_line_done(line);
    if (any <= 0)
        return;
    request.motion = &control->move->approach;
    command_line_request(line, &request);
}
