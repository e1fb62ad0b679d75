/* motion/otg_exact.c - from a proposal in reals to a plan in exact integers.
 *
 * Times are rounded to whole ticks, accelerations at the corners to whole
 * units, so the motion between them follows in exact integers (otg.h).  The
 * ends then miss by about 2^-36 of the move; the quintic that is zero with two
 * derivatives at the start, and makes up the miss at the end, is added over the
 * whole move. */
#include <stddef.h>

#include "motion/err.h"
#include "motion/otg_internal.h"

#define EXACT_POS_BITS  119 /* of positions, and of velocities times ticks */
#define EXACT_ACC_BITS  41  /* wanted: the fewer, the finer a tick can be */
#define EXACT_ACC_MOST  56
#define EXACT_TICK_BITS 48 /* a move is 2^48 ticks or fewer */

/* 4096e9 ticks of 2^-12 ns per second: the factor is 2^21 5^9 exactly. */
struct real motion_otg_ticks_per_s(int tick_shift)
{
    return real_scale(real_int(INT64_C(4096000000000)), -tick_shift);
}

struct real motion_otg_tick_s(int tick_shift)
{
    static const struct real per_second = { INT64_C(2475880078570760550),
                                            -103 };
    return real_scale(per_second, tick_shift);
}

void motion_otg_units(const struct motion_otg_plan *plan,
                      struct otg_units *units)
{
    static const struct real third = { INT64_C(0x2aaaaaaaaaaaaaaa), -63 };
    struct real h = motion_otg_tick_s(plan->tick_shift);
    struct real step = real_scale(third, plan->pos_shift - 32);
    units->vel = real_mul(h, step);
    units->acc = real_scale(real_mul(h, units->vel), 15);
    units->jerk = real_mul(h, units->acc);
}

static unsigned wide_lead(struct wide a)
{
    return a.hi ? real_clz(a.hi) : a.lo ? 64 + real_clz(a.lo) : 200;
}

struct wide motion_otg_scaled(int64_t n, struct real factor)
{
    bool negative = n < 0;
    if (n == INT64_MIN)
        n++;
    struct wide product = wide_mul(wide_from(negative ? -n : n), factor.m);
    if (factor.e > (int)wide_lead(product) - 2)
        product = (struct wide){ (uint64_t)1 << 62, 0 };
    else if (factor.e >= 0)
        product = wide_shl(product, (unsigned)factor.e);
    else
        product =
            wide_shr(product, factor.e < -127 ? 127 : (unsigned)-factor.e);
    return negative ? wide_neg(product) : product;
}

static int larger(int a, int b)
{
    return a > b ? a : b;
}

/* Bounds, as powers of two, of what happens during a shape. */
struct extent {
    int t, v, a;
};

static int exponent_num(struct num a)
{
    return a.m ? a.e + 30 : -2000;
}

static struct extent shape_extent(const struct otg_problem *q,
                                  const struct otg_shape *shape)
{
    struct num t = num_zero(), v = q->v0, a = q->a0;
    struct num v_most = num_abs(v), a_most = num_abs(a);
    for (int i = 0; i < shape->count; i++) {
        const struct otg_phase *ph = &shape->phase[i];
        struct num half = num_half(ph->dt);
        /* within a phase v is at most |a| dt / 2 beyond its ends */
        struct num swell = num_mul(num_max(num_abs(a), num_abs(ph->a)), half);
        v = num_add(v, num_mul(num_add(a, ph->a), half));
        a = ph->a;
        t = num_add(t, ph->dt);
        v_most = num_max(v_most, num_add(num_abs(v), swell));
        a_most = num_max(a_most, num_abs(a));
    }
    return (struct extent){ exponent_num(t), exponent_num(v_most),
                            exponent_num(a_most) };
}

/* Choose the step so that positions fill their bits, and the tick so that
 * accelerations keep EXACT_ACC_BITS: acc = a h^2 2^pos_shift / 6 with a tick
 * of h = 2^(shift - 41.9) s.  A wanted duration must be whole ticks, as far as
 * ten more bits of acceleration can buy that. */
