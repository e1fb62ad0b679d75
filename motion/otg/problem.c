/* motion/otg/problem.c - from a move to the shape of its fastest motion.
 *
 *   the move in short reals, its limits tightened  ->  both ends brought inside
 *   ->  search what is between (search.c)  ->  the goal's end behind it
 *
 * The margin by which limits are tightened takes up the rounding to whole ticks
 * and units.  An end outside its limits comes first: full jerk until the
 * acceleration is inside; when the velocity is, or is bound to come, outside,
 * full jerk towards the limit of deceleration, held until ramping it to zero
 * ends at the limit of velocity: later, the velocity would fall below it by all
 * that the ramp takes off.  Too fast downwards is the same upside down, and a
 * goal is a start backwards in time. */
#include <stddef.h>

#include "motion/core/err.h"
#include "motion/core/fixed.h"
#include "motion/otg/internal.h"

/* --- limits tightened by a margin ----------------------------------------- */

#define PROBLEM_MOST_PER_S 32 /* the shortest ramp: 2^-32 s, 954 ticks */
#define PROBLEM_TICKS      11 /* 2^11 of them (1/8 ns) are little */

/* Limits are tightened by 2^-25, or for a move of few ticks by what 2^11 ticks
 * (1/8 ns) are of it. */
int motion_otg_margin_bits(int64_t dur_ns_q12)
{
    int bits = 64 - (int)motion_real_clz((uint64_t)dur_ns_q12) - PROBLEM_TICKS;
    return bits > OTG_MARGIN_BITS ? OTG_MARGIN_BITS : bits < 8 ? 8 : bits;
}

/* Larger by steps of 2^2: velocity and acceleration, the jerk, all, and all
 * with a smaller one of velocity: less jerk makes a start that swings beyond
 * its limits swing further, lower limits can put a displacement out of reach
 * that was just within it. */
struct otg_margin motion_otg_margin(int finest, int i)
{
    int bits = finest - 2 * ((i + 3) / 4);
    int near = (finest + OTG_MARGIN_BITS) / 2;
    bits = bits < 2 ? 2 : bits;
    switch (i % 4) {
    case 1:
        return (struct otg_margin){ bits, bits, finest, false };
    case 2:
        return (struct otg_margin){ OTG_MARGIN_BITS, OTG_MARGIN_BITS, bits,
                                    false };
    case 3:
        return (struct otg_margin){ near, bits + 2, bits + 2, false };
    default:
        return (struct otg_margin){ bits, bits, bits, false };
    }
}

static const struct num tick_s = { 576460752, -71 }; /* 1 / 4096e9 s */
static const struct num ticks_per_s = { 1000000000, 12 };

struct num motion_otg_per_second(void)
{
    return ticks_per_s;
}

struct num motion_otg_seconds(int64_t dur_ns_q12)
{
    return num_mul(num_int(dur_ns_q12), tick_s);
}

/* A time the move cannot do without, within a factor of about four. */
static struct num least_time(const struct otg_problem *q)
{
    struct num dv = num_abs(num_sub(q->vf, q->v0));
    struct num a = num_min(q->ax, num_neg(q->an));
    struct num t = num_div(num_abs(q->d), num_max(q->vx, num_neg(q->vn)));
    if (a.m > 0) {
        t = num_max(t, num_div(dv, a));
        t = num_max(t, num_sqrt(num_div(num_abs(q->d), a)));
    }
    return t;
}

/* What is not limited is limited so far away that reaching it takes 2^-22 of
 * the move, or a few ticks. */
static void limit_the_rest(const struct motion_otg_move *move,
                           struct otg_problem *q)
{
    if (move->limit.jerk_q32)
        return;
    struct num per_t = least_time(q);
    if (per_t.m == 0)
        per_t = num_one();
    per_t = num_scale(num_inv(per_t), 22);
    per_t = num_min(per_t, num_scale(num_one(), PROBLEM_MOST_PER_S));
    if (!move->limit.acc_max_q32) {
        q->ax = num_mul(num_max(q->vx, num_neg(q->vn)), per_t);
        q->an = num_neg(q->ax);
    }
    q->j = q->j2 = num_mul(num_max(q->ax, num_neg(q->an)), per_t);
}

/* Towards zero by 2^-bits of it, rounded up; 2 <= bits <= 29. */
static struct num tightened(struct num a, int bits)
{
    int32_t size = a.m < 0 ? -a.m : a.m;
    size -= (size + (1 << bits) - 1) >> bits;
    if (a.m != 0 && size < NUM_ONE) {
        size *= 2;
        a.e--;
    }
    a.m = a.m < 0 ? -size : size;
    return a;
}

