/* motion/otg/brake.c - from a start outside its limits to one inside.
 *
 * Getting inside comes first: full jerk until the acceleration is inside; when
 * the velocity is, or is bound to come, outside, full jerk towards the limit
 * of deceleration and hold it until letting go of it ends at the limit: later,
 * the velocity would fall below it by all that letting go takes off.  Too fast
 * downwards is the same upside down. */
#include "motion/otg/internal.h"

#define BRAKE_TIE_BITS   20
#define BRAKE_FLOOR_BITS 10

/* The part of the problem that braking looks at, upside down where `up`.
 * `per_soft` is 1 / the jerk with which the motion goes on afterwards. */
struct brake {
    struct num v, a, vx, vn, ax, an, per_j, per_soft;
};

static struct brake brake_view(const struct otg_problem *q, bool up)
{
    struct num soft = num_max(q->per_j, q->per_j2);
    if (!up)
        return (struct brake){ q->v0, q->a0, q->vx,    q->vn,
                               q->ax, q->an, q->per_j, soft };
    return (struct brake){ num_neg(q->v0), num_neg(q->a0),
                           num_neg(q->vn), num_neg(q->vx),
                           num_neg(q->an), num_neg(q->ax),
                           q->per_j,       soft };
}

/* Speed change of letting go of a afterwards; of letting go at once. */
static struct num brake_ramp(const struct brake *b)
{
    return num_half(num_mul(num_sqr(b->a), b->per_soft));
}

static struct num brake_own_ramp(const struct brake *b)
{
    return num_half(num_mul(num_sqr(b->a), b->per_j));
}

/* Run one phase to acceleration `a` and put it into the answer. */
static void brake_run(struct otg_problem *q, struct otg_shape *shape,
                      struct num dt, struct num a)
{
    static const struct num sixth = { 0x2aaaaaaa, -32 };
    if (dt.m <= 0)
        return;
    /* v dt + (2 a0 + a) dt^2 / 6 */
    struct num rise = num_mul(num_add(q->a0, a), dt);
    struct num bent = num_add(rise, num_mul(q->a0, dt));
    bent = num_add(q->v0, num_mul(bent, sixth));
    q->d = num_sub(q->d, num_mul(bent, dt));
    q->v0 = num_add(q->v0, num_half(rise));
    q->dv = num_sub(q->dv, num_half(rise));
    q->a0 = a;
    otg_shape_add(shape, dt, a);
}

static struct num brake_sign(struct num a, bool up)
{
    return up ? num_neg(a) : a;
}

/* Where letting go is to end: inside vx by what the start is beyond it, but for
 * the most by a little, so that a part of the ramps that follow can make good
 * what braking is off. */
static struct num brake_floor(const struct brake *b, struct num over)
{
    return num_sub(b->vx, num_min(over, num_scale(b->vx, -BRAKE_FLOOR_BITS)));
}

/* Time of hard jerk down until ramping back to a = 0 ends at `floor`: there a =
 * -x with
 *   v + (a0^2 - x^2)/2 hard - x^2/2j = floor. */
static struct num brake_time(const struct brake *b, struct num above,
                             struct num per_hard)
{
    struct num both = num_half(num_add(per_hard, b->per_j));
    struct num x = num_sqrt(num_div(above, both));
    return num_mul(num_add(b->a, x), per_hard);
}

/* What goes on with less jerk must not fall out below: full jerk up to a = -x,
 * from which that ends at vn,
 *   v - (a^2 - x^2)/2j - x^2/2 soft = vn,
 * or to rest of a where full jerk ends there. */
static void brake_let_go(struct otg_problem *q, struct otg_shape *shape,
                         bool up)
{
    struct brake b = brake_view(q, up);
    struct num above = num_sub(b.v, b.vn), soft = num_sub(b.per_soft, b.per_j);
    if (b.a.m >= 0 || soft.m <= 0 || !num_lt(above, brake_ramp(&b)))
        return;
    struct num ramp = brake_own_ramp(&b), room = num_sub(above, ramp);
    struct num a = num_zero();
    if (num_lt(num_scale(ramp, -BRAKE_TIE_BITS), room))
        a = num_neg(num_sqrt(num_twice(num_div(room, soft))));
    brake_run(q, shape, num_mul(num_sub(a, b.a), b.per_j), brake_sign(a, up));
}

/* At first with all the jerk there is: the check allows no more than that
 * leads to. */