static int exact_scale(const struct otg_problem *q,
                       const struct otg_shape *shape, int64_t dur_ns_q12,
                       struct motion_otg_plan *plan)
{
    struct extent most = shape_extent(q, shape);
    int way = larger(most.v + most.t, exponent_num(q->d)) + 2;
    int pos = EXACT_POS_BITS - way;
    plan->tick_shift = 0;
    plan->pos_shift = 64;
    if (most.t <= -100)
        return MOTION_OK; /* nothing moves */
    if (most.t + 42 > 60)
        return MOTION_E_RANGE;
    int sum = EXACT_ACC_BITS + 2 - most.a - pos;
    int shift = 42 + (sum >= 0 ? sum / 2 : -((1 - sum) / 2));
    shift = larger(larger(shift, most.t + 42 - EXACT_TICK_BITS), 0);
    for (int i = 0; i < 10 && shift > 0; i++)
        if (dur_ns_q12 & (((int64_t)1 << shift) - 1))
            shift--;
    int acc = most.a + 2 * (shift - 41) - 2;
    if (pos > EXACT_ACC_MOST - acc)
        pos = EXACT_ACC_MOST - acc;
    plan->tick_shift = shift;
    plan->pos_shift = pos;
    return pos < 32 ? MOTION_E_RANGE : MOTION_OK;
}

static struct real long_real(struct num a)
{
    struct motion_real r = num_real(a);
    return (struct real){ r.m, r.e };
}

static int64_t acc_in_units(struct num a, struct real unit)
{
    return real_floor(real_mul(real_scale(long_real(a), 16), unit), 0);
}

static struct num short_num(struct real a)
{
    return num_make(a.m, a.e);
}

static void exact_rates(const struct otg_problem *q,
                        const struct otg_shape *shape,
                        const struct otg_units *units, struct otg_rates *rates)
{
    struct num unit = num_scale(short_num(units->jerk), 16);
    rates->j = num_mul(q->j, unit);
    rates->j2 = num_mul(q->j2, unit);
    rates->per_j = num_inv(rates->j);
    rates->per_j2 = num_inv(rates->j2);
    rates->brake = shape->brake;
    rates->turn = shape->turn;
}

static bool is_hold(const struct otg_shape *shape, int i)
{
    return i > 0 && shape->phase[i].a.m == shape->phase[i - 1].a.m &&
           shape->phase[i].a.e == shape->phase[i - 1].a.e;
}

/* Phases one by one as the shape has them.  Times to nearest; where the
 * acceleration moves, as long as its jerk wants at least, and with knobs no
 * longer.  A phase that lasts no time and moves the acceleration by rounding
 * alone stays where it is. */
static void exact_phases(const struct otg_shape *shape,
                         const struct otg_units *units,
                         const struct otg_rates *rates, int64_t goal_acc,
                         struct motion_otg_plan *plan)
{
    struct real per_s = motion_otg_ticks_per_s(plan->tick_shift);
    bool is_full = shape->knobs.hump[0] >= 0;
    int64_t acc = plan->start_acc;
    plan->count = shape->count;
    plan->ticks = 0;
    for (int i = 0; i < shape->count; i++) {
        const struct otg_phase *ph = &shape->phase[i];
        bool last = i + 1 == shape->count;
        int64_t to = last ? goal_acc : acc_in_units(ph->a, units->acc);
        struct real ticks = real_mul(long_real(ph->dt), per_s);
        if (!last && (ticks.e < -62 - 10 || is_hold(shape, i)))
            to = acc;
        int64_t n = motion_otg_ramp_ticks(rates, i, to - acc);
        if (to == acc || !is_full) {
            int64_t near = (real_floor(ticks, 1) + 1) >> 1;
            n = near > n ? near : n;
        }
        plan->phase[i] = (struct motion_otg_phase){ n, to };
        plan->ticks += n;
        acc = to;
    }
}

