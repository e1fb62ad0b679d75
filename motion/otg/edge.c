/* motion/otg/edge.c - ways next to that of the plain change of speed.
 *
 * There the interval of what can be reached is one point and opens with the
 * square of the time: a way beside it by 2^-25, as far as the search draws
 * limits in, costs 2^-13 of the time.  So the border (docs/OTG.md, 1 and 2) is
 * solved once more next to its start, in reals of 62 bits and with limits drawn
 * in by no more than what a few ticks are of the move.  The unknown is half the
 * time of the side whose natural speed is the higher one: it starts from its
 * end alone, and the other side's time has no edge there. */
#include <stddef.h>

#include "motion/core/err.h"
#include "motion/core/fixed.h"
#include "motion/otg/internal.h"

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

/* Less by 2^-bits of it. */
static struct motion_real drawn_in(struct motion_real a, int bits)
{
    if (bits >= EDGE_DRAWN)
        return a;
    struct motion_real part = motion_real_scale(a, -bits);
    return motion_otg_minus(&a, &part);
}

static void edge_side_init(struct edge *e, bool goal, int bits)
{
    const struct motion_otg_limit *lim = &e->move->limit;
    const struct motion_state *at = goal ? &e->move->goal : &e->move->start;
    struct edge_side *s = &e->side[goal];
    bool down = e->sign < 0;
    s->limit =
        drawn_in(goal == down ? motion_otg_signed(lim->acc_max_q32, 32, false)
                              : motion_otg_signed(lim->acc_min_q32, 32, true),
                 bits);
    s->a = motion_otg_signed(at->acc_q32, 32, goal != down);
    s->lead_t = motion_otg_per(&s->a, &e->j);
    struct motion_real twice = motion_otg_times(&s->a, &s->lead_t);
    struct motion_real part = motion_real_half(twice), six = motion_real_int(6);
    s->base = motion_otg_signed(at->vel_q32, 32, down);
    s->base = motion_otg_minus(&s->base, &part);
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
        drawn_in(motion_otg_signed(e->move->limit.jerk_q32, 32, false), bits);
    for (int i = 0; i < 2; i++)
        edge_side_init(e, i, bits);
    e->least = motion_otg_is_less(&e->side[0].natural, &e->side[1].natural);
    struct motion_real to =
        motion_otg_signed(e->move->goal.pos_q32, 32, sign < 0);
    struct motion_real from =
        motion_otg_signed(e->move->start.pos_q32, 32, sign < 0);
    e->want = motion_otg_minus(&to, &from);
    for (int i = 0; i < 2; i++)
        e->want = motion_otg_sum(&e->want, &e->side[i].lead_d);
}

/* --- the border ----------------------------------------------------------- */

/* The speed change of half the time x, and its peak. */
static struct motion_real edge_rise(const struct edge *e,
                                    const struct edge_side *s,
                                    const struct motion_real *x,
                                    struct motion_real *peak)
{
    *peak = motion_otg_times(x, &e->j);
    if (!motion_otg_is_less(&s->limit, peak))
        return motion_otg_times(x, peak);
    struct motion_real ramp = motion_otg_per(&s->limit, &e->j);
    struct motion_real twice = motion_real_twice(*x);
    *peak = s->limit;
    twice = motion_otg_minus(&twice, &ramp);
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
    if (!motion_otg_is_less(&s->limit, peak))
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
    p->rest = motion_otg_minus(&p->rest, &d);
}

static void edge_at(const struct edge *e, struct motion_real x,
                    struct edge_point *p)
{
    const struct edge_side *m = &e->side[e->least], *o = &e->side[!e->least];
    struct motion_real *peak = &p->peak[e->least], *other = &p->peak[!e->least];
    struct motion_real w = edge_rise(e, m, &x, peak);
    struct motion_real vc = motion_otg_sum(&m->base, &w);
    w = motion_otg_minus(&vc, &o->base);
    struct motion_real z = edge_half(e, o, &w, other);
    p->x[e->least] = x;
    p->x[!e->least] = z;
    p->rest = e->want;
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

/* Where the border first comes to the way, from its start on: beyond it by
 * steps of 2^2, and from there by Newton's method.  false: not near. */
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
        if (motion_otg_is_less(&x, &lo))
            x = lo;
        edge_at(e, x, p);
        struct motion_real from = motion_otg_minus(&x, &lo);
        if (motion_real_is_zero(step) || step.e < all.e - EDGE_END ||
            step.e < from.e - EDGE_PART)
            return true;
    }
    return false;
}

/* --- its plan ------------------------------------------------------------- */

/* Ramps up to whole ticks of jerk drawn in. */
static int64_t edge_ticks(const struct edge *e, int64_t step, int bits)
{
    int64_t n =
        motion_otg_full_ticks(step, e->move->limit.jerk_q32, e->plan->acc_bits);
    return n + (bits < EDGE_DRAWN ? n >> bits : 0);
}

static int64_t edge_hold(const struct edge *e, const struct edge_point *p,
                         int i)
{
    struct motion_real per_s = num_real(motion_otg_per_second());
    struct motion_real ramp = motion_otg_per(&e->side[i].limit, &e->j);
    struct motion_real hold = motion_otg_minus(&p->x[i], &ramp);
    if (motion_otg_is_less(&p->peak[i], &e->side[i].limit) ||
        motion_real_sign(hold) <= 0)
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
    if (move->limit.jerk_q32 == 0 || move->limit.jerk_down_q32 != 0)
        return MOTION_E_LIMIT;
    *field = MOTION_OTG_FIELD_GOAL_POS;
    for (int i = 0; i < EDGE_DRAWS && err == MOTION_E_LIMIT; i++, bits -= 2)
        err = edge_try(&e, i == 0 ? EDGE_DRAWN : bits, field);
    return err;
}
