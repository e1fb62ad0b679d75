/* firmware/linux/commands/files/plot_payload.h - what the axes of a rig carry, as
 * it moves with a move: a strip of moments, pictures, or an SVG that plays. */
#ifndef FIRMWARE_LINUX_COMMANDS_FILES_PLOT_PAYLOAD_H
#define FIRMWARE_LINUX_COMMANDS_FILES_PLOT_PAYLOAD_H

#include "firmware/host/job/job_camera.h"
#include "firmware/linux/commands/options.h"

/* Of a job whose rig has payloads on axes that move: options->film, an SVG that
 * plays or a sequence of PNG; else one page.  With a sentence on stderr. */
enum status plot_payload(const struct job *job, const struct options *options);

/* The camera of such a job (rig: job_camera_rig) with what its axes carry around
 * it: picture_of_space. */
enum status plot_payload_space(const struct job *job,
                               const struct plan_rig *rig, const char *path);

#endif
