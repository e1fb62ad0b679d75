/* motion/otg.c - see otg.h.
 *
 *   judge the request  ->  reals, limits drawn in  ->  brake both ends inside
 *   ->  solve  ->  whole ticks  ->  check; draw in further while it fails */
#include "motion/otg.h"

#include <stddef.h>

#include "motion/err.h"
#include "motion/otg_internal.h"

#define OTG_BITS        25 /* limits are drawn in by 2^-25 */
#define OTG_MOST_PER_S  32 /* the shortest ramp: 2^-32 s, 954 ticks */
#define OTG_HURRY       20 /* at first no more than 2^-20 longer, and a ns */
#define OTG_HURRY_TICKS 4096
#define OTG_ROOT        8  /* of what drawing in takes: 2^-8 of the time */
#define OTG_LATER       16 /* durations tried when the shortest has no plan */
#define OTG_SOON        6  /* of these before all draws are tried */
#define OTG_WAIT        4  /* the second is 2^4 ticks more */

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
    if (move->dur_ns_q12 < 0 || (!vel && move->dur_ns_q12 != 0))
        return refuse(field, MOTION_OTG_FIELD_DURATION, MOTION_E_ARG);
    return MOTION_OK;
}

/* What the formats hold, but has no negative, or no place in a track. */
static int otg_fits_formats(const struct motion_otg_move *move,
                            enum motion_otg_field *field)
{
    const struct motion_otg_limit *lim = &move->limit;
    const struct motion_state *start = &move->start, *goal = &move->goal;
    if (lim->vel_min_q32 == INT64_MIN)
        return refuse(field, MOTION_OTG_FIELD_VEL_MIN, MOTION_E_RANGE);
    if (lim->acc_min_q16 == INT64_MIN)
        return refuse(field, MOTION_OTG_FIELD_ACC_MIN, MOTION_E_RANGE);
    if (start->vel_q32 == INT64_MIN)
        return refuse(field, MOTION_OTG_FIELD_START_VEL, MOTION_E_RANGE);
    if (motion_fixed_abs(start->acc_q16) > MOTION_TRACK_ACC_MAX_Q16)
        return refuse(field, MOTION_OTG_FIELD_START_ACC, MOTION_E_RANGE);
    if (goal->vel_q32 == INT64_MIN)
        return refuse(field, MOTION_OTG_FIELD_GOAL_VEL, MOTION_E_RANGE);
    if (motion_fixed_abs(goal->acc_q16) > MOTION_TRACK_ACC_MAX_Q16)
        return refuse(field, MOTION_OTG_FIELD_GOAL_ACC, MOTION_E_RANGE);
    return MOTION_OK;
}

static int64_t closing_jerk(const struct motion_otg_limit *lim)
{
    return lim->jerk_down_q16 ? lim->jerk_down_q16 : lim->jerk_q16;
}

/* The ramp down from `acc` fits below `limit`, or is too long by no more than
 * 2^-40 of the velocities and a unit: numbers that come rounded from elsewhere may tie. */
static bool otg_ramp_fits(int64_t vel_q32, int64_t acc_q16, int64_t jerk_q16,
                          int64_t limit_q32)
{
    uint64_t room = (uint64_t)limit_q32 - (uint64_t)vel_q32;
    uint64_t tie = (motion_fixed_abs(limit_q32) >> 40) + 1;
    return jerk_q16 == 0 || motion_otg_ramp_fits(acc_q16, jerk_q16, room + tie);
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
    if ((goal->acc_q16 < 0 && !otg_ramp_fits(goal->vel_q32, goal->acc_q16, jerk,
                                             lim->vel_max_q32)) ||
        (goal->acc_q16 > 0 && !otg_ramp_fits(-goal->vel_q32, goal->acc_q16,
                                             jerk, -lim->vel_min_q32)))
        return refuse(field, MOTION_OTG_FIELD_GOAL_ACC, MOTION_E_LIMIT);
    return MOTION_OK;
}

/* Whether the start can stay inside the limits as they are. */
static bool otg_start_fits(const struct motion_otg_move *move)
{
    const struct motion_otg_limit *lim = &move->limit;
    const struct motion_state *start = &move->start;
    int64_t vel = start->vel_q32, acc = start->acc_q16;
    if (vel > lim->vel_max_q32 || vel < lim->vel_min_q32)
        return false;
    return acc > 0 ? otg_ramp_fits(vel, acc, lim->jerk_q16, lim->vel_max_q32)
                   : otg_ramp_fits(-vel, acc, lim->jerk_q16, -lim->vel_min_q32);
}

