/* motion/otg_check.c - does a plan do what was asked, inside the limits?
 *
 * Knows nothing of how the plan was found.  It integrates the phases in exact
 * integers and compares; the added quintic E is bounded by its third
 * derivatives' Bernstein coefficients, which enclose them:
 *
 *   |E'''| <= B / N^3      B = max(|e3|, |e3 + 2 e4|, |e3 + 4 e4 + 10 e5|)
 *   |E''|  <= B2 / N^2     3 B2 = max(|e3|, |2 e3 + 2 e4|)
 *   |E'|   <= B1 / N       6 B1 = max(|e3|, |3 e3 + 2 e4|,
 *                                     |6 e3 + 8 e4 + 10 e5|)
 *
 * in units of jerk, acceleration and velocity (which counts half units).  At
 * time t from either end also |E''| <= B t / N^3: the ends are exact.  Every
 * bound is rounded outwards. */
#include <stddef.h>

#include "motion/err.h"
#include "motion/otg_internal.h"

struct check {
    const struct motion_otg_plan *plan;
    struct otg_units units;
    int64_t acc_max, acc_min, acc_bend;
    struct wide vel_max, vel_min, vel_bend;
    int64_t jerk, jerk_down, jerk_bend; /* times 2^jerk_shift */
    int jerk_shift;
    bool has_acc, has_jerk;
};

static struct wide check_abs(struct wide a)
{
    return wide_is_negative(a) ? wide_neg(a) : a;
}

static struct wide check_larger(struct wide a, struct wide b)
{
    return wide_cmp(a, b) < 0 ? b : a;
}

static struct wide largest(struct wide a, struct wide b, struct wide c)
{
    return check_larger(check_abs(a), check_larger(check_abs(b), check_abs(c)));
}

/* B, 3 B2, 6 B1 of the heading. */
static void bend_bounds(const struct motion_otg_plan *plan, struct wide *jerk,
                        struct wide *acc, struct wide *vel)
{
    struct wide e3 = motion_otg_wide_in(plan->bend[0]);
    struct wide e4 = motion_otg_wide_in(plan->bend[1]);
    struct wide e5 = motion_otg_wide_in(plan->bend[2]);
    struct wide both = wide_shl(wide_add(e3, e4), 1);
    struct wide twice = wide_add(both, e3); /* 3 e3 + 2 e4 */
    struct wide end =
        wide_add(twice, wide_add(wide_shl(e4, 1), wide_mul(e5, 5)));
    *jerk = largest(e3, wide_add(e3, wide_shl(e4, 1)),
                    wide_add(wide_add(e3, wide_shl(e4, 2)), wide_mul(e5, 10)));
    *acc = largest(e3, both, wide_from(0));
    *vel = largest(e3, twice, wide_shl(end, 1));
}

/* The limit itself, or what start and goal make necessary beyond it. */
static struct wide limit_vel(int64_t limit_q32, struct real need, bool upper,
                             const struct otg_units *units)
{
    struct real limit = real_scale(real_int(limit_q32), -32);
    if (real_cmp(need, limit) * (upper ? 1 : -1) > 0)
        return wide_floor(real_mul(real_scale(need, 32), units->vel));
    return motion_otg_scaled(limit_q32, units->vel);
}

/* A limit far above anything in the plan does not fit and need not. */
static int64_t limit_acc(int64_t limit_q16, const struct otg_units *units)
{
    const struct wide most = { 0, (uint64_t)1 << 62 };
    struct wide a = motion_otg_scaled(limit_q16, units->acc);
    if (wide_cmp(most, a) < 0)
        a = most;
    if (wide_cmp(a, wide_neg(most)) < 0)
        a = wide_neg(most);
    return (int64_t)a.lo;
}

