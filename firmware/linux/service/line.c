/* firmware/linux/service/line.c - see line.h. */
#include "firmware/linux/service/line.h"

#include <string.h>

static void line_add(struct service_line_scan *scan, char byte)
{
    if (scan->depth != 1)
        return;
    if (scan->length < sizeof scan->token - 1)
        scan->token[scan->length] = byte;
    scan->length++;
}

static bool line_is(const struct service_line_scan *scan, const char *token)
{
    return scan->length == strlen(token) &&
           memcmp(scan->token, token, scan->length) == 0;
}

/* Of two members of one name the first counts. */
static void line_end_member(struct service_line_scan *scan)
{
    const bool fits = scan->length < sizeof scan->token;
    if (scan->member == LINE_COMMAND && !scan->has_command) {
        scan->has_command = true;
        scan->is_stop = line_is(scan, "\"stop\"");
    }
    if (scan->member == LINE_ID && fits && scan->length > 0 &&
        strchr("\"-0123456789", scan->token[0]) != NULL) {
        memcpy(scan->id, scan->token, scan->length);
        scan->id[scan->length] = '\0';
    }
    scan->member = LINE_OTHER;
    scan->length = 0;
}

static void line_bracket(struct service_line_scan *scan, char byte)
{
    if (byte == '{' || byte == '[') {
        scan->is_broken |= scan->depth == 0 && byte == '[';
        scan->length = sizeof scan->token; /* no plain value */
        scan->depth++;
        scan->values++;
        if (scan->depth == 1)
            scan->length = 0;
        return;
    }
    if (scan->depth == 1)
        line_end_member(scan);
    scan->is_broken |= scan->depth == 0;
    scan->depth -= scan->depth > 0;
    scan->is_over |= scan->depth == 0;
}

void service_line_take(struct service_line_scan *scan, char byte)
{
    if (scan->in_string) {
        scan->in_string = byte != '"' || scan->is_escaped;
        scan->is_escaped = byte == '\\' && !scan->is_escaped;
        line_add(scan, byte);
        return;
    }
    if (byte == ' ' || byte == '\t' || byte == '\r')
        return;
    scan->is_broken |= scan->is_over || (scan->depth == 0 && byte != '{');
    switch (byte) {
    case '"':
        scan->in_string = true;
        line_add(scan, byte);
        break;
    case '{':
    case '[':
    case '}':
    case ']':
        line_bracket(scan, byte);
        break;
    case ',':
        scan->values++;
        if (scan->depth == 1)
            line_end_member(scan);
        break;
    case ':':
        if (scan->depth != 1)
            break;
        scan->member = line_is(scan, "\"command\"") ? LINE_COMMAND
                       : line_is(scan, "\"id\"")    ? LINE_ID
                                                    : LINE_OTHER;
        scan->length = 0;
        break;
    default:
        line_add(scan, byte);
    }
}

bool service_line_is_stop(const struct service_line_scan *scan)
{
    return scan->is_stop && scan->is_over && !scan->is_broken &&
           scan->depth == 0;
}
