/* firmware/control/gantry.h - two rails that carry one bridge, each with a motor: they
 * move as one.
 *
 * A jog of either rail takes the other along: that is told the same speed and
 * acceleration in the same tick, and its place is as far from the leader's as when the
 * jog began.  The limits of both count, and the range of both.  A move has a track for
 * each, and has to keep them together itself (host/job judges it beforehand); with a
 * track for one alone it begins only where that stays within the racking of the other.
 *
 *   racking = place of rail 1 - place of rail 0
 *
 * In every tick with torque it is judged: the difference of the set points, once both
 * rails are homed, and that of the two following errors, so that drives that are measured
 * at different times may be compared.  Before they are homed their set points go together,
 * and the bridge racks as far as they follow apart.  More than racking_q32 is a fault, and
 * as every fault on one axis it stops both along the path.
 *
 * Homing (homing.h) moves both as one until each has met its switch, so that it racks the
 * bridge no further, and then squares it: one rail alone goes where its own switch says
 * that the other stands. */
#ifndef FIRMWARE_CONTROL_GANTRY_H
#define FIRMWARE_CONTROL_GANTRY_H

#include <stdbool.h>
#include <stdint.h>

#include "motion/core/clock_warp.h"
#include "motion/core/track.h"

struct controller;

struct controller_gantry {
    unsigned axis[2];    /* the rails, of one unit; in no other gantry */
    int64_t racking_q32; /* > 0, at most */
    /* the controller's: rail 1 less rail 0, of the set points of a jog; and whether
     * homing squares the bridge, so that a jog moves its own rail alone */
    int64_t apart_q32;
    bool is_alone;
};

/* Call it right after controller_init; `gantry` must outlive the controller.  MOTION_E_ARG: a
 * rail that is not there, twice, or goes to goals or on a board; no racking. */
int controller_set_gantries(struct controller *controller,
                            struct controller_gantry gantry[], unsigned count);
/* The gantry of an axis; NULL: it is no rail.  The other rail. */
struct controller_gantry *
controller_gantry_of(const struct controller *controller, unsigned axis);
unsigned controller_gantry_other(const struct controller_gantry *gantry,
                                 unsigned axis);

/* A controller with gantries calls these; one without (a board) is not linked to them. */
struct controller_gantry_ops {
    /* Tell rails that go along where they are, on the tick. */
    void (*follow)(struct controller *controller);
    /* Judge the racking, on the tick. */
    void (*judge)(struct controller *controller);
};
struct controller_gantries {
    const struct controller_gantry_ops *ops;
    /* Lower what a rail may do (`stop`: its stop limits) to what the other can, which
     * has no track of its own.  Divides nothing. */
    void (*reduce)(const struct controller *controller, unsigned axis,
                   bool stop, struct motion_clock_limit *limit);
    /* May these tracks begin?  As the couplings'. */
    int (*admit)(struct controller *controller,
                 const struct motion_track *const track[], int *axis);
};

#endif
