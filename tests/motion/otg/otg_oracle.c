/* tests/motion/otg/otg_oracle.c - see otg_oracle.h. */
#include <math.h>
#include <stddef.h>

#include "tests/motion/otg/otg_oracle_parts.h"

/* --- limits --------------------------------------------------------------- */

void oracle_bound_of(struct oracle_bound *b, int64_t value)
{
    big_set(&b->num, value);
    big_set(&b->den, 1);
}

/* side * (bound - value) >= 0 all through the phase; `times`: n for the jerk,
 * 1 else; `less`, when not NULL, is taken off the value. */
static bool is_kept(const struct oracle *g, enum oracle_order order,
                    int64_t times, const struct oracle_bound *bound, int side,
                    const struct big *less)
{
    struct big_poly f;
    struct big limit;
    oracle_poly(g, order, &f);
    if (less != NULL)
        big_sub(&f.c[0], &f.c[0], less);
    big_mul(&limit, &bound->num, &g->unit[order]);
    big_mul_int(&limit, &limit, times);
    for (int k = 0; k <= f.degree; k++) {
        big_mul(&f.c[k], &f.c[k], &bound->den);
        f.c[k].sign *= -side;
    }
    limit.sign *= side;
    big_add(&f.c[0], &f.c[0], &limit);
    return big_poly_is_not_negative(&f);
}

int64_t oracle_closing_jerk(const struct motion_otg_limit *limit)
{
    return limit->jerk_down_q32 ? limit->jerk_down_q32 : limit->jerk_q32;
}

static bool jerk_is_kept(const struct oracle *g)
{
    const struct motion_otg_limit *l = &g->move->limit;
    int64_t first = l->jerk_q32, last = oracle_closing_jerk(l), least = first;
    struct oracle_bound bound;
    if (last < least)
        least = last;
    for (int side = -1; side <= 1; side += 2) {
        oracle_bound_of(&bound, side * (g->i < g->plan->brake   ? first
                                        : g->i >= g->plan->turn ? last
                                                                : least));
        if (!is_kept(g, ORACLE_JERK, g->n, &bound, side, NULL))
            return false;
    }
    return true;
}

