/* motion/otg_border.h - the two one-parameter families of motions that reach
 * the most and the least displacement in their time.
 *
 * Only the upper border is here, with the end first whose natural speed is the
 * higher; otg_solve.c turns every problem so.  docs/OTG.md, sections 1 and 2. */
#ifndef MOTION_OTG_BORDER_H
#define MOTION_OTG_BORDER_H

#include "motion/otg_solve.h"

/* One half: from a = 0 at speed `base` (where the end's own acceleration ramp
 * would start or stop) to the cruise speed. */
struct otg_half {
    struct real base, a, j;
    struct real per_a, per_root_j; /* 1/a, 1/sqrt(j) */
    struct real corner;            /* a^2/j: a is reached above it */
    struct real ramp;              /* a/j */
    struct real lead_t, lead_d;    /* the part before the end, not driven */
};

struct otg_border_point {
    struct real t, d;   /* duration and displacement */
    struct real dt, dd; /* their slopes */
    struct real rate;   /* dD/dT; regime B only */
    bool rising;        /* Dmax(T) is rising here */
};

/* The two ways a border is followed: regime A over s with vc = low + s^2, or
 * regime B over a1. */
struct otg_border {
    const struct otg_problem *q;
    struct otg_half first, second; /* regime A */
    struct real low;
    struct real k;        /* regime B */
    struct real hold_per; /* 1 / (j |an|) */
    bool is_a;
};

/* What is looked for along a border, between lo and hi. */
enum otg_goal {
    OTG_GOAL_D,    /* displacement, on the last rising branch */
    OTG_GOAL_LENS, /* displacement, on the first rising branch */
    OTG_GOAL_T,    /* duration */
};

/* |a - b| / j. */
static inline struct real otg_time_between(struct real a, struct real b,
                                           struct real per_j)
{
    return real_mul(real_abs(real_sub(a, b)), per_j);
}

/* Set up regime A (over s, vc = low + s^2) or B (over a1). */
void motion_otg_border_init_a(struct otg_border *b,
                              const struct otg_problem *q);
void motion_otg_border_init_b(struct otg_border *b,
                              const struct otg_problem *q);

struct otg_border_point motion_otg_border_a(const struct otg_border *b,
                                            struct real s);
struct otg_border_point motion_otg_border_b(const struct otg_border *b,
                                            struct real a1);

/* Append the motion. */
void motion_otg_border_shape_a(const struct otg_border *b, struct real vc,
                               struct real cruise, struct otg_shape *shape);
void motion_otg_border_shape_b(const struct otg_border *b, struct real a1,
                               struct otg_shape *shape);

/* Whether a point is at or beyond what is looked for. */
bool motion_otg_is_right_of(const struct otg_border_point *p,
                            enum otg_goal goal, struct real want);

/* Where between lo and hi that begins, from a first guess x. */
struct real motion_otg_border_root(const struct otg_border *b,
                                   enum otg_goal goal, struct real want,
                                   struct real lo, struct real hi,
                                   struct real x);

#endif
