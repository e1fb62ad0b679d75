/* tests/fuzz/fuzz_can_frame.c - what the kernel hands over as a CAN frame. */
#include <string.h>

#include "hal/linux/socketcan_frame.h"
#include "tests/fuzz/fuzz.h"

static bool fuzz_is_same(const struct hal_can_frame *a,
                         const struct hal_can_frame *b)
{
    return a->id == b->id && a->extended == b->extended &&
           a->remote == b->remote && a->fd == b->fd &&
           a->switched == b->switched && a->len == b->len &&
           memcmp(a->data, b->data, a->len) == 0;
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    struct canfd_frame raw = { 0 }, again;
    struct hal_can_frame frame, back;
    struct hal_can_stats stats = { 0 };
    const size_t bytes = size < sizeof raw ? size : sizeof raw;

    memcpy(&raw, data, bytes);
    if (can_frame_is_error(&raw)) {
        const enum hal_can_state state =
            can_frame_error(&raw, HAL_CAN_ACTIVE, &stats);
        fuzz_claim(state <= HAL_CAN_DOWN, "an error leads to a state");
        fuzz_claim(!can_frame_decode(&raw, bytes, &frame),
                   "an error is no frame");
        return 0;
    }
    if (!can_frame_decode(&raw, bytes, &frame))
        return 0;
    fuzz_claim(hal_can_is_legal(&frame, true), "a frame can be on a wire");
    fuzz_claim(can_frame_encode(&frame, &again) == bytes,
               "it goes back into as many bytes");
    fuzz_claim(can_frame_decode(&again, bytes, &back) &&
                   fuzz_is_same(&back, &frame),
               "it is the same frame");
    return 0;
}
