/* firmware/linux/service/commands.c - the commands of the protocol; see
 * control.h. */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "firmware/host/base/array.h"
#include "firmware/host/base/json.h"
#include "firmware/host/base/number.h"
#include "firmware/linux/service/control.h"
#include "motion/core/err.h"
#include "motion/core/fixed.h"

#define COMMAND_LEASE_S     5.0 /* when not given */
#define COMMAND_LEASE_MIN_S 0.2
#define COMMAND_LEASE_MAX_S 60.0
#define COMMAND_RATE_MAX    100.0 /* of a stream, Hz */
#define COMMAND_JOG_S       0.25
#define COMMAND_FAR_S       100
#define COMMAND_VALUE_MAX   1e9

/* A line that is being looked at. */
struct command_line {
    struct service_control *control;
    struct service_client *client;
    const cJSON *request;
    char id[SERVICE_ID_MAX]; /* as JSON; "" when there is none */
};

/* --- answers --- */

static cJSON *command_object(const char *id, bool ok)
{
    cJSON *object = cJSON_CreateObject();
    if (id[0] != '\0')
        cJSON_AddRawToObject(object, "id", id);
    cJSON_AddBoolToObject(object, "ok", ok);
    return object;
}

static void command_answer(struct service_client *client, cJSON *object)
{
    (void)service_client_answer(client, object);
}

static void command_done(const struct command_line *line)
{
    command_answer(line->client, command_object(line->id, true));
}

static void command_fail(struct service_client *client, const char *id,
                         const char *error, const char *text)
{
    cJSON *object = command_object(id, false);
    cJSON_AddStringToObject(object, "error", error);
    cJSON_AddStringToObject(object, "text", text);
    command_answer(client, object);
}

static void command_refuse(const struct command_line *line, const char *error,
                           const char *text)
{
    command_fail(line->client, line->id, error, text);
}

static const char *command_error(int err)
{
    static const char *const name[] = {
#define COMMAND_ERROR(name, value, text) [-(value)] = #name,
        MOTION_ERR_LIST(COMMAND_ERROR)
#undef COMMAND_ERROR
    };
    const size_t at = (size_t)-err;
    return at < ARRAY_LEN(name) && name[at] != NULL
               ? name[at] + sizeof "MOTION_E_" - 1
               : "UNKNOWN";
}

/* --- members of a request --- */

static const cJSON *command_member(const struct command_line *line,
                                   const char *name)
{
    return cJSON_GetObjectItemCaseSensitive(line->request, name);
}

/* A number from `low` to `high`; `otherwise` when it is not there.  False: it
 * has been refused. */
static bool command_number(const struct command_line *line, const char *name,
                           double low, double high, double otherwise,
                           double *value)
{
    const cJSON *item = command_member(line, name);
    char text[128];
    *value = item == NULL ? otherwise : cJSON_GetNumberValue(item);
    if (isfinite(*value) && *value >= low && *value <= high)
        return true;
    snprintf(text, sizeof text, "\"%s\": expected a number from %g to %g", name,
             low, high);
    command_refuse(line, "ARG", text);
    return false;
}

static int64_t command_q32(double value)
{
    return llrint(value * 4294967296.0);
}

/* In the axis's unit, as a number or with a unit: "12.5", "45 deg". */
static bool command_quantity(const struct command_line *line, const char *name,
                             unsigned axis, enum units_quantity quantity,
                             int64_t *value_q32)
{
    const cJSON *item = command_member(line, name);
    const struct units_context units = {
        .unit = line->control->rig->axis[axis].unit
    };
    char sentence[UNITS_SENTENCE_MAX];
    double value;
    if (!cJSON_IsString(item)) {
        if (!command_number(line, name, -COMMAND_VALUE_MAX, COMMAND_VALUE_MAX,
                            (double)NAN, &value))
            return false;
        *value_q32 = command_q32(value);
        return true;
    }
    if (units_parse(item->valuestring, quantity, &units, value_q32, sentence) ==
        0)
        return true;
    command_refuse(line, "ARG", sentence);
    return false;
}

