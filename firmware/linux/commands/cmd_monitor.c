/* firmware/linux/commands/cmd_monitor.c - slew monitor: what the machine is
 * doing, without touching it. */
#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

#include "firmware/host/base/array.h"
#include "firmware/host/base/json.h"
#include "firmware/host/base/memory.h"
#include "firmware/host/base/number.h"
#include "firmware/host/base/table.h"
#include "firmware/linux/base/interrupt.h"
#include "firmware/linux/base/json_print.h"
#include "firmware/linux/commands/command.h"
#include "firmware/linux/commands/live.h"

#define MONITOR_RATE_UHZ INT64_C(5000000)
#define MONITOR_WAIT_NS  INT64_C(5000000000) /* for drives, with --once */

struct cmd_monitor {
    const struct options *options;
    struct live live;
    int64_t every_ns, shown_ns;
    int64_t busy_ns[RIG_BUSES_MAX]; /* of the wire, when it was shown last */
    double load[RIG_BUSES_MAX];
    bool screen; /* standard output is a terminal that is drawn anew */
};

/* --- words --------------------------------------------------------------- */

/* CiA 402-2, statusword: the state of its bits 0 - 3, 5 and 6. */
static const struct {
    uint16_t mask, value;
    const char *text;
} monitor_power[] = {
    { 0x4F, 0x00, "not ready to switch on" },
    { 0x4F, 0x40, "switch on disabled" },
    { 0x6F, 0x21, "ready to switch on" },
    { 0x6F, 0x23, "switched on" },
    { 0x6F, 0x27, "operation enabled" },
    { 0x6F, 0x07, "quick stop active" },
    { 0x4F, 0x0F, "fault reaction active" },
    { 0x4F, 0x08, "fault" },
};

static const char *monitor_power_text(uint16_t statusword)
{
    for (size_t i = 0; i < ARRAY_LEN(monitor_power); i++)
        if ((statusword & monitor_power[i].mask) == monitor_power[i].value)
            return monitor_power[i].text;
    return "no state of CiA 402";
}

/* "0x0637 operation enabled, warning"; "" for drives that have none. */
static uint16_t monitor_statusword(const struct cmd_monitor *self, unsigned i,
                                   char text[TABLE_CELL_MAX])
{
    uint16_t word;
    text[0] = 0;
    if (machine_statusword(&self->live.machine, i, &word))
        snprintf(text, TABLE_CELL_MAX, "0x%04X %s%s%s%s", word,
                 monitor_power_text(word),
                 (word & 0x10) == 0 ? ", no power" : "",
                 (word & 0x80) != 0 ? ", warning" : "",
                 (word & 0x800) != 0 ? ", internal limit" : "");
    return word;
}

static void monitor_inputs(const struct hal_drive_feedback *feedback,
                           char text[TABLE_CELL_MAX])
{
    snprintf(text, TABLE_CELL_MAX, "%s%s%s%s",
             feedback->home_switch ? " home" : "",
             feedback->limit_negative ? " limit-negative" : "",
             feedback->limit_positive ? " limit-positive" : "",
             feedback->probe_latched ? " probe" : "");
}

static const struct controller_axis *
monitor_axis(const struct cmd_monitor *self, unsigned i)
{
    return &self->live.machine.controller.axis[i];
}

/* Where it may be looked up, when the position means nothing yet. */
static const char *monitor_position_note(const struct controller_axis *axis)
{
    return axis->homed ? "" : " (unhomed)";
}

/* --- the table ------------------------------------------------------------ */

