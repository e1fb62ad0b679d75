/* firmware/linux/commands/run/cmd_run.c - slew run: say what will happen, check,
 * move, report. */
#include <stdio.h>
#include <string.h>

#include "firmware/host/base/memory.h"
#include "firmware/host/base/number.h"
#include "firmware/host/job/budget.h"
#include "firmware/host/job/job.h"
#include "firmware/host/job/job_shots.h"
#include "firmware/host/track/compiled.h"
#include "firmware/linux/base/disk.h"
#include "firmware/linux/base/error.h"
#include "firmware/linux/base/interrupt.h"
#include "firmware/linux/base/output.h"
#include "firmware/linux/commands/command.h"
#include "firmware/linux/commands/picture.h"
#include "firmware/linux/commands/planning.h"
#include "firmware/linux/commands/run/live.h"
#include "firmware/linux/commands/run/run_intent.h"
#include "firmware/linux/commands/run/run_service.h"
#include "firmware/linux/commands/run/run_when.h"
#include "firmware/linux/machine/modbus_record.h"
#include "firmware/linux/player/player.h"
#include "firmware/linux/player/run_follow.h"

#define CMD_RUN_RESUME_NS INT64_C(1000000000) /* when not given */

/* Everything a run needs, in one piece: nothing is allocated while the bus is
 * live. */
struct cmd_run {
    const struct options *options;
    struct run_when when;
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
    struct run_follow follow;
    struct output csv, frames;
    struct run_record run_record;
    struct can_log can_log;
    struct modbus_record record; /* of the first Modbus bus */
    struct output pcap;
    struct fault_script script;
    struct machine_fault faults;
    struct loads loads;
};

/* --- may it happen? --- */

static enum status cmd_run_check(struct cmd_run *self)
{
    job_check(&self->job, self->when.rate_q30);
    if (self->job.violation_count > 0) {
        if (self->options->json)
            run_intent_json(&self->when, STATUS_REFUSED);
        else
            job_print_violations(&self->job, false, stdout);
        fflush(stdout);
        error_say("slew run: %u limit violation%s, nothing was moved",
                  self->job.violation_count,
                  number_word(self->job.violation_count, "", "s"));
        return STATUS_REFUSED;
    }
    const bool fits =
        job_shots_check(&self->job, self->when.rate_q30, &self->job.messages) &&
        budget_check(&self->job.rig, self->job.rig_path, &self->job.messages);
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
    job_summarise(&self->job);
    enum status status = live_ports(&self->live, self->options, &ports);
    if (status == STATUS_OK && self->options->faults != NULL &&
        machine_fault_init(&self->faults, &self->script, &self->live.sim) < 0)
        status = STATUS_SYSTEM;
    if (status == STATUS_OK && self->frames.file != NULL)
        can_log_init(&self->can_log, self->frames.file, &self->job.rig,
                     self->live.on_clock, &ports);
    if (status == STATUS_OK)
        status = cmd_run_record(self, &ports);
    if (status == STATUS_OK)
        status = live_build(&self->live, self->options, &ports);
    return status;
}

/* What goes wrong is simulated: on the wires and servos of virtual time or of
 * the clock, and nowhere else. */
static enum status cmd_run_faults(struct cmd_run *self)
{
    const struct options *options = self->options;
    char message[YAML_MESSAGE_MAX];
    if (options->faults == NULL)
        return STATUS_OK;
    if (options->real || options->pty) {
        error_say("slew run: --faults: %s",
                  options->real
                      ? "is for simulated drives, expected it without --real"
                      : "is for simulated buses, expected it without --pty");
        return STATUS_INPUT;
    }
    if (fault_script_load(&disk_files, options->faults, &self->job.rig,
                          &self->script, message) == 0)
        return STATUS_OK;
    error_say("%s", message);
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
                                      self->when.rate_q30);
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
    if (options->record != NULL) {
        if (run_record_open(&self->run_record, options->record) < 0)
            return STATUS_SYSTEM;
        if (!options->json)
            printf("recording: %s\n", options->record);
        fflush(stdout);
    }
    if (options->telemetry == NULL)
        return STATUS_OK;
    if (output_open(&self->csv, options->telemetry) < 0)
        return STATUS_SYSTEM;
    telemetry_init(&self->telemetry, self->csv.file, &self->job.rig,
                   options->faults != NULL);
    cmd_run_say_partial(self, &self->csv, "telemetry");
    return STATUS_OK;
}

