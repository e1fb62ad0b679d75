/* firmware/host/rig/kind.c - see kind.h. */
#include "firmware/host/rig/rig_parts.h"

#define KIND_ROW(NAME, name, word) [RIG_##NAME] = &rig_kind_##name,
const struct rig_kind *const rig_kinds[] = { RIG_KIND_LIST(KIND_ROW) };

#define KIND_WORD(NAME, name, word) [RIG_##NAME] = word,
const char *const rig_drive_kinds[] = { RIG_KIND_LIST(KIND_WORD) };

enum rig_drive_kind rig_kind_on(const struct rig_bus *bus)
{
    unsigned kind = 0;

    while (kind + 1 < RIG_DRIVE_KINDS && !rig_kinds[kind]->is_for(bus))
        kind++;
    return (enum rig_drive_kind)kind;
}
