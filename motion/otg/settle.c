/* motion/otg/settle.c - a proposal in reals becomes a plan that has passed the
 * check.
 *
 *   whole ticks and units (round.c)  ->  meet the goal by moving two
 *   accelerations a little (trim.c)  ->  check (check.c)
 *
 * Where a ramp would bend by more than the room that drawn-in limits leave, a
 * Newton step on the places where the motion is free comes first
 * (round.c). */
#include <stddef.h>

#include "motion/core/err.h"
#include "motion/core/fixed.h"
#include "motion/otg/internal.h"

#define SETTLE_REPAIRS 4
#define SETTLE_STEPS   4
#define SETTLE_LONGER  21 /* 2^-21 more than proposed, and a ns */
#define SETTLE_FREELY                                                          \
    10 /* with two jerks, or where time grows with the root
                             of what a way is off, 2^-10 */
#define SETTLE_TICKS 4096

struct settle {
    const struct motion_otg_move *move;
    const struct otg_shape *shape;
    struct motion_otg_plan *plan;
    int64_t dur_ns_q12; /* wanted, or 0 */
    int64_t rounded;    /* that of the proposal */
    struct otg_rates rates;
    uint32_t fixed; /* corners that may not move */
    bool is_strict;
};

int64_t motion_otg_phase_jerk(const struct motion_otg_limit *lim,
                              const struct motion_otg_plan *plan, int i)
{
    int64_t jerk = lim->jerk_q32;
    int64_t down = otg_closing_jerk(lim);
    if (i < plan->brake)
        return jerk;
    return i >= plan->turn || down < jerk ? down : jerk;
}

/* The longest phase whose corners may move takes what is missing from the
 * wanted total; with `rates` the one with the most time to spare. */
static int settle_total(struct motion_otg_plan *plan, uint32_t fixed,
                        int64_t dur_ns_q12, const struct otg_rates *rates)
{
    int longest = -1;
    int64_t from = plan->start_acc;
    int64_t most = 0, missing = dur_ns_q12 - plan->dur_ns_q12;
    if (dur_ns_q12 == 0 || missing == 0)
        return MOTION_OK;
    if (dur_ns_q12 >= MOTION_TRACK_SEGMENT_MAX_NS_Q12)
        return MOTION_E_RANGE;
    for (int i = 0; i < plan->count; i++) {
        bool ends = (i == 0 && (fixed & 1)) ||
                    (i > 0 && i + 1 == plan->count && (fixed >> (i - 1) & 1));
        int64_t spare = plan->phase[i].dur_ns_q12, acc = plan->phase[i].acc;
        if (rates)
            spare -= motion_otg_ramp_ticks(rates, i, acc - from);
        from = acc;
        if (!ends && spare > most) {
            most = spare;
            longest = i;
        }
    }
    if (most + missing <= 0 || longest < 0)
        return MOTION_E_LIMIT;
    plan->phase[longest].dur_ns_q12 += missing;
    plan->dur_ns_q12 = dur_ns_q12;
    return MOTION_OK;
}

/* One step on the shape's own knobs; what it misses is known exactly.  The
 * first one finds the duration where it is free, the others keep that: a part
 * of a tick at the cruise's speed may be more than the pulses can bear. */
static void settle_polish(const struct settle *s, bool is_first)
{
    struct motion_otg_plan *plan = s->plan;
    struct otg_miss miss;
    struct wider way;
    struct motion_u128 vel;
    motion_otg_plan_miss(plan, &vel, &way);
    miss.vel = motion_otg_vel_num(&vel, plan->acc_bits);
    miss.way = motion_otg_way_num(&way, plan->acc_bits);
    miss.is_timed = s->dur_ns_q12 != 0 || !is_first;
    miss.ticks = s->dur_ns_q12 ? s->dur_ns_q12 - plan->dur_ns_q12 : 0;
    motion_otg_polish(plan, s->shape, &s->rates, &miss);
}

/* --- nothing to do for some time ------------------------------------------ */

static bool stands_still(const struct motion_otg_move *move)
{
    const struct motion_state *start = &move->start, *goal = &move->goal;
    return move->mode == MOTION_OTG_POSITION &&
           start->pos_q32 == goal->pos_q32 &&
           (start->vel_q32 | goal->vel_q32) == 0 &&
           (start->acc_q32 | goal->acc_q32) == 0;
}

static int settle_wait(int64_t dur_ns_q12, struct motion_otg_plan *plan)
{
    plan->count = 1;
    plan->phase[0] = (struct motion_otg_phase){ dur_ns_q12, 0 };
    plan->dur_ns_q12 = dur_ns_q12;
    plan->brake = plan->turn = 0;
    plan->trim[0] = plan->trim[1] = 0;
    return dur_ns_q12 < MOTION_TRACK_SEGMENT_MAX_NS_Q12 ? MOTION_OK
                                                        : MOTION_E_RANGE;
}

/* --- all of it ------------------------------------------------------------ */

static enum otg_trim settle_trim(const struct settle *s)
{
    return s->dur_ns_q12 ? OTG_TRIM_FREELY : OTG_TRIM_USUAL;
}

/* After so many steps of polishing; without any, no ramp may bend by more than
 * its room. */
