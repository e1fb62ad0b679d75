/* tests/hal/modbus/test_modbus_rtu.c - frames against the makers' manuals,
 * times against the standard's arithmetic, decoders against anything. */
#include "hal/modbus/rtu.h"

#include <inttypes.h>
#include <string.h>

#include "hal/modbus/slave.h"
#include "hal/modbus/tcp.h"
#include "tests/hal/linux/modbus_bank.h"
#include "tests/support/check.h"
#include "tests/support/rtu_frame.h"

static unsigned bytes_of(const char *text, uint8_t *out)
{
    unsigned n = 0, digits = 0, value = 0;

    for (; *text != '\0'; text++) {
        if (*text == ' ')
            continue;
        value = value * 16 +
                (unsigned)(*text <= '9' ? *text - '0' : *text - 'A' + 10);
        if (++digits % 2 == 0) {
            out[n++] = (uint8_t)value;
            value = 0;
        }
    }
    return n;
}

/* Requests as makers' manuals print them. */
static const struct {
    const char *name, *frame;
    struct hal_modbus_request request;
} manual[] = {
    { "start path 0",
      "01 06 60 02 00 10 37 C6",
      { .unit = 1,
        .function = 6,
        .address = 0x6002,
        .count = 1,
        .value = { 0x10 } } },
    { "stop",
      "01 06 60 02 00 40 37 FA",
      { .unit = 1,
        .function = 6,
        .address = 0x6002,
        .count = 1,
        .value = { 0x40 } } },
    { "read position",
      "01 03 60 2C 00 02 1B C2",
      { .unit = 1, .function = 3, .address = 0x602C, .count = 2 } },
    { "path 0 in one frame",
      "07 10 62 00 00 08 10 00 01 00 00 27 10 00 C8 27 10 27 10 00 00 00 10 BA "
      "95",
      { .unit = 7,
        .function = 16,
        .address = 0x6200,
        .count = 8,
        .value = { 1, 0, 10000, 200, 10000, 10000, 0, 0x10 } } },
    { "continuous, 1000 r/min",
      "01 10 00 5A 00 0E 1C 00000030 00000000 000003E8 000003E8 000009C4 "
      "000003E8 00000001 87 36",
      { .unit = 1,
        .function = 16,
        .address = 0x5A,
        .count = 14,
        .value = { 0, 0x30, 0, 0, 0, 1000, 0, 1000, 0, 2500, 0, 1000, 0,
                   1 } } },
    { "start PR1",
      "01 10 05 0E 00 02 04 00 01 00 00 1C B3",
      { .unit = 1,
        .function = 16,
        .address = 0x050E,
        .count = 2,
        .value = { 1, 0 } } },
    { "controlword",
      "01 06 31 00 00 0F C7 32",
      { .unit = 1,
        .function = 6,
        .address = 0x3100,
        .count = 1,
        .value = { 15 } } },
};

static void frames_are_those_of_the_manuals(void **state)
{
    uint8_t want[MODBUS_RTU_FRAME_MAX], got[MODBUS_RTU_FRAME_MAX];

    (void)state;
    for (unsigned i = 0; i < ARRAY_LEN(manual); i++) {
        const unsigned length = bytes_of(manual[i].frame, want);

        if (!modbus_rtu_is_sealed(want, length))
            fail_msg("%s: CRC", manual[i].name);
        if (rtu_frame_put_request(&manual[i].request, got) != (int)length ||
            memcmp(want, got, length) != 0)
            fail_msg("%s: other bytes", manual[i].name);
    }
}

/* 8N1, no turn-around, the standard's silences; us. */
static const struct {
    uint32_t baud;
    int64_t read_2_us, write_8_us;
} table[] = {
    { 9600, 25000, 41667 }, { 19200, 12500, 20833 }, { 115200, 4975, 6363 },
    { 230400, 4237, 4932 }, { 1000000, 3670, 3830 },
};

static void transactions_take_what_the_baud_rate_says(void **state)
{
    const struct hal_modbus_request read_2 = { .unit = 1,
                                               .function = 3,
                                               .count = 2 };
    const struct hal_modbus_request write_8 = { .unit = 1,
                                                .function = 16,
                                                .count = 8 };

    (void)state;
    for (unsigned i = 0; i < ARRAY_LEN(table); i++) {
        const struct modbus_rtu_line line = { .baud = table[i].baud,
                                              .parity = MODBUS_PARITY_NONE,
                                              .stop_bits = 1 };
        struct modbus_rtu_time time;
        int64_t read_us, write_us;

        assert_int_equal(modbus_rtu_time_init(&time, &line), 0);
        read_us = modbus_rtu_transaction_ns(&time, &read_2) / 1000;
        write_us = modbus_rtu_transaction_ns(&time, &write_8) / 1000;
        /* 17 and 33 characters and two silences */
        if (read_us < table[i].read_2_us || read_us > table[i].read_2_us + 1 ||
            write_us < table[i].write_8_us - 1 ||
            write_us > table[i].write_8_us + 1)
            fail_msg("%u: %" PRId64 " and %" PRId64 " us", table[i].baud,
                     read_us, write_us);
    }
}

