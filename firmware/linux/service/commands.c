/* firmware/linux/service/commands.c - the commands of the protocol; see
 * control.h. */
#include <math.h>
#include <string.h>

#include "firmware/host/base/array.h"
#include "firmware/host/base/json.h"
#include "firmware/host/base/number.h"
#include "firmware/host/job/budget.h"
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
                            const struct service_flight *flight,
                            const struct mailbox_entry *entry)
{
    struct service_client *client =
        service_asker(control, flight->asker, flight->seat);
    if (!flight->by_request && entry->command == MAILBOX_COUPLE &&
        entry->err == MOTION_OK)
        service_cam_taken(control, entry->axis);
    if (client == NULL)
        return;
    char text[SERVICE_COUPLE_TEXT_MAX];
    const char *why = control->loop->request.why;
    if (entry->err < 0 && (!flight->by_request || why[0] == '\0'))
        why = service_couple_refusal(control, entry, text, sizeof text);
    cJSON *object = entry->err < 0
                        ? command_line_failure(
                              flight->id, command_line_error(entry->err), why)
                        : command_line_object(flight->id, true);
    if (!flight->by_request && entry->command == MAILBOX_CAPTURE &&
        entry->err == MOTION_OK)
        command_add_key(control, object, entry->value);
    service_client_answer(&control->clients, client, object);
}

/* --- for everybody --- */

static void command_hello(const struct command_line *line)
{
    cJSON *object = command_line_object(line->id, true);
    service_report_hello(line->control, object);
    command_line_answer(line, object);
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
        connected += clients->client[i].is_here;
    cJSON_AddNumberToObject(object, "clients", connected);
    cJSON_AddNumberToObject(object, "clients_refused",
                            (double)clients->refused);
    cJSON_AddNumberToObject(object, "dropped", (double)line->client->dropped);
    command_record_status(control, object);
    cJSON_AddStringToObject(object, "follow", control->follow_text);
    cJSON_AddBoolToObject(object, "held", control->holder != NULL);
    cJSON_AddBoolToObject(object, "holder", control->holder == line->client);
    cJSON_AddNumberToObject(object, "stops", clients->mailbox->stops);
    if (control->move != NULL)
        cJSON_AddStringToObject(object, "move", control->move->facts.title);
    command_line_answer(line, object);
}

