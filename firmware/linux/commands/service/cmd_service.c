/* firmware/linux/commands/service/cmd_service.c - slew service: a rig under control of
 * other programs, over a socket. */
#include <errno.h>
#include <poll.h>
#include <pthread.h>
#include <stdatomic.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "firmware/host/base/memory.h"
#include "firmware/host/base/table.h"
#include "firmware/linux/base/error.h"
#include "firmware/linux/base/json_print.h"
#include "firmware/linux/commands/command.h"
#include "firmware/linux/commands/service/install.h"
#include "firmware/linux/commands/service/page.h"
#include "firmware/linux/service/place.h"
#include "firmware/linux/service/service.h"
#include "hal/linux/thread.h"

#define CMD_SERVICE_LINE 262144
#define CMD_SERVICE_CPUS 1023
#define CMD_SERVICE_LAST 500 /* ms for answers after the end of the input */
#define CMD_SERVICE_LOOK 100 /* ms between two looks at who is gone */

/* "RIG", or a directory with rig.yaml. */
static const char *cmd_service_rig(const struct options *options,
                                   char path[4096])
{
    struct stat status;
    if (options->path_count < 2)
        return NULL;
    const bool directory =
        stat(options->path[1], &status) == 0 && S_ISDIR(status.st_mode);
    const int n = snprintf(path, 4096, "%s%s", options->path[1],
                           directory ? "/rig.yaml" : "");
    return n < 4096 ? path : NULL;
}

static enum status cmd_service_which(const char *verb)
{
    error_say("slew service %s: which rig? expected RIG, or --socket PATH",
              verb);
    return STATUS_INPUT;
}

/* --- run --- */

/* The studio's page, where --port says so. */
static enum status cmd_service_with_page(const struct service_config *alone,
                                         const struct options *options)
{
    struct page *page = memory_new(1, sizeof *page);
    const struct service_beside beside = page_beside(page);
    struct service_config config = *alone;
    enum status status = STATUS_INPUT;
    config.beside = &beside;
    if (page_place(page, "service run", options) == 0 &&
        page_files(page, "service run", options->path[1],
                   options->path_count > 2 ? options->path[2] : NULL) == 0) {
        page->opens = false;
        status = service_run(&config);
    }
    memory_free(page);
    return status;
}

static enum status cmd_service_page_alone(const struct options *options)
{
    error_say("slew service run: %s is for the page, expected --port too",
              options->path_count > 2       ? options->path[2]
              : options->token_file != NULL ? "--token-file"
              : options->edit_rig           ? "--edit-rig"
                                            : "--address");
    return STATUS_INPUT;
}

/* Refuse a folder for recordings that is not there, at the start and not later. */
static enum status cmd_service_recordings(const struct options *options)
{
    struct stat about;
    if (options->records && options->recordings == NULL) {
        error_say("slew service run: --record-always: expected --recordings "
                  "DIRECTORY too");
        return STATUS_INPUT;
    }
    if (options->recordings == NULL)
        return STATUS_OK;
    if (stat(options->recordings, &about) < 0)
        return error_file(options->recordings, strerror(errno));
    return S_ISDIR(about.st_mode)
               ? STATUS_OK
               : error_file(options->recordings, strerror(ENOTDIR));
}

static enum status cmd_service_serve(const struct options *options)
{
    char path[4096];
    const struct service_config config = {
        .command = "service run",
        .rig_path = cmd_service_rig(options, path),
        .socket = options->socket,
        .interface = options->interface,
        .real = options->real,
        .group = options->group,
        .cpu = (int)options->cpu,
        .plan = { options->plan_ns, options->plan_mib },
        .recordings = options->recordings,
        .clock = options->clock,
        .records = options->records,
    };
    if (config.rig_path == NULL) {
        error_say("slew service run: which rig? expected RIG");
        return STATUS_INPUT;
    }
    if (options->real == options->sim) {
        error_say("slew service run: expected --sim for simulated drives or "
                  "--real for those of the rig");
        return STATUS_INPUT;
    }
    if (options->cpu > CMD_SERVICE_CPUS) {
        error_say("slew service run: --cpu: expected 0 to %d",
                  CMD_SERVICE_CPUS);
        return STATUS_INPUT;
    }
    if (options->port < 0 &&
        (options->path_count > 2 || options->token_file != NULL ||
         options->address != NULL || options->edit_rig))
        return cmd_service_page_alone(options);
    const enum status status = cmd_service_recordings(options);
    if (status != STATUS_OK)
        return status;
    if (!command_may_move(options, "service run"))
        return STATUS_INPUT;
    return options->port < 0 ? service_run(&config)
                             : cmd_service_with_page(&config, options);
}

