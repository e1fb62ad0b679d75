/* firmware/host/exchange/import_anim.c - Maya .anim: keys with tangents.
 *
 * A tangent is an angle whose tangent is the slope in the file's units of value
 * per unit of time; a weight is its length in the same units.  import_anim.h
 * makes curves of them; what those cannot keep is counted and said. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "firmware/host/base/array.h"
#include "firmware/host/base/memory.h"
#include "firmware/host/base/number.h"
#include "firmware/host/base/quote.h"
#include "firmware/host/exchange/import.h"
#include "firmware/host/exchange/import_anim.h"
#include "motion/core/err.h"
#include "motion/core/fixed.h"
#include "motion/double/double_math.h"

static const struct {
    const char *name;
    enum import_anim_tangent tangent;
} anim_tangent[] = {
    { "fixed", IMPORT_ANIM_FIXED },   { "linear", IMPORT_ANIM_LINEAR },
    { "flat", IMPORT_ANIM_FLAT },     { "spline", IMPORT_ANIM_SPLINE },
    { "smooth", IMPORT_ANIM_SPLINE }, { "auto", IMPORT_ANIM_AUTO },
    { "clamped", IMPORT_ANIM_AUTO },  { "plateau", IMPORT_ANIM_AUTO },
    { "slow", IMPORT_ANIM_AUTO },     { "fast", IMPORT_ANIM_AUTO },
    { "global", IMPORT_ANIM_AUTO },   { "automix", IMPORT_ANIM_AUTO },
    { "autoease", IMPORT_ANIM_AUTO }, { "autocustom", IMPORT_ANIM_AUTO },
    { "step", IMPORT_ANIM_STEP },     { "stepnext", IMPORT_ANIM_STEP },
};

static const struct {
    const char *name;
    unsigned num, den; /* per second; num 0: not frames */
    const char *unit;
} anim_time[] = {
    { "game", 15, 1, "" },
    { "film", 24, 1, "" },
    { "pal", 25, 1, "" },
    { "ntsc", 30, 1, "" },
    { "show", 48, 1, "" },
    { "palf", 50, 1, "" },
    { "ntscf", 60, 1, "" },
    /* whole ticks of 1/141120000 s */
    { "23.976fps", 24000, 1001, "" },
    { "29.97fps", 30000, 1001, "" },
    { "29.97df", 30000, 1001, "" },
    { "47.952fps", 48000, 1001, "" },
    { "59.94fps", 60000, 1001, "" },
    { "sec", 1, 1, "s" },
    { "second", 1, 1, "s" },
    { "millisec", 1000, 1, "ms" },
    { "millisecond", 1000, 1, "ms" },
};

static const struct {
    const char *name, *unit;
} anim_unit[] = {
    { "mm", "mm" },         { "millimeter", "mm" }, { "cm", "cm" },
    { "centimeter", "cm" }, { "m", "m" },           { "meter", "m" },
    { "in", "in" },         { "inch", "in" },       { "ft", "ft" },
    { "foot", "ft" },       { "deg", "deg" },       { "degree", "deg" },
    { "rad", "rad" },       { "radian", "rad" },
};

static const char *const anim_infinity[] = {
    [IMPORT_ANIM_CONSTANT] = "constant",
    [IMPORT_ANIM_LINE] = "linear",
    [IMPORT_ANIM_CYCLE] = "cycle",
    [IMPORT_ANIM_CYCLE_RELATIVE] = "cycleRelative",
    [IMPORT_ANIM_OSCILLATE] = "oscillate",
};

struct anim_read {
    struct import_text text;
    const struct import_wish *wish;
    struct imported *out;
    const char *linear, *angular, *tangent_angle, *time_unit;
    bool breakdown; /* keys have the third flag: version 1.1 */
    char leaf[IMPORT_WORD_MAX], node[IMPORT_WORD_MAX];
    bool named, skipped;
    unsigned curves;
    struct import_word end; /* of the file's range, empty: not said */
    /* of the curve that is being read */
    struct import_anim_curve curve;
    enum units_axis axis_unit;
    const char *unit; /* of its values, "" for the axis's own */
    unsigned automatic, longer, unplayed; /* what is lost */
};

