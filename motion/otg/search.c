/* motion/otg/search.c - the fastest motion between two states inside their
 * limits, or one that takes a given time; names and equations are those of
 * docs/OTG.md.
 *
 * The fastest is a root on one of two borders.  A given time is nearly always
 * met by one cruise: a ramp to the speed vc, a cruise, a ramp to the goal,
 * where either ramp goes up or down.  Its displacement rises with vc, so that
 * is one root, too.  What this family does not reach is between the two
 * borders' motions of the same duration, and a mixture of these. */
#include <stddef.h>

#include "motion/core/err.h"
#include "motion/otg/internal.h"

#define REACHED_BITS 24 /* the search is off by 2^-27 */
#define EDGE_BITS    14 /* where margins of 2^-25 cost their root, 2^-13 */
#define EARLY_BITS   24 /* what rounding makes of its time is less */

/* --- the main region ------------------------------------------------------ */

/* Where on a border the answer is. */
struct answer {
    struct otg_border b;
    struct otg_point p;
    struct num cruise;
    bool is_edge; /* see otg_shape */
};

static struct num answer_time(const struct answer *at)
{
    return num_add(motion_otg_border_time(&at->b, &at->p), at->cruise);
}

/* About where 2 x^3 + s x reaches `rest`, from above: what is left of the
 * family when no limit of a binds. */
static struct num guess(struct num rest, struct num s)
{
    struct num x = num_zero();
    if (rest.m > 0) {
        x = motion_num_cbrt_above(num_half(rest));
        if (s.m > 0)
            x = num_min(x, num_div(rest, s));
    }
    if (s.m < 0)
        return num_add(x, num_sqrt(num_half(num_neg(s))));
    if (x.m == 0)
        return x;
    struct num x2 = num_twice(num_sqr(x));
    struct num up = num_add(rest, num_twice(num_mul(x2, x)));
    return num_div(up, num_add(s, num_add(x2, num_twice(x2))));
}

/* The same with two jerks: j (1 + sqrt(j / j2)) x^3 + s x, j on the side whose
 * x it is. */
OTG_OWN_FRAME static struct num guess_two(const struct otg_border *b,
                                          struct num rest, struct num s)
{
    const struct otg_side *f = &b->side[b->first], *o = &b->side[!b->first];
    struct num r = num_sqrt(num_mul(f->j, o->per_j));
    struct num by = num_inv(num_half(num_add(num_one(), r)));
    by = num_mul(by, f->per_j);
    return guess(num_mul(rest, by), num_mul(s, by));
}

/* In regime B the border may rise before it falls: as far as its rate gets
 * less, as in the early set.  What it reaches there comes first. */
static bool is_placed_on_first(struct answer *at, struct num target,
                               struct num lo)
{
    struct otg_point p = at->p;
    struct num hi = motion_otg_border_turn(&at->b, num_zero());
    if (!num_lt(lo, hi) || motion_otg_border_rate(&at->b, &p).m <= 0 ||
        !num_lt(p.got, target))
        return false;
    p.x = num_half(num_add(lo, hi));
    motion_otg_border_root(&at->b, OTG_GOAL_FIRST, target, lo, hi, &p);
    if (p.rest.m > 0)
        return false;
    at->p = p;
    at->cruise = num_zero();
    return true;
}

/* The target displacement on the last rising branch, from p at lo on. */
static void place(struct answer *at, struct num target, struct num lo)
{
    struct otg_border *b = &at->b;
    struct otg_point *p = &at->p;
    struct num hi = motion_otg_border_half(b, b->top);
    if (lo.m < 0) {
        motion_otg_border_at(b, OTG_GOAL_D, num_zero(), p);
        if (p->slope.m > 0 && !num_lt(p->got, target)) {
            hi = num_zero();
            p->x = num_half(lo);
        } else {
            lo = num_zero();
        }
    }
    hi = num_max(lo, hi);
    if (lo.m >= 0) {
        struct num rest = num_sub(target, p->got);
        p->x = num_add(lo, b->is_unit ? guess(rest, p->slope)
                                      : guess_two(b, rest, p->slope));
    }
    motion_otg_border_root(b, OTG_GOAL_D, target, lo, hi, p);
    at->cruise = num_zero();
    if (p->rest.m > 0)
        at->cruise = num_div(p->rest, p->vc);
}