/* --- status --- */

static enum status cmd_service_link(const struct options *options,
                                    const char *verb, struct service_link *link)
{
    char path[4096];
    const char *rig = cmd_service_rig(options, path);
    if (rig == NULL && options->socket == NULL)
        return cmd_service_which(verb);
    return service_link_open(link, options->socket, rig, false) < 0
               ? STATUS_REFUSED
               : STATUS_OK;
}

static double cmd_service_number(const cJSON *object, const char *name)
{
    const cJSON *item = cJSON_GetObjectItemCaseSensitive(object, name);
    return cJSON_IsNumber(item) ? item->valuedouble : 0;
}

static const char *cmd_service_text(const cJSON *object, const char *name)
{
    const char *text =
        cJSON_GetStringValue(cJSON_GetObjectItemCaseSensitive(object, name));
    return text != NULL ? text : "";
}

static bool cmd_service_is(const cJSON *object, const char *name)
{
    return cJSON_IsTrue(cJSON_GetObjectItemCaseSensitive(object, name));
}

/* Of the hello, which has the same axes in the same order. */
static const char *cmd_service_unit(const cJSON *hello, int i)
{
    return cmd_service_text(
        cJSON_GetArrayItem(cJSON_GetObjectItemCaseSensitive(hello, "axes"), i),
        "unit");
}

static void cmd_service_axes(const cJSON *hello, const cJSON *status)
{
    static const char *const head[] = { "<axis", ">position", "<unit", "<homed",
                                        "<drive" };
    const cJSON *axes = cJSON_GetObjectItemCaseSensitive(status, "axes"), *axis;
    struct table table;
    int i = 0;
    table_init(&table, 5, head);
    cJSON_ArrayForEach(axis, axes)
    {
        table_cell(&table, "%s", cmd_service_text(axis, "name"));
        table_cell(&table, "%.3f", cmd_service_number(axis, "position"));
        table_cell(&table, "%s", cmd_service_unit(hello, i++));
        table_cell(&table, "%s", cmd_service_is(axis, "homed") ? "yes" : "no");
        table_cell(&table, "%s", cmd_service_text(axis, "drive"));
    }
    table_print(&table, stdout);
    table_free(&table);
}

static void cmd_service_print(const cJSON *hello, const cJSON *status)
{
    const cJSON *tick = cJSON_GetObjectItemCaseSensitive(status, "tick");
    printf("%s: %s drives, %s%s%s%s\n", cmd_service_text(hello, "rig"),
           cmd_service_is(hello, "real") ? "REAL" : "simulated",
           cmd_service_text(status, "state"),
           cmd_service_is(status, "torque_off") ? ", torque off" : "",
           cmd_service_text(status, "fault")[0] != '\0' ? ", fault: " : "",
           cmd_service_text(status, "fault"));
    printf("%.0f clients, %s\n", cmd_service_number(status, "clients"),
           cmd_service_is(status, "held") ? "one has control"
                                          : "none has control");
    if (cJSON_HasObjectItem(status, "move"))
        printf("move \"%s\": at %.3f s of %.3f s, %.0f %%\n",
               cmd_service_text(status, "move"),
               cmd_service_number(status, "path_s"),
               cmd_service_number(status, "end_s"),
               cmd_service_number(status, "override"));
    printf("%.0f ticks, %.0f lost; wake-ups: half within %.0f us, all but 1 in "
           "1000 within %.0f us, the worst %.0f us late; %.0f page faults%s%s"
           "\n\n",
           cmd_service_number(tick, "ticks"),
           cmd_service_number(tick, "ticks_lost"),
           cmd_service_number(tick, "late_us_median"),
           cmd_service_number(tick, "late_us_p999"),
           cmd_service_number(tick, "late_us_most"),
           cmd_service_number(tick, "page_faults"),
           cmd_service_is(tick, "real_time") ? "" : "; no real-time priority",
           cmd_service_is(tick, "memory_locked") ? "" : "; memory not locked");
    cmd_service_axes(hello, status);
}

