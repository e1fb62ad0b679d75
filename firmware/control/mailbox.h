/* firmware/control/mailbox.h - commands into the tick, and the answers back.
 *
 * A ring with one sender (the keys of a terminal, a service) and one reader,
 * the tick.  Neither waits for the other: no lock, no allocation, at most
 * MAILBOX_CAPACITY commands in one tick.  An entry is the sender's until it is
 * put, the tick's until it is done, and the sender's again as an answer.
 *
 * A stop takes no entry: it is counted, so that a full mailbox cannot refuse
 * it. */
#ifndef FIRMWARE_CONTROL_MAILBOX_H
#define FIRMWARE_CONTROL_MAILBOX_H

#include <stdbool.h>
#include <stdint.h>

struct controller;

#define MAILBOX_CAPACITY 16

/* X(name, function) : int function(struct controller *, int64_t value) */
#define MAILBOX_COMMAND_LIST(X)                                                \
    X(MAILBOX_HOLD, mailbox_hold)                                              \
    X(MAILBOX_RESUME, mailbox_resume)                                          \
    X(MAILBOX_OVERRIDE, controller_override) /* value: rate_q30 */

enum mailbox_command {
#define MAILBOX_ENUM(name, function) name,
    MAILBOX_COMMAND_LIST(MAILBOX_ENUM)
#undef MAILBOX_ENUM
        MAILBOX_COMMANDS
};

struct mailbox_entry {
    enum mailbox_command command;
    int64_t value;
    int err; /* what the controller said: MOTION_OK or an error */
};

struct mailbox {
    struct mailbox_entry entry[MAILBOX_CAPACITY];
    /* Entries ever, modulo 2^32, each written by one side alone: loads and
     * stores are enough, also where there is no atomic addition.  (C11 6.5.16:
     * those of an _Atomic object are sequentially consistent.) */
    _Atomic uint32_t put, done;
    uint32_t answered;      /* the sender's */
    _Atomic uint32_t stops; /* asked for */
    uint32_t stopped;       /* the tick's */
};

void mailbox_init(struct mailbox *mailbox);

/* --- the sender's --- */

/* MOTION_E_FULL: as many commands wait, or have answers that were not read.
 * MOTION_E_ARG: no such command. */
int mailbox_put(struct mailbox *mailbox, enum mailbox_command command,
                int64_t value);
/* The oldest answer that was not read yet; false: there is none. */
bool mailbox_answer(struct mailbox *mailbox, struct mailbox_entry *answer);
void mailbox_stop(struct mailbox *mailbox);

/* --- the tick's --- */

/* Everything that was put is given to the controller, in order.  True: stops
 * were asked for since the last call; the controller has been told first, and
 * commands that were put with them do not undo it. */
bool mailbox_step(struct mailbox *mailbox, struct controller *controller);

#endif
