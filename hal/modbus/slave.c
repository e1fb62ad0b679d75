/* hal/modbus/slave.c - see slave.h. */
#include "hal/modbus/slave.h"

#define ILLEGAL_FUNCTION 0x01

static uint8_t modbus_slave_read(struct modbus_slave *slave,
                                 const struct hal_modbus_request *request,
                                 uint16_t *value)
{
    enum modbus_space space = MODBUS_HOLDING;

    if (request->function == HAL_MODBUS_READ_INPUT)
        space = MODBUS_INPUT;
    else if (request->function == HAL_MODBUS_READ_COILS)
        space = MODBUS_COILS;
    else if (request->function == HAL_MODBUS_READ_DISCRETE)
        space = MODBUS_DISCRETE;
    return slave->ops->get(slave, space, request->address, request->count,
                           value);
}

static uint8_t modbus_slave_write(struct modbus_slave *slave,
                                  const struct hal_modbus_request *request)
{
    const bool coils = request->function == HAL_MODBUS_WRITE_COIL ||
                       request->function == HAL_MODBUS_WRITE_COILS;

    return slave->ops->set(slave, coils ? MODBUS_COILS : MODBUS_HOLDING,
                           request->address, request->count, request->value);
}

static uint8_t modbus_slave_mask(struct modbus_slave *slave,
                                 const struct hal_modbus_request *request)
{
    const uint16_t and_mask = request->value[0];
    const uint16_t or_mask = request->value[1];
    uint16_t value;
    const uint8_t exception =
        slave->ops->get(slave, MODBUS_HOLDING, request->address, 1, &value);

    if (exception != 0)
        return exception;
    value = (uint16_t)((value & and_mask) | (or_mask & ~and_mask));
    return slave->ops->set(slave, MODBUS_HOLDING, request->address, 1, &value);
}

static uint8_t modbus_slave_write_read(struct modbus_slave *slave,
                                       const struct hal_modbus_request *request,
                                       uint16_t *value)
{
    const uint8_t exception =
        slave->ops->set(slave, MODBUS_HOLDING, request->write_address,
                        request->write_count, request->value);

    return exception != 0 ? exception
                          : modbus_slave_read(slave, request, value);
}

static uint8_t modbus_slave_do(struct modbus_slave *slave,
                               const struct hal_modbus_request *request,
                               uint16_t *value)
{
    switch (request->function) {
    case HAL_MODBUS_READ_COILS:
    case HAL_MODBUS_READ_DISCRETE:
    case HAL_MODBUS_READ:
    case HAL_MODBUS_READ_INPUT:
        return modbus_slave_read(slave, request, value);
    case HAL_MODBUS_MASK:
        return modbus_slave_mask(slave, request);
    case HAL_MODBUS_WRITE_READ:
        return modbus_slave_write_read(slave, request, value);
    default:
        return modbus_slave_write(slave, request);
    }
}

static bool modbus_slave_has(const struct modbus_slave *slave,
                             unsigned function)
{
    return slave->functions == 0 ||
           (function < 32 && (slave->functions >> function & 1) != 0);
}

unsigned modbus_slave_serve(struct modbus_slave *slave, const uint8_t *pdu,
                            unsigned length, uint8_t answer[MODBUS_PDU_MAX])
{
    struct hal_modbus_request request;
    uint16_t value[HAL_MODBUS_READ_MAX];
    uint8_t exception = modbus_pdu_take_request(pdu, length, &request);

    if (exception == 0 && !modbus_slave_has(slave, request.function))
        exception = ILLEGAL_FUNCTION;
    if (exception == 0)
        exception = modbus_slave_do(slave, &request, value);
    if (exception != 0)
        return modbus_pdu_put_exception(length > 0 ? pdu[0] : 0, exception,
                                        answer);
    return modbus_pdu_put_answer(&request, value, answer);
}
