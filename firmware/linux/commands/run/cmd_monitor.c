/* firmware/linux/commands/run/cmd_monitor.c - slew monitor: what the machine is
 * doing, without touching it. */
#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

#include "firmware/host/base/memory.h"
#include "firmware/host/base/number.h"
#include "firmware/host/base/table.h"
#include "firmware/linux/base/interrupt.h"
#include "firmware/linux/base/json_print.h"
#include "firmware/linux/commands/command.h"
#include "firmware/linux/commands/run/live.h"
#include "firmware/linux/commands/run/served.h"
#include "firmware/linux/machine/modbus_words.h"
#include "firmware/linux/machine/view.h"

#define MONITOR_RATE_UHZ INT64_C(5000000)
#define MONITOR_WAIT_NS  INT64_C(5000000000) /* for drives, with --once */

struct cmd_monitor {
    const struct options *options;
    struct live live; /* or, where a service has the rig, its rig alone */
    struct served served;
    bool is_served;
    struct machine_view view;
    char fault[MACHINE_FAULT_MAX];
    int64_t start_ns, now_ns;
    int64_t every_ns, shown_ns;
    int64_t *busy_ns; /* of each bus's wire, when it was shown last */
    double *load;
    struct memory_pool memory;
    bool screen; /* standard output is a terminal that is drawn anew */
};

/* --- the table ------------------------------------------------------------ */

static void monitor_inputs(const struct machine_view_axis *axis,
                           char text[TABLE_CELL_MAX])
{
    snprintf(text, TABLE_CELL_MAX, "%s%s%s%s", axis->home_switch ? " home" : "",
             axis->limit_negative ? " limit-negative" : "",
             axis->limit_positive ? " limit-positive" : "",
             axis->probe_latched ? " probe" : "");
}

/* Where it may be looked up, when the position means nothing yet. */
static const char *monitor_position_note(const struct machine_view_axis *axis)
{
    return axis->homed ? "" : " (unhomed)";
}

