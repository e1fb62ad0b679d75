/* firmware/linux/kind/turn/tool.h - what the tools do alike with all drives that
 * count turns; see firmware/linux/tools/kind.h. */
#ifndef FIRMWARE_LINUX_KIND_TURN_TOOL_H
#define FIRMWARE_LINUX_KIND_TURN_TOOL_H

#include "firmware/linux/tools/kind.h"

int turn_open(struct talk *talk, const struct talk_config *config,
              const struct ask_turns_family *family,
              char message[YAML_MESSAGE_MAX]);
int turn_is_enabled(struct talk *talk);
void turn_text(const struct talk *talk, int err, char text[TALK_TEXT_MAX]);
int turn_reset(struct talk *talk, struct reset *reset);

#endif
