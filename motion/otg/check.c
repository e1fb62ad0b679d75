/* motion/otg/check.c - does a plan meet its request, inside the limits?
 *
 * Shares nothing with how the plan was found.  It integrates the phases in
 * exact integers and compares with the public numbers, which are whole in the
 * plan's units (otg.h): a limit is kept or it is not.  V is followed from
 * corner to corner; P is what each phase adds to V, times the time that is
 * left.  The corners in `trim` are known to one unit; what these can make is
 * added wherever it can matter:
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
 * full jerk leads it, v + a^2 / 2j, to the last unit of its acceleration; so
 * may a goal, backwards in time. */
#include <stddef.h>

#include "motion/core/err.h"
#include "motion/core/fixed.h"
#include "motion/number/real.h"
#include "motion/otg/internal.h"

struct otg_check {
    const struct motion_otg_plan *plan;
    const struct motion_otg_move *move;
    struct motion_u128 start, goal, up, down; /* V there, and at its limits */
    struct motion_u128 up_in, down_in; /* with the margin that trimming takes */
    int64_t acc_max, acc_min;
    int64_t trimmed, slack; /* W; that margin, 2^9 W or where is_coarse W */
    uint64_t fives;         /* see jerk_is_kept */
    uint64_t jerk[2];
    int step_down;
    bool has_vel, has_acc, has_jerk, is_coarse;
    bool is_in[2]; /* the velocity has been below its limit, above the lower */
};

enum otg_check_end { OTG_CHECK_START, OTG_CHECK_GOAL };

/* Margin above v (below it with sign -1). */
static inline struct motion_u128 check_margin(const struct otg_check *c,
                                              struct motion_u128 v, int sign)
{
    return sign > 0 ? wide_sub(c->up, v) : wide_sub(v, c->down);
}

/* --- limits in the plan's units ------------------------------------------- */

#define CHECK_FIVES_BITS 42 /* 5^9 has 21 bits */
#define CHECK_SLACK      9  /* 2^9 W: see "what a track lays on one phase" */
#define CHECK_LEAST      36 /* 2^9 W is little: 2^-27 of the limits */
#define CHECK_MOST       54 /* of W, to hold 2^9 W */

/* A limit that does not fit cannot be broken by what does. */
static int64_t limit_acc(int64_t limit_q32, int acc_bits)
{
    int margin = acc_bits - 32;
    if (margin > 0 && motion_fixed_abs(limit_q32) >> (62 - margin) != 0)
        return limit_q32 < 0 ? -INT64_MAX : INT64_MAX;
    return motion_otg_acc_image(limit_q32, acc_bits);
}

#define CHECK_VEL_BITS 111 /* of a velocity and acc_bits: below 2^123 */

static struct motion_u128 limit_vel(int64_t limit_q32, int acc_bits)
{
    if (64 - (int)motion_real_clz(motion_fixed_abs(limit_q32)) + acc_bits <=
        CHECK_VEL_BITS)
        return motion_otg_vel_image(limit_q32, acc_bits);
    struct motion_u128 most = { (uint64_t)1 << 60, 0 };
    return limit_q32 < 0 ? wide_neg(most) : most;
}

/* a^2 / 2j in units of velocity, and what one unit of acceleration makes of it:
 * the jerk of a phase is the limit as nearly as its corners can tell. */
