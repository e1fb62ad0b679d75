/* firmware/linux/service/control.c - see control.h. */
#include "firmware/linux/service/control.h"

#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "firmware/host/base/json.h"
#include "firmware/host/base/memory.h"
#include "firmware/host/recording/drive_events.h"
#include "firmware/host/recording/row_notes.h"
#include "firmware/linux/base/error.h"
#include "motion/core/err.h"

/* The tick's clock, so that a test's virtual time is that of leases, too. */
static int64_t control_now_ns(const struct service_control *control)
{
    return hal_clock_now_ns(control->loop->machine->ports.clock);
}

void service_control_reserve(struct service_control *control,
                             struct memory_pool *pool)
{
    const unsigned axes = control->rig->axis_count;
    control->capture_q32 =
        memory_pool_new(pool, axes, sizeof *control->capture_q32);
    control->cam = memory_pool_new(pool, axes, sizeof *control->cam);
}

void service_tell_all(struct service_control *control, const cJSON *object)
{
    char *text = cJSON_PrintUnformatted(object);
    for (unsigned i = 0; i < SERVICE_CLIENTS && text != NULL; i++)
        if (control->clients.client[i].is_here)
            service_client_tell(&control->clients, &control->clients.client[i],
                                text);
    free(text);
}

cJSON *service_event_object(const char *name, int64_t now_ns)
{
    cJSON *object = cJSON_CreateObject();
    cJSON_AddStringToObject(object, "event", name);
    cJSON_AddNumberToObject(object, "t_s", (double)now_ns / 1e9);
    return object;
}

/* --- control --- */

void service_release(struct service_control *control, const char *why)
{
    cJSON *object = service_event_object("control", control->now_ns);
    control->jog_stops |= control->jogged;
    control->jogged = false;
    control->jog_held_ns = 0;
    control->holder = NULL;
    cJSON_AddBoolToObject(object, "held", false);
    cJSON_AddStringToObject(object, "why", why);
    service_tell_all(control, object);
    cJSON_Delete(object);
}

static void control_came(void *context, struct service_client *client)
{
    struct service_control *control = context;
    cJSON *object = cJSON_CreateObject();
    cJSON_AddStringToObject(object, "event", "hello");
    service_report_hello(control, object);
    service_client_answer(&control->clients, client, object);
}

static void control_gone(void *context, struct service_client *client)
{
    struct service_control *control = context;
    if (control->plan.asker == client->number)
        service_plan_give_up(control, NULL);
    if (control->holder == client)
        service_release(control, "gone");
}

/* --- from the tick --- */

/* The answer to the oldest; false: the tick has not had it yet. */
static bool control_landed(struct service_control *control,
                           const struct service_flight *flight,
                           struct mailbox_entry *entry)
{
    struct service_loop *loop = control->loop;
    if (!flight->by_request) {
        /* the state that came of it is out: whoever asks next sees it */
        control->state = service_board_read(&loop->board);
        return control->state->commands_done != loop->mailbox.answered &&
               mailbox_answer(&loop->mailbox, entry);
    }
    if (loop->turn != SERVICE_DONE)
        return false;
    *entry = (struct mailbox_entry){ .err = loop->request.err };
    loop->turn = SERVICE_FREE;
    control->state = service_board_read(&loop->board);
    return true;
}

static void control_answer(struct service_control *control)
{
    struct mailbox_entry entry;
    while (control->flights > 0) {
        const struct service_flight flight =
            control->flight[control->flight_first % SERVICE_FLIGHTS];
        if (!control_landed(control, &flight, &entry))
            return;
        control->flight_first++;
        control->flights--;
        service_command_answer(control, &flight, &entry);
    }
}

