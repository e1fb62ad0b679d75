/* firmware/linux/base/disk.h - the files of this machine, for host
 * (firmware/host/base/files.h).
 *
 * Those that come with slew are found from the program: in PREFIX/share/slew
 * where it is in PREFIX/bin, in the source tree where it is in build/. */
#ifndef FIRMWARE_LINUX_BASE_DISK_H
#define FIRMWARE_LINUX_BASE_DISK_H

#include "firmware/host/base/files.h"

extern const struct files disk_files;

#endif
