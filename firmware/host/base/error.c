/* firmware/host/base/error.c - see error.h. */
#include "firmware/host/base/error.h"

#include <stdarg.h>
#include <stdio.h>
#include <string.h>

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

const char *error_said(void)
{
    return error_text;
}
