/* firmware/linux/commands/run/jog_wanted.c - see jog_wanted.h. */
#include "firmware/linux/commands/run/jog_wanted.h"

#include <stdio.h>
#include <string.h>
#include <unistd.h>

#include "firmware/host/base/number.h"
#include "firmware/host/base/units.h"
#include "firmware/linux/base/error.h"
#include "motion/core/fixed.h"
#include "motion/otg/otg.h"

/* --- the words --- */

/* All words from `first` up to `end`, parted by blanks: units may stand
 * apart. */
static void wanted_join(const struct jog_wanted *want, int first, int end,
                        char *text, size_t capacity)
{
    size_t at = 0;
    text[0] = 0;
    for (int i = first; i < end && at < capacity; i++)
        at += (size_t)snprintf(text + at, capacity - at, "%s%s",
                               i > first ? " " : "", want->options->path[i]);
}

static int wanted_value(const struct jog_wanted *want, int first, int end,
                        enum units_quantity quantity, int64_t *out)
{
    const struct units_context units = { .unit = want->rig_axis->unit };
    char text[128], sentence[UNITS_SENTENCE_MAX];
    wanted_join(want, first, end, text, sizeof text);
    if (units_parse(text, quantity, &units, out, sentence) == 0)
        return 0;
    error_say("slew jog: %s", sentence);
    return -1;
}

static int wanted_fail(void)
{
    error_say("slew jog: expected +10mm, -10mm, to 45deg, or at 5mm/s for 2s");
    return -1;
}

static int wanted_find(const struct jog_wanted *want, const char *word)
{
    for (int i = 2; i < want->options->path_count; i++)
        if (strcmp(want->options->path[i], word) == 0)
            return i;
    return -1;
}

static int wanted_read_at(struct jog_wanted *want)
{
    const int count = want->options->path_count;
    const int split = wanted_find(want, "for");
    int64_t for_ns_q12;
    if (split < 4 || split + 1 >= count)
        return wanted_fail();
    if (wanted_value(want, 3, split, UNITS_VELOCITY, &want->speed_q32) < 0 ||
        wanted_value(want, split + 1, count, UNITS_TIME, &for_ns_q12) < 0)
        return -1;
    want->kind = JOG_AT;
    want->direction = want->speed_q32 < 0 ? -1 : 1;
    if (want->speed_q32 < 0)
        want->speed_q32 = -want->speed_q32;
    want->for_ns = for_ns_q12 / MOTION_FIXED_NS_Q12;
    return want->speed_q32 == 0 || want->for_ns <= 0 ? wanted_fail() : 0;
}

static int wanted_read(struct jog_wanted *want)
{
    const struct options *options = want->options;
    const char *word = options->path_count > 2 ? options->path[2] : NULL;
    if (word == NULL)
        return 0;
    if (strcmp(word, "at") == 0)
        return wanted_read_at(want);
    want->kind = strcmp(word, "to") == 0 ? JOG_TO : JOG_BY;
    if (want->kind == JOG_BY && strchr("+- ", word[0]) == NULL)
        return wanted_fail();
    const int first = want->kind == JOG_TO ? 3 : 2;
    if (first >= options->path_count)
        return wanted_fail();
    return wanted_value(want, first, options->path_count, UNITS_POSITION,
                        &want->pos_q32);
}

/* --speed, or a quarter of the limit. */
static int wanted_speed(struct jog_wanted *want)
{
    const struct rig_axis *axis = want->rig_axis;
    const struct units_context units = { .unit = axis->unit };
    char sentence[UNITS_SENTENCE_MAX];
    if (want->kind == JOG_AT)
        return 0;
    if (want->options->speed == NULL) {
        want->speed_q32 =
            want->kind == JOG_BY_KEYS ? 0 : axis->limit.vel_q32 / 4 + 1;
        return 0;
    }
    if (units_parse(want->options->speed, UNITS_VELOCITY, &units,
                    &want->speed_q32, sentence) < 0) {
        error_say("slew jog: --speed: %s", sentence);
        return -1;
    }
    if (want->speed_q32 > 0)
        return 0;
    error_say("slew jog: --speed is not above zero, expected a speed such as "
              "5mm/s");
    return -1;
}

enum status jog_wanted_outside(const struct rig_axis *axis, int64_t pos_q32)
{
    const bool below = pos_q32 < axis->limit.pos_min_q32;
    const char *unit = units_axis_text(axis->unit);
    char pos[NUMBER_MAX], min[NUMBER_MAX], max[NUMBER_MAX];
    number_short(pos, pos_q32, 32);
    number_short(min, axis->limit.pos_min_q32, 32);
    number_short(max, axis->limit.pos_max_q32, 32);
    error_say("slew jog: %s %s is %s the %s limit of %s, expected a position "
              "from %s to %s %s",
              pos, unit, below ? "below" : "above", below ? "lower" : "upper",
              axis->name, min, max, unit);
    return STATUS_REFUSED;
}

