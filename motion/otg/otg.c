/* motion/otg/otg.c - see otg.h.  The route of a request:
 *
 *   is it sound?
 *   problem   short reals, limits tightened, ends brought inside (problem.c)
 *   search    the shape, by one root (search.c) on a border (border.c)
 *   exact     whole ticks and units (round.c) that meet the goal (exact.c)
 *   check     (check.c); while that fails, again with a larger margin
 *
 * Beside it: what the edge of the possible needs (edge.c), and motions with no
 * time to spare in the nearest whole tick. */
#include <stddef.h>

#include "motion/core/err.h"
#include "motion/core/fixed.h"
#include "motion/otg/internal.h"
#include "motion/otg/otg.h"

#define NEAREST_LONGER 10 /* a goal that is met takes 2^-10 more, and */
#define NEAREST_TICKS  2  /* two ticks, before a residual is better */
#define NEAREST_ROUGH  16 /* left open at first: 2^-16 of the change, */
#define NEAREST_STEPS  32 /* 32 steps of the format, */
#define NEAREST_OPEN   38 /* what the acceleration makes in 2^-38 s, 15 ticks */
#define TICKS_PER_S    UINT64_C(4096000000000)
#define CHANGE_POWER   12 /* 2 dv ticks_per_s / n unit/s2 */
#define DIP_POWER      22 /* 8 v ticks_per_s / n^2 unit/s2, 2^8 to spare */

/* --- is the request sound, and possible at all? --------------------------- */

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

static int otg_limits_are_valid(const struct motion_otg_move *move,
                                enum motion_otg_field *field)
{
    const struct motion_otg_limit *lim = &move->limit;
    bool acc = lim->acc_max_q32 != 0 || lim->acc_min_q32 != 0;
    bool vel = move->mode == MOTION_OTG_POSITION;
    if (vel && lim->vel_max_q32 <= 0)
        return otg_refuse(field, MOTION_OTG_FIELD_VEL_MAX, MOTION_E_ARG);
    if (vel && lim->vel_min_q32 >= 0)
        return otg_refuse(field, MOTION_OTG_FIELD_VEL_MIN, MOTION_E_ARG);
    if (lim->jerk_q32 < 0)
        return otg_refuse(field, MOTION_OTG_FIELD_JERK, MOTION_E_ARG);
    if ((acc || lim->jerk_q32) && lim->acc_max_q32 <= 0)
        return otg_refuse(field, MOTION_OTG_FIELD_ACC_MAX, MOTION_E_ARG);
    if ((acc || lim->jerk_q32) && lim->acc_min_q32 >= 0)
        return otg_refuse(field, MOTION_OTG_FIELD_ACC_MIN, MOTION_E_ARG);
    if (lim->jerk_down_q32 < 0 || (lim->jerk_down_q32 && !lim->jerk_q32))
        return otg_refuse(field, MOTION_OTG_FIELD_JERK_DOWN, MOTION_E_ARG);
    if (move->dur_ns_q12 < 0 || (!vel && move->dur_ns_q12 != 0))
        return otg_refuse(field, MOTION_OTG_FIELD_DURATION, MOTION_E_ARG);
    return MOTION_OK;
}

/* What the formats hold, but has no negative, or no place in a track. */
static int otg_fits_formats(const struct motion_otg_move *move,
                            enum motion_otg_field *field)
{
    const struct motion_otg_limit *lim = &move->limit;
    const struct motion_state *start = &move->start, *goal = &move->goal;
    if (lim->vel_min_q32 == INT64_MIN)
        return otg_refuse(field, MOTION_OTG_FIELD_VEL_MIN, MOTION_E_RANGE);
    if (lim->acc_min_q32 == INT64_MIN)
        return otg_refuse(field, MOTION_OTG_FIELD_ACC_MIN, MOTION_E_RANGE);
    if (start->vel_q32 == INT64_MIN)
        return otg_refuse(field, MOTION_OTG_FIELD_START_VEL, MOTION_E_RANGE);
    if (motion_fixed_abs(start->acc_q32) > MOTION_TRACK_ACC_MAX_Q32)
        return otg_refuse(field, MOTION_OTG_FIELD_START_ACC, MOTION_E_RANGE);
    if (goal->vel_q32 == INT64_MIN)
        return otg_refuse(field, MOTION_OTG_FIELD_GOAL_VEL, MOTION_E_RANGE);
    if (motion_fixed_abs(goal->acc_q32) > MOTION_TRACK_ACC_MAX_Q32)
        return otg_refuse(field, MOTION_OTG_FIELD_GOAL_ACC, MOTION_E_RANGE);
    return MOTION_OK;
}

