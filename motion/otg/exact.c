/* motion/otg/exact.c - a shape in reals becomes a plan that has passed the
 * check.
 *
 *   whole ticks and units (round.c)  ->  meet the goal by moving two
 *   accelerations a little, with constant jerk throughout  ->  check (check.c)
 *
 * Raising the acceleration at the corner between phases of n and n' ticks by
 * one unit adds a hat to it, and so
 *
 *     w = n + n'                  to the velocity at the end
 *     x = w k,  k = 3 r + n - n'  to the position there, r ticks after it
 *
 * (a third of k is the time from the hat's centre to the end).  Neighbouring
 * corners of equal acceleration move together, so that a hold stays one; W and
 * X are their sums.  What velocity and position miss, v and p, two such groups
 * make up for:
 *
 *     W0 d0 + W1 d1 = v,  X0 d0 + X1 d1 = p
 *
 * With k counted from the centre of group 0 (p - k v for p, X - k W for X, all
 * exact) its own X is nothing, and one after the other is found.
 *
 * Where a ramp would bend by more than the margin that tightened limits leave,
 * a Newton step on the places where the motion is free comes first. */
#include <stddef.h>

#include "motion/core/err.h"
#include "motion/core/fixed.h"
#include "motion/otg/internal.h"

#define TRIM_ROUNDS 4 /* 26 of 62 bits each, and one to spare */
#define TRIM_SMALL  ((int64_t)1 << 24) /* what is left is less than a unit */
#define TRIM_GENTLE 25 /* no ramp bends by more than 2^-25, the margin */
#define TRIM_MOST   58 /* an eighth of the largest acceleration, 2^61 */
#define TRIM_FREE   61
#define TRIM_ZERO   (-1000) /* a cruise, until it is weighed: */
#define TRIM_CRUISE 10      /* 2^-10 of the largest peak */
#define TRIM_LONGER 22      /* 2^-22 of the time */

/* Corners first .. last; `weight` the power of two of the velocity they are
 * worth. */
struct trim_group {
    int64_t k;
    int16_t weight;
    int first, last;
};

struct trim {
    struct motion_otg_plan *plan;
    bool gently;
    int most; /* no acceleration moves by more than 2^most */
    int count;
    struct trim_group group[MOTION_OTG_PHASES];
    int64_t k, w[2];         /* the centre of group 0; W of groups 0 and 1 */
    struct motion_u128 x[2]; /* their X about k */
    struct num per_w, per_x; /* 1 / W of group 0, 1 / X of group 1 */
    struct motion_u128 vel;  /* missing */
    struct wider pos;        /* missing about k */
};

static int power_of(int64_t a)
{
    return 64 - (int)motion_real_clz(motion_fixed_abs(a));
}

static void trim_add(struct trim *t, int i, int64_t rest)
{
    const struct motion_otg_phase *ph = &t->plan->phase[i];
    struct trim_group *g = &t->group[t->count++];
    int64_t n = ph[0].dur_ns_q12, next = ph[1].dur_ns_q12;
    g->k = 3 * rest + n - next;
    g->first = g->last = i;
    g->weight =
        (int16_t)(ph->acc == 0 ? TRIM_ZERO
                               : power_of(n + next) + power_of(ph->acc));
}

/* Groups in order of time; corners `alone` are not put together. */
static void trim_groups(struct trim *t, uint32_t fixed, bool alone)
{
    const struct motion_otg_plan *plan = t->plan;
    int64_t rest = plan->dur_ns_q12;
    t->count = 0;
    for (int i = 0; i + 1 < plan->count; i++) {
        rest -= plan->phase[i].dur_ns_q12;
        if (fixed >> i & 1)
            continue;
        bool same = t->count > 0 && t->group[t->count - 1].last == i - 1 &&
                    plan->phase[i].acc == plan->phase[i - 1].acc;
        if (same && !alone)
            t->group[t->count - 1].last = i;
        else
            trim_add(t, i, rest);
    }
}

static int smaller(int a, int b)
{
    return a < b ? a : b;
}

/* A cruise may change its speed by as much as limits are tightened, and so do
 * most of the work of the largest peak; but it should stay one. */