/* The border with `sign`: its start; what d is beyond that. */
static struct num border_start(const struct otg_problem *q, int sign,
                               struct answer *at, struct num *target,
                               struct num *lo)
{
    motion_otg_border_init(q, sign, -1, &at->b);
    *target = num_add(sign < 0 ? num_neg(q->d) : q->d, at->b.lead_d);
    *lo = motion_otg_border_low(&at->b);
    if (!q->is_unit && lo->m < 0)
        *lo = num_zero();
    motion_otg_border_at(&at->b, OTG_GOAL_D, *lo, &at->p);
    return num_sub(*target, at->p.got);
}

/* Equal within what the search leaves, relative to the displacement and v t. */
static bool is_reached(const struct otg_problem *q, struct num t,
                       struct num residual)
{
    if (residual.m == 0)
        return true;
    struct num scale = num_max(num_abs(q->v0), num_abs(q->vf));
    scale = num_add(num_abs(q->d), num_mul(scale, t));
    return scale.m != 0 && residual.e < scale.e - REACHED_BITS;
}

/* No more than tightening limits may make of `size` or `other`. */
static bool is_slight(struct num rest, struct num size, struct num other)
{
    int32_t e = size.e > other.e ? size.e : other.e;
    return rest.m == 0 || rest.e < e - EDGE_BITS;
}

static bool is_at_start(const struct otg_problem *q, struct answer *at,
                        struct num rest)
{
    at->cruise = num_zero();
    return is_reached(q, answer_time(at), rest);
}

/* Both borders start with the same motion, the plain speed change. */
static void answer_main(const struct otg_problem *q, struct answer *at)
{
    struct num target, lo;
    int sign = q->d.m < 0 ? -1 : 1;
    struct num rest = border_start(q, sign, at, &target, &lo);
    at->is_edge |= is_slight(rest, q->d, at->b.lead_d);
    if ((at->p.slope.m <= 0 || (rest.m <= 0 && !q->is_strict)) &&
        is_at_start(q, at, rest))
        return;
    if (rest.m < 0)
        (void)border_start(q, -sign, at, &target, &lo);
    if (lo.m >= 0 || !is_placed_on_first(at, target, lo))
        place(at, target, lo);
}

/* --- the early set -------------------------------------------------------- */

/* Motions whose acceleration never changes sign, which needs accelerations of
 * one sign at both ends.  What they reach is closed in time: between two speed
 * changes, + - and - +, with *end = x of that, minus its valley.  The main set
 * begins later; durations between are blocked. */
static bool has_early(const struct otg_problem *q, struct num *end)
{
    if (q->has_no_early || q->a0.m == 0 || q->af.m == 0 ||
        (q->a0.m < 0) != (q->af.m < 0))
        return false;
    struct num dv = q->dv;
    struct num e0 = num_half(num_sqr(q->a0)), ef = num_half(num_sqr(q->af));
    if (q->a0.m < 0)
        dv = num_neg(dv);
    struct num square = num_sub(num_add(e0, ef), dv);
    if (square.m <= 0 || num_lt(dv, num_abs(num_sub(ef, e0))))
        return false;
    *end = num_neg(num_sqrt(square));
    return true;
}

/* A border of it is regime B of the side whose acceleration is below zero
 * there, with a1 rising to `end`; returns x at its start. */
static struct num early_border(const struct otg_problem *q, int sign,
                               struct otg_border *b)
{
    motion_otg_border_init(q, sign, (q->a0.m > 0) == (sign > 0), b);
    return b->side[b->first].a;
}

/* Whether the target is reached while the border is concave, up to hi: it must
 * rise at its start, and when it ends short of that, fall at its end, or its
 * highest value is at the end.  Nor is it higher than its tangents. */
