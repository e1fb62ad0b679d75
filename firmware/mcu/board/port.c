/* firmware/mcu/board/port.c - see board.h.  One side writes each counter. */
#include "firmware/mcu/board/board.h"

void board_port_received_isr(struct board_port *port, uint8_t byte)
{
    const uint32_t put = port->put;

    port->last_ns = board_now_ns();
    if (put - port->taken == BOARD_BYTES)
        return; /* more than any frame: its checksum will tell */
    port->received[put % BOARD_BYTES] = byte;
    port->put = put + 1;
}

int board_port_next_isr(struct board_port *port)
{
    const uint32_t sent = port->sent;

    if (sent == port->to_send)
        return -1;
    port->sent = sent + 1;
    return port->sending[sent];
}

/* The time and the count belong together: read again when a byte came between. */
unsigned board_port_take(struct board_port *port, uint8_t bytes[BOARD_BYTES],
                         int64_t *last_ns)
{
    unsigned count = 0;
    uint32_t put;

    do {
        put = port->put;
        *last_ns = port->last_ns;
    } while (put != port->put);
    while (port->taken != put) {
        bytes[count++] = port->received[port->taken % BOARD_BYTES];
        port->taken = port->taken + 1;
    }
    return count;
}

void board_port_send(struct board_port *port, const uint8_t bytes[],
                     unsigned length)
{
    for (unsigned i = 0; i < length; i++)
        port->sending[i] = bytes[i];
    port->sent = 0;
    port->to_send = length;
    board_port_start(port);
}

bool board_port_is_sending(const struct board_port *port)
{
    return port->sent != port->to_send;
}
