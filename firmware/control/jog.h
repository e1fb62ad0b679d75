/* firmware/control/jog.h - one axis moved by itself: to a position, or until
 * told to stop; again and again while it moves.
 *
 * A jog is a move of one axis, planned by motion/otg from where its last plan
 * is, or from the set point that was sent last, in the least time inside the
 * axis's limits.  It is played as every move: gate, following error, switches
 * and faults are the same, and the group's state is MOVING until it rests.  It
 * can be held and resumed; the override is for moves, a jog has a speed of its
 * own.  A new goal takes the place of the old one at the next tick, from full
 * motion, without a step in acceleration where the axis has a limit of jerk.
 *
 * A stop, and a fault that stops the group, brakes it by a plan of its own within the
 * stop limits, the shortest there is.  That is made between ticks, so after a fault one
 * tick goes by in which its clock slows down; where such a plan would leave the range
 * the clock goes on with that.  A fault while such a brake is played changes nothing of
 * it: torque is taken at its end.
 *
 * An axis whose drive goes by its own profile gets the goal; to stop it is
 * halted, and a drive that cannot be halted runs on to its goal.
 *
 * Whoever jogs by hand gives each goal a time and gives it anew while the key
 * is held: without a new one the axis stops.  Not on the tick: plans, so
 * divides. */
#ifndef FIRMWARE_CONTROL_JOG_H
#define FIRMWARE_CONTROL_JOG_H

#include "firmware/control/controller.h"
#include "motion/otg/replan.h"

MOTION_C_BEGIN

/* The caller's, as long as the controller may play it. */
struct controller_jog {
    /* As controller_jog_stop: what never jogs (a board) is not linked to its plans. */
    void (*brake)(struct controller *controller, bool hard);
    struct motion_segment storage[2][MOTION_OTG_PHASES];
    struct motion_track track[2];
    struct motion_otg_trajectory trajectory[2]; /* of which they are made */
    struct controller_goal goal[2]; /* of an axis that goes to goals */
    unsigned which;                 /* in use */
    unsigned axis;
    int64_t until_ns; /* stops then, unless kept alive; 0: never */
};

struct controller_jog_goal {
    unsigned axis;
    int64_t pos_q32;
    int64_t vel_q32;  /* at most so fast, > 0; the axis's limit counts too */
    int64_t until_ns; /* on the time of the ticks; 0: until it is there */
};

/* In READY, or MOVING by a jog of the same axis; else, and while an axis is
 * homed, MOTION_E_STATE.  MOTION_E_LIMIT when the axis is homed and
 * would leave its range, MOTION_E_ARG, or what motion_otg_make says; the motion
 * that is under way goes on then. */
int controller_jog(struct controller *controller, struct controller_jog *jog,
                   const struct controller_jog_goal *goal);

/* To rest, whatever the clock does: by the axis's limits, and a new goal may
 * take over on the way; or (`hard`) as controller_stop, by its stop limits.
 * Cannot fail: where none by the axis's limits stays inside the range the stop
 * limits count; where these leave none either, as on an axis that turns round
 * just before the end of its range, the clock slows down and such a motion is
 * looked for in every tick from then on.  Where it is not this jog that is
 * played it is controller_stop. */
void controller_jog_stop(struct controller *controller,
                         struct controller_jog *jog, bool hard);

/* Between ticks: stop a jog whose time is over, or go on with a stop that has
 * found no motion to rest yet. */
void controller_jog_step(struct controller *controller,
                         struct controller_jog *jog);

MOTION_C_END

#endif
