/* firmware/linux/commands/otg/otg_lines.c - see otg_lines.h. */
#include "firmware/linux/commands/otg/otg_lines.h"

#include <string.h>

/* What ends a line (\n, \r\n or, as on old machines, \r) is \n. */
static int lines_byte(FILE *file)
{
    int c = getc(file);
    if (c != '\r')
        return c;
    int next = getc(file);
    if (next != '\n' && next != EOF)
        ungetc(next, file);
    return '\n';
}

static bool lines_any(struct otg_lines *lines)
{
    size_t length = 0;
    int c = lines_byte(lines->file);
    if (c == EOF)
        return false;
    lines->number++;
    for (; c != EOF && c != '\n'; c = lines_byte(lines->file)) {
        if (c == 0)
            lines->wrong = "a zero byte, expected text";
        if (length + 1 < sizeof lines->line)
            lines->line[length++] = (char)c;
        else
            lines->wrong = "the line is too long: expected 16383 bytes at most";
    }
    lines->line[length] = 0;
    return true;
}

static bool lines_is_empty(const char *line)
{
    line += strspn(line, " \t");
    return *line == '\0' || *line == '#';
}

bool otg_lines_next(struct otg_lines *lines)
{
    lines->wrong = NULL;
    do {
        if (!lines_any(lines))
            return false;
    } while (lines->wrong == NULL && lines_is_empty(lines->line));
    return true;
}