static void monitor_row(struct table *table, const struct cmd_monitor *self,
                        unsigned i)
{
    const struct controller_axis *axis = monitor_axis(self, i);
    const struct hal_drive_feedback *feedback = &axis->feedback;
    const bool known = feedback->t_ns != 0;
    char text[NUMBER_MAX], cell[TABLE_CELL_MAX];
    table_cell(table, "%s", self->live.rig->axis[i].name);
    table_cell(table, "%s", hal_drive_state_text(feedback->state));
    number_fixed(text, feedback->pos_q32, 32, 4);
    table_cell(table, "%s%s", known ? text : "-",
               known ? monitor_position_note(axis) : "");
    number_fixed(text, feedback->vel_q32, 32, 3);
    table_cell(table, "%s", known ? text : "-");
    number_fixed(text, axis->following_q32, 32, 4);
    table_cell(table, "%s", known ? text : "-");
    table_cell(table, "%s", units_axis_text(self->live.rig->axis[i].unit));
    if (feedback->torque_known)
        table_cell(table, "%.1f %%", feedback->torque_permille / 10.0);
    else
        table_cell(table, "-");
    monitor_inputs(feedback, cell);
    table_cell(table, "%s", cell[0] != 0 ? cell + 1 : "-");
    (void)monitor_statusword(self, i, cell);
    table_cell(table, "%s", cell[0] != 0 ? cell : "-");
    table_cell(table, "%s",
               feedback->fault_text[0] != 0 ? feedback->fault_text : "-");
}

static void monitor_axes(const struct cmd_monitor *self)
{
    static const char *const head[] = {
        "<axis", "<drive",  ">position", ">velocity /s", ">following",
        "<unit", ">torque", "<inputs",   "<statusword",  "<error",
    };
    struct table table;
    table_init(&table, 10, head);
    for (unsigned i = 0; i < self->live.rig->axis_count; i++)
        monitor_row(&table, self, i);
    table_print(&table, stdout);
    table_free(&table);
}

/* What happened on a bus that should not. */
static uint64_t monitor_errors(const struct cmd_monitor *self, unsigned bus)
{
    const struct machine_ports *ports = &self->live.machine.ports;
    struct hal_can_stats can = { 0 };
    struct hal_modbus_stats line = { 0 };
    if (ports->can[bus] != NULL)
        hal_can_stats(ports->can[bus], &can);
    else
        hal_modbus_stats(ports->modbus[bus], &line);
    return can.errors + can.dropped + can.refused + line.timeouts +
           line.broken + line.failures;
}

static void monitor_print_bus(const struct cmd_monitor *self, unsigned bus)
{
    printf("%s: ", self->live.rig->bus[bus].name);
    if (self->live.machine.ports.can[bus] != NULL)
        printf("%s, ", hal_can_state_text((enum hal_can_state)hal_can_state(
                           self->live.machine.ports.can[bus])));
    if (self->load[bus] > 0)
        printf("%.1f %% in use, ", 100 * self->load[bus]);
    printf("%" PRIu64 " errors\n", monitor_errors(self, bus));
}

/* As the machine sees it: an input after its debouncing. */
static int monitor_line(struct cmd_monitor *self, unsigned i)
{
    struct machine *machine = &self->live.machine;
    return rig_line_is_output(&self->live.rig->line[i])
               ? hal_gpio_get(machine->ports.line[i])
               : hal_gpio_get(&machine->input[i].gpio);
}

static const char *monitor_line_text(int level)
{
    if (level < 0)
        return "cannot be read";
    return level != 0 ? "active" : "-";
}

static void monitor_lines(struct cmd_monitor *self)
{
    for (unsigned i = 0; i < self->live.rig->line_count; i++)
        printf("%s%s (%s): %s",
               i > 0 ? ", " : "lines: ", self->live.rig->line[i].name,
               rig_line_kind_text(self->live.rig->line[i].kind),
               monitor_line_text(monitor_line(self, i)));
    if (self->live.rig->line_count > 0)
        putchar('\n');
}

static void monitor_print(struct cmd_monitor *self)
{
    char fault[LIVE_FAULT_MAX];
    if (self->screen)
        fputs("\033[H\033[J", stdout);
    printf("%s%s%.1f s, %s drives\n", self->live.rig->title,
           self->live.rig->title[0] != 0 ? ", " : "",
           (double)(self->live.now_ns - self->live.start_ns) / 1e9,
           self->options->real ? "real" : "simulated");
    monitor_axes(self);
    for (unsigned i = 0; i < self->live.rig->bus_count; i++)
        monitor_print_bus(self, i);
    monitor_lines(self);
    live_fault_text(&self->live, fault);
    if (fault[0] != 0)
        printf("fault: %s\n", fault);
}

/* --- for programs ----------------------------------------------------------- */

