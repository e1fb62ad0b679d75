/* firmware/host/job/repair.c - see repair.h.
 *
 * Of keys alone the planner finds others (motion/plan/fit).  Anything else is
 * played at a lower pace: by a duration for all of it, or by the speed law of its
 * path.  Then the text is changed, planned and judged, and changed again by what
 * it still needs; one round is enough where time scales all there is. */
#include "firmware/host/job/repair.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "firmware/host/base/memory.h"
#include "firmware/host/base/number.h"
#include "firmware/host/job/job_fit.h"
#include "motion/core/clock_warp.h"
#include "motion/core/err.h"
#include "motion/core/fixed.h"

#define REPAIR_ROUNDS 24
#define REPAIR_MOST   1e4 /* times as slow: more than that is refused */

const char *const repair_words[REPAIR_METHODS] = {
#define REPAIR_WORD(name, word, text) [name] = word,
    REPAIR_LIST(REPAIR_WORD)
#undef REPAIR_WORD
};

enum repair_method repair_default(const struct job *job)
{
    return plan_fit_more(&job->move) == NULL ? REPAIR_LOCAL : REPAIR_STRETCH;
}

static enum status repair_refuse(struct repair *self,
                                 const struct plan_error *error)
{
    struct job *job = self->before;
    const char *const text =
        error->text[0] != 0 ? error->text : motion_err_text(error->code);

    if (error->place.line > 0)
        messages_add(&job->messages, MESSAGE_ERROR, "%s:%u:%u: %s",
                     job->move_path, error->place.line, error->place.column,
                     text);
    else
        messages_add(&job->messages, MESSAGE_ERROR, "%s: %s", job->move_path,
                     text);
    return error->code == MOTION_E_LIMIT ? STATUS_REFUSED : STATUS_INPUT;
}

/* --- tolerances ---------------------------------------------------------------- */

static enum status repair_tolerance_item(struct repair *self, const char *item)
{
    struct job *job = self->before;
    char first[UNITS_SENTENCE_MAX] = "", other[UNITS_SENTENCE_MAX];
    bool found = false;

    for (unsigned a = 0; a < job->move.axis_count; a++) {
        const struct units_context context = { .unit =
                                                   job_rig_axis(job, a)->unit };
        int64_t q32;
        if (units_parse(item, UNITS_POSITION, &context, &q32,
                        a == 0 ? first : other) < 0)
            continue;
        found = true;
        self->tolerance_q32[a] = q32;
        if (q32 <= 0) {
            messages_add(&job->messages, MESSAGE_ERROR,
                         "slew fit: --tolerance '%.64s' is not above zero",
                         item);
            return STATUS_INPUT;
        }
    }
    if (found)
        return STATUS_OK;
    messages_add(&job->messages, MESSAGE_ERROR,
                 "slew fit: --tolerance %s, the unit of an axis of the move",
                 first);
    return STATUS_INPUT;
}

enum status repair_tolerance(struct repair *self, const char *text)
{
    enum status status = STATUS_OK;
    char item[128];

    if (self->tolerance_q32 == NULL)
        self->tolerance_q32 = memory_new(self->before->move.axis_count,
                                         sizeof *self->tolerance_q32);
    while (status == STATUS_OK && text != NULL) {
        const char *const comma = strchr(text, ',');
        const size_t length =
            comma != NULL ? (size_t)(comma - text) : strlen(text);
        text += strspn(text, " ");
        snprintf(item, sizeof item, "%.*s",
                 (int)(length < sizeof item ? length : sizeof item - 1), text);
        item[strcspn(item, ",")] = 0;
        status = repair_tolerance_item(self, item);
        text = comma != NULL ? comma + 1 : NULL;
    }
    return status;
}

/* --- the new text --------------------------------------------------------------- */

static struct move_text_source repair_source(const struct repair *self,
                                             const struct files *files,
                                             char message[YAML_MESSAGE_MAX])
{
    return (struct move_text_source){ .files = files,
                                      .path = self->before->move_path,
                                      .rig = &self->before->rig,
                                      .was = &self->before->move,
                                      .on_frames = self->on_frames,
                                      .message = message };
}

static void repair_drop(struct repair *self)
{
    move_text_free(&self->text);
    if (self->after != NULL)
        job_free(self->after);
    memory_free(self->after);
    self->after = NULL;
}

/* The text as a move: planned and judged.  What it has to say when it is none. */
static enum status repair_open(struct repair *self, const struct files *files)
{
    struct move_text_files over;
    enum status status;