/* No more than a track can hold. */
static int64_t capped(int64_t acc_q32)
{
    if (acc_q32 > MOTION_TRACK_ACC_MAX_Q32)
        return MOTION_TRACK_ACC_MAX_Q32;
    return acc_q32 < -MOTION_TRACK_ACC_MAX_Q32 ? -MOTION_TRACK_ACC_MAX_Q32
                                               : acc_q32;
}

/* A limit upwards and the one downwards, which often is the same. */
static void tighten_limits(int64_t up, int64_t down, int scale, int bits,
                           struct num *most, struct num *least)
{
    *most = tightened(num_make(up, -scale), bits);
    *least = (uint64_t)up + (uint64_t)down == 0
                 ? num_neg(*most)
                 : tightened(num_make(down, -scale), bits);
}

/* a - b in Q32; the difference of two int64 needs 65 bits. */
static struct num between_q32(int64_t a, int64_t b)
{
    int64_t change;
    if (!__builtin_sub_overflow(a, b, &change))
        return num_make(change, -32);
    return num_make((a >> 1) - (b >> 1), -31);
}

void motion_otg_problem_init(const struct motion_otg_move *move,
                             struct otg_margin margin, struct otg_problem *q)
{
    const struct motion_otg_limit *lim = &move->limit;
    q->d = between_q32(move->goal.pos_q32, move->start.pos_q32);
    q->dv = between_q32(move->goal.vel_q32, move->start.vel_q32);
    q->v0 = num_make(move->start.vel_q32, -32);
    q->a0 = num_make(move->start.acc_q32, -32);
    q->vf = num_make(move->goal.vel_q32, -32);
    q->af = num_make(move->goal.acc_q32, -32);
    tighten_limits(lim->vel_max_q32, lim->vel_min_q32, 32, margin.vel, &q->vx,
                   &q->vn);
    tighten_limits(capped(lim->acc_max_q32), capped(lim->acc_min_q32), 32,
                   margin.acc, &q->ax, &q->an);
    q->j = q->j2 = tightened(num_make(lim->jerk_q32, -32), margin.jerk);
    q->jerk_bits = margin.jerk;
    if (lim->jerk_down_q32)
        q->j2 = tightened(num_make(lim->jerk_down_q32, -32), margin.jerk);
    q->is_unit = false;
    q->is_strict = margin.is_strict;
    q->exact = move;
    q->has_no_early = false;
    limit_the_rest(move, q);
    q->per_j = q->per_j2 = num_inv(q->j);
    if (lim->jerk_down_q32)
        q->per_j2 = num_inv(q->j2);
}

void motion_otg_in_jerk(struct otg_problem *q, struct num per_j)
{
    q->d = num_mul(q->d, per_j);
    q->v0 = num_mul(q->v0, per_j);
    q->a0 = num_mul(q->a0, per_j);
    q->vf = num_mul(q->vf, per_j);
    q->af = num_mul(q->af, per_j);
    q->dv = num_mul(q->dv, per_j);
    q->vx = num_mul(q->vx, per_j);
    q->vn = num_mul(q->vn, per_j);
    q->ax = num_mul(q->ax, per_j);
    q->an = num_mul(q->an, per_j);
    q->j = q->j2 = q->per_j = q->per_j2 = num_one();
    q->is_unit = true;
}

/* Backwards in time. */
static void reverse(struct otg_problem *q)
{
    struct otg_problem f = *q;
    q->v0 = f.vf;
    q->a0 = num_neg(f.af);
    q->vf = f.v0;
    q->dv = num_neg(f.dv);
    q->af = num_neg(f.a0);
    q->ax = num_neg(f.an);
    q->an = num_neg(f.ax);
    q->j = f.j2;
    q->j2 = f.j;
    q->per_j = f.per_j2;
    q->per_j2 = f.per_j;
}

/* --- ends brought inside their limits ------------------------------------- */

#define BRAKE_TIE_BITS   20 /* 2^-20 of a ramp is rounding */
#define BRAKE_FLOOR_BITS 10 /* 2^-10 of the limit at most, see brake_floor */

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

/* Speed change of ramping a to zero afterwards; of ramping it at once. */
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