static int anim_refuse(const struct anim_read *self, struct plan_place place,
                       const char *word, const char *expected)
{
    char quote[QUOTE_MAX];
    return yaml_report_at(&self->text.report, place, "%s is not valid here, %s",
                          quote_text(quote, word, strlen(word)), expected);
}

static int anim_fail(const struct anim_read *self, const char *what)
{
    return yaml_report_at(&self->text.report, import_text_place(&self->text),
                          "%s", what);
}

/* The next word that must be there. */
static int anim_word(struct anim_read *self, struct import_word *word)
{
    int found = import_text_word(&self->text, ";", word);
    if (found == 0)
        return anim_fail(self, "the line ends, a value is missing");
    return found;
}

/* The next line's first word; 0 at the end of the file. */
static int anim_line(struct anim_read *self, struct import_word *word)
{
    while (import_text_filled(&self->text, '#')) {
        int found = import_text_word(&self->text, ";", word);
        if (found < 0)
            return -1;
        if (found > 0 && strncmp(word->text, "//", 2) != 0)
            return 1;
    }
    return 0;
}

static bool anim_is_number(const char *text)
{
    return strchr("eE", text[0]) == NULL &&
           text[strspn(text, "+-.0123456789eE")] == 0;
}

/* --- units --- */

static const char *anim_find_unit(const char *name)
{
    for (size_t i = 0; i < ARRAY_LEN(anim_unit); i++)
        if (strcmp(anim_unit[i].name, name) == 0)
            return anim_unit[i].unit;
    return NULL;
}

static int anim_read_unit(struct anim_read *self, const char **unit)
{
    struct import_word word;
    if (anim_word(self, &word) < 0)
        return -1;
    *unit = anim_find_unit(word.text);
    return *unit != NULL ? 0
                         : anim_refuse(self, word.place, word.text,
                                       "expected mm, cm, m, in, ft, deg or "
                                       "rad");
}

/* Any other, such as "12fps". */
static int anim_read_rate(struct anim_read *self, struct import_word *word)
{
    char sentence[UNITS_SENTENCE_MAX];
    char *fps = strstr(word->text, "fps");
    if (fps == NULL || fps[3] != 0)
        return anim_refuse(self, word->place, word->text,
                           "expected game, film, pal, ntsc, show, palf, ntscf, "
                           "sec, millisec or such as 23.976fps");
    *fps = 0;
    if (units_parse_fps(word->text, &self->out->fps, sentence) < 0)
        return yaml_report_at(&self->text.report, word->place, "%s", sentence);
    self->time_unit = "";
    return 0;
}

static int anim_read_time_unit(struct anim_read *self)
{
    struct import_word word;
    if (anim_word(self, &word) < 0)
        return -1;
    for (size_t i = 0; i < ARRAY_LEN(anim_time); i++) {
        if (strcmp(word.text, anim_time[i].name) != 0)
            continue;
        self->time_unit = anim_time[i].unit;
        self->out->fps =
            (struct units_fps){ anim_time[i].num, anim_time[i].den };
        return 0;
    }
    return anim_read_rate(self, &word);
}

/* --- keys --- */

static int anim_read_tangent(struct anim_read *self,
                             enum import_anim_tangent *tangent)
{
    struct import_word word;
    if (anim_word(self, &word) < 0)
        return -1;
    for (size_t i = 0; i < ARRAY_LEN(anim_tangent); i++) {
        if (strcmp(word.text, anim_tangent[i].name) != 0)
            continue;
        *tangent = anim_tangent[i].tangent;
        self->automatic += *tangent == IMPORT_ANIM_AUTO;
        if (*tangent != IMPORT_ANIM_STEP)
            return 0;
        return anim_refuse(self, word.place, word.text, "a servo cannot jump");
    }
    return anim_refuse(self, word.place, word.text,
                       "expected a tangent: fixed, linear, flat, spline, auto, "
                       "clamped or plateau");
}

