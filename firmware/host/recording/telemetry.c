/* firmware/host/recording/telemetry.c - see telemetry.h. */
#include "firmware/host/recording/telemetry.h"

#include <stddef.h>
#include <string.h>

#include "firmware/control/controller.h"
#include "firmware/host/base/number.h"
#include "firmware/host/base/quote.h"
#include "motion/core/err.h"
#include "motion/core/fixed.h"

static const char *const telemetry_spelling[] = {
#define TELEMETRY_SPELLING(name, spelling, text) spelling,
    TELEMETRY_PHASE_LIST(TELEMETRY_SPELLING)
#undef TELEMETRY_SPELLING
};

static const char *const telemetry_text[] = {
#define TELEMETRY_TEXT(name, spelling, text) text,
    TELEMETRY_PHASE_LIST(TELEMETRY_TEXT)
#undef TELEMETRY_TEXT
};

const char *telemetry_phase_spelling(enum telemetry_phase phase)
{
    return telemetry_spelling[phase];
}

const char *telemetry_phase_text(enum telemetry_phase phase)
{
    return telemetry_text[phase];
}

const struct telemetry_field telemetry_field[TELEMETRY_FIELDS] = {
#define TELEMETRY_FIELD(member) offsetof(struct telemetry_axis, member)
    { "demand", "", TELEMETRY_FIELD(demand.pos_q32), 32, 12 },
    { "demand", "_s", TELEMETRY_FIELD(demand.vel_q32), 32, 9 },
    { "demand", "_s2", TELEMETRY_FIELD(demand.acc_q32), 32, 9 },
    { "demand", "_s3", TELEMETRY_FIELD(demand.jerk_q32), 32, 9 },
    { "actual", "", TELEMETRY_FIELD(actual_q32), 32, 7 },
    { "actual", "_s", TELEMETRY_FIELD(actual_vel_q32), 32, 6 },
    { "following", "", TELEMETRY_FIELD(following_q32), 32, 7 },
#undef TELEMETRY_FIELD
};

static void telemetry_heading(const struct telemetry *telemetry)
{
    FILE *file = telemetry->rows.file;
    fputs("t_ns,phase,state,path_ns", file);
    for (uint32_t a = 0; a < telemetry->rig->axis_count; a++) {
        const struct rig_axis *axis = &telemetry->rig->axis[a];
        for (size_t f = 0; f < TELEMETRY_FIELDS; f++)
            fprintf(file, ",%s.%s_%s%s", axis->name, telemetry_field[f].name,
                    units_axis_text(axis->unit), telemetry_field[f].per);
        fprintf(file, ",%s.statusword", axis->name);
    }
    for (uint32_t i = 0; i < telemetry->rig->line_count; i++) {
        const struct rig_line *line = &telemetry->rig->line[i];
        if (line->kind == RIG_LINE_TRIGGER)
            fprintf(file, ",%s.shot,%s.shot_ns", line->name, line->name);
    }
    if (telemetry->has_faults)
        fputs(",faults", file);
    fputc('\n', file);
}

void telemetry_init(struct telemetry *telemetry, FILE *file,
                    const struct rig *rig, bool has_faults)
{
    telemetry->rig = rig;
    telemetry->has_faults = has_faults;
    rows_init(&telemetry->rows, file);
    telemetry_heading(telemetry);
    fflush(file);
}

int64_t telemetry_get(const struct telemetry_axis *axis, size_t field)
{
    int64_t value;
    memcpy(&value, (const char *)axis + telemetry_field[field].offset,
           sizeof value);
    return value;
}

void telemetry_set(struct telemetry_axis *axis, size_t field, int64_t value)
{
    memcpy((char *)axis + telemetry_field[field].offset, &value, sizeof value);
}

/* Five numbers, two words, and per axis seven numbers and a statusword. */
#define TELEMETRY_LINE_MAX                                                     \
    ((size_t)NUMBER_MAX * (5 + RIG_AXES_MAX * (TELEMETRY_FIELDS + 1) +         \
                           (size_t)2 * RIG_TRIGGERS_MAX))

