/* hal/linux/socketcan_frame.h - between the kernel's CAN frames and ours.
 *
 * Pure: no socket, so that all of it can be tested where there is no CAN.
 * Source: linux/can.h, linux/can/error.h; Documentation/networking/can.rst. */
#ifndef HAL_LINUX_SOCKETCAN_FRAME_H
#define HAL_LINUX_SOCKETCAN_FRAME_H

#include <stddef.h>

#include <linux/can.h>

#include "hal/can.h"

/* The frame as the kernel has it; returns its size, CAN_MTU or CANFD_MTU. */
size_t can_frame_encode(const struct hal_can_frame *frame,
                        struct canfd_frame *out);
/* `bytes` as read.  False: no frame that can be on a wire (wrong size, length
 * beyond its format, an error frame). */
bool can_frame_decode(const struct canfd_frame *in, size_t bytes,
                      struct hal_can_frame *frame);
bool can_frame_is_error(const struct canfd_frame *in);

/* What an error frame tells: the state that follows `state`, and counts. */
enum hal_can_state can_frame_error(const struct canfd_frame *in,
                                   enum hal_can_state state,
                                   struct hal_can_stats *stats);

/* From the clocks of the kernel's time stamps to the monotonic one.  A card's
 * own clock has an epoch and a drift of its own: what it is apart is learnt
 * from the fastest frames (a frame is read late, never early). */
struct can_stamp {
    bool known;
    int64_t apart_ns; /* monotonic minus the card's */
};
/* software_ns: CLOCK_REALTIME, 0: none; hardware_ns: the card's, 0: none.  now:
 * both clocks at the same moment, after the frame was read.  The result is not
 * after now and at most a second before it. */
int64_t can_stamp_monotonic(struct can_stamp *stamp, int64_t software_ns,
                            int64_t hardware_ns, int64_t now_real_ns,
                            int64_t now_ns);

#endif
