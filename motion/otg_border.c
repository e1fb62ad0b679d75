/* motion/otg_border.c - see otg_border.h; the names and equations are those of
 * docs/OTG.md.
 *
 *     a |  a1 __                    regime A: the middle '-' passes a = 0, the
 *       |    /  \        vc         speed there is vc; grows until vc = vx,
 *       |___/____\__________ t      then the speed is held
 *       |         \    /            regime B: a1 < 0, the middle '-' does not
 *       |       a2 \__/             pass a = 0 */
#include "motion/otg_border.h"

int motion_otg_solve_most;

/* K of regime B: a2^2 = a1^2 + K. */
static struct real solve_k(const struct otg_problem *q)
{
    struct real k = real_half(real_sub(real_sqr(q->af), real_sqr(q->a0)));
    return real_sub(k, real_mul(q->j, real_sub(q->vf, q->v0)));
}

/* --- regime A ------------------------------------------------------------ */

static struct otg_half half_make(struct real v, struct real a0, struct real a,
                                 struct real j, struct real per_j)
{
    static const struct real third = { INT64_C(0x2aaaaaaaaaaaaaaa), -63 };
    struct otg_half h = { .a = a, .j = j };
    h.per_root_j = real_rsqrt(j);
    h.per_a = real_inv(a);
    h.ramp = real_mul(a, per_j);
    h.corner = real_mul(a, h.ramp);
    h.lead_t = real_mul(a0, per_j);
    struct real e = real_half(real_mul(a0, h.lead_t)); /* a0^2 / 2j */
    h.base = real_sub(v, e);
    /* base t + j t^3 / 6, with j t^2 = 2 e */
    h.lead_d = real_mul(h.lead_t, real_add(h.base, real_mul(e, third)));
    return h;
}

/* Time tau from base to vc and its slope; vc above base. */
static struct real half_tau(const struct otg_half *h, struct real w,
                            struct real *slope)
{
    if (real_lt(h->corner, w)) {
        *slope = h->per_a;
        return real_add(real_mul(w, h->per_a), h->ramp);
    }
    if (w.m <= 0)
        w = (struct real){ (int64_t)1 << 61, -600 };
    *slope = real_mul(real_rsqrt(w), h->per_root_j);
    return real_twice(real_mul(w, *slope));
}

static void half_add(const struct otg_half *h, struct real vc,
                     struct otg_border_point *p)
{
    struct real slope;
    struct real tau = half_tau(h, real_sub(vc, h->base), &slope);
    struct real mean = real_half(real_add(h->base, vc));
    p->t = real_add(p->t, real_sub(tau, h->lead_t));
    p->d = real_add(p->d, real_sub(real_mul(mean, tau), h->lead_d));
    p->dt = real_add(p->dt, slope);
    p->dd = real_add(p->dd, real_add(real_half(tau), real_mul(mean, slope)));
}

void motion_otg_border_init_a(struct otg_border *b, const struct otg_problem *q)
{
    b->q = q;
    b->is_a = true;
    b->first = half_make(q->v0, q->a0, q->ax, q->j, q->per_j);
    b->second =
        half_make(q->vf, real_neg(q->af), real_neg(q->an), q->j2, q->per_j2);
    /* the natural speeds: base + a|a|/j on the rising side */
    struct real low = b->first.base, low2 = b->second.base;
    if (q->a0.m > 0)
        low = real_add(low, real_mul(q->a0, b->first.lead_t));
    if (q->af.m < 0)
        low2 = real_sub(low2, real_mul(q->af, b->second.lead_t));
    b->low = real_max(low, low2);
}

struct otg_border_point motion_otg_border_a(const struct otg_border *b,
                                            struct real s)
{
    struct otg_border_point p = { real_zero(), real_zero(), real_zero(),
                                  real_zero(), real_zero(), false };
    struct real vc = real_add(b->low, real_sqr(s));
    half_add(&b->first, vc, &p);
    half_add(&b->second, vc, &p);
    p.dt = real_mul(real_twice(p.dt), s);
    p.dd = real_mul(real_twice(p.dd), s);
    p.rising = p.dd.m > 0;
    return p;
}

/* --- regime B ------------------------------------------------------------ */

void motion_otg_border_init_b(struct otg_border *b, const struct otg_problem *q)
{
    b->q = q;
    b->is_a = false;
    b->k = solve_k(q);
    b->hold_per = real_inv(real_mul(q->j, real_neg(q->an)));
}

/* a2 and the time it is held. */
static struct real border_valley(const struct otg_border *b, struct real a1,
                                 struct real *hold)
{
    struct real square = real_add(real_sqr(a1), b->k);
    struct real limit = real_sqr(b->q->an);
    *hold = real_zero();
    if (real_lt(limit, square)) {
        *hold = real_mul(real_sub(square, limit), b->hold_per);
        return b->q->an;
    }
    return real_neg(real_sqrt(square));
}

void motion_otg_border_shape_b(const struct otg_border *b, struct real a1,
                               struct otg_shape *shape)
{
    const struct otg_problem *q = b->q;
    struct real hold, a2 = border_valley(b, a1, &hold);
    otg_shape_add(shape, otg_time_between(a1, q->a0, q->per_j), a1);
    otg_shape_add(shape, otg_time_between(a2, a1, q->per_j), a2);
    otg_shape_add(shape, hold, a2);
    otg_shape_add(shape, otg_time_between(q->af, a2, q->per_j), q->af);
}

/* dD/dT along the border is the Hamiltonian v(c) + j w^2 / 2, c the middle and
 * w the half width of the '-' phase. */