static enum status cmd_service_show(const struct options *options)
{
    struct service_link link = { .file = -1 };
    cJSON *command = cJSON_CreateObject();
    enum status status = cmd_service_link(options, "status", &link);
    cJSON_AddStringToObject(command, "command", "status");
    if (status != STATUS_OK) {
        cJSON_Delete(command);
        return status;
    }
    cJSON *answer =
        service_link_ask(&link, command, SERVICE_ANSWER_MS, NULL, NULL);
    if (answer == NULL) {
        error_say("slew service status: the service does not answer");
        status = STATUS_REFUSED;
    } else if (options->json) {
        cJSON_AddItemToObject(answer, "service",
                              cJSON_Duplicate(link.hello, true));
        json_print(answer, stdout);
    } else {
        cmd_service_print(link.hello, answer);
        cJSON_Delete(answer);
    }
    service_link_close(&link);
    return status;
}

/* --- send: lines from standard input, lines to standard output --- */

struct cmd_service_answers {
    struct service_link *link; /* its reading half */
    _Atomic bool ends;         /* after what comes within a moment */
};

/* In a thread of its own: whoever does not take the answers holds up no line, a
 * stop among them. */
static void *cmd_service_receive(void *context)
{
    struct cmd_service_answers *self = context;
    const char *line;
    while (self->link->file >= 0) {
        const bool last = self->ends;
        while ((line = service_link_line(
                    self->link, last ? CMD_SERVICE_LAST : CMD_SERVICE_LOOK)) !=
               NULL)
            puts(line);
        fflush(stdout);
        if (last)
            break;
    }
    return NULL;
}

/* Lines of standard input, until its end or that of the service. */
static void cmd_service_lines(struct service_link *to,
                              const struct service_link *from)
{
    char *line = memory_new(CMD_SERVICE_LINE, 1);
    struct pollfd look = { .fd = STDIN_FILENO, .events = POLLIN };
    setvbuf(stdin, NULL, _IONBF, 0); /* poll() sees all that there is */
    while (to->file >= 0 && from->file >= 0) {
        if (poll(&look, 1, CMD_SERVICE_LOOK) <= 0)
            continue;
        if (fgets(line, CMD_SERVICE_LINE, stdin) == NULL)
            break;
        line[strcspn(line, "\n")] = '\0';
        (void)service_link_send(to, line);
    }
    memory_free(line);
}

static enum status cmd_service_send(const struct options *options)
{
    struct service_link link = { .file = -1 };
    struct cmd_service_answers answers = { .link = &link };
    pthread_t thread;
    enum status status = cmd_service_link(options, "send", &link);
    if (status != STATUS_OK)
        return status;
    json_print_line(link.hello, stdout);
    link.hello = NULL;
    putchar('\n');
    fflush(stdout);
    struct service_link to = { .file = dup(link.file) };
    if (to.file < 0 ||
        thread_linux_start(&thread, cmd_service_receive, &answers) != 0) {
        error_say("slew service send: no thread for answers");
        return STATUS_SYSTEM;
    }
    cmd_service_lines(&to, &link);
    answers.ends = true;
    (void)pthread_join(thread, NULL);
    close(to.file);
    if (link.file < 0)
        error_say("slew service send: the service has closed the connection");
    status = link.file < 0 ? STATUS_REFUSED : STATUS_OK;
    service_link_close(&link);
    return status;
}

/* --- install, remove --- */

static enum status cmd_service_system(const struct options *options,
                                      const char *verb, bool installs)
{
    char path[4096];
    const char *rig = cmd_service_rig(options, path);
    if (rig == NULL) {
        error_say("slew service %s: which rig? expected RIG", verb);
        return STATUS_INPUT;
    }
    if (installs && options->real == options->sim) {
        error_say("slew service install: expected --sim for simulated drives "
                  "or --real for those of the rig");
        return STATUS_INPUT;
    }
    if (options->cpu > CMD_SERVICE_CPUS) {
        error_say("slew service install: --cpu: expected 0 to %d",
                  CMD_SERVICE_CPUS);
        return STATUS_INPUT;
    }
    return installs ? service_install(options, rig)
                    : service_remove(options, rig);
}

static enum status cmd_service_install(const struct options *options)
{
    return cmd_service_system(options, "install", true);
}

static enum status cmd_service_remove(const struct options *options)
{
    return cmd_service_system(options, "remove", false);
}

/* --- the command --- */

static const struct {
    const char *name;
    enum status (*run)(const struct options *options);
} cmd_service_verb[] = {
    { "run", cmd_service_serve },     { "status", cmd_service_show },
    { "send", cmd_service_send },     { "install", cmd_service_install },
    { "remove", cmd_service_remove },
};

