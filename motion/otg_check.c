/* motion/otg_check.c - does a plan do what was asked, inside the limits?
 *
 * Knows nothing of how the plan was found.  It integrates the phases in exact
 * integers and compares with the public numbers, which are whole in the plan's
 * units (otg.h): a limit is kept or it is not.  The corners in `trim` are known
 * to one unit; what these can make is added wherever it can matter:
 *
 *   acceleration  1 at such a corner
 *   jerk          1, or 2 between corners that move apart, over the phase
 *   velocity      W, the sum of both phases' ticks over such corners
 *   the end       W in velocity, 3 W T in position
 *
 * Start and goal are exact, and so is what follows from them alone: the first
 * phase counts from the start, the last one back from the goal.
 *
 * A start that is outside a velocity limit, or bound to leave it, may go where
 * full jerk leads it, v + a^2 / 2j, to the last unit of its acceleration; so may
 * a goal, backwards in time. */
#include <stddef.h>

#include "motion/err.h"
#include "motion/otg_internal.h"
#include "motion/real.h"

struct check {
    const struct motion_otg_plan *plan;
    const struct motion_otg_move *move;
    int64_t acc_max, acc_min;
    struct wide up[3], down[3]; /* see vel_limits */
    bool is_in;                 /* the velocity has been inside its limits */
    int64_t trimmed;            /* W */
    bool has_vel, has_acc, has_jerk;
};

static int refuse(enum motion_otg_field *field, enum motion_otg_field which)
{
    *field = which;
    return MOTION_E_LIMIT;
}

/* --- limits in the plan's units ------------------------------------------- */

static int64_t closing_jerk(const struct motion_otg_limit *lim)
{
    return lim->jerk_down_q16 ? lim->jerk_down_q16 : lim->jerk_q16;
}

/* A limit that does not fit cannot be broken by what does. */
static int64_t limit_acc(int64_t limit_q16, int acc_bits)
{
    int room = acc_bits - 16;
    if (room > 0 && motion_fixed_abs(limit_q16) >> (62 - room) != 0)
        return limit_q16 < 0 ? -INT64_MAX : INT64_MAX;
    return motion_otg_acc_image(limit_q16, acc_bits);
}

/* The same of a velocity: what a plan can hold is below 2^123. */
static struct wide limit_vel(int64_t limit_q32, int acc_bits)
{
    int bits = 64 - (int)motion_fixed_clz_u64(motion_fixed_abs(limit_q32));
    if (bits + acc_bits > 111)
        return wide_shl(wide_from(1), 124);
    return motion_otg_vel_image(limit_q32, acc_bits);
}

/* a^2 / 2j in units of velocity, and what one unit of acceleration makes of it:
 * the jerk of a phase is the limit as nearly as its corners can tell. */
static struct wide ramp_of(int64_t acc_q16, int64_t jerk_q16, int acc_bits)
{
    struct motion_real a = motion_real_from_q(acc_q16, 16);
    struct motion_real j = motion_real_from_q(jerk_q16, 16);
    struct motion_real per_a = motion_real_inv(motion_real_scale(a, acc_bits));
    a = motion_real_half(motion_real_div(motion_real_sqr(a), j));
    a = motion_real_mul(motion_real_scale(a, 22 + acc_bits),
                        motion_real_int(OTG_FIVES));
    per_a = motion_real_add(motion_real_twice(per_a),
                            motion_real_scale(motion_real_int(1), -54));
    a = motion_real_add(a, motion_real_mul(a, per_a));
    struct wide ramp = wide_from(a.m);
    ramp = a.e < 0 ? wide_shr(ramp, a.e < -127 ? 127 : (unsigned)-a.e)
                   : wide_shl(ramp, a.e > 62 ? 62 : (unsigned)a.e);
    return wide_add(ramp, wide_from(1));
}

/* Does a state with velocity v stay below `limit` for certain, when its
 * acceleration a > 0 is let off with jerk j (0: at once)?  The room below the
 * limit is limit - v, at most 2^64. */
static bool swing_is_inside(int64_t vel, int64_t acc, int64_t jerk,
                            int64_t limit)
{
    uint64_t room = (uint64_t)limit - (uint64_t)vel;
    if (vel > limit)
        return false;
    return acc <= 0 || jerk == 0 ||
           motion_otg_ramp_fits(acc, jerk, room - (room >> 40) - (room != 0));
}

