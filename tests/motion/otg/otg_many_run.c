/* tests/motion/otg/otg_many_run.c - planning and judging; see otg_many.h. */
#include <inttypes.h>
#include <math.h>
#include <stdbool.h>
#include <stdio.h>

#include "motion/core/err.h"
#include "motion/otg/internal.h"
#include "motion/otg/replan.h"
#include "motion/otg/sync.h"
#include "tests/motion/otg/otg_many.h"
#include "tests/motion/otg/otg_oracle.h"

#define POINTS 5

/* --- what may be refused -------------------------------------------------- */

static long double q32(int64_t value)
{
    return ldexpl((long double)value, -32);
}

static int64_t closing_jerk(const struct motion_otg_limit *l)
{
    return l->jerk_down_q32 ? l->jerk_down_q32 : l->jerk_q32;
}

/* v + a^2 / 2j of the end above (sign 1) or below (-1), less the limit. */
static long double over(const struct motion_state *end, int64_t jerk_q32,
                        int64_t limit_q32, int sign)
{
    long double a = sign * q32(end->acc_q32), v = sign * q32(end->vel_q32);
    long double ramp = a > 0 && jerk_q32 ? a * a / (2 * q32(jerk_q32)) : 0;
    return v + ramp - sign * q32(limit_q32) - 0x1p-36L * (ramp + fabsl(v));
}

/* Where the goal's acceleration means that the speed was higher before it. */
static bool goal_is_out_of_reach(const struct motion_otg_move *m)
{
    struct motion_state back = m->goal;
    back.acc_q32 = -back.acc_q32;
    int64_t j = closing_jerk(&m->limit);
    return m->mode == MOTION_OTG_POSITION &&
           (over(&back, j, m->limit.vel_max_q32, 1) >
                -0x1p-30L * fabsl(q32(m->limit.vel_max_q32)) ||
            over(&back, j, m->limit.vel_min_q32, -1) >
                -0x1p-30L * fabsl(q32(m->limit.vel_min_q32)));
}

/* --- verdicts ------------------------------------------------------------- */

static enum many_verdict bad(const struct motion_otg_move *m, const char *what,
                             const char *which, char text[MANY_TEXT])
{
    const struct motion_otg_limit *l = &m->limit;
    snprintf(text, MANY_TEXT,
             "%s%s%s: mode %d start %" PRId64 " %" PRId64 " %" PRId64
             " goal %" PRId64 " %" PRId64 " %" PRId64 " vel %" PRId64
             " %" PRId64 " acc %" PRId64 " %" PRId64 " jerk %" PRId64
             " %" PRId64 " dur %" PRId64,
             what, *which ? ", " : "", which, (int)m->mode, m->start.pos_q32,
             m->start.vel_q32, m->start.acc_q32, m->goal.pos_q32,
             m->goal.vel_q32, m->goal.acc_q32, l->vel_max_q32, l->vel_min_q32,
             l->acc_max_q32, l->acc_min_q32, l->jerk_q32, l->jerk_down_q32,
             m->dur_ns_q12);
    return MANY_BAD;
}

static bool is_far(const struct motion_otg_move m[], int axes, bool on_line)
{
    for (int i = 0; i < axes; i++)
        if (many_is_far(&m[i]))
            return true;
    if (on_line)
        return many_is_line_far(m, axes);
    return axes > 1 && many_are_far(m, axes);
}

/* Of several axes that are one motion any may be the reason. */
static enum many_verdict refused(const struct motion_otg_move m[], int axes,
                                 bool on_line, int axis, int err,
                                 enum motion_otg_field field,
                                 char text[MANY_TEXT])
{
    if (err == MOTION_E_RANGE && is_far(m, axes, on_line))
        return MANY_RANGE;
    if (err == MOTION_E_LIMIT && field == MOTION_OTG_FIELD_GOAL_ACC &&
        goal_is_out_of_reach(&m[axis]))
        return MANY_REFUSED;
    bad(&m[axis], motion_err_text(err), motion_otg_field_text(field), text);
    return err == MOTION_E_RANGE ? MANY_DOUBT : MANY_MISSED;
}

