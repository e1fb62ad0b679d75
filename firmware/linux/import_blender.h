/* firmware/linux/import_blender.h - curves of a Blender action.
 *
 * Reads what examples/blender/slew_export.py writes: keys with handles, times in
 * frames, values in the units of the property.  Handles of the automatic kinds
 * are computed anew, so a file may be edited. */
#ifndef FIRMWARE_LINUX_IMPORT_BLENDER_H
#define FIRMWARE_LINUX_IMPORT_BLENDER_H

#include <stddef.h>
#include <stdint.h>

#include "motion/fcurve.h"

#define IMPORT_BLENDER_KEYS_MAX 1000000

/* One curve that is wanted.  Times count from the file's frame 0. */
struct import_blender_curve {
    const char *name;           /* in: "location[0]" */
    double units_per_value;     /* in: 1000 for metres on an axis in mm, 180/pi
                                   for radians on one in degrees; not 0 */
    struct motion_fcurve curve; /* out: handles are computed; keys are on the
                                   heap: import_blender_free */
};

/* Fill in all of them.  On an error -1, one sentence without a line end is
 * written into `message` and nothing is on the heap. */
int import_blender_read(const char *path, struct import_blender_curve want[],
                        unsigned count, char *message, size_t room);
void import_blender_free(struct import_blender_curve want[], unsigned count);

#endif