static struct motion_u128 ramp_of(int64_t acc_q32, int64_t jerk_q32,
                                  int acc_bits)
{
    struct motion_real a = motion_otg_signed(acc_q32, 32, false);
    struct motion_real j = motion_otg_signed(jerk_q32, 32, false);
    struct motion_real five =
        motion_otg_signed(OTG_FIVES, -21 - acc_bits, false);
    struct motion_real two = motion_otg_signed(1, acc_bits - 1, false);
    struct motion_real more = motion_otg_signed(1, 54, false);
    two = motion_otg_per(&two, &a);
    more = motion_otg_sum(&more, &two);
    a = motion_otg_times(&a, &a);
    a = motion_otg_per(&a, &j);
    a = motion_otg_times(&a, &five);
    more = motion_otg_times(&a, &more);
    a = motion_otg_sum(&a, &more);
    struct motion_u128 ramp = wide_from(a.m);
    ramp = a.e < 0 ? wide_shr(ramp, a.e < -127 ? 127 : (unsigned)-a.e)
                   : motion_fixed_shl_u128(ramp, a.e > 62 ? 62 : (unsigned)a.e);
    return wide_add(ramp, wide_from(1));
}

/* Does a state with velocity v stay below `limit` for certain, when its
 * acceleration a > 0 ramps to zero with jerk j (0: at once)?  The margin below
 * the limit is limit - v, at most 2^64. */
static bool swing_is_inside(int64_t vel, int64_t acc, int64_t jerk,
                            int64_t limit)
{
    uint64_t margin = (uint64_t)limit - (uint64_t)vel;
    if (vel > limit)
        return false;
    return acc <= 0 || jerk == 0 ||
           motion_otg_ramp_fits(acc, jerk,
                                margin - (margin >> 40) - (margin != 0));
}

/* What the velocity may rise to (fall to, upside down, with sign -1): the
 * limit, or what the start or the goal makes necessary. */
static struct motion_u128 check_widened(const struct otg_check *c, int sign,
                                        enum otg_check_end end)
{
    const struct motion_otg_limit *lim = &c->move->limit;
    bool is_goal = end == OTG_CHECK_GOAL;
    const struct motion_state *at = is_goal ? &c->move->goal : &c->move->start;
    int64_t most = sign > 0 ? lim->vel_max_q32 : -lim->vel_min_q32;
    int64_t vel = sign * at->vel_q32;
    int64_t acc = (is_goal ? -sign : sign) * at->acc_q32;
    int64_t jerk = is_goal ? otg_closing_jerk(lim) : lim->jerk_q32;
    struct motion_u128 limit = sign > 0 ? c->up : wide_neg(c->down);
    if (swing_is_inside(vel, acc, jerk, most))
        return limit;
    struct motion_u128 v = motion_otg_vel_image(vel, c->plan->acc_bits);
    if (acc > 0 && jerk > 0)
        v = wide_add(v, ramp_of(acc, jerk, c->plan->acc_bits));
    return wide_is_less(limit, v) ? v : limit;
}

static int64_t trimmed_ticks(const struct motion_otg_plan *plan)
{
    const struct motion_otg_phase *ph = plan->phase;
    int64_t all = 0;
    for (uint32_t both = plan->trim[0] | plan->trim[1]; both; both >>= 1, ph++)
        if (both & 1)
            all += ph[0].dur_ns_q12 + ph[1].dur_ns_q12;
    return all;
}

/* 5^9 step <= 2^up jerk n: the power on the side where it fits. */
static void jerk_init(struct otg_check *c, int up)
{
    uint64_t jerk = (uint64_t)c->move->limit.jerk_q32;
    uint64_t down = (uint64_t)otg_closing_jerk(&c->move->limit);
    int margin = (int)motion_real_clz(jerk | down),
        by = up < margin ? up : margin;
    c->fives = OTG_FIVES;
    c->step_down = up - by;
    if (up < 0) {
        c->fives <<= up < -CHECK_FIVES_BITS ? CHECK_FIVES_BITS : -up;
        by = c->step_down = 0;
    }
    c->jerk[0] = jerk << by;
    c->jerk[1] = down << by;
}

/* W < V 2^-36, the upper half of V being V 2^-64. */
static bool is_coarse(const struct otg_check *c)
{
    int64_t w = c->trimmed >> (64 - CHECK_LEAST);
    return w >= (int64_t)c->up.hi || w >= (int64_t)~c->down.hi ||
           c->trimmed >> CHECK_MOST != 0;
}

