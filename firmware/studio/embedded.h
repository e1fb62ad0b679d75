/* firmware/studio/embedded.h - files that are part of the program; made by
 * embed.sh when it is built. */
#ifndef FIRMWARE_STUDIO_EMBEDDED_H
#define FIRMWARE_STUDIO_EMBEDDED_H

#include <stddef.h>

struct embedded_file {
    const char *name; /* NULL: there are no more */
    const unsigned char *data;
    size_t length;
};

extern const struct embedded_file embedded_own[];  /* of hal/maps, hal/quirks */
extern const struct embedded_file embedded_page[]; /* of the page, gzip */
extern const struct embedded_file embedded_example[]; /* rig.yaml, move.yaml */

#endif
