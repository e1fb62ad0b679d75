/* firmware/linux/tools/turn_client_parts.h - between turn_client.c and the kinds of
 * drive. */
#ifndef FIRMWARE_LINUX_TOOLS_TURN_CLIENT_PARTS_H
#define FIRMWARE_LINUX_TOOLS_TURN_CLIENT_PARTS_H

#include "firmware/linux/tools/turn_client.h"

/* Is this the frame that is waited for? */
typedef bool turn_client_match(const struct turn_client *client,
                               const struct hal_can_frame *frame,
                               const void *what);
/* Sends `question` (NULL: none) and waits at most so long. */
int turn_client_frame(struct turn_client *client,
                      const struct hal_can_frame *question,
                      turn_client_match *match, const void *what,
                      int64_t most_ns, struct hal_can_frame *answer);
int turn_client_send(struct turn_client *client,
                     const struct hal_can_frame *frame);

/* What a kind of them is asked, and how. */
struct turn_client_family {
    int (*hello)(struct turn_client *client);
    int (*read)(struct turn_client *client, const struct quantity *quantity,
                uint32_t *raw);
    int (*write)(struct turn_client *client, const struct quantity *quantity,
                 uint32_t raw);
    int (*state)(struct turn_client *client, struct turn_client_state *state);
    int (*clear)(struct turn_client *client);
    const char *(*state_text)(unsigned state);
    void (*reason)(const struct turn_client *client,
                   const struct turn_client_state *state,
                   char text[TURN_CLIENT_REASON_MAX]);
};

#endif