static int anim_read_double(struct anim_read *self, double *value,
                            struct import_word *word)
{
    char *end;
    if (anim_word(self, word) < 0)
        return -1;
    *value = strtod(word->text, &end);
    if (*end != 0 || !isfinite(*value) || !anim_is_number(word->text))
        return anim_refuse(self, word->place, word->text, "expected a number");
    return 0;
}

static int anim_slope(struct anim_read *self, double slope,
                      const struct import_word *word,
                      struct import_anim_side *side)
{
    const struct units_context context = { .unit = self->axis_unit };
    const struct units_fps *fps = &self->out->fps;
    char sentence[UNITS_SENTENCE_MAX], text[96];
    snprintf(text, sizeof text, "%.17g%s%s",
             slope * (double)fps->num / (double)fps->den, self->unit,
             self->unit[0] != 0 ? "/s" : "");
    if (units_parse(text, UNITS_VELOCITY, &context, &side->vel_q32, sentence) ==
        0)
        return 0;
    return anim_refuse(self, word->place, word->text,
                       "the tangent is steeper than velocities can be");
}

/* A third of the tangent: `time` and `rise` are in the file's units. */
static int anim_control(struct anim_read *self, double time, double rise,
                        const struct import_word *word,
                        struct import_anim_side *side)
{
    const struct units_context context = { .unit = self->axis_unit,
                                           .fps = self->out->fps };
    char sentence[UNITS_SENTENCE_MAX], text[2][96];
    snprintf(text[0], sizeof text[0], "%s%.17g%s",
             self->time_unit[0] == 0 ? "f" : "", time / 3, self->time_unit);
    snprintf(text[1], sizeof text[1], "%.17g%s", rise / 3, self->unit);
    if (units_parse(text[0], UNITS_TIME, &context, &side->dt_ns_q12,
                    sentence) == 0 &&
        units_parse(text[1], UNITS_POSITION, &context, &side->dp_q32,
                    sentence) == 0)
        return 0;
    return anim_refuse(self, word->place, word->text,
                       "the tangent reaches beyond what times and positions "
                       "can be");
}

/* Angle and weight of a fixed tangent. */
static int anim_read_angle(struct anim_read *self,
                           struct import_anim_side *side)
{
    const double quarter = DOUBLE_PI / 2;
    struct import_word word, weight_word;
    double angle, weight;
    if (side->tangent != IMPORT_ANIM_FIXED)
        return 0;
    if (anim_read_double(self, &angle, &word) < 0 ||
        anim_read_double(self, &weight, &weight_word) < 0)
        return -1;
    if (strcmp(self->tangent_angle, "deg") == 0)
        angle *= quarter / 90;
    if (!self->curve.weighted && fabs(angle) < 1.5707963)
        return anim_slope(self, double_sin(angle) / double_cos(angle), &word,
                          side);
    if (!self->curve.weighted)
        return anim_refuse(self, word.place, word.text,
                           "the tangent is steeper than velocities can be");
    if (fabs(angle) > quarter)
        return anim_refuse(self, word.place, word.text,
                           "expected an angle from -90 to 90 deg");
    if (weight < 0)
        return anim_refuse(self, weight_word.place, weight_word.text,
                           "expected a weight of at least 0");
    /* the cosine of a right angle is not quite 0 */
    return anim_control(self,
                        fabs(angle) < quarter ? weight * double_cos(angle) : 0,
                        weight * double_sin(angle), &word, side);
}

static int anim_read_flags(struct anim_read *self)
{
    struct import_word word;
    double flag;
    for (int i = 0; i < (self->breakdown ? 3 : 2); i++)
        if (anim_read_double(self, &flag, &word) < 0)
            return -1;
    return 0;
}

