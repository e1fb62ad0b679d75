/* motion/otg/round.c - from a shape in reals to phases in whole numbers.
 *
 * Times go up to whole ticks, so that no ramp gets steeper; accelerations at
 * the corners are cut to whole units.  What the plan then misses is known to
 * the last bit; where that is much, a Newton step on the places where the
 * motion is free makes it good to the square of it: how long the highest and
 * the lowest acceleration are held or, where they are not, how high they are;
 * and the cruise. */
#include <stddef.h>

#include "motion/core/err.h"
#include "motion/core/fixed.h"
#include "motion/otg/internal.h"

/* Bits that keep V below 2^124 and P below 2^190; one is left for trimming. */
#define ROUND_ACC_BITS 61  /* of an acceleration */
#define ROUND_VEL_BITS 111 /* of a public velocity and acc_bits */
#define ROUND_MOST     70  /* acc_bits of a motion that hardly accelerates */
/* As motion_otg_pos_public; a step of 2^31 unit/s in 2^-32 s has -2. */
#define ROUND_LEAST       (-10)
#define ROUND_CLOSE       52 /* what is 2^-52 of a ramp, or of 1 s, is rounding */
#define ROUND_LEAST_POWER (-1000) /* of no acceleration */
#define ROUND_SWING       22      /* a margin of 2^-22 counts as none */
#define FLAT_BITS         16 /* a change of 2^-16 of an acceleration is none */
#define SHORT_BITS        14 /* 2^-14 of the move, or of the phase beside it */
#define MERGE_BITS        26 /* 2^-26 of the next phase, inside the move */

static int bits_of(int64_t a, int64_t b)
{
    return 64 - (int)motion_real_clz(motion_fixed_abs(a) | motion_fixed_abs(b));
}

static int larger(int a, int b)
{
    return a > b ? a : b;
}

static int smaller(int a, int b)
{
    return a < b ? a : b;
}

/* The finest unit with which accelerations below 2^acc and velocities fit; a
 * displacement of 2^65 does with every one of them. */
static int round_scale(const struct motion_otg_move *move, int acc)
{
    int vel = bits_of(move->start.vel_q32, move->goal.vel_q32);
    acc = larger(acc, bits_of(move->start.acc_q32, move->goal.acc_q32) - 32);
    /* all but the last bit, unless that would cut a public acceleration */
    int bits = acc == 30 ? 32 : ROUND_ACC_BITS - acc;
    bits = smaller(bits, ROUND_VEL_BITS - vel);
    return smaller(bits, ROUND_MOST);
}

int motion_otg_round_units(const struct motion_otg_move *move, int acc,
                           struct motion_otg_plan *plan)
{
    int bits = round_scale(move, acc);
    if (bits < ROUND_LEAST ||
        (bits < 32 && (move->start.acc_q32 | move->goal.acc_q32) != 0))
        return MOTION_E_RANGE;
    plan->acc_bits = bits;
    plan->start_pos_q32 = move->start.pos_q32;
    plan->start_vel_q32 = move->start.vel_q32;
    plan->goal_pos_q32 = move->goal.pos_q32;
    plan->goal_vel_q32 = move->goal.vel_q32;
    plan->residual_pos_q32 = plan->residual_vel_q32 = 0;
    plan->start_acc = motion_otg_acc_image(move->start.acc_q32, bits);
    return MOTION_OK;
}

int motion_otg_round_start(const struct motion_otg_move *move,
                           const struct otg_problem *q,
                           const struct otg_shape *shape,
                           struct otg_rates *rates,
                           struct motion_otg_plan *plan)
{
    int acc = ROUND_LEAST_POWER;
    for (int i = 0; i < shape->count; i++)
        if (shape->phase[i].a.m != 0)
            acc = larger(acc, shape->phase[i].a.e + 30);
    int err = motion_otg_round_units(move, acc, plan);
    if (err < 0)
        return err;
    struct num tick = num_scale(motion_otg_seconds(1), plan->acc_bits);
    rates->j = rates->j2 = num_mul(q->j, tick);
    rates->per_j = rates->per_j2 = num_inv(rates->j);
    if (q->j2.m != q->j.m || q->j2.e != q->j.e) {
        rates->j2 = num_mul(q->j2, tick);
        rates->per_j2 = num_inv(rates->j2);
    }
    rates->brake = shape->brake;
    rates->turn = shape->turn;
    rates->lands = shape->land < shape->count;
    return MOTION_OK;
}

