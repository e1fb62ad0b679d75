/* motion/otg_edge.c - ways next to that of the plain change of speed.
 *
 * There the interval of what can be reached is one point and opens with the
 * square of the time: a way beside it by 2^-25, as far as the search draws limits
 * in, costs 2^-13 of the time.  So the border (docs/OTG.md, 1 and 2) is solved
 * once more next to its start, in reals of 62 bits and with limits drawn in by
 * no more than what a few ticks are of the move.  The unknown is half the time of
 * the side whose natural speed is the higher one: it starts from its end alone,
 * and the other side's time has no edge there. */
#include <stddef.h>

#include "motion/err.h"
#include "motion/fixed.h"
#include "motion/otg_internal.h"

#define EDGE_NEAR    30 /* first step from the start: 2^-30 of the time */
#define EDGE_FAR     6  /* the last one */
#define EDGE_STEPS   12
#define EDGE_END     44 /* a step of 2^-44 of the time ends it, */
#define EDGE_PART    16 /* or of 2^-16 of the way from the start */
#define EDGE_DRAWN   60 /* not drawn in */
#define EDGE_DRAWS   8
#define EDGE_REPAIRS 4

/* One end: as struct otg_side, in full length. */
struct edge_side {
    struct motion_real a, base, natural, limit, lead_t, lead_d;
};

struct edge {
    const struct motion_otg_move *move;
    struct motion_otg_plan *plan;
    struct edge_side side[2]; /* of the start, of the goal */
    struct motion_real j, want;
    int sign, least; /* the border; the side with the higher natural speed */
};

/* A point of the border; half times and peaks of both sides. */
struct edge_point {
    struct motion_real x[2], peak[2], rest, slope;
};

static struct motion_real signed_q(int64_t n, int bits, bool minus)
{
    struct motion_real a = motion_real_from_q(n, bits);
    return minus ? motion_real_neg(a) : a;
}

/* Less by 2^-bits of it. */
static struct motion_real drawn_in(struct motion_real a, int bits)
{
    if (bits >= EDGE_DRAWN)
        return a;
    return motion_real_sub(a, motion_real_scale(a, -bits));
}

static void edge_side_init(struct edge *e, bool goal, int bits)
{
    const struct motion_otg_limit *lim = &e->move->limit;
    const struct motion_state *at = goal ? &e->move->goal : &e->move->start;
    struct edge_side *s = &e->side[goal];
    bool down = e->sign < 0;
    s->limit = drawn_in(goal == down ? signed_q(lim->acc_max_q16, 16, false)
                                     : signed_q(lim->acc_min_q16, 16, true),
                        bits);
    s->a = signed_q(at->acc_q16, 16, goal != down);
    s->lead_t = motion_real_div(s->a, e->j);
    struct motion_real twice = motion_real_mul(s->a, s->lead_t);
    s->base = motion_real_sub(signed_q(at->vel_q32, 32, down),
                              motion_real_half(twice));
    s->natural =
        motion_real_sign(s->a) > 0 ? motion_real_add(s->base, twice) : s->base;
    struct motion_real sixth =
        motion_real_div(twice, motion_real_int(6)); /* base t + j t^3 / 6 */
    s->lead_d = motion_real_mul(s->lead_t, motion_real_add(s->base, sixth));
}

static void edge_init(struct edge *e, int sign, int bits)
{
    e->sign = sign;
    e->j = drawn_in(motion_real_from_q(e->move->limit.jerk_q16, 16), bits);
    for (int i = 0; i < 2; i++)
        edge_side_init(e, i, bits);
    e->least = motion_real_lt(e->side[0].natural, e->side[1].natural);
    struct motion_real to = motion_real_from_q(e->move->goal.pos_q32, 32);
    struct motion_real from = motion_real_from_q(e->move->start.pos_q32, 32);
    e->want = motion_real_sub(to, from);
    if (sign < 0)
        e->want = motion_real_neg(e->want);
    for (int i = 0; i < 2; i++)
        e->want = motion_real_add(e->want, e->side[i].lead_d);
}

/* --- the border ----------------------------------------------------------- */

/* The speed change of half the time x, and its peak. */
static struct motion_real edge_rise(const struct edge *e,
                                    const struct edge_side *s,
                                    struct motion_real x,
                                    struct motion_real *peak)
{
    *peak = motion_real_mul(x, e->j);
    if (!motion_real_lt(s->limit, *peak))
        return motion_real_mul(x, *peak);
    struct motion_real ramp = motion_real_div(s->limit, e->j);
    *peak = s->limit;
    return motion_real_mul(s->limit,
                           motion_real_sub(motion_real_twice(x), ramp));
}