static void trim_weigh_zero(struct trim *t)
{
    int most = 0;
    for (int i = 0; i < t->count; i++)
        if (t->group[i].weight > most)
            most = t->group[i].weight;
    for (int i = 0; i < t->count; i++)
        if (t->group[i].weight == TRIM_ZERO)
            t->group[i].weight = (int16_t)(most - TRIM_CRUISE);
}

/* The two groups whose velocities, times the time between them, are worth most;
 * they become groups 0 and 1. */
static void trim_choose(struct trim *t)
{
    int best = -30000, one = 0, other = 1;
    if (t->count > 2)
        trim_weigh_zero(t);
    for (int i = 0; t->count > 2 && i < t->count; i++)
        for (int k = i + 1; k < t->count; k++) {
            const struct trim_group *a = &t->group[i], *b = &t->group[k];
            int worth = smaller(a->weight, b->weight) + power_of(a->k - b->k);
            if (worth > best) {
                best = worth;
                one = i;
                other = k;
            }
        }
    const struct trim_group first = t->group[one];
    t->group[1] = t->group[other];
    t->group[0] = first;
}

/* For a velocity alone: the group that is worth most becomes group 0. */
static void trim_choose_one(struct trim *t)
{
    int one = 0;
    for (int i = 1; i < t->count; i++)
        if (t->group[i].weight > t->group[one].weight)
            one = i;
    t->group[0] = t->group[one];
}

/* Halve the longest phase, so that there is a corner to move. */
static int trim_split(struct motion_otg_plan *plan)
{
    int longest = 0;
    if (plan->count == 0 || plan->count == MOTION_OTG_PHASES)
        return MOTION_E_LIMIT;
    for (int i = 1; i < plan->count; i++)
        if (plan->phase[i].dur_ns_q12 > plan->phase[longest].dur_ns_q12)
            longest = i;
    struct motion_otg_phase *ph = &plan->phase[longest];
    if (ph->dur_ns_q12 < 2)
        return MOTION_E_LIMIT;
    for (int i = plan->count; i > longest; i--)
        plan->phase[i] = plan->phase[i - 1];
    int64_t from = longest ? ph[-1].acc : plan->start_acc;
    ph[0].dur_ns_q12 /= 2;
    ph[1].dur_ns_q12 -= ph[0].dur_ns_q12;
    ph[0].acc = from + (ph[1].acc - from) / 2;
    plan->count++;
    plan->brake += plan->brake > longest;
    plan->turn += plan->turn > longest;
    return MOTION_OK;
}

/* W, and X about the moment k. */
static struct motion_u128 group_worth(const struct motion_otg_plan *plan,
                                      const struct trim_group *g, int64_t k,
                                      int64_t *all)
{
    struct motion_u128 x = { 0, 0 };
    const struct motion_otg_phase *ph = &plan->phase[g->first];
    int64_t own = g->k - k;
    *all = 0;
    for (int i = g->first; i <= g->last; i++, ph++) {
        int64_t w = ph[0].dur_ns_q12 + ph[1].dur_ns_q12;
        *all += w;
        wide_add_mul(&x, own, w);
        if (i < g->last) /* k'' = k - (n + n' + n'') */
            own -= w + ph[2].dur_ns_q12;
    }
    return x;
}

/* MOTION_E_LIMIT beyond what a plan can hold; by < 2^61. */
static int group_move(struct motion_otg_plan *plan, const struct trim_group *g,
                      int64_t by)
{
    for (int i = g->first; i <= g->last; i++) {
        plan->phase[i].acc += by;
        if (motion_fixed_abs(plan->phase[i].acc) >> 62)
            return MOTION_E_LIMIT;
    }
    return MOTION_OK;
}

static uint32_t group_mask(const struct trim_group *g)
{
    return (2u << g->last) - (1u << g->first);
}

/* d to nearest; MOTION_E_LIMIT when no acceleration could move so far. */
static int trim_rounded(struct num d, int most, int64_t *by)
{
    if (d.m != 0 && d.e > most - 30)
        return MOTION_E_LIMIT;
    int down = -d.e - 1;
    int64_t twice = down <= 0 ? (int64_t)((uint64_t)(int64_t)d.m << -down)
                              : (int64_t)d.m >> (down > 63 ? 63 : down);
    *by = (twice + 1) >> 1;
    return MOTION_OK;
}

