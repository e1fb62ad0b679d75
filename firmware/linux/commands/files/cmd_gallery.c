/* firmware/linux/commands/files/cmd_gallery.c - slew gallery: every kind of curve on
 * the same keys, as a page of Markdown with a picture each.
 *
 * Everything on the page is measured on the tracks that the curves plan to, in
 * closed form; a kind that is added to PLAN_CURVE_LIST is on the page without a
 * line here. */
#define _XOPEN_SOURCE 700 /* mkdir */
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#include "firmware/host/base/array.h"
#include "firmware/host/base/memory.h"
#include "firmware/host/base/number.h"
#include "firmware/host/job/compare.h"
#include "firmware/host/job/job.h"
#include "firmware/linux/base/error.h"
#include "firmware/linux/base/json_print.h"
#include "firmware/linux/base/output.h"
#include "firmware/linux/commands/command.h"
#include "firmware/linux/commands/picture.h"
#include "firmware/linux/commands/planning.h"
#include "motion/core/err.h"

static const char *const cmd_gallery_text[] = {
#define CMD_GALLERY_TEXT(name, spelling, text) [name] = text,
    PLAN_CURVE_LIST(CMD_GALLERY_TEXT)
#undef CMD_GALLERY_TEXT
};

/* When to take it: one sentence each. */
static const char *const cmd_gallery_use[] = {
    [PLAN_CURVE_LINEAR] = "To see what keys say: no machine follows it; a "
                          "servo overshoots at every key",
    [PLAN_CURVE_ROUNDED] = "For steady speed on straight stretches, when the "
                           "inner keys may be missed by a little",
    [PLAN_CURVE_SMOOTHED] = "As rounded, on an axis whose jerk is limited",
    [PLAN_CURVE_PARABOLIC] = "For moves from stop to stop in the least time "
                             "under a limit of acceleration",
    [PLAN_CURVE_SINE] = "For moves from stop to stop that look soft in the "
                        "middle; the start is still abrupt",
    [PLAN_CURVE_SCURVE] = "For moves from stop to stop on a real machine: "
                          "nothing steps",
    [PLAN_CURVE_HERMITE] = "When you know the speed at every key, as from "
                           "another program",
    [PLAN_CURVE_CATMULL_ROM] = "For keys that follow each other evenly enough, "
                               "without solving anything",
    [PLAN_CURVE_CARDINAL] = "To choose by one number how tight the curve is "
                            "between its keys",
    [PLAN_CURVE_KOCHANEK] = "To shape every key by hand, as animators do",
    [PLAN_CURVE_MONOTONE] = "When it may never go beyond a key: focus, iris, a "
                            "wall",
    [PLAN_CURVE_AKIMA] = "For measured or uneven keys, where others swing",
    [PLAN_CURVE_AKIMA_MONOTONE] = "As akima, where nothing may go beyond a key",
    [PLAN_CURVE_C2] = "For the smoothest pass through close, even keys",
    [PLAN_CURVE_QUINTIC] = "The first choice on a machine: passes every key "
                           "and its acceleration does not step",
    [PLAN_CURVE_C4] = "For heavy or soft rigs that ring: jerk is smooth too; "
                      "look at how far it swings",
    [PLAN_CURVE_CONSTRAINTS] = "To say of every key exactly what must hold "
                               "there, and nothing else",
    [PLAN_CURVE_BSPLINE] = "For the calmest curve, when keys only guide it",
    [PLAN_CURVE_LAGRANGE] = "For two to four keys; with more, to see why not",
    [PLAN_CURVE_BEZIER] = "For what was drawn in a graph editor, handles and "
                          "easings included",
};

/* One kind of curve on the keys. */
struct cmd_gallery_row {
    char refused[240]; /* why it cannot take the keys; empty: it can */
    int64_t peak[4];   /* of v, a, j; [0] is how far beyond the keys */
    struct motion_continuity step;
};

struct cmd_gallery {
    struct job *job; /* one axis: the keys */
    FILE *page;
    char folder[OUTPUT_PATH_MAX]; /* of the pictures */
    const char *folder_name;      /* as the page calls it */
    struct cmd_gallery_row *row;  /* of every curve */
};