/* The ramp down from `acc` fits below `limit`, or is too long by no more than
 * 2^-40 of the velocities and a unit: numbers that come rounded from elsewhere
 * may tie. */
static bool otg_ramp_fits(int64_t vel_q32, int64_t acc_q32, int64_t jerk_q32,
                          int64_t limit_q32)
{
    uint64_t margin = (uint64_t)limit_q32 - (uint64_t)vel_q32;
    uint64_t tie = (motion_fixed_abs(limit_q32) >> 40) + 1;
    return jerk_q32 == 0 ||
           motion_otg_ramp_fits(acc_q32, jerk_q32, margin + tie);
}

/* The goal needs a margin to have been reached: with af < 0 the speed was
 * higher just before. */
static int otg_goal_is_possible(const struct motion_otg_move *move,
                                enum motion_otg_field *field)
{
    const struct motion_otg_limit *lim = &move->limit;
    const struct motion_state *goal = &move->goal;
    int64_t jerk = otg_closing_jerk(lim);
    if (lim->jerk_q32 &&
        (goal->acc_q32 > lim->acc_max_q32 || goal->acc_q32 < lim->acc_min_q32))
        return otg_refuse(field, MOTION_OTG_FIELD_GOAL_ACC, MOTION_E_LIMIT);
    if (move->mode == MOTION_OTG_VELOCITY)
        return MOTION_OK;
    if (goal->vel_q32 > lim->vel_max_q32 || goal->vel_q32 < lim->vel_min_q32)
        return otg_refuse(field, MOTION_OTG_FIELD_GOAL_VEL, MOTION_E_LIMIT);
    if ((goal->acc_q32 < 0 && !otg_ramp_fits(goal->vel_q32, goal->acc_q32, jerk,
                                             lim->vel_max_q32)) ||
        (goal->acc_q32 > 0 && !otg_ramp_fits(-goal->vel_q32, goal->acc_q32,
                                             jerk, -lim->vel_min_q32)))
        return otg_refuse(field, MOTION_OTG_FIELD_GOAL_ACC, MOTION_E_LIMIT);
    return MOTION_OK;
}