static char *telemetry_put_text(char *at, const char *text)
{
    size_t length = strlen(text);
    *at++ = ',';
    memcpy(at, text, length);
    return at + length;
}

static char *telemetry_put_axis(char *at, const struct telemetry_axis *axis)
{
    for (size_t f = 0; f < TELEMETRY_FIELDS; f++) {
        *at++ = ',';
        at += number_fixed(at, telemetry_get(axis, f), telemetry_field[f].bits,
                           telemetry_field[f].digits);
    }
    *at++ = ',';
    return at + number_integer(at, axis->statusword);
}

static char *telemetry_put_shots(char *at, const struct rig *rig,
                                 const struct telemetry_row *row)
{
    unsigned count = 0;
    for (uint32_t i = 0; i < rig->line_count; i++) {
        if (rig->line[i].kind != RIG_LINE_TRIGGER)
            continue;
        const struct telemetry_shot *shot = &row->shot[count++];
        *at++ = ',';
        at += number_integer(at, shot->number);
        *at++ = ',';
        at += number_integer(at, shot->t_ns);
    }
    return at;
}

_Static_assert(TELEMETRY_LINE_MAX <= ROWS_BUFFER, "a row fits the buffer");

void telemetry_write(struct telemetry *telemetry,
                     const struct telemetry_row *row)
{
    char line[TELEMETRY_LINE_MAX];
    char *at = line + number_integer(line, row->t_ns);
    at = telemetry_put_text(at, telemetry_spelling[row->phase]);
    at = telemetry_put_text(
        at, controller_state_text((enum controller_state)row->state));
    *at++ = ',';
    at += number_exact(at, row->rate.s_ns_q12, 12);
    for (uint32_t a = 0; a < telemetry->rig->axis_count; a++)
        at = telemetry_put_axis(at, &row->axis[a]);
    at = telemetry_put_shots(at, telemetry->rig, row);
    if (telemetry->has_faults) { /* a bit per fault, 32 at most */
        *at++ = ',';
        at += number_integer(at, (int64_t)row->faults);
    }
    *at++ = '\n';
    rows_put(&telemetry->rows, line, (size_t)(at - line), row->t_ns);
}

/* --- reading back --- */

#define TELEMETRY_FIXED 4 /* columns before the first axis */

/* Where a column of the file goes: field TELEMETRY_FIELDS is the statusword,
 * the two after it are those of a trigger line, whose number is in `axis`, the
 * last one is the faults of a script. */
struct telemetry_column {
    unsigned axis;
    size_t field;
};
#define TELEMETRY_SHOT    (TELEMETRY_FIELDS + 1)
#define TELEMETRY_SHOT_NS (TELEMETRY_FIELDS + 2)
#define TELEMETRY_FAULTS  (TELEMETRY_FIELDS + 3)

struct telemetry_reader {
    struct files_lines lines;
    const char *path;
    unsigned long line;
    char *text;
    const struct rig *rig;
    struct memory_pool memory;
    struct telemetry_column *column;
    size_t columns, columns_max; /* in the file; that the rig can have */
    char *message;
};

static int telemetry_fail(struct telemetry_reader *reader, const char *what,
                          const char *expected)
{
    snprintf(reader->message, YAML_MESSAGE_MAX,
             "%.300s:%lu: %.60s, expected %s", reader->path, reader->line, what,
             expected);
    return -1;
}

/* About a cell of the file, NULL: it is missing. */
static int telemetry_fail_cell(struct telemetry_reader *reader,
                               const char *cell, const char *expected)
{
    char quote[QUOTE_MAX];
    return telemetry_fail(reader,
                          cell == NULL ? "the line ends"
                                       : quote_text(quote, cell, strlen(cell)),
                          expected);
}

/* 1, or 0 at the end; the line end is cut off. */
static int telemetry_line(struct telemetry_reader *reader)
{
    int64_t length = files_lines_next(&reader->lines);
    if (length < 0)
        return 0;
    reader->line++;
    reader->text = reader->lines.line;
    while (length > 0 && reader->text[length - 1] == '\r')
        reader->text[--length] = 0;
    return 1;
}

