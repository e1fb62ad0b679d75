/* firmware/linux/import_blender.c - see import_blender.h. */
#include "firmware/linux/import_blender.h"

#include <cjson/cJSON.h>
#include <math.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stdio.h>
#include <string.h>

#include "firmware/linux/memory.h"
#include "firmware/linux/yaml_report.h"
#include "motion/err.h"
#include "motion/fixed.h"

#define BLENDER_BYTES_MAX (256L << 20)

/* Where a sentence goes, and what it is about. */
struct blender {
    const char *path, *curve;
    uint32_t key; /* from 1; 0: none */
    char *message;
    size_t room;
    double frame_s;
    double units_per_value;
};

static int blender_refuse(const struct blender *file, const char *format, ...)
    __attribute__((format(printf, 2, 3)));

static int blender_refuse(const struct blender *file, const char *format, ...)
{
    char where[160] = "";
    char what[160];
    va_list list;

    va_start(list, format);
    vsnprintf(what, sizeof what, format, list);
    va_end(list);
    if (file->curve && file->key)
        snprintf(where, sizeof where, "curve '%.80s', key %u: ", file->curve,
                 file->key);
    else if (file->curve)
        snprintf(where, sizeof where, "curve '%.80s': ", file->curve);
    snprintf(file->message, file->room, "%s: %s%s", file->path, where, what);
    return -1;
}

/* --- fields --------------------------------------------------------------- */

static const cJSON *blender_get(const cJSON *json, const char *name)
{
    return cJSON_GetObjectItemCaseSensitive(json, name);
}

static int blender_number(const struct blender *file, const cJSON *json,
                          const char *name, double *value)
{
    const cJSON *item = blender_get(json, name);

    if (!cJSON_IsNumber(item) || !isfinite(item->valuedouble))
        return blender_refuse(file, "%s: expected a number", name);
    *value = item->valuedouble;
    return 0;
}

/* value * scale as an integer below 2^62. */
static int blender_fixed(const struct blender *file, const cJSON *json,
                         const char *name, double scale, int64_t *fixed)
{
    double value = 0;
    long double scaled;

    if (blender_number(file, json, name, &value) < 0)
        return -1;
    scaled = (long double)value * (long double)scale;
    if (!(fabsl(scaled) < 0x1p62L))
        return blender_refuse(file, "%s: %g is out of range", name, value);
    *fixed = (int64_t)llroundl(scaled);
    return 0;
}

static int blender_time(const struct blender *file, const cJSON *json,
                        const char *name, int64_t *t_ns_q12)
{
    return blender_fixed(file, json, name,
                         file->frame_s * (double)MOTION_FIXED_S_Q12, t_ns_q12);
}

static int blender_value(const struct blender *file, const cJSON *json,
                         const char *name, int64_t *pos_q32)
{
    return blender_fixed(file, json, name,
                         file->units_per_value * (double)MOTION_FIXED_ONE_Q32,
                         pos_q32);
}

static const char *const handle_words[] = { "FREE", "ALIGNED",      "VECTOR",
                                            "AUTO", "AUTO_CLAMPED", NULL };
static const char *const interpolation_words[] = {
    "CONSTANT", "LINEAR", "BEZIER", "SINE", "QUAD",   "CUBIC",   "QUART",
    "QUINT",    "EXPO",   "CIRC",   "BACK", "BOUNCE", "ELASTIC", NULL
};
static const char *const easing_words[] = { "AUTO", "EASE_IN", "EASE_OUT",
                                            "EASE_IN_OUT", NULL };
static const char *const smoothing_words[] = { "NONE", "CONT_ACCEL", NULL };
static const char *const extrapolation_words[] = { "CONSTANT", "LINEAR", NULL };
static const char *const cycle_words[] = { "NONE", "REPEAT", "REPEAT_OFFSET",
                                           "MIRROR", NULL };

/* Lists are in the order of the enums of motion/fcurve.h. */
static int blender_word(const struct blender *file, const cJSON *json,
                        const char *name, const char *const list[],
                        uint8_t *place)
{
    const char *word = cJSON_GetStringValue(blender_get(json, name));
    char quote[YAML_QUOTE_MAX];

    if (!word)
        return blender_refuse(file, "%s: expected a word", name);
    for (uint8_t i = 0; list[i]; i++)
        if (strcmp(word, list[i]) == 0) {
            *place = i;
            return 0;
        }
    return blender_refuse(file, "%s: %s is not known", name,
                          yaml_quote(quote, word, strlen(word)));
}