static int anim_read_key(struct anim_read *self, const struct import_word *time)
{
    const struct units_context context = { .unit = self->axis_unit,
                                           .fps = self->out->fps };
    struct import_word value, extra;
    struct plan_key *key =
        import_add_key(&self->text, time->place, self->curve.axis);
    if (key == NULL)
        return -1;
    import_anim_capacity(&self->curve, self->curve.axis->key_count);
    struct import_anim_side *side =
        self->curve.side[self->curve.axis->key_count - 1];
    side[0] = side[1] = (struct import_anim_side){ .vel_q32 = 0 };
    if (import_text_number(&self->text, time,
                           self->time_unit[0] == 0 ? "f" : "", self->time_unit,
                           UNITS_TIME, &context, &key->key.t_ns_q12) < 0 ||
        anim_word(self, &value) < 0 ||
        import_text_number(&self->text, &value, "", self->unit, UNITS_POSITION,
                           &context, &key->key.pos_q32) < 0 ||
        anim_read_tangent(self, &side[0].tangent) < 0 ||
        anim_read_tangent(self, &side[1].tangent) < 0 ||
        anim_read_flags(self) < 0 || anim_read_angle(self, &side[0]) < 0 ||
        anim_read_angle(self, &side[1]) < 0)
        return -1;
    if (self->curve.axis->key_count > 1 &&
        key->key.t_ns_q12 <= key[-1].key.t_ns_q12)
        return anim_refuse(self, time->place, time->text,
                           "expected a time later than the one before");
    if (import_text_word(&self->text, ";", &extra) != 0)
        return anim_refuse(self, extra.place, extra.text,
                           "the key should end here");
    return 0;
}

static int anim_settle(struct anim_read *self)
{
    struct import_anim_curve *curve = &self->curve;
    uint32_t failed;
    if (curve->axis->key_count == 0)
        return anim_fail(self, "the curve has no keys");
    if (import_anim_settle(curve, &failed) < 0)
        return yaml_report_at(&self->text.report,
                              curve->axis->key[failed].place,
                              "the tangent is steeper than velocities can be");
    self->longer += curve->longer;
    return 0;
}

/* --- curves --- */

/* anim [full [leaf node]] row child attribute; */
static int anim_read_name(struct anim_read *self)
{
    struct import_word word;
    int found, names = 0;
    self->leaf[0] = self->node[0] = 0;
    while ((found = import_text_word(&self->text, ";", &word)) > 0) {
        if (anim_is_number(word.text))
            continue;
        if (names++ == 2)
            memcpy(self->node, word.text, sizeof self->node);
        else
            memcpy(self->leaf, word.text, sizeof self->leaf);
    }
    self->named = true;
    return found;
}

static bool anim_has_axis(const struct anim_read *self, const char *name)
{
    for (unsigned i = 0; i < self->wish->rig->axis_count; i++)
        if (import_text_same(self->wish->rig->axis[i].name, name))
            return true;
    return false;
}

/* By --columns in the file's order, else by the node's name, else by the
 * attribute's. */
static int anim_open_curve(struct anim_read *self, struct plan_place place)
{
    const struct import_wish *wish = self->wish;
    const char *name =
        anim_has_axis(self, self->node) ? self->node : self->leaf;
    if (!self->named)
        return anim_fail(self, "animData without a line 'anim' before it");
    self->named = false;
    if (wish->column_count > 0 && self->curves >= wish->column_count)
        return yaml_report_at(&self->text.report, place,
                              "curve %u has no axis, expected as many names in "
                              "--columns as curves",
                              self->curves + 1);
    if (wish->column_count > 0)
        name = wish->column[self->curves];
    self->curves++;
    self->curve.axis = NULL;
    self->unit = self->linear;
    self->curve.weighted = false;
    self->curve.before = self->curve.after = IMPORT_ANIM_CONSTANT;
    self->tangent_angle = self->angular;
    self->skipped = strcmp(name, "-") == 0;
    if (self->skipped)
        return 0;
    self->curve.axis =
        import_add_axis(&self->text, place, wish, self->out, name);
    if (self->curve.axis == NULL)
        return -1;
    self->axis_unit =
        wish->rig->axis[rig_axis_index(wish->rig, self->curve.axis->name)].unit;
    return 0;
}

