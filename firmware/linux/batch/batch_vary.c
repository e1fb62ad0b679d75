/* firmware/linux/batch/batch_vary.c - see batch_vary.h. */
#include "firmware/linux/batch/batch_vary.h"

#include <ctype.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "firmware/host/base/units.h"
#include "motion/double/double_math.h"

struct vary_what {
    const char *word;
    enum units_quantity quantity;
    double least, most;
};
#define VARY_ROW(name, text, of, low, high, says)                              \
    [BATCH_##name] = { text, UNITS_##of, low, high },
static const struct vary_what vary_of[BATCH_WHATS] = {
    BATCH_WHAT_LIST(VARY_ROW)[BATCH_FAULTS] = { "faults", UNITS_RATIO, 0, 1 },
};

/* --- chance --- */

/* splitmix64: Steele, Lea, Flood, OOPSLA 2014. */
static uint64_t vary_mix(uint64_t z)
{
    z += UINT64_C(0x9E3779B97F4A7C15);
    z = (z ^ z >> 30) * UINT64_C(0xBF58476D1CE4E5B9);
    z = (z ^ z >> 27) * UINT64_C(0x94D049BB133111EB);
    return z ^ z >> 31;
}

/* 0 .. 1, of what is drawn for `key` in a run. */
static double vary_chance(uint64_t seed, uint64_t run, uint64_t key)
{
    const uint64_t bits = vary_mix(vary_mix(vary_mix(seed) ^ run) ^ key);
    return ldexp((double)(bits >> 11), -53);
}

/* --- reading --- */

static int vary_fail(char message[BATCH_MESSAGE_MAX], const char *item,
                     const char *what)
{
    snprintf(message, BATCH_MESSAGE_MAX, "--vary: '%.80s': %.280s", item, what);
    return -1;
}

static double vary_number(enum units_quantity quantity, int64_t value)
{
    return quantity == UNITS_TIME ? 1e-9 * ldexp((double)value, -12)
                                  : ldexp((double)value, -32);
}

static int vary_bound(const char *text, const struct vary_what *of,
                      enum units_axis unit, double *value,
                      char sentence[UNITS_SENTENCE_MAX])
{
    const struct units_context context = { .unit = unit };
    int64_t number;
    if (units_parse(text, of->quantity, &context, &number, sentence) < 0)
        return -1;
    *value = vary_number(of->quantity, number);
    if (*value >= of->least && *value <= of->most)
        return 0;
    snprintf(sentence, UNITS_SENTENCE_MAX, "is out of range, expected %g .. %g",
             of->least, of->most);
    return -1;
}

/* LOW..HIGH, or one value; a unit behind HIGH holds for LOW too. */
static int vary_range(const char *item, char *text, struct batch_item *to,
                      enum units_axis unit, char message[BATCH_MESSAGE_MAX])
{
    const struct vary_what *const of = &vary_of[to->what];
    char sentence[UNITS_SENTENCE_MAX], low[96];
    char *const dots = strstr(text, "..");
    const char *high = text;

    if (dots != NULL) {
        *dots = '\0';
        high = dots + 2;
        const char *word = high + strspn(high, " +-.0123456789eE");
        if (strpbrk(text, "abcdfghijklmnopqrstuvwxyz%") != NULL)
            word = ""; /* LOW has its own */
        snprintf(low, sizeof low, "%.60s%s%.30s", text,
                 word[0] != '\0' ? " " : "", word);
    } else {
        snprintf(low, sizeof low, "%.60s", text);
    }
    if (vary_bound(low, of, unit, &to->low, sentence) < 0 ||
        vary_bound(high, of, unit, &to->high, sentence) < 0)
        return vary_fail(message, item, sentence);
    return to->low <= to->high
               ? 0
               : vary_fail(message, item,
                           "goes down, expected the lower value first");
}

/* MEAN+-DEVIATION; a unit behind DEVIATION holds for MEAN too. */
static int vary_normal(const char *item, char *text, struct batch_item *to,
                       enum units_axis unit, char message[BATCH_MESSAGE_MAX])
{
    const struct vary_what *const of = &vary_of[to->what];
    const struct vary_what spread = { of->word, of->quantity, 0, of->most };
    char sentence[UNITS_SENTENCE_MAX], mean[96];
    char *const sign = strstr(text, "+-");

    *sign = '\0';
    const char *const deviation = sign + 2;
    const char *word = deviation + strspn(deviation, " .0123456789eE");
    if (strpbrk(text, "abcdfghijklmnopqrstuvwxyz%") != NULL)
        word = ""; /* MEAN has its own */
    snprintf(mean, sizeof mean, "%.60s%s%.30s", text,
             word[0] != '\0' ? " " : "", word);
    if (vary_bound(mean, of, unit, &to->low, sentence) < 0 ||
        vary_bound(deviation, &spread, unit, &to->deviation, sentence) < 0)
        return vary_fail(message, item, sentence);
    to->high = to->low;
    return to->deviation > 0
               ? 0
               : vary_fail(message, item,
                           "has no deviation, expected one above 0");
}

static int vary_add(struct batch_vary *vary, const struct batch_item *item,
                    const char *text, char message[BATCH_MESSAGE_MAX])
{
    for (unsigned i = 0; i < vary->count; i++)
        if (vary->item[i].what == item->what &&
            vary->item[i].axis == item->axis)
            return vary_fail(message, text, "is varied twice");
    vary->item = memory_pool_more(&vary->memory, vary->item, vary->count,
                                  sizeof *vary->item);
    vary->item[vary->count++] = *item;
    return 0;
}

static int vary_what_of(const char *word, enum batch_what *what)
{
    for (unsigned i = 0; i < BATCH_FAULTS; i++)
        if (strcmp(word, vary_of[i].word) == 0) {
            *what = (enum batch_what)i;
            return 0;
        }
    return -1;
}

/* Of one axis, or of every one: "*". */
static int vary_of_axes(struct batch_vary *vary, const char *item, char *text,
                        char *range, char message[BATCH_MESSAGE_MAX])
{
    char *const dot = strrchr(text, '.');
    struct batch_item to = { 0 };
    bool any = false;

    if (dot == NULL || vary_what_of(dot + 1, &to.what) < 0)
        return vary_fail(message, item,
                         "expected AXIS.mass, .bandwidth, .damping, .friction "
                         "or .delay, or faults");
    *dot = '\0';
    for (uint32_t i = 0; i < vary->rig->axis_count; i++) {
        char copy[128];
        if (strcmp(text, "*") != 0 &&
            strcmp(text, vary->rig->axis[i].name) != 0)
            continue;
        any = true;
        to.axis = i;
        snprintf(copy, sizeof copy, "%s", range);
        const enum units_axis unit = vary->rig->axis[i].unit;
        if ((strstr(copy, "+-") != NULL
                 ? vary_normal(item, copy, &to, unit, message)
                 : vary_range(item, copy, &to, unit, message)) < 0 ||
            vary_add(vary, &to, item, message) < 0)
            return -1;
    }
    return any ? 0 : vary_fail(message, item, "the rig has no such axis");
}

static int vary_faults(struct batch_vary *vary, const char *item, char *range,
                       char message[BATCH_MESSAGE_MAX])
{
    struct batch_item to = { .what = BATCH_FAULTS };
    if (vary->script == NULL)
        return vary_fail(message, item, "has no script, expected --faults");
    if (strstr(range, "..") != NULL || strstr(range, "+-") != NULL)
        return vary_fail(message, item, "is a share, such as 20 %");
    return vary_range(item, range, &to, UNITS_AXIS_MM, message) < 0
               ? -1
               : vary_add(vary, &to, item, message);
}

static int vary_item(struct batch_vary *vary, const char *item,
                     char message[BATCH_MESSAGE_MAX])
{
    char text[128];
    if (snprintf(text, sizeof text, "%s", item) >= (int)sizeof text)
        return vary_fail(message, item, "is too long");
    char *const equals = strchr(text, '=');
    if (equals == NULL)
        return vary_fail(
            message, item,
            "expected AXIS.WHAT=LOW..HIGH or =MEAN+-DEVIATION, such "
            "as pan.mass=1..2");
    *equals = '\0';
    if (strcmp(text, "faults") == 0)
        return vary_faults(vary, item, equals + 1, message);
    return vary_of_axes(vary, item, text, equals + 1, message);
}

/* Each variation of friction or delay is a fault that begins with the run. */
static int vary_check(const struct batch_vary *vary,
                      char message[BATCH_MESSAGE_MAX])
{
    unsigned entries = vary->script != NULL ? vary->script->count : 0;
    for (unsigned i = 0; i < vary->count; i++)
        entries += vary->item[i].what == BATCH_FRICTION ||
                   vary->item[i].what == BATCH_DELAY;
    if (entries <= FAULT_ENTRIES_MAX)
        return 0;
    snprintf(message, BATCH_MESSAGE_MAX,
             "--vary: %u variations of friction and delay and faults, expected "
             "at most %d",
             entries, FAULT_ENTRIES_MAX);
    return -1;
}

int batch_vary_init(struct batch_vary *vary, const struct rig *rig,
                    const char *text, const struct fault_script *script,
                    uint64_t seed, char message[BATCH_MESSAGE_MAX])
{
    char item[128];

    vary->rig = rig;
    vary->script = script;
    vary->seed = seed;
    vary->sim =
        memory_pool_new(&vary->memory, rig->axis_count, sizeof *vary->sim);
    for (uint32_t i = 0; i < rig->axis_count; i++)
        vary->sim[i] = rig->axis[i].sim;
    while (*text != '\0') {
        text += strspn(text, " ,");
        const size_t length = strcspn(text, ",");
        size_t used = length < sizeof item ? length : sizeof item - 1;
        memcpy(item, text, used);
        while (used > 0 && isspace((unsigned char)item[used - 1]))
            used--;
        item[used] = '\0';
        text += length;
        if (used > 0 && vary_item(vary, item, message) < 0)
            return -1;
    }
    return vary_check(vary, message);
}

void batch_vary_free(struct batch_vary *vary)
{
    memory_pool_free(&vary->memory);
    *vary = (struct batch_vary){ 0 };
}

/* --- a run --- */

void batch_item_name(const struct batch_vary *vary, unsigned item,
                     char name[BATCH_NAME_MAX])
{
    const struct batch_item *const of = &vary->item[item];
    const struct rig_axis *const axis = &vary->rig->axis[of->axis];
    if (of->what == BATCH_FAULTS)
        snprintf(name, BATCH_NAME_MAX, "faults");
    else if (of->what == BATCH_FRICTION)
        snprintf(name, BATCH_NAME_MAX, "%s.friction_%s_s2", axis->name,
                 units_axis_text(axis->unit));
    else
        snprintf(name, BATCH_NAME_MAX, "%s.%s%s", axis->name,
                 vary_of[of->what].word, of->what == BATCH_DELAY ? "_s" : "");
}

/* Box and Muller, Annals of Mathematical Statistics 29 (1958). */
static double vary_gauss(uint64_t seed, uint64_t run, uint64_t key)
{
    const double radius = 1 - vary_chance(seed, run, key); /* above 0 */
    const double angle =
        6.283185307179586 * vary_chance(seed, run, key | UINT64_C(1) << 62);

    return sqrt(-2 * double_log(radius)) * double_cos(angle);
}

double batch_item_value(const struct batch_vary *vary, unsigned item,
                        uint64_t run)
{
    const struct batch_item *const of = &vary->item[item];
    const uint64_t key = (uint64_t)of->what << 32 | (uint64_t)of->axis << 16;
    uint64_t faults = 0;

    if (of->deviation > 0)
        return fmin(
            fmax(of->low + of->deviation * vary_gauss(vary->seed, run, key),
                 vary_of[of->what].least),
            vary_of[of->what].most);
    if (of->what != BATCH_FAULTS)
        return of->low +
               (of->high - of->low) * vary_chance(vary->seed, run, key);
    for (uint32_t i = 0; i < vary->script->count; i++)
        if (vary_chance(vary->seed, run, key + i) < of->high)
            faults |= UINT64_C(1) << i;
    return (double)faults;
}

static uint32_t vary_times(uint32_t value, double factor, double least,
                           double most)
{
    const double product = rint(value * factor);
    return (uint32_t)(product < least  ? least
                      : product > most ? most
                                       : product);
}

static void vary_servo(struct rig_sim *sim, double bandwidth, double damping,
                       double acceleration)
{
    sim->omega_mrad_s = vary_times(sim->omega_mrad_s, bandwidth, 1000, 4000000);
    sim->zeta_permille =
        (uint16_t)vary_times(sim->zeta_permille, damping, 100, 2000);
    sim->acc_max_q32 =
        (int64_t)fmin(rint((double)sim->acc_max_q32 * acceleration), 0x1p62);
}

static void vary_entry(struct fault_script *script, enum fault_kind kind,
                       uint32_t axis, int64_t value)
{
    if (value > 0)
        script->entry[script->count++] = (struct fault_entry){
            .kind = kind,
            .target = FAULT_OF_AXIS,
            .index = axis,
            .of_axis = axis,
            .event = FAULT_ON_ENABLE,
            .value = value,
        };
}

static void vary_take(const struct batch_vary *vary, uint64_t faults,
                      struct fault_script *script)
{
    for (uint32_t i = 0; i < vary->script->count; i++)
        if ((faults >> i & 1) != 0)
            script->entry[script->count++] = vary->script->entry[i];
}

void batch_vary_apply(const struct batch_vary *vary, uint64_t run,
                      struct rig *rig, struct fault_script *script)
{
    *script =
        (struct fault_script){ .seed =
                                   vary_mix(vary_mix(vary->seed) ^ run) | 1 };
    for (uint32_t i = 0; i < rig->axis_count; i++)
        rig->axis[i].sim = vary->sim[i];
    for (unsigned i = 0; i < vary->count; i++) {
        const uint32_t axis = vary->item[i].axis;
        const double value = batch_item_value(vary, i, run);
        switch (vary->item[i].what) {
        case BATCH_MASS:
            vary_servo(&rig->axis[axis].sim, 1 / sqrt(value), 1 / sqrt(value),
                       1 / value);
            break;
        case BATCH_BANDWIDTH:
            vary_servo(&rig->axis[axis].sim, value, 1, 1);
            break;
        case BATCH_DAMPING:
            vary_servo(&rig->axis[axis].sim, 1, value, 1);
            break;
        case BATCH_FRICTION:
            vary_entry(script, FAULT_FRICTION_STEP, axis,
                       (int64_t)rint(ldexp(value, 32)));
            break;
        case BATCH_DELAY:
            vary_entry(script, FAULT_SLOW_DRIVE, axis,
                       (int64_t)rint(1e9 * value));
            break;
        case BATCH_FAULTS:
        case BATCH_WHATS:
            vary_take(vary, (uint64_t)value, script);
            break;
        }
    }
}
