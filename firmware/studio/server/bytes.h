/* firmware/studio/server/bytes.h - a frame as bytes; docs/STUDIO.md, "binary
 * frames", is the layout. */
#ifndef FIRMWARE_STUDIO_SERVER_BYTES_H
#define FIRMWARE_STUDIO_SERVER_BYTES_H

#include "firmware/host/rig/rig.h"
#include "firmware/linux/service/frames.h"

#define BYTES_HEAD 88
#define BYTES_AXIS 104
#define BYTES_BUS  24
#define BYTES_MAX                                                              \
    (BYTES_HEAD + CONTROLLER_AXES_MAX * BYTES_AXIS +                           \
     RIG_BUSES_MAX * BYTES_BUS + RIG_LINES_MAX)

/* What is of a connection alone. */
struct bytes_count {
    uint32_t number, joined;
    bool is_real;
};

/* How many there are. */
size_t bytes_of_frame(const struct rig *rig, const struct service_frame *frame,
                      const struct bytes_count *count, uint8_t to[BYTES_MAX]);

#endif
