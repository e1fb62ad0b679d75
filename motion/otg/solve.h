/* motion/otg/solve.h - the fastest way from one state of motion to another.
 *
 * Position, velocity and acceleration are driven by a bounded jerk.  For a
 * fixed duration T the motions that obey the limits form a convex set, so the
 * displacements they reach form one interval [Dmin(T), Dmax(T)].  The fastest
 * motion over d is the first T with Dmin(T) <= d <= Dmax(T).  The motions on
 * the two borders are known in closed form, one parameter each; so the search
 * is for one root of one smooth function, and there is no list of cases to try.
 * docs/OTG.md derives everything used here.
 *
 * Works on short reals (num.h); proposes only, exact.c makes the
 * proposal exact and check.c judges it. */
#ifndef MOTION_OTG_SOLVE_H
#define MOTION_OTG_SOLVE_H

#include <stdbool.h>
#include <stdint.h>

#include "motion/number/num.h"

struct motion_otg_move;

/* Displacement d from (v0, a0) to (vf, af); vn <= v <= vx, an <= a <= ax,
 * an < 0 < ax; jerk within +-j before the cruise and +-j2 after it.  Both ends
 * must be inside (brake.c brings them there).  `is_unit`: lengths are
 * counted such that j = j2 = 1, which saves most multiplications. */
struct otg_problem {
    struct num d, v0, a0, vf, af;
    struct num dv; /* vf - v0, to its own last bit */
    struct num vx, vn, ax, an;
    struct num j, j2;
    struct num per_j, per_j2; /* 1/j, 1/j2 */
    int jerk_bits;            /* both are drawn in by 2^-jerk_bits */
    bool is_unit;
    bool is_strict; /* a way that the plain speed change covers but for 2^-24 is
                       not taken for one that it covers */
    bool is_no_lens;                     /* there was nothing in it */
    const struct motion_otg_move *exact; /* the same, with limits that are not
                                            drawn in; NULL for several axes */
};

/* The acceleration as a polyline: in each phase it runs straight to `a`. */
struct otg_phase {
    struct num dt, a;
};

/* Both ends' braking, 3 phases each, and a mixture of 7 and 7. */
#define OTG_SHAPE_MAX 20

/* What may be moved a little so that the shape meets its goal exactly: the two
 * places where the acceleration is highest and lowest, as the phase that holds
 * it (dt zero when it does not) between the two that lead there and away; and
 * the phase that holds the speed.  -1: none. */
struct otg_knobs {
    int16_t pulse[2], cruise;
    bool is_peak[2]; /* acceleration rises to it; else falls */
};

struct otg_shape {
    struct otg_phase phase[OTG_SHAPE_MAX];
    int count;
    int brake, turn; /* j limits the phases before `brake`, j2 those from
                        `turn` on, the lower those between */
    int land;        /* where the goal's braking begins */
    bool is_edge;    /* the way is next to that of the plain speed change */
    struct otg_knobs knobs;
};

/* The phases are not cleared: nothing reads beyond `count`. */
static inline void otg_shape_init(struct otg_shape *shape)
{
    shape->count = shape->brake = shape->turn = 0;
    shape->is_edge = false;
    shape->land = OTG_SHAPE_MAX;
    shape->knobs.pulse[0] = shape->knobs.pulse[1] = shape->knobs.cruise = -1;
}

static inline void otg_shape_add(struct otg_shape *shape, struct num dt,
                                 struct num a)
{
    shape->phase[shape->count++] = (struct otg_phase){ dt, a };
}

/* Over a jerk: a length in this problem's count divided by 1 costs nothing. */
static inline struct num otg_over(const struct otg_problem *q, struct num a,
                                  struct num per_j)
{
    return q->is_unit ? a : num_mul(a, per_j);
}

/* Append the fastest motion.  Always finds one for a problem as above.  Where
 * it uses both jerks, brake and turn are set to where the second begins. */
void motion_otg_solve(const struct otg_problem *q, struct otg_shape *shape);

/* Append a motion whose acceleration stays on one side of zero, the fastest for
 * t zero, else one of that duration; false when there is none of the lens.  Its
 * velocities are between v0 and vf: vx, vn are not looked at.  Unit jerk. */
bool motion_otg_solve_lens(const struct otg_problem *q, struct num t,
                           struct otg_shape *shape);

/* Append the fastest motion from (v0, a0) to (vf, af) whatever it covers;
 * vx, vn, d are not looked at. */
void motion_otg_solve_velocity(const struct otg_problem *q,
                               struct otg_shape *shape);

/* Append a motion that takes exactly `t`, if there is one: MOTION_OK; or
 * MOTION_E_LIMIT and *next, the shortest possible duration above t. */
int motion_otg_solve_duration(const struct otg_problem *problem, struct num t,
                              struct otg_shape *shape, struct num *next);

#endif