/* Only run takes a move. */
static enum status cmd_service_more(const struct options *options)
{
    error_say("slew service: one argument too many: %s; see slew service "
              "--help",
              options->path[2]);
    return STATUS_INPUT;
}

static enum status cmd_service_run(const struct options *options)
{
    for (size_t i = 0; i < ARRAY_LEN(cmd_service_verb); i++)
        if (strcmp(options->path[0], cmd_service_verb[i].name) == 0)
            return options->path_count > 2 && i > 0
                       ? cmd_service_more(options)
                       : cmd_service_verb[i].run(options);
    error_say("slew service: no \"%s\", expected run, status, send, install "
              "or remove",
              options->path[0]);
    return STATUS_INPUT;
}

static const struct option_row cmd_service_option[] = {
    { "sim", NULL, OPTION_FLAG, offsetof(struct options, sim),
      "run: simulated drives, on the clock" },
    OPTIONS_REAL("run: the real drives, on the interfaces of the rig"),
    OPTIONS_YES("run: do not prompt before clients can move real drives"),
    OPTIONS_DRY_RUN("install, remove: print the steps and the files"),
    { "root", "DIRECTORY", OPTION_TEXT, offsetof(struct options, root),
      "install, remove: files there instead of /, and nothing is run" },
    OPTIONS_INTERFACE,
    { "cpu", "N", OPTION_COUNT, offsetof(struct options, cpu),
      "run: the processor of the tick (any)" },
    { "group", NULL, OPTION_FLAG, offsetof(struct options, group),
      "run: those of the socket's group may connect, too" },
    { "recordings", "DIRECTORY", OPTION_TEXT,
      offsetof(struct options, recordings),
      "run, install: where clients may record what happens at every "
      "tick (install: /var/lib/slew-NAME)" },
    { "record-always", NULL, OPTION_FLAG, offsetof(struct options, records),
      "run, install: from the first tick on, in a file there named by the "
      "time" },
    OPTIONS_PLAN("run, install: "),
    { "clock", "FILE", OPTION_TEXT, offsetof(struct options, clock),
      "run, install: a stream of timecode that clients may follow; others "
      "must be below the rig's folder" },
    { "socket", "PATH", OPTION_TEXT, offsetof(struct options, socket),
      "another socket than the rig's" },
    { "port", "N", OPTION_COUNT, offsetof(struct options, port),
      "run, install: serve the page of slew studio too, at this port" },
    PAGE_OPTIONS("run: "),
    OPTIONS_COMMON,
};

const struct command cmd_service = {
    .name = "service",
    .arguments = "run | status | send | install | remove  RIG [MOVE]",
    .summary = "a rig under control of other programs, over a socket",
    .text =
        "run     load the rig and serve it until SIGTERM or Ctrl-C: then the\n"
        "        axes stop along their path, and torque is taken off.  slewd "
        "is\n"
        "        the same command under a name of its own.  Nothing moves, "
        "and\n"
        "        no drive gets torque, before a client requests it; with "
        "--real "
        "it\n"
        "        prompts first, and without a terminal needs --yes.\n"
        "status  what the service of the rig is about, and how late its ticks "
        "were\n"
        "send    lines of standard input to the service, its answers to "
        "standard\n"
        "        output: JSON, a line each, as docs/API.md says\n"
        "install a unit of systemd for the rig, with a user of its own, is\n"
        "        written, enabled and started; remove takes it away again.\n"
        "        Both print every step; --dry-run does no more than that.\n\n"
        "With --port browsers are clients, too: the page of slew studio, which "
        "edits\n"
        "MOVE, or move.yaml where RIG is a directory.\n\n"
        "One client at a time has control, by a lease that it renews; others\n"
        "watch, and anybody may stop.  A jog ends when its client is gone.\n",
    .examples =
        "  slew service run --sim examples/dolly\n"
        "  slewd --real --yes --cpu 1 rig.yaml\n"
        "  slewd --sim --port 8787 rig.yaml move.yaml\n"
        "  slew service status --json rig.yaml\n"
        "  slew service install --real --cpu 1 --dry-run rig.yaml\n"
        "  echo '{\"command\": \"stop\"}' | slew service send rig.yaml\n",
    .path_max = 3,
    COMMAND_OPTIONS(cmd_service_option),
    .run = cmd_service_run,
};
