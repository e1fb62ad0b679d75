/* firmware/linux/base/terminal.h - keys from a terminal as they are pressed,
 * and text on it that is thrown away rather than waited for.
 *
 * A terminal sends a key again and again while it is held, and nothing when it
 * is let go.  Ctrl-C stays what it is. */
#ifndef FIRMWARE_LINUX_BASE_TERMINAL_H
#define FIRMWARE_LINUX_BASE_TERMINAL_H

#include <stdbool.h>
#include <stddef.h>
#include <termios.h>

enum terminal_key {
    TERMINAL_NONE = 0,
    /* 1 .. 255: the character */
    TERMINAL_LEFT = 256,
    TERMINAL_RIGHT,
    TERMINAL_UP,
    TERMINAL_DOWN,
    TERMINAL_FAST_LEFT, /* with shift */
    TERMINAL_FAST_RIGHT,
    TERMINAL_END, /* the terminal is gone */
};

struct terminal {
    struct termios before;
    int flags_before[2]; /* of standard input and output */
    bool is_open;
    char text[32]; /* read and not understood yet */
    size_t length;
};

/* Takes the terminal of standard input.  -1 when it is none. */
int terminal_open(struct terminal *terminal);
/* As it was before; does nothing when it is not open. */
void terminal_close(struct terminal *terminal);

/* The oldest key that was not asked for yet; never waits. */
int terminal_key(struct terminal *terminal);
/* To standard output, as far as it takes it at once. */
void terminal_write(const struct terminal *terminal, const char *text);

#endif
