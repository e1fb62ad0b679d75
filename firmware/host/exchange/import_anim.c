/* firmware/host/exchange/import_anim.c - Maya .anim: keys with tangents.
 *
 *   file  = statement ...         statement = word ... ;  |  anim  |  block
 *   block = animData { statement ...  keys { time value in out flags ... ; ... } }
 *
 * A statement ends at its ; wherever the line does.  Curves are counted before they
 * are read, so that --columns can name each of them.
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
    const struct import_settings *settings;
    struct imported *out;
    const char *linear, *angular, *tangent_angle, *time_unit;
    bool breakdown; /* keys have the third flag: version 1.1 */
    char leaf[IMPORT_WORD_MAX], node[IMPORT_WORD_MAX];
    bool named, skipped;
    unsigned curves; /* begun */
    unsigned unknown, unknown_line;
    char unknown_word[IMPORT_NAME_MAX];
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

/* The next token; one must be there. */
static int anim_next(struct anim_read *self, struct import_word *word)
{
    const int found = import_text_token(&self->text, "{};", word);

    return found == 0 ? anim_fail(self, "the file ends within a statement")
                      : found;
}

static bool anim_is_mark(const struct import_word *word)
{
    return strlen(word->text) == 1 && strchr("{};", word->text[0]) != NULL;
}

/* The next word of the statement; one must be there. */
static int anim_word(struct anim_read *self, struct import_word *word)
{
    if (anim_next(self, word) < 0)
        return -1;
    return anim_is_mark(word)
               ? anim_refuse(self, word->place, word->text,
                             "the statement ends and a value is missing")
               : 0;
}

/* The mark that must be next. */
static int anim_mark(struct anim_read *self, const char *mark)
{
    struct import_word word;
    char expected[16];

    if (anim_next(self, &word) < 0)
        return -1;
    snprintf(expected, sizeof expected, "expected %s", mark);
    return strcmp(word.text, mark) == 0
               ? 0
               : anim_refuse(self, word.place, word.text, expected);
}

/* A statement whose words are not asked for. */
static int anim_skip(struct anim_read *self)
{
    return import_text_skip(&self->text, ';')
               ? 0
               : anim_fail(self, "the file ends within a statement");
}

/* One that is in no description of the format: it is left, and said. */
static int anim_unknown(struct anim_read *self, const struct import_word *word)
{
    if (self->unknown++ == 0) {
        self->unknown_line = word->place.line;
        snprintf(self->unknown_word, sizeof self->unknown_word, "%.40s",
                 word->text);
    }
    return anim_skip(self);
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
    struct import_word value;
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
    if (self->out->first[0] == 0)
        snprintf(self->out->first, IMPORT_NAME_MAX, "%.60s", time->text);
    return anim_mark(self, ";");
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
    int names = 0;
    self->leaf[0] = self->node[0] = 0;
    for (;;) {
        if (anim_next(self, &word) < 0)
            return -1;
        if (strcmp(word.text, ";") == 0)
            break;
        if (anim_is_mark(&word))
            return anim_refuse(self, word.place, word.text, "expected ;");
        if (anim_is_number(word.text))
            continue;
        memcpy(names++ == 2 ? self->node : self->leaf, word.text,
               sizeof self->node);
    }
    self->named = true;
    return 0;
}

static bool anim_has_axis(const struct anim_read *self, const char *name)
{
    for (unsigned i = 0; i < self->settings->rig->axis_count; i++)
        if (import_text_same(self->settings->rig->axis[i].name, name))
            return true;
    return false;
}

/* By the node's name, else by the attribute's. */
static int anim_add_curve(struct anim_read *self, struct plan_place place)
{
    char name[IMPORT_NAME_MAX];

    if (!self->named)
        return yaml_report_at(&self->text.report, place,
                              "animData without a line 'anim' before it");
    self->named = false;
    snprintf(name, sizeof name, "%.30s%s%.30s", self->node,
             self->node[0] != 0 ? "." : "", self->leaf);
    return import_add_column(&self->text, place, self->out, name,
                             anim_has_axis(self, self->node) ? self->node
                                                             : self->leaf);
}

