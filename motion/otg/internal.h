/* motion/otg/internal.h - between the files of the planner, in the order in
 * which a request passes them:
 *
 *   otg.c       request: is it sound?  Then the loop: margins, durations
 *   problem.c   problem: the move in short reals; ends brought inside
 *   border.c    borders: the two families of motions that reach most and least
 *   search.c    search: one root on a border, or a motion of a given duration
 *   round.c     exact end: phases in whole ticks and units, a Newton step
 *   exact.c     exact end: corners moved until the goal is met
 *   edge.c      exact end of what is at the edge of the possible, unsearched
 *   plan.c      a plan's units, where it leads, its track
 *   check.c     check
 *
 * Names and equations are those of docs/OTG.md. */
#ifndef MOTION_OTG_INTERNAL_H
#define MOTION_OTG_INTERNAL_H

#include <stdbool.h>
#include <stdint.h>

#include "motion/number/num.h"
#include "motion/number/real.h"
#include "motion/number/wide.h"
#include "motion/otg/otg.h"

/* Not inlined into a caller whose stack other, deeper calls need. */
#define OTG_OWN_FRAME __attribute__((noinline))

/* --- request (otg.c) ------------------------------------------------------ */

/* The request itself: MOTION_OK, or as motion_otg_make without trying. */
int motion_otg_is_valid(const struct motion_otg_move *move,
                        enum motion_otg_field *field);
/* Whether the start can stay inside the limits as they are. */
bool motion_otg_start_fits(const struct motion_otg_move *move);

/* motion_otg_make in another duration than move->dur_ns_q12 (0: the
 * shortest). */
int motion_otg_make_in(const struct motion_otg_move *move, int64_t dur_ns_q12,
                       struct motion_otg_plan *plan,
                       enum motion_otg_field *field);

/* How long the fastest motion takes, to 2^-27; move->dur_ns_q12 is not looked
 * at.  Errors as motion_otg_make. */
int motion_otg_least(const struct motion_otg_move *move, int64_t *dur_ns_q12,
                     enum motion_otg_field *field);

static inline int otg_refuse(enum motion_otg_field *field,
                             enum motion_otg_field which, int err)
{
    *field = which;
    return err;
}

/* The jerk of slowing down. */
static inline int64_t otg_closing_jerk(const struct motion_otg_limit *lim)
{
    return lim->jerk_down_q32 ? lim->jerk_down_q32 : lim->jerk_q32;
}

/* --- problem (problem.c) --------------------------------------------------
 *
 * Displacement d from (v0, a0) to (vf, af); vn <= v <= vx, an <= a <= ax,
 * an < 0 < ax; jerk within +-j before the cruise and +-j2 after it.
 * `is_unit`: lengths are counted such that j = j2 = 1, which saves most
 * multiplications. */
struct otg_problem {
    struct num d, v0, a0, vf, af;
    struct num dv; /* vf - v0, to its own last bit */
    struct num vx, vn, ax, an;
    struct num j, j2;
    struct num per_j, per_j2; /* 1/j, 1/j2 */
    int jerk_bits;            /* both are tightened by 2^-jerk_bits */
    bool is_unit;
    bool is_strict;    /* a displacement that the plain speed change covers but
                          for 2^-24 is not taken for one that it covers */
    bool has_no_early; /* the early set has been searched */
    const struct motion_otg_move *exact; /* the same, with limits that are not
                                            tightened; NULL for several axes */
};

/* By how much limits are tightened: 2^-vel, 2^-acc, 2^-jerk; `is_strict` as in
 * struct otg_problem. */
struct otg_margin {
    int vel, acc, jerk;
    bool is_strict;
};

#define OTG_MARGIN_BITS 25 /* limits are tightened by 2^-25 at first */
#define OTG_MARGINS     48 /* margins tried for one duration */

/* The i-th margin, counted from 0; `finest` from motion_otg_margin_bits. */
struct otg_margin motion_otg_margin(int finest, int i);
int motion_otg_margin_bits(int64_t dur_ns_q12);

void motion_otg_problem_init(const struct motion_otg_move *move,
                             struct otg_margin margin, struct otg_problem *q);

/* Count lengths such that the jerk 1 / per_j is 1. */
void motion_otg_in_jerk(struct otg_problem *q, struct num per_j);

/* Over a jerk: a length in this problem's count divided by 1 costs nothing. */
static inline struct num otg_over(const struct otg_problem *q, struct num a,
                                  struct num per_j)
{
    return q->is_unit ? a : num_mul(a, per_j);
}

/* Ticks per second. */
struct num motion_otg_per_second(void);
/* A duration in seconds. */
struct num motion_otg_seconds(int64_t dur_ns_q12);

/* --- shape: the acceleration as a polyline ---------------------------------
 *
 * In each phase it runs straight to `a`. */
