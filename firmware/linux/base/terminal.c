/* firmware/linux/base/terminal.c - see terminal.h. */
#include "firmware/linux/base/terminal.h"

#include <errno.h>
#include <fcntl.h>
#include <string.h>
#include <unistd.h>

#include "firmware/host/base/array.h"

#define TERMINAL_ESCAPE 27

int terminal_open(struct terminal *terminal)
{
    struct termios raw;
    *terminal = (struct terminal){ .is_open = false };
    if (!isatty(STDIN_FILENO) || tcgetattr(STDIN_FILENO, &raw) < 0)
        return -1;
    terminal->before = raw;
    raw.c_lflag &= ~(tcflag_t)(ICANON | ECHO);
    raw.c_cc[VMIN] = 0;
    raw.c_cc[VTIME] = 0;
    if (tcsetattr(STDIN_FILENO, TCSANOW, &raw) < 0)
        return -1;
    for (int fd = 0; fd < 2; fd++) {
        terminal->flags_before[fd] = fcntl(fd, F_GETFL);
        (void)fcntl(fd, F_SETFL, terminal->flags_before[fd] | O_NONBLOCK);
    }
    terminal->is_open = true;
    return 0;
}

void terminal_close(struct terminal *terminal)
{
    if (!terminal->is_open)
        return;
    terminal->is_open = false;
    for (int fd = 1; fd >= 0; fd--)
        (void)fcntl(fd, F_SETFL, terminal->flags_before[fd]);
    (void)tcsetattr(STDIN_FILENO, TCSANOW, &terminal->before);
}

static void terminal_drop(struct terminal *terminal, size_t count)
{
    terminal->length -= count;
    memmove(terminal->text, terminal->text + count, terminal->length);
}

/* What xterm and its kin send for keys without a character. */
static const struct {
    const char *text;
    int key;
} terminal_keys[] = {
    { "[D", TERMINAL_LEFT },         { "[C", TERMINAL_RIGHT },
    { "[A", TERMINAL_UP },           { "[B", TERMINAL_DOWN },
    { "OD", TERMINAL_LEFT },         { "OC", TERMINAL_RIGHT },
    { "OA", TERMINAL_UP },           { "OB", TERMINAL_DOWN },
    { "[1;2D", TERMINAL_FAST_LEFT }, { "[1;2C", TERMINAL_FAST_RIGHT },
    { "[d", TERMINAL_FAST_LEFT },    { "[c", TERMINAL_FAST_RIGHT },
};

/* An escape sequence at the front: its key, or 0; *length is how long. */
static int terminal_sequence(const struct terminal *terminal, size_t *length)
{
    for (size_t i = 0; i < ARRAY_LEN(terminal_keys); i++) {
        *length = strlen(terminal_keys[i].text) + 1;
        if (terminal->length >= *length &&
            memcmp(terminal->text + 1, terminal_keys[i].text, *length - 1) == 0)
            return terminal_keys[i].key;
    }
    return TERMINAL_NONE;
}

/* One that is not known ends with a letter or a tilde. */
static size_t terminal_unknown(const struct terminal *terminal)
{
    size_t i = 2;
    while (i < terminal->length &&
           !((terminal->text[i] >= '@' && terminal->text[i] <= '~')))
        i++;
    return i < terminal->length ? i + 1 : terminal->length;
}

static int terminal_take(struct terminal *terminal)
{
    const int first = (unsigned char)terminal->text[0];
    size_t length = 1;
    int key = first;
    if (first == TERMINAL_ESCAPE && terminal->length > 1) {
        key = terminal_sequence(terminal, &length);
        if (key == TERMINAL_NONE)
            length = terminal_unknown(terminal);
    }
    terminal_drop(terminal, length);
    return key;
}

int terminal_key(struct terminal *terminal)
{
    const ssize_t count = read(STDIN_FILENO, terminal->text + terminal->length,
                               sizeof terminal->text - terminal->length);
    if (count > 0)
        terminal->length += (size_t)count;
    else if (count < 0 && errno != EAGAIN && errno != EINTR)
        return TERMINAL_END;
    return terminal->length == 0 ? TERMINAL_NONE : terminal_take(terminal);
}

void terminal_write(const struct terminal *terminal, const char *text)
{
    if (terminal->is_open && write(STDOUT_FILENO, text, strlen(text)) < 0)
        return; /* a terminal that does not keep up misses a line */
}
