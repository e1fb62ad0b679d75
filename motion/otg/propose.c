/* motion/otg/propose.c - the whole motion in short reals.
 *
 *   brake both ends inside  ->  solve what is between  ->  put the goal's end
 *   behind it */
#include <stddef.h>

#include "motion/core/err.h"
#include "motion/otg/internal.h"

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

struct num motion_otg_shape_time(const struct otg_shape *shape)
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
        t = num_sub(t, num_add(motion_otg_shape_time(shape), end_time(end)));
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
           motion_otg_lens_is_near(q, num_zero()) &&
           motion_otg_start_fits(q->exact);
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
    motion_otg_brake_acc(&q, shape);
    motion_otg_solve_velocity(&q, shape);
    end_append(&end, shape);
    shape->brake = shape->turn = slows ? from : shape->count;
}
