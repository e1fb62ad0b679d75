/* motion/plan/path/plan_fastest.h - a path that is run as fast as the limits of its
 * axes allow.  See plan_path.h for what is asked. */
#ifndef MOTION_PLAN_PATH_PLAN_FASTEST_H
#define MOTION_PLAN_PATH_PLAN_FASTEST_H

#include "motion/plan/path/plan_path.h"

/* The tracks of the path's axes, which are inside its limits, with their bounds
 * and the law into *drive, whose space is there.  MOTION_E_ARG for a place
 * beyond the path, MOTION_E_LIMIT where no speed is left, MOTION_E_WORK,
 * MOTION_E_FULL; *error says it, the tracks are empty and drive is to be
 * freed. */
int plan_fastest_tracks(const struct plan_path *path, struct plan_drive *drive,
                        struct motion_track track[], struct plan_error *error);

void plan_fastest_free(struct plan_fastest *fastest);

#endif
