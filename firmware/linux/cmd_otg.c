/* firmware/linux/cmd_otg.c - slew otg: fastest motions for rows of a table. */
#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "firmware/linux/command.h"
#include "firmware/linux/otg_rows.h"
#include "motion/err.h"

#define CMD_OTG_LINE_MAX 16384

struct cmd_otg {
    const char *path;
    FILE *file;
    struct otg_header header;
    char line[CMD_OTG_LINE_MAX];
    int number; /* of the line, from 1 */
    bool segments;
    struct motion_otg_plan plan[MOTION_SYNC_AXES];
    unsigned refused;
};

static enum status cmd_otg_wrong(const struct cmd_otg *self, int column,
                                 const char *what)
{
    fprintf(stderr, "%s:%d:%d: %s\n", self->path, self->number, column, what);
    return STATUS_INPUT;
}

/* The next line that is not empty; false at the end. */
static bool cmd_otg_line(struct cmd_otg *self)
{
    do {
        if (fgets(self->line, sizeof self->line, self->file) == NULL)
            return false;
        self->number++;
    } while (self->line[strspn(self->line, " \t\r\n")] == '\0');
    return true;
}

static bool cmd_otg_line_is_cut(const struct cmd_otg *self)
{
    return strchr(self->line, '\n') == NULL && !feof(self->file);
}

/* Start and goal are the row's own numbers, not sums that should come to
 * them. */
static struct otg_point cmd_otg_point(const struct cmd_otg *self, int axis,
                                      int i, const struct otg_row *problem,
                                      const struct otg_scaled *scaled)
{
    const struct motion_otg_plan *plan = &self->plan[axis];
    const double *value = problem->value[axis];
    struct otg_point at =
        otg_plan_point(plan, i, scaled->length[axis], scaled->time);
    at.p += value[OTG_P0];
    if (i == plan->count) {
        at.v = value[OTG_VF];
        at.a = value[OTG_AF];
        if (!self->header.velocity)
            at.p = value[OTG_PF];
    } else if (i == 0) {
        at.v = value[OTG_V0];
        at.a = value[OTG_A0];
    }
    return at;
}

static void cmd_otg_segments(const struct cmd_otg *self, long row,
                             const struct otg_row *problem,
                             const struct otg_scaled *scaled)
{
    for (int axis = 0; axis < self->header.axes; axis++)
        for (int i = 0; i <= self->plan[axis].count; i++) {
            struct otg_point at = cmd_otg_point(self, axis, i, problem, scaled);
            printf("%ld,%d,%.17g,%.17g,%.17g,%.17g,%.17g\n", row, axis, at.t,
                   at.p, at.v, at.a, at.j);
        }
}

static void cmd_otg_refuse(struct cmd_otg *self, long row,
                           const struct motion_sync_fault *fault, int err)
{
    self->refused++;
    if (self->segments)
        fprintf(stderr, "row %ld: ", row);
    else
        printf("%ld,", row);
    FILE *file = self->segments ? stderr : stdout;
    fprintf(file, "%s", motion_otg_field_text(fault->field));
    if (self->header.axes > 1)
        fprintf(file, " of axis %d", fault->axis + 1);
    fprintf(file, ": %s%s\n", motion_err_text(err), self->segments ? "" : ",");
}

static void cmd_otg_solve(struct cmd_otg *self, long row,
                          const struct otg_row *problem)
{
    struct otg_scaled scaled;
    struct motion_sync_fault fault;
    otg_row_scale(&self->header, problem, &scaled);
    int err = motion_sync_make(scaled.move, self->header.axes,
                               self->header.axes > 1 ? MOTION_SYNC_TIME
                                                     : MOTION_SYNC_NONE,
                               self->plan, &fault);
    if (err < 0)
        cmd_otg_refuse(self, row, &fault, err);
    else if (self->segments)
        cmd_otg_segments(self, row, problem, &scaled);
    else
        printf("%ld,ok,%.17g\n", row,
               otg_plan_seconds(&self->plan[0], scaled.time));
}

static enum status cmd_otg_rows(struct cmd_otg *self)
{
    struct otg_row problem;
    int column = 1;
    if (!cmd_otg_line(self))
        return cmd_otg_wrong(self, 1, "no header line");
    const char *wrong = otg_header_parse(self->line, &self->header);
    if (cmd_otg_line_is_cut(self))
        wrong = "the line is too long";
    if (wrong != NULL)
        return cmd_otg_wrong(self, 1, wrong);
    puts(self->segments ? "row,axis,t,p,v,a,j" : "row,status,duration");
    for (long row = 0; cmd_otg_line(self); row++) {
        wrong = otg_row_parse(&self->header, self->line, &problem, &column);
        if (cmd_otg_line_is_cut(self))
            wrong = "the line is too long";
        if (wrong != NULL)
            return cmd_otg_wrong(self, column, wrong);
        cmd_otg_solve(self, row, &problem);
    }
    return self->refused ? STATUS_REFUSED : STATUS_OK;
}

static enum status cmd_otg_run(const struct options *options)
{
    static struct cmd_otg self;
    if (options->path_count != 1) {
        fputs("slew: otg: expected one file, or - for standard input\n",
              stderr);
        return STATUS_INPUT;
    }
    bool standard = strcmp(options->path[0], "-") == 0;
    self = (struct cmd_otg){ .path =
                                 standard ? "standard input" : options->path[0],
                             .segments = options->segments,
                             .file = stdin };
    if (!standard)
        self.file = fopen(options->path[0], "r");
    if (self.file == NULL) {
        fprintf(stderr, "%s: %s\n", self.path, strerror(errno));
        return STATUS_INPUT;
    }
    enum status status = cmd_otg_rows(&self);
    if (!standard)
        fclose(self.file);
    return status;
}

static const struct option_row cmd_otg_option[] = {
    { "segments", NULL, OPTION_FLAG, offsetof(struct options, segments),
      "write every phase: row,axis,t,p,v,a,j" },
    OPTIONS_COMMON,
};

const struct command cmd_otg = {
    .name = "otg",
    .arguments = "FILE | -",
    .summary = "plan the fastest motion between states, row by row",
    .text =
        "Reads CSV with a header.  Position goals: p0,v0,a0,pf,vf,af,vmax,\n"
        "vmin,amax,amin,jmax; several axes that arrive together: the same\n"
        "names with _1, _2 ...; velocity goals: v0,a0,vf,af,amax,amin,jmax.\n"
        "Other columns are left alone.  Lengths and times may have any unit.\n"
        "Writes row,status,duration: rows from 0, status \"ok\" or what is\n"
        "wrong, seconds with 17 digits.  With --segments the start of every\n"
        "phase of constant jerk and the end of the move instead.\n",
    .examples = "  slew otg moves.csv\n"
                "  slew otg --segments - < moves.csv\n",
    COMMAND_OPTIONS(cmd_otg_option),
    .run = cmd_otg_run,
};
