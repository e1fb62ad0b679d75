/* firmware/linux/commands/run/cmd_home.c - slew home: find out where the axes are.
 */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "firmware/host/base/json.h"
#include "firmware/host/base/memory.h"
#include "firmware/host/base/number.h"
#include "firmware/host/base/table.h"
#include "firmware/linux/base/error.h"
#include "firmware/linux/base/interrupt.h"
#include "firmware/linux/base/json_print.h"
#include "firmware/linux/commands/command.h"
#include "firmware/linux/commands/run/live.h"
#include "firmware/linux/commands/run/served.h"
#include "firmware/linux/machine/view.h"
#include "motion/core/err.h"

struct cmd_home {
    const struct options *options;
    struct live live; /* or, where a service has the rig, its rig alone */
    struct served served;
    uint64_t axes; /* to be homed, a bit each */
    int64_t dur_ns;
    /* what came of it */
    struct machine_view view;
    struct memory_pool memory;
    int failed; /* axis; -1: none */
    char why[HOMING_TEXT_MAX];
    char fault[MACHINE_FAULT_MAX];
};

static const char *const cmd_home_by[] = {
    [HOMING_NONE] = "its position is known",
    [HOMING_SWITCH] = "switch",
    [HOMING_DRIVE] = "the drive",
    [HOMING_HERE] = "where it stands",
    [HOMING_HARD_STOP] = "hard stop",
};

static bool cmd_home_has(const struct cmd_home *self, unsigned axis)
{
    return (self->axes >> axis & 1) != 0;
}

/* --- what will happen --- */

static const char *cmd_home_how(const struct homing_config *homing)
{
    if (homing->by != HOMING_SWITCH)
        return cmd_home_by[homing->by];
    if (homing->input == HOMING_INPUT_LIMIT_NEGATIVE)
        return "limit-negative";
    return homing->input == HOMING_INPUT_HOME ? "home switch"
                                              : "limit-positive";
}

static void cmd_home_row(struct table *table, const struct rig_axis *axis)
{
    const struct homing_config *homing = &axis->homing;
    const bool searches =
        homing->by == HOMING_SWITCH || homing->by == HOMING_HARD_STOP;
    char text[NUMBER_MAX];
    table_cell(table, "%u", homing->order);
    table_cell(table, "%s", axis->name);
    table_cell(table, "%s", cmd_home_how(homing));
    table_cell(table, "%s",
               !searches               ? "-"
               : homing->direction < 0 ? "negative"
                                       : "positive");
    number_short(text, homing->fast_q32, 32);
    table_cell(table, "%s", homing->by == HOMING_HERE ? "-" : text);
    number_short(text, homing->slow_q32, 32); /* 0: the drive's own */
    table_cell(table, "%s",
               homing->by == HOMING_HERE || homing->slow_q32 == 0 ? "-" : text);
    number_short(text, homing->distance_q32, 32);
    table_cell(table, "%s", searches ? text : "-");
    number_short(text, homing->pos_q32, 32);
    table_cell(table, "%s", text);
    number_short(text, homing->go_q32, 32);
    table_cell(table, "%s", homing->goes ? text : "-");
    table_cell(table, "%s", units_axis_text(axis->unit));
}

static void cmd_home_intent(const struct cmd_home *self)
{
    static const char *const head[] = {
        ">order",   "<axis",    "<by",      "<direction", ">speed /s",
        ">slow /s", ">at most", ">home is", ">then to",   "<unit",
    };
    struct table table;
    table_init(&table, 10, head);
    for (unsigned order = 1; order <= 16; order++)
        for (unsigned i = 0; i < self->live.rig->axis_count; i++)
            if (cmd_home_has(self, i) &&
                self->live.rig->axis[i].homing.order == order)
                cmd_home_row(&table, &self->live.rig->axis[i]);
    table_print(&table, stdout);
    table_free(&table);
    printf("%s drives\n", self->options->real ? "REAL" : "simulated");
    fflush(stdout);
}

/* --- doing it --- */

