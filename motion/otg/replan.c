/* motion/otg/replan.c - see replan.h.
 *
 * Public formats do not hold the state of a plan: in rev, after a tick of 125
 * us at 1/360 rev/s3, position, velocity and acceleration are below half a step
 * of theirs.  What starts from such a state, tick after tick, would never
 * start, or gather what rounding gave it.  So the request is counted in a
 * smaller unit, by a power of two (limits and goal stay what they are,
 * exactly), and the state is taken from the plan in that unit. */
#include "motion/otg/replan.h"

#include <stddef.h>

#include "motion/core/err.h"
#include "motion/core/fixed.h"
#include "motion/otg/internal.h"

/* n / d as a fraction of 2^-62, rounded down; 0 <= n < d. */
static int64_t fraction(int64_t n, int64_t d)
{
    uint64_t part;
    struct motion_u128 wide = { (uint64_t)n >> 2, (uint64_t)n << 62 };
    (void)motion_fixed_div_u128(wide, (uint64_t)d, &part, NULL);
    return (int64_t)part;
}

static int64_t acc_public(int64_t acc, int acc_bits)
{
    int shift = acc_bits - 32;
    if (shift <= 0 && motion_fixed_abs(acc) >> (62 + shift) != 0)
        return acc < 0 ? -INT64_MAX : INT64_MAX; /* a step of velocity */
    if (shift <= 0)
        return (int64_t)((uint64_t)acc << -shift);
    if (shift > 62) /* |acc| <= 2^61 */
        return 0;
    return ((acc >> (shift - 1)) + 1) >> 1;
}

/* 2^-acc_bits unit/s2 per tick in 2^-32 unit/s3. */
static int64_t jerk_public(int64_t step, int64_t n, int acc_bits)
{
    int64_t jerk;
    struct motion_real per_s = motion_real_make(INT64_C(4096000000000), 0);
    struct motion_real j = motion_real_mul(motion_real_int(step), per_s);
    j = motion_real_div(j, motion_real_int(n));
    if (motion_real_round(j, 32 - acc_bits, &jerk) < 0)
        jerk = step < 0 ? -INT64_MAX : INT64_MAX;
    return jerk;
}

/* The acceleration t ticks into a phase of n: a whole unit, like its corners,
 * so the part of the phase up to there is a phase too. */
static struct motion_otg_phase part_of(const struct motion_otg_phase *phase,
                                       int64_t from, int64_t t)
{
    struct motion_otg_phase part = { t, phase->acc };
    if (t < phase->dur_ns_q12) {
        int64_t step = phase->acc - from;
        int64_t u = fraction(t, phase->dur_ns_q12);
        int err = motion_fixed_mulshift(step, u, 62, &step);
        part.acc = from + (err < 0 ? 0 : step);
    }
    return part;
}

/* a 2^bits, to nearest; |bits| < 64. */
static int64_t scaled(int64_t a, int bits)
{
    if (bits >= 0)
        return (int64_t)((uint64_t)a << bits);
    return ((a >> (-bits - 1)) + 1) >> 1;
}

/* The state in 2^-finer of the plan's units, to nearest; `from` is where the
 * plan starts and `to` where it ends, in these. */
static void state_finer(const struct motion_otg_plan *plan, int64_t t_ns_q12,
                        int finer, int64_t from, int64_t to,
                        struct motion_state *state)
{
    struct otg_run run = motion_otg_run_start(plan);
    int64_t t = t_ns_q12 < 0 ? 0 : t_ns_q12;
    int64_t jerk = 0;
    const int bits = plan->acc_bits - finer;
    int i = 0;
    for (; i < plan->count && plan->phase[i].dur_ns_q12 <= t; i++) {
        t -= plan->phase[i].dur_ns_q12;
        motion_otg_run_phase(&run, &plan->phase[i]);
    }
    if (i < plan->count) {
        const struct motion_otg_phase *phase = &plan->phase[i];
        struct motion_otg_phase part = part_of(phase, run.a, t);
        jerk = jerk_public(phase->acc - run.a, phase->dur_ns_q12, bits);
        motion_otg_run_phase(&run, &part);
    }
    *state = (struct motion_state){
        .pos_q32 = to,
        .vel_q32 = scaled(plan->goal_vel_q32, finer),
        .acc_q32 = acc_public(run.a, bits),
        .jerk_q32 = jerk,
    };
    if (i == plan->count)
        return;
    state->vel_q32 = motion_otg_vel_public(run.v, bits);
    if (motion_otg_pos_public(run.p, bits, from, false, &state->pos_q32) < 0)
        state->pos_q32 = to;
}

void motion_otg_state_at(const struct motion_otg_plan *plan, int64_t t_ns_q12,
                         struct motion_state *state)
{
    state_finer(plan, t_ns_q12, 0, plan->start_pos_q32, plan->goal_pos_q32,
                state);
}