/* Past a block and those within it, or to the end of the file. */
static int anim_skip_block(struct anim_read *self)
{
    struct import_word word;
    unsigned depth = 0;
    int found;

    do {
        found = import_text_token(&self->text, "{};", &word);
        depth += found > 0 && strcmp(word.text, "{") == 0;
        depth -= found > 0 && depth > 0 && strcmp(word.text, "}") == 0;
    } while (found > 0 && depth > 0);
    return found;
}

/* All curves there are, before any is read. */
static int anim_scan(struct anim_read *self)
{
    const struct import_text begin = self->text;
    struct import_word word;
    int found;

    while ((found = import_text_token(&self->text, "{};", &word)) > 0) {
        if (strcmp(word.text, "anim") == 0)
            found = anim_read_name(self);
        else if (strcmp(word.text, "animData") == 0)
            found = anim_add_curve(self, word.place) < 0
                        ? -1
                        : anim_skip_block(self);
        else if (!anim_is_mark(&word))
            (void)import_text_skip(&self->text, ';');
        if (found < 0)
            return -1;
    }
    if (found < 0 ||
        (self->out->columns > 0 &&
         import_name_columns(&self->text, self->settings, self->out) < 0))
        return -1;
    self->text = begin;
    self->named = false;
    return 0;
}

static int anim_open_curve(struct anim_read *self)
{
    const struct import_settings *settings = self->settings;
    struct import_column *column = &self->out->column[self->curves++];
    self->curve.axis = NULL;
    self->unit = self->linear;
    self->curve.weighted = false;
    self->curve.before = self->curve.after = IMPORT_ANIM_CONSTANT;
    self->tangent_angle = self->angular;
    self->skipped = column->axis < 0;
    if (self->skipped)
        return 0;
    self->curve.axis =
        import_add_axis(&self->text, settings, self->out, column);
    if (self->curve.axis == NULL)
        return -1;
    self->axis_unit = settings->rig->axis[column->axis].unit;
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
    snprintf(self->out->column[self->curves - 1].unit, IMPORT_UNIT_MAX, "%s",
             self->unit);
    return anim_mark(self, ";");
}

