/* firmware/host/exchange/import_table.c - tables of positions, a row per
 * frame.
 *
 * Kuper ASCII, Flair ascii, Dragonframe raw and CSV differ in what stands above
 * the numbers.  Each head names every column, import_columns.c says what that is,
 * and the rows are read by one loop.  Numbers are in the axes' own units where the
 * name of a column has no other. */
#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "firmware/host/base/decimal.h"
#include "firmware/host/base/memory.h"
#include "firmware/host/exchange/import.h"
#include "motion/core/err.h"
#include "motion/core/fixed.h"

struct table_column {
    enum import_part part;
    struct plan_axis *axis; /* of a position, velocity or acceleration */
    enum units_axis unit;
    char after[IMPORT_UNIT_MAX + 1]; /* the unit behind its numbers; "": own */
};

struct table_read {
    struct import_text text;
    const struct import_settings *settings;
    struct imported *out;
    struct table_column column[IMPORT_COLUMNS_MAX];
    struct import_word cell[IMPORT_COLUMNS_MAX + 1]; /* of a row */
    char separator; /* of cells; 0: blanks and commas */
    const char *separators;
    int64_t rows, rows_said; /* -1: not said */
    int64_t first_ns_q12, last_ns_q12;
    struct import_column *time; /* the column of times; NULL: none */
    unsigned decimals;          /* of its numbers, at most */
};

static int table_fail(const struct table_read *self, const char *what)
{
    return yaml_report_at(&self->text.report, import_text_place(&self->text),
                          "%s", what);
}

/* --- columns --- */

static int table_add(struct table_read *self, const struct import_word *word)
{
    return import_add_column(&self->text, word->place, self->out, word->text,
                             word->text);
}

static struct plan_axis *table_axis(const struct table_read *self, int axis)
{
    struct plan_move *move = &self->out->move;

    for (unsigned i = 0; i < move->axis_count; i++)
        if (strcmp(move->axis[i].name, self->settings->rig->axis[axis].name) ==
            0)
            return &move->axis[i];
    return NULL;
}

static int table_take_time(struct table_read *self,
                           struct import_column *column)
{
    char first[IMPORT_NAME_MAX];

    if (self->time == NULL) {
        self->time = column;
        return 0;
    }
    snprintf(first, sizeof first, "%s", self->time->name);
    return yaml_report_at(&self->text.report, column->place,
                          "'%s' is a second column of times beside '%s', "
                          "expected one: --columns names what each column is",
                          column->name, first);
}

/* Positions first, so that velocities find theirs. */
static int table_take_columns(struct table_read *self, bool positions)
{
    const struct import_settings *settings = self->settings;

    for (unsigned i = 0; i < self->out->columns; i++) {
        struct import_column *column = &self->out->column[i];
        struct table_column *to = &self->column[i];
        if ((column->part == IMPORT_POSITION) != positions)
            continue;
        to->part = column->part;
        snprintf(to->after, sizeof to->after, "%s%s",
                 column->unit[0] != 0 ? " " : "", column->unit);
        if (column->part >= IMPORT_FRAMES && column->part <= IMPORT_TIMECODES &&
            table_take_time(self, column) < 0)
            return -1;
        if (column->axis < 0)
            continue;
        to->unit = settings->rig->axis[column->axis].unit;
        to->axis = positions ? import_add_axis(&self->text, settings, self->out,
                                               column)
                             : table_axis(self, column->axis);
        if (to->axis == NULL && positions)
            return -1;
        if (to->axis == NULL)
            return yaml_report_at(&self->text.report, column->place,
                                  "'%s' is of axis %s, whose positions are in "
                                  "no column",
                                  column->name,
                                  settings->rig->axis[column->axis].name);
    }
    return 0;
}

static int table_columns(struct table_read *self)
{
    if (import_name_columns(&self->text, self->settings, self->out) < 0 ||
        table_take_columns(self, true) < 0)
        return -1;
    return table_take_columns(self, false);
}

/* Velocities must be there with accelerations, and then the curve is quintic
 * through all of them. */
static void table_choose_curve(struct table_read *self)
{
    for (unsigned i = 0; i < self->out->columns; i++)
        if (self->column[i].part == IMPORT_ACCELERATION)
            self->column[i].axis->curve = PLAN_CURVE_QUINTIC;
        else if (self->column[i].part == IMPORT_VELOCITY)
            self->column[i].axis->curve = PLAN_CURVE_HERMITE;
    for (unsigned i = 0; i < self->out->columns; i++)
        if (self->column[i].part == IMPORT_ACCELERATION)
            self->column[i].axis->curve = PLAN_CURVE_QUINTIC;
}