static bool early_may_reach(struct otg_border *b, struct num target,
                            const struct otg_point *first, struct num hi)
{
    struct otg_point last;
    struct num up = motion_otg_border_rate(b, first);
    if (up.m <= 0)
        return false;
    motion_otg_border_at(b, OTG_GOAL_FIRST, hi, &last);
    struct num down = motion_otg_border_rate(b, &last);
    bool is_short = num_lt(last.got, target);
    if (is_short && down.m > 0)
        return false;
    struct num span = num_sub(motion_otg_border_time(b, &last),
                              motion_otg_border_time(b, first));
    if (num_lt(num_add(first->got, num_mul(up, span)), target))
        return false;
    return down.m > 0 ||
           !num_lt(num_sub(last.got, num_mul(down, span)), target);
}

/* Both borders of the early set begin and end with the same motions. */
OTG_OWN_FRAME static bool is_early_tip(const struct otg_problem *q,
                                       struct answer *at, struct num hi)
{
    struct num lo = early_border(q, 1, &at->b);
    struct num target = num_add(q->d, at->b.lead_d);
    motion_otg_border_at(&at->b, OTG_GOAL_FIRST, lo, &at->p);
    if (is_slight(num_sub(target, at->p.got), q->d, at->b.lead_d))
        return true;
    motion_otg_border_at(&at->b, OTG_GOAL_FIRST, hi, &at->p);
    return is_slight(num_sub(target, at->p.got), q->d, at->b.lead_d);
}

static bool early_reaches(const struct otg_problem *q, enum otg_goal goal,
                          struct num target, struct num lo, struct num hi,
                          struct answer *at)
{
    at->p.x = num_half(num_add(lo, hi));
    motion_otg_border_root(&at->b, goal, target, lo, hi, &at->p);
    return is_reached(q, answer_time(at), at->p.rest);
}

/* A border rises first while it is concave, and once more at its end, where
 * what it comes to is the most of that. */
static bool answer_early_border(const struct otg_problem *q, struct num target,
                                struct num lo, struct num hi, struct answer *at)
{
    struct num concave = num_max(lo, motion_otg_border_turn(&at->b, hi));
    if (num_lt(lo, concave) &&
        early_may_reach(&at->b, target, &at->p, concave) &&
        early_reaches(q, OTG_GOAL_FIRST, target, lo, concave, at))
        return true;
    if (!num_lt(concave, hi))
        return false;
    motion_otg_border_at(&at->b, OTG_GOAL_D, hi, &at->p);
    return !num_lt(at->p.got, target) &&
           early_reaches(q, OTG_GOAL_D, target, concave, hi, at);
}

bool motion_otg_early_is_near(const struct otg_problem *q, struct num end)
{
    struct num v =
        q->d.m < 0 ? num_neg(num_min(q->v0, q->vf)) : num_max(q->v0, q->vf);
    struct num t = otg_over(q, num_add(num_abs(q->a0), num_abs(q->af)),
                            num_max(q->per_j, q->per_j2));
    struct num rounding = num_scale(t, -EARLY_BITS);
    t = num_add(num_add(t, num_twice(end)), rounding);
    return !num_lt(num_mul(v, t), num_abs(q->d));
}

OTG_OWN_FRAME static bool answer_early(const struct otg_problem *q,
                                       struct answer *at)
{
    struct num end;
    if (!has_early(q, &end) || !motion_otg_early_is_near(q, end))
        return false;
    at->is_edge |= is_early_tip(q, at, end);
    at->cruise = num_zero();
    for (int sign = 1; sign >= -1; sign -= 2) {
        struct num lo = early_border(q, sign, &at->b);
        struct num target = sign < 0 ? num_neg(q->d) : q->d;
        target = num_add(target, at->b.lead_d);
        motion_otg_border_at(&at->b, OTG_GOAL_FIRST, lo, &at->p);
        if (!num_lt(target, at->p.got))
            return answer_early_border(q, target, lo, end, at);
    }
    return false;
}

