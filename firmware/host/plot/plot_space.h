/* firmware/host/plot/plot_space.h - a move of a camera in space: where the
 * camera goes, how it looks and what it sees, from above, from the side and at a
 * slant.
 *
 * The path, at even times the frustum of the lens (full frame, 36 x 24 mm, by
 * the zoom axis or else 35 mm) and the line to the subject, and the subject; what
 * axes carry at the same times. */
#ifndef FIRMWARE_HOST_PLOT_PLOT_SPACE_H
#define FIRMWARE_HOST_PLOT_PLOT_SPACE_H

#include "firmware/host/job/job_camera.h"
#include "firmware/host/plot/plot_film.h"

#define PLOT_SPACE_MOMENTS 13 /* from the first of the move to its last */

/* Of a job with a camera (job_camera_rig).  carried: PLOT_SPACE_MOMENTS of what
 * axes carry, with points in the camera's space; or NULL.  As
 * plot_page_write. */
int plot_space_write(const struct job *job, const struct plot_film *carried,
                     enum plot_format format, FILE *file,
                     struct messages *messages);

#endif