/* The limit; while braking, the start. */
static bool acc_is_kept(const struct oracle *g)
{
    const struct motion_otg_limit *l = &g->move->limit;
    int brake = g->move->mode == MOTION_OTG_VELOCITY ? 1 : g->plan->brake;
    struct oracle_bound bound;
    for (int side = -1; side <= 1; side += 2) {
        int64_t limit = side > 0 ? l->acc_max_q32 : l->acc_min_q32;
        int64_t start = g->move->start.acc_q32;
        if (g->i < brake && (side > 0 ? start > limit : start < limit))
            limit = start;
        oracle_bound_of(&bound, limit);
        if (!is_kept(g, ORACLE_ACC, 1, &bound, side, NULL))
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

/* As it comes from the start and, behind a trimmed corner, as it goes to the
 * goal; between them both. */
static bool vel_is_kept(const struct oracle *g)
{
    struct oracle_bound bound;
    for (int up = 0; up < 2; up++) {
        int side = up ? 1 : -1;
        oracle_vel_bound(g, up, &bound);
        if ((g->i <= g->last_trim || g->last_trim < 0) &&
            !is_kept(g, ORACLE_VEL, 1, &bound, side, NULL))
            return false;
        if (g->i > g->first_trim &&
            !is_kept(g, ORACLE_VEL, 1, &bound, side, &g->rest))
            return false;
    }
    return true;
}

static const char *judge_phase(const struct oracle *g)
{
    const struct motion_otg_limit *l = &g->move->limit;
    if (l->jerk_q32 && !jerk_is_kept(g))
        return "jerk";
    if (l->acc_max_q32 && !acc_is_kept(g))
        return "acceleration";
    if (g->move->mode == MOTION_OTG_POSITION && !vel_is_kept(g))
        return "velocity";
    return NULL;
}

/* --- ends ----------------------------------------------------------------- */

/* With a limit on it, velocity (acceleration) does not step at the ends. */
static const char *judge_start(const struct oracle *g)
{
    const struct motion_otg_move *m = g->move;
    struct big acc, expected;
    oracle_acc(g, &acc, g->a);
    big_mul_int(&expected, &g->unit[ORACLE_ACC], m->start.acc_q32);
    if (g->plan->start_pos_q32 != m->start.pos_q32)
        return "start position";
    if (m->limit.acc_max_q32 && g->plan->start_vel_q32 != m->start.vel_q32)
        return "start velocity";
    if (m->limit.jerk_q32 && big_cmp(&acc, &expected) != 0)
        return "start acceleration";
    return NULL;
}

/* Is it what is expected, rounded to the nearest of the public format?  Or off
 * by no more than one unit of the trimmed corners makes, `most`. */
static bool is_goal(const struct oracle *g, enum oracle_order order,
                    const struct big *have, int64_t expected,
                    const struct big *most)
{
    struct big off;
    big_mul_int(&off, &g->unit[order], expected);
    big_sub(&off, have, &off);
    off.sign = off.sign != 0;
    if (big_cmp(&off, most) <= 0)
        return true;
    big_mul_int(&off, &off, 2);
    return big_cmp(&off, &g->unit[order]) <= 0;
}

/* What a plan names as its residual may be left: two ticks at the velocity
 * (acceleration) of either end and two steps of the public format, and what
 * those of the velocity make of the position; of one phase, or one change from
 * one speed to another, to a goal that is not at rest. */
#define TICK_S (1 / 4096e9L)

static long double may_be_left(int64_t from, int64_t to, int bits)
{
    long double rate = fmaxl(fabsl(ldexpl((long double)from, -bits)),
                             fabsl(ldexpl((long double)to, -bits)));
    return 2 * TICK_S * rate + 3 * 0x1p-32L; /* one of them to name it */
}

static bool may_have_residual(const struct oracle *g)
{
    const struct motion_otg_move *m = g->move;
    const bool is_cruise = (m->start.acc_q32 | m->goal.acc_q32) == 0;
    return g->plan->count >= 1 && g->plan->count <= (is_cruise ? 3 : 1);
}

static bool residual_is_small(const struct oracle *g)
{
    const struct motion_otg_plan *plan = g->plan;
    const struct motion_state *start = &g->move->start, *goal = &g->move->goal;
    long double t = (long double)plan->dur_ns_q12 * TICK_S;
    long double vel = may_be_left(start->acc_q32, goal->acc_q32, 32);
    long double pos = vel * t + may_be_left(start->vel_q32, goal->vel_q32, 32);
    if ((plan->residual_pos_q32 | plan->residual_vel_q32) == 0)
        return true;
    return may_have_residual(g) && (plan->trim[0] | plan->trim[1]) == 0 &&
           (goal->vel_q32 | goal->acc_q32) != 0 &&
           fabsl(ldexpl((long double)plan->residual_vel_q32, -32)) <= vel &&
           fabsl(ldexpl((long double)plan->residual_pos_q32, -32)) <= pos;
}

static const char *judge_goal(const struct oracle *g)
{
    const struct motion_otg_move *m = g->move;
    struct big acc, expected, most, pos;
    oracle_trim(g, &most);
    oracle_acc(g, &acc, g->a);
    big_mul_int(&expected, &g->unit[ORACLE_ACC], m->goal.acc_q32);
    if (m->limit.jerk_q32 && big_cmp(&acc, &expected) != 0)
        return "goal acceleration";
    if (m->limit.acc_max_q32 &&
        (g->plan->goal_vel_q32 + g->plan->residual_vel_q32 != m->goal.vel_q32 ||
         !is_goal(g, ORACLE_VEL, &g->vel, g->plan->goal_vel_q32, &most)))
        return "goal velocity";
    big_mul_int(&most, &most, 3);
    big_mul_int(&most, &most, g->plan->dur_ns_q12);
    big_mul_int(&pos, &g->unit[ORACLE_POS], m->start.pos_q32);
    big_add(&pos, &pos, &g->pos);
    if (!residual_is_small(g))
        return "residual";
    if (most.sign == 0 && may_have_residual(g)) /* cut, not rounded */
        big_copy(&most, &g->unit[ORACLE_POS]);
    if (!is_goal(g, ORACLE_POS, &pos, g->plan->goal_pos_q32, &most))
        return "displacement";
    if (m->mode == MOTION_OTG_POSITION &&
        g->plan->goal_pos_q32 + g->plan->residual_pos_q32 != m->goal.pos_q32)
        return "goal position";
    return NULL;
}

/* From `turn` on jerk_down counts: the highest (lowest) speed is behind.  So
 * the phase that follows may lead beyond all corners inside the limits up to
 * there on one side only if the velocity comes from the other; but a goal that
 * swings may be all that follows.  But for the margin of the limits (in the
 * shortest of moves 2^-6). */
#define TURN_BITS 6

static void widen(struct big *lo, struct big *hi, const struct big *vel)
{
    if (big_cmp(vel, lo) < 0)
        big_copy(lo, vel);
    if (big_cmp(vel, hi) > 0)
        big_copy(hi, vel);
}

/* Does a exceed b by more than the margin of the limits? */
static bool exceeds(const struct big *a, const struct big *b)
{
    struct big by, size;
    big_sub(&by, a, b);
    big_copy(&size, b);
    size.sign = size.sign != 0;
    big_shl(&by, &by, TURN_BITS);
    return big_cmp(&by, &size) > 0;
}

/* And from there the velocity goes to the goal's without a peak. */
static bool goes_to_goal(struct oracle *g, const struct big *from)
{
    int late[2] = { oracle_late(g->plan, -1), oracle_late(g->plan, 1) };
    struct big lo, hi;
    big_copy(&lo, from);
    big_copy(&hi, from);
    big_mul_int(&hi, &g->unit[ORACLE_VEL], g->plan->goal_vel_q32);
    widen(&lo, &hi, &hi);
    widen(&lo, &hi, from);
    while (g->i < late[0] && g->i < late[1]) {
        if (exceeds(&g->vel, &hi) || exceeds(&lo, &g->vel))
            return false;
        oracle_phase(g);
        oracle_step(g);
    }
    return true;
}

static bool is_behind_the_peak(struct oracle *g, int turn)
{
    struct big at, lo, hi;
    bool inside = g->plan->brake == 0 && !g->outside[0] && !g->outside[1];
    big_set(&lo, 0);
    big_set(&hi, 0);
    while (g->i < turn) {
        oracle_phase(g);
        if (!inside) {
            big_copy(&lo, &g->vel);
            big_copy(&hi, &g->vel);
        }
        widen(&lo, &hi, &g->vel);
        inside = inside ||
                 (g->i >= g->plan->brake && !g->outside[0] && !g->outside[1]);
        oracle_step(g);
    }
    if (!inside)
        return turn == g->plan->turn;
    if (g->i >= oracle_late(g->plan, 1) || g->i >= oracle_late(g->plan, -1))
        return true;
    big_copy(&at, &g->vel);
    widen(&lo, &hi, &at);
    oracle_phase(g);
    oracle_step(g);
    return !(exceeds(&g->vel, &hi) && exceeds(&at, &lo)) &&
           !(exceeds(&lo, &g->vel) && exceeds(&hi, &at)) &&
           goes_to_goal(g, &at);
}

/* Before `turn` the lower jerk counts already, which the other one allows too:
 * so the peak may be anywhere there. */
static bool turn_is_behind_the_peak(struct oracle *g)
{
    const struct motion_otg_plan *plan = g->plan;
    for (int turn = plan->turn; turn >= plan->brake; turn--) {
        oracle_init(g, g->move, plan);
        if (is_behind_the_peak(g, turn))
            return true;
    }
    return false;
}

/* Which jerk counts where is for the plan to say, but not as it likes.  The
 * lower of both needs no reason. */
static const char *judge_turn(struct oracle *g)
{
    const struct motion_otg_limit *limit = &g->move->limit;
    const struct motion_otg_plan *plan = g->plan;
    if (plan->brake < 0 || plan->brake > plan->turn || plan->turn > plan->count)
        return "turn";
    if (g->move->mode == MOTION_OTG_POSITION &&
        limit->jerk_down_q32 > limit->jerk_q32 && plan->turn < plan->count &&
        !turn_is_behind_the_peak(g))
        return "turn";
    return NULL;
}

/* Nothing moves. */
static const char *judge_empty(const struct motion_otg_move *m,
                               const struct motion_otg_plan *plan)
{
    if (plan->dur_ns_q12 != 0)
        return "duration";
    if (m->mode == MOTION_OTG_POSITION && m->start.pos_q32 != m->goal.pos_q32)
        return "goal position";
    if (m->limit.acc_max_q32 && m->start.vel_q32 != m->goal.vel_q32)
        return "goal velocity";
    if (m->limit.jerk_q32 && m->start.acc_q32 != m->goal.acc_q32)
        return "goal acceleration";
    return NULL;
}

const char *otg_oracle_judge(const struct motion_otg_move *move,
                             const struct motion_otg_plan *plan)
{
    static struct oracle g;
    if (plan->count < 0 || plan->count > MOTION_OTG_PHASES)
        return "count";
    if (plan->acc_bits < -200 || plan->acc_bits > 240)
        return "acc_bits";
    if (plan->count == 0)
        return judge_empty(move, plan);
    oracle_init(&g, move, plan);
    const char *wrong = judge_turn(&g);
    oracle_init(&g, move, plan);
    if (wrong == NULL)
        wrong = judge_start(&g);
    while (wrong == NULL && g.i < plan->count) {
        oracle_phase(&g);
        wrong = g.n <= 0 ? "duration" : judge_phase(&g);
        oracle_step(&g);
    }
    if (wrong != NULL)
        return wrong;
    if (g.t0 != plan->dur_ns_q12)
        return "duration";
    return judge_goal(&g);
}
