/* firmware/host/recording/row_notes.h - what rows of telemetry say beside their
 * numbers, in words and as it begins: warnings of axes and buses, what drives say
 * without being in fault, and that the guardian was lost.  A service, which has no rows, asks the same of what it
 * has (row_notes_warning and after). */
#ifndef FIRMWARE_HOST_RECORDING_ROW_NOTES_H
#define FIRMWARE_HOST_RECORDING_ROW_NOTES_H

#include <stdbool.h>
#include <stdint.h>

#include "firmware/host/base/memory.h"
#include "firmware/host/recording/telemetry.h"

#define ROW_NOTES_TEXT_MAX 256

/* What was said, and when. */
struct row_notes_axis {
    uint32_t warning; /* number of the newest */
    struct hal_drive_events drive;
    int64_t drive_ns;
};
struct row_notes_bus {
    uint32_t warnings;
    int64_t ns;
};

struct row_notes {
    struct memory_pool memory;
    const struct rig *rig;
    int64_t every_ns; /* of one drive, and of one bus, once in */
    bool begun;
    uint32_t guardian_lost;
    struct row_notes_axis *axis;
    struct row_notes_bus *bus;
};

/* Is there something to be said that was not?  Of warnings of an axis each, of one
 * drive and one bus once in every_ns: what has come since then, together. */
bool row_notes_warning(struct row_notes_axis *said,
                       const struct warning *newest);
bool row_notes_drive(struct row_notes_axis *said,
                     const struct hal_drive_events *now, int64_t now_ns,
                     int64_t every_ns, struct hal_drive_events *more);
bool row_notes_bus(struct row_notes_bus *said, uint32_t warnings,
                   int64_t now_ns, int64_t every_ns);
/* Of the guardian, each time that it is lost: what has become of it. */
bool row_notes_guardian(uint32_t *said, uint32_t lost);
const char *row_notes_guardian_text(bool is_gone);

/* All zero before; row_notes_free in the end. */
void row_notes_init(struct row_notes *notes, const struct rig *rig,
                    int64_t every_ns);
void row_notes_free(struct row_notes *notes);
/* "pan: warning 1", "bus can0: error-warning" to `say`.  What was there in the first
 * row is no news. */
void row_notes_take(struct row_notes *notes, const struct telemetry_row *row,
                    void (*say)(void *context, const struct telemetry_row *row,
                                const char *text),
                    void *context);

#endif