    self->after = memory_new(1, sizeof *self->after);
    move_text_over(&over, files, self->before->move_path, &self->text);
    status = job_open(self->after, &over.files, self->before->rig_path,
                      self->before->move_path, false, self->before->progress);
    if (status == STATUS_OK)
        job_check(self->after, MOTION_CLOCK_WARP_ONE_Q30);
    else
        messages_move(&self->before->messages, &self->after->messages);
    return status;
}

static enum status repair_text_fail(struct repair *self, const char *message)
{
    messages_add(&self->before->messages, MESSAGE_ERROR, "%s", message);
    return STATUS_INPUT;
}

/* --- keys ------------------------------------------------------------------------ */

static enum status repair_keys(struct repair *self, const struct files *files)
{
    static const enum plan_fit_method method[] = {
        [REPAIR_STRETCH] = PLAN_FIT_STRETCH,
        [REPAIR_LOCAL] = PLAN_FIT_LOCAL,
        [REPAIR_SMOOTH] = PLAN_FIT_SMOOTH,
    };
    struct job *job = self->before;
    struct plan_limit *limit = memory_new(job->move.axis_count, sizeof *limit);
    const struct plan_fit_request request = { &job->move, limit,
                                              method[self->method],
                                              self->tolerance_q32,
                                              self->on_frames };
    char message[YAML_MESSAGE_MAX];
    const struct move_text_source source = repair_source(self, files, message);
    struct plan_error error;

    for (unsigned a = 0; a < job->move.axis_count; a++)
        job_fit_limit(job, a, &limit[a]);
    const int err = plan_fit_solve(&request, &self->fit, &error);
    memory_free(limit);
    if (err < 0)
        return repair_refuse(self, &error);
    self->has_fit = true;
    if (move_text_keys(&source, &self->fit, &self->text) < 0)
        return repair_text_fail(self, message);
    enum status status = repair_open(self, files);
    if (status == STATUS_OK && self->after->violation_count > 0)
        status = STATUS_SYSTEM;
    if (status == STATUS_OK)
        return STATUS_OK;
    messages_add(
        &job->messages, MESSAGE_ERROR,
        "%s: the new keys do not read as they were planned; nothing is "
        "written",
        job->move_path);
    return STATUS_SYSTEM;
}

/* --- pace ------------------------------------------------------------------------ */

/* Above 1 by more with every round. */
static double repair_margin(unsigned round)
{
    return 1 + fmin(ldexp(1e-9, 2 * (int)round), 5e-2);
}

/* How long the move takes, without what shapers add. */
static int64_t repair_end(const struct job *job)
{
    const struct plan_outcome *outcome = &job->outcome;

    return outcome->played_ns_q12 != 0
               ? outcome->played_ns_q12
               : job->end_ns_q12 - outcome->lag_ns_q12 - outcome->tail_ns_q12;
}

/* By whole microseconds; 0 where there is no need. */
static int64_t repair_duration(int64_t dur_ns_q12, double by)
{
    const double us = (double)(1000 * MOTION_FIXED_NS_Q12);

    return by > 1 ? (int64_t)(ceil((double)dur_ns_q12 * by / us) * us) : 0;
}

struct repair_by {
    double shot;
    struct job_fit_rolls rolls;
};

static struct move_text_times repair_times(const struct job *job,
                                           const struct repair_by *by)
{
    return (struct move_text_times){
        repair_duration(repair_end(job), by->shot),
        repair_duration(job->move.pre_roll_ns_q12, by->rolls.pre),
        repair_duration(job->move.post_roll_ns_q12, by->rolls.post),
    };
}

static enum status repair_uncured(struct repair *self, const struct job *job)
{
    uint32_t i = 0;
    char t[NUMBER_MAX];

    while (i + 1 < job->violation_count && (job->violation[i].kind == JOB_VEL ||
                                            job->violation[i].kind == JOB_ACC ||
                                            job->violation[i].kind == JOB_JERK))
        i++;
    number_seconds(t, job->violation[i].t_ns_q12);
    messages_add(&self->before->messages, MESSAGE_ERROR,
                 "%s: axis %s, %s at %s s: a longer duration does not help, "
                 "other points, keys, or another curve would",
                 self->before->move_path,
                 job->move.axis[job->violation[i].axis].name,
                 job_violation_text(job->violation[i].kind), t);
    return STATUS_REFUSED;
}

