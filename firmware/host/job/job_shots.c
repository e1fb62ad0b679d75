/* firmware/host/job/job_shots.c - see job_shots.h. */
#include "firmware/host/job/job_shots.h"

#include "firmware/host/base/number.h"
#include "motion/core/clock_warp.h"
#include "motion/core/fixed.h"

bool job_has_shots(const struct job *job)
{
    for (unsigned i = 0; job->shots != NULL && i < job->rig.line_count; i++)
        if (job->shots[i].count > 0)
            return true;
    return false;
}

static int64_t shots_whole_ticks(const struct rig *rig, int64_t ns)
{
    const int64_t period_ns = rig->period_ns;
    return (ns + period_ns - 1) / period_ns * period_ns;
}

/* From the start of a pulse to the earliest next one: the line changes once per
 * tick. */
static int64_t shots_need_ns(const struct rig *rig, unsigned line)
{
    const struct rig_line *trigger = &rig->line[line];
    const int64_t rest_ns = shots_whole_ticks(rig, trigger->rest_ns);
    return shots_whole_ticks(rig, trigger->width_ns) +
           (rest_ns > 0 ? rest_ns : rig->period_ns);
}

/* Those that are closest on the path are so on the clock, at any rate. */
uint32_t job_shots_closest(const struct plan_shots *shots, int64_t rate_q30,
                           int64_t *apart_ns)
{
    int64_t least = INT64_MAX;
    uint32_t closest = 0;
    for (uint32_t i = 0; i + 1 < shots->count; i++) {
        const int64_t apart = shots->t_ns_q12[i + 1] - shots->t_ns_q12[i];
        if (apart >= least)
            continue;
        least = apart;
        closest = i;
    }
    *apart_ns = INT64_MAX;
    if (least < INT64_MAX &&
        motion_fixed_muldiv(least, MOTION_CLOCK_WARP_ONE_Q30, rate_q30,
                            apart_ns) == 0)
        *apart_ns /= MOTION_FIXED_NS_Q12;
    return closest;
}

static bool shots_check_line(const struct rig *rig, unsigned line,
                             const struct plan_shots *shots,
                             const struct plan_event event[], const char *path,
                             int64_t rate_q30, struct messages *messages)
{
    const int64_t need_ns = shots_need_ns(rig, line);
    int64_t apart_ns;
    const uint32_t i = job_shots_closest(shots, rate_q30, &apart_ns);
    if (apart_ns >= need_ns)
        return true;
    char t[NUMBER_MAX], where[32] = ""; /* a compiled move has no lines */
    if (event != NULL && shots->event != NULL) {
        const struct plan_place place = event[shots->event[i + 1]].place;
        snprintf(where, sizeof where, ":%u:%u", place.line, place.column);
    }
    number_seconds(t, shots->t_ns_q12[i + 1]);
    messages_add(messages, MESSAGE_ERROR,
                 "%s%s: the shot of %s at %s s comes %.3f ms after the one "
                 "before it, expected %.3f ms or more: its pulse and the rest "
                 "after it",
                 path, where, rig->line[line].name, t, (double)apart_ns / 1e6,
                 (double)need_ns / 1e6);
    return false;
}

bool job_shots_keep_up(const struct rig *rig, const struct plan_shots shots[],
                       const struct plan_event event[], const char *path,
                       int64_t rate_q30, struct messages *messages)
{
    bool fits = true;
    for (unsigned i = 0; i < rig->line_count; i++)
        fits &= shots_check_line(rig, i, &shots[i], event, path, rate_q30,
                                 messages);
    return fits;
}

bool job_shots_check(const struct job *job, int64_t rate_q30,
                     struct messages *messages)
{
    return job_shots_keep_up(&job->rig, job->shots, job->move.event,
                             job->move_path, rate_q30, messages);
}
