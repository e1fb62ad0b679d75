/* firmware/linux/tools/kind.h - what a kind of drive does for the tools; see
 * firmware/host/rig/kind.h. */
#ifndef FIRMWARE_LINUX_TOOLS_KIND_H
#define FIRMWARE_LINUX_TOOLS_KIND_H

#include "firmware/linux/tools/reset.h"
#include "firmware/linux/tools/session.h"

/* How a kind on a plain CAN bus is told from the others. */
struct tool_ear {
    const char *text; /* "ODrive" */
    /* Is this frame of one, with that number and that state? */
    bool (*is_of)(const struct hal_can_frame *frame, uint8_t *id,
                  uint8_t *state);
    unsigned frames; /* so many are no accident */
    /* Asked for by an FD frame; NULL: it speaks by itself, in classic frames,
     * and takes CANopen's questions for orders. */
    void (*client)(struct hal_can_frame *frame, uint8_t id);
    const char *(*state_text)(unsigned state);
};

struct tool_kind {
    const char *word;     /* of --kind; NULL: not of a CAN interface */
    const char *number;   /* what its number is: "node" or "unit" */
    uint8_t first, last;  /* of its numbers */
    const char *expected; /* "is no node, expected 1 .. 127" */
    struct tool_ear ear;  /* text NULL: it is found otherwise */
    /* Makes a CAN interface a bus for it; only with a word.  -1 with a
     * sentence. */
    int (*take)(struct rig_bus *bus, char message[YAML_MESSAGE_MAX]);
    /* Its bus is open: make ready to ask.  0, or -1 with a sentence. */
    int (*open)(struct session *session, const struct session_config *config,
                char message[YAML_MESSAGE_MAX]);
    /* See session_is_enabled, session_text and reset_drive. */
    int (*is_enabled)(struct session *session);
    void (*text)(const struct session *session, int err,
                 char text[SESSION_TEXT_MAX]);
    int (*reset)(struct session *session, struct reset *reset);
};

#define TOOL_KIND_ROW(NAME, name, word)                                        \
    extern const struct tool_kind tool_kind_##name;
RIG_KIND_LIST(TOOL_KIND_ROW)
/* By enum rig_drive_kind. */
extern const struct tool_kind *const tool_kinds[RIG_DRIVE_KINDS];

/* "'can0' takes no FD frames": what take() says. */
int session_refuse(char message[YAML_MESSAGE_MAX], const char *who,
                   const char *what);

#endif
