/* firmware/host/job/job_check.c - the tracks against the limits of the rig: see
 * job.h. */

#include <stddef.h>

#include "firmware/host/base/memory.h"
#include "firmware/host/job/job.h"
#include "firmware/host/job/job_fit.h"
#include "firmware/host/track/compiled.h"
#include "motion/core/clock_warp.h"
#include "motion/core/fixed.h"
#include "motion/curve/interval.h"

static const struct {
    unsigned order;
    const char *text;
} job_kind[] = {
#define JOB_VIOLATION_ROW(name, order, text) { order, text },
    JOB_VIOLATION_LIST(JOB_VIOLATION_ROW)
#undef JOB_VIOLATION_ROW
};

const char *job_violation_text(enum job_violation_kind kind)
{
    return job_kind[kind].text;
}

unsigned job_violation_order(enum job_violation_kind kind)
{
    return job_kind[kind].order;
}

/* value / rate, saturating. */
static int64_t job_over_rate(int64_t value, int64_t rate_q30)
{
    int64_t result;
    if (motion_fixed_muldiv(value, MOTION_CLOCK_WARP_ONE_Q30, rate_q30,
                            &result) < 0)
        return INT64_MAX;
    return result;
}

void job_limit_at(const struct plan_limit *limit, int64_t rate_q30,
                  struct plan_limit *scaled)
{
    *scaled = *limit;
    if (rate_q30 == MOTION_CLOCK_WARP_ONE_Q30 || rate_q30 <= 0)
        return;
    scaled->vel_q32 = job_over_rate(limit->vel_q32, rate_q30);
    scaled->acc_q32 =
        job_over_rate(job_over_rate(limit->acc_q32, rate_q30), rate_q30);
    scaled->jerk_q32 = job_over_rate(
        job_over_rate(job_over_rate(limit->jerk_q32, rate_q30), rate_q30),
        rate_q30);
}

/* The key at or before a time. */
static uint32_t job_key_before(const struct plan_axis *axis, int64_t t_ns_q12)
{
    return axis->key_count == 0
               ? 0
               : motion_interval_find(&axis->key->key.t_ns_q12,
                                      sizeof *axis->key, axis->key_count,
                                      t_ns_q12);
}

static void job_add(struct job *job, const struct job_violation *violation)
{
    /* Room grows at powers of two. */
    uint32_t count = job->violation_count;
    if ((count & (count - 1)) == 0)
        job->violation =
            memory_resize(job->violation, count == 0 ? 1 : 2 * (size_t)count,
                          sizeof *job->violation);
    job->violation[job->violation_count++] = *violation;
}

/* It goes on after its last key. */
static bool job_cycles(const struct plan_axis *axis)
{
    return axis->key_count > 0 && axis->bezier.after.mode != MOTION_FCURVE_ONCE;
}

/* A step of velocity at the first or last key has its own sentence; one where a
 * cycle goes over to the next is a step. */
static enum job_violation_kind job_kind_of(const struct job *job,
                                           const struct plan_axis *axis,
                                           const struct motion_track *track,
                                           const struct plan_violation *found)
{
    const bool keyed = axis->key_count > 0 && !job->outcome.is_bent;
    const int64_t lag = job->outcome.lag_ns_q12;
    const int64_t first = keyed ? axis->key[0].key.t_ns_q12 + lag : 0;
    const int64_t last = keyed && !job_cycles(axis)
                             ? axis->key[axis->key_count - 1].key.t_ns_q12 + lag
                             : track->end_ns_q12;
    if (found->kind != PLAN_VEL_STEP)
        return (enum job_violation_kind)found->kind;
    if (found->t_ns_q12 <= (first > 0 ? first : 0))
        return JOB_START_MOVING;
    return found->t_ns_q12 >= last ? JOB_END_MOVING : JOB_VEL_STEP;
}

#define JOB_TELL_EVERY 1024 /* segments: some 10 ms */

/* The segments of an axis, one after the other, and how many there were. */
struct job_walk {
    const struct job *job;
    const struct plan_progress *progress;
    unsigned axis;
    uint32_t next, count;
    struct compiled_walk compiled;
};

static const struct motion_segment *job_walk_next(void *context)
{
    struct job_walk *walk = context;
    const struct job *job = walk->job;
    const uint32_t i = walk->next++;
    if (i % JOB_TELL_EVERY == 0)
        plan_progress_tell(walk->progress, "judging",
                           job->move.axis[walk->axis].name, i, walk->count);
    if (job->compiled != NULL)
        return compiled_walk_next(&walk->compiled);
    return i < walk->count ? &job->track[walk->axis].segment[i] : NULL;
}