/* The room the quintic takes, rounded up. */
static void check_bend(struct check *c)
{
    struct wide jerk, acc, vel;
    struct real per_n = real_inv(real_int(c->plan->ticks));
    struct real per_n2 = real_sqr(per_n);
    bend_bounds(c->plan, &jerk, &acc, &vel);
    if (vel.hi == 0 && vel.lo == 0 && jerk.hi == 0 && jerk.lo == 0)
        return;
    struct real b = real_mul(wide_real(jerk, 0), real_mul(per_n, per_n2));
    c->jerk_bend = real_floor(b, c->jerk_shift) + 1;
    b = real_mul(wide_real(acc, 0), per_n2);
    c->acc_bend = real_floor(b, 0) / 3 + 2;
    b = real_mul(wide_real(vel, 0), per_n);
    c->vel_bend = wide_add(wide_shr(wide_floor(b), 2), wide_from(2));
}

/* Limits in the plan's units. */
static void check_limits(const struct motion_otg_move *move, struct check *c)
{
    const struct motion_otg_limit *lim = &move->limit;
    const struct otg_units *units = &c->units;
    struct otg_range range;
    motion_otg_allowed(move, c->plan->dur_ns_q12, &range);
    c->has_acc = lim->acc_max_q16 != 0;
    c->has_jerk = lim->jerk_q16 != 0;
    c->acc_max = limit_acc(lim->acc_max_q16, units);
    c->acc_min = limit_acc(lim->acc_min_q16, units);
    if (c->acc_max < c->plan->start_acc)
        c->acc_max = c->plan->start_acc;
    if (c->acc_min > c->plan->start_acc)
        c->acc_min = c->plan->start_acc;
    c->vel_max = limit_vel(lim->vel_max_q32, range.vx, true, units);
    c->vel_min = limit_vel(lim->vel_min_q32, range.vn, false, units);
    /* the start itself, as the plan counts it */
    struct wide vel = motion_otg_wide_in(c->plan->start_vel);
    c->vel_max = check_larger(c->vel_max, vel);
    c->vel_min = wide_cmp(c->vel_min, vel) < 0 ? c->vel_min : vel;
    int64_t down = lim->jerk_down_q16 ? lim->jerk_down_q16 : lim->jerk_q16;
    struct real jerk = real_mul(real_int(lim->jerk_q16), units->jerk);
    struct real jerk_down = real_mul(real_int(down), units->jerk);
    int shift = 56 - (real_max(jerk, jerk_down).e + 62);
    c->jerk_shift = shift < 0 ? 0 : shift > 60 ? 60 : shift;
    c->jerk = real_floor(jerk, c->jerk_shift);
    c->jerk_down = real_floor(jerk_down, c->jerk_shift);
    check_bend(c);
}

/* |step| / n + bend <= jerk. */
static bool jerk_is_kept(const struct check *c, int64_t jerk, int64_t step,
                         int64_t n)
{
    struct wide have =
        wide_shl(check_abs(wide_from(step)), (unsigned)c->jerk_shift);
    int64_t room = jerk - c->jerk_bend;
    return room >= 0 && wide_cmp(have, wide_mul(wide_from(room), n)) <= 0;
}

/* The ends of the move are exact; elsewhere the quintic may add its bound. */
static bool acc_is_kept(const struct check *c, int64_t a, bool exact)
{
    int64_t room = exact ? 0 : c->acc_bend;
    return a <= c->acc_max - room && a >= c->acc_min + room;
}

/* One phase, velocity from v at its start to v1; on the last both counted back
 * from the goal, where E' makes up what the phases miss. */
struct stretch {
    struct wide v, v1;
    int64_t a, a1, n;
    bool first, last;
    int64_t jerk;
};

/* What E' can add on the phase; next to an end of the move, where it is zero
 * with its slope, less. */
static struct wide bend_on(const struct check *c, const struct stretch *s)
{
    struct real n = real_int(s->n);
    if (!s->first && !s->last)
        return c->vel_bend;
    struct real near = real_mul(real_int(c->jerk_bend), real_sqr(n));
    struct wide bend =
        wide_add(wide_floor(real_scale(near, -c->jerk_shift)), wide_from(1));
    return wide_cmp(bend, c->vel_bend) < 0 ? bend : c->vel_bend;
}

