/* firmware/host/job/job_fit.c - see job_fit.h. */
#include "firmware/host/job/job_fit.h"

#include <cjson/cJSON.h>
#include <math.h>
#include <stdlib.h>

#include "firmware/host/base/memory.h"
#include "firmware/host/base/number.h"
#include "motion/core/clock_warp.h"
#include "motion/core/fixed.h"
#include "motion/double/double_math.h"
#include "motion/plan/check.h"
#include "motion/plan/fit/fit.h"
#include "motion/plan/shoot/plan_shoot.h"

#define JOB_FIT_SPANS_MAX 8 /* that are named; the worst */
/* Of a shoot: its times are rounded up one by one, which changes what part of a
 * frame each has. */
#define JOB_FIT_SHOOT_SPARE 1e-3

/* A span that touches a limit needs less than this more by rounding alone; times are
 * written in whole us. */
#define JOB_FIT_LEAST_S 1e-6

/* A span of an axis that needs longer than it has. */
struct job_fit_span {
    unsigned axis;
    uint32_t key; /* the first of its two, from 0 */
    double more_s;
};

struct job_fit {
    struct job_fit_rolls rolls;
    bool is_cured; /* there is more to it than speed: steps, positions */
    double stretch;
    int64_t end_ns_q12; /* a duration that fits */
    unsigned axes;      /* that need longer */
    uint32_t spans;     /* that need longer, also those not kept */
    struct job_fit_span span[JOB_FIT_SPANS_MAX];
};

void job_fit_limit(const struct job *job, unsigned axis,
                   struct plan_limit *limit)
{
    const int64_t rate_q30 = job->rate_q30;

    job_limit_at(&job_rig_axis(job, axis)->limit, rate_q30, limit);
    /* of path time: faster, a period covers more of it */
    (void)motion_fixed_mulshift(job->rig.period_ns, rate_q30, 30,
                                &limit->period_ns);
}

/* What is judged, and where its shot begins and ends between the rolls. */
struct job_fit_tracks {
    const struct motion_track *track; /* of each axis */
    int64_t start_ns_q12, end_ns_q12;
};

/* Is it of the pre-roll (`after` false) or of the post-roll, and not of the
 * shot?  Where they meet the acceleration is the shot's. */
static bool job_fit_is_rolled(const struct job *job,
                              const struct job_fit_tracks *of,
                              const struct job_violation *violation, bool after)
{
    const int64_t t = violation->t_ns_q12,
                  border = after ? of->end_ns_q12 : of->start_ns_q12;
    struct motion_state beside;

    if ((after ? job->move.post_roll_ns_q12 : job->move.pre_roll_ns_q12) == 0 ||
        (violation->kind != JOB_ACC && violation->kind != JOB_JERK))
        return false;
    if (t != border)
        return after ? t > border : t < border;
    motion_track_state(&of->track[violation->axis], after ? t + 1 : t - 1,
                       &beside);
    return violation->kind == JOB_JERK &&
           motion_fixed_abs(beside.jerk_q32) > (uint64_t)violation->limit;
}

/* A roll that takes so many times as long: the acceleration goes with 1 / T, the
 * jerk with 1 / T^2.  A shot: velocity 1 / T, and so on; what time does not cure
 * has no limit to be below. */
static void job_fit_take(const struct job *job, const struct job_fit_tracks *of,
                         const struct job_violation *violation,
                         struct job_fit *fit)
{
    const double ratio =
        fabs((double)violation->value) / (double)violation->limit;
    const double roll = violation->kind == JOB_JERK ? sqrt(ratio) : ratio;
    const double need = violation->kind == JOB_VEL    ? ratio
                        : violation->kind == JOB_ACC  ? sqrt(ratio)
                        : violation->kind == JOB_JERK ? double_cbrt(ratio)
                                                      : 0;

    if (job_fit_is_rolled(job, of, violation, false)) {
        fit->rolls.pre = fmax(fit->rolls.pre, roll);
    } else if (job_fit_is_rolled(job, of, violation, true)) {
        fit->rolls.post = fmax(fit->rolls.post, roll);
    } else {
        fit->is_cured = fit->is_cured && need > 0;
        fit->stretch = fmax(fit->stretch, need);
    }
}

