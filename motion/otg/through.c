/* motion/otg/through.c - see through.h. */
#include "motion/otg/through.h"

#include <stddef.h>

#include "motion/core/err.h"
#include "motion/otg/internal.h"

#define THROUGH_SWEEPS 2

struct through {
    const struct motion_state *start;
    const struct motion_otg_limit *limit;
    int axes, points;
    struct motion_otg_point *point;
    struct motion_otg_plan *plan;
    struct motion_sync_fault *fault;
};

static struct motion_otg_point *point_of(const struct through *th, int i,
                                         int axis)
{
    return &th->point[(size_t)i * (size_t)th->axes + (size_t)axis];
}

/* Plans of the move that ends at point i. */
static struct motion_otg_plan *plans_to(const struct through *th, int i)
{
    return th->plan + (size_t)i * (size_t)th->axes;
}

static int64_t position_of(const struct through *th, int i, int axis)
{
    return i < 0 ? th->start[axis].pos_q32 : point_of(th, i, axis)->pos_q32;
}

/* The move that ends at point i, into its plans. */
static int move_to(const struct through *th, int i)
{
    struct motion_otg_move move[MOTION_SYNC_AXES];
    for (int k = 0; k < th->axes; k++) {
        move[k] = (struct motion_otg_move){ .limit = th->limit[k] };
        move[k].start.pos_q32 = position_of(th, i - 1, k);
        if (i == 0)
            move[k].start = th->start[k];
        else
            move[k].start.vel_q32 = point_of(th, i - 1, k)->vel_q32;
        move[k].goal.pos_q32 = point_of(th, i, k)->pos_q32;
        move[k].goal.vel_q32 = point_of(th, i, k)->vel_q32;
    }
    return motion_sync_make(move, th->axes, MOTION_SYNC_TIME, plans_to(th, i),
                            th->fault);
}

static struct num way_between(const struct through *th, int i, int axis)
{
    return num_sub(num_make(position_of(th, i, axis), -32),
                   num_make(position_of(th, i - 1, axis), -32));
}

/* sqrt(a d) is what half the way d reaches at acceleration a; at most 7/8 of
 * the limit, so that the point can also be left faster. */
static int64_t reachable(const struct motion_otg_limit *limit, struct num d,
                         bool up)
{
    int64_t vel = up ? limit->vel_max_q32 : -limit->vel_min_q32;
    int64_t acc = limit->acc_max_q32 < -limit->acc_min_q32
                      ? limit->acc_max_q32
                      : -limit->acc_min_q32;
    struct num a = num_make(acc, -32);
    struct num v = num_sqrt(num_mul(a, num_abs(d)));
    int64_t most = vel - (vel >> 3);
    int64_t can = motion_real_floor_clamped(num_real(v), 32);
    can = acc == 0 || can > most ? most : can;
    return up ? can : -can;
}

/* Velocity of every axis at point i, times share / 4. */
static void choose(const struct through *th, int i, int share)
{
    for (int k = 0; k < th->axes; k++) {
        struct motion_otg_point *p = point_of(th, i, k);
        if (p->has_vel)
            continue;
        p->vel_q32 = 0;
        if (i + 1 == th->points)
            continue;
        struct num before = way_between(th, i, k);
        struct num after = way_between(th, i + 1, k);
        if (before.m == 0 || after.m == 0 || (before.m > 0) != (after.m > 0))
            continue;
        struct num d = num_min(num_abs(before), num_abs(after));
        p->vel_q32 = reachable(&th->limit[k], d, before.m > 0) / 4 * share;
    }
}

/* Time of the two moves at point i; -1 when there is none. */
static int64_t time_about(const struct through *th, int i)
{
    if (move_to(th, i) < 0)
        return -1;
    int64_t t = plans_to(th, i)->dur_ns_q12;
    if (i + 1 == th->points)
        return t;
    if (move_to(th, i + 1) < 0)
        return -1;
    return t + plans_to(th, i + 1)->dur_ns_q12;
}

static void settle(const struct through *th, int i)
{
    int best = 0;
    int64_t least = -1;
    for (int share = 0; share <= 4; share++) {
        choose(th, i, share);
        int64_t t = time_about(th, i);
        if (t >= 0 && (least < 0 || t < least)) {
            least = t;
            best = share;
        }
    }
    choose(th, i, best);
}

/* Before a velocity is chosen: the limits and the start of every axis. */
static int are_valid(const struct through *th)
{
    for (int k = 0; k < th->axes; k++) {
        const struct motion_otg_move move = { .start = th->start[k],
                                              .limit = th->limit[k] };
        int err = motion_otg_is_valid(&move, &th->fault->field);
        th->fault->axis = k;
        if (err < 0)
            return err;
    }
    return MOTION_OK;
}

int motion_otg_through(const struct motion_state start[],
                       const struct motion_otg_limit limit[], int axes,
                       struct motion_otg_point point[], int points,
                       struct motion_otg_plan plan[], int *failed,
                       struct motion_sync_fault *fault)
{
    struct motion_sync_fault unused;
    struct through th = {
        start, limit, axes, points, point, plan, fault ? fault : &unused
    };
    *th.fault = (struct motion_sync_fault){ 0, MOTION_OTG_FIELD_NONE };
    if (failed)
        *failed = 0;
    if (axes < 1 || axes > MOTION_SYNC_AXES || points < 1)
        return MOTION_E_ARG;
    int valid = are_valid(&th);
    if (valid < 0)
        return valid;
    for (int i = 0; i < points; i++)
        choose(&th, i, 2);
    for (int sweep = 0; sweep < THROUGH_SWEEPS; sweep++)
        for (int i = 0; i + 1 < points; i++)
            settle(&th, i);
    for (int i = 0; i < points; i++) {
        int err = move_to(&th, i);
        if (err < 0) {
            if (failed)
                *failed = i;
            return err;
        }
    }
    return MOTION_OK;
}
