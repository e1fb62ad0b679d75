/* tests/peers/master.c - asks a server of somebody else every function of ours.
 *
 *   master rtu DEVICE | tcp PORT
 *
 * Unit 17 has 256 holding registers 0x1000 + 3 i, input registers that are
 * their inverse, and coils. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "hal/linux/clock.h"
#include "hal/linux/libmodbus.h"

#define MS   INT64_C(1000000)
#define UNIT 17

static struct modbus_libmodbus line;
static struct clock_linux clock_linux;

static void fail(const char *what)
{
    printf("  master: %s\n", what);
    exit(1);
}

static void pass(void)
{
    struct hal_clock *clock = &clock_linux.clock;

    (void)hal_clock_wait_until(clock, hal_clock_now_ns(clock) + MS);
}

static struct hal_modbus_reply client(uint8_t function, uint16_t address,
                                      uint16_t count, uint16_t first,
                                      uint16_t second)
{
    const struct hal_modbus_request request = { .unit = UNIT,
                                                .function = function,
                                                .address = address,
                                                .count = count,
                                                .write_address = 50,
                                                .write_count = 2,
                                                .value = { first, second } };
    struct hal_modbus_reply reply;

    if (hal_modbus_submit(&line.modbus, &request, 0) != MOTION_OK)
        fail("a request was not taken");
    for (int i = 0; i < 5000; i++) {
        if (hal_modbus_collect(&line.modbus, &reply) == 1)
            return reply;
        pass();
    }
    fail("no reply");
    return reply;
}

static struct hal_modbus_reply expect(uint8_t function, uint16_t address,
                                      uint16_t count, uint16_t first,
                                      uint16_t second)
{
    const struct hal_modbus_reply reply =
        client(function, address, count, first, second);

    if (reply.err == MOTION_OK)
        return reply;
    printf("  function %u: %s\n", function, motion_err_text(reply.err));
    exit(1);
}

static void expect_value(uint16_t address, uint16_t want)
{
    if (expect(HAL_MODBUS_READ, address, 1, 0, 0).value[0] != want)
        fail("a register has another value");
}

static void every_function(void)
{
    struct hal_modbus_reply reply = expect(HAL_MODBUS_READ, 5, 100, 0, 0);

    for (unsigned i = 0; i < 100; i++)
        if (reply.value[i] != 0x1000 + 3 * (5 + i))
            fail("read other values");
    if (expect(HAL_MODBUS_READ_INPUT, 5, 1, 0, 0).value[0] !=
        (uint16_t) ~(0x1000 + 15))
        fail("read another input");
    (void)expect(HAL_MODBUS_WRITE, 40, 1, 0xBEEF, 0);
    expect_value(40, 0xBEEF);
    (void)expect(HAL_MODBUS_WRITE_MANY, 41, 2, 1, 0xFFFE);
    expect_value(42, 0xFFFE);
    (void)expect(HAL_MODBUS_WRITE, 43, 1, 0x12, 0);
    (void)expect(HAL_MODBUS_MASK, 43, 1, 0xF2, 0x25);
    expect_value(43, 0x17);
    (void)expect(HAL_MODBUS_WRITE_COILS, 0, 20, 0x5555, 0x0005);
    (void)expect(HAL_MODBUS_WRITE_COIL, 2, 1, 1, 0);
    reply = expect(HAL_MODBUS_WRITE_READ, 49, 3, 0x0102, 0x0304);
    if (reply.value[1] != 0x0102 || reply.value[2] != 0x0304)
        fail("function 23 read before it wrote");
    reply = client(HAL_MODBUS_READ, 0xF000, 1, 0, 0);
    if (reply.err != MOTION_E_REFUSED || reply.exception != 2)
        fail("no exception for an address that is not there");
}

int main(int argc, char *argv[])
{
    struct modbus_line_config config = {
        .line = { .baud = 115200,
                  .parity = MODBUS_PARITY_NONE,
                  .stop_bits = 1 },
        .host = "127.0.0.1",
        .timeout_ns = 1000 * MS,
    };

    if (argc != 3 || strlen(argv[2]) >= sizeof config.device)
        return 2;
    if (strcmp(argv[1], "rtu") == 0)
        memcpy(config.device, argv[2], strlen(argv[2]) + 1);
    else
        config.port = (uint16_t)strtoul(argv[2], NULL, 10);
    (void)clock_linux_init(&clock_linux);
    if (modbus_libmodbus_open(&line, &config) < 0)
        fail("cannot be opened");
    every_function();
    for (int i = 0; i < 500; i++)
        expect_value(60, 0x1000 + 180);
    modbus_libmodbus_close(&line);
    printf("  %s: 3, 4, 5, 6, 15, 16, 22, 23, an exception, 500 reads right\n",
           argv[1]);
    return 0;
}