static void check_init(struct otg_check *c, const struct motion_otg_move *move,
                       const struct motion_otg_plan *plan)
{
    const struct motion_otg_limit *lim = &move->limit;
    int bits = plan->acc_bits;
    c->plan = plan;
    c->move = move;
    c->has_acc = lim->acc_max_q32 != 0;
    c->has_jerk = lim->jerk_q32 != 0;
    c->has_vel = c->move->mode == MOTION_OTG_POSITION;
    c->acc_max = limit_acc(lim->acc_max_q32, bits);
    c->acc_min = limit_acc(lim->acc_min_q32, bits);
    c->start = motion_otg_vel_image(c->plan->start_vel_q32, bits);
    c->goal = motion_otg_vel_image(c->plan->goal_vel_q32, bits);
    jerk_init(c, bits - 53);
    c->is_in[0] = c->is_in[1] = false;
    c->trimmed = trimmed_ticks(c->plan);
    if (!c->has_vel)
        return;
    c->up = limit_vel(lim->vel_max_q32, bits);
    c->down = (uint64_t)lim->vel_max_q32 + (uint64_t)lim->vel_min_q32 == 0
                  ? wide_neg(c->up)
                  : limit_vel(lim->vel_min_q32, bits);
    c->is_coarse = is_coarse(c);
    c->slack = c->is_coarse ? c->trimmed : c->trimmed << CHECK_SLACK;
    c->up_in = wide_sub(c->up, wide_from(c->slack));
    c->down_in = wide_add(c->down, wide_from(c->slack));
}

/* --- a residual ----------------------------------------------------------- */

/* What two ticks make at the larger rate, and two steps of the public
 * format. */
static struct num residual_most(struct num rate, struct num other)
{
    struct num most = num_max(num_abs(rate), num_abs(other));
    most = num_mul(most, motion_otg_seconds(2));
    return num_add(most, num_scale(num_one(), -31));
}

/* Named to a step of the public format, and no more than `most`. */
static bool is_within(struct num off, int64_t named_q32, struct num most)
{
    struct num all = num_add(off, num_make(named_q32, -32));
    return !num_lt(num_scale(num_one(), -32), num_abs(off)) &&
           !num_lt(most, num_abs(all));
}

/* Is what a plan of one phase, or one change between two speeds, leaves of its
 * goal, the residual it names and what that leaves (V, and twice P), no more
 * than a part of a tick and a rounding make? */
OTG_OWN_FRAME static bool check_residual(const struct otg_check *c,
                                         struct motion_u128 vel,
                                         struct wider twice)
{
    const struct motion_otg_plan *plan = c->plan;
    const struct motion_state *start = &c->move->start, *goal = &c->move->goal;
    int most_phases = (start->acc_q32 | goal->acc_q32) == 0 ? 3 : 1;
    if (plan->count < 1 || plan->count > most_phases ||
        (goal->vel_q32 | goal->acc_q32) == 0)
        return false;
    struct num most = residual_most(num_make(start->acc_q32, -32),
                                    num_make(goal->acc_q32, -32));
    if (!is_within(motion_otg_vel_num(&vel, plan->acc_bits),
                   plan->residual_vel_q32, most))
        return false;
    most = num_mul(most, motion_otg_seconds(plan->dur_ns_q12));
    most = num_add(most, residual_most(num_make(start->vel_q32, -32),
                                       num_make(goal->vel_q32, -32)));
    return !c->has_vel ||
           is_within(motion_otg_pos_num(&twice, plan->acc_bits + 1),
                     plan->residual_pos_q32, most);
}

static int refuse(enum motion_otg_field *field, enum motion_otg_field which)
{
    *field = which;
    return MOTION_E_LIMIT;
}

/* --- one phase ------------------------------------------------------------ */

/* From a to v1, a1 in n ticks, `rest` ticks before the end; off: what trimming
 * can change of a and a1, and of the difference; `trim` the groups that a1
 * belongs to. */
