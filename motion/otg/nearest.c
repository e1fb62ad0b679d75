/* motion/otg/nearest.c - motions with no time to spare, in the nearest whole
 * tick: one phase, or one change between two velocities.  docs/OTG.md, section
 * 5, No time to spare. */
#include <stddef.h>

#include "motion/core/err.h"
#include "motion/core/fixed.h"
#include "motion/otg/internal.h"

#define NEAREST_LONGER 10 /* a goal that is met takes 2^-10 more, and */
#define NEAREST_TICKS  2  /* two ticks, before a residual is better */
#define NEAREST_ROUGH  16 /* left open at first: 2^-16 of the change, */
#define NEAREST_STEPS  32 /* 32 steps of the format, */
#define NEAREST_OPEN   38 /* what the acceleration makes in 2^-38 s, 15 ticks */
#define TICKS_PER_S    UINT64_C(4096000000000)
#define CHANGE_POWER   12 /* 2 dv ticks_per_s / n unit/s2 */
#define DIP_POWER      22 /* 8 v ticks_per_s / n^2 unit/s2, 2^8 to spare */

/* a / b seconds in ticks, up, both in one format; OTG_TICKS_MOST where they are
 * too many or have two signs. */
static int64_t ticks_of(int64_t a, int64_t b)
{
    uint64_t n, rest;
    struct motion_u128 all = wide_mul_u64(motion_fixed_abs(a), TICKS_PER_S);
    if ((a ^ b) < 0 ||
        motion_fixed_div_u128(all, motion_fixed_abs(b), &n, &rest) < 0)
        return OTG_TICKS_MOST;
    return (int64_t)(n >> 1 < (uint64_t)OTG_TICKS_MOST
                         ? n + (rest != 0)
                         : (uint64_t)OTG_TICKS_MOST);
}

static int64_t nearest_jerk(const struct motion_otg_limit *limit)
{
    int64_t down = otg_closing_jerk(limit);
    return down < limit->jerk_q32 ? down : limit->jerk_q32;
}

/* Could one phase make the change of velocity, roughly?  Full jerk from a0 to
 * a1 makes 2 jerk (v1 - v0) = (a0 + a1) |a1 - a0|; NEAREST_ROUGH of that, some
 * ticks and some steps of the formats are left open.  Most moves end here: the
 * rest costs a plan and its check. */
static bool nearest_is_likely(const struct motion_otg_move *move)
{
    const struct motion_state *start = &move->start, *goal = &move->goal;
    const int64_t a0 = start->acc_q32, a1 = goal->acc_q32;
    int64_t by;
    if ((goal->vel_q32 | a1) == 0 ||
        motion_fixed_sub(goal->vel_q32, start->vel_q32, &by) < 0)
        return false;
    if (a0 == a1)
        return true;
    const uint64_t jerk = (uint64_t)nearest_jerk(&move->limit);
    const uint64_t size0 = motion_fixed_abs(a0), size1 = motion_fixed_abs(a1);
    const uint64_t most = size0 < size1 ? size1 : size0;
    const int64_t mean = a0 / 2 + a1 / 2;
    const uint64_t step =
        a0 < a1 ? (uint64_t)a1 - (uint64_t)a0 : (uint64_t)a0 - (uint64_t)a1;
    struct motion_u128 gain = wide_mul_u64(motion_fixed_abs(mean), step);
    struct motion_u128 have = wide_mul_u64(motion_fixed_abs(by), jerk);
    const struct motion_u128 both = wide_add(have, gain);
    struct motion_u128 margin =
        wide_mul_u64(NEAREST_STEPS + (most >> NEAREST_OPEN), jerk);
    margin = wide_add(margin, wide_shr(both, NEAREST_ROUGH));
    have = (by ^ mean) < 0 ? both : wide_abs(wide_sub(have, gain));
    return !wide_is_less(margin, have);
}

/* At the mean of both speeds; where acceleration steps, in no less than it
 * takes, and a tick for the steps. */
static int64_t change_ticks(const struct motion_otg_move *move)
{
    const struct motion_otg_limit *lim = &move->limit;
    const int64_t v0 = move->start.vel_q32, v1 = move->goal.vel_q32;
    int64_t by, both = v0, least = 0;
    if (motion_fixed_sub(move->goal.pos_q32, move->start.pos_q32, &by) < 0 ||
        (v0 != v1 && (motion_fixed_add(by, by, &by) < 0 ||
                      motion_fixed_add(v0, v1, &both) < 0)))
        return 0;
    if (lim->jerk_q32 == 0)
        least = 1 + ticks_of(v1 - v0,
                             v1 < v0 ? lim->acc_min_q32 : lim->acc_max_q32);
    int64_t n = ticks_of(by, both);
    return n < least ? least : n;
}

/* The least time of one phase, or from one cruise to another; zero where
 * neither can be the answer. */
static int64_t nearest_ticks(const struct motion_otg_move *move)
{
    const struct motion_state *start = &move->start, *goal = &move->goal;
    int64_t jerk = nearest_jerk(&move->limit);
    if (start->acc_q32 != goal->acc_q32)
        return motion_otg_full_ticks(goal->acc_q32 - start->acc_q32, jerk, 32);
    if (start->acc_q32 != 0) /* nearest_is_likely has subtracted them */
        return ticks_of(goal->vel_q32 - start->vel_q32, start->acc_q32);
    return move->mode == MOTION_OTG_VELOCITY ? 0 : change_ticks(move);
}

