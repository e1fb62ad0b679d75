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
#include <string.h>

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

static const struct motion_extreme *
check_exact(const struct motion_segment *segment, struct plan_facts *facts,
            enum motion_quantity quantity)
{
    const uint8_t bit = (uint8_t)(1u << quantity);

    if (!(facts->exact & bit)) {
        motion_segment_extreme(segment, quantity, &facts->extreme[quantity]);
        facts->exact |= bit;
    }
    return &facts->extreme[quantity];
}

static bool check_is_outside(const struct check *check,
                             const struct motion_extreme *pos)
{
    return check_is_above(check->limit->pos_min_q32, pos->min) ||
           check_is_above(pos->max, check->limit->pos_max_q32);
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
 * 2^-28; what is beyond the format is above every limit.  Further above than
 * that, which `size` is off by, there is no need to look where. */
static bool check_is_above_planned(const struct motion_segment *segment,
                                   const struct plan_facts *facts,
                                   enum motion_quantity quantity, uint64_t size,
                                   int64_t limit)
{
    const int64_t most = limit < INT64_MAX - 1 - (limit >> 28)
                             ? limit + (limit >> 28)
                             : INT64_MAX - 1;
    const uint64_t rounding = (uint64_t)facts->rounding[quantity] + 4;

    return (size > rounding && size - rounding > (uint64_t)most) ||
           motion_segment_peak(segment, quantity) > most;
}

static bool check_is_beyond(const struct motion_extreme *extreme, int64_t limit)
{
    return motion_fixed_abs(extreme->min) > (uint64_t)limit ||
           motion_fixed_abs(extreme->max) > (uint64_t)limit;
}

/* A limit on the magnitude. */
static void check_magnitude(struct check *check, enum plan_violation_kind kind,
                            const struct motion_segment *segment,
                            struct plan_facts *facts,
                            enum motion_quantity quantity, int64_t limit)
{
    const struct motion_extreme *extreme = &facts->extreme[quantity];

    if (check_is_beyond(extreme, limit))
        extreme = check_exact(segment, facts, quantity);
    const uint64_t min = motion_fixed_abs(extreme->min);
    const uint64_t max = motion_fixed_abs(extreme->max);
    const bool low =
        min > max || (min == max && extreme->min_ns_q12 < extreme->max_ns_q12);
    bool over = (low ? min : max) > (uint64_t)limit;

    if (over && kind != PLAN_VEL)
        over = check_is_above_planned(segment, facts, quantity, low ? min : max,
                                      limit);
    check_stretch(check, kind, over,
                  low ? extreme->min_ns_q12 : extreme->max_ns_q12,
                  low ? extreme->min : extreme->max, limit);
}

static void check_segment(struct check *check,
                          const struct motion_segment *segment,
                          struct plan_facts *facts)
{
    const struct plan_limit *limit = check->limit;

    if (check_is_outside(check, &facts->extreme[MOTION_POS]))
        (void)check_exact(segment, facts, MOTION_POS);
    check_pos(check, &facts->extreme[MOTION_POS]);
    check_magnitude(check, PLAN_VEL, segment, facts, MOTION_VEL,
                    limit->vel_q32);
    check_magnitude(check, PLAN_ACC, segment, facts, MOTION_ACC,
                    limit->acc_q32);
    if (limit->jerk_q32 != 0)
        check_magnitude(check, PLAN_JERK, segment, facts, MOTION_JERK,
                        limit->jerk_q32);
}

/* One side of a border, without a segment where the axis stands: velocity and
 * acceleration, how exact they are, and what rounding may have done to them, in
 * the units of their formats. */
struct check_side {
    const struct motion_segment *segment;
    struct plan_facts *facts;
    bool is_end;
    double value[2], margin[2], rounding[2];
};

static const struct check_side check_rest; /* all zero */

void plan_facts_of(const struct motion_segment *segment,
                   struct plan_facts *facts)
{
    struct plan_bound bound[MOTION_JERK + 1];

    plan_segment_bounds(segment, bound);
    *facts = (struct plan_facts){ .exact = 0 };
    for (int q = MOTION_POS; q <= MOTION_JERK; q++) {
        facts->extreme[q] =
            (struct motion_extreme){ bound[q].low, bound[q].high,
                                     segment->start_ns_q12,
                                     segment->start_ns_q12 };
        facts->value[0][q] = bound[q].start;
        facts->value[1][q] = bound[q].end;
        facts->margin[q] = bound[q].margin;
        if (q > MOTION_POS)
            facts->rounding[q] =
                motion_segment_rounding(segment, (enum motion_quantity)q);
    }
}

void plan_facts_exact(const struct motion_segment *segment,
                      struct plan_facts *facts)
{
    motion_segment_extremes(segment, facts->extreme);
    facts->exact = (1u << (MOTION_JERK + 1)) - 1;
}

static struct check_side check_side(const struct check *check,
                                    const struct motion_segment *segment,
                                    struct plan_facts *facts, bool is_end)
{
    const double rate =
        (double)MOTION_FIXED_S_Q12 / (double)segment->dur_ns_q12;
    const double period_rate =
        check->limit->period_ns > 0 ? 1e9 / (double)check->limit->period_ns : 0;
    const double seen = rate < period_rate ? rate : period_rate;
    const double *value = facts->value[is_end];

    return (struct check_side){
        .segment = segment,
        .facts = facts,
        .is_end = is_end,
        .value = { value[MOTION_VEL], value[MOTION_ACC] },
        .margin = { facts->margin[MOTION_VEL], facts->margin[MOTION_ACC] },
        .rounding = { (double)facts->rounding[MOTION_VEL] +
                          CHECK_VEL_DIGITS * seen,
                      (double)facts->rounding[MOTION_ACC] +
                          CHECK_ACC_DIGITS * seen * seen },
    };
}

/* Velocity and acceleration to the bit. */
static void check_state(const struct check_side *side, int64_t value[2])
{
    struct plan_facts *facts = side->facts;

    value[0] = value[1] = 0;
    if (side->segment == NULL)
        return;
    if (!facts->has_state[side->is_end]) {
        struct motion_state state;
        motion_segment_state(side->segment,
                             side->is_end ? side->segment->dur_ns_q12 : 0,
                             &state);
        facts->vel_q32[side->is_end] = state.vel_q32;
        facts->acc_q32[side->is_end] = state.acc_q32;
        facts->has_state[side->is_end] = true;
    }
    value[0] = facts->vel_q32[side->is_end];
    value[1] = facts->acc_q32[side->is_end];
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

/* Whether there surely is no step of velocity (0) or acceleration (1). */
static bool check_joins(const struct check_side *left,
                        const struct check_side *right, int i, double allowed)
{
    return fabs(left->value[i] - right->value[i]) + left->margin[i] +
               right->margin[i] <
           allowed;
}

static void check_border(struct check *check, int64_t t_ns_q12,
                         const struct check_side *left,
                         const struct check_side *right)
{
    const bool has_jerk = check->limit->jerk_q32 != 0;
    const double vel =
        left->rounding[0] + right->rounding[0] + check->vel_sampling;
    const double acc =
        left->rounding[1] + right->rounding[1] + check->acc_sampling;

    if (check_joins(left, right, 0, vel) &&
        (!has_jerk || check_joins(left, right, 1, acc)))
        return;
    int64_t a[2], b[2];
    check_state(left, a);
    check_state(right, b);
    check_step(check, PLAN_VEL_STEP, t_ns_q12, a[0], b[0], vel);
    if (has_jerk)
        check_step(check, PLAN_ACC_STEP, t_ns_q12, a[1], b[1], acc);
}

/* The border before a segment, and the segment; `former`, the one before it, is
 * NULL at the first.  Whether nothing is wrong with them. */
static bool check_next(struct check *check, const struct motion_segment *former,
                       struct plan_facts *former_facts,
                       const struct motion_segment *segment,
                       struct plan_facts *facts)
{
    const uint32_t count = check->count;
    const struct check_side left =
        former == NULL ? check_rest
                       : check_side(check, former, former_facts, true);
    const struct check_side right = check_side(check, segment, facts, false);
    bool is_inside;

    check_border(check, segment->start_ns_q12, &left, &right);
    check_segment(check, segment, facts);
    is_inside = check->count == count;
    for (unsigned kind = 0; kind < CHECK_KINDS; kind++)
        is_inside = is_inside && check->open[kind] == 0;
    return is_inside;
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
    const struct motion_segment *segment = source->next(source->context);
    struct motion_segment former = { 0 }; /* `next` may write over it */
    struct plan_facts own[2], *former_facts = NULL;

    check_sampling(&check);
    if (segment == NULL) {
        const struct motion_extreme pos = { .min = track->end.pos_q32,
                                            .max = track->end.pos_q32 };
        check_pos(&check, &pos);
    }
    for (int i = 0; segment != NULL;
         segment = source->next(source->context), i ^= 1) {
        struct plan_facts *facts =
            source->facts != NULL ? source->facts(source->context) : &own[i];
        bool *is_inside = source->is_inside != NULL
                              ? source->is_inside(source->context)
                              : &(bool){ false };
        if (facts == &own[i])
            plan_facts_of(segment, facts);
        if (*is_inside)
            memset(check.open, 0, sizeof check.open);
        else
            *is_inside =
                check_next(&check, former_facts == NULL ? NULL : &former,
                           former_facts, segment, facts);
        former = *segment;
        former_facts = facts;
    }
    const struct check_side last =
        former_facts == NULL ? check_rest
                             : check_side(&check, &former, former_facts, true);
    check_border(&check, track->end_ns_q12, &last, &check_rest);
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
