/* tests/hal/modbus/test_modbus_listener.c - the answer among stray bytes, echoes
 * and whatever follows, in pieces of any size. */
#include "hal/modbus/listener.h"

#include <string.h>

#include "tests/support/check.h"
#include "tests/support/rtu_frame.h"

#define CASES 20000
#define HEARD 2048

/* A request, and all that is heard after it. */
struct heard {
    struct hal_modbus_request request;
    bool is_ascii;
    uint8_t sent[MODBUS_FRAME_MAX], answer[MODBUS_FRAME_MAX];
    unsigned sent_length, answer_length;
    uint8_t byte[HEARD];
    unsigned length;
    unsigned whole; /* bytes until the answer is whole */
    struct hal_modbus_reply want;
};

static void draw_request(struct hal_modbus_request *request)
{
    static const uint8_t function[] = { 1, 2, 3, 4, 5, 6, 15, 16, 0x16, 0x17 };
    static const uint16_t most[] = { 40, 40, 20, 20, 1, 1, 40, 20, 1, 20 };
    const unsigned kind = draw_below(ARRAY_LEN(function));

    *request = (struct hal_modbus_request){
        .unit = (uint8_t)(1 + draw_below(247)),
        .function = function[kind],
        .address = (uint16_t)draw_below(60000),
        .count = (uint16_t)(1 + draw_below(most[kind])),
        .write_address = (uint16_t)draw_below(60000),
    };
    request->write_count = function[kind] == 0x17 ? 3 : 0;
    for (unsigned i = 0; i < 20; i++)
        request->value[i] = (uint16_t)draw();
}

/* The device's own, or its refusal. */
static void draw_answer(struct heard *heard)
{
    struct hal_modbus_request taken;
    uint16_t value[HAL_MODBUS_READ_MAX];
    uint8_t bytes[MODBUS_RTU_FRAME_MAX];
    unsigned length;

    for (unsigned i = 0; i < ARRAY_LEN(value); i++)
        value[i] = (uint16_t)draw();
    length = modbus_serial_open(heard->is_ascii, heard->sent,
                                heard->sent_length, bytes);
    assert_int_equal(modbus_pdu_take_request(bytes + 1, length - 1, &taken), 0);
    length = draw_below(8) == 0
                 ? modbus_pdu_put_exception(taken.function,
                                            (uint8_t)(1 + draw_below(11)),
                                            heard->answer + 1)
                 : modbus_pdu_put_answer(&taken, value, heard->answer + 1);
    modbus_pdu_take_answer(&heard->request, heard->answer + 1, length,
                           &heard->want);
    heard->answer_length = modbus_serial_seal(heard->is_ascii, heard->answer,
                                              heard->request.unit, length);
    assert_int_not_equal(heard->want.err, MOTION_E_PROTOCOL);
}

static unsigned most_strays(const struct heard *heard)
{
    return heard->is_ascii ? MODBUS_ASCII_STRAYS_MAX : MODBUS_STRAYS_MAX;
}

static void draw_heard(struct heard *heard)
{
    memset(heard, 0, sizeof *heard);
    heard->is_ascii = draw_below(2) == 0;
    draw_request(&heard->request);
    heard->sent_length = (unsigned)modbus_serial_put_request(
        heard->is_ascii, &heard->request, heard->sent);
    draw_answer(heard);
}

static void put(struct heard *heard, const uint8_t *bytes, unsigned length)
{
    memcpy(heard->byte + heard->length, bytes, length);
    heard->length += length;
}

/* Any bytes, or such as a frame begins with. */
static void put_strays(struct heard *heard, unsigned count)
{
    for (unsigned i = 0; i < count; i++) {
        const uint8_t like[] = { heard->is_ascii ? ':' : heard->request.unit,
                                 heard->is_ascii ? '0'
                                                 : heard->request.function,
                                 0x00, 0xFF, (uint8_t)draw() };

        heard->byte[heard->length++] = like[draw_below(ARRAY_LEN(like))];
    }
}

static bool is_twin(const struct heard *heard)
{
    return heard->sent_length == heard->answer_length &&
           memcmp(heard->sent, heard->answer, heard->sent_length) == 0;
}

static bool is_same(const struct hal_modbus_reply *got,
                    const struct hal_modbus_reply *want)
{
    return got->err == want->err && got->exception == want->exception &&
           got->count == want->count &&
           memcmp(got->value, want->value,
                  2 * (size_t)((want->count + 15) / 16)) == 0;
}

