/* motion/otg.c - see otg.h.
 *
 *   judge the request  ->  reals, limits drawn in  ->  brake both ends inside
 *   ->  solve  ->  whole ticks  ->  check; draw in further while it fails */
#include "motion/otg.h"

#include <stddef.h>

#include "motion/err.h"
#include "motion/otg_internal.h"

#define OTG_BITS 25 /* limits are drawn in by 2^-25 */

const char *motion_otg_field_text(enum motion_otg_field field)
{
    static const char *const text[] = {
#define MOTION_OTG_FIELD_TEXT(name, sentence) [name] = sentence,
        MOTION_OTG_FIELD_LIST(MOTION_OTG_FIELD_TEXT)
#undef MOTION_OTG_FIELD_TEXT
    };
    if ((unsigned)field >= sizeof text / sizeof text[0])
        return text[0];
    return text[field];
}

/* --- the request --------------------------------------------------------- */

static int refuse(enum motion_otg_field *field, enum motion_otg_field which,
                  int err)
{
    *field = which;
    return err;
}

static int otg_limits_are_valid(const struct motion_otg_move *move,
                                enum motion_otg_field *field)
{
    const struct motion_otg_limit *lim = &move->limit;
    bool acc = lim->acc_max_q16 != 0 || lim->acc_min_q16 != 0;
    bool vel = move->mode == MOTION_OTG_POSITION;
    if (vel && lim->vel_max_q32 <= 0)
        return refuse(field, MOTION_OTG_FIELD_VEL_MAX, MOTION_E_ARG);
    if (vel && lim->vel_min_q32 >= 0)
        return refuse(field, MOTION_OTG_FIELD_VEL_MIN, MOTION_E_ARG);
    if (lim->jerk_q16 < 0)
        return refuse(field, MOTION_OTG_FIELD_JERK, MOTION_E_ARG);
    if ((acc || lim->jerk_q16) && lim->acc_max_q16 <= 0)
        return refuse(field, MOTION_OTG_FIELD_ACC_MAX, MOTION_E_ARG);
    if ((acc || lim->jerk_q16) && lim->acc_min_q16 >= 0)
        return refuse(field, MOTION_OTG_FIELD_ACC_MIN, MOTION_E_ARG);
    if (lim->jerk_down_q16 < 0 || (lim->jerk_down_q16 && !lim->jerk_q16))
        return refuse(field, MOTION_OTG_FIELD_JERK_DOWN, MOTION_E_ARG);
    if (move->dur_ns_q12 < 0)
        return refuse(field, MOTION_OTG_FIELD_DURATION, MOTION_E_ARG);
    return MOTION_OK;
}

static struct real q32(int64_t v)
{
    return real_scale(real_int(v), -32);
}

static struct real q16(int64_t v)
{
    return real_scale(real_int(v), -16);
}

static int64_t closing_jerk(const struct motion_otg_limit *lim)
{
    return lim->jerk_down_q16 ? lim->jerk_down_q16 : lim->jerk_q16;
}

/* The ramp down from `acc` fits below `limit`, or is too long by no more than
 * 2^-40 of the velocities: numbers that come rounded from elsewhere may tie. */
static bool otg_goal_fits(int64_t vel_q32, int64_t acc_q16, int64_t jerk_q16,
                          int64_t limit_q32)
{
    uint64_t room = (uint64_t)limit_q32 - (uint64_t)vel_q32;
    uint64_t tie = motion_fixed_abs(limit_q32) >> 40;
    return jerk_q16 == 0 ||
           motion_otg_ramp_fits(acc_q16, jerk_q16, room + tie);
}

/* The goal needs room to have been reached: with af < 0 the speed was higher
 * just before. */
static int otg_goal_is_possible(const struct motion_otg_move *move,
                                enum motion_otg_field *field)
{
    const struct motion_otg_limit *lim = &move->limit;
    const struct motion_state *goal = &move->goal;
    int64_t jerk = closing_jerk(lim);
    if (lim->jerk_q16 &&
        (goal->acc_q16 > lim->acc_max_q16 || goal->acc_q16 < lim->acc_min_q16))
        return refuse(field, MOTION_OTG_FIELD_GOAL_ACC, MOTION_E_LIMIT);
    if (move->mode == MOTION_OTG_VELOCITY)
        return MOTION_OK;
    if (goal->vel_q32 > lim->vel_max_q32 || goal->vel_q32 < lim->vel_min_q32)
        return refuse(field, MOTION_OTG_FIELD_GOAL_VEL, MOTION_E_LIMIT);
    if ((goal->acc_q16 < 0 && !otg_goal_fits(goal->vel_q32, goal->acc_q16, jerk,
                                             lim->vel_max_q32)) ||
        (goal->acc_q16 > 0 && !otg_goal_fits(-goal->vel_q32, goal->acc_q16,
                                             jerk, -lim->vel_min_q32)))
        return refuse(field, MOTION_OTG_FIELD_GOAL_ACC, MOTION_E_LIMIT);
    return MOTION_OK;
}