/* Are the ramps about the group 2^25 times as much? */
static bool is_gentle(const struct motion_otg_plan *plan,
                      const struct trim_group *g, int64_t by)
{
    const struct motion_otg_phase *ph = plan->phase;
    int64_t before = g->first ? ph[g->first - 1].acc : plan->start_acc;
    uint64_t size = motion_fixed_abs(by) << TRIM_GENTLE;
    return size <= motion_fixed_abs(ph[g->first].acc - before) &&
           size <= motion_fixed_abs(ph[g->last + 1].acc - ph[g->last].acc);
}

/* Moves group i by what makes `lack` good at 1 / `per` a unit, to 2^-26 of
 * it. */
static int trim_by(struct trim *t, int i, struct num lack, struct num per,
                   int64_t *by)
{
    int err = trim_rounded(num_mul(lack, per), t->most, by);
    if (err < 0 || (t->gently && !is_gentle(t->plan, &t->group[i], *by)))
        return MOTION_E_LIMIT;
    return group_move(t->plan, &t->group[i], *by);
}

/* Whether what its own rounding left of a step is less than a unit. */
static bool is_small(int64_t by)
{
    return by > -TRIM_SMALL && by < TRIM_SMALL;
}

static int trim_step(struct trim *t, bool *is_done)
{
    int64_t by, last;
    int err = trim_by(t, 1, motion_otg_wider_num(&t->pos, 0), t->per_x, &by);
    if (err < 0)
        return err;
    wide_add_mul(&t->vel, -by, t->w[1]);
    err = trim_by(t, 0, motion_otg_wide_num(&t->vel, 0), t->per_w, &last);
    if (err < 0)
        return err;
    *is_done = is_small(by) && is_small(last);
    if (*is_done)
        return MOTION_OK;
    wide_add_mul(&t->vel, -last, t->w[0]);
    wider_add_mul(&t->pos, -by, &t->x[1]);
    if ((t->x[0].hi | t->x[0].lo) != 0)
        wider_add_mul(&t->pos, -last, &t->x[0]);
    t->gently = false; /* what is left is 2^-26 of what was found gentle */
    return MOTION_OK;
}

/* Two groups to move; splits a phase where there are not so many corners. */
static int trim_take(struct trim *t, uint32_t fixed)
{
    for (bool alone = false;; alone = true) {
        trim_groups(t, fixed, alone);
        if (t->count > 1)
            break;
        if (alone && trim_split(t->plan) < 0)
            return MOTION_E_LIMIT;
    }
    trim_choose(t);
    t->k = t->group[0].k;
    t->x[0] = group_worth(t->plan, &t->group[0], t->k, &t->w[0]);
    t->per_w = num_inv(num_int(t->w[0]));
    if ((t->x[0].hi | t->x[0].lo) != 0) {
        struct num off = num_mul(motion_otg_wide_num(&t->x[0], 0), t->per_w);
        int64_t later = motion_real_floor_clamped(num_real(off), 0);
        wide_add_mul(&t->x[0], -later, t->w[0]);
        t->k += later;
    }
    t->x[1] = group_worth(t->plan, &t->group[1], t->k, &t->w[1]);
    t->per_x = num_inv(motion_otg_wide_num(&t->x[1], 0));
    if (t->per_x.e > 0)
        return MOTION_E_LIMIT; /* both at one moment */
    for (int i = 0; i < 2; i++)
        t->plan->trim[i] = group_mask(&t->group[i]);
    return MOTION_OK;
}

static int trim_position(struct trim *t, struct motion_otg_plan *plan,
                         uint32_t fixed)
{
    int count = plan->count, err = MOTION_OK;
    bool is_done = false;
    t->plan = plan;
    motion_otg_plan_residual(plan, &t->vel, &t->pos);
    if ((t->pos.hi | t->pos.mid | t->pos.lo | t->vel.hi | t->vel.lo) == 0)
        return MOTION_OK;
    if (trim_take(t, fixed) < 0)
        return MOTION_E_LIMIT;
    if (plan->count != count)
        motion_otg_plan_residual(plan, &t->vel, &t->pos);
    wider_add_mul(&t->pos, -t->k, &t->vel);
    for (int i = 0; i < TRIM_ROUNDS && !is_done && err == MOTION_OK; i++)
        err = trim_step(t, &is_done);
    return err;
}

