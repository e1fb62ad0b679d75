/* firmware/host/exchange/import_adjust.c - what was read, in the rig's own numbers:
 * --unwrap, --scale and --offset, and times that are frames; see import.h.
 *
 *   position = (what the file has, unwrapped) x scale + offset
 *
 * Velocities, accelerations and handles go with the scale. */
#include <stdio.h>
#include <string.h>

#include "firmware/host/base/decimal.h"
#include "firmware/host/base/quote.h"
#include "firmware/host/exchange/import.h"
#include "motion/core/err.h"
#include "motion/core/fixed.h"
#include "motion/number/real.h"

#define ADJUST_ITEM_MAX 96
#define ADJUST_NEAR_Q12                                                        \
    4 /* 10^-3 ns: what rounding a difference of times leaves */
#define ADJUST_TURN_RAD INT64_C(26986075409) /* 2 pi, Q32 */

int64_t import_turn_q32(enum units_axis unit)
{
    return unit == UNITS_AXIS_DEG   ? 360 * MOTION_FIXED_ONE_Q32
           : unit == UNITS_AXIS_REV ? MOTION_FIXED_ONE_Q32
           : unit == UNITS_AXIS_RAD ? ADJUST_TURN_RAD
                                    : 0;
}

/* ---- what the settings say ---- */

/* The value for an axis in "10" or "pan=-1, slide=25.4"; false: none. */
static bool adjust_find(const char *list, const char *name,
                        char item[ADJUST_ITEM_MAX])
{
    while (list != NULL && *list != 0) {
        list += strspn(list, " ");
        const size_t length = strcspn(list, ",");
        const size_t equals = strcspn(list, "=,");
        const bool is_named = list[equals] == '=';
        if (!is_named ||
            (equals == strlen(name) && strncmp(list, name, equals) == 0)) {
            const size_t from = is_named ? equals + 1 : 0;
            snprintf(item, ADJUST_ITEM_MAX, "%.*s", (int)(length - from),
                     list + from);
            return true;
        }
        list += length + (list[length] == ',');
    }
    return false;
}

/* Every name of it is an axis of the rig. */
static int adjust_check(const struct rig *rig, const char *option,
                        const char *list, char message[YAML_MESSAGE_MAX])
{
    char name[ADJUST_ITEM_MAX], quote[QUOTE_MAX];

    while (list != NULL && *list != 0) {
        list += strspn(list, " ");
        const size_t length = strcspn(list, ",");
        const size_t equals = strcspn(list, "=,");
        snprintf(name, sizeof name, "%.*s", (int)equals, list);
        if (list[equals] == '=' && rig_axis_index(rig, name) < 0) {
            snprintf(message, YAML_MESSAGE_MAX,
                     "--%s: %s is not an axis of the rig", option,
                     quote_text(quote, name, strlen(name)));
            return -1;
        }
        list += length + (list[length] == ',');
    }
    return 0;
}

/* One of num / den below 10^18, or false. */
static bool adjust_part(const char **at, int64_t *num, int64_t *den)
{
    struct decimal number;
    uint64_t above, below = 1;

    if (decimal_read(&number, at) != NULL || number.mantissa == 0)
        return false;
    above = number.mantissa;
    for (; number.exp10 > 0; number.exp10--)
        if (!decimal_mul_whole(&above, 10))
            return false;
    for (; number.exp10 < 0; number.exp10++)
        if (!decimal_mul_whole(&below, 10))
            return false;
    const uint64_t same = decimal_gcd(above, below);
    *num = (int64_t)(above / same);
    *den = (int64_t)(below / same);
    if (number.negative)
        *num = -*num;
    return true;
}

/* "-25.4", "360/8192". */
static bool adjust_ratio(const char *text, int64_t *num, int64_t *den)
{
    int64_t over_num = 1, over_den = 1;
    uint64_t above, below;

    if (!adjust_part(&text, num, den))
        return false;
    text += strspn(text, " ");
    if (*text == '/') {
        text++;
        text += strspn(text, " ");
        if (!adjust_part(&text, &over_num, &over_den) || over_num < 0)
            return false;
    }
    above = motion_fixed_abs(*num);
    below = (uint64_t)*den;
    if (text[strspn(text, " ")] != 0 ||
        !decimal_mul_whole(&above, (uint64_t)over_den) ||
        !decimal_mul_whole(&below, (uint64_t)over_num))
        return false;
    const uint64_t same = decimal_gcd(above, below);
    *num = (*num < 0 ? -1 : 1) * (int64_t)(above / same);
    *den = (int64_t)(below / same);
    return true;
}

int import_adjust_of(const struct import_settings *settings, unsigned axis,
                     struct import_adjust *adjust,
                     char message[YAML_MESSAGE_MAX])
{
    const struct rig_axis *on = &settings->rig->axis[axis];
    const struct units_context context = { .unit = on->unit };
    char item[ADJUST_ITEM_MAX], sentence[UNITS_SENTENCE_MAX], quote[QUOTE_MAX];

    *adjust = (struct import_adjust){ 1, 1, 0 };
    if (adjust_check(settings->rig, "scale", settings->scale, message) < 0 ||
        adjust_check(settings->rig, "offset", settings->offset, message) < 0)
        return -1;
    if (adjust_find(settings->scale, on->name, item) &&
        !adjust_ratio(item, &adjust->num, &adjust->den)) {
        snprintf(message, YAML_MESSAGE_MAX,
                 "--scale: %s is no factor, expected such as 25.4, -1 or "
                 "360/8192, or pan=-1,slide=25.4",
                 quote_text(quote, item, strlen(item)));
        return -1;
    }
    if (adjust_find(settings->offset, on->name, item) &&
        units_parse(item, UNITS_POSITION, &context, &adjust->offset_q32,
                    sentence) < 0) {
        snprintf(message, YAML_MESSAGE_MAX, "--offset: %s: %s", on->name,
                 sentence);
        return -1;
    }
    return 0;
}

