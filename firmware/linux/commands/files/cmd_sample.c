/* firmware/linux/commands/files/cmd_sample.c - slew sample: a move as numbers.
 *
 * Sample k is at k / rate, computed from k each time and rounded to the
 * nanosecond: nothing is added up, so rates that share a time share a sample,
 * to the bit, however long the move. */
#include <inttypes.h>
#include <math.h>
#include <stdio.h>

#include "firmware/host/base/array.h"
#include "firmware/host/base/json.h"
#include "firmware/host/base/memory.h"
#include "firmware/host/base/number.h"
#include "firmware/host/base/quote.h"
#include "firmware/host/job/job.h"
#include "firmware/host/job/job_camera.h"
#include "firmware/host/track/compiled.h"
#include "firmware/linux/base/error.h"
#include "firmware/linux/commands/command.h"
#include "firmware/linux/commands/planning.h"
#include "motion/core/err.h"
#include "motion/core/fixed.h"
#include "motion/number/trig.h"
#include "motion/plan/camera/plan_camera.h"

#define CMD_SAMPLE_NS_UHZ INT64_C(1000000000000000) /* ns of a micro-hertz */

struct cmd_sample {
    const struct job *job;
    const struct options *options;
    unsigned first, end;            /* axes */
    struct motion_cursor *cursor;   /* of the move's axes */
    struct motion_quat mount, last; /* of the camera */
    bool failed; /* a compiled move could not be read any more */
};

/* Time of sample k.  k <= 19 days * 1 MHz < 2^41 and the product is 128 bits
 * wide; the result is at most 19 days. */
static int64_t cmd_sample_time(int64_t k, int64_t rate_uhz)
{
    int64_t t_ns = INT64_MAX;
    motion_fixed_muldiv(k, CMD_SAMPLE_NS_UHZ, rate_uhz, &t_ns);
    return t_ns;
}

/* The first sample at or after a time. */
static int64_t cmd_sample_first(int64_t t_ns, int64_t rate_uhz)
{
    int64_t k = 0;
    motion_fixed_muldiv(t_ns, rate_uhz, CMD_SAMPLE_NS_UHZ, &k);
    while (k > 0 && cmd_sample_time(k - 1, rate_uhz) >= t_ns)
        k--;
    while (cmd_sample_time(k, rate_uhz) < t_ns)
        k++;
    return k;
}

static void cmd_sample_value(const struct cmd_sample *self, int64_t value,
                             unsigned bits)
{
    char text[NUMBER_MAX + 1];
    text[0] = ',';
    if (self->options->raw)
        number_integer(text + 1, value);
    else
        number_exact(text + 1, value, bits);
    fputs(text, stdout);
}

static const struct motion_track *
cmd_sample_track(struct cmd_sample *self, unsigned axis, int64_t t_ns_q12)
{
    if (self->job->compiled == NULL)
        return &self->job->track[axis];
    const struct motion_track *track =
        compiled_look(self->job->compiled, axis, t_ns_q12);
    self->failed |= track == NULL;
    return track;
}

/* The camera's rotation in the space of its path or rig, w x y z; the sign that is
 * nearer to the row before. */
static void cmd_sample_quaternion(struct cmd_sample *self, int64_t t_ns_q12)
{
    const struct plan_camera *camera = self->job->move.camera;
    int64_t turn[MOTION_HEAD_AXES] = { 0 };
    for (int i = 0; camera != NULL && i < MOTION_HEAD_AXES; i++) {
        struct motion_state at;
        if (i == MOTION_HEAD_ROLL && !camera->has_roll)
            continue;
        motion_track_state(&self->job->track[camera->axis[i]], t_ns_q12, &at);
        turn[i] = motion_trig_from_deg_q32(at.pos_q32);
    }
    struct motion_quat q = motion_quat_mul(self->mount, motion_head_quat(turn));
    (void)job_camera_rotation(self->job, t_ns_q12, &q);
    if (motion_quat_dot_q62(q, self->last) < 0)
        q = motion_quat_neg(q);
    self->last = q;
    const int64_t part[] = { q.w, q.x, q.y, q.z };
    for (int i = 0; i < 4; i++) {
        if (self->options->raw)
            printf(",%" PRId64, part[i]);
        else
            printf(",%.17g", ldexp((double)part[i], -62));
    }
}

