/* firmware/linux/base/disk.h - the files of this machine, for host
 * (firmware/host/base/files.h).
 *
 * Those that come with slew are found from the program: in PREFIX/share/slew
 * where it is in PREFIX/bin, in the source tree where it is in build/. */
#ifndef FIRMWARE_LINUX_BASE_DISK_H
#define FIRMWARE_LINUX_BASE_DISK_H

#include "firmware/host/base/files.h"

extern const struct files disk_files;

/* For a name that came from somebody else: a regular file whose place, links
 * followed, is below `folder` (a real path); nothing else is so much as opened.
 * A file to be read, or a negative errno: FILES_E_KIND, FILES_E_PLACE. */
int disk_open_below(const char *folder, const char *path);

#endif
