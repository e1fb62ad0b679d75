/* firmware/linux/commands/command.c - finding and running a command; see
 * command.h. */
#include "firmware/linux/commands/command.h"

#include <errno.h>
#include <poll.h>
#include <signal.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

#include "firmware/library/version.h"
#include "firmware/linux/base/error.h"
#include "firmware/linux/base/json_print.h"

const struct command *const command_list[] = {
    &cmd_check,   &cmd_fit,    &cmd_plan,    &cmd_sample,  &cmd_plot,
    &cmd_run,     &cmd_batch,  &cmd_report,  &cmd_otg,     &cmd_gallery,
    &cmd_import,  &cmd_export, &cmd_compile, &cmd_sim,     &cmd_drive,
    &cmd_off,     &cmd_home,   &cmd_jog,     &cmd_capture, &cmd_monitor,
    &cmd_service, &cmd_studio, &cmd_scan,    &cmd_doctor,  &cmd_shaper,
    NULL,
};

/* NULL when there is none of that name. */
static const struct command *command_find(const char *name)
{
    for (size_t i = 0; command_list[i] != NULL; i++)
        if (strcmp(command_list[i]->name, name) == 0)
            return command_list[i];
    return NULL;
}

static void command_help(FILE *file)
{
    fputs("slew - plan and run servo moves\n\n"
          "usage: slew COMMAND [OPTIONS] RIG MOVE\n"
          "       slew COMMAND [OPTIONS] DIRECTORY"
          "    (with rig.yaml and move.yaml)\n\n"
          "commands:\n",
          file);
    for (size_t i = 0; command_list[i] != NULL; i++)
        fprintf(file, "  %-8s %s\n", command_list[i]->name,
                command_list[i]->summary);
    fputs("\nslew COMMAND --help says more; slew --version says which it is.\n",
          file);
}

/* Why stdout failed some time ago, which stdio does not keep; 0: unknown. */
static int command_stdout_error(void)
{
    struct pollfd reader = { .fd = STDOUT_FILENO, .events = POLLOUT };
    const bool closed =
        poll(&reader, 1, 0) == 1 && (reader.revents & POLLERR) != 0;
    return closed ? EPIPE : 0;
}

static bool command_wants_json(int argc, char *argv[])
{
    for (int i = 1; i < argc && strcmp(argv[i], "--") != 0; i++)
        if (strcmp(argv[i], "--json") == 0)
            return true;
    return false;
}

bool command_may_move(const struct options *options, const char *command)
{
    char line[16] = "";
    if (!options->real || options->yes)
        return true;
    if (!isatty(STDIN_FILENO)) {
        error_say("slew %s: REAL drives would move, expected --yes, or a "
                  "terminal to confirm on",
                  command);
        return false;
    }
    fputs("REAL drives will move. Go on? [y/N] ", stderr);
    return fgets(line, sizeof line, stdin) != NULL &&
           (line[0] == 'y' || line[0] == 'Y');
}

/* With --json there is an object whatever happens: where a command ended before
 * it had a report, this one. */
static enum status command_json(enum status status)
{
    if (status == STATUS_OK || json_is_printed())
        return status;
    cJSON *report = cJSON_CreateObject();
    cJSON_AddNumberToObject(report, "status", status);
    cJSON_AddStringToObject(report, "error", error_said());
    json_report(report, false);
    return status;
}

/* A full disk or a closed pipe shows only here. */
static enum status command_flush(enum status status)
{
    int error = fflush(stdout) == 0 ? 0 : errno;
    if (error == 0 && !ferror(stdout))
        return status;
    if (error == 0)
        error = command_stdout_error();
    if (error != EPIPE)
        error_say("slew: standard output: %s",
                  error == 0 ? "not all of it could be written"
                             : strerror(error));
    return STATUS_SYSTEM;
}

static enum status command_run(const struct command *command, int argc,
                               char *argv[])
{
    struct options options;
    if (options_parse(command, argc, argv, &options) < 0)
        return STATUS_INPUT;
    if (options.help) {
        options_help(command, stdout);
        return STATUS_OK;
    }
    return command->run(&options);
}

static bool command_is_help(const char *word)
{
    return strcmp(word, "--help") == 0 || strcmp(word, "-h") == 0 ||
           strcmp(word, "help") == 0;
}

/* slewd ... is slew service run ... */
static enum status command_slewd(int argc, char *argv[])
{
    char *words[OPTIONS_PATHS_MAX + 4] = { argv[0], "service", "run" };
    if (argc > OPTIONS_PATHS_MAX) {
        error_say("slewd: too many arguments; see slewd --help");
        return STATUS_INPUT;
    }
    for (int i = 1; i < argc; i++)
        words[i + 2] = argv[i];
    return command_flush(command_run(&cmd_service, argc + 1, words + 1));
}

static bool command_is_slewd(const char *program)
{
    const char *slash = strrchr(program, '/');
    return strcmp(slash == NULL ? program : slash + 1, "slewd") == 0;
}

enum status command_main(int argc, char *argv[])
{
    signal(SIGPIPE, SIG_IGN); /* write errors are seen where they happen */
    signal(SIGXFSZ, SIG_IGN);
    if (argc > 0 && command_is_slewd(argv[0]))
        return command_slewd(argc, argv);
    if (argc < 2) {
        command_help(stderr);
        return STATUS_INPUT;
    }
    if (command_is_help(argv[1])) {
        command_help(stdout);
        return command_flush(STATUS_OK);
    }
    if (strcmp(argv[1], "--version") == 0) {
        puts("slew " SLEW_VERSION);
        return command_flush(STATUS_OK);
    }
    const struct command *command = command_find(argv[1]);
    if (command == NULL)
        error_say("slew: no command \"%s\"; see slew --help", argv[1]);
    enum status status = command == NULL
                             ? STATUS_INPUT
                             : command_run(command, argc - 1, argv + 1);
    if (command_wants_json(argc, argv))
        status = command_json(status);
    return command_flush(status);
}
