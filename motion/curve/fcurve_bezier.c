/* motion/curve/fcurve_bezier.c - the value of a bezier span at a time.  See
 * fcurve_internal.h. */
#include "motion/curve/fcurve_internal.h"

#define BEZIER_NEWTON_MAX 200
#define BEZIER_NEAR_STEPS 6
#define BEZIER_NEAR_SLOPE ((int64_t)1 << 22) /* Q28; below, halving is safer */

/* The middle control points, the span being 1 wide: from its start (x1, y1),
 * back from its end (x2, y2). */
struct bezier_handles {
    struct motion_real x1, x2, y1, y2, change;
};

/* A handle longer in time than the span is shortened to it. */
static void bezier_shorten(struct motion_real *x, struct motion_real *y)
{
    if (motion_real_cmp(*x, fcurve_whole(1)) <= 0)
        return;
    *y = motion_real_div(*y, *x);
    *x = fcurve_whole(1);
}

static struct bezier_handles bezier_handles(const struct motion_fcurve_key *a,
                                            const struct motion_fcurve_key *b)
{
    const struct fcurve_offset from = fcurve_get(&a->right, &a->at);
    const struct fcurve_offset to = fcurve_get(&b->left, &b->at);
    const struct fcurve_offset chord = fcurve_get(&b->at, &a->at);
    struct bezier_handles z = { motion_real_div(motion_real_abs(from.t),
                                                chord.t),
                                motion_real_div(motion_real_abs(to.t), chord.t),
                                from.pos, motion_real_neg(to.pos), chord.pos };

    bezier_shorten(&z.x1, &z.y1);
    bezier_shorten(&z.x2, &z.y2);
    return z;
}

/* The cubic 0, p1, end - p2, end:
 * 3 p1 u + 3 (end - p2 - 2 p1) u^2 + (3 p1 + 3 p2 - 2 end) u^3 */
static struct fcurve_cubic bezier_powers(struct motion_real p1,
                                         struct motion_real p2,
                                         struct motion_real end)
{
    return (struct fcurve_cubic){
        curve_times(p1, 3),
        curve_times(
            motion_real_sub(motion_real_sub(end, p2), motion_real_twice(p1)),
            3),
        motion_real_sub(curve_times(motion_real_add(p1, p2), 3),
                        motion_real_twice(end)),
    };
}

struct fcurve_bezier fcurve_bezier(const struct motion_fcurve_key *a,
                                   const struct motion_fcurve_key *b, bool back)
{
    const struct motion_real one = fcurve_whole(1);
    const struct bezier_handles z = bezier_handles(a, b);

    if (back)
        return (struct fcurve_bezier){ bezier_powers(z.x2, z.x1, one),
                                       bezier_powers(z.y2, z.y1, z.change) };
    return (struct fcurve_bezier){ bezier_powers(z.x1, z.x2, one),
                                   bezier_powers(z.y1, z.y2, z.change) };
}

struct motion_real fcurve_cubic_at(const struct fcurve_cubic *c,
                                   struct motion_real u)
{
    const struct motion_real low =
        motion_real_add(c->c2, motion_real_mul(c->c3, u));

    return motion_real_mul(motion_real_add(motion_real_mul(low, u), c->c1), u);
}

/* Its value at u and its derivatives by u. */
static struct fcurve_jet bezier_cubic(const struct fcurve_cubic *c,
                                      struct motion_real u)
{
    const struct motion_real twice = motion_real_twice(c->c2);
    const struct motion_real c3u = motion_real_mul(c->c3, u);
    const struct motion_real thrice =
        motion_real_add(c3u, motion_real_twice(c3u));
    struct fcurve_jet jet = { 0 };

    jet.f = motion_real_mul(motion_real_add(c->c2, c3u), u);
    jet.f = motion_real_mul(motion_real_add(jet.f, c->c1), u);
    jet.d = motion_real_add(twice, thrice);
    jet.d = motion_real_add(motion_real_mul(jet.d, u), c->c1);
    jet.dd = motion_real_add(twice, motion_real_twice(thrice));
    return jet;
}

struct motion_real fcurve_bezier_near(const struct fcurve_cubic *x_of,
                                      struct motion_real x)
{
    const int64_t whole = (int64_t)1 << 30;
    int64_t c1, c2, c3, at, u;

    if (motion_real_round(x_of->c1, 28, &c1) < 0 ||
        motion_real_round(x_of->c2, 28, &c2) < 0 ||
        motion_real_round(x_of->c3, 28, &c3) < 0 ||
        motion_real_round(x, 28, &at) < 0)
        return x;
    u = at * 4;
    for (int i = 0; i < BEZIER_NEAR_STEPS; i++) {
        const int64_t f =
            ((((((c3 * u) >> 30) + c2) * u) >> 30) + c1) * u / whole - at;
        const int64_t d = (((3 * ((c3 * u) >> 30) + 2 * c2) * u) >> 30) + c1;
        if (d < BEZIER_NEAR_SLOPE)
            return x;
        u -= f * whole / d;
        u = u < 0 ? 0 : u > whole ? whole : u;
    }
    return motion_real_from_q(u, 30);
}

/* Whether Newton's step reaches u to 2^-58 of it: what is left afterwards is
 * step^2 x'' / 2 x' at most, x'' that of either end of the step.  By exponents:
 * a number is below 2^(e + 62), and not below 2^(e + 61). */
