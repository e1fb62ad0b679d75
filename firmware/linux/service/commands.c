/* firmware/linux/service/commands.c - the commands of the protocol; see
 * control.h. */
#include <math.h>
#include <string.h>

#include "firmware/host/base/array.h"
#include "firmware/host/base/json.h"
#include "firmware/host/base/number.h"
#include "firmware/linux/service/command_line.h"
#include "motion/core/err.h"
#include "motion/core/fixed.h"

#define COMMAND_LEASE_S     5.0 /* when not given */
#define COMMAND_LEASE_MIN_S 0.2
#define COMMAND_LEASE_MAX_S 60.0
#define COMMAND_RATE_MAX    100.0 /* of a stream, Hz */
#define COMMAND_JOG_S       0.25
#define COMMAND_FAR_S       100

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
    struct service_client *client = command_line_asker(control);
    if (!control->by_request && entry->command == MAILBOX_COUPLE &&
        entry->err == MOTION_OK)
        service_cam_taken(control, entry->axis);
    if (client == NULL)
        return;
    if (entry->err < 0) {
        char text[SERVICE_COUPLE_TEXT_MAX];
        command_line_fail(
            client, control->id, command_line_error(entry->err),
            service_couple_refusal(control, entry, text, sizeof text));
        return;
    }
    cJSON *object = command_line_object(control->id, true);
    if (!control->by_request && entry->command == MAILBOX_CAPTURE)
        command_add_key(control, object, entry->value);
    command_line_answer(client, object);
}

/* --- for everybody --- */

static void command_hello(const struct command_line *line)
{
    cJSON *object = command_line_object(line->id, true);
    service_report_hello(line->control, object);
    command_line_answer(line->client, object);
}

static void command_status(const struct command_line *line)
{
    const struct service_control *control = line->control;
    const struct service_clients *clients = &control->clients;
    cJSON *object = command_line_object(line->id, true);
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
    command_record_status(control, object);
    cJSON_AddStringToObject(object, "follow", control->follow_text);
    cJSON_AddBoolToObject(object, "held", control->holder != NULL);
    cJSON_AddBoolToObject(object, "holder", control->holder == line->client);
    if (control->move != NULL)
        cJSON_AddStringToObject(object, "move", control->move->facts.title);
    command_line_answer(line->client, object);
}

static void command_latency(const struct command_line *line)
{
    cJSON *object = command_line_object(line->id, true);
    service_report_latency(line->control, object);
    command_line_answer(line->client, object);
}

static void command_stream(const struct command_line *line)
{
    double rate;
    if (!command_line_number(line, "rate", 0, COMMAND_RATE_MAX, 10, &rate))
        return;
    if (rate > 0 && rate < 0.01) {
        command_line_refuse(line, "ARG",
                            "\"rate\": expected 0 or 0.01 to 100 Hz");
        return;
    }
    line->client->stream_ns = rate > 0 ? llrint(1e9 / rate) : 0;
    line->client->stream_due_ns = line->control->now_ns;
    command_line_done(line);
}

static void command_stop(const struct command_line *line)
{
    mailbox_stop(&line->control->loop->mailbox);
    command_line_done(line);
}

