/* tests/firmware/mcu/test_port.c - bytes between a port and the main loop, while
 * its counters wrap. */
#include "firmware/mcu/board/board.h"
#include "tests/support/check.h"

static unsigned starts;

int64_t board_now_ns(void)
{
    return 7;
}

void board_port_start(struct board_port *port)
{
    (void)port;
    starts++;
}

static void bytes_of_a_port_wrap(void **state)
{
    static struct board_port port;
    uint8_t bytes[BOARD_BYTES];
    int64_t last_ns;
    uint8_t next = 0, seen = 0;
    (void)state;

    port.put = port.taken = UINT32_MAX - 3 * BOARD_BYTES / 2;
    for (unsigned round = 0; round < 100; round++) {
        const unsigned count = 1 + round * 5;
        for (unsigned i = 0; i < count; i++)
            board_port_received_isr(&port, next++);
        assert_int_equal(board_port_take(&port, bytes, &last_ns), count);
        for (unsigned i = 0; i < count; i++)
            assert_int_equal(bytes[i], seen++);
    }
    assert_true(port.put < UINT32_MAX / 2);
    /* More than there is room for, across the wrap: the rest is lost. */
    port.put = port.taken = UINT32_MAX - 5;
    for (unsigned i = 0; i < 2 * BOARD_BYTES; i++)
        board_port_received_isr(&port, (uint8_t)i);
    assert_int_equal(board_port_take(&port, bytes, &last_ns), BOARD_BYTES);
    assert_int_equal(bytes[BOARD_BYTES - 1], (uint8_t)(BOARD_BYTES - 1));
}

static void a_port_sends_all_once(void **state)
{
    static struct board_port port;
    uint8_t bytes[256];
    (void)state;

    for (unsigned i = 0; i < sizeof bytes; i++)
        bytes[i] = (uint8_t)i;
    board_port_send(&port, bytes, sizeof bytes);
    assert_int_equal(starts, 1);
    for (unsigned i = 0; i < sizeof bytes; i++) {
        assert_true(board_port_is_sending(&port));
        assert_int_equal(board_port_next_isr(&port), (int)i);
    }
    assert_false(board_port_is_sending(&port));
    assert_int_equal(board_port_next_isr(&port), -1);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(bytes_of_a_port_wrap),
        cmocka_unit_test(a_port_sends_all_once),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
