/* motion/otg_solve.c - see otg_solve.h; the names and equations are those of
 * docs/OTG.md.
 *
 * Two symmetries reduce everything to "upper border, first end's natural speed
 * the higher": upside down (negate), and backwards in time (reverse). */
#include "motion/otg_solve.h"

#include <stddef.h>

#include "motion/err.h"
#include "motion/otg_border.h"
#include "motion/otg_internal.h"

/* --- symmetries ---------------------------------------------------------- */

static struct otg_problem solve_negate(const struct otg_problem *q)
{
    return (struct otg_problem){
        .d = real_neg(q->d),
        .v0 = real_neg(q->v0),
        .a0 = real_neg(q->a0),
        .vf = real_neg(q->vf),
        .af = real_neg(q->af),
        .vx = real_neg(q->vn),
        .vn = real_neg(q->vx),
        .ax = real_neg(q->an),
        .an = real_neg(q->ax),
        .j = q->j,
        .j2 = q->j2,
        .per_j = q->per_j,
        .per_j2 = q->per_j2,
    };
}

/* s = T - t and displacement counted backwards: speed keeps its sign,
 * acceleration changes it. */
struct otg_problem motion_otg_reversed(const struct otg_problem *q)
{
    return (struct otg_problem){
        .d = q->d,
        .v0 = q->vf,
        .a0 = real_neg(q->af),
        .vf = q->v0,
        .af = real_neg(q->a0),
        .vx = q->vx,
        .vn = q->vn,
        .ax = real_neg(q->an),
        .an = real_neg(q->ax),
        .j = q->j2,
        .j2 = q->j,
        .per_j = q->per_j2,
        .per_j2 = q->per_j,
    };
}

static void shape_negate(struct otg_shape *shape, int from)
{
    for (int i = from; i < shape->count; i++)
        shape->phase[i].a = real_neg(shape->phase[i].a);
}

/* `a0` is where the polyline starts, in the frame it was made in. */
void motion_otg_shape_reverse(struct otg_shape *shape, int from, struct real a0)
{
    int last = shape->count - 1;
    for (int i = from, k = last; i < k; i++, k--) {
        struct otg_phase t = shape->phase[i];
        shape->phase[i] = shape->phase[k];
        shape->phase[k] = t;
    }
    for (int i = from; i <= last; i++)
        shape->phase[i].a = real_neg(i < last ? shape->phase[i + 1].a : a0);
}

/* --- pieces -------------------------------------------------------------- */

struct otg_reach motion_otg_shape_reach(const struct otg_shape *shape,
                                        struct real *v, struct real a0)
{
    static const struct real third = { INT64_C(0x2aaaaaaaaaaaaaaa), -63 };
    struct otg_reach reach = { real_zero(), real_zero() };
    for (int i = 0; i < shape->count; i++) {
        const struct otg_phase *ph = &shape->phase[i];
        if (ph->dt.m == 0) {
            a0 = ph->a;
            continue;
        }
        /* 6 v dt + (2 a0 + a) dt^2, and the sixth of it at the end */
        struct real rise = real_mul(real_add(a0, ph->a), ph->dt);
        struct real mean = real_add(rise, real_mul(a0, ph->dt));
        struct real v6 = real_add(real_scale(*v, 2), real_twice(*v));
        reach.d = real_add(reach.d, real_mul(real_add(v6, mean), ph->dt));
        reach.t = real_add(reach.t, ph->dt);
        *v = real_add(*v, real_half(rise));
        a0 = ph->a;
    }
    reach.d = real_mul(real_half(reach.d), third);
    return reach;
}

/* Speed when the acceleration has been brought to zero: v + a|a| / 2j. */
static struct real natural(struct real v, struct real a, struct real per_j)
{
    struct real e = real_mul(real_mul(a, real_abs(a)), per_j);
    return real_add(v, real_half(e));
}

/* --- upper border -------------------------------------------------------- */