/* As it is played.  By the violations, which there are of every move: each has
 * its worst value as played, by the limit as it is. */
static struct job_fit job_fit_judged(const struct job *job)
{
    const struct job_fit_tracks of = { job->track, job->outcome.lag_ns_q12,
                                       job->end_ns_q12 -
                                           job->outcome.tail_ns_q12 };
    struct job_fit fit = { .rolls = { 1, 1 }, .is_cured = true, .stretch = 1 };

    for (uint32_t i = 0; i < job->violation_count; i++)
        job_fit_take(job, &of, &job->violation[i], &fit);
    return fit;
}

/* The tracks before the shapers, without what these add before and after. */
static struct job_fit_tracks job_fit_plain_tracks(const struct job *job)
{
    const double second = (double)MOTION_FIXED_S_Q12;
    const int64_t lag = llround(job->shaping.lag_s * second);

    /* both of the shot's borders are as much later */
    return (struct job_fit_tracks){ job->plain, job->outcome.lag_ns_q12 - lag,
                                    job->end_ns_q12 - lag -
                                        job->outcome.tail_ns_q12 };
}

/* A shaper smooths what lasts no longer than it, and less of it the slower the
 * move is: the time by which the shaped one fits is not enough once it is taken.
 * What the plain one keeps, the shaped one does, too. */
static void job_fit_plain(const struct job *job, struct job_fit *fit)
{
    const struct job_fit_tracks of = job_fit_plain_tracks(job);
    struct plan_limit limit;

    fit->stretch = fit->rolls.pre = fit->rolls.post = 1;
    for (unsigned a = 0; a < job->planned; a++) {
        job_fit_limit(job, a, &limit);
        const uint32_t count = plan_check_track(&of.track[a], &limit, NULL, 0);
        struct plan_violation *found = memory_new(count + 1, sizeof *found);
        plan_check_track(&of.track[a], &limit, found, count);
        for (uint32_t k = 0; k < count; k++) {
            const struct job_violation violation = {
                .axis = a,
                .kind = (enum job_violation_kind)found[k].kind,
                .t_ns_q12 = found[k].t_ns_q12,
                .value = found[k].value,
                .limit = found[k].limit,
            };
            if (found[k].kind >= PLAN_VEL && found[k].kind <= PLAN_JERK)
                job_fit_take(job, &of, &violation, fit);
        }
        memory_free(found);
    }
}

static void job_fit_keep(struct job_fit *fit, struct job_fit_span span)
{
    uint32_t i =
        fit->spans < JOB_FIT_SPANS_MAX ? fit->spans : JOB_FIT_SPANS_MAX - 1;

    fit->spans++;
    if (fit->spans > JOB_FIT_SPANS_MAX && span.more_s <= fit->span[i].more_s)
        return;
    for (; i > 0 && fit->span[i - 1].more_s < span.more_s; i--)
        fit->span[i] = fit->span[i - 1];
    fit->span[i] = span;
}

/* By the track before its shaper, whose keys are where they were written. */
static void job_fit_axis(const struct job *job, unsigned a, struct job_fit *fit)
{
    const struct plan_axis *axis = &job->move.axis[a];
    const uint32_t before = fit->spans;
    struct plan_fit_need *need = memory_new(axis->key_count, sizeof *need);
    struct plan_limit limit;

    job_fit_limit(job, a, &limit);
    plan_fit_span_needs(
        axis, &(job->plain != NULL ? job->plain : job->track)[a], &limit, need);
    for (uint32_t i = 0; i + 1 < axis->key_count; i++) {
        const double span_s =
            number_double(
                axis->key[i + 1].key.t_ns_q12 - axis->key[i].key.t_ns_q12, 12) /
            1e9;
        const double more_s = span_s * (need[i].stretch - 1);
        fit->stretch = fmax(fit->stretch, need[i].stretch);
        if (more_s >= JOB_FIT_LEAST_S)
            job_fit_keep(fit, (struct job_fit_span){ a, i, more_s });
    }
    memory_free(need);
    fit->axes += fit->spans > before;
}

