/* firmware/linux/commands/files/import_urdf.h - slew import urdf: limits of joints
 * into the text of a rig file. */
#ifndef FIRMWARE_LINUX_COMMANDS_FILES_IMPORT_URDF_H
#define FIRMWARE_LINUX_COMMANDS_FILES_IMPORT_URDF_H

#include "firmware/linux/commands/command.h"

/* options->path[1] is the description, options->rig the rig, whose axes have the
 * joints' names, options->out the new one. */
enum status import_urdf(const struct options *options);

#endif
