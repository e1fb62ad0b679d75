/* motion/otg/edge.c - the edge of what is possible: the plain change of speed,
 * exactly, and displacements next to its own.  For starts and goals inside
 * their limits of acceleration, and one jerk.  docs/OTG.md, section 5.
 *
 * The plain change: ramp to a peak, hold it where it is the limit, ramp to the
 * goal.  With h the nearer end's acceleration and E the speed that one ramp of
 * full jerk from end to end leaves to be changed, times the jerk,
 *
 *     peak^2 = h^2 + E
 *
 * E is a whole number in the public formats.  Limits are not tightened: ramps
 * go up to whole ticks, which leaves the margin that trimming takes, and
 * trimming the peak makes the speed good.  So a motion whose corners are whole
 * ticks is met to the unit.
 *
 * Next to it the interval of what can be reached is one point and opens with
 * the square of the time: a displacement beside it by 2^-25, as far as the
 * search tightens limits, costs 2^-13 of the time.  So the border (docs/OTG.md,
 * 1 and 2) is solved once more next to its start, in reals of 62 bits and with
 * limits tightened by no more than what a few ticks are of the move.  The
 * unknown is half the time of the side whose natural speed is the higher one:
 * it starts from its end alone, and the other side's time has no edge there. */
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

struct motion_real motion_otg_sum(const struct motion_real *a,
                                  const struct motion_real *b)
{
    return motion_real_add(*a, *b);
}

static struct motion_real minus(const struct motion_real *a,
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

static bool is_less(const struct motion_real *a, const struct motion_real *b)
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
    n = minus(&n, &little); /* 2^-10 of a tick is rounding */
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
    bool is_held = !is_less(&peak, &limit);
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
    struct motion_real h = is_less(&p->a0, &p->af) ? p->af : p->a0;
    if (motion_real_sign(p->excess) <= 0)
        return h;
    struct motion_real limit = plain_limit(p),
                       most = motion_otg_times(&limit, &limit);
    h = motion_otg_times(&h, &h);
    h = motion_otg_sum(&h, &p->excess);
    return is_less(&h, &most) ? motion_real_sqrt(h) : limit;
}

/* Where ticks leave too much, a pulse of the other sign takes it off: of a tick
 * or so, on the shorter ramp. */
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
 * that ends the early set; and by one through zero, which begins what is after
 * it. */