/* --- rows --- */

static int table_time_of(struct table_read *self, enum import_part part,
                         const struct table_column *column,
                         const struct import_word *word, int64_t *t_ns_q12)
{
    const struct units_context context = { .fps = self->out->fps };
    const char *point = strchr(word->text, self->text.has_comma ? ',' : '.');
    const unsigned decimals =
        point == NULL ? 0 : (unsigned)strspn(point + 1, "0123456789");
    char sentence[UNITS_SENTENCE_MAX];

    self->decimals = decimals > self->decimals ? decimals : self->decimals;
    if (self->rows == 0)
        snprintf(self->out->first, sizeof self->out->first, "%.63s",
                 word->text);
    if (part != IMPORT_TIMECODES)
        return import_text_number(
            &self->text, word, part == IMPORT_FRAMES ? "f" : "", column->after,
            UNITS_TIME, &context, t_ns_q12);
    return units_parse(word->text, UNITS_TIME, &context, t_ns_q12, sentence) ==
                   0
               ? 0
               : yaml_report_at(&self->text.report, word->place, "%s",
                                sentence);
}

static int table_nameless(const struct table_read *self, unsigned i,
                          const struct import_word *word)
{
    if (word->text[0] == 0)
        return 0;
    return yaml_report_at(&self->text.report, word->place,
                          "column %u has no name, expected one in the first "
                          "line, or --columns with what each column is",
                          i + 1);
}

static int table_take(struct table_read *self, unsigned i, int64_t *t_ns_q12)
{
    const struct table_column *column = &self->column[i];
    const struct units_context context = { .unit = column->unit };
    const struct import_word *word = &self->cell[i];
    static const enum units_quantity quantity[] = {
        [IMPORT_POSITION] = UNITS_POSITION,
        [IMPORT_VELOCITY] = UNITS_VELOCITY,
        [IMPORT_ACCELERATION] = UNITS_ACCELERATION
    };
    int64_t value = 0;

    if (column->part == IMPORT_NAMELESS)
        return table_nameless(self, i, word);
    if (column->part == IMPORT_LEFT_OUT)
        return 0;
    if (column->axis == NULL)
        return table_time_of(self, column->part, column, word, t_ns_q12);
    if (import_text_number(&self->text, word, "", column->after,
                           quantity[column->part], &context, &value) < 0)
        return -1;
    struct motion_key *key =
        &column->axis->key[column->axis->key_count - 1].key;
    if (column->part == IMPORT_POSITION) {
        key->pos_q32 = value;
    } else if (column->part == IMPORT_VELOCITY) {
        key->has_vel = true;
        key->vel = motion_real_from_q(value, 32);
    } else {
        key->has_acc = true;
        key->acc = motion_real_from_q(value, 32);
    }
    return 0;
}

/* Times count from the first row. */
static int table_place_row(struct table_read *self, struct plan_place place,
                           int64_t t_ns_q12)
{
    if (self->rows == 0)
        self->first_ns_q12 = t_ns_q12;
    else if (t_ns_q12 <= self->last_ns_q12)
        return yaml_report_at(&self->text.report, place,
                              "the time is not later than that of the row "
                              "before");
    self->last_ns_q12 = t_ns_q12;
    if (motion_fixed_sub(t_ns_q12, self->first_ns_q12, &t_ns_q12) < 0 ||
        t_ns_q12 > MOTION_TRACK_MAX_NS_Q12)
        return yaml_report_at(&self->text.report, place,
                              "the time is more than 19 days after the first");
    for (unsigned i = 0; i < self->out->move.axis_count; i++) {
        struct plan_axis *axis = &self->out->move.axis[i];
        axis->key[axis->key_count - 1].key.t_ns_q12 = t_ns_q12;
    }
    self->rows++;
    return 0;
}

static int table_next(struct table_read *self, struct import_word *word)
{
    return self->separator != 0
               ? import_text_cell(&self->text, self->separator, word)
               : import_text_word(&self->text, self->separators, word);
}

