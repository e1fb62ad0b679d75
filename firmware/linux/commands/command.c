/* firmware/linux/commands/command.c - finding and running a command; see
 * command.h. */
#include "firmware/linux/commands/command.h"

#include <errno.h>
#include <stdio.h>
#include <string.h>

const struct command *const command_list[] = {
    &cmd_check,   &cmd_plan,    &cmd_sample, &cmd_plot,   &cmd_run,
    &cmd_otg,     &cmd_gallery, &cmd_import, &cmd_export, &cmd_compile,
    &cmd_sim,     &cmd_drive,   &cmd_off,    &cmd_home,   &cmd_jog,
    &cmd_monitor, &cmd_scan,    &cmd_doctor, NULL,
};

const struct command *command_find(const char *name)
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
    fputs("\nslew COMMAND --help says more.\n", file);
}

/* A full disk or a closed pipe shows only here. */
static enum status command_flush(enum status status)
{
    if (fflush(stdout) == 0 && !ferror(stdout))
        return status;
    if (errno != EPIPE)
        fprintf(stderr, "slew: standard output: %s\n", strerror(errno));
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

enum status command_main(int argc, char *argv[])
{
    if (argc < 2) {
        command_help(stderr);
        return STATUS_INPUT;
    }
    if (command_is_help(argv[1])) {
        command_help(stdout);
        return command_flush(STATUS_OK);
    }
    const struct command *command = command_find(argv[1]);
    if (command == NULL) {
        fprintf(stderr, "slew: no command \"%s\"; see slew --help\n", argv[1]);
        return STATUS_INPUT;
    }
    return command_flush(command_run(command, argc - 1, argv + 1));
}