/* Where that ramp is to end: inside vx by what the start is beyond it, but for
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
static void brake_release(struct otg_problem *q, struct otg_shape *shape,
                          bool up)
{
    struct brake b = brake_view(q, up);
    struct num above = num_sub(b.v, b.vn), soft = num_sub(b.per_soft, b.per_j);
    if (b.a.m >= 0 || soft.m <= 0 || !num_lt(above, brake_ramp(&b)))
        return;
    struct num ramp = brake_own_ramp(&b), margin = num_sub(above, ramp);
    struct num a = num_zero();
    if (num_lt(num_scale(ramp, -BRAKE_TIE_BITS), margin))
        a = num_neg(num_sqrt(num_twice(num_div(margin, soft))));
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
    brake_release(q, shape, up);
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
    /* still too slow: hold the acceleration until its ramp to zero ends
     * inside */
    b = brake_view(q, up);
    struct num below = num_sub(num_sub(b.vn, b.v), brake_own_ramp(&b));
    brake_run(q, shape, num_div(below, b.ax), brake_sign(b.ax, up));
    brake_release(q, shape, !up);
}

static bool brake_is_too_fast(const struct brake *b)
{
    struct num own = brake_own_ramp(b);
    if (num_lt(b->vx, b->v) && num_lt(b->vn, num_sub(b->v, own)))
        return true;
    struct num ramp = num_lt(b->v, b->vn) ? own : brake_ramp(b);
    return b->a.m > 0 && num_lt(b->vx, num_add(b->v, ramp));
}

/* An acceleration outside its limit to it, nothing more. */
static void brake_acc(struct otg_problem *q, struct otg_shape *shape)
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

/* Whether the start (or the goal, backwards in time) is inside, and stays
 * there while its acceleration ramps to zero: then there is nothing to
 * brake. */
static bool is_start_inside(const struct otg_problem *q)
{
    return is_inside(q, q->v0, q->a0, q->ax, q->an);
}

static bool is_goal_inside(const struct otg_problem *q)
{
    return is_inside(q, q->vf, num_neg(q->af), num_neg(q->an), num_neg(q->ax));
}

/* Bring the start (a, then v) inside the limits; adds 0..2 phases to `shape`
 * and moves v0, a0 and d on. */
static void brake_inside(struct otg_problem *q, struct otg_shape *shape)
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

/* --- the whole shape ------------------------------------------------------ */

/* Backwards in time the goal is a start; what braking there adds is kept until
 * the rest of the shape is there. */
#define END_PHASES 4 /* braking has 3 at most */

struct end {
    struct otg_phase phase[END_PHASES]; /* backwards, from the goal */
    int count;
    struct num af;
};

/* `shape` is empty, and is again. */
static void end_brake(struct otg_problem *q, struct otg_shape *shape,
                      bool acc_alone, struct end *end)
{
    end->af = q->af;
    reverse(q);
    if (acc_alone)
        brake_acc(q, shape);
    else
        brake_inside(q, shape);
    reverse(q);
    end->count = shape->count;
    for (int i = 0; i < shape->count; i++)
        end->phase[i] = shape->phase[i];
    shape->count = 0;
}

static void end_append(const struct end *end, struct otg_shape *shape)
{
    if (end->count > 0)
        shape->land = shape->count;
    for (int i = end->count - 1; i >= 0; i--)
        otg_shape_add(shape, end->phase[i].dt,
                      i ? num_neg(end->phase[i - 1].a) : end->af);
}

static struct num end_time(const struct end *end)
{
    struct num t = num_zero();
    for (int i = 0; i < end->count; i++)
        t = num_add(t, end->phase[i].dt);
    return t;
}

/* Most phases hold what is zero or was just multiplied. */
void motion_otg_shape_scale(struct otg_shape *shape, int from, struct num by)
{
    struct num was = num_zero(), is = was;
    for (int i = from; i < shape->count; i++) {
        struct num *a = &shape->phase[i].a;
        if (a->m != was.m || a->e != was.e) {
            was = *a;
            is = num_mul(was, by);
        }
        *a = is;
    }
}

struct num motion_otg_shape_time(const struct otg_shape *shape)
{
    struct num t = num_zero();
    for (int i = 0; i < shape->count; i++)
        if (shape->phase[i].dt.m != 0)
            t = num_add(t, shape->phase[i].dt);
    return t;
}

/* An end that is outside only because limits are tightened has no time to brake
 * where the acceleration stays on its side of zero: velocities between those of
 * start and goal are inside.  Without such a motion all is as before. */