/* A lower speed on the path is none of an axis that does not go with it. */
static enum status repair_check_speed(struct repair *self,
                                      const struct job *job)
{
    for (uint32_t i = 0; i < job->violation_count; i++) {
        const struct plan_axis *axis = &job->move.axis[job->violation[i].axis];
        if (axis->driver == PLAN_BY_PATH || axis->driver == PLAN_BY_CAMERA)
            continue;
        messages_add(&self->before->messages, MESSAGE_ERROR,
                     "%s:%u:%u: axis %s breaks a limit and is driven by %s: a "
                     "lower speed on the path does not help, --method stretch "
                     "would",
                     self->before->move_path, axis->place.line,
                     axis->place.column, axis->name,
                     plan_driver_name(axis->driver));
        return STATUS_REFUSED;
    }
    return STATUS_OK;
}

static enum status repair_pace_text(struct repair *self,
                                    const struct files *files,
                                    const struct repair_by *by)
{
    char message[YAML_MESSAGE_MAX];
    const struct move_text_source source = repair_source(self, files, message);
    const struct move_text_times times = repair_times(self->before, by);
    const int err = self->method == REPAIR_SPEED
                        ? move_text_slower(&source, by->shot, &self->text)
                        : move_text_duration(&source, &times, &self->text);

    return err < 0 ? repair_text_fail(self, message) : repair_open(self, files);
}

static void repair_grow(double *by, double need, unsigned round)
{
    if (need > 1)
        *by *= need * repair_margin(round);
}

/* Rounds until the checker finds nothing. */
static enum status repair_pace(struct repair *self, const struct files *files)
{
    const struct job *job = self->before;
    enum status status = STATUS_OK;
    struct repair_by by = { 1, { 1, 1 } };

    for (unsigned round = 0; status == STATUS_OK && job->violation_count > 0;
         round++) {
        struct job_fit_rolls rolls;
        const double need = job_fit_stretch(job, &rolls);
        if (need == 0)
            return repair_uncured(self, job);
        if (self->method == REPAIR_SPEED)
            status = repair_check_speed(self, job);
        repair_grow(&by.shot, need, round);
        if (need == 1) { /* at the speed that it will have */
            repair_grow(&by.rolls.pre, rolls.pre, round);
            repair_grow(&by.rolls.post, rolls.post, round);
        }
        if (status == STATUS_OK &&
            (round == REPAIR_ROUNDS || by.shot > REPAIR_MOST))
            return repair_refuse(
                self, &(struct plan_error){
                          .code = MOTION_E_LIMIT,
                          .text = "no pace was found at which the move is "
                                  "inside all limits" });
        if (status != STATUS_OK)
            return status;
        repair_drop(self);
        status = repair_pace_text(self, files, &by);
        job = self->after;
    }
    return status;
}

/* --- which ----------------------------------------------------------------------- */

static enum status repair_check(struct repair *self, const char *more)
{
    const struct plan_move *move = &self->before->move;
    struct plan_error error = { .code = MOTION_E_ARG };

    if (self->method == REPAIR_SPEED &&
        (move->path == NULL || move->path->parts == 0))
        snprintf(error.text, sizeof error.text,
                 "the move has no path with a speed law, expected one with "
                 "--method speed");
    else if (self->method == REPAIR_STRETCH && move->shoot != NULL)
        snprintf(error.text, sizeof error.text,
                 "shoot says when a frame is played: more time between them "
                 "there would help, not a duration");
    else if ((self->method == REPAIR_LOCAL || self->method == REPAIR_SMOOTH) &&
             more != NULL)
        snprintf(error.text, sizeof error.text,
                 "the move has %s, expected one of keys alone with --method "
                 "%s; stretch gives all of it a duration",
                 more, repair_words[self->method]);
    return error.text[0] == 0 ? STATUS_OK : repair_refuse(self, &error);
}

enum status repair_solve(struct repair *self, const struct files *files)
{
    const char *const more = plan_fit_more(&self->before->move);
    enum status status = repair_check(self, more);

    if (status != STATUS_OK)
        return status;
    job_check(self->before, MOTION_CLOCK_WARP_ONE_Q30);
    status = self->method == REPAIR_SPEED || more != NULL
                 ? repair_pace(self, files)
                 : repair_keys(self, files);
    return status;
}

void repair_free(struct repair *self)
{
    repair_drop(self);
    plan_fit_free(&self->fit);
    memory_free(self->tolerance_q32);
}