OTG_OWN_FRAME static bool solve_early(const struct otg_problem *q,
                                      struct otg_shape *shape)
{
    struct answer at;
    at.is_edge = false;
    bool is_reached = answer_early(q, &at);
    shape->is_edge |= at.is_edge;
    if (is_reached)
        motion_otg_border_shape(&at.b, &at.p, at.cruise, shape);
    return is_reached;
}

/* --- solutions ------------------------------------------------------------ */

/* One ramp from end to end makes the speed, or one to zero and one away from
 * it, or nearly: tightening limits costs a pulse there, or
 * closes the early set. */
OTG_OWN_FRAME static bool is_tie(const struct otg_problem *q)
{
    if ((q->a0.m | q->af.m) == 0)
        return false;
    struct num e0 = num_half(num_sqr(q->a0)), ef = num_half(num_sqr(q->af));
    struct num dv = num_abs(q->dv);
    return is_slight(num_sub(dv, num_abs(num_sub(ef, e0))), e0, ef) ||
           is_slight(num_sub(dv, num_add(ef, e0)), e0, ef);
}

static void answer_unit(const struct otg_problem *q, struct answer *at)
{
    at->is_edge = is_tie(q);
    if (!answer_early(q, at))
        answer_main(q, at);
}

/* With the lower jerk on both sides, which any motion may use anywhere; and
 * with both as they are: the cruise between them separates the two halves, so
 * regime A alone, upper or lower border. */
static void answer_best(const struct otg_problem *problem, struct answer *best)
{
    if (problem->is_unit) {
        answer_unit(problem, best);
        return;
    }
    struct otg_problem q = *problem;
    motion_otg_in_jerk(&q, num_max(problem->per_j, problem->per_j2));
    answer_unit(&q, best);
    for (int sign = 1; sign >= -1; sign -= 2) {
        struct answer at;
        struct num target, lo;
        at.is_edge = false;
        if (num_sub(problem->j, problem->j2).m == 0 ||
            border_start(problem, sign, &at, &target, &lo).m < 0)
            continue;
        place(&at, target, lo);
        if (num_lt(answer_time(&at), answer_time(best)))
            *best = at;
    }
}

void motion_otg_solve(const struct otg_problem *q, struct otg_shape *shape)
{
    struct answer at;
    int from = shape->count;
    answer_best(q, &at);
    shape->is_edge |= at.is_edge;
    motion_otg_border_shape(&at.b, &at.p, at.cruise, shape);
    if (!q->is_unit && at.b.is_unit)
        motion_otg_shape_scale(shape, from, num_min(q->j, q->j2));
}

/* --- a speed change ------------------------------------------------------- */

void motion_otg_solve_velocity(const struct otg_problem *q,
                               struct otg_shape *shape)
{
    struct num e0 = num_half(num_sqr(q->a0)), ef = num_half(num_sqr(q->af));
    struct num dv = num_mul(q->j, q->dv);
    struct num direct = num_sub(ef, e0), hold = num_zero();
    bool up = !num_lt(dv, num_lt(q->af, q->a0) ? num_neg(direct) : direct);
    struct num square = num_add(up ? dv : num_neg(dv), num_add(e0, ef));
    struct num limit = up ? q->ax : num_neg(q->an);
    struct num rest = num_sub(square, num_sqr(limit)), a = limit;
    if (rest.m > 0)
        hold = num_mul(num_div(rest, limit), q->per_j);
    else
        a = num_sqrt(square);
    if (!up)
        a = num_neg(a);
    otg_shape_add(shape, num_mul(num_abs(num_sub(a, q->a0)), q->per_j), a);
    otg_shape_add(shape, hold, a);
    shape->free.pulse[0] = (int16_t)(shape->count - 1);
    shape->free.is_peak[0] = up;
    otg_shape_add(shape, num_mul(num_abs(num_sub(q->af, a)), q->per_j), q->af);
}

/* Duration of the fastest motion outside the early set (`sign` 0), or of where
 * the displacement is last passed on the border with that sign. */
OTG_OWN_FRAME static struct num next_time(const struct otg_problem *q, int sign)
{
    struct answer at;
    struct num target, lo;
    at.is_edge = false;
    if (sign == 0)
        answer_main(q, &at);
    else {
        (void)border_start(q, sign, &at, &target, &lo);
        place(&at, target, lo);
    }
    return answer_time(&at);
}