/* The next whole millisecond. */
static int64_t job_fit_up(double t_ns_q12)
{
    const double grid = 1e6 * (double)MOTION_FIXED_NS_Q12;

    return t_ns_q12 < 0x1p62 ? llround(ceil(t_ns_q12 / grid) * grid)
                             : INT64_MAX;
}

static bool job_fit_has_spans(const struct job *job, unsigned a)
{
    return job->compiled == NULL && !job->outcome.is_bent &&
           job->move.axis[a].driver == PLAN_BY_KEYS &&
           job->move.axis[a].key_count > 1;
}

/* A shoot with a longer move between its pictures and, where it moves during
 * them, longer exposures, by so much that the limits are kept. */
static struct plan_shoot job_fit_shoot(const struct job *job,
                                       const struct job_fit *fit)
{
    const double by = fit->stretch * (1 + JOB_FIT_SHOOT_SPARE);
    struct plan_shoot longer = *job->move.shoot;

    longer.move_ns_q12 = job_fit_up((double)longer.move_ns_q12 * by);
    if (longer.mode != PLAN_SHOOT_STOP)
        longer.exposure_ns_q12 =
            job_fit_up((double)longer.exposure_ns_q12 * by);
    return longer;
}

/* How long all of it takes then: what the shapers add stays. */
static int64_t job_fit_shoot_end(const struct job *job,
                                 const struct job_fit *fit)
{
    const struct plan_shoot longer = job_fit_shoot(job, fit);
    struct plan_shoot_times was, then;

    plan_shoot_times(job->move.shoot, &was);
    plan_shoot_times(&longer, &then);
    return job_fit_up((double)job->end_ns_q12 - (double)was.end_ns_q12 +
                      (double)then.end_ns_q12);
}

static bool job_fit_has_rolls(const struct job *job)
{
    return job->move.pre_roll_ns_q12 != 0 || job->move.post_roll_ns_q12 != 0;
}

/* The time by which the plain move is longer; what shapers add stays. */
static int64_t job_fit_end(const struct job *job, const struct job_fit *fit)
{
    const double added = job->shaping.longer_s * (double)MOTION_FIXED_S_Q12;

    return job_fit_up(
        ((double)job->end_ns_q12 - added) * fit->stretch * (1 + 1e-9) + added);
}

static struct job_fit job_fit_of(const struct job *job)
{
    struct job_fit fit = job_fit_judged(job);

    if (job->plain != NULL && job->violation_count > 0)
        job_fit_plain(job, &fit);
    if (fit.stretch > 1)
        for (unsigned a = 0; a < job->move.axis_count; a++)
            if (job_fit_has_spans(job, a))
                job_fit_axis(job, a, &fit);
    fit.end_ns_q12 = job->move.shoot != NULL && fit.stretch > 1
                         ? job_fit_shoot_end(job, &fit)
                         : job_fit_end(job, &fit);
    return fit;
}

double job_fit_stretch(const struct job *job, struct job_fit_rolls *rolls)
{
    const struct job_fit fit = job->plain != NULL && !job_fit_has_rolls(job)
                                   ? job_fit_judged(job)
                                   : job_fit_of(job);

    *rolls = fit.rolls;
    return fit.is_cured ? fit.stretch : 0;
}

static void job_fit_print_spans(const struct job *job,
                                const struct job_fit *fit, FILE *file)
{
    char more[NUMBER_MAX];

    for (uint32_t i = 0; i < fit->spans && i < JOB_FIT_SPANS_MAX; i++) {
        const struct job_fit_span *span = &fit->span[i];
        number_short(more, llround(span->more_s * 0x1p32), 32);
        fprintf(file, "  %s %sneeds %s s more between keys %u and %u\n",
                job->move.axis[span->axis].name, fit->axes == 1 ? "alone " : "",
                more, span->key + 1, span->key + 2);
    }
    if (fit->spans > JOB_FIT_SPANS_MAX)
        fprintf(file, "  and %u more %s less than these\n",
                fit->spans - JOB_FIT_SPANS_MAX,
                number_word(fit->spans - JOB_FIT_SPANS_MAX, "span needs",
                            "spans need"));
}

