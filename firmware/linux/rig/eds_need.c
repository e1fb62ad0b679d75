/* firmware/linux/rig/eds_need.c - see eds_need.h. */
#include "firmware/linux/rig/eds_need.h"

#include <stddef.h>

const struct eds_need eds_needs[] = {
    { 0x1000, 0, NEED_READ, true, "is it a drive" },
    { 0x1016, 1, NEED_READ | NEED_WRITE, true, "it stops when we are silent" },
    { 0x1017, 0, NEED_READ | NEED_WRITE, true, "its heartbeat" },
    { 0x1400, 1, NEED_READ | NEED_WRITE, true, "set points in a PDO" },
    { 0x1600, 0, NEED_READ | NEED_WRITE, true, "likewise, what it carries" },
    { 0x1800, 1, NEED_READ | NEED_WRITE, true, "feedback in a PDO" },
    { 0x1A00, 0, NEED_READ | NEED_WRITE, true, "likewise, what it carries" },
    { 0x6007, 0, NEED_READ | NEED_WRITE, true, "how it stops when we are" },
    { 0x6040, 0, NEED_MAP, true, "controlword" },
    { 0x6041, 0, NEED_READ | NEED_MAP, true, "statusword" },
    { 0x6060, 0, NEED_WRITE, true, "mode" },
    { 0x6061, 0, NEED_READ, true, "mode in force" },
    { 0x6064, 0, NEED_READ | NEED_MAP, true, "actual position" },
    { 0x607A, 0, NEED_READ | NEED_WRITE | NEED_MAP, true, "target position" },
    { 0x6502, 0, NEED_READ, true, "CSP among its modes" },
    { 0x1006, 0, NEED_READ | NEED_WRITE, false, "SYNC period" },
    { 0x603F, 0, NEED_READ, false, "error code" },
    { 0x6065, 0, NEED_READ | NEED_WRITE, false, "following error window" },
    { 0x6085, 0, NEED_READ | NEED_WRITE, false, "quick-stop ramp" },
    { 0x60C2, 1, NEED_READ | NEED_WRITE, false, "interpolation period" },
    { 0x60FD, 0, NEED_READ | NEED_MAP, false, "limit switches" },
};
const unsigned eds_need_count = sizeof eds_needs / sizeof eds_needs[0];

const char *eds_lacks(const struct eds *eds, const struct eds_need *need)
{
    const struct eds_object *object = eds_find(eds, need->index, need->sub);

    if (object == NULL)
        return "not there";
    if ((need->access & NEED_READ) != 0 && !object->readable)
        return "cannot be read";
    if ((need->access & NEED_WRITE) != 0 && !object->writable)
        return "cannot be written";
    if ((need->access & NEED_MAP) != 0 && !object->mappable)
        return "cannot be mapped";
    if (object->index == 0x6502 && object->has_value &&
        (object->value & EDS_MODE_CSP) == 0)
        return "has no CSP";
    return NULL;
}

unsigned eds_missing(const struct eds *eds)
{
    unsigned missing = 0;

    for (unsigned i = 0; i < eds_need_count; i++)
        missing +=
            eds_needs[i].required && eds_lacks(eds, &eds_needs[i]) != NULL;
    return missing;
}