/* Cut off the next cell; NULL after the last. */
static char *telemetry_cell(char **rest)
{
    char *cell = *rest;
    if (cell == NULL)
        return NULL;
    char *comma = strchr(cell, ',');
    *rest = comma == NULL ? NULL : comma + 1;
    if (comma != NULL)
        *comma = 0;
    return cell;
}

static bool telemetry_is_field(const struct rig_axis *axis, size_t field,
                               const char *name)
{
    char expected[64] = "statusword";
    if (field < TELEMETRY_FIELDS)
        snprintf(expected, sizeof expected, "%s_%s%s",
                 telemetry_field[field].name, units_axis_text(axis->unit),
                 telemetry_field[field].per);
    return strcmp(name, expected) == 0;
}

/* "shot" or "shot_ns" of a trigger line. */
static bool telemetry_find_line(const struct rig *rig, const char *line,
                                const char *name,
                                struct telemetry_column *column)
{
    unsigned number = 0;
    column->field =
        strcmp(name, "shot") == 0 ? TELEMETRY_SHOT : TELEMETRY_SHOT_NS;
    if (column->field == TELEMETRY_SHOT_NS && strcmp(name, "shot_ns") != 0)
        return false;
    for (uint32_t i = 0; i < rig->line_count; i++) {
        if (rig->line[i].kind != RIG_LINE_TRIGGER)
            continue;
        column->axis = number++;
        if (strcmp(rig->line[i].name, line) == 0)
            return true;
    }
    return false;
}

static int telemetry_find(struct telemetry_reader *reader, char *name,
                          struct telemetry_column *column)
{
    char *dot = strchr(name, '.');
    column->field = TELEMETRY_FAULTS;
    if (strcmp(name, "faults") == 0)
        return 0;
    if (dot == NULL)
        return telemetry_fail_cell(reader, name, "a column of an axis");
    *dot = 0;
    if (telemetry_find_line(reader->rig, name, dot + 1, column))
        return 0;
    int axis = rig_axis_index(reader->rig, name);
    if (axis < 0)
        return telemetry_fail_cell(reader, name, "an axis of this rig");
    column->axis = (unsigned)axis;
    for (size_t f = 0; f <= TELEMETRY_FIELDS; f++) {
        column->field = f;
        if (telemetry_is_field(&reader->rig->axis[axis], f, dot + 1))
            return 0;
    }
    return telemetry_fail_cell(reader, dot + 1,
                               "a column of telemetry in the axis's unit");
}

static int telemetry_read_heading(struct telemetry_reader *reader)
{
    static const char *const fixed[TELEMETRY_FIXED] = { "t_ns", "phase",
                                                        "state", "path_ns" };
    char *rest = telemetry_line(reader) ? reader->text : NULL;
    if (rest == NULL)
        reader->line = 1; /* there is none: that is said of the first */
    for (size_t i = 0; i < TELEMETRY_FIXED; i++) {
        const char *name = telemetry_cell(&rest);
        if (name == NULL || strcmp(name, fixed[i]) != 0)
            return telemetry_fail(reader, "not the heading of telemetry",
                                  "t_ns,phase,state,path_ns,...");
    }
    for (char *name; (name = telemetry_cell(&rest)) != NULL;) {
        if (reader->columns == reader->columns_max)
            return telemetry_fail(reader, "too many columns",
                                  "each of an axis or a line once");
        if (telemetry_find(reader, name, &reader->column[reader->columns]) < 0)
            return -1;
        reader->columns++;
    }
    return 0;
}

static int telemetry_read_number(struct telemetry_reader *reader,
                                 const char *cell, unsigned bits,
                                 int64_t *value)
{
    const char *end;
    if (cell == NULL || number_parse(cell, bits, value, &end) < 0 || *end != 0)
        return telemetry_fail_cell(reader, cell, "a number");
    return 0;
}

