/* firmware/host/job/job_payload.h - where in the camera's space what an axis
 * carries is.
 *
 * As the rig's file says (origin, direction); or else, of an axis that carries
 * the head, where the head is mounted, along the level part of how that axis moves it
 * there; or else from the space's origin along x. */
#ifndef FIRMWARE_HOST_JOB_JOB_PAYLOAD_H
#define FIRMWARE_HOST_JOB_JOB_PAYLOAD_H

#include "firmware/host/job/job_camera.h"

/* A payload has x along its axis, y to the left of that, z up, all m. */
struct job_payload_place {
    double at_m[3];  /* in space, of its axis */
    double along[2]; /* x and y in space of its own x; a unit vector */
    double from_m;   /* its x where its axis is */
};

/* rig: of job_camera_rig.  at: of the payload's axis, as rig_payload_at. */
void job_payload_place(const struct job *job, const struct plan_rig *rig,
                       const struct rig_payload *payload, int64_t t_ns_q12,
                       double at, struct job_payload_place *place);

/* A point of it, in space. */
void job_payload_in_space(const struct job_payload_place *place,
                          const double point_m[3], double space_m[3]);

#endif