static int nearest_start(const struct motion_otg_move *move, int power,
                         struct motion_otg_plan *plan)
{
    plan->count = 0;
    plan->dur_ns_q12 = 0;
    plan->trim[0] = plan->trim[1] = 0;
    return motion_otg_round_units(move, power, plan);
}

/* Down and up again by what the last tick is too much. */
static int nearest_dip(const struct motion_otg_move *move, int64_t n,
                       struct motion_otg_plan *plan)
{
    int power = DIP_POWER + 2 * (int)motion_real_clz((uint64_t)n) - 64 -
                (int)motion_real_clz(motion_fixed_abs(move->start.vel_q32));
    int err = nearest_start(move, power, plan);
    if (err < 0 || move->start.acc_q32 != 0 || n < 4)
        return MOTION_E_LIMIT;
    motion_otg_plan_add(plan, n / 4, 1);
    motion_otg_plan_add(plan, n / 2, -1);
    motion_otg_plan_add(plan, n - n / 4 - n / 2, 0);
    err = motion_otg_trim(MOTION_OTG_POSITION, 0, OTG_TRIM_FREELY, plan);
    plan->brake = 0; /* the lower jerk everywhere */
    return err < 0 ? err : motion_otg_check(move, plan, NULL);
}

/* Up to the acceleration that makes the change of velocity and back to zero, in
 * halves, or steps of a tick: V = 2 A (n - n0). */
static int nearest_change(const struct motion_otg_move *move, int64_t n,
                          struct motion_otg_plan *plan)
{
    const int64_t v0 = move->start.vel_q32, v1 = move->goal.vel_q32;
    const int64_t n0 = move->limit.jerk_q32 ? n / 2 : 1;
    uint64_t acc;
    int power = CHANGE_POWER + (int)motion_real_clz((uint64_t)n) -
                (int)motion_real_clz(motion_fixed_abs(v1 - v0));
    int err = nearest_start(move, power, plan);
    if (err < 0)
        return err;
    struct motion_u128 by = wide_sub(motion_otg_vel_image(v1, plan->acc_bits),
                                     motion_otg_vel_image(v0, plan->acc_bits));
    err =
        motion_fixed_div_u128(wide_abs(by), 2 * (uint64_t)(n - n0), &acc, NULL);
    if (err < 0)
        return err;
    const int64_t peak = v1 < v0 ? -(int64_t)acc : (int64_t)acc;
    motion_otg_plan_add(plan, n0, peak);
    motion_otg_plan_add(plan, n - 2 * n0, peak);
    motion_otg_plan_add(plan, n0, 0);
    return MOTION_OK;
}

static int nearest_ramp(const struct motion_otg_move *move, int64_t n,
                        struct motion_otg_plan *plan)
{
    int err = nearest_start(move, -1000, plan);
    if (err == MOTION_OK)
        motion_otg_plan_add(
            plan, n, motion_otg_acc_image(move->goal.acc_q32, plan->acc_bits));
    return err;
}

/* It ends where it ends: its place cut towards the start, which leads the
 * velocity of a track away from its limit. */
static int nearest_phase(const struct motion_otg_move *move, int64_t n,
                         struct motion_otg_plan *plan)
{
    const struct motion_state *goal = &move->goal;
    bool is_ramp = (move->start.acc_q32 | goal->acc_q32) != 0 ||
                   move->start.vel_q32 == goal->vel_q32;
    int err =
        is_ramp ? nearest_ramp(move, n, plan) : nearest_change(move, n, plan);
    if (err < 0)
        return err;
    const int bits = plan->acc_bits;
    struct otg_run run = motion_otg_run_start(plan);
    for (int i = 0; i < plan->count; i++)
        motion_otg_run_phase(&run, &plan->phase[i]);
    plan->goal_vel_q32 = motion_otg_vel_public(run.v, bits);
    err = motion_otg_pos_public(run.p, bits, plan->start_pos_q32, true,
                                &plan->goal_pos_q32);
    /* what is too far off to say is no nearest tick */
    if (err < 0 || motion_fixed_sub(goal->vel_q32, plan->goal_vel_q32,
                                    &plan->residual_vel_q32) < 0)
        return MOTION_E_LIMIT;
    if (move->mode == MOTION_OTG_POSITION &&
        motion_fixed_sub(goal->pos_q32, plan->goal_pos_q32,
                         &plan->residual_pos_q32) < 0)
        return MOTION_E_LIMIT;
    return motion_otg_check(move, plan, NULL);
}

OTG_OWN_FRAME int motion_otg_nearest(const struct motion_otg_move *move,
                                     int err, struct motion_otg_plan *plan)
{
    struct motion_otg_plan made;
    if (!nearest_is_likely(move))
        return err;
    int64_t n = nearest_ticks(move);
    int64_t most = n + (n >> NEAREST_LONGER) + NEAREST_TICKS;
    if (n != 0 && n < OTG_TICKS_MOST && (err < 0 || plan->dur_ns_q12 > most) &&
        (nearest_dip(move, n, &made) == MOTION_OK ||
         nearest_phase(move, n, &made) == MOTION_OK)) {
        *plan = made;
        return MOTION_OK;
    }
    return err;
}

bool motion_otg_cruise(const struct motion_otg_move *move,
                       struct motion_otg_plan *plan)
{
    const int64_t vel = move->start.vel_q32;
    if (move->start.acc_q32 != 0 || vel != move->goal.vel_q32 ||
        (vel != move->limit.vel_max_q32 && vel != move->limit.vel_min_q32))
        return false;
    int64_t n = nearest_ticks(move);
    return n != 0 && n < OTG_TICKS_MOST &&
           nearest_dip(move, n, plan) == MOTION_OK;
}