OTG_OWN_FRAME static bool propose_early(struct otg_problem *q, struct num t,
                                        struct end *end,
                                        struct otg_shape *shape)
{
    const struct num d = q->d, v0 = q->v0, a0 = q->a0, vf = q->vf, af = q->af;
    const struct num dv = q->dv;
    end->count = 0;
    if (num_lt(q->ax, q->af) || num_lt(q->af, q->an))
        end_brake(q, shape, true, end);
    brake_acc(q, shape);
    shape->brake = shape->count;
    if (t.m != 0)
        t = num_sub(t, num_add(motion_otg_shape_time(shape), end_time(end)));
    if (motion_otg_solve_early(q, t, shape)) {
        shape->turn = shape->count;
        end_append(end, shape);
        return true;
    }
    bool is_edge = shape->is_edge;
    otg_shape_init(shape);
    shape->is_edge = is_edge;
    q->d = d;
    q->v0 = v0;
    q->a0 = a0;
    q->vf = vf;
    q->af = af;
    q->dv = dv;
    q->has_no_early = true;
    return false;
}

static int propose_middle(const struct otg_problem *q, struct num t,
                          struct num ends, struct otg_shape *shape,
                          struct num *next)
{
    if (t.m == 0) {
        motion_otg_solve(q, shape);
        return MOTION_OK;
    }
    int err = motion_otg_solve_duration(q, num_sub(t, ends), shape, next);
    *next = num_add(*next, ends);
    return err;
}

/* With one jerk: two are not worth the stack that another problem takes. */
static bool may_keep_side(const struct otg_problem *q)
{
    return q->is_unit && q->a0.m != 0 && q->af.m != 0 &&
           (q->a0.m < 0) == (q->af.m < 0) && q->exact != NULL &&
           motion_otg_early_is_near(q, num_zero()) &&
           motion_otg_start_fits(q->exact);
}

static int propose_all(struct otg_problem *q, struct num t,
                       struct otg_shape *shape, struct num *next)
{
    struct end end;
    bool starts = is_start_inside(q);
    bool ends = is_goal_inside(q);
    if (!(starts && ends) && may_keep_side(q) &&
        propose_early(q, t, &end, shape))
        return MOTION_OK;
    end.count = 0;
    if (!ends)
        end_brake(q, shape, false, &end);
    if (!starts)
        brake_inside(q, shape);
    shape->brake = shape->count;
    shape->turn = -1;
    struct num outside = num_zero();
    if (t.m != 0)
        outside = num_add(motion_otg_shape_time(shape), end_time(&end));
    int err = propose_middle(q, t, outside, shape, next);
    if (shape->turn < 0)
        shape->turn = shape->count;
    end_append(&end, shape);
    return err;
}

int motion_otg_propose(struct otg_problem *q, struct num t,
                       struct otg_shape *shape, struct num *next)
{
    struct num jerk = q->j, per_j = q->per_j;
    bool is_one = jerk.m == q->j2.m && jerk.e == q->j2.e;
    if (is_one)
        motion_otg_in_jerk(q, per_j);
    int err = propose_all(q, t, shape, next);
    if (!is_one)
        return err;
    q->j = q->j2 = jerk;
    q->per_j = q->per_j2 = per_j;
    motion_otg_shape_scale(shape, 0, jerk);
    return err;
}

/* A start that slows down only after it has come to its highest speed gets
 * there with the jerk of speeding up.  Returns how long that takes, or zero. */
static struct num velocity_peak(struct otg_problem *q)
{
    struct num t = num_mul(num_abs(q->a0), q->per_j);
    struct num rise = num_half(num_mul(q->a0, t));
    struct num peak = num_add(q->v0, rise);
    if (num_sub(q->j, q->j2).m == 0 || !num_lt(num_abs(q->v0), num_abs(peak)) ||
        !num_lt(num_abs(q->vf), num_abs(peak)))
        return num_zero();
    q->v0 = peak;
    q->dv = num_sub(q->dv, rise);
    q->a0 = num_zero();
    return t;
}

/* One jerk after the peak: that of slowing down where the speed falls. */
OTG_OWN_FRAME void
motion_otg_propose_velocity(const struct otg_problem *problem,
                            struct otg_shape *shape)
{
    struct otg_problem q = *problem;
    struct end end;
    struct num peak = velocity_peak(&q);
    bool slows = num_lt(num_abs(q.vf), num_abs(q.v0));
    q.j = q.j2 = slows ? q.j2 : q.j;
    q.per_j = q.per_j2 = slows ? q.per_j2 : q.per_j;
    end_brake(&q, shape, true, &end);
    if (peak.m)
        otg_shape_add(shape, peak, num_zero());
    int from = shape->count;
    brake_acc(&q, shape);
    motion_otg_solve_velocity(&q, shape);
    end_append(&end, shape);
    shape->brake = shape->turn = slows ? from : shape->count;
}
