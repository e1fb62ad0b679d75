/* hal/modbus/rtu.h - Modbus RTU frames and their time on the wire.
 *
 * A frame is unit, PDU and CRC; silence of 3.5 characters ends it.  A character
 * is a start bit, 8 data bits, parity and stop bits.  Above 19200 bit/s the
 * standard fixes the silence at 1.75 ms, so that faster lines stop helping
 * unless a shorter one is agreed on.  Of the other framing, ASCII (serial.h), a
 * character has 7 data bits, and one character of silence is kept, in which a device
 * turns round.
 *
 * Source: MODBUS over Serial Line V1.02, 2.5.1 and 6.2. */
#ifndef HAL_MODBUS_RTU_H
#define HAL_MODBUS_RTU_H

#include "hal/modbus/pdu.h"

#define MODBUS_RTU_FRAME_MAX 256
#define MODBUS_FRAME_MAX     513 /* of ASCII too: serial.h */
#define MODBUS_RTU_BAUD_MIN  1200
#define MODBUS_RTU_BAUD_MAX  4000000

enum modbus_parity {
    MODBUS_PARITY_EVEN, /* what the standard asks for */
    MODBUS_PARITY_ODD,
    MODBUS_PARITY_NONE,
};

struct modbus_rtu_line {
    uint32_t baud; /* bit/s, MODBUS_RTU_BAUD_MIN .. _MAX */
    enum modbus_parity parity;
    uint8_t stop_bits; /* 1 or 2 */
    bool is_ascii;     /* framing; else RTU */
    uint8_t data_bits; /* 7 of ASCII, or 8; 0: 8, of ASCII 7 */
    int64_t gap_ns;    /* silence between frames; 0: the standard's */
};

/* What is made of a line once, so that later nobody divides. */
struct modbus_rtu_time {
    int64_t char_ns_q12; /* rounded up */
    bool is_ascii;
    int64_t gap_ns;
};

/* MOTION_E_ARG for a line outside its ranges. */
int modbus_rtu_time_init(struct modbus_rtu_time *time,
                         const struct modbus_rtu_line *line);
/* Data bits of its characters. */
unsigned modbus_rtu_data_bits(const struct modbus_rtu_line *line);
/* Characters of the frame around a PDU. */
unsigned modbus_rtu_frame_chars(const struct modbus_rtu_time *time,
                                unsigned pdu_length);
/* n <= 10000 characters, rounded up. */
int64_t modbus_rtu_chars_ns(const struct modbus_rtu_time *time, unsigned n);
/* Request, silence, answer, silence: the least a transaction takes.  A
 * broadcast has no answer. */
int64_t modbus_rtu_transaction_ns(const struct modbus_rtu_time *time,
                                  const struct hal_modbus_request *request);

/* Put unit and CRC around the PDU that stands at frame + 1.  Bytes of the
 * frame. */
unsigned modbus_rtu_seal(uint8_t frame[MODBUS_RTU_FRAME_MAX], uint8_t unit,
                         unsigned pdu_length);
/* Long enough and with the right CRC? */
bool modbus_rtu_is_sealed(const uint8_t *frame, unsigned length);

#endif
