/* firmware/linux/tools/scan.c - what is found; see scan.h. */
#include "firmware/linux/tools/scan.h"

#include <stdarg.h>
#include <stdio.h>

const char *scan_kind_text(enum scan_kind kind)
{
    static const char *const text[] = {
        [SCAN_CANOPEN] = "CANopen", [SCAN_NO_NUMBER] = "CANopen, no number",
        [SCAN_ODRIVE] = "ODrive",   [SCAN_MOTEUS] = "moteus",
        [SCAN_MODBUS] = "Modbus",
    };
    return text[kind];
}

struct scan_found *scan_add(struct scan *scan, enum scan_kind kind, unsigned id,
                            const char *bus)
{
    struct scan_found *found;

    if (scan->count == SCAN_MAX)
        return NULL;
    found = &scan->found[scan->count++];
    *found = (struct scan_found){ .kind = kind, .id = id };
    snprintf(found->bus, sizeof found->bus, "%s", bus);
    return found;
}

void scan_note(struct scan *scan, const char *format, ...)
{
    va_list arguments;

    if (scan->notes == SCAN_NOTES)
        return;
    va_start(arguments, format);
    vsnprintf(scan->note[scan->notes++], SCAN_NOTE_MAX, format, arguments);
    va_end(arguments);
}