/* Limits are drawn in by 2^-25, or for a move of few ticks by what 2^11 ticks
 * (1/8 ns) are of it. */
int motion_otg_wanted_bits(int64_t dur_ns_q12)
{
    int bits = 64 - (int)motion_real_clz((uint64_t)dur_ns_q12) - 11;
    return bits > OTG_BITS ? OTG_BITS : bits < 8 ? 8 : bits;
}

/* --- solve --------------------------------------------------------------- */

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
    if (move->limit.jerk_q16)
        return;
    struct num per_t = least_time(q);
    if (per_t.m == 0)
        per_t = num_one();
    per_t = num_scale(num_inv(per_t), 22);
    per_t = num_min(per_t, num_scale(num_one(), OTG_MOST_PER_S));
    if (!move->limit.acc_max_q16) {
        q->ax = num_mul(num_max(q->vx, num_neg(q->vn)), per_t);
        q->an = num_neg(q->ax);
    }
    q->j = q->j2 = num_mul(num_max(q->ax, num_neg(q->an)), per_t);
}

/* Towards zero by 2^-bits of it, rounded up; 2 <= bits <= 29. */
static struct num drawn_in(struct num a, int bits)
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
static int64_t capped(int64_t acc_q16)
{
    if (acc_q16 > MOTION_TRACK_ACC_MAX_Q16)
        return MOTION_TRACK_ACC_MAX_Q16;
    return acc_q16 < -MOTION_TRACK_ACC_MAX_Q16 ? -MOTION_TRACK_ACC_MAX_Q16
                                               : acc_q16;
}

/* A limit upwards and the one downwards, which often is the same. */
static void draw_limits(int64_t up, int64_t down, int scale, int bits,
                        struct num *most, struct num *least)
{
    *most = drawn_in(num_make(up, -scale), bits);
    *least = (uint64_t)up + (uint64_t)down == 0
                 ? num_neg(*most)
                 : drawn_in(num_make(down, -scale), bits);
}

/* a - b in Q32; the difference of two int64 needs 65 bits. */
static struct num between_q32(int64_t a, int64_t b)
{
    int64_t way;
    if (!__builtin_sub_overflow(a, b, &way))
        return num_make(way, -32);
    return num_make((a >> 1) - (b >> 1), -31);
}

void motion_otg_problem_init(const struct motion_otg_move *move,
                             struct otg_draw draw, struct otg_problem *q)
{
    const struct motion_otg_limit *lim = &move->limit;
    q->d = between_q32(move->goal.pos_q32, move->start.pos_q32);
    q->dv = between_q32(move->goal.vel_q32, move->start.vel_q32);
    q->v0 = num_make(move->start.vel_q32, -32);
    q->a0 = num_make(move->start.acc_q16, -16);
    q->vf = num_make(move->goal.vel_q32, -32);
    q->af = num_make(move->goal.acc_q16, -16);
    draw_limits(lim->vel_max_q32, lim->vel_min_q32, 32, draw.vel, &q->vx,
                &q->vn);
    draw_limits(capped(lim->acc_max_q16), capped(lim->acc_min_q16), 16,
                draw.acc, &q->ax, &q->an);
    q->j = q->j2 = drawn_in(num_make(lim->jerk_q16, -16), draw.jerk);
    q->jerk_bits = draw.jerk;
    if (lim->jerk_down_q16)
        q->j2 = drawn_in(num_make(lim->jerk_down_q16, -16), draw.jerk);
    q->is_unit = false;
    q->is_strict = draw.is_strict;
    q->exact = move;
    q->is_no_lens = false;
    limit_the_rest(move, q);
    q->per_j = q->per_j2 = num_inv(q->j);
    if (lim->jerk_down_q16)
        q->per_j2 = num_inv(q->j2);
}

void motion_otg_reverse(struct otg_problem *q)
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

/* Backwards in time the goal is a start; what braking there adds is kept until
 * the rest of the shape is there. */
#define END_PHASES 4

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
    motion_otg_reverse(q);
    if (acc_alone)
        motion_otg_brake_acc(q, shape);
    else
        motion_otg_brake(q, shape);
    motion_otg_reverse(q);
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

static struct num time_of(const struct otg_shape *shape)
{
    struct num t = num_zero();
    for (int i = 0; i < shape->count; i++)
        if (shape->phase[i].dt.m != 0)
            t = num_add(t, shape->phase[i].dt);
    return t;
}

/* An end that is outside only because limits are drawn in has no time to brake
 * where the acceleration stays on its side of zero: velocities between those of
 * start and goal are inside.  Without such a motion all is as before. */
