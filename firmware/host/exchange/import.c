/* firmware/host/exchange/import.c - the table of formats, and what readers
 * share; see import.h. */
#include "firmware/host/exchange/import.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "firmware/host/base/array.h"
#include "firmware/host/base/quote.h"
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

void import_format_unknown(const char *name, const char *const also[],
                           char message[YAML_MESSAGE_MAX])
{
    const char *names[ARRAY_LEN(import_format) + IMPORT_ALSO_MAX];
    char list[QUOTE_LIST_MAX], quote[QUOTE_MAX];
    unsigned count = 0;
    for (const struct import_format *row = import_format; row->name; row++)
        names[count++] = row->name;
    for (; *also != NULL && count < ARRAY_LEN(names); also++)
        names[count++] = *also;
    snprintf(message, YAML_MESSAGE_MAX, "no format %s, expected %s",
             quote_text(quote, name, strlen(name)),
             quote_list(list, names, count));
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

int64_t import_frame_at(const struct units_fps *fps, int64_t t_ns_q12,
                        int64_t *micro)
{
    const int64_t den = (int64_t)fps->den, num = (int64_t)fps->num;
    const long double frame = (long double)t_ns_q12 /
                              (long double)MOTION_FIXED_S_Q12 *
                              (long double)num / (long double)den;
    int64_t at_ns_q12;
    /* below 2^46, den below 2^16, num below 2^30: products below 2^63 */
    if (!(fabsl(frame) < 0x1p26L) || den == 0 || den > 1 << 16)
        return INT64_MIN;
    *micro = llroundl(frame * 1000000);
    return motion_fixed_muldiv(*micro * den, MOTION_FIXED_S_Q12, num * 1000000,
                               &at_ns_q12) == MOTION_OK
               ? at_ns_q12
               : INT64_MIN;
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
