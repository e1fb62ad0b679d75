/* firmware/mcu/board/main.c - the image: the tick moves the axes, the main loop
 * answers the line.
 *
 * The watchdog is fed here, and only when the tick has come since: it stays
 * away when either of the two hangs. */
#include "firmware/mcu/board/board.h"
#include "firmware/mcu/registers.h"
#include "hal/modbus/rtu_slave.h"

#define MAIN_UNIT 1 /* Modbus address */

static struct mcu_unit_config main_config = {
    .period_ns = BOARD_PERIOD_NS,
    .hold = board_hold,
    .release = board_release,
    .stack_free = board_stack_free,
    .now_ns = board_now_ns,
    .open_line = board_master_open,
};
static struct mcu_unit main_unit;
static struct mcu_upload main_upload;
static struct mcu_registers main_registers;
static struct modbus_rtu_slave main_slave;
static volatile uint32_t main_ticks;

void board_tick_isr(int64_t now_ns)
{
    main_ticks = main_ticks + 1;
    mcu_unit_tick(&main_unit, now_ns);
    board_steer(main_unit.clock_ppb);
}

/* `was_sending` is the port's. */
static void main_serve(struct board_port *port, struct modbus_station *station,
                       bool *was_sending)
{
    static uint8_t bytes[BOARD_BYTES];
    static uint8_t frame[MODBUS_FRAME_MAX];
    int64_t last_ns;
    unsigned length;

    /* In this order: a master may ask again as soon as it has the answer. */
    if (*was_sending && !board_port_is_sending(port)) {
        *was_sending = false;
        station->ops->sent(station, board_now_ns());
    }
    length = board_port_take(port, bytes, &last_ns);
    if (length > 0)
        station->ops->recv(station, bytes, length, last_ns);
    if (*was_sending)
        return;
    if (board_now_ns() < station->ops->due_ns(station))
        return;
    length = station->ops->poll(station, board_now_ns(), frame);
    if (length == 0)
        return;
    *was_sending = true;
    board_port_send(port, frame, length);
}

/* The tick has the mailbox of the same master. */
static void main_serve_drives(void)
{
    static bool was_sending;

    board_hold();
    if (board_memory.servos->is_on)
        main_serve(&board_master_port, &board_memory.servos->master.station,
                   &was_sending);
    board_release();
}

int main(void)
{
    const struct modbus_rtu_line line = { .baud = BOARD_BAUD,
                                          .parity = MODBUS_PARITY_NONE,
                                          .stop_bits = 1 };
    uint32_t ticks = 0;
    bool was_sending = false;

    board_hold();
    main_config.board = board_memory.board;
    main_config.ring = board_memory.ring;
    main_config.window = board_memory.window;
    main_config.log = board_memory.log;
    main_config.log_words = board_memory.log_words;
    main_config.servos = board_memory.servos;
    mcu_unit_init(&main_unit, &main_config);
    mcu_upload_init(&main_upload, &main_unit);
    mcu_registers_init(&main_registers, &main_unit, &main_upload);
    if (modbus_rtu_slave_init(&main_slave, &main_registers.slave, MAIN_UNIT,
                              &line, 0) < 0)
        return 1;
    board_release();
    for (;;) {
        main_serve(&board_slave_port, &main_slave.station, &was_sending);
        main_serve_drives();
        mcu_registers_poll(&main_registers);
        if (main_ticks != ticks)
            board_watchdog_feed();
        ticks = main_ticks;
        board_wait();
    }
}