static void lines_outside_their_ranges_are_refused(void **state)
{
    static const struct modbus_rtu_line bad[] = {
        { .baud = 0, .stop_bits = 1 },
        { .baud = 300, .stop_bits = 1 },
        { .baud = 5000000, .stop_bits = 1 },
        { .baud = 9600, .stop_bits = 0 },
        { .baud = 9600, .stop_bits = 3 },
        { .baud = 9600, .stop_bits = 1, .gap_ns = -1 },
        { .baud = 9600, .stop_bits = 1, .parity = 3 },
    };
    struct modbus_rtu_time time;

    (void)state;
    for (unsigned i = 0; i < ARRAY_LEN(bad); i++)
        if (modbus_rtu_time_init(&time, &bad[i]) != MOTION_E_ARG)
            fail_msg("row %u was taken", i);
}

/* ---- properties ---- */

static struct hal_modbus_request any_request(uint64_t *seed)
{
    static const uint8_t functions[] = { 3, 4, 5, 6, 15, 16, 22, 23 };
    struct hal_modbus_request any = {
        .unit = (uint8_t)check_random_in(seed, 1, 247),
        .function = functions[check_random(seed) % 8],
        .address = (uint16_t)check_random_in(seed, 0, 0xF000),
        .count = (uint16_t)check_random_in(seed, 1, 123),
    };

    if (any.function == 5 || any.function == 6 || any.function == 22)
        any.count = 1;
    if (any.function == 23) {
        any.write_address = (uint16_t)check_random_in(seed, 0, 0xF000);
        any.write_count = (uint16_t)check_random_in(seed, 1, 121);
    }
    for (unsigned i = 0; i < HAL_MODBUS_WRITE_MAX; i++)
        any.value[i] = (uint16_t)check_random(seed);
    if (any.function == 5)
        any.value[0] &= 1;
    return any;
}

static void what_is_put_is_what_is_taken(void **state)
{
    uint64_t seed = 77;
    uint8_t pdu[MODBUS_PDU_MAX], again[MODBUS_PDU_MAX];
    struct hal_modbus_request taken;

    (void)state;
    for (unsigned i = 0; i < 20000; i++) {
        const struct hal_modbus_request requested = any_request(&seed);
        const int length = modbus_pdu_put_request(&requested, pdu);

        assert_true(length > 0);
        assert_int_equal(modbus_pdu_take_request(pdu, (unsigned)length, &taken),
                         0);
        taken.unit = requested.unit;
        assert_int_equal(modbus_pdu_put_request(&taken, again), length);
        assert_memory_equal(pdu, again, (size_t)length);
    }
}

/* Every request with every length but its own is an exception, never a read
 * beyond the bytes (the sanitizer looks). */
static void a_cut_or_longer_request_is_refused(void **state)
{
    uint64_t seed = 5;
    uint8_t pdu[MODBUS_PDU_MAX + 1] = { 0 };
    struct hal_modbus_request taken;

    (void)state;
    for (unsigned i = 0; i < 2000; i++) {
        const struct hal_modbus_request requested = any_request(&seed);
        const unsigned length =
            (unsigned)modbus_pdu_put_request(&requested, pdu);

        for (unsigned n = 0; n <= MODBUS_PDU_MAX; n++)
            if (n != length && modbus_pdu_take_request(pdu, n, &taken) == 0)
                fail_msg("function %u, %u of %u bytes", requested.function, n,
                         length);
    }
}

static void any_bytes_are_answered_by_a_slave(void **state)
{
    uint64_t seed = 9;
    uint8_t pdu[MODBUS_PDU_MAX], answer[MODBUS_PDU_MAX];
    struct modbus_bank bank;

    (void)state;
    modbus_bank_init(&bank);
    for (unsigned i = 0; i < 100000; i++) {
        const unsigned length =
            (unsigned)check_random_in(&seed, 1, MODBUS_PDU_MAX);

        for (unsigned n = 0; n < length; n++)
            pdu[n] = (uint8_t)check_random(&seed);
        pdu[0] &= 0x1F;
        const unsigned got =
            modbus_slave_serve(&bank.slave, pdu, length, answer);
        assert_in_range(got, 2, MODBUS_PDU_MAX);
        assert_int_equal(answer[0] & 0x7F, pdu[0]);
    }
}