/* --- keys ----------------------------------------------------------------- */

static int blender_point(const struct blender *file, const cJSON *json,
                         const char *t, const char *v,
                         struct motion_fcurve_point *point)
{
    if (blender_time(file, json, t, &point->t_ns_q12) < 0)
        return -1;
    return blender_value(file, json, v, &point->pos_q32);
}

static int blender_words(const struct blender *file, const cJSON *json,
                         struct motion_fcurve_key *key)
{
    if (blender_word(file, json, "hl", handle_words, &key->left_kind) < 0 ||
        blender_word(file, json, "hr", handle_words, &key->right_kind) < 0 ||
        blender_word(file, json, "interp", interpolation_words,
                     &key->interpolation) < 0)
        return -1;
    return blender_word(file, json, "easing", easing_words, &key->easing);
}

static int blender_key(const struct blender *file, const cJSON *json,
                       struct motion_fcurve_key *key)
{
    if (blender_words(file, json, key) < 0 ||
        blender_point(file, json, "t", "v", &key->at) < 0 ||
        blender_point(file, json, "lt", "lv", &key->left) < 0 ||
        blender_point(file, json, "rt", "rv", &key->right) < 0)
        return -1;
    if (blender_value(file, json, "amplitude", &key->amplitude_q32) < 0 ||
        blender_time(file, json, "period", &key->period_ns_q12) < 0)
        return -1;
    /* a size, whichever way the axis turns */
    if (file->units_per_value < 0)
        key->amplitude_q32 = -key->amplitude_q32;
    return blender_fixed(file, json, "back", (double)MOTION_FIXED_ONE_Q32,
                         &key->back_q32);
}

static int blender_keys(struct blender *file, const cJSON *json,
                        struct motion_fcurve *curve)
{
    const cJSON *keys = blender_get(json, "keys"), *key;
    const int count = cJSON_GetArraySize(keys);

    if (!cJSON_IsArray(keys) || count < 1 || count > IMPORT_BLENDER_KEYS_MAX)
        return blender_refuse(file, "keys: expected 1 to %d",
                              IMPORT_BLENDER_KEYS_MAX);
    curve->key = memory_new((size_t)count, sizeof *curve->key);
    cJSON_ArrayForEach(key, keys)
    {
        file->key = curve->count + 1;
        if (blender_key(file, key, &curve->key[curve->count]) < 0)
            return -1;
        curve->count++;
    }
    file->key = 0;
    return 0;
}

/* --- curves --------------------------------------------------------------- */

static int blender_cycles(const struct blender *file, const cJSON *json,
                          const char *mode, const char *count,
                          struct motion_fcurve_cycles *cycles)
{
    double times = 0;

    if (blender_word(file, json, mode, cycle_words, &cycles->mode) < 0 ||
        blender_number(file, json, count, &times) < 0)
        return -1;
    if (times < 0 || times > UINT32_MAX || times != floor(times))
        return blender_refuse(file, "%s: %g is not a number of times", count,
                              times);
    cycles->count = (uint32_t)times;
    return 0;
}

static int blender_handles(struct blender *file, struct motion_fcurve *curve)
{
    struct motion_fcurve_work *work = memory_new(curve->count, sizeof *work);
    uint32_t failed = 0;
    int rc = motion_fcurve_handles(curve, work, &failed);

    memory_free(work);
    file->key = failed + 1;
    return rc == MOTION_OK ? 0
                           : blender_refuse(file, "%s", motion_err_text(rc));
}

static int blender_curve(struct blender *file, const cJSON *json,
                         struct motion_fcurve *curve)
{
    const cJSON *cycles = blender_get(json, "cycles");

