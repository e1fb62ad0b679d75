/* firmware/host/exchange/import_columns.c - which column, curve or joint of a file is
 * which axis; see import.h.
 *
 * A column has a name: that of the file, or the one that --columns has in its place.
 * Either says what it is:
 *
 *   pan          an axis, in its own unit
 *   pan_rad, pan (rad), pan [rad]            in that one
 *   pan_deg_s, pan (deg/s), pan_deg_s2 ...   its velocity, its acceleration
 *   frame, t, time, t_ns, time (ms), timecode
 *   -            none
 *
 * --columns names all columns, that of times too; "-" there leaves the file's own
 * word for it. */
#include <stdio.h>
#include <string.h>
#include <strings.h>

#include "firmware/host/base/array.h"
#include "firmware/host/base/memory.h"
#include "firmware/host/base/number.h"
#include "firmware/host/base/quote.h"
#include "firmware/host/exchange/import.h"
#include "motion/core/err.h"

#define IMPORT_LIST_MAX 400

/* ---- --columns ---- */

static int import_columns_refuse(char message[YAML_MESSAGE_MAX])
{
    snprintf(message, YAML_MESSAGE_MAX,
             "--columns: expected a name for every column, with - for one that "
             "is no axis, such as frame,pan,-,tilt");
    return -1;
}

int import_settings_columns(struct import_settings *settings, const char *text,
                            char message[YAML_MESSAGE_MAX])
{
    for (;; text++) {
        const size_t length = strcspn(text, ",");
        char *name = settings->column[settings->column_count];
        if (length == 0 || length >= IMPORT_NAME_MAX ||
            settings->column_count + 1 == IMPORT_COLUMNS_MAX)
            return import_columns_refuse(message);
        memcpy(name, text, length);
        name[length] = 0;
        settings->column_count++;
        text += length;
        if (*text == 0)
            return 0;
    }
}

/* ---- axes ---- */

#define IMPORT_NO_AXIS   (-1)
#define IMPORT_MANY_AXES (-2)

/* The name as it is; else the one that differs only in case. */
static int import_axis_index(const struct rig *rig, const char *name)
{
    int found = IMPORT_NO_AXIS;
    for (unsigned i = 0; i < rig->axis_count; i++) {
        if (strcmp(rig->axis[i].name, name) == 0)
            return (int)i;
        if (import_text_same(rig->axis[i].name, name))
            found = found == IMPORT_NO_AXIS ? (int)i : IMPORT_MANY_AXES;
    }
    return found;
}

void import_axis_names(const struct rig *rig, char text[IMPORT_NAMES_MAX])
{
    size_t used = 0;
    text[0] = 0;
    for (unsigned i = 0; i < rig->axis_count; i++)
        used += (size_t)snprintf(text + used, IMPORT_NAMES_MAX - used, "%s%s",
                                 i > 0 ? "," : "", rig->axis[i].name);
}

struct plan_axis *import_add_axis(const struct import_text *text,
                                  const struct import_settings *settings,
                                  struct imported *imported,
                                  const struct import_column *column)
{
    struct plan_move *move = &imported->move;
    const char *name = settings->rig->axis[column->axis].name;
    for (unsigned i = 0; i < move->axis_count; i++)
        if (strcmp(move->axis[i].name, name) == 0) {
            yaml_report_at(&text->report, column->place,
                           "axis %s appears twice, expected it once", name);
            return NULL;
        }
    if (move->axis == NULL &&
        plan_move_reserve(move, settings->rig->axis_count) < 0)
        memory_fail();
    struct plan_axis *axis = &move->axis[move->axis_count++];
    *axis =
        (struct plan_axis){ .curve = settings->curve, .place = column->place };
    memcpy(axis->name, name, PLAN_NAME_MAX);
    return axis;
}

/* ---- what a name says ---- */

