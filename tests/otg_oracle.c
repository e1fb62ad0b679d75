/* tests/otg_oracle.c - see otg_oracle.h. */
#include <stddef.h>

#include "tests/otg_oracle_parts.h"

/* --- limits --------------------------------------------------------------- */

void oracle_bound_of(struct oracle_bound *b, int64_t value)
{
    big_set(&b->num, value);
    big_set(&b->den, 1);
}

/* side * (bound - value) >= 0 all through the phase, `times` being what the
 * polynomial was multiplied by. */
static bool is_kept(const struct oracle *g, enum oracle_order order,
                    const struct big_poly *value, const struct big *times,
                    const struct oracle_bound *bound, int side)
{
    struct big_poly f;
    struct big limit;
    int scale = oracle_scale(g->plan, order);
    big_mul(&limit, &bound->num, times);
    if (scale > 0)
        big_shl(&limit, &limit, (unsigned)scale);
    f.degree = value->degree;
    for (int k = 0; k <= f.degree; k++) {
        big_mul(&f.c[k], &value->c[k], &g->five[order]);
        if (bound->den.count != 1 || bound->den.limb[0] != 1)
            big_mul(&f.c[k], &f.c[k], &bound->den);
        if (scale < 0)
            big_shl(&f.c[k], &f.c[k], (unsigned)-scale);
        f.c[k].sign = -f.c[k].sign;
    }
    big_add(&f.c[0], &f.c[0], &limit);
    for (int k = 0; side < 0 && k <= f.degree; k++)
        f.c[k].sign = -f.c[k].sign;
    return big_poly_is_not_negative(&f);
}

int64_t oracle_closing_jerk(const struct motion_otg_limit *limit)
{
    return limit->jerk_down_q16 ? limit->jerk_down_q16 : limit->jerk_q16;
}

static bool jerk_is_kept(const struct oracle *g)
{
    const struct motion_otg_limit *l = &g->move->limit;
    int64_t first = l->jerk_q16, last = oracle_closing_jerk(l), least = first;
    struct big_poly jerk;
    struct big times;
    struct oracle_bound bound;
    if (last < least)
        least = last;
    oracle_poly(g, ORACLE_JERK, &jerk);
    big_mul_int(&times, &g->total[5], g->n);
    for (int side = -1; side <= 1; side += 2) {
        oracle_bound_of(&bound, side * (g->i < g->plan->brake   ? first
                                        : g->i >= g->plan->turn ? last
                                                                : least));
        if (!is_kept(g, ORACLE_JERK, &jerk, &times, &bound, side))
            return false;
    }
    return true;
}

/* The limit; while braking, the start. */
static bool acc_is_kept(const struct oracle *g)
{
    const struct motion_otg_limit *l = &g->move->limit;
    int brake = g->move->mode == MOTION_OTG_VELOCITY ? 1 : g->plan->brake;
    struct big_poly acc;
    struct oracle_bound bound;
    oracle_poly(g, ORACLE_ACC, &acc);
    for (int side = -1; side <= 1; side += 2) {
        int64_t limit = side > 0 ? l->acc_max_q16 : l->acc_min_q16;
        int64_t start = g->move->start.acc_q16;
        if (g->i < brake && (side > 0 ? start > limit : start < limit))
            limit = start;
        oracle_bound_of(&bound, limit);
        if (!is_kept(g, ORACLE_ACC, &acc, &g->total[5], &bound, side))
            return false;
    }
    return true;
}

void oracle_vel_bound(const struct oracle *g, int up, struct oracle_bound *b)
{
    const struct motion_otg_limit *l = &g->move->limit;
    oracle_bound_of(b, up ? l->vel_max_q32 : l->vel_min_q32);
    if (!g->outside[up] && g->i < g->late[up])
        return;
    big_copy(&b->num, &g->peak[up].num);
    big_copy(&b->den, &g->peak[up].den);
}

static bool vel_is_kept(const struct oracle *g)
{
    struct big_poly vel;
    struct oracle_bound bound;
    oracle_poly(g, ORACLE_VEL, &vel);
    for (int up = 0; up < 2; up++) {
        oracle_vel_bound(g, up, &bound);
        if (!is_kept(g, ORACLE_VEL, &vel, &g->total[5], &bound, up ? 1 : -1))
            return false;
    }
    return true;
}

