/* motion/otg/border.c - see border.h; the names and equations are those of
 * docs/OTG.md.
 *
 *     a |  a1 __                    regime A: the middle '-' passes a = 0, the
 *       |    /  \        vc         speed there is vc; grows until vc = vx,
 *       |___/____\__________ t      then the speed is held
 *       |         \    /            regime B: a1 < 0, the middle '-' does not
 *       |       a2 \__/             pass a = 0; vc is where it would */

#include <stddef.h>

#include "motion/otg/internal.h"

/* A smaller step ends the search: the next error is its square, and round.c
 * squares that again. */
#define ROOT_BITS 13
#define ROOT_MOST 100 /* evaluations: the bound of one root */
#define ROOT_HALF 12  /* from here on the bracket is halved every other time */
#define ROOT_SHUT 26  /* a bracket of 2^-26 holds no other number, */
#define ROOT_LAST 24  /* and a step of 2^-24 is rounding */
#define ROOT_LOOK 3   /* the bracket's width matters after a few steps only */

static const struct num sixth = { 0x2aaaaaaa, -32 };

/* --- sides ---------------------------------------------------------------- */

static struct num side_sign(struct num a, bool minus)
{
    return minus ? num_neg(a) : a;
}

void motion_otg_side_init(const struct otg_problem *q, bool goal, int sign,
                          struct otg_side *s)
{
    s->j = goal ? q->j2 : q->j;
    s->per_j = goal ? q->per_j2 : q->per_j;
    s->limit = goal == (sign < 0) ? q->ax : num_neg(q->an);
    s->ramp = otg_over(q, s->limit, s->per_j);
    s->corner = num_mul(s->limit, s->ramp);
    s->per_limit = num_zero();
    s->a = side_sign(goal ? q->af : q->a0, goal == (sign > 0));
    s->base = s->natural = side_sign(goal ? q->vf : q->v0, sign < 0);
    s->lead_t = s->lead_d = s->drop = num_zero();
    if (s->a.m == 0)
        return;
    s->lead_t = otg_over(q, s->a, s->per_j);
    struct num e = num_mul(s->a, s->lead_t); /* a^2/j */
    s->drop = num_half(e);
    s->base = num_sub(s->base, s->drop);
    s->natural = s->a.m > 0 ? num_add(s->base, e) : s->base;
    /* base t + j t^3 / 6 */
    s->lead_d = num_mul(s->lead_t, num_add(s->base, num_mul(e, sixth)));
}

void motion_otg_side_pulse(struct otg_side *side, bool is_unit, struct num w,
                           struct otg_pulse *pulse)
{
    if (num_lt(side->corner, w)) {
        if (side->per_limit.m == 0)
            side->per_limit = num_inv(side->limit);
        pulse->a = side->limit;
        pulse->per_a = side->per_limit;
        pulse->z = num_half(num_add(num_mul(w, side->per_limit), side->ramp));
        return;
    }
    if (w.m <= 0) {
        *pulse =
            (struct otg_pulse){ num_zero(), num_zero(), num_inv(num_zero()) };
        return;
    }
    if (!is_unit)
        w = num_mul(w, side->per_j);
    pulse->per_a = num_rsqrt(w);
    pulse->a = pulse->z = num_mul(w, pulse->per_a);
    if (!is_unit) {
        pulse->a = num_mul(pulse->a, side->j);
        pulse->per_a = num_mul(pulse->per_a, side->per_j);
    }
}

/* --- the family ----------------------------------------------------------- */

void motion_otg_border_init(const struct otg_problem *q, int sign, int first,
                            struct otg_border *b)
{
    struct otg_side *s = b->side;
    motion_otg_side_init(q, false, sign, &s[0]);
    motion_otg_side_init(q, true, sign, &s[1]);
    b->gap = num_sub(num_sub(s[1].drop, s[0].drop), side_sign(q->dv, sign < 0));
    b->first = first < 0 ? b->gap.m < 0 : first;
    if (b->first)
        b->gap = num_neg(b->gap);
    b->sign = sign;
    b->is_unit = q->is_unit;
    b->top = side_sign(sign < 0 ? q->vn : q->vx, sign < 0);
    b->lead_t = num_add(s[0].lead_t, s[1].lead_t);
    b->lead_d = num_add(s[0].lead_d, s[1].lead_d);
}

struct num motion_otg_border_half(struct otg_border *b, struct num vc)
{
    struct otg_side *f = &b->side[b->first];
    struct otg_pulse h;
    motion_otg_side_pulse(f, b->is_unit, num_sub(vc, f->base), &h);
    return h.z;
}

struct num motion_otg_border_low(struct otg_border *b)
{
    struct otg_side *f = &b->side[b->first];
    const struct otg_side *o = &b->side[!b->first];
    if (!num_lt(f->natural, o->natural))
        return f->lead_t;
    return motion_otg_border_half(b, o->natural);
}