    if (blender_word(file, json, "extrapolation", extrapolation_words,
                     &curve->extrapolation) < 0 ||
        blender_word(file, json, "auto_smoothing", smoothing_words,
                     &curve->smoothing) < 0)
        return -1;
    if (cJSON_IsObject(cycles) &&
        (blender_cycles(file, cycles, "mode_before", "count_before",
                        &curve->before) < 0 ||
         blender_cycles(file, cycles, "mode_after", "count_after",
                        &curve->after) < 0))
        return -1;
    curve->frame_ns_q12 =
        (int64_t)llround(file->frame_s * (double)MOTION_FIXED_S_Q12);
    curve->value_q32 = (int64_t)llround(fabs(file->units_per_value) *
                                        (double)MOTION_FIXED_ONE_Q32);
    if (blender_keys(file, json, curve) < 0)
        return -1;
    return blender_handles(file, curve);
}

static const cJSON *blender_find(const cJSON *json, const char *name)
{
    const cJSON *curve;

    cJSON_ArrayForEach(curve, blender_get(json, "curves"))
    {
        const char *is = cJSON_GetStringValue(blender_get(curve, "name"));
        if (is && strcmp(is, name) == 0)
            return curve;
    }
    return NULL;
}

/* --- the file ------------------------------------------------------------- */

static int blender_head(struct blender *file, const cJSON *json)
{
    const char *format = cJSON_GetStringValue(blender_get(json, "format"));
    double fps = 0, base = 0;

    if (!format || strcmp(format, "slew-blender-1") != 0)
        return blender_refuse(file, "format: expected 'slew-blender-1'");
    if (blender_number(file, json, "fps", &fps) < 0 ||
        blender_number(file, json, "fps_base", &base) < 0)
        return -1;
    if (!(fps > 0) || !(base > 0) || !(base / fps < 1e3) ||
        !(base / fps > 1e-6))
        return blender_refuse(file, "fps: %g / %g is out of range", fps, base);
    file->frame_s = base / fps;
    return 0;
}

static char *blender_load(const struct blender *file)
{
    FILE *in = fopen(file->path, "rb");
    char *text = NULL;
    long size = -1;

    if (in && fseek(in, 0, SEEK_END) == 0)
        size = ftell(in);
    if (size >= 0 && size <= BLENDER_BYTES_MAX && fseek(in, 0, SEEK_SET) == 0) {
        text = memory_new((size_t)size + 1, 1);
        if (fread(text, 1, (size_t)size, in) != (size_t)size) {
            memory_free(text);
            text = NULL;
        }
    }
    if (in)
        fclose(in);
    if (!text)
        (void)blender_refuse(file, "cannot be read");
    return text;
}

/* Line and column where cJSON stopped. */
static int blender_refuse_syntax(const struct blender *file, const char *text,
                                 const char *stop)
{
    unsigned line = 1, column = 1;

    for (const char *at = text; stop && at < stop; at++) {
        column = *at == '\n' ? 1 : column + 1;
        line += *at == '\n';
    }
    snprintf(file->message, file->room, "%s:%u:%u: not JSON", file->path, line,
             column);
    return -1;
}

static int blender_curves(struct blender *file, const cJSON *json,
                          struct import_blender_curve want[], unsigned count)
{
    if (blender_head(file, json) < 0)
        return -1;
    for (unsigned i = 0; i < count; i++) {
        const cJSON *curve = blender_find(json, want[i].name);

        file->key = 0;
        file->curve = want[i].name;
        file->units_per_value = want[i].units_per_value;
        if (!curve)
            return blender_refuse(file, "not in the file");
        if (blender_curve(file, curve, &want[i].curve) < 0)
            return -1;
    }
    return 0;
}

void import_blender_free(struct import_blender_curve want[], unsigned count)
{
    for (unsigned i = 0; i < count; i++) {
        memory_free(want[i].curve.key);
        want[i].curve = (struct motion_fcurve){ 0 };
    }
}

int import_blender_read(const char *path, struct import_blender_curve want[],
                        unsigned count, char *message, size_t room)
{
    struct blender file = { .path = path, .message = message, .room = room };
    const char *stop = NULL;
    char *text = blender_load(&file);
    cJSON *json;
    int rc;

    for (unsigned i = 0; i < count; i++)
        want[i].curve = (struct motion_fcurve){ 0 };
    if (!text)
        return -1;
    json = cJSON_ParseWithOpts(text, &stop, true);
    rc = json ? blender_curves(&file, json, want, count)
              : blender_refuse_syntax(&file, text, stop);
    cJSON_Delete(json);
    memory_free(text);
    if (rc < 0)
        import_blender_free(want, count);
    return rc;
}