static void monitor_row(struct table *table, const struct cmd_monitor *self,
                        unsigned i)
{
    const struct machine_view_axis *axis = &self->view.axis[i];
    char text[NUMBER_MAX], cell[TABLE_CELL_MAX];
    table_cell(table, "%s", self->live.rig->axis[i].name);
    table_cell(table, "%s", hal_drive_state_text(axis->drive));
    number_fixed(text, axis->pos_q32, 32, 4);
    table_cell(table, "%s%s", axis->known ? text : "-",
               axis->known ? monitor_position_note(axis) : "");
    number_fixed(text, axis->vel_q32, 32, 3);
    table_cell(table, "%s", axis->known ? text : "-");
    number_fixed(text, axis->following_q32, 32, 4);
    table_cell(table, "%s", axis->known ? text : "-");
    table_cell(table, "%s", units_axis_text(self->live.rig->axis[i].unit));
    if (axis->torque_known)
        table_cell(table, "%.1f %%", axis->torque_permille / 10.0);
    else
        table_cell(table, "-");
    monitor_inputs(axis, cell);
    table_cell(table, "%s", cell[0] != 0 ? cell + 1 : "-");
    machine_view_word(axis, cell);
    table_cell(table, "%s", cell[0] != 0 ? cell : "-");
    table_cell(table, "%s", axis->fault_text[0] != 0 ? axis->fault_text : "-");
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

static void monitor_print_bus(const struct cmd_monitor *self, unsigned i)
{
    const struct machine_view_bus *bus = &self->view.bus[i];
    printf("%s: ", self->live.rig->bus[i].name);
    if (bus->can_state >= 0)
        printf("%s, ", hal_can_state_text((enum hal_can_state)bus->can_state));
    if (self->load[i] > 0)
        printf("%.1f %% in use, ", 100 * self->load[i]);
    printf("%" PRIu64 " %s\n", bus->errors,
           number_word(bus->errors, "error", "errors"));
    char text[MODBUS_WORDS][MODBUS_WORDS_MAX];
    const unsigned count =
        modbus_words(&self->live.rig->bus[i], &bus->line, text);
    for (unsigned k = 0; k < count; k++)
        printf("%s: %s\n", self->live.rig->bus[i].name, text[k]);
}

static const char *monitor_line_text(int level)
{
    if (level < 0)
        return "cannot be read";
    return level != 0 ? "active" : "-";
}

static void monitor_lines(const struct cmd_monitor *self)
{
    for (unsigned i = 0; i < self->live.rig->line_count; i++)
        printf("%s%s (%s): %s",
               i > 0 ? ", " : "lines: ", self->live.rig->line[i].name,
               rig_line_kind_text(self->live.rig->line[i].kind),
               monitor_line_text(self->view.line[i]));
    if (self->live.rig->line_count > 0)
        putchar('\n');
}

static void monitor_print(const struct cmd_monitor *self)
{
    if (self->screen)
        fputs("\033[H\033[J", stdout);
    printf("%s%s%.1f s, %s drives\n", self->live.rig->title,
           self->live.rig->title[0] != 0 ? ", " : "",
           (double)(self->now_ns - self->start_ns) / 1e9,
           self->options->real ? "real" : "simulated");
    monitor_axes(self);
    for (unsigned i = 0; i < self->live.rig->bus_count; i++)
        monitor_print_bus(self, i);
    monitor_lines(self);
    if (self->fault[0] != 0)
        printf("fault: %s\n", self->fault);
}

/* --- for programs ----------------------------------------------------------- */

static void monitor_json(const struct cmd_monitor *self)
{
    cJSON *report = cJSON_CreateObject(), *bus;
    unsigned n = 0;
    cJSON_AddNumberToObject(report, "t_s",
                            (double)(self->now_ns - self->start_ns) / 1e9);
    cJSON *axes = cJSON_AddArrayToObject(report, "axes");
    for (unsigned i = 0; i < self->live.rig->axis_count; i++)
        cJSON_AddItemToArray(axes,
                             machine_view_to_axis(&self->live.rig->axis[i],
                                                  &self->view.axis[i]));
    machine_view_to_ports(self->live.rig, &self->view, report);
    cJSON_ArrayForEach(bus, cJSON_GetObjectItem(report, "buses"))
    {
        cJSON_AddNumberToObject(bus, "load", self->load[n++]);
    }
    if (self->fault[0] != 0)
        cJSON_AddStringToObject(report, "fault", self->fault);
    json_print_line(report, stdout);
    putchar('\n');
}

/* --- the loop --------------------------------------------------------------- */

static void monitor_measure(struct cmd_monitor *self)
{
    const int64_t dur_ns = self->now_ns - self->shown_ns;
    for (unsigned i = 0; i < self->live.rig->bus_count && dur_ns > 0; i++) {
        const int64_t busy_ns = self->view.bus[i].busy_ns;
        /* what began before the last look counts when it ends */
        self->load[i] =
            fmin((double)(busy_ns - self->busy_ns[i]) / (double)dur_ns, 1);
        self->busy_ns[i] = busy_ns;
    }
    self->shown_ns = self->now_ns;
}

/* What the machine is about after its last tick. */
static void monitor_look(struct cmd_monitor *self)
{
    machine_view_axes(&self->live.machine, &self->view);
    machine_view_ports(&self->live.machine, &self->view);
    machine_fault_text(&self->live.machine, self->fault);
    self->now_ns = self->live.now_ns;
}

static void monitor_show(struct cmd_monitor *self)
{
    if (self->options->json)
        monitor_json(self);
    else
        monitor_print(self);
    fflush(stdout);
}

static bool monitor_all_there(const struct cmd_monitor *self)
{
    for (unsigned i = 0; i < self->live.rig->axis_count; i++)
        if (self->view.axis[i].drive == HAL_DRIVE_OFFLINE)
            return false;
    return true;
}

static void monitor_tick(struct cmd_monitor *self)
{
    live_tick(&self->live);
    machine_view_axes(&self->live.machine, &self->view);
    self->now_ns = self->live.now_ns;
}

/* One look: when every drive has been found and the buses had time for their
 * load, or not at all. */
static void monitor_once(struct cmd_monitor *self,
                         const volatile sig_atomic_t *interrupts)
{
    while (!monitor_all_there(self) && *interrupts == 0 &&
           self->now_ns - self->start_ns < MONITOR_WAIT_NS)
        monitor_tick(self);
    monitor_look(self);
    monitor_measure(self);
    for (int64_t until_ns = self->now_ns + self->every_ns;
         self->now_ns < until_ns && *interrupts == 0;)
        monitor_tick(self);
    monitor_look(self);
    monitor_measure(self);
    monitor_show(self);
}

static bool monitor_goes_on(const struct cmd_monitor *self,
                            const volatile sig_atomic_t *interrupts)
{
    return *interrupts == 0 && !ferror(stdout) &&
           (self->options->to_ns < 0 ||
            self->now_ns - self->start_ns < self->options->to_ns);
}

static void monitor_loop(struct cmd_monitor *self,
                         const volatile sig_atomic_t *interrupts)
{
    while (monitor_goes_on(self, interrupts)) {
        monitor_tick(self);
        if (self->now_ns - self->shown_ns < self->every_ns)
            continue;
        monitor_look(self);
        monitor_measure(self);
        monitor_show(self);
    }
}

/* --- where a service has the rig --- */

static bool monitor_is_plain(const struct options *options)
{
    return !options->pty && options->interface == NULL;
}

static enum status monitor_ask(struct cmd_monitor *self)
{
    const enum status status = served_look(&self->served);
    if (status != STATUS_OK)
        return status;
    machine_view_from(self->live.rig, self->served.status, &self->view);
    snprintf(self->fault, sizeof self->fault, "%s", self->served.fault);
    self->now_ns = llrint(1e9 * cJSON_GetNumberValue(cJSON_GetObjectItem(
                                    self->served.status, "t_s")));
    return STATUS_OK;
}

static void monitor_pause(int64_t dur_ns)
{
    const struct timespec pause = { .tv_sec = dur_ns / 1000000000,
                                    .tv_nsec = dur_ns % 1000000000 };
    (void)nanosleep(&pause, NULL); /* an interrupt cuts it short */
}

/* The first look is there for the load of the buses alone. */
static enum status monitor_served(struct cmd_monitor *self,
                                  const volatile sig_atomic_t *interrupts)
{
    enum status status = monitor_ask(self);
    self->start_ns = self->now_ns;
    monitor_measure(self);
    while (status == STATUS_OK && monitor_goes_on(self, interrupts)) {
        monitor_pause(self->every_ns);
        status = monitor_ask(self);
        if (status != STATUS_OK)
            break;
        monitor_measure(self);
        monitor_show(self);
        if (self->options->once)
            break;
    }
    return status;
}

/* --- the command --- */

static void monitor_reserve(struct cmd_monitor *self)
{
    const struct rig *rig = self->live.rig;
    machine_view_init(&self->view, rig, &self->memory);
    self->busy_ns =
        memory_pool_new(&self->memory, rig->bus_count, sizeof *self->busy_ns);
    self->load =
        memory_pool_new(&self->memory, rig->bus_count, sizeof *self->load);
}

static enum status cmd_monitor_open(struct cmd_monitor *self)
{
    const struct options *options = self->options;
    const bool is_plain = monitor_is_plain(options);
    enum status status = live_read(&self->live, options);
    if (status != STATUS_OK)
        return status;
    monitor_reserve(self);
    self->is_served = served_find(&self->served, options, "monitor", is_plain);
    if (self->is_served)
        return served_allow(&self->served, is_plain, "--interface");
    status = live_open(&self->live, options, !options->once);
    self->start_ns = self->now_ns = self->shown_ns = self->live.now_ns;
    if (status == STATUS_OK)
        machine_view_axes(&self->live.machine, &self->view);
    return status;
}

static enum status cmd_monitor_rig(struct cmd_monitor *self)
{
    enum status status = cmd_monitor_open(self);
    if (status != STATUS_OK)
        return status;
    const volatile sig_atomic_t *interrupts = interrupt_listen();
    if (self->is_served)
        status = monitor_served(self, interrupts);
    else if (self->options->once)
        monitor_once(self, interrupts);
    else
        monitor_loop(self, interrupts);
    live_leave(&self->live, interrupts);
    interrupt_listen_no_more();
    if (status != STATUS_OK)
        return status;
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
    self->served.link.file = -1;
    enum status status = cmd_monitor_rig(self);
    served_close(&self->served);
    live_close(&self->live);
    memory_pool_free(&self->memory);
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
        "Drives are simulated unless --real is given.  Where a service has "
        "the\n"
        "rig, what it reports is shown, and it goes on undisturbed.\n",
    .examples = "  slew monitor --real rig.yaml\n"
                "  slew monitor --once rig.yaml\n"
                "  slew monitor --json --rate 50 --for 10s --real rig.yaml\n",
    .path_max = 1,
    COMMAND_OPTIONS(cmd_monitor_option),
    .run = cmd_monitor_run,
};
