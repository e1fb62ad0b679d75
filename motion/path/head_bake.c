/* motion/path/head_bake.c - see head.h.
 *
 * The angles and their first two derivatives for the baker (bake.h), from 7
 * orientations on a grid of width d (Fornberg, Mathematics of Computation 51,
 * 1988):
 *
 *     central   60 d f'  = -f-3 + 9 f-2 - 45 f-1 + 45 f1 - 9 f2 + f3
 *               180 d2 f'' = 2 f-3 - 27 f-2 + 270 f-1 - 490 f0 + ..
 *     forward   60 d f'  = -147 f0 + 360 f1 - 450 f2 + 400 f3 - 225 f4 + 72 f5
 *                          - 10 f6
 *               180 d2 f'' = 812 f0 - 3132 f1 + 5265 f2 - 5080 f3 + 2970 f4
 *                          - 972 f5 + 137 f6
 *
 * Angles are good to 2^-60 turn, so d = 1 ms leaves 1e-12 deg/s and 1e-9
 * deg/s2.  At the borders the stencil lies on the inner side.
 *
 * The baker looks at times in any order; which of the many sets of angles an
 * orientation has must not depend on that.  So each stretch between borders is
 * walked through once, in HEAD_BAKE_WALK steps, and what is asked for goes on
 * from the step before it. */
#include "motion/path/head.h"

#include "motion/core/err.h"
#include "motion/core/fixed.h"
#include "motion/curve/bake.h"
#include "motion/number/trig.h"

#define HEAD_BAKE_NODES    7
#define HEAD_BAKE_WALK     64
#define HEAD_BAKE_SHORTEST (MOTION_FIXED_S_Q12 >> 8)
#define HEAD_BAKE_STENCIL  (MOTION_FIXED_S_Q12 >> 10)

enum head_bake_side {
    HEAD_BAKE_FORWARD,
    HEAD_BAKE_CENTRAL,
    HEAD_BAKE_BACKWARD
};

static const int64_t head_bake_first[2][HEAD_BAKE_NODES] = {
    { -147, 360, -450, 400, -225, 72, -10 },
    { -1, 9, -45, 0, 45, -9, 1 },
};
static const int64_t head_bake_second[2][HEAD_BAKE_NODES] = {
    { 812, -3132, 5265, -5080, 2970, -972, 137 },
    { 2, -27, 270, -490, 270, -27, 2 },
};

/* What is being baked. */
struct head_bake {
    const struct motion_head_bake *job;
    const struct motion_turning *turning;
    uint32_t stretch;  /* the present one ends at border[stretch] */
    int64_t low, high; /* and lies between these */
    struct motion_head walk[HEAD_BAKE_WALK];
    struct motion_head end;                          /* at `high` */
    struct motion_bake_point left[MOTION_HEAD_AXES]; /* there, as last seen */
};

/* The angles at t, nearest to those of `near`. */
static int head_bake_angles(const struct motion_turning *turning, int64_t t,
                            const struct motion_head *near,
                            struct motion_head *head)
{
    struct motion_quat q;
    int err = turning->at(turning->context, t, &q);

    if (err < 0)
        return err;
    *head = *near;
    return motion_head_follow(head, q);
}

/* The next stretch, from where the one before ended. */
static int head_bake_enter(struct head_bake *bake)
{
    const int64_t *const border = &bake->job->border_ns_q12[bake->stretch];
    const int64_t step = (border[1] - border[0]) / HEAD_BAKE_WALK;
    struct motion_head head = bake->end;
    int err = MOTION_OK;

    bake->low = border[0];
    bake->high = border[1];
    bake->stretch++;
    for (int i = 0; i < HEAD_BAKE_WALK && err == MOTION_OK; i++) {
        err = head_bake_angles(bake->turning, bake->low + i * step, &head,
                               &bake->walk[i]);
        head = bake->walk[i];
    }
    if (err == MOTION_OK)
        err = head_bake_angles(bake->turning, bake->high, &head, &bake->end);
    return err;
}