struct stretch {
    struct motion_u128 v1;
    int64_t a, a1, n, rest;
    int off, off1, off_step, trim;
    bool first, last;
};

static void stretch_next(const struct motion_otg_plan *plan, int i,
                         struct stretch *s)
{
    const struct motion_otg_phase *ph = &plan->phase[i];
    int before = s->trim;
    int after = (int)((plan->trim[0] >> i & 1) | (plan->trim[1] >> i & 1) << 1);
    s->trim = after;
    s->first = i == 0;
    s->last = i + 1 == plan->count;
    s->a = s->a1;
    s->n = ph->dur_ns_q12;
    s->a1 = ph->acc;
    s->rest -= s->n;
    s->off = before != 0;
    s->off1 = after != 0;
    s->off_step = before == after ? 0 : s->off + s->off1;
}

/* V, and 2 P of its gain G = (A + A') n:  G (3 r + n) + A n n. */
static void stretch_run(struct stretch *s, struct wider *twice)
{
    int64_t k = 2 * (3 * s->rest + s->n);
    if ((s->a | s->a1) == 0)
        return;
    struct motion_u128 gain = wide_mul_i64(s->a + s->a1, s->n);
    s->v1 = wide_add(s->v1, gain);
    if (s->a == s->a1)
        k += s->n;
    else if (s->a1 == 0)
        k += 2 * s->n;
    else if (s->a != 0) {
        struct motion_u128 more = wide_mul_i64(2 * s->a, s->n);
        wider_add_mul(twice, s->n, &more);
    }
    wider_add_mul(twice, k, &gain);
}

/* |a1 - a| / n <= jerk */
static bool jerk_is_kept(const struct otg_check *c, const struct stretch *s,
                         uint64_t jerk)
{
    uint64_t step = motion_fixed_abs(s->a1 - s->a) + (uint64_t)s->off_step;
    if (step == 0)
        return true;
    struct motion_u128 have = wide_mul_u64(step, c->fives);
    if (c->step_down > 0) /* up */
        have = wide_neg(wide_shr(wide_neg(have), (unsigned)c->step_down));
    return !wide_is_less(wide_mul_u64(jerk, (uint64_t)s->n), have);
}

static bool acc_is_kept(const struct otg_check *c, int64_t a, int off)
{
    if (a < c->acc_max && a > c->acc_min)
        return true;
    return off == 0 && a <= c->acc_max && a >= c->acc_min;
}

/* margin >= least, least >= 0. */
static bool has_margin(struct motion_u128 margin, int64_t least)
{
    return margin.hi == 0 ? margin.lo >= (uint64_t)least
                          : !wide_is_negative(margin);
}

/* The velocity rises (falls) from where it is v while |a| goes to zero on the
 * way to b on the other side: by a^2 n / (|a| + |b|), at most |a| n. */
static bool check_crest(struct motion_u128 margin, int64_t a, int64_t b,
                        int64_t n, int off)
{
    uint64_t from = motion_fixed_abs(a) + (uint64_t)off;
    uint64_t to = motion_fixed_abs(b);
    to = to > (uint64_t)off ? to - (uint64_t)off : 0;
    if (wide_is_negative(margin))
        return false;
    if (!wide_is_less(margin, wide_mul_u64(from, (uint64_t)n)))
        return true;
    struct wider rise = wider_mul(wide_mul_u64(from, from), n);
    return !wider_is_less(wider_mul(margin, (int64_t)(from + to)), rise);
}

static struct motion_u128 widened_margin(const struct otg_check *c,
                                         struct motion_u128 v, int sign,
                                         enum otg_check_end end)
{
    struct motion_u128 most = check_widened(c, sign, end);
    return sign > 0 ? wide_sub(most, v) : wide_add(most, v);
}

/* Where the acceleration changes its sign, the velocity turns.  Counted from
 * the phase's start; in the last phase backwards in time from the goal. */