/* --- phases --------------------------------------------------------------- */

/* a 2^bits as an integer, down; saturates at 2^62. */
static int64_t shifted(int64_t a, int bits)
{
    if (bits < 0)
        return a >> (bits < -63 ? 63 : -bits);
    if (a != 0 && bits > (int)motion_real_clz(motion_fixed_abs(a)) - 2)
        return a < 0 ? -((int64_t)1 << 62) : (int64_t)1 << 62;
    return (int64_t)((uint64_t)a << bits);
}

/* Seconds to ticks, 10^9 2^12 per second, to nearest. */
static int64_t ticks_of(struct num dt)
{
    return (shifted((int64_t)dt.m * 1000000000, dt.e + 13) + 1) >> 1;
}

/* The acceleration stays that of the phase before. */
static bool is_hold(const struct otg_phase *ph)
{
    return ph[0].a.m == ph[-1].a.m && ph[0].a.e == ph[-1].a.e;
}

/* Phases one by one as the shape has them.  Where the acceleration moves, as
 * long as its jerk takes at least, and with free phases no longer.  A phase
 * that lasts no time and moves the acceleration by rounding alone stays where
 * it is. */
static int round_phases(const struct otg_shape *shape,
                        const struct otg_rates *rates, int64_t goal_acc,
                        struct motion_otg_plan *plan)
{
    bool is_full = shape->free.pulse[0] >= 0;
    int64_t acc = plan->start_acc;
    plan->count = shape->count;
    plan->dur_ns_q12 = 0;
    for (int i = 0; i < shape->count; i++) {
        const struct otg_phase *ph = &shape->phase[i];
        bool last = i + 1 == shape->count;
        int64_t to =
            last ? goal_acc : shifted(ph->a.m, ph->a.e + plan->acc_bits);
        if (!last && (ph->dt.e < -30 - ROUND_CLOSE || (i > 0 && is_hold(ph))))
            to = acc;
        int64_t n = 0;
        if (to != acc)
            n = motion_otg_ramp_ticks(rates, i, to - acc);
        if ((to == acc || !is_full) && ph->dt.m != 0) {
            int64_t near = ticks_of(ph->dt);
            n = near > n ? near : n;
        }
        plan->phase[i] = (struct motion_otg_phase){ n, to };
        plan->dur_ns_q12 += n;
        acc = to;
        if (n < 0 || plan->dur_ns_q12 >= MOTION_TRACK_SEGMENT_MAX_NS_Q12)
            return MOTION_E_RANGE;
    }
    return MOTION_OK;
}

/* --- ends that swing ------------------------------------------------------
 *
 * A start that swings to its velocity limit (or beyond it, because it has to)
 * needs all the jerk there is in the phase that takes its acceleration through
 * zero, and the shape has it; so has a goal, backwards.  That phase gets the
 * nearest ticks and all that jerk allows in them. */

int64_t motion_otg_full_step(int64_t n, int64_t jerk_q32, int acc_bits)
{
    struct motion_u128 most = wide_mul_u64((uint64_t)jerk_q32, (uint64_t)n);
    uint64_t step;
    int shift = 53 - acc_bits;
    most = shift >= 0 ? wide_shr(most, (unsigned)shift)
                      : motion_fixed_shl_u128(most, (unsigned)-shift);
    if (motion_fixed_div_u128(most, OTG_FIVES, &step, NULL) < 0)
        return INT64_MAX / 4;
    return (int64_t)step;
}

