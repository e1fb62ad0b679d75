/* firmware/linux/commands/cmd_otg.c - slew otg: fastest motions, of a table's
 * rows or of one problem on the command line. */
#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "firmware/host/base/array.h"
#include "firmware/host/base/error.h"
#include "firmware/host/base/json.h"
#include "firmware/host/base/number.h"
#include "firmware/host/base/quote.h"
#include "firmware/host/plot/plot_page.h"
#include "firmware/linux/commands/command.h"
#include "firmware/linux/commands/otg_answer.h"

#define CMD_OTG_LINE_MAX 16384
#define CMD_OTG_NO_ROW   (-1)

struct cmd_otg {
    const struct options *options;
    const char *path;
    FILE *file;
    struct otg_header header;
    struct otg_row row;
    struct otg_answer answer;
    enum motion_sync_kind kind;
    char line[CMD_OTG_LINE_MAX];
    int number;        /* of the line, from 1 */
    const char *wrong; /* with the line itself */
    cJSON *rows;       /* with --json */
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
    error_say("%s:%d:%d: %s", self->path, self->number, column, what);
    return STATUS_INPUT;
}

/* --- lines ---------------------------------------------------------------- */

/* The next byte; what ends a line (\n, \r\n or, as on old machines, \r) is
 * \n. */
static int cmd_otg_byte(struct cmd_otg *self)
{
    int c = getc(self->file);
    if (c != '\r')
        return c;
    int next = getc(self->file);
    if (next != '\n' && next != EOF)
        ungetc(next, self->file);
    return '\n';
}

/* Any line, without its end; false at the end of the file. */
static bool cmd_otg_any_line(struct cmd_otg *self)
{
    size_t length = 0;
    int c = cmd_otg_byte(self);
    if (c == EOF)
        return false;
    self->number++;
    for (; c != EOF && c != '\n'; c = cmd_otg_byte(self)) {
        if (c == 0)
            self->wrong = "a zero byte, expected text";
        if (length + 1 < sizeof self->line)
            self->line[length++] = (char)c;
        else
            self->wrong = "the line is too long: expected 16383 bytes at most";
    }
    self->line[length] = 0;
    return true;
}

static bool cmd_otg_is_empty(const char *line)
{
    line += strspn(line, " \t");
    return *line == '\0' || *line == '#';
}

/* The next one that is neither empty nor a comment. */
static bool cmd_otg_line(struct cmd_otg *self)
{
    self->wrong = NULL;
    do {
        if (!cmd_otg_any_line(self))
            return false;
    } while (self->wrong == NULL && cmd_otg_is_empty(self->line));
    return true;
}

/* --- one row -------------------------------------------------------------- */

static void cmd_otg_report(struct cmd_otg *self)
{
    const struct otg_answer *answer = &self->answer;
    char text[OTG_ANSWER_TEXT];
    if (self->rows != NULL)
        cJSON_AddItemToArray(self->rows,
                             otg_answer_json(answer, self->options->segments));
    else if (self->options->segments)
        otg_answer_segments(answer, stdout);
    else if (self->path == NULL)
        otg_answer_text(answer, stdout);
    else
        otg_answer_line(answer, stdout);
    if (self->rows == NULL)
        otg_answer_residuals(answer, stderr);
    if (self->options->segments && self->rows == NULL && answer->err < 0)
        error_say("row %ld: %s", answer->number,
                  otg_answer_status(answer, text));
}

static void cmd_otg_solve(struct cmd_otg *self, long number)
{
    self->row.wanted_s = self->options->wanted_s;
    otg_answer_make(&self->answer, number, &self->header, &self->row,
                    self->kind);
    self->answered++;
    self->refused += self->answer.err < 0;
    self->bent += self->answer.bent;
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
    bool is_line = cmd_otg_line(self);
    if (ferror(self->file))
        return cmd_otg_unreadable(self);
    if (!is_line) {
        self->number = 1;
        return cmd_otg_wrong(
            self, 1, "no header line, expected columns such as p0,v0,a0,pf");
    }
    const char *wrong = self->wrong;
    if (wrong == NULL)
        wrong = otg_header_parse(self->line, &self->header);
    return wrong == NULL ? STATUS_OK : cmd_otg_wrong(self, 1, wrong);
}