static bool turn_is_inside(const struct otg_check *c, const struct stretch *s)
{
    struct motion_u128 v = c->goal;
    if (!s->last)
        v = wide_sub(s->v1, wide_mul_i64(s->a + s->a1, s->n));
    int64_t a = s->last ? -s->a1 : s->a, b = s->last ? -s->a : s->a1;
    int off = s->off | s->off1, sign = a > 0 ? 1 : -1;
    struct motion_u128 least = wide_from(s->first || s->last ? 0 : c->slack);
    struct motion_u128 margin = wide_sub(check_margin(c, v, sign), least);
    if (check_crest(margin, a, b, s->n, off))
        return true;
    if (!s->last && c->is_in[sign < 0])
        return false;
    margin =
        widened_margin(c, v, sign, s->last ? OTG_CHECK_GOAL : OTG_CHECK_START);
    return check_crest(wide_sub(margin, least), a, b, s->n, off);
}

/* Outside since the start, where that makes it necessary; and the corner goes
 * on to bring the velocity back: by 2^-20 of what may be, so that no cruise
 * counts as that. */
static bool is_excused(const struct otg_check *c, const struct stretch *s,
                       int sign)
{
    if (c->is_in[sign < 0] ||
        (sign > 0 ? s->a1 > c->acc_min >> 20 : s->a1 < c->acc_max >> 20))
        return false;
    return has_margin(widened_margin(c, s->v1, sign, OTG_CHECK_START),
                      c->slack);
}

/* The end of the last phase is the goal, which has been judged. */
static bool vel_is_kept(struct otg_check *c, const struct stretch *s)
{
    if ((s->a ^ s->a1) < 0 && s->a != 0 && s->a1 != 0 && !turn_is_inside(c, s))
        return false;
    for (int sign = 1; sign >= -1 && !s->last; sign -= 2) {
        if (sign > 0 ? !wide_is_less(c->up_in, s->v1)
                     : !wide_is_less(s->v1, c->down_in))
            c->is_in[sign < 0] = true;
        else if (!is_excused(c, s, sign))
            return false;
    }
    return true;
}

/* The one before `brake`, the other from `turn` on, the lower between. */
static uint64_t phase_jerk(const struct otg_check *c, int i)
{
    bool is_late = i >= c->plan->turn || c->jerk[1] < c->jerk[0];
    return c->jerk[i >= c->plan->brake && is_late];
}

static int check_phase(struct otg_check *c, int i, const struct stretch *s,
                       enum motion_otg_field *field)
{
    if (c->has_jerk && !jerk_is_kept(c, s, phase_jerk(c, i)))
        return refuse(field, MOTION_OTG_FIELD_JERK);
    if (c->has_acc && !acc_is_kept(c, s->a1, s->off1))
        return refuse(field, MOTION_OTG_FIELD_ACC_MAX);
    if (c->has_vel && !vel_is_kept(c, s))
        return refuse(field, MOTION_OTG_FIELD_VEL_MAX);
    return MOTION_OK;
}

/* --- what a track lays on one phase ------------------------------------
 *
 * A track lays what is missing at the end on one phase, the carrier (track.c),
 * as d u^3 over its n ticks, n of T in all: 3 d / n more velocity.  With d at
 * most 2 W T that is less than 2^9 W where n > T / 2^6, and such is the margin
 * that velocities keep.  Where that is too large, or the carrier is shorter
 * or the first phase or the last, d itself tells. */

#define CHECK_CARRIER   6  /* n > T / 2^6 */
#define CHECK_COEF_BITS 60 /* of a segment, all but one */

/* The carrier, and where it begins. */
struct carrier {
    int64_t a, a1, n;
    struct motion_u128 v, v1;
    bool last;
};

