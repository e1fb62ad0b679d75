/* firmware/linux/commands/cmd_run.c - slew run: say what will happen, check,
 * move, report. */
#include <stdio.h>
#include <string.h>

#include "firmware/host/base/memory.h"
#include "firmware/host/base/number.h"
#include "firmware/host/base/table.h"
#include "firmware/host/move/budget.h"
#include "firmware/host/move/compiled.h"
#include "firmware/host/move/job.h"
#include "firmware/host/rig/modbus_budget.h"
#include "firmware/linux/base/error.h"
#include "firmware/linux/base/interrupt.h"
#include "firmware/linux/base/json_print.h"
#include "firmware/linux/base/output.h"
#include "firmware/linux/commands/command.h"
#include "firmware/linux/commands/live.h"
#include "firmware/linux/commands/picture.h"
#include "firmware/linux/commands/planning.h"
#include "firmware/linux/machine/modbus_record.h"
#include "firmware/linux/machine/player.h"
#include "motion/core/clock_warp.h"
#include "motion/core/fixed.h"

#define CMD_RUN_RESUME_NS INT64_C(1000000000) /* when not given */

/* Everything a run needs, in one piece: nothing is allocated while the bus is
 * live. */
struct cmd_run {
    const struct options *options;
    int64_t rate_q30;
    int64_t hold_at_ns; /* -1: never */
    struct job job;
    struct live live;
    struct player player;
    struct telemetry telemetry;
    struct trace trace;
    struct report report;
    struct shots shots;
    struct arrivals arrivals;
    struct progress progress;
    struct run_keys keys;
    struct output csv, frames;
    struct can_log can_log;
    struct modbus_record record; /* of the first Modbus bus */
    struct output pcap;
};

/* --- what will happen --- */

static void cmd_run_margin(struct table *table, const struct cmd_run *self,
                           unsigned axis, enum motion_quantity quantity)
{
    struct plan_limit limit;
    job_limit_at(&job_rig_axis(&self->job, axis)->limit, self->rate_q30,
                 &limit);
    int64_t most = job_limit_of(&limit, quantity);
    int64_t peak = job_peak(&self->job.track[axis], quantity, NULL);
    if (most == 0)
        table_cell(table, "no limit");
    else
        table_cell(table, "%d %%", (int)number_percent(peak, most));
}

static void cmd_run_intent_row(struct table *table, const struct cmd_run *self,
                               unsigned i)
{
    const struct motion_track *track = &self->job.track[i];
    const struct rig_axis *rig = job_rig_axis(&self->job, i);
    struct motion_sample first;
    struct motion_cursor cursor = { 0 };
    char text[NUMBER_MAX];
    motion_track_sample(track, &cursor, 0, &first);
    table_cell(table, "%s", rig->name);
    number_short(text, first.pos_q32, 32);
    table_cell(table, "%s", text);
    number_short(text, track->end.pos_q32, 32);
    table_cell(table, "%s", text);
    table_cell(table, "%s", units_axis_text(rig->unit));
    const struct plan_axis *axis = &self->job.move.axis[i];
    if (self->job.compiled != NULL)
        table_cell(table, "%u", self->job.compiled->file.axis[i].keys);
    else if (axis->driver == PLAN_BY_KEYS)
        table_cell(table, "%u", axis->key_count);
    else
        table_cell(table, "-");
    cmd_run_margin(table, self, i, MOTION_VEL);
    cmd_run_margin(table, self, i, MOTION_ACC);
    cmd_run_margin(table, self, i, MOTION_JERK);
    table_cell(table, "%s", self->job.rig.bus[rig->bus].name);
    table_cell(table, "%u", rig->node_id);
}

static void cmd_run_intent_table(const struct cmd_run *self)
{
    static const char *const head[] = {
        "<axis",     ">from",         ">to",   "<unit", ">keys",
        ">velocity", ">acceleration", ">jerk", "<bus",  ">node",
    };
    struct table table;
    table_init(&table, 10, head);
    for (unsigned i = 0; i < self->job.move.axis_count; i++)
        cmd_run_intent_row(&table, self, i);
    table_print(&table, stdout);
    table_free(&table);
}

/* At the override; saturates. */
static int64_t cmd_run_duration(const struct cmd_run *self)
{
    int64_t dur_ns_q12;
    if (motion_fixed_muldiv(self->job.end_ns_q12, MOTION_CLOCK_WARP_ONE_Q30,
                            self->rate_q30, &dur_ns_q12) < 0)
        return INT64_MAX;
    return dur_ns_q12;
}

