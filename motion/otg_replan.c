/* motion/otg_replan.c - see otg_replan.h. */
#include "motion/otg_replan.h"

#include <stddef.h>

#include "motion/err.h"
#include "motion/fixed.h"
#include "motion/otg_internal.h"

/* n / d as a fraction of 2^-62, rounded down; 0 <= n < d. */
static int64_t fraction(int64_t n, int64_t d)
{
    uint64_t part;
    struct motion_u128 wide = { (uint64_t)n >> 2, (uint64_t)n << 62 };
    (void)motion_fixed_div_u128(wide, (uint64_t)d, &part, NULL);
    return (int64_t)part;
}

/* V in 2^-32 unit/s, to nearest. */
static int64_t vel_public(struct motion_u128 v, int acc_bits)
{
    struct motion_u128 m = wide_abs(v);
    int shift = acc_bits - 10;
    uint64_t vel;
    m = shift < 0 ? motion_fixed_shl_u128(m, (unsigned)(1 - shift))
                  : wide_shr(m, (unsigned)shift - 1);
    if (motion_fixed_div_u128((struct motion_u128){ m.hi, m.lo }, OTG_FIVES,
                              &vel, NULL) < 0 ||
        vel / 2 > INT64_MAX)
        vel = INT64_MAX;
    vel = (vel >> 1) + (vel & 1);
    return wide_is_negative(v) ? -(int64_t)vel : (int64_t)vel;
}

static int64_t acc_public(int64_t acc, int acc_bits)
{
    int shift = acc_bits - 16;
    if (shift <= 0)
        return (int64_t)((uint64_t)acc << -shift);
    return ((acc >> (shift - 1)) + 1) >> 1;
}

/* 2^-acc_bits unit/s2 per tick in 2^-16 unit/s3. */
static int64_t jerk_public(int64_t step, int64_t n, int acc_bits)
{
    int64_t jerk;
    struct motion_real per_s = motion_real_make(INT64_C(4096000000000), 0);
    struct motion_real j = motion_real_mul(motion_real_int(step), per_s);
    j = motion_real_div(j, motion_real_int(n));
    if (motion_real_round(j, 16 - acc_bits, &jerk) < 0)
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

void motion_otg_state_at(const struct motion_otg_plan *plan, int64_t t_ns_q12,
                         struct motion_state *state)
{
    struct otg_run run = motion_otg_run_start(plan);
    int64_t t = t_ns_q12 < 0 ? 0 : t_ns_q12;
    int64_t jerk = 0;
    int i = 0;
    for (; i < plan->count && plan->phase[i].dur_ns_q12 <= t; i++) {
        t -= plan->phase[i].dur_ns_q12;
        motion_otg_run_phase(&run, &plan->phase[i]);
    }
    if (i < plan->count) {
        const struct motion_otg_phase *phase = &plan->phase[i];
        struct motion_otg_phase part = part_of(phase, run.a, t);
        jerk =
            jerk_public(phase->acc - run.a, phase->dur_ns_q12, plan->acc_bits);
        motion_otg_run_phase(&run, &part);
    }
    *state = (struct motion_state){
        .pos_q32 = plan->goal_pos_q32,
        .vel_q32 = plan->goal_vel_q32,
        .acc_q16 = acc_public(run.a, plan->acc_bits),
        .jerk_q16 = jerk,
    };
    if (i == plan->count)
        return;
    state->vel_q32 = vel_public(run.v, plan->acc_bits);
    if (motion_otg_way_public(run.p, plan->acc_bits, plan->start_pos_q32,
                              &state->pos_q32) < 0)
        state->pos_q32 = plan->goal_pos_q32;
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

static bool is_same_limit(const struct motion_otg_limit *a,
                          const struct motion_otg_limit *b)
{
    return a->vel_max_q32 == b->vel_max_q32 &&
           a->vel_min_q32 == b->vel_min_q32 &&
           a->acc_max_q16 == b->acc_max_q16 &&
           a->acc_min_q16 == b->acc_min_q16 && a->jerk_q16 == b->jerk_q16 &&
           a->jerk_down_q16 == b->jerk_down_q16;
}

static bool is_same_goal(const struct motion_otg_move *a,
                         const struct motion_otg_move *b)
{
    return a->mode == b->mode && a->goal.pos_q32 == b->goal.pos_q32 &&
           a->goal.vel_q32 == b->goal.vel_q32 &&
           a->goal.acc_q16 == b->goal.acc_q16 &&
           is_same_limit(&a->limit, &b->limit);
}

int motion_otg_replan(const struct motion_otg_move *old_move,
                      const struct motion_otg_plan *old, int64_t t_ns_q12,
                      struct motion_otg_move *move,
                      struct motion_otg_plan *next,
                      enum motion_otg_field *field)
{
    struct motion_otg_plan made;
    int64_t left = old->dur_ns_q12 - t_ns_q12;
    motion_otg_state_at(old, t_ns_q12, &move->start);
    int err = motion_otg_make(move, &made, field);
    if (left > 0 &&
        (err < 0 || (made.dur_ns_q12 >= left && is_same_goal(old_move, move))))
        return MOTION_OTG_KEPT;
    if (err == MOTION_OK) {
        *next = made;
        return MOTION_OTG_NEW;
    }
    err = motion_otg_stop(&move->start, &move->limit, next);
    return err < 0 ? err : MOTION_OTG_STOP;
}
