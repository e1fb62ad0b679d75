/* firmware/linux/kind/cia402/verbs.h - private to verbs.c and info.c. */
#ifndef FIRMWARE_LINUX_KIND_CIA402_VERBS_H
#define FIRMWARE_LINUX_KIND_CIA402_VERBS_H

#include "firmware/linux/commands/drive/kind.h"

void cia402_read_object(struct session *session, const struct object *object,
                        struct drive_value *value);
/* The same where another axis of the node has it, at this index; axis: of the
 * rig, or NULL. */
void cia402_read_object_of(struct session *session, const struct rig_axis *axis,
                           const struct object *object, uint16_t index,
                           struct drive_value *value);
enum status cia402_info(struct session *session, struct drive_info *info);

#endif
