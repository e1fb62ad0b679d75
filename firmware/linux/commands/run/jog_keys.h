/* firmware/linux/commands/run/jog_keys.h - jogging by the keys of a terminal.
 *
 *   left, right        move the axis while held        h  home the axis
 *   shift with them    faster                          s  set a key of a move
 *   up, down           another axis                    r  reset after a fault
 *   space              stop at once                    q  stop and leave
 *
 * A terminal does not tell when a key is let go: the axis stops when no key has
 * come for the dead-man time, so does it when the terminal, or the person, is
 * gone. */
#ifndef FIRMWARE_LINUX_COMMANDS_RUN_JOG_KEYS_H
#define FIRMWARE_LINUX_COMMANDS_RUN_JOG_KEYS_H

#include "firmware/linux/base/terminal.h"
#include "firmware/linux/commands/run/jog_hand.h"

#define JOG_KEYS_MAX 1000 /* keys of a move that can be set */

struct jog_keys_config {
    unsigned axis;       /* to begin with */
    int64_t speed_q32;   /* of that axis; 0: a tenth of each axis's limit */
    int64_t dead_man_ns; /* > 0 */
};

struct jog_keys {
    const struct rig *rig;
    struct jog_hand *hand; /* while it runs */
    struct jog_keys_config config;
    struct terminal terminal;
    unsigned axis;
    int64_t shown_ns;
    bool leaving;
    char said[80];    /* the last thing that happened */
    int64_t *key_q32; /* of every axis of the rig, key by key */
    unsigned keys;
};

/* Before anything is live: room for the keys of this rig.  All zero is none. */
void jog_keys_init(struct jog_keys *self, const struct rig *rig);
void jog_keys_free(struct jog_keys *self);

/* Until the person leaves or *interrupts counts.  The machine is READY.
 * STATUS_OK, STATUS_INPUT when standard input is no terminal, or
 * STATUS_REFUSED when nobody is there any more. */
enum status jog_keys_run(struct jog_keys *self, struct jog_hand *hand,
                         const struct jog_keys_config *config,
                         const volatile sig_atomic_t *interrupts);

/* The keys that were set as a move, `every_ns` apart: 0, or -1 with a line on
 * stderr. */
int jog_keys_save(const struct jog_keys *self, const char *path,
                  int64_t every_ns);

#endif
