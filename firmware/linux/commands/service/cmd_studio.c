/* firmware/linux/commands/service/cmd_studio.c - slew studio: a rig and a move in
 * a browser. */
#include <spawn.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "firmware/host/base/files.h"
#include "firmware/host/base/memory.h"
#include "firmware/linux/base/disk.h"
#include "firmware/linux/base/error.h"
#include "firmware/linux/commands/command.h"
#include "firmware/linux/service/service.h"
#include "firmware/studio/server/guard.h"
#include "firmware/studio/server/server.h"

#define CMD_STUDIO_PATH FILES_PATH_MAX
#define CMD_STUDIO_CPUS 1023

struct cmd_studio {
    struct studio_config config;
    bool opens; /* a browser */
    struct studio_server *server;
    char rig[CMD_STUDIO_PATH], move[CMD_STUDIO_PATH];
    char token[GUARD_TOKEN_MAX + 2];
};

/* --- which files ------------------------------------------------------------- */

static bool cmd_studio_is_directory(const char *path)
{
    struct stat status;
    return stat(path, &status) == 0 && S_ISDIR(status.st_mode);
}

/* NAME, or NAME/file where NAME is a directory. */
static int cmd_studio_path(char path[CMD_STUDIO_PATH], const char *name,
                           const char *file)
{
    const size_t length = strlen(name);
    const int n =
        snprintf(path, CMD_STUDIO_PATH, "%s%s%s", name,
                 file[0] == '\0' || name[length - 1] == '/' ? "" : "/", file);
    if (n < CMD_STUDIO_PATH)
        return 0;
    error_say("slew studio: %s: the name is too long", name);
    return -1;
}

static int cmd_studio_move(struct cmd_studio *self,
                           const struct options *options)
{
    const char *rig = options->path[0];
    self->config.move_path = self->move;
    if (options->path_count > 1)
        return cmd_studio_path(self->move, options->path[1], "");
    if (cmd_studio_is_directory(rig)) {
        if (cmd_studio_path(self->move, rig, "move.yaml") < 0)
            return -1;
        if (access(self->move, R_OK) == 0)
            return 0;
    }
    self->config.move_path = NULL;
    return 0;
}

static int cmd_studio_files(struct cmd_studio *self,
                            const struct options *options)
{
    const char *rig = options->path[0];
    const bool directory = cmd_studio_is_directory(rig);
    self->config.rig_path = self->rig;
    if (cmd_studio_path(self->rig, rig, directory ? "rig.yaml" : "") < 0 ||
        cmd_studio_move(self, options) < 0)
        return -1;
    if (self->config.move_path == NULL || access(self->move, R_OK) == 0)
        return 0;
    error_say("slew studio: %s cannot be read, expected a move file",
              self->move);
    return -1;
}

/* --- where ------------------------------------------------------------------- */

static int cmd_studio_token(struct cmd_studio *self, const char *path)
{
    FILE *file = fopen(path, "r");
    const bool read =
        file != NULL && fgets(self->token, sizeof self->token, file) != NULL;
    if (file != NULL)
        fclose(file);
    self->token[strcspn(self->token, "\r\n")] = '\0';
    if (read && guard_is_good_token(self->token)) {
        self->config.token = self->token;
        return 0;
    }
    error_say("slew studio: --token-file %s: expected a line of %d to %d "
              "letters, digits, - and _",
              path, GUARD_TOKEN_MIN, GUARD_TOKEN_MAX);
    return -1;
}

static int cmd_studio_place(struct cmd_studio *self,
                            const struct options *options)
{
    struct studio_config *config = &self->config;
    const int64_t port = options->port < 0 ? STUDIO_PORT : options->port;
    config->address = options->address;
    config->port = (unsigned)port;
    config->is_real = options->real;
    self->opens = !options->no_browser;
    if (port < 1 || port > 65535) {
        error_say("slew studio: --port: expected 1 to 65535");
        return -1;
    }
    if (options->token_file != NULL &&
        cmd_studio_token(self, options->token_file) < 0)
        return -1;
    if (config->address == NULL || guard_is_loopback(config->address) ||
        config->token != NULL)
        return 0;
    error_say("slew studio: --address %s can be reached by others, expected "
              "--token-file too",
              config->address);
    return -1;
}

