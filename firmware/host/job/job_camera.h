/* firmware/host/job/job_camera.h - where the camera of a job is, and its shot
 * as samples. */
#ifndef FIRMWARE_HOST_JOB_JOB_CAMERA_H
#define FIRMWARE_HOST_JOB_JOB_CAMERA_H

#include <stdio.h>

#include "firmware/host/job/job.h"
#include "motion/plan/rig/plan_rig.h"

struct cJSON;

/* The rig on the axes of the move: by the kinematics of the rig's file, or of a
 * path that carries a camera.  False when neither says where the camera is. */
bool job_camera_rig(const struct job *job, struct plan_rig *rig);

/* What the move's camera, or the tool of its path, looks at; NULL: neither. */
const struct plan_camera *job_camera_look(const struct job *job);

/* Where the subject of the camera is: false where it has none, or one that only
 * the path has. */
bool job_camera_subject(const struct job *job, int64_t t_ns_q12,
                        struct plan_jet_vec *subject);

/* The rotation of the camera in space at a time, for a move whose camera is on
 * the kinematics of its rig: false for another. */
bool job_camera_rotation(const struct job *job, int64_t t_ns_q12,
                         struct motion_quat *q);

/* Place and speed of the camera, distance of the subject, and the lens, in
 * moments of the move; nothing where it is not known where the camera is. */
void job_camera_text(const struct job *job, FILE *file);
void job_camera_json(const struct job *job, struct cJSON *object);

#endif