static int anim_read_output(struct anim_read *self)
{
    struct import_word word;
    if (anim_word(self, &word) < 0)
        return -1;
    if (strcmp(word.text, "linear") == 0)
        self->unit = self->linear;
    else if (strcmp(word.text, "angular") == 0)
        self->unit = self->angular;
    else if (strcmp(word.text, "unitless") == 0)
        self->unit = "";
    else
        return anim_refuse(self, word.place, word.text,
                           "expected linear, angular or unitless");
    return 0;
}

static int anim_read_keys(struct anim_read *self)
{
    struct import_word word;
    int found;
    if (!self->skipped && self->curve.axis->key_count > 0)
        return anim_fail(self,
                         "the curve has keys already, expected them once");
    while ((found = anim_line(self, &word)) > 0) {
        if (strcmp(word.text, "}") == 0)
            return self->skipped ? 0 : anim_settle(self);
        if (!self->skipped && anim_read_key(self, &word) < 0)
            return -1;
    }
    return found < 0 ? -1 : anim_fail(self, "the file ends within keys");
}

static int anim_read_infinity(struct anim_read *self,
                              const struct import_word *word,
                              enum import_anim_infinity *infinity)
{
    for (size_t i = 0; i < ARRAY_LEN(anim_infinity); i++)
        if (strcmp(word->text, anim_infinity[i]) == 0) {
            *infinity = (enum import_anim_infinity)i;
            return 0;
        }
    return anim_refuse(self, word->place, word->text,
                       "expected constant, linear, cycle, cycleRelative or "
                       "oscillate");
}

static int anim_read_member(struct anim_read *self,
                            const struct import_word *key)
{
    struct import_word word;
    if (strcmp(key->text, "output") == 0)
        return anim_read_output(self);
    if (strcmp(key->text, "tangentAngleUnit") == 0)
        return anim_read_unit(self, &self->tangent_angle);
    if (strcmp(key->text, "keys") == 0)
        return anim_read_keys(self);
    if (anim_word(self, &word) < 0)
        return -1;
    if (strcmp(key->text, "weighted") == 0)
        self->curve.weighted = strcmp(word.text, "0") != 0;
    else if (strcmp(key->text, "input") == 0 && strcmp(word.text, "time") != 0)
        return anim_refuse(self, word.place, word.text,
                           "expected curves over time");
    else if (strcmp(key->text, "preInfinity") == 0)
        return anim_read_infinity(self, &word, &self->curve.before);
    else if (strcmp(key->text, "postInfinity") == 0)
        return anim_read_infinity(self, &word, &self->curve.after);
    return 0;
}

static int anim_read_curve(struct anim_read *self, struct plan_place place)
{
    struct import_word word;
    int found;
    if (anim_open_curve(self, place) < 0)
        return -1;
    while ((found = anim_line(self, &word)) > 0) {
        if (strcmp(word.text, "}") == 0)
            return self->skipped || self->curve.axis->key_count > 0
                       ? 0
                       : anim_fail(self, "the curve has no keys");
        if (strcmp(word.text, "{") != 0 && anim_read_member(self, &word) < 0)
            return -1;
    }
    return found < 0 ? -1 : anim_fail(self, "the file ends within animData");
}

/* --- the file --- */

static int anim_read_version(struct anim_read *self)
{
    struct import_word word;
    if (anim_line(self, &word) <= 0 || strcmp(word.text, "animVersion") != 0)
        return yaml_report_at(&self->text.report, (struct plan_place){ 1, 1 },
                              "the file does not begin with 'animVersion'");
    if (anim_word(self, &word) < 0)
        return -1;
    self->breakdown = strcmp(word.text, "1.0") != 0;
    return 0;
}

static int anim_read_file(struct anim_read *self)
{
    struct import_word word;
    int found, err = anim_read_version(self);
    while (err == 0 && (found = anim_line(self, &word)) != 0) {
        if (found < 0)
            return -1;
        if (strcmp(word.text, "timeUnit") == 0)
            err = anim_read_time_unit(self);
        else if (strcmp(word.text, "linearUnit") == 0)
            err = anim_read_unit(self, &self->linear);
        else if (strcmp(word.text, "angularUnit") == 0)
            err = anim_read_unit(self, &self->angular);
        else if (strcmp(word.text, "endTime") == 0)
            err = anim_word(self, &self->end) < 0 ? -1 : 0;
        else if (strcmp(word.text, "anim") == 0)
            err = anim_read_name(self);
        else if (strcmp(word.text, "animData") == 0)
            err = anim_read_curve(self, word.place);
        else if (strcmp(word.text, "}") == 0 || strcmp(word.text, "{") == 0)
            err = anim_refuse(self, word.place, word.text, "nothing is open");
    }
    if (err == 0 && self->out->move.axis_count == 0)
        return anim_fail(self, "there are no curves with axes");
    return err;
}

