/* firmware/linux/kind/turn/tool.h - what the tools do alike with all drives that
 * count turns; see firmware/linux/tools/kind.h. */
#ifndef FIRMWARE_LINUX_KIND_TURN_TOOL_H
#define FIRMWARE_LINUX_KIND_TURN_TOOL_H

#include "firmware/linux/tools/kind.h"

int turn_open(struct session *session, const struct session_config *config,
              const struct turn_client_family *family,
              char message[YAML_MESSAGE_MAX]);
int turn_is_enabled(struct session *session);
void turn_text(const struct session *session, int err,
               char text[SESSION_TEXT_MAX]);
int turn_reset(struct session *session, struct reset *reset);

#endif
