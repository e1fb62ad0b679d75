/* motion/otg/check_limits.c - the limits of a move in its plan's units, and
 * what a start or goal outside them makes necessary. */
#include "motion/core/fixed.h"
#include "motion/number/real.h"
#include "motion/otg/check_internal.h"

#define CHECK_FIVES_ROOM 42 /* 5^9 has 21 bits */
#define CHECK_SLACK      9
#define CHECK_LEAST      36 /* 2^9 W is little: 2^-27 of the limits */
#define CHECK_MOST       54 /* of W, to hold 2^9 W */

/* A limit that does not fit cannot be broken by what does. */
static int64_t limit_acc(int64_t limit_q32, int acc_bits)
{
    int room = acc_bits - 32;
    if (room > 0 && motion_fixed_abs(limit_q32) >> (62 - room) != 0)
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

struct motion_u128 motion_otg_check_widened(const struct otg_check *c, int sign,
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

/* 5^9 step <= 2^up jerk n: the power where there is room for it. */
static void jerk_init(struct otg_check *c, int up)
{
    uint64_t jerk = (uint64_t)c->move->limit.jerk_q32;
    uint64_t down = (uint64_t)otg_closing_jerk(&c->move->limit);
    int room = (int)motion_real_clz(jerk | down), by = up < room ? up : room;
    c->fives = OTG_FIVES;
    c->step_down = up - by;
    if (up < 0) {
        c->fives <<= up < -CHECK_FIVES_ROOM ? CHECK_FIVES_ROOM : -up;
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

void motion_otg_check_init(struct otg_check *c,
                           const struct motion_otg_move *move,
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

bool motion_otg_check_residual(const struct otg_check *c,
                               struct motion_u128 vel, struct wider twice)
{
    const struct motion_otg_plan *plan = c->plan;
    const struct motion_state *start = &c->move->start, *goal = &c->move->goal;
    if (plan->count != 1 || (goal->vel_q32 | goal->acc_q32) == 0)
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
           is_within(motion_otg_way_num(&twice, plan->acc_bits + 1),
                     plan->residual_pos_q32, most);
}
