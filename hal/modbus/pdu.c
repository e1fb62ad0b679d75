/* hal/modbus/pdu.c - see pdu.h.
 *
 * A request is a function code, its head of whole registers, and for the ones
 * that write several a byte count and data:
 *
 *   01 02     address, count: bits
 *   03 04     address, count
 *   05 06     address, value
 *   0F 10     address, count, bytes, data
 *   16        address, and, or
 *   17        address, count, write address, write count, bytes, data
 *   11        nothing
 *   2B        0E 01 00: the basic objects, from the first on
 *
 * Reads are answered with a byte count and data, everything else with the
 * first registers of its own head. */
#include "hal/modbus/pdu.h"

#include <stddef.h>

#define EXCEPTION_BIT    0x80
#define ILLEGAL_FUNCTION 0x01
#define ILLEGAL_VALUE    0x03
#define COIL_ON          0xFF00
#define WRITE_READ_MAX   121

static bool modbus_pdu_reads_bits(uint8_t function)
{
    return function == HAL_MODBUS_READ_COILS ||
           function == HAL_MODBUS_READ_DISCRETE;
}

static bool modbus_pdu_reads(uint8_t function)
{
    return modbus_pdu_reads_bits(function) || function == HAL_MODBUS_READ ||
           function == HAL_MODBUS_READ_INPUT ||
           function == HAL_MODBUS_WRITE_READ;
}

/* Answered with whatever the device has to say. */
static bool modbus_pdu_is_open(uint8_t function)
{
    return function == HAL_MODBUS_REPORT || function == HAL_MODBUS_IDENTIFY;
}

static bool modbus_pdu_in(uint16_t count, unsigned most)
{
    return count >= 1 && count <= most;
}

/* The last address there is is 0xFFFF. */
static bool modbus_pdu_fits(uint16_t address, uint16_t count)
{
    return (uint32_t)address + count <= 0x10000;
}

static bool modbus_pdu_counts_ok(const struct hal_modbus_request *request)
{
    switch (request->function) {
    case HAL_MODBUS_READ_COILS:
    case HAL_MODBUS_READ_DISCRETE:
        return modbus_pdu_in(request->count, HAL_MODBUS_BITS_READ);
    case HAL_MODBUS_READ:
    case HAL_MODBUS_READ_INPUT:
        return modbus_pdu_in(request->count, HAL_MODBUS_READ_MAX);
    case HAL_MODBUS_WRITE_COIL:
    case HAL_MODBUS_WRITE:
    case HAL_MODBUS_MASK:
        return request->count == 1;
    case HAL_MODBUS_WRITE_COILS:
        return modbus_pdu_in(request->count, HAL_MODBUS_BITS_MAX);
    case HAL_MODBUS_WRITE_MANY:
        return modbus_pdu_in(request->count, HAL_MODBUS_WRITE_MAX);
    case HAL_MODBUS_REPORT:
    case HAL_MODBUS_IDENTIFY:
        return request->count == 0;
    case HAL_MODBUS_WRITE_READ:
        return modbus_pdu_in(request->count, HAL_MODBUS_READ_MAX) &&
               modbus_pdu_in(request->write_count, WRITE_READ_MAX) &&
               modbus_pdu_fits(request->write_address, request->write_count);
    default:
        return false;
    }
}

bool modbus_pdu_is_request(const struct hal_modbus_request *request)
{
    if (!modbus_pdu_counts_ok(request) ||
        !modbus_pdu_fits(request->address, request->count))
        return false;
    if (request->unit == HAL_MODBUS_BROADCAST)
        return !modbus_pdu_reads(request->function) &&
               !modbus_pdu_is_open(request->function);
    return request->unit <= 247 || request->unit == 255;
}

/* ---- data: registers, or coils eight to a byte ---- */

static unsigned modbus_pdu_data_length(const struct hal_modbus_request *request)
{
    switch (request->function) {
    case HAL_MODBUS_WRITE_COILS:
        return (request->count + 7u) >> 3;
    case HAL_MODBUS_WRITE_MANY:
        return 2u * request->count;
    case HAL_MODBUS_WRITE_READ:
        return 2u * request->write_count;
    default:
        return 0;
    }
}

