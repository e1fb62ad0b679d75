/* firmware/studio/server/example.h - the example of whoever has no rig
 * yet. */
#ifndef FIRMWARE_STUDIO_SERVER_EXAMPLE_H
#define FIRMWARE_STUDIO_SERVER_EXAMPLE_H

#include "firmware/host/base/files.h"

/* rig.yaml and move.yaml in slew/example under XDG_DATA_HOME, ~/.local/share, or
 * where neither is known the user's own directory in /tmp; what is there already
 * stays as it is.  0 and the directory, or -1 with a line on stderr. */
int example_write(char path[FILES_PATH_MAX]);

#endif
