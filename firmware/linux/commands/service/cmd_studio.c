/* firmware/linux/commands/service/cmd_studio.c - slew studio: a rig and a move in
 * a browser. */
#include <stdio.h>

#include "firmware/host/base/memory.h"
#include "firmware/linux/base/error.h"
#include "firmware/linux/commands/service/page.h"
#include "firmware/studio/server/example.h"

#define CMD_STUDIO_CPUS 1023

static enum status cmd_studio_serve(struct page *page,
                                    const struct options *options)
{
    const struct service_beside beside = page_beside(page);
    const struct service_config config = {
        .command = "studio",
        .rig_path = page->rig,
        .socket = options->socket,
        .interface = options->interface,
        .real = options->real,
        .cpu = (int)options->cpu,
        .plan = { options->plan_ns, options->plan_mib },
        .beside = &beside,
    };
    return command_may_move(options, "studio") ? service_run(&config)
                                               : STATUS_INPUT;
}

/* The rig that is named, or an example of the user's own. */
static int cmd_studio_files(struct page *page, const struct options *options)
{
    char example[FILES_PATH_MAX];

    if (options->path_count > 0)
        return page_files(page, "studio", options->path[0],
                          options->path_count > 1 ? options->path[1] : NULL);
    if (options->real) {
        error_say("slew studio: which rig? expected RIG with --real");
        return -1;
    }
    if (example_write(example) < 0)
        return -1;
    printf("the example in %s; one of your own: slew studio RIG [MOVE]\n",
           example);
    return page_files(page, "studio", example, NULL);
}

static enum status cmd_studio_run(const struct options *options)
{
    struct page *page = memory_new(1, sizeof *page);
    enum status status = STATUS_INPUT;
    if (options->cpu > CMD_STUDIO_CPUS)
        error_say("slew studio: --cpu: expected 0 to %d", CMD_STUDIO_CPUS);
    else if (page_place(page, "studio", options) == 0 &&
             cmd_studio_files(page, options) == 0)
        status = cmd_studio_serve(page, options);
    memory_free(page);
    return status;
}

static const struct option_row cmd_studio_option[] = {
    { "port", "N", OPTION_COUNT, offsetof(struct options, port),
      "of the page (8787)" },
    PAGE_OPTIONS(""),
    { "no-browser", NULL, OPTION_FLAG, offsetof(struct options, no_browser),
      "do not open it" },
    OPTIONS_REAL("the real drives, on the interfaces of the rig"),
    OPTIONS_YES("do not prompt before the page can move real drives"),
    OPTIONS_INTERFACE,
    { "cpu", "N", OPTION_COUNT, offsetof(struct options, cpu),
      "the processor of the tick (any)" },
    OPTIONS_PLAN(""),
    { "socket", "PATH", OPTION_TEXT, offsetof(struct options, socket),
      "another socket of the service than the rig's" },
    OPTIONS_COMMON,
};

const struct command cmd_studio = {
    .name = "studio",
    .arguments = "[RIG [MOVE] | DIRECTORY]",
    .summary = "a rig and a move in a browser: see, edit, check, run",
    .text =
        "Serves a page until Ctrl-C, and the rig as slew service run does: "
        "other\n"
        "programs can watch and take control meanwhile.  The page plans with "
        "the\n"
        "very planner of this program, compiled for a browser by make studio, "
        "and\n"
        "changes the move file where it stands.  Without a rig it is an "
        "example,\n"
        "kept in ~/.local/share/slew/example.\n\n"
        "Nothing moves, and no drive gets torque, before the page requests it; "
        "with\n"
        "--real it prompts first.  Only a browser that comes by the link that "
        "is\n"
        "printed is answered, and only on this machine unless --address and\n"
        "--token-file say more: whoever has the token moves the rig.\n",
    .examples = "  slew studio\n"
                "  slew studio examples/dolly\n"
                "  slew studio --real --cpu 1 rig.yaml move.yaml\n"
                "  slew studio --address 192.168.1.20 --token-file token rig\n",
    .path_max = 2,
    .path_optional = true,
    COMMAND_OPTIONS(cmd_studio_option),
    .run = cmd_studio_run,
};