/* Leave out phases of no ticks. */
static void exact_compact(const struct otg_shape *shape,
                          struct motion_otg_plan *plan)
{
    int count = plan->count;
    plan->count = plan->brake = plan->turn = 0;
    for (int i = 0; i < count; i++) {
        if (plan->phase[i].ticks == 0)
            continue;
        plan->phase[plan->count++] = plan->phase[i];
        if (i < shape->brake)
            plan->brake = plan->count;
        if (i < shape->turn)
            plan->turn = plan->count;
    }
}

/* The longest phase takes what is missing from the wanted total. */
static int exact_total(struct motion_otg_plan *plan, int64_t dur_ns_q12)
{
    int longest = 0;
    for (int i = 1; i < plan->count; i++)
        if (plan->phase[i].ticks > plan->phase[longest].ticks)
            longest = i;
    if (dur_ns_q12 && plan->count) {
        int64_t rest = (dur_ns_q12 >> plan->tick_shift) - plan->ticks;
        plan->phase[longest].ticks += rest;
        plan->ticks += rest;
        if (plan->phase[longest].ticks <= 0)
            return MOTION_E_RANGE;
    }
    plan->dur_ns_q12 = plan->ticks << plan->tick_shift;
    return plan->dur_ns_q12 >= MOTION_TRACK_SEGMENT_MAX_NS_Q12 ? MOTION_E_RANGE
                                                               : MOTION_OK;
}

/* Integrate the phases: velocity and position at the end, from zero position. */
static struct wide exact_run(const struct motion_otg_plan *plan,
                             struct wide *vel)
{
    struct wide p = wide_from(0);
    int64_t a = plan->start_acc;
    for (int i = 0; i < plan->count; i++) {
        int64_t n = plan->phase[i].ticks, to = plan->phase[i].acc;
        struct wide v3 = wide_add(*vel, wide_shl(*vel, 1));
        struct wide bent = wide_mul(wide_from(2 * a + to), n);
        p = wide_add(p, wide_mul(wide_add(v3, bent), n));
        *vel = wide_add(*vel, wide_mul(wide_from(a + to), n));
        a = to;
    }
    return p;
}

/* E(1) = miss, E'(1) = slope, E''(1) = 0. */
static void exact_bend(struct motion_otg_plan *plan, struct wide miss,
                       struct wide slope)
{
    struct wide e3 = wide_sub(wide_mul(miss, 10), wide_mul(slope, 4));
    struct wide e4 = wide_sub(wide_mul(slope, 7), wide_mul(miss, 15));
    struct wide e5 = wide_sub(wide_mul(miss, 6), wide_mul(slope, 3));
    plan->bend[0] = motion_otg_wide_out(e3);
    plan->bend[1] = motion_otg_wide_out(e4);
    plan->bend[2] = motion_otg_wide_out(e5);
}

/* goal - start in steps; the subtraction of two int64 needs 65 bits. */
struct wide motion_otg_way(const struct motion_otg_plan *plan,
                           const struct motion_otg_move *move)
{
    struct wide way =
        wide_sub(wide_from(move->goal.pos_q32), wide_from(move->start.pos_q32));
    int shift = plan->pos_shift - 32;
    return wide_shl(way, shift > 127 ? 127 : (unsigned)shift);
}

/* Spread what the phases miss of the goal. */
static void exact_close(const struct motion_otg_move *move,
                        const struct otg_units *units,
                        struct motion_otg_plan *plan)
{
    struct wide vel = motion_otg_wide_in(plan->start_vel);
    struct wide goal_vel = motion_otg_scaled(move->goal.vel_q32, units->vel);
    struct wide p = exact_run(plan, &vel);
    struct wide slope =
        wide_mul(wide_mul(wide_sub(goal_vel, vel), 3), plan->ticks);
    /* a velocity goal is free to end anywhere: E(1) = E'(1) / 2 bends least */
    struct wide way = wide_add(p, wide_shr(slope, 1));
    if (move->mode == MOTION_OTG_POSITION)
        way = motion_otg_way(plan, move);
    plan->way = motion_otg_wide_out(way);
    exact_bend(plan, wide_sub(way, p), slope);
}