static const char *cmd_run_drives(const struct cmd_run *self)
{
    if (self->options->real)
        return "REAL drives";
    if (self->options->pty)
        return "simulated drives in real time, Modbus by libmodbus";
    return self->options->realtime ? "simulated drives in real time"
                                   : "simulated drives in virtual time";
}

static void cmd_run_port(const struct rig_bus *bus)
{
    if (bus->kind == RIG_MODBUS_TCP)
        printf(", %s port %u", bus->modbus.host, bus->modbus.port);
    else if (bus->kind == RIG_MODBUS_RTU)
        printf(", %s", bus->modbus.device);
    else
        printf(", interface %s",
               bus->interface[0] != 0 ? bus->interface : "not given");
}

static void cmd_run_bus(const struct cmd_run *self, unsigned i)
{
    const struct rig_bus *bus = &self->job.rig.bus[i];
    struct budget budget;
    budget_of(&self->job.rig, i, NULL, &budget);
    printf("%s: %u kbit/s, at most %.1f %% in use", bus->name,
           bus->bit_rate / 1000, 100 * budget.most);
    if (self->options->real)
        cmd_run_port(bus);
    putchar('\n');
    if (!rig_bus_is_can(bus))
        modbus_budget_print(&self->job.rig, i, stdout);
}

static void cmd_run_intent(const struct cmd_run *self)
{
    const struct job *job = &self->job;
    char duration[NUMBER_MAX], period[NUMBER_MAX], percent[NUMBER_MAX];
    number_seconds(duration, cmd_run_duration(self));
    number_short(percent, 100 * self->rate_q30, 30);
    number_short(period, job->rig.period_ns * 4096 / 1000000, 12);
    printf("%s%s%s\n", job->move.title, job->move.title[0] ? " - " : "",
           job->rig.title);
    printf("%u %s, %s s at %s %% speed, a set point every %s ms, %s\n\n",
           job->move.axis_count,
           number_word(job->move.axis_count, "axis", "axes"), duration, percent,
           period, cmd_run_drives(self));
    cmd_run_intent_table(self);
    fputs("\nlimits: how much of each the move uses at its peak\n", stdout);
    for (unsigned i = 0; i < job->rig.bus_count; i++)
        cmd_run_bus(self, i);
    shots_plan_print(job, stdout);
    fputs("first every axis goes to its first key at a quarter of its limits\n",
          stdout);
    fflush(stdout);
}

static void cmd_run_intent_json(const struct cmd_run *self, enum status status)
{
    const struct job *job = &self->job;
    cJSON *report = cJSON_CreateObject();
    cJSON_AddBoolToObject(report, "ok", status == STATUS_OK);
    cJSON_AddStringToObject(report, "title", job->move.title);
    cJSON_AddNumberToObject(report, "duration_s",
                            number_double(cmd_run_duration(self), 12) / 1e9);
    job_json_violations(job, report);
    budget_json(&job->rig, NULL, report);
    json_print(report, stdout);
}

/* --- may it happen? --- */

static enum status cmd_run_check(struct cmd_run *self)
{
    job_check(&self->job, self->rate_q30);
    if (self->job.violation_count > 0) {
        if (self->options->json)
            cmd_run_intent_json(self, STATUS_REFUSED);
        else
            job_print_violations(&self->job, stdout);
        fflush(stdout);
        error_say("slew run: %u limit violation%s, nothing was moved",
                  self->job.violation_count,
                  number_word(self->job.violation_count, "", "s"));
        return STATUS_REFUSED;
    }
    if (!shots_check(&self->job, self->rate_q30))
        return STATUS_REFUSED;
    const bool fits = budget_check(&self->job);
    error_tell(&self->job.messages);
    return fits ? STATUS_OK : STATUS_REFUSED;
}

/* --- doing it --- */

/* The first Modbus bus is recorded. */
static enum status cmd_run_record(struct cmd_run *self,
                                  struct machine_ports *ports)
{
    const struct rig *rig = &self->job.rig;
    unsigned i = 0;
    if (self->options->modbus_log == NULL)
        return STATUS_OK;
    while (i < rig->bus_count && rig_bus_is_can(&rig->bus[i]))
        i++;
    if (i == rig->bus_count) {
        error_say(
            "slew run: --modbus-log: the rig has no Modbus bus, expected a rig "
            "with one");
        return STATUS_INPUT;
    }
    modbus_record_init(&self->record, ports->modbus[i],
                       rig->bus[i].kind == RIG_MODBUS_TCP);
    ports->modbus[i] = &self->record.modbus;
    return output_open(&self->pcap, self->options->modbus_log) < 0
               ? STATUS_SYSTEM
               : STATUS_OK;
}