static enum status cmd_gallery_fail(const char *what, const char *which)
{
    error_say("slew gallery: %s%s", what, which);
    return STATUS_INPUT;
}

/* --- measuring --- */

static int64_t cmd_gallery_overshoot(const struct plan_axis *axis,
                                     const struct motion_track *track)
{
    struct motion_extreme extreme;
    int64_t low = INT64_MAX, high = INT64_MIN;
    for (uint32_t i = 0; i < axis->key_count; i++) {
        int64_t pos = axis->key[i].key.pos_q32;
        low = pos < low ? pos : low;
        high = pos > high ? pos : high;
    }
    motion_track_extreme(track, MOTION_POS, &extreme);
    int64_t above = extreme.max - high, below = low - extreme.min;
    return above > below ? above : below;
}

static void cmd_gallery_measure(struct cmd_gallery_row *row,
                                const struct plan_axis *axis,
                                const struct motion_track *track)
{
    row->peak[0] = cmd_gallery_overshoot(axis, track);
    for (int order = 1; order <= 3; order++)
        row->peak[order] = job_peak(track, (enum motion_quantity)order, NULL);
    motion_track_continuity(track, &row->step);
}

/* What rounding leaves is far below this; a step that is meant, far above. */
#define CMD_GALLERY_SMALL_Q32 ((uint64_t)1 << 22)

static bool cmd_gallery_steps(const struct cmd_gallery_row *row, int order)
{
    if (order == 1)
        return row->step.vel_step_q32 > CMD_GALLERY_SMALL_Q32;
    return row->step.acc_step_q32 > CMD_GALLERY_SMALL_Q32;
}

/* --- pictures --- */

static enum status cmd_gallery_picture(struct cmd_gallery *self,
                                       enum plan_curve curve)
{
    char path[OUTPUT_PATH_MAX + PLAN_NAME_MAX + 8];
    const struct plan_axis *axis = &self->job->move.axis[0];
    struct cmd_gallery_row *row = &self->row[curve];
    struct plan_error error;
    struct job *one = memory_new(1, sizeof *one);
    one->rig = self->job->rig;
    one->rig.memory = (struct memory_pool){ NULL }; /* it stays the other's */
    one->rig.line_count = 0; /* keys alone trigger nothing */
    one->compared = true;
    job_capacity(one, 1);
    if (plan_move_reserve(&one->move, 1) < 0)
        memory_fail();
    int err =
        compare_plan(axis, curve, &one->move.axis[0], &one->track[0], &error);
    if (err < 0) {
        snprintf(row->refused, sizeof row->refused, "%s", error.text);
        job_free(one);
        memory_free(one);
        return STATUS_OK;
    }
    one->rig_axis[0] = self->job->rig_axis[0];
    one->move.axis_count = one->planned = 1;
    one->end_ns_q12 = one->track[0].end_ns_q12;
    snprintf(one->move.title, sizeof one->move.title, "%s", axis->name);
    cmd_gallery_measure(row, &one->move.axis[0], &one->track[0]);
    snprintf(path, sizeof path, "%s/%s.svg", self->folder,
             compare_spelling[curve]);
    err = picture_of_job(one, NULL, path);
    job_free(one);
    memory_free(one);
    return err < 0 ? STATUS_SYSTEM : STATUS_OK;
}

/* --- the page --- */

static void cmd_gallery_cell(const struct cmd_gallery *self, int64_t value,
                             unsigned bits)
{
    char text[NUMBER_MAX];
    number_short(text, value, bits);
    fprintf(self->page, " %s |", text);
}

