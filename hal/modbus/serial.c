/* hal/modbus/serial.c - see serial.h. */
#include "hal/modbus/serial.h"

#include <stddef.h>

#define AROUND 3 /* colon, CR, LF; of RTU unit and CRC */

static uint8_t serial_digit(unsigned value)
{
    return (uint8_t)(value < 10 ? '0' + value : 'A' - 10 + value);
}

/* 16: it is none. */
static unsigned serial_value(uint8_t digit)
{
    if (digit >= '0' && digit <= '9')
        return (unsigned)(digit - '0');
    return digit >= 'A' && digit <= 'F' ? (unsigned)(digit - 'A' + 10) : 16;
}

/* Write the digits from the last byte on, as each byte takes the room of two. */
static unsigned serial_seal_ascii(uint8_t *frame, uint8_t unit,
                                  unsigned pdu_length)
{
    const unsigned length = pdu_length + 2;
    uint8_t sum = 0;

    frame[0] = unit;
    for (unsigned i = 0; i <= pdu_length; i++)
        sum = (uint8_t)(sum + frame[i]);
    frame[pdu_length + 1] = (uint8_t)-sum;
    for (size_t i = length; i-- > 0;) {
        const uint8_t byte = frame[i];

        frame[1 + 2 * i] = serial_digit(byte >> 4);
        frame[2 + 2 * i] = serial_digit(byte & 15);
    }
    frame[0] = ':';
    frame[1 + 2 * length] = '\r';
    frame[2 + 2 * length] = '\n';
    return 2 * length + AROUND;
}

unsigned modbus_serial_seal(bool is_ascii, uint8_t frame[MODBUS_FRAME_MAX],
                            uint8_t unit, unsigned pdu_length)
{
    return is_ascii ? serial_seal_ascii(frame, unit, pdu_length)
                    : modbus_rtu_seal(frame, unit, pdu_length);
}

static unsigned serial_open_ascii(const uint8_t *frame, unsigned length,
                                  uint8_t bytes[MODBUS_RTU_FRAME_MAX])
{
    const unsigned count = length > AROUND ? (length - AROUND) / 2 : 0;
    uint8_t sum = 0;

    if (count < 3 || length > MODBUS_ASCII_FRAME_MAX || length % 2 == 0 ||
        frame[0] != ':' || frame[length - 2] != '\r' ||
        frame[length - 1] != '\n')
        return 0;
    for (size_t i = 0; i < count; i++) {
        const unsigned high = serial_value(frame[1 + 2 * i]);
        const unsigned low = serial_value(frame[2 + 2 * i]);

        if (high > 15 || low > 15)
            return 0;
        bytes[i] = (uint8_t)(high << 4 | low);
        sum = (uint8_t)(sum + bytes[i]);
    }
    return sum == 0 ? count - 1 : 0;
}

unsigned modbus_serial_open(bool is_ascii, const uint8_t *frame,
                            unsigned length,
                            uint8_t bytes[MODBUS_RTU_FRAME_MAX])
{
    if (is_ascii)
        return serial_open_ascii(frame, length, bytes);
    if (!modbus_rtu_is_sealed(frame, length))
        return 0;
    for (unsigned i = 0; i < length - 2; i++)
        bytes[i] = frame[i];
    return length - 2;
}

int modbus_serial_put_request(bool is_ascii,
                              const struct hal_modbus_request *request,
                              uint8_t frame[MODBUS_FRAME_MAX])
{
    const int length = modbus_pdu_put_request(request, frame + 1);

    if (length < 0)
        return length;
    return (int)modbus_serial_seal(is_ascii, frame, request->unit,
                                   (unsigned)length);
}

unsigned modbus_ascii_whole(const uint8_t *bytes, unsigned length, bool *is_cut)
{
    *is_cut = length > 0 && bytes[0] != ':';
    for (unsigned i = 1; i < length && !*is_cut; i++) {
        *is_cut = bytes[i] == ':' || i >= MODBUS_ASCII_FRAME_MAX;
        if (bytes[i] == '\n' && bytes[i - 1] == '\r' && !*is_cut)
            return i + 1;
    }
    return 0;
}