/* A comma between two digits of the line, in a table where it parts them. */
static bool table_has_comma(const struct table_read *self)
{
    const char *line = self->text.data;

    for (size_t at = self->text.line_start + 1; at + 1 < self->text.line_end;
         at++)
        if (line[at] == ',' && decimal_is_digit(line[at - 1]) &&
            decimal_is_digit(line[at + 1]))
            return self->separator == 0 && !self->text.has_comma;
    return false;
}

/* The cells of a row.  1; 0: all of them are empty; -1. */
static int table_cells(struct table_read *self)
{
    const unsigned columns = self->out->columns;
    unsigned count = 0, filled = 0;
    int found;

    while ((found = table_next(self, &self->cell[count])) > 0) {
        const bool is_filled = self->cell[count].text[0] != 0;
        filled += is_filled;
        if (count == columns && is_filled)
            return yaml_report_at(&self->text.report, self->cell[count].place,
                                  "the row has more than %u columns%s", columns,
                                  table_has_comma(self)
                                      ? "; --decimal comma reads 0,5 as a half"
                                      : "");
        count += count < columns;
    }
    if (found < 0)
        return -1;
    struct plan_place end = import_text_place(&self->text);
    end.column -=
        self->text.at > self->text.line_end; /* the LF has been read */
    if (filled > 0 && count < columns)
        return yaml_report_at(&self->text.report, end,
                              "the row ends after %u of %u columns", count,
                              columns);
    return filled > 0;
}

static int table_row(struct table_read *self)
{
    const struct plan_place place = { self->text.line, 1 };
    const int filled = table_cells(self);
    int64_t t_ns_q12 = 0;

    if (filled <= 0)
        return filled;
    for (unsigned i = 0; i < self->out->move.axis_count; i++)
        if (import_add_key(&self->text, place, &self->out->move.axis[i]) ==
            NULL)
            return -1;
    for (unsigned i = 0; i < self->out->columns; i++)
        if (table_take(self, i, &t_ns_q12) < 0)
            return -1;
    if (self->time == NULL)
        t_ns_q12 = import_frame_ns_q12(&self->out->fps, self->rows);
    return table_place_row(self, place, t_ns_q12);
}

/* Times of few decimals that are frames of the rate that was said, but for what
 * their last digit rounds, are these. */
static void table_round(struct table_read *self)
{
    const struct units_fps *fps = &self->settings->fps;
    const struct plan_move *move = &self->out->move;
    char text[64], sentence[UNITS_SENTENCE_MAX];
    int64_t step_ns_q12;

    if (self->time == NULL || self->time->part != IMPORT_TIMES || fps->den == 0)
        return;
    snprintf(text, sizeof text, "1e-%u %s", self->decimals, self->time->unit);
    if (units_parse(text, UNITS_TIME, &(struct units_context){ .fps = *fps },
                    &step_ns_q12, sentence) < 0 ||
        4 * step_ns_q12 > import_frame_ns_q12(fps, 1))
        return;
    for (uint32_t k = 0; k < move->axis[0].key_count; k++) {
        const int64_t t_ns_q12 = move->axis[0].key[k].key.t_ns_q12;
        const int64_t frame =
            import_frame_ns_q12(fps, import_frame_near(fps, t_ns_q12));
        if (motion_fixed_abs(t_ns_q12 - frame) > (uint64_t)step_ns_q12)
            return;
    }
    for (uint32_t i = 0; i < move->axis_count; i++)
        for (uint32_t k = 0; k < move->axis[i].key_count; k++) {
            int64_t *t_ns_q12 = &move->axis[i].key[k].key.t_ns_q12;
            *t_ns_q12 =
                import_frame_ns_q12(fps, import_frame_near(fps, *t_ns_q12));
        }
    snprintf(self->time->unit, sizeof self->time->unit, "%s, rounded frames",
             self->column[self->time - self->out->column].after + 1);
}

static int table_rows(struct table_read *self, char comment)
{
    table_choose_curve(self);
    while ((self->rows_said < 0 || self->rows < self->rows_said) &&
           import_text_filled(&self->text, comment))
        if (table_row(self) < 0)
            return -1;
    if (self->rows == 0)
        return table_fail(self, "there are no rows of positions");
    if (self->rows_said >= 0 && self->rows < self->rows_said)
        return yaml_report_at(
            &self->text.report, import_text_place(&self->text),
            "the file ends after %lld rows, expected the "
            "%lld that it gives",
            (long long)self->rows, (long long)self->rows_said);
    table_round(self);
    if (self->rows_said >= 0 && import_text_filled(&self->text, comment))
        snprintf(self->out->note, IMPORT_NOTE_MAX,
                 "what stands behind the last row that is announced, from line "
                 "%u on",
                 self->text.line);
    return 0;
}

