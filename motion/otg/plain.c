/* motion/otg/plain.c - the plain change of speed, exactly.
 *
 * Ramp to a peak, hold it where it is the limit, ramp to the goal: with h the
 * nearer end's acceleration and E the speed that one ramp of full jerk from end
 * to end leaves to be changed, times the jerk,
 *
 *     peak^2 = h^2 + E
 *
 * E is a whole number in the public formats.  Limits are not drawn in: ramps go
 * up to whole ticks, which leaves the room that trimming takes, and trimming
 * the peak makes the speed good.  So a motion whose corners are whole ticks is
 * met to the unit.  For starts and goals inside their limits of acceleration,
 * and one jerk.  docs/OTG.md, section 5. */
#include <stddef.h>

#include "motion/core/err.h"
#include "motion/core/fixed.h"
#include "motion/otg/internal.h"

#define PLAIN_MORE  6 /* tries with more and more ticks to spare */
#define PLAIN_EARLY 2 /* ticks before the peak that full jerk ends */

/* Upside down where the peak would be a valley. */
struct plain {
    const struct motion_otg_move *move;
    struct motion_otg_plan *plan;
    enum motion_otg_field *field;
    int sign;
    struct motion_real excess, a0, af;
    int64_t limit_q32;
};

void motion_otg_plan_add(struct motion_otg_plan *plan, int64_t dur_ns_q12,
                         int64_t acc)
{
    if (dur_ns_q12 <= 0)
        return;
    plan->phase[plan->count++] = (struct motion_otg_phase){ dur_ns_q12, acc };
    plan->dur_ns_q12 += dur_ns_q12;
    plan->brake = plan->turn = plan->count;
}

struct motion_real motion_otg_sum(const struct motion_real *a,
                                  const struct motion_real *b)
{
    return motion_real_add(*a, *b);
}

struct motion_real motion_otg_minus(const struct motion_real *a,
                                    const struct motion_real *b)
{
    const struct motion_real minus = motion_real_neg(*b);
    return motion_otg_sum(a, &minus);
}

struct motion_real motion_otg_times(const struct motion_real *a,
                                    const struct motion_real *b)
{
    return motion_real_mul(*a, *b);
}

struct motion_real motion_otg_per(const struct motion_real *a,
                                  const struct motion_real *b)
{
    return motion_real_div(*a, *b);
}

bool motion_otg_is_less(const struct motion_real *a,
                        const struct motion_real *b)
{
    return motion_real_lt(*a, *b);
}

struct motion_real motion_otg_signed(int64_t n, int bits, bool minus)
{
    struct motion_real a = motion_real_from_q(n, bits);
    return minus ? motion_real_neg(a) : a;
}

/* a in reals of 62 bits. */
static struct motion_real wider_real(struct wider a)
{
    bool minus = wider_is_negative(a);
    struct wider m = wider_abs(a);
    unsigned lead = wider_clz(m);
    if (lead >= 192)
        return motion_real_zero();
    m = wider_shl(m, lead);
    return motion_otg_signed((int64_t)(m.hi >> 2), (int)lead - 130, minus);
}

/* --- the peak ------------------------------------------------------------- */

static struct motion_u128 square_q64(int64_t acc_q32)
{
    uint64_t size = motion_fixed_abs(acc_q32);
    return wide_mul_u64(size, size);
}

/* 2 (j dv -+ (af^2 - a0^2) / 2) in Q64. */
static struct motion_real plain_excess(const struct motion_otg_move *move)
{
    const struct motion_state *start = &move->start, *goal = &move->goal;
    struct motion_u128 dv =
        wide_sub(wide_from(goal->vel_q32), wide_from(start->vel_q32));
    struct motion_u128 ramp =
        wide_sub(square_q64(goal->acc_q32), square_q64(start->acc_q32));
    if (goal->acc_q32 > start->acc_q32)
        ramp = wide_neg(ramp);
    struct wider all = wider_mul(dv, move->limit.jerk_q32);
    all = wider_add(wider_add(all, all), wider_from(ramp));
    return motion_real_scale(wider_real(all), -65);
}

