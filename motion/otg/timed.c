/* motion/otg/timed.c - a motion that takes a given time.  See solve.h.
 *
 * Nearly always one of constant cruise: a ramp to the speed vc, a cruise, a
 * ramp to the goal, where either ramp goes up or down.  Its displacement rises
 * with vc, so that is one root.  What this family does not reach is between the
 * two borders' motions of the same duration, and a mixture of these. */
#include <stddef.h>

#include "motion/core/err.h"
#include "motion/otg/internal.h"

#define CRUISE_MOST 24
#define CRUISE_BITS 12

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
struct edge {
    struct otg_phase phase[7];
    int count;
    struct num d;
};

/* One polyline being walked along. */
struct walk {
    const struct edge *edge;
    int i;
    struct num a, left; /* here; time to the next corner */
};

static void walk_next(struct walk *w)
{
    while (w->i < w->edge->count && w->left.m <= 0) {
        w->a = w->edge->phase[w->i].a;
        w->i++;
        if (w->i < w->edge->count)
            w->left = w->edge->phase[w->i].dt;
    }
}

static void walk_by(struct walk *w, struct num dt)
{
    struct num rise = num_sub(w->edge->phase[w->i].a, w->a);
    struct num part = num_div(dt, w->left);
    w->a = num_add(w->a, num_mul(rise, part));
    w->left = num_sub(w->left, dt);
    walk_next(w);
}

static struct walk walk_start(const struct edge *edge, struct num a0)
{
    struct walk w = { edge, 0, a0, edge->phase[0].dt };
    walk_next(&w);
    return w;
}

/* Append lambda x + (1 - lambda) y: limits are convex, so what both keep the
 * mixture keeps, and its displacement is the same mixture of theirs. */
OTG_OWN_FRAME static void blend(const struct edge *x, const struct edge *y,
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

/* What each border reaches in time t; d is lambda of the way between them. */
struct slice {
    struct edge upper, lower;
    struct num lambda;
};

/* 0, or on which side of the slice d is. */
static int slice_place(struct slice *s, const struct otg_problem *q,
                       struct num t)
{
    struct num over = num_sub(q->d, s->upper.d);
    struct num above = num_sub(q->d, s->lower.d);
    s->lambda = num_one();
    if (motion_otg_is_reached(q, t, over))
        return 0;
    if (over.m > 0)
        return 1;
    s->lambda = num_zero();
    if (motion_otg_is_reached(q, t, above))
        return 0;
    if (above.m < 0)
        return -1;
    s->lambda = num_div(above, num_sub(s->upper.d, s->lower.d));
    return 0;
}

static void edge_take(struct edge *edge, struct otg_shape *shape, int from)
{
    edge->count = shape->count - from;
    for (int i = 0; i < edge->count; i++)
        edge->phase[i] = shape->phase[from + i];
    shape->count = from;
    shape->knobs.pulse[0] = shape->knobs.pulse[1] = shape->knobs.cruise = -1;
}

/* The border's motion of duration t from lo on; false if it starts later.
 * `shape` is as before. */
static bool border_in(struct otg_border *b, struct num t, struct num lo,
                      struct num hi, struct otg_shape *shape, struct edge *edge)
{
    int from = shape->count;
    struct otg_point p;
    struct num want = num_add(t, b->lead_t);
    motion_otg_border_at(b, OTG_GOAL_T, lo, &p);
    if (num_lt(want, p.got))
        return false;
    p.x = num_half(num_add(lo, num_min(hi, num_half(t))));
    motion_otg_border_root(b, OTG_GOAL_T, want, lo, hi, &p);
    struct num cruise = num_zero(), x = p.x;
    if (p.rest.m > 0)
        cruise = p.rest;
    motion_otg_border_shape(b, &p, cruise, shape);
    edge_take(edge, shape, from);
    motion_otg_border_at(b, OTG_GOAL_D, x, &p);
    struct num d = num_add(num_sub(p.got, b->lead_d), num_mul(cruise, p.vc));
    edge->d = b->sign < 0 ? num_neg(d) : d;
    return true;
}

OTG_OWN_FRAME static bool duration_in_lens(const struct otg_problem *q,
                                           struct num t,
                                           struct otg_shape *shape,
                                           struct slice *s)
{
    struct otg_lens lens = motion_otg_lens_of(q);
    struct otg_border b;
    if (!lens.exists)
        return false;
    struct num hi = num_neg(lens.valley);
    struct num late = num_sub(num_add(num_abs(q->a0), num_abs(q->af)),
                              num_twice(lens.valley));
    if (num_lt(late, t))
        return false;
    struct num lo = motion_otg_lens_border(q, 1, &b);
    if (!border_in(&b, t, lo, hi, shape, &s->upper))
        return false;
    lo = motion_otg_lens_border(q, -1, &b);
    return border_in(&b, t, lo, hi, shape, &s->lower) &&
           slice_place(s, q, t) == 0;
}

static bool main_border_in(const struct otg_problem *q, int sign, struct num t,
                           struct otg_shape *shape, struct edge *edge)
{
    struct otg_border b;
    motion_otg_border_init(q, sign, -1, &b);
    struct num lo = motion_otg_border_low(&b);
    struct num hi = num_max(lo, motion_otg_border_half(&b, b.top));
    return border_in(&b, t, lo, hi, shape, edge);
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

bool motion_otg_lens_in(const struct otg_problem *q, struct num t,
                        struct otg_shape *shape)
{
    struct slice s;
    if (!duration_in_lens(q, t, shape, &s))
        return false;
    blend(&s.upper, &s.lower, q->a0, s.lambda, shape);
    return true;
}

OTG_OWN_FRAME static bool solve_blend(const struct otg_problem *q, struct num t,
                                      struct otg_shape *shape, int *side)
{
    struct slice s;
    if (!duration_in_lens(q, t, shape, &s) &&
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
        *next = motion_otg_next_time(&q, side);
        return MOTION_E_LIMIT;
    }
    if (!problem->is_unit)
        motion_otg_shape_scale(shape, from, num_min(problem->j, problem->j2));
    return MOTION_OK;
}