static struct carrier carrier_of(const struct otg_check *c, int at)
{
    const struct motion_otg_plan *plan = c->plan;
    struct carrier k = { .a1 = plan->start_acc, .v1 = c->start };
    for (int i = 0; i <= at; i++) {
        k.v = k.v1;
        k.a = k.a1;
        k.n = plan->phase[i].dur_ns_q12;
        k.a1 = plan->phase[i].acc;
        k.v1 = wide_add(k.v, wide_mul_i64(k.a + k.a1, k.n));
    }
    k.last = at + 1 == plan->count;
    return k;
}

/* 2 d of it, in units of P: what is missing at the end, less what the velocity
 * missing there makes of the time behind the carrier. */
static struct wider carried(const struct otg_check *c, int at,
                            struct motion_u128 vel, struct wider twice)
{
    const struct motion_otg_plan *plan = c->plan;
    int64_t left = 0;
    for (int i = at + 1; i < plan->count; i++)
        left += plan->phase[i].dur_ns_q12;
    return wider_sub(twice, wider_mul(vel, 6 * left));
}

/* Above v, or below; what is outside for good reasons has none to keep. */
static bool end_is_carried(const struct otg_check *c, struct motion_u128 v,
                           int sign, struct motion_u128 need)
{
    struct motion_u128 margin = check_margin(c, v, sign);
    return wide_is_negative(margin) || !wide_is_less(margin, need);
}

static bool crest_is_carried(const struct otg_check *c, const struct carrier *k,
                             int sign, struct motion_u128 need)
{
    if ((k->a ^ k->a1) >= 0 || (k->a < 0) != (sign < 0))
        return true;
    struct motion_u128 margin = wide_sub(check_margin(c, k->v, sign), need);
    return check_crest(margin, k->a, k->a1, k->n, 1);
}

/* Is there a margin for what a track's carrier takes of what is missing at the
 * end (V, and twice P), rounded up to a power of two, or is it no more than the
 * coefficients of its segment leave open?  In V it is 2 d / 2 n. */
OTG_OWN_FRAME static bool check_carried(const struct otg_check *c,
                                        struct motion_u128 vel,
                                        struct wider twice)
{
    int at = motion_otg_carrier(c->plan);
    struct wider by = carried(c, at, vel, twice);
    int sign = wider_is_negative(by) ? -1 : 1;
    struct carrier k = carrier_of(c, at);
    by = wider_shr(wider_abs(by), 64 - motion_real_clz((uint64_t)k.n));
    struct motion_u128 need =
        wide_add((struct motion_u128){ by.mid, by.lo }, wide_from(1));
    struct motion_u128 most = wide_abs(sign > 0 ? c->up : c->down);
    if (!wide_is_less(wide_shr(most, CHECK_COEF_BITS), need))
        return true;
    if (k.last && wide_is_negative(check_margin(c, k.v1, sign)))
        return false;
    return crest_is_carried(c, &k, sign, need) &&
           end_is_carried(c, k.v, sign, need) &&
           end_is_carried(c, k.v1, sign, need);
}

/* --- the whole ------------------------------------------------------------ */

static int check_start(const struct motion_otg_move *move,
                       const struct motion_otg_plan *plan,
                       enum motion_otg_field *field)
{
    const struct motion_state *start = &move->start;
    if (plan->start_vel_q32 != start->vel_q32)
        return refuse(field, MOTION_OTG_FIELD_START_VEL);
    if (plan->start_acc != motion_otg_acc_image(start->acc_q32, plan->acc_bits))
        return refuse(field, MOTION_OTG_FIELD_START_ACC);
    return MOTION_OK;
}

/* What is missing at the end is what the trimmed corners' last unit makes; of
 * a free end the rounding to its format, too. */
static bool pos_is_met(const struct otg_check *c, struct wider twice)
{
    const struct motion_otg_plan *plan = c->plan;
    struct motion_u128 unit =
        wide_mul_u64((uint64_t)c->trimmed, (uint64_t)plan->dur_ns_q12);
    struct wider margin = wider_mul(unit, 6);
    if (!c->has_vel)
        margin = wider_shl((struct wider){ 0, 0, (uint64_t)OTG_POS_FIVES },
                           (unsigned)(plan->acc_bits + 12));
    return !wider_is_less(margin, wider_abs(twice));
}

