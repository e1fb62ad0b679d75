/* firmware/linux/commands/run/jog_hand.h - what jogs are asked of: a machine of
 * this process, or the service that has the rig. */
#ifndef FIRMWARE_LINUX_COMMANDS_RUN_JOG_HAND_H
#define FIRMWARE_LINUX_COMMANDS_RUN_JOG_HAND_H

#include "firmware/linux/commands/run/live.h"

struct jog_hand_axis {
    int64_t pos_q32, vel_q32; /* actual */
    int64_t target_q32;
    bool homed;
};

struct jog_hand;
/* Those that return a text say why not: "" when it is done. */
struct jog_hand_ops {
    /* The next tick, or the next look; fills in what the hand has seen.  False,
     * with a line on stderr: nobody is there any more. */
    bool (*step)(struct jog_hand *hand);
    /* As far as it goes in a direction (-1, 1), until for_ns are over. */
    const char *(*move)(struct jog_hand *hand, unsigned axis, int direction,
                        int64_t speed_q32, int64_t for_ns);
    void (*stop)(struct jog_hand *hand, bool hard);
    const char *(*home)(struct jog_hand *hand, unsigned axis);
    const char *(*reset)(struct jog_hand *hand);
    void (*enable)(struct jog_hand *hand);
};

struct jog_hand {
    const struct jog_hand_ops *ops;
    const struct rig *rig;
    /* as it was at the last step */
    int64_t now_ns;
    enum controller_state state;
    bool enabling, homing;
    char doing[64]; /* a word for the state, or the homing's step */
    char fault[MACHINE_FAULT_MAX]; /* or why homing failed; "" */
    struct jog_hand_axis *axis;    /* of the rig; on the heap */
};

/* The machine of this process. */
struct jog_hand_live {
    struct jog_hand hand;
    struct live *live;
};
void jog_hand_live_init(struct jog_hand_live *self, struct live *live);
void jog_hand_live_free(struct jog_hand_live *self);

/* A goal so far away in a direction (-1, 1) that only the dead-man stops it, or
 * the end of the range of an axis that is homed. */
int64_t jog_far_q32(const struct live *live, unsigned axis, int direction,
                    int64_t speed_q32);

#endif
