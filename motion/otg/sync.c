/* motion/otg/sync.c - see sync.h. */
#include <stddef.h>

#include "motion/core/err.h"
#include "motion/core/fixed.h"
#include "motion/otg/internal.h"
#include "motion/otg/sync.h"

#define SYNC_ROUNDS  64 /* two gaps per axis and a few roundings */
#define SYNC_NEAR    22 /* the search is off by 2^-27, ticks by some more */
#define SYNC_STRETCH 32 /* a plan is made 2^-32 longer as it is */
#define SYNC_LATER   24 /* 2^-24 more, where no axis says what comes next */

/* What the axes need, to 2^-27. */
struct needs {
    int64_t least[MOTION_SYNC_AXES];
    int slowest;
    int64_t given; /* by the caller */
};

/* The plan of an axis that needs all the time there is comes out a rounding
 * shorter than that: lengthen it. */
static bool is_stretched(const struct motion_otg_move *move, int64_t dur,
                         struct motion_otg_plan *plan)
{
    int64_t rest = dur - plan->dur_ns_q12;
    if (rest == 0)
        return true;
    return rest >= 0 && rest <= dur >> SYNC_STRETCH &&
           motion_otg_stretch(move, dur, plan) == MOTION_OK;
}

/* Its fastest plan, if that takes `dur`. */
static bool is_fastest(const struct motion_otg_move *move, int64_t dur,
                       struct motion_otg_plan *plan,
                       enum motion_otg_field *field)
{
    return motion_otg_make_in(move, 0, plan, field) == MOTION_OK &&
           is_stretched(move, dur, plan);
}

static bool is_near(int64_t least, int64_t dur)
{
    int64_t late = dur - least;
    return late <= dur >> SYNC_NEAR && late >= -(dur >> SYNC_NEAR);
}

/* All axes in `dur`, or the first that cannot and the next time it can.  The
 * plan of axis `made` is there already.  What has no time to spare is planned
 * in no given time (docs/OTG.md, 5), but may take just this. */
static int all_in(const struct motion_otg_move move[], int count,
                  const struct needs *needs, int made, int64_t *dur,
                  struct motion_otg_plan plan[],
                  struct motion_sync_fault *fault)
{
    for (int i = 0; i < count; i++) {
        bool was_tried = is_near(needs->least[i], *dur);
        fault->axis = i;
        if (i == made ||
            (was_tried && is_fastest(&move[i], *dur, &plan[i], &fault->field)))
            continue;
        int err = motion_otg_make_in(&move[i], *dur, &plan[i], &fault->field);
        if (err < 0) {
            const int64_t next = plan[i].dur_ns_q12;
            const enum motion_otg_field field = fault->field;
            if (!was_tried &&
                is_fastest(&move[i], *dur, &plan[i], &fault->field))
                continue;
            fault->field = field;
            *dur = next;
            return err;
        }
    }
    return MOTION_OK;
}

OTG_OWN_FRAME static int sync_time(const struct motion_otg_move move[],
                                   int count, const struct needs *needs,
                                   struct motion_otg_plan plan[],
                                   struct motion_sync_fault *fault)
{
    int64_t dur = needs->given;
    int slowest = needs->slowest, made = -1, err = MOTION_OK;
    if (dur < needs->least[slowest]) {
        fault->axis = slowest;
        err = motion_otg_make_in(&move[slowest], 0, &plan[slowest],
                                 &fault->field);
        dur = plan[slowest].dur_ns_q12;
        made = slowest;
    }
    for (int i = 0; err == MOTION_OK && i < SYNC_ROUNDS; i++) {
        int64_t now = dur;
        err = all_in(move, count, needs, made, &dur, plan, fault);
        made = -1;
        if (err != MOTION_E_LIMIT || fault->field != MOTION_OTG_FIELD_DURATION)
            return err;
        err = MOTION_OK;
        if (dur <= now)
            dur = now + (now >> SYNC_LATER) + 1;
    }
    return err == MOTION_OK ? MOTION_E_LIMIT : err;
}

/* --- straight lines -------------------------------------------------------
 *
 * On a straight line every axis does r_i times what the leading axis does, the
 * one with the longest displacement; so the limits of all, divided by r_i,
 * limit the leader, and its plan's corners times r_i are every axis's plan. */

struct line {
    const struct motion_otg_move *move;
    int count, leader;
    int64_t travel[MOTION_SYNC_AXES];
};

