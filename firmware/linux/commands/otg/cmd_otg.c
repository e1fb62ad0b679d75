/* firmware/linux/commands/otg/cmd_otg.c - slew otg: fastest motions, of a table's
 * rows or of one problem on the command line. */
#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "firmware/host/base/array.h"
#include "firmware/host/base/memory.h"
#include "firmware/host/base/number.h"
#include "firmware/host/base/quote.h"
#include "firmware/host/plot/plot_page.h"
#include "firmware/linux/base/error.h"
#include "firmware/linux/base/json_print.h"
#include "firmware/linux/commands/command.h"
#include "firmware/linux/commands/otg/otg_answer.h"
#include "firmware/linux/commands/otg/otg_lines.h"

#define CMD_OTG_NO_ROW   (-1)
#define CMD_OTG_LEGS_MAX 10000

struct cmd_otg {
    const struct options *options;
    const char *path;
    struct otg_lines lines;
    struct otg_header header;
    struct otg_answer answer;
    struct otg_leg *leg; /* of a motion of several rows */
    int legs;
    enum otg_table table;
    enum motion_sync_kind kind;
    cJSON *rows; /* with --json */
    unsigned answered, refused;
    unsigned bent; /* --together phase, and on no straight line */
};

static enum status cmd_otg_fail(const char *what)
{
    error_say("slew otg: %s", what);
    return STATUS_INPUT;
}

static enum status cmd_otg_wrong(const struct cmd_otg *self, int column,
                                 const char *what)
{
    error_say("%s:%d:%d: %s", self->path, self->lines.number, column, what);
    return STATUS_INPUT;
}

/* --- one motion ----------------------------------------------------------- */

static void cmd_otg_report(struct cmd_otg *self)
{
    const struct otg_answer *answer = &self->answer;
    const bool segments = self->options->segments;
    if (self->rows != NULL)
        cJSON_AddItemToArray(self->rows, otg_answer_json(answer, segments));
    else if (segments)
        otg_answer_segments(answer, stdout);
    else if (self->path == NULL)
        otg_answer_text(answer, stdout);
    else
        otg_answer_line(answer, stdout);
    if (self->rows == NULL)
        otg_answer_notes(answer, segments);
}

/* A number below 0: not of a file, or all of it. */
static void cmd_otg_solve(struct cmd_otg *self, long number)
{
    struct otg_motion *motion = &self->answer.motion;
    motion->leg[0].row.wanted_s = self->options->wanted_s;
    motion->kind = self->kind;
    self->answer.number = number;
    otg_answer_make(&self->answer);
    self->answered++;
    self->refused += otg_answer_is_refused(&self->answer);
    self->bent += motion->bent;
    cmd_otg_report(self);
}

/* --- a file --------------------------------------------------------------- */

static enum status cmd_otg_unreadable(const struct cmd_otg *self)
{
    error_say("%s: %s", self->path, strerror(errno));
    return STATUS_INPUT;
}

static enum status cmd_otg_header(struct cmd_otg *self)
{
    bool is_line = otg_lines_next(&self->lines);
    if (ferror(self->lines.file))
        return cmd_otg_unreadable(self);
    if (!is_line) {
        self->lines.number = 1;
        return cmd_otg_wrong(
            self, 1, "no header line, expected columns such as p0,v0,a0,pf");
    }
    const char *wrong = self->lines.wrong;
    if (wrong == NULL)
        wrong = otg_header_parse(self->lines.line, &self->header);
    self->header.table = self->table;
    if (wrong == NULL && self->table != OTG_TABLE_SEPARATE &&
        self->header.velocity)
        wrong = "expected columns p0 and pf, as goals are positions with "
                "--through and --replan";
    if (wrong == NULL && self->table == OTG_TABLE_REPLAN && !self->header.timed)
        wrong = "no column t, expected when each goal replaces the one before, "
                "in seconds, 0 in the first row";
    return wrong == NULL ? STATUS_OK : cmd_otg_wrong(self, 1, wrong);
}