#define CRUISE_MOST 24 /* evaluations: the bound of one root */
#define CRUISE_BITS 12 /* a smaller step ends it: the error is its square */

/* --- one cruise ----------------------------------------------------------- */

/* One side, up to speeds above its natural one or down to those below. */
struct ramp {
    struct otg_side up, down;
    bool has_down;
    bool is_down;
    struct otg_pulse pulse;
};

struct cruise {
    const struct otg_problem *q;
    struct ramp ramp[2];
    struct num t, left; /* in all; of it without acceleration */
    struct num rest, slope;
    struct num size; /* of the smaller of both speed changes */
};

static const struct otg_side *ramp_side(const struct ramp *r)
{
    return r->is_down ? &r->down : &r->up;
}

/* Against cruising all the time at vc: w x + lead - vc lead_t less; with vc
 * it changes by x + w / 2a - lead_t. */
static void ramp_to(struct cruise *c, int i, struct num vc)
{
    struct ramp *r = &c->ramp[i];
    r->is_down = num_lt(vc, r->up.natural);
    if (r->is_down && !r->has_down)
        motion_otg_side_init(c->q, i, -1, &r->down);
    r->has_down |= r->is_down;
    struct otg_side *s = r->is_down ? &r->down : &r->up;
    if (r->is_down)
        vc = num_neg(vc);
    struct num w = num_sub(vc, s->base);
    motion_otg_side_pulse(s, true, w, &r->pulse);
    struct num x = r->pulse.z, less = num_mul(w, x), more = num_half(x);
    if (num_lt(s->corner, w))
        more = num_half(num_mul(w, s->per_limit));
    if (s->a.m) {
        less = num_add(less, s->lead_d);
        less = num_sub(less, num_mul(vc, s->lead_t));
    }
    c->rest = r->is_down ? num_sub(c->rest, less) : num_add(c->rest, less);
    more = num_sub(num_add(x, more), s->lead_t);
    c->slope = num_sub(c->slope, more);
    c->left = num_sub(c->left, num_sub(num_twice(x), s->lead_t));
    if (r->pulse.z.m != 0)
        c->size = num_min(c->size, w);
}

static void cruise_at(struct cruise *c, struct num vc)
{
    c->rest = num_sub(c->q->d, num_mul(vc, c->t));
    c->slope = c->left = c->t;
    c->size = num_max(c->q->vx, num_neg(c->q->vn));
    ramp_to(c, 0, vc);
    ramp_to(c, 1, vc);
}

static bool is_small_step(const struct cruise *c, struct num vc,
                          struct num step)
{
    return step.m == 0 || step.e < c->size.e - CRUISE_BITS ||
           step.e < vc.e - 29;
}

/* Take a last step in vc without evaluating again: one that no ramp would
 * notice, or that vc itself cannot hold. */
static void cruise_finish(struct cruise *c, struct num step)
{
    for (int i = 0; i < 2; i++) {
        struct otg_pulse *h = &c->ramp[i].pulse;
        struct num by = num_half(num_mul(step, h->per_a));
        /* exponents alone may say twice the step's part of w */
        if (h->z.m == 0 || by.e > h->z.e - CRUISE_BITS + 1)
            continue;
        by = c->ramp[i].is_down ? num_neg(by) : by;
        h->z = num_add(h->z, by);
        c->left = num_sub(c->left, num_twice(by));
    }
}

static bool cruise_search(struct cruise *c, struct num *speed)
{
    const struct otg_problem *q = c->q;
    struct num vc = num_div(q->d, c->t);
    for (int i = 0; i < CRUISE_MOST; i++) {
        vc = num_max(num_min(vc, q->vx), q->vn);
        cruise_at(c, vc);
        if (c->slope.m <= 0)
            return false;
        struct num step = num_div(c->rest, c->slope);
        if (is_small_step(c, vc, step)) {
            cruise_finish(c, step);
            *speed = num_add(vc, step);
            return c->left.m > 0;
        }
        vc = num_add(vc, step);
    }
    return false;
}