static int telemetry_read_phase(struct telemetry_reader *reader,
                                const char *cell, struct telemetry_row *row)
{
    for (int i = 0; cell != NULL && i < TELEMETRY_PHASES; i++) {
        if (strcmp(cell, telemetry_spelling[i]) != 0)
            continue;
        row->phase = (enum telemetry_phase)i;
        return 0;
    }
    return telemetry_fail_cell(
        reader, cell, "a phase: enable, home, approach, move, settle or stop");
}

static int telemetry_read_column(struct telemetry_reader *reader,
                                 const char *cell,
                                 const struct telemetry_column *column,
                                 struct telemetry_row *row)
{
    struct telemetry_axis *axis = &row->axis[column->axis];
    int64_t value = 0;
    if (column->field >= TELEMETRY_FIELDS) {
        if (telemetry_read_number(reader, cell, 0, &value) < 0)
            return -1;
        if (column->field == TELEMETRY_FIELDS)
            axis->statusword = (uint16_t)value;
        else if (column->field == TELEMETRY_FAULTS)
            row->faults = (uint64_t)value;
        else if (column->field == TELEMETRY_SHOT)
            row->shot[column->axis].number = (uint32_t)value;
        else
            row->shot[column->axis].t_ns = value;
        return 0;
    }
    if (telemetry_read_number(reader, cell, telemetry_field[column->field].bits,
                              &value) < 0)
        return -1;
    telemetry_set(axis, column->field, value);
    return 0;
}

static int telemetry_read_row(struct telemetry_reader *reader,
                              struct telemetry_row *row)
{
    char *rest = reader->text;
    if (telemetry_read_number(reader, telemetry_cell(&rest), 0, &row->t_ns) <
            0 ||
        telemetry_read_phase(reader, telemetry_cell(&rest), row) < 0)
        return -1;
    telemetry_cell(&rest); /* the state's name is for people */
    if (telemetry_read_number(reader, telemetry_cell(&rest), 12,
                              &row->rate.s_ns_q12) < 0)
        return -1;
    for (size_t i = 0; i < reader->columns; i++)
        if (telemetry_read_column(reader, telemetry_cell(&rest),
                                  &reader->column[i], row) < 0)
            return -1;
    return rest == NULL ? 0
                        : telemetry_fail(reader, "more cells than columns",
                                         "one cell per column");
}

static int telemetry_read_all(struct telemetry_reader *reader,
                              void (*take)(void *context,
                                           const struct telemetry_row *row),
                              void *context)
{
    const struct rig *rig = reader->rig;
    struct memory_pool *memory = &reader->memory;
    struct telemetry_row row = { .shot_count = rig_trigger_count(rig) };
    row.axis = memory_pool_new(memory, rig->axis_count, sizeof *row.axis);
    row.shot = memory_pool_new(memory, row.shot_count, sizeof *row.shot);
    reader->columns_max = (size_t)rig->axis_count * (TELEMETRY_FIELDS + 1) +
                          (size_t)2 * row.shot_count + 1;
    reader->column =
        memory_pool_new(memory, reader->columns_max, sizeof *reader->column);
    if (telemetry_read_heading(reader) < 0)
        return -1;
    while (telemetry_line(reader)) {
        if (telemetry_read_row(reader, &row) < 0)
            return -1;
        take(context, &row);
    }
    if (reader->lines.error < 0)
        return telemetry_fail(reader, strerror(-reader->lines.error),
                              "to read on");
    return 0;
}

int telemetry_read(const struct files *files, const char *path,
                   const struct rig *rig,
                   void (*take)(void *context, const struct telemetry_row *row),
                   void *context, char message[YAML_MESSAGE_MAX])
{
    struct telemetry_reader reader = { .path = path,
                                       .rig = rig,
                                       .message = message };
    int err = files_lines_open(&reader.lines, files, path);
    if (err < 0) {
        snprintf(message, YAML_MESSAGE_MAX, "%.300s: %s", path, strerror(-err));
        return -1;
    }
    err = telemetry_read_all(&reader, take, context);
    memory_pool_free(&reader.memory);
    files_lines_close(&reader.lines);
    return err;
}
