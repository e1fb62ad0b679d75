/* motion/plan/check.c - see check.h.
 *
 * What rounding may leave at a border.  Position is a multiple of
 * q = 2^-(32 + frac) unit; coefficient k of u is rounded to a multiple of
 * q / 2^k, and the highest one, n, makes up for the others and for both ends
 * having been cut to q: it is off by at most 1.5 q.  So at either end of a
 * segment of duration T the derivatives miss the polynomial that was meant by
 *     velocity      (1/4 + 2/8 + 3/16 + ... + 1.5 n) q/T        < 9 q/T
 *     acceleration  (2/8 + 6/16 + ... + 1.5 n (n-1)) q/T^2      < 32 q/T^2
 *     jerk          (6/16 + 24/32 + 1.5 n (n-1) (n-2)) q/T^3    < 92 q/T^3
 * for n = 5.  Planners that round states to their own integers (ease) stay
 * within twice that.  Reading a state rounds by one unit of its format or 2^-60
 * of the largest value, which is below 4 q/T, 16 q/T^2 and 64 q/T^3, as
 * coefficients have 62 bits.  A step is the difference of two sides.  An
 * acceleration and a jerk that are planned at their limit may come out so far
 * above it, and 2^-28 of it (as for ramps, clock_warp.h): a sixth of a time in
 * 2^-32 makes 2.1e-9 of a jerk.
 *
 * What digits may leave there, where set points have a period P.  Keys and
 * handles are multiples of s = 2^-32 unit; one of them s/2 off turns the cubic
 * beside it by 3 s/2T in velocity and 12 s/2T^2 in acceleration at most, and a
 * span has two.  T counts as P where it is shorter: no set point sees less.
 *
 * What sampling may leave: a drive sees a step of acceleration as a jerk of
 * step / P for one period, one of velocity as an acceleration of step / P and a
 * jerk of step / P^2.  A hundredth of the limit is allowed for that. */
#include "motion/plan/check.h"

#include <math.h>
#include <stdbool.h>
#include <stdlib.h>

#include "motion/core/fixed.h"

#define CHECK_KINDS      (PLAN_ACC_STEP + 1)
#define CHECK_VEL_DIGITS 3
#define CHECK_ACC_DIGITS 12
#define CHECK_SAMPLING   0.01

struct check {
    const struct plan_limit *limit;
    struct plan_violation *violation;
    uint32_t capacity, count;
    /* Of each kind: the entry that the previous segment was in, + 1; and its
     * worst value, kept here as the entry may be beyond the room. */
    uint32_t open[CHECK_KINDS];
    int64_t worst[CHECK_KINDS];
    double vel_sampling, acc_sampling; /* in the units of their formats */
};

static void check_write(struct check *check, uint32_t index,
                        enum plan_violation_kind kind, int64_t t_ns_q12,
                        int64_t value, int64_t limit)
{
    check->worst[kind] = value;
    if (index < check->capacity)
        check->violation[index] =
            (struct plan_violation){ kind, t_ns_q12, value, limit };
}

/* How far a value is beyond, comparable within one kind. */
static uint64_t check_excess(enum plan_violation_kind kind, int64_t value,
                             int64_t limit)
{
    if (kind == PLAN_POS_LOW)
        return (uint64_t)limit - (uint64_t)value;
    if (kind == PLAN_POS_HIGH)
        return (uint64_t)value - (uint64_t)limit;
    return motion_fixed_abs(value);
}

/* A segment is, or is not (`over`), beyond the limit of `kind`. */
static void check_stretch(struct check *check, enum plan_violation_kind kind,
                          bool over, int64_t t_ns_q12, int64_t value,
                          int64_t limit)
{
    if (!over) {
        check->open[kind] = 0;
        return;
    }
    if (check->open[kind] == 0) {
        check_write(check, check->count, kind, t_ns_q12, value, limit);
        check->open[kind] = ++check->count;
    } else if (check_excess(kind, value, limit) >
               check_excess(kind, check->worst[kind], limit)) {
        check_write(check, check->open[kind] - 1, kind, t_ns_q12, value, limit);
    }
}

