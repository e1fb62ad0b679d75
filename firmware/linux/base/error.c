/* firmware/linux/base/error.c - see error.h. */
#include "firmware/linux/base/error.h"

#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "firmware/host/base/memory.h"

static char error_text[ERROR_SAID_MAX];

void error_say(const char *format, ...)
{
    char line[ERROR_SAID_MAX];
    va_list args;
    va_start(args, format);
    (void)vsnprintf(line, sizeof line, format, args);
    va_end(args);
    fprintf(stderr, "%s\n", line);
    const size_t used = strlen(error_text), length = strlen(line);
    if (used + length + 2 > sizeof error_text)
        return;
    if (used > 0)
        error_text[used] = '\n';
    memcpy(error_text + used + (used > 0), line, length + 1);
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