static void control_warning(const struct service_control *control,
                            const struct service_event *event, cJSON *object)
{
    const struct rig_axis *axis = &control->rig->axis[event->index];
    const struct warning *warning = &event->warning;
    char text[WARNING_TEXT_MAX];
    warning_text(warning, axis, text);
    cJSON_AddStringToObject(object, "axis", axis->name);
    cJSON_AddStringToObject(object, "code", warning_word(warning->kind));
    json_add_fixed(object, "value", warning->value_q32, 32);
    if (!warning_is_of_speed(warning->kind))
        json_add_fixed(object, "limit", warning->limit_q32, 32);
    cJSON_AddStringToObject(object, "unit", warning_unit(warning->kind, axis));
    cJSON_AddStringToObject(object, "text", text);
    if (warning_is_of_speed(warning->kind)) /* before a client can be there */
        error_say("slew: warning: %s", text);
}

static void control_drive(const struct service_control *control,
                          const struct service_event *event, cJSON *object)
{
    const char *axis = control->rig->axis[event->index].name;
    char words[DRIVE_EVENTS_TEXT_MAX], text[MACHINE_FAULT_MAX];
    drive_events_text(&event->drive, words);
    snprintf(text, sizeof text, "%s: %s", axis, words);
    cJSON_AddStringToObject(object, "axis", axis);
    drive_events_json(&event->drive, object);
    cJSON_AddStringToObject(object, "text", text);
}

static void control_bus(const struct service_control *control,
                        const struct service_event *event, cJSON *object)
{
    const char *bus = control->rig->bus[event->index].name;
    char text[MACHINE_FAULT_MAX];
    snprintf(text, sizeof text, "bus %s: error-warning", bus);
    cJSON_AddStringToObject(object, "bus", bus);
    cJSON_AddStringToObject(object, "code", "error_warning");
    cJSON_AddNumberToObject(object, "count", (double)event->count);
    cJSON_AddStringToObject(object, "text", text);
}

static void control_guardian(const struct service_control *control,
                             const struct service_event *event, cJSON *object)
{
    const char *text = row_notes_guardian_text(event->is_gone);
    (void)control;
    cJSON_AddBoolToObject(object, "gone", event->is_gone);
    cJSON_AddNumberToObject(object, "count", (double)event->count);
    cJSON_AddStringToObject(object, "text", text);
    error_say("slew: warning: %s", text);
}

static void control_fault(const struct service_control *control,
                          const struct service_event *event, cJSON *object)
{
    (void)control;
    cJSON_AddStringToObject(object, "code", service_fault_code(event->fault));
    cJSON_AddStringToObject(object, "text", event->text);
}

static void control_homing(const struct service_control *control,
                           const struct service_event *event, cJSON *object)
{
    (void)control;
    cJSON_AddBoolToObject(object, "done", event->text[0] == '\0');
    if (event->text[0] != '\0')
        cJSON_AddStringToObject(object, "text", event->text);
}

static void control_lost(const struct service_control *control,
                         const struct service_event *event, cJSON *object)
{
    (void)control;
    cJSON_AddNumberToObject(object, "count", (double)event->count);
}

static void control_event(struct service_control *control,
                          const struct service_event *event)
{
    static const struct {
        const char *name;
        void (*add)(const struct service_control *control,
                    const struct service_event *event, cJSON *object);
    } kind[] = {
        [SERVICE_EVENT_STATE] = { "state", NULL },
        [SERVICE_EVENT_FAULT] = { "fault", control_fault },
        [SERVICE_EVENT_HOMING] = { "homing", control_homing },
        [SERVICE_EVENT_LOST] = { "ticks lost", control_lost },
        [SERVICE_EVENT_WARNING] = { "warning", control_warning },
        [SERVICE_EVENT_DRIVE] = { "drive", control_drive },
        [SERVICE_EVENT_BUS] = { "bus", control_bus },
        [SERVICE_EVENT_GUARDIAN] = { "guardian", control_guardian },
    };
    cJSON *object = service_event_object(kind[event->kind].name, event->now_ns);
    cJSON_AddStringToObject(object, "state",
                            controller_state_text(event->state));
    if (kind[event->kind].add != NULL)
        kind[event->kind].add(control, event, object);
    if (event->kind == SERVICE_EVENT_FAULT)
        service_record_fault(control, event->now_ns, event->text);
    service_tell_all(control, object);
    cJSON_Delete(object);
}