/* --- ends ----------------------------------------------------------------- */

/* num / den in plan units of velocity (3 steps / tick) or acceleration (6
 * steps / tick^2): is it `value`, to the nearest of the public format, or to a
 * plan's unit or 2^-58 of itself where those are coarser? */
#define SCALE_BITS 58

static bool is_bit_equal(const struct oracle *g, enum oracle_order order,
                         const struct big *num, const struct big *den,
                         int64_t value)
{
    struct big have, want, half, unit;
    int scale = oracle_scale(g->plan, order),
        steps = order == ORACLE_VEL ? 3 : 6;
    unsigned up = scale > 0 ? (unsigned)scale : 0;
    unsigned down = scale < 0 ? (unsigned)-scale : 0;
    big_mul_int(&unit, &g->five[order], steps);
    big_shl(&unit, &unit, down);
    big_mul(&have, num, &unit);
    big_mul(&unit, &unit, den);
    big_shl(&half, den, up);
    big_mul_int(&want, &half, value);
    big_sub(&have, &have, &want);
    have.sign = have.sign != 0;
    if (big_cmp(&have, &unit) < 0)
        return true;
    big_shl(&have, &have, SCALE_BITS);
    big_shl(&half, &half, SCALE_BITS - 1);
    want.sign = want.sign != 0;
    return big_cmp(&have, big_cmp(&half, &want) < 0 ? &want : &half) <= 0;
}

/* With a limit on it, velocity (acceleration) does not step at the ends. */
static const char *judge_start(const struct oracle *g)
{
    const struct motion_otg_limit *l = &g->move->limit;
    struct big vel, acc;
    oracle_wide(&vel, g->plan->start_vel);
    big_set(&acc, g->plan->start_acc);
    if (l->acc_max_q16 && !is_bit_equal(g, ORACLE_VEL, &vel, &g->total[0],
                                        g->move->start.vel_q32))
        return "start velocity";
    if (l->jerk_q16 && !is_bit_equal(g, ORACLE_ACC, &acc, &g->total[0],
                                     g->move->start.acc_q16))
        return "start acceleration";
    return NULL;
}

/* e3 * a + e4 * b + e5 * c */
static void bend_sum(const struct motion_otg_plan *plan, struct big *sum,
                     const int64_t factor[3])
{
    struct big e;
    big_set(sum, 0);
    for (int k = 0; k < 3; k++) {
        oracle_wide(&e, plan->bend[k]);
        big_mul_int(&e, &e, factor[k]);
        big_add(sum, sum, &e);
    }
}

static const char *judge_goal(const struct oracle *g)
{
    static const int64_t value[] = { 1, 1, 1 }, slope[] = { 3, 4, 5 };
    static const int64_t curve[] = { 6, 12, 20 };
    const struct motion_otg_move *m = g->move;
    struct big sum, have, den, goal;
    bend_sum(g->plan, &sum, curve);
    big_set(&have, g->a);
    if (sum.sign != 0 ||
        (m->limit.jerk_q16 &&
         !is_bit_equal(g, ORACLE_ACC, &have, &g->total[0], m->goal.acc_q16)))
        return "goal acceleration";
    bend_sum(g->plan, &sum, slope);
    big_mul_int(&den, &g->total[1], 3);
    big_mul(&have, &g->vel, &den);
    big_add(&have, &have, &sum);
    if (m->limit.acc_max_q16 &&
        !is_bit_equal(g, ORACLE_VEL, &have, &den, m->goal.vel_q32))
        return "goal velocity";
    bend_sum(g->plan, &sum, value);
    big_add(&have, &g->pos, &sum);
    oracle_wide(&goal, g->plan->way);
    if (big_cmp(&have, &goal) != 0)
        return "way";
    if (m->mode == MOTION_OTG_VELOCITY)
        return NULL;
    big_set(&goal, m->goal.pos_q32);
    big_set(&sum, m->start.pos_q32);
    big_sub(&goal, &goal, &sum);
    if (g->plan->pos_shift < 32)
        return "step";
    big_shl(&goal, &goal, (unsigned)g->plan->pos_shift - 32);
    return big_cmp(&have, &goal) != 0 ? "goal position" : NULL;
}