static int command_axis(const struct command_line *line, const char *name)
{
    const struct rig *rig = line->control->rig;
    char text[QUOTE_LIST_MAX + 32], list[QUOTE_LIST_MAX];
    const int axis = name == NULL ? -1 : rig_axis_index(rig, name);
    if (axis >= 0)
        return axis;
    snprintf(text, sizeof text, "no such axis, expected %s",
             rig_axis_list(rig, list));
    command_refuse(line, "ARG", text);
    return -1;
}

/* --- to the tick --- */

static void command_wait(const struct command_line *line, bool by_request,
                         enum mailbox_command command)
{
    struct service_control *control = line->control;
    control->waits = true;
    control->by_request = by_request;
    control->command = command;
    control->asker = line->client->number;
    control->asker_seat = (unsigned)(line->client - control->clients.client);
    memcpy(control->id, line->id, sizeof control->id);
}

static void command_send(const struct command_line *line,
                         const struct mailbox_entry *entry)
{
    const int err = mailbox_send(&line->control->loop->mailbox, entry);
    if (err < 0)
        command_refuse(line, command_error(err), motion_err_text(err));
    else
        command_wait(line, false, entry->command);
}

static void command_ask(const struct command_line *line,
                        const struct service_request *request)
{
    line->control->loop->request = *request;
    line->control->loop->turn = SERVICE_ASKED;
    command_wait(line, true, MAILBOX_COMMANDS);
}

static struct service_client *
command_asker(const struct service_control *control)
{
    const struct service_client *client =
        &control->clients.client[control->asker_seat];
    return control->asker != 0 && client->file >= 0 &&
                   client->number == control->asker
               ? (struct service_client *)client
               : NULL;
}

static void command_add_key(const struct service_control *control,
                            cJSON *object, int64_t t_ns_q12)
{
    cJSON_AddNumberToObject(object, "path_s",
                            number_double(t_ns_q12, 12) / 1e9);
    cJSON *axes = cJSON_AddObjectToObject(object, "axes");
    for (unsigned i = 0; i < control->rig->axis_count; i++)
        json_add_fixed(axes, control->rig->axis[i].name,
                       control->capture_q32[i], 32);
}

void service_command_answer(struct service_control *control,
                            const struct mailbox_entry *entry)
{
    struct service_client *client = command_asker(control);
    if (client == NULL)
        return;
    if (entry->err < 0) {
        command_fail(client, control->id, command_error(entry->err),
                     motion_err_text(entry->err));
        return;
    }
    cJSON *object = command_object(control->id, true);
    if (!control->by_request && entry->command == MAILBOX_CAPTURE)
        command_add_key(control, object, entry->value);
    command_answer(client, object);
}

/* --- for everybody --- */

static void command_hello(const struct command_line *line)
{
    cJSON *object = command_object(line->id, true);
    service_report_hello(line->control, object);
    command_answer(line->client, object);
}

static void command_status(const struct command_line *line)
{
    const struct service_control *control = line->control;
    const struct service_clients *clients = &control->clients;
    cJSON *object = command_object(line->id, true);
    unsigned connected = 0;
    service_report_state(control, object);
    service_report_machine(control, object);
    service_report_tick(control, cJSON_AddObjectToObject(object, "tick"));
    for (unsigned i = 0; i < SERVICE_CLIENTS; i++)
        connected += clients->client[i].file >= 0;
    cJSON_AddNumberToObject(object, "clients", connected);
    cJSON_AddNumberToObject(object, "clients_refused",
                            (double)clients->refused);
    cJSON_AddNumberToObject(object, "dropped", (double)line->client->dropped);
    cJSON_AddBoolToObject(object, "held", control->holder != NULL);
    cJSON_AddBoolToObject(object, "holder", control->holder == line->client);
    if (control->move != NULL)
        cJSON_AddStringToObject(object, "move", control->move->job.move.title);
    command_answer(line->client, object);
}