static int table_need_fps(const struct table_read *self)
{
    if (self->out->fps.den != 0 ||
        (self->time != NULL && self->time->part == IMPORT_TIMES))
        return 0;
    return yaml_report_at(&self->text.report, (struct plan_place){ 1, 1 },
                          "the file gives no frame rate, expected --fps");
}

/* One reader: load, head, columns, rows. */
static int table_read(const struct files *files, const char *path,
                      const struct import_settings *settings,
                      struct imported *imported, char *message,
                      int (*head)(struct table_read *self), char comment)
{
    struct table_read *self = memory_new(1, sizeof *self);
    *self = (struct table_read){ .settings = settings,
                                 .out = imported,
                                 .separators = settings->has_comma ? "" : ",",
                                 .rows_said = -1 };
    *imported =
        (struct imported){ .fps = settings->fps, .column_word = "column" };
    int err =
        import_text_load(&self->text, files, path, message, YAML_MESSAGE_MAX);
    self->text.progress = settings->progress;
    self->text.has_comma = settings->has_comma;
    if (err == 0)
        err = head(self);
    if (err == 0)
        err = table_columns(self);
    if (err == 0)
        err = table_need_fps(self);
    if (err == 0)
        err = table_rows(self, comment);
    import_text_free(&self->text);
    memory_free(self);
    if (err < 0)
        move_free(&imported->move);
    return err;
}

/* --- Kuper: "Axes = Pan, Tilt" --- */

static int table_kuper_head(struct table_read *self)
{
    struct import_word word;
    int found = 0;
    if (!import_text_filled(&self->text, 0))
        return table_fail(self, "the file is empty, expected 'Axes = ...'");
    found = import_text_word(&self->text, "=", &word);
    if (found < 0)
        return -1;
    if (found == 0 || !import_text_same(word.text, "axes"))
        return yaml_report_at(&self->text.report,
                              (struct plan_place){ self->text.line, 1 },
                              "the first line does not name the axes, "
                              "expected 'Axes = Pan, Tilt'");
    while ((found = import_text_word(&self->text, "=,", &word)) > 0)
        if (table_add(self, &word) < 0)
            return -1;
    return found;
}

int import_kuper(const struct files *files, const char *path,
                 const struct import_settings *settings,
                 struct imported *imported, char message[YAML_MESSAGE_MAX])
{
    return table_read(files, path, settings, imported, message,
                      table_kuper_head, 0);
}

/* --- Flair: three lines, then rows --- */

static int table_flair_speed(struct table_read *self, const char *key,
                             const struct import_word *word)
{
    const struct units_context context = { 0 };
    int64_t rows_q32;
    if (import_text_same(key, "speed")) {
        char sentence[UNITS_SENTENCE_MAX];
        if (self->settings->fps.den == 0 &&
            units_parse_fps(word->text, &self->out->fps, sentence) < 0)
            return yaml_report_at(&self->text.report, word->place, "%s",
                                  sentence);
        return 0;
    }
    if (!import_text_same(key, "points"))
        return 0;
    if (import_text_number(&self->text, word, "", "", UNITS_RATIO, &context,
                           &rows_q32) < 0)
        return -1;
    if (rows_q32 < MOTION_FIXED_ONE_Q32 ||
        (rows_q32 & (MOTION_FIXED_ONE_Q32 - 1)) != 0)
        return yaml_report_at(&self->text.report, word->place,
                              "the number of points is not a whole one above "
                              "zero");
    self->rows_said = rows_q32 >> 32;
    return 0;
}

static int table_flair_points(struct table_read *self)
{
    struct import_word key, value;
    int found;
    while ((found = import_text_word(&self->text, "", &key)) > 0) {
        found = import_text_word(&self->text, "", &value);
        if (found == 0)
            return yaml_report_at(&self->text.report, key.place,
                                  "there is no value after this word");
        if (found < 0 || table_flair_speed(self, key.text, &value) < 0)
            return -1;
    }
    if (found == 0 && self->rows_said < 0)
        return table_fail(self, "the second line has no POINTS");
    return found;
}