static enum status cmd_run_build(struct cmd_run *self)
{
    struct machine_ports ports;
    enum status status = live_ports(&self->live, self->options, &ports);
    if (status == STATUS_OK && self->frames.file != NULL)
        can_log_init(&self->can_log, self->frames.file, &self->job.rig,
                     self->live.on_clock, &ports);
    if (status == STATUS_OK)
        status = cmd_run_record(self, &ports);
    if (status == STATUS_OK)
        status = live_build(&self->live, self->options, &ports);
    return status;
}

/* Of the move, in seconds or frames of it; nowhere else is there anything to
 * hold. */
static enum status cmd_run_hold(struct cmd_run *self)
{
    const struct options *options = self->options;
    const struct units_context units = {
        .fps = { self->job.move.fps_num, self->job.move.fps_den },
    };
    char sentence[UNITS_SENTENCE_MAX], end[NUMBER_MAX];
    int64_t t_ns_q12;
    self->hold_at_ns = -1;
    if (options->hold_at == NULL && options->resume_after_ns < 0)
        return STATUS_OK;
    if (options->hold_at == NULL) {
        error_say("slew run: --resume-after is for a hold, expected --hold-at "
                  "TIME with it");
        return STATUS_INPUT;
    }
    if (units_parse(options->hold_at, UNITS_TIME, &units, &t_ns_q12, sentence) <
        0) {
        error_say("slew run: --hold-at: %s", sentence);
        return STATUS_INPUT;
    }
    if (t_ns_q12 >= 0 && t_ns_q12 < self->job.end_ns_q12) {
        self->hold_at_ns = t_ns_q12 / MOTION_FIXED_NS_Q12;
        return STATUS_OK;
    }
    number_seconds(end, self->job.end_ns_q12);
    error_say("slew run: --hold-at: '%s' is not within the move, expected a "
              "move time from 0 s to before its end at %s s",
              options->hold_at, end);
    return STATUS_INPUT;
}

/* A window must always reach as far as a stop may need, and twice that so that
 * reading ahead has time. */
static enum status cmd_run_window(const struct cmd_run *self)
{
    const struct job *job = &self->job;
    const struct motion_track *track[CONTROLLER_AXES_MAX] = { NULL };
    char what[256], least[NUMBER_MAX], need[NUMBER_MAX];
    if (job->compiled == NULL)
        return STATUS_OK;
    for (unsigned i = 0; i < job->move.axis_count; i++)
        track[job->rig_axis[i]] = &job->track[i];
    const int64_t need_ns_q12 =
        2 * controller_reserve_ns_q12(&self->live.machine.controller, track,
                                      self->rate_q30);
    if (job->compiled->least_ns_q12 >= need_ns_q12)
        return STATUS_OK;
    number_seconds(least, job->compiled->least_ns_q12);
    number_seconds(need, need_ns_q12);
    snprintf(what, sizeof what,
             "%d segments last %s s somewhere, expected %s s to be able to "
             "stop: run the move file itself",
             TRACK_STREAM_PLAY, least, need);
    error_file(job->move_path, what);
    return STATUS_REFUSED;
}

/* What a run wrote is worth having, however it ends. */
static void cmd_run_say_partial(const struct cmd_run *self,
                                struct output *output, const char *what)
{
    output->keep = true;
    if (!self->options->json && output->partial[0] != 0)
        printf("%s: %s until the end\n", what, output->partial);
    fflush(stdout);
}

static enum status cmd_run_files(struct cmd_run *self)
{
    const struct options *options = self->options;
    if (options->plot != NULL && plot_format_of(options->plot) < 0) {
        error_say("slew run: --plot %s: expected a name that ends in "
                  ".svg or .png",
                  options->plot);
        return STATUS_INPUT;
    }
    /* What could not be written is said before anything moves. */
    if (options->plot != NULL) {
        if (output_open(&self->csv, options->plot) < 0)
            return STATUS_SYSTEM;
        output_abandon(&self->csv);
    }
    if (options->telemetry == NULL)
        return STATUS_OK;
    if (output_open(&self->csv, options->telemetry) < 0)
        return STATUS_SYSTEM;
    telemetry_init(&self->telemetry, self->csv.file, &self->job.rig);
    cmd_run_say_partial(self, &self->csv, "telemetry");
    return STATUS_OK;
}