static const struct motion_head *head_bake_near(const struct head_bake *bake,
                                                int64_t t)
{
    const int64_t step = (bake->high - bake->low) / HEAD_BAKE_WALK;
    const int64_t i = (t - bake->low) / step;

    return &bake->walk[i < HEAD_BAKE_WALK ? i : HEAD_BAKE_WALK - 1];
}

static struct motion_real head_bake_deg(struct motion_real turns)
{
    return motion_real_mul(turns, motion_real_int(360));
}

/* sum weight angle / divisor / d^order, degrees, d in seconds */
static struct motion_real head_bake_sum(const int64_t weight[],
                                        const int64_t turn[], int64_t divisor,
                                        struct motion_real width, int order)
{
    struct motion_real sum = motion_real_zero();

    for (int i = 0; i < HEAD_BAKE_NODES; i++)
        sum = motion_real_add(sum,
                              motion_real_mul(motion_real_from_q(turn[i], 64),
                                              motion_real_int(weight[i])));
    sum = motion_real_div(head_bake_deg(sum), motion_real_int(divisor));
    for (int i = 0; i < order; i++)
        sum = motion_real_div(sum, width);
    return sum;
}

static int64_t head_bake_width(const struct head_bake *bake)
{
    const int64_t part = (bake->high - bake->low) / 16;
    const int64_t width = bake->job->stencil_ns_q12 != 0
                              ? bake->job->stencil_ns_q12
                              : HEAD_BAKE_STENCIL;

    return part < width ? part : width;
}

static enum head_bake_side head_bake_side_at(const struct head_bake *bake,
                                             int64_t t, int64_t width)
{
    if (t - bake->low < 3 * width)
        return HEAD_BAKE_FORWARD;
    return bake->high - t < 3 * width ? HEAD_BAKE_BACKWARD : HEAD_BAKE_CENTRAL;
}

/* Backward is forward in a mirror: the nodes, as differences from the angle at
 * the place, are given from the place on. */
static struct motion_bake_point head_bake_point(const struct motion_head *head,
                                                int axis, const int64_t turn[],
                                                enum head_bake_side side,
                                                int64_t width)
{
    const int row = side == HEAD_BAKE_CENTRAL;
    const struct motion_real s = motion_bake_seconds(width);
    struct motion_bake_point point = {
        .pos = head_bake_deg(
            motion_real_add(motion_real_int(head->whole[axis]),
                            motion_real_from_q(head->turn[axis], 64))),
        .vel = head_bake_sum(head_bake_first[row], turn, 60, s, 1),
        .acc = head_bake_sum(head_bake_second[row], turn, 180, s, 2),
    };

    if (side == HEAD_BAKE_BACKWARD)
        point.vel = motion_real_neg(point.vel);
    return point;
}

static int head_bake_look(const struct head_bake *bake, int64_t t,
                          struct motion_bake_point point[])
{
    const int64_t width = head_bake_width(bake);
    const enum head_bake_side side = head_bake_side_at(bake, t, width);
    const int64_t step = side == HEAD_BAKE_BACKWARD ? -width : width;
    const int64_t from = side == HEAD_BAKE_CENTRAL ? t - 3 * width : t;
    int64_t turn[MOTION_HEAD_AXES][HEAD_BAKE_NODES];
    struct motion_head head, node;
    int err =
        head_bake_angles(bake->turning, t, head_bake_near(bake, t), &head);

    for (int i = 0; i < HEAD_BAKE_NODES && err == MOTION_OK; i++) {
        err = head_bake_angles(bake->turning, from + i * step, &head, &node);
        for (int axis = 0; axis < MOTION_HEAD_AXES && err == MOTION_OK; axis++)
            turn[axis][i] = motion_trig_diff(node.turn[axis], head.turn[axis]);
    }
    for (int axis = 0; axis < MOTION_HEAD_AXES && err == MOTION_OK; axis++)
        point[axis] = head_bake_point(&head, axis, turn[axis], side, width);
    return err;
}

