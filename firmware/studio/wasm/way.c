/* firmware/studio/wasm/way.c - from where the axes stand to a place of the move, as
 * the service goes there; see plan.h. */
#include <math.h>

#include "firmware/host/base/memory.h"
#include "firmware/host/base/number.h"
#include "firmware/host/job/job_camera.h"
#include "firmware/host/job/job_way.h"
#include "firmware/studio/wasm/plan.h"

struct way {
    struct motion_track *track; /* of each axis of the move */
    struct motion_segment (*segment)[JOB_WAY_SEGMENTS];
};

static bool way_plan(const struct studio_plan *plan, const double *from,
                     int64_t t_ns_q12, const struct way *way)
{
    for (unsigned i = 0; i < plan->job.planned; i++) {
        const double pos = ldexp(from[i], 32);
        if (!(fabs(pos) < ldexp(1, 62)))
            return false;
        motion_track_init(&way->track[i], way->segment[i], JOB_WAY_SEGMENTS,
                          (int64_t)pos);
        if (job_way(&plan->job, i, t_ns_q12, &way->track[i]) < 0)
            return false;
    }
    return true;
}

static void way_write(const struct studio_plan *plan, const struct way *way,
                      uint32_t count, double *out)
{
    const unsigned axes = plan->job.planned;
    struct plan_rig rig;
    int64_t longest = 0;

    for (unsigned i = 0; i < axes; i++) {
        const int64_t end = way->track[i].end_ns_q12;
        out[i] = number_double(end, 12) / 1e9;
        longest = end > longest ? end : longest;
    }
    out += axes;
    const bool is_seen = job_camera_rig(&plan->job, &rig);
    for (uint32_t i = 0; i < count; i++, out += STUDIO_POSE)
        if (is_seen)
            studio_pose(&rig, way->track,
                        count > 1 ? longest / (count - 1) * i : 0, out);
        else
            out[0] = NAN;
}

STUDIO_EXPORT bool studio_plan_way(const struct studio_plan *plan,
                                   const double *from, double to_s,
                                   uint32_t count, double *out)
{
    if (plan->status != STATUS_OK)
        return false;
    const unsigned axes = plan->job.planned;
    const struct way way = {
        .track = memory_new((size_t)axes + 1, sizeof *way.track),
        .segment = memory_new((size_t)axes + 1, sizeof *way.segment),
    };
    const bool is_planned = way_plan(plan, from, studio_time(to_s), &way);
    if (is_planned)
        way_write(plan, &way, count, out);
    memory_free(way.track);
    memory_free(way.segment);
    return is_planned;
}
