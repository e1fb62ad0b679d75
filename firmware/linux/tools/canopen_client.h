/* firmware/linux/tools/canopen_client.h - questions to one CANopen node at a time,
 * each waited for.
 *
 * For tools, never for the tick: a call returns when the answer is there or
 * does not come. */
#ifndef FIRMWARE_LINUX_TOOLS_CANOPEN_CLIENT_H
#define FIRMWARE_LINUX_TOOLS_CANOPEN_CLIENT_H

#include <stdbool.h>
#include <stdint.h>

#include "hal/canopen/lss.h"
#include "hal/clock.h"

struct canopen_client {
    struct hal_can *can;
    struct hal_clock *clock;
    int64_t timeout_ns;
    struct canopen master;
    struct canopen_lss lss;
    struct canopen_node node;
    uint32_t abort_code; /* of the last question that was refused */
};

/* timeout_ns: for each answer; 0: 200 ms. */
void canopen_client_init(struct canopen_client *client, struct hal_can *can,
                         struct hal_clock *clock, int64_t timeout_ns);
/* Whom to ask, 1..127; the one before is forgotten. */
int canopen_client_node(struct canopen_client *client, uint8_t node_id);

/* An object of up to `capacity` bytes, by segments when it is long.
 * MOTION_E_REFUSED (abort_code), MOTION_E_TIMEOUT after three tries,
 * MOTION_E_IO the bus is gone. */
int canopen_client_read(struct canopen_client *client, uint16_t index,
                        uint8_t sub, uint8_t *into, uint32_t capacity,
                        uint32_t *length);
/* The same of at most four bytes, not sign extended; `size` may be NULL. */
int canopen_client_read_number(struct canopen_client *client, uint16_t index,
                               uint8_t sub, uint32_t *value, uint8_t *size);
int canopen_client_write_number(struct canopen_client *client, uint16_t index,
                                uint8_t sub, uint8_t size, uint32_t value);
/* Why it did not work: "no such object (0x06020000)". */
#define CANOPEN_CLIENT_TEXT_MAX 80
void canopen_client_text(const struct canopen_client *client, int err,
                         char text[CANOPEN_CLIENT_TEXT_MAX]);

/* Let time pass and hear what comes. */
void canopen_client_wait(struct canopen_client *client, int64_t dur_ns);
/* Until the LSS request that was started is over; what canopen_lss_take
 * says. */
int canopen_client_lss(struct canopen_client *client);

#endif
