/* firmware/linux/base/error.c - see error.h. */
#include "firmware/linux/base/error.h"

#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <poll.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include "firmware/host/base/memory.h"

static char error_text[ERROR_SAID_MAX];
static bool error_is_hasty;
static int error_own =
    -1; /* stderr opened anew, so that it alone does not wait */

void error_hasten(bool is_hasty)
{
    struct stat status;
    if (is_hasty && error_own < 0 && fstat(STDERR_FILENO, &status) == 0 &&
        (S_ISCHR(status.st_mode) || S_ISFIFO(status.st_mode)))
        error_own = open("/proc/self/fd/2",
                         O_WRONLY | O_NONBLOCK | O_NOCTTY | O_CLOEXEC);
    if (!is_hasty && error_own >= 0) {
        close(error_own);
        error_own = -1;
    }
    error_is_hasty = is_hasty;
}

/* Write a piece without waiting; where stderr could not be opened anew, as far as
 * there is room. */
static bool error_put_piece(const char *text, size_t length)
{
    struct pollfd reader = { .fd = STDERR_FILENO, .events = POLLOUT };
    ssize_t sent =
        send(STDERR_FILENO, text, length, MSG_DONTWAIT | MSG_NOSIGNAL);
    if (sent < 0 && errno == ENOTSOCK && error_own >= 0)
        sent = write(error_own, text, length);
    else if (sent < 0 && errno == ENOTSOCK && poll(&reader, 1, 0) > 0 &&
             (reader.revents & POLLOUT) != 0)
        sent = write(STDERR_FILENO, text, length);
    return sent >= 0;
}

void error_put(const char *text)
{
    size_t left = strlen(text);
    if (!error_is_hasty) {
        fputs(text, stderr);
        return;
    }
    for (size_t piece; left > 0; text += piece, left -= piece) {
        piece = left < PIPE_BUF ? left : PIPE_BUF;
        if (!error_put_piece(text, piece))
            return;
    }
}

void error_say(const char *format, ...)
{
    char line[ERROR_SAID_MAX + 1];
    va_list args;
    va_start(args, format);
    (void)vsnprintf(line, ERROR_SAID_MAX, format, args);
    va_end(args);
    const size_t used = strlen(error_text), length = strlen(line);
    memcpy(line + length, "\n", 2);
    error_put(line);
    if (used + length + 2 > sizeof error_text)
        return;
    if (used > 0)
        error_text[used] = '\n';
    memcpy(error_text + used + (used > 0), line, length);
    error_text[used + (used > 0) + length] = '\0';
}

enum status error_file(const char *path, const char *what)
{
    error_say("%s: %s", path, what);
    return STATUS_INPUT;
}

void error_tell(struct messages *messages)
{
    enum message_kind kind;
    const char *text;

    for (size_t at = 0; (text = messages_next(messages, &at, &kind)) != NULL;)
        if (kind == MESSAGE_ERROR)
            error_say("%s", text);
        else
            fprintf(stderr, "%s\n", text);
    messages_free(messages);
}

const char *error_said(void)
{
    return error_text;
}

void memory_fail(void)
{
    fputs("slew: out of memory\n", stderr);
    exit(STATUS_SYSTEM);
}