static int plain_position(const struct plain *p, int sign)
{
    struct plain v = plain_view(p, sign);
    int err = plain_make(&v, plain_peak(&v), 0);
    struct motion_real low = is_less(&v.a0, &v.af) ? v.a0 : v.af;
    struct motion_real square = motion_otg_times(&low, &low);
    square = minus(&square, &v.excess);
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

/* --- displacements next to it --------------------------------------------- */

#define EDGE_NEAR    30 /* first step from the start: 2^-30 of the time */
#define EDGE_FAR     6  /* the last one */
#define EDGE_STEPS   12 /* of Newton's method, 4 in general */
#define EDGE_END     44 /* a step of 2^-44 of the time ends it, */
#define EDGE_PART    16 /* or 2^-16 of what it is from the start */
#define EDGE_AS_IS   60 /* as they are */
#define EDGE_MARGINS 8  /* tried, */
#define EDGE_REPAIRS 4  /* and how often ramps of each get more ticks */

/* One end: as struct otg_side, in full length. */
struct edge_side {
    struct motion_real a, base, natural, limit, lead_t, lead_d;
};

struct edge {
    const struct motion_otg_move *move;
    struct motion_otg_plan *plan;
    struct edge_side side[2]; /* of the start, of the goal */
    struct motion_real j, target;
    int sign, least; /* the border; the side with the higher natural speed */
};

/* A point of the border; half times and peaks of both sides. */
struct edge_point {
    struct motion_real x[2], peak[2], rest, slope;
};

/* Less by 2^-bits of it. */
static struct motion_real tightened(struct motion_real a, int bits)
{
    if (bits >= EDGE_AS_IS)
        return a;
    struct motion_real part = motion_real_scale(a, -bits);
    return minus(&a, &part);
}

static void edge_side_init(struct edge *e, bool goal, int bits)
{
    const struct motion_otg_limit *lim = &e->move->limit;
    const struct motion_state *at = goal ? &e->move->goal : &e->move->start;
    struct edge_side *s = &e->side[goal];
    bool down = e->sign < 0;
    s->limit =
        tightened(goal == down ? motion_otg_signed(lim->acc_max_q32, 32, false)
                               : motion_otg_signed(lim->acc_min_q32, 32, true),
                  bits);
    s->a = motion_otg_signed(at->acc_q32, 32, goal != down);
    s->lead_t = motion_otg_per(&s->a, &e->j);
    struct motion_real twice = motion_otg_times(&s->a, &s->lead_t);
    struct motion_real part = motion_real_half(twice), six = motion_real_int(6);
    s->base = motion_otg_signed(at->vel_q32, 32, down);
    s->base = minus(&s->base, &part);
    s->natural =
        motion_real_sign(s->a) > 0 ? motion_otg_sum(&s->base, &twice) : s->base;
    part = motion_otg_per(&twice, &six); /* base t + j t^3 / 6 */
    part = motion_otg_sum(&s->base, &part);
    s->lead_d = motion_otg_times(&s->lead_t, &part);
}

static void edge_init(struct edge *e, int sign, int bits)
{
    e->sign = sign;
    e->j =
        tightened(motion_otg_signed(e->move->limit.jerk_q32, 32, false), bits);
    for (int i = 0; i < 2; i++)
        edge_side_init(e, i, bits);
    e->least = is_less(&e->side[0].natural, &e->side[1].natural);
    struct motion_real to =
        motion_otg_signed(e->move->goal.pos_q32, 32, sign < 0);
    struct motion_real from =
        motion_otg_signed(e->move->start.pos_q32, 32, sign < 0);
    e->target = minus(&to, &from);
    for (int i = 0; i < 2; i++)
        e->target = motion_otg_sum(&e->target, &e->side[i].lead_d);
}

/* --- the border ----------------------------------------------------------- */

/* The speed change of half the time x, and its peak. */
static struct motion_real edge_rise(const struct edge *e,
                                    const struct edge_side *s,
                                    const struct motion_real *x,
                                    struct motion_real *peak)
{
    *peak = motion_otg_times(x, &e->j);
    if (!is_less(&s->limit, peak))
        return motion_otg_times(x, peak);
    struct motion_real ramp = motion_otg_per(&s->limit, &e->j);
    struct motion_real twice = motion_real_twice(*x);
    *peak = s->limit;
    twice = minus(&twice, &ramp);
    return motion_otg_times(&s->limit, &twice);
}

/* Half the time of the speed change w, and its peak. */
static struct motion_real edge_half(const struct edge *e,
                                    const struct edge_side *s,
                                    const struct motion_real *w,
                                    struct motion_real *peak)
{
    struct motion_real x = motion_otg_per(w, &e->j);
    x = motion_real_sqrt(x);
    *peak = motion_otg_times(&x, &e->j);
    if (!is_less(&s->limit, peak))
        return x;
    *peak = s->limit;
    struct motion_real ramp = motion_otg_per(&s->limit, &e->j);
    x = motion_otg_per(w, &s->limit);
    x = motion_otg_sum(&x, &ramp);
    return motion_real_half(x);
}

/* What half the time x from or to vc covers is taken off. */
static void edge_take(struct edge_point *p, const struct edge_side *s,
                      const struct motion_real *x, const struct motion_real *vc)
{
    struct motion_real d = motion_otg_sum(vc, &s->base);
    d = motion_otg_times(x, &d);
    p->rest = minus(&p->rest, &d);
}

static void edge_at(const struct edge *e, struct motion_real x,
                    struct edge_point *p)
{
    const struct edge_side *m = &e->side[e->least], *o = &e->side[!e->least];
    struct motion_real *peak = &p->peak[e->least], *other = &p->peak[!e->least];
    struct motion_real w = edge_rise(e, m, &x, peak);
    struct motion_real vc = motion_otg_sum(&m->base, &w);
    w = minus(&vc, &o->base);
    struct motion_real z = edge_half(e, o, &w, other);
    p->x[e->least] = x;
    p->x[!e->least] = z;
    p->rest = e->target;
    edge_take(p, m, &x, &vc);
    edge_take(p, o, &z, &vc);
    p->slope = motion_real_zero();
    if (motion_real_sign(*other) <= 0)
        return;
    /* (3), and dT/dx = 2 (1 + r) */
    struct motion_real one = motion_real_int(1);
    struct motion_real pull = motion_otg_times(peak, other);
    struct motion_real both = motion_otg_per(peak, other);
    pull = motion_otg_per(&pull, &e->j);
    vc = motion_real_twice(vc);
    pull = motion_otg_sum(&vc, &pull);
    both = motion_otg_sum(&one, &both);
    p->slope = motion_otg_times(&both, &pull);
}

/* Where the border first comes to the displacement, from its start on: beyond
 * it by steps of 2^2, and from there by Newton's method.  false: not near. */
static bool edge_root(const struct edge *e, struct edge_point *p)
{
    struct motion_real lo = e->side[e->least].lead_t, x, all, step;
    edge_at(e, lo, p);
    if (motion_real_sign(p->rest) <= 0)
        return motion_real_sign(p->rest) == 0;
    x = motion_real_abs(p->x[0]);
    all = motion_real_abs(p->x[1]);
    all = motion_otg_sum(&all, &x);
    int bits = EDGE_NEAR;
    do {
        step = motion_real_scale(all, -bits);
        x = motion_otg_sum(&lo, &step);
        edge_at(e, x, p);
        bits -= 2;
    } while (bits >= EDGE_FAR && motion_real_sign(p->rest) > 0);
    if (motion_real_sign(p->rest) > 0)
        return false;
    for (int i = 0; i < EDGE_STEPS && motion_real_sign(p->slope) > 0; i++) {
        step = motion_otg_per(&p->rest, &p->slope);
        x = motion_otg_sum(&x, &step);
        if (is_less(&x, &lo))
            x = lo;
        edge_at(e, x, p);
        struct motion_real from = minus(&x, &lo);
        if (motion_real_is_zero(step) || step.e < all.e - EDGE_END ||
            step.e < from.e - EDGE_PART)
            return true;
    }
    return false;
}

/* --- its plan ------------------------------------------------------------- */

/* Ramps up to whole ticks of the tightened jerk. */
static int64_t edge_ticks(const struct edge *e, int64_t step, int bits)
{
    int64_t n =
        motion_otg_full_ticks(step, e->move->limit.jerk_q32, e->plan->acc_bits);
    return n + (bits < EDGE_AS_IS ? n >> bits : 0);
}

static int64_t edge_hold(const struct edge *e, const struct edge_point *p,
                         int i)
{
    struct motion_real per_s = num_real(motion_otg_per_second());
    struct motion_real ramp = motion_otg_per(&e->side[i].limit, &e->j);
    struct motion_real hold = minus(&p->x[i], &ramp);
    if (is_less(&p->peak[i], &e->side[i].limit) || motion_real_sign(hold) <= 0)
        return 0;
    return motion_real_floor_clamped(motion_otg_times(&hold, &per_s), 1);
}

static int edge_phases(const struct edge *e, const struct edge_point *p,
                       int bits)
{
    struct motion_otg_plan *plan = e->plan;
    int power = p->peak[0].e > p->peak[1].e ? p->peak[0].e : p->peak[1].e;
    int err = motion_otg_round_units(e->move, power + 62, plan);
    if (err < 0)
        return err;
    int64_t a[2], hold[2];
    for (int i = 0; i < 2; i++) {
        a[i] = motion_real_floor_clamped(p->peak[i], plan->acc_bits);
        a[i] = (i == 0) == (e->sign > 0) ? a[i] : -a[i];
        hold[i] = edge_hold(e, p, i);
    }
    int64_t af = motion_otg_acc_image(e->move->goal.acc_q32, plan->acc_bits);
    int64_t n[3] = { edge_ticks(e, a[0] - plan->start_acc, bits),
                     edge_ticks(e, a[1] - a[0], bits),
                     edge_ticks(e, af - a[1], bits) };
    plan->count = 0;
    plan->dur_ns_q12 = 0;
    for (int i = 0; i < 5; i++)
        if ((i & 1 ? hold[i / 2] : n[i / 2]) >= OTG_TICKS_MOST / 8)
            return MOTION_E_RANGE;
    motion_otg_plan_add(plan, n[0], a[0]);
    motion_otg_plan_add(plan, hold[0], a[0]);
    motion_otg_plan_add(plan, n[1], a[1]);
    motion_otg_plan_add(plan, hold[1], a[1]);
    motion_otg_plan_add(plan, n[2], af);
    if (plan->count == 0)
        return MOTION_E_LIMIT;
    plan->phase[plan->count - 1].acc = af;
    return MOTION_OK;
}

/* Trimming made ramps steeper than they may be: give them time. */
static void edge_repair(const struct edge *e)
{
    struct motion_otg_plan *plan = e->plan;
    int64_t acc = plan->start_acc;
    for (int i = 0; i < plan->count; i++) {
        struct motion_otg_phase *ph = &plan->phase[i];
        int64_t least = edge_ticks(e, ph->acc - acc, EDGE_AS_IS);
        acc = ph->acc;
        if (least > ph->dur_ns_q12) {
            plan->dur_ns_q12 += least + 1 - ph->dur_ns_q12;
            ph->dur_ns_q12 = least + 1;
        }
    }
}

static int edge_settle(const struct edge *e, enum motion_otg_field *field)
{
    int err = MOTION_E_LIMIT;
    *field = MOTION_OTG_FIELD_JERK;
    for (int i = 0; i < EDGE_REPAIRS && err == MOTION_E_LIMIT &&
                    *field == MOTION_OTG_FIELD_JERK;
         i++) {
        if (i > 0)
            edge_repair(e);
        *field = MOTION_OTG_FIELD_GOAL_POS;
        err = motion_otg_trim(e->move->mode, 0, OTG_TRIM_USUAL, e->plan);
        if (err == MOTION_OK)
            err = motion_otg_check(e->move, e->plan, field);
    }
    return err;
}

/* On the border on whose side the displacement is. */
static int edge_try(struct edge *e, int bits, enum motion_otg_field *field)
{
    struct edge_point p;
    for (int sign = 1; sign >= -1; sign -= 2) {
        edge_init(e, sign, bits);
        if (!edge_root(e, &p))
            continue;
        int err = edge_phases(e, &p, bits);
        return err < 0 ? err : edge_settle(e, field);
    }
    return MOTION_E_LIMIT;
}

int motion_otg_edge(const struct motion_otg_move *move, int64_t dur_ns_q12,
                    struct motion_otg_plan *plan, enum motion_otg_field *field)
{
    struct edge e = { .move = move, .plan = plan };
    int err = MOTION_E_LIMIT;
    int bits = 64 - (int)motion_real_clz((uint64_t)dur_ns_q12);
    if (move->limit.jerk_q32 == 0 || move->limit.jerk_down_q32 != 0)
        return MOTION_E_LIMIT;
    *field = MOTION_OTG_FIELD_GOAL_POS;
    for (int i = 0; i < EDGE_MARGINS && err == MOTION_E_LIMIT; i++, bits -= 2)
        err = edge_try(&e, i == 0 ? EDGE_AS_IS : bits, field);
    return err;
}