static enum status cmd_otg_row(struct cmd_otg *self, long number)
{
    int column = 1;
    const char *wrong = self->wrong;
    int64_t only = self->options->row;
    if (wrong == NULL)
        wrong = otg_row_parse(&self->header, self->line, &self->row, &column);
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

static enum status cmd_otg_rows(struct cmd_otg *self)
{
    int64_t only = self->options->row;
    enum status status = cmd_otg_header(self);
    if (status != STATUS_OK)
        return status;
    if (self->rows == NULL)
        puts(self->options->segments ? "row,axis,t,p,v,a,j"
                                     : "row,status,duration");
    long number = 0;
    while (status == STATUS_OK && (only < 0 || self->answered == 0) &&
           cmd_otg_line(self))
        status = cmd_otg_row(self, number++);
    if (status == STATUS_OK && only >= 0 && self->answered == 0) {
        error_say("%s: no row %ld, expected one of %ld, counted from 0",
                  self->path, (long)only, number);
        return STATUS_INPUT;
    }
    return status;
}

static enum status cmd_otg_file(struct cmd_otg *self, const char *path)
{
    bool standard = strcmp(path, "-") == 0;
    self->path = standard ? "standard input" : path;
    self->file = standard ? stdin : fopen(path, "r");
    if (self->file == NULL)
        return cmd_otg_unreadable(self);
    enum status status = cmd_otg_rows(self);
    if (status == STATUS_OK && ferror(self->file))
        status = cmd_otg_unreadable(self);
    if (!standard)
        fclose(self->file);
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
static bool cmd_otg_lacks(const struct cmd_otg *self)
{
    static const int limit[] = { OTG_VMAX, OTG_AMAX, OTG_JMAX };
    static const char *const name[] = { "--vmax", "--amax", "--jmax" };
    const char *missing[ARRAY_LEN(limit)];
    char list[QUOTE_LIST_MAX];
    unsigned count = 0;
    for (size_t i = 0; i < ARRAY_LEN(limit); i++)
        if (isnan(self->row.value[0][limit[i]]))
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
        return cmd_otg_fail("--row: expected with FILE");
    self->header.axes = 1;
    self->header.velocity = isnan(given[OTG_PF]);
    for (int i = 0; i < OTG_VALUES; i++)
        self->row.value[0][i] = cmd_otg_value(self, i);
    if (cmd_otg_lacks(self))
        return STATUS_INPUT;
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
    if (picture == NULL || self->answered == 0 || self->refused > 0)
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
        cJSON_AddBoolToObject(report, "ok",
                              status == STATUS_OK && self->refused == 0);
        cJSON_AddItemToObject(report, "rows", self->rows);
        json_print(report, stdout);
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

static enum status cmd_otg_run(const struct options *options)
{
    static struct cmd_otg self;
    bool numbers = cmd_otg_has_numbers(options);
    if (options->path_count > 1)
        return cmd_otg_fail("expected one FILE, or - for standard input");
    if (options->path_count == 1 && numbers)
        return cmd_otg_fail("expected a FILE or the numbers of one motion, "
                            "not both");
    if (options->plot != NULL && plot_format_of(options->plot) < 0)
        return cmd_otg_fail("--plot: expected FILE.svg or FILE.png");
    self = (struct cmd_otg){ .options = options };
    if (!cmd_otg_together(options->together, &self.kind))
        return cmd_otg_fail("--together: expected time, phase (on a line where "
                            "the states allow), straight or none");
    if (options->wanted_s < 0)
        return cmd_otg_fail("--duration: expected seconds, 0 or above");
    if (options->wanted_s > 0 && self.kind == MOTION_SYNC_NONE)
        return cmd_otg_fail("--duration: not with --together none, by which "
                            "each axis takes the least");
    self.rows = options->json ? cJSON_CreateArray() : NULL;
    enum status status = options->path_count == 1
                             ? cmd_otg_file(&self, options->path[0])
                             : cmd_otg_one(&self);
    if (status == STATUS_OK)
        return cmd_otg_finish(&self);
    cJSON_Delete(self.rows);
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
        "--vf alone to a velocity.\n",
    .examples = "  slew otg moves.csv\n"
                "  slew otg --segments - < moves.csv\n"
                "  slew otg --row 12 --plot row12.png moves.csv\n"
                "  slew otg --to 100 --vmax 10 --amax 20 --jmax 200 --plot "
                "move.png\n"
                "  slew otg --together straight --segments robot.csv\n"
                "  slew otg --v0 5 --vf -2 --amax 20 --jmax 200 --json\n",
    .path_optional = true,
    COMMAND_OPTIONS(cmd_otg_option),
    .run = cmd_otg_run,
};