int64_t motion_otg_full_ticks(int64_t step, int64_t jerk_q32, int acc_bits)
{
    uint64_t size = motion_fixed_abs(step), ticks;
    int shift = 53 - acc_bits;
    size -= size >> ROUND_CLOSE;
    struct motion_u128 need = wide_mul_u64(size, OTG_FIVES);
    if (shift > 40)
        return OTG_TICKS_MOST;
    if (shift >= 0)
        need = motion_fixed_shl_u128(need, (unsigned)shift);
    else /* up */
        need = wide_neg(wide_shr(wide_neg(need), (unsigned)-shift));
    need = wide_add(need, wide_from(jerk_q32 - 1));
    if (motion_fixed_div_u128(need, (uint64_t)jerk_q32, &ticks, NULL) < 0 ||
        ticks > (uint64_t)OTG_TICKS_MOST)
        return OTG_TICKS_MOST;
    return (int64_t)ticks;
}

static void set_ticks(struct motion_otg_plan *plan, int i, int64_t n)
{
    plan->dur_ns_q12 += n - plan->phase[i].dur_ns_q12;
    plan->phase[i].dur_ns_q12 = n;
}

/* Between corner i (of a swing from the start 0, to the goal the last but one)
 * and its end's acceleration; other corners of a hold follow, and the ramp
 * behind them, which takes all the jerk there is where `is_full`. */
static bool round_swing(struct motion_otg_plan *plan,
                        const struct otg_rates *rates, bool is_full, int i,
                        int64_t end, struct num dt, int64_t jerk_q32)
{
    struct motion_otg_phase *ph = plan->phase;
    int64_t was = ph[i].acc, n = ticks_of(dt);
    int64_t step = motion_otg_full_step(n, jerk_q32, plan->acc_bits);
    int64_t to = was < end ? end - step : end + step;
    int dir = i == 0 ? 1 : -1, last = plan->count - 2;
    if (n <= 0 || (was ^ end) >= 0 || was == 0 ||
        motion_fixed_abs(to - was) > (uint64_t)step >> FLAT_BITS)
        return false;
    set_ticks(plan, i + (dir < 0), n);
    for (; i >= 0 && i <= last && ph[i].acc == was; i += dir)
        ph[i].acc = to;
    int ramp = dir > 0 ? i : i + 1;
    int64_t next = i < 0 ? plan->start_acc : ph[i].acc;
    int64_t least = motion_otg_ramp_ticks(rates, ramp, next - to);
    if (ph[ramp].dur_ns_q12 > 0 && (is_full || ph[ramp].dur_ns_q12 < least))
        set_ticks(plan, ramp, least);
    return true;
}

/* Does the velocity pass a tightened limit while the acceleration ramps to
 * zero? */
static bool swings_out(int64_t vel, int64_t acc, int64_t jerk_q32,
                       const struct motion_otg_limit *lim)
{
    int64_t limit = acc > 0 ? lim->vel_max_q32 : lim->vel_min_q32;
    bool is_beyond = acc > 0 ? vel > limit : vel < limit;
    uint64_t margin = acc > 0 ? (uint64_t)limit - (uint64_t)vel
                              : (uint64_t)vel - (uint64_t)limit;
    if (acc == 0)
        return false;
    return is_beyond ||
           !motion_otg_ramp_fits(
               acc, jerk_q32, margin - (margin >> ROUND_SWING) - (margin != 0));
}

static uint32_t round_swings(const struct motion_otg_move *move,
                             const struct otg_shape *shape,
                             const struct otg_rates *rates,
                             struct motion_otg_plan *plan)
{
    const struct motion_otg_limit *lim = &move->limit;
    int64_t down = lim->jerk_down_q32 ? lim->jerk_down_q32 : lim->jerk_q32;
    int last = plan->count - 1;
    bool is_full = shape->free.pulse[0] >= 0;
    uint32_t ends = 0;
    if (move->mode != MOTION_OTG_POSITION || lim->jerk_q32 == 0 || last < 1)
        return 0;
    if (shape->brake > 0 &&
        swings_out(move->start.vel_q32, move->start.acc_q32, lim->jerk_q32,
                   lim) &&
        round_swing(plan, rates, is_full, 0, plan->start_acc,
                    shape->phase[0].dt, lim->jerk_q32))
        ends |= OTG_END_START;
    if (shape->land <= last &&
        swings_out(move->goal.vel_q32, -move->goal.acc_q32, down, lim) &&
        round_swing(plan, rates, is_full, last - 1, plan->phase[last].acc,
                    shape->phase[last].dt, down))
        ends |= OTG_END_GOAL;
    return ends;
}