static enum status cmd_otg_row(struct cmd_otg *self, long number)
{
    int column = 1;
    const char *wrong = self->lines.wrong;
    int64_t only = self->options->row;
    if (wrong == NULL)
        wrong = otg_row_parse(&self->header, self->lines.line,
                              &self->answer.motion.leg[0].row, &column);
    if (wrong != NULL)
        return cmd_otg_wrong(self, column, wrong);
    if (self->options->plot != NULL && only < 0 && number > 0)
        return cmd_otg_wrong(self, 1,
                             "--plot draws one row, and here is another, "
                             "expected --row N (from 0)");
    if (only < 0 || only == number)
        cmd_otg_solve(self, number);
    return STATUS_OK;
}

static enum status cmd_otg_each_row(struct cmd_otg *self)
{
    int64_t only = self->options->row;
    enum status status = STATUS_OK;
    if (self->rows == NULL)
        puts(self->options->segments ? "row,axis,t,p,v,a,j"
                                     : "row,status,duration");
    otg_motion_init(&self->answer.motion, &self->header, self->kind, 1);
    long number = 0;
    while (status == STATUS_OK && (only < 0 || self->answered == 0) &&
           otg_lines_next(&self->lines))
        status = cmd_otg_row(self, number++);
    if (status == STATUS_OK && only >= 0 && self->answered == 0) {
        error_say("%s: no row %ld, expected one of %ld, counted from 0",
                  self->path, (long)only, number);
        return STATUS_INPUT;
    }
    return status;
}

/* One more row of the one motion. */
static enum status cmd_otg_leg(struct cmd_otg *self)
{
    int column = 1;
    const char *wrong = self->lines.wrong;
    if (self->legs == CMD_OTG_LEGS_MAX)
        wrong = "too many rows: expected 10000 at most in one motion";
    if ((self->legs & (self->legs - 1)) == 0)
        self->leg = memory_resize(self->leg, (size_t)self->legs * 2 + 1,
                                  sizeof *self->leg);
    struct otg_leg *leg = &self->leg[self->legs];
    if (wrong == NULL)
        wrong =
            otg_row_parse(&self->header, self->lines.line, &leg->row, &column);
    if (wrong == NULL)
        wrong = otg_row_follow(&self->header, self->lines.line,
                               self->legs > 0 ? &leg[-1].row : NULL, &leg->row,
                               &column);
    if (wrong != NULL)
        return cmd_otg_wrong(self, column, wrong);
    self->legs++;
    return STATUS_OK;
}

static enum status cmd_otg_one_motion(struct cmd_otg *self)
{
    enum status status = STATUS_OK;
    while (status == STATUS_OK && otg_lines_next(&self->lines))
        status = cmd_otg_leg(self);
    if (status == STATUS_OK && self->legs == 0)
        return cmd_otg_wrong(self, 1, "no rows, expected one at least");
    if (status != STATUS_OK)
        return status;
    otg_motion_init(&self->answer.motion, &self->header, self->kind,
                    self->legs);
    for (int i = 0; i < self->legs; i++)
        self->answer.motion.leg[i].row = self->leg[i].row;
    if (self->rows == NULL)
        puts(self->options->segments ? "row,axis,t,p,v,a,j" : "row,status,t");
    cmd_otg_solve(self, CMD_OTG_NO_ROW);
    return STATUS_OK;
}

static enum status cmd_otg_rows(struct cmd_otg *self)
{
    enum status status = cmd_otg_header(self);
    if (status != STATUS_OK)
        return status;
    return self->table == OTG_TABLE_SEPARATE ? cmd_otg_each_row(self)
                                             : cmd_otg_one_motion(self);
}

static enum status cmd_otg_file(struct cmd_otg *self, const char *path)
{
    bool standard = strcmp(path, "-") == 0;
    self->path = standard ? "standard input" : path;
    self->lines.file = standard ? stdin : fopen(path, "r");
    if (self->lines.file == NULL)
        return cmd_otg_unreadable(self);
    enum status status = cmd_otg_rows(self);
    if (status == STATUS_OK && ferror(self->lines.file))
        status = cmd_otg_unreadable(self);
    if (!standard)
        fclose(self->lines.file);
    return status;
}

/* --- the command line ----------------------------------------------------- */

