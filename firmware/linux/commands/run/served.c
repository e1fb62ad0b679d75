/* firmware/linux/commands/run/served.c - see served.h. */
#include "firmware/linux/commands/run/served.h"

#include <math.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>
#include <time.h>

#include "firmware/host/base/array.h"
#include "firmware/host/base/memory.h"
#include "firmware/linux/base/disk.h"
#include "firmware/linux/base/error.h"
#include "hal/support/crc32.h"

#define SERVED_FILE_MAX  1048576
#define SERVED_OFF_MS    5000  /* until drives confirm it */
#define SERVED_ANSWER_MS 10000 /* of silence: planning tells how far it is */

/* --- is it for the service? --- */

static bool served_names(struct served *self)
{
    const char *first = self->options->path[0];
    struct stat status;
    const bool directory = stat(first, &status) == 0 && S_ISDIR(status.st_mode);
    const int length = snprintf(self->rig, sizeof self->rig, "%s%s", first,
                                directory ? "/rig.yaml" : "");
    return length < SERVED_PATH_MAX;
}

bool served_find(struct served *self, const struct options *options,
                 const char *verb, bool is_plain)
{
    *self = (struct served){ .options = options,
                             .verb = verb,
                             .own_stops = HUGE_VAL,
                             .link = { .file = -1 } };
    return options->path_count > 0 && (options->real || is_plain) &&
           served_names(self) &&
           service_link_open(&self->link, NULL, self->rig, true) == 0 &&
           cJSON_IsTrue(cJSON_GetObjectItem(self->link.hello, "real")) ==
               options->real;
}

void served_close(struct served *self)
{
    service_link_close(&self->link);
    cJSON_Delete(self->status);
    self->status = NULL;
}

/* The rig of the service is the one that stands in the file now. */
static bool served_is_same_rig(const struct served *self)
{
    char *text = NULL;
    const cJSON *crc = cJSON_GetObjectItem(self->link.hello, "rig_crc32");
    const int64_t length =
        files_load(&disk_files, self->rig, SERVED_FILE_MAX, &text);
    if (length < 0)
        return false;
    const double now = crc32_of(0, text, (size_t)length);
    memory_free(text);
    return cJSON_IsNumber(crc) && crc->valuedouble == now;
}

enum status served_allow(const struct served *self, bool is_plain,
                         const char *without)
{
    if (!is_plain) {
        error_say("slew %s: a service has these drives, expected it without "
                  "%s, or the service ended first",
                  self->verb, without);
        return STATUS_REFUSED;
    }
    if (served_is_same_rig(self))
        return STATUS_OK;
    error_say("%s: has changed since its service has read it, expected the "
              "service started anew",
              self->rig);
    return STATUS_REFUSED;
}

void served_say(const struct served *self, const char *what)
{
    if (!self->options->json)
        printf("%s\n", what);
    fflush(stdout);
}

/* --- one command, one answer --- */

cJSON *served_command(const char *name)
{
    cJSON *command = cJSON_CreateObject();
    cJSON_AddStringToObject(command, "command", name);
    return command;
}

/* What is no fault, and is said all the same. */
static void served_event(void *context, const cJSON *event)
{
    static const char *const said[] = { "warning", "drive", "bus" };
    const struct served *self = context;
    const char *kind =
        cJSON_GetStringValue(cJSON_GetObjectItem(event, "event"));
    const char *text = cJSON_GetStringValue(cJSON_GetObjectItem(event, "text"));
    for (size_t i = 0; i < ARRAY_LEN(said); i++)
        if (!self->draws && kind != NULL && text != NULL &&
            strcmp(kind, said[i]) == 0)
            error_say("slew %s: warning: %s", self->verb, text);
}

/* What the operator has stopped is refused, or given up, for that. */
static bool served_is_cut(const struct served *self)
{
    return self->link.stopped && !self->leaves;
}

/* Whatever it was sent for: a stop is for all that moves, and nothing that this
 * client has begun goes on after it. */