/* Limits are drawn in by 2^-25, or for a move of few ticks by what 2^11 ticks
 * (1/8 ns) are of it. */
int motion_otg_wanted_bits(int64_t dur_ns_q12)
{
    int bits = 64 - (int)real_clz((uint64_t)dur_ns_q12) - 11;
    return bits > OTG_BITS ? OTG_BITS : bits < 8 ? 8 : bits;
}

/* --- solve --------------------------------------------------------------- */

/* A time the move cannot do without, within a factor of about four. */
static struct real least_time(const struct otg_problem *q)
{
    struct real dv = real_abs(real_sub(q->vf, q->v0));
    struct real a = real_min(q->ax, real_neg(q->an));
    struct real t = real_div(real_abs(q->d), real_max(q->vx, real_neg(q->vn)));
    if (a.m > 0) {
        t = real_max(t, real_div(dv, a));
        t = real_max(t, real_sqrt(real_div(real_abs(q->d), a)));
    }
    return t;
}

/* What is not limited is limited so far away that reaching it takes 2^-22 of
 * the move. */
static void limit_the_rest(const struct motion_otg_move *move,
                           struct otg_problem *q)
{
    if (move->limit.jerk_q16)
        return;
    struct real per_t = least_time(q);
    if (per_t.m == 0)
        per_t = real_int(1);
    per_t = real_scale(real_inv(per_t), 22);
    if (!move->limit.acc_max_q16) {
        q->ax = real_mul(real_max(q->vx, real_neg(q->vn)), per_t);
        q->an = real_neg(q->ax);
    }
    q->j = q->j2 = real_mul(real_max(q->ax, real_neg(q->an)), per_t);
}

static struct real drawn_in(struct real a, int bits)
{
    return real_sub(a, real_scale(a, -bits));
}

void motion_otg_problem_init(const struct motion_otg_move *move,
                             struct otg_draw draw, struct otg_problem *q)
{
    const struct motion_otg_limit *lim = &move->limit;
    struct wide way =
        wide_sub(wide_from(move->goal.pos_q32), wide_from(move->start.pos_q32));
    *q = (struct otg_problem){
        .d = wide_real(way, -32),
        .v0 = q32(move->start.vel_q32),
        .a0 = q16(move->start.acc_q16),
        .vf = q32(move->goal.vel_q32),
        .af = q16(move->goal.acc_q16),
        .vx = drawn_in(q32(lim->vel_max_q32), draw.vel),
        .vn = drawn_in(q32(lim->vel_min_q32), draw.vel),
        .ax = drawn_in(q16(lim->acc_max_q16), draw.acc),
        .an = drawn_in(q16(lim->acc_min_q16), draw.acc),
        .j = drawn_in(q16(lim->jerk_q16), draw.jerk),
        .j2 = drawn_in(q16(closing_jerk(lim)), draw.jerk),
    };
    limit_the_rest(move, q);
    q->per_j = real_inv(q->j);
    q->per_j2 = real_cmp(q->j, q->j2) ? real_inv(q->j2) : q->per_j;
}

static void append_reversed(struct otg_shape *end, struct real af,
                            struct otg_shape *shape)
{
    motion_otg_shape_reverse(end, 0, af);
    for (int i = 0; i < end->count; i++)
        otg_shape_add(shape, end->phase[i].dt, end->phase[i].a);
}

static struct real time_of(const struct otg_shape *shape)
{
    struct real t = real_zero();
    for (int i = 0; i < shape->count; i++)
        t = real_add(t, shape->phase[i].dt);
    return t;
}

/* Backwards in time the goal is a start. */
int motion_otg_propose(struct otg_problem q, struct real t,
                       struct otg_shape *shape, struct real *next)
{
    struct otg_shape end;
    otg_shape_init(&end);
    int err = MOTION_OK;
    motion_otg_brake(&q, shape);
    shape->brake = shape->count;
    shape->turn = -1;
    struct otg_problem back = motion_otg_reversed(&q);
    struct real af = back.a0;
    motion_otg_brake(&back, &end);
    q = motion_otg_reversed(&back);
    if (t.m == 0) {
        motion_otg_solve(&q, shape);
    } else {
        struct real ends = real_add(time_of(shape), time_of(&end));
        err = motion_otg_solve_duration(&q, real_sub(t, ends), shape, next);
        *next = real_add(*next, ends);
    }
    if (shape->turn < 0)
        shape->turn = shape->count;
    append_reversed(&end, af, shape);
    return err;
}

