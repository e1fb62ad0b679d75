/* motion/otg/sync.c - see sync.h. */
#include "motion/otg/sync.h"

#include <stddef.h>

#include "motion/core/err.h"
#include "motion/core/fixed.h"
#include "motion/otg/internal.h"

#define SYNC_ROUNDS 64 /* two gaps per axis and a few roundings */

/* What the axes need, to 2^-27. */
struct needs {
    int64_t least[MOTION_SYNC_AXES];
    int slowest;
    int64_t wanted; /* by the caller */
};

/* The plan of an axis that needs all the time there is comes out a rounding
 * shorter than that: lengthen it. */
static bool is_stretched(const struct motion_otg_move *move, int64_t dur,
                         struct motion_otg_plan *plan)
{
    int64_t rest = dur - plan->dur_ns_q12;
    if (rest == 0)
        return true;
    return rest >= 0 && rest <= dur >> 32 &&
           motion_otg_stretch(move, dur, plan) == MOTION_OK;
}

static bool is_near(int64_t least, int64_t dur)
{
    int64_t late = dur - least;
    return late <= dur >> 22 && late >= -(dur >> 22);
}

/* All axes in `dur`, or the first that cannot and the next time it can.  The
 * fastest plan of axis `made` is there already. */
static int all_in(const struct motion_otg_move move[], int count,
                  const struct needs *needs, int made, int64_t *dur,
                  struct motion_otg_plan plan[],
                  struct motion_sync_fault *fault)
{
    for (int i = 0; i < count; i++) {
        fault->axis = i;
        if (is_near(needs->least[i], *dur) &&
            (i == made || motion_otg_make_in(&move[i], 0, &plan[i],
                                             &fault->field) == MOTION_OK) &&
            is_stretched(&move[i], *dur, &plan[i]))
            continue;
        int err = motion_otg_make_in(&move[i], *dur, &plan[i], &fault->field);
        if (err < 0) {
            *dur = plan[i].dur_ns_q12;
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
    int64_t dur = needs->wanted;
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
            dur = now + (now >> 24) + 1;
    }
    return err == MOTION_OK ? MOTION_E_LIMIT : err;
}

/* --- straight lines -------------------------------------------------------
 *
 * On a straight line every axis does r_i times what the leading axis does, the
 * one with the longest way; so the limits of all, divided by r_i, limit the
 * leader, and its plan's corners times r_i are every axis's plan. */

struct line {
    const struct motion_otg_move *move;
    int count, leader;
    int64_t way[MOTION_SYNC_AXES];
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
                             &line->way[i]) < 0)
            return false;
        if (motion_fixed_abs(line->way[i]) > longest) {
            longest = motion_fixed_abs(line->way[i]);
            line->leader = i;
        }
    }
    return longest != 0;
}

/* r of axis i. */
static struct num line_ratio(const struct line *line, int i)
{
    return num_div(num_make(line->way[i], 0),
                   num_make(line->way[line->leader], 0));
}

/* a = r lead, as far as one unit of the format, or 2^-30, can tell. */
static bool is_parallel(const struct line *line, int i, int64_t a, int64_t lead)
{
    int64_t want, off, most = (int64_t)(motion_fixed_abs(a) >> 30);
    if (motion_fixed_muldiv(lead, line->way[i], line->way[line->leader],
                            &want) < 0 ||
        motion_fixed_sub(a, want, &off) < 0)
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
                                       struct otg_draw draw,
                                       struct otg_problem *q)
{
    motion_otg_problem_init(&line->move[line->leader], draw, q);
    q->exact = NULL;
    for (int i = 0; i < line->count; i++) {
        struct otg_problem axis;
        if (line->way[i] == 0 || i == line->leader)
            continue;
        struct num per_r = num_inv(line_ratio(line, i));
        motion_otg_problem_init(&line->move[i], draw, &axis);
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
        own.knobs.is_peak[k] = !own.knobs.is_peak[k];
    return motion_otg_settle(&line->move[i], &q, &own, dur, plan, field);
}

/* The leader comes first: without a duration asked for it gives one. */
static int line_try(const struct line *line, struct otg_draw draw,
                    int64_t shortest, struct motion_otg_plan plan[],
                    struct motion_sync_fault *fault)
{
    struct otg_problem q;
    struct otg_shape shape;
    int64_t dur = shortest;
    struct num next = num_zero();
    otg_shape_init(&shape);
    line_problem(line, draw, &q);
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
    int wanted = motion_otg_wanted_bits(needs->least[needs->slowest]);
    for (int i = 0; i < OTG_TRIES; i++) {
        err = line_try(&line, motion_otg_draw(wanted, i), needs->wanted, plan,
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
    needs->wanted = 0;
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
        if (move[i].dur_ns_q12 > needs->wanted)
            needs->wanted = move[i].dur_ns_q12;
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
    if (needs.least[needs.slowest] == 0 && needs.wanted == 0)
        return sync_none(move, count, plan, fault);
    if (kind == MOTION_SYNC_PHASE || kind == MOTION_SYNC_STRAIGHT) {
        err = sync_line(move, count, &needs, plan, fault);
        if (err == MOTION_OK || kind == MOTION_SYNC_STRAIGHT)
            return err;
    }
    *fault = (struct motion_sync_fault){ 0, MOTION_OTG_FIELD_NONE };
    return sync_time(move, count, &needs, plan, fault);
}