/* Nobody waits at the end of a run on the clock for who does not read. */
static void cmd_run_begin_files(struct cmd_run *self, bool on_clock)
{
    struct player *player = &self->player;
    if (on_clock && self->options->telemetry != NULL)
        output_make_hasty(&self->csv);
    if (self->options->record == NULL)
        return;
    if (on_clock)
        output_make_hasty(&self->run_record.output);
    run_record_begin(&self->run_record, &self->job, &self->report,
                     on_clock ? self->live.machine.ports.clock : NULL,
                     player->start_ns);
}

static enum status cmd_run_no_keys(void)
{
    error_say("slew run: the shoot waits for the operator's keys before every "
              "frame, and there is no terminal to press them on");
    return STATUS_INPUT;
}

/* Is there anything to be said of what a simulation has beside its servos? */
static bool cmd_run_has_loads(const struct cmd_run *self)
{
    const struct rig *const rig = &self->job.rig;

    return self->live.sim.rig != NULL &&
           (self->live.sim.mechanics != NULL || rig->payload_count > 0 ||
            rig_trigger_count(rig) > 0);
}

/* A line of the rig as an input of the machine; NULL: none. */
static struct hal_gpio *cmd_run_line(struct cmd_run *self, int line)
{
    return line < 0 ? NULL : &self->live.machine.input[line].gpio;
}

static struct player_config cmd_run_config(struct cmd_run *self)
{
    const struct options *options = self->options;
    const struct run_when *when = &self->when;
    return (struct player_config){
        .realtime = run_when_is_on_clock(options),
        .override_q30 = when->play_q30,
        .from_ns_q12 = when->from_ns_q12,
        .times = when->times,
        .is_ping_pong = when->is_ping_pong,
        .hold_at_ns = when->hold_at_ns,
        .start_wall_ns = when->at_ns,
        .start_line = cmd_run_line(self, when->start_line),
        .resume_after_ns = options->resume_after_ns < 0
                               ? CMD_RUN_RESUME_NS
                               : options->resume_after_ns,
        .faults = options->faults != NULL ? &self->faults : NULL,
        .loads = cmd_run_has_loads(self) ? &self->loads : NULL,
        .follow = when->follow.kind != RUN_FOLLOW_NONE ? &self->follow : NULL,
    };
}

static struct player_observer cmd_run_observer(struct cmd_run *self,
                                               bool has_keys)
{
    const struct options *options = self->options;
    return (struct player_observer){
        .telemetry = options->telemetry != NULL ? &self->telemetry : NULL,
        .record = options->record != NULL ? &self->run_record : NULL,
        .can_log = options->can_log != NULL ? &self->can_log : NULL,
        .trace = options->plot != NULL ? &self->trace : NULL,
        .report = &self->report,
        .shots = &self->shots,
        .arrivals = &self->arrivals,
        .progress = &self->progress,
        .keys = has_keys ? &self->keys : NULL,
    };
}

static void cmd_run_begin_report(struct cmd_run *self,
                                 const struct player_config *config)
{
    report_init(&self->report, &self->job);
    shots_init(&self->shots, &self->job);
    arrivals_init(&self->arrivals, &self->job);
    self->report.arrivals = &self->arrivals;
    self->report.loads = config->loads;
    self->report.faults = config->faults;
    if (self->shots.count > 0)
        self->report.shots = &self->shots;
    if (self->job.steps.count > 0)
        self->report.step = &self->live.machine.step;
}

/* The keys of the operator, and the clock that is followed: *has_keys where the
 * terminal has them. */
static enum status cmd_run_begin_control(struct cmd_run *self,
                                         const struct player_config *config,
                                         bool *has_keys)
{
    const struct run_follow_config *follow = &self->when.follow;
    *has_keys = config->realtime && !self->options->json &&
                run_keys_begin(&self->keys, &self->job, self->when.play_q30,
                               config->follow != NULL);
    const int err = config->follow == NULL
                        ? 0
                        : run_follow_begin(&self->follow, follow,
                                           self->live.machine.ports.clock,
                                           cmd_run_line(self, follow->line));
    if (err != 0) {
        run_keys_end(&self->keys);
        (void)error_file(follow->path, strerror(err));
        return STATUS_SYSTEM;
    }
    if (self->job.steps.count == 0 || self->job.step_line != NULL || *has_keys)
        return STATUS_OK;
    run_keys_end(&self->keys);
    run_follow_end(&self->follow);
    return cmd_run_no_keys();
}

