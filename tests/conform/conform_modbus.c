/* tests/conform/conform_modbus.c - see conform_modbus.h. */
#include "tests/conform/conform_modbus.h"

#include "tests/support/check.h"

#define PATIENCE 30000 /* passes */

static struct hal_modbus_reply collect(struct conform_modbus *conform)
{
    struct hal_modbus_reply reply;

    for (unsigned i = 0; i < PATIENCE; i++) {
        if (hal_modbus_collect(conform->line, &reply) == 1)
            return reply;
        conform->pass(conform);
    }
    fail_msg("no reply");
    return reply;
}

struct hal_modbus_reply
conform_modbus_do(struct conform_modbus *conform,
                  const struct hal_modbus_request *request)
{
    assert_int_equal(hal_modbus_submit(conform->line, request, 7), MOTION_OK);
    const struct hal_modbus_reply reply = collect(conform);
    assert_int_equal(reply.tag, 7);
    assert_true(reply.sent_ns <= reply.answer_ns || reply.err != MOTION_OK);
    assert_true(reply.answer_ns <= reply.done_ns);
    return reply;
}

static struct hal_modbus_request request(uint8_t function, uint16_t address,
                                         uint16_t count)
{
    return (struct hal_modbus_request){ .unit = CONFORM_UNIT,
                                        .function = function,
                                        .address = address,
                                        .count = count };
}

static void expect_ok(struct conform_modbus *conform,
                      const struct hal_modbus_request *query,
                      struct hal_modbus_reply *reply)
{
    *reply = conform_modbus_do(conform, query);
    if (reply->err != MOTION_OK)
        fail_msg("function %02X: %s", query->function,
                 motion_err_text(reply->err));
}

static void expect_read(struct conform_modbus *conform, uint8_t function,
                        uint16_t flip)
{
    const struct hal_modbus_request query = request(function, 5, 4);
    struct hal_modbus_reply reply;

    expect_ok(conform, &query, &reply);
    assert_int_equal(reply.count, 4);
    for (unsigned i = 0; i < 4; i++)
        assert_int_equal(reply.value[i], conform->bank->reg[5 + i] ^ flip);
}

static void expect_coils(struct conform_modbus *conform)
{
    struct hal_modbus_request query = request(HAL_MODBUS_WRITE_COIL, 3, 1);
    struct hal_modbus_reply reply;

    query.value[0] = 1;
    expect_ok(conform, &query, &reply);
    assert_int_equal(conform->bank->coil[0], 1 << 3);
    query.value[0] = 0;
    expect_ok(conform, &query, &reply);
    assert_int_equal(conform->bank->coil[0], 0);
    query = request(HAL_MODBUS_WRITE_COILS, 0, 19);
    query.value[0] = 0x8421;
    query.value[1] = 0xFFFD;
    expect_ok(conform, &query, &reply);
    assert_int_equal(conform->bank->coil[0], 0x8421);
    assert_int_equal(conform->bank->coil[1], 0x0005); /* three of them */
}

static void expect_writes(struct conform_modbus *conform)
{
    struct hal_modbus_request query = request(HAL_MODBUS_WRITE, 40, 1);
    struct hal_modbus_reply reply;

    query.value[0] = 0xBEEF;
    expect_ok(conform, &query, &reply);
    assert_int_equal(conform->bank->reg[40], 0xBEEF);
    query = request(HAL_MODBUS_WRITE_MANY, 41, 2);
    query.value[0] = 1;
    query.value[1] = 0xFFFE;
    expect_ok(conform, &query, &reply);
    assert_int_equal(conform->bank->reg[41], 1);
    assert_int_equal(conform->bank->reg[42], 0xFFFE);
    query = request(HAL_MODBUS_MASK, 40, 1); /* the standard's own example */
    conform->bank->reg[40] = 0x12;
    query.value[0] = 0xF2;
    query.value[1] = 0x25;
    expect_ok(conform, &query, &reply);
    assert_int_equal(conform->bank->reg[40], 0x17);
}