static void widen(struct wide *limit, int64_t vel, int64_t acc, int64_t jerk,
                  int acc_bits)
{
    struct wide v = motion_otg_vel_image(vel, acc_bits);
    if (acc > 0 && jerk > 0)
        v = wide_add(v, ramp_of(acc, jerk, acc_bits));
    if (wide_cmp(*limit, v) < 0)
        *limit = v;
}

/* What the velocity may rise to (fall to, upside down, with sign -1): the limit,
 * at first what the start makes necessary, in the last phase the goal. */
static void vel_limits(const struct motion_otg_move *move, int sign,
                       int acc_bits, struct wide limit[3])
{
    const struct motion_otg_limit *lim = &move->limit;
    const struct motion_state *start = &move->start, *goal = &move->goal;
    int64_t most = sign > 0 ? lim->vel_max_q32 : -lim->vel_min_q32;
    int64_t v0 = sign * start->vel_q32, a0 = sign * start->acc_q16;
    int64_t vf = sign * goal->vel_q32, af = -sign * goal->acc_q16;
    int64_t j = lim->jerk_q16, j2 = closing_jerk(lim);
    limit[0] = limit[1] = limit[2] = limit_vel(most, acc_bits);
    if (!swing_is_inside(v0, a0, j, most))
        widen(&limit[1], v0, a0, j, acc_bits);
    if (!swing_is_inside(vf, af, j2, most))
        widen(&limit[2], vf, af, j2, acc_bits);
}

static int64_t corner_weight(const struct motion_otg_plan *plan, int i)
{
    return plan->phase[i].dur_ns_q12 + plan->phase[i + 1].dur_ns_q12;
}

static void check_init(struct check *c)
{
    const struct motion_otg_limit *lim = &c->move->limit;
    const struct motion_otg_plan *plan = c->plan;
    uint32_t both = plan->trim[0] | plan->trim[1];
    c->has_acc = lim->acc_max_q16 != 0;
    c->has_jerk = lim->jerk_q16 != 0;
    c->has_vel = c->move->mode == MOTION_OTG_POSITION;
    c->acc_max = limit_acc(lim->acc_max_q16, plan->acc_bits);
    c->acc_min = limit_acc(lim->acc_min_q16, plan->acc_bits);
    if (c->has_vel) {
        vel_limits(c->move, 1, plan->acc_bits, c->up);
        vel_limits(c->move, -1, plan->acc_bits, c->down);
    }
    c->is_in = false;
    c->trimmed = 0;
    for (int i = 0; both >> i != 0 && i + 1 < plan->count; i++)
        if (both >> i & 1)
            c->trimmed += corner_weight(plan, i);
}

/* --- one phase ------------------------------------------------------------ */

/* From v, a to v1, a1 in n ticks; off: what trimming can change of a and a1,
 * and of the difference. */
struct stretch {
    struct wide v, v1;
    int64_t a, a1, n, jerk;
    int off, off1, off_step;
    bool first, last;
};

/* Corner i - 1 starts phase i. */
static int trim_at(const struct motion_otg_plan *plan, int i)
{
    if (i < 0)
        return 0;
    return (int)((plan->trim[0] >> i & 1) | (plan->trim[1] >> i & 1) << 1);
}

static void stretch_next(const struct check *c, int i, struct otg_run *run,
                         struct stretch *s)
{
    const struct motion_otg_phase *ph = &c->plan->phase[i];
    int before = trim_at(c->plan, i - 1), after = trim_at(c->plan, i);
    s->first = i == 0;
    s->last = i + 1 == c->plan->count;
    s->v = run->v;
    s->a = run->a;
    s->n = ph->dur_ns_q12;
    motion_otg_run_phase(run, ph);
    s->a1 = run->a;
    s->v1 = run->v;
    s->off = before != 0;
    s->off1 = after != 0;
    s->off_step = before == after ? 0 : s->off + s->off1;
    s->jerk =
        c->has_jerk ? motion_otg_phase_jerk(&c->move->limit, c->plan, i) : 0;
}