/* What each number is when it is not given; NAN: it has to be. */
static double cmd_otg_value(const struct cmd_otg *self, int i)
{
    const double *given = self->options->motion;
    bool position = !self->header.velocity;
    if (!isnan(given[i]))
        return given[i];
    switch (i) {
    case OTG_VMIN:
        return position ? -given[OTG_VMAX] : 0;
    case OTG_AMIN:
        return -given[OTG_AMAX];
    case OTG_VMAX:
        return position ? (double)NAN : 0;
    case OTG_AMAX:
    case OTG_JMAX:
        return (double)NAN;
    default:
        return 0;
    }
}

/* Every limit that is missing, at once. */
static bool cmd_otg_lacks(const struct otg_row *row)
{
    static const int limit[] = { OTG_VMAX, OTG_AMAX, OTG_JMAX };
    static const char *const name[] = { "--vmax", "--amax", "--jmax" };
    const char *missing[ARRAY_LEN(limit)];
    char list[QUOTE_LIST_MAX];
    unsigned count = 0;
    for (size_t i = 0; i < ARRAY_LEN(limit); i++)
        if (isnan(row->value[0][limit[i]]))
            missing[count++] = name[i];
    if (count > 0)
        error_say("slew otg: no %s, expected every limit (--jmax 0: no "
                  "limit of the jerk)",
                  quote_list(list, missing, count));
    return count > 0;
}

static enum status cmd_otg_one(struct cmd_otg *self)
{
    const double *given = self->options->motion;
    if (isnan(given[OTG_PF]) && isnan(given[OTG_VF]))
        return cmd_otg_fail("where to? expected FILE, or --to POSITION, or "
                            "--vf VELOCITY; see slew otg --help");
    if (self->options->row >= 0)
        return cmd_otg_fail("--row is for a table, expected FILE with it");
    self->header.axes = 1;
    self->header.velocity = isnan(given[OTG_PF]);
    struct otg_row row = { .duration = (double)NAN };
    for (int i = 0; i < OTG_VALUES; i++)
        row.value[0][i] = cmd_otg_value(self, i);
    if (cmd_otg_lacks(&row))
        return STATUS_INPUT;
    otg_motion_init(&self->answer.motion, &self->header, self->kind, 1);
    self->answer.motion.leg[0].row = row;
    bool csv = self->options->segments && !self->options->json;
    if (csv)
        puts("row,axis,t,p,v,a,j");
    cmd_otg_solve(self, csv ? 0 : CMD_OTG_NO_ROW);
    return STATUS_OK;
}

static bool cmd_otg_has_numbers(const struct options *options)
{
    for (int i = 0; i < OTG_VALUES; i++)
        if (!isnan(options->motion[i]))
            return true;
    return false;
}

/* --- both ----------------------------------------------------------------- */

static enum status cmd_otg_plot(struct cmd_otg *self, cJSON *report)
{
    const char *picture = self->options->plot;
    if (picture == NULL || self->answered == 0 || self->answer.motion.err < 0)
        return STATUS_OK;
    if (otg_answer_plot(&self->answer, picture) < 0)
        return STATUS_SYSTEM;
    if (report != NULL)
        cJSON_AddStringToObject(report, "picture", picture);
    else if (self->path == NULL && !self->options->segments)
        printf("\npicture: %s\n", picture);
    return STATUS_OK;
}

static enum status cmd_otg_finish(struct cmd_otg *self)
{
    cJSON *report = self->rows != NULL ? cJSON_CreateObject() : NULL;
    enum status status = cmd_otg_plot(self, report);
    if (report != NULL) {
        cJSON_AddItemToObject(report, "rows", self->rows);
        json_report(report, status == STATUS_OK && self->refused == 0);
    }
    if (self->bent > 0)
        fprintf(stderr,
                "slew otg: note: %u of %u %s on no straight line, for which "
                "start and goal do not allow (--together straight refuses "
                "them)\n",
                self->bent, self->answered,
                number_word(self->bent, "row is", "rows are"));
    return status == STATUS_OK && self->refused > 0 ? STATUS_REFUSED : status;
}

/* The names of --together. */
static const char *const cmd_otg_kind[] = {
    [MOTION_SYNC_NONE] = "none",
    [MOTION_SYNC_TIME] = "time",
    [MOTION_SYNC_PHASE] = "phase",
    [MOTION_SYNC_STRAIGHT] = "straight",
};