/* The velocity alone. */
static int trim_one(struct trim *t)
{
    int64_t by;
    (void)group_worth(t->plan, &t->group[0], 0, &t->w[0]);
    t->per_w = num_inv(num_int(t->w[0]));
    t->plan->trim[0] = group_mask(&t->group[0]);
    for (int i = 0; i < TRIM_ROUNDS; i++) {
        int err = trim_by(t, 0, motion_otg_wide_num(&t->vel, 0), t->per_w, &by);
        if (err < 0 || is_small(by))
            return err;
        wide_add_mul(&t->vel, -by, t->w[0]);
    }
    return MOTION_OK;
}

/* A velocity goal ends wherever it ends. */
static int trim_free_end(struct motion_otg_plan *plan)
{
    struct motion_u128 vel;
    struct wider pos;
    plan->goal_pos_q32 = plan->start_pos_q32;
    motion_otg_plan_residual(plan, &vel, &pos);
    return motion_otg_pos_public(wider_neg(pos), plan->acc_bits,
                                 plan->start_pos_q32, false,
                                 &plan->goal_pos_q32);
}

/* A single phase, whose acceleration may be a limit: so much longer that its
 * middle has to give way towards zero. */
static void trim_lengthen(const struct trim *t)
{
    struct motion_otg_plan *plan = t->plan;
    int64_t acc = plan->start_acc + plan->phase[0].acc;
    if (plan->count != 1 || acc == 0 || wide_is_negative(t->vel) != (acc < 0))
        return;
    struct num more = num_div(motion_otg_wide_num(&t->vel, 0), num_int(acc));
    more = num_min(more, num_int(plan->dur_ns_q12 >> TRIM_LONGER));
    int64_t n = 2 + motion_real_floor_clamped(num_real(more), 0);
    plan->phase[0].dur_ns_q12 += n;
    plan->dur_ns_q12 += n;
}

static int trim_velocity(struct trim *t, struct motion_otg_plan *plan,
                         uint32_t fixed)
{
    t->plan = plan;
    motion_otg_plan_residual(plan, &t->vel, &t->pos);
    while ((t->vel.hi | t->vel.lo) != 0) {
        trim_groups(t, fixed, false);
        if (t->count > 0) {
            trim_choose_one(t);
            int err = trim_one(t);
            if (err < 0)
                return err;
            break;
        }
        trim_lengthen(t);
        if (trim_split(plan) < 0)
            return MOTION_E_LIMIT;
        motion_otg_plan_residual(plan, &t->vel, &t->pos);
    }
    return trim_free_end(plan);
}

int motion_otg_trim(enum motion_otg_mode mode, uint32_t fixed,
                    enum otg_trim how, struct motion_otg_plan *plan)
{
    struct trim t;
    t.gently = how == OTG_TRIM_GENTLY;
    t.most = how == OTG_TRIM_FREELY || mode == MOTION_OTG_VELOCITY ? TRIM_FREE
                                                                   : TRIM_MOST;
    plan->trim[0] = plan->trim[1] = 0;
    return mode == MOTION_OTG_VELOCITY ? trim_velocity(&t, plan, fixed)
                                       : trim_position(&t, plan, fixed);
}

/* --- round, meet the goal, check ------------------------------------------ */

#define SETTLE_REPAIRS 4  /* how often steep ramps get more ticks: */
#define REPAIR_BITS    24 /* 2^-24 more than they take, */
#define REPAIR_TICKS   16 /* and 16 ticks */
#define SETTLE_STEPS   4  /* of Newton's method */
#define SETTLE_LONGER  21 /* 2^-21 more than proposed, and a ns */
/* With two jerks, or where time grows with the root of what a displacement is
 * off: 2^-10. */
#define SETTLE_FREELY 10
#define SETTLE_TICKS  4096

struct settle {
    const struct motion_otg_move *move;
    const struct otg_shape *shape;
    struct motion_otg_plan *plan;
    int64_t dur_ns_q12; /* given, or 0 */
    int64_t rounded;    /* that of the proposal */
    struct otg_rates rates;
    uint32_t fixed; /* corners that may not move */
    bool is_strict;
};

/* The longest phase whose corners may move takes what is missing from the
 * given total; with `rates` the one with the most time to spare. */