enum status served_goes_on(const struct served *self)
{
    if (self->stopped || self->link.stopped || self->leaves ||
        !(self->stops > self->own_stops))
        return STATUS_OK;
    error_say("slew %s: another client of the service has stopped it",
              self->verb);
    return STATUS_REFUSED;
}

/* One command, one answer, which is the caller's.  NULL: the service is gone,
 * with a line on stderr. */
static cJSON *served_ask(struct served *self, cJSON *command, const char *name)
{
    self->link.interrupts = self->interrupts;
    cJSON *answer = service_link_ask(&self->link, command, SERVED_ANSWER_MS,
                                     served_event, self);
    if (answer == NULL)
        error_say("slew %s: the service does not answer to \"%s\"", self->verb,
                  name);
    return answer;
}

static void served_copy(char *to, size_t size, const cJSON *object,
                        const char *name)
{
    const char *text = cJSON_GetStringValue(cJSON_GetObjectItem(object, name));
    snprintf(to, size, "%s", text != NULL ? text : "");
}

static bool served_has(const struct served *self, const char *name)
{
    return cJSON_IsTrue(cJSON_GetObjectItem(self->status, name));
}

/* What the service says of the clock that a move of ours keeps to. */
static void served_look_follow(struct served *self)
{
    char now[SERVED_FAULT_MAX];
    served_copy(now, sizeof now, self->status, "follow");
    if (self->options->follow != NULL && now[0] != '\0' &&
        strcmp(now, self->follow) != 0)
        served_say(self, now);
    memcpy(self->follow, now, sizeof now);
}

enum status served_look(struct served *self)
{
    cJSON *answer = served_ask(self, served_command("status"), "status");
    if (answer == NULL)
        return STATUS_REFUSED;
    cJSON_Delete(self->status);
    self->status = answer;
    self->stops = cJSON_GetNumberValue(cJSON_GetObjectItem(answer, "stops"));
    served_copy(self->state, sizeof self->state, answer, "state");
    served_copy(self->fault, sizeof self->fault, answer, "fault");
    self->homing = served_has(self, "homing");
    self->starting = served_has(self, "starting");
    self->torque_off = served_has(self, "torque_off");
    self->enabling = served_has(self, "enabling");
    served_look_follow(self);
    return STATUS_OK;
}

/* Say why a command was refused: a stop of another client comes first. */
static enum status served_refused(struct served *self, const char *name,
                                  const cJSON *answer)
{
    const char *text =
        cJSON_GetStringValue(cJSON_GetObjectItem(answer, "text"));
    if (served_is_cut(self))
        return STATUS_INTERRUPTED;
    if (served_look(self) == STATUS_OK && served_goes_on(self) == STATUS_OK)
        error_say("slew %s: the service refuses \"%s\": %s", self->verb, name,
                  text != NULL ? text : "no reason given");
    return STATUS_REFUSED;
}

enum status served_do(struct served *self, cJSON *command)
{
    enum status status = STATUS_OK;
    char name[32];
    snprintf(name, sizeof name, "%s",
             cJSON_GetStringValue(cJSON_GetObjectItem(command, "command")));
    cJSON *answer = served_ask(self, command, name);
    if (answer == NULL)
        status = served_is_cut(self) ? STATUS_INTERRUPTED : STATUS_REFUSED;
    else if (!cJSON_IsTrue(cJSON_GetObjectItem(answer, "ok")))
        status = served_refused(self, name, answer);
    cJSON_Delete(answer);
    return status;
}

bool served_is_homed(const struct served *self)
{
    const cJSON *axis;
    bool homed = true;
    cJSON_ArrayForEach(axis, cJSON_GetObjectItem(self->status, "axes"))
    {
        homed &= cJSON_IsTrue(cJSON_GetObjectItem(axis, "homed"));
    }
    return homed;
}

/* --- waiting --- */

static void served_pause(void)
{
    const struct timespec pause = { .tv_nsec = SERVED_LOOK_MS * 1000000L };
    (void)nanosleep(&pause, NULL); /* a signal may cut it short */
}