static void cmd_sample_row(struct cmd_sample *self, int64_t t_ns)
{
    char text[NUMBER_MAX];
    number_integer(text, t_ns);
    fputs(text, stdout);
    for (unsigned i = self->first; i < self->end; i++) {
        const struct motion_track *track =
            cmd_sample_track(self, i, t_ns * MOTION_FIXED_NS_Q12);
        struct motion_sample sample;
        if (track == NULL)
            return;
        motion_track_sample(track, &self->cursor[i], t_ns * MOTION_FIXED_NS_Q12,
                            &sample);
        cmd_sample_value(self, sample.pos_q32, 32);
        cmd_sample_value(self, sample.vel_q32, 32);
        cmd_sample_value(self, sample.acc_q32, 32);
    }
    if (self->options->quaternion)
        cmd_sample_quaternion(self, t_ns * MOTION_FIXED_NS_Q12);
}

static void cmd_sample_head(const struct cmd_sample *self)
{
    static const char *const raw[] = { "pos_q32", "vel_q32", "acc_q32" };
    static const char *const slash[] = { "", "_s", "_s2" };
    const char *quote = self->options->json ? "\"" : "";
    printf("%st_ns%s", quote, quote);
    for (unsigned i = self->first; i < self->end; i++)
        for (unsigned order = 0; order < 3; order++) {
            printf(",%s%s_", quote, self->job->move.axis[i].name);
            if (self->options->raw)
                printf("%s", raw[order]);
            else
                printf("%s%s",
                       units_axis_text(job_rig_axis(self->job, i)->unit),
                       slash[order]);
            printf("%s", quote);
        }
    for (int i = 0; i < 4 && self->options->quaternion; i++)
        printf(",%scamera_%c%s%s", quote, "wxyz"[i],
               self -> options -> raw ? "_q62" : "", quote);
}

static void cmd_sample_csv(struct cmd_sample *self, int64_t k, int64_t to_ns)
{
    int64_t rate_uhz = self->options->rate_uhz;
    cmd_sample_head(self);
    putchar('\n');
    for (;; k++) {
        int64_t t_ns = cmd_sample_time(k, rate_uhz);
        if (t_ns > to_ns || self->failed || ferror(stdout))
            return;
        cmd_sample_row(self, t_ns);
        putchar('\n');
    }
}

static void cmd_sample_json(struct cmd_sample *self, int64_t k, int64_t to_ns)
{
    int64_t rate_uhz = self->options->rate_uhz;
    const char *between = "\n";
    fputs("{ \"columns\": [", stdout);
    cmd_sample_head(self);
    fputs("],\n\"rows\": [", stdout);
    for (;; k++) {
        int64_t t_ns = cmd_sample_time(k, rate_uhz);
        if (t_ns > to_ns || self->failed || ferror(stdout))
            break;
        printf("%s[", between);
        cmd_sample_row(self, t_ns);
        putchar(']');
        between = ",\n";
    }
    printf("],\n\"ok\": %s }\n", self->failed ? "false" : "true");
}

static enum status cmd_sample_fail(const char *what, const char *which)
{
    error_say("slew sample: %s%s", what, which);
    return STATUS_INPUT;
}

static enum status cmd_sample_no_axis(const struct cmd_sample *self,
                                      const char *name)
{
    const unsigned axes = self->job->move.axis_count;
    const char **names = memory_new((size_t)axes + 1, sizeof *names);
    char list[QUOTE_LIST_MAX];
    for (unsigned i = 0; i < axes; i++)
        names[i] = self->job->move.axis[i].name;
    error_say("slew sample: the move has no axis \"%s\", expected %s", name,
              quote_list(list, names, axes));
    memory_free(names);
    return STATUS_INPUT;
}

static enum status cmd_sample_axes(struct cmd_sample *self)
{
    const char *name = self->options->axis;
    self->end = self->job->move.axis_count;
    if (name == NULL)
        return STATUS_OK;
    int axis = job_axis_index(self->job, name);
    if (axis < 0)
        return cmd_sample_no_axis(self, name);
    self->first = (unsigned)axis;
    self->end = self->first + 1;
    return STATUS_OK;
}

static enum status cmd_sample_camera(struct cmd_sample *self)
{
    const struct plan_camera *camera = self->job->move.camera;
    if (!self->options->quaternion)
        return STATUS_OK;
    self->last = MOTION_QUAT_ONE;
    if (self->job->compiled == NULL &&
        job_camera_rotation(self->job, 0, &self->mount))
        return STATUS_OK;
    if (camera == NULL || self->job->compiled != NULL ||
        plan_camera_mount(camera, &self->mount) < 0)
        return cmd_sample_fail("--quaternion: the move has no camera",
                               ", expected a move with one");
    return STATUS_OK;
}