/* "time (ms)", "pan [deg]": the name in front, the unit within; false: neither. */
static bool import_split(const char *name, char base[IMPORT_NAME_MAX],
                         char unit[IMPORT_UNIT_MAX])
{
    const char *round = strrchr(name, '('), *square = strrchr(name, '[');
    const char *bracket =
        square == NULL || (round != NULL && round > square) ? round : square;
    const size_t open = bracket != NULL ? (size_t)(bracket - name) : 0;
    const char *close = bracket != NULL ? strpbrk(bracket, ")]") : NULL;
    size_t length = open;

    if (close == NULL || close[1] != 0 ||
        (size_t)(close - name) - open - 1 >= IMPORT_UNIT_MAX - 3)
        return false;
    while (length > 0 && name[length - 1] == ' ')
        length--;
    snprintf(base, IMPORT_NAME_MAX, "%.*s", (int)length, name);
    snprintf(unit, IMPORT_UNIT_MAX, "%.*s", (int)(close - bracket) - 1,
             bracket + 1);
    if (strncmp(unit, "\xC2\xB0", 2) == 0) { /* the degree sign */
        memmove(unit + 3, unit + 2, strlen(unit) - 1);
        memcpy(unit, "deg", 3);
    }
    return true;
}

static bool import_is_unit(const char *unit, enum units_quantity quantity,
                           enum units_axis of)
{
    const struct units_context context = { .unit = of };
    char text[IMPORT_UNIT_MAX + 4], sentence[UNITS_SENTENCE_MAX];
    int64_t value;

    snprintf(text, sizeof text, "1 %s", unit);
    return unit[0] != 0 &&
           units_parse(text, quantity, &context, &value, sentence) == 0;
}

/* What numbers in this unit are of the axis; false: they are none. */
static bool import_take_unit(const struct rig *rig, int axis, const char *unit,
                             struct import_column *column)
{
    static const enum import_part part[] = { IMPORT_POSITION, IMPORT_VELOCITY,
                                             IMPORT_ACCELERATION };
    const enum units_axis of = rig->axis[axis].unit;

    for (unsigned i = 0; i < ARRAY_LEN(part); i++)
        if (import_is_unit(unit, (enum units_quantity)(UNITS_POSITION + i),
                           of)) {
            column->part = part[i];
            column->axis = axis;
            snprintf(column->unit, IMPORT_UNIT_MAX, "%s", unit);
            if (strcmp(unit, units_axis_text(of)) == 0)
                column->unit[0] = 0;
            return true;
        }
    return false;
}

/* "pan_deg", "pan_rad_s2"; a name in the case that it has comes first. */
static bool import_take_suffix(const struct rig *rig, const char *name,
                               bool any_case, struct import_column *column)
{
    for (unsigned i = 0; i < rig->axis_count; i++) {
        const size_t length = strlen(rig->axis[i].name);
        char unit[IMPORT_UNIT_MAX];
        if ((any_case ? strncasecmp : strncmp)(name, rig->axis[i].name,
                                               length) != 0 ||
            name[length] != '_' || strlen(name + length) > IMPORT_UNIT_MAX)
            continue;
        snprintf(unit, sizeof unit, "%s", name + length + 1);
        char *per = strchr(unit, '_');
        if (per != NULL)
            *per = '/';
        if (import_take_unit(rig, (int)i, unit, column))
            return true;
    }
    return false;
}

/* "frame", "t", "time", "timecode", and "t_ns", "time (ms)". */
static bool import_take_time(const char *name, struct import_column *column)
{
    static const struct {
        const char *word;
        enum import_part part;
    } words[] = { { "frame", IMPORT_FRAMES },
                  { "frames", IMPORT_FRAMES },
                  { "t", IMPORT_TIMES },
                  { "time", IMPORT_TIMES },
                  { "timecode", IMPORT_TIMECODES },
                  { "tc", IMPORT_TIMECODES } };
    char base[IMPORT_NAME_MAX], unit[IMPORT_UNIT_MAX] = "";
    const char *suffix = strrchr(name, '_');

    snprintf(base, sizeof base, "%s", name);
    if (!import_split(name, base, unit) && suffix != NULL &&
        strlen(suffix) < IMPORT_UNIT_MAX) {
        snprintf(unit, sizeof unit, "%s", suffix + 1);
        base[suffix - name] = 0;
    }
    for (size_t i = 0; i < ARRAY_LEN(words); i++)
        if (import_text_same(base, words[i].word)) {
            column->part = words[i].part;
            column->axis = -1;
            snprintf(column->unit, IMPORT_UNIT_MAX, "%s",
                     unit[0] != 0 || column->part != IMPORT_TIMES ? unit : "s");
            return column->part == IMPORT_TIMES
                       ? import_is_unit(column->unit, UNITS_TIME, 0)
                       : unit[0] == 0;
        }
    return false;
}