static int table_flair_head(struct table_read *self)
{
    struct import_word word;
    int found;
    if (!import_text_filled(&self->text, '#') ||
        (found = import_text_word(&self->text, "", &word)) == 0)
        return table_fail(self, "the file is empty, expected 'DATA_TYPE ...'");
    if (found < 0)
        return -1;
    if (!import_text_same(word.text, "data_type"))
        return yaml_report_at(&self->text.report, word.place,
                              "the first line does not begin with DATA_TYPE");
    if (!import_text_filled(&self->text, '#'))
        return table_fail(self, "the file ends, expected 'POINTS ... SPEED'");
    if (table_flair_points(self) < 0)
        return -1;
    if (!import_text_filled(&self->text, '#'))
        return table_fail(self, "the file ends, expected names of columns");
    while ((found = import_text_word(&self->text, ",", &word)) > 0)
        if (table_add(self, &word) < 0)
            return -1;
    return found;
}

int import_flair(const struct files *files, const char *path,
                 const struct import_settings *settings,
                 struct imported *imported, char message[YAML_MESSAGE_MAX])
{
    return table_read(files, path, settings, imported, message,
                      table_flair_head, '#');
}

/* --- Dragonframe raw: nothing above the numbers --- */

/* As many columns as the first row has. */
static int table_raw_head(struct table_read *self)
{
    const struct import_settings *settings = self->settings;
    const struct import_text begin = self->text;
    struct import_word word;
    char names[IMPORT_NAMES_MAX];
    int found = 0;

    if (!import_text_filled(&self->text, 0))
        return table_fail(self, "there are no rows of positions");
    while ((found = table_next(self, &word)) > 0) {
        word.text[0] = 0;
        if (table_add(self, &word) < 0)
            return -1;
    }
    self->text = begin;
    if (found < 0 || settings->column_count > 0)
        return found;
    if (settings->rig->axis_count == 1 && self->out->columns == 1) {
        snprintf(self->out->column[0].called, IMPORT_NAME_MAX, "%s",
                 settings->rig->axis[0].name);
        return 0;
    }
    import_axis_names(settings->rig, names);
    return yaml_report_at(&self->text.report, (struct plan_place){ 1, 1 },
                          "the file does not name its axes, expected "
                          "--columns with what each of its %u columns is, such "
                          "as --columns %.400s",
                          self->out->columns, names);
}

int import_raw(const struct files *files, const char *path,
               const struct import_settings *settings,
               struct imported *imported, char message[YAML_MESSAGE_MAX])
{
    return table_read(files, path, settings, imported, message, table_raw_head,
                      0);
}

/* --- CSV: names of columns --- */

/* What parts the names of the first line, outside quotes. */
static char table_csv_separator(const struct import_text *text)
{
    const char *line = text->data + text->line_start;
    const size_t length = text->line_end - text->line_start;
    bool has[UCHAR_MAX + 1] = { false }, is_quoted = false;

    for (size_t i = 0; i < length; i++) {
        is_quoted ^= line[i] == '"';
        has[(unsigned char)line[i]] |= !is_quoted;
    }
    return (char)(has[';'] ? ';' : has['\t'] ? '\t' : ',');
}

/* "sep=;", which some spreadsheets put first. */
static bool table_csv_says(struct table_read *self)
{
    const char *line = self->text.data + self->text.line_start;

    if (self->text.line_end - self->text.line_start != 5 ||
        strncmp(line, "sep=", 4) != 0)
        return false;
    self->separator = line[4];
    return true;
}

static int table_csv_head(struct table_read *self)
{
    struct import_word word;
    int found;
    if (!import_text_filled(&self->text, '#') ||
        (table_csv_says(self) && !import_text_filled(&self->text, '#')))
        return table_fail(self, "the file is empty, expected names of "
                                "columns");
    if (self->separator == 0)
        self->separator = table_csv_separator(&self->text);
    while ((found = import_text_cell(&self->text, self->separator, &word)) > 0)
        if (table_add(self, &word) < 0)
            return -1;
    return found;
}

int import_csv(const struct files *files, const char *path,
               const struct import_settings *settings,
               struct imported *imported, char message[YAML_MESSAGE_MAX])
{
    return table_read(files, path, settings, imported, message, table_csv_head,
                      '#');
}