/* --- the whole ------------------------------------------------------------ */

static const char *judge_phase(const struct oracle *g)
{
    const struct motion_otg_limit *l = &g->move->limit;
    if (l->jerk_q16 && !jerk_is_kept(g))
        return "jerk";
    if (l->acc_max_q16 && !acc_is_kept(g))
        return "acceleration";
    if (g->move->mode == MOTION_OTG_POSITION && !vel_is_kept(g))
        return "velocity";
    return NULL;
}

/* Is the velocity at `turn`, where jerk_down takes over, the highest (the
 * lowest) of all corners after braking, but for what limits are drawn in by (in
 * the shortest of moves 2^-6)? */
#define TURN_BITS 6

static void widen(struct big *lo, struct big *hi, const struct big *vel)
{
    if (big_cmp(vel, lo) < 0)
        big_copy(lo, vel);
    if (big_cmp(vel, hi) > 0)
        big_copy(hi, vel);
}

static bool turn_is_extreme(struct oracle *g)
{
    struct big at, lo, hi, play;
    while (g->i < g->plan->count) {
        if (g->i == g->plan->brake) {
            big_copy(&lo, &g->vel);
            big_copy(&hi, &g->vel);
        }
        if (g->i == g->plan->turn)
            big_copy(&at, &g->vel);
        if (g->i >= g->plan->brake)
            widen(&lo, &hi, &g->vel);
        oracle_phase(g);
        oracle_step(g);
    }
    widen(&lo, &hi, &g->vel);
    big_copy(&play, &lo);
    play.sign = play.sign != 0;
    if (big_cmp(&play, &hi) < 0)
        big_copy(&play, &hi);
    big_sub(&lo, &at, &lo);
    big_sub(&hi, &hi, &at);
    big_shl(&lo, &lo, TURN_BITS);
    big_shl(&hi, &hi, TURN_BITS);
    return big_cmp(&lo, &play) <= 0 || big_cmp(&hi, &play) <= 0;
}

/* Which jerk counts where is for the plan to say, but not as it likes. */
static const char *judge_turn(struct oracle *g)
{
    const struct motion_otg_plan *plan = g->plan;
    if (plan->brake < 0 || plan->brake > plan->turn || plan->turn > plan->count)
        return "turn";
    if (g->move->mode == MOTION_OTG_POSITION && g->move->limit.jerk_down_q16 &&
        plan->turn < plan->count && !turn_is_extreme(g))
        return "turn";
    return NULL;
}

/* Nothing moves. */
static const char *judge_empty(const struct motion_otg_move *m,
                               const struct motion_otg_plan *plan)
{
    if (plan->ticks != 0 || plan->dur_ns_q12 != 0)
        return "duration";
    if (m->mode == MOTION_OTG_POSITION && m->start.pos_q32 != m->goal.pos_q32)
        return "goal position";
    if (m->limit.acc_max_q16 && m->start.vel_q32 != m->goal.vel_q32)
        return "goal velocity";
    if (m->limit.jerk_q16 && m->start.acc_q16 != m->goal.acc_q16)
        return "goal acceleration";
    return NULL;
}

const char *otg_oracle_judge(const struct motion_otg_move *move,
                             const struct motion_otg_plan *plan)
{
    static struct oracle g;
    if (plan->count < 0 || plan->count > MOTION_OTG_PHASES)
        return "count";
    if (plan->start_pos_q32 != move->start.pos_q32)
        return "start position";
    if (plan->count == 0)
        return judge_empty(move, plan);
    oracle_init(&g, move, plan);
    const char *wrong = judge_turn(&g);
    oracle_init(&g, move, plan);
    if (wrong == NULL)
        wrong = judge_start(&g);
    while (wrong == NULL && g.i < plan->count) {
        oracle_phase(&g);
        wrong = g.n <= 0 ? "ticks" : judge_phase(&g);
        oracle_step(&g);
    }
    if (wrong != NULL)
        return wrong;
    if (g.t0 != plan->ticks ||
        plan->ticks << plan->tick_shift != plan->dur_ns_q12)
        return "duration";
    return judge_goal(&g);
}