/* |a1 - a| / n <= jerk: 2^(37 - acc_bits) 5^9 |a1 - a| <= jerk n. */
static bool jerk_is_kept(const struct check *c, const struct stretch *s)
{
    uint64_t step = motion_fixed_abs(s->a1 - s->a) + (uint64_t)s->off_step;
    if (step == 0)
        return true;
    struct wide have = wide_mul_u64(step, OTG_FIVES); /* < 2^84 */
    struct wide most = wide_mul_u64((uint64_t)s->jerk, (uint64_t)s->n);
    int shift = 37 - c->plan->acc_bits;
    if (shift >= 0)
        have = wide_shl(have, (unsigned)shift);
    else /* up */
        have = wide_neg(wide_shr(wide_neg(have), (unsigned)-shift));
    return wide_cmp(have, most) <= 0;
}

static bool acc_is_kept(const struct check *c, int64_t a, int off)
{
    return a <= c->acc_max - off && a >= c->acc_min + off;
}

/* The velocity rises (falls) from where it is v while |a| goes to zero on the
 * way to b on the other side: by a^2 n / (|a| + |b|), at most |a| n. */
static bool crest_is_inside(struct wide room, int64_t a, int64_t b, int64_t n,
                            int off)
{
    uint64_t from = motion_fixed_abs(a) + (uint64_t)off;
    uint64_t to = motion_fixed_abs(b);
    to = to > (uint64_t)off ? to - (uint64_t)off : 0;
    if (wide_is_negative(room))
        return false;
    if (wide_cmp(wide_mul_u64(from, (uint64_t)n), room) <= 0)
        return true;
    struct wider rise = wider_mul(wide_mul_u64(from, from), n);
    return wider_cmp(rise, wider_mul(room, (int64_t)(from + to))) <= 0;
}

/* Where the acceleration changes its sign, the velocity turns.  Counted from
 * v, and backwards in time from v1: `v` with a at it, b at the other end. */
static bool turn_is_inside(const struct check *c, struct wide v, int64_t a,
                           int64_t b, const struct stretch *s, int64_t room)
{
    int which = s->last ? 2 : c->is_in ? 0 : 1;
    struct wide left =
        a > 0 ? wide_sub(c->up[which], v) : wide_add(c->down[which], v);
    return crest_is_inside(wide_sub(left, wide_from(room)), a, b, s->n,
                           s->off | s->off1);
}

/* -down <= v <= up, with the room that trimming needs. */
static bool vel_is_inside(const struct check *c, struct wide v, int which)
{
    const struct wide room = wide_from(c->trimmed);
    return wide_cmp(v, wide_sub(c->up[which], room)) <= 0 &&
           wide_cmp(wide_neg(v), wide_sub(c->down[which], room)) <= 0;
}

/* Outside, a corner must go on to bring the velocity back: by 2^-20 of what may
 * be, so that no cruise counts as that. */
static bool is_let_go(const struct check *c, const struct stretch *s)
{
    bool above = wide_cmp(s->v1, c->up[0]) > 0;
    return above ? s->a1 > c->acc_min >> 20 : s->a1 < c->acc_max >> 20;
}

/* The end of the last phase is the goal, which has been judged. */
static bool vel_is_kept(struct check *c, const struct stretch *s)
{
    bool was_in = c->is_in;
    if (!s->last) {
        c->is_in = vel_is_inside(c, s->v1, 0);
        if (!c->is_in &&
            (was_in || !vel_is_inside(c, s->v1, 1) || is_let_go(c, s)))
            return false;
    }
    if ((s->a ^ s->a1) >= 0 || s->a == 0 || s->a1 == 0)
        return true;
    if (s->last)
        return turn_is_inside(
            c, motion_otg_vel_image(c->plan->goal_vel_q32, c->plan->acc_bits),
            -s->a1, -s->a, s, 0);
    bool now_in = c->is_in;
    c->is_in = was_in;
    bool kept =
        turn_is_inside(c, s->v, s->a, s->a1, s, s->first ? 0 : c->trimmed);
    c->is_in = now_in;
    return kept;
}