static enum many_verdict judged(const struct motion_otg_move *m,
                                const struct motion_otg_plan *plan,
                                char text[MANY_TEXT])
{
    const char *wrong = otg_oracle_judge(m, plan);
    if (wrong == NULL)
        wrong = otg_oracle_judge_track(m, plan);
    return wrong == NULL ? MANY_GOOD : bad(m, wrong, "", text);
}

/* A plan in the least time, that is good otherwise. */
static enum many_verdict timed(const struct motion_otg_move *m,
                               const struct motion_otg_plan *plan,
                               char text[MANY_TEXT])
{
    enum motion_otg_field field;
    int64_t least;
    if (motion_otg_least(m, &least, &field) != MOTION_OK ||
        plan->dur_ns_q12 <= least + least / 1000000 + 4096)
        return MANY_GOOD;
    bad(m, "longer than the least", "", text);
    return MANY_LATE;
}

static enum many_verdict run_one(const struct motion_otg_move *m,
                                 struct motion_otg_plan *plan,
                                 char text[MANY_TEXT])
{
    enum motion_otg_field field;
    int err = motion_otg_make(m, plan, &field);
    return err < 0 ? refused(m, 1, false, 0, err, field, text)
                   : judged(m, plan, text);
}

/* --- kinds that are more than one call ------------------------------------ */

/* Longer than the shortest by up to three times; in a gap, what comes next. */
static enum many_verdict run_duration(const struct many_problem *p,
                                      char text[MANY_TEXT])
{
    struct motion_otg_move m = p->move[0];
    struct motion_otg_plan plan;
    enum motion_otg_field field;
    enum many_verdict verdict = run_one(&m, &plan, text);
    if (verdict != MANY_GOOD || plan.dur_ns_q12 > INT64_MAX / 8)
        return verdict;
    m.dur_ns_q12 =
        plan.dur_ns_q12 + (int64_t)(ldexpl((long double)plan.dur_ns_q12, -30) *
                                    (long double)p->share_q32 * 0.75L);
    int err = motion_otg_make(&m, &plan, &field);
    if (err == MOTION_E_LIMIT && field == MOTION_OTG_FIELD_DURATION) {
        if (plan.dur_ns_q12 <= m.dur_ns_q12)
            return bad(&m, "the next duration is no later", "", text);
        m.dur_ns_q12 = plan.dur_ns_q12;
        err = motion_otg_make(&m, &plan, &field);
    }
    if (err < 0)
        return refused(&m, 1, false, 0, err, field, text);
    if (plan.dur_ns_q12 != m.dur_ns_q12 && m.dur_ns_q12 > 0)
        return bad(&m, "another duration", "", text);
    return judged(&m, &plan, text);
}

static enum many_verdict run_axes(const struct many_problem *p,
                                  enum motion_sync_kind kind,
                                  char text[MANY_TEXT])
{
    struct motion_otg_plan plan[MANY_AXES];
    struct motion_sync_fault fault = { 0, MOTION_OTG_FIELD_NONE };
    int err = motion_sync_make(p->move, p->axes, kind, plan, &fault);
    if (err < 0)
        return refused(p->move, p->axes, kind == MOTION_SYNC_STRAIGHT,
                       fault.axis, err, fault.field, text);
    for (int i = 0; i < p->axes; i++) {
        if (plan[i].dur_ns_q12 != plan[0].dur_ns_q12)
            return bad(&p->move[i], "axes take different times", "", text);
        enum many_verdict verdict = judged(&p->move[i], &plan[i], text);
        if (verdict != MANY_GOOD)
            return verdict;
    }
    return MANY_GOOD;
}

static void through_points(const struct many_problem *p,
                           struct motion_otg_point point[])
{
    uint32_t turn = p->share_q32;
    for (int k = 0; k < POINTS; k++)
        for (int i = 0; i < p->axes; i++) {
            const struct motion_otg_move *m = &p->move[i];
            int64_t step = (m->goal.pos_q32 - m->start.pos_q32) / POINTS;
            bool back = turn >> (k * 5 + i) % 32 & 1;
            int64_t before = k == 0 ? m->start.pos_q32
                                    : point[(k - 1) * p->axes + i].pos_q32;
            point[k * p->axes + i] =
                (struct motion_otg_point){ before + (back ? -step / 2 : step),
                                           0, false };
        }
}

