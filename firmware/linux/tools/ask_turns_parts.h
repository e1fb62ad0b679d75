/* firmware/linux/tools/ask_turns_parts.h - between ask_turns.c and the kinds of
 * drive. */
#ifndef FIRMWARE_LINUX_TOOLS_ASK_TURNS_PARTS_H
#define FIRMWARE_LINUX_TOOLS_ASK_TURNS_PARTS_H

#include "firmware/linux/tools/ask_turns.h"

/* Is this the frame that is waited for? */
typedef bool ask_turns_match(const struct ask_turns *ask,
                             const struct hal_can_frame *frame,
                             const void *what);
/* Sends `question` (NULL: none) and waits at most so long. */
int ask_turns_frame(struct ask_turns *ask, const struct hal_can_frame *question,
                    ask_turns_match *match, const void *what, int64_t most_ns,
                    struct hal_can_frame *answer);
int ask_turns_send(struct ask_turns *ask, const struct hal_can_frame *frame);

/* What a kind of them is asked, and how. */
struct ask_turns_family {
    int (*hello)(struct ask_turns *ask);
    int (*read)(struct ask_turns *ask, const struct quantity *quantity,
                uint32_t *raw);
    int (*write)(struct ask_turns *ask, const struct quantity *quantity,
                 uint32_t raw);
    int (*state)(struct ask_turns *ask, struct ask_turns_state *state);
    int (*clear)(struct ask_turns *ask);
    const char *(*state_text)(unsigned state);
    void (*reason)(const struct ask_turns *ask,
                   const struct ask_turns_state *state,
                   char text[ASK_TURNS_REASON_MAX]);
};

#endif