static int anim_read_keys(struct anim_read *self)
{
    struct import_word word;
    if (!self->skipped && self->curve.axis->key_count > 0)
        return anim_fail(self,
                         "the curve has keys already, expected them once");
    if (anim_mark(self, "{") < 0)
        return -1;
    for (;;) {
        if (import_text_token(&self->text, "{};", &word) <= 0)
            return anim_fail(self, "the file ends within keys");
        if (strcmp(word.text, "}") == 0)
            return self->skipped ? 0 : anim_settle(self);
        if (strcmp(word.text, "{") == 0)
            return anim_refuse(self, word.place, word.text, "expected a key");
        if (strcmp(word.text, ";") == 0)
            continue;
        if (self->skipped ? anim_skip(self) < 0
                          : anim_read_key(self, &word) < 0)
            return -1;
    }
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

static int anim_read_weighted(struct anim_read *self)
{
    struct import_word word;
    if (anim_word(self, &word) < 0)
        return -1;
    self->curve.weighted = strcmp(word.text, "1") == 0;
    if (!self->curve.weighted && strcmp(word.text, "0") != 0)
        return anim_refuse(self, word.place, word.text, "expected 0 or 1");
    return 0;
}

static int anim_read_input(struct anim_read *self)
{
    struct import_word word;
    if (anim_word(self, &word) < 0)
        return -1;
    return strcmp(word.text, "time") == 0
               ? 0
               : anim_refuse(self, word.place, word.text,
                             "expected curves over time");
}

static int anim_read_member(struct anim_read *self,
                            const struct import_word *key)
{
    struct import_word word;
    int err;
    if (strcmp(key->text, "output") == 0)
        return anim_read_output(self);
    if (strcmp(key->text, "keys") == 0)
        return anim_read_keys(self);
    if (strcmp(key->text, "tangentAngleUnit") == 0)
        err = anim_read_unit(self, &self->tangent_angle);
    else if (strcmp(key->text, "weighted") == 0)
        err = anim_read_weighted(self);
    else if (strcmp(key->text, "input") == 0)
        err = anim_read_input(self);
    else if (strcmp(key->text, "preInfinity") == 0)
        err = anim_word(self, &word) < 0
                  ? -1
                  : anim_read_infinity(self, &word, &self->curve.before);
    else if (strcmp(key->text, "postInfinity") == 0)
        err = anim_word(self, &word) < 0
                  ? -1
                  : anim_read_infinity(self, &word, &self->curve.after);
    else
        return anim_unknown(self, key);
    return err < 0 ? -1 : anim_mark(self, ";");
}

static int anim_read_curve(struct anim_read *self)
{
    struct import_word word;
    if (anim_open_curve(self) < 0 || anim_mark(self, "{") < 0)
        return -1;
    for (;;) {
        if (import_text_token(&self->text, "{};", &word) <= 0)
            return anim_fail(self, "the file ends within animData");
        if (strcmp(word.text, "}") == 0)
            return self->skipped || self->curve.axis->key_count > 0
                       ? 0
                       : anim_fail(self, "the curve has no keys");
        if (strcmp(word.text, "{") == 0)
            return anim_refuse(self, word.place, word.text,
                               "expected a statement");
        if (strcmp(word.text, ";") != 0 && anim_read_member(self, &word) < 0)
            return -1;
    }
}

/* --- the file --- */

static int anim_read_version(struct anim_read *self)
{
    struct import_word word;
    if (import_text_token(&self->text, "{};", &word) <= 0 ||
        strcmp(word.text, "animVersion") != 0)
        return yaml_report_at(&self->text.report, (struct plan_place){ 1, 1 },
                              "the file does not begin with 'animVersion'");
    if (anim_word(self, &word) < 0)
        return -1;
    self->breakdown = strcmp(word.text, "1.0") != 0;
    return anim_mark(self, ";");
}

static bool anim_is_silent(const char *word)
{
    static const char *const silent[] = { "mayaVersion", "mayaSceneFile",
                                          "startTime",   "startUnitless",
                                          "endUnitless", "" };
    size_t i = 0;

    while (silent[i][0] != 0 && strcmp(word, silent[i]) != 0)
        i++;
    return silent[i][0] != 0;
}

static int anim_read_statement(struct anim_read *self,
                               const struct import_word *word)
{
    int err;
    if (strcmp(word->text, "anim") == 0)
        return anim_read_name(self);
    if (strcmp(word->text, "animData") == 0)
        return anim_read_curve(self);
    if (anim_is_silent(word->text))
        return anim_skip(self);
    if (strcmp(word->text, "timeUnit") == 0)
        err = anim_read_time_unit(self);
    else if (strcmp(word->text, "linearUnit") == 0)
        err = anim_read_unit(self, &self->linear);
    else if (strcmp(word->text, "angularUnit") == 0)
        err = anim_read_unit(self, &self->angular);
    else if (strcmp(word->text, "endTime") == 0)
        err = anim_word(self, &self->end);
    else
        return anim_unknown(self, word);
    return err < 0 ? -1 : anim_mark(self, ";");
}

static int anim_read_file(struct anim_read *self)
{
    struct import_word word;
    int found, err = anim_read_version(self);
    if (err == 0)
        err = anim_scan(self);
    while (err == 0 &&
           (found = import_text_token(&self->text, "{};", &word)) != 0) {
        if (found < 0)
            return -1;
        if (strcmp(word.text, "}") == 0 || strcmp(word.text, "{") == 0)
            return anim_refuse(self, word.place, word.text, "nothing is open");
        if (strcmp(word.text, ";") != 0)
            err = anim_read_statement(self, &word);
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
    if (self->unknown > 0)
        snprintf(note + used, IMPORT_NOTE_MAX - used,
                 "%s%u %s of a kind that is not known, the first '%s' in line "
                 "%u",
                 used > 0 ? ", " : "", self->unknown,
                 number_word(self->unknown, "statement", "statements"),
                 self->unknown_word, self->unknown_line);
}

int import_anim(const struct files *files, const char *path,
                const struct import_settings *settings,
                struct imported *imported, char message[YAML_MESSAGE_MAX])
{
    struct anim_read *self = memory_new(1, sizeof *self);
    *self = (struct anim_read){ .settings = settings,
                                .out = imported,
                                .linear = "cm",
                                .angular = "deg",
                                .time_unit = "" };
    *imported = (struct imported){ .fps = { 24, 1 }, .column_word = "curve" };
    int err =
        import_text_load(&self->text, files, path, message, YAML_MESSAGE_MAX);
    self->text.progress = settings->progress;
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