/* Leave out phases of no ticks. */
static void round_compact(const struct otg_shape *shape,
                          struct motion_otg_plan *plan)
{
    int count = plan->count;
    plan->count = plan->brake = plan->turn = 0;
    plan->dur_ns_q12 = 0;
    for (int i = 0; i < count; i++) {
        if (plan->phase[i].dur_ns_q12 == 0)
            continue;
        plan->dur_ns_q12 += plan->phase[i].dur_ns_q12;
        plan->phase[plan->count++] = plan->phase[i];
        if (i < shape->brake)
            plan->brake = plan->count;
        if (i < shape->turn)
            plan->turn = plan->count;
    }
}

static bool is_flat(int64_t from, int64_t to)
{
    uint64_t size = motion_fixed_abs(from) | motion_fixed_abs(to);
    return motion_fixed_abs(to - from) <= size >> FLAT_BITS;
}

static int64_t phase_start(const struct motion_otg_plan *plan, int i)
{
    return i > 0 ? plan->phase[i - 1].acc : plan->start_acc;
}

/* A start or goal on its limit of acceleration has a phase i at it that leads
 * to the tightened limit: 2^-25 of it in as short a time, which no trimming
 * could move by its share.  Its neighbour does that, too: one that holds the
 * limit, or a ramp, which must not be bent by what it takes in. */
static bool is_negligible(const struct motion_otg_plan *plan, int i, int beside)
{
    const struct motion_otg_phase *ph = plan->phase;
    int64_t n = ph[i].dur_ns_q12;
    return n < plan->dur_ns_q12 >> SHORT_BITS &&
           is_flat(phase_start(plan, i), ph[i].acc) &&
           (n < ph[beside].dur_ns_q12 >> SHORT_BITS ||
            is_flat(phase_start(plan, beside), ph[beside].acc));
}

/* The first phase from i on, in steps of `dir`, that has ticks; or the end. */
static int next_lasting(const struct motion_otg_plan *plan, int i, int dir)
{
    while (i > 0 && i + 1 < plan->count && plan->phase[i].dur_ns_q12 == 0)
        i += dir;
    return i;
}

/* Phase i, next to the start or goal, gives its time to the one in direction
 * `dir`. */
static void round_end(struct motion_otg_plan *plan, int i, int dir)
{
    struct motion_otg_phase *ph = plan->phase;
    if (ph[i].dur_ns_q12 == 0)
        i = next_lasting(plan, i + dir, dir);
    int64_t acc = dir > 0 ? phase_start(plan, i) : ph[i].acc;
    int to = i + dir;
    if (to < 0 || to >= plan->count)
        return;
    to = next_lasting(plan, to, dir);
    if (!is_negligible(plan, i, to))
        return;
    ph[to].dur_ns_q12 += ph[i].dur_ns_q12;
    ph[i].dur_ns_q12 = 0;
    for (; i != to; i += dir)
        ph[i].acc = acc;
    if (dir < 0)
        ph[to].acc = acc;
}

/* With all phases still there; giving their time away moves the plan's end. */
void motion_otg_round_ends(struct motion_otg_plan *plan)
{
    if (plan->count < 2)
        return;
    round_end(plan, 0, 1);
    round_end(plan, plan->count - 1, -1);
}

/* Phase i gives its time to the one after it. */
static void merge_on(struct motion_otg_plan *plan, int i)
{
    plan->phase[i + 1].dur_ns_q12 += plan->phase[i].dur_ns_q12;
    plan->count--;
    for (int k = i; k < plan->count; k++)
        plan->phase[k] = plan->phase[k + 1];
    plan->brake -= plan->brake > i;
    plan->turn -= plan->turn > i;
}

