/* firmware/linux/tools/ask_turns.h - questions to one drive that counts turns,
 * each waited for.
 *
 * For tools, never for the tick; nothing here takes torque on.  What the frames
 * are says the drive's kind, firmware/linux/kind. */
#ifndef FIRMWARE_LINUX_TOOLS_ASK_TURNS_H
#define FIRMWARE_LINUX_TOOLS_ASK_TURNS_H

#include <stdbool.h>
#include <stdint.h>

#include "firmware/host/device/quantity.h"
#include "hal/can.h"
#include "hal/clock.h"

struct ask_turns_family;

struct ask_turns {
    struct hal_can *can;
    struct hal_clock *clock;
    int64_t timeout_ns;
    uint8_t node;
    const struct ask_turns_family *family; /* its kind's */
    bool switched;                         /* data at the faster bit rate */
    bool is_05;         /* ODrive: of that firmware, and not 0.6 */
    uint8_t version[8]; /* ODrive 0.6: as Get_Version has it */
};

/* timeout_ns: for each answer; 0: 200 ms. */
void ask_turns_init(struct ask_turns *ask, struct hal_can *can,
                    struct hal_clock *clock, int64_t timeout_ns);
/* Is it there, and what is it?  MOTION_E_TIMEOUT; MOTION_E_IO: the bus is
 * gone. */
int ask_turns_hello(struct ask_turns *ask);

/* Its bytes, little endian.  Errors of hello; MOTION_E_REFUSED: it has no such
 * register, or it is not for this. */
int ask_turns_read(struct ask_turns *ask, const struct quantity *quantity,
                   uint32_t *raw);
int ask_turns_write(struct ask_turns *ask, const struct quantity *quantity,
                    uint32_t raw);

/* How it is, by its own words. */
struct ask_turns_state {
    bool is_fault, has_torque; /* may have */
    unsigned state;            /* axis state, or mode */
    uint32_t error;            /* error bits, or fault number */
    uint8_t parts; /* ODrive 0.5: which have one; 1 motor, 2 encoder, 4
                      controller */
};
int ask_turns_state(struct ask_turns *ask, struct ask_turns_state *state);
/* Errors are forgotten, those whose cause is gone; it does not move then. */
int ask_turns_clear(struct ask_turns *ask);
/* "closed loop control" */
const char *ask_turns_state_text(const struct ask_turns *ask, unsigned state);
#define ASK_TURNS_REASON_MAX 160
/* Why it is in fault, all that it says. */
void ask_turns_reason(const struct ask_turns *ask,
                      const struct ask_turns_state *state,
                      char text[ASK_TURNS_REASON_MAX]);

/* Why it did not work: "node 3 does not answer". */
#define ASK_TURNS_TEXT_MAX 80
void ask_turns_text(const struct ask_turns *ask, int err,
                    char text[ASK_TURNS_TEXT_MAX]);

/* Let time pass. */
void ask_turns_wait(struct ask_turns *ask, int64_t dur_ns);

#endif
