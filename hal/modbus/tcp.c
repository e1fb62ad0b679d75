/* hal/modbus/tcp.c - see tcp.h. */
#include "hal/modbus/tcp.h"

#define LENGTH_AT 4 /* counts from the unit on, which is at */
#define UNIT_AT   6

unsigned modbus_tcp_whole(const uint8_t *bytes, unsigned length)
{
    unsigned whole;

    if (length < UNIT_AT)
        return 0;
    whole = UNIT_AT + (unsigned)modbus_pdu_get(bytes + LENGTH_AT);
    if (modbus_pdu_get(bytes + 2) != 0 || whole <= MODBUS_TCP_HEAD)
        return MODBUS_TCP_FRAME_MAX + 1;
    return whole;
}

unsigned modbus_tcp_seal(uint8_t frame[MODBUS_TCP_FRAME_MAX],
                         uint16_t transaction, uint8_t unit,
                         unsigned pdu_length)
{
    modbus_pdu_set(frame, transaction);
    modbus_pdu_set(frame + 2, 0);
    modbus_pdu_set(frame + LENGTH_AT, (uint16_t)(1 + pdu_length));
    frame[UNIT_AT] = unit;
    return MODBUS_TCP_HEAD + pdu_length;
}

int modbus_tcp_put_request(const struct hal_modbus_request *request,
                           uint16_t transaction,
                           uint8_t frame[MODBUS_TCP_FRAME_MAX])
{
    const int length = modbus_pdu_put_request(request, frame + MODBUS_TCP_HEAD);

    if (length < 0)
        return length;
    return (int)modbus_tcp_seal(frame, transaction, request->unit,
                                (unsigned)length);
}

void modbus_tcp_take_answer(const struct hal_modbus_request *request,
                            uint16_t transaction, const uint8_t *frame,
                            unsigned length, struct hal_modbus_reply *reply)
{
    reply->err = MOTION_E_PROTOCOL;
    reply->exception = 0;
    reply->count = 0;
    if (length <= MODBUS_TCP_HEAD ||
        modbus_tcp_whole(frame, length) != length ||
        modbus_pdu_get(frame) != transaction || frame[UNIT_AT] != request->unit)
        return;
    modbus_pdu_take_answer(request, frame + MODBUS_TCP_HEAD,
                           length - MODBUS_TCP_HEAD, reply);
}

static void modbus_tcp_drop(struct modbus_tcp_stream *stream, unsigned count)
{
    stream->length -= count;
    for (unsigned i = 0; i < stream->length; i++)
        stream->byte[i] = stream->byte[i + count];
}

bool modbus_tcp_find(struct modbus_tcp_stream *stream,
                     const struct hal_modbus_request *request,
                     uint16_t transaction, struct hal_modbus_reply *reply)
{
    unsigned whole;

    while ((whole = modbus_tcp_whole(stream->byte, stream->length)) != 0 &&
           (whole <= stream->length || whole > MODBUS_TCP_FRAME_MAX)) {
        const bool is_frame = whole <= MODBUS_TCP_FRAME_MAX;
        const bool is_ours =
            is_frame && modbus_pdu_get(stream->byte) == transaction;

        if (is_ours)
            modbus_tcp_take_answer(request, transaction, stream->byte, whole,
                                   reply);
        else if (is_frame)
            stream->late++;
        else
            stream->strays++;
        modbus_tcp_drop(stream, is_frame ? whole : 1);
        if (is_ours)
            return true;
    }
    return false;
}
