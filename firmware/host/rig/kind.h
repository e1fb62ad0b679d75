/* firmware/host/rig/kind.h - the kinds of drive: one row here, and what is
 * theirs in folders of their own, firmware/host/kind/NAME among them.
 *
 * A row makes RIG_NAME, and in every layer expects a constant table of what the
 * kind does there: rig_kind_name (here), machine_kind_name, tool_kind_name,
 * verb_kind_name.  docs/ARCHITECTURE.md, "To add a kind of drive". */
#ifndef FIRMWARE_HOST_RIG_KIND_H
#define FIRMWARE_HOST_RIG_KIND_H

#include <stdbool.h>

#define RIG_KIND_LIST(KIND)                                                    \
    KIND(CIA402, cia402)                                                       \
    KIND(MODBUS, modbus)                                                       \
    KIND(ODRIVE, odrive)                                                       \
    KIND(MOTEUS, moteus)
/* As a sentence has them. */
#define RIG_KIND_WORDS "cia402, modbus, odrive or moteus"

#define RIG_KIND_ENUM(NAME, name)  RIG_##NAME,
#define RIG_KIND_COUNT(NAME, name) +1
enum rig_drive_kind { RIG_KIND_LIST(RIG_KIND_ENUM) };
#define RIG_DRIVE_KINDS (0 RIG_KIND_LIST(RIG_KIND_COUNT))

struct rig_bus;

struct rig_kind {
    /* Is this a bus for it? */
    bool (*is_for)(const struct rig_bus *bus);
};
#define RIG_KIND_ROW(NAME, name) extern const struct rig_kind rig_kind_##name;
RIG_KIND_LIST(RIG_KIND_ROW)
/* By enum rig_drive_kind. */
extern const struct rig_kind *const rig_kinds[RIG_DRIVE_KINDS];

/* Which drives are on a bus: there is one kind only. */
enum rig_drive_kind rig_kind_on(const struct rig_bus *bus);

#endif
