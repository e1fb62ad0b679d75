/* firmware/linux/commands/files/import_arm.h - the arm of a robot description as
 * kinematics of a rig. */
#ifndef FIRMWARE_LINUX_COMMANDS_FILES_IMPORT_ARM_H
#define FIRMWARE_LINUX_COMMANDS_FILES_IMPORT_ARM_H

#include <cjson/cJSON.h>

#include "firmware/host/move/move_text.h"
#include "firmware/linux/commands/command.h"
#include "firmware/linux/xml/urdf_arm.h"

struct import_arm {
    char why[URDF_WHY_MAX]; /* there is none; "": there is */
    struct urdf_chain chain;
    struct urdf_arm arm;
    double off_mm, off_deg; /* at most, of where the description has the tip */
};

/* Append kinematics to the text of the rig, which has none, once the rig of that
 * text has its tool where the description has it. */
void import_arm(const struct urdf *urdf, const struct rig *rig,
                const struct options *options, struct move_text *text,
                struct import_arm *self);
void import_arm_print(const struct import_arm *self);
void import_arm_json(const struct import_arm *self, cJSON *report);

#endif