/* The end of the file's range, if it says one. */
static int anim_read_end(struct anim_read *self, int64_t *end_ns_q12)
{
    const struct units_context context = { .fps = self->out->fps };
    if (self->end.text[0] == 0)
        return 0;
    return import_text_number(
        &self->text, &self->end, self->time_unit[0] == 0 ? "f" : "",
        self->time_unit, UNITS_TIME, &context, end_ns_q12);
}

/* The earliest key of all curves, and the last or the end of the range. */
static int anim_range(struct anim_read *self, int64_t *first, int64_t *end)
{
    const struct plan_move *move = &self->out->move;
    int64_t length;
    *first = INT64_MAX;
    *end = INT64_MIN;
    if (anim_read_end(self, end) < 0)
        return -1;
    for (uint32_t i = 0; i < move->axis_count; i++) {
        const struct plan_axis *axis = &move->axis[i];
        const int64_t last = axis->key[axis->key_count - 1].key.t_ns_q12;
        if (axis->key[0].key.t_ns_q12 < *first)
            *first = axis->key[0].key.t_ns_q12;
        if (last > *end)
            *end = last;
    }
    if (motion_fixed_sub(*end, *first, &length) == MOTION_OK)
        return 0;
    return anim_fail(self, "the file's range is longer than 26 days");
}

/* Times count from the earliest key of all curves; infinities play until the
 * last key or the end of the file's range. */
static int anim_shift(struct anim_read *self)
{
    struct plan_move *move = &self->out->move;
    int64_t first, end;
    if (anim_range(self, &first, &end) < 0)
        return -1;
    for (uint32_t i = 0; i < move->axis_count; i++) {
        for (uint32_t k = 0; k < move->axis[i].key_count; k++)
            move->axis[i].key[k].key.t_ns_q12 -= first;
        self->unplayed += !import_anim_until(&move->axis[i], end - first);
    }
    return 0;
}

static void anim_note(const struct anim_read *self)
{
    const struct {
        unsigned count;
        const char *what;
    } lost[] = {
        { self->automatic, "automatic tangents (by slew's rule)" },
        { self->longer, "tangents beyond the next key (shortened)" },
        { self->unplayed, "infinities that begin where the file ends" },
    };
    char *note = self->out->note;
    size_t used = 0;
    for (size_t i = 0; i < ARRAY_LEN(lost); i++)
        if (lost[i].count > 0)
            used += (size_t)snprintf(note + used, IMPORT_NOTE_MAX - used,
                                     "%s%u %s", used > 0 ? ", " : "",
                                     lost[i].count, lost[i].what);
}

int import_anim(const struct files *files, const char *path,
                const struct import_wish *wish, struct imported *imported,
                char message[YAML_MESSAGE_MAX])
{
    struct anim_read *self = memory_new(1, sizeof *self);
    *self = (struct anim_read){ .wish = wish,
                                .out = imported,
                                .linear = "cm",
                                .angular = "deg",
                                .time_unit = "" };
    *imported = (struct imported){ .fps = { 24, 1 } };
    int err =
        import_text_load(&self->text, files, path, message, YAML_MESSAGE_MAX);
    self->text.progress = wish->progress;
    if (err == 0)
        err = anim_read_file(self);
    if (err == 0)
        err = anim_shift(self);
    if (err == 0)
        anim_note(self);
    import_text_free(&self->text);
    memory_free(self->curve.side);
    memory_free(self);
    if (err < 0)
        move_free(&imported->move);
    return err;
}