static bool is_reversed(const struct otg_problem *q)
{
    return real_lt(natural(q->v0, q->a0, q->per_j),
                   natural(q->vf, real_neg(q->af), q->per_j2));
}

/* A speed near which the two halves take `t`: what a mean of both would do,
 * with and without the limit of a binding. */
static struct real guess_s_time(const struct otg_border *b, struct real t)
{
    const struct otg_half *x = &b->first, *y = &b->second;
    struct real flat = real_sub(t, real_add(x->ramp, y->ramp));
    struct real s = real_scale(real_div(t, x->per_root_j), -2);
    flat = real_add(flat, real_add(x->lead_t, y->lead_t));
    if (flat.m > 0) {
        struct real w = real_div(flat, real_add(x->per_a, y->per_a));
        s = real_min(s, real_sqrt(real_max(w, real_half(x->corner))));
    }
    return s;
}

/* From above, a speed over `low` at which the displacement has grown by
 * `rest`; near the root when no limit of a binds (OTG.md, "First guess"). */
static struct real guess_s(const struct otg_border *b, struct real rest)
{
    struct real low = b->low, s = real_zero();
    struct real c = real_half(real_div(rest, b->first.per_root_j));
    if (rest.m > 0)
        s = real_cbrt_above(c);
    if (low.m < 0)
        return real_add(s, real_sqrt(real_twice(real_neg(low))));
    if (low.m > 0 && rest.m > 0)
        s = real_min(s, real_half(real_div(c, low)));
    return s;
}

static struct otg_border_point border_top(const struct otg_border *b,
                                          struct real *vc, struct real *s)
{
    *s = real_sqrt(real_sub(b->q->vx, b->low));
    *vc = real_max(b->q->vx, b->low);
    return motion_otg_border_a(b, *s);
}

/* Where on the upper border the wanted displacement or duration is. */
struct place {
    bool is_b;
    struct real x; /* regime B: a1; regime A: the cruise speed */
    struct real cruise;
    struct real t, d;
};

static struct real rest_of(enum otg_goal goal, const struct otg_border_point *p,
                           struct real want)
{
    return real_sub(want, goal == OTG_GOAL_T ? p->t : p->d);
}

static struct place place_a(const struct otg_border *b, enum otg_goal goal,
                            struct real want)
{
    struct place at = { .cruise = real_zero() };
    struct real s, s_top;
    struct otg_border_point p = border_top(b, &at.x, &s_top);
    struct real rest = rest_of(goal, &p, want);
    if (rest.m >= 0) {
        at.cruise = goal == OTG_GOAL_T ? rest : real_div(rest, at.x);
        at.t = real_add(p.t, at.cruise);
        at.d = real_add(p.d, real_mul(at.cruise, at.x));
        return at;
    }
    if (goal == OTG_GOAL_T) {
        s = guess_s_time(b, want);
        if (!real_lt(s, s_top))
            s = real_half(s_top);
    } else {
        p = motion_otg_border_a(b, real_zero());
        s = guess_s(b, rest_of(goal, &p, want));
        if (!real_lt(s, s_top))
            s = s_top;
    }
    s = motion_otg_border_root(b, goal, want, real_zero(), s_top, s);
    p = motion_otg_border_a(b, s);
    at.x = real_add(b->low, real_sqr(s));
    at.t = p.t;
    at.d = p.d;
    return at;
}

static struct place place_b(const struct otg_border *b, enum otg_goal goal,
                            struct real want, struct real lo, struct real hi)
{
    struct place at = { .is_b = true, .cruise = real_zero() };
    at.x = motion_otg_border_root(b, goal, want, lo, hi,
                                  real_half(real_add(lo, hi)));
    struct otg_border_point p = motion_otg_border_b(b, at.x);
    at.t = p.t;
    at.d = p.d;
    return at;
}

