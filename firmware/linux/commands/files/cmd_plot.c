/* firmware/linux/commands/files/cmd_plot.c - slew plot: a move, or a run of it, as a
 * picture. */
#include <stdio.h>

#include "firmware/host/base/memory.h"
#include "firmware/host/base/number.h"
#include "firmware/host/job/compare.h"
#include "firmware/host/job/job.h"
#include "firmware/host/recording/mcap_reader.h"
#include "firmware/host/recording/record_files.h"
#include "firmware/host/recording/telemetry.h"
#include "firmware/host/recording/trace.h"
#include "firmware/linux/base/disk.h"
#include "firmware/linux/base/error.h"
#include "firmware/linux/base/json_print.h"
#include "firmware/linux/commands/command.h"
#include "firmware/linux/commands/files/plot_payload.h"
#include "firmware/linux/commands/picture.h"
#include "firmware/linux/commands/planning.h"
#include "motion/core/fixed.h"

static enum status cmd_plot_fail(const char *what)
{
    error_say("slew plot: %s", what);
    return STATUS_INPUT;
}

/* Telemetry on its way into a trace, held against the move. */
struct cmd_plot_reader {
    const struct job *job;
    struct trace *trace;
    struct motion_cursor *cursor; /* of the move's axes */
    int other; /* the axis that another move played, -1: none */
    int64_t at_ns_q12;
};

/* During a move every demand is the track at the path time of the row. */
static bool cmd_plot_is_other(struct cmd_plot_reader *self, unsigned i,
                              const struct telemetry_row *row)
{
    const struct job *job = self->job;
    const struct rig_axis *axis = job_rig_axis(job, i);
    struct motion_sample sample;
    uint64_t off;
    if (job->compiled != NULL || axis->point_to_point)
        return false;
    motion_track_sample(&job->track[i], &self->cursor[i], row->rate.s_ns_q12,
                        &sample);
    off = motion_fixed_abs(row->axis[job->rig_axis[i]].demand.pos_q32 -
                           sample.pos_q32);
    return off > (uint64_t)axis->following_floor_q32;
}

static void cmd_plot_take(void *context, const struct telemetry_row *row)
{
    struct cmd_plot_reader *self = context;
    for (unsigned i = 0; self->other < 0 && i < self->job->move.axis_count &&
                         row->phase == TELEMETRY_MOVE;
         i++)
        if (cmd_plot_is_other(self, i, row)) {
            self->other = (int)i;
            self->at_ns_q12 = row->rate.s_ns_q12;
        }
    trace_take(self->trace, row);
}

/* A recording, or telemetry as CSV. */
static int cmd_plot_read(struct cmd_plot_reader *self, const char *path,
                         char message[YAML_MESSAGE_MAX])
{
    const struct record_taker taker = { .row = cmd_plot_take, .context = self };
    const struct rig *rig = &self->job->rig;
    struct record_file file;
    if (!mcap_reader_is_mcap(&disk_files, path))
        return telemetry_read(&disk_files, path, rig, cmd_plot_take, self,
                              message);
    const int err = record_read(&file, &disk_files, path, rig, &taker, message);
    record_file_free(&file);
    return err;
}

static enum status cmd_plot_trace(const struct job *job, const char *path,
                                  struct trace *trace)
{
    struct cmd_plot_reader self = {
        .job = job,
        .trace = trace,
        .cursor = memory_new((size_t)job->move.axis_count + 1,
                             sizeof(struct motion_cursor)),
        .other = -1,
    };
    char message[YAML_MESSAGE_MAX], at[NUMBER_MAX];
    const int err = cmd_plot_read(&self, path, message);
    memory_free(self.cursor);
    if (err < 0) {
        error_say("%s", message);
        return STATUS_INPUT;
    }
    if (trace->count == 0)
        return error_file(path,
                          "holds no move, expected telemetry of slew run");
    if (self.other < 0)
        return STATUS_OK;
    number_seconds(at, self.at_ns_q12);
    snprintf(message, sizeof message,
             "axis %s is not where this move has it at %s s, expected the "
             "telemetry of a run of %.300s",
             job->move.axis[self.other].name, at, job->move_path);
    return error_file(path, message);
}

static void cmd_plot_report(const char *path, bool json)
{
    if (!json) {
        printf("picture: %s\n", path);
        return;
    }
    cJSON *report = cJSON_CreateObject();
    cJSON_AddStringToObject(report, "picture", path);
    json_report(report, true);
}

static enum status cmd_plot_space(const struct job *job,
                                  const struct options *options)
{
    struct plan_rig rig;
    const bool has_camera = job_camera_rig(job, &rig);
    if (options->film && job->rig.payload_count == 0) {
        error_say("%s: no axis carries anything, expected payload",
                  job->rig_path);
        return STATUS_INPUT;
    }
    if (options->film || (!has_camera && job->rig.payload_count > 0))
        return plot_payload(job, options);
    if (!has_camera) {
        error_say("%s: says nothing of where the camera is, expected "
                  "kinematics, payload, or a move with a path and a camera on "
                  "it",
                  job->rig_path);
        return STATUS_INPUT;
    }
    enum status status = STATUS_OK;
    if (job->rig.payload_count > 0)
        status = plot_payload_space(job, &rig, options->out);
    else if (picture_of_space(job, NULL, options->out) < 0)
        status = STATUS_SYSTEM;
    if (status == STATUS_OK)
        cmd_plot_report(options->out, options->json);
    return status;
}

