/* motion/otg/check_internal.h - between the files of the check:
 *
 *   check.c          phase by phase, and the end
 *   check_limits.c   limits in the plan's units
 *   check_carrier.c  what a track lays on one phase */
#ifndef MOTION_OTG_CHECK_INTERNAL_H
#define MOTION_OTG_CHECK_INTERNAL_H

#include "motion/otg/internal.h"

struct otg_check {
    const struct motion_otg_plan *plan;
    const struct motion_otg_move *move;
    struct motion_u128 start, goal, up, down; /* V there, and at its limits */
    struct motion_u128 up_in, down_in; /* with the room that trimming needs */
    int64_t acc_max, acc_min;
    int64_t trimmed, slack; /* W; that room, 2^9 W or where that is_coarse W */
    uint64_t fives;         /* see jerk_is_kept */
    uint64_t jerk[2];
    int step_down;
    bool has_vel, has_acc, has_jerk, is_coarse;
    bool is_in[2]; /* the velocity has been below its limit, above the lower */
};

void motion_otg_check_init(struct otg_check *c,
                           const struct motion_otg_move *move,
                           const struct motion_otg_plan *plan);

enum otg_check_end { OTG_CHECK_START, OTG_CHECK_GOAL };

/* What the velocity may rise to (fall to, upside down, with sign -1): the
 * limit, or what the start or the goal makes necessary. */
struct motion_u128 motion_otg_check_widened(const struct otg_check *c, int sign,
                                            enum otg_check_end end);

/* Room above v (below it with sign -1). */
static inline struct motion_u128 otg_check_room(const struct otg_check *c,
                                                struct motion_u128 v, int sign)
{
    return sign > 0 ? wide_sub(c->up, v) : wide_sub(v, c->down);
}

/* The velocity rises (falls) from where it is v while |a| goes to zero on the
 * way to b on the other side: by a^2 n / (|a| + |b|), at most |a| n. */
bool motion_otg_check_crest(struct motion_u128 room, int64_t a, int64_t b,
                            int64_t n, int off);

/* Is what a plan of one phase leaves of its goal, the residual it names and
 * what that leaves (V, and twice P), no more than a part of a tick and a
 * rounding make? */
bool motion_otg_check_residual(const struct otg_check *c,
                               struct motion_u128 vel, struct wider twice);

/* Is there room for what a track's carrier takes of what is missing at the end
 * (V, and twice P), rounded up to a power of two, or is it no more than the
 * coefficients of its segment leave open?  In V it is 2 d / 2 n. */
bool motion_otg_check_carried(const struct otg_check *c, struct motion_u128 vel,
                              struct wider twice);

#endif