bool import_is_time(const char *name)
{
    struct import_column column;
    return import_take_time(name, &column);
}

/* Is it known?  *column says what it is then. */
static bool import_mean(const struct rig *rig, const char *name,
                        struct import_column *column)
{
    char base[IMPORT_NAME_MAX], unit[IMPORT_UNIT_MAX];
    const int axis = import_axis_index(rig, name);

    column->unit[0] = 0;
    column->axis = axis;
    column->part = IMPORT_POSITION;
    if (axis >= 0)
        return true;
    if (import_split(name, base, unit) && import_axis_index(rig, base) >= 0)
        return import_take_unit(rig, import_axis_index(rig, base), unit,
                                column);
    return import_take_suffix(rig, name, false, column) ||
           import_take_suffix(rig, name, true, column) ||
           import_take_time(name, column);
}

/* ---- all of a file ---- */

int import_add_column(const struct import_text *text, struct plan_place place,
                      struct imported *imported, const char *name,
                      const char *called)
{
    if (imported->columns == IMPORT_COLUMNS_MAX)
        return yaml_report_at(&text->report, place,
                              "there are more than %d %ss", IMPORT_COLUMNS_MAX,
                              imported->column_word);
    struct import_column *column = &imported->column[imported->columns++];
    *column = (struct import_column){ .place = place, .axis = -1 };
    snprintf(column->name, sizeof column->name, "%s", name);
    snprintf(column->called, sizeof column->called, "%s", called);
    return 0;
}

static bool import_is_table(const struct imported *imported)
{
    return strcmp(imported->column_word, "column") == 0;
}

/* " (frame, a, b)"; "" where they have none. */
static void import_column_names(const struct imported *imported,
                                char text[IMPORT_LIST_MAX])
{
    size_t used = 0;

    text[0] = 0;
    for (unsigned i = 0;
         imported->column[0].name[0] != 0 && i < imported->columns &&
         used + IMPORT_NAME_MAX + 8 < IMPORT_LIST_MAX;
         i++)
        used += (size_t)snprintf(text + used, IMPORT_LIST_MAX - used, "%s%s",
                                 i > 0 ? ", " : " (", imported->column[i].name);
    if (used > 0)
        snprintf(text + used, IMPORT_LIST_MAX - used, ")");
}

/* Where somebody did not count a column of times: what --columns should have been,
 * with its names in the places of all others. */
static void import_columns_propose(const struct import_settings *settings,
                                   const struct imported *imported,
                                   char text[IMPORT_LIST_MAX])
{
    unsigned times = 0, next = 0;
    size_t used = 0;

    text[0] = 0;
    for (unsigned i = 0; i < imported->columns && import_is_table(imported);
         i++)
        times += import_is_time(imported->column[i].name);
    if (times == 0 || settings->column_count + times != imported->columns)
        return;
    for (unsigned i = 0;
         i < imported->columns && used + IMPORT_NAME_MAX + 24 < IMPORT_LIST_MAX;
         i++) {
        const char *name = imported->column[i].name;
        if (!import_is_time(name))
            name = settings->column[next++];
        if (name != imported->column[i].name && import_is_time(name)) {
            text[0] = 0; /* it was counted, and another was not */
            return;
        }
        used += (size_t)snprintf(text + used, IMPORT_LIST_MAX - used, "%s%s",
                                 i > 0 ? "," : ", such as --columns ", name);
    }
}

static int import_columns_count(const struct import_text *text,
                                const struct import_settings *settings,
                                const struct imported *imported)
{
    char names[IMPORT_LIST_MAX], propose[IMPORT_LIST_MAX], word[16];

    if (settings->column_count == 0 ||
        settings->column_count == imported->columns)
        return 0;
    import_column_names(imported, names);
    import_columns_propose(settings, imported, propose);
    snprintf(word, sizeof word, "%ss", imported->column_word);
    return yaml_report_at(
        &text->report, imported->column[0].place,
        "the file has %u %s%s and --columns %u, expected a name for each, with "
        "- for one that is no axis%s",
        imported->columns,
        number_word(imported->columns, imported->column_word, word), names,
        settings->column_count, propose);
}

