/* hal/modbus/listener.c - see listener.h. */
#include "hal/modbus/listener.h"

#include <stddef.h>

#define AROUND 3 /* unit and CRC */

/* The kinds of things at the beginning of what was heard. */
enum listener_thing {
    LISTENER_STRAY,
    LISTENER_ECHO,
    LISTENER_ANSWER,
    LISTENER_MORE, /* it may become one of these */
};

/* Judge a frame as an answer to the request; MOTION_E_PROTOCOL: it is none. */
static void listener_judge(const struct modbus_listener *self,
                           const uint8_t *frame, unsigned length,
                           struct hal_modbus_reply *reply)
{
    uint8_t bytes[MODBUS_RTU_FRAME_MAX];
    const unsigned count =
        modbus_serial_open(self->is_ascii, frame, length, bytes);

    reply->err = MOTION_E_PROTOCOL;
    if (count > 1 && bytes[0] == self->request->unit)
        modbus_pdu_take_answer(self->request, bytes + 1, count - 1, reply);
}

/* Would a device's answer be the request? */
static bool listener_is_twin(const struct modbus_listener *self)
{
    struct hal_modbus_reply reply = { 0 };

    listener_judge(self, self->sent, self->sent_length, &reply);
    return reply.err == MOTION_OK;
}

void modbus_listener_begin(struct modbus_listener *self, bool is_ascii,
                           const struct hal_modbus_request *request,
                           const uint8_t *frame, unsigned length,
                           bool expects_echo)
{
    self->is_ascii = is_ascii;
    self->request = request;
    for (unsigned i = 0; i < length; i++)
        self->sent[i] = frame[i];
    self->sent_length = length;
    self->expects_echo = expects_echo;
    self->is_twin = listener_is_twin(self);
    self->length = self->strays = self->echoes = 0;
    self->is_disturbed = false;
}

/* Count what finds no room as stray: it is more than a frame with its echo. */
void modbus_listener_take(struct modbus_listener *self, const uint8_t *bytes,
                          unsigned length)
{
    for (unsigned i = 0; i < length; i++) {
        if (self->length == sizeof self->byte) {
            self->strays += length - i;
            return;
        }
        self->byte[self->length++] = bytes[i];
    }
}

static void listener_drop(struct modbus_listener *self, unsigned count)
{
    self->length -= count;
    for (unsigned i = 0; i < self->length; i++)
        self->byte[i] = self->byte[i + count];
}

/* The request, as far as it was heard from `at` on. */
static bool listener_repeats(const struct modbus_listener *self, unsigned at)
{
    for (unsigned i = 0; at + i < self->length && i < self->sent_length; i++)
        if (self->byte[at + i] != self->sent[i])
            return false;
    return true;
}

void modbus_listener_sent(struct modbus_listener *self)
{
    while (self->length >= self->sent_length && listener_repeats(self, 0)) {
        self->echoes++;
        listener_drop(self, self->sent_length);
    }
    if (listener_repeats(self, 0))
        return;
    self->is_disturbed = true;
    self->strays += self->length;
    self->length = 0;
}

/* Bytes of the frame that an answer which begins so has; 0: too few to say; more
 * than a frame: none begins so. */
static unsigned listener_whole_rtu(const struct modbus_listener *self,
                                   unsigned at, bool is_last)
{
    const unsigned length = self->length - at;
    const unsigned pdu =
        length < 2 ? 0
                   : modbus_pdu_answer_whole(self->request, self->byte + at + 1,
                                             length - 1);

    if (self->byte[at] != self->request->unit)
        return MODBUS_FRAME_MAX + 1;
    if (pdu == 0) /* of one that does not say it: all that came */
        return is_last ? length : 0;
    return pdu > MODBUS_PDU_MAX ? MODBUS_FRAME_MAX + 1 : pdu + AROUND;
}

static unsigned listener_whole(const struct modbus_listener *self, unsigned at,
                               bool is_last)
{
    bool is_cut;

    if (!self->is_ascii)
        return listener_whole_rtu(self, at, is_last);
    const unsigned whole =
        modbus_ascii_whole(self->byte + at, self->length - at, &is_cut);
    return is_cut || (whole == 0 && is_last) ? MODBUS_FRAME_MAX + 1 : whole;
}

static enum listener_thing listener_look(const struct modbus_listener *self,
                                         unsigned at, bool is_last,
                                         unsigned *used,
                                         struct hal_modbus_reply *reply)
{
    const unsigned length = self->length - at;
    const unsigned whole = listener_whole(self, at, is_last);
    const bool repeats = listener_repeats(self, at);
    const bool is_echo = repeats && length >= self->sent_length;

    *used = self->sent_length;
    if (is_echo &&
        (!self->is_twin || (self->expects_echo && self->echoes == 0)))
        return LISTENER_ECHO;
    if (whole > 0 && whole <= length) {
        *used = whole;
        listener_judge(self, self->byte + at, whole, reply);
        if (reply->err != MOTION_E_PROTOCOL)
            return LISTENER_ANSWER;
    }
    if (!is_last && ((repeats && !is_echo) || whole == 0 ||
                     (whole <= MODBUS_FRAME_MAX && whole > length)))
        return LISTENER_MORE;
    return LISTENER_STRAY;
}

static bool listener_believes(const struct modbus_listener *self, unsigned at)
{
    const unsigned most =
        self->is_ascii ? MODBUS_ASCII_STRAYS_MAX : MODBUS_STRAYS_MAX;

    return at < self->length && !self->is_disturbed &&
           self->strays + at <= most;
}

/* Stray bytes may look like the beginning of something longer than what is there
 * behind them, so a frame that is whole is looked for first. */
static enum listener_thing listener_next(struct modbus_listener *self,
                                         bool is_last, unsigned *used,
                                         struct hal_modbus_reply *reply)
{
    for (unsigned at = 0; listener_believes(self, at); at++) {
        const enum listener_thing thing =
            listener_look(self, at, is_last, used, reply);

        if (thing == LISTENER_ANSWER || thing == LISTENER_ECHO) {
            self->strays += at;
            listener_drop(self, at + *used);
            return thing;
        }
    }
    return LISTENER_STRAY;
}

/* No frame begins with them. */
static void listener_skip(struct modbus_listener *self, bool is_last)
{
    struct hal_modbus_reply nobodys;
    unsigned used;

    while (listener_believes(self, 0) &&
           listener_look(self, 0, is_last, &used, &nobodys) == LISTENER_STRAY) {
        self->strays++;
        listener_drop(self, 1);
    }
    if (listener_believes(self, 0))
        return;
    self->strays += self->length;
    self->length = 0;
}

unsigned modbus_listener_find(struct modbus_listener *self, bool is_last,
                              struct hal_modbus_reply *reply)
{
    enum listener_thing thing;
    unsigned used;

    while ((thing = listener_next(self, is_last, &used, reply)) ==
           LISTENER_ECHO)
        self->echoes++;
    if (thing == LISTENER_ANSWER)
        return used;
    listener_skip(self, is_last);
    reply->err = self->strays > 0 ? MOTION_E_PROTOCOL : MOTION_E_TIMEOUT;
    reply->exception = 0;
    reply->count = 0;
    return 0;
}