OTG_OWN_FRAME static bool solve_cruise(const struct otg_problem *q,
                                       struct num t, struct otg_shape *shape)
{
    struct cruise c = { .q = q, .t = t };
    struct otg_end end[2];
    struct num vc;
    motion_otg_side_init(q, false, 1, &c.ramp[0].up);
    motion_otg_side_init(q, true, 1, &c.ramp[1].up);
    if (t.m <= 0 || !cruise_search(&c, &vc))
        return false;
    for (int i = 0; i < 2; i++)
        end[i] =
            (struct otg_end){ ramp_side(&c.ramp[i]), c.ramp[i].is_down ? -1 : 1,
                              c.ramp[i].pulse.z };
    motion_otg_shape_ends(end, true, &c.left, shape);
    return true;
}

/* --- between the borders -------------------------------------------------- */

/* The motion of one border. */
struct reach {
    struct otg_phase phase[7];
    int count;
    struct num d;
};

/* One polyline being walked along. */
struct walk {
    const struct reach *reach;
    int i;
    struct num a, left; /* here; time to the next corner */
};

static void walk_next(struct walk *w)
{
    while (w->i < w->reach->count && w->left.m <= 0) {
        w->a = w->reach->phase[w->i].a;
        w->i++;
        if (w->i < w->reach->count)
            w->left = w->reach->phase[w->i].dt;
    }
}

static void walk_by(struct walk *w, struct num dt)
{
    struct num rise = num_sub(w->reach->phase[w->i].a, w->a);
    struct num part = num_div(dt, w->left);
    w->a = num_add(w->a, num_mul(rise, part));
    w->left = num_sub(w->left, dt);
    walk_next(w);
}

static struct walk walk_start(const struct reach *reach, struct num a0)
{
    struct walk w = { reach, 0, a0, reach->phase[0].dt };
    walk_next(&w);
    return w;
}

/* Append lambda x + (1 - lambda) y: limits are convex, so what both keep the
 * mixture keeps, and its displacement is the same mixture of theirs. */
OTG_OWN_FRAME static void blend(const struct reach *x, const struct reach *y,
                                struct num a0, struct num lambda,
                                struct otg_shape *shape)
{
    struct walk wx = walk_start(x, a0), wy = walk_start(y, a0);
    while (wx.i < x->count && wy.i < y->count) {
        struct num dt = num_min(wx.left, wy.left);
        walk_by(&wx, dt);
        walk_by(&wy, dt);
        struct num a = num_mul(lambda, num_sub(wx.a, wy.a));
        otg_shape_add(shape, dt, num_add(wy.a, a));
    }
}

/* What each border reaches in time t; d is lambda of the distance between them. */
struct slice {
    struct reach upper, lower;
    struct num lambda;
};

/* 0, or on which side of the slice d is. */
static int slice_place(struct slice *s, const struct otg_problem *q,
                       struct num t)
{
    struct num over = num_sub(q->d, s->upper.d);
    struct num above = num_sub(q->d, s->lower.d);
    s->lambda = num_one();
    if (is_reached(q, t, over))
        return 0;
    if (over.m > 0)
        return 1;
    s->lambda = num_zero();
    if (is_reached(q, t, above))
        return 0;
    if (above.m < 0)
        return -1;
    s->lambda = num_div(above, num_sub(s->upper.d, s->lower.d));
    return 0;
}

static void reach_take(struct reach *reach, struct otg_shape *shape, int from)
{
    reach->count = shape->count - from;
    for (int i = 0; i < reach->count; i++)
        reach->phase[i] = shape->phase[from + i];
    shape->count = from;
    shape->free.pulse[0] = shape->free.pulse[1] = shape->free.cruise = -1;
}

/* The border's motion of duration t from lo on; false if it starts later.
 * `shape` is as before. */
