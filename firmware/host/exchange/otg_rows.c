/* firmware/host/exchange/otg_rows.c - see otg_rows.h. */
#include "firmware/host/exchange/otg_rows.h"

#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const char *const otg_names[OTG_VALUES] = {
    "p0",   "v0",   "a0",   "pf",   "vf",   "af",
    "vmax", "vmin", "amax", "amin", "jmax", "jdown",
};

/* --- header --------------------------------------------------------------- */

static size_t field_length(const char *field)
{
    return strcspn(field, ",\r\n");
}

static bool is_name(const char *field, size_t length, const char *name)
{
    return strlen(name) == length && memcmp(field, name, length) == 0;
}

#define AXIS_NOT_OURS (-1)
#define AXIS_TOO_MANY (-2)

/* "_3" is axis 2. */
static short header_axis(const char *field, size_t length)
{
    char *end;
    if (length == 0)
        return 0;
    long number = strtol(field + 1, &end, 10);
    if (end != field + length || field[1] < '1' || field[1] > '9')
        return AXIS_NOT_OURS;
    return number > MOTION_SYNC_AXES ? AXIS_TOO_MANY : (short)(number - 1);
}

/* "v0" or "v0_3". */
static void header_column(const char *field, size_t length, short *axis,
                          short *value)
{
    size_t stem = 0;
    while (length > 0 && *field == ' ') {
        field++;
        length--;
    }
    while (length > 0 && field[length - 1] == ' ')
        length--;
    while (stem < length && field[stem] != '_')
        stem++;
    *axis = AXIS_NOT_OURS;
    if (is_name(field, length, "duration"))
        *value = OTG_VALUE_DURATION;
    else if (is_name(field, length, "category"))
        *value = OTG_VALUE_CATEGORY;
    else if (is_name(field, length, "t"))
        *value = OTG_VALUE_TIME;
    else
        for (int i = 0; i < OTG_VALUES; i++)
            if (is_name(field, stem, otg_names[i])) {
                *axis = header_axis(field + stem, length - stem);
                *value = (short)i;
            }
}

static const char *header_wrong(struct otg_header *header, const char *what,
                                int axis, int value)
{
    char number[16] = "";
    if (axis > 0 || header->axes > 1)
        snprintf(number, sizeof number, "_%d", axis + 1);
    snprintf(header->wrong, sizeof header->wrong, "column %s%s %s",
             otg_names[value], number, what);
    return header->wrong;
}

/* One more name in a list; what does not fit is "...". */
static void header_list(const struct otg_header *header, char *list,
                        size_t capacity, int axis, int value)
{
    size_t used = strlen(list);
    char name[32];
    if (used + sizeof name > capacity) {
        if (strcmp(list + used - 3, "...") != 0)
            snprintf(list + used, capacity - used, " ...");
        return;
    }
    snprintf(name, sizeof name, header->axes > 1 ? "%s_%d" : "%s",
             otg_names[value], axis + 1);
    snprintf(list + used, capacity - used, "%s%s", used > 0 ? "," : "", name);
}

/* A velocity goal has no positions. */
static const char *header_missing(struct otg_header *header,
                                  const unsigned has[MOTION_SYNC_AXES])
{
    const unsigned position = 1u << OTG_P0 | 1u << OTG_PF;
    const unsigned limits = 1u << OTG_VMAX | 1u << OTG_VMIN;
    if (header->axes == 0)
        return "expected a header line with the columns p0,v0,a0,pf,vf,af,"
               "vmax,vmin,amax,amin,jmax";
    header->velocity = header->axes == 1 && !(has[0] & position);
    char list[160] = "";
    unsigned count = 0;
    for (int i = 0; i < header->axes; i++)
        for (int k = 0; k < OTG_VALUES; k++) {
            bool needed = !header->velocity || !((position | limits) & 1u << k);
            if (!needed || k == OTG_JDOWN || has[i] & 1u << k)
                continue;
            count++;
            header_list(header, list, sizeof list, i, k);
        }
    if (count > 0) {
        snprintf(header->wrong, sizeof header->wrong,
                 "no %s %s, expected every axis with all of its columns",
                 count == 1 ? "column" : "columns", list);
        return header->wrong;
    }
    return NULL;
}

static const char *header_add(struct otg_header *header, const char *field,
                              size_t length, unsigned has[MOTION_SYNC_AXES])
{
    short axis, value = -1;
    if (header->columns == OTG_COLUMNS_MAX)
        return "too many columns: expected 512 at most";
    header_column(field, length, &axis, &value);
    header->column[header->columns].axis = axis;
    header->column[header->columns].value = value;
    header->columns++;
    if (axis == AXIS_TOO_MANY)
        return "too many axes: expected 16 at most";
    if (axis < 0) {
        header->timed |= value == OTG_VALUE_TIME;
        return NULL;
    }
    if (has[axis] & 1u << value)
        return header_wrong(header, "is there twice, expected it once", axis,
                            value);
    has[axis] |= 1u << value;
    if (axis + 1 > header->axes)
        header->axes = axis + 1;
    return NULL;
}

const char *otg_header_parse(const char *line, struct otg_header *header)
{
    unsigned has[MOTION_SYNC_AXES] = { 0 };
    const char *wrong = NULL;
    memset(header, 0, sizeof *header);
    if (strncmp(line, "\xef\xbb\xbf", 3) == 0)
        line += 3; /* what some spreadsheets put first */
    while (wrong == NULL) {
        size_t length = field_length(line);
        wrong = header_add(header, line, length, has);
        line += length;
        if (*line++ != ',')
            break;
    }
    return wrong != NULL ? wrong : header_missing(header, has);
}