/* `q` has its higher natural speed first. */
static struct place place_upper(struct otg_border *b,
                                const struct otg_problem *q, enum otg_goal goal,
                                struct real want)
{
    if (q->a0.m < 0) {
        motion_otg_border_init_b(b, q);
        struct otg_border_point p = motion_otg_border_b(b, real_zero());
        if (motion_otg_is_right_of(&p, goal, want))
            return place_b(b, goal, want, q->a0, real_zero());
    }
    motion_otg_border_init_a(b, q);
    return place_a(b, goal, want);
}

static void place_shape(const struct otg_border *b, const struct place *at,
                        struct otg_shape *shape)
{
    if (at->is_b)
        motion_otg_border_shape_b(b, at->x, shape);
    else
        motion_otg_border_shape_a(b, at->x, at->cruise, shape);
}

/* Append the motion of the upper (or, with `lower`, the lower) border with the
 * wanted displacement or duration. */
static struct otg_reach border_append(const struct otg_problem *problem,
                                      bool lower, enum otg_goal goal,
                                      struct real want, struct otg_shape *shape)
{
    struct otg_problem q = lower ? solve_negate(problem) : *problem;
    struct otg_border b;
    int from = shape->count;
    bool reversed = is_reversed(&q);
    if (reversed)
        q = motion_otg_reversed(&q);
    if (lower && goal != OTG_GOAL_T)
        want = real_neg(want);
    struct place at = place_upper(&b, &q, goal, want);
    place_shape(&b, &at, shape);
    if (reversed)
        motion_otg_shape_reverse(shape, from, q.a0);
    if (lower)
        shape_negate(shape, from);
    return (struct otg_reach){ at.t, lower ? real_neg(at.d) : at.d };
}

/* --- where the borders start --------------------------------------------- */

/* Speed change up with jerk + then -; needs dv at or above the direct ramp. */
static void ramp_up(const struct otg_problem *q, struct otg_shape *shape)
{
    struct real dv = real_mul(q->j, real_sub(q->vf, q->v0));
    struct real m = real_half(real_add(real_sqr(q->a0), real_sqr(q->af)));
    struct real square = real_add(dv, m), limit = real_sqr(q->ax);
    struct real a1 = q->ax, hold = real_zero();
    if (real_lt(limit, square))
        hold = real_mul(real_div(real_sub(square, limit), q->ax), q->per_j);
    else
        a1 = real_sqrt(square);
    otg_shape_add(shape, otg_time_between(a1, q->a0, q->per_j), a1);
    otg_shape_add(shape, hold, a1);
    otg_shape_add(shape, otg_time_between(q->af, a1, q->per_j), q->af);
}

/* Speed change, in j v, of going straight from a0 to af. */
static struct real ramp_direct(const struct otg_problem *q)
{
    struct real d = real_half(real_sub(real_sqr(q->af), real_sqr(q->a0)));
    return real_lt(q->af, q->a0) ? real_neg(d) : d;
}

void motion_otg_solve_velocity(const struct otg_problem *problem,
                               struct otg_shape *shape)
{
    struct real dv = real_mul(problem->j, real_sub(problem->vf, problem->v0));
    int from = shape->count;
    if (!real_lt(dv, ramp_direct(problem))) {
        ramp_up(problem, shape);
        return;
    }
    struct otg_problem q = solve_negate(problem);
    ramp_up(&q, shape);
    shape_negate(shape, from);
}

/* The speed change by jerk - then +: where both borders of the main region
 * start, when the first end's natural speed is the higher. */
static void ramp_down(const struct otg_problem *problem,
                      struct otg_shape *shape)
{
    int from = shape->count;
    struct otg_problem q = solve_negate(problem);
    ramp_up(&q, shape);
    shape_negate(shape, from);
}

/* The region of motions whose acceleration never changes sign is closed: a
 * lens between two speed changes, + - and - +.  In `q` as oriented (higher
 * natural speed first) it exists for a0, af > 0 only. */
struct lens {
    bool exists;
    struct real valley; /* lowest acceleration at its late end */
};

