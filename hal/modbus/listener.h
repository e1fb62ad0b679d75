/* hal/modbus/listener.h - the answer to a request among what is heard on a serial
 * line.
 *
 * Adapters that switch direction, cables and drives put bytes on a line that are
 * of no frame, before an answer and behind it, and some adapters hear what they
 * send.  The answer to a request is known by its unit, function, length and check,
 * wherever it stands:
 *
 *   stray bytes, 7 at most | the request itself | answer | whatever follows
 *
 * Eight bytes (of ASCII 17) may be the question of another master, whose answer might look like
 * ours, so nothing behind them is believed.  Where the answer may be the same bytes
 * as the request (functions 5, 6 and 16h, and by chance a read of bits) the first
 * of two is the echo on a line that has one, and the only one on another. */
#ifndef HAL_MODBUS_LISTENER_H
#define HAL_MODBUS_LISTENER_H

#include "hal/modbus/serial.h"

#define MODBUS_STRAYS_MAX       7 /* before an answer */
#define MODBUS_ASCII_STRAYS_MAX 16

/* Visible so that it can be static; use the functions. */
struct modbus_listener {
    const struct hal_modbus_request *request; /* outlives the listener's use */
    bool is_ascii;
    uint8_t sent[MODBUS_FRAME_MAX];
    unsigned sent_length;
    bool expects_echo, is_twin; /* its answer may be the same bytes */
    /* Heard, and not yet judged. */
    uint8_t byte[2 * MODBUS_FRAME_MAX];
    unsigned length;
    bool is_disturbed;       /* by bytes that came before it had gone out */
    unsigned strays, echoes; /* so far, those behind the answer left out */
};

/* A request goes out as these bytes. */
void modbus_listener_begin(struct modbus_listener *self, bool is_ascii,
                           const struct hal_modbus_request *request,
                           const uint8_t *frame, unsigned length,
                           bool expects_echo);
/* It has gone out whole.  Nothing that was heard until then answers it: what is not
 * its echo is of somebody else, or an answer to a request of before, and no answer
 * is believed after that. */
void modbus_listener_sent(struct modbus_listener *self);
void modbus_listener_take(struct modbus_listener *self, const uint8_t *bytes,
                          unsigned length);
/* Is the answer there?  Its bytes, and *reply as modbus_pdu_take_answer has it;
 * what was heard behind it is left in `length`.  0: not yet, or with `is_last` not
 * at all: then *reply says MOTION_E_PROTOCOL where anything but an echo was heard,
 * else MOTION_E_TIMEOUT. */
unsigned modbus_listener_find(struct modbus_listener *self, bool is_last,
                              struct hal_modbus_reply *reply);

/* ---- whether a line has an echo ---- */

/* Found by what is heard of requests that no answer looks like. */
struct modbus_echo {
    bool is_known; /* said in the configuration */
    bool is_heard; /* with the last such request */
};

static inline bool modbus_echo_expects(const struct modbus_echo *echo)
{
    return echo->is_known || echo->is_heard;
}

/* A transaction had an answer. */
static inline void modbus_echo_note(struct modbus_echo *echo,
                                    const struct modbus_listener *listener)
{
    if (!listener->is_twin)
        echo->is_heard = listener->echoes > 0;
}

#endif