struct otg_phase {
    struct num dt, a;
};

/* Both ends' braking, 3 phases each, and a mixture of 7 and 7. */
#define OTG_SHAPE_MAX 20

/* What is free to move a little so that the shape meets its goal exactly: the
 * two places where the acceleration is highest and lowest, as the phase that
 * holds it (dt zero when it does not) between the two that lead there and away;
 * and the phase that holds the speed.  -1: none. */
struct otg_free {
    int16_t pulse[2], cruise;
    bool is_peak[2]; /* acceleration rises to it; else falls */
};

struct otg_shape {
    struct otg_phase phase[OTG_SHAPE_MAX];
    int count;
    int brake, turn; /* j limits the phases before `brake`, j2 those from
                        `turn` on, the lower those between */
    int land;        /* where the goal's braking begins */
    bool is_edge;    /* the displacement is next to that of the plain speed
                        change */
    struct otg_free free;
};

/* The phases are not cleared: nothing reads beyond `count`. */
static inline void otg_shape_init(struct otg_shape *shape)
{
    shape->count = shape->brake = shape->turn = 0;
    shape->is_edge = false;
    shape->land = OTG_SHAPE_MAX;
    shape->free.pulse[0] = shape->free.pulse[1] = shape->free.cruise = -1;
}

static inline void otg_shape_add(struct otg_shape *shape, struct num dt,
                                 struct num a)
{
    shape->phase[shape->count++] = (struct otg_phase){ dt, a };
}

/* How long a shape takes. */
struct num motion_otg_shape_time(const struct otg_shape *shape);
/* The accelerations of phases [from, count) times `by`. */
void motion_otg_shape_scale(struct otg_shape *shape, int from, struct num by);

/* Position goal: brake both ends inside, solve the middle; t zero for the
 * fastest, else exactly t seconds or MOTION_E_LIMIT and *next.  Uses `q` up;
 * its jerks stay. */
int motion_otg_propose(struct otg_problem *q, struct num t,
                       struct otg_shape *shape, struct num *next);

/* Velocity goal: the same in the least time. */
void motion_otg_propose_velocity(const struct otg_problem *problem,
                                 struct otg_shape *shape);

/* --- borders (border.c) ---------------------------------------------------
 *
 * The two one-parameter families of motions that reach the most and the least
 * displacement in their time.
 *
 * A motion is two sides that meet at the cruise speed vc: one from the start,
 * one from the goal backwards in time.  Both are ramps from a = 0 at speed
 * `base` (where the end's own acceleration would begin) up to vc.  The lower
 * border is the upper one upside down (`sign` -1).  Lengths are counted such
 * that the jerk is 1, but where there are two. */
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
 * base (in the early set: with the negative acceleration); below zero its peak
 * is -x j: regime B. */
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
    struct num rest;  /* what the target is beyond that; after a search */
    struct num slope; /* d got / dx */
    struct num bend;  /* dz/dx, the ratio of their peaks */
};