static struct plan_facts *job_walk_facts(void *context)
{
    const struct job_walk *walk = context;
    return walk->job->facts[walk->axis].segment[walk->next - 1].facts;
}

static bool *job_walk_is_inside(void *context)
{
    const struct job_walk *walk = context;
    return &walk->job->facts[walk->axis].segment[walk->next - 1].is_inside;
}

static uint32_t job_find(const struct job *job, unsigned i,
                         const struct plan_limit *limit,
                         struct plan_violation *found, uint32_t capacity,
                         const struct plan_progress *progress)
{
    struct job_walk walk = {
        .job = job,
        .progress = progress,
        .axis = i,
        .count = job->compiled != NULL ? job->compiled->file.axis[i].segments
                                       : job->track[i].count,
        .compiled = { .compiled = job->compiled, .axis = i },
    };
    const struct plan_check_source source = {
        .next = job_walk_next,
        .context = &walk,
        .facts = job->facts != NULL ? job_walk_facts : NULL,
        .is_inside = job->facts != NULL ? job_walk_is_inside : NULL,
    };
    return plan_check_source(&job->track[i], &source, limit, found, capacity);
}

/* What a value of the move is when it is played at that rate; saturating. */
static int64_t job_played(int64_t value, unsigned order, int64_t rate_q30)
{
    for (unsigned i = 0; i < order; i++)
        if (motion_fixed_muldiv(value, rate_q30, MOTION_CLOCK_WARP_ONE_Q30,
                                &value) < 0)
            return value < 0 ? -INT64_MAX : INT64_MAX;
    return value;
}

/* As the user meets it: the value as it is played, the limit of the rig. */
static struct job_violation job_violation_of(const struct job *job, unsigned i,
                                             int64_t rate_q30,
                                             const struct plan_violation *found)
{
    struct job_violation violation = {
        .axis = i,
        .kind = job_kind_of(job, &job->move.axis[i], &job->track[i], found),
        .t_ns_q12 = found->t_ns_q12,
        .limit = found->limit,
        .key =
            job_key_before(&job->move.axis[i],
                           plan_outcome_time(&job->outcome, found->t_ns_q12)),
    };
    const unsigned order = job_violation_order(violation.kind);
    violation.value = job_played(found->value, order, rate_q30);
    if (order > 0 && found->limit != 0)
        violation.limit = job_limit_of(&job_rig_axis(job, i)->limit, order);
    return violation;
}

static void job_keep_facts(struct job *job)
{
    const struct job *former = job->former;
    job->facts = memory_new((size_t)job->planned + 1, sizeof *job->facts);
    for (unsigned i = 0; i < job->planned; i++) {
        const int k = former == NULL || former->facts == NULL
                          ? -1
                          : job_axis_index(former, job->move.axis[i].name);
        if (k < 0)
            job_facts_make(&job->facts[i], &job->track[i], NULL, NULL);
        else
            job_facts_make(&job->facts[i], &job->track[i], &former->facts[k],
                           &former->track[k]);
    }
    job->former = NULL;
}

/* Room for so many at first; for more the axis is judged a second time. */
#define JOB_VIOLATIONS 256

static void job_check_axis(struct job *job, unsigned i, int64_t rate_q30)
{
    uint32_t room = JOB_VIOLATIONS;
    struct plan_violation *found = memory_new(room, sizeof *found);
    struct plan_limit limit;
    job_fit_limit(job, i, &limit);
    if (job->facts != NULL)
        job_facts_judge(&job->facts[i], &limit);
    uint32_t count = job_find(job, i, &limit, found, room, job->progress);
    if (count > room) {
        room = count;
        found = memory_resize(found, room, sizeof *found);
        count = job_find(job, i, &limit, found, room, NULL);
    }
    for (uint32_t k = 0; k < count; k++) {
        const struct job_violation violation =
            job_violation_of(job, i, rate_q30, &found[k]);
        job_add(job, &violation);
    }
    memory_free(found);
}

void job_check(struct job *job, int64_t rate_q30)
{
    if (rate_q30 < MOTION_CLOCK_WARP_ONE_Q30)
        rate_q30 = MOTION_CLOCK_WARP_ONE_Q30;
    job->violation_count = 0;
    job->rate_q30 = rate_q30;
    if (job->keeps && job->facts == NULL)
        job_keep_facts(job);
    for (unsigned i = 0; i < job->move.axis_count; i++)
        job_check_axis(job, i, rate_q30);
    plan_progress_end(job->progress);
}