static struct lens lens_of(const struct otg_problem *q)
{
    struct lens lens = { .exists = false };
    if (q->a0.m <= 0 || q->af.m <= 0)
        return lens;
    struct real dv = real_mul(q->j, real_sub(q->vf, q->v0));
    struct real m = real_half(real_add(real_sqr(q->a0), real_sqr(q->af)));
    if (real_lt(dv, real_abs(ramp_direct(q))) || !real_lt(dv, m))
        return lens;
    return (struct lens){ true, real_sqrt(real_sub(m, dv)) };
}

/* Append the lens's border motion: as border_append, inside the lens.  The
 * lower border by turning upside down, the upper by going backwards: both give
 * regime B with a1 rising to -valley. */
static struct otg_reach lens_append(const struct otg_problem *q,
                                    const struct lens *lens, bool lower,
                                    enum otg_goal goal, struct real want,
                                    struct otg_shape *shape)
{
    struct otg_problem r = lower ? solve_negate(q) : motion_otg_reversed(q);
    struct otg_border b;
    int from = shape->count;
    motion_otg_border_init_b(&b, &r);
    if (lower && goal != OTG_GOAL_T)
        want = real_neg(want);
    struct place at = place_b(&b, goal, want, r.a0, real_neg(lens->valley));
    motion_otg_border_shape_b(&b, at.x, shape);
    if (lower)
        shape_negate(shape, from);
    else
        motion_otg_shape_reverse(shape, from, r.a0);
    return (struct otg_reach){ at.t, lower ? real_neg(at.d) : at.d };
}

/* --- solutions ----------------------------------------------------------- */

/* Equal within what the search leaves, relative to the way and v t. */
static bool is_reached(const struct otg_problem *q, struct otg_reach reach,
                       struct real want)
{
    struct real way = real_max(real_abs(q->v0), real_abs(q->vf));
    way = real_add(real_abs(want), real_mul(way, reach.t));
    struct real miss = real_abs(real_sub(reach.d, want));
    return miss.m == 0 || (way.m != 0 && miss.e < way.e - 36);
}

/* Whether d is reached along the lens's border.  It is concave in the wanted
 * direction: it must rise at its start, and when it ends short of d, fall at
 * its end, or its highest value is at the end. */
static bool lens_may_reach(const struct otg_problem *q, const struct lens *lens,
                           bool lower)
{
    struct otg_problem r = lower ? solve_negate(q) : motion_otg_reversed(q);
    struct otg_border b;
    motion_otg_border_init_b(&b, &r);
    struct otg_border_point first = motion_otg_border_b(&b, r.a0);
    struct otg_border_point last =
        motion_otg_border_b(&b, real_neg(lens->valley));
    if (!first.rising || (real_lt(last.d, r.d) && last.rising))
        return false;
    /* no higher than its tangents: D + H (T' - T), from either end */
    struct real span = real_sub(last.t, first.t);
    struct real up = real_mul(first.rate, span);
    if (real_lt(real_add(first.d, up), r.d))
        return false;
    struct real down = real_mul(last.rate, span);
    return last.rising || !real_lt(real_sub(last.d, down), r.d);
}

static bool solve_lens(const struct otg_problem *q, struct otg_shape *shape)
{
    struct lens lens = lens_of(q);
    int from = shape->count;
    if (!lens.exists)
        return false;
    struct otg_shape start;
    struct real v = q->v0;
    otg_shape_init(&start);
    ramp_up(q, &start);
    struct otg_reach reach = motion_otg_shape_reach(&start, &v, q->a0);
    bool lower = real_lt(q->d, reach.d);
    if (!lens_may_reach(q, &lens, lower))
        return false;
    reach = lens_append(q, &lens, lower, OTG_GOAL_LENS, q->d, shape);
    if (is_reached(q, reach, q->d))
        return true;
    shape->count = from;
    return false;
}

static struct otg_reach region_start(const struct otg_problem *q)
{
    struct otg_shape start;
    otg_shape_init(&start);
    struct real v = q->v0;
    ramp_down(q, &start);
    return motion_otg_shape_reach(&start, &v, q->a0);
}

