/* firmware/linux/commands/run/cmd_off.c - slew off: torque off every drive. */
#include <stdio.h>
#include <string.h>

#include "firmware/host/base/memory.h"
#include "firmware/host/base/table.h"
#include "firmware/linux/base/error.h"
#include "firmware/linux/base/interrupt.h"
#include "firmware/linux/base/json_print.h"
#include "firmware/linux/commands/command.h"
#include "firmware/linux/commands/run/live.h"
#include "firmware/linux/machine/off.h"

static void cmd_off_table(const struct rig *rig, const struct off_axis axis[])
{
    static const char *const head[] = { "<axis", "<drive", "<torque" };
    struct table table;
    table_init(&table, 3, head);
    for (unsigned i = 0; i < rig->axis_count; i++) {
        table_cell(&table, "%s", rig->axis[i].name);
        table_cell(&table, "%s", hal_drive_state_text(axis[i].state));
        table_cell(&table, "%s", axis[i].is_off ? "off" : "not confirmed off");
    }
    table_print(&table, stdout);
    table_free(&table);
    for (unsigned i = 0; i < rig->axis_count; i++)
        if (!axis[i].is_off || axis[i].found)
            error_say("%s: %s", rig->axis[i].name, axis[i].text);
}

static void cmd_off_json(const struct rig *rig, const struct off_axis axis[],
                         bool all)
{
    cJSON *report = cJSON_CreateObject();
    cJSON *list = cJSON_AddArrayToObject(report, "axes");
    for (unsigned i = 0; i < rig->axis_count; i++) {
        cJSON *item = cJSON_CreateObject();
        cJSON_AddItemToArray(list, item);
        cJSON_AddStringToObject(item, "name", rig->axis[i].name);
        cJSON_AddBoolToObject(item, "off", axis[i].is_off);
        cJSON_AddStringToObject(item, "drive",
                                hal_drive_state_text(axis[i].state));
        cJSON_AddStringToObject(item, "what", axis[i].text);
    }
    json_report(report, all);
}

static enum status cmd_off_rig(const struct rig *rig,
                               const struct options *options)
{
    struct off_axis *axis = memory_new(rig->axis_count, sizeof *axis);
    const struct off_config config = {
        .real = options->real,
        .kills = options->take_over,
        .timeout_ns =
            options->timeout_ns > 0 ? options->timeout_ns : SHUTDOWN_OFF_NS,
    };
    const volatile sig_atomic_t *interrupts = interrupt_listen();
    const bool all = off_all(rig, &config, axis, interrupts);
    const bool interrupted = *interrupts > 0;
    interrupt_listen_no_more();
    if (options->json)
        cmd_off_json(rig, axis, all);
    else
        cmd_off_table(rig, axis);
    memory_free(axis);
    if (all)
        return STATUS_OK;
    return interrupted ? STATUS_INTERRUPTED : STATUS_REFUSED;
}

static enum status cmd_off_run(const struct options *options)
{
    struct live *live = memory_new(1, sizeof *live);
    enum status status = live_read(live, options);
    if (status == STATUS_OK)
        status = cmd_off_rig(live->rig, options);
    live_close(live);
    memory_free(live);
    return status;
}

static const struct option_row cmd_off_option[] = {
    OPTIONS_REAL("the real drives, on the interfaces of the rig"),
    OPTIONS_INTERFACE,
    { "timeout", "TIME", OPTION_TIME, offsetof(struct options, timeout_ns),
      "so long drives that do not answer are tried (5 s)" },
    { "take-over", NULL, OPTION_FLAG, offsetof(struct options, take_over),
      "kill who has the ports, or, where that is not allowed, go on beside" },
    OPTIONS_COMMON,
};

const struct command cmd_off = {
    .name = "off",
    .arguments = "RIG",
    .summary = "take torque off every drive, and say who confirmed it",
    .text =
        "Stops and switches off every drive of the rig, whatever left it on,\n"
        "and says of each whether it has confirmed that.  Nothing is enabled,\n"
        "without a question.  The other buses do not wait for one that "
        "cannot\n"
        "be opened.  Status 1 when a drive has not confirmed that it is off:\n"
        "then use the e-stop.\n\n"
        "A load that the motor holds may fall: that is for the brake.\n\n"
        "Where another program has the ports, it is named, and not disturbed:\n"
        "end that one (Ctrl-C, kill -INT): it takes torque off itself.  One\n"
        "whose loop hangs is killed by its guardian, and waited for.  Where\n"
        "neither helps, --take-over does.\n\n"
        "Drives are simulated unless --real is given.\n",
    .examples = "  slew off --real rig.yaml\n"
                "  slew off --real --interface can1 --timeout 30s rig.yaml\n"
                "  slew off --real --json examples/dolly\n",
    .path_max = 1,
    COMMAND_OPTIONS(cmd_off_option),
    .run = cmd_off_run,
};
