/* firmware/linux/commands/command.h - the commands of slew. */
#ifndef FIRMWARE_LINUX_COMMANDS_COMMAND_H
#define FIRMWARE_LINUX_COMMANDS_COMMAND_H

#include "firmware/host/base/array.h"
#include "firmware/host/base/status.h"
#include "firmware/linux/commands/options.h"

struct command {
    const char *name;
    const char *arguments;    /* after the options, for the help */
    const char *summary;      /* one line */
    const char *text;         /* paragraphs */
    void (*more)(FILE *file); /* after the text, what tables say; or NULL */
    const char *examples;     /* lines, indented */
    int path_max;             /* arguments; 0: 2 */
    bool negative;            /* arguments may be values below zero */
    bool path_optional;       /* none will do, too */
    const struct option_row *option;
    size_t option_count;
    enum status (*run)(const struct options *options);
};

#define COMMAND_OPTIONS(rows) .option = (rows), .option_count = ARRAY_LEN(rows)

extern const struct command cmd_check, cmd_fit, cmd_plan, cmd_sample, cmd_plot,
    cmd_run, cmd_report, cmd_otg, cmd_gallery, cmd_import, cmd_export,
    cmd_compile, cmd_off, cmd_sim, cmd_drive, cmd_home, cmd_jog, cmd_monitor,
    cmd_scan, cmd_doctor, cmd_shaper, cmd_service, cmd_capture, cmd_batch,
    cmd_studio;

/* The commands above in the order of the help; NULL at the end. */
extern const struct command *const command_list[];
/* Everything after main(): argv[1] names the command. */
enum status command_main(int argc, char *argv[]);

/* With --real: says that things will move and asks on a terminal; elsewhere
 * --yes is needed.  False: the operator does not want it. */
bool command_may_move(const struct options *options, const char *command);

#endif