static struct plain plain_view(const struct plain *p, int sign)
{
    struct plain v = *p;
    const struct motion_otg_limit *lim = &p->move->limit;
    v.sign = sign;
    v.limit_q32 = sign > 0 ? lim->acc_max_q32 : -lim->acc_min_q32;
    v.a0 = motion_otg_signed(p->move->start.acc_q32, 32, sign < 0);
    v.af = motion_otg_signed(p->move->goal.acc_q32, 32, sign < 0);
    if (sign < 0)
        v.excess = motion_real_neg(p->excess);
    return v;
}

static struct motion_real plain_limit(const struct plain *p)
{
    return motion_otg_signed(p->limit_q32, 32, false);
}

/* --- its plan ------------------------------------------------------------- */

/* Ticks to hold the limit `acc` for what ramps leave of the speed. */
static int64_t plain_hold(const struct plain *p, int64_t acc, int64_t n0,
                          int64_t n1)
{
    const struct motion_otg_plan *plan = p->plan;
    int bits = plan->acc_bits;
    int64_t af = motion_otg_acc_image(p->move->goal.acc_q32, bits);
    struct motion_u128 v =
        wide_sub(motion_otg_vel_image(plan->goal_vel_q32, bits),
                 motion_otg_vel_image(plan->start_vel_q32, bits));
    wide_add_mul(&v, -(plan->start_acc + acc), n0);
    wide_add_mul(&v, -(acc + af), n1);
    struct motion_real n = wider_real(wider_from(v));
    struct motion_real twice = motion_otg_signed(acc, -1, false);
    struct motion_real little = motion_otg_signed(1, 10, false);
    n = motion_otg_per(&n, &twice);
    n = motion_otg_minus(&n, &little); /* 2^-10 of a tick is rounding */
    return motion_real_sign(n) < 0 ? 0 : motion_real_floor_clamped(n, 0) + 1;
}

/* Where trimming the peak would make the longer ramp too steep: that has full
 * jerk up to a tick or two before the peak, and a corner in what is left makes
 * the speed good, with some ticks to spare.  Returns the corner that stays. */
static uint32_t plain_close(const struct plain *p, int64_t acc,
                            const int64_t n[2], int more)
{
    struct motion_otg_plan *plan = p->plan;
    int64_t a0 = plan->start_acc;
    int64_t af = motion_otg_acc_image(p->move->goal.acc_q32, plan->acc_bits);
    bool is_second = n[0] < n[1];
    int64_t end = is_second ? af : a0, other = is_second ? a0 : af;
    int64_t ramp = n[is_second] - PLAIN_EARLY;
    int64_t rest = n[!is_second] + PLAIN_EARLY + (int64_t)2 * (more - 1);
    int64_t half = rest / 2;
    int64_t step =
        motion_otg_full_step(ramp, p->move->limit.jerk_q32, plan->acc_bits);
    int64_t corner = end + (acc < end ? -step : step);
    int64_t middle = corner / 2 + other / 2;
    if (!is_second)
        motion_otg_plan_add(plan, ramp, corner);
    motion_otg_plan_add(plan, half, middle);
    motion_otg_plan_add(plan, rest - half, is_second ? corner : af);
    if (is_second)
        motion_otg_plan_add(plan, ramp, af);
    return is_second ? 2 : 1;
}

static int plain_phases(const struct plain *p, struct motion_real peak,
                        int more, uint32_t *fixed)
{
    struct motion_otg_plan *plan = p->plan;
    struct motion_real limit = plain_limit(p);
    bool is_held = !motion_otg_is_less(&peak, &limit);
    int power = motion_real_is_zero(peak) ? -1000 : peak.e + 62;
    int err = motion_otg_round_units(p->move, power, plan);
    if (err < 0)
        return err;
    int64_t jerk = p->move->limit.jerk_q32;
    int bits = plan->acc_bits;
    int64_t acc = is_held ? motion_otg_acc_image(p->limit_q32, bits)
                          : motion_real_floor_clamped(peak, bits);
    int64_t af = motion_otg_acc_image(p->move->goal.acc_q32, bits);
    acc *= p->sign;
    int64_t n[2] = { motion_otg_full_ticks(acc - plan->start_acc, jerk, bits),
                     motion_otg_full_ticks(acc - af, jerk, bits) };
    int64_t hold = is_held ? plain_hold(p, acc, n[0], n[1]) : 0;
    plan->count = 0;
    plan->dur_ns_q12 = 0;
    if (n[0] >= OTG_TICKS_MOST || n[1] >= OTG_TICKS_MOST ||
        hold >= OTG_TICKS_MOST)
        return MOTION_E_RANGE;
    if (more > 1 && hold == 0 && n[n[0] < n[1]] > PLAIN_EARLY) {
        *fixed = plain_close(p, acc, n, more);
        return MOTION_OK;
    }
    n[n[0] < n[1] ? 0 : 1] += more;
    motion_otg_plan_add(plan, n[0], acc);
    motion_otg_plan_add(plan, hold, acc);
    motion_otg_plan_add(plan, n[1], af);
    if (plan->count > 0)
        plan->phase[plan->count - 1].acc = af;
    return MOTION_OK;
}

