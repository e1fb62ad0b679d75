/* firmware/mcu/board/board.h - what an image needs of its board: a tick, time,
 * serial ports, a watchdog.  One file per board, cortex_m.c for all. */
#ifndef FIRMWARE_MCU_BOARD_BOARD_H
#define FIRMWARE_MCU_BOARD_BOARD_H

#include <stdbool.h>
#include <stdint.h>

#include "firmware/mcu/unit.h"

#define BOARD_PERIOD_NS  INT64_C(1000000)
#define BOARD_TICKS_S    1000u
#define BOARD_BAUD       115200u
#define BOARD_BYTES      512 /* of a port, received and not taken yet; 2^n */
#define BOARD_IRQ_SERIAL 0x40
#define BOARD_IRQ_TICK   0x80 /* greater: gives way to the ports */

/* A serial port between its interrupts and the main loop. */
struct board_port {
    uint8_t received[BOARD_BYTES];
    volatile uint32_t put, taken; /* bytes ever */
    volatile int64_t last_ns;     /* when the last one came */
    uint8_t sending[256];
    volatile uint32_t sent, to_send;
};

/* ---- the board's own file ---- */

/* What struct mcu_unit_config has of the board's own. */
struct board_memory {
    uint16_t board;
    struct motion_segment *ring;
    uint32_t window;
    int64_t *log;
    uint32_t log_words;
    struct mcu_servos *servos;
};
extern const struct board_memory board_memory;
/* Clocks, ports and watchdog; bits of the processor's clock per second. */
uint32_t board_init(void);
void board_watchdog_feed(void);
/* The port that others command this board by. */
extern struct board_port board_slave_port;
/* The port to servo drives, silent until it is opened; the direction of RS-485
 * is its transceiver's to switch.  MOTION_E_ARG: it cannot be such a line. */
extern struct board_port board_master_port;
int board_master_open(const struct modbus_rtu_line *line);
void board_port_start(struct board_port *port); /* something is to be sent */

/* ---- cortex_m.c ---- */

/* Since the start. */
int64_t board_now_ns(void);
/* In the tick: those to come are faster by so many 1e-9, +-MCU_CLOCK_MAX. */
void board_steer(int32_t ppb);
/* Keep the tick away, and let it come; nothing else is. */
void board_hold(void);
void board_release(void);
void board_wait(void); /* for the next interrupt */
void board_enable_irq(unsigned irq);
uint32_t board_stack_free(void);

/* ---- port.c ---- */

void board_port_received_isr(struct board_port *port, uint8_t byte);
/* 0..255: what to send next; -1: nothing more. */
int board_port_next_isr(struct board_port *port);
unsigned board_port_take(struct board_port *port, uint8_t bytes[BOARD_BYTES],
                         int64_t *last_ns);
void board_port_send(struct board_port *port, const uint8_t bytes[],
                     unsigned length);
bool board_port_is_sending(const struct board_port *port);

/* ---- main.c ---- */

int main(void);
void board_tick_isr(int64_t now_ns);

#endif