static void command_latency(const struct command_line *line)
{
    cJSON *object = command_line_object(line->id, true);
    service_report_latency(line->control, object);
    command_line_answer(line, object);
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

/* One that the reader has not seen for what it is. */
static void command_stop(const struct command_line *line)
{
    struct service_clients *clients = &line->control->clients;
    (void)pthread_mutex_lock(&clients->lock);
    mailbox_stop(clients->mailbox);
    (void)pthread_mutex_unlock(&clients->lock);
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

/* Refuse a bus that cannot carry the rig: its drives would be lost once they have
 * torque. */
static void command_enable(const struct command_line *line)
{
    struct messages messages = { .text = NULL };
    enum message_kind kind;
    size_t at = 0;
    if (budget_check(line->control->rig, line->control->rig_path, &messages))
        command_simple(line, MAILBOX_ENABLE);
    else
        command_line_refuse(line, "LIMIT",
                            messages_next(&messages, &at, &kind));
    messages_free(&messages);
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

/* A stop may be over before the next of the jogs by which a button that is held
 * says that it is: none of them moves anything until it has been let go. */
static bool command_jog_is_cut(struct service_control *control, int64_t for_ns)
{
    const uint32_t stops = control->loop->mailbox.stops;
    if (control->now_ns >= control->jog_held_ns)
        control->jog_held_stops = stops;
    control->jog_held_ns = control->now_ns + for_ns;
    return control->jog_held_stops != stops;
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
    if (command_jog_is_cut(control, entry.for_ns)) {
        command_line_refuse(line, "STATE",
                            "a stop has ended this jog, expected it let go: "
                            "\"jog stop\", or none for as long as \"for\"");
        return;
    }
    control->jogged = true;
    command_line_send(line, &entry);
}

static void command_jog_stop(const struct command_line *line)
{
    line->control->jog_held_ns = 0;
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

enum command_flag {
    COMMAND_HELD = 1, /* for who has control alone */
    COMMAND_TICK = 2, /* may go to the tick */
    COMMAND_MOVES =
        4,            /* sets something in motion: a later stop takes it back */
    COMMAND_SETS = 8, /* says all itself: the last one counts */
};
#define COMMAND_HELD_TICK  (COMMAND_HELD | COMMAND_TICK)
#define COMMAND_HELD_MOVES (COMMAND_HELD | COMMAND_TICK | COMMAND_MOVES)
#define COMMAND_HELD_SETS  (COMMAND_HELD_TICK | COMMAND_SETS)

static const struct command_row {
    const char *name;
    unsigned flags;
    void (*run)(const struct command_line *line);
} command_row[] = {
    { "hello", 0, command_hello },
    { "status", 0, command_status },
    { "latency", 0, command_latency },
    { "stream", 0, command_stream },
    { "stop", 0, command_stop },
    { "take", 0, command_take },
    { "cancel", 0, command_cancel },
    { "renew", COMMAND_HELD, command_renew },
    { "release", COMMAND_HELD, command_release },
    { "check", COMMAND_HELD, command_check },
    { "load", COMMAND_HELD, command_load },
    { "record", COMMAND_HELD, command_record },
    { "record stop", COMMAND_HELD, command_record_stop },
    { "enable", COMMAND_HELD_TICK, command_enable },
    { "off", COMMAND_HELD_TICK, command_off },
    { "reset", COMMAND_HELD_TICK, command_reset },
    { "hold", COMMAND_HELD_TICK, command_hold },
    { "loop", COMMAND_HELD_TICK, command_loop },
    { "override", COMMAND_HELD_SETS, command_override },
    { "jog stop", COMMAND_HELD_TICK, command_jog_stop },
    { "capture", COMMAND_HELD_TICK, command_capture },
    { "gear", COMMAND_HELD_TICK, command_gear },
    { "cam", COMMAND_HELD_TICK, command_cam },
    { "uncouple", COMMAND_HELD_TICK, command_uncouple },
    { "home", COMMAND_HELD_MOVES, command_home },
    { "approach", COMMAND_HELD_MOVES, command_approach },
    { "start", COMMAND_HELD_MOVES, command_start },
    { "go", COMMAND_HELD_MOVES, command_go },
    { "resume", COMMAND_HELD_MOVES, command_resume },
    { "step", COMMAND_HELD_MOVES, command_step },
    { "reverse", COMMAND_HELD_MOVES, command_reverse },
    { "jog", COMMAND_HELD_SETS | COMMAND_MOVES, command_jog },
};

/* An id is a number or a short text, and comes back as it was. */
static bool command_id(struct service_client *client)
{
    cJSON *id = cJSON_GetObjectItemCaseSensitive(client->head.object, "id");
    client->id[0] = '\0';
    if (id == NULL)
        return true;
    if ((cJSON_IsNumber(id) || cJSON_IsString(id)) &&
        cJSON_PrintPreallocated(id, client->id, sizeof client->id, false))
        return true;
    client->id[0] = '\0';
    return false;
}

/* The row of a request that can be done; NULL: it has been refused. */
static const struct command_row *command_find(const struct command_line *line)
{
    const char *name =
        cJSON_GetStringValue(command_line_member(line, "command"));
    size_t i = 0;
    while (i < ARRAY_LEN(command_row) &&
           (name == NULL || strcmp(command_row[i].name, name) != 0))
        i++;
    const struct command_row *row = &command_row[i];
    if (!cJSON_IsObject(line->request))
        command_line_refuse(line, "JSON", "expected one JSON object per line");
    else if (!command_id(line->client))
        command_line_refuse(line, "ARG",
                            "\"id\": expected a number or a text of at "
                            "most 50 bytes");
    else if (i == ARRAY_LEN(command_row))
        command_line_refuse(line, "COMMAND", "there is no such command");
    else if ((row->flags & COMMAND_HELD) != 0 &&
             line->control->holder != line->client)
        command_line_refuse(line, "CONTROL",
                            "this is for the client that has control, expected "
                            "\"take\" first");
    else if ((row->flags & COMMAND_TICK) != 0 && line->control->loop->end != 0)
        command_line_refuse(line, "STATE", "the service ends");
    else
        return row;
    return NULL;
}

static bool command_is_set(enum mailbox_command command)
{
    return command == MAILBOX_JOG || command == MAILBOX_OVERRIDE;
}

/* What was sent before it is to be answered first, so that it finds the state
 * that came of that; what says all itself waits for no other of its kind. */
static bool command_waits(const struct service_control *control,
                          const struct command_row *row)
{
    bool sets = (row->flags & COMMAND_SETS) != 0;
    if ((row->flags & COMMAND_TICK) == 0)
        return false;
    for (unsigned i = 0; i < control->flights; i++)
        sets &= command_is_set(
            control->flight[(control->flight_first + i) % SERVICE_FLIGHTS]
                .command);
    return control->jog_stops || control->flights >= SERVICE_FLIGHTS_ASKED ||
           (control->flights > 0 && !sets);
}

static const char *command_text(const cJSON *request, const char *name)
{
    const char *text =
        cJSON_GetStringValue(cJSON_GetObjectItemCaseSensitive(request, name));
    return text == NULL ? "" : text;
}

/* One that waits for the tick is of no use any more once there is another of its
 * axis: whoever sends more than a tick takes is not behind for that. */
static bool command_is_superseded(const struct command_line *line,
                                  const struct command_row *row)
{
    struct service_client *client = line->client;
    if ((row->flags & COMMAND_SETS) == 0 ||
        !service_client_next(&line->control->clients, client) ||
        strcmp(command_text(client->next.object, "command"), row->name) != 0 ||
        strcmp(command_text(client->next.object, "axis"),
               command_text(client->head.object, "axis")) != 0)
        return false;
    cJSON *object = command_line_object(line->id, true);
    cJSON_AddBoolToObject(object, "superseded", true);
    command_line_answer(line, object);
    return true;
}

bool service_command(struct service_control *control,
                     struct service_client *client)
{
    struct command_line line = { .control = control,
                                 .client = client,
                                 .id = client->id };
    if (!client->head.is_there &&
        !service_client_next(&control->clients, client))
        return false;
    line.request = client->head.object;
    const struct command_row *row = command_find(&line);
    const bool waits = row != NULL && command_waits(control, row);
    if (waits && !command_is_superseded(&line, row))
        return false;
    if (row != NULL && control->holder == client)
        control->lease_end_ns = control->now_ns + control->lease_ns;
    line.moves = row != NULL && (row->flags & COMMAND_MOVES) != 0;
    if (row != NULL && !waits)
        row->run(&line);
    service_client_forget(client);
    return true;
}