static void round_merge(struct motion_otg_plan *plan)
{
    struct motion_otg_phase *ph = plan->phase;
    int last = plan->count - 1;
    for (; last >= 1 && is_negligible(plan, last, last - 1); last--) {
        ph[last - 1].dur_ns_q12 += ph[last].dur_ns_q12;
        ph[last - 1].acc = ph[last].acc;
    }
    plan->count = last + 1;
    while (plan->count > 1 && is_negligible(plan, 0, 1))
        merge_on(plan, 0);
    for (int i = 1; i + 1 < plan->count; i++)
        if (ph[i].dur_ns_q12 <= ph[i + 1].dur_ns_q12 >> MERGE_BITS &&
            is_negligible(plan, i, i + 1))
            merge_on(plan, i--);
    plan->brake = smaller(plan->brake, plan->count);
    plan->turn = smaller(plan->turn, plan->count);
}

int motion_otg_round(const struct motion_otg_move *move,
                     const struct otg_shape *shape,
                     const struct otg_rates *rates,
                     struct motion_otg_plan *plan, uint32_t *ends)
{
    int64_t goal_acc = motion_otg_acc_image(move->goal.acc_q32, plan->acc_bits);
    int err = round_phases(shape, rates, goal_acc, plan);
    *ends = err < 0 ? 0 : round_swings(move, shape, rates, plan);
    return err;
}

uint32_t motion_otg_round_join(const struct otg_shape *shape, uint32_t ends,
                               struct motion_otg_plan *plan)
{
    uint32_t fixed = 0;
    round_compact(shape, plan);
    round_merge(plan);
    if (plan->count < 2)
        return 0;
    if (ends & OTG_END_START)
        fixed |= 1;
    if (ends & OTG_END_GOAL)
        fixed |= (uint32_t)1 << (plan->count - 2);
    return fixed;
}

/* --- one Newton step in exact integers ------------------------------------ */

/* The part of the whole that is small enough for a Newton step, and where two
 * jerks lie between which the cruise's speed chooses. */
#define REFINE_BITS     6
#define REFINE_TWO_BITS 10
/* A pulse is an acceleration that leaves zero and returns to it (acceleration
 * pulse:  Biagiotti & Melchiorri 3.4).  A new one lasts longer than this
 * part. */
#define PULSE_BITS 20

#define ACC_END ((uint64_t)1 << 62) /* accelerations have 62 bits */

struct refine {
    struct motion_otg_plan *plan;
    const struct otg_shape *shape;
    const struct otg_rates *rates;
    struct num per_s;   /* ticks */
    struct num v, d, t; /* what is missing */
    /* Half a second more on either side of a pulse changes speed and position
     * at the end by these, a second more of the cruise the position by
     * `speed`. */
    struct num pulse_v[2], pulse_d[2], speed;
};

static bool is_late(const struct otg_rates *rates, int i)
{
    if (i >= rates->turn)
        return true;
    return i >= rates->brake && num_lt(rates->j2, rates->j);
}

/* The product of a step of up to 57 bits and the 30 of 1 / j; what does not fit
 * is 2^-32 of it. */
int64_t motion_otg_ramp_ticks(const struct otg_rates *rates, int i,
                              int64_t step)
{
    struct num per_j = is_late(rates, i) ? rates->per_j2 : rates->per_j;
    uint64_t size = motion_fixed_abs(step), n = size * (uint32_t)per_j.m;
    int down = -per_j.e;
    if (step == 0)
        return 0;
    if (size >> 34) {
        uint64_t low = (size & UINT32_MAX) * (uint32_t)per_j.m;
        n = (size >> 32) * (uint32_t)per_j.m + (low >> 32);
        down -= 32;
    }
    if (down < 0)
        n = down < -60 || n >> (60 + down) ? (uint64_t)OTG_TICKS_MOST
                                           : n << -down;
    else
        n >>= down > 63 ? 63 : down;
    return (int64_t)(n < (uint64_t)OTG_TICKS_MOST ? n
                                                  : (uint64_t)OTG_TICKS_MOST) +
           1;
}

static int64_t whole(struct num x)
{
    return (motion_real_floor_clamped(num_real(x), 1) + 1) >> 1;
}