static int check_phase(struct check *c, const struct stretch *s,
                       enum motion_otg_field *field)
{
    if (s->n <= 0)
        return refuse(field, MOTION_OTG_FIELD_DURATION);
    if (c->has_jerk && !jerk_is_kept(c, s))
        return refuse(field, MOTION_OTG_FIELD_JERK);
    if (c->has_acc && !acc_is_kept(c, s->a1, s->off1))
        return refuse(field, MOTION_OTG_FIELD_ACC_MAX);
    if (c->has_vel && !vel_is_kept(c, s))
        return refuse(field, MOTION_OTG_FIELD_VEL_MAX);
    return MOTION_OK;
}

/* --- the whole ------------------------------------------------------------ */

static int check_start(const struct check *c, enum motion_otg_field *field)
{
    const struct motion_otg_plan *plan = c->plan;
    const struct motion_state *start = &c->move->start;
    if (plan->start_vel_q32 != start->vel_q32)
        return refuse(field, MOTION_OTG_FIELD_START_VEL);
    if (plan->start_acc != motion_otg_acc_image(start->acc_q16, plan->acc_bits))
        return refuse(field, MOTION_OTG_FIELD_START_ACC);
    return MOTION_OK;
}

/* What is missing at the end is what the trimmed corners' last unit makes; of
 * a free end the rounding to its format, too. */
static bool way_is_met(const struct check *c, struct wider p)
{
    const struct motion_otg_plan *plan = c->plan;
    struct wide way =
        wide_sub(wide_from(plan->goal_pos_q32), wide_from(plan->start_pos_q32));
    struct wide unit =
        wide_mul_u64((uint64_t)c->trimmed, (uint64_t)plan->dur_ns_q12);
    struct wider room = wider_from(wide_add(unit, wide_add(unit, unit)));
    if (!c->has_vel)
        room = motion_otg_way_image(wide_from(1), plan->acc_bits);
    struct wider miss = wider_sub(motion_otg_way_image(way, plan->acc_bits), p);
    return wider_cmp(wider_abs(miss), room) <= 0;
}

static int check_goal(const struct check *c, const struct stretch *end,
                      struct wider p, enum motion_otg_field *field)
{
    const struct motion_otg_plan *plan = c->plan;
    const struct motion_state *goal = &c->move->goal;
    struct wide vel = motion_otg_vel_image(goal->vel_q32, plan->acc_bits);
    struct wide miss = wide_abs(wide_sub(vel, end->v1));
    if (plan->goal_vel_q32 != goal->vel_q32 ||
        wide_cmp(miss, wide_from(c->trimmed)) > 0)
        return refuse(field, MOTION_OTG_FIELD_GOAL_VEL);
    if (end->a1 != motion_otg_acc_image(goal->acc_q16, plan->acc_bits) ||
        trim_at(plan, plan->count - 1) != 0)
        return refuse(field, MOTION_OTG_FIELD_GOAL_ACC);
    if (plan->start_pos_q32 != c->move->start.pos_q32 ||
        (c->has_vel && plan->goal_pos_q32 != goal->pos_q32) ||
        !way_is_met(c, p))
        return refuse(field, MOTION_OTG_FIELD_GOAL_POS);
    return MOTION_OK;
}

static int check_phases(struct check *c, enum motion_otg_field *field)
{
    const struct motion_otg_plan *plan = c->plan;
    struct otg_run run = motion_otg_run_start(plan);
    struct stretch s = { .v1 = run.v, .a1 = plan->start_acc };
    int64_t dur = 0;
    for (int i = 0; i < plan->count; i++) {
        stretch_next(c, i, &run, &s);
        int err = check_phase(c, &s, field);
        if (err < 0)
            return err;
        dur += s.n;
    }
    if (dur != plan->dur_ns_q12)
        return refuse(field, MOTION_OTG_FIELD_DURATION);
    return check_goal(c, &s, run.p, field);
}

int motion_otg_check(const struct motion_otg_move *move,
                     const struct motion_otg_plan *plan,
                     enum motion_otg_field *field)
{
    enum motion_otg_field unused;
    struct check c = { .plan = plan, .move = move };
    if (field == NULL)
        field = &unused;
    *field = MOTION_OTG_FIELD_NONE;
    int err = check_start(&c, field);
    if (err < 0)
        return err;
    check_init(&c);
    return check_phases(&c, field);
}
