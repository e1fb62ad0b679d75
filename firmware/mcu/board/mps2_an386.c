/* firmware/mcu/board/mps2_an386.c - Arm MPS2 board with the image AN386: a
 * Cortex-M4 at 25 MHz, 4 MB of RAM.
 * Source: Arm, Application Note AN386, table 3-1 and 3-2; Cortex-M System
 * Design Kit, APB UART and watchdog. */
#include "firmware/mcu/board/board.h"
#include "firmware/mcu/board/cortex_m.h"

#define CLOCK_HZ   25000000u
#define WINDOW     512
#define LOG_WORDS  (256 * 1024)
#define STATE_TX   1u /* its buffer is full */
#define STATE_RX   2u
#define CTRL_ALL   0xFu /* both directions with interrupts */
#define WATCHDOG_S 2    /* half a second */

#define UART_DATA(base)    REGISTER((base) + 0x00)
#define UART_STATE(base)   REGISTER((base) + 0x04)
#define UART_CTRL(base)    REGISTER((base) + 0x08)
#define UART_INT(base)     REGISTER((base) + 0x0C)
#define UART_BAUDDIV(base) REGISTER((base) + 0x10)
#define UART0              0x40004000u
#define UART1              0x40005000u
#define IRQ_UART0_RX       0
#define IRQ_UART0_TX       1
#define IRQ_UART1_RX       2
#define IRQ_UART1_TX       3

#define WDOG_LOAD    REGISTER(0x40008000)
#define WDOG_CONTROL REGISTER(0x40008008)
#define WDOG_INTCLR  REGISTER(0x4000800C)
#define WDOG_LOCK    REGISTER(0x40008C00)
#define WDOG_UNLOCK  0x1ACCE551u

static struct motion_segment mps2_ring[MCU_AXES_MAX * 2 * WINDOW];
static int64_t mps2_log[LOG_WORDS];
static struct mcu_servos mps2_servos;
struct board_port board_slave_port, board_master_port;

const struct board_memory board_memory = { .board = 1,
                                           .ring = mps2_ring,
                                           .window = WINDOW,
                                           .log = mps2_log,
                                           .log_words = LOG_WORDS,
                                           .servos = &mps2_servos };

uint32_t board_init(void)
{
    UART_BAUDDIV(UART0) = CLOCK_HZ / BOARD_BAUD;
    UART_CTRL(UART0) = CTRL_ALL;
    board_enable_irq(IRQ_UART0_RX);
    board_enable_irq(IRQ_UART0_TX);
    WDOG_LOCK = WDOG_UNLOCK;
    WDOG_LOAD = CLOCK_HZ / WATCHDOG_S;
    WDOG_CONTROL = 3;
    return CLOCK_HZ;
}

/* The first time-out is an NMI, which leaves it at that; the second resets.
 * (QEMU's time jumps by as long as its machine has paused.) */
void board_watchdog_feed(void)
{
    WDOG_INTCLR = 1;
}

void board_nmi_isr(void)
{
}

/* Eight bits, no parity, one stop bit: it has no other. */
int board_master_open(const struct modbus_rtu_line *line)
{
    if (line->parity != MODBUS_PARITY_NONE || line->stop_bits != 1)
        return MOTION_E_ARG;
    UART_BAUDDIV(UART1) = (CLOCK_HZ + line->baud / 2) / line->baud;
    UART_CTRL(UART1) = CTRL_ALL;
    board_enable_irq(IRQ_UART1_RX);
    board_enable_irq(IRQ_UART1_TX);
    return MOTION_OK;
}

static void mps2_take(uint32_t uart, struct board_port *port)
{
    UART_INT(uart) = 2;
    while ((UART_STATE(uart) & STATE_RX) != 0)
        board_port_received_isr(port, (uint8_t)UART_DATA(uart));
}

static void mps2_send(uint32_t uart, struct board_port *port)
{
    UART_INT(uart) = 1;
    while ((UART_STATE(uart) & STATE_TX) == 0) {
        const int next = board_port_next_isr(port);
        if (next < 0)
            return;
        UART_DATA(uart) = (uint32_t)next;
    }
}

static void mps2_slave_receive_isr(void)
{
    mps2_take(UART0, &board_slave_port);
}

static void mps2_slave_sent_isr(void)
{
    mps2_send(UART0, &board_slave_port);
}

static void mps2_master_receive_isr(void)
{
    mps2_take(UART1, &board_master_port);
}

static void mps2_master_sent_isr(void)
{
    mps2_send(UART1, &board_master_port);
}

/* The interrupt comes when the buffer empties: the first byte has none. */
void board_port_start(struct board_port *port)
{
    const int next = board_port_next_isr(port);

    if (next >= 0)
        UART_DATA(port == &board_slave_port ? UART0 : UART1) = (uint32_t)next;
}

__attribute__((section(".irqs"), used)) void (*const board_irq_vectors[])(
    void) = { mps2_slave_receive_isr, mps2_slave_sent_isr,
              mps2_master_receive_isr, mps2_master_sent_isr };