static int settle_make(struct settle *s, int steps)
{
    struct motion_otg_plan *plan = s->plan;
    uint32_t ends;
    int err = motion_otg_round(s->move, s->shape, &s->rates, plan, &ends);
    if (err < 0)
        return err;
    s->rounded = plan->dur_ns_q12;
    if (steps > 0)
        motion_otg_round_ends(plan);
    for (int i = 0; i < steps && s->shape->knobs.pulse[0] >= 0; i++)
        settle_polish(s, i == 0);
    s->fixed = motion_otg_round_join(s->shape, ends, plan);
    err = settle_total(plan, s->fixed, s->dur_ns_q12, NULL);
    return err < 0 ? err
                   : motion_otg_trim(s->move->mode, s->fixed,
                                     steps ? settle_trim(s) : OTG_TRIM_GENTLY,
                                     plan);
}

/* Trimming made some ramps steeper than they may be: give them time.  With a
 * wanted duration the phase that can spare most gives it. */
static int settle_repair(struct settle *s)
{
    struct motion_otg_plan *plan = s->plan;
    int64_t acc = plan->start_acc;
    s->rates.brake = plan->brake;
    s->rates.turn = plan->turn;
    for (int i = 0; i < plan->count; i++) {
        struct motion_otg_phase *ph = &plan->phase[i];
        int64_t least = motion_otg_ramp_ticks(&s->rates, i, ph->acc - acc);
        bool is_swing =
            (i == 0 && (s->fixed & 1)) ||
            (i > 0 && i + 1 == plan->count && (s->fixed >> (i - 1) & 1));
        if (least > ph->dur_ns_q12 && !is_swing) {
            least += (least >> 24) + 16;
            plan->dur_ns_q12 += least - ph->dur_ns_q12;
            ph->dur_ns_q12 = least;
        }
        acc = ph->acc;
    }
    int err = settle_total(plan, s->fixed, s->dur_ns_q12, &s->rates);
    return err < 0
               ? err
               : motion_otg_trim(s->move->mode, s->fixed, settle_trim(s), plan);
}

/* With two jerks the cruise's speed says which counts where, so what moves it
 * may not go far. */
static bool has_two_jerks(const struct settle *s)
{
    return s->move->limit.jerk_down_q32 != 0;
}

/* Made good at the price of a longer time. */
static bool is_longer(const struct settle *s)
{
    int bits = has_two_jerks(s) || s->is_strict ? SETTLE_FREELY : SETTLE_LONGER;
    return s->dur_ns_q12 == 0 &&
           s->plan->dur_ns_q12 >
               s->rounded + (s->rounded >> bits) + SETTLE_TICKS;
}

static int settle_check(const struct settle *s, int err,
                        enum motion_otg_field *field)
{
    *field = MOTION_OTG_FIELD_GOAL_POS;
    if (err == MOTION_OK)
        err = motion_otg_check(s->move, s->plan, field);
    if (err == MOTION_OK && is_longer(s)) {
        *field = MOTION_OTG_FIELD_GOAL_POS;
        err = MOTION_E_LIMIT;
    }
    return err;
}

/* By more steps of polishing: not a cruise that is too fast, which they
 * keep. */
static bool is_curable(enum motion_otg_field field)
{
    return field == MOTION_OTG_FIELD_GOAL_POS || field == MOTION_OTG_FIELD_JERK;
}

/* Braking leaves more than trimming alone can make good. */
int motion_otg_settle(const struct motion_otg_move *move,
                      const struct otg_problem *problem,
                      const struct otg_shape *shape, int64_t dur_ns_q12,
                      struct motion_otg_plan *plan,
                      enum motion_otg_field *field)
{
    struct settle s;
    s.move = move;
    s.shape = shape;
    s.plan = plan;
    s.dur_ns_q12 = dur_ns_q12;
    s.fixed = 0;
    s.is_strict = problem->is_strict;
    int err = motion_otg_round_start(move, problem, shape, &s.rates, plan);
    if (err < 0 || (dur_ns_q12 != 0 && stands_still(move)))
        return settle_check(&s, err < 0 ? err : settle_wait(dur_ns_q12, plan),
                            field);
    bool has_knobs = shape->knobs.pulse[0] >= 0;
    int steps = has_knobs && shape->brake == 0 ? 0 : 1;
    int most = has_knobs && !has_two_jerks(&s) ? SETTLE_STEPS : 1;
    do
        err = settle_check(&s, settle_make(&s, steps++), field);
    while (err == MOTION_E_LIMIT && steps <= most &&
           (steps == 1 || is_curable(*field)));
    for (int k = 0; k < SETTLE_REPAIRS && err == MOTION_E_LIMIT &&
                    *field == MOTION_OTG_FIELD_JERK;
         k++)
        err = settle_check(&s, settle_repair(&s), field);
    return err;
}

int motion_otg_stretch(const struct motion_otg_move *move, int64_t dur_ns_q12,
                       struct motion_otg_plan *plan)
{
    int err = settle_total(plan, 0, dur_ns_q12, NULL);
    if (err == MOTION_OK)
        err = motion_otg_trim(move->mode, 0, OTG_TRIM_FREELY, plan);
    return err < 0 ? err : motion_otg_check(move, plan, NULL);
}