/* How far v passes its start before a = 0: a^2 n / (a - a1), up by 2^-40. */
static struct wide crest(const struct stretch *s)
{
    struct real square = real_sqr(real_int(s->a));
    struct real rise =
        real_div(real_mul(square, real_int(s->n)), real_int(s->a - s->a1));
    rise = real_add(rise, real_scale(rise, -40));
    return wide_add(wide_floor(rise), wide_from(1));
}

/* Highest speed on the phase.  Where it only falls from the exact start (rises
 * to the exact end) it is there; where jerk is positive v + b t^2 is convex and
 * has its highest value at an end. */
static struct wide highest(const struct check *c, const struct stretch *s)
{
    struct wide bend = bend_on(c, s);
    bool convex = s->a1 > s->a;
    if (s->first && s->a <= 0 && s->a1 + c->acc_bend <= 0)
        return s->v;
    if (s->last && s->a1 >= 0 && s->a - c->acc_bend >= 0)
        return s->v1;
    if (s->first && convex)
        return check_larger(s->v, wide_add(s->v1, bend));
    if (s->last && convex)
        return check_larger(wide_add(s->v, bend), s->v1);
    struct wide top = check_larger(s->v, s->v1);
    if (s->a > 0 && s->a1 < 0)
        top = wide_add(s->v, crest(s));
    return wide_add(top, bend);
}

static struct stretch upside_down(const struct stretch *s)
{
    struct stretch down = *s;
    down.v = wide_neg(s->v);
    down.v1 = wide_neg(s->v1);
    down.a = -s->a;
    down.a1 = -s->a1;
    return down;
}

static bool vel_is_kept(const struct check *c, const struct stretch *s)
{
    struct stretch down = upside_down(s);
    return wide_cmp(highest(c, s), c->vel_max) <= 0 &&
           wide_cmp(highest(c, &down), wide_neg(c->vel_min)) <= 0;
}

static int refuse(enum motion_otg_field *field, enum motion_otg_field which)
{
    *field = which;
    return MOTION_E_LIMIT;
}

static int check_phase(const struct check *c, const struct stretch *s,
                       bool position, enum motion_otg_field *field)
{
    if (s->n <= 0)
        return refuse(field, MOTION_OTG_FIELD_DURATION);
    if (c->has_jerk && !jerk_is_kept(c, s->jerk, s->a1 - s->a, s->n))
        return refuse(field, MOTION_OTG_FIELD_JERK);
    if (c->has_acc &&
        (!acc_is_kept(c, s->a, s->first) || !acc_is_kept(c, s->a1, s->last)))
        return refuse(field, MOTION_OTG_FIELD_ACC_MAX);
    if (position && !vel_is_kept(c, s))
        return refuse(field, MOTION_OTG_FIELD_VEL_MAX);
    return MOTION_OK;
}

/* V (2 a, a1) over n ticks, see otg.h. */
static struct wide phase_way(const struct stretch *s)
{
    struct wide v3 = wide_mul(s->v, 3);
    struct wide bent = wide_mul(wide_from(2 * s->a + s->a1), s->n);
    return wide_mul(wide_add(v3, bent), s->n);
}

/* Start and end of the whole, with the quintic's value and slopes there. */
static int check_goal(const struct check *c, const struct motion_otg_move *move,
                      struct wide vel, struct wide way, int64_t acc,
                      enum motion_otg_field *field)
{
    const struct motion_otg_plan *plan = c->plan;
    struct wide e3 = motion_otg_wide_in(plan->bend[0]);
    struct wide e4 = motion_otg_wide_in(plan->bend[1]);
    struct wide e5 = motion_otg_wide_in(plan->bend[2]);
    struct wide want = motion_otg_scaled(move->goal.vel_q32, c->units.vel);
    struct wide slope = wide_mul(wide_sub(want, vel), 3);
    slope = wide_mul(slope, plan->ticks);
    struct wide bend = wide_add(wide_mul(e3, 3), wide_shl(e4, 2));
    if (wide_cmp(slope, wide_add(bend, wide_mul(e5, 5))) != 0)
        return refuse(field, MOTION_OTG_FIELD_GOAL_VEL);
    bend = wide_add(wide_mul(e3, 6), wide_mul(e4, 12));
    bend = wide_add(bend, wide_mul(e5, 20));
    struct wide goal_acc = motion_otg_scaled(move->goal.acc_q16, c->units.acc);
    if (wide_cmp(bend, wide_from(0)) != 0 || (int64_t)goal_acc.lo != acc)
        return refuse(field, MOTION_OTG_FIELD_GOAL_ACC);
    way = wide_add(way, wide_add(e3, wide_add(e4, e5)));
    if (wide_cmp(way, motion_otg_wide_in(plan->way)) != 0)
        return refuse(field, MOTION_OTG_FIELD_GOAL_POS);
    if (move->mode == MOTION_OTG_POSITION &&
        wide_cmp(way, motion_otg_way(plan, move)) != 0)
        return refuse(field, MOTION_OTG_FIELD_GOAL_POS);
    return MOTION_OK;
}