static void modbus_pdu_put_data(const struct hal_modbus_request *request,
                                uint8_t *at, unsigned length)
{
    at[0] = (uint8_t)length;
    for (unsigned i = 0; i < length; i++) {
        const uint16_t value = request->value[i >> 1];
        const bool coils = request->function == HAL_MODBUS_WRITE_COILS;
        const bool upper = coils == ((i & 1) != 0);

        at[1 + i] = (uint8_t)(upper ? value >> 8 : value);
    }
    /* coils that were not asked for are 0 */
    if (request->function == HAL_MODBUS_WRITE_COILS &&
        (request->count & 7) != 0)
        at[length] &= (uint8_t)((1u << (request->count & 7)) - 1);
}

static void modbus_pdu_take_data(struct hal_modbus_request *request,
                                 const uint8_t *at, unsigned length)
{
    const bool coils = request->function == HAL_MODBUS_WRITE_COILS;

    for (unsigned i = 0; i < length; i++) {
        const bool upper = coils == ((i & 1) != 0);
        uint16_t *value = &request->value[i >> 1];

        if ((i & 1) == 0)
            *value = 0;
        *value = (uint16_t)(*value | (upper ? at[i] << 8 : at[i]));
    }
}

/* ---- heads ---- */

/* Registers before the data; 0: no function of ours. */
static unsigned modbus_pdu_head_count(uint8_t function)
{
    switch (function) {
    case HAL_MODBUS_READ_COILS:
    case HAL_MODBUS_READ_DISCRETE:
    case HAL_MODBUS_READ:
    case HAL_MODBUS_READ_INPUT:
    case HAL_MODBUS_WRITE_COIL:
    case HAL_MODBUS_WRITE:
    case HAL_MODBUS_WRITE_COILS:
    case HAL_MODBUS_WRITE_MANY:
        return 2;
    case HAL_MODBUS_MASK:
        return 3;
    case HAL_MODBUS_WRITE_READ:
        return 4;
    default:
        return 0;
    }
}

static void modbus_pdu_head(const struct hal_modbus_request *request,
                            uint16_t head[4])
{
    head[0] = request->address;
    head[1] = request->count;
    head[2] = request->write_address;
    head[3] = request->write_count;
    if (request->function == HAL_MODBUS_WRITE_COIL)
        head[1] = request->value[0] != 0 ? COIL_ON : 0;
    if (request->function == HAL_MODBUS_WRITE ||
        request->function == HAL_MODBUS_MASK)
        head[1] = request->value[0];
    if (request->function == HAL_MODBUS_MASK)
        head[2] = request->value[1];
}

static unsigned modbus_pdu_put_head(const struct hal_modbus_request *request,
                                    unsigned count, uint8_t *pdu)
{
    uint16_t head[4];

    modbus_pdu_head(request, head);
    pdu[0] = request->function;
    for (size_t i = 0; i < count; i++)
        modbus_pdu_set(pdu + 1 + 2 * i, head[i]);
    return 1 + 2 * count;
}

/* false: 05 with a value that is neither on nor off. */
static bool modbus_pdu_take_head(struct hal_modbus_request *request,
                                 const uint16_t head[4])
{
    request->address = head[0];
    request->count = head[1];
    switch (request->function) {
    case HAL_MODBUS_WRITE_COIL:
        request->count = 1;
        request->value[0] = head[1] == COIL_ON;
        return head[1] == COIL_ON || head[1] == 0;
    case HAL_MODBUS_WRITE:
    case HAL_MODBUS_MASK:
        request->count = 1;
        request->value[0] = head[1];
        request->value[1] = head[2];
        return true;
    case HAL_MODBUS_WRITE_READ:
        request->write_address = head[2];
        request->write_count = head[3];
        return true;
    default:
        return true;
    }
}

/* ---- requests ---- */

static int modbus_pdu_put_open(uint8_t function, uint8_t *pdu)
{
    pdu[0] = function;
    if (function == HAL_MODBUS_REPORT)
        return 1;
    pdu[1] = 0x0E;
    pdu[2] = 0x01;
    pdu[3] = 0x00;
    return 4;
}