/* Where somebody sits in front of a screen; that it fails is seen. */
static void cmd_studio_open(const struct cmd_studio *self, char *url)
{
    extern char **environ;
    char program[] = "xdg-open";
    char *const words[] = { program, url, NULL };
    pid_t child;
    if (self->opens && isatty(STDOUT_FILENO) &&
        (getenv("DISPLAY") != NULL || getenv("WAYLAND_DISPLAY") != NULL))
        (void)posix_spawnp(&child, program, NULL, NULL, words, environ);
}

/* --- beside the service ------------------------------------------------------- */

static int cmd_studio_start(void *context, const struct rig *rig,
                            const char *socket, struct service_frames *frames)
{
    struct cmd_studio *self = context;
    const struct studio_config *config = &self->config;
    const char *address = config->address;
    self->server = studio_server_start(config, rig, socket, frames);
    if (self->server == NULL)
        return -1;
    if (address == NULL || strcmp(address, "0.0.0.0") == 0)
        address = "127.0.0.1";
    char url[512];
    snprintf(url, sizeof url, "http://%s%s%s:%u/%s%s",
             strchr(address, ':') != NULL ? "[" : "", address,
             strchr(address, ':') != NULL ? "]" : "", config->port,
             config->token != NULL ? "?token=" : "",
             config->token != NULL ? config->token : "");
    puts(url);
    cmd_studio_open(self, url);
    return 0;
}

static void cmd_studio_stop(void *context)
{
    struct cmd_studio *self = context;
    studio_server_stop(self->server);
    self->server = NULL;
}

static enum status cmd_studio_serve(struct cmd_studio *self,
                                    const struct options *options)
{
    const struct service_beside beside = { cmd_studio_start, cmd_studio_stop,
                                           self };
    const struct service_config config = {
        .rig_path = self->rig,
        .socket = options->socket,
        .interface = options->interface,
        .real = options->real,
        .cpu = (int)options->cpu,
        .beside = &beside,
    };
    return command_may_move(options, "studio") ? service_run(&config)
                                               : STATUS_INPUT;
}

static enum status cmd_studio_run(const struct options *options)
{
    struct cmd_studio *self = memory_new(1, sizeof *self);
    enum status status = STATUS_INPUT;
    if (options->cpu > CMD_STUDIO_CPUS)
        error_say("slew studio: --cpu: expected 0 to %d", CMD_STUDIO_CPUS);
    else if (cmd_studio_files(self, options) == 0 &&
             cmd_studio_place(self, options) == 0)
        status = cmd_studio_serve(self, options);
    memory_free(self);
    return status;
}

static const struct option_row cmd_studio_option[] = {
    { "port", "N", OPTION_COUNT, offsetof(struct options, port),
      "of the page (8787)" },
    { "address", "ADDRESS", OPTION_TEXT, offsetof(struct options, address),
      "of the page (127.0.0.1); others than loopback with --token-file" },
    { "token-file", "FILE", OPTION_TEXT, offsetof(struct options, token_file),
      "its first line is what a browser must bring" },
    { "no-browser", NULL, OPTION_FLAG, offsetof(struct options, no_browser),
      "do not open it" },
    OPTIONS_REAL("the real drives, on the interfaces of the rig"),
    OPTIONS_YES("do not ask before the page can move real drives"),
    OPTIONS_INTERFACE,
    { "cpu", "N", OPTION_COUNT, offsetof(struct options, cpu),
      "the processor of the tick (any)" },
    { "socket", "PATH", OPTION_TEXT, offsetof(struct options, socket),
      "another socket of the service than the rig's" },
    OPTIONS_COMMON,
};

const struct command cmd_studio = {
    .name = "studio",
    .arguments = "RIG [MOVE] | DIRECTORY",
    .summary = "a rig and a move in a browser: see, edit, check, run",
    .text =
        "Serves a page until Ctrl-C, and the rig as slew service run does: "
        "other\n"
        "programs can watch and take control meanwhile.  The page plans with "
        "the\n"
        "very planner of this program, compiled for a browser by make studio, "
        "and\n"
        "changes the move file where it stands.\n\n"
        "Nothing moves, and no drive gets torque, before the page asks for it; "
        "with\n"
        "--real it asks first.  Only a browser on this machine is answered, "
        "unless\n"
        "--address and --token-file say more: whoever has the token moves the "
        "rig.\n",
    .examples = "  slew studio examples/dolly\n"
                "  slew studio --real --cpu 1 rig.yaml move.yaml\n"
                "  slew studio --address 192.168.1.20 --token-file token rig\n",
    .path_max = 2,
    COMMAND_OPTIONS(cmd_studio_option),
    .run = cmd_studio_run,
};