/* A recording has its rig and its move in it. */
static enum status cmd_plot_recording(struct job *job, struct trace *trace,
                                      struct record_files *files,
                                      const struct options *options)
{
    char message[YAML_MESSAGE_MAX];
    enum status status = STATUS_INPUT;
    if (options->compare != NULL || options->telemetry != NULL ||
        options->space || options->film)
        status = cmd_plot_fail("a recording has its move in it, expected RIG "
                               "MOVE for --compare, --telemetry, --space and "
                               "--film");
    else if (record_files_open(files, &disk_files, options->path[0], message) <
             0)
        error_say("%s", message);
    else
        status = planning_open_files(job, &files->files, files->kept[0].path,
                                     files->kept[1].path);
    if (status == STATUS_OK) {
        trace_init(trace, &job->rig);
        status = cmd_plot_trace(job, options->path[0], trace);
    }
    if (status == STATUS_OK && picture_of_job(job, trace, options->out) < 0)
        status = STATUS_SYSTEM;
    if (status == STATUS_OK)
        cmd_plot_report(options->out, options->json);
    return status;
}

static enum status cmd_plot_job(struct job *job, struct trace *trace,
                                struct record_files *files,
                                const struct options *options)
{
    if (options->path_count == 1 &&
        mcap_reader_is_mcap(&disk_files, options->path[0]))
        return cmd_plot_recording(job, trace, files, options);
    enum status status = planning_open(job, options->path, options->path_count,
                                       options->compare == NULL &&
                                           !options->space && !options->film);
    if (status == STATUS_OK && options->compare != NULL)
        status = compare_job(job, options->compare, options->axis);
    error_tell(&job->messages);
    if (status != STATUS_OK)
        return status;
    if (options->space || options->film)
        return cmd_plot_space(job, options);
    bool traced = options->telemetry != NULL;
    if (traced) {
        trace_init(trace, &job->rig);
        status = cmd_plot_trace(job, options->telemetry, trace);
    }
    if (status != STATUS_OK)
        return status;
    if (picture_of_job(job, traced ? trace : NULL, options->out) < 0)
        return STATUS_SYSTEM;
    cmd_plot_report(options->out, options->json);
    return STATUS_OK;
}

static enum status cmd_plot_run(const struct options *options)
{
    if (options->out == NULL || plot_format_of(options->out) < 0)
        return cmd_plot_fail("where to? expected --out FILE.svg or FILE.png");
    if (options->compare != NULL && options->telemetry != NULL)
        return cmd_plot_fail(
            "--compare: not with --telemetry, as a run has one "
            "curve");
    if ((options->space || options->film) &&
        (options->compare != NULL || options->telemetry != NULL))
        return cmd_plot_fail(
            "--space, --film: not with --compare or --telemetry, "
            "which are of curves over time");
    if (options->axis != NULL && options->compare == NULL)
        return cmd_plot_fail(
            "--axis is for --compare, expected --compare CURVE "
            "with it");
    struct job *job = memory_new(1, sizeof *job);
    struct trace *trace = memory_new(1, sizeof *trace);
    struct record_files *files = memory_new(1, sizeof *files);
    enum status status = cmd_plot_job(job, trace, files, options);
    trace_free(trace);
    job_free(job);
    record_files_free(files);
    memory_free(files);
    memory_free(trace);
    memory_free(job);
    return status;
}

static const struct option_row cmd_plot_option[] = {
    { "out", "FILE", OPTION_TEXT, offsetof(struct options, out),
      "the picture, .svg or .png by its name" },
    { "telemetry", "FILE", OPTION_TEXT, offsetof(struct options, telemetry),
      "CSV or MCAP of slew run: draw what the servos did, too" },
    { "compare", "CURVES", OPTION_TEXT, offsetof(struct options, compare),
      "the same keys under these curves, or all: linear,quintic" },
    { "axis", "NAME", OPTION_TEXT, offsetof(struct options, axis),
      "with --compare: whose keys" },
    { "space", NULL, OPTION_FLAG, offsetof(struct options, space),
      "where the camera goes, how it looks and what it sees, with what axes "
      "carry; without a camera, what axes carry in twelve moments" },
    { "film", NULL, OPTION_FLAG, offsetof(struct options, film),
      "what axes carry, moving: an .svg that plays, or .png after .png" },
    OPTIONS_COMMON,
};

const struct command cmd_plot = {
    .name = "plot",
    .arguments = "RIG MOVE | DIRECTORY | RECORDING",
    .summary = "draw position, velocity, acceleration and jerk",
    .text =
        "Draws one column per axis: position, velocity, acceleration and jerk\n"
        "against time, with the keys and with what lies beyond a limit "
        "shaded.\n"
        "With telemetry also what the servo did, and the following error; a\n"
        "recording of slew run has the move in it and needs nothing else.\n"
        "With --compare one column per kind of curve, on common scales; what\n"
        "a key gives and a curve does not take is left out.  docs/GALLERY.md\n"
        "shows every kind.  MOVE may be a compiled one, which has no keys\n"
        "(slew compile).  With --space the camera from above, from the side\n"
        "and at a slant: of a rig with kinematics, or on a path.  What axes\n"
        "carry (payload) is simulated along the move and for 2 s after it.\n",
    .examples = "  slew plot --out dolly.svg examples/dolly\n"
                "  slew plot --out run.png --telemetry run.csv rig.yaml "
                "move.yaml\n"
                "  slew plot --out run.png run.mcap\n"
                "  slew plot --out pan.svg --compare linear,quintic --axis pan "
                "examples/dolly\n"
                "  slew plot --space --out orbit.svg examples/orbit\n"
                "  slew plot --film --out payload.svg examples/payload\n",
    COMMAND_OPTIONS(cmd_plot_option),
    .run = cmd_plot_run,
};