static int settle_total(struct motion_otg_plan *plan, uint32_t fixed,
                        int64_t dur_ns_q12, const struct otg_rates *rates)
{
    int longest = -1;
    int64_t from = plan->start_acc;
    int64_t most = 0, missing = dur_ns_q12 - plan->dur_ns_q12;
    if (dur_ns_q12 == 0 || missing == 0)
        return MOTION_OK;
    if (dur_ns_q12 >= MOTION_TRACK_SEGMENT_MAX_NS_Q12)
        return MOTION_E_RANGE;
    for (int i = 0; i < plan->count; i++) {
        bool ends = (i == 0 && (fixed & 1)) ||
                    (i > 0 && i + 1 == plan->count && (fixed >> (i - 1) & 1));
        int64_t spare = plan->phase[i].dur_ns_q12, acc = plan->phase[i].acc;
        if (rates)
            spare -= motion_otg_ramp_ticks(rates, i, acc - from);
        from = acc;
        if (!ends && spare > most) {
            most = spare;
            longest = i;
        }
    }
    if (most + missing <= 0 || longest < 0)
        return MOTION_E_LIMIT;
    plan->phase[longest].dur_ns_q12 += missing;
    plan->dur_ns_q12 = dur_ns_q12;
    return MOTION_OK;
}

/* One step on the shape's own free phases; the residual is exact.  The
 * first one finds the duration where it is free, the others keep that: a part
 * of a tick at the cruise's speed may be more than the pulses can take. */
static void settle_refine(const struct settle *s, bool is_first)
{
    struct motion_otg_plan *plan = s->plan;
    struct otg_residual residual;
    struct wider pos;
    struct motion_u128 vel;
    motion_otg_plan_residual(plan, &vel, &pos);
    residual.vel = motion_otg_vel_num(&vel, plan->acc_bits);
    residual.pos = motion_otg_pos_num(&pos, plan->acc_bits);
    residual.is_timed = s->dur_ns_q12 != 0 || !is_first;
    residual.ticks = s->dur_ns_q12 ? s->dur_ns_q12 - plan->dur_ns_q12 : 0;
    motion_otg_refine(plan, s->shape, &s->rates, &residual);
}

/* --- nothing to do for some time ------------------------------------------ */

static bool stands_still(const struct motion_otg_move *move)
{
    const struct motion_state *start = &move->start, *goal = &move->goal;
    return move->mode == MOTION_OTG_POSITION &&
           start->pos_q32 == goal->pos_q32 &&
           (start->vel_q32 | goal->vel_q32) == 0 &&
           (start->acc_q32 | goal->acc_q32) == 0;
}

static int settle_wait(int64_t dur_ns_q12, struct motion_otg_plan *plan)
{
    plan->count = 1;
    plan->phase[0] = (struct motion_otg_phase){ dur_ns_q12, 0 };
    plan->dur_ns_q12 = dur_ns_q12;
    plan->brake = plan->turn = 0;
    plan->trim[0] = plan->trim[1] = 0;
    return dur_ns_q12 < MOTION_TRACK_SEGMENT_MAX_NS_Q12 ? MOTION_OK
                                                        : MOTION_E_RANGE;
}

/* --- all of it ------------------------------------------------------------ */

static enum otg_trim settle_trim(const struct settle *s)
{
    return s->dur_ns_q12 ? OTG_TRIM_FREELY : OTG_TRIM_USUAL;
}

/* After so many Newton steps; without any, no ramp may bend by more than its
 * margin. */
static int settle_make(struct settle *s, int steps)
{
    struct motion_otg_plan *plan = s->plan;
    uint32_t ends;
    int err = motion_otg_round(s->move, s->shape, &s->rates, plan, &ends);
    if (err < 0)
        return err;
    s->rounded = plan->dur_ns_q12;
    if (steps > 0)
        motion_otg_round_ends(plan);
    for (int i = 0; i < steps && s->shape->free.pulse[0] >= 0; i++)
        settle_refine(s, i == 0);
    s->fixed = motion_otg_round_join(s->shape, ends, plan);
    err = settle_total(plan, s->fixed, s->dur_ns_q12, NULL);
    return err < 0 ? err
                   : motion_otg_trim(s->move->mode, s->fixed,
                                     steps ? settle_trim(s) : OTG_TRIM_GENTLY,
                                     plan);
}

/* Trimming made some ramps steeper than they may be: give them time.  With a
 * given duration the phase that can spare most gives it. */