static bool cmd_otg_together(const char *how, enum motion_sync_kind *kind)
{
    *kind = MOTION_SYNC_TIME;
    if (how == NULL)
        return true;
    for (int i = MOTION_SYNC_NONE; i <= MOTION_SYNC_STRAIGHT; i++)
        if (strcmp(how, cmd_otg_kind[i]) == 0) {
            *kind = (enum motion_sync_kind)i;
            return true;
        }
    return false;
}

static enum status cmd_otg_table(const struct options *options,
                                 enum otg_table *table)
{
    *table = options->through  ? OTG_TABLE_THROUGH
             : options->replan ? OTG_TABLE_REPLAN
                               : OTG_TABLE_SEPARATE;
    if (*table == OTG_TABLE_SEPARATE)
        return STATUS_OK;
    if (options->through && options->replan)
        return cmd_otg_fail("expected --through or --replan, not both");
    if (options->path_count == 0)
        return cmd_otg_fail("--through and --replan are for a table, expected "
                            "FILE, whose rows are one motion");
    if (options->row >= 0)
        return cmd_otg_fail("--row: not with --through or --replan, as all "
                            "rows are one motion");
    if (options->together != NULL)
        return cmd_otg_fail("--together: not with --through, where axes take "
                            "the same time, or --replan, where each takes its "
                            "least");
    if (options->wanted_s != 0)
        return cmd_otg_fail("--duration: not with --through or --replan, which "
                            "take the least");
    return STATUS_OK;
}

static enum status cmd_otg_requested(struct cmd_otg *self)
{
    const struct options *options = self->options;
    bool numbers = cmd_otg_has_numbers(options);
    if (options->path_count > 1)
        return cmd_otg_fail("expected one FILE, or - for standard input");
    if (options->path_count == 1 && numbers)
        return cmd_otg_fail("expected a FILE or the numbers of one motion, "
                            "not both");
    if (options->plot != NULL && plot_format_of(options->plot) < 0)
        return cmd_otg_fail("--plot: expected FILE.svg or FILE.png");
    if (!cmd_otg_together(options->together, &self->kind))
        return cmd_otg_fail("--together: expected time, phase (on a line where "
                            "the states allow), straight or none");
    if (options->wanted_s < 0)
        return cmd_otg_fail("--duration: expected seconds, 0 or above");
    if (options->wanted_s > 0 && self->kind == MOTION_SYNC_NONE)
        return cmd_otg_fail("--duration: not with --together none, by which "
                            "each axis takes the least");
    return cmd_otg_table(options, &self->table);
}

static enum status cmd_otg_run(const struct options *options)
{
    static struct cmd_otg self;
    self = (struct cmd_otg){ .options = options };
    enum status status = cmd_otg_requested(&self);
    if (status != STATUS_OK)
        return status;
    self.rows = options->json ? cJSON_CreateArray() : NULL;
    status = options->path_count == 1 ? cmd_otg_file(&self, options->path[0])
                                      : cmd_otg_one(&self);
    if (status == STATUS_OK)
        status = cmd_otg_finish(&self);
    else
        cJSON_Delete(self.rows);
    otg_motion_free(&self.answer.motion);
    memory_free(self.leg);
    return status;
}

#define CMD_OTG_NUMBER(name, value, index, help)                               \
    {                                                                          \
        name, value, OPTION_NUMBER, offsetof(struct options, motion[index]),   \
            help                                                               \
    }

