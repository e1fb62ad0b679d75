/* hal/modbus/serial.h - frames of a serial line, RTU or ASCII.
 *
 * Of ASCII a frame is a colon, unit, PDU and check as two hexadecimal digits a byte,
 * CR and LF; the check (LRC) makes the sum of all bytes 0.  No silence ends it, and a
 * colon begins a new one.
 *
 * Source: MODBUS over Serial Line V1.02, 2.5.2. */
#ifndef HAL_MODBUS_SERIAL_H
#define HAL_MODBUS_SERIAL_H

#include "hal/modbus/rtu.h"

#define MODBUS_ASCII_FRAME_MAX 513

/* Put the PDU that stands at frame + 1 into a frame.  Its bytes. */
unsigned modbus_serial_seal(bool is_ascii, uint8_t frame[MODBUS_FRAME_MAX],
                            uint8_t unit, unsigned pdu_length);
/* Bytes of unit and PDU of a frame that is sound; 0: it is not. */
unsigned modbus_serial_open(bool is_ascii, const uint8_t *frame,
                            unsigned length,
                            uint8_t bytes[MODBUS_RTU_FRAME_MAX]);
/* Bytes of the request's frame, or MOTION_E_ARG. */
int modbus_serial_put_request(bool is_ascii,
                              const struct hal_modbus_request *request,
                              uint8_t frame[MODBUS_FRAME_MAX]);
/* Bytes of the ASCII frame that begins with these; 0: its end has not come, or there
 * will be none as another one begins (*is_cut). */
unsigned modbus_ascii_whole(const uint8_t *bytes, unsigned length,
                            bool *is_cut);

#endif