OTG_OWN_FRAME static bool propose_lens(struct otg_problem *q, struct num t,
                                       struct end *end, struct otg_shape *shape)
{
    const struct num d = q->d, v0 = q->v0, a0 = q->a0, vf = q->vf, af = q->af;
    const struct num dv = q->dv;
    end->count = 0;
    if (num_lt(q->ax, q->af) || num_lt(q->af, q->an))
        end_brake(q, shape, true, end);
    motion_otg_brake_acc(q, shape);
    shape->brake = shape->count;
    if (t.m != 0)
        t = num_sub(t, num_add(time_of(shape), end_time(end)));
    if (motion_otg_solve_lens(q, t, shape)) {
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
    q->is_no_lens = true;
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

/* With one jerk: two are not worth the room that another problem takes. */
static bool may_keep_side(const struct otg_problem *q)
{
    return q->is_unit && q->a0.m != 0 && q->af.m != 0 &&
           (q->a0.m < 0) == (q->af.m < 0) && q->exact != NULL &&
           motion_otg_lens_is_near(q, num_zero()) && otg_start_fits(q->exact);
}

static int propose_all(struct otg_problem *q, struct num t,
                       struct otg_shape *shape, struct num *next)
{
    struct end end;
    bool starts = motion_otg_is_start_inside(q);
    bool ends = motion_otg_is_goal_inside(q);
    if (!(starts && ends) && may_keep_side(q) &&
        propose_lens(q, t, &end, shape))
        return MOTION_OK;
    end.count = 0;
    if (!ends)
        end_brake(q, shape, false, &end);
    if (!starts)
        motion_otg_brake(q, shape);
    shape->brake = shape->count;
    shape->turn = -1;
    struct num outside = num_zero();
    if (t.m != 0)
        outside = num_add(time_of(shape), end_time(&end));
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

/* A start that slows down only after it has come to its highest speed gets there
 * with the jerk of speeding up.  Returns how long that takes, or zero. */
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

/* One jerk from there on: that of slowing down where the speed falls. */
OTG_OWN_FRAME static void otg_solve_velocity(const struct otg_problem *problem,
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
    motion_otg_brake_acc(&q, shape);
    motion_otg_solve_velocity(&q, shape);
    end_append(&end, shape);
    shape->brake = shape->turn = slows ? from : shape->count;
}

/* Seconds to whole 2^-12 ns, up by more than the search is off and so much that
 * there is something to choose from. */
static int64_t in_ns_q12(struct num t)
{
    struct num up = num_add(t, num_scale(t, -23));
    return motion_real_floor_clamped(num_real(num_mul(up, ticks_per_s)), 0) + 1;
}

static bool is_there(const struct motion_otg_move *move)
{
    const struct motion_state *start = &move->start, *goal = &move->goal;
    return (move->mode == MOTION_OTG_VELOCITY ||
            start->pos_q32 == goal->pos_q32) &&
           start->vel_q32 == goal->vel_q32 && start->acc_q16 == goal->acc_q16;
}

/* The shape of the motion, for a position or a velocity. */
static int otg_shape_of(const struct motion_otg_move *move,
                        struct otg_problem *q, int64_t dur_ns_q12,
                        struct otg_shape *shape, struct num *next)
{
    otg_shape_init(shape);
    if (dur_ns_q12 == 0 && is_there(move))
        return MOTION_OK;
    if (move->mode == MOTION_OTG_POSITION)
        return motion_otg_propose(q, motion_otg_seconds(dur_ns_q12), shape,
                                  next);
    otg_solve_velocity(q, shape);
    return MOTION_OK;
}

/* The plan's duration is the proposal's where the answer is MOTION_E_LIMIT; one
 * above `most` is not made good, nor one that is on an edge when that is asked. */
static int otg_try(const struct motion_otg_move *move, int64_t dur_ns_q12,
                   struct otg_draw draw, int64_t most, bool *is_edge,
                   struct motion_otg_plan *plan, enum motion_otg_field *field)
{
    struct otg_problem q;
    struct otg_shape shape;
    struct num next = num_zero();
    motion_otg_problem_init(move, draw, &q);
    int err = otg_shape_of(move, &q, dur_ns_q12, &shape, &next);
    if (err < 0) {
        plan->dur_ns_q12 = in_ns_q12(next);
        return refuse(field, MOTION_OTG_FIELD_DURATION, err);
    }
    err = MOTION_E_LIMIT;
    if (is_edge)
        *is_edge = shape.is_edge;
    if (is_edge && *is_edge)
        *field = MOTION_OTG_FIELD_GOAL_POS;
    else if (most == INT64_MAX || in_ns_q12(time_of(&shape)) <= most)
        err = motion_otg_settle(move, &q, &shape, dur_ns_q12, plan, field);
    if (err == MOTION_E_LIMIT)
        plan->dur_ns_q12 = in_ns_q12(time_of(&shape));
    return err;
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
        return (struct otg_draw){ bits, bits, wanted, false };
    case 2:
        return (struct otg_draw){ OTG_BITS, OTG_BITS, bits, false };
    case 3:
        return (struct otg_draw){ near, bits + 2, bits + 2, false };
    default:
        return (struct otg_draw){ bits, bits, bits, false };
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

int motion_otg_is_valid(const struct motion_otg_move *move,
                        enum motion_otg_field *field)
{
    *field = MOTION_OTG_FIELD_NONE;
    int err = otg_limits_are_valid(move, field);
    if (err == MOTION_OK)
        err = otg_fits_formats(move, field);
    return err < 0 ? err : otg_goal_is_possible(move, field);
}

static int64_t least_of(const struct motion_otg_move *move)
{
    static const struct otg_draw draw = { OTG_BITS, OTG_BITS, OTG_BITS, false };
    struct otg_problem q;
    struct otg_shape shape;
    struct num next;
    motion_otg_problem_init(move, draw, &q);
    (void)otg_shape_of(move, &q, 0, &shape, &next);
    struct num t = num_mul(time_of(&shape), ticks_per_s);
    return motion_real_floor_clamped(num_real(t), 0);
}

OTG_OWN_FRAME static int64_t least_unlimited(const struct motion_otg_move *move)
{
    const struct motion_otg_move own = without_unlimited(move);
    return least_of(&own);
}

int motion_otg_least(const struct motion_otg_move *move, int64_t *dur_ns_q12,
                     enum motion_otg_field *field)
{
    int err = motion_otg_is_valid(move, field);
    if (err == MOTION_OK)
        *dur_ns_q12 =
            move->limit.jerk_q16 ? least_of(move) : least_unlimited(move);
    return err;
}

int motion_otg_make(const struct motion_otg_move *move,
                    struct motion_otg_plan *plan, enum motion_otg_field *field)
{
    enum motion_otg_field unused;
    return motion_otg_make_in(move, move->dur_ns_q12, plan,
                              field ? field : &unused);
}

/* Where the way is next to what the plain change of speed covers, drawing limits in
 * costs the root of it: that is made exactly, or what is next to it, if that does not
 * take longer by more than such a root. */
OTG_OWN_FRAME static int otg_make_edge(const struct motion_otg_move *move,
                                       struct motion_otg_plan *plan,
                                       enum motion_otg_field *field)
{
    int64_t dur = plan->dur_ns_q12;
    int err = motion_otg_plain(move, plan, field);
    if (err < 0)
        err = motion_otg_edge(move, dur, plan, field);
    bool is_longer = plan->dur_ns_q12 > dur + (dur >> OTG_ROOT);
    return err == MOTION_OK && is_longer ? MOTION_E_LIMIT : err;
}

/* In a hurry what takes longer waits: lower limits can close a way that was just
 * open.  Then strictly, and then as they are. */
enum draws { DRAW_HURRY, DRAW_STRICT, DRAW_ALL };

/* One after the other with limits drawn in further; *first becomes the duration
 * of the first.  Where there is no motion of the duration it stays, and the
 * plan's duration is the next one. */
static int otg_make_drawn(const struct motion_otg_move *move,
                          int64_t dur_ns_q12, enum draws how,
                          struct motion_otg_plan *plan, int64_t *first,
                          enum motion_otg_field *field)
{
    struct otg_draw draw = { OTG_BITS, OTG_BITS, OTG_BITS, how == DRAW_STRICT };
    int64_t most = INT64_MAX;
    int wanted = OTG_BITS;
    for (int i = 0; i < OTG_TRIES; i++) {
        bool is_edge = false;
        int err =
            otg_try(move, dur_ns_q12, draw, most,
                    i == 0 && how == DRAW_HURRY ? &is_edge : NULL, plan, field);
        if (is_edge && otg_make_edge(move, plan, field) == MOTION_OK)
            return MOTION_OK;
        if (is_edge)
            err = otg_try(move, dur_ns_q12, draw, most, NULL, plan, field);
        if (err == MOTION_OK || err == MOTION_E_RANGE)
            return err;
        if (i == 0) {
            if (*field == MOTION_OTG_FIELD_DURATION)
                return err;
            *first = plan->dur_ns_q12;
            wanted = motion_otg_wanted_bits(*first);
            if (how == DRAW_HURRY)
                most = *first + (*first >> OTG_HURRY) + OTG_HURRY_TICKS;
        }
        draw = motion_otg_draw(wanted, i + (wanted == OTG_BITS));
        draw.is_strict = how == DRAW_STRICT;
    }
    return MOTION_E_LIMIT;
}

/* The first duration from `least` on that has a plan.  The fastest motion may
 * exist for no whole number of ticks: at a given speed a way is covered in a part
 * of one, or within what the jerk allows only in times that lie between two.  So
 * wait: for a little longer, or for the next time at which there is a motion. */
static int otg_make_later(const struct motion_otg_move *move, int64_t least,
                          int tries, struct motion_otg_plan *plan,
                          enum motion_otg_field *field)
{
    int64_t dur = least;
    for (int i = 0; i <= tries; i++) {
        int64_t first = 0;
        if (dur >= MOTION_TRACK_SEGMENT_MAX_NS_Q12)
            return refuse(field, MOTION_OTG_FIELD_GOAL_POS, MOTION_E_RANGE);
        int err = otg_make_drawn(move, dur, DRAW_ALL, plan, &first, field);
        if (err == MOTION_OK || err == MOTION_E_RANGE)
            return err;
        if (tries > OTG_SOON && first == 0 && plan->dur_ns_q12 > dur)
            least = plan->dur_ns_q12;
        dur =
            least + (least >> (OTG_BITS - i)) + ((int64_t)1 << (OTG_WAIT + i));
    }
    return refuse(field, MOTION_OTG_FIELD_GOAL_POS, MOTION_E_LIMIT);
}

static int otg_make_valid(const struct motion_otg_move *move,
                          int64_t dur_ns_q12, struct motion_otg_plan *plan,
                          enum motion_otg_field *field)
{
    int64_t first = 0;
    bool hurry = move->mode == MOTION_OTG_POSITION && dur_ns_q12 == 0;
    if (move->mode == MOTION_OTG_VELOCITY &&
        motion_otg_plain(move, plan, field) == MOTION_OK)
        return MOTION_OK;
    int err = otg_make_drawn(move, dur_ns_q12, hurry ? DRAW_HURRY : DRAW_ALL,
                             plan, &first, field);
    if (err == MOTION_E_LIMIT && hurry &&
        otg_make_later(move, first, OTG_SOON, plan, field) == MOTION_OK)
        return MOTION_OK;
    if (err == MOTION_E_LIMIT && hurry)
        err =
            otg_make_drawn(move, dur_ns_q12, DRAW_STRICT, plan, &first, field);
    if (err == MOTION_E_LIMIT && hurry)
        err = otg_make_drawn(move, dur_ns_q12, DRAW_ALL, plan, &first, field);
    if (err != MOTION_E_LIMIT || move->mode != MOTION_OTG_POSITION)
        return err;
    if (dur_ns_q12 == 0)
        return otg_make_later(move, first, OTG_LATER, plan, field);
    int64_t least = dur_ns_q12 + (dur_ns_q12 >> OTG_BITS) + 1;
    if (first == 0 && plan->dur_ns_q12 > dur_ns_q12)
        least = plan->dur_ns_q12;
    err = otg_make_later(move, least, OTG_LATER, plan, field);
    return refuse(field, MOTION_OTG_FIELD_DURATION,
                  err == MOTION_E_RANGE ? err : MOTION_E_LIMIT);
}

OTG_OWN_FRAME static int otg_make_unlimited(const struct motion_otg_move *move,
                                            int64_t dur_ns_q12,
                                            struct motion_otg_plan *plan,
                                            enum motion_otg_field *field)
{
    const struct motion_otg_move own = without_unlimited(move);
    return otg_make_valid(&own, dur_ns_q12, plan, field);
}

int motion_otg_make_in(const struct motion_otg_move *move, int64_t dur_ns_q12,
                       struct motion_otg_plan *plan,
                       enum motion_otg_field *field)
{
    int err = motion_otg_is_valid(move, field);
    if (err == MOTION_OK)
        err = move->limit.jerk_q16
                  ? otg_make_valid(move, dur_ns_q12, plan, field)
                  : otg_make_unlimited(move, dur_ns_q12, plan, field);
    if (err < 0)
        plan->count = 0;
    if (err < 0 && move->mode == MOTION_OTG_VELOCITY &&
        *field == MOTION_OTG_FIELD_GOAL_POS)
        *field = MOTION_OTG_FIELD_GOAL_VEL;
    return err;
}