static void command_stream(const struct command_line *line)
{
    double rate;
    if (!command_number(line, "rate", 0, COMMAND_RATE_MAX, 10, &rate))
        return;
    if (rate > 0 && rate < 0.01) {
        command_refuse(line, "ARG", "\"rate\": expected 0 or 0.01 to 100 Hz");
        return;
    }
    line->client->stream_ns = rate > 0 ? llrint(1e9 / rate) : 0;
    line->client->stream_due_ns = line->control->now_ns;
    command_done(line);
}

static void command_stop(const struct command_line *line)
{
    mailbox_stop(&line->control->loop->mailbox);
    command_done(line);
}

static void command_take(const struct command_line *line)
{
    struct service_control *control = line->control;
    double lease_s;
    if (!command_number(line, "lease", COMMAND_LEASE_MIN_S, COMMAND_LEASE_MAX_S,
                        COMMAND_LEASE_S, &lease_s))
        return;
    if (control->holder != NULL && control->holder != line->client) {
        command_refuse(line, "CONTROL", "another client has control");
        return;
    }
    control->lease_ns = llrint(lease_s * 1e9);
    control->lease_end_ns = control->now_ns + control->lease_ns;
    if (control->holder == NULL) {
        cJSON *object = service_event_object("control", control->now_ns);
        cJSON_AddBoolToObject(object, "held", true);
        service_tell_all(control, object);
        cJSON_Delete(object);
    }
    control->holder = line->client;
    command_done(line);
}

/* --- for who has control --- */

static void command_renew(const struct command_line *line)
{
    command_done(line); /* every line of the holder renews the lease */
}

static void command_release(const struct command_line *line)
{
    command_done(line);
    service_release(line->control, "released");
}

static void command_simple(const struct command_line *line,
                           enum mailbox_command command)
{
    const struct mailbox_entry entry = { .command = command };
    command_send(line, &entry);
}

static void command_enable(const struct command_line *line)
{
    command_simple(line, MAILBOX_ENABLE);
}

static void command_off(const struct command_line *line)
{
    command_simple(line, MAILBOX_OFF);
}

static void command_reset(const struct command_line *line)
{
    command_simple(line, MAILBOX_RESET);
}

static void command_hold(const struct command_line *line)
{
    command_simple(line, MAILBOX_HOLD);
}

static void command_resume(const struct command_line *line)
{
    command_simple(line, MAILBOX_RESUME);
}

static void command_reverse(const struct command_line *line)
{
    const cJSON *back = command_member(line, "back");
    const struct mailbox_entry entry = { .command = MAILBOX_REVERSE,
                                         .value = !cJSON_IsFalse(back) };
    command_send(line, &entry);
}

static void command_override(const struct command_line *line)
{
    double percent;
    if (!command_number(line, "percent", 0, 200, (double)NAN, &percent))
        return;
    const struct mailbox_entry entry = {
        .command = MAILBOX_OVERRIDE,
        .value = llrint(percent / 100 * (double)MOTION_CLOCK_WARP_ONE_Q30),
    };
    command_send(line, &entry);
}

static void command_capture(const struct command_line *line)
{
    const struct mailbox_entry entry = { .command = MAILBOX_CAPTURE,
                                         .pos_q32 =
                                             line->control->capture_q32 };
    command_send(line, &entry);
}

/* So far that only the dead man's time stops it, or the end of the range of an
 * axis that is homed. */
static int64_t command_far_q32(const struct service_control *control,
                               unsigned axis, int64_t speed_q32)
{
    const struct machine_view_axis *at = &control->state->view.axis[axis];
    const struct plan_limit *limit = &control->rig->axis[axis].limit;
    int64_t far_q32;
    if (at->homed)
        return speed_q32 < 0 ? limit->pos_min_q32 : limit->pos_max_q32;
    if (motion_fixed_muldiv(speed_q32, COMMAND_FAR_S, 1, &far_q32) < 0 ||
        motion_fixed_add(at->demand_q32, far_q32, &far_q32) < 0)
        return at->demand_q32;
    return far_q32;
}