static void expect_write_read(struct conform_modbus *conform)
{
    struct hal_modbus_request query = request(HAL_MODBUS_WRITE_READ, 60, 3);
    struct hal_modbus_reply reply;

    query.write_address = 61;
    query.write_count = 2;
    query.value[0] = 0x0102;
    query.value[1] = 0x0304;
    expect_ok(conform, &query, &reply);
    assert_int_equal(reply.count, 3);
    assert_int_equal(reply.value[0], conform->bank->reg[60]);
    assert_int_equal(reply.value[1], 0x0102); /* written first */
    assert_int_equal(reply.value[2], 0x0304);
}

/* After what expect_coils has written: any start, any count. */
static void expect_bits(struct conform_modbus *conform, uint8_t function,
                        bool inverse, uint16_t at, uint16_t count)
{
    const struct hal_modbus_request query = request(function, at, count);
    struct hal_modbus_reply reply;

    expect_ok(conform, &query, &reply);
    assert_int_equal(reply.count, count);
    for (unsigned i = 0; i < count; i++) {
        const unsigned coil = at + i;
        const bool want =
            (conform->bank->coil[coil / 16] >> coil % 16 & 1) != inverse;
        const bool got = (reply.value[i / 16] >> i % 16 & 1) != 0;

        if (got != want)
            fail_msg("function %02X, bit %u of %u", function, i, count);
    }
}

void conform_modbus_every_function(struct conform_modbus *conform)
{
    expect_read(conform, HAL_MODBUS_READ, 0);
    expect_read(conform, HAL_MODBUS_READ_INPUT, 0xFFFF);
    expect_coils(conform);
    for (uint16_t count = 1; count < 40; count = (uint16_t)(count + 6)) {
        expect_bits(conform, HAL_MODBUS_READ_COILS, false, 2, count);
        expect_bits(conform, HAL_MODBUS_READ_DISCRETE, true, 3, count);
    }
    expect_writes(conform);
    expect_write_read(conform);
}

void conform_modbus_longest(struct conform_modbus *conform)
{
    struct hal_modbus_request query =
        request(HAL_MODBUS_WRITE_MANY, 100, HAL_MODBUS_WRITE_MAX);
    struct hal_modbus_reply reply;

    for (unsigned i = 0; i < HAL_MODBUS_WRITE_MAX; i++)
        query.value[i] = (uint16_t)(i * 521);
    expect_ok(conform, &query, &reply);
    query = request(HAL_MODBUS_READ, 98, HAL_MODBUS_READ_MAX);
    expect_ok(conform, &query, &reply);
    assert_int_equal(reply.count, HAL_MODBUS_READ_MAX);
    for (unsigned i = 0; i < HAL_MODBUS_WRITE_MAX; i++)
        assert_int_equal(reply.value[2 + i], (uint16_t)(i * 521));
}

void conform_modbus_order(struct conform_modbus *conform)
{
    for (uint32_t i = 0; i < 5; i++) {
        const struct hal_modbus_request query =
            request(HAL_MODBUS_READ, (uint16_t)(10 * i), 1);
        assert_int_equal(hal_modbus_submit(conform->line, &query, 100 + i), 0);
    }
    for (uint32_t i = 0; i < 5; i++) {
        const struct hal_modbus_reply reply = collect(conform);
        assert_int_equal(reply.tag, 100 + i);
        assert_int_equal(reply.err, MOTION_OK);
        assert_int_equal(reply.value[0], conform->bank->reg[10 * i]);
    }
}

