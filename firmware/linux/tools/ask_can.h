/* firmware/linux/tools/ask_can.h - questions to one CANopen node at a time,
 * each waited for.
 *
 * For tools, never for the tick: a call returns when the answer is there or
 * does not come. */
#ifndef FIRMWARE_LINUX_TOOLS_ASK_CAN_H
#define FIRMWARE_LINUX_TOOLS_ASK_CAN_H

#include <stdbool.h>
#include <stdint.h>

#include "hal/canopen/lss.h"
#include "hal/clock.h"

struct ask_can {
    struct hal_can *can;
    struct hal_clock *clock;
    int64_t timeout_ns;
    struct canopen master;
    struct canopen_lss lss;
    struct canopen_node node;
    uint32_t abort_code; /* of the last question that was refused */
};

/* timeout_ns: for each answer; 0: 200 ms. */
void ask_can_init(struct ask_can *ask, struct hal_can *can,
                  struct hal_clock *clock, int64_t timeout_ns);
/* Whom to ask, 1..127; the one before is forgotten. */
int ask_can_node(struct ask_can *ask, uint8_t node_id);

/* An object of up to `room` bytes, by segments when it is long.
 * MOTION_E_REFUSED (abort_code), MOTION_E_TIMEOUT after three tries,
 * MOTION_E_IO the bus is gone. */
int ask_can_read(struct ask_can *ask, uint16_t index, uint8_t sub,
                 uint8_t *into, uint32_t room, uint32_t *length);
/* The same of at most four bytes, not sign extended; `size` may be NULL. */
int ask_can_read_number(struct ask_can *ask, uint16_t index, uint8_t sub,
                        uint32_t *value, uint8_t *size);
int ask_can_write(struct ask_can *ask, uint16_t index, uint8_t sub,
                  const uint8_t *from, uint32_t length);
int ask_can_write_number(struct ask_can *ask, uint16_t index, uint8_t sub,
                         uint8_t size, uint32_t value);
/* Why it did not work: "no such object (0x06020000)". */
#define ASK_CAN_TEXT_MAX 80
void ask_can_text(const struct ask_can *ask, int err,
                  char text[ASK_CAN_TEXT_MAX]);

/* Let time pass and hear what comes. */
void ask_can_wait(struct ask_can *ask, int64_t dur_ns);
/* Until the LSS request that was started is over; what canopen_lss_take
 * says. */
int ask_can_lss(struct ask_can *ask);

#endif