static void cmd_gallery_table_row(const struct cmd_gallery *self, unsigned i)
{
    const struct cmd_gallery_row *row = &self->row[i];
    fprintf(self->page, "| [%s](#%s) |", compare_spelling[i],
            compare_spelling[i]);
    if (row->refused[0] != 0) {
        fprintf(self->page, " %s | | | | |\n", "cannot take these keys");
        return;
    }
    fprintf(self->page, " %s |",
            cmd_gallery_steps(row, 1)   ? "position"
            : cmd_gallery_steps(row, 2) ? "velocity"
                                        : "acceleration");
    cmd_gallery_cell(self, row->peak[0] > 0 ? row->peak[0] : 0, 32);
    cmd_gallery_cell(self, row->peak[1], 32);
    if (cmd_gallery_steps(row, 1))
        fputs(" infinite |", self->page);
    else
        cmd_gallery_cell(self, row->peak[2], 32);
    if (cmd_gallery_steps(row, 1) || cmd_gallery_steps(row, 2))
        fputs(" infinite |\n", self->page);
    else {
        cmd_gallery_cell(self, row->peak[3], 32);
        fputc('\n', self->page);
    }
}

static void cmd_gallery_head(const struct cmd_gallery *self)
{
    const struct plan_axis *axis = &self->job->move.axis[0];
    const char *unit = units_axis_text(job_rig_axis(self->job, 0)->unit);
    char t[NUMBER_MAX], pos[NUMBER_MAX];
    fputs("# Gallery of curves\n\n"
          "<!-- Made by make gallery; edits are lost. -->\n\n"
          "The same keys under every kind of curve, so that you can pick one. "
          "Pictures and\nfigures are measured on what slew would play. The "
          "keys, unevenly spaced:\n\n| time s |",
          self->page);
    for (uint32_t i = 0; i < axis->key_count; i++) {
        number_short(t, axis->key[i].key.t_ns_q12 / 1000000000, 12);
        fprintf(self->page, " %s |", t);
    }
    fputs("\n|---|", self->page);
    for (uint32_t i = 0; i < axis->key_count; i++)
        fputs("---:|", self->page);
    fprintf(self->page, "\n| position %s |", unit);
    for (uint32_t i = 0; i < axis->key_count; i++) {
        number_short(pos, axis->key[i].key.pos_q32, 32);
        fprintf(self->page, " %s |", pos);
    }
    fprintf(self->page,
            "\n\n| curve | continuous up to | beyond the keys %s | velocity "
            "%s/s | acceleration %s/s² | jerk %s/s³ |\n"
            "|---|---|---:|---:|---:|---:|\n",
            unit, unit, unit, unit);
}

/* The largest step on these keys, of what steps first. */
static void cmd_gallery_steps_line(const struct cmd_gallery *self,
                                   const struct cmd_gallery_row *row)
{
    const char *unit = units_axis_text(job_rig_axis(self->job, 0)->unit);
    char text[NUMBER_MAX];
    if (row->refused[0] != 0)
        fputc('\n', self->page);
    else if (cmd_gallery_steps(row, 1)) {
        number_short(text, (int64_t)row->step.vel_step_q32, 32);
        fprintf(self->page, "Here velocity steps by up to %s %s/s.\n\n", text,
                unit);
    } else if (cmd_gallery_steps(row, 2)) {
        number_short(text, (int64_t)row->step.acc_step_q32, 32);
        fprintf(self->page, "Here acceleration steps by up to %s %s/s².\n\n",
                text, unit);
    } else
        fputs("Here nothing steps but jerk.\n\n", self->page);
}

static void cmd_gallery_curve(const struct cmd_gallery *self, unsigned i)
{
    const struct cmd_gallery_row *row = &self->row[i];
    fprintf(self->page, "\n## %s\n\n%s.\n", compare_spelling[i],
            cmd_gallery_text[i]);
    if (i < ARRAY_LEN(cmd_gallery_use) && cmd_gallery_use[i] != NULL)
        fprintf(self->page, "%s.\n", cmd_gallery_use[i]);
    cmd_gallery_steps_line(self, row);
    if (row->refused[0] != 0)
        fprintf(self->page, "Cannot take these keys: %s.\n", row->refused);
    else
        fprintf(self->page, "![%s](%s/%s.svg)\n", compare_spelling[i],
                self->folder_name, compare_spelling[i]);
}