static void cmd_home_progress(const struct cmd_home *self,
                              enum homing_state *shown)
{
    const struct homing *homing = &self->live.machine.homing;
    if (homing->state == *shown || !homing_is_running(homing))
        return;
    *shown = homing->state;
    error_say("%s: %s", self->live.rig->axis[homing->axis].name,
              homing_state_text(homing->state));
}

static enum status cmd_home_live(struct cmd_home *self)
{
    const volatile sig_atomic_t *interrupts = interrupt_listen();
    struct live *live = &self->live;
    struct homing *homing = &live->machine.homing;
    enum homing_state shown = HOMING_IDLE;
    const bool enabled = live_enable(live, interrupts);
    const int64_t start_ns = live->now_ns;
    if (enabled)
        homing_start(homing, self->axes);
    while (homing_is_running(homing) && *interrupts == 0) {
        live_tick(live);
        cmd_home_progress(self, &shown);
    }
    self->dur_ns = live->now_ns - start_ns;
    const bool off = live_off(live, interrupts);
    const bool interrupted = *interrupts > 0;
    interrupt_listen_no_more();
    if (!off)
        return STATUS_REFUSED;
    if (interrupted)
        return STATUS_INTERRUPTED;
    return homing->state == HOMING_DONE ? STATUS_OK : STATUS_REFUSED;
}

/* --- by a service --- */

static const char *cmd_home_turn(const struct cmd_home *self, const char *name)
{
    const char *text = cJSON_GetStringValue(cJSON_GetObjectItem(
        cJSON_GetObjectItem(self->served.status, "homing_turn"), name));
    return text != NULL ? text : "";
}

static enum status cmd_home_wait(struct cmd_home *self)
{
    char shown[HOMING_TEXT_MAX] = "";
    enum status status = served_look(&self->served);
    while (status == STATUS_OK && self->served.homing) {
        if (strcmp(shown, cmd_home_turn(self, "step")) != 0) {
            snprintf(shown, sizeof shown, "%s", cmd_home_turn(self, "step"));
            error_say("%s: %s", cmd_home_turn(self, "axis"), shown);
        }
        status = served_step(&self->served);
    }
    return status == STATUS_OK ? served_wait(&self->served, "ready") : status;
}

static bool cmd_home_all(const struct cmd_home *self)
{
    for (unsigned i = 0; i < self->live.rig->axis_count; i++)
        if (cmd_home_has(self, i) && !self->view.axis[i].homed)
            return false;
    return true;
}

static void cmd_home_learn(struct cmd_home *self)
{
    machine_view_from(self->live.rig, self->served.status, &self->view);
    snprintf(self->why, sizeof self->why, "%s", cmd_home_turn(self, "text"));
    snprintf(self->fault, sizeof self->fault, "%s", self->served.fault);
    self->failed =
        self->why[0] != '\0'
            ? rig_axis_index(self->live.rig, cmd_home_turn(self, "axis"))
            : -1;
}

static enum status cmd_home_ask(struct cmd_home *self)
{
    struct served *served = &self->served;
    cJSON *command = served_command("home");
    cJSON *axes = cJSON_AddArrayToObject(command, "axes");
    for (unsigned i = 0; i < self->live.rig->axis_count; i++)
        if (cmd_home_has(self, i))
            cJSON_AddItemToArray(
                axes, cJSON_CreateString(self->live.rig->axis[i].name));
    enum status status = served_enable(served);
    if (status == STATUS_OK)
        status = served_do(served, command);
    else
        cJSON_Delete(command);
    if (status == STATUS_OK)
        status = cmd_home_wait(self);
    if (served->status != NULL)
        cmd_home_learn(self);
    if (status == STATUS_OK && !cmd_home_all(self))
        status = STATUS_REFUSED;
    return served_off(served, status);
}

static double cmd_home_seconds(const struct served *served)
{
    const double t_s =
        cJSON_GetNumberValue(cJSON_GetObjectItem(served->status, "t_s"));
    return t_s > 0 ? t_s : 0;
}

