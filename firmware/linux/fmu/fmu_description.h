/* firmware/linux/fmu/fmu_description.h - modelDescription.xml of a rig's unit. */
#ifndef FIRMWARE_LINUX_FMU_FMU_DESCRIPTION_H
#define FIRMWARE_LINUX_FMU_FMU_DESCRIPTION_H

#include <stdio.h>

#include "firmware/linux/fmu/fmu_variable.h"

#define FMU_IDENTIFIER "slew_rig" /* of the model: the binary's name */

/* version: 2 (FMI 2.0) or 3 (3.0). */
void fmu_describe(FILE *file, const struct rig *rig, int version,
                  const char *token);

#endif