static void head_bake_join(struct motion_real *right, struct motion_real left,
                           struct motion_real rounding)
{
    if (motion_real_lt(motion_real_abs(motion_real_sub(*right, left)),
                       rounding))
        *right = left;
}

/* The second side of a border: rounding is no step. */
static void head_bake_cross(const struct head_bake *bake,
                            struct motion_bake_point right[])
{
    const struct motion_real rounding =
        motion_real_from_q(bake->job->tolerance_q32, 36);

    for (int axis = 0; axis < MOTION_HEAD_AXES; axis++) {
        head_bake_join(&right[axis].vel, bake->left[axis].vel, rounding);
        head_bake_join(&right[axis].acc, bake->left[axis].acc, rounding);
    }
}

static bool head_bake_is_rest(const struct head_bake *bake, int64_t t)
{
    const struct motion_head_bake *job = bake->job;

    return job->is_rest && (t == job->border_ns_q12[0] ||
                            t == job->border_ns_q12[job->borders - 1]);
}

/* The baker asks for a border's right side before anything beyond it. */
static int head_bake_at(void *context, int64_t t_ns_q12,
                        enum motion_bake_side side,
                        struct motion_bake_point point[])
{
    struct head_bake *const bake = context;
    int err = MOTION_OK;

    const bool is_second = bake->stretch > 0 && side == MOTION_BAKE_RIGHT &&
                           t_ns_q12 == bake->high;

    if (bake->stretch == 0 || is_second)
        err = head_bake_enter(bake);
    if (err == MOTION_OK)
        err = head_bake_look(bake, t_ns_q12, point);
    if (err < 0)
        return err;
    if (is_second)
        head_bake_cross(bake, point);
    for (int axis = 0; axis < MOTION_HEAD_AXES; axis++) {
        if (head_bake_is_rest(bake, t_ns_q12))
            point[axis].vel = point[axis].acc = motion_real_zero();
        if (t_ns_q12 == bake->high)
            bake->left[axis] = point[axis];
    }
    return MOTION_OK;
}

/* What the baker cannot see: the stencil's width may not vanish. */
static int head_bake_check(const struct motion_head_bake *job)
{
    if (job->borders < 2 || job->tolerance_q32 < 1 || job->stencil_ns_q12 < 0)
        return MOTION_E_ARG;
    return motion_bake_check_borders(job->border_ns_q12, job->borders,
                                     16 * MOTION_FIXED_NS_Q12);
}

int motion_head_bake(const struct motion_head_bake *job,
                     const struct motion_turning *turning,
                     struct motion_head *head,
                     struct motion_track *track[MOTION_HEAD_AXES],
                     int64_t bound_q32[MOTION_HEAD_AXES])
{
    struct head_bake bake = { .job = job, .turning = turning, .end = *head };
    const struct motion_bake fit = {
        .source = { head_bake_at, &bake },
        .axes = MOTION_HEAD_AXES,
        .border_ns_q12 = job->border_ns_q12,
        .borders = job->borders,
        .pos = motion_real_from_q(job->tolerance_q32, 32),
        .vel = motion_real_zero(),
        .acc = motion_real_zero(),
        .shortest_ns_q12 = job->shortest_ns_q12 != 0 ? job->shortest_ns_q12
                                                     : HEAD_BAKE_SHORTEST,
        .evaluations = job->evaluations,
    };
    struct motion_bake_report report = { .segments = 0 };
    int err = head_bake_check(job);

    if (err == MOTION_OK)
        err = motion_bake(&fit, track, &report);
    if (err < 0)
        return err;
    *head = bake.end;
    /* at most the tolerance, so it fits */
    for (int axis = 0; axis < MOTION_HEAD_AXES; axis++)
        (void)motion_real_ceil(report.bound[axis].pos, 32, &bound_q32[axis]);
    return MOTION_OK;
}