/* A goal is reached, or named with what is left of it. */
static bool is_named(int64_t have, int64_t residual, int64_t target)
{
    return (uint64_t)have + (uint64_t)residual == (uint64_t)target;
}

static int check_goal(const struct otg_check *c, const struct stretch *end,
                      struct wider twice, int64_t longest,
                      enum motion_otg_field *field)
{
    const struct motion_otg_plan *plan = c->plan;
    const struct motion_state *goal = &c->move->goal;
    struct motion_u128 residual = wide_sub(c->goal, end->v1);
    struct wider change = motion_otg_pos_change(plan);
    twice = wider_sub(wider_add(change, change), twice);
    bool is_near = c->trimmed == 0 && check_residual(c, residual, twice);
    int64_t left_pos = is_near ? plan->residual_pos_q32 : 0;
    int64_t left_vel = is_near ? plan->residual_vel_q32 : 0;
    if (!is_named(plan->goal_vel_q32, left_vel, goal->vel_q32) ||
        (!is_near && wide_is_less(wide_from(c->trimmed), wide_abs(residual))))
        return refuse(field, MOTION_OTG_FIELD_GOAL_VEL);
    if (end->a1 != motion_otg_acc_image(goal->acc_q32, plan->acc_bits) ||
        end->trim != 0)
        return refuse(field, MOTION_OTG_FIELD_GOAL_ACC);
    if (plan->start_pos_q32 != c->move->start.pos_q32 ||
        (c->has_vel &&
         !is_named(plan->goal_pos_q32, left_pos, goal->pos_q32)) ||
        (!is_near && !pos_is_met(c, twice)))
        return refuse(field, MOTION_OTG_FIELD_GOAL_POS);
    if (c->has_vel && is_near &&
        (wide_is_less(c->up, end->v1) || wide_is_less(end->v1, c->down)))
        return refuse(field, MOTION_OTG_FIELD_VEL_MAX);
    bool is_short = longest < plan->dur_ns_q12 >> CHECK_CARRIER;
    if (c->has_vel &&
        (is_near || (c->trimmed != 0 && (c->is_coarse || is_short))) &&
        !check_carried(c, residual, twice))
        return refuse(field, MOTION_OTG_FIELD_VEL_MAX);
    return MOTION_OK;
}

static int check_phases(struct otg_check *c, enum motion_otg_field *field)
{
    const struct motion_otg_plan *plan = c->plan;
    struct wider twice = { 0, 0, 0 };
    struct stretch s;
    s.v1 = c->start;
    s.a1 = plan->start_acc;
    s.trim = 0;
    s.rest = plan->dur_ns_q12;
    int64_t longest = 0; /* between the first and the last */
    for (int i = 0; i < plan->count; i++) {
        stretch_next(plan, i, &s);
        if (s.n <= 0)
            return refuse(field, MOTION_OTG_FIELD_DURATION);
        stretch_run(&s, &twice);
        if (s.n > longest && !s.first && !s.last)
            longest = s.n;
        int err = check_phase(c, i, &s, field);
        if (err < 0)
            return err;
    }
    if (s.rest != 0)
        return refuse(field, MOTION_OTG_FIELD_DURATION);
    return check_goal(c, &s, twice, longest, field);
}

int motion_otg_check(const struct motion_otg_move *move,
                     const struct motion_otg_plan *plan,
                     enum motion_otg_field *field)
{
    enum motion_otg_field unused;
    struct otg_check c;
    if (field == NULL)
        field = &unused;
    *field = MOTION_OTG_FIELD_NONE;
    int err = check_start(move, plan, field);
    if (err < 0)
        return err;
    check_init(&c, move, plan);
    return check_phases(&c, field);
}
