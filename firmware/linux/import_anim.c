/* firmware/linux/import_anim.c - Maya .anim: keys with tangents.
 *
 * A tangent is an angle whose tangent is the slope in the file's units of value
 * per unit of time.  slew's key has one velocity, so a curve is hermite with
 * the slopes as velocities; what that cannot keep is counted and said. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "firmware/linux/import.h"
#include "firmware/linux/memory.h"
#include "firmware/linux/number.h"
#include "motion/fixed.h"

/* How a tangent is found. */
enum anim_tangent {
    ANIM_FIXED,
    ANIM_LINEAR,
    ANIM_FLAT,
    ANIM_SPLINE,
    ANIM_AUTO, /* Maya's own rules, not published: flat at extremes, else the
                  spline's, at most three times the lesser chord */
    ANIM_STEP, /* a jump */
};

static const struct {
    const char *name;
    enum anim_tangent tangent;
} anim_tangent[] = {
    { "fixed", ANIM_FIXED },   { "linear", ANIM_LINEAR },
    { "flat", ANIM_FLAT },     { "spline", ANIM_SPLINE },
    { "smooth", ANIM_SPLINE }, { "auto", ANIM_AUTO },
    { "clamped", ANIM_AUTO },  { "plateau", ANIM_AUTO },
    { "slow", ANIM_AUTO },     { "fast", ANIM_AUTO },
    { "global", ANIM_AUTO },   { "automix", ANIM_AUTO },
    { "autoease", ANIM_AUTO }, { "autocustom", ANIM_AUTO },
    { "step", ANIM_STEP },     { "stepnext", ANIM_STEP },
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

#define ARRAY_LEN(a) (sizeof(a) / sizeof(a)[0])

/* One side of a key. */
struct anim_side {
    enum anim_tangent tangent;
    int64_t vel_q32;
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
    /* of the curve that is being read */
    struct plan_axis *axis;
    enum rig_unit axis_unit;
    const char *unit; /* of its values, "" for the axis's own */
    bool weighted;
    struct anim_side (*side)[2]; /* in, out */
    size_t side_room;
    unsigned broken, automatic, weights, infinite; /* what is lost */
};

static int anim_refuse(const struct anim_read *self, struct plan_place place,
                       const char *word, const char *expected)
{
    char quote[YAML_QUOTE_MAX];
    return yaml_report_at(&self->text.report, place, "%s is not expected, %s",
                          yaml_quote(quote, word, strlen(word)), expected);
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
    return text[strspn(text, "+-.0123456789eE")] == 0;
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

/* "23.976fps" is 24000/1001 to whoever writes it. */
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

static int anim_read_tangent(struct anim_read *self, enum anim_tangent *tangent)
{
    struct import_word word;
    if (anim_word(self, &word) < 0)
        return -1;
    for (size_t i = 0; i < ARRAY_LEN(anim_tangent); i++) {
        if (strcmp(word.text, anim_tangent[i].name) != 0)
            continue;
        *tangent = anim_tangent[i].tangent;
        self->automatic += *tangent == ANIM_AUTO;
        if (*tangent != ANIM_STEP)
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

/* Angle and weight of a fixed tangent. */
static int anim_read_angle(struct anim_read *self, struct anim_side *side)
{
    const struct units_context context = { .unit = self->axis_unit };
    const struct units_fps *fps = &self->out->fps;
    char sentence[UNITS_SENTENCE_MAX], slope[96];
    struct import_word word, weight_word;
    double angle, weight;
    if (side->tangent != ANIM_FIXED)
        return 0;
    if (anim_read_double(self, &angle, &word) < 0 ||
        anim_read_double(self, &weight, &weight_word) < 0)
        return -1;
    if (strcmp(self->tangent_angle, "deg") == 0)
        angle *= acos(-1) / 180;
    snprintf(slope, sizeof slope, "%.17g%s%s",
             tan(angle) * (double)fps->num / (double)fps->den, self->unit,
             self->unit[0] != 0 ? "/s" : "");
    if (fabs(angle) < 1.5707963 && units_parse(slope, UNITS_VELOCITY, &context,
                                               &side->vel_q32, sentence) == 0)
        return 0;
    return anim_refuse(self, word.place, word.text,
                       "the tangent is steeper than velocities can be");
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

static void anim_room(struct anim_read *self, uint32_t count)
{
    if (count <= self->side_room)
        return;
    self->side_room = count < 64 ? 64 : 2 * (size_t)count;
    self->side = memory_resize(self->side, self->side_room, sizeof *self->side);
}

static int anim_read_key(struct anim_read *self, const struct import_word *time)
{
    const struct units_context context = { .unit = self->axis_unit,
                                           .fps = self->out->fps };
    struct import_word value, extra;
    struct plan_key *key = import_add_key(&self->text, time->place, self->axis);
    if (key == NULL)
        return -1;
    anim_room(self, self->axis->key_count);
    struct anim_side *side = self->side[self->axis->key_count - 1];
    side[0] = side[1] = (struct anim_side){ .vel_q32 = 0 };
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
    if (self->axis->key_count > 1 && key->key.t_ns_q12 <= key[-1].key.t_ns_q12)
        return anim_refuse(self, time->place, time->text,
                           "each time is later than the one before");
    if (import_text_word(&self->text, ";", &extra) != 0)
        return anim_refuse(self, extra.place, extra.text,
                           "the key should end here");
    return 0;
}

/* --- from tangents to velocities --- */

static double anim_chord(const struct plan_key *a, const struct plan_key *b)
{
    double dt = number_double(b->key.t_ns_q12 - a->key.t_ns_q12, 12) / 1e9;
    return (number_double(b->key.pos_q32, 32) -
            number_double(a->key.pos_q32, 32)) /
           dt;
}

static double anim_auto(double before, double after, double spline)
{
    double most = 3 * fmin(fabs(before), fabs(after));
    if (before * after <= 0)
        return 0;
    return copysign(fmin(fabs(spline), most), before);
}

/* Slope at key i of `count`, of its side 0 (in) or 1 (out). */
static double anim_slope(const struct anim_read *self, uint32_t i, int which)
{
    const struct plan_key *key = &self->axis->key[i];
    const struct anim_side *side = &self->side[i][which];
    uint32_t last = self->axis->key_count - 1;
    if (side->tangent == ANIM_FIXED)
        return number_double(side->vel_q32, 32);
    if (side->tangent == ANIM_FLAT || last == 0)
        return 0;
    double before = anim_chord(i > 0 ? key - 1 : key, i > 0 ? key : key + 1);
    double after =
        anim_chord(i < last ? key : key - 1, i < last ? key + 1 : key);
    if (side->tangent == ANIM_LINEAR)
        return which == 0 ? before : after;
    double spline = anim_chord(i > 0 ? key - 1 : key, i < last ? key + 1 : key);
    if (side->tangent == ANIM_SPLINE)
        return spline;
    return i == 0 || i == last ? 0 : anim_auto(before, after, spline);
}

static bool anim_is_linear(const struct anim_read *self)
{
    for (uint32_t i = 0; i < self->axis->key_count; i++)
        for (int which = 0; which < 2; which++)
            if (self->side[i][which].tangent != ANIM_LINEAR)
                return false;
    return true;
}

static int anim_settle_key(struct anim_read *self, uint32_t i)
{
    struct motion_key *key = &self->axis->key[i].key;
    const struct anim_side *side = self->side[i];
    double in = anim_slope(self, i, i == 0), out;
    out = anim_slope(self, i, i + 1 < self->axis->key_count);
    double mean = (in + out) / 2;
    bool whole = fabs(in - out) <= 1e-9 * fmax(fabs(in), fabs(out)) + 1e-9;
    self->broken += !whole;
    if (!(fabs(mean) < 2147483647.0))
        return yaml_report_at(&self->text.report, self->axis->key[i].place,
                              "the tangent is steeper than velocities can be");
    key->has_vel = true;
    const int64_t vel_q32 =
        side[0].tangent == ANIM_FIXED && whole && i > 0 ? side[0].vel_q32
        : side[1].tangent == ANIM_FIXED && whole        ? side[1].vel_q32
                                                 : llround(ldexp(mean, 32));
    key->vel = motion_real_from_q(vel_q32, 32);
    return 0;
}

static int anim_settle(struct anim_read *self)
{
    self->weights += self->weighted;
    if (self->axis->key_count == 0)
        return anim_fail(self, "the curve has no keys");
    self->axis->curve = PLAN_CURVE_LINEAR;
    if (anim_is_linear(self))
        return 0;
    self->axis->curve = PLAN_CURVE_HERMITE;
    for (uint32_t i = 0; i < self->axis->key_count; i++)
        if (anim_settle_key(self, i) < 0)
            return -1;
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
    self->axis = NULL;
    self->unit = self->linear;
    self->weighted = false;
    self->tangent_angle = self->angular;
    self->skipped = strcmp(name, "-") == 0;
    if (self->skipped)
        return 0;
    self->axis = import_add_axis(&self->text, place, wish, self->out, name);
    if (self->axis == NULL)
        return -1;
    self->axis_unit =
        wish->rig->axis[rig_axis_index(wish->rig, self->axis->name)].unit;
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
    while ((found = anim_line(self, &word)) > 0) {
        if (strcmp(word.text, "}") == 0)
            return self->skipped ? 0 : anim_settle(self);
        if (!self->skipped && anim_read_key(self, &word) < 0)
            return -1;
    }
    return found < 0 ? -1 : anim_fail(self, "the file ends within keys");
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
        self->weighted = strcmp(word.text, "0") != 0;
    else if (strcmp(key->text, "input") == 0 && strcmp(word.text, "time") != 0)
        return anim_refuse(self, word.place, word.text,
                           "expected curves over time");
    else if (strcmp(key->text, "preInfinity") == 0 ||
             strcmp(key->text, "postInfinity") == 0)
        self->infinite += strcmp(word.text, "constant") != 0;
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
            return self->skipped || self->axis->key_count > 0
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

/* Times count from the earliest key of all curves. */
static void anim_shift(struct plan_move *move)
{
    int64_t first = INT64_MAX;
    for (uint32_t i = 0; i < move->axis_count; i++)
        if (move->axis[i].key[0].key.t_ns_q12 < first)
            first = move->axis[i].key[0].key.t_ns_q12;
    for (uint32_t i = 0; i < move->axis_count; i++)
        for (uint32_t k = 0; k < move->axis[i].key_count; k++)
            move->axis[i].key[k].key.t_ns_q12 -= first;
}

static void anim_note(const struct anim_read *self)
{
    const struct {
        unsigned count;
        const char *what;
    } lost[] = {
        { self->broken, "broken tangents (one velocity each: their mean)" },
        { self->automatic, "automatic tangents (by slew's rule)" },
        { self->weights, "curves' weights" },
        { self->infinite, "infinities that are not constant" },
    };
    char *note = self->out->note;
    size_t used = 0;
    for (size_t i = 0; i < ARRAY_LEN(lost); i++)
        if (lost[i].count > 0)
            used += (size_t)snprintf(note + used, IMPORT_NOTE_MAX - used,
                                     "%s%u %s", used > 0 ? ", " : "",
                                     lost[i].count, lost[i].what);
}

int import_anim(const char *path, const struct import_wish *wish,
                struct imported *imported, char message[RIG_MESSAGE_MAX])
{
    struct anim_read *self = memory_new(1, sizeof *self);
    *self = (struct anim_read){ .wish = wish,
                                .out = imported,
                                .linear = "cm",
                                .angular = "deg",
                                .time_unit = "" };
    *imported = (struct imported){ .fps = { 24, 1 } };
    int err = import_text_load(&self->text, path, message, RIG_MESSAGE_MAX);
    if (err == 0)
        err = anim_read_file(self);
    if (err == 0) {
        anim_shift(&imported->move);
        anim_note(self);
    }
    import_text_free(&self->text);
    memory_free(self->side);
    memory_free(self);
    if (err < 0)
        move_free(&imported->move);
    return err;
}