/* What the duration of the file asks for, beside what its limits allow. */
static void job_fit_print_duration(const struct job *job,
                                   const struct job_fit *fit, FILE *file)
{
    const struct plan_outcome *outcome = &job->outcome;
    char written[NUMBER_MAX], played[NUMBER_MAX], least[NUMBER_MAX];

    if (outcome->played_ns_q12 == 0)
        return;
    number_seconds(written, outcome->written_ns_q12);
    number_seconds(played, outcome->played_ns_q12);
    number_seconds(least, job_fit_up((double)outcome->played_ns_q12 *
                                     fit->stretch * (1 + 1e-9)));
    fprintf(file,
            "Line %u requires %s s: %.4g times the pace of the %s s that are "
            "written, and %.4g times the fastest that the limits allow, "
            "%s s.\n",
            job->move.duration_place.line, played,
            (double)outcome->written_ns_q12 / (double)outcome->played_ns_q12,
            written, fit->stretch, least);
}

/* Is a key fixed at a time that a longer move would change? */
static bool job_fit_has_fixed(const struct job *job)
{
    for (unsigned a = 0; a < job->move.axis_count; a++)
        for (uint32_t i = 0; i < job->move.axis[a].key_count; i++) {
            const struct plan_key *key = &job->move.axis[a].key[i];
            if ((key->fixed & PLAN_FIXED_TIME) != 0 && key->key.t_ns_q12 > 0)
                return true;
        }
    return false;
}

/* What slew fit would do about it. */
static const char *job_fit_advice(const struct job *job,
                                  const struct job_fit *fit)
{
    if (!fit->is_cured || job->compiled != NULL)
        return "";
    if (fit->spans == 0 || plan_fit_more(&job->move) != NULL)
        return "; slew fit gives it a duration";
    return job_fit_has_fixed(job)
               ? "; slew fit finds the times, if keys that are fixed allow it"
               : "; slew fit finds the times";
}

static void job_fit_print_roll(FILE *file, const char *before, const char *name,
                               int64_t roll_ns_q12, double by)
{
    char text[NUMBER_MAX];

    number_seconds(text, job_fit_up((double)roll_ns_q12 * by * (1 + 1e-9)));
    fprintf(file, "%s a %s of %s s", before, name, text);
}

static void job_fit_print_rolls(const struct job *job,
                                const struct job_fit *fit, FILE *file)
{
    const bool pre = fit->rolls.pre > 1, post = fit->rolls.post > 1;

    if (!pre && !post)
        return;
    if (pre)
        job_fit_print_roll(file, "Needs", "pre_roll", job->move.pre_roll_ns_q12,
                           fit->rolls.pre);
    if (post)
        job_fit_print_roll(file, pre ? " and" : "Needs", "post_roll",
                           job->move.post_roll_ns_q12, fit->rolls.post);
    fprintf(file, "; slew fit writes %s.\n", pre && post ? "them" : "it");
}

/* What no duration cures, and what does. */
/* A key is out of its range, or there is more than keys. */
static bool job_fit_keys_leave(const struct job *job)
{
    if (plan_fit_more(&job->move) != NULL)
        return true;
    for (uint32_t a = 0; a < job->move.axis_count; a++) {
        const struct plan_axis *axis = &job->move.axis[a];
        const struct plan_limit *limit = &job_rig_axis(job, a)->limit;
        for (uint32_t i = 0; i < axis->key_count; i++)
            if (axis->key[i].key.pos_q32 < limit->pos_min_q32 ||
                axis->key[i].key.pos_q32 > limit->pos_max_q32)
                return true;
    }
    return false;
}

static void job_fit_print_uncured(const struct job *job, FILE *file)
{
    bool steps = false, leaves = false, moves = false;

    for (uint32_t i = 0; i < job->violation_count; i++) {
        const enum job_violation_kind kind = job->violation[i].kind;
        steps |= kind == JOB_VEL_STEP || kind == JOB_ACC_STEP;
        leaves |= kind == JOB_POS_LOW || kind == JOB_POS_HIGH;
        moves |= kind == JOB_START_MOVING || kind == JOB_END_MOVING;
    }
    if (steps)
        fputs("No duration removes a step: another curve does, such as "
              "quintic or c4.\n",
              file);
    if (leaves)
        fprintf(file, "No duration brings a position into its range: %s.\n",
                job_fit_keys_leave(job)
                    ? "other keys do"
                    : "the keys are in it, and slew fit gives those beside "
                      "which the curve leaves it a velocity");
    if (moves)
        fputs("No duration brings an end to rest: other keys or ends do, or a "
              "pre_roll and a post_roll.\n",
              file);
}