static void command_jog(const struct command_line *line)
{
    struct service_control *control = line->control;
    struct mailbox_entry entry = { .command = MAILBOX_JOG };
    int64_t speed_q32;
    double for_s;
    const int axis =
        command_axis(line, cJSON_GetStringValue(command_member(line, "axis")));
    if (axis < 0 ||
        !command_quantity(line, "speed", (unsigned)axis, UNITS_VELOCITY,
                          &speed_q32) ||
        !command_number(line, "for", 0.001, PLAYBACK_JOG_MAX_NS / 1e9,
                        COMMAND_JOG_S, &for_s))
        return;
    entry.axis = (unsigned)axis;
    entry.vel_q32 = speed_q32 < 0 ? -speed_q32 : speed_q32;
    entry.for_ns = llrint(for_s * 1e9);
    entry.value = command_far_q32(control, entry.axis, speed_q32);
    if (command_member(line, "to") != NULL &&
        !command_quantity(line, "to", entry.axis, UNITS_POSITION, &entry.value))
        return;
    control->jogged = true;
    command_send(line, &entry);
}

static void command_jog_stop(const struct command_line *line)
{
    if (line->control->state->jogging)
        command_simple(line, MAILBOX_JOG_STOP);
    else
        command_done(line);
}

/* All axes that can be homed, or those of the list. */
static void command_home(const struct command_line *line)
{
    struct service_request request = { .kind = SERVICE_HOME };
    const cJSON *axes = command_member(line, "axes"), *item;
    if (axes == NULL)
        request.axes = UINT64_MAX;
    if (axes != NULL && !cJSON_IsArray(axes)) {
        command_refuse(line, "ARG", "\"axes\": expected a list of names");
        return;
    }
    cJSON_ArrayForEach(item, axes)
    {
        const int axis = command_axis(line, cJSON_GetStringValue(item));
        if (axis < 0)
            return;
        request.axes |= (uint64_t)1 << axis;
    }
    if (line->control->rig->axis_count < 64)
        request.axes &= ((uint64_t)1 << line->control->rig->axis_count) - 1;
    command_ask(line, &request);
}

/* --- moves --- */

static void command_plan(const struct command_line *line, bool loads)
{
    const char *text = cJSON_GetStringValue(command_member(line, "text"));
    struct service_client *client = line->client;
    if (text == NULL) {
        command_refuse(line, "ARG",
                       "\"text\": expected the text of a move "
                       "file");
        return;
    }
    if (client->planning ||
        !service_planner_ask(&line->control->planner, text)) {
        command_refuse(line, "BUSY", "another move is being planned");
        return;
    }
    client->planning = true;
    client->plan_loads = loads;
    memcpy(client->plan_id, line->id, sizeof client->plan_id);
}

static void command_load(const struct command_line *line)
{
    command_plan(line, true);
}

static void command_check(const struct command_line *line)
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
    cJSON *object = command_object(client->plan_id, move->status == STATUS_OK);
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
    command_answer(client, object);
}