static int import_no_unit(const struct import_text *text,
                          const struct import_column *column,
                          const struct rig_axis *axis, const char *unit)
{
    char quote[QUOTE_MAX];

    return yaml_report_at(&text->report, column->place,
                          "%s is no unit of axis %s, whose unit is %s",
                          quote_text(quote, unit, strlen(unit)), axis->name,
                          units_axis_text(axis->unit));
}

static int import_unknown(const struct import_text *text,
                          const struct import_settings *settings,
                          const struct import_column *column, const char *name)
{
    const struct rig *rig = settings->rig;
    const char *names[RIG_AXES_MAX];
    char quote[QUOTE_MAX], list[QUOTE_LIST_MAX], base[IMPORT_NAME_MAX];
    char unit[IMPORT_UNIT_MAX];

    if (import_split(name, base, unit) && import_axis_index(rig, base) >= 0)
        return import_no_unit(text, column,
                              &rig->axis[import_axis_index(rig, base)], unit);
    for (unsigned i = 0; i < rig->axis_count; i++)
        names[i] = rig->axis[i].name;
    return yaml_report_at(
        &text->report, column->place,
        "%s is %s, expected %s; --columns says what a column is",
        quote_text(quote, name, strlen(name)),
        import_axis_index(rig, name) == IMPORT_MANY_AXES
            ? "the name of two axes that differ in case"
            : "not an axis of the rig",
        quote_list(list, names, rig->axis_count));
}

/* A unit that the file has in brackets stays its unit under another name. */
static int import_keep_unit(const struct import_text *text,
                            const struct import_settings *settings,
                            struct import_column *column)
{
    char base[IMPORT_NAME_MAX], unit[IMPORT_UNIT_MAX];
    bool is_unit = false;

    if (column->part != IMPORT_POSITION || column->unit[0] != 0 ||
        !import_split(column->name, base, unit) ||
        import_take_unit(settings->rig, column->axis, unit, column))
        return 0;
    for (unsigned i = 0; i < UNITS_AXIS_WORDS; i++)
        is_unit |= import_is_unit(unit, UNITS_POSITION, (enum units_axis)i);
    return is_unit ? import_no_unit(text, column,
                                    &settings->rig->axis[column->axis], unit)
                   : 0;
}

/* "-" leaves out what is no time. */
static int import_name_column(const struct import_text *text,
                              const struct import_settings *settings,
                              struct imported *imported, unsigned i)
{
    const bool is_table = import_is_table(imported);
    struct import_column *column = &imported->column[i];
    const bool is_said = settings->column_count > 0;
    const char *name = is_said ? settings->column[i] : column->called;

    column->axis = -1;
    column->part = IMPORT_LEFT_OUT;
    if (is_said && strcmp(name, "-") == 0)
        return is_table && import_take_time(column->called, column)
                   ? 0
                   : (column->part = IMPORT_LEFT_OUT, 0);
    if (name[0] == 0) {
        column->part = IMPORT_NAMELESS;
        return 0;
    }
    if (!import_mean(settings->rig, name, column) ||
        (!is_table && column->part != IMPORT_POSITION))
        return import_unknown(text, settings, column, name);
    if (is_table && column->axis >= 0 && import_is_time(name))
        return yaml_report_at(&text->report, column->place,
                              "'%s' is an axis of the rig and a column of "
                              "times, expected another name",
                              name);
    return is_said ? import_keep_unit(text, settings, column) : 0;
}

int import_name_columns(const struct import_text *text,
                        const struct import_settings *settings,
                        struct imported *imported)
{
    unsigned axes = 0;

    if (import_columns_count(text, settings, imported) < 0)
        return -1;
    for (unsigned i = 0; i < imported->columns; i++) {
        if (import_name_column(text, settings, imported, i) < 0)
            return -1;
        axes += imported->column[i].part == IMPORT_POSITION;
    }
    return axes > 0 ? 0
                    : yaml_report_at(&text->report, import_text_place(text),
                                     "there are no %ss with axes",
                                     imported->column_word);
}
