/* firmware/studio/server/guard.c - see guard.h. */
#include "firmware/studio/server/guard.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

bool guard_is_loopback(const char *address)
{
    return strcasecmp(address, "localhost") == 0 ||
           strcmp(address, "::1") == 0 || strcmp(address, "[::1]") == 0 ||
           (strncmp(address, "127.", 4) == 0 &&
            strspn(address, "0123456789.") == strlen(address));
}

/* The name in `host`, without brackets, and its port; 80 where there is none. */
static bool guard_split(const char *host, char name[256], unsigned *port)
{
    const bool brackets = host[0] == '[';
    const char *end = brackets ? strchr(host, ']') : strchr(host, ':');
    const char *rest;

    if (brackets && end == NULL)
        return false;
    if (end == NULL)
        end = host + strlen(host);
    rest = brackets ? end + 1 : end;
    const int length = (int)(end - host) - brackets;
    if (length <= 0 || length > 255)
        return false;
    snprintf(name, 256, "%.*s", length, host + brackets);
    *port = 80;
    if (rest[0] == 0)
        return true;
    char *last;
    if (rest[0] != ':' || rest[1] < '0' || rest[1] > '9')
        return false;
    const unsigned long number = strtoul(rest + 1, &last, 10);
    *port = (unsigned)(number < 65536 ? number : 0);
    return *last == 0 && *port > 0;
}

bool guard_is_host(const char *host, const char *address, unsigned port)
{
    char name[256];
    unsigned asked;

    if (!guard_split(host, name, &asked) || asked != port)
        return false;
    if (guard_is_loopback(address))
        return guard_is_loopback(name);
    if (strcmp(address, "0.0.0.0") == 0 || strcmp(address, "::") == 0)
        return true;
    return strcasecmp(name, address) == 0;
}

bool guard_is_origin(const char *origin, const char *host)
{
    return origin[0] == 0 || (strncmp(origin, "http://", 7) == 0 &&
                              strcasecmp(origin + 7, host) == 0);
}

static bool guard_is_same(const char *text, size_t length, const char *token)
{
    const size_t wanted = strlen(token);
    unsigned differs = length != wanted;

    for (size_t i = 0; i < wanted; i++)
        differs |= (unsigned)((i < length ? text[i] : 0) ^ token[i]);
    return differs == 0;
}

bool guard_is_token(const char *text, const char *token)
{
    return guard_is_same(text, strlen(text), token);
}

void guard_cookie_name(unsigned port, char name[GUARD_COOKIE_MAX])
{
    snprintf(name, GUARD_COOKIE_MAX, "slew-%u=", port % 65536);
}

bool guard_has_cookie(const char *cookies, const char *name, const char *token)
{
    const size_t own = strlen(name);

    while (*cookies != 0) {
        const char *end = strchr(cookies, ';');
        const size_t length =
            end == NULL ? strlen(cookies) : (size_t)(end - cookies);
        if (length > own && strncmp(cookies, name, own) == 0 &&
            guard_is_same(cookies + own, length - own, token))
            return true;
        cookies += length;
        cookies += strspn(cookies, "; ");
    }
    return false;
}

static const char guard_letters[] =
    "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789-_";

bool guard_is_good_token(const char *token)
{
    const size_t length = strlen(token);

    return length >= GUARD_TOKEN_MIN && length <= GUARD_TOKEN_MAX &&
           strspn(token, guard_letters) == length;
}

void guard_token_of(const unsigned char random[GUARD_TOKEN_NEW],
                    char token[GUARD_TOKEN_NEW + 1])
{
    for (unsigned i = 0; i < GUARD_TOKEN_NEW; i++)
        token[i] = guard_letters[random[i] % 64];
    token[GUARD_TOKEN_NEW] = 0;
}
