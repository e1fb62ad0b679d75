/* hal/canopen/guard.c - node guarding, for devices without a heartbeat (CiA 301
 * 7.2.8.2.2). */
#include "hal/canopen/sdo.h"

#define GUARD_TOGGLE 0x80u

/* After a gap the next question is a period away. */
void canopen_guard_request(struct canopen_node *node, int64_t now_ns)
{
    const struct hal_can_frame frame = {
        .id = CANOPEN_COB_HEARTBEAT + (uint32_t)node->id,
        .remote = true,
        .len = 1,
    };

    if (node->guard_period_ns == 0 || now_ns < node->guard_due_ns ||
        can_cycle_send(&node->master->cycle, &frame) != MOTION_OK)
        return;
    node->guard_due_ns += node->guard_period_ns;
    if (node->guard_due_ns <= now_ns)
        node->guard_due_ns = now_ns + node->guard_period_ns;
}

/* It begins with 0 after boot-up, and anew with the first answer after the node
 * was lost. */
bool canopen_guard_toggles(struct canopen_node *node, uint8_t answer)
{
    const uint8_t toggle = answer & GUARD_TOGGLE;

    if (node->guard_period_ns == 0)
        return true;
    if (answer == CANOPEN_NMT_BOOT_UP) {
        node->guard_toggle = 0;
        return true;
    }
    if (node->heartbeat_heard && toggle != node->guard_toggle)
        return false;
    node->guard_toggle = toggle ^ GUARD_TOGGLE;
    return true;
}