static void solve_main(const struct otg_problem *q, struct otg_shape *shape)
{
    struct otg_reach start = region_start(q);
    if (real_cmp(q->d, start.d) == 0)
        ramp_down(q, shape);
    else
        border_append(q, real_lt(q->d, start.d), OTG_GOAL_D, q->d, shape);
}

static void solve_oriented(const struct otg_problem *q, struct otg_shape *shape)
{
    if (!solve_lens(q, shape))
        solve_main(q, shape);
}

static void solve_one_jerk(const struct otg_problem *problem,
                           struct otg_shape *shape)
{
    int from = shape->count;
    if (!is_reversed(problem)) {
        solve_oriented(problem, shape);
        return;
    }
    struct otg_problem q = motion_otg_reversed(problem);
    solve_oriented(&q, shape);
    motion_otg_shape_reverse(shape, from, q.a0);
}

/* The lower jerk on both sides: what any motion may use anywhere. */
static void lower_jerk(struct otg_problem *q)
{
    q->j = q->j2 = real_min(q->j, q->j2);
    q->per_j = q->per_j2 = real_max(q->per_j, q->per_j2);
}

/* Both jerks as they are: the cruise between them separates the two halves, so
 * regime A alone; upper or lower border. */
static bool solve_two_jerks(const struct otg_problem *problem, bool lower,
                            struct otg_shape *shape, struct real *t)
{
    struct otg_problem q = lower ? solve_negate(problem) : *problem;
    struct otg_border b;
    motion_otg_border_init_a(&b, &q);
    struct otg_border_point p = motion_otg_border_a(&b, real_zero());
    if (real_lt(q.d, p.d))
        return false;
    struct place at = place_a(&b, OTG_GOAL_D, q.d);
    *t = at.t;
    shape->turn = shape->count + 4;
    place_shape(&b, &at, shape);
    if (lower)
        shape_negate(shape, shape->turn - 4);
    return true;
}

static struct real shape_time(const struct otg_shape *shape, int from)
{
    struct real t = real_zero();
    for (int i = from; i < shape->count; i++)
        t = real_add(t, shape->phase[i].dt);
    return t;
}

void motion_otg_solve(const struct otg_problem *problem,
                      struct otg_shape *shape)
{
    struct otg_problem q = *problem;
    int from = shape->count;
    lower_jerk(&q);
    solve_one_jerk(&q, shape);
    if (real_cmp(problem->j, problem->j2) == 0)
        return;
    struct real best = shape_time(shape, from), t;
    for (int lower = 0; lower < 2; lower++) {
        struct otg_shape other;
        otg_shape_init(&other);
        if (!solve_two_jerks(problem, lower, &other, &t) || !real_lt(t, best))
            continue;
        best = t;
        shape->count = from;
        shape->brake = shape->turn = from + other.turn;
        for (int i = 0; i < other.count; i++)
            otg_shape_add(shape, other.phase[i].dt, other.phase[i].a);
    }
}

/* --- a given duration ---------------------------------------------------- */

/* One polyline being walked along. */
struct walk {
    const struct otg_shape *shape;
    int i;
    struct real a, left; /* here; time to the next corner */
};

static void walk_next(struct walk *w)
{
    while (w->i < w->shape->count && w->left.m <= 0) {
        w->a = w->shape->phase[w->i].a;
        w->i++;
        if (w->i < w->shape->count)
            w->left = w->shape->phase[w->i].dt;
    }
}

static void walk_by(struct walk *w, struct real dt)
{
    struct real rise = real_sub(w->shape->phase[w->i].a, w->a);
    struct real part = real_div(dt, w->left);
    w->a = real_add(w->a, real_mul(rise, part));
    w->left = real_sub(w->left, dt);
    walk_next(w);
}

static struct walk walk_start(const struct otg_shape *shape, struct real a0)
{
    struct walk w = { shape, 0, a0, shape->phase[0].dt };
    walk_next(&w);
    return w;
}

