/* firmware/host/exchange/import_table.c - tables of positions, a row per
 * frame.
 *
 * Kuper ASCII, Flair ascii, Dragonframe raw and CSV differ in what stands above
 * the numbers.  Each head says what every column is; the rows are read by one
 * loop.  Numbers are in the axes' own units. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "firmware/host/base/array.h"
#include "firmware/host/base/memory.h"
#include "firmware/host/exchange/import.h"
#include "motion/core/err.h"
#include "motion/core/fixed.h"

enum table_kind {
    TABLE_POS,
    TABLE_VEL,
    TABLE_ACC,
    TABLE_FRAME,
    TABLE_SECONDS,
    TABLE_NS,
    TABLE_SKIP,
};

struct table_column {
    enum table_kind kind;
    struct plan_axis *axis; /* of POS, VEL, ACC */
    enum units_axis unit;
};

struct table_read {
    struct import_text text;
    const struct import_wish *wish;
    struct imported *out;
    struct table_column column[IMPORT_COLUMNS_MAX];
    unsigned columns;
    unsigned positions; /* columns with axes, so far */
    char separator;     /* of cells; 0: blanks and commas */
    const char *separators;
    int64_t rows, rows_said; /* -1: not said */
    int64_t first_ns_q12, last_ns_q12;
    bool timed;
};

static int table_fail(const struct table_read *self, const char *what)
{
    return yaml_report_at(&self->text.report, import_text_place(&self->text),
                          "%s", what);
}

/* --- columns --- */

static int table_add(struct table_read *self, struct plan_place place,
                     struct table_column column)
{
    if (self->columns == IMPORT_COLUMNS_MAX)
        return yaml_report_at(&self->text.report, place,
                              "there are more than %d columns",
                              IMPORT_COLUMNS_MAX);
    self->column[self->columns++] = column;
    return 0;
}

/* A column of positions, by its name or by what the user said of it. */
static int table_add_axis(struct table_read *self, struct plan_place place,
                          const char *name)
{
    const struct import_wish *wish = self->wish;
    struct table_column column = { .kind = TABLE_POS };
    if (wish->column_count > 0) {
        if (self->positions >= wish->column_count)
            return yaml_report_at(&self->text.report, place,
                                  "column %u has no axis, expected as many "
                                  "names in --columns as columns",
                                  self->positions + 1);
        name = wish->column[self->positions];
    }
    self->positions++;
    if (strcmp(name, "-") == 0) {
        column.kind = TABLE_SKIP;
        return table_add(self, place, column);
    }
    column.axis = import_add_axis(&self->text, place, wish, self->out, name);
    if (column.axis == NULL)
        return -1;
    column.unit =
        wish->rig->axis[rig_axis_index(wish->rig, column.axis->name)].unit;
    return table_add(self, place, column);
}

static const struct {
    const char *name;
    enum table_kind kind;
} table_time[] = {
    { "frame", TABLE_FRAME },    { "t", TABLE_SECONDS },
    { "time", TABLE_SECONDS },   { "t_s", TABLE_SECONDS },
    { "time_s", TABLE_SECONDS }, { "t_ns", TABLE_NS },
};

bool import_is_time(const char *name)
{
    for (size_t i = 0; i < ARRAY_LEN(table_time); i++)
        if (import_text_same(name, table_time[i].name))
            return true;
    return false;
}

static bool table_has_axis(const struct table_read *self, const char *name)
{
    for (unsigned i = 0; i < self->wish->rig->axis_count; i++)
        if (strcmp(self->wish->rig->axis[i].name, name) == 0)
            return true;
    return false;
}

static int table_add_named(struct table_read *self,
                           const struct import_word *word)
{
    if (import_is_time(word->text) && table_has_axis(self, word->text))
        return yaml_report_at(&self->text.report, word->place,
                              "'%s' is an axis of the rig and a column of "
                              "times, expected another name",
                              word->text);
    for (size_t i = 0; i < ARRAY_LEN(table_time); i++) {
        if (!import_text_same(word->text, table_time[i].name))
            continue;
        if (self->timed)
            return yaml_report_at(&self->text.report, word->place,
                                  "there is a second column of times");
        self->timed = true;
        return table_add(self, word->place,
                         (struct table_column){ .kind = table_time[i].kind });
    }
    return table_add_axis(self, word->place, word->text);
}

/* "pan_deg" is pan, "pan_deg_s" its velocity, "pan_deg_s2" its acceleration, as
 * slew sample names them. */
