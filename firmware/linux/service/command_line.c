/* firmware/linux/service/command_line.c - see command_line.h. */
#include "firmware/linux/service/command_line.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "firmware/host/base/array.h"
#include "motion/core/err.h"

#define COMMAND_VALUE_MAX 1e9

/* --- answers --- */

cJSON *command_line_object(const char *id, bool ok)
{
    cJSON *object = cJSON_CreateObject();
    if (id[0] != '\0')
        cJSON_AddRawToObject(object, "id", id);
    cJSON_AddBoolToObject(object, "ok", ok);
    return object;
}

void command_line_answer(const struct command_line *self, cJSON *object)
{
    service_client_answer(&self->control->clients, self->client, object);
}

void command_line_done(const struct command_line *self)
{
    command_line_answer(self, command_line_object(self->id, true));
}

cJSON *command_line_failure(const char *id, const char *error, const char *text)
{
    cJSON *object = command_line_object(id, false);
    cJSON_AddStringToObject(object, "error", error);
    cJSON_AddStringToObject(object, "text", text);
    return object;
}

void command_line_refuse(const struct command_line *self, const char *error,
                         const char *text)
{
    command_line_answer(self, command_line_failure(self->id, error, text));
}

const char *command_line_error(int err)
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

const cJSON *command_line_member(const struct command_line *self,
                                 const char *name)
{
    return cJSON_GetObjectItemCaseSensitive(self->request, name);
}

bool command_line_number(const struct command_line *self, const char *name,
                         double low, double high, double otherwise,
                         double *value)
{
    const cJSON *item = command_line_member(self, name);
    char text[128];
    *value = item == NULL ? otherwise : cJSON_GetNumberValue(item);
    if (isfinite(*value) && *value >= low && *value <= high)
        return true;
    snprintf(text, sizeof text, "\"%s\": expected a number from %g to %g", name,
             low, high);
    command_line_refuse(self, "ARG", text);
    return false;
}

static int64_t command_q32(double value)
{
    return llrint(value * 4294967296.0);
}

bool command_line_quantity(const struct command_line *self, const char *name,
                           unsigned axis, enum units_quantity quantity,
                           int64_t *value_q32)
{
    const cJSON *item = command_line_member(self, name);
    const struct units_context units = {
        .unit = self->control->rig->axis[axis].unit
    };
    char sentence[UNITS_SENTENCE_MAX];
    double value;
    if (!cJSON_IsString(item)) {
        if (!command_line_number(self, name, -COMMAND_VALUE_MAX,
                                 COMMAND_VALUE_MAX, (double)NAN, &value))
            return false;
        *value_q32 = command_q32(value);
        return true;
    }
    if (units_parse(item->valuestring, quantity, &units, value_q32, sentence) ==
        0)
        return true;
    command_line_refuse(self, "ARG", sentence);
    return false;
}

int command_line_axis(const struct command_line *self, const char *name)
{
    const struct rig *rig = self->control->rig;
    char text[QUOTE_LIST_MAX + 32], list[QUOTE_LIST_MAX];
    const int axis = name == NULL ? -1 : rig_axis_index(rig, name);
    if (axis >= 0)
        return axis;
    snprintf(text, sizeof text, "no such axis, expected %s",
             rig_axis_list(rig, list));
    command_line_refuse(self, "ARG", text);
    return -1;
}

/* --- to the tick --- */

static struct service_flight *line_flight(struct service_control *control)
{
    return &control->flight[(control->flight_first + control->flights++) %
                            SERVICE_FLIGHTS];
}

void service_flies(struct service_control *control,
                   enum mailbox_command command)
{
    *line_flight(control) = (struct service_flight){ .command = command };
}

static void line_flies(const struct command_line *self, bool by_request,
                       enum mailbox_command command)
{
    struct service_control *control = self->control;
    struct service_flight *flight = line_flight(control);
    *flight = (struct service_flight){
        .by_request = by_request,
        .command = command,
        .asker = self->client->number,
        .seat = (unsigned)(self->client - control->clients.client),
    };
    snprintf(flight->id, sizeof flight->id, "%s", self->id);
}

/* Sends what it is: an entry of the mailbox, or a request.  Under the lock of
 * those who stop, so that no stop comes between the look and the sending. */
static void line_send(const struct command_line *self,
                      const struct mailbox_entry *entry,
                      const struct service_request *request)
{
    struct service_clients *clients = &self->control->clients;
    struct service_loop *loop = self->control->loop;
    int err = MOTION_OK;
    (void)pthread_mutex_lock(&clients->lock);
    const bool is_stopped =
        self->moves && self->client->head.stops != loop->mailbox.stops;
    if (!is_stopped && entry != NULL) {
        err = mailbox_send(&loop->mailbox, entry);
    } else if (!is_stopped && request != NULL) {
        loop->request = *request;
        loop->turn = SERVICE_ASKED;
    }
    (void)pthread_mutex_unlock(&clients->lock);
    if (is_stopped)
        command_line_refuse(self, "STATE", "a stop has come after this");
    else if (err < 0)
        command_line_refuse(self, command_line_error(err),
                            motion_err_text(err));
    else
        line_flies(self, entry == NULL,
                   entry == NULL ? MAILBOX_COMMANDS : entry->command);
}

void command_line_send(const struct command_line *self,
                       const struct mailbox_entry *entry)
{
    line_send(self, entry, NULL);
}

void command_line_request(const struct command_line *self,
                          const struct service_request *request)
{
    line_send(self, NULL, request);
}

struct service_client *service_asker(struct service_control *control,
                                     uint64_t number, unsigned seat)
{
    struct service_client *client = &control->clients.client[seat];
    return number != 0 && client->is_here && client->number == number ? client
                                                                      : NULL;
}