/* --- streams --- */

/* The same text for all, but for what was dropped. */
static void control_stream_to(struct service_control *control,
                              struct service_client *client, char **text)
{
    char dropped[48];
    if (*text == NULL) {
        cJSON *object = cJSON_CreateObject();
        cJSON_AddStringToObject(object, "event", "stream");
        service_report_state(control, object);
        *text = cJSON_PrintUnformatted(object);
        cJSON_Delete(object);
    }
    const size_t length = *text == NULL ? 0 : strlen(*text);
    if (length == 0 || client->dropped == 0) {
        service_client_tell(&control->clients, client,
                            *text == NULL ? "{}" : *text);
        return;
    }
    snprintf(dropped, sizeof dropped, ",\"dropped\":%" PRIu64 "}",
             client->dropped);
    char *own = memory_new(length + sizeof dropped, 1);
    memcpy(own, *text, length - 1);
    memcpy(own + length - 1, dropped, strlen(dropped));
    service_client_tell(&control->clients, client, own);
    memory_free(own);
}

static void control_stream(struct service_control *control)
{
    char *text = NULL;
    for (unsigned i = 0; i < SERVICE_CLIENTS; i++) {
        struct service_client *client = &control->clients.client[i];
        if (!client->is_here || client->stream_ns == 0 ||
            control->now_ns < client->stream_due_ns)
            continue;
        client->stream_due_ns += client->stream_ns;
        if (client->stream_due_ns < control->now_ns)
            client->stream_due_ns = control->now_ns + client->stream_ns;
        control_stream_to(control, client, &text);
    }
    free(text);
}

static int control_wait_ms(const struct service_control *control, int most_ms)
{
    int64_t wait_ns = most_ms * INT64_C(1000000);
    if (control->goes_on)
        return 0;
    if (control->flights > 0)
        return most_ms < 1 ? most_ms : 1;
    for (unsigned i = 0; i < SERVICE_CLIENTS; i++) {
        const struct service_client *client = &control->clients.client[i];
        if (client->is_here && client->stream_ns > 0 &&
            client->stream_due_ns - control->now_ns < wait_ns)
            wait_ns = client->stream_due_ns - control->now_ns;
    }
    return wait_ns <= 0 ? 0 : (int)(wait_ns / 1000000) + 1;
}

/* --- a turn --- */

/* One request of each client. */
static void control_requests(struct service_control *control)
{
    control->goes_on = false;
    for (unsigned i = 0; i < SERVICE_CLIENTS; i++) {
        struct service_client *client = &control->clients.client[i];
        if (client->is_here && service_command(control, client))
            control->goes_on = true;
    }
}

static void control_lease(struct service_control *control)
{
    if (control->holder != NULL && control->now_ns >= control->lease_end_ns)
        service_release(control, "expired");
    /* what its client had sent before is to have reached the tick */
    if (!control->jog_stops || control->flights > 0)
        return;
    control->jog_stops = false;
    if (control->state->jogging &&
        mailbox_put(&control->loop->mailbox, MAILBOX_JOG_STOP, 0) == MOTION_OK)
        service_flies(control, MAILBOX_JOG_STOP);
}

void service_control_step(struct service_control *control, int timeout_ms)
{
    struct service_event event;
    control->now_ns = control_now_ns(control);
    service_clients_wait(&control->clients,
                         control_wait_ms(control, timeout_ms));
    control->now_ns = control_now_ns(control);
    control->state = service_board_read(&control->loop->board);
    service_clients_serve(&control->clients, control_came, control_gone,
                          control);
    while (service_board_take(&control->loop->board, &event))
        control_event(control, &event);
    control_answer(control);
    service_record_step(control);
    service_plan_step(control);
    service_follow_control(control);
    control_requests(control);
    control_lease(control);
    control_stream(control);
}
