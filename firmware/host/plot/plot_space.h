/* firmware/host/plot/plot_space.h - a move of a camera in space: where the
 * camera goes, how it looks and what it sees, from above, from the side and at a
 * slant.
 *
 * The path, at even times the frustum of the lens (full frame, 36 x 24 mm, by
 * the zoom axis or else 35 mm) and the line to the subject, and the subject. */
#ifndef FIRMWARE_HOST_PLOT_PLOT_SPACE_H
#define FIRMWARE_HOST_PLOT_PLOT_SPACE_H

#include "firmware/host/job/job_camera.h"
#include "firmware/host/plot/plot_page.h"

/* Of a job with a camera (job_camera_rig).  As plot_page_write. */
int plot_space_write(const struct job *job, enum plot_format format, FILE *file,
                     struct messages *messages);

#endif
