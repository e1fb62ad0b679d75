/* hal/modbus/pdu.h - what a Modbus frame carries, without address and check:
 * function code and data, both ways.
 *
 * Shared by RTU and TCP, masters and slaves.  Every decoder takes any bytes:
 * it answers whether they are exactly what they should be, length included.
 *
 * Source: MODBUS Application Protocol Specification V1.1b3, 6. */
#ifndef HAL_MODBUS_PDU_H
#define HAL_MODBUS_PDU_H

#include <stdbool.h>

#include "hal/modbus.h"

#define MODBUS_PDU_MAX 253

/* Could a slave be asked this?  Function, counts and unit. */
bool modbus_pdu_is_request(const struct hal_modbus_request *request);

/* ---- the master's half ---- */

/* Bytes of the request, or MOTION_E_ARG. */
int modbus_pdu_put_request(const struct hal_modbus_request *request,
                           uint8_t pdu[MODBUS_PDU_MAX]);

/* Bytes of the answer to it when the slave does what was asked. */
unsigned modbus_pdu_answer_length(const struct hal_modbus_request *request);

/* Bytes of the answer to it that begins with these; 0: too few to say; above
 * MODBUS_PDU_MAX: none begins so. */
unsigned modbus_pdu_answer_whole(const struct hal_modbus_request *request,
                                 const uint8_t *pdu, unsigned length);

/* Fill in err, exception, count and value of *reply.  MOTION_E_PROTOCOL for
 * whatever is not an answer to this request: another function, another length,
 * an echo that differs. */
void modbus_pdu_take_answer(const struct hal_modbus_request *request,
                            const uint8_t *pdu, unsigned length,
                            struct hal_modbus_reply *reply);

/* ---- the slave's half ---- */

/* 0, or the exception code to answer with; *request has no unit. */
uint8_t modbus_pdu_take_request(const uint8_t *pdu, unsigned length,
                                struct hal_modbus_request *request);

/* Bytes of the answer; `value` is what was read, NULL when nothing is. */
unsigned modbus_pdu_put_answer(const struct hal_modbus_request *request,
                               const uint16_t *value,
                               uint8_t pdu[MODBUS_PDU_MAX]);
unsigned modbus_pdu_put_exception(uint8_t function, uint8_t exception,
                                  uint8_t pdu[MODBUS_PDU_MAX]);

/* Registers, upper byte first. */
static inline uint16_t modbus_pdu_get(const uint8_t *at)
{
    return (uint16_t)(at[0] << 8 | at[1]);
}

static inline void modbus_pdu_set(uint8_t *at, uint16_t value)
{
    at[0] = (uint8_t)(value >> 8);
    at[1] = (uint8_t)value;
}

#endif