static cJSON *monitor_json_axis(const struct cmd_monitor *self, unsigned i)
{
    const struct controller_axis *axis = monitor_axis(self, i);
    const struct hal_drive_feedback *feedback = &axis->feedback;
    char text[TABLE_CELL_MAX];
    cJSON *item = cJSON_CreateObject();
    cJSON_AddStringToObject(item, "name", self->live.rig->axis[i].name);
    cJSON_AddStringToObject(item, "unit",
                            units_axis_text(self->live.rig->axis[i].unit));
    cJSON_AddStringToObject(item, "drive",
                            hal_drive_state_text(feedback->state));
    cJSON_AddBoolToObject(item, "homed", axis->homed);
    if (feedback->t_ns != 0) {
        json_add_fixed(item, "position", feedback->pos_q32, 32);
        json_add_fixed(item, "velocity", feedback->vel_q32, 32);
        json_add_fixed(item, "following", axis->following_q32, 32);
    }
    if (feedback->torque_known)
        cJSON_AddNumberToObject(item, "torque_permille",
                                feedback->torque_permille);
    cJSON_AddBoolToObject(item, "home_switch", feedback->home_switch);
    cJSON_AddBoolToObject(item, "limit_negative", feedback->limit_negative);
    cJSON_AddBoolToObject(item, "limit_positive", feedback->limit_positive);
    const uint16_t word = monitor_statusword(self, i, text);
    if (text[0] != 0) {
        cJSON_AddNumberToObject(item, "statusword", word);
        cJSON_AddStringToObject(item, "statusword_text", text);
    }
    cJSON_AddNumberToObject(item, "fault_code", feedback->fault_code);
    cJSON_AddStringToObject(item, "error", feedback->fault_text);
    return item;
}

static void monitor_json(struct cmd_monitor *self)
{
    cJSON *report = cJSON_CreateObject();
    cJSON_AddNumberToObject(
        report, "t_s", (double)(self->live.now_ns - self->live.start_ns) / 1e9);
    cJSON *axes = cJSON_AddArrayToObject(report, "axes");
    for (unsigned i = 0; i < self->live.rig->axis_count; i++)
        cJSON_AddItemToArray(axes, monitor_json_axis(self, i));
    cJSON *buses = cJSON_AddArrayToObject(report, "buses");
    for (unsigned i = 0; i < self->live.rig->bus_count; i++) {
        cJSON *bus = cJSON_CreateObject();
        cJSON_AddItemToArray(buses, bus);
        cJSON_AddStringToObject(bus, "name", self->live.rig->bus[i].name);
        cJSON_AddNumberToObject(bus, "load", self->load[i]);
        json_add_integer(bus, "errors", (int64_t)monitor_errors(self, i));
    }
    cJSON *lines = cJSON_AddArrayToObject(report, "lines");
    for (unsigned i = 0; i < self->live.rig->line_count; i++) {
        const int level = monitor_line(self, i);
        cJSON *line = cJSON_CreateObject();
        cJSON_AddItemToArray(lines, line);
        cJSON_AddStringToObject(line, "name", self->live.rig->line[i].name);
        cJSON_AddStringToObject(
            line, "kind", rig_line_kind_text(self->live.rig->line[i].kind));
        if (level >= 0)
            cJSON_AddBoolToObject(line, "active", level != 0);
        else
            cJSON_AddNullToObject(line, "active");
    }
    json_print_line(report, stdout);
    putchar('\n');
}

/* --- the loop --------------------------------------------------------------- */

static void monitor_measure(struct cmd_monitor *self)
{
    const int64_t dur_ns = self->live.now_ns - self->shown_ns;
    for (unsigned i = 0; i < self->live.rig->bus_count && dur_ns > 0; i++) {
        const int64_t busy_ns = machine_busy_ns(&self->live.machine, i);
        /* what began before the last look counts when it ends */
        self->load[i] =
            fmin((double)(busy_ns - self->busy_ns[i]) / (double)dur_ns, 1);
        self->busy_ns[i] = busy_ns;
    }
    self->shown_ns = self->live.now_ns;
}

static void monitor_show(struct cmd_monitor *self)
{
    monitor_measure(self);
    if (self->options->json)
        monitor_json(self);
    else
        monitor_print(self);
    fflush(stdout);
}

