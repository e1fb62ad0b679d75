/* firmware/control/mailbox.h - commands into the tick, and the answers back.
 *
 * A ring with one sender (the keys of a terminal, a service) and one reader,
 * the tick.  Neither waits for the other: no lock, no allocation, at most
 * MAILBOX_CAPACITY commands in one tick.  An entry is the sender's until it is
 * put, the tick's until it is done, and the sender's again as an answer.
 *
 * A stop takes no entry: it is counted, so that a full mailbox cannot refuse
 * it.
 *
 * Everything an operator does is a command here; what a state forbids is
 * answered by MOTION_E_STATE, and nothing has changed then. */
#ifndef FIRMWARE_CONTROL_MAILBOX_H
#define FIRMWARE_CONTROL_MAILBOX_H

#include <stdbool.h>
#include <stdint.h>

struct controller_cam;
struct playback;

#define MAILBOX_CAPACITY 16

/* X(name, word, function) : what the fields of its entry are, else 0
 *   ENABLE     OFF -> READY, once every drive has torque
 *   OFF        torque off, from READY
 *   RESET      a fault, to OFF
 *   START      the move that is loaded (playback.h): to its start, and on
 *   HOLD       a move, along its path
 *   RESUME     what is held
 *   REVERSE    value: 1 to the start, 0 to the end; what is held goes on there
 *   GO         value: path time, ns Q12; to there, and HOLDING
 *   LOOP       value: so often, this time included; 0: until a stop
 *   PING_PONG  the same, every second time in reverse
 *   OVERRIDE   value: rate_q30, 0 .. 200 %; by a ramp
 *   JOG        axis; value: pos_q32, to where; vel_q32 at most; for_ns: stops
 *              then unless another JOG comes (dead man)
 *   JOG_STOP   value: 1 by the stop limits, 0 by the axis's
 *   CAPTURE    pos_q32: the sender's, of as many axes as the controller has,
 *              and the tick's until it is answered; value comes back as the
 *              path time, ns Q12
 *   COUPLE     axis; cam: follows by it (couple.h); outlives that
 *   UNCOUPLE   axis */
#define MAILBOX_COMMAND_LIST(X)                                                \
    X(MAILBOX_ENABLE, "enable", mailbox_enable)                                \
    X(MAILBOX_OFF, "off", mailbox_off)                                         \
    X(MAILBOX_RESET, "reset", mailbox_reset)                                   \
    X(MAILBOX_START, "start", mailbox_start)                                   \
    X(MAILBOX_HOLD, "hold", mailbox_hold)                                      \
    X(MAILBOX_RESUME, "resume", mailbox_resume)                                \
    X(MAILBOX_REVERSE, "reverse", mailbox_reverse)                             \
    X(MAILBOX_GO, "go", mailbox_go)                                            \
    X(MAILBOX_LOOP, "loop", mailbox_loop)                                      \
    X(MAILBOX_PING_PONG, "ping-pong", mailbox_ping_pong)                       \
    X(MAILBOX_OVERRIDE, "override", mailbox_override)                          \
    X(MAILBOX_JOG, "jog", mailbox_jog)                                         \
    X(MAILBOX_JOG_STOP, "jog stop", mailbox_jog_stop)                          \
    X(MAILBOX_CAPTURE, "capture", mailbox_capture)                             \
    X(MAILBOX_COUPLE, "couple", mailbox_couple)                                \
    X(MAILBOX_UNCOUPLE, "uncouple", mailbox_uncouple)

enum mailbox_command {
#define MAILBOX_ENUM(name, word, function) name,
    MAILBOX_COMMAND_LIST(MAILBOX_ENUM)
#undef MAILBOX_ENUM
        MAILBOX_COMMANDS
};

struct mailbox_entry {
    enum mailbox_command command;
    unsigned axis;
    int64_t value;
    int64_t vel_q32, for_ns;
    int64_t *pos_q32;
    struct controller_cam *cam;
    int err; /* the answer: MOTION_OK or an error */
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
 * MOTION_E_ARG: no such command, a CAPTURE without a place for it, or a
 * COUPLE without a cam. */
int mailbox_send(struct mailbox *mailbox, const struct mailbox_entry *entry);
/* A command that has a value and no more. */
int mailbox_put(struct mailbox *mailbox, enum mailbox_command command,
                int64_t value);
/* The oldest answer that was not read yet; false: there is none. */
bool mailbox_answer(struct mailbox *mailbox, struct mailbox_entry *answer);
void mailbox_stop(struct mailbox *mailbox);

/* --- the tick's --- */

/* Between two ticks: everything that was put is done, in order.  True: stops
 * were asked for since the last call; the controller has been told first, and
 * commands that were put with them are refused, but for OFF, so that none undoes
 * it. */
bool mailbox_step(struct mailbox *mailbox, struct playback *playback);

#endif
