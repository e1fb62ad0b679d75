/* firmware/linux/fmu/fmu_export.h - a rig as a functional mock-up unit: a zip
 * archive with the description, the binary and the files of the rig.
 *
 * The same files give the same bytes. */
#ifndef FIRMWARE_LINUX_FMU_FMU_EXPORT_H
#define FIRMWARE_LINUX_FMU_FMU_EXPORT_H

#include <stdio.h>

#include "firmware/linux/fmu/fmu_files.h"
#include "firmware/linux/fmu/fmu_variable.h"

#define FMU_EXPORT_MESSAGE 512

/* version: 2 or 3.  `files` is the record that the rig was read through.  0, or
 * -1 and a sentence; what fails in writing stays in the file's error flag. */
int fmu_export(const struct rig *rig, const struct fmu_files *files,
               int version, FILE *file, char message[FMU_EXPORT_MESSAGE]);

#endif