int modbus_pdu_put_request(const struct hal_modbus_request *request,
                           uint8_t pdu[MODBUS_PDU_MAX])
{
    unsigned length, data;

    if (!modbus_pdu_is_request(request))
        return MOTION_E_ARG;
    if (modbus_pdu_is_open(request->function))
        return modbus_pdu_put_open(request->function, pdu);
    length = modbus_pdu_put_head(request,
                                 modbus_pdu_head_count(request->function), pdu);
    data = modbus_pdu_data_length(request);
    if (data == 0)
        return (int)length;
    modbus_pdu_put_data(request, pdu + length, data);
    return (int)(length + 1 + data);
}

uint8_t modbus_pdu_take_request(const uint8_t *pdu, unsigned length,
                                struct hal_modbus_request *request)
{
    unsigned head_count, head_length, data;
    uint16_t head[4] = { 0 };

    *request = (struct hal_modbus_request){ .unit = 1 };
    if (length < 1)
        return ILLEGAL_FUNCTION;
    request->function = pdu[0];
    head_count = modbus_pdu_head_count(request->function);
    head_length = 1 + 2 * head_count;
    if (head_count == 0)
        return ILLEGAL_FUNCTION;
    if (length < head_length)
        return ILLEGAL_VALUE;
    for (size_t i = 0; i < head_count; i++)
        head[i] = modbus_pdu_get(pdu + 1 + 2 * i);
    if (!modbus_pdu_take_head(request, head) || !modbus_pdu_counts_ok(request))
        return ILLEGAL_VALUE;
    data = modbus_pdu_data_length(request);
    if (data > 0 && (length < head_length + 1 || pdu[head_length] != data))
        return ILLEGAL_VALUE;
    if (length != head_length + (data > 0 ? 1 + data : 0))
        return ILLEGAL_VALUE;
    modbus_pdu_take_data(request, pdu + head_length + 1, data);
    return modbus_pdu_is_request(request) ? 0 : 0x02;
}

/* ---- answers ---- */

/* Registers of the head that an answer repeats. */
static unsigned modbus_pdu_echo_count(uint8_t function)
{
    return function == HAL_MODBUS_MASK ? 3 : 2;
}

/* Bytes of what is read. */
static unsigned modbus_pdu_read_length(const struct hal_modbus_request *request)
{
    if (modbus_pdu_reads_bits(request->function))
        return (request->count + 7u) >> 3;
    return 2u * request->count;
}

unsigned modbus_pdu_answer_length(const struct hal_modbus_request *request)
{
    if (modbus_pdu_is_open(request->function))
        return MODBUS_PDU_MAX;
    if (modbus_pdu_reads(request->function))
        return 2 + modbus_pdu_read_length(request);
    return 1 + 2 * modbus_pdu_echo_count(request->function);
}

/* 2B: 0E 01 conformity more next count, then number, length, text of each. */
static unsigned modbus_pdu_objects_whole(const uint8_t *pdu, unsigned length)
{
    unsigned whole = 7;

    for (unsigned i = 0; length >= 7 && i < pdu[6] && whole <= MODBUS_PDU_MAX;
         i++) {
        if (whole + 2 > length)
            return 0;
        whole += 2u + pdu[whole + 1];
    }
    return length < 7 ? 0 : whole;
}

unsigned modbus_pdu_answer_whole(const struct hal_modbus_request *request,
                                 const uint8_t *pdu, unsigned length)
{
    if (length == 0)
        return 0;
    if (pdu[0] == (request->function | EXCEPTION_BIT))
        return 2;
    if (pdu[0] != request->function)
        return MODBUS_PDU_MAX + 1;
    if (request->function == HAL_MODBUS_IDENTIFY)
        return modbus_pdu_objects_whole(pdu, length);
    if (request->function == HAL_MODBUS_REPORT)
        return length < 2 ? 0 : 2u + pdu[1];
    return modbus_pdu_answer_length(request);
}

/* The lowest first; those of the last byte that were not asked for are 0. */
static void modbus_pdu_put_bits(const uint16_t *value, unsigned count,
                                uint8_t *at)
{
    for (unsigned i = 0; 8 * i < count; i++)
        at[i] = (uint8_t)(value[i >> 1] >> 8 * (i & 1));
    if ((count & 7) != 0)
        at[count >> 3] &= (uint8_t)((1u << (count & 7)) - 1);
}

