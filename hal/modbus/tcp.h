/* hal/modbus/tcp.h - Modbus TCP frames: transaction number, protocol 0, length
 * and unit in front of a PDU.
 *
 * Source: MODBUS Messaging on TCP/IP Implementation Guide V1.0b, 3.1. */
#ifndef HAL_MODBUS_TCP_H
#define HAL_MODBUS_TCP_H

#include "hal/modbus/pdu.h"

#define MODBUS_TCP_HEAD      7
#define MODBUS_TCP_FRAME_MAX (MODBUS_TCP_HEAD + MODBUS_PDU_MAX)

/* Bytes of the whole frame that begins with these; 0: too few to say; above
 * MODBUS_TCP_FRAME_MAX: no frame begins so. */
unsigned modbus_tcp_whole(const uint8_t *bytes, unsigned length);

/* Put the head before the PDU that stands at frame + MODBUS_TCP_HEAD.  Bytes of
 * the frame. */
unsigned modbus_tcp_seal(uint8_t frame[MODBUS_TCP_FRAME_MAX],
                         uint16_t transaction, uint8_t unit,
                         unsigned pdu_length);

/* Bytes of the request's frame, or MOTION_E_ARG. */
int modbus_tcp_put_request(const struct hal_modbus_request *request,
                           uint16_t transaction,
                           uint8_t frame[MODBUS_TCP_FRAME_MAX]);
/* Bytes that a connection has brought and that are not yet judged.  Its frames are whole by
 * their own length, so the answer to a request of before is known and dropped; where
 * no frame can begin, bytes are left out until one does. */
struct modbus_tcp_stream {
    uint8_t byte[2 * MODBUS_TCP_FRAME_MAX];
    unsigned length;
    unsigned strays,
        late; /* bytes, answers; the owner counts and clears them */
};

/* Return where the next bytes go, and how many there may be. */
static inline uint8_t *modbus_tcp_room(struct modbus_tcp_stream *stream,
                                       unsigned *room)
{
    *room = (unsigned)sizeof stream->byte - stream->length;
    return stream->byte + stream->length;
}
/* Is the answer there?  Then *reply is as modbus_tcp_take_answer has it: a frame
 * of this transaction that is no answer to it is MOTION_E_PROTOCOL.  Leaves room
 * for more. */
bool modbus_tcp_find(struct modbus_tcp_stream *stream,
                     const struct hal_modbus_request *request,
                     uint16_t transaction, struct hal_modbus_reply *reply);

/* As modbus_pdu_take_answer, the head looked at too. */
void modbus_tcp_take_answer(const struct hal_modbus_request *request,
                            uint16_t transaction, const uint8_t *frame,
                            unsigned length, struct hal_modbus_reply *reply);

#endif