static bool line_init(struct line *line, const struct motion_otg_move move[],
                      int count)
{
    uint64_t longest = 0;
    line->move = move;
    line->count = count;
    for (int i = 0; i < count; i++) {
        if (move[i].mode != MOTION_OTG_POSITION ||
            motion_fixed_sub(move[i].goal.pos_q32, move[i].start.pos_q32,
                             &line->travel[i]) < 0)
            return false;
        if (motion_fixed_abs(line->travel[i]) > longest) {
            longest = motion_fixed_abs(line->travel[i]);
            line->leader = i;
        }
    }
    return longest != 0;
}

/* r of axis i. */
static struct num line_ratio(const struct line *line, int i)
{
    return num_div(num_make(line->travel[i], 0),
                   num_make(line->travel[line->leader], 0));
}

/* a = r lead, as far as one unit of the format, or 2^-30, can tell. */
static bool is_parallel(const struct line *line, int i, int64_t a, int64_t lead)
{
    int64_t target, off, most = (int64_t)(motion_fixed_abs(a) >> 30);
    if (motion_fixed_muldiv(lead, line->travel[i], line->travel[line->leader],
                            &target) < 0 ||
        motion_fixed_sub(a, target, &off) < 0)
        return false;
    return motion_fixed_abs(off) <= (uint64_t)(most > 1 ? most : 1);
}

/* Whether all states lie on the line. */
OTG_OWN_FRAME static bool line_holds(const struct line *line,
                                     struct motion_sync_fault *fault)
{
    const struct motion_otg_move *lead = &line->move[line->leader];
    for (int i = 0; i < line->count; i++) {
        const struct motion_otg_move *m = &line->move[i];
        const struct {
            enum motion_otg_field field;
            int64_t own, lead;
        } state[] = {
            { MOTION_OTG_FIELD_START_VEL, m->start.vel_q32,
              lead->start.vel_q32 },
            { MOTION_OTG_FIELD_START_ACC, m->start.acc_q32,
              lead->start.acc_q32 },
            { MOTION_OTG_FIELD_GOAL_VEL, m->goal.vel_q32, lead->goal.vel_q32 },
            { MOTION_OTG_FIELD_GOAL_ACC, m->goal.acc_q32, lead->goal.acc_q32 },
        };
        fault->axis = i;
        for (size_t k = 0; k < sizeof state / sizeof state[0]; k++) {
            fault->field = state[k].field;
            if (!is_parallel(line, i, state[k].own, state[k].lead))
                return false;
        }
    }
    return true;
}

/* Tighten [*low, *high] to what `limit` of an axis leaves, r_i = 1 / per_r. */
static void narrow(struct num per_r, struct num low, struct num high,
                   struct num *lead_low, struct num *lead_high)
{
    struct num a = num_mul(low, per_r), b = num_mul(high, per_r);
    *lead_low = num_max(*lead_low, num_min(a, b));
    *lead_high = num_min(*lead_high, num_max(a, b));
}

OTG_OWN_FRAME static void line_problem(const struct line *line,
                                       struct otg_margin margin,
                                       struct otg_problem *q)
{
    motion_otg_problem_init(&line->move[line->leader], margin, q);
    q->exact = NULL;
    for (int i = 0; i < line->count; i++) {
        struct otg_problem axis;
        if (line->travel[i] == 0 || i == line->leader)
            continue;
        struct num per_r = num_inv(line_ratio(line, i));
        motion_otg_problem_init(&line->move[i], margin, &axis);
        narrow(per_r, axis.vn, axis.vx, &q->vn, &q->vx);
        narrow(per_r, axis.an, axis.ax, &q->an, &q->ax);
        per_r = num_abs(per_r);
        q->j = num_min(q->j, num_mul(axis.j, per_r));
        q->j2 = num_min(q->j2, num_mul(axis.j2, per_r));
    }
    q->per_j = num_inv(q->j);
    q->per_j2 = num_inv(q->j2);
}

/* The leader's shape times r, as the axis's plan in `dur` (0: what comes). */
static int line_axis(const struct line *line, int i,
                     const struct otg_problem *lead,
                     const struct otg_shape *shape, int64_t dur,
                     struct motion_otg_plan *plan, enum motion_otg_field *field)
{
    struct otg_shape own = *shape;
    struct otg_problem q = *lead;
    struct num r = line_ratio(line, i);
    q.d = num_mul(q.d, r);
    q.v0 = num_mul(q.v0, r);
    q.a0 = num_mul(q.a0, r);
    q.j = num_mul(q.j, num_abs(r));
    q.j2 = num_mul(q.j2, num_abs(r));
    motion_otg_shape_scale(&own, 0, r);
    for (int k = 0; k < 2 && r.m < 0; k++)
        own.free.is_peak[k] = !own.free.is_peak[k];
    return motion_otg_settle(&line->move[i], &q, &own, dur, plan, field);
}