static void modbus_pdu_take_bits(const uint8_t *at, unsigned count,
                                 uint16_t *value)
{
    for (unsigned i = 0; i < count; i++) {
        const uint16_t bit = (uint16_t)(at[i >> 3] >> (i & 7) & 1);

        if ((i & 15) == 0)
            value[i >> 4] = 0;
        value[i >> 4] = (uint16_t)(value[i >> 4] | bit << (i & 15));
    }
}

unsigned modbus_pdu_put_answer(const struct hal_modbus_request *request,
                               const uint16_t *value,
                               uint8_t pdu[MODBUS_PDU_MAX])
{
    if (!modbus_pdu_reads(request->function))
        return modbus_pdu_put_head(
            request, modbus_pdu_echo_count(request->function), pdu);
    pdu[0] = request->function;
    pdu[1] = (uint8_t)modbus_pdu_read_length(request);
    if (modbus_pdu_reads_bits(request->function))
        modbus_pdu_put_bits(value, request->count, pdu + 2);
    else
        for (size_t i = 0; i < request->count; i++)
            modbus_pdu_set(pdu + 2 + 2 * i, value[i]);
    return modbus_pdu_answer_length(request);
}

unsigned modbus_pdu_put_exception(uint8_t function, uint8_t exception,
                                  uint8_t pdu[MODBUS_PDU_MAX])
{
    pdu[0] = function | EXCEPTION_BIT;
    pdu[1] = exception;
    return 2;
}

static bool modbus_pdu_is_echo(const struct hal_modbus_request *request,
                               const uint8_t *pdu)
{
    uint8_t want[1 + 2 * 4];
    const unsigned length = modbus_pdu_put_head(
        request, modbus_pdu_echo_count(request->function), want);

    for (unsigned i = 0; i < length; i++)
        if (pdu[i] != want[i])
            return false;
    return true;
}

/* 11: a byte count and so many bytes.  2B: what was asked for comes back. */
static bool modbus_pdu_is_whole(const uint8_t *pdu, unsigned length)
{
    if (length < 2 || length - 1 > 2 * HAL_MODBUS_READ_MAX)
        return false;
    if (pdu[0] == HAL_MODBUS_REPORT)
        return pdu[1] == length - 2;
    return length >= 7 && pdu[1] == 0x0E && pdu[2] == 0x01;
}

static void modbus_pdu_take_open(const uint8_t *pdu, unsigned length,
                                 struct hal_modbus_reply *reply)
{
    if (!modbus_pdu_is_whole(pdu, length))
        return;
    reply->err = MOTION_OK;
    reply->bytes = (uint8_t)(length - 1);
    reply->count = (uint16_t)(length >> 1);
    for (unsigned i = 0; i < reply->count; i++)
        reply->value[i] = (uint16_t)(pdu[1 + 2 * i] << 8);
    for (unsigned i = 1; i < reply->bytes; i += 2)
        reply->value[i >> 1] = (uint16_t)(reply->value[i >> 1] | pdu[1 + i]);
}

void modbus_pdu_take_answer(const struct hal_modbus_request *request,
                            const uint8_t *pdu, unsigned length,
                            struct hal_modbus_reply *reply)
{
    const unsigned want = modbus_pdu_answer_length(request);
    const bool reads = modbus_pdu_reads(request->function);

    reply->err = MOTION_E_PROTOCOL;
    reply->exception = 0;
    reply->count = 0;
    reply->bytes = 0;
    if (length == 2 && pdu[0] == (request->function | EXCEPTION_BIT) &&
        pdu[1] != 0) {
        reply->err = MOTION_E_REFUSED;
        reply->exception = pdu[1];
    } else if (modbus_pdu_is_open(request->function)) {
        if (length > 0 && pdu[0] == request->function)
            modbus_pdu_take_open(pdu, length, reply);
    } else if (length != want || pdu[0] != request->function) {
        return;
    } else if (!reads) {
        if (modbus_pdu_is_echo(request, pdu))
            reply->err = MOTION_OK;
    } else if (pdu[1] == want - 2) {
        reply->err = MOTION_OK;
        reply->count = request->count;
        if (modbus_pdu_reads_bits(request->function))
            modbus_pdu_take_bits(pdu + 2, request->count, reply->value);
        else
            for (size_t i = 0; i < request->count; i++)
                reply->value[i] = modbus_pdu_get(pdu + 2 + 2 * i);
    }
}