static void brake_velocity(struct otg_problem *q, struct otg_shape *shape,
                           bool up)
{
    struct brake b = brake_view(q, up);
    struct num per_hard = num_sub(b.per_j, num_scale(b.per_j, -q->jerk_bits));
    struct num hard = num_inv(per_hard);
    struct num to_an = num_mul(num_sub(b.a, b.an), per_hard);
    struct num ramp = num_half(num_mul(num_sqr(b.a), per_hard));
    struct num end = b.a.m < 0 ? num_sub(b.v, ramp) : num_add(b.v, ramp);
    end = brake_floor(&b, num_sub(end, b.vx));
    struct num above = num_sub(num_add(ramp, b.v), end);
    struct num dt = brake_time(&b, above, per_hard);
    if (!num_lt(to_an, dt)) {
        struct num a = num_sub(b.a, num_mul(dt, hard));
        brake_run(q, shape, dt, brake_sign(a, up));
    } else {
        brake_run(q, shape, to_an, brake_sign(b.an, up));
        b = brake_view(q, up);
        above = num_sub(num_sub(b.v, end), brake_own_ramp(&b));
        brake_run(q, shape, num_div(above, num_neg(b.an)),
                  brake_sign(b.an, up));
    }
    brake_let_go(q, shape, up);
}

static void brake_acceleration(struct otg_problem *q, struct otg_shape *shape,
                               bool up)
{
    struct brake b = brake_view(q, up);
    if (num_lt(b.vx, num_add(b.v, brake_own_ramp(&b)))) {
        brake_velocity(q, shape, up);
        return;
    }
    brake_run(q, shape, num_mul(num_sub(b.a, b.ax), b.per_j),
              brake_sign(b.ax, up));
    /* still too slow: hold the acceleration until letting go of it ends
     * inside */
    b = brake_view(q, up);
    struct num below = num_sub(num_sub(b.vn, b.v), brake_own_ramp(&b));
    brake_run(q, shape, num_div(below, b.ax), brake_sign(b.ax, up));
    brake_let_go(q, shape, !up);
}

static bool brake_is_too_fast(const struct brake *b)
{
    struct num own = brake_own_ramp(b);
    if (num_lt(b->vx, b->v) && num_lt(b->vn, num_sub(b->v, own)))
        return true;
    struct num ramp = num_lt(b->v, b->vn) ? own : brake_ramp(b);
    return b->a.m > 0 && num_lt(b->vx, num_add(b->v, ramp));
}

void motion_otg_brake_acc(struct otg_problem *q, struct otg_shape *shape)
{
    for (int up = 0; up < 2; up++) {
        struct brake b = brake_view(q, up);
        if (num_lt(b.ax, b.a))
            brake_run(q, shape, num_mul(num_sub(b.a, b.ax), b.per_j),
                      brake_sign(b.ax, up));
    }
}

/* Whether the end is inside and can stay there. */
static bool is_inside(const struct otg_problem *q, struct num v, struct num a,
                      struct num ax, struct num an)
{
    struct num limit = q->vx;
    if (a.m) {
        if (a.m > 0 ? num_lt(ax, a) : num_lt(a, an))
            return false;
        struct num ramp = num_half(num_sqr(a));
        if (!q->is_unit)
            ramp = num_mul(ramp, num_max(q->per_j, q->per_j2));
        if ((v.m < 0) == (a.m < 0) || v.m == 0)
            v = num_add(v, a.m < 0 ? num_neg(ramp) : ramp);
        else if (num_lt(q->vx, num_add(v, ramp)) ||
                 num_lt(num_sub(v, ramp), q->vn))
            return false;
    }
    if (v.m < 0) {
        v = num_neg(v);
        limit = num_neg(q->vn);
    }
    return !num_lt(limit, v);
}

bool motion_otg_is_start_inside(const struct otg_problem *q)
{
    return is_inside(q, q->v0, q->a0, q->ax, q->an);
}

bool motion_otg_is_goal_inside(const struct otg_problem *q)
{
    return is_inside(q, q->vf, num_neg(q->af), num_neg(q->an), num_neg(q->ax));
}

void motion_otg_brake(struct otg_problem *q, struct otg_shape *shape)
{
    struct brake down = brake_view(q, false), up = brake_view(q, true);
    if (num_lt(down.ax, down.a))
        brake_acceleration(q, shape, false);
    else if (num_lt(up.ax, up.a))
        brake_acceleration(q, shape, true);
    else if (brake_is_too_fast(&down))
        brake_velocity(q, shape, false);
    else if (brake_is_too_fast(&up))
        brake_velocity(q, shape, true);
}