static enum status served_now(struct served *self)
{
    enum status status = served_look(self);
    if (status == STATUS_OK && *self->interrupts > 0 && !self->stopped) {
        self->stopped = true;
        if (!self->link.stopped)
            status = served_do(self, served_command("stop"));
        if (status == STATUS_OK)
            status = served_look(self);
    }
    if (status == STATUS_OK && self->fault[0] != '\0') {
        error_say("slew %s: %s", self->verb, self->fault);
        status = STATUS_REFUSED;
    }
    return status == STATUS_OK ? served_goes_on(self) : status;
}

enum status served_step(struct served *self)
{
    served_pause();
    return served_now(self);
}

enum status served_wait(struct served *self, const char *state)
{
    for (enum status status = served_now(self);; status = served_step(self)) {
        if (status != STATUS_OK)
            return status;
        if (!self->homing && !self->starting && strcmp(self->state, state) == 0)
            return self->stopped ? STATUS_INTERRUPTED : STATUS_OK;
        if (self->stopped && strcmp(self->state, "off") == 0)
            return STATUS_INTERRUPTED;
    }
}

enum status served_then(struct served *self, cJSON *command, const char *state,
                        const char *what)
{
    enum status status = served_look(self);
    if (status == STATUS_OK)
        status = served_goes_on(self);
    if (status != STATUS_OK) {
        cJSON_Delete(command);
        return status;
    }
    served_say(self, what);
    status = served_do(self, command);
    return status == STATUS_OK ? served_wait(self, state) : status;
}

/* --- in and out --- */

enum status served_take(struct served *self, double lease_s)
{
    cJSON *command = served_command("take");
    cJSON_AddNumberToObject(command, "lease", lease_s);
    enum status status = served_do(self, command);
    if (status == STATUS_OK)
        status = served_look(self);
    if (status == STATUS_OK)
        self->own_stops = self->stops;
    if (status != STATUS_OK || strcmp(self->state, "off") == 0 ||
        strcmp(self->state, "ready") == 0)
        return status;
    error_say("slew %s: the service is not at rest: %s%s%s", self->verb,
              self->state, self->fault[0] != '\0' ? ", " : "", self->fault);
    return STATUS_REFUSED;
}

enum status served_enable(struct served *self)
{
    if (self->enabling) /* by the client before us */
        return served_wait(self, "ready");
    if (strcmp(self->state, "off") == 0)
        return served_then(self, served_command("enable"), "ready",
                           "enabling drives");
    return STATUS_OK;
}

/* Every drive has said so itself. */
static enum status served_confirm(struct served *self)
{
    for (int ms = 0; ms < SERVED_OFF_MS; ms += SERVED_LOOK_MS) {
        if (served_look(self) != STATUS_OK)
            return STATUS_REFUSED;
        if (self->torque_off)
            return STATUS_OK;
        served_pause();
    }
    error_say("slew %s: torque is not confirmed off, see slew service status",
              self->verb);
    return STATUS_REFUSED;
}

/* Whatever still moves is stopped first. */
static enum status served_rest(struct served *self)
{
    bool asked = false;
    for (;;) {
        enum status status = served_look(self);
        const bool moves = self->homing || (strcmp(self->state, "off") != 0 &&
                                            strcmp(self->state, "ready") != 0 &&
                                            strcmp(self->state, "fault") != 0);
        if (status == STATUS_OK && moves && !asked)
            status = served_do(self, served_command("stop"));
        if (status != STATUS_OK || !moves)
            return status;
        asked = true;
        served_pause();
    }
}

enum status served_off(struct served *self, enum status status)
{
    self->leaves = true;
    enum status off = served_rest(self);
    if (off == STATUS_OK && strcmp(self->state, "ready") == 0) {
        served_say(self, "torque off");
        off = served_do(self, served_command("off"));
    }
    if (off == STATUS_OK)
        off = served_confirm(self);
    return off != STATUS_OK ? off : status;
}