static enum status cmd_run_play(struct cmd_run *self)
{
    const struct options *options = self->options;
    const struct player_config config = {
        .realtime = options->realtime || options->real || options->pty,
        .patient = options->real,
        .override_q30 = self->rate_q30,
        .hold_at_ns = self->hold_at_ns,
        .resume_after_ns = options->resume_after_ns < 0
                               ? CMD_RUN_RESUME_NS
                               : options->resume_after_ns,
    };
    const bool has_keys =
        config.realtime && !options->json &&
        run_keys_begin(&self->keys, &self->job, self->rate_q30);
    const struct player_observer observer = {
        .telemetry = options->telemetry != NULL ? &self->telemetry : NULL,
        .can_log = options->can_log != NULL ? &self->can_log : NULL,
        .trace = options->plot != NULL ? &self->trace : NULL,
        .report = &self->report,
        .shots = &self->shots,
        .arrivals = &self->arrivals,
        .progress = &self->progress,
        .keys = has_keys ? &self->keys : NULL,
    };
    report_init(&self->report, &self->job);
    shots_init(&self->shots, &self->job);
    arrivals_init(&self->arrivals, &self->job);
    self->report.arrivals = &self->arrivals;
    if (self->shots.count > 0)
        self->report.shots = &self->shots;
    progress_init(&self->progress, stderr, self->job.end_ns_q12);
    player_init(&self->player, &self->live.machine, &self->job, &config,
                &observer);
    int err = player_run(&self->player, interrupt_listen());
    interrupt_listen_no_more();
    progress_end(&self->progress);
    run_keys_end(&self->keys);
    return err < 0 ? STATUS_SYSTEM : STATUS_OK;
}

static enum status cmd_run_save(struct cmd_run *self)
{
    const struct options *options = self->options;
    enum status status = STATUS_OK;
    if (options->telemetry != NULL) {
        if (output_commit(&self->csv) < 0)
            status = STATUS_SYSTEM;
        else
            self->report.telemetry_path = options->telemetry;
    }
    if (options->can_log != NULL) {
        if (output_commit(&self->frames) < 0)
            status = STATUS_SYSTEM;
        else
            self->report.can_log_path = options->can_log;
        self->report.frames_dropped = self->can_log.dropped;
    }
    if (options->modbus_log != NULL) {
        modbus_record_write(&self->record, self->pcap.file);
        if (output_commit(&self->pcap) < 0)
            status = STATUS_SYSTEM;
    }
    if (options->plot != NULL && self->report.started) {
        if (picture_of_job(&self->job, &self->trace, options->plot) < 0)
            status = STATUS_SYSTEM;
        else
            self->report.plot_path = options->plot;
    }
    return status;
}

static enum status cmd_run_end(const struct report *report)
{
    if (report->torque_left)
        return STATUS_REFUSED;
    switch (report->end) {
    case REPORT_DONE:
        return STATUS_OK;
    case REPORT_FAULT:
        return STATUS_REFUSED;
    case REPORT_STOPPED:
    case REPORT_QUICK_STOPPED:
        break;
    }
    return STATUS_INTERRUPTED;
}

static void cmd_run_report(struct cmd_run *self)
{
    report_torque(&self->report, stderr);
    if (self->options->json) {
        report_json(&self->report, stdout);
        return;
    }
    putchar('\n');
    report_print(&self->report, stdout);
    machine_modbus_print(&self->live.pty, &self->job.rig, stdout);
    machine_modbus_print(&self->live.real.modbus, &self->job.rig, stdout);
}

static enum status cmd_run_live(struct cmd_run *self)
{
    enum status status = cmd_run_play(self);
    if (status != STATUS_OK)
        return status;
    status = cmd_run_save(self);
    cmd_run_report(self);
    return status == STATUS_OK ? cmd_run_end(&self->report) : status;
}

/* What it would do, and what can be known of how it would end. */
static enum status cmd_run_dry(struct cmd_run *self)
{
    enum status status = live_dry_run(&self->live, self->options);
    if (status == STATUS_OK && self->options->real)
        status = cmd_run_window(self);
    if (self->options->json)
        cmd_run_intent_json(self, status);
    return status;
}