static enum status cmd_home_served(struct cmd_home *self, bool is_plain)
{
    struct served *served = &self->served;
    enum status status =
        served_allow(served, is_plain, "--dry-run and --interface");
    if (status != STATUS_OK)
        return status;
    if (!command_may_move(self->options, "home"))
        return STATUS_INPUT;
    served_say(served, "a service has this rig: it homes the axes");
    served->interrupts = interrupt_listen();
    status = served_take(served, SERVED_LEASE_S);
    const double start_s = cmd_home_seconds(served);
    if (status == STATUS_OK)
        status = cmd_home_ask(self);
    self->dur_ns = llrint((cmd_home_seconds(served) - start_s) * 1e9);
    interrupt_listen_no_more();
    return status;
}

/* --- what came of it --- */

static void cmd_home_see(struct cmd_home *self)
{
    const struct homing *homing = &self->live.machine.homing;
    char why[HOMING_TEXT_MAX];
    machine_view_axes(&self->live.machine, &self->view);
    machine_fault_text(&self->live.machine, self->fault);
    self->failed = homing->state == HOMING_FAILED ? (int)homing->axis : -1;
    if (self->failed >= 0)
        snprintf(self->why, sizeof self->why, "%s",
                 homing_failure(homing, why));
}

static const char *cmd_home_result(const struct cmd_home *self, unsigned i)
{
    if (self->view.axis[i].homed)
        return "homed";
    return self->failed == (int)i ? self->why : "not homed";
}

static void cmd_home_report_row(struct table *table,
                                const struct cmd_home *self, unsigned i)
{
    const struct machine_view_axis *axis = &self->view.axis[i];
    char text[NUMBER_MAX];
    table_cell(table, "%s", self->live.rig->axis[i].name);
    number_short(text, axis->pos_q32, 32);
    table_cell(table, "%s", axis->homed ? text : "-");
    number_short(text, axis->offset_q32, 32);
    table_cell(table, "%s", axis->homed ? text : "-");
    table_cell(table, "%s", units_axis_text(self->live.rig->axis[i].unit));
    table_cell(table, "%s", cmd_home_result(self, i));
}

static void cmd_home_report(const struct cmd_home *self)
{
    static const char *const head[] = { "<axis", ">stands at",
                                        ">the drive's 0 is", "<unit",
                                        "<result" };
    struct table table;
    table_init(&table, 5, head);
    for (unsigned i = 0; i < self->live.rig->axis_count; i++)
        if (cmd_home_has(self, i))
            cmd_home_report_row(&table, self, i);
    putchar('\n');
    table_print(&table, stdout);
    table_free(&table);
    if (self->fault[0] != 0)
        printf("fault: %s\n", self->fault);
    printf("after %.3f s\n", (double)self->dur_ns / 1e9);
}

static void cmd_home_json(const struct cmd_home *self, enum status status)
{
    cJSON *report = cJSON_CreateObject();
    cJSON *list = cJSON_AddArrayToObject(report, "axes");
    for (unsigned i = 0; i < self->live.rig->axis_count; i++) {
        const struct machine_view_axis *axis = &self->view.axis[i];
        if (!cmd_home_has(self, i))
            continue;
        cJSON *item = cJSON_CreateObject();
        cJSON_AddItemToArray(list, item);
        cJSON_AddStringToObject(item, "name", self->live.rig->axis[i].name);
        cJSON_AddStringToObject(item, "unit",
                                units_axis_text(self->live.rig->axis[i].unit));
        cJSON_AddBoolToObject(item, "homed", axis->homed);
        cJSON_AddStringToObject(item, "result", cmd_home_result(self, i));
        json_add_fixed(item, "position", axis->pos_q32, 32);
        json_add_fixed(item, "offset", axis->offset_q32, 32);
    }
    if (self->fault[0] != 0)
        cJSON_AddStringToObject(report, "fault", self->fault);
    cJSON_AddNumberToObject(report, "duration_s", (double)self->dur_ns / 1e9);
    json_report(report, status == STATUS_OK);
}

/* --- the command --- */