static enum status cmd_sample_between(const struct job *job,
                                      const struct options *options,
                                      int64_t *from_ns, int64_t *to_ns)
{
    const struct {
        const char *name, *text;
        int64_t *to_ns;
    } ends[] = { { "--from", options->from, from_ns },
                 { "--to", options->to, to_ns } };

    for (size_t i = 0; i < ARRAY_LEN(ends); i++) {
        int64_t t_ns_q12;
        if (ends[i].text == NULL)
            continue;
        const enum status status =
            planning_time(job, "sample", ends[i].name, ends[i].text, &t_ns_q12);
        if (status != STATUS_OK)
            return status;
        if (t_ns_q12 < 0)
            return cmd_sample_fail(ends[i].name,
                                   " is before the move, expected 0 or later");
        *ends[i].to_ns = t_ns_q12 / MOTION_FIXED_NS_Q12;
    }
    if (*from_ns > *to_ns)
        return cmd_sample_fail(options->to == NULL
                                   ? "--from is after the end of the move"
                                   : "--from is after --to",
                               ", expected an earlier time");
    return STATUS_OK;
}

static enum status cmd_sample_job(struct job *job,
                                  const struct options *options)
{
    struct cmd_sample self = { .job = job, .options = options };
    if (options->rate_uhz < 0)
        return cmd_sample_fail("how often? expected --rate HZ", "");
    enum status status =
        planning_open(job, options->path, options->path_count, true);
    if (status == STATUS_OK)
        status = cmd_sample_axes(&self);
    if (status == STATUS_OK)
        status = cmd_sample_camera(&self);
    if (status != STATUS_OK)
        return status;
    int64_t from_ns = 0, to_ns = job->end_ns_q12 / MOTION_FIXED_NS_Q12;
    status = cmd_sample_between(job, options, &from_ns, &to_ns);
    if (status != STATUS_OK)
        return status;
    int64_t k = cmd_sample_first(from_ns, options->rate_uhz);
    self.cursor =
        memory_new((size_t)job->move.axis_count + 1, sizeof *self.cursor);
    if (options->json)
        cmd_sample_json(&self, k, to_ns);
    else
        cmd_sample_csv(&self, k, to_ns);
    memory_free(self.cursor);
    return self.failed
               ? error_file(job->move_path, compiled_error(job->compiled))
               : STATUS_OK;
}

static enum status cmd_sample_run(const struct options *options)
{
    struct job *job = memory_new(1, sizeof *job);
    enum status status = cmd_sample_job(job, options);
    job_free(job);
    memory_free(job);
    return status;
}

static const struct option_row cmd_sample_option[] = {
    { "rate", "HZ", OPTION_RATE, offsetof(struct options, rate_uhz),
      "samples per second, 0.001 to 1000000" },
    { "axis", "NAME", OPTION_TEXT, offsetof(struct options, axis),
      "this axis alone" },
    { "from", "TIME", OPTION_TEXT, offsetof(struct options, from),
      "first time (0), such as 2.5, f48 or 00:00:02:12" },
    { "to", "TIME", OPTION_TEXT, offsetof(struct options, to),
      "last time (the end of the move)" },
    { "quaternion", NULL, OPTION_FLAG, offsetof(struct options, quaternion),
      "the camera's rotation, too, in the space of its path: w, x, y, z" },
    { "raw", NULL, OPTION_FLAG, offsetof(struct options, raw),
      "integers: Q32.32 position, velocity and acceleration" },
    OPTIONS_COMMON,
};

const struct command cmd_sample = {
    .name = "sample",
    .arguments = "RIG MOVE | DIRECTORY",
    .summary = "print a move as numbers, exact to the last bit",
    .text =
        "Writes CSV: the time in nanoseconds and, per axis, position, "
        "velocity\n"
        "and acceleration.  Numbers have all the digits there are, nothing is\n"
        "rounded.  Sample k is at k / rate, to the nanosecond.\n",
    .examples = "  slew sample --rate 1000 examples/dolly > dolly.csv\n"
                "  slew sample --rate 24 --axis pan rig.yaml move.yaml\n"
                "  slew sample --rate 8000 --raw --from 2s --to f60 "
                "examples/dolly\n",
    COMMAND_OPTIONS(cmd_sample_option),
    .run = cmd_sample_run,
};
