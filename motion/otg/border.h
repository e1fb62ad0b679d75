/* motion/otg/border.h - the two one-parameter families of motions that reach
 * the most and the least displacement in their time.
 *
 * A motion is two sides that meet at the cruise speed vc: one from the start,
 * one from the goal backwards in time.  Both are ramps from a = 0 at speed
 * `base` (where the end's own acceleration would begin) up to vc.  The lower
 * border is the upper one upside down (`sign` -1).  Lengths are counted such
 * that the jerk is 1, but where there are two.  docs/OTG.md, sections 1, 2. */
#ifndef MOTION_OTG_BORDER_H
#define MOTION_OTG_BORDER_H

#include "motion/otg/solve.h"

struct otg_side {
    struct num a;          /* at the end itself, towards the cruise */
    struct num base, drop; /* drop = a^2 / 2j below the end's own speed */
    struct num limit;      /* of the acceleration */
    struct num corner;     /* limit^2 / j: reached above this speed change */
    struct num ramp;       /* limit / j */
    struct num per_limit;
    struct num lead_t, lead_d; /* the part before the end, not driven */
    struct num natural;
    struct num j, per_j;
};

/* The unknown x is half the time of the side `first`, the one with the higher
 * base (in the lens: with the negative acceleration); below zero its peak is
 * -x j: regime B. */
struct otg_border {
    struct otg_side side[2]; /* of the start, of the goal */
    struct num top;          /* highest vc */
    int first, sign;
    bool is_unit;
    struct num gap; /* base of the first - base of the other */
    struct num lead_t, lead_d;
};

struct otg_point {
    struct num x, z;  /* half times of the first and the other side */
    struct num vc;    /* speed where they meet */
    struct num got;   /* displacement + lead_d, or duration + lead_t */
    struct num rest;  /* what is wanted beyond that; after a search */
    struct num slope; /* d got / dx */
    struct num bend;  /* dz/dx, the ratio of their peaks */
};

/* What is looked for along a border. */
enum otg_goal {
    OTG_GOAL_D,    /* displacement, on the last rising branch */
    OTG_GOAL_LENS, /* displacement, on the first rising branch */
    OTG_GOAL_T,    /* duration */
};

/* A speed change from a = 0 to a = 0: half its time, its peak, 1 / peak. */
struct otg_pulse {
    struct num z, a, per_a;
};

void motion_otg_side_init(const struct otg_problem *q, bool goal, int sign,
                          struct otg_side *side);
/* The speed change w (zero for w < 0). */
void motion_otg_side_pulse(struct otg_side *side, bool is_unit, struct num w,
                           struct otg_pulse *pulse);

/* A side that is driven for twice `half`; upside down with `sign` -1. */
struct otg_end {
    const struct otg_side *side;
    int sign;
    struct num half;
};

/* Append the motion along both, start first, with a cruise or without. */
void motion_otg_shape_ends(const struct otg_end end[2], bool is_unit,
                           const struct num *cruise, struct otg_shape *shape);

/* Sides, and their order for regimes A and B (`first` -1) or as given. */
void motion_otg_border_init(const struct otg_problem *q, int sign, int first,
                            struct otg_border *b);
/* x where the family starts; x with cruise speed vc. */
struct num motion_otg_border_low(struct otg_border *b);
struct num motion_otg_border_half(struct otg_border *b, struct num vc);

void motion_otg_border_at(struct otg_border *b, enum otg_goal goal,
                          struct num x, struct otg_point *p);
/* Duration of the motion, without a cruise. */
struct num motion_otg_border_time(const struct otg_border *b,
                                  const struct otg_point *p);
/* In regime B and the lens: how fast the displacement grows with it. */
struct num motion_otg_border_rate(const struct otg_border *b,
                                  const struct otg_point *p);

/* In regime B and the lens that rate is convex over x: where it is least up to
 * hi <= 0.  Unit jerk. */
struct num motion_otg_border_turn(const struct otg_border *b, struct num hi);

/* Where between lo and hi `got` rises to what is wanted, from a first guess
 * p->x; the point there.  p->rest above zero: beyond hi. */
void motion_otg_border_root(struct otg_border *b, enum otg_goal goal,
                            struct num want, struct num lo, struct num hi,
                            struct otg_point *p);

/* Append the motion. */
void motion_otg_border_shape(const struct otg_border *b,
                             const struct otg_point *p, struct num cruise,
                             struct otg_shape *shape);

#endif
