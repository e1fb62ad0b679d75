/* firmware/studio/wasm/approach.c - from where the axes stand to a place of the move, as
 * the service goes there; see plan.h. */
#include <math.h>

#include "firmware/host/base/memory.h"
#include "firmware/host/base/number.h"
#include "firmware/host/job/job_approach.h"
#include "firmware/host/job/job_camera.h"
#include "firmware/studio/wasm/plan.h"

struct approach {
    struct motion_track *track; /* of each axis of the move */
    struct motion_segment (*segment)[JOB_APPROACH_SEGMENTS];
};

static bool approach_plan(const struct studio_plan *plan, const double *from,
                          int64_t t_ns_q12, const struct approach *approach)
{
    for (unsigned i = 0; i < plan->job.planned; i++) {
        const double pos = ldexp(from[i], 32);
        if (!(fabs(pos) < ldexp(1, 62)))
            return false;
        motion_track_init(&approach->track[i], approach->segment[i],
                          JOB_APPROACH_SEGMENTS, (int64_t)pos);
        const struct plan_limit limit =
            rig_rails_limit(&plan->job.rig, plan->job.rig_axis[i]);
        if (job_approach(&limit, &plan->job.track[i], t_ns_q12,
                         &approach->track[i]) < 0)
            return false;
    }
    return true;
}

static void approach_write(const struct studio_plan *plan,
                           const struct approach *approach, uint32_t count,
                           double *out)
{
    const unsigned axes = plan->job.planned;
    struct plan_rig rig;
    int64_t longest = 0;

    for (unsigned i = 0; i < axes; i++) {
        const int64_t end = approach->track[i].end_ns_q12;
        out[i] = number_double(end, 12) / 1e9;
        longest = end > longest ? end : longest;
    }
    out += axes;
    const bool is_seen = job_camera_rig(&plan->job, &rig);
    for (uint32_t i = 0; i < count; i++, out += STUDIO_POSE)
        if (is_seen)
            studio_pose(&rig, approach->track,
                        count > 1 ? longest / (count - 1) * i : 0, out);
        else
            out[0] = NAN;
}

STUDIO_EXPORT bool studio_plan_approach(const struct studio_plan *plan,
                                        const double *from, double to_s,
                                        uint32_t count, double *out)
{
    if (plan->status != STATUS_OK)
        return false;
    const unsigned axes = plan->job.planned;
    const struct approach approach = {
        .track = memory_new((size_t)axes + 1, sizeof *approach.track),
        .segment = memory_new((size_t)axes + 1, sizeof *approach.segment),
    };
    const bool is_planned =
        approach_plan(plan, from, studio_time(to_s), &approach);
    if (is_planned)
        approach_write(plan, &approach, count, out);
    memory_free(approach.track);
    memory_free(approach.segment);
    return is_planned;
}