static int table_add_csv(struct table_read *self, struct import_word *word)
{
    struct imported *out = self->out;
    for (unsigned i = 0; i < self->wish->rig->axis_count; i++) {
        const struct rig_axis *rig = &self->wish->rig->axis[i];
        char stem[2 * PLAN_NAME_MAX];
        int n = snprintf(stem, sizeof stem, "%s_%s", rig->name,
                         units_axis_text(rig->unit));
        if (strncmp(word->text, stem, (size_t)n) != 0)
            continue;
        const char *rest = word->text + n;
        struct table_column column = { .unit = rig->unit };
        if (rest[0] == 0) {
            return table_add_axis(self, word->place, rig->name);
        }
        column.kind = strcmp(rest, "_s") == 0    ? TABLE_VEL
                      : strcmp(rest, "_s2") == 0 ? TABLE_ACC
                                                 : TABLE_SKIP;
        for (unsigned k = 0; k < out->move.axis_count; k++)
            if (strcmp(out->move.axis[k].name, rig->name) == 0)
                column.axis = &out->move.axis[k];
        if (column.kind != TABLE_SKIP && column.axis != NULL &&
            self->wish->column_count == 0)
            return table_add(self, word->place, column);
    }
    return table_add_named(self, word);
}

/* Velocities must be there with accelerations, and then the curve is quintic
 * through all of them. */
static void table_choose_curve(struct table_read *self)
{
    for (unsigned i = 0; i < self->columns; i++)
        if (self->column[i].kind == TABLE_ACC)
            self->column[i].axis->curve = PLAN_CURVE_QUINTIC;
        else if (self->column[i].kind == TABLE_VEL)
            self->column[i].axis->curve = PLAN_CURVE_HERMITE;
    for (unsigned i = 0; i < self->columns; i++)
        if (self->column[i].kind == TABLE_ACC)
            self->column[i].axis->curve = PLAN_CURVE_QUINTIC;
}

/* --- rows --- */

static int table_time_of(struct table_read *self, enum table_kind kind,
                         const struct import_word *word, int64_t *t_ns_q12)
{
    const struct units_context context = { .fps = self->out->fps };
    return import_text_number(&self->text, word, kind == TABLE_FRAME ? "f" : "",
                              kind == TABLE_FRAME     ? ""
                              : kind == TABLE_SECONDS ? "s"
                                                      : "ns",
                              UNITS_TIME, &context, t_ns_q12);
}