/* One jerk throughout: that of slowing down where the speed falls. */
static void otg_solve_velocity(struct otg_problem q, struct otg_shape *shape)
{
    struct otg_shape end;
    bool slows = real_lt(real_abs(q.vf), real_abs(q.v0));
    otg_shape_init(&end);
    q.j = q.j2 = slows ? q.j2 : q.j;
    q.per_j = q.per_j2 = slows ? q.per_j2 : q.per_j;
    motion_otg_brake_acc(&q, shape);
    struct otg_problem back = motion_otg_reversed(&q);
    struct real af = back.a0;
    motion_otg_brake_acc(&back, &end);
    q = motion_otg_reversed(&back);
    motion_otg_solve_velocity(&q, shape);
    append_reversed(&end, af, shape);
    shape->brake = shape->turn = slows ? 0 : shape->count;
}

/* Seconds to whole 2^-12 ns, up. */
static int64_t in_ns_q12(struct real t)
{
    return real_floor(real_mul(t, motion_otg_ticks_per_s()), 0) + 1;
}

static int otg_try(const struct motion_otg_move *move, struct otg_draw draw,
                   struct motion_otg_plan *plan, enum motion_otg_field *field)
{
    struct otg_problem q;
    struct otg_shape shape;
    otg_shape_init(&shape);
    struct real next = real_zero();
    struct real t = real_mul(real_int(move->dur_ns_q12), motion_otg_tick_s());
    int err = MOTION_OK;
    motion_otg_problem_init(move, draw, &q);
    if (move->mode == MOTION_OTG_VELOCITY)
        otg_solve_velocity(q, &shape);
    else
        err = motion_otg_propose(q, t, &shape, &next);
    if (err < 0) {
        plan->dur_ns_q12 = in_ns_q12(next);
        return refuse(field, MOTION_OTG_FIELD_DURATION, err);
    }
    return motion_otg_settle(move, &shape, move->dur_ns_q12, plan, field);
}

/* Further in by steps of 2^2: velocity and acceleration, the jerk, all, and all
 * with the velocity less far in: less jerk makes a start that swings beyond its limits
 * swing further, lower limits can close a way that was just open. */
struct otg_draw motion_otg_draw(int wanted, int i)
{
    int bits = wanted - 2 * ((i + 3) / 4);
    int near = (wanted + OTG_BITS) / 2;
    bits = bits < 2 ? 2 : bits;
    switch (i % 4) {
    case 1:
        return (struct otg_draw){ bits, bits, wanted };
    case 2:
        return (struct otg_draw){ wanted, wanted, bits };
    case 3:
        return (struct otg_draw){ near, bits + 2, bits + 2 };
    default:
        return (struct otg_draw){ bits, bits, bits };
    }
}

/* Without a limit on it, what a start or goal has of acceleration (velocity)
 * does not matter: it steps. */
static struct motion_otg_move
without_unlimited(const struct motion_otg_move *move)
{
    struct motion_otg_move m = *move;
    if (!m.limit.jerk_q16)
        m.start.acc_q16 = m.goal.acc_q16 = 0;
    if (!m.limit.acc_max_q16)
        m.start.vel_q32 = m.goal.vel_q32 = 0;
    return m;
}

int motion_otg_make(const struct motion_otg_move *move,
                    struct motion_otg_plan *plan, enum motion_otg_field *field)
{
    enum motion_otg_field unused;
    if (field == NULL)
        field = &unused;
    *field = MOTION_OTG_FIELD_NONE;
    int err = otg_limits_are_valid(move, field);
    if (err == MOTION_OK)
        err = otg_goal_is_possible(move, field);
    if (err < 0)
        return err;
    const struct motion_otg_move own = without_unlimited(move);
    struct motion_otg_plan made;
    struct otg_draw draw = { OTG_BITS, OTG_BITS, OTG_BITS };
    int wanted = OTG_BITS;
    for (int i = 0; i < OTG_TRIES; i++) {
        err = otg_try(&own, draw, &made, field);
        if (err == MOTION_E_RANGE || *field == MOTION_OTG_FIELD_DURATION)
            break;
        if (i == 0)
            wanted = motion_otg_wanted_bits(made.dur_ns_q12);
        if (err == MOTION_OK && (i > 0 || wanted == OTG_BITS))
            break;
        draw = motion_otg_draw(wanted, i + (wanted == OTG_BITS));
    }
    if (err == MOTION_OK)
        *plan = made;
    else if (*field == MOTION_OTG_FIELD_DURATION)
        plan->dur_ns_q12 = made.dur_ns_q12;
    return err;
}