/* ---- positions ---- */

/* Whole turns that a jump of more than half of one adds are taken out. */
static unsigned adjust_unwrap(struct plan_axis *axis, int64_t turn_q32)
{
    int64_t before_q32 = axis->key[0].key.pos_q32, turns = 0;
    unsigned wraps = 0;

    for (uint32_t i = 1; i < axis->key_count; i++) {
        int64_t *pos_q32 = &axis->key[i].key.pos_q32, jump_q32, turned_q32;
        const int64_t now_q32 = *pos_q32;
        if (motion_fixed_sub(now_q32, before_q32, &jump_q32) < 0)
            return wraps;
        const int64_t half = (turn_q32 - 1) / 2;
        const int64_t whole =
            (jump_q32 < 0 ? jump_q32 - half : jump_q32 + half) / turn_q32;
        turns -= whole;
        wraps += whole != 0;
        before_q32 = now_q32;
        if (motion_fixed_muldiv(turns, turn_q32, 1, &turned_q32) == MOTION_OK)
            (void)motion_fixed_add(now_q32, turned_q32, pos_q32);
    }
    return wraps;
}

static bool adjust_scale(const struct import_adjust *adjust, int64_t *value)
{
    return motion_fixed_muldiv(*value, adjust->num, adjust->den, value) ==
           MOTION_OK;
}

static bool adjust_key(const struct import_adjust *adjust,
                       struct motion_real ratio, struct motion_key *key)
{
    key->vel = motion_real_mul(key->vel, ratio);
    key->acc = motion_real_mul(key->acc, ratio);
    return adjust_scale(adjust, &key->pos_q32) &&
           motion_fixed_add(key->pos_q32, adjust->offset_q32, &key->pos_q32) ==
               MOTION_OK;
}

static bool adjust_bezier(const struct import_adjust *adjust,
                          struct plan_axis *axis)
{
    const struct import_adjust size = { .num = adjust->num < 0 ? -adjust->num
                                                               : adjust->num,
                                        .den = adjust->den };

    for (uint32_t i = 0; i < axis->key_count && axis->bezier.key != NULL; i++) {
        struct plan_bezier_key *key = &axis->bezier.key[i];
        if (!adjust_scale(adjust, &key->left.dp_q32) ||
            !adjust_scale(adjust, &key->right.dp_q32) ||
            !adjust_scale(&size, &key->amplitude_q32))
            return false;
    }
    return adjust_scale(&size, &axis->bezier.value_q32);
}

static bool adjust_axis(const struct import_adjust *adjust,
                        struct plan_axis *axis)
{
    const bool is_scaled = adjust->num != adjust->den;
    const struct motion_real ratio = motion_real_div(
        motion_real_int(adjust->num), motion_real_int(adjust->den));

    for (uint32_t i = 0; i < axis->key_count; i++)
        if (!adjust_key(adjust, ratio, &axis->key[i].key))
            return false;
    return !is_scaled || adjust_bezier(adjust, axis);
}

/* ---- times ---- */

/* A time that is a frame of at most six decimals but for rounding. */
static int64_t adjust_frame(const struct units_fps *fps, int64_t t_ns_q12)
{
    int64_t micro;
    const int64_t near = import_frame_at(fps, t_ns_q12, &micro);

    return near != INT64_MIN &&
                   motion_fixed_abs(near - t_ns_q12) <= ADJUST_NEAR_Q12
               ? near
               : t_ns_q12;
}

static void adjust_times(const struct units_fps *fps, struct plan_axis *axis)
{
    int64_t before = INT64_MIN;

    for (uint32_t i = 0; i < axis->key_count && fps->den != 0; i++) {
        int64_t *const t_ns_q12 = &axis->key[i].key.t_ns_q12;
        const int64_t frame = adjust_frame(fps, *t_ns_q12);
        if (frame > before)
            *t_ns_q12 = frame;
        before = *t_ns_q12;
    }
}

/* ---- all of it ---- */

static struct import_column *adjust_column(struct imported *imported, int axis)
{
    for (unsigned i = 0; i < imported->columns; i++)
        if (imported->column[i].part == IMPORT_POSITION &&
            imported->column[i].axis == axis)
            return &imported->column[i];
    return NULL;
}

int import_adjust(const struct import_settings *settings,
                  struct imported *imported, char message[YAML_MESSAGE_MAX])
{
    for (uint32_t i = 0; i < imported->move.axis_count; i++) {
        struct plan_axis *axis = &imported->move.axis[i];
        const int index = rig_axis_index(settings->rig, axis->name);
        const int64_t turn_q32 =
            import_turn_q32(settings->rig->axis[index].unit);
        struct import_column *column = adjust_column(imported, index);
        struct import_adjust adjust;
        if (import_adjust_of(settings, (unsigned)index, &adjust, message) < 0)
            return -1;
        if (settings->unwrap && turn_q32 > 0 && column != NULL)
            column->wraps = adjust_unwrap(axis, turn_q32);
        adjust_times(&imported->fps, axis);
        if (adjust.num == adjust.den && adjust.offset_q32 == 0)
            continue;
        if (!adjust_axis(&adjust, axis)) {
            snprintf(message, YAML_MESSAGE_MAX,
                     "axis %s goes beyond 2147483647 %s with this scale and "
                     "offset",
                     axis->name,
                     units_axis_text(settings->rig->axis[index].unit));
            return -1;
        }
    }
    return 0;
}
