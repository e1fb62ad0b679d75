/* motion/otg_brake.c - from a start outside its limits to one inside.
 *
 * Getting inside comes first: full jerk until the acceleration is inside; when
 * the velocity is, or is bound to come, outside, full jerk towards the limit
 * of deceleration and hold it until the velocity is back - or must be let off
 * so as not to fall out on the other side.  Too fast downwards is the same
 * upside down. */
#include "motion/otg_internal.h"

/* The part of the problem that braking looks at, upside down where `up`.
 * `per_soft` is 1 / the jerk with which the motion goes on afterwards. */
struct brake {
    struct real v, a, vx, vn, ax, an, j, per_j, per_soft;
};

static struct brake brake_view(const struct otg_problem *q, bool up)
{
    struct real soft = real_max(q->per_j, q->per_j2);
    if (!up)
        return (struct brake){ q->v0, q->a0, q->vx,    q->vn, q->ax,
                               q->an, q->j,  q->per_j, soft };
    return (struct brake){ real_neg(q->v0),
                           real_neg(q->a0),
                           real_neg(q->vn),
                           real_neg(q->vx),
                           real_neg(q->an),
                           real_neg(q->ax),
                           q->j,
                           q->per_j,
                           soft };
}

/* Speed change of letting go of a afterwards. */
static struct real brake_ramp(const struct brake *b)
{
    return real_half(real_mul(real_sqr(b->a), b->per_soft));
}

/* Run one phase to acceleration `a` and put it into the answer. */
static void brake_run(struct otg_problem *q, struct otg_shape *shape,
                      struct real dt, struct real a)
{
    struct otg_shape one;
    otg_shape_init(&one);
    if (dt.m <= 0)
        return;
    otg_shape_add(&one, dt, a);
    q->d = real_sub(q->d, motion_otg_shape_reach(&one, &q->v0, q->a0).d);
    q->a0 = a;
    otg_shape_add(shape, dt, a);
}

static struct real brake_sign(struct real a, bool up)
{
    return up ? real_neg(a) : a;
}

static void brake_jerk(struct otg_problem *q, struct otg_shape *shape,
                       const struct brake *b, struct real dt, bool up)
{
    struct real a = real_sub(b->a, real_mul(dt, b->j));
    brake_run(q, shape, dt, brake_sign(a, up));
}

/* Time of full jerk down until the velocity is at vx, or, if that comes first,
 * until ramping back to a = 0 ends at vn: there a = -x with
 *   v + (a0^2 - x^2)/2j - x^2/2 soft = vn. */
static struct real brake_time(const struct brake *b)
{
    struct real per_j = b->per_j;
    struct real rise = real_mul(real_half(real_sqr(b->a)), per_j);
    struct real over = real_add(rise, real_sub(b->v, b->vx));
    struct real above = real_add(rise, real_sub(b->v, b->vn));
    struct real both = real_add(per_j, b->per_soft);
    struct real to_vx = real_sqrt(real_twice(real_mul(over, b->j)));
    struct real to_vn = real_sqrt(real_twice(real_div(above, both)));
    return real_mul(real_add(b->a, real_min(to_vx, to_vn)), per_j);
}

static void brake_velocity(struct otg_problem *q, struct otg_shape *shape,
                           bool up)
{
    struct brake b = brake_view(q, up);
    struct real to_an = real_mul(real_sub(b.a, b.an), b.per_j);
    struct real dt = brake_time(&b);
    if (!real_lt(to_an, dt)) {
        brake_jerk(q, shape, &b, dt, up);
        return;
    }
    brake_run(q, shape, to_an, brake_sign(b.an, up));
    b = brake_view(q, up);
    struct real room = real_sub(real_sub(b.v, b.vn), brake_ramp(&b));
    struct real over = real_min(real_sub(b.v, b.vx), room);
    brake_run(q, shape, real_div(over, real_neg(b.an)), brake_sign(b.an, up));
}

static void brake_acceleration(struct otg_problem *q, struct otg_shape *shape,
                               bool up)
{
    struct brake b = brake_view(q, up);
    if (real_lt(b.vx, real_add(b.v, brake_ramp(&b)))) {
        brake_velocity(q, shape, up);
        return;
    }
    brake_run(q, shape, real_mul(real_sub(b.a, b.ax), b.per_j),
              brake_sign(b.ax, up));
    /* still too slow: hold the acceleration until inside, or until letting go
     * of it ends at vx */
    b = brake_view(q, up);
    struct real below = real_sub(b.vn, b.v);
    struct real room = real_sub(real_sub(b.vx, b.v), brake_ramp(&b));
    brake_run(q, shape, real_div(real_min(below, room), b.ax),
              brake_sign(b.ax, up));
}

static bool brake_is_too_fast(const struct brake *b)
{
    struct real ramp = brake_ramp(b);
    if (real_lt(b->vx, b->v) && real_lt(b->vn, real_sub(b->v, ramp)))
        return true;
    return b->a.m > 0 && real_lt(b->vx, real_add(b->v, ramp));
}

void motion_otg_brake_acc(struct otg_problem *q, struct otg_shape *shape)
{
    for (int up = 0; up < 2; up++) {
        struct brake b = brake_view(q, up);
        if (real_lt(b.ax, b.a))
            brake_run(q, shape, real_mul(real_sub(b.a, b.ax), b.per_j),
                      brake_sign(b.ax, up));
    }
}

void motion_otg_brake(struct otg_problem *q, struct otg_shape *shape)
{
    struct brake down = brake_view(q, false), up = brake_view(q, true);
    if (real_lt(down.ax, down.a))
        brake_acceleration(q, shape, false);
    else if (real_lt(up.ax, up.a))
        brake_acceleration(q, shape, true);
    else if (brake_is_too_fast(&down))
        brake_velocity(q, shape, false);
    else if (brake_is_too_fast(&up))
        brake_velocity(q, shape, true);
}
