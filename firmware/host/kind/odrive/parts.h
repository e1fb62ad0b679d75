/* firmware/host/kind/odrive/parts.h - what the files of this folder share. */
#ifndef FIRMWARE_HOST_KIND_ODRIVE_PARTS_H
#define FIRMWARE_HOST_KIND_ODRIVE_PARTS_H

#include "firmware/host/kind/turn/parts.h"

/* ---- endpoints.c ---- */

/* From the rig's directory.  -1: too long. */
int rig_endpoints_path(char path[RIG_PATH_MAX], const char *name,
                       const char *rig_path);
/* Fills in enable_watchdog and watchdog_timeout, 0 where it does not have them.
 * -1: no such file, or not a list. */
int rig_endpoints_load(const struct files *files, const char *path,
                       struct rig_axis *axis);

/* ---- budget.c: see struct rig_kind ---- */

unsigned odrive_frames(const struct rig *rig, unsigned i,
                       struct rig_frame frame[RIG_FRAMES_MAX]);
void odrive_expect(const struct rig *rig, unsigned i,
                   const struct motion_state *state,
                   double bits[RIG_FRAMES_MAX]);

#endif
