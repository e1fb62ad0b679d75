/* firmware/host/base/messages.h - sentences for the user.
 *
 * Host collects them, in the order in which they came up; the program prints
 * them. */
#ifndef FIRMWARE_HOST_BASE_MESSAGES_H
#define FIRMWARE_HOST_BASE_MESSAGES_H

#include <stddef.h>

/* An error is why something was refused, a warning goes with what was done. */
enum message_kind { MESSAGE_ERROR, MESSAGE_WARNING };

/* Zeroed: none. */
struct messages {
    char *text; /* of each its kind, the sentence and a 0; on the heap */
    size_t length;
};

/* One sentence, without line end; longer ones are cut at MESSAGE_MAX. */
#define MESSAGE_MAX 4096
void messages_add(struct messages *messages, enum message_kind kind,
                  const char *format, ...)
    __attribute__((format(printf, 3, 4)));

/* The sentence at *at, which starts at 0 and is moved on; NULL after the
 * last. */
const char *messages_next(const struct messages *messages, size_t *at,
                          enum message_kind *kind);

/* Add all of `from`, which has none then. */
void messages_move(struct messages *messages, struct messages *from);

void messages_free(struct messages *messages);

#endif