static bool border_in(struct otg_border *b, struct num t, struct num lo,
                      struct num hi, struct otg_shape *shape,
                      struct reach *reach)
{
    int from = shape->count;
    struct otg_point p;
    struct num target = num_add(t, b->lead_t);
    motion_otg_border_at(b, OTG_GOAL_T, lo, &p);
    if (num_lt(target, p.got))
        return false;
    p.x = num_half(num_add(lo, num_min(hi, num_half(t))));
    motion_otg_border_root(b, OTG_GOAL_T, target, lo, hi, &p);
    struct num cruise = num_zero(), x = p.x;
    if (p.rest.m > 0)
        cruise = p.rest;
    motion_otg_border_shape(b, &p, cruise, shape);
    reach_take(reach, shape, from);
    motion_otg_border_at(b, OTG_GOAL_D, x, &p);
    struct num d = num_add(num_sub(p.got, b->lead_d), num_mul(cruise, p.vc));
    reach->d = b->sign < 0 ? num_neg(d) : d;
    return true;
}

OTG_OWN_FRAME static bool duration_in_early(const struct otg_problem *q,
                                            struct num t,
                                            struct otg_shape *shape,
                                            struct slice *s)
{
    struct num hi;
    struct otg_border b;
    if (!has_early(q, &hi))
        return false;
    struct num late =
        num_add(num_add(num_abs(q->a0), num_abs(q->af)), num_twice(hi));
    if (num_lt(late, t))
        return false;
    struct num lo = early_border(q, 1, &b);
    if (!border_in(&b, t, lo, hi, shape, &s->upper))
        return false;
    lo = early_border(q, -1, &b);
    return border_in(&b, t, lo, hi, shape, &s->lower) &&
           slice_place(s, q, t) == 0;
}

static bool main_border_in(const struct otg_problem *q, int sign, struct num t,
                           struct otg_shape *shape, struct reach *reach)
{
    struct otg_border b;
    motion_otg_border_init(q, sign, -1, &b);
    struct num lo = motion_otg_border_low(&b);
    struct num hi = num_max(lo, motion_otg_border_half(&b, b.top));
    return border_in(&b, t, lo, hi, shape, reach);
}

/* Whether d is reached in t; else on which *side of the slice it is, 0 when
 * both borders start later. */
static bool duration_in_main(const struct otg_problem *q, struct num t,
                             struct otg_shape *shape, struct slice *s,
                             int *side)
{
    *side = 0;
    if (!main_border_in(q, 1, t, shape, &s->upper) ||
        !main_border_in(q, -1, t, shape, &s->lower))
        return false;
    *side = slice_place(s, q, t);
    return *side == 0;
}

/* A motion of the early set that takes t. */
static bool early_in(const struct otg_problem *q, struct num t,
                     struct otg_shape *shape)
{
    struct slice s;
    if (!duration_in_early(q, t, shape, &s))
        return false;
    blend(&s.upper, &s.lower, q->a0, s.lambda, shape);
    return true;
}

OTG_OWN_FRAME static bool solve_blend(const struct otg_problem *q, struct num t,
                                      struct otg_shape *shape, int *side)
{
    struct slice s;
    if (!duration_in_early(q, t, shape, &s) &&
        !duration_in_main(q, t, shape, &s, side))
        return false;
    blend(&s.upper, &s.lower, q->a0, s.lambda, shape);
    return true;
}

int motion_otg_solve_duration(const struct otg_problem *problem, struct num t,
                              struct otg_shape *shape, struct num *next)
{
    struct otg_problem q = *problem;
    int from = shape->count, side;
    struct num per_j = num_max(q.per_j, q.per_j2);
    if (!q.is_unit)
        motion_otg_in_jerk(&q, per_j);
    if (!solve_cruise(&q, t, shape) && !solve_blend(&q, t, shape, &side)) {
        *next = next_time(&q, side);
        return MOTION_E_LIMIT;
    }
    if (!problem->is_unit)
        motion_otg_shape_scale(shape, from, num_min(problem->j, problem->j2));
    return MOTION_OK;
}

bool motion_otg_solve_early(const struct otg_problem *q, struct num t,
                            struct otg_shape *shape)
{
    return t.m != 0 ? early_in(q, t, shape) : solve_early(q, shape);
}
