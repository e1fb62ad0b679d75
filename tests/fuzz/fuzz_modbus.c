/* tests/fuzz/fuzz_modbus.c - Modbus PDU, RTU and TCP frames, both ways.
 *
 * The first bytes say what was asked; the rest is the answer, and the same rest
 * is a request for a slave. */
#include <stdlib.h>
#include <string.h>

#include "hal/modbus/rtu.h"
#include "hal/modbus/rtu_slave.h"
#include "hal/modbus/tcp.h"
#include "tests/fuzz/fuzz.h"
#include "tests/hal/linux/modbus_bank.h"
#include "tests/support/rtu_frame.h"

#define FRAME_MAX 300

static struct hal_modbus_request fuzz_modbus_requested(struct fuzz_bytes *bytes)
{
    struct hal_modbus_request request = { .unit = 9 };

    request.function = fuzz_u8(bytes);
    request.address = fuzz_u16(bytes);
    request.count = fuzz_u8(bytes);
    request.write_address = fuzz_u8(bytes);
    request.write_count = fuzz_u8(bytes) % 8;
    for (unsigned i = 0; i < 8; i++)
        request.value[i] = (uint16_t)(0x1234 * i);
    return request;
}

/* Answered with as much as the device has to say. */
static bool fuzz_modbus_is_open(const struct hal_modbus_request *request)
{
    return request->function == HAL_MODBUS_REPORT ||
           request->function == HAL_MODBUS_IDENTIFY;
}

static void fuzz_modbus_claim(const struct hal_modbus_request *request,
                              const struct hal_modbus_reply *reply)
{
    fuzz_claim(reply->count <= HAL_MODBUS_READ_MAX, "a reply has its room");
    if (reply->err != MOTION_OK)
        return;
    if (fuzz_modbus_is_open(request))
        fuzz_claim(reply->count == (reply->bytes + 1) / 2,
                   "an open answer has all of its bytes");
    else
        fuzz_claim(reply->count == 0 || reply->count == request->count,
                   "an answer has what was asked for");
}

/* An answer that is accepted is the one and only frame with these values. */
static void fuzz_modbus_answers(const struct hal_modbus_request *request,
                                const uint8_t *frame, unsigned length)
{
    struct hal_modbus_reply reply = { 0 };
    uint8_t sealed[FRAME_MAX + 2];

    modbus_pdu_take_answer(request, frame, length, &reply);
    fuzz_modbus_claim(request, &reply);
    if (reply.err == MOTION_OK)
        fuzz_claim(fuzz_modbus_is_open(request)
                       ? length == reply.bytes + 1u
                       : length == modbus_pdu_answer_length(request),
                   "an answer has its length");
    reply = (struct hal_modbus_reply){ 0 };
    rtu_frame_take_answer(request, frame, length, &reply);
    fuzz_modbus_claim(request, &reply);
    if (reply.err == MOTION_OK)
        fuzz_claim(modbus_rtu_is_sealed(frame, length), "with the right CRC");
    reply = (struct hal_modbus_reply){ 0 };
    modbus_tcp_take_answer(request, 0x0102, frame, length, &reply);
    fuzz_modbus_claim(request, &reply);
    (void)modbus_tcp_whole(frame, length);
    if (length + 3 > MODBUS_RTU_FRAME_MAX)
        return;
    memcpy(sealed + 1, frame, length);
    const unsigned whole = modbus_rtu_seal(sealed, 9, length);
    reply = (struct hal_modbus_reply){ 0 };
    rtu_frame_take_answer(request, sealed, whole, &reply);
    fuzz_modbus_claim(request, &reply);
}

static void fuzz_modbus_serves(const uint8_t *pdu, unsigned length)
{
    static struct modbus_bank bank;
    static struct modbus_rtu_slave slave;
    static const struct modbus_rtu_line line = { .baud = 115200,
                                                 .stop_bits = 1 };
    struct hal_modbus_request request;
    uint8_t answer[MODBUS_PDU_MAX], frame[MODBUS_RTU_FRAME_MAX];

    modbus_bank_init(&bank);
    if (modbus_pdu_take_request(pdu, length, &request) == 0) {
        request.unit = 9;
        fuzz_claim(modbus_pdu_is_request(&request), "a request is one");
    }
    const unsigned got = modbus_slave_serve(&bank.slave, pdu, length, answer);
    fuzz_claim(got >= 2 && got <= MODBUS_PDU_MAX, "there is an answer");
    fuzz_claim(modbus_rtu_slave_init(&slave, &bank.slave, 9, &line, 0) == 0,
               "a slave");
    slave.station.ops->recv(&slave.station, pdu, length, 1000000);
    fuzz_claim(slave.station.ops->poll(&slave.station, 9000000, frame) <=
                   sizeof frame,
               "an answer fits");
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    struct fuzz_bytes bytes = { data, size };
    const struct hal_modbus_request request = fuzz_modbus_requested(&bytes);
    uint8_t frame[FRAME_MAX];
    const unsigned length = (unsigned)fuzz_take(&bytes, frame, FRAME_MAX);
    /* on the heap, so that reading past the end is seen */
    uint8_t *exact = malloc(length > 0 ? length : 1);

    fuzz_claim(exact != NULL, "there is room for a frame");
    memcpy(exact, frame, length);
    if (modbus_pdu_is_request(&request))
        fuzz_modbus_answers(&request, exact, length);
    if (length > 0)
        fuzz_modbus_serves(exact, length);
    free(exact);
    return 0;
}
