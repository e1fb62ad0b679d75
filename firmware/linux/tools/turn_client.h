/* firmware/linux/tools/turn_client.h - questions to one drive that counts turns,
 * each waited for.
 *
 * For tools, never for the tick; nothing here takes torque on.  What the frames
 * are says the drive's kind, firmware/linux/kind. */
#ifndef FIRMWARE_LINUX_TOOLS_TURN_CLIENT_H
#define FIRMWARE_LINUX_TOOLS_TURN_CLIENT_H

#include <stdbool.h>
#include <stdint.h>

#include "firmware/host/device/quantity.h"
#include "hal/can.h"
#include "hal/clock.h"

struct turn_client_family;

struct turn_client {
    struct hal_can *can;
    struct hal_clock *clock;
    int64_t timeout_ns;
    uint8_t node;
    const struct turn_client_family *family; /* its kind's */
    bool switched;                           /* data at the faster bit rate */
    bool is_05;         /* ODrive: of that firmware, and not 0.6 */
    uint8_t version[8]; /* ODrive 0.6: as Get_Version has it */
};

/* timeout_ns: for each answer; 0: 200 ms. */
void turn_client_init(struct turn_client *client, struct hal_can *can,
                      struct hal_clock *clock, int64_t timeout_ns);
/* Is it there, and what is it?  MOTION_E_TIMEOUT; MOTION_E_IO: the bus is
 * gone. */
int turn_client_hello(struct turn_client *client);

/* Its bytes, little endian.  Errors of hello; MOTION_E_REFUSED: it has no such
 * register, or it is not for this. */
int turn_client_read(struct turn_client *client,
                     const struct quantity *quantity, uint32_t *raw);
int turn_client_write(struct turn_client *client,
                      const struct quantity *quantity, uint32_t raw);

/* How it is, by its own words. */
struct turn_client_state {
    bool is_fault, has_torque; /* may have */
    unsigned state;            /* axis state, or mode */
    uint32_t error;            /* error bits, or fault number */
    uint8_t parts; /* ODrive 0.5: which have one; 1 motor, 2 encoder, 4
                      controller */
};
int turn_client_state(struct turn_client *client,
                      struct turn_client_state *state);
/* Errors are forgotten, those whose cause is gone; it does not move then. */
int turn_client_clear(struct turn_client *client);
/* "closed loop control" */
const char *turn_client_state_text(const struct turn_client *client,
                                   unsigned state);
#define TURN_CLIENT_REASON_MAX 160
/* Why it is in fault, all that it says. */
void turn_client_reason(const struct turn_client *client,
                        const struct turn_client_state *state,
                        char text[TURN_CLIENT_REASON_MAX]);

/* Why it did not work: "node 3 does not answer". */
#define TURN_CLIENT_TEXT_MAX 80
void turn_client_text(const struct turn_client *client, int err,
                      char text[TURN_CLIENT_TEXT_MAX]);

/* Let time pass. */
void turn_client_wait(struct turn_client *client, int64_t dur_ns);

#endif