/* Expect the answer with the byte that makes it whole, no sooner and no later. */
static void expect_found(struct heard *heard, bool expects_echo,
                         unsigned strays, unsigned echoes)
{
    struct modbus_listener listener;
    struct hal_modbus_reply reply = { 0 };
    unsigned fed = 0, found = 0;

    modbus_listener_begin(&listener, heard->is_ascii, &heard->request,
                          heard->sent, heard->sent_length, expects_echo);
    while (found == 0 && fed < heard->length) {
        unsigned piece = 1 + draw_below(12);

        if (piece > heard->length - fed)
            piece = heard->length - fed;
        modbus_listener_take(&listener, heard->byte + fed, piece);
        fed += piece;
        found = modbus_listener_find(&listener, false, &reply);
        if ((found != 0) != (fed >= heard->whole))
            fail_msg("function %u, %s: %u of %u heard, answer %u, found %u",
                     heard->request.function, heard->is_ascii ? "ASCII" : "RTU",
                     fed, heard->whole, heard->answer_length, found);
    }
    assert_int_equal(found, heard->answer_length);
    assert_int_equal(listener.length, fed - heard->whole);
    assert_true(is_same(&reply, &heard->want));
    assert_int_equal(listener.strays, strays);
    assert_int_equal(listener.echoes, echoes);
}

static int give_up(struct heard *heard, bool expects_echo)
{
    struct modbus_listener listener;
    struct hal_modbus_reply reply = { 0 };

    modbus_listener_begin(&listener, heard->is_ascii, &heard->request,
                          heard->sent, heard->sent_length, expects_echo);
    modbus_listener_take(&listener, heard->byte, heard->length);
    assert_int_equal(modbus_listener_find(&listener, false, &reply), 0);
    if (modbus_listener_find(&listener, true, &reply) != 0)
        assert_true(reply.err == MOTION_OK || reply.err == MOTION_E_REFUSED);
    return reply.err;
}

static void an_answer_is_found_wherever_it_stands(void **state)
{
    struct heard heard;

    (void)state;
    seed_from("an_answer_is_found_wherever_it_stands");
    for (unsigned i = 0; i < CASES; i++) {
        const bool has_echo = draw_below(2) == 0;

        draw_heard(&heard);
        const unsigned before = draw_below(most_strays(&heard) + 1);
        const unsigned between = draw_below(most_strays(&heard) + 1 - before);
        put_strays(&heard, before);
        if (has_echo)
            put(&heard, heard.sent, heard.sent_length);
        put_strays(&heard, between);
        put(&heard, heard.answer, heard.answer_length);
        heard.whole = heard.length;
        put_strays(&heard, draw_below(30));
        expect_found(&heard, has_echo, before + between, has_echo);
    }
}

/* The answer to a write of one register is its echo: where two should come and one does,
 * nobody has heard the request. */
static void of_two_that_are_the_same_the_first_is_the_echo(void **state)
{
    struct heard heard;
    unsigned twins = 0;

    (void)state;
    seed_from("of_two_that_are_the_same_the_first_is_the_echo");
    for (unsigned i = 0; i < CASES; i++) {
        draw_heard(&heard);
        if (!is_twin(&heard))
            continue;
        twins++;
        put(&heard, heard.answer, heard.answer_length);
        heard.whole = heard.length;
        expect_found(&heard, false, 0, 0);
        assert_int_equal(give_up(&heard, true), MOTION_E_TIMEOUT);
        put(&heard, heard.answer, heard.answer_length);
        heard.whole = heard.length;
        expect_found(&heard, true, 0, 1);
    }
    assert_true(twins > CASES / 20);
}

/* The question of another master, and the answer to it. */
static void the_answer_to_another_is_not_ours(void **state)
{
    struct heard heard, other;
    struct hal_modbus_reply reply;
    uint8_t bytes[MODBUS_RTU_FRAME_MAX];
    unsigned asked = 0;

    (void)state;
    seed_from("the_answer_to_another_is_not_ours");
    for (unsigned i = 0; i < CASES; i++) {
        draw_heard(&heard);
        other = heard;
        other.request.address ^= 1;
        other.sent_length = (unsigned)modbus_serial_put_request(
            other.is_ascii, &other.request, other.sent);
        draw_answer(&other);
        const unsigned length = modbus_serial_open(other.is_ascii, other.sent,
                                                   other.sent_length, bytes);
        modbus_pdu_take_answer(&heard.request, bytes + 1, length - 1, &reply);
        if (reply.err == MOTION_OK)
            continue; /* a question as the answer would be */
        asked++;
        put(&heard, other.sent, other.sent_length);
        put(&heard, other.answer, other.answer_length);
        assert_int_equal(give_up(&heard, false), MOTION_E_PROTOCOL);
    }
    assert_true(asked > CASES * 9 / 10);
}

/* It is heard while the request goes out, in whole or in part. */
static void what_comes_too_early_is_no_answer(void **state)
{
    struct heard heard;

    (void)state;
    seed_from("what_comes_too_early_is_no_answer");
    for (unsigned i = 0; i < CASES; i++) {
        struct modbus_listener listener;
        struct hal_modbus_reply reply = { 0 };
        unsigned early;

        draw_heard(&heard);
        early = 1 + draw_below(heard.answer_length);
        if (memcmp(heard.answer, heard.sent, early) == 0)
            continue; /* it may be the echo */
        modbus_listener_begin(&listener, heard.is_ascii, &heard.request,
                              heard.sent, heard.sent_length, false);
        modbus_listener_take(&listener, heard.sent, heard.sent_length);
        modbus_listener_take(&listener, heard.answer, early);
        modbus_listener_sent(&listener);
        modbus_listener_take(&listener, heard.answer + early,
                             heard.answer_length - early);
        modbus_listener_take(&listener, heard.answer, heard.answer_length);
        assert_int_equal(modbus_listener_find(&listener, false, &reply), 0);
        assert_int_equal(modbus_listener_find(&listener, true, &reply), 0);
        assert_int_equal(reply.err, MOTION_E_PROTOCOL);
        assert_int_equal(listener.echoes, 1);
        assert_int_equal(listener.strays, 2 * heard.answer_length);
    }
}