static int settle_repair(struct settle *s)
{
    struct motion_otg_plan *plan = s->plan;
    int64_t acc = plan->start_acc;
    s->rates.brake = plan->brake;
    s->rates.turn = plan->turn;
    for (int i = 0; i < plan->count; i++) {
        struct motion_otg_phase *ph = &plan->phase[i];
        int64_t least = motion_otg_ramp_ticks(&s->rates, i, ph->acc - acc);
        bool is_swing =
            (i == 0 && (s->fixed & 1)) ||
            (i > 0 && i + 1 == plan->count && (s->fixed >> (i - 1) & 1));
        if (least > ph->dur_ns_q12 && !is_swing) {
            least += (least >> REPAIR_BITS) + REPAIR_TICKS;
            plan->dur_ns_q12 += least - ph->dur_ns_q12;
            ph->dur_ns_q12 = least;
        }
        acc = ph->acc;
    }
    int err = settle_total(plan, s->fixed, s->dur_ns_q12, &s->rates);
    return err < 0
               ? err
               : motion_otg_trim(s->move->mode, s->fixed, settle_trim(s), plan);
}

/* With two jerks the cruise's speed says which counts where, so what moves it
 * may not go far. */
static bool has_two_jerks(const struct settle *s)
{
    return s->move->limit.jerk_down_q32 != 0;
}

/* Made good at the price of a longer time. */
static bool is_longer(const struct settle *s)
{
    int bits = has_two_jerks(s) || s->is_strict ? SETTLE_FREELY : SETTLE_LONGER;
    return s->dur_ns_q12 == 0 &&
           s->plan->dur_ns_q12 >
               s->rounded + (s->rounded >> bits) + SETTLE_TICKS;
}

static int settle_check(const struct settle *s, int err,
                        enum motion_otg_field *field)
{
    *field = MOTION_OTG_FIELD_GOAL_POS;
    if (err == MOTION_OK)
        err = motion_otg_check(s->move, s->plan, field);
    if (err == MOTION_OK && is_longer(s)) {
        *field = MOTION_OTG_FIELD_GOAL_POS;
        err = MOTION_E_LIMIT;
    }
    return err;
}

/* By more Newton steps: not a cruise that is too fast, which they keep. */
static bool is_curable(enum motion_otg_field field)
{
    return field == MOTION_OTG_FIELD_GOAL_POS || field == MOTION_OTG_FIELD_JERK;
}

/* Braking leaves more than trimming alone can make good. */
int motion_otg_settle(const struct motion_otg_move *move,
                      const struct otg_problem *problem,
                      const struct otg_shape *shape, int64_t dur_ns_q12,
                      struct motion_otg_plan *plan,
                      enum motion_otg_field *field)
{
    struct settle s;
    s.move = move;
    s.shape = shape;
    s.plan = plan;
    s.dur_ns_q12 = dur_ns_q12;
    s.fixed = 0;
    s.is_strict = problem->is_strict;
    int err = motion_otg_round_start(move, problem, shape, &s.rates, plan);
    if (err < 0 || (dur_ns_q12 != 0 && stands_still(move)))
        return settle_check(&s, err < 0 ? err : settle_wait(dur_ns_q12, plan),
                            field);
    bool has_free = shape->free.pulse[0] >= 0;
    int steps = has_free && shape->brake == 0 ? 0 : 1;
    int most = has_free && !has_two_jerks(&s) ? SETTLE_STEPS : 1;
    do
        err = settle_check(&s, settle_make(&s, steps++), field);
    while (err == MOTION_E_LIMIT && steps <= most &&
           (steps == 1 || is_curable(*field)));
    for (int k = 0; k < SETTLE_REPAIRS && err == MOTION_E_LIMIT &&
                    *field == MOTION_OTG_FIELD_JERK;
         k++)
        err = settle_check(&s, settle_repair(&s), field);
    return err;
}

int motion_otg_stretch(const struct motion_otg_move *move, int64_t dur_ns_q12,
                       struct motion_otg_plan *plan)
{
    int err = settle_total(plan, 0, dur_ns_q12, NULL);
    if (err == MOTION_OK)
        err = motion_otg_trim(move->mode, 0, OTG_TRIM_FREELY, plan);
    return err < 0 ? err : motion_otg_check(move, plan, NULL);
}
