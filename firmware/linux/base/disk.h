/* firmware/linux/base/disk.h - the files of this machine, for host
 * (firmware/host/base/files.h).
 *
 * Those that come with slew are found from the program: in PREFIX/share/slew
 * where it is in PREFIX/bin, in the source tree where it is in build/. */
#ifndef FIRMWARE_LINUX_BASE_DISK_H
#define FIRMWARE_LINUX_BASE_DISK_H

#include "firmware/host/base/files.h"

extern const struct files disk_files;

/* For a name that came from somebody else, counted from `folder`, a real path: a
 * regular file, or with `streams` a pipe, whose place, links followed, is below
 * it; nothing else is so much as opened.  A file to be read, which waits for
 * nothing, or a negative errno: FILES_E_KIND, FILES_E_PLACE. */
int disk_open_below(const char *folder, const char *path, bool streams);
/* Where the folder of a file is, links followed; "": nowhere. */
void disk_folder(const char *path, char folder[FILES_PATH_MAX]);

#endif