/* The leader comes first: without a given duration it gives one. */
static int line_try(const struct line *line, struct otg_margin margin,
                    int64_t shortest, struct motion_otg_plan plan[],
                    struct motion_sync_fault *fault)
{
    struct otg_problem q;
    struct otg_shape shape;
    int64_t dur = shortest;
    struct num next = num_zero();
    otg_shape_init(&shape);
    line_problem(line, margin, &q);
    int err = motion_otg_propose(&q, motion_otg_seconds(dur), &shape, &next);
    if (err < 0)
        return err;
    if (dur == 0) {
        fault->axis = line->leader;
        err = line_axis(line, line->leader, &q, &shape, 0, &plan[line->leader],
                        &fault->field);
        dur = plan[line->leader].dur_ns_q12;
    }
    for (int i = 0; i < line->count && err == MOTION_OK; i++) {
        fault->axis = i;
        err = line_axis(line, i, &q, &shape, dur, &plan[i], &fault->field);
    }
    return err;
}

/* As motion_otg_make, on the line. */
OTG_OWN_FRAME static int sync_line(const struct motion_otg_move move[],
                                   int count, const struct needs *needs,
                                   struct motion_otg_plan plan[],
                                   struct motion_sync_fault *fault)
{
    struct line line;
    if (!line_init(&line, move, count) || !line_holds(&line, fault))
        return MOTION_E_LIMIT;
    int err = MOTION_OK;
    int finest = motion_otg_margin_bits(needs->least[needs->slowest]);
    for (int i = 0; i < OTG_MARGINS; i++) {
        err = line_try(&line, motion_otg_margin(finest, i), needs->given, plan,
                       fault);
        if (err != MOTION_E_LIMIT)
            break;
    }
    return err;
}

/* Each as fast as it can. */
static int sync_none(const struct motion_otg_move move[], int count,
                     struct motion_otg_plan plan[],
                     struct motion_sync_fault *fault)
{
    int err = MOTION_OK;
    for (int i = 0; i < count && err == MOTION_OK; i++) {
        fault->axis = i;
        err = motion_otg_make_in(&move[i], 0, &plan[i], &fault->field);
    }
    return err;
}

OTG_OWN_FRAME static int find_needs(const struct motion_otg_move move[],
                                    int count, struct needs *needs,
                                    struct motion_sync_fault *fault)
{
    needs->slowest = 0;
    needs->given = 0;
    for (int i = 0; i < count; i++) {
        fault->axis = i;
        fault->field = MOTION_OTG_FIELD_DURATION;
        if (move[i].mode == MOTION_OTG_VELOCITY)
            return MOTION_E_ARG;
        int err = motion_otg_least(&move[i], &needs->least[i], &fault->field);
        if (err < 0)
            return err;
        if (needs->least[i] > needs->least[needs->slowest])
            needs->slowest = i;
        if (move[i].dur_ns_q12 > needs->given)
            needs->given = move[i].dur_ns_q12;
    }
    return MOTION_OK;
}

int motion_sync_make(const struct motion_otg_move move[], int count,
                     enum motion_sync_kind kind, struct motion_otg_plan plan[],
                     struct motion_sync_fault *fault)
{
    struct motion_sync_fault unused;
    struct needs needs;
    if (fault == NULL)
        fault = &unused;
    *fault = (struct motion_sync_fault){ 0, MOTION_OTG_FIELD_NONE };
    if (count < 1 || count > MOTION_SYNC_AXES)
        return MOTION_E_ARG;
    if (kind == MOTION_SYNC_NONE)
        return sync_none(move, count, plan, fault);
    int err = find_needs(move, count, &needs, fault);
    if (err < 0)
        return err;
    if (needs.least[needs.slowest] == 0 && needs.given == 0)
        return sync_none(move, count, plan, fault);
    if (kind == MOTION_SYNC_PHASE || kind == MOTION_SYNC_STRAIGHT) {
        err = sync_line(move, count, &needs, plan, fault);
        if (err == MOTION_OK || kind == MOTION_SYNC_STRAIGHT)
            return err;
    }
    *fault = (struct motion_sync_fault){ 0, MOTION_OTG_FIELD_NONE };
    return sync_time(move, count, &needs, plan, fault);
}

/* --- through points ------------------------------------------------------- */

#define THROUGH_SWEEPS 2 /* over all points, first to last */

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

static struct num displacement(const struct through *th, int i, int axis)
{
    return num_sub(num_make(position_of(th, i, axis), -32),
                   num_make(position_of(th, i - 1, axis), -32));
}

/* sqrt(a d) is what half the displacement d reaches at acceleration a; at most
 * 7/8 of the limit, so that the point can also be left faster. */
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
        struct num before = displacement(th, i, k);
        struct num after = displacement(th, i + 1, k);
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