static void cmd_gallery_page(const struct cmd_gallery *self)
{
    cmd_gallery_head(self);
    for (unsigned i = 0; i < compare_spellings; i++)
        cmd_gallery_table_row(self, i);
    fputs("\nFigures are the largest of the whole curve. Where velocity "
          "steps, acceleration is\ninfinite, and where acceleration steps, "
          "jerk is: a servo rounds such corners off as it\ncan. Your own keys "
          "under some of them: `slew plot --compare linear,quintic --axis "
          "NAME\n--out FILE.svg RIG MOVE`.\n",
          self->page);
    for (unsigned i = 0; i < compare_spellings; i++)
        cmd_gallery_curve(self, i);
}

/* --- the command --- */

/* "docs/GALLERY.md": pictures in docs/gallery. */
static enum status cmd_gallery_folder(struct cmd_gallery *self,
                                      const char *path)
{
    const char *slash = strrchr(path, '/');
    int length = slash == NULL ? 0 : (int)(slash - path) + 1;
    self->folder_name = "gallery";
    if ((size_t)length + 64 > sizeof self->folder)
        return cmd_gallery_fail("the name is too long: ", path);
    snprintf(self->folder, sizeof self->folder, "%.*s%s", length, path,
             self->folder_name);
    if (mkdir(self->folder, 0777) < 0 && errno != EEXIST) {
        error_say("slew: %s: cannot create: %s", self->folder, strerror(errno));
        return STATUS_SYSTEM;
    }
    return STATUS_OK;
}

static enum status cmd_gallery_write(struct cmd_gallery *self, const char *path)
{
    struct output output;
    enum status status = cmd_gallery_folder(self, path);
    for (unsigned i = 0; i < compare_spellings && status == STATUS_OK; i++)
        status = cmd_gallery_picture(self, (enum plan_curve)i);
    if (status != STATUS_OK)
        return status;
    if (output_open(&output, path) < 0)
        return STATUS_SYSTEM;
    self->page = output.file;
    cmd_gallery_page(self);
    return output_commit(&output) < 0 ? STATUS_SYSTEM : STATUS_OK;
}

static void cmd_gallery_report(const char *path, bool json)
{
    if (!json) {
        printf("gallery: %s, %u curves\n", path, compare_spellings);
        return;
    }
    cJSON *report = cJSON_CreateObject();
    cJSON_AddStringToObject(report, "gallery", path);
    cJSON_AddNumberToObject(report, "curves", compare_spellings);
    json_report(report, true);
}

static enum status cmd_gallery_run(const struct options *options)
{
    static struct cmd_gallery self;
    const size_t length = options->out != NULL ? strlen(options->out) : 0;
    if (length < 4 || strcmp(options->out + length - 3, ".md") != 0)
        return cmd_gallery_fail("where to? expected --out FILE.md", "");
    struct job *job = memory_new(1, sizeof *job);
    self = (struct cmd_gallery){
        .job = job,
        .row = memory_new(compare_spellings, sizeof *self.row),
    };
    enum status status =
        planning_open(job, options->path, options->path_count, false);
    if (status == STATUS_OK && job->move.axis_count != 1)
        status = error_file(job->move_path,
                            "moves several axes, expected a move of one");
    if (status == STATUS_OK)
        status = cmd_gallery_write(&self, options->out);
    if (status == STATUS_OK)
        cmd_gallery_report(options->out, options->json);
    memory_free(self.row);
    job_free(job);
    memory_free(job);
    return status;
}

static const struct option_row cmd_gallery_option[] = {
    { "out", "FILE", OPTION_TEXT, offsetof(struct options, out),
      "the page, .md; pictures go to the folder gallery beside it" },
    OPTIONS_COMMON,
};

const struct command cmd_gallery = {
    .name = "gallery",
    .arguments = "RIG MOVE | DIRECTORY",
    .summary = "draw the same keys under every kind of curve",
    .text =
        "Writes a page of Markdown with a picture for every kind of curve on\n"
        "the keys of a move with one axis: position, velocity, acceleration,\n"
        "jerk; and a table of what each costs.\n",
    .examples = "  slew gallery --out GALLERY.md examples/gallery\n",
    COMMAND_OPTIONS(cmd_gallery_option),
    .run = cmd_gallery_run,
};