/* Too far for a Newton step; x in ticks. */
static bool is_far(const struct refine *p, struct num x)
{
    const struct otg_rates *r = p->rates;
    bool is_one = r->j.m == r->j2.m && r->j.e == r->j2.e;
    int64_t most =
        p->plan->dur_ns_q12 >> (is_one ? REFINE_BITS : REFINE_TWO_BITS);
    return num_lt(num_make(most, 0), num_abs(x));
}

/* A pulse may go, but not turn over: time would be added where it should be
 * taken away. */
static int64_t no_less(bool is_peak, int64_t acc, int64_t end)
{
    return (acc < end) == is_peak ? end : acc;
}

/* A pulse that rises over no end is not made by a rounding: its ramps would be
 * too short for what trimming moves. */
static bool is_no_pulse(const struct refine *p,
                        const struct motion_otg_phase *hold, struct num x)
{
    int64_t least = p->plan->dur_ns_q12 >> PULSE_BITS;
    return (hold[-1].dur_ns_q12 == 0 || hold[1].dur_ns_q12 == 0) &&
           num_lt(num_abs(x), num_int(least));
}

/* Half time x, in ticks, more on either side of a pulse. */
static void turn_pulse(struct refine *p, int which, struct num x)
{
    int i = p->shape->free.pulse[which];
    struct motion_otg_phase *hold = &p->plan->phase[i];
    if (hold->dur_ns_q12 > 0) {
        hold->dur_ns_q12 += whole(num_twice(x));
        if (hold->dur_ns_q12 < 0)
            hold->dur_ns_q12 = 0;
        return;
    }
    if (is_no_pulse(p, hold, x))
        return;
    struct num j = is_late(p->rates, i) ? p->rates->j2 : p->rates->j;
    int64_t by = whole(num_mul(x, j));
    if (!p->shape->free.is_peak[which])
        by = -by;
    int64_t before = i > 1 ? hold[-2].acc : p->plan->start_acc;
    int64_t acc;
    if (motion_fixed_add(hold->acc, by, &acc) < 0 ||
        motion_fixed_abs(acc) >= ACC_END)
        return; /* no limit is as high */
    acc = no_less(p->shape->free.is_peak[which], acc, before);
    hold->acc = no_less(p->shape->free.is_peak[which], acc, hold[1].acc);
    hold[-1].acc = hold->acc;
    hold[-1].dur_ns_q12 =
        motion_otg_ramp_ticks(p->rates, i - 1, hold->acc - before);
    hold[1].dur_ns_q12 =
        motion_otg_ramp_ticks(p->rates, i + 1, hold[1].acc - hold->acc);
}

static void turn_cruise(struct refine *p, struct num x)
{
    int64_t *n = &p->plan->phase[p->shape->free.cruise].dur_ns_q12;
    *n += whole(x);
    if (*n < 0)
        *n = 0;
}

/* Whether a pulse's acceleration is 2^-8 of the other's. */
static bool is_slight(struct num one, struct num other)
{
    return one.m == 0 || num_lt(num_abs(num_scale(one, 8)), num_abs(other));
}

/* The pulse that is to make the speed good: the one next to an end that brakes
 * by much, whose speed is known to 2^-28 of what braking took and may be all
 * that the cruise's limit allows; else the one that changes it more. */
static int speed_pulse(const struct refine *p)
{
    if (p->rates->brake > 0 && !is_slight(p->pulse_v[0], p->pulse_v[1]))
        return 0;
    if (p->rates->lands && !is_slight(p->pulse_v[1], p->pulse_v[0]))
        return 1;
    return num_lt(num_abs(p->pulse_v[0]), num_abs(p->pulse_v[1]));
}

/* Speed with a pulse, the rest with the cruise. */
static void refine_cruise(struct refine *p)
{
    int which = speed_pulse(p);
    struct num x = num_zero();
    if (p->pulse_v[which].m)
        x = num_div(p->v, p->pulse_v[which]);
    struct num c = num_sub(p->d, num_mul(p->pulse_d[which], x));
    c = num_mul(num_div(c, p->speed), p->per_s);
    x = num_mul(x, p->per_s);
    if (p->speed.m == 0 || is_far(p, x) || is_far(p, c))
        return;
    turn_pulse(p, which, x);
    turn_cruise(p, c);
}