/* All that can be homed, or those that were named. */
static enum status cmd_home_choose(struct cmd_home *self)
{
    const struct rig *rig = self->live.rig;
    for (int i = 1; i < self->options->path_count; i++) {
        const int axis = live_axis(&self->live, "home", self->options->path[i]);
        if (axis < 0)
            return STATUS_INPUT;
        if (rig->axis[axis].homing.by == HOMING_NONE) {
            error_say("slew home: axis %s has no homing in the rig, expected a "
                      "section such as homing: {by: switch}",
                      rig->axis[axis].name);
            return STATUS_INPUT;
        }
        self->axes |= (uint64_t)1 << axis;
        if (rig_rail_beside(rig, (uint32_t)axis) >= 0) /* both in one turn */
            self->axes |= (uint64_t)1 << rig_rail_beside(rig, (uint32_t)axis);
    }
    for (unsigned i = 0; self->options->path_count == 1 && i < rig->axis_count;
         i++)
        if (rig->axis[i].homing.by != HOMING_NONE)
            self->axes |= (uint64_t)1 << i;
    if (self->axes != 0)
        return STATUS_OK;
    error_say("slew home: no axis of the rig has homing, expected one with a "
              "section such as homing: {by: switch}");
    return STATUS_INPUT;
}

static enum status cmd_home_rig(struct cmd_home *self)
{
    const struct options *options = self->options;
    enum status status = live_read(&self->live, options);
    if (status == STATUS_OK)
        status = cmd_home_choose(self);
    if (status != STATUS_OK)
        return status;
    machine_view_init(&self->view, self->live.rig, &self->memory);
    if (!options->json)
        cmd_home_intent(self);
    status = live_fits(&self->live, options);
    if (status != STATUS_OK)
        return status;
    const bool is_plain =
        !options->dry_run && !options->pty && options->interface == NULL;
    if (served_find(&self->served, options, "home", is_plain)) {
        status = cmd_home_served(self, is_plain);
        if (self->served.status == NULL)
            return status;
    } else {
        if (options->dry_run)
            return live_dry_run_alone(&self->live, options);
        status = live_begin(&self->live, options, "home", false);
        if (status != STATUS_OK)
            return status;
        status = cmd_home_live(self);
        cmd_home_see(self);
    }
    if (options->json)
        cmd_home_json(self, status);
    else
        cmd_home_report(self);
    return status;
}

static enum status cmd_home_run(const struct options *options)
{
    struct cmd_home *self = memory_new(1, sizeof *self);
    self->options = options;
    self->failed = -1;
    self->served.link.file = -1;
    enum status status = cmd_home_rig(self);
    served_close(&self->served);
    live_close(&self->live);
    memory_pool_free(&self->memory);
    memory_free(self);
    return status;
}

static const struct option_row cmd_home_option[] = {
    OPTIONS_DRY_RUN("say what would happen and stop there"),
    OPTIONS_REAL("home the real drives, on the interfaces of the rig"),
    OPTIONS_YES("do not prompt before real drives move"),
    OPTIONS_PORTS,
    OPTIONS_COMMON,
};

const struct command cmd_home = {
    .name = "home",
    .arguments = "RIG [AXIS...]",
    .summary = "find out where axes are: switches, the drive's own, or here",
    .text =
        "Homes the axes that are named, or all that have `homing` in the rig,\n"
        "one after the other in the rig's order: to a switch, by the drive's\n"
        "own homing, or by taking the present position.  Says first what it\n"
        "will do.  Torque goes off at the end.\n\n"
        "slew run homes by itself what a move needs; where a drive loses "
        "its\n"
        "zero without torque or power, this only tries it out.\n\n"
        "Drives are simulated unless --real is given.  Where a service has "
        "the\n"
        "rig it homes the axes, and they stay homed there.\n\n" LIVE_HELP_STOP,
    .examples = "  slew home --dry-run rig.yaml\n"
                "  slew home rig.yaml dolly\n"
                "  slew home --real --yes rig.yaml\n",
    .path_max = 17,
    COMMAND_OPTIONS(cmd_home_option),
    .run = cmd_home_run,
};