static int plain_make(const struct plain *p, struct motion_real peak, int more)
{
    uint32_t fixed = 0;
    *p->field = MOTION_OTG_FIELD_GOAL_POS;
    int err = plain_phases(p, peak, more, &fixed);
    if (err == MOTION_OK)
        err = motion_otg_trim(MOTION_OTG_VELOCITY, fixed, OTG_TRIM_USUAL,
                              p->plan);
    if (err < 0)
        return err;
    if (p->move->mode == MOTION_OTG_POSITION)
        p->plan->goal_pos_q32 = p->move->goal.pos_q32;
    return motion_otg_check(p->move, p->plan, p->field);
}

/* --- which ---------------------------------------------------------------- */

static struct motion_real plain_peak(const struct plain *p)
{
    struct motion_real h = motion_otg_is_less(&p->a0, &p->af) ? p->af : p->a0;
    if (motion_real_sign(p->excess) <= 0)
        return h;
    struct motion_real limit = plain_limit(p),
                       most = motion_otg_times(&limit, &limit);
    h = motion_otg_times(&h, &h);
    h = motion_otg_sum(&h, &p->excess);
    return motion_otg_is_less(&h, &most) ? motion_real_sqrt(h) : limit;
}

/* Where ticks leave too much, a pulse the other way takes it off: of a tick or
 * so, on the shorter ramp. */
static int plain_velocity(const struct plain *p, int sign)
{
    int err = MOTION_E_LIMIT;
    for (int i = 0; i < 2 * PLAIN_MORE && err == MOTION_E_LIMIT; i++) {
        bool turns = i < 4 ? i >= 2 : i & 1; /* one more tick comes first */
        struct plain v = plain_view(p, turns ? -sign : sign);
        err = plain_make(&v, plain_peak(&v), i < 4 ? i & 1 : i / 2);
    }
    return err;
}

/* With both accelerations of one sign the same change is had by a valley, too:
 * that ends the lens; and by one through zero, which begins what is after
 * it. */
static int plain_position(const struct plain *p, int sign)
{
    struct plain v = plain_view(p, sign);
    int err = plain_make(&v, plain_peak(&v), 0);
    struct motion_real low = motion_otg_is_less(&v.a0, &v.af) ? v.a0 : v.af;
    struct motion_real square = motion_otg_times(&low, &low);
    square = motion_otg_minus(&square, &v.excess);
    if (err != MOTION_E_LIMIT || motion_real_sign(low) <= 0 ||
        motion_real_sign(square) < 0)
        return err;
    low = motion_real_sqrt(square);
    err = plain_make(&v, low, 0);
    if (err != MOTION_E_LIMIT)
        return err;
    v = plain_view(p, -sign);
    return plain_make(&v, low, 0);
}

static bool is_between(int64_t acc, const struct motion_otg_limit *lim)
{
    return acc >= lim->acc_min_q32 && acc <= lim->acc_max_q32;
}

int motion_otg_plain(const struct motion_otg_move *move,
                     struct motion_otg_plan *plan, enum motion_otg_field *field)
{
    const struct motion_otg_limit *lim = &move->limit;
    struct plain p = { .move = move, .plan = plan, .field = field };
    if (lim->jerk_q32 == 0 || lim->jerk_down_q32 != 0 ||
        !is_between(move->start.acc_q32, lim) ||
        !is_between(move->goal.acc_q32, lim))
        return MOTION_E_LIMIT;
    p.excess = plain_excess(move);
    int sign = motion_real_sign(p.excess) < 0 ? -1 : 1;
    return move->mode == MOTION_OTG_VELOCITY ? plain_velocity(&p, sign)
                                             : plain_position(&p, sign);
}