/* --- rows ----------------------------------------------------------------- */

bool otg_number(const char *text, size_t length, double *number)
{
    char *end;
    while (length > 0 && text[length - 1] == ' ')
        length--;
    errno = 0;
    *number = strtod(text, &end);
    return length > 0 && memchr(text, 'x', length) == NULL &&
           memchr(text, 'X', length) == NULL && end == text + length &&
           isfinite(*number) &&
           ((*number == 0 && errno == 0) ||
            (fabs(*number) > 1e-60 && fabs(*number) < 1e60));
}

static bool row_field(const struct otg_header *header, int i, const char *field,
                      size_t length, struct otg_row *row)
{
    int axis = header->column[i].axis, value = header->column[i].value;
    if (axis >= 0 && header->table != OTG_TABLE_SEPARATE &&
        strspn(field, " ") >= length) {
        row->value[axis][value] = (double)NAN;
        return true;
    }
    if (axis >= 0)
        return otg_number(field, length, &row->value[axis][value]);
    if (value == OTG_VALUE_TIME && header->table == OTG_TABLE_REPLAN)
        return otg_number(field, length, &row->t);
    if (value == OTG_VALUE_DURATION)
        return length == 0 || otg_number(field, length, &row->duration);
    if (value == OTG_VALUE_CATEGORY && length < sizeof row->category)
        memcpy(row->category, field, length);
    return true;
}

static const char *row_wrong(struct otg_header *header, int i, const char *what)
{
    int axis = header->column[i].axis, value = header->column[i].value;
    if (axis < 0)
        snprintf(header->wrong, sizeof header->wrong, "%s: %s",
                 value == OTG_VALUE_TIME ? "t" : "duration", what);
    else if (header->axes > 1)
        snprintf(header->wrong, sizeof header->wrong, "%s_%d: %s",
                 otg_names[value], axis + 1, what);
    else
        snprintf(header->wrong, sizeof header->wrong, "%s: %s",
                 otg_names[value], what);
    return header->wrong;
}

const char *otg_row_parse(struct otg_header *header, const char *line,
                          struct otg_row *row, int *column)
{
    const char *field = line;
    memset(row, 0, sizeof *row);
    row->duration = (double)NAN;
    for (int i = 0; i < header->columns; i++) {
        size_t length = field_length(field);
        *column = (int)(field - line) + 1;
        if (!row_field(header, i, field, length, row))
            return row_wrong(header, i,
                             "expected a finite number, 0 or from 1e-60 to "
                             "1e60");
        field += length;
        *column = (int)(field - line) + 1;
        if (i + 1 < header->columns && *field != ',')
            return "too few fields, expected as many as the header "
                   "has";
        field += *field == ',' && i + 1 < header->columns;
    }
    return *field == ',' ? "too many fields, expected as many as the header has"
                         : NULL;
}

/* --- rows of one motion --------------------------------------------------- */

/* What the field may not say, or NULL; an empty one is filled in. */
static const char *follow_value(enum otg_table table, int value,
                                const double *before, double *x)
{
    const bool through = table == OTG_TABLE_THROUGH;
    if (through && value == OTG_VF)
        return NULL;
    if (before != NULL && value <= OTG_A0)
        return isnan(*x) ? NULL
                         : "expected nothing, as the motion comes from the row "
                           "before";
    if (isnan(*x)) {
        if (before == NULL)
            return "expected a number in the first row";
        *x = *before;
    }
    if (((value == OTG_VMAX || value == OTG_AMAX) && !(*x > 0)) ||
        (value >= OTG_JMAX && *x < 0))
        return value < OTG_JMAX ? "expected a number above 0"
                                : "expected 0 or a number above it";
    if ((value == OTG_VMIN || value == OTG_AMIN) && !(*x < 0))
        return "expected a number below 0";
    if (through && value == OTG_AF && *x != 0)
        return "expected 0 or nothing, as the acceleration is 0 at every point";
    if (through && value >= OTG_VMAX && before != NULL && *x != *before)
        return "expected that of the row before, or nothing: one limit for all "
               "points";
    return NULL;
}

static const char *follow_field(const struct otg_header *header, int i,
                                const struct otg_row *before,
                                struct otg_row *row)
{
    int axis = header->column[i].axis, value = header->column[i].value;
    if (axis >= 0)
        return follow_value(header->table, value,
                            before ? &before->value[axis][value] : NULL,
                            &row->value[axis][value]);
    if (value != OTG_VALUE_TIME || header->table != OTG_TABLE_REPLAN)
        return NULL;
    if (before == NULL)
        return row->t == 0 ? NULL : "expected 0 in the first row";
    return row->t > before->t ? NULL : "expected later than the row before";
}

const char *otg_row_follow(struct otg_header *header, const char *line,
                           const struct otg_row *before, struct otg_row *row,
                           int *column)
{
    const char *field = line;
    for (int i = 0; i < header->columns; i++) {
        const char *wrong = follow_field(header, i, before, row);
        *column = (int)(field - line) + 1;
        if (wrong != NULL)
            return row_wrong(header, i, wrong);
        field += field_length(field);
        field += *field == ',';
    }
    return NULL;
}
