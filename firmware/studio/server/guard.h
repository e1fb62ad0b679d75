/* firmware/studio/server/guard.h - whose requests are answered.
 *
 * A page of another site in the same browser can send requests to a server on
 * this machine; by its Host and its Origin it is known.  Pure. */
#ifndef FIRMWARE_STUDIO_SERVER_GUARD_H
#define FIRMWARE_STUDIO_SERVER_GUARD_H

#include <stdbool.h>

#define GUARD_TOKEN_MIN 16
#define GUARD_TOKEN_MAX 128
#define GUARD_TOKEN_NEW 43 /* 256 bits */

/* Is it an address of this machine alone: 127.0.0.0/8, ::1, localhost? */
bool guard_is_loopback(const char *address);

/* Is `host` (of a request, with or without a port) the server at that address
 * and port?  A server for loopback is that by any of its names; one for another
 * address by that address, or by any name where it is for all (0.0.0.0, ::). */
bool guard_is_host(const char *host, const char *address, unsigned port);
/* Is `origin` the page of the server that `host` names?  "" where there is
 * none: no browser sends that from another page with what changes anything. */
bool guard_is_origin(const char *origin, const char *host);

/* The name of the cookie of the server at this port: cookies know no ports. */
#define GUARD_COOKIE_MAX 16
void guard_cookie_name(unsigned port, char name[GUARD_COOKIE_MAX]);
/* The value of the cookie of this name is the token; also of a query
 * "token=...".  Takes as long whatever is wrong. */
bool guard_has_cookie(const char *cookies, const char *name, const char *token);
bool guard_is_token(const char *text, const char *token);
/* Letters, digits, - and _ only, GUARD_TOKEN_MIN to GUARD_TOKEN_MAX of them. */
bool guard_is_good_token(const char *token);
/* One of random bytes. */
void guard_token_of(const unsigned char random[GUARD_TOKEN_NEW],
                    char token[GUARD_TOKEN_NEW + 1]);

#endif
