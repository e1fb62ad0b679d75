/* firmware/host/exchange/import.c - the table of formats, and what readers
 * share; see import.h. */
#include "firmware/host/exchange/import.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "firmware/host/base/array.h"
#include "firmware/host/base/quote.h"
#include "firmware/host/yaml/yaml_fields.h"
#include "motion/core/err.h"
#include "motion/core/fixed.h"

const struct import_format import_format[] = {
    { "kuper", "Kuper ASCII: 'Axes = ...', a row per frame", true, false, true,
      import_kuper, export_kuper },
    { "flair", "Flair ascii: DATA_TYPE, POINTS, columns, a row per frame", true,
      true, true, import_flair, export_flair },
    { "raw", "Dragonframe raw move: a row per frame, no names", false, false,
      true, import_raw, export_raw },
    { "csv", "columns with names; slew sample's own too", true, false, true,
      import_csv, export_csv },
    { "maya", "Maya .anim: keys and tangents", true, true, false, import_anim,
      export_anim },
    { "blender", "Blender action as JSON: keys and handles", true, true, false,
      import_blender, export_blender },
    { "ros-yaml", "ROS JointTrajectory as YAML: points with p, v, a", true,
      true, false, import_ros, export_ros_yaml },
    { "ros-json", "the same as JSON", true, true, false, import_ros,
      export_ros_json },
    { NULL, NULL, false, false, false, NULL, NULL },
};

const struct import_format *import_format_find(const char *name)
{
    for (const struct import_format *row = import_format; row->name; row++)
        if (strcmp(row->name, name) == 0)
            return row;
    return NULL;
}

void import_format_unknown(const char *name, const char *also,
                           char message[YAML_MESSAGE_MAX])
{
    const char *names[ARRAY_LEN(import_format) + 1];
    char list[QUOTE_LIST_MAX], quote[QUOTE_MAX];
    unsigned count = 0;
    for (const struct import_format *row = import_format; row->name; row++)
        names[count++] = row->name;
    if (also != NULL)
        names[count++] = also;
    snprintf(message, YAML_MESSAGE_MAX, "no format %s, expected %s",
             quote_text(quote, name, strlen(name)),
             quote_list(list, names, count));
}

static int import_columns_refuse(char message[YAML_MESSAGE_MAX])
{
    snprintf(message, YAML_MESSAGE_MAX,
             "--columns: expected names of axes, with - for a column that is "
             "left out, such as pan,-,tilt");
    return -1;
}

int import_wish_columns(struct import_wish *wish, const char *text,
                        char message[YAML_MESSAGE_MAX])
{
    for (;; text++) {
        size_t length = strcspn(text, ",");
        char *name = wish->column[wish->column_count];
        if (length == 0 || length >= PLAN_NAME_MAX ||
            wish->column_count + 1 == IMPORT_COLUMNS_MAX)
            return import_columns_refuse(message);
        memcpy(name, text, length);
        name[length] = 0;
        wish->column_count++;
        text += length;
        if (*text == 0)
            return 0;
    }
}

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

static void import_no_axis(const struct import_text *text,
                           struct plan_place place, const struct rig *rig,
                           const char *name)
{
    const char *names[RIG_AXES_MAX];
    char quote[QUOTE_MAX], list[QUOTE_LIST_MAX];
    for (unsigned i = 0; i < rig->axis_count; i++)
        names[i] = rig->axis[i].name;
    yaml_report_at(&text->report, place,
                   "%s is %s, expected %s; --columns says what a column is",
                   quote_text(quote, name, strlen(name)),
                   import_axis_index(rig, name) == IMPORT_MANY_AXES
                       ? "the name of two axes that differ in case"
                       : "not an axis of the rig",
                   quote_list(list, names, rig->axis_count));
}

struct plan_axis *import_add_axis(const struct import_text *text,
                                  struct plan_place place,
                                  const struct import_wish *wish,
                                  struct imported *imported, const char *name)
{
    struct plan_move *move = &imported->move;
    int index = import_axis_index(wish->rig, name);
    if (index < 0) {
        import_no_axis(text, place, wish->rig, name);
        return NULL;
    }
    for (unsigned i = 0; i < move->axis_count; i++)
        if (strcmp(move->axis[i].name, wish->rig->axis[index].name) == 0) {
            yaml_report_at(&text->report, place,
                           "axis %s appears twice, expected it once",
                           move->axis[i].name);
            return NULL;
        }
    if (move->axis == NULL &&
        plan_move_reserve(move, wish->rig->axis_count) < 0)
        memory_fail();
    struct plan_axis *axis = &move->axis[move->axis_count++];
    *axis = (struct plan_axis){ .curve = wish->curve, .place = place };
    memcpy(axis->name, wish->rig->axis[index].name, PLAN_NAME_MAX);
    return axis;
}

/* Room grows at powers of two. */
struct plan_key *import_add_key(const struct import_text *text,
                                struct plan_place place, struct plan_axis *axis)
{
    uint32_t count = axis->key_count;
    if (count == PLAN_KEYS_MAX) {
        yaml_report_at(&text->report, place,
                       "there are more than %d keys for axis %s", PLAN_KEYS_MAX,
                       axis->name);
        return NULL;
    }
    if ((count & (count - 1)) == 0) {
        size_t capacity = count == 0 ? 1 : 2 * (size_t)count;
        struct plan_key *key = realloc(axis->key, capacity * sizeof *key);
        if (key == NULL) {
            yaml_report_at(&text->report, place,
                           "there are too many keys for the memory");
            return NULL;
        }
        axis->key = key;
    }
    axis->key[axis->key_count] = (struct plan_key){ .place = place };
    return &axis->key[axis->key_count++];
}

int64_t import_frame_near(const struct units_fps *fps, int64_t t_ns_q12)
{
    const long double frame = (long double)t_ns_q12 /
                              (long double)MOTION_FIXED_S_Q12 *
                              (long double)fps->num / (long double)fps->den;
    return frame < 9e18L && frame > -9e18L ? llroundl(frame) : -1;
}

int64_t import_frame_ns_q12(const struct units_fps *fps, int64_t frame)
{
    int64_t frames, t_ns_q12;
    /* frame < 2^26 and fps < 2^30: the product is below 2^56 */
    if (frame > INT64_C(1) << 26 || fps->num == 0)
        return -1;
    frames = frame * (int64_t)fps->den;
    if (motion_fixed_muldiv(frames, MOTION_FIXED_S_Q12, (int64_t)fps->num,
                            &t_ns_q12) < 0)
        return -1;
    return t_ns_q12;
}