/* The upper 64 bits suffice. */
struct num motion_otg_wide_num(struct wide a, int32_t e)
{
    bool minus = wide_is_negative(a);
    if (minus)
        a = wide_neg(a);
    if (a.hi) {
        unsigned lead = motion_real_clz(a.hi);
        a = wide_shl(a, lead);
        a.lo = a.hi;
        e += 64 - (int32_t)lead;
    }
    struct num n = num_make((int64_t)(a.lo >> 1), e + 1);
    return minus ? num_neg(n) : n;
}

static void exact_polish(const struct motion_otg_move *move,
                         const struct otg_units *units,
                         const struct otg_shape *shape,
                         const struct otg_rates *rates, int64_t dur_ns_q12,
                         struct motion_otg_plan *plan)
{
    struct wide vel = motion_otg_wide_in(plan->start_vel);
    struct otg_miss miss;
    struct wide p = exact_run(plan, &vel);
    vel = wide_sub(motion_otg_scaled(move->goal.vel_q32, units->vel), vel);
    p = wide_sub(motion_otg_way(plan, move), p);
    /* 3 steps / tick, steps */
    miss.vel = num_mul(motion_otg_wide_num(vel, -plan->pos_shift),
                       motion_otg_per_second(plan->tick_shift));
    miss.vel = num_add(miss.vel, num_twice(miss.vel));
    miss.way = motion_otg_wide_num(p, -plan->pos_shift);
    miss.is_timed = dur_ns_q12 != 0;
    miss.ticks = (dur_ns_q12 >> plan->tick_shift) - plan->ticks;
    motion_otg_polish(plan, &shape->knobs, rates, &miss);
    plan->ticks = 0;
    for (int i = 0; i < plan->count; i++)
        plan->ticks += plan->phase[i].ticks;
}

int motion_otg_quantise(const struct motion_otg_move *move,
                        const struct otg_problem *problem,
                        const struct otg_shape *shape, int64_t dur_ns_q12,
                        struct motion_otg_plan *plan)
{
    struct otg_units units;
    int err = exact_scale(problem, shape, dur_ns_q12, plan);
    if (err < 0)
        return err;
    motion_otg_units(plan, &units);
    int64_t acc = (int64_t)motion_otg_scaled(move->start.acc_q16, units.acc).lo;
    int64_t goal_acc =
        (int64_t)motion_otg_scaled(move->goal.acc_q16, units.acc).lo;
    struct wide vel = motion_otg_scaled(move->start.vel_q32, units.vel);
    plan->start_acc = acc;
    plan->start_vel = motion_otg_wide_out(vel);
    plan->start_pos_q32 = move->start.pos_q32;
    struct otg_rates rates;
    exact_rates(problem, shape, &units, &rates);
    exact_phases(shape, &units, &rates, goal_acc, plan);
    exact_polish(move, &units, shape, &rates, dur_ns_q12, plan);
    exact_compact(shape, plan);
    err = exact_total(plan, dur_ns_q12);
    if (err == MOTION_OK)
        exact_close(move, &units, plan);
    return err;
}

int motion_otg_stretch(const struct motion_otg_move *move, int64_t dur_ns_q12,
                       struct motion_otg_plan *plan)
{
    struct otg_units units;
    if (dur_ns_q12 & (((int64_t)1 << plan->tick_shift) - 1))
        return MOTION_E_ARG;
    int err = exact_total(plan, dur_ns_q12);
    if (err < 0)
        return err;
    motion_otg_units(plan, &units);
    exact_close(move, &units, plan);
    return motion_otg_check(move, plan, NULL);
}
