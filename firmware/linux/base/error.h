/* firmware/linux/base/error.h - what went wrong, said to the user.
 *
 * A line on stderr, kept for the JSON object that --json gives when a command
 * fails before it has a report of its own. */
#ifndef FIRMWARE_LINUX_BASE_ERROR_H
#define FIRMWARE_LINUX_BASE_ERROR_H

#include <stdbool.h>

#include "firmware/host/base/messages.h"
#include "firmware/host/base/status.h"

#define ERROR_SAID_MAX 4096

/* One sentence, without line end. */
void error_say(const char *format, ...) __attribute__((format(printf, 1, 2)));

/* Text on stderr, as it is, and not kept. */
void error_put(const char *text);

/* Wait for no reader from now on, and leave out what finds no room.  Whoever ticks,
 * serves a tick or guards one does so until that is over. */
void error_hasten(bool is_hasty);

/* "path: what": what is wrong with a file.  STATUS_INPUT. */
enum status error_file(const char *path, const char *what);

/* What host has to say, errors as error_say does; `messages` is empty then. */
void error_tell(struct messages *messages);

/* All that was said, a line each, without the last line end; what does not fit
 * is left out.  "" when nothing was. */
const char *error_said(void);

#endif
