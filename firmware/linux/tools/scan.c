/* firmware/linux/tools/scan.c - what is found; see scan.h. */
#include "firmware/linux/tools/scan.h"

#include <stdarg.h>
#include <stdio.h>

struct scan_found *scan_add(struct scan *scan, const char *kind, unsigned id,
                            const char *bus)
{
    struct scan_found *found;

    if (scan->count == SCAN_MAX)
        return NULL;
    found = &scan->found[scan->count++];
    *found = (struct scan_found){ .kind = kind, .has_number = true, .id = id };
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
