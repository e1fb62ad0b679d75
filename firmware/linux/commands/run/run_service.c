/* firmware/linux/commands/run/run_service.c - see run_service.h. */
#define _XOPEN_SOURCE 700 /* realpath */
#include "firmware/linux/commands/run/run_service.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#include "firmware/host/base/memory.h"
#include "firmware/linux/base/disk.h"
#include "firmware/linux/base/error.h"
#include "firmware/linux/base/interrupt.h"
#include "firmware/linux/base/json_print.h"
#include "firmware/linux/commands/command.h"
#include "firmware/linux/commands/run/served.h"
#include "motion/core/clock_warp.h"

#define RUN_SERVICE_FILE_MAX 1048576
#define RUN_SERVICE_LEASE_S  60 /* while it plans */

/* The name of the move, beside the rig in a directory. */
static bool run_move(const struct options *options, char move[SERVED_PATH_MAX])
{
    const char *first = options->path[0];
    struct stat status;
    const bool directory = stat(first, &status) == 0 && S_ISDIR(status.st_mode);
    if (!directory && options->path_count < 2)
        return false;
    return snprintf(move, SERVED_PATH_MAX, "%s%s",
                    directory ? first : options->path[1],
                    directory ? "/move.yaml" : "") < SERVED_PATH_MAX;
}

/* --- the steps of a run --- */

static enum status run_load(struct served *self, const char *move)
{
    char *text = NULL;
    cJSON *command = served_command("load");
    const int64_t length =
        files_load(&disk_files, move, RUN_SERVICE_FILE_MAX, &text);
    if (length < 0) {
        cJSON_Delete(command);
        return error_file(move, strerror((int)-length));
    }
    cJSON_AddStringToObject(command, "text", text);
    memory_free(text);
    return served_do(self, command);
}

static enum status run_to_start(struct served *self)
{
    enum status status = served_enable(self);
    if (status == STATUS_OK && !served_is_homed(self)) {
        status = served_then(self, served_command("home"), "ready", "homing");
        if (status == STATUS_OK && !served_is_homed(self)) {
            error_say("slew run: not all axes could be homed");
            status = STATUS_REFUSED;
        }
    }
    return status == STATUS_OK ? served_then(self, served_command("approach"),
                                             "ready", "going to the start")
                               : status;
}

/* The service opens a stream by its full name. */
static enum status run_start(const struct served *self, cJSON **start)
{
    const char *clock = self->options->follow;
    char text[SERVED_PATH_MAX + 4];
    *start = served_command("start");
    if (clock == NULL)
        return STATUS_OK;
    snprintf(text, sizeof text, "%s", clock);
    if (strncmp(clock, "ltc:", 4) == 0 || strncmp(clock, "mtc:", 4) == 0) {
        char *path = realpath(clock + 4, NULL);
        if (path == NULL)
            return error_file(clock + 4, strerror(errno));
        snprintf(text, sizeof text, "%.4s%s", clock, path);
        free(path);
    }
    cJSON_AddStringToObject(*start, "follow", text);
    if (self->options->follow_at != NULL)
        cJSON_AddStringToObject(*start, "at", self->options->follow_at);
    return STATUS_OK;
}

static enum status run_play(struct served *self)
{
    cJSON *start;
    enum status status = run_start(self, &start);
    if (status != STATUS_OK) {
        cJSON_Delete(start);
        return status;
    }
    cJSON *command = served_command("override");
    cJSON_AddNumberToObject(command, "percent",
                            100.0 * (double)self->options->override_q30 /
                                (double)MOTION_CLOCK_WARP_ONE_Q30);
    status = served_do(self, command);
    if (status != STATUS_OK) {
        cJSON_Delete(start);
        return status;
    }
    return served_then(self, start, "ready",
                       self->options->follow != NULL
                           ? "waiting for the clock, then moving"
                           : "moving");
}

static enum status run_all(struct served *self, const char *move)
{
    enum status status = served_take(self, RUN_SERVICE_LEASE_S);
    if (status != STATUS_OK)
        return status;
    status = run_load(self, move);
    if (status != STATUS_OK)
        return status;
    status = run_to_start(self);
    if (status == STATUS_OK)
        status = run_play(self);
    return served_off(self, status);
}

/* --- is it for the service? --- */

/* What only a run of its own writes or does. */
static bool run_is_plain(const struct options *options)
{
    return !options->dry_run && !options->pty && options->telemetry == NULL &&
           options->record == NULL && options->faults == NULL &&
           options->can_log == NULL && options->modbus_log == NULL &&
           options->plot == NULL && options->at == NULL &&
           options->on_edge == NULL && options->hold_at == NULL &&
           options->from == NULL && options->loop < 0 && !options->ping_pong &&
           options->resume_after_ns < 0 && options->interface == NULL;
}

static enum status run_begin(struct served *self, const char *move)
{
    const struct options *options = self->options;
    enum status status = served_allow(
        self, run_is_plain(options),
        "--dry-run, --interface, --hold-at, --at, --on-edge, --from, --loop "
        "and files to write");
    if (status != STATUS_OK)
        return status;
    if (!command_may_move(options, "run"))
        return STATUS_INPUT;
    served_say(self, "a service has this rig: the move is played by it");
    self->interrupts = interrupt_listen();
    status = run_all(self, move);
    interrupt_listen_no_more();
    if (status == STATUS_OK && options->json) {
        cJSON *report = cJSON_CreateObject();
        cJSON_AddBoolToObject(report, "service", true);
        json_report(report, true);
    }
    return status;
}

bool run_service(const struct options *options, enum status *status)
{
    struct served *self = memory_new(1, sizeof *self);
    char move[SERVED_PATH_MAX];
    const bool is_for_it =
        served_find(self, options, "run", run_is_plain(options)) &&
        run_move(options, move);
    if (is_for_it)
        *status = run_begin(self, move);
    served_close(self);
    memory_free(self);
    return is_for_it;
}