/* Speed change of the first side, and its peak. */
static struct num border_rise(const struct otg_border *b, struct num x,
                              struct num *peak)
{
    const struct otg_side *f = &b->side[b->first];
    if (num_lt(f->ramp, x)) {
        *peak = f->limit;
        return num_mul(f->limit, num_sub(num_twice(x), f->ramp));
    }
    *peak = b->is_unit ? x : num_mul(x, f->j);
    return num_mul(x, *peak);
}

/* By (3) dD/dT = pull / 2, and dT/dx = 2 (1 + r). */
static struct num border_slope(const struct otg_border *b, struct num vc,
                               struct num a1, const struct otg_pulse *h,
                               struct num both)
{
    const struct otg_side *f = &b->side[b->first], *o = &b->side[!b->first];
    struct num pull = num_twice(vc);
    if (b->is_unit)
        return num_mul(num_add(pull, num_mul(a1, h->a)), both);
    struct num width = num_add(num_mul(a1, f->per_j), num_mul(h->a, o->per_j));
    return num_add(num_mul(pull, both), num_mul(a1, width));
}

void motion_otg_border_at(struct otg_border *b, enum otg_goal goal,
                          struct num x, struct otg_point *p)
{
    struct otg_side *f = &b->side[b->first], *o = &b->side[!b->first];
    struct num a1 = x, w = x;
    struct otg_pulse h;
    if (x.m)
        w = border_rise(b, x, &a1);
    motion_otg_side_pulse(o, b->is_unit, num_add(w, b->gap), &h);
    p->x = x;
    p->z = h.z;
    p->vc = num_add(f->base, w);
    p->bend = num_mul(a1, h.per_a);
    struct num both = num_add(num_one(), p->bend);
    if (goal == OTG_GOAL_T) {
        p->got = num_twice(num_add(x, h.z));
        p->slope = num_twice(both);
        return;
    }
    p->got = num_mul(num_add(p->vc, o->base), h.z);
    if (x.m)
        p->got = num_add(p->got, num_mul(num_add(p->vc, f->base), x));
    p->slope = border_slope(b, p->vc, a1, &h, both);
}

struct num motion_otg_border_time(const struct otg_border *b,
                                  const struct otg_point *p)
{
    return num_sub(num_twice(num_add(p->x, p->z)), b->lead_t);
}

/* --- one root ------------------------------------------------------------- */

/* Whether the point is at or beyond what is looked for. */
static bool is_right_of(enum otg_goal goal, struct num rest, struct num slope)
{
    if (goal == OTG_GOAL_T)
        return rest.m <= 0;
    if (goal == OTG_GOAL_D)
        return slope.m > 0 && rest.m <= 0;
    return slope.m <= 0 || rest.m <= 0;
}

/* |a| below 2^-bits of b. */
static bool is_small(struct num a, struct num b, int bits)
{
    return a.m == 0 || (b.m != 0 && a.e < b.e - bits);
}

/* dD/dT by (3), where the first side's acceleration is x: in regime B. */
struct num motion_otg_border_rate(const struct otg_border *b,
                                  const struct otg_point *p)
{
    struct num a2 = num_min(p->z, b->side[!b->first].limit);
    return num_add(p->vc, num_half(num_mul(p->x, a2)));
}

/* It changes by 2 x + z/2 + x^2/2z: nothing where x = -(2 - sqrt 3) z, so where
 * x^2 = gap / (6 + 4 sqrt 3); where the other side's limit binds, later, by
 * 2 x + limit/2. */
struct num motion_otg_border_turn(const struct otg_border *b, struct num hi)
{
    static const struct num part = { 664433753, -33 }; /* 1 / (6 + 4 sqrt 3) */
    static const struct num per_s = { 1001814760, -28 }; /* 2 + sqrt 3 */
    struct num limit = b->side[!b->first].limit;
    struct num x = num_mul(b->gap, part);
    if (!num_lt(num_sqr(hi), x))
        return hi;
    x = num_sqrt(x);
    if (num_lt(limit, num_mul(x, per_s)))
        x = num_max(num_sqrt(num_sub(num_sqr(limit), b->gap)),
                    num_scale(limit, -2));
    return num_min(num_neg(x), hi);
}

/* As long as that rate falls, the border is concave over the duration: no
 * higher than the tangent.  The duration changes by less than 2 with x. */
static bool is_hopeless(const struct otg_border *b, const struct otg_point *p,
                        struct num lo, struct num hi)
{
    struct num rate = motion_otg_border_rate(b, p);
    struct num far = rate.m > 0 ? num_sub(hi, p->x) : num_sub(p->x, lo);
    return num_lt(num_twice(num_mul(num_abs(rate), far)), p->rest);
}

static bool is_same(struct num a, struct num b)
{
    return a.m == b.m && a.e == b.e;
}

/* The last step, to `to`; what of it is beyond the cruise's limit is left. */
static void root_end(enum otg_goal goal, struct num to, struct num step,
                     struct num top, struct otg_point *p)
{
    p->rest = num_zero();
    if (goal == OTG_GOAL_D && top.m > 0 && num_lt(top, to)) {
        struct num over = num_sub(to, top);
        p->rest = num_mul(over, p->slope);
        step = num_sub(step, over);
        to = top;
    }
    p->x = to;
    p->z = num_add(p->z, num_mul(p->bend, step));
}

