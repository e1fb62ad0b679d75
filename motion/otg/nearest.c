/* motion/otg/nearest.c - what one phase covers, in the nearest whole tick.
 *
 * A way covered at the velocity of both ends, or a change of speed by one ramp,
 * takes a time that has none to spare.  Where that is no whole number of ticks
 * the jerk has to stretch it by part of one; where it cannot, the next motion
 * is far: it turns round and comes again.  So the phase gets the next whole
 * tick, and what that misses is the plan's residual; the check says how large
 * it may be (docs/OTG.md, 5).
 *
 * A cruise is made exact where the jerk allows: it dips by what the last tick
 * is too much, for as long as it lasts, at no more jerk than that needs. */
#include <stddef.h>

#include "motion/core/err.h"
#include "motion/core/fixed.h"
#include "motion/otg/internal.h"

#define NEAREST_LONGER 10 /* a goal that is met takes 2^-10 more, and */
#define NEAREST_TICKS  2  /* two ticks, before a residual is better */
#define NEAREST_ROUGH  16
#define NEAREST_STEPS  32
#define TICKS_PER_S    UINT64_C(4096000000000)
#define DIP_POWER      22 /* 8 v ticks_per_s / n^2 in unit/s2, and 2^8 to spare */

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
    struct motion_u128 way = wide_mul_u64(motion_fixed_abs(mean), step);
    struct motion_u128 have = wide_mul_u64(motion_fixed_abs(by), jerk);
    const struct motion_u128 both = wide_add(have, way);
    struct motion_u128 room = wide_mul_u64(NEAREST_STEPS + (most >> 38), jerk);
    room = wide_add(room, wide_shr(both, NEAREST_ROUGH));
    have = (by ^ mean) < 0 ? both : wide_abs(wide_sub(have, way));
    return !wide_is_less(room, have);
}

/* The least time of one phase; zero where none can be the answer. */
static int64_t nearest_ticks(const struct motion_otg_move *move)
{
    const struct motion_state *start = &move->start, *goal = &move->goal;
    int64_t jerk = nearest_jerk(&move->limit), by;
    if (start->acc_q32 != goal->acc_q32)
        return motion_otg_full_ticks(goal->acc_q32 - start->acc_q32, jerk, 32);
    if (start->acc_q32 != 0)
        return motion_fixed_sub(goal->vel_q32, start->vel_q32, &by) < 0
                   ? 0
                   : ticks_of(by, start->acc_q32);
    return move->mode == MOTION_OTG_VELOCITY || start->vel_q32 == 0 ||
                   start->vel_q32 != goal->vel_q32 ||
                   motion_fixed_sub(goal->pos_q32, start->pos_q32, &by) < 0
               ? 0
               : ticks_of(by, start->vel_q32);
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
    if (err < 0 || (move->start.acc_q32 | (n < 4)))
        return MOTION_E_LIMIT;
    motion_otg_plan_add(plan, n / 4, 1);
    motion_otg_plan_add(plan, n / 2, -1);
    motion_otg_plan_add(plan, n - n / 4 - n / 2, 0);
    err = motion_otg_trim(MOTION_OTG_POSITION, 0, OTG_TRIM_FREELY, plan);
    plan->brake = 0; /* the lower jerk everywhere */
    return err < 0 ? err : motion_otg_check(move, plan, NULL);
}

/* It ends where it ends: its place cut towards the start, which leads the
 * velocity of a track away from its limit. */
static int nearest_phase(const struct motion_otg_move *move, int64_t n,
                         struct motion_otg_plan *plan)
{
    const struct motion_state *goal = &move->goal;
    int err = nearest_start(move, -1000, plan);
    if (err < 0)
        return err;
    const int bits = plan->acc_bits;
    motion_otg_plan_add(plan, n, motion_otg_acc_image(goal->acc_q32, bits));
    struct otg_run run = motion_otg_run_start(plan);
    motion_otg_run_phase(&run, plan->phase);
    plan->goal_vel_q32 = motion_otg_vel_public(run.v, bits);
    err = motion_otg_way_public(run.p, bits, plan->start_pos_q32, true,
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
    if (move->start.acc_q32 != 0 ||
        (vel != move->limit.vel_max_q32 && vel != move->limit.vel_min_q32))
        return false;
    int64_t n = nearest_ticks(move);
    return n != 0 && n < OTG_TICKS_MOST &&
           nearest_dip(move, n, plan) == MOTION_OK;
}
