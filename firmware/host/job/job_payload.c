/* firmware/host/job/job_payload.c - see job_payload.h. */
#include "firmware/host/job/job_payload.h"

#include <math.h>
#include <string.h>

#include "motion/double/double_math.h"

#define PAYLOAD_MM    1000.0
#define PAYLOAD_LEVEL 1e-9 /* of a direction: less is none */

/* Which of the carrier's; -1: none. */
static int payload_carrier(const struct job *job, const struct plan_rig *rig,
                           uint32_t rig_axis)
{
    for (int i = 0; rig->arm.arm.count == 0 && i < MOTION_CARRIER_AXES_MAX; i++)
        if (rig->carrier[i].is_given &&
            job->rig_axis[rig->carrier[i].axis] == rig_axis)
            return i;
    return -1;
}

/* The jet of every axis but its own stands, so that the pivot's speed is how it
 * moves with that. */
static void payload_on_carrier(const struct job *job,
                               const struct plan_rig *rig, int own,
                               int64_t t_ns_q12,
                               struct job_payload_place *place)
{
    struct plan_jet axis[MOTION_CARRIER_AXES_MAX];
    struct plan_rig_frame mount;
    struct plan_jet_vec pivot;

    for (int i = 0; i < MOTION_CARRIER_AXES_MAX; i++) {
        const struct plan_rig_axis *const of = &rig->carrier[i];
        axis[i] = plan_jet_of(
            of->is_given ? plan_rig_track(&job->track[of->axis], t_ns_q12, -1).p
                         : 0);
    }
    axis[own].v = 1;
    plan_rig_mount(&rig->rig.carrier, axis, &pivot, &mount);
    for (int k = 0; k < 3; k++)
        place->at_m[k] = pivot.x[k].p / PAYLOAD_MM;
    const double x = pivot.x[0].v, y = pivot.x[1].v;
    const double level = sqrt(x * x + y * y);
    if (level > PAYLOAD_LEVEL) {
        place->along[0] = x / level;
        place->along[1] = y / level;
    }
}

/* An axis that turns goes on a circle to the left, its payload along the
 * tangent. */
static void payload_on_arm(const struct rig_payload *payload, double at,
                           struct job_payload_place *place)
{
    const double angle = at / payload->arm_m, arm = payload->arm_m;
    const double cosine = double_cos(angle), sine = double_sin(angle);
    const double x = place->along[0], y = place->along[1];

    place->at_m[0] += arm * (sine * x - (1 - cosine) * y);
    place->at_m[1] += arm * (sine * y + (1 - cosine) * x);
    place->along[0] = cosine * x - sine * y;
    place->along[1] = cosine * y + sine * x;
}

void job_payload_place(const struct job *job, const struct plan_rig *rig,
                       const struct rig_payload *payload, int64_t t_ns_q12,
                       double at, struct job_payload_place *place)
{
    const int own =
        payload->is_placed ? -1 : payload_carrier(job, rig, payload->axis);
    const bool tilts = payload->kind == RIG_PAYLOAD_BALL;

    *place = (struct job_payload_place){ .along = { 1, 0 },
                                         .from_m = tilts ? 0 : at };
    if (own >= 0) {
        payload_on_carrier(job, rig, own, t_ns_q12, place);
        return;
    }
    if (payload->is_placed) {
        memcpy(place->at_m, payload->origin_m, sizeof place->at_m);
        memcpy(place->along, payload->along, sizeof place->along);
    }
    if (payload->arm_m > 0)
        payload_on_arm(payload, at, place);
    else
        for (int k = 0; !tilts && k < 2; k++)
            place->at_m[k] += at * place->along[k];
}

void job_payload_in_space(const struct job_payload_place *place,
                          const double point_m[3], double space_m[3])
{
    const double x = point_m[0] - place->from_m, y = point_m[1];
    const double *const along = place->along;

    space_m[0] = place->at_m[0] + x * along[0] - y * along[1];
    space_m[1] = place->at_m[1] + x * along[1] + y * along[0];
    space_m[2] = place->at_m[2] + point_m[2];
}
