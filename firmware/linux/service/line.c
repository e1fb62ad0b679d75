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
    scan->any = true;
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

static bool line_is_number(const char *id)
{
    static const char digits[] = "0123456789";
    const char *at = id + (id[0] == '-');
    size_t n = strspn(at, digits);
    if (n == 0 || (n > 1 && at[0] == '0'))
        return false;
    at += n;
    if (at[0] == '.') {
        n = strspn(at + 1, digits);
        at += n > 0 ? n + 1 : 0;
    }
    if (at[0] == 'e' || at[0] == 'E') {
        const size_t sign = at[1] == '-' || at[1] == '+';
        n = strspn(at + 1 + sign, digits);
        at += n > 0 ? n + 1 + sign : 0;
    }
    return at[0] == '\0';
}

static bool line_is_text(const char *id)
{
    static const char hex[] = "0123456789abcdefABCDEF";
    const char *at = id + 1;
    if (id[0] != '"')
        return false;
    while ((unsigned char)*at >= ' ' && *at != '"') {
        const bool escapes = *at++ == '\\';
        if (escapes && *at == 'u' && strspn(at + 1, hex) >= 4)
            at += 5;
        else if (escapes && *at != '\0' && strchr("\"\\/bfnrt", *at) != NULL)
            at++;
        else if (escapes)
            return false;
    }
    return strcmp(at, "\"") == 0;
}

bool service_line_id_is_whole(const char *id)
{
    return line_is_number(id) || line_is_text(id);
}

bool service_line_is_stop(const struct service_line_scan *scan)
{
    return scan->is_stop && scan->is_over && !scan->is_broken &&
           scan->depth == 0;
}