int motion_otg_stop(const struct motion_state *start,
                    const struct motion_otg_limit *limit,
                    struct motion_otg_plan *plan)
{
    struct motion_otg_move move = { .start = *start,
                                    .limit = *limit,
                                    .mode = MOTION_OTG_VELOCITY };
    return motion_otg_make(&move, plan, NULL);
}

/* --- units ---------------------------------------------------------------- */

#define REPLAN_SPARE 4  /* bits that the largest number of a request has left */
#define REPLAN_FINE  32 /* positions and velocities in 2^-64 are enough */
#define REPLAN_POS   10 /* motion_otg_pos_public takes no acc_bits below -10 */

/* A position of the trajectory in 2^-(32 + bits) from `origin`. */
static int64_t pos_from(const struct motion_otg_trajectory *trajectory,
                        int64_t pos, int64_t origin_q32, int bits)
{
    uint64_t off = (uint64_t)trajectory->origin_q32 - (uint64_t)origin_q32;
    return (int64_t)((off << bits) +
                     (uint64_t)scaled(pos, bits - trajectory->fine_bits));
}

static void state_in(const struct motion_otg_trajectory *trajectory, int64_t t,
                     int64_t origin_q32, int bits, struct motion_state *state)
{
    const struct motion_otg_plan *plan = &trajectory->plan;
    state_finer(plan, t, bits - trajectory->fine_bits,
                pos_from(trajectory, plan->start_pos_q32, origin_q32, bits),
                pos_from(trajectory, plan->goal_pos_q32, origin_q32, bits),
                state);
}

void motion_otg_trajectory_state(const struct motion_otg_trajectory *trajectory,
                                 int64_t t_ns_q12, struct motion_state *state)
{
    state_in(trajectory, t_ns_q12, 0, 0, state);
}

/* The limits and the goal in 2^-bits unit, and back for bits < 0. */
static void move_scale(struct motion_otg_move *move, int bits)
{
    struct motion_otg_limit *l = &move->limit;
    int64_t *const all[] = {
        &l->vel_max_q32,     &l->vel_min_q32,     &l->acc_max_q32,
        &l->acc_min_q32,     &l->jerk_q32,        &l->jerk_down_q32,
        &move->goal.vel_q32, &move->goal.acc_q32, &move->goal.pos_q32,
    };
    for (size_t i = 0; i < sizeof all / sizeof all[0]; i++)
        *all[i] = scaled(*all[i], bits);
}

static uint64_t apart(int64_t a, int64_t b)
{
    return a > b ? (uint64_t)a - (uint64_t)b : (uint64_t)b - (uint64_t)a;
}

/* By how many bits `move`, which starts where `old` is, can be finer: all its
 * numbers, and what leads there in the old plan, fit. */
static int finest(const struct motion_otg_trajectory *old,
                  const struct motion_otg_move *move)
{
    const struct motion_otg_limit *l = &move->limit;
    const struct motion_state *start = &move->start, *goal = &move->goal;
    const bool has_pos = move->mode == MOTION_OTG_POSITION;
    const int64_t origin = start->pos_q32;
    const int64_t all[] = { has_pos ? l->vel_max_q32 : 0,
                            has_pos ? l->vel_min_q32 : 0,
                            l->acc_max_q32,
                            l->acc_min_q32,
                            l->jerk_q32,
                            l->jerk_down_q32,
                            goal->vel_q32,
                            goal->acc_q32,
                            start->vel_q32,
                            start->acc_q32 };
    uint64_t most = has_pos ? apart(goal->pos_q32, origin) : 0;
    most |= apart(pos_from(old, old->plan.start_pos_q32, 0, 0), origin);
    most |= apart(pos_from(old, old->plan.goal_pos_q32, 0, 0), origin);
    for (size_t i = 0; i < sizeof all / sizeof all[0]; i++)
        most |= motion_fixed_abs(all[i]);
    int bits = (int)motion_real_clz(most) - REPLAN_SPARE;
    int pos_bits = old->plan.acc_bits + old->fine_bits + REPLAN_POS;
    bits = bits < pos_bits ? bits : pos_bits;
    return bits < 0 ? 0 : bits < REPLAN_FINE ? bits : REPLAN_FINE;
}

/* --- from a plan and a time ----------------------------------------------- */

int motion_otg_begin(const struct motion_otg_move *move,
                     struct motion_otg_trajectory *trajectory,
                     enum motion_otg_field *field)
{
    trajectory->move = *move;
    trajectory->origin_q32 = 0;
    trajectory->fine_bits = 0;
    return motion_otg_make(move, &trajectory->plan, field);
}

/* A velocity goal has no place, and its limits of velocity need not fit. */
static void leave_place(struct motion_otg_move *move, int bits)
{
    const int64_t most = INT64_MAX >> bits;
    struct motion_otg_limit *l = &move->limit;
    move->goal.pos_q32 = 0;
    if (l->vel_max_q32 > most)
        l->vel_max_q32 = most;
    if (l->vel_min_q32 < -most)
        l->vel_min_q32 = -most;
}