static bool monitor_all_there(const struct cmd_monitor *self)
{
    for (unsigned i = 0; i < self->live.rig->axis_count; i++)
        if (monitor_axis(self, i)->feedback.state == HAL_DRIVE_OFFLINE)
            return false;
    return true;
}

/* One look: when every drive has been found and the buses had time for their
 * load, or not at all. */
static void monitor_once(struct cmd_monitor *self,
                         const volatile sig_atomic_t *interrupts)
{
    const int64_t start_ns = self->live.now_ns;
    while (!monitor_all_there(self) && *interrupts == 0 &&
           self->live.now_ns - start_ns < MONITOR_WAIT_NS)
        live_tick(&self->live);
    monitor_measure(self);
    for (int64_t until_ns = self->live.now_ns + self->every_ns;
         self->live.now_ns < until_ns && *interrupts == 0;)
        live_tick(&self->live);
    monitor_show(self);
}

static void monitor_loop(struct cmd_monitor *self,
                         const volatile sig_atomic_t *interrupts)
{
    const int64_t start_ns = self->live.now_ns;
    while (*interrupts == 0 && !ferror(stdout) &&
           (self->options->to_ns < 0 ||
            self->live.now_ns - start_ns < self->options->to_ns)) {
        live_tick(&self->live);
        if (self->live.now_ns - self->shown_ns >= self->every_ns)
            monitor_show(self);
    }
}

static enum status cmd_monitor_rig(struct cmd_monitor *self)
{
    const struct options *options = self->options;
    enum status status = live_read(&self->live, options);
    if (status == STATUS_OK)
        status = live_open(&self->live, options, !options->once);
    if (status != STATUS_OK)
        return status;
    const volatile sig_atomic_t *interrupts = interrupt_listen();
    self->shown_ns = self->live.now_ns;
    if (options->once)
        monitor_once(self, interrupts);
    else
        monitor_loop(self, interrupts);
    interrupt_listen_no_more();
    return monitor_all_there(self) ? STATUS_OK : STATUS_REFUSED;
}

static enum status cmd_monitor_run(const struct options *options)
{
    const int64_t rate_uhz =
        options->rate_uhz < 0 ? MONITOR_RATE_UHZ : options->rate_uhz;
    struct cmd_monitor *self = memory_new(1, sizeof *self);
    self->options = options;
    self->every_ns = INT64_C(1000000000000000) / rate_uhz;
    self->screen = isatty(STDOUT_FILENO) && !options->once && !options->json;
    enum status status = cmd_monitor_rig(self);
    live_close(&self->live);
    memory_free(self);
    return status;
}

static const struct option_row cmd_monitor_option[] = {
    { "once", NULL, OPTION_FLAG, offsetof(struct options, once),
      "look once, when every drive was found" },
    { "rate", "HZ", OPTION_RATE, offsetof(struct options, rate_uhz),
      "how often to look (5)" },
    { "for", "TIME", OPTION_TIME, offsetof(struct options, to_ns),
      "end after so long (until Ctrl-C)" },
    OPTIONS_REAL("look at the real drives, on the interfaces of the rig"),
    OPTIONS_PORTS,
    OPTIONS_COMMON,
};

const struct command cmd_monitor = {
    .name = "monitor",
    .arguments = "RIG",
    .summary = "watch drives, inputs and buses; nothing is enabled",
    .text =
        "Finds the drives and shows, again and again, what each of them says:\n"
        "state, position, velocity, following error, torque, inputs,\n"
        "statusword and error; how busy the buses are and what went wrong on\n"
        "them; and the GPIO lines.  Drives are set up (PDOs, watchdog) but "
        "get\n"
        "no torque: an axis can be pushed by hand and watched.\n\n"
        "With --json a line of JSON per look.  Status 1 when a drive was not\n"
        "there at the end.\n\n"
        "Drives are simulated unless --real is given.\n",
    .examples = "  slew monitor --real rig.yaml\n"
                "  slew monitor --once rig.yaml\n"
                "  slew monitor --json --rate 50 --for 10s --real rig.yaml\n",
    .path_max = 1,
    COMMAND_OPTIONS(cmd_monitor_option),
    .run = cmd_monitor_run,
};