static enum status wanted_limits(const struct jog_wanted *want)
{
    const struct rig_axis *axis = want->rig_axis;
    char speed[NUMBER_MAX], limit[NUMBER_MAX];
    if (want->speed_q32 > axis->limit.vel_q32) {
        number_short(speed, want->speed_q32, 32);
        number_short(limit, axis->limit.vel_q32, 32);
        error_say(
            "slew jog: %s %s/s is above the limit of %s, expected at most "
            "%s %s/s",
            speed, units_axis_text(axis->unit), axis->name, limit,
            units_axis_text(axis->unit));
        return STATUS_REFUSED;
    }
    if (want->kind != JOG_TO || (want->pos_q32 >= axis->limit.pos_min_q32 &&
                                 want->pos_q32 <= axis->limit.pos_max_q32))
        return STATUS_OK;
    return jog_wanted_outside(axis, want->pos_q32);
}

enum status jog_wanted_read(struct jog_wanted *want,
                            const struct options *options,
                            const struct live *live)
{
    *want = (struct jog_wanted){ .options = options };
    if (options->path_count < 2) {
        error_say("slew jog: which axis? expected RIG AXIS");
        return STATUS_INPUT;
    }
    const int axis = live_axis(live, "jog", options->path[1]);
    if (axis < 0)
        return STATUS_INPUT;
    want->axis = (unsigned)axis;
    want->rig_axis = &live->rig->axis[axis];
    if (rig_kinds[want->rig_axis->kind]->samples) {
        error_say("slew jog: %s is sampled by a board, which is given whole "
                  "moves, expected an axis that follows set points",
                  want->rig_axis->name);
        return STATUS_INPUT;
    }
    want->dead_man_ns =
        options->dead_man_ns < 0 ? JOG_DEAD_MAN_NS : options->dead_man_ns;
    if (wanted_read(want) < 0 || wanted_speed(want) < 0)
        return STATUS_INPUT;
    if (options->keys != NULL && access(options->keys, F_OK) == 0) {
        error_say("%s: is there already, expected a new file for the keys",
                  options->keys);
        return STATUS_INPUT;
    }
    return wanted_limits(want);
}

/* --- what will happen --- */

/* How long a displacement takes from rest to rest; -1: it cannot be planned. */
static double wanted_duration_s(const struct jog_wanted *want,
                                int64_t displacement_q32)
{
    const struct plan_limit *limit = &want->rig_axis->limit;
    struct motion_otg_plan plan;
    const struct motion_otg_move move = {
        .goal = { .pos_q32 = displacement_q32 },
        .limit = { .vel_max_q32 = want->speed_q32,
                   .vel_min_q32 = -want->speed_q32,
                   .acc_max_q32 = limit->acc_q32,
                   .acc_min_q32 = -limit->acc_q32,
                   .jerk_q32 = limit->jerk_q32 },
    };
    if (motion_otg_make(&move, &plan, NULL) < 0)
        return -1;
    return number_double(plan.dur_ns_q12, 12) / 1e9;
}

void jog_wanted_intent(const struct jog_wanted *want)
{
    const struct rig_axis *axis = want->rig_axis;
    const char *unit = units_axis_text(axis->unit);
    char pos[NUMBER_MAX], speed[NUMBER_MAX], acc[NUMBER_MAX];
    number_short(pos, want->pos_q32, 32);
    number_short(speed, want->speed_q32, 32);
    number_short(acc, axis->limit.acc_q32, 32);
    printf("%s drives, %s: ", want->options->real ? "REAL" : "simulated",
           axis->name);
    if (want->kind == JOG_AT)
        printf("%s %s/s in the %s direction for %.3f s, then to rest", speed,
               unit, want->direction < 0 ? "negative" : "positive",
               (double)want->for_ns / 1e9);
    else if (want->kind == JOG_BY)
        printf("%s %s from where it is, %.3f s", pos, unit,
               wanted_duration_s(want, want->pos_q32));
    else if (want->kind == JOG_TO)
        printf("to %s %s", pos, unit);
    else
        printf("by keys");
    if (want->kind == JOG_BY || want->kind == JOG_TO)
        printf(", at most %s %s/s", speed, unit);
    printf(", at most %s %s/s2\n", acc, unit);
    fflush(stdout);
}