/* Both pulses; where there is a cruise, it takes what they leave of a given
 * duration. */
static void refine_pulses(struct refine *p)
{
    bool is_timed = p->shape->free.cruise >= 0;
    struct num d0 = p->pulse_d[0], d1 = p->pulse_d[1], d = p->d;
    if (is_timed) {
        struct num twice = num_twice(p->speed);
        d0 = num_sub(d0, twice);
        d1 = num_sub(d1, twice);
        d = num_sub(d, num_mul(p->speed, p->t));
    }
    struct num det =
        num_sub(num_mul(p->pulse_v[0], d1), num_mul(p->pulse_v[1], d0));
    if (det.m == 0)
        return;
    struct num per = num_mul(num_inv(det), p->per_s);
    struct num x = num_sub(num_mul(p->v, d1), num_mul(p->pulse_v[1], d));
    struct num y = num_sub(num_mul(p->pulse_v[0], d), num_mul(p->v, d0));
    x = num_mul(x, per);
    y = num_mul(y, per);
    if (is_far(p, x) || is_far(p, y))
        return;
    turn_pulse(p, 0, x);
    turn_pulse(p, 1, y);
    if (is_timed) {
        struct num t = num_mul(p->t, p->per_s);
        turn_cruise(p, num_sub(t, num_twice(num_add(x, y))));
    }
}

static void refine_speed(struct refine *p)
{
    struct num x = num_mul(num_div(p->v, p->pulse_v[0]), p->per_s);
    if (p->pulse_v[0].m && !is_far(p, x))
        turn_pulse(p, 0, x);
}

/* A pulse of acceleration a at the speed v, held 2 x longer: what comes after
 * is 2 x later and 2 a x faster. */
static void walk_pulse(struct refine *p, int k, struct num v, int64_t left)
{
    int64_t acc = p->plan->phase[p->shape->free.pulse[k]].acc;
    struct num a = num_make(acc, -p->plan->acc_bits);
    p->pulse_v[k] = num_twice(a);
    p->pulse_d[k] = num_twice(num_add(v, num_mul(a, motion_otg_seconds(left))));
}

/* The speeds at the free phases. */
static void refine_walk(struct refine *p)
{
    const struct otg_free *k = &p->shape->free;
    int last = k->pulse[1] < 0 ? k->pulse[0] : k->pulse[1];
    struct num v = num_make(p->plan->start_vel_q32, -32);
    struct num a = num_make(p->plan->start_acc, -p->plan->acc_bits);
    int64_t left = p->plan->dur_ns_q12;
    for (int i = 0; i <= last; i++) {
        const struct otg_phase *to = &p->shape->phase[i];
        if (to->dt.m != 0) {
            struct num gain = num_mul(num_add(a, to->a), to->dt);
            v = num_add(v, num_half(gain));
        }
        a = to->a;
        left -= p->plan->phase[i].dur_ns_q12;
        if (i == k->pulse[0])
            walk_pulse(p, 0, v, left);
        if (i == k->cruise)
            p->speed = v;
    }
    if (k->pulse[1] >= 0)
        walk_pulse(p, 1, v, left);
}

void motion_otg_refine(struct motion_otg_plan *plan,
                       const struct otg_shape *shape,
                       const struct otg_rates *rates,
                       const struct otg_residual *residual)
{
    const struct otg_free *free = &shape->free;
    struct refine p = { .plan = plan, .shape = shape, .rates = rates };
    if (free->pulse[0] < 0 || plan->count == 0)
        return;
    p.per_s = motion_otg_per_second();
    p.v = residual->vel;
    p.d = residual->pos;
    refine_walk(&p);
    if (free->pulse[1] < 0) {
        refine_speed(&p);
    } else if (free->cruise >= 0 && !residual->is_timed) {
        refine_cruise(&p);
    } else {
        if (free->cruise >= 0)
            p.t = num_div(num_make(residual->ticks, 0), p.per_s);
        refine_pulses(&p);
    }
    plan->dur_ns_q12 = 0;
    for (int i = 0; i < plan->count; i++)
        plan->dur_ns_q12 += plan->phase[i].dur_ns_q12;
}