/* Half the time of the speed change w, and its peak. */
static struct motion_real edge_half(const struct edge *e,
                                    const struct edge_side *s,
                                    struct motion_real w,
                                    struct motion_real *peak)
{
    struct motion_real x = motion_real_sqrt(motion_real_div(w, e->j));
    *peak = motion_real_mul(x, e->j);
    if (!motion_real_lt(s->limit, *peak))
        return x;
    *peak = s->limit;
    struct motion_real ramp = motion_real_div(s->limit, e->j);
    return motion_real_half(
        motion_real_add(motion_real_div(w, s->limit), ramp));
}

static void edge_at(const struct edge *e, struct motion_real x,
                    struct edge_point *p)
{
    const struct edge_side *m = &e->side[e->least], *o = &e->side[!e->least];
    struct motion_real *peak = &p->peak[e->least], *other = &p->peak[!e->least];
    struct motion_real w = edge_rise(e, m, x, peak);
    struct motion_real vc = motion_real_add(m->base, w);
    struct motion_real z = edge_half(e, o, motion_real_sub(vc, o->base), other);
    struct motion_real d = motion_real_mul(x, motion_real_add(vc, m->base));
    d = motion_real_add(d, motion_real_mul(z, motion_real_add(vc, o->base)));
    p->x[e->least] = x;
    p->x[!e->least] = z;
    p->rest = motion_real_sub(e->want, d);
    p->slope = motion_real_zero();
    if (motion_real_sign(*other) <= 0)
        return;
    /* (3), and dT/dx = 2 (1 + r) */
    struct motion_real pull =
        motion_real_div(motion_real_mul(*peak, *other), e->j);
    struct motion_real both =
        motion_real_add(motion_real_int(1), motion_real_div(*peak, *other));
    p->slope =
        motion_real_mul(both, motion_real_add(motion_real_twice(vc), pull));
}

/* Where the border first comes to the way, from its start on: beyond it by
 * steps of 2^2, and from there by Newton's method.  false: not near. */
static bool edge_root(const struct edge *e, struct edge_point *p)
{
    struct motion_real lo = e->side[e->least].lead_t, x, all;
    edge_at(e, lo, p);
    if (motion_real_sign(p->rest) <= 0)
        return motion_real_sign(p->rest) == 0;
    all = motion_real_add(motion_real_abs(p->x[0]), motion_real_abs(p->x[1]));
    int bits = EDGE_NEAR;
    do {
        x = motion_real_add(lo, motion_real_scale(all, -bits));
        edge_at(e, x, p);
        bits -= 2;
    } while (bits >= EDGE_FAR && motion_real_sign(p->rest) > 0);
    if (motion_real_sign(p->rest) > 0)
        return false;
    for (int i = 0; i < EDGE_STEPS && motion_real_sign(p->slope) > 0; i++) {
        struct motion_real step = motion_real_div(p->rest, p->slope);
        x = motion_real_max(motion_real_add(x, step), lo);
        edge_at(e, x, p);
        if (motion_real_is_zero(step) || step.e < all.e - EDGE_END ||
            step.e < motion_real_sub(x, lo).e - EDGE_PART)
            return true;
    }
    return false;
}

/* --- its plan ------------------------------------------------------------- */

/* Ramps up to whole ticks of jerk drawn in. */
static int64_t edge_ticks(const struct edge *e, int64_t step, int bits)
{
    int64_t n =
        motion_otg_full_ticks(step, e->move->limit.jerk_q16, e->plan->acc_bits);
    return n + (bits < EDGE_DRAWN ? n >> bits : 0);
}

static int64_t edge_hold(const struct edge *e, const struct edge_point *p,
                         int i)
{
    struct motion_real ramp = motion_real_div(e->side[i].limit, e->j);
    struct motion_real hold = motion_real_sub(p->x[i], ramp);
    if (motion_real_lt(p->peak[i], e->side[i].limit) ||
        motion_real_sign(hold) <= 0)
        return 0;
    return motion_real_floor_clamped(
        motion_real_mul(hold, num_real(motion_otg_per_second())), 1);
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
    int64_t af = motion_otg_acc_image(e->move->goal.acc_q16, plan->acc_bits);
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
        int64_t least = edge_ticks(e, ph->acc - acc, EDGE_DRAWN);
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

/* On the border on whose side the way is. */
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
    if (move->limit.jerk_q16 == 0 || move->limit.jerk_down_q16 != 0)
        return MOTION_E_LIMIT;
    *field = MOTION_OTG_FIELD_GOAL_POS;
    for (int i = 0; i < EDGE_DRAWS && err == MOTION_E_LIMIT; i++, bits -= 2)
        err = edge_try(&e, i == 0 ? EDGE_DRAWN : bits, field);
    return err;
}