static const struct option_row cmd_otg_option[] = {
    { "segments", NULL, OPTION_FLAG, offsetof(struct options, segments),
      "write every phase: row,axis,t,p,v,a,j" },
    { "plot", "FILE", OPTION_TEXT, offsetof(struct options, plot),
      "draw one row, .svg or .png by its name" },
    { "row", "N", OPTION_COUNT, offsetof(struct options, row),
      "this row of FILE alone, counted from 0" },
    CMD_OTG_NUMBER("to", "P", OTG_PF, "goal: position (pf)"),
    CMD_OTG_NUMBER("vf", "V", OTG_VF, "velocity there (0)"),
    CMD_OTG_NUMBER("af", "A", OTG_AF, "acceleration there (0)"),
    CMD_OTG_NUMBER("from", "P", OTG_P0, "start: position (0)"),
    CMD_OTG_NUMBER("v0", "V", OTG_V0, "velocity there (0)"),
    CMD_OTG_NUMBER("a0", "A", OTG_A0, "acceleration there (0)"),
    CMD_OTG_NUMBER("vmax", "V", OTG_VMAX, "limit of the velocity"),
    CMD_OTG_NUMBER("vmin", "V", OTG_VMIN, "below zero (-vmax)"),
    CMD_OTG_NUMBER("amax", "A", OTG_AMAX, "limit of the acceleration"),
    CMD_OTG_NUMBER("amin", "A", OTG_AMIN, "below zero (-amax)"),
    CMD_OTG_NUMBER("jmax", "J", OTG_JMAX,
                   "limit of the jerk; 0: none, the acceleration steps"),
    CMD_OTG_NUMBER("jdown", "J", OTG_JDOWN, "that of slowing down (jmax)"),
    { "duration", "S", OPTION_NUMBER, offsetof(struct options, wanted_s),
      "take so long, or the least that is more" },
    { "together", "HOW", OPTION_TEXT, offsetof(struct options, together),
      "axes of a row: time, phase, straight, none" },
    { "through", NULL, OPTION_FLAG, offsetof(struct options, through),
      "the rows are points of one motion, passed without stopping" },
    { "replan", NULL, OPTION_FLAG, offsetof(struct options, replan),
      "from its time t on a row's goal replaces that of the row before" },
    OPTIONS_COMMON,
};

const struct command cmd_otg = {
    .name = "otg",
    .arguments = "FILE | - | --to P --vmax V --amax A --jmax J",
    .summary = "plan the fastest motion between states, row by row",
    .text =
        "Reads CSV with a header, # begins a comment.  Position goals: p0,v0,\n"
        "a0,pf,vf,af,vmax,vmin,amax,amin,jmax and, when it is there, jdown;\n"
        "several axes: the same names with _1, _2 ...; velocity goals: v0,a0,\n"
        "vf,af,amax,amin,jmax.  Other columns are left alone, a column\n"
        "duration too.  Lengths and times may have any unit.\n"
        "Writes row,status,duration: rows from 0, status \"ok\" or what is\n"
        "wrong, seconds with 17 digits.  With --segments the start of every\n"
        "phase of constant jerk and the end of the move instead.  A goal that\n"
        "no motion meets in whole ticks but a much longer one is missed by "
        "part\n"
        "of a tick: that residual is said on stderr, and per axis in JSON.\n"
        "With jmax 0 the acceleration steps and the duration is that motion's; "
        "in\n"
        "the phases steep ramps stand for the steps, so that they end a few\n"
        "millionths of it later.\n"
        "Without FILE one motion from the options: to a position, or with\n"
        "--vf alone to a velocity.\n"
        "With --through or --replan the rows are one motion.  It starts as\n"
        "the first row says; p0, v0 and a0 of the others are empty, and any\n"
        "other empty field is as in the row before.  Written is row,status,t:\n"
        "when the row's goal is reached.  --through stops at the last point\n"
        "and passes the others at vf, where that is empty at a speed of its\n"
        "own choice.  --replan needs a column t, the seconds at which each\n"
        "row takes over, from the state that the axis is in; limits may\n"
        "change too, and each axis takes its least time.  Goals for a target\n"
        "that moves are one row per time it was seen at.\n",
    .examples = "  slew otg moves.csv\n"
                "  slew otg --segments - < moves.csv\n"
                "  slew otg --row 12 --plot row12.png moves.csv\n"
                "  slew otg --to 100 --vmax 10 --amax 20 --jmax 200 --plot "
                "move.png\n"
                "  slew otg --together straight --segments robot.csv\n"
                "  slew otg --v0 5 --vf -2 --amax 20 --jmax 200 --json\n"
                "  slew otg --through --plot path.svg points.csv\n"
                "  slew otg --replan --segments target.csv\n",
    .path_optional = true,
    COMMAND_OPTIONS(cmd_otg_option),
    .run = cmd_otg_run,
};