bool motion_otg_start_fits(const struct motion_otg_move *move)
{
    const struct motion_otg_limit *lim = &move->limit;
    const struct motion_state *start = &move->start;
    int64_t vel = start->vel_q32, acc = start->acc_q32;
    if (vel > lim->vel_max_q32 || vel < lim->vel_min_q32)
        return false;
    return acc > 0 ? otg_ramp_fits(vel, acc, lim->jerk_q32, lim->vel_max_q32)
                   : otg_ramp_fits(-vel, acc, lim->jerk_q32, -lim->vel_min_q32);
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

/* --- the loop ------------------------------------------------------------- */

/* A shape may not become a plan: rounding to ticks may take more than the
 * margin is, and no whole number of ticks may be a motion's duration.  So
 * larger margins are tried, and longer durations, stage by stage, until a plan
 * passes the check.  Of most moves the first try does; all stages are 35
 * durations of OTG_MARGINS. */
static const struct stage {
    bool is_later; /* durations from the least on, not that itself */
    bool
        is_capped; /* what takes longer than the first try waits: larger margins
                       can close a displacement that was just open */
    bool is_strict; /* as in struct otg_problem */
    int durations;
} stages[] = {
    { .durations = 1, .is_capped = true }, { .durations = 7, .is_later = true },
    { .durations = 1, .is_strict = true }, { .durations = 1 },
    { .durations = 25, .is_later = true },
};

enum { STAGE_LEAST, STAGE_SOON, STAGE_STRICT, STAGE_ALL, STAGE_LATER, STAGES };

#define UP_BITS    23   /* more than the search is off, 2^-27 */
#define CAP_BITS   20   /* no more than 2^-20 longer, */
#define CAP_TICKS  4096 /* and a ns */
#define LATER_BITS 4    /* the second duration is 2^4 ticks more */
#define EDGE_OFF   10   /* what a search next to the edge may be off */

/* One try, and what is needed for the next. */
struct tries {
    int64_t dur;  /* of this one; 0: the least */
    int64_t most; /* what takes longer waits */
    int64_t given, least;
    int stage, end;       /* of the stages; the first that is not for it */
    int duration, margin; /* counted in the stage, and at this duration */
    int finest;
    struct otg_margin by;
};

static void tries_begin(struct tries *t, int64_t dur)
{
    const struct otg_margin by = { OTG_MARGIN_BITS, OTG_MARGIN_BITS,
                                   OTG_MARGIN_BITS,
                                   stages[t->stage].is_strict };
    t->dur = dur;
    t->most = INT64_MAX;
    t->margin = 0;
    t->finest = OTG_MARGIN_BITS;
    t->by = by;
}

static void tries_init(struct tries *t, enum motion_otg_mode mode,
                       int64_t dur_ns_q12)
{
    bool is_least = mode == MOTION_OTG_POSITION && dur_ns_q12 == 0;
    t->stage = is_least ? STAGE_LEAST : STAGE_ALL;
    t->end = mode == MOTION_OTG_POSITION ? STAGES : STAGE_LATER;
    t->duration = 0;
    t->given = dur_ns_q12;
    t->least = dur_ns_q12 + (dur_ns_q12 >> OTG_MARGIN_BITS) + 1;
    tries_begin(t, dur_ns_q12);
}

/* What the first try at a duration came to, which took `dur`. */
static void tries_measure(struct tries *t, int64_t dur)
{
    t->finest = motion_otg_margin_bits(dur);
    if (t->dur == 0)
        t->least = dur;
    if (stages[t->stage].is_capped)
        t->most = dur + (dur >> CAP_BITS) + CAP_TICKS;
}

/* A larger margin, a longer duration or the next stage, after a try that came
 * to `next`, or was blocked up to there; false after the last one.  A
 * displacement may be covered in no whole number of ticks: at a given speed in
 * a part of one, or within what the jerk allows only in times between two.  So
 * durations are a little longer each, or from the next on at which there is a
 * motion. */
static bool tries_next(struct tries *t, bool is_blocked, int64_t next)
{
    if (is_blocked && t->stage != STAGE_SOON && next > t->dur)
        t->least = next;
    if (!is_blocked && t->margin == 0)
        tries_measure(t, next);
    if (!is_blocked && ++t->margin < OTG_MARGINS) {
        t->by = motion_otg_margin(t->finest,
                                  t->margin - (t->finest < OTG_MARGIN_BITS));
        t->by.is_strict = stages[t->stage].is_strict;
        return true;
    }
    int k = t->duration++;
    if (t->duration < stages[t->stage].durations) {
        tries_begin(t, t->least + (t->least >> (OTG_MARGIN_BITS - k)) +
                           ((int64_t)1 << (LATER_BITS + k)));
        return true;
    }
    if (++t->stage == t->end)
        return false;
    t->duration = 0;
    tries_begin(t, stages[t->stage].is_later ? t->least : t->given);
    return true;
}

/* Seconds to whole 2^-12 ns, up by more than the search is off and so much that
 * there is something to choose from. */
static int64_t in_ns_q12(struct num t)
{
    struct num up = num_add(t, num_scale(t, -UP_BITS));
    return motion_real_floor_clamped(
               num_real(num_mul(up, motion_otg_per_second())), 0) +
           1;
}

static bool is_there(const struct motion_otg_move *move)
{
    const struct motion_state *start = &move->start, *goal = &move->goal;
    return (move->mode == MOTION_OTG_VELOCITY ||
            start->pos_q32 == goal->pos_q32) &&
           start->vel_q32 == goal->vel_q32 && start->acc_q32 == goal->acc_q32;
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
    motion_otg_propose_velocity(q, shape);
    return MOTION_OK;
}

/* The plan's duration is the shape's where the answer is MOTION_E_LIMIT, or the
 * next where the duration is blocked.  A shape that takes too long is not made
 * good, nor one on the edge where is_edge says to look for that. */
static int otg_try(const struct motion_otg_move *move, const struct tries *t,
                   bool *is_edge, struct motion_otg_plan *plan,
                   enum motion_otg_field *field)
{
    struct otg_problem q;
    struct otg_shape shape;
    struct num next = num_zero();
    motion_otg_problem_init(move, t->by, &q);
    int err = otg_shape_of(move, &q, t->dur, &shape, &next);
    if (err < 0) {
        plan->dur_ns_q12 = in_ns_q12(next);
        return otg_refuse(field, MOTION_OTG_FIELD_DURATION, err);
    }
    err = MOTION_E_LIMIT;
    *is_edge = *is_edge && shape.is_edge;
    if (!*is_edge && (t->most == INT64_MAX ||
                      in_ns_q12(motion_otg_shape_time(&shape)) <= t->most))
        err = motion_otg_settle(move, &q, &shape, t->dur, plan, field);
    if (err == MOTION_E_LIMIT)
        plan->dur_ns_q12 = in_ns_q12(motion_otg_shape_time(&shape));
    return err;
}

/* Without a limit on it, what a start or goal has of acceleration (velocity)
 * does not matter: it steps. */
static struct motion_otg_move
without_unlimited(const struct motion_otg_move *move)
{
    struct motion_otg_move m = *move;
    if (!m.limit.jerk_q32)
        m.start.acc_q32 = m.goal.acc_q32 = 0;
    if (!m.limit.acc_max_q32)
        m.start.vel_q32 = m.goal.vel_q32 = 0;
    return m;
}

static int64_t least_of(const struct motion_otg_move *move)
{
    static const struct otg_margin margin = { OTG_MARGIN_BITS, OTG_MARGIN_BITS,
                                              OTG_MARGIN_BITS, false };
    struct otg_problem q;
    struct otg_shape shape;
    struct num next;
    motion_otg_problem_init(move, margin, &q);
    (void)otg_shape_of(move, &q, 0, &shape, &next);
    struct num t =
        num_mul(motion_otg_shape_time(&shape), motion_otg_per_second());
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
            move->limit.jerk_q32 ? least_of(move) : least_unlimited(move);
    return err;
}

int motion_otg_make(const struct motion_otg_move *move,
                    struct motion_otg_plan *plan, enum motion_otg_field *field)
{
    enum motion_otg_field unused;
    return motion_otg_make_in(move, move->dur_ns_q12, plan,
                              field ? field : &unused);
}

/* Where the displacement is next to what the plain change of speed covers,
 * tightening limits costs the root of it: that is made exactly, or what is next
 * to it, unless the search has a shorter motion, with the acceleration on one
 * side of zero. */
OTG_OWN_FRAME static int otg_make_edge(const struct motion_otg_move *move,
                                       struct motion_otg_plan *plan,
                                       enum motion_otg_field *field)
{
    int64_t dur = plan->dur_ns_q12;
    int err = motion_otg_plain(move, plan, field);
    if (err < 0)
        err = motion_otg_edge(move, dur, plan, field);
    if (err == MOTION_OK && plan->dur_ns_q12 > dur + (dur >> EDGE_OFF))
        err = MOTION_E_LIMIT;
    return err;
}

/* One try after the other. */
static int otg_make_tries(const struct motion_otg_move *move, struct tries *t,
                          struct motion_otg_plan *plan,
                          enum motion_otg_field *field)
{
    int err;
    do {
        if (stages[t->stage].is_later &&
            t->dur >= MOTION_TRACK_SEGMENT_MAX_NS_Q12)
            return otg_refuse(field, MOTION_OTG_FIELD_GOAL_POS, MOTION_E_RANGE);
        bool is_edge = t->stage == STAGE_LEAST && t->margin == 0;
        err = otg_try(move, t, &is_edge, plan, field);
        if (is_edge && otg_make_edge(move, plan, field) == MOTION_OK)
            return MOTION_OK;
        if (is_edge) {
            is_edge = false;
            err = otg_try(move, t, &is_edge, plan, field);
        }
    } while (err == MOTION_E_LIMIT &&
             tries_next(t,
                        t->margin == 0 && *field == MOTION_OTG_FIELD_DURATION,
                        plan->dur_ns_q12));
    return err;
}

/* --- no time to spare: the nearest whole tick ------------------------------
 *
 * One phase, or one change between two velocities; docs/OTG.md, section 5. */

/* a / b seconds in ticks, up, both in one format; OTG_TICKS_MOST where they are
 * too many or have two signs. */
static int64_t ticks_of(int64_t a, int64_t b)
{
    uint64_t n, rest;
    struct motion_u128 all = wide_mul_u64(motion_fixed_abs(a), TICKS_PER_S);
    if ((a ^ b) < 0 ||
        motion_fixed_div_u128(all, motion_fixed_abs(b), &n, &rest) < 0)
        return OTG_TICKS_MOST;
    return (int64_t)(n >> 1 < (uint64_t)OTG_TICKS_MOST
                         ? n + (rest != 0)
                         : (uint64_t)OTG_TICKS_MOST);
}

static int64_t nearest_jerk(const struct motion_otg_limit *limit)
{
    int64_t down = otg_closing_jerk(limit);
    return down < limit->jerk_q32 ? down : limit->jerk_q32;
}

/* Could one phase make the change of velocity, roughly?  Full jerk from a0 to
 * a1 makes 2 jerk (v1 - v0) = (a0 + a1) |a1 - a0|; NEAREST_ROUGH of that, some
 * ticks and some steps of the formats are left open.  Most moves end here: the
 * rest costs a plan and its check. */
static bool nearest_is_likely(const struct motion_otg_move *move)
{
    const struct motion_state *start = &move->start, *goal = &move->goal;
    const int64_t a0 = start->acc_q32, a1 = goal->acc_q32;
    int64_t by;
    if ((goal->vel_q32 | a1) == 0 ||
        motion_fixed_sub(goal->vel_q32, start->vel_q32, &by) < 0)
        return false;
    if (a0 == a1)
        return true;
    const uint64_t jerk = (uint64_t)nearest_jerk(&move->limit);
    const uint64_t size0 = motion_fixed_abs(a0), size1 = motion_fixed_abs(a1);
    const uint64_t most = size0 < size1 ? size1 : size0;
    const int64_t mean = a0 / 2 + a1 / 2;
    const uint64_t step =
        a0 < a1 ? (uint64_t)a1 - (uint64_t)a0 : (uint64_t)a0 - (uint64_t)a1;
    struct motion_u128 gain = wide_mul_u64(motion_fixed_abs(mean), step);
    struct motion_u128 have = wide_mul_u64(motion_fixed_abs(by), jerk);
    const struct motion_u128 both = wide_add(have, gain);
    struct motion_u128 margin =
        wide_mul_u64(NEAREST_STEPS + (most >> NEAREST_OPEN), jerk);
    margin = wide_add(margin, wide_shr(both, NEAREST_ROUGH));
    have = (by ^ mean) < 0 ? both : wide_abs(wide_sub(have, gain));
    return !wide_is_less(margin, have);
}

/* At the mean of both speeds; where acceleration steps, in no less than it
 * takes, and a tick for the steps. */
static int64_t change_ticks(const struct motion_otg_move *move)
{
    const struct motion_otg_limit *lim = &move->limit;
    const int64_t v0 = move->start.vel_q32, v1 = move->goal.vel_q32;
    int64_t by, both = v0, least = 0;
    if (motion_fixed_sub(move->goal.pos_q32, move->start.pos_q32, &by) < 0 ||
        (v0 != v1 && (motion_fixed_add(by, by, &by) < 0 ||
                      motion_fixed_add(v0, v1, &both) < 0)))
        return 0;
    if (lim->jerk_q32 == 0)
        least = 1 + ticks_of(v1 - v0,
                             v1 < v0 ? lim->acc_min_q32 : lim->acc_max_q32);
    int64_t n = ticks_of(by, both);
    return n < least ? least : n;
}

/* The least time of one phase, or from one cruise to another; zero where
 * neither can be the answer. */
static int64_t nearest_ticks(const struct motion_otg_move *move)
{
    const struct motion_state *start = &move->start, *goal = &move->goal;
    int64_t jerk = nearest_jerk(&move->limit);
    if (start->acc_q32 != goal->acc_q32)
        return motion_otg_full_ticks(goal->acc_q32 - start->acc_q32, jerk, 32);
    if (start->acc_q32 != 0) /* nearest_is_likely has subtracted them */
        return ticks_of(goal->vel_q32 - start->vel_q32, start->acc_q32);
    return move->mode == MOTION_OTG_VELOCITY ? 0 : change_ticks(move);
}

static int nearest_start(const struct motion_otg_move *move, int power,
                         struct motion_otg_plan *plan)
{
    plan->count = 0;
    plan->dur_ns_q12 = 0;
    plan->trim[0] = plan->trim[1] = 0;
    return motion_otg_round_units(move, power, plan);
}

/* Down and up again by what the last tick is too much. */
static int nearest_dip(const struct motion_otg_move *move, int64_t n,
                       struct motion_otg_plan *plan)
{
    int power = DIP_POWER + 2 * (int)motion_real_clz((uint64_t)n) - 64 -
                (int)motion_real_clz(motion_fixed_abs(move->start.vel_q32));
    int err = nearest_start(move, power, plan);
    if (err < 0 || move->start.acc_q32 != 0 || n < 4)
        return MOTION_E_LIMIT;
    motion_otg_plan_add(plan, n / 4, 1);
    motion_otg_plan_add(plan, n / 2, -1);
    motion_otg_plan_add(plan, n - n / 4 - n / 2, 0);
    err = motion_otg_trim(MOTION_OTG_POSITION, 0, OTG_TRIM_FREELY, plan);
    plan->brake = 0; /* the lower jerk everywhere */
    return err < 0 ? err : motion_otg_check(move, plan, NULL);
}

/* Up to the acceleration that makes the change of velocity and back to zero, in
 * halves, or steps of a tick: V = 2 A (n - n0). */
static int nearest_change(const struct motion_otg_move *move, int64_t n,
                          struct motion_otg_plan *plan)
{
    const int64_t v0 = move->start.vel_q32, v1 = move->goal.vel_q32;
    const int64_t n0 = move->limit.jerk_q32 ? n / 2 : 1;
    uint64_t acc;
    int power = CHANGE_POWER + (int)motion_real_clz((uint64_t)n) -
                (int)motion_real_clz(motion_fixed_abs(v1 - v0));
    int err = nearest_start(move, power, plan);
    if (err < 0)
        return err;
    struct motion_u128 by = wide_sub(motion_otg_vel_image(v1, plan->acc_bits),
                                     motion_otg_vel_image(v0, plan->acc_bits));
    err =
        motion_fixed_div_u128(wide_abs(by), 2 * (uint64_t)(n - n0), &acc, NULL);
    if (err < 0)
        return err;
    const int64_t peak = v1 < v0 ? -(int64_t)acc : (int64_t)acc;
    motion_otg_plan_add(plan, n0, peak);
    motion_otg_plan_add(plan, n - 2 * n0, peak);
    motion_otg_plan_add(plan, n0, 0);
    return MOTION_OK;
}

static int nearest_ramp(const struct motion_otg_move *move, int64_t n,
                        struct motion_otg_plan *plan)
{
    int err = nearest_start(move, -1000, plan);
    if (err == MOTION_OK)
        motion_otg_plan_add(
            plan, n, motion_otg_acc_image(move->goal.acc_q32, plan->acc_bits));
    return err;
}

/* It ends where it ends: its place cut towards the start, which leads the
 * velocity of a track away from its limit. */
static int nearest_phase(const struct motion_otg_move *move, int64_t n,
                         struct motion_otg_plan *plan)
{
    const struct motion_state *goal = &move->goal;
    bool is_ramp = (move->start.acc_q32 | goal->acc_q32) != 0 ||
                   move->start.vel_q32 == goal->vel_q32;
    int err =
        is_ramp ? nearest_ramp(move, n, plan) : nearest_change(move, n, plan);
    if (err < 0)
        return err;
    const int bits = plan->acc_bits;
    struct otg_run run = motion_otg_run_start(plan);
    for (int i = 0; i < plan->count; i++)
        motion_otg_run_phase(&run, &plan->phase[i]);
    plan->goal_vel_q32 = motion_otg_vel_public(run.v, bits);
    err = motion_otg_pos_public(run.p, bits, plan->start_pos_q32, true,
                                &plan->goal_pos_q32);
    /* what is too far off to say is no nearest tick */
    if (err < 0 || motion_fixed_sub(goal->vel_q32, plan->goal_vel_q32,
                                    &plan->residual_vel_q32) < 0)
        return MOTION_E_LIMIT;
    if (move->mode == MOTION_OTG_POSITION &&
        motion_fixed_sub(goal->pos_q32, plan->goal_pos_q32,
                         &plan->residual_pos_q32) < 0)
        return MOTION_E_LIMIT;
    return motion_otg_check(move, plan, NULL);
}

/* Where one phase, or one change between two velocities, does it in much less
 * time than the plan that was made (or refused, `err`): that in whole ticks,
 * with a residual where it has one.  Returns err, or MOTION_OK. */
OTG_OWN_FRAME static int otg_nearest(const struct motion_otg_move *move,
                                     int err, struct motion_otg_plan *plan)
{
    struct motion_otg_plan made;
    if (!nearest_is_likely(move))
        return err;
    int64_t n = nearest_ticks(move);
    int64_t most = n + (n >> NEAREST_LONGER) + NEAREST_TICKS;
    if (n != 0 && n < OTG_TICKS_MOST && (err < 0 || plan->dur_ns_q12 > most) &&
        (nearest_dip(move, n, &made) == MOTION_OK ||
         nearest_phase(move, n, &made) == MOTION_OK)) {
        *plan = made;
        return MOTION_OK;
    }
    return err;
}

/* A cruise with both ends on the limit, made exactly; false where the jerk
 * cannot. */
static bool otg_cruise(const struct motion_otg_move *move,
                       struct motion_otg_plan *plan)
{
    const int64_t vel = move->start.vel_q32;
    if (move->start.acc_q32 != 0 || vel != move->goal.vel_q32 ||
        (vel != move->limit.vel_max_q32 && vel != move->limit.vel_min_q32))
        return false;
    int64_t n = nearest_ticks(move);
    return n != 0 && n < OTG_TICKS_MOST &&
           nearest_dip(move, n, plan) == MOTION_OK;
}

/* --- the motion ------------------------------------------------------------ */

/* A plan that meets its goal. */
static int otg_make_exact(const struct motion_otg_move *move,
                          int64_t dur_ns_q12, struct motion_otg_plan *plan,
                          enum motion_otg_field *field)
{
    struct tries t;
    bool has_place = move->mode == MOTION_OTG_POSITION;
    if (has_place ? dur_ns_q12 == 0 && otg_cruise(move, plan)
                  : motion_otg_plain(move, plan, field) == MOTION_OK)
        return MOTION_OK;
    tries_init(&t, move->mode, dur_ns_q12);
    int err = otg_make_tries(move, &t, plan, field);
    if (dur_ns_q12 != 0 && t.stage > STAGE_ALL)
        return otg_refuse(field, MOTION_OTG_FIELD_DURATION,
                          err == MOTION_E_RANGE ? err : MOTION_E_LIMIT);
    if (err == MOTION_E_LIMIT && has_place)
        *field = MOTION_OTG_FIELD_GOAL_POS;
    return err;
}

static int otg_make_valid(const struct motion_otg_move *move,
                          int64_t dur_ns_q12, struct motion_otg_plan *plan,
                          enum motion_otg_field *field)
{
    int err = otg_make_exact(move, dur_ns_q12, plan, field);
    return dur_ns_q12 ? err : otg_nearest(move, err, plan);
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
        err = move->limit.jerk_q32
                  ? otg_make_valid(move, dur_ns_q12, plan, field)
                  : otg_make_unlimited(move, dur_ns_q12, plan, field);
    if (err < 0)
        plan->count = 0;
    if (err < 0 && move->mode == MOTION_OTG_VELOCITY &&
        *field == MOTION_OTG_FIELD_GOAL_POS)
        *field = MOTION_OTG_FIELD_GOAL_VEL;
    return err;
}