static void job_fit_print_shoot(const struct job *job,
                                const struct job_fit *fit, FILE *file)
{
    const struct plan_shoot longer = job_fit_shoot(job, fit);
    char text[NUMBER_MAX];

    number_seconds(text, longer.move_ns_q12);
    fprintf(file, ", if shoot has a move of %s s", text);
    if (longer.mode != PLAN_SHOOT_STOP) {
        number_seconds(text, longer.exposure_ns_q12);
        fprintf(file, " and an exposure of %s s", text);
    }
    fputs(".\n", file);
}

void job_fit_print(const struct job *job, FILE *file)
{
    const struct job_fit fit = job_fit_of(job);
    char duration[NUMBER_MAX], percent[NUMBER_MAX];

    job_fit_print_uncured(job, file);
    job_fit_print_rolls(job, &fit, file);
    if (fit.stretch <= 1)
        return;
    number_seconds(duration, fit.end_ns_q12);
    fprintf(file, "%s in %s s", fit.is_cured ? "Fits" : "The rest fits",
            duration);
    if (job->rate_q30 > MOTION_CLOCK_WARP_ONE_Q30) {
        number_short(percent, 100 * job->rate_q30, 30);
        fprintf(file, ", at %s %% speed.\n", percent);
    } else if (job->move.shoot != NULL) {
        job_fit_print_shoot(job, &fit, file);
    } else {
        fprintf(file, "%s.\n", job_fit_advice(job, &fit));
    }
    job_fit_print_spans(job, &fit, file);
    job_fit_print_duration(job, &fit, file);
}

static void job_fit_json_shoot(const struct job *job, const struct job_fit *fit,
                               cJSON *object)
{
    const struct plan_shoot longer = job_fit_shoot(job, fit);
    cJSON *const item = cJSON_AddObjectToObject(object, "shoot");

    cJSON_AddNumberToObject(item, "move_s",
                            number_double(longer.move_ns_q12, 12) / 1e9);
    cJSON_AddNumberToObject(item, "exposure_s",
                            number_double(longer.exposure_ns_q12, 12) / 1e9);
}

void job_fit_json(const struct job *job, cJSON *object)
{
    const struct job_fit fit = job_fit_of(job);
    cJSON *const item = cJSON_CreateObject();
    cJSON *list;

    if (job->violation_count == 0) {
        cJSON_Delete(item);
        return;
    }
    cJSON_AddItemToObject(object, "fit", item);
    cJSON_AddBoolToObject(item, "cured_by_time", fit.is_cured);
    cJSON_AddNumberToObject(item, "stretch", fit.stretch);
    cJSON_AddNumberToObject(item, "duration_s",
                            number_double(fit.end_ns_q12, 12) / 1e9);
    if (fit.rolls.pre > 1)
        cJSON_AddNumberToObject(item, "pre_roll_s",
                                number_double(job->move.pre_roll_ns_q12, 12) /
                                    1e9 * fit.rolls.pre);
    if (fit.rolls.post > 1)
        cJSON_AddNumberToObject(item, "post_roll_s",
                                number_double(job->move.post_roll_ns_q12, 12) /
                                    1e9 * fit.rolls.post);
    if (job->move.shoot != NULL && fit.stretch > 1)
        job_fit_json_shoot(job, &fit, item);
    list = cJSON_AddArrayToObject(item, "spans");
    for (uint32_t i = 0; i < fit.spans && i < JOB_FIT_SPANS_MAX; i++) {
        cJSON *const span = cJSON_CreateObject();
        cJSON_AddStringToObject(span, "axis",
                                job->move.axis[fit.span[i].axis].name);
        cJSON_AddNumberToObject(span, "key", fit.span[i].key + 1);
        cJSON_AddNumberToObject(span, "more_s", fit.span[i].more_s);
        cJSON_AddItemToArray(list, span);
    }
}
