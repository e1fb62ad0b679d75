/* firmware/host/base/error.h - what went wrong, said to the user.
 *
 * A line on stderr, kept for the JSON object that --json gives when a command
 * fails before it has a report of its own. */
#ifndef FIRMWARE_HOST_BASE_ERROR_H
#define FIRMWARE_HOST_BASE_ERROR_H

#define ERROR_SAID_MAX 4096

/* One sentence, without line end. */
void error_say(const char *format, ...) __attribute__((format(printf, 1, 2)));

/* All that was said, a line each, without the last line end; what does not fit
 * is left out.  "" when nothing was. */
const char *error_said(void);

#endif