static int make_finer(const struct motion_otg_trajectory *old, int64_t t,
                      const struct motion_otg_move *move, int bits,
                      struct motion_otg_trajectory *next,
                      enum motion_otg_field *field)
{
    next->move = *move;
    next->fine_bits = bits;
    next->origin_q32 = bits ? move->start.pos_q32 : 0;
    if (move->mode == MOTION_OTG_POSITION)
        next->move.goal.pos_q32 -= next->origin_q32;
    else
        leave_place(&next->move, bits);
    move_scale(&next->move, bits);
    state_in(old, t, next->origin_q32, bits, &next->move.start);
    return motion_otg_make(&next->move, &next->plan, field);
}

/* `move`, from the state of `old` at t.  A motion that leaves the finest
 * formats is looked for in coarser ones. */
static int make_from(const struct motion_otg_trajectory *old, int64_t t,
                     const struct motion_otg_move *wish,
                     struct motion_otg_trajectory *next,
                     enum motion_otg_field *field)
{
    struct motion_otg_move move = *wish;
    motion_otg_trajectory_state(old, t, &move.start);
    for (int bits = finest(old, &move);; bits /= 2) {
        int err = make_finer(old, t, &move, bits, next, field);
        if (err != MOTION_E_RANGE || bits == 0)
            return err;
    }
}

static bool is_same_limit(const struct motion_otg_limit *a,
                          const struct motion_otg_limit *b)
{
    return a->acc_max_q32 == b->acc_max_q32 &&
           a->acc_min_q32 == b->acc_min_q32 && a->jerk_q32 == b->jerk_q32 &&
           a->jerk_down_q32 == b->jerk_down_q32;
}

/* What a velocity goal does not use. */
static bool is_same_place(const struct motion_otg_move *a,
                          const struct motion_otg_move *b)
{
    return a->goal.pos_q32 == b->goal.pos_q32 &&
           a->limit.vel_max_q32 == b->limit.vel_max_q32 &&
           a->limit.vel_min_q32 == b->limit.vel_min_q32;
}

static bool is_same_goal(const struct motion_otg_trajectory *old,
                         const struct motion_otg_move *wish)
{
    struct motion_otg_move was = old->move;
    move_scale(&was, -old->fine_bits);
    was.goal.pos_q32 += old->origin_q32;
    return was.mode == wish->mode && was.goal.vel_q32 == wish->goal.vel_q32 &&
           was.goal.acc_q32 == wish->goal.acc_q32 &&
           is_same_limit(&was.limit, &wish->limit) &&
           (was.mode == MOTION_OTG_VELOCITY || is_same_place(&was, wish));
}

/* What a plan may be longer than the optimum (otg.h). */
#define REPLAN_LONGER 21   /* 2^-21 of it, or */
#define REPLAN_TICKS  8192 /* 2 ns */

/* Does the old plan, with `left` to go, serve as well as one of dur?  With a
 * jerk of slowing down it does in any case: that the highest speed is behind is
 * part of its state, and a plan made anew takes the other jerk again. */
static bool is_as_good(const struct motion_otg_trajectory *old, int64_t left,
                       const struct motion_otg_move *wish, int64_t dur)
{
    int64_t rounding = old->plan.dur_ns_q12 >> REPLAN_LONGER;
    rounding = rounding < REPLAN_TICKS ? REPLAN_TICKS : rounding;
    return (dur >= left - rounding || wish->limit.jerk_down_q32) &&
           left >= wish->dur_ns_q12 - rounding && is_same_goal(old, wish);
}

int motion_otg_stop_from(const struct motion_otg_trajectory *old,
                         int64_t t_ns_q12, const struct motion_otg_limit *limit,
                         struct motion_otg_trajectory *next)
{
    const struct motion_otg_move wish = { .limit = *limit,
                                          .mode = MOTION_OTG_VELOCITY };
    enum motion_otg_field field;
    struct motion_otg_trajectory made;
    int64_t left = old->plan.dur_ns_q12 - t_ns_q12;
    int err = make_from(old, t_ns_q12, &wish, &made, &field);
    if (left > 0 && is_as_good(old, left, &wish,
                               err < 0 ? INT64_MAX : made.plan.dur_ns_q12))
        return MOTION_OTG_KEPT;
    if (err < 0)
        return err;
    *next = made;
    return MOTION_OTG_STOP;
}

int motion_otg_replan(const struct motion_otg_trajectory *old, int64_t t_ns_q12,
                      const struct motion_otg_move *wish,
                      struct motion_otg_trajectory *next,
                      enum motion_otg_field *field)
{
    struct motion_otg_trajectory made;
    int64_t left = old->plan.dur_ns_q12 - t_ns_q12;
    int err = make_from(old, t_ns_q12, wish, &made, field);
    if (left > 0 &&
        (err < 0 || is_as_good(old, left, wish, made.plan.dur_ns_q12)))
        return MOTION_OTG_KEPT;
    if (err == MOTION_OK) {
        *next = made;
        return MOTION_OTG_NEW;
    }
    return motion_otg_stop_from(old, t_ns_q12, &wish->limit, next);
}
