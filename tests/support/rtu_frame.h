/* tests/support/rtu_frame.h - whole frames of Modbus RTU: a request, and what an answer
 * to it says. */
#ifndef TESTS_SUPPORT_RTU_FRAME_H
#define TESTS_SUPPORT_RTU_FRAME_H

#include "hal/modbus/pdu.h"
#include "hal/modbus/rtu.h"
#include "motion/core/err.h"

/* Bytes of the request's frame, or MOTION_E_ARG. */
static inline int
rtu_frame_put_request(const struct hal_modbus_request *request,
                      uint8_t frame[MODBUS_RTU_FRAME_MAX])
{
    const int length = modbus_pdu_put_request(request, frame + 1);
    return length < 0
               ? length
               : (int)modbus_rtu_seal(frame, request->unit, (unsigned)length);
}

/* Take an answer like modbus_pdu_take_answer, and look at its unit and CRC too. */
static inline void
rtu_frame_take_answer(const struct hal_modbus_request *request,
                      const uint8_t *frame, unsigned length,
                      struct hal_modbus_reply *reply)
{
    *reply = (struct hal_modbus_reply){ .err = MOTION_E_PROTOCOL };
    if (modbus_rtu_is_sealed(frame, length) && frame[0] == request->unit)
        modbus_pdu_take_answer(request, frame + 1, length - 3, reply);
}

#endif