/* What is looked for along a border. */
enum otg_goal {
    OTG_GOAL_D,     /* displacement, on the last rising branch */
    OTG_GOAL_FIRST, /* displacement, on the first rising branch */
    OTG_GOAL_T,     /* duration */
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
/* In regime B and the early set: how fast the displacement grows with it. */
struct num motion_otg_border_rate(const struct otg_border *b,
                                  const struct otg_point *p);

/* In regime B and the early set that rate is convex over x: where it is least
 * up to hi <= 0.  Unit jerk. */
struct num motion_otg_border_turn(const struct otg_border *b, struct num hi);

/* Where between lo and hi `got` rises to the target, from a first guess p->x;
 * the point there.  p->rest above zero: beyond hi. */
void motion_otg_border_root(struct otg_border *b, enum otg_goal goal,
                            struct num target, struct num lo, struct num hi,
                            struct otg_point *p);

/* Append the motion. */
void motion_otg_border_shape(const struct otg_border *b,
                             const struct otg_point *p, struct num cruise,
                             struct otg_shape *shape);

/* --- search (search.c) ----------------------------------------------------
 *
 * For a fixed duration T the motions that obey the limits form a convex set, so
 * the displacements they reach form one interval [Dmin(T), Dmax(T)].  The
 * fastest motion over d is the first T with Dmin(T) <= d <= Dmax(T).  The
 * motions on the two borders are known in closed form, one parameter each; so
 * the search is for one root of one smooth function, and there is no list of
 * cases to try.  Both ends must be inside. */

/* Append the fastest motion.  Always finds one.  Where it uses both jerks,
 * brake and turn are set to where the second begins. */
void motion_otg_solve(const struct otg_problem *q, struct otg_shape *shape);

/* Append a motion of the early set: its acceleration stays on one side of zero.
 * The fastest for t zero, else one of that duration; false when there is none.
 * Its velocities are between v0 and vf: vx, vn are not looked at.  Unit
 * jerk. */
bool motion_otg_solve_early(const struct otg_problem *q, struct num t,
                            struct otg_shape *shape);
/* Whether velocities between v0 and vf can cover d in the time of the last of
 * its motions, with x = end <= 0 on its border. */
bool motion_otg_early_is_near(const struct otg_problem *q, struct num end);

/* Append the fastest motion from (v0, a0) to (vf, af) whatever it covers;
 * vx, vn, d are not looked at. */
void motion_otg_solve_velocity(const struct otg_problem *q,
                               struct otg_shape *shape);

/* Append a motion that takes exactly `t`, if there is one: MOTION_OK; or
 * MOTION_E_LIMIT and *next, the shortest possible duration above t. */
int motion_otg_solve_duration(const struct otg_problem *problem, struct num t,
                              struct otg_shape *shape, struct num *next);

/* --- whole ticks and units (round.c) -------------------------------------- */

#define OTG_TICKS_MOST ((int64_t)1 << 60)

/* Jerks in a plan's own units of acceleration per tick, and where they hold. */
struct otg_rates {
    struct num j, j2, per_j, per_j2;
    int brake, turn;
    bool lands; /* the goal's side brakes too */
};

/* Ticks for the acceleration to move by `step` units in phase i, up. */
int64_t motion_otg_ramp_ticks(const struct otg_rates *rates, int i,
                              int64_t step);
/* Ticks that full jerk takes for `step` units, up; what is 2^-52 of it less is
 * what rounding made of a step.  At most OTG_TICKS_MOST. */
int64_t motion_otg_full_ticks(int64_t step, int64_t jerk_q32, int acc_bits);
/* The largest step of the acceleration in n ticks. */
int64_t motion_otg_full_step(int64_t n, int64_t jerk_q32, int acc_bits);

/* Units for `plan`, whose accelerations are below 2^acc unit/s2, and its ends.
 * MOTION_E_RANGE when it does not fit. */
int motion_otg_round_units(const struct motion_otg_move *move, int acc,
                           struct motion_otg_plan *plan);
/* The same for a shape's accelerations, and the jerks in these units. */
int motion_otg_round_start(const struct motion_otg_move *move,
                           const struct otg_problem *q,
                           const struct otg_shape *shape,
                           struct otg_rates *rates,
                           struct motion_otg_plan *plan);
/* The shape's phases one by one, some of no ticks; *ends: those that swing. */
#define OTG_END_START 1u
#define OTG_END_GOAL  2u
int motion_otg_round(const struct motion_otg_move *move,
                     const struct otg_shape *shape,
                     const struct otg_rates *rates,
                     struct motion_otg_plan *plan, uint32_t *ends);
/* Phases of hardly any ticks next to the start and goal last none. */
void motion_otg_round_ends(struct motion_otg_plan *plan);
/* Leave out phases of no or hardly any ticks; returns the corners that must
 * stay for the ends that swing. */
uint32_t motion_otg_round_join(const struct otg_shape *shape, uint32_t ends,
                               struct motion_otg_plan *plan);

/* The goal less the plan's end, in unit/s, unit, and with a given duration in
 * ticks. */
struct otg_residual {
    struct num vel, pos;
    int64_t ticks;
    bool is_timed;
};

/* Move the plan, its phases still those of `shape`, by one Newton step. */
void motion_otg_refine(struct motion_otg_plan *plan,
                       const struct otg_shape *shape,
                       const struct otg_rates *rates,
                       const struct otg_residual *residual);

/* --- the goal, exactly (exact.c) ------------------------------------------ */

/* How far an acceleration may be moved: so little that no ramp bends by more
 * than 2^-25; an eighth of the largest one at most, which makes ramps steeper
 * and the plan longer when they are given time; as far as it takes, where the
 * duration is given and ramps of few ticks are far from what they were to
 * be. */
enum otg_trim {
    OTG_TRIM_GENTLY,
    OTG_TRIM_USUAL,
    OTG_TRIM_FREELY,
};

/* Move accelerations at a few corners so that the plan ends at its goal; not
 * those in `fixed`.  MOTION_E_LIMIT when no acceleration can. */
int motion_otg_trim(enum motion_otg_mode mode, uint32_t fixed,
                    enum otg_trim how, struct motion_otg_plan *plan);

/* Round `shape` to whole ticks and units, meet the goal, and check; the total
 * is `dur_ns_q12`, or what comes for 0.  MOTION_E_RANGE when it does not fit
 * the formats, MOTION_E_LIMIT with the field that is broken. */
int motion_otg_settle(const struct motion_otg_move *move,
                      const struct otg_problem *problem,
                      const struct otg_shape *shape, int64_t dur_ns_q12,
                      struct motion_otg_plan *plan,
                      enum motion_otg_field *field);

/* Make a plan of `move` longer by little, by lengthening its longest phase; it
 * has then passed the check, or the error says that it could not. */
int motion_otg_stretch(const struct motion_otg_move *move, int64_t dur_ns_q12,
                       struct motion_otg_plan *plan);

/* --- the edge of what is possible (edge.c) -------------------------------- */

/* The plain change of speed with all that the limits allow, as exactly as ticks
 * do: a velocity goal's answer, and that of a position goal whose displacement
 * is just what the change covers.  MOTION_E_LIMIT where it cannot be had. */
int motion_otg_plain(const struct motion_otg_move *move,
                     struct motion_otg_plan *plan,
                     enum motion_otg_field *field);
/* The fastest motion over a displacement next to the plain change's, which
 * takes about dur_ns_q12. */
int motion_otg_edge(const struct motion_otg_move *move, int64_t dur_ns_q12,
                    struct motion_otg_plan *plan, enum motion_otg_field *field);

/* Reals of 62 bits, called: inline, each operation is twice the code. */
struct motion_real motion_otg_sum(const struct motion_real *a,
                                  const struct motion_real *b);
struct motion_real motion_otg_times(const struct motion_real *a,
                                    const struct motion_real *b);
struct motion_real motion_otg_per(const struct motion_real *a,
                                  const struct motion_real *b);
struct motion_real motion_otg_signed(int64_t n, int bits, bool minus);

/* --- a plan in exact integers (plan.c; otg.h) -----------------------------
 *
 * A second is 2^21 5^9 ticks of 2^-12 ns, so V' = V + (A + A') n counts in
 * 2^-(22 + acc_bits) / 5^9 unit/s, and P in a third of V's unit times a
 * tick. */

#define OTG_FIVES     1953125                 /* 5^9 */
#define OTG_POS_FIVES INT64_C(11444091796875) /* 3 5^18 */

/* Values of the public formats in the plan's units; exact, but for an
 * acceleration where acc_bits < 32 and a velocity where acc_bits < 10, which
 * are rounded down. */
int64_t motion_otg_acc_image(int64_t acc_q32, int acc_bits);
struct motion_u128 motion_otg_vel_image(int64_t vel_q32, int acc_bits);

/* The upper 30 bits of a 2^e, as num.h packs them: inline, what calls them is
 * larger. */
uint64_t motion_otg_wide_word(const struct motion_u128 *a, int e);
uint64_t motion_otg_wider_word(const struct wider *a, int e);
static inline struct num motion_otg_wide_num(const struct motion_u128 *a, int e)
{
    return num_unpack(motion_otg_wide_word(a, e));
}
static inline struct num motion_otg_wider_num(const struct wider *a, int e)
{
    return num_unpack(motion_otg_wider_word(a, e));
}

/* V, P in unit/s, unit. */
struct num motion_otg_vel_num(const struct motion_u128 *vel, int acc_bits);
struct num motion_otg_pos_num(const struct wider *pos, int acc_bits);

/* start + p as a public position, to nearest or cut towards the start;
 * MOTION_E_RANGE beyond. */
int motion_otg_pos_public(struct wider p, int acc_bits, int64_t start_q32,
                          bool cuts, int64_t *pos_q32);

/* V as a public velocity, to nearest. */
int64_t motion_otg_vel_public(struct motion_u128 v, int acc_bits);

/* Append a phase, unless it lasts no time. */
void motion_otg_plan_add(struct motion_otg_plan *plan, int64_t dur_ns_q12,
                         int64_t acc);

/* One phase on, from zero position. */
struct otg_run {
    struct wider p;
    struct motion_u128 v;
    int64_t a;
};
struct otg_run motion_otg_run_start(const struct motion_otg_plan *plan);
void motion_otg_run_phase(struct otg_run *run,
                          const struct motion_otg_phase *phase);

/* P of a plan's displacement, less what its start's velocity makes of it:
 * 3 V0 T. */
struct wider motion_otg_pos_change(const struct motion_otg_plan *plan);
/* The goal less where a plan's phases lead, in its units. */
void motion_otg_plan_residual(const struct motion_otg_plan *plan,
                              struct motion_u128 *vel, struct wider *pos);

/* The phase that takes what is left over in a track: the longest, but not the
 * first or the last, where the motion may touch its limits, unless all others
 * are short.  0 in a plan without phases. */
int motion_otg_carrier(const struct motion_otg_plan *plan);

/* a^2 / 2j <= margin: does a ramp from |a| to zero fit?  Exactly.  j > 0. */
bool motion_otg_ramp_fits(int64_t acc_q32, int64_t jerk_q32,
                          uint64_t margin_q32);

#endif