static enum status cmd_run_job(struct cmd_run *self)
{
    const struct options *options = self->options;
    enum status status =
        planning_open(&self->job, options->path, options->path_count, true);
    if (status != STATUS_OK)
        return status;
    status = live_use(&self->live, options, &self->job.rig);
    if (status != STATUS_OK)
        return status;
    status = cmd_run_hold(self);
    if (status != STATUS_OK)
        return status;
    if (!options->json)
        cmd_run_intent(self);
    status = cmd_run_check(self);
    if (status != STATUS_OK)
        return status;
    if (options->dry_run)
        return cmd_run_dry(self);
    status = live_confirm(&self->live, options, "run");
    if (status != STATUS_OK)
        return status;
    if (options->can_log != NULL) {
        if (output_open(&self->frames, options->can_log) < 0)
            return STATUS_SYSTEM;
        cmd_run_say_partial(self, &self->frames, "frames");
    }
    status = cmd_run_build(self);
    if (status == STATUS_OK)
        status = cmd_run_window(self);
    if (status == STATUS_OK)
        status = cmd_run_files(self);
    if (status != STATUS_OK)
        return status;
    if (options->plot != NULL)
        trace_init(&self->trace, self->job.rig.axis_count);
    return cmd_run_live(self);
}

static enum status cmd_run_run(const struct options *options)
{
    struct cmd_run *self = memory_new(1, sizeof *self);
    self->options = options;
    self->rate_q30 = options->override_q30;
    enum status status = cmd_run_job(self);
    output_abandon(&self->csv);
    output_abandon(&self->frames);
    output_abandon(&self->pcap);
    trace_free(&self->trace);
    shots_free(&self->shots);
    arrivals_free(&self->arrivals);
    live_close(&self->live);
    can_log_free(&self->can_log);
    player_free(&self->player);
    report_free(&self->report);
    job_free(&self->job);
    memory_free(self);
    return status;
}

static const struct option_row cmd_run_option[] = {
    OPTIONS_DRY_RUN("say what would happen, check it (with --real also whether "
                    "drives answer), and stop there"),
    OPTIONS_REAL("move the real drives, on the interfaces of the rig"),
    OPTIONS_YES("do not ask before real drives move"),
    OPTIONS_PORTS,
    { "telemetry", "FILE", OPTION_TEXT, offsetof(struct options, telemetry),
      "write what happened at every tick as CSV" },
    { "can-log", "FILE", OPTION_TEXT, offsetof(struct options, can_log),
      "write every CAN frame as candump -L does" },
    { "modbus-log", "FILE", OPTION_TEXT, offsetof(struct options, modbus_log),
      "write what went over the first Modbus bus as pcap, for Wireshark" },
    { "plot", "FILE", OPTION_TEXT, offsetof(struct options, plot),
      "draw plan and run as .svg or .png" },
    { "override", "PERCENT", OPTION_PERCENT,
      offsetof(struct options, override_q30), "speed, 1 to 200 (100)" },
    { "hold-at", "TIME", OPTION_TEXT, offsetof(struct options, hold_at),
      "feed hold at this move time, such as 2.5, 250ms or f48" },
    { "resume-after", "TIME", OPTION_TIME,
      offsetof(struct options, resume_after_ns),
      "go on after standing for this long (1 s)" },
    OPTIONS_COMMON,
};

const struct command cmd_run = {
    .name = "run",
    .arguments = "RIG MOVE | DIRECTORY",
    .summary = "run a move on simulated drives, or --real ones",
    .text =
        "Says what it will do, checks the move against all limits, enables "
        "the\n"
        "drives, takes every axis to its first key, runs the move, and "
        "reports\n"
        "per axis what was reached.  A move that breaks a limit is not run:\n"
        "nothing is sent to the bus.  MOVE may be a compiled one: it is read\n"
        "as it is played (slew compile).\n\n"
        "Drives are simulated unless --real is given: then the buses are the\n"
        "CAN interfaces, serial devices and hosts that the rig names, and\n"
        "things move.  --dry-run says what would happen, with --real also\n"
        "whether the drives are there.\n\n"
        "On the clock (--real, --realtime) the keys of the terminal work "
        "while\n"
        "it runs: space holds and resumes, + and - change the speed by 10 %,\n"
        "0 is 100 %, q stops along the path.\n\n"
        "Telemetry and frames are written to FILE.partial, whole rows once a\n"
        "second, and get their name at the end.  After a kill or on a full "
        "disk\n"
        "the partial file stays; the next run to FILE takes its "
        "place.\n\n" LIVE_HELP_STOP,
    .examples = "  slew run examples/dolly\n"
                "  slew run --telemetry run.csv --plot run.png examples/dolly\n"
                "  slew run --realtime --override 50 rig.yaml move.yaml\n"
                "  slew run --real --telemetry run.csv rig.yaml move.yaml\n"
                "  slew run --hold-at 5s --resume-after 2s examples/dolly\n",
    COMMAND_OPTIONS(cmd_run_option),
    .run = cmd_run_run,
};
