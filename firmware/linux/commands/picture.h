/* firmware/linux/commands/picture.h - plots as files that are there whole or
 * not at all.
 *
 * `path` ends in .svg or .png.  0, or -1 with a line on stderr. */
#ifndef FIRMWARE_LINUX_COMMANDS_PICTURE_H
#define FIRMWARE_LINUX_COMMANDS_PICTURE_H

#include "firmware/host/plot/plot.h"
#include "firmware/host/plot/plot_otg.h"
#include "firmware/host/plot/plot_space.h"

int picture_of_job(const struct job *job, const struct trace *trace,
                   const char *path);
int picture_of_space(const struct job *job, const struct plot_film *carried,
                     const char *path);
int picture_of_otg(const struct otg_motion *motion, const char *title,
                   const char *subtitle, const char *path);

#endif