static void what_is_broken_is_never_an_answer(void **state)
{
    struct heard heard;

    (void)state;
    seed_from("what_is_broken_is_never_an_answer");
    for (unsigned i = 0; i < CASES; i++) {
        draw_heard(&heard);
        const unsigned before = draw_below(most_strays(&heard) + 1);
        put_strays(&heard, before);
        put(&heard, heard.answer, heard.answer_length);
        if (draw_below(2) == 0)
            heard.length -= 1 + draw_below(heard.answer_length);
        else
            heard.byte[before + draw_below(heard.answer_length)] ^=
                (uint8_t)(1u << draw_below(8));
        assert_int_equal(give_up(&heard, false), heard.length == 0
                                                     ? MOTION_E_TIMEOUT
                                                     : MOTION_E_PROTOCOL);
    }
}

/* The most that may stand before an answer, and one more. */
static void more_strays_may_be_a_question(void **state)
{
    struct heard heard;

    (void)state;
    seed_from("more_strays_may_be_a_question");
    for (unsigned strays = MODBUS_STRAYS_MAX; strays < 40; strays++) {
        draw_heard(&heard);
        for (unsigned i = 0; i < strays; i++)
            put(&heard, (const uint8_t[]){ 0 }, 1);
        put(&heard, heard.answer, heard.answer_length);
        heard.whole = heard.length;
        if (strays <= most_strays(&heard))
            expect_found(&heard, false, strays, 0);
        else
            assert_int_equal(give_up(&heard, false), MOTION_E_PROTOCOL);
    }
}

/* Answers that say their own length. */
static void an_identification_ends_where_it_says(void **state)
{
    static const uint8_t pdu[] = { 0x2B, 0x0E, 1,   1,   0, 0, 2,   0,
                                   3,    'a',  'b', 'c', 1, 2, 'd', 'e' };
    static const uint8_t report[] = { 0x11, 3, 'x', 'y', 0xFF };
    struct heard heard = { .request = { .unit = 9, .function = 0x2B } };

    (void)state;
    seed_from("an_identification_ends_where_it_says");
    for (unsigned i = 0; i < 100; i++) {
        const bool is_report = i % 2 == 1;

        heard.request.function = is_report ? 0x11 : 0x2B;
        heard.length = 0;
        heard.sent_length =
            (unsigned)rtu_frame_put_request(&heard.request, heard.sent);
        memcpy(heard.answer + 1, is_report ? report : pdu,
               is_report ? sizeof report : sizeof pdu);
        heard.answer_length = modbus_rtu_seal(
            heard.answer, 9, is_report ? sizeof report : sizeof pdu);
        rtu_frame_take_answer(&heard.request, heard.answer, heard.answer_length,
                              &heard.want);
        put_strays(&heard, i % 4);
        put(&heard, heard.answer, heard.answer_length);
        heard.whole = heard.length;
        put_strays(&heard, draw_below(20));
        expect_found(&heard, false, i % 4, 0);
    }
}

/* The check by hand: 01 + 03 + 02 = 06, and 06 + FA = 100. */
static void an_ascii_frame_is_as_the_standard_has_it(void **state)
{
    static const char want[] = ":010300000002FA\r\n";
    const struct hal_modbus_request request = { .unit = 1,
                                                .function = 3,
                                                .count = 2 };
    uint8_t frame[MODBUS_FRAME_MAX], bytes[MODBUS_RTU_FRAME_MAX];

    (void)state;
    assert_int_equal(modbus_serial_put_request(true, &request, frame),
                     sizeof want - 1);
    assert_memory_equal(frame, want, sizeof want - 1);
    assert_int_equal(modbus_serial_open(true, frame, sizeof want - 1, bytes),
                     6);
    for (size_t i = 0; i < sizeof want - 1; i++)
        for (unsigned bit = 0; bit < 8; bit++) { /* one wrong bit is seen */
            frame[i] ^= (uint8_t)(1u << bit);
            assert_int_equal(
                modbus_serial_open(true, frame, sizeof want - 1, bytes), 0);
            frame[i] ^= (uint8_t)(1u << bit);
        }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(an_answer_is_found_wherever_it_stands),
        cmocka_unit_test(of_two_that_are_the_same_the_first_is_the_echo),
        cmocka_unit_test(the_answer_to_another_is_not_ours),
        cmocka_unit_test(what_comes_too_early_is_no_answer),
        cmocka_unit_test(what_is_broken_is_never_an_answer),
        cmocka_unit_test(more_strays_may_be_a_question),
        cmocka_unit_test(an_ascii_frame_is_as_the_standard_has_it),
        cmocka_unit_test(an_identification_ends_where_it_says),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