static int check_start(const struct check *c,
                       const struct motion_otg_move *move,
                       enum motion_otg_field *field)
{
    const struct motion_otg_plan *plan = c->plan;
    struct wide vel = motion_otg_scaled(move->start.vel_q32, c->units.vel);
    struct wide acc = motion_otg_scaled(move->start.acc_q16, c->units.acc);
    if (wide_cmp(vel, motion_otg_wide_in(plan->start_vel)) != 0)
        return refuse(field, MOTION_OTG_FIELD_START_VEL);
    if ((int64_t)acc.lo != plan->start_acc)
        return refuse(field, MOTION_OTG_FIELD_START_ACC);
    return MOTION_OK;
}

static int64_t jerk_of(const struct check *c, int i)
{
    if (i < c->plan->brake)
        return c->jerk;
    if (i >= c->plan->turn)
        return c->jerk_down;
    return c->jerk < c->jerk_down ? c->jerk : c->jerk_down;
}

/* Step s on to phase i. */
static void next_stretch(const struct check *c, int i, struct stretch *s)
{
    s->v = s->v1;
    s->a = s->a1;
    s->n = c->plan->phase[i].ticks;
    s->a1 = c->plan->phase[i].acc;
    s->v1 = wide_add(s->v, wide_mul(wide_from(s->a + s->a1), s->n));
    s->first = i == 0;
    s->last = i + 1 == c->plan->count;
    s->jerk = jerk_of(c, i);
}

static int judge(const struct check *c, const struct motion_otg_move *move,
                 struct stretch s, enum motion_otg_field *field)
{
    if (s.last && !s.first) {
        struct wide goal = motion_otg_scaled(move->goal.vel_q32, c->units.vel);
        s.v = wide_add(s.v, wide_sub(goal, s.v1));
        s.v1 = goal;
    }
    return check_phase(c, &s, move->mode == MOTION_OTG_POSITION, field);
}

static int check_phases(const struct check *c,
                        const struct motion_otg_move *move,
                        enum motion_otg_field *field)
{
    const struct motion_otg_plan *plan = c->plan;
    struct wide way = wide_from(0);
    struct stretch s = { .v1 = motion_otg_wide_in(plan->start_vel),
                         .a1 = plan->start_acc };
    for (int i = 0; i < plan->count; i++) {
        next_stretch(c, i, &s);
        int err = judge(c, move, s, field);
        if (err < 0)
            return err;
        way = wide_add(way, phase_way(&s));
    }
    return check_goal(c, move, s.v1, way, s.a1, field);
}

int motion_otg_check(const struct motion_otg_move *move,
                     const struct motion_otg_plan *plan,
                     enum motion_otg_field *field)
{
    enum motion_otg_field unused;
    struct check c = { .plan = plan };
    if (field == NULL)
        field = &unused;
    *field = MOTION_OTG_FIELD_NONE;
    motion_otg_units(plan, &c.units);
    int err = check_start(&c, move, field);
    if (err < 0)
        return err;
    if (plan->count > 0)
        check_limits(move, &c);
    return check_phases(&c, move, field);
}