static void check_step(struct check *check, enum plan_violation_kind kind,
                       int64_t t_ns_q12, int64_t left, int64_t right,
                       double allowed)
{
    const uint64_t step = left > right ? (uint64_t)left - (uint64_t)right
                                       : (uint64_t)right - (uint64_t)left;
    const int64_t value = step > INT64_MAX ? INT64_MAX : (int64_t)step;

    if ((double)step > allowed)
        check_write(check, check->count++, kind, t_ns_q12, value, 0);
}

/* a > b by more than sampling may round. */
static bool check_is_above(int64_t a, int64_t b)
{
    return a > b && (uint64_t)a - (uint64_t)b > MOTION_TRACK_POS_ROUNDING;
}

static void check_pos(struct check *check, const struct motion_extreme *pos)
{
    const struct plan_limit *limit = check->limit;

    check_stretch(check, PLAN_POS_LOW,
                  check_is_above(limit->pos_min_q32, pos->min), pos->min_ns_q12,
                  pos->min, limit->pos_min_q32);
    check_stretch(check, PLAN_POS_HIGH,
                  check_is_above(pos->max, limit->pos_max_q32), pos->max_ns_q12,
                  pos->max, limit->pos_max_q32);
}

/* What is planned at a limit may come out above it by what rounding makes, and
 * 2^-28; what is beyond the format is above every limit. */
static bool check_is_above_planned(const struct motion_segment *segment,
                                   enum motion_quantity quantity, int64_t limit)
{
    const int64_t most = limit < INT64_MAX - 1 - (limit >> 28)
                             ? limit + (limit >> 28)
                             : INT64_MAX - 1;

    return motion_segment_peak(segment, quantity) > most;
}

/* A limit on the magnitude. */
static void check_magnitude(struct check *check, enum plan_violation_kind kind,
                            const struct motion_segment *segment,
                            const struct motion_extreme *extreme, int64_t limit)
{
    const uint64_t min = motion_fixed_abs(extreme->min);
    const uint64_t max = motion_fixed_abs(extreme->max);
    const bool low =
        min > max || (min == max && extreme->min_ns_q12 < extreme->max_ns_q12);
    bool over = (low ? min : max) > (uint64_t)limit;

    if (over && kind != PLAN_VEL)
        over = check_is_above_planned(
            segment, kind == PLAN_ACC ? MOTION_ACC : MOTION_JERK, limit);
    check_stretch(check, kind, over,
                  low ? extreme->min_ns_q12 : extreme->max_ns_q12,
                  low ? extreme->min : extreme->max, limit);
}

static void check_segment(struct check *check,
                          const struct motion_segment *segment,
                          const struct motion_extreme extreme[])
{
    const struct plan_limit *limit = check->limit;

    check_pos(check, &extreme[MOTION_POS]);
    check_magnitude(check, PLAN_VEL, segment, &extreme[MOTION_VEL],
                    limit->vel_q32);
    check_magnitude(check, PLAN_ACC, segment, &extreme[MOTION_ACC],
                    limit->acc_q32);
    if (limit->jerk_q32 != 0)
        check_magnitude(check, PLAN_JERK, segment, &extreme[MOTION_JERK],
                        limit->jerk_q32);
}

/* One side of a border: its derivatives and what rounding may have done to
 * them, in the units of their formats. */
struct check_side {
    struct motion_state state;
    double vel_rounding, acc_rounding;
};

static const struct check_side check_rest; /* all zero */

void plan_facts_of(const struct motion_segment *segment,
                   struct plan_facts *facts)
{
    motion_segment_extremes(segment, facts->extreme);
    motion_segment_state(segment, 0, &facts->start);
    motion_segment_state(segment, segment->dur_ns_q12, &facts->end);
    facts->vel_rounding = motion_segment_rounding(segment, MOTION_VEL);
    facts->acc_rounding = motion_segment_rounding(segment, MOTION_ACC);
}