static enum status cmd_run_play(struct cmd_run *self)
{
    const struct player_config config = cmd_run_config(self);
    bool has_keys;
    if (config.loads != NULL)
        loads_init(&self->loads, &self->live.sim);
    const enum status status = cmd_run_begin_control(self, &config, &has_keys);
    if (status != STATUS_OK)
        return status;
    const struct player_observer observer =
        cmd_run_observer(self, has_keys || config.follow != NULL);
    cmd_run_begin_report(self, &config);
    progress_init(&self->progress, stderr, &self->job.rig,
                  self->job.end_ns_q12);
    player_init(&self->player, &self->live.machine, &self->job, &config,
                &observer);
    cmd_run_begin_files(self, config.realtime);
    const int err = player_run(&self->player, interrupt_listen());
    interrupt_listen_no_more();
    progress_end(&self->progress);
    run_keys_end(&self->keys);
    (void)run_follow_report(&self->follow, self->report.followed);
    run_follow_end(&self->follow);
    return err < 0 ? STATUS_SYSTEM : STATUS_OK;
}

static enum status cmd_run_save(struct cmd_run *self)
{
    const struct options *options = self->options;
    enum status status = STATUS_OK;
    if (options->record != NULL) {
        if (run_record_end(&self->run_record) < 0)
            status = STATUS_SYSTEM;
        else
            self->report.record_path = options->record;
        self->report.record_lost = self->run_record.record.rows_lost;
    }
    if (options->telemetry != NULL) {
        rows_end(&self->telemetry.rows);
        self->report.telemetry_lost = self->telemetry.rows.rows_lost;
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

/* Take the counts of the Modbus lines. */
static void cmd_run_lines(struct cmd_run *self)
{
    const struct rig *rig = &self->job.rig;
    struct hal_modbus **line = self->live.machine.ports.modbus;

    for (uint32_t i = 0; i < rig->bus_count; i++)
        if (!rig_bus_is_can(&rig->bus[i]))
            hal_modbus_stats(line[i], &self->report.bus[i].line);
}

static void cmd_run_report(struct cmd_run *self)
{
    (void)shutdown_say_torque(&self->live.machine);
    cmd_run_lines(self);
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
        run_intent_json(&self->when, status);
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
    status = run_when_read(&self->when, options, &self->job);
    if (status == STATUS_OK)
        status = cmd_run_faults(self);
    if (status != STATUS_OK)
        return status;
    if (!options->json)
        run_intent_print(&self->when);
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
        trace_init(&self->trace, &self->job.rig);
    return cmd_run_live(self);
}

static enum status cmd_run_run(const struct options *options)
{
    enum status served;
    if (run_service(options, &served))
        return served;
    struct cmd_run *self = memory_new(1, sizeof *self);
    self->options = options;
    enum status status = cmd_run_job(self);
    output_abandon(&self->csv);
    output_abandon(&self->frames);
    run_record_free(&self->run_record);
    output_abandon(&self->pcap);
    trace_free(&self->trace);
    shots_free(&self->shots);
    arrivals_free(&self->arrivals);
    live_close(&self->live);
    can_log_free(&self->can_log);
    player_free(&self->player);
    machine_fault_free(&self->faults);
    loads_free(&self->loads);
    report_free(&self->report);
    job_free(&self->job);
    memory_free(self);
    return status;
}

static const struct option_row cmd_run_option[] = {
    OPTIONS_DRY_RUN("say what would happen, check it (with --real also whether "
                    "drives answer), and stop there"),
    OPTIONS_REAL("move the real drives, on the interfaces of the rig"),
    OPTIONS_YES("do not prompt before real drives move"),
    OPTIONS_PORTS,
    { "telemetry", "FILE", OPTION_TEXT, offsetof(struct options, telemetry),
      "write what happened at every tick as CSV" },
    { "record", "FILE", OPTION_TEXT, offsetof(struct options, record),
      "record the run as MCAP, for slew report, Foxglove, PlotJuggler" },
    { "faults", "FILE", OPTION_TEXT, offsetof(struct options, faults),
      "let what this fault script says happen to the simulated drives" },
    { "can-log", "FILE", OPTION_TEXT, offsetof(struct options, can_log),
      "write every CAN frame as candump -L does" },
    { "modbus-log", "FILE", OPTION_TEXT, offsetof(struct options, modbus_log),
      "write what went over the first Modbus bus as pcap, for Wireshark" },
    { "plot", "FILE", OPTION_TEXT, offsetof(struct options, plot),
      "draw plan and run as .svg or .png" },
    { "override", "PERCENT", OPTION_PERCENT,
      offsetof(struct options, override_q30), "speed, 1 to 200 (100)" },
    { "at", "TIME", OPTION_TEXT, offsetof(struct options, at),
      "start the move then, such as 2026-11-23T21:00:00.5Z" },
    { "follow", "CLOCK", OPTION_TEXT, offsetof(struct options, follow),
      "keep to another clock: ltc:FILE, mtc:FILE, or a line of kind frame" },
    { "follow-at", "TIMECODE", OPTION_TEXT, offsetof(struct options, follow_at),
      "the timecode at which the move begins (00:00:00:00)" },
    { "on-edge", "LINE", OPTION_TEXT, offsetof(struct options, on_edge),
      "start the move when this line of kind start becomes active" },
    { "from", "TIME", OPTION_TEXT, offsetof(struct options, from),
      "begin at this move time, such as 2.5, f48 or 00:00:02:12" },
    { "loop", "N", OPTION_COUNT, offsetof(struct options, loop),
      "play the move N times; 0: until it is stopped" },
    { "ping-pong", NULL, OPTION_FLAG, offsetof(struct options, ping_pong),
      "every second time in reverse; without --loop there and back" },
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
        "it runs: space holds and resumes, r reverses along the path, b goes\n"
        "back to the start, g and a time go there, c says where the axes "
        "stand,\n"
        "+ and - change the speed by 10 %, 0 is 100 %, q stops along the "
        "path.\n\n"
        "--at starts the move at a time of the wall clock, to the tick, so "
        "that\n"
        "several controllers whose clocks agree start together.  Axes that "
        "are\n"
        "not ready by then are not moved.  A clock that is set meanwhile "
        "counts as\n"
        "it is then, and slew says so; one that is set past the start moves\n"
        "nothing.  --on-edge starts it when a line of the rig becomes active, "
        "the\n"
        "first time once the axes are ready.\n\n"
        "--follow keeps the move to another clock at its frame rate: it starts "
        "at\n"
        "--follow-at, or at the first pulse, and is played up to 2 % slower "
        "or\n"
        "faster so that it stays there; when the clock is lost or jumps, it "
        "is\n"
        "held.  LTC is mono 16-bit PCM at 48 kHz, such as a pipe that arecord\n"
        "writes to; MTC what a raw MIDI device such as /dev/snd/midiC1D0 "
        "says.\n\n"
        "Telemetry and frames are written to FILE.partial, whole rows once a\n"
        "second, and get their name at the end.  After a kill or on a full "
        "disk\n"
        "the partial file stays; the next run to FILE takes its place.\n"
        "A recording is only appended to, under its own name, and can be read\n"
        "at any time; one that is there is never replaced.\n\n" LIVE_HELP_STOP,
    .examples = "  slew run examples/dolly\n"
                "  slew run --telemetry run.csv --plot run.png examples/dolly\n"
                "  slew run --realtime --override 50 rig.yaml move.yaml\n"
                "  slew run --real --telemetry run.csv rig.yaml move.yaml\n"
                "  slew run --faults faults.yaml rig.yaml move.yaml\n"
                "  slew run --hold-at 5s --resume-after 2s examples/dolly\n"
                "  slew run --realtime --ping-pong --loop 0 examples/dolly\n"
                "  slew run --real --follow mtc:/dev/snd/midiC1D0 "
                "--follow-at 01:00:10:00 rig.yaml move.yaml\n",
    COMMAND_OPTIONS(cmd_run_option),
    .run = cmd_run_run,
};