/* The move that ends at point k, into m. */
static void move_to_point(const struct many_problem *p,
                          const struct motion_otg_point point[], int k,
                          struct motion_otg_move m[])
{
    for (int i = 0; i < p->axes; i++) {
        const struct motion_otg_point *to = &point[k * p->axes + i];
        m[i] = p->move[i];
        m[i].goal = (struct motion_state){ to->pos_q32, to->vel_q32, 0, 0 };
        if (k > 0)
            m[i].start = (struct motion_state){ to[-p->axes].pos_q32,
                                                to[-p->axes].vel_q32, 0, 0 };
    }
}

static enum many_verdict run_through(const struct many_problem *p,
                                     char text[MANY_TEXT])
{
    static struct motion_otg_plan plan[POINTS * MANY_AXES];
    struct motion_otg_point point[POINTS * MANY_AXES];
    struct motion_state start[MANY_AXES];
    struct motion_otg_limit limit[MANY_AXES];
    struct motion_otg_move m[MANY_AXES];
    struct motion_sync_fault fault = { 0, MOTION_OTG_FIELD_NONE };
    int failed = 0;
    for (int i = 0; i < p->axes; i++) {
        start[i] = p->move[i].start;
        limit[i] = p->move[i].limit;
    }
    through_points(p, point);
    int err = motion_otg_through(start, limit, p->axes, point, POINTS, plan,
                                 &failed, &fault);
    if (err < 0) {
        move_to_point(p, point, failed, m);
        return refused(m, p->axes, false, fault.axis, err, fault.field, text);
    }
    for (int k = 0; k < POINTS; k++) {
        move_to_point(p, point, k, m);
        for (int i = 0; i < p->axes; i++) {
            enum many_verdict verdict =
                judged(&m[i], &plan[k * p->axes + i], text);
            if (verdict != MANY_GOOD)
                return verdict;
        }
    }
    return MANY_GOOD;
}

static enum many_verdict run_replan(const struct many_problem *p,
                                    char text[MANY_TEXT])
{
    struct motion_otg_move later = p->later;
    struct motion_otg_trajectory old = { .move = p->move[0] }, next;
    enum motion_otg_field field;
    enum many_verdict verdict = run_one(&p->move[0], &old.plan, text);
    if (verdict != MANY_GOOD)
        return verdict;
    int64_t t = (int64_t)ldexpl(
        (long double)old.plan.dur_ns_q12 * (long double)p->share_q32, -32);
    int outcome = motion_otg_replan(&old, t, &later, &next, &field);
    motion_otg_trajectory_state(&old, t, &later.start);
    switch (outcome) {
    case MOTION_OTG_NEW:
    case MOTION_OTG_STOP:
        return judged(&next.move, &next.plan, text);
    case MOTION_OTG_KEPT:
        return t < old.plan.dur_ns_q12
                   ? MANY_GOOD
                   : bad(&later, "kept what is over", "", text);
    default:
        return refused(&later, 1, false, 0, outcome, field, text);
    }
}

static enum many_verdict run_stop(const struct many_problem *p,
                                  char text[MANY_TEXT])
{
    struct motion_otg_move m = p->move[0];
    struct motion_otg_plan plan;
    int err = motion_otg_stop(&m.start, &m.limit, &plan);
    m.mode = MOTION_OTG_VELOCITY;
    m.goal = (struct motion_state){ 0 };
    if (err < 0)
        return refused(&m, 1, false, 0, err, MOTION_OTG_FIELD_NONE, text);
    return judged(&m, &plan, text);
}

enum many_verdict many_run(const struct many_problem *p, char text[MANY_TEXT])
{
    struct motion_otg_plan plan;
    switch (p->kind) {
    case MANY_DURATION:
        return run_duration(p, text);
    case MANY_SYNC:
        return run_axes(p, MOTION_SYNC_TIME, text);
    case MANY_STRAIGHT:
        return run_axes(p, MOTION_SYNC_STRAIGHT, text);
    case MANY_THROUGH:
        return run_through(p, text);
    case MANY_REPLAN:
        return run_replan(p, text);
    case MANY_STOP:
        return run_stop(p, text);
    default: {
        enum many_verdict verdict = run_one(&p->move[0], &plan, text);
        return verdict == MANY_GOOD ? timed(&p->move[0], &plan, text) : verdict;
    }
    }
}