static struct check_side check_side(const struct check *check,
                                    const struct motion_segment *segment,
                                    const struct plan_facts *facts, bool is_end)
{
    const double rate =
        (double)MOTION_FIXED_S_Q12 / (double)segment->dur_ns_q12;
    const double period_rate =
        check->limit->period_ns > 0 ? 1e9 / (double)check->limit->period_ns : 0;
    const double seen = rate < period_rate ? rate : period_rate;
    struct check_side side;

    side.state = is_end ? facts->end : facts->start;
    side.vel_rounding = (double)facts->vel_rounding + CHECK_VEL_DIGITS * seen;
    side.acc_rounding =
        (double)facts->acc_rounding + CHECK_ACC_DIGITS * seen * seen;
    return side;
}

/* What is let pass of a limit of acceleration and one of jerk. */
static void check_sampling(struct check *check)
{
    const struct plan_limit *limit = check->limit;
    const double period = (double)limit->period_ns * 1e-9;
    const double by_acc = (double)limit->acc_q32 * period;
    const double by_jerk = (double)limit->jerk_q32 * period * period;

    check->acc_sampling = CHECK_SAMPLING * (double)limit->jerk_q32 * period;
    check->vel_sampling =
        CHECK_SAMPLING *
        (limit->jerk_q32 != 0 && by_jerk < by_acc ? by_jerk : by_acc);
}

static void check_border(struct check *check, int64_t t_ns_q12,
                         const struct check_side *left,
                         const struct check_side *right)
{
    check_step(check, PLAN_VEL_STEP, t_ns_q12, left->state.vel_q32,
               right->state.vel_q32,
               left->vel_rounding + right->vel_rounding + check->vel_sampling);
    if (check->limit->jerk_q32 != 0)
        check_step(check, PLAN_ACC_STEP, t_ns_q12, left->state.acc_q32,
                   right->state.acc_q32,
                   left->acc_rounding + right->acc_rounding +
                       check->acc_sampling);
}

static int check_by_time(const void *a, const void *b)
{
    const struct plan_violation *x = a, *y = b;

    if (x->t_ns_q12 != y->t_ns_q12)
        return x->t_ns_q12 < y->t_ns_q12 ? -1 : 1;
    return (x->kind > y->kind) - (x->kind < y->kind);
}

uint32_t plan_check_source(const struct motion_track *track,
                           const struct plan_check_source *source,
                           const struct plan_limit *limit,
                           struct plan_violation *violation, uint32_t capacity)
{
    struct check check = { .limit = limit,
                           .violation = violation,
                           .capacity = capacity };
    struct check_side left = check_rest;
    const struct motion_segment *segment = source->next(source->context);
    struct plan_facts own;

    check_sampling(&check);
    if (segment == NULL) {
        const struct motion_extreme pos = { .min = track->end.pos_q32,
                                            .max = track->end.pos_q32 };
        check_pos(&check, &pos);
    }
    for (; segment != NULL; segment = source->next(source->context)) {
        const struct plan_facts *facts =
            source->facts != NULL ? source->facts(source->context) : &own;
        if (facts == &own)
            plan_facts_of(segment, &own);
        const struct check_side right =
            check_side(&check, segment, facts, false);
        check_border(&check, segment->start_ns_q12, &left, &right);
        check_segment(&check, segment, facts->extreme);
        left = check_side(&check, segment, facts, true);
    }
    check_border(&check, track->end_ns_q12, &left, &check_rest);
    if (capacity != 0)
        qsort(violation, check.count < capacity ? check.count : capacity,
              sizeof *violation, check_by_time);
    return check.count;
}

struct check_list {
    const struct motion_track *track;
    uint32_t next;
};

static const struct motion_segment *check_list_next(void *context)
{
    struct check_list *list = context;

    if (list->next == list->track->count)
        return NULL;
    return &list->track->segment[list->next++];
}

uint32_t plan_check_track(const struct motion_track *track,
                          const struct plan_limit *limit,
                          struct plan_violation *violation, uint32_t capacity)
{
    struct check_list list = { track, 0 };
    const struct plan_check_source source = { .next = check_list_next,
                                              .context = &list };

    return plan_check_source(track, &source, limit, violation, capacity);
}
