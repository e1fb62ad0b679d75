/* firmware/linux/service/frames.h - what happened on all ticks since the last
 * look, for one who looks on some 60 times a second.
 *
 * The tick adds every state to a frame: last, lowest and highest of what moves.
 * It hands the frame over when it is old enough and the one before was taken;
 * until then it goes on adding, so that a reader that is slow, or stopped, loses
 * no peak and delays nothing. */
#ifndef FIRMWARE_LINUX_SERVICE_FRAMES_H
#define FIRMWARE_LINUX_SERVICE_FRAMES_H

#include <stdatomic.h>

#include "firmware/linux/service/state.h"

#define SERVICE_FRAME_NS INT64_C(16666667)

struct service_range {
    int64_t last, low, high;
};

struct service_frame_axis {
    struct service_range demand_q32, actual_q32, following_q32;
};

struct service_frame {
    uint32_t ticks;                  /* in it; 0: it is empty */
    int64_t late_ns;                 /* the latest wake-up among them */
    struct service_frame_axis *axis; /* of the rig */
    struct service_state state;      /* of the last of them */
};

struct service_frames {
    struct service_frame frame; /* the tick's */
    int64_t begun_ns;
    struct service_frame out; /* the tick's while not full, else the reader's */
    _Atomic bool full;
};

/* Empty, with memory from the pool. */
void service_frame_init(struct service_frame *frame, const struct rig *rig,
                        struct memory_pool *pool);
void service_frames_init(struct service_frames *frames, const struct rig *rig,
                         struct memory_pool *pool);

/* Adds `from`, of the same rig, to a frame that may be empty. */
void service_frame_join(struct service_frame *frame,
                        const struct service_frame *from);

/* The tick's. */
void service_frames_put(struct service_frames *frames,
                        const struct service_state *state);
/* The reader's; false: there is none. */
bool service_frames_take(struct service_frames *frames,
                         struct service_frame *frame);

#endif