void conform_modbus_mailbox_full(struct conform_modbus *conform)
{
    const struct hal_modbus_request query = request(HAL_MODBUS_READ, 0, 1);

    for (uint32_t i = 0; i < HAL_MODBUS_MAILBOX; i++)
        assert_int_equal(hal_modbus_submit(conform->line, &query, i),
                         MOTION_OK);
    assert_int_equal(hal_modbus_submit(conform->line, &query, 99),
                     MOTION_E_FULL);
    for (uint32_t i = 0; i < HAL_MODBUS_MAILBOX; i++)
        assert_int_equal(collect(conform).tag, i);
    assert_int_equal(conform_modbus_do(conform, &query).err, MOTION_OK);
}

void conform_modbus_refuses_malformed(struct conform_modbus *conform)
{
    const struct hal_modbus_request bad[] = {
        request(HAL_MODBUS_READ, 0, 0),
        request(HAL_MODBUS_READ, 0, HAL_MODBUS_READ_MAX + 1),
        request(HAL_MODBUS_READ, 0xFFFF, 2),
        request(HAL_MODBUS_WRITE, 0, 2),
        request(HAL_MODBUS_WRITE_MANY, 0, HAL_MODBUS_WRITE_MAX + 1),
        request(HAL_MODBUS_WRITE_READ, 0, 1), /* writes none */
        request(0x2B, 0, 1),
        { .unit = 248, .function = HAL_MODBUS_READ, .count = 1 },
        { .unit = 0, .function = HAL_MODBUS_READ, .count = 1 },
    };

    for (unsigned i = 0; i < ARRAY_LEN(bad); i++)
        if (hal_modbus_submit(conform->line, &bad[i], 0) != MOTION_E_ARG)
            fail_msg("row %u was taken", i);
}

void conform_modbus_exception(struct conform_modbus *conform)
{
    const struct hal_modbus_request query =
        request(HAL_MODBUS_READ, BANK_SIZE - 1, 2);
    const struct hal_modbus_reply reply = conform_modbus_do(conform, &query);

    assert_int_equal(reply.err, MOTION_E_REFUSED);
    assert_int_equal(reply.exception, 2);
    assert_string_equal(hal_modbus_exception_text(reply.exception),
                        "illegal data address");
}

/* Nobody answers on a serial line; a gateway says that nobody does. */
void conform_modbus_missing_unit(struct conform_modbus *conform)
{
    struct hal_modbus_request query = request(HAL_MODBUS_READ, 0, 1);

    query.unit = 30;
    const struct hal_modbus_reply reply = conform_modbus_do(conform, &query);
    if (reply.err != MOTION_E_TIMEOUT)
        assert_int_equal(reply.exception, 0x0B);
    expect_read(conform, HAL_MODBUS_READ, 0);
}

void conform_modbus_broadcast(struct conform_modbus *conform)
{
    struct hal_modbus_request query = request(HAL_MODBUS_WRITE, 77, 1);

    query.unit = HAL_MODBUS_BROADCAST;
    query.value[0] = 0xABCD;
    if (!conform->broadcasts) {
        assert_int_equal(hal_modbus_submit(conform->line, &query, 0),
                         MOTION_E_ARG);
        return;
    }
    assert_int_equal(conform_modbus_do(conform, &query).err, MOTION_OK);
    assert_int_equal(conform->bank->reg[77], 0xABCD);
    expect_read(conform, HAL_MODBUS_READ, 0);
}

void conform_modbus_stats(struct conform_modbus *conform)
{
    struct hal_modbus_request query = request(HAL_MODBUS_READ, 0, 1);
    struct hal_modbus_stats before, after;

    hal_modbus_stats(conform->line, &before);
    (void)conform_modbus_do(conform, &query);
    query.address = 0xFFFF;
    (void)conform_modbus_do(conform, &query);
    hal_modbus_stats(conform->line, &after);
    assert_int_equal(after.transactions - before.transactions, 2);
    assert_int_equal(after.exceptions - before.exceptions, 1);
    assert_true(after.busy_ns > before.busy_ns);
    assert_true(after.busy_ns - before.busy_ns >=
                after.ideal_ns - before.ideal_ns);
    assert_int_equal(hal_modbus_is_up(conform->line), 1);
}
