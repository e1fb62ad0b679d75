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

/* As a spreadsheet writes it: quotes are blanks, and what parts the names of the first
 * line is a comma; every byte stays at its place. */
static void lines_plain(struct otg_lines *lines)
{
    const char *line = lines->line;
    bool is_quoted = false;

    if (lines->separator == 0)
        lines->separator = strchr(line, ';') != NULL   ? ';'
                           : strchr(line, ',') != NULL ? ','
                                                       : '\t';
    for (char *at = lines->line; *at != '\0'; at++) {
        const bool is_separator = *at == lines->separator;
        is_quoted ^= *at == '"';
        if (*at == '"' || (is_quoted && *at == ','))
            *at = ' ';
        else if (is_separator && !is_quoted)
            *at = ',';
    }
}

bool otg_lines_next(struct otg_lines *lines)
{
    lines->wrong = NULL;
    do {
        if (!lines_any(lines))
            return false;
    } while (lines->wrong == NULL && lines_is_empty(lines->line));
    lines_plain(lines);
    return true;
}
