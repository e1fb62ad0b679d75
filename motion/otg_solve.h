/* motion/otg_solve.h - the fastest way from one state of motion to another.
 *
 * Position, velocity and acceleration are driven by a bounded jerk.  For a
 * fixed duration T the motions that obey the limits form a convex set, so the
 * displacements they reach form one interval [Dmin(T), Dmax(T)].  The fastest
 * motion over d is the first T with Dmin(T) <= d <= Dmax(T).  The motions on
 * the two borders are known in closed form, one parameter each; so the search
 * is for one root of one smooth function, and there is no list of cases to try.
 * docs/OTG.md derives everything used here.
 *
 * Works on reals (otg_math.h); proposes only, otg_exact.c makes the proposal
 * exact and otg_check.c judges it. */
#ifndef MOTION_OTG_SOLVE_H
#define MOTION_OTG_SOLVE_H

#include <stdbool.h>
#include <stdint.h>

#include "motion/otg_math.h"

/* Displacement d from (v0, a0) to (vf, af); vn <= v <= vx, an <= a <= ax,
 * an < 0 < ax; jerk within +-j before the cruise and +-j2 after it.  Both ends
 * must be inside (otg_brake.c brings them there). */
struct otg_problem {
    struct real d, v0, a0, vf, af;
    struct real vx, vn, ax, an;
    struct real j, j2;
    struct real per_j, per_j2; /* 1/j, 1/j2 */
};

/* The acceleration as a polyline: in each phase it runs straight to `a`. */
struct otg_phase {
    struct real dt, a;
};

#define OTG_SHAPE_MAX 24

struct otg_shape {
    struct otg_phase phase[OTG_SHAPE_MAX];
    int count;
    int brake, turn; /* j limits the phases before `brake`, j2 those from
                        `turn` on, the lower those between */
};

/* The phases are not cleared: nothing reads beyond `count`. */
static inline void otg_shape_init(struct otg_shape *shape)
{
    shape->count = shape->brake = shape->turn = 0;
}

static inline void otg_shape_add(struct otg_shape *shape, struct real dt,
                                 struct real a)
{
    shape->phase[shape->count++] = (struct otg_phase){ dt, a };
}

/* Duration and displacement of a shape from v0, a0; *v is left at the end. */
struct otg_reach {
    struct real t, d;
};
struct otg_reach motion_otg_shape_reach(const struct otg_shape *shape,
                                        struct real *v, struct real a0);

/* Append the fastest motion.  Always finds one for a problem as above.  Where
 * it uses both jerks, brake and turn are set to where the second begins. */
void motion_otg_solve(const struct otg_problem *problem,
                      struct otg_shape *shape);

/* Append the fastest motion from (v0, a0) to (vf, af) whatever it covers;
 * vx, vn, d are not looked at. */
void motion_otg_solve_velocity(const struct otg_problem *problem,
                               struct otg_shape *shape);

/* Append a motion that takes exactly `t`, if there is one: MOTION_OK; or
 * MOTION_E_LIMIT and *next, the shortest possible duration above t. */
int motion_otg_solve_duration(const struct otg_problem *problem, struct real t,
                              struct otg_shape *shape, struct real *next);

/* Most evaluations that one root took since start; for tests. */
extern int motion_otg_solve_most;

#endif