/* Append lambda x + (1 - lambda) y: limits are convex, so what both keep the
 * mixture keeps, and its displacement is the same mixture of theirs. */
static void blend(const struct otg_shape *x, const struct otg_shape *y,
                  struct real a0, struct real lambda, struct otg_shape *shape)
{
    struct walk wx = walk_start(x, a0), wy = walk_start(y, a0);
    while (wx.i < x->count && wy.i < y->count) {
        struct real dt = real_min(wx.left, wy.left);
        walk_by(&wx, dt);
        walk_by(&wy, dt);
        struct real a = real_mul(lambda, real_sub(wx.a, wy.a));
        otg_shape_add(shape, dt, real_add(wy.a, a));
    }
}

/* What each border reaches in time t, and where d is between them: 0 .. 1, or
 * outside when d cannot be reached in t. */
struct slice {
    struct otg_shape upper, lower;
    struct real lambda;
};

static int slice_place(struct slice *s, const struct otg_problem *q,
                       struct otg_reach upper, struct otg_reach lower)
{
    struct real one = real_int(1);
    struct real width = real_sub(upper.d, lower.d);
    s->lambda = one;
    if (is_reached(q, upper, q->d))
        return 0;
    if (real_lt(upper.d, q->d))
        return 1;
    s->lambda = real_zero();
    if (is_reached(q, lower, q->d))
        return 0;
    if (real_lt(q->d, lower.d))
        return -1;
    s->lambda = real_div(real_sub(q->d, lower.d), width);
    return 0;
}

static bool duration_in_lens(const struct otg_problem *q, struct real t,
                             struct slice *s)
{
    struct lens lens = lens_of(q);
    struct otg_shape ramp;
    otg_shape_init(&ramp);
    if (!lens.exists)
        return false;
    ramp_up(q, &ramp);
    struct real late =
        real_sub(real_add(q->a0, q->af), real_twice(lens.valley));
    if (real_lt(t, shape_time(&ramp, 0)) ||
        real_lt(real_mul(late, q->per_j), t))
        return false;
    struct otg_reach upper =
        lens_append(q, &lens, false, OTG_GOAL_T, t, &s->upper);
    struct otg_reach lower =
        lens_append(q, &lens, true, OTG_GOAL_T, t, &s->lower);
    if (slice_place(s, q, upper, lower) == 0)
        return true;
    s->upper.count = s->lower.count = 0;
    return false;
}

static int duration_in_main(const struct otg_problem *q, struct real t,
                            struct slice *s, struct real *next)
{
    struct otg_shape late;
    otg_shape_init(&late);
    if (real_lt(t, region_start(q).t)) {
        solve_main(q, &late);
        *next = shape_time(&late, 0);
        return MOTION_E_LIMIT;
    }
    struct otg_reach upper = border_append(q, false, OTG_GOAL_T, t, &s->upper);
    struct otg_reach lower = border_append(q, true, OTG_GOAL_T, t, &s->lower);
    int side = slice_place(s, q, upper, lower);
    if (side == 0)
        return MOTION_OK;
    *next = border_append(q, side < 0, OTG_GOAL_D, q->d, &late).t;
    return MOTION_E_LIMIT;
}

int motion_otg_solve_duration(const struct otg_problem *problem, struct real t,
                              struct otg_shape *shape, struct real *next)
{
    struct otg_problem q = *problem;
    struct slice s;
    otg_shape_init(&s.upper);
    otg_shape_init(&s.lower);
    int from = shape->count;
    lower_jerk(&q);
    bool reversed = is_reversed(&q);
    if (reversed)
        q = motion_otg_reversed(&q);
    if (!duration_in_lens(&q, t, &s)) {
        int err = duration_in_main(&q, t, &s, next);
        if (err < 0)
            return err;
    }
    blend(&s.upper, &s.lower, q.a0, s.lambda, shape);
    if (reversed)
        motion_otg_shape_reverse(shape, from, q.a0);
    return MOTION_OK;
}
