/* hal/modbus/rtu.c - see rtu.h. */
#include "hal/modbus/rtu.h"

#define NS_PER_S       INT64_C(1000000000)
#define FAST_BAUD      19200 /* above: the silence is fixed */
#define FAST_GAP_NS    INT64_C(1750000)
#define AROUND         3 /* unit and CRC */
#define CRC_POLYNOMIAL 0xA001

unsigned modbus_rtu_data_bits(const struct modbus_rtu_line *line)
{
    if (line->data_bits != 0)
        return line->data_bits;
    return line->is_ascii ? 7 : 8;
}

/* 9 .. 12. */
static unsigned modbus_rtu_char_bits(const struct modbus_rtu_line *line)
{
    return 1u + modbus_rtu_data_bits(line) +
           (line->parity == MODBUS_PARITY_NONE ? 0 : 1) + line->stop_bits;
}

int modbus_rtu_time_init(struct modbus_rtu_time *time,
                         const struct modbus_rtu_line *line)
{
    int64_t bit_ns_q12;

    if (line->baud < MODBUS_RTU_BAUD_MIN || line->baud > MODBUS_RTU_BAUD_MAX ||
        line->parity > MODBUS_PARITY_NONE || line->stop_bits < 1 ||
        line->stop_bits > 2 || line->gap_ns < 0 || line->gap_ns > NS_PER_S ||
        (modbus_rtu_data_bits(line) != 8 &&
         (modbus_rtu_data_bits(line) != 7 || !line->is_ascii)))
        return MOTION_E_ARG;
    bit_ns_q12 = modbus_rtu_char_bits(line) * NS_PER_S * 4096; /* < 2^46 */
    time->char_ns_q12 = (bit_ns_q12 + line->baud - 1) / line->baud;
    time->gap_ns = line->gap_ns;
    time->is_ascii = line->is_ascii;
    if (line->gap_ns == 0 && line->is_ascii)
        time->gap_ns = modbus_rtu_chars_ns(time, 1);
    else if (line->gap_ns == 0 && line->baud > FAST_BAUD)
        time->gap_ns = FAST_GAP_NS;
    else if (line->gap_ns == 0)
        time->gap_ns = (7 * time->char_ns_q12 + 8191) >> 13;
    return MOTION_OK;
}

int64_t modbus_rtu_chars_ns(const struct modbus_rtu_time *time, unsigned n)
{
    return (n * time->char_ns_q12 + 4095) >> 12;
}

unsigned modbus_rtu_frame_chars(const struct modbus_rtu_time *time,
                                unsigned pdu_length)
{
    return time->is_ascii ? 2 * (pdu_length + 2) + 3 : pdu_length + AROUND;
}

int64_t modbus_rtu_transaction_ns(const struct modbus_rtu_time *time,
                                  const struct hal_modbus_request *request)
{
    uint8_t pdu[MODBUS_PDU_MAX];
    const int length = modbus_pdu_put_request(request, pdu);
    int64_t dur_ns;

    if (length < 0)
        return 0;
    dur_ns = modbus_rtu_chars_ns(
                 time, modbus_rtu_frame_chars(time, (unsigned)length)) +
             time->gap_ns;
    if (request->unit == HAL_MODBUS_BROADCAST)
        return dur_ns;
    return dur_ns + time->gap_ns +
           modbus_rtu_chars_ns(
               time,
               modbus_rtu_frame_chars(time, modbus_pdu_answer_length(request)));
}

static uint16_t modbus_rtu_crc(const uint8_t *bytes, unsigned length)
{
    uint16_t crc = 0xFFFF;

    for (unsigned i = 0; i < length; i++) {
        crc ^= bytes[i];
        for (unsigned bit = 0; bit < 8; bit++)
            crc =
                (uint16_t)((crc >> 1) ^ ((crc & 1) != 0 ? CRC_POLYNOMIAL : 0));
    }
    return crc;
}

unsigned modbus_rtu_seal(uint8_t frame[MODBUS_RTU_FRAME_MAX], uint8_t unit,
                         unsigned pdu_length)
{
    uint16_t crc;

    frame[0] = unit;
    crc = modbus_rtu_crc(frame, 1 + pdu_length);
    frame[1 + pdu_length] = (uint8_t)crc; /* lower byte first, this once */
    frame[2 + pdu_length] = (uint8_t)(crc >> 8);
    return pdu_length + AROUND;
}

bool modbus_rtu_is_sealed(const uint8_t *frame, unsigned length)
{
    return length > AROUND && length <= MODBUS_RTU_FRAME_MAX &&
           modbus_rtu_crc(frame, length - 2) ==
               (uint16_t)(frame[length - 2] | frame[length - 1] << 8);
}