static void command_take(const struct command_line *line)
{
    struct service_control *control = line->control;
    double lease_s;
    if (!command_line_number(line, "lease", COMMAND_LEASE_MIN_S,
                             COMMAND_LEASE_MAX_S, COMMAND_LEASE_S, &lease_s))
        return;
    if (control->holder != NULL && control->holder != line->client) {
        command_line_refuse(line, "CONTROL", "another client has control");
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
    command_line_done(line);
}

/* --- for who has control --- */

static void command_renew(const struct command_line *line)
{
    command_line_done(line); /* every line of the holder renews the lease */
}

static void command_release(const struct command_line *line)
{
    command_line_done(line);
    service_release(line->control, "released");
}

static void command_simple(const struct command_line *line,
                           enum mailbox_command command)
{
    const struct mailbox_entry entry = { .command = command };
    command_line_send(line, &entry);
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

/* A shoot that waits; one that is held elsewhere is for resume. */
static void command_step(const struct command_line *line)
{
    if (line->control->state->waits_for == 0)
        command_line_refuse(line, "STATE", "no frame waits to be taken");
    else
        command_simple(line, MAILBOX_RESUME);
}

static void command_reverse(const struct command_line *line)
{
    const cJSON *back = command_line_member(line, "back");
    const struct mailbox_entry entry = { .command = MAILBOX_REVERSE,
                                         .value = !cJSON_IsFalse(back) };
    if (entry.value == 0 || command_may_repeat(line))
        command_line_send(line, &entry);
}

static void command_override(const struct command_line *line)
{
    double percent;
    if (!command_line_number(line, "percent", 0, 200, (double)NAN, &percent))
        return;
    const struct mailbox_entry entry = {
        .command = MAILBOX_OVERRIDE,
        .value = llrint(percent / 100 * (double)MOTION_CLOCK_WARP_ONE_Q30),
    };
    if (!command_is_steered(line) && command_keeps_shots(line, entry.value))
        command_line_send(line, &entry);
}

static void command_capture(const struct command_line *line)
{
    const struct mailbox_entry entry = { .command = MAILBOX_CAPTURE,
                                         .pos_q32 =
                                             line->control->capture_q32 };
    command_line_send(line, &entry);
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
    const int axis = command_line_axis(
        line, cJSON_GetStringValue(command_line_member(line, "axis")));
    if (axis < 0 ||
        !command_line_quantity(line, "speed", (unsigned)axis, UNITS_VELOCITY,
                               &speed_q32) ||
        !command_line_number(line, "for", 0.001, PLAYBACK_JOG_MAX_NS / 1e9,
                             COMMAND_JOG_S, &for_s))
        return;
    entry.axis = (unsigned)axis;
    entry.vel_q32 = speed_q32 < 0 ? -speed_q32 : speed_q32;
    entry.for_ns = llrint(for_s * 1e9);
    entry.value = command_far_q32(control, entry.axis, speed_q32);
    if (command_line_member(line, "to") != NULL &&
        !command_line_quantity(line, "to", entry.axis, UNITS_POSITION,
                               &entry.value))
        return;
    control->jogged = true;
    command_line_send(line, &entry);
}

static void command_jog_stop(const struct command_line *line)
{
    if (line->control->state->jogging)
        command_simple(line, MAILBOX_JOG_STOP);
    else
        command_line_done(line);
}

/* All axes that can be homed, or those of the list. */
static void command_home(const struct command_line *line)
{
    struct service_request request = { .kind = SERVICE_HOME };
    const cJSON *axes = command_line_member(line, "axes"), *item;
    if (axes == NULL)
        request.axes = UINT64_MAX;
    if (axes != NULL && !cJSON_IsArray(axes)) {
        command_line_refuse(line, "ARG", "\"axes\": expected a list of names");
        return;
    }
    cJSON_ArrayForEach(item, axes)
    {
        const int axis = command_line_axis(line, cJSON_GetStringValue(item));
        if (axis < 0)
            return;
        request.axes |= (uint64_t)1 << axis;
    }
    if (line->control->rig->axis_count < 64)
        request.axes &= ((uint64_t)1 << line->control->rig->axis_count) - 1;
    command_line_request(line, &request);
}

/* --- a line --- */

static const struct {
    const char *name;
    bool held; /* for who has control alone */
    void (*run)(const struct command_line *line);
} command_row[] = {
    { "hello", false, command_hello },
    { "status", false, command_status },
    { "latency", false, command_latency },
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
    { "cancel", false, command_cancel },
    { "approach", true, command_approach },
    { "start", true, command_start },
    { "go", true, command_go },
    { "loop", true, command_loop },
    { "hold", true, command_hold },
    { "resume", true, command_resume },
    { "step", true, command_step },
    { "reverse", true, command_reverse },
    { "override", true, command_override },
    { "jog", true, command_jog },
    { "jog stop", true, command_jog_stop },
    { "capture", true, command_capture },
    { "gear", true, command_gear },
    { "cam", true, command_cam },
    { "uncouple", true, command_uncouple },
    { "record", true, command_record },
    { "record stop", true, command_record_stop },
};

static void command_run(struct command_line *line)
{
    struct service_control *control = line->control;
    const char *name =
        cJSON_GetStringValue(command_line_member(line, "command"));
    size_t i = 0;
    while (i < ARRAY_LEN(command_row) &&
           (name == NULL || strcmp(command_row[i].name, name) != 0))
        i++;
    if (i == ARRAY_LEN(command_row)) {
        command_line_refuse(line, "COMMAND", "there is no such command");
        return;
    }
    if (command_row[i].held && control->holder != line->client) {
        command_line_refuse(line, "CONTROL",
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
        command_line_refuse(&line, "JSON", "expected one JSON object per line");
    else if (!command_id(&line))
        command_line_refuse(&line, "ARG",
                            "\"id\": expected a number or a text of at "
                            "most 50 bytes");
    else
        command_run(&line);
    cJSON_Delete(request);
}