static bool bezier_is_found(const struct fcurve_cubic *x_of,
                            const struct fcurve_jet *at, struct motion_real u,
                            struct motion_real step)
{
    const struct motion_real more =
        motion_real_scale(motion_real_mul(motion_real_abs(x_of->c3), step), 3);
    const struct motion_real bend =
        motion_real_add(motion_real_abs(at->dd), more);
    const int32_t left = 2 * (step.e + 62) + (bend.e + 62) - (at->d.e + 61) - 1;

    return left <= u.e + 61 - 58;
}

/* Newton's method kept between two bounds, which are halved where it would
 * leave them or does not halve its step.  x(u) rises, as 0 <= x1, x2 <= 1, but
 * may be level at one place. */
struct motion_real fcurve_bezier_invert(const struct fcurve_cubic *x_of,
                                        struct motion_real x,
                                        struct motion_real u)
{
    struct motion_real low = motion_real_zero(), high = fcurve_whole(1);
    struct motion_real step = high;

    for (int i = 0; i < BEZIER_NEWTON_MAX; i++) {
        const struct fcurve_jet at = bezier_cubic(x_of, u);
        const struct motion_real over = motion_real_sub(at.f, x);
        struct motion_real next;

        if (over.m == 0)
            return u;
        if (over.m < 0)
            low = u;
        else
            high = u;
        next = u;
        if (at.d.m > 0)
            next = motion_real_sub(u, motion_real_div(over, at.d));
        const bool halve =
            at.d.m <= 0 || motion_real_lt(next, low) ||
            motion_real_lt(high, next) ||
            motion_real_cmp(motion_real_abs(motion_real_sub(next, u)),
                            motion_real_half(step)) > 0;
        if (halve)
            next = motion_real_half(motion_real_add(low, high));
        step = motion_real_abs(motion_real_sub(next, u));
        if (step.m == 0 || step.e < u.e - 58 ||
            (!halve && bezier_is_found(x_of, &at, u, step)))
            return next;
        u = next;
    }
    return u;
}

/* Where x(u) stands still.  With u small, x = a2 u^2 + .., y = b2 u^2 + ..: the
 * slope is finite where y stands still too, the second derivative where y is
 * a multiple of x. */
static struct fcurve_jet bezier_standing(const struct fcurve_jet *x,
                                         const struct fcurve_jet *y,
                                         struct motion_real jerk_x,
                                         struct motion_real jerk_y)
{
    struct fcurve_jet jet = { .f = y->f, .steep = true };
    struct motion_real cross;

    jet.dd = motion_real_zero();
    jet.d = motion_real_scale(fcurve_whole(motion_real_sign(y->d)), 200);
    if (!motion_real_is_zero(y->d))
        return jet;
    if (motion_real_is_zero(x->dd)) { /* x = u^3 */
        jet.d = motion_real_scale(fcurve_whole(motion_real_sign(y->dd)), 200);
        if (motion_real_is_zero(y->dd)) {
            jet.d = motion_real_div(jerk_y, jerk_x);
            jet.steep = false;
        }
        return jet;
    }
    jet.d = motion_real_div(y->dd, x->dd);
    cross = motion_real_sub(jerk_y, motion_real_mul(jet.d, jerk_x));
    jet.steep = !motion_real_is_zero(cross) && cross.e > jerk_y.e - 50;
    return jet;
}

/* dy/dx = y'/x', d2y/dx2 = (y'' - dy/dx x'') / x'^2 */
struct fcurve_jet fcurve_bezier_jet(const struct fcurve_bezier *z,
                                    struct motion_real u)
{
    const struct fcurve_jet x = bezier_cubic(&z->x, u),
                            y = bezier_cubic(&z->y, u);
    struct fcurve_jet jet = { .f = y.f };

    if (x.d.m <= 0 || x.d.e < -61 - 50)
        return bezier_standing(&x, &y, curve_times(z->x.c3, 6),
                               curve_times(z->y.c3, 6));
    jet.d = motion_real_div(y.d, x.d);
    jet.dd = motion_real_sub(y.dd, motion_real_mul(jet.d, x.dd));
    jet.dd = motion_real_div(jet.dd, motion_real_sqr(x.d));
    return jet;
}

/* The nearer end is where u = 0, so that what stands still there is exact. */
struct fcurve_jet fcurve_bezier_at(const struct motion_fcurve_key *a,
                                   const struct motion_fcurve_key *b,
                                   const struct fcurve_when *when)
{
    const bool back = when->at > when->dur - when->at;
    const int64_t near = back ? when->dur - when->at : when->at;
    const struct motion_real x =
        motion_real_div(fcurve_whole(near), fcurve_whole(when->dur));
    const struct fcurve_bezier z = fcurve_bezier(a, b, back);
    struct fcurve_jet jet = fcurve_bezier_jet(
        &z, fcurve_bezier_invert(&z.x, x, fcurve_bezier_near(&z.x, x)));

    if (back) {
        jet.f = motion_real_sub(
            fcurve_difference(b->at.pos_q32, a->at.pos_q32, 32), jet.f);
        jet.dd = motion_real_neg(jet.dd);
    }
    return jet;
}