/* A TCP answer that was touched anywhere but in its registers is no answer. */
static void touched_tcp_frames_are_no_answers(void **state)
{
    uint64_t seed = 11;
    uint8_t frame[MODBUS_TCP_FRAME_MAX + 64];
    struct hal_modbus_reply reply;
    unsigned accepted = 0;

    (void)state;
    for (unsigned i = 0; i < 100000; i++) {
        struct hal_modbus_request requested = any_request(&seed);
        const uint16_t number = (uint16_t)check_random(&seed);
        const uint16_t zero[HAL_MODBUS_READ_MAX] = { 0 };
        unsigned length =
            modbus_pdu_put_answer(&requested, zero, frame + MODBUS_TCP_HEAD);
        const bool reads = requested.function == 3 || requested.function == 4 ||
                           requested.function == 23;

        length = modbus_tcp_seal(frame, number, requested.unit, length);
        modbus_tcp_take_answer(&requested, number, frame, length, &reply);
        assert_int_equal(reply.err, MOTION_OK);
        const unsigned at = (unsigned)check_random_in(&seed, 0, length - 1);
        frame[at] ^= (uint8_t)check_random_in(&seed, 1, 255);
        if (check_random(&seed) % 4 == 0)
            length = (unsigned)check_random_in(&seed, 0, length + 20);
        modbus_tcp_take_answer(&requested, number, frame, length, &reply);
        if (reply.err != MOTION_OK)
            continue;
        if (!reads || at < MODBUS_TCP_HEAD + 2)
            fail_msg("byte %u of function %u", at, requested.function);
        accepted++;
    }
    assert_true(accepted > 10000); /* in the registers: TCP's own checksum */
}

/* What a device says of itself: as long as it likes, but whole. */
static void answers_of_any_length_are_taken_whole_or_not(void **state)
{
    /* the specification's examples, 6.13 and 6.21 */
    static const struct {
        struct hal_modbus_request request;
        const char *frame, *answer;
    } row[] = {
        { { .unit = 0x11, .function = 0x11 }, "11 11 CD EC", "11 02 2A FF" },
        { { .unit = 1, .function = 0x2B },
          "01 2B 0E 01 00 70 77",
          "2B 0E 01 01 00 00 01 00 03 61 62 63" },
    };
    uint8_t frame[MODBUS_RTU_FRAME_MAX], pdu[MODBUS_RTU_FRAME_MAX];
    struct hal_modbus_reply reply = { 0 };

    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(row); i++) {
        const unsigned want = bytes_of(row[i].frame, pdu);
        const int got = rtu_frame_put_request(&row[i].request, frame);

        assert_int_equal(got, (int)want);
        assert_memory_equal(frame, pdu, want);
        const unsigned length = bytes_of(row[i].answer, pdu);
        for (unsigned n = 0; n <= length + 1; n++) {
            modbus_pdu_take_answer(&row[i].request, pdu, n, &reply);
            /* 2B says of its objects how long they are: its reader looks */
            if (n == length || (row[i].request.function == 0x2B && n >= 7))
                assert_int_equal(reply.err, MOTION_OK);
            else
                assert_int_equal(reply.err, MOTION_E_PROTOCOL);
        }
        modbus_pdu_take_answer(&row[i].request, pdu, length, &reply);
        assert_int_equal(reply.bytes, length - 1);
        for (unsigned k = 0; k < reply.bytes; k++)
            assert_int_equal(
                (uint8_t)(reply.value[k / 2] >> (k % 2 == 0 ? 8 : 0)),
                pdu[1 + k]);
        pdu[0] |= 0x80;
        pdu[1] = 1;
        modbus_pdu_take_answer(&row[i].request, pdu, 2, &reply);
        assert_int_equal(reply.err, MOTION_E_REFUSED);
        pdu[0] = 3;
        modbus_pdu_take_answer(&row[i].request, pdu, length, &reply);
        assert_int_equal(reply.err, MOTION_E_PROTOCOL);
    }
    memset(pdu, 0, sizeof pdu);
    pdu[0] = 0x11;
    pdu[1] = 250; /* more than a reply has room for */
    modbus_pdu_take_answer(&row[0].request, pdu, 252, &reply);
    assert_int_equal(reply.err, MOTION_E_PROTOCOL);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(frames_are_those_of_the_manuals),
        cmocka_unit_test(transactions_take_what_the_baud_rate_says),
        cmocka_unit_test(lines_outside_their_ranges_are_refused),
        cmocka_unit_test(what_is_put_is_what_is_taken),
        cmocka_unit_test(a_cut_or_longer_request_is_refused),
        cmocka_unit_test(any_bytes_are_answered_by_a_slave),
        cmocka_unit_test(touched_tcp_frames_are_no_answers),
        cmocka_unit_test(answers_of_any_length_are_taken_whole_or_not),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