void service_command_planned(struct service_control *control,
                             struct service_move *move)
{
    struct service_client *client = command_planner(control);
    const bool loads = client != NULL && client->plan_loads &&
                       client == control->holder && move->status == STATUS_OK;
    if (client == NULL) {
        service_move_free(move);
        return;
    }
    client->planning = false;
    if (loads && !command_may_load(control)) {
        command_fail(client, client->plan_id, "STATE",
                     "a move is loaded at rest only");
        service_move_free(move);
        return;
    }
    if (client->plan_loads && client != control->holder) {
        command_fail(client, client->plan_id, "CONTROL",
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
    command_refuse(line, "EMPTY", "no move is loaded");
    return false;
}

static void command_start(const struct command_line *line)
{
    struct service_request request = {
        .kind = SERVICE_START,
        .is_ping_pong = cJSON_IsTrue(command_member(line, "ping_pong")),
    };
    double times;
    if (!command_number(line, "times", 0, 1e9, 1, &times) ||
        !command_has_move(line))
        return;
    request.times = llrint(times);
    request.motion = &line->control->move->motion;
    command_ask(line, &request);
}

/* To the first keys of what is loaded. */
static void command_approach(const struct command_line *line)
{
    struct service_control *control = line->control;
    struct service_request request = { .kind = SERVICE_START, .times = 1 };
    int64_t pos_q32[CONTROLLER_AXES_MAX];
    if (!command_has_move(line))
        return;
    if (control->state->state != CONTROLLER_READY || control->state->homing) {
        command_refuse(line, "STATE", motion_err_text(MOTION_E_STATE));
        return;
    }
    for (unsigned i = 0; i < control->rig->axis_count; i++)
        pos_q32[i] = control->state->view.axis[i].demand_q32;
    const int any = service_move_approach(control->move, pos_q32);
    if (any < 0)
        command_refuse(line, command_error(any), motion_err_text(any));
    if (any == 0)
        command_done(line);
    if (any <= 0)
        return;
    request.motion = &control->move->approach;
    command_ask(line, &request);
}

/* --- a line --- */

static const struct {
    const char *name;
    bool held; /* for who has control alone */
    void (*run)(const struct command_line *line);
} command_row[] = {
    { "hello", false, command_hello },
    { "status", false, command_status },
    { "stream", false, command_stream },
    { "stop", false, command_stop },
    { "take", false, command_take },
    { "renew", true, command_renew },
    { "release", true, command_release },
    { "enable", true, command_enable },
    { "off", true, command_off },
    { "reset", true, command_reset },
    { "home", true, command_home },
    { "check", true, command_check },
    { "load", true, command_load },
    { "approach", true, command_approach },
    { "start", true, command_start },
    { "hold", true, command_hold },
    { "resume", true, command_resume },
    { "reverse", true, command_reverse },
    { "override", true, command_override },
    { "jog", true, command_jog },
    { "jog stop", true, command_jog_stop },
    { "capture", true, command_capture },
};

static void command_run(struct command_line *line)
{
    struct service_control *control = line->control;
    const char *name = cJSON_GetStringValue(command_member(line, "command"));
    size_t i = 0;
    while (i < ARRAY_LEN(command_row) &&
           (name == NULL || strcmp(command_row[i].name, name) != 0))
        i++;
    if (i == ARRAY_LEN(command_row)) {
        command_refuse(line, "COMMAND", "there is no such command");
        return;
    }
    if (command_row[i].held && control->holder != line->client) {
        command_refuse(line, "CONTROL",
                       "this is for the client that has control, expected "
                       "\"take\" first");
        return;
    }
    if (control->holder == line->client)
        control->lease_end_ns = control->now_ns + control->lease_ns;
    command_row[i].run(line);
}

/* An id is a number or a short text, and comes back as it was. */
static bool command_id(struct command_line *line)
{
    cJSON *id = cJSON_GetObjectItemCaseSensitive(line->request, "id");
    line->id[0] = '\0';
    if (id == NULL)
        return true;
    if ((cJSON_IsNumber(id) || cJSON_IsString(id)) &&
        cJSON_PrintPreallocated(id, line->id, sizeof line->id, false))
        return true;
    line->id[0] = '\0';
    return false;
}

void service_command(struct service_control *control,
                     struct service_client *client, const char *text)
{
    struct command_line line = { .control = control, .client = client };
    cJSON *request = cJSON_ParseWithOpts(text, NULL, true);
    line.request = request;
    if (!cJSON_IsObject(request))
        command_refuse(&line, "JSON", "expected one JSON object per line");
    else if (!command_id(&line))
        command_refuse(&line, "ARG",
                       "\"id\": expected a number or a text of at "
                       "most 50 bytes");
    else
        command_run(&line);
    cJSON_Delete(request);
}
