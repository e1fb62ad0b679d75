/* firmware/linux/commands/rig_text.h - the edited text of a rig, written when it
 * is a rig. */
#ifndef FIRMWARE_LINUX_COMMANDS_RIG_TEXT_H
#define FIRMWARE_LINUX_COMMANDS_RIG_TEXT_H

#include "firmware/host/base/status.h"
#include "firmware/host/move/move_text.h"

/* `text` in the place of what the rig at `path` says is read as a rig first,
 * and then written to `out`. */
enum status rig_text_write(const char *path, const struct move_text *text,
                           const char *out);

#endif