static int table_take(struct table_read *self,
                      const struct table_column *column,
                      const struct import_word *word, int64_t *t_ns_q12)
{
    const struct units_context context = { .unit = column->unit };
    struct motion_key *key;
    if (column->kind == TABLE_SKIP)
        return 0;
    if (column->axis == NULL)
        return table_time_of(self, column->kind, word, t_ns_q12);
    key = &column->axis->key[column->axis->key_count - 1].key;
    if (column->kind == TABLE_POS)
        return import_text_number(&self->text, word, "", "", UNITS_POSITION,
                                  &context, &key->pos_q32);
    const bool is_vel = column->kind == TABLE_VEL;
    int64_t value = 0;
    const int rc = import_text_number(
        &self->text, word, "", "", is_vel ? UNITS_VELOCITY : UNITS_ACCELERATION,
        &context, &value);
    if (is_vel) {
        key->has_vel = true;
        key->vel = motion_real_from_q(value, 32);
    } else {
        key->has_acc = true;
        key->acc = motion_real_from_q(value, 32);
    }
    return rc;
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

static int table_row(struct table_read *self)
{
    struct plan_place place = { self->text.line, 1 };
    struct import_word word;
    int64_t t_ns_q12 = 0;
    for (unsigned i = 0; i < self->out->move.axis_count; i++)
        if (import_add_key(&self->text, place, &self->out->move.axis[i]) ==
            NULL)
            return -1;
    for (unsigned i = 0; i < self->columns; i++) {
        int found = table_next(self, &word);
        if (found == 0)
            return yaml_report_at(
                &self->text.report, import_text_place(&self->text),
                "the row ends after %u of %u columns", i, self->columns);
        if (found < 0 ||
            table_take(self, &self->column[i], &word, &t_ns_q12) < 0)
            return -1;
    }
    if (table_next(self, &word) != 0)
        return yaml_report_at(&self->text.report, word.place,
                              "the row has more than %u columns",
                              self->columns);
    if (!self->timed)
        t_ns_q12 = import_frame_ns_q12(&self->out->fps, self->rows);
    return table_place_row(self, place, t_ns_q12);
}

static int table_rows(struct table_read *self, char comment)
{
    if (self->out->move.axis_count == 0)
        return table_fail(self, "there are no columns with axes");
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
    return 0;
}

static int table_need_fps(const struct table_read *self)
{
    if (self->out->fps.den != 0)
        return 0;
    return yaml_report_at(&self->text.report, (struct plan_place){ 1, 1 },
                          "the file gives no frame rate, expected --fps");
}

/* One reader: load, head, rows. */
static int table_read(const struct files *files, const char *path,
                      const struct import_wish *wish, struct imported *imported,
                      char *message, int (*head)(struct table_read *self),
                      char comment)
{
    struct table_read *self = memory_new(1, sizeof *self);
    *self = (struct table_read){
        .wish = wish, .out = imported, .separators = ",", .rows_said = -1
    };
    *imported = (struct imported){ .fps = wish->fps };
    int err =
        import_text_load(&self->text, files, path, message, YAML_MESSAGE_MAX);
    self->text.progress = wish->progress;
    if (err == 0)
        err = head(self);
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
    if (table_need_fps(self) < 0)
        return -1;
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
        if (table_add_named(self, &word) < 0)
            return -1;
    return found;
}

int import_kuper(const struct files *files, const char *path,
                 const struct import_wish *wish, struct imported *imported,
                 char message[YAML_MESSAGE_MAX])
{
    return table_read(files, path, wish, imported, message, table_kuper_head,
                      0);
}

/* --- Flair: three lines, then rows --- */

static int table_flair_speed(struct table_read *self, const char *key,
                             const struct import_word *word)
{
    const struct units_context context = { 0 };
    int64_t rows_q32;
    if (import_text_same(key, "speed")) {
        char sentence[UNITS_SENTENCE_MAX];
        if (self->wish->fps.den == 0 &&
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
    if (table_flair_points(self) < 0 || table_need_fps(self) < 0)
        return -1;
    if (!import_text_filled(&self->text, '#'))
        return table_fail(self, "the file ends, expected names of columns");
    while ((found = import_text_word(&self->text, ",", &word)) > 0)
        if (table_add_named(self, &word) < 0)
            return -1;
    return found;
}

int import_flair(const struct files *files, const char *path,
                 const struct import_wish *wish, struct imported *imported,
                 char message[YAML_MESSAGE_MAX])
{
    return table_read(files, path, wish, imported, message, table_flair_head,
                      '#');
}

/* --- Dragonframe raw: nothing above the numbers --- */

static int table_raw_head(struct table_read *self)
{
    const struct import_wish *wish = self->wish;
    unsigned count =
        wish->column_count > 0 ? wish->column_count : wish->rig->axis_count;
    char names[IMPORT_NAMES_MAX];
    if (table_need_fps(self) < 0)
        return -1;
    import_axis_names(wish->rig, names);
    if (wish->column_count == 0 && count > 1)
        return yaml_report_at(&self->text.report, (struct plan_place){ 1, 1 },
                              "the file does not name its axes, expected "
                              "--columns with the axis of every column, such "
                              "as --columns %.400s",
                              names);
    for (unsigned i = 0; i < count; i++)
        if (table_add_axis(self, (struct plan_place){ 1, 1 },
                           wish->column_count > 0
                               ? wish->column[i]
                               : wish->rig->axis[i].name) < 0)
            return -1;
    return 0;
}

int import_raw(const struct files *files, const char *path,
               const struct import_wish *wish, struct imported *imported,
               char message[YAML_MESSAGE_MAX])
{
    return table_read(files, path, wish, imported, message, table_raw_head, 0);
}

/* --- CSV: names of columns --- */

static int table_csv_head(struct table_read *self)
{
    struct import_word word;
    int found;
    if (!import_text_filled(&self->text, '#'))
        return table_fail(self, "the file is empty, expected names of "
                                "columns");
    const char *line = self->text.data + self->text.line_start;
    size_t length = self->text.line_end - self->text.line_start;
    self->separator = memchr(line, ';', length) != NULL    ? ';'
                      : memchr(line, '\t', length) != NULL ? '\t'
                                                           : ',';
    while ((found = import_text_cell(&self->text, self->separator, &word)) > 0)
        if (table_add_csv(self, &word) < 0)
            return -1;
    if (found < 0)
        return -1;
    for (unsigned i = 0; i < self->columns; i++)
        if (self->column[i].kind == TABLE_SECONDS ||
            self->column[i].kind == TABLE_NS)
            return 0;
    return table_need_fps(self);
}

int import_csv(const struct files *files, const char *path,
               const struct import_wish *wish, struct imported *imported,
               char message[YAML_MESSAGE_MAX])
{
    return table_read(files, path, wish, imported, message, table_csv_head,
                      '#');
}
