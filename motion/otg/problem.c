/* motion/otg/problem.c - a request in short reals, its limits drawn in.
 *
 * The room that drawing in leaves takes up the rounding to whole ticks and
 * units; by how much, and what is tried when it was not enough, is said
 * here. */
#include "motion/core/fixed.h"
#include "motion/otg/internal.h"

#define PROBLEM_MOST_PER_S 32 /* the shortest ramp: 2^-32 s, 954 ticks */
#define PROBLEM_TICKS      11 /* 2^11 of them (1/8 ns) are little */

/* Limits are drawn in by 2^-25, or for a move of few ticks by what 2^11 ticks
 * (1/8 ns) are of it. */
int motion_otg_wanted_bits(int64_t dur_ns_q12)
{
    int bits = 64 - (int)motion_real_clz((uint64_t)dur_ns_q12) - PROBLEM_TICKS;
    return bits > OTG_BITS ? OTG_BITS : bits < 8 ? 8 : bits;
}

/* Further in by steps of 2^2: velocity and acceleration, the jerk, all, and all
 * with the velocity less far in: less jerk makes a start that swings beyond its
 * limits swing further, lower limits can close a way that was just open. */
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
static int64_t capped(int64_t acc_q32)
{
    if (acc_q32 > MOTION_TRACK_ACC_MAX_Q32)
        return MOTION_TRACK_ACC_MAX_Q32;
    return acc_q32 < -MOTION_TRACK_ACC_MAX_Q32 ? -MOTION_TRACK_ACC_MAX_Q32
                                               : acc_q32;
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
    q->a0 = num_make(move->start.acc_q32, -32);
    q->vf = num_make(move->goal.vel_q32, -32);
    q->af = num_make(move->goal.acc_q32, -32);
    draw_limits(lim->vel_max_q32, lim->vel_min_q32, 32, draw.vel, &q->vx,
                &q->vn);
    draw_limits(capped(lim->acc_max_q32), capped(lim->acc_min_q32), 32,
                draw.acc, &q->ax, &q->an);
    q->j = q->j2 = drawn_in(num_make(lim->jerk_q32, -32), draw.jerk);
    q->jerk_bits = draw.jerk;
    if (lim->jerk_down_q32)
        q->j2 = drawn_in(num_make(lim->jerk_down_q32, -32), draw.jerk);
    q->is_unit = false;
    q->is_strict = draw.is_strict;
    q->exact = move;
    q->is_no_lens = false;
    limit_the_rest(move, q);
    q->per_j = q->per_j2 = num_inv(q->j);
    if (lim->jerk_down_q32)
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