static struct real border_slope_b(const struct otg_problem *q, struct real a1,
                                  struct real a2, struct real per_j)
{
    struct real mid = real_half(real_add(a1, a2));
    struct real rise = real_half(real_add(a1, mid)); /* mean up to c */
    struct real w = real_mul(real_half(real_sub(a1, a2)), per_j);
    struct real up = real_half(real_sub(real_sqr(a1), real_sqr(q->a0)));
    struct real v = real_add(q->v0, real_mul(up, per_j));
    struct real half_jw = real_scale(real_sub(a1, a2), -2);
    return real_add(v, real_mul(w, real_add(rise, half_jw)));
}

struct otg_border_point motion_otg_border_b(const struct otg_border *b,
                                            struct real a1)
{
    struct otg_shape shape;
    otg_shape_init(&shape);
    struct otg_border_point p;
    struct real v = b->q->v0, per_j = b->q->per_j;
    motion_otg_border_shape_b(b, a1, &shape);
    struct otg_reach reach = motion_otg_shape_reach(&shape, &v, b->q->a0);
    struct real a2 = shape.phase[1].a;
    p.t = reach.t;
    p.d = reach.d;
    /* dT/da1 = 2 (1 - a1/a2) / j, with and without hold */
    p.dt = real_zero();
    if (a2.m != 0)
        p.dt = real_div(real_sub(a2, a1), a2);
    p.dt = real_twice(real_mul(p.dt, per_j));
    struct real slope = border_slope_b(b->q, a1, a2, per_j);
    p.dd = real_mul(slope, p.dt);
    p.rate = slope;
    p.rising = slope.m > 0;
    return p;
}

static struct otg_border_point border_at(const struct otg_border *b,
                                         struct real x)
{
    return b->is_a ? motion_otg_border_a(b, x) : motion_otg_border_b(b, x);
}

static void half_shape(const struct otg_half *h, struct real vc,
                       struct real *peak, struct real *hold)
{
    struct real w = real_sub(vc, h->base);
    *hold = real_zero();
    *peak = h->a;
    if (real_lt(h->corner, w))
        *hold = real_mul(real_sub(w, h->corner), h->per_a);
    else
        *peak = real_sqrt(real_mul(h->j, w));
}

void motion_otg_border_shape_a(const struct otg_border *b, struct real vc,
                               struct real cruise, struct otg_shape *shape)
{
    const struct otg_problem *q = b->q;
    struct real a1, a2, hold1, hold2;
    half_shape(&b->first, vc, &a1, &hold1);
    half_shape(&b->second, vc, &a2, &hold2);
    a2 = real_neg(a2);
    otg_shape_add(shape, otg_time_between(a1, q->a0, q->per_j), a1);
    otg_shape_add(shape, hold1, a1);
    otg_shape_add(shape, otg_time_between(a1, real_zero(), q->per_j),
                  real_zero());
    otg_shape_add(shape, cruise, real_zero());
    otg_shape_add(shape, otg_time_between(a2, real_zero(), q->per_j2), a2);
    otg_shape_add(shape, hold2, a2);
    otg_shape_add(shape, otg_time_between(q->af, a2, q->per_j2), q->af);
}

/* --- one root ------------------------------------------------------------ */

bool motion_otg_is_right_of(const struct otg_border_point *p,
                            enum otg_goal goal, struct real want)
{
    if (goal == OTG_GOAL_T)
        return !real_lt(p->t, want);
    if (goal == OTG_GOAL_D)
        return p->rising && !real_lt(p->d, want);
    return !p->rising || !real_lt(p->d, want);
}

/* Newton's step from x, or false when it leaves (lo, hi). */
static bool newton(const struct otg_border_point *p, enum otg_goal goal,
                   struct real want, struct real lo, struct real hi,
                   struct real *x)
{
    struct real slope = goal == OTG_GOAL_T ? p->dt : p->dd;
    struct real rest = real_sub(want, goal == OTG_GOAL_T ? p->t : p->d);
    if (slope.m <= 0 || (goal != OTG_GOAL_T && !p->rising))
        return false;
    struct real to = real_add(*x, real_div(rest, slope));
    if (!real_lt(lo, to) || !real_lt(to, hi))
        return false;
    *x = to;
    return true;
}

/* |a - b| below 2^-bits of either. */
static bool is_close(struct real a, struct real b, int bits)
{
    struct real gap = real_abs(real_sub(a, b));
    return gap.m == 0 || gap.e + 62 < (a.e > b.e ? a.e : b.e) + 62 - bits;
}

/* Bracketed Newton.  The bracket halves at least every other step; a step
 * below 2^-26 squares to 2^-52. */
struct real motion_otg_border_root(const struct otg_border *b,
                                   enum otg_goal goal, struct real want,
                                   struct real lo, struct real hi,
                                   struct real x)
{
    int i;
    for (i = 0; i < 100; i++) {
        struct otg_border_point p = border_at(b, x);
        struct real old = x;
        bool right = motion_otg_is_right_of(&p, goal, want);
        *(right ? &hi : &lo) = x;
        if (is_close(lo, hi, 50))
            break;
        bool stepped = newton(&p, goal, want, lo, hi, &x);
        if (stepped && is_close(x, old, 24))
            break;
        if (!stepped || (i > 12 && (i & 1)))
            x = real_half(real_add(lo, hi));
    }
    if (i > motion_otg_solve_most)
        motion_otg_solve_most = i;
    return x;
}