/* Newton in a bracket, the bracket halved at least every other step. */
void motion_otg_border_root(struct otg_border *b, enum otg_goal goal,
                            struct num target, struct num lo, struct num hi,
                            struct otg_point *p)
{
    struct num x = p->x, top = hi;
    bool is_bounded = false;
    if (!num_lt(x, hi))
        x = hi;
    for (int i = 1; i < ROOT_MOST; i++) {
        motion_otg_border_at(b, goal, x, p);
        p->rest = num_sub(target, p->got);
        if (goal == OTG_GOAL_FIRST && p->rest.m > 0 &&
            is_hopeless(b, p, lo, hi))
            break;
        bool is_right = is_right_of(goal, p->rest, p->slope);
        if (is_right) {
            hi = x;
            is_bounded = true;
        } else if (is_same(x, top)) {
            break;
        } else {
            lo = x;
        }
        struct num all = num_add(x, p->z);
        if (i % ROOT_LOOK == 0 && is_bounded &&
            is_small(num_sub(hi, lo), all, ROOT_SHUT))
            break;
        struct num to = x;
        if (p->slope.m > 0) {
            struct num step = num_div(p->rest, p->slope);
            to = num_add(x, step);
            if (is_small(step, x, ROOT_BITS) ||
                is_small(step, all, ROOT_LAST)) {
                root_end(goal, to, step, top, p);
                break;
            }
        }
        /* a step leads away from the end that x has become */
        bool is_inside =
            p->slope.m > 0 && (is_right ? num_lt(lo, to) : num_lt(to, hi));
        if (is_inside && (i < ROOT_HALF || (i & 1)))
            x = to;
        else
            x = is_bounded ? num_half(num_add(lo, hi)) : hi;
        if (is_bounded && (is_same(x, lo) || is_same(x, hi)))
            break; /* nothing is between */
    }
    if (goal == OTG_GOAL_D && !is_same(p->x, top))
        p->rest = num_zero(); /* by rounding; no cruise makes it good */
}

/* --- its motion ----------------------------------------------------------- */

static struct num end_peak(const struct otg_end *end, bool is_unit,
                           struct num *hold)
{
    const struct otg_side *s = end->side;
    *hold = num_zero();
    if (num_lt(s->ramp, end->half)) {
        *hold = num_twice(num_sub(end->half, s->ramp));
        return s->limit;
    }
    return is_unit ? end->half : num_mul(end->half, s->j);
}

/* |a| / j; rounding may leave less than nothing. */
static struct num end_time(const struct otg_end *end, bool is_unit,
                           struct num a)
{
    if (a.m <= 0)
        return num_zero();
    return is_unit ? a : num_mul(a, end->side->per_j);
}

static void shape_pulse(struct otg_shape *shape, int which, bool is_peak)
{
    shape->free.pulse[which] = (int16_t)(shape->count - 1);
    shape->free.is_peak[which] = is_peak;
}

void motion_otg_shape_ends(const struct otg_end end[2], bool is_unit,
                           const struct num *cruise, struct otg_shape *shape)
{
    const struct otg_end *s = &end[0], *g = &end[1];
    bool up = s->sign > 0, down = g->sign > 0;
    struct num hold_s, hold_g;
    struct num as = end_peak(s, is_unit, &hold_s);
    struct num ag = end_peak(g, is_unit, &hold_g);
    struct num a1 = side_sign(as, !up), a2 = side_sign(ag, down);
    otg_shape_add(shape, end_time(s, is_unit, num_sub(as, s->side->a)), a1);
    otg_shape_add(shape, hold_s, a1);
    shape_pulse(shape, 0, up);
    if (cruise == NULL) {
        otg_shape_add(shape, num_add(as, ag), a2);
    } else {
        otg_shape_add(shape, end_time(s, is_unit, as), num_zero());
        otg_shape_add(shape, *cruise, num_zero());
        if (cruise->m > 0)
            shape->free.cruise = (int16_t)(shape->count - 1);
        if (!is_unit)
            shape->brake = shape->turn = shape->count;
        otg_shape_add(shape, end_time(g, is_unit, ag), a2);
    }
    otg_shape_add(shape, hold_g, a2);
    shape_pulse(shape, 1, !down);
    otg_shape_add(shape, end_time(g, is_unit, num_sub(ag, g->side->a)),
                  side_sign(g->side->a, down));
}

void motion_otg_border_shape(const struct otg_border *b,
                             const struct otg_point *p, struct num cruise,
                             struct otg_shape *shape)
{
    struct otg_end end[2];
    for (int i = 0; i < 2; i++)
        end[i] = (struct otg_end){ &b->side[i], b->sign,
                                   b->first == i ? p->x : p->z };
    bool is_split = !b->is_unit || cruise.m > 0;
    motion_otg_shape_ends(end, b->is_unit, is_split ? &cruise : NULL, shape);
}
