/* motion/otg_exact.c - from a proposal in reals to a plan in exact integers.
 *
 * Times go up to whole ticks, so that no ramp gets steeper; accelerations at
 * the corners are cut to whole units, and a few of them moved (otg_trim.c) so
 * that the motion between them, which follows exactly (otg.h), ends at the
 * goal. */
#include <stddef.h>

#include "motion/err.h"
#include "motion/fixed.h"
#include "motion/otg_internal.h"

/* Bits that keep V below 2^124 and P below 2^190; one is left for trimming. */
#define EXACT_ACC_BITS 61
#define EXACT_VEL_BITS 111 /* of a public velocity and acc_bits */
#define EXACT_MOST     70
#define EXACT_REPAIRS  4
#define EXACT_LEAST    (-11)

int64_t motion_otg_acc_image(int64_t acc_q16, int acc_bits)
{
    int shift = acc_bits - 16;
    if (shift < 0)
        return acc_q16 >> (shift < -63 ? 63 : -shift);
    return (int64_t)((uint64_t)acc_q16 << shift);
}

struct wide motion_otg_vel_image(int64_t vel_q32, int acc_bits)
{
    struct wide v = wide_mul_i64(vel_q32, OTG_FIVES);
    int shift = acc_bits - 10;
    return shift < 0 ? wide_shr(v, (unsigned)-shift)
                     : wide_shl(v, (unsigned)shift);
}

/* Of the first word that is not zero and the next at least 32 bits. */
struct num motion_otg_wider_num(struct wider a, int e)
{
    bool minus = wider_is_negative(a);
    if (minus)
        a = wider_neg(a);
    for (int i = 0; i < 2 && a.hi == 0; i++, e -= 64)
        a = (struct wider){ a.mid, a.lo, 0 };
    uint64_t top = a.hi;
    if (top >> 31 == 0) {
        top = top << 32 | a.mid >> 32;
        e -= 32;
    }
    struct num n = num_make((int64_t)(top >> 1), e + 129);
    return minus ? num_neg(n) : n;
}

struct motion_real motion_otg_wider_real(struct wider a)
{
    bool negative = wider_is_negative(a);
    a = wider_abs(a);
    unsigned lead = wider_clz(a);
    if (lead >= 192)
        return motion_real_zero();
    a = wider_shl(a, lead);
    struct motion_real r =
        motion_real_make((int64_t)(a.hi >> 2), 130 - (int)lead);
    return negative ? motion_real_neg(r) : r;
}

int motion_otg_way_public(struct wider p, int acc_bits, int64_t start_q32,
                          int64_t *pos_q32)
{
    uint64_t way;
    struct wider m = wider_shr(wider_abs(p), (unsigned)(acc_bits + 10));
    struct motion_u128 n = { m.mid, m.lo };
    if (m.hi != 0 ||
        motion_fixed_div_u128(n, (uint64_t)OTG_WAY_FIVES, &way, NULL) < 0)
        return MOTION_E_RANGE;
    way = (way >> 1) + (way & 1); /* from halves */
    if (way > INT64_MAX)
        return MOTION_E_RANGE;
    return wider_is_negative(p)
               ? motion_fixed_sub(start_q32, (int64_t)way, pos_q32)
               : motion_fixed_add(start_q32, (int64_t)way, pos_q32);
}

struct otg_run motion_otg_run_start(const struct motion_otg_plan *plan)
{
    struct wide v = motion_otg_vel_image(plan->start_vel_q32, plan->acc_bits);
    return (struct otg_run){ { 0, 0, 0 }, v, plan->start_acc };
}

/* With S = (A + A') n, V' = V + S and P' = P + (3 V + S + A n) n.  A n costs a
 * product only where neither end is zero nor both the same. */
void motion_otg_run_phase(struct otg_run *run,
                          const struct motion_otg_phase *phase)
{
    int64_t n = phase->dur_ns_q12, a = run->a, to = phase->acc;
    struct wide sum = wide_add(run->v, wide_add(run->v, run->v));
    if (a != 0 || to != 0) {
        struct wide gain = wide_mul_i64_inline(a + to, n);
        sum = wide_add(sum, gain);
        run->v = wide_add(run->v, gain);
        if (to == 0)
            sum = wide_add(sum, gain);
        else if (a != 0)
            sum = wide_add(sum, wide_mul_i64(a, n));
        run->a = to;
    }
    run->p = wider_add(run->p, wider_mul_inline(sum, n));
}

/* --- the end ------------------------------------------------------------- */

/* One corner, or some of the same acceleration. */
struct corners {
    int64_t acc, w;
    struct wide x;
};

static void corners_add(struct corners *c, int64_t w, int64_t k)
{
    c->w += w;
    wide_add_mul(&c->x, w, k);
}

/* What they make at the end is the sum of what each makes; times before and
 * after it n and n', r left after it. */
static void exact_gain(const struct motion_otg_plan *plan, struct wide *vel,
                       struct wider *way)
{
    struct corners c = { plan->start_acc, 0, { 0, 0 } };
    int64_t rest = plan->dur_ns_q12, before = 0;
    for (int i = 0; i <= plan->count; i++) {
        const struct motion_otg_phase *ph = &plan->phase[i];
        int64_t next = i < plan->count ? ph->dur_ns_q12 : 0;
        if (c.acc != 0)
            corners_add(&c, before + next, 3 * rest + before - next);
        rest -= next;
        before = next;
        if (i < plan->count && ph->acc == c.acc)
            continue;
        if (c.acc != 0) {
            wide_add_mul(vel, c.acc, c.w);
            wider_add_mul(way, c.acc, &c.x);
        }
        if (i < plan->count)
            c = (struct corners){ ph->acc, 0, { 0, 0 } };
    }
}

/* Both have the factor 3 5^9 2^(acc_bits - 10). */
struct wider motion_otg_way_wanted(const struct motion_otg_plan *plan)
{
    struct wide way =
        wide_sub(wide_from(plan->goal_pos_q32), wide_from(plan->start_pos_q32));
    bool minus = wide_is_negative(way);
    way = wide_mul_u64(wide_abs(way).lo, (uint64_t)OTG_FIVES << 21);
    if (minus)
        way = wide_neg(way);
    way = wide_sub(way, wide_mul_i64(plan->start_vel_q32, plan->dur_ns_q12));
    struct wider p = wider_mul(way, INT64_C(3) * OTG_FIVES);
    int shift = plan->acc_bits - 10;
    return shift < 0 ? wider_shr(p, (unsigned)-shift)
                     : wider_shl(p, (unsigned)shift);
}

void motion_otg_plan_miss(const struct motion_otg_plan *plan, struct wide *vel,
                          struct wider *way)
{
    struct wide start =
        motion_otg_vel_image(plan->start_vel_q32, plan->acc_bits);
    struct wide v = { 0, 0 };
    struct wider p = { 0, 0, 0 };
    exact_gain(plan, &v, &p);
    *vel = motion_otg_vel_image(plan->goal_vel_q32, plan->acc_bits);
    *vel = wide_sub(wide_sub(*vel, start), v);
    *way = wider_sub(motion_otg_way_wanted(plan), p);
}

/* In raw numbers a^2 2^-32 / (2 j 2^-16) <= room 2^-32. */
bool motion_otg_ramp_fits(int64_t acc_q16, int64_t jerk_q16, uint64_t room_q32)
{
    uint64_t a = motion_fixed_abs(acc_q16);
    struct wide square = wide_mul_u64(a, a);
    struct wide most = wide_mul_u64((uint64_t)jerk_q16, room_q32);
    most = (struct wide){ most.hi >> 15, most.hi << 49 | most.lo >> 15 };
    return square.hi < most.hi ||
           (square.hi == most.hi && square.lo <= most.lo);
}

/* --- units ---------------------------------------------------------------- */

static int bits_of(int64_t a)
{
    return 64 - (int)motion_real_clz(motion_fixed_abs(a));
}

static int larger(int a, int b)
{
    return a > b ? a : b;
}

static int smaller(int a, int b)
{
    return a < b ? a : b;
}

/* The finest unit with which accelerations and velocities fit; a way of 2^65
 * does with every one of them. */
static int exact_scale(const struct motion_otg_move *move,
                       const struct otg_shape *shape)
{
    int acc =
        larger(bits_of(move->start.acc_q16), bits_of(move->goal.acc_q16)) - 16;
    int vel = larger(bits_of(move->start.vel_q32), bits_of(move->goal.vel_q32));
    for (int i = 0; i < shape->count; i++)
        if (shape->phase[i].a.m != 0)
            acc = larger(acc, shape->phase[i].a.e + 30);
    /* all but the last bit, unless that would cut a public acceleration */
    int bits = acc == 46 ? 16 : EXACT_ACC_BITS - acc;
    bits = smaller(bits, EXACT_VEL_BITS - vel);
    return smaller(bits, EXACT_MOST);
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

static void exact_rates(const struct otg_problem *q,
                        const struct otg_shape *shape, int acc_bits,
                        struct otg_rates *rates)
{
    struct num tick = num_scale(motion_otg_seconds(1), acc_bits);
    rates->j = num_mul(q->j, tick);
    rates->j2 = num_mul(q->j2, tick);
    rates->per_j = num_inv(rates->j);
    rates->per_j2 = num_inv(rates->j2);
    rates->brake = shape->brake;
    rates->turn = shape->turn;
}

/* The acceleration stays that of the phase before. */
static bool is_hold(const struct otg_phase *ph)
{
    return ph[0].a.m == ph[-1].a.m && ph[0].a.e == ph[-1].a.e;
}

/* Phases one by one as the shape has them.  Where the acceleration moves, as
 * long as its jerk wants at least, and with knobs no longer.  A phase that lasts
 * no time and moves the acceleration by rounding alone stays where it is. */
static int exact_phases(const struct otg_shape *shape,
                        const struct otg_rates *rates, int64_t goal_acc,
                        struct motion_otg_plan *plan)
{
    bool is_full = shape->knobs.hump[0] >= 0;
    int64_t acc = plan->start_acc;
    plan->count = shape->count;
    plan->dur_ns_q12 = 0;
    for (int i = 0; i < shape->count; i++) {
        const struct otg_phase *ph = &shape->phase[i];
        bool last = i + 1 == shape->count;
        int64_t to =
            last ? goal_acc : shifted(ph->a.m, ph->a.e + plan->acc_bits);
        if (!last && (ph->dt.e < -30 - 52 || (i > 0 && is_hold(ph))))
            to = acc;
        int64_t n = motion_otg_ramp_ticks(rates, i, to - acc);
        if (to == acc || !is_full) {
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

/* One step on the shape's own knobs; what it misses is known exactly. */
static void exact_polish(const struct otg_shape *shape,
                         const struct otg_rates *rates, int64_t dur_ns_q12,
                         struct motion_otg_plan *plan)
{
    static const struct num per_fives = { 576460752, -50 };     /* 5^-9 */
    static const struct num per_way_fives = { 825293360, -73 }; /* 5^-18 / 3 */
    struct otg_miss miss;
    struct wider way;
    struct wide vel;
    if (shape->knobs.hump[0] < 0)
        return;
    motion_otg_plan_miss(plan, &vel, &way);
    miss.vel = num_mul(
        motion_otg_wider_num(wider_from(vel), -22 - plan->acc_bits), per_fives);
    miss.way =
        num_mul(motion_otg_wider_num(way, -43 - plan->acc_bits), per_way_fives);
    miss.is_timed = dur_ns_q12 != 0;
    miss.ticks = dur_ns_q12 - plan->dur_ns_q12;
    motion_otg_polish(plan, &shape->knobs, rates, &miss);
}

/* Leave out phases of no ticks. */
static void exact_compact(const struct otg_shape *shape,
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

/* A start or goal on its limit of acceleration has a phase at it that leads to
 * the drawn-in limit: 2^-25 of it in as short a time, which no trimming could
 * move by its share.  Its neighbour does that, too. */
static bool is_sliver(const struct motion_otg_plan *plan, int64_t n,
                      int64_t from, int64_t to)
{
    uint64_t size = motion_fixed_abs(from) | motion_fixed_abs(to);
    return n < plan->dur_ns_q12 >> 14 &&
           motion_fixed_abs(to - from) <= size >> 16;
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

static void exact_merge(struct motion_otg_plan *plan)
{
    struct motion_otg_phase *ph = plan->phase;
    int last = plan->count - 1;
    for (; last >= 1 &&
           is_sliver(plan, ph[last].dur_ns_q12, ph[last - 1].acc, ph[last].acc);
         last--) {
        ph[last - 1].dur_ns_q12 += ph[last].dur_ns_q12;
        ph[last - 1].acc = ph[last].acc;
    }
    plan->count = last + 1;
    while (plan->count > 1 &&
           is_sliver(plan, ph[0].dur_ns_q12, plan->start_acc, ph[0].acc))
        merge_on(plan, 0);
    for (int i = 1; i + 1 < plan->count; i++)
        if (ph[i].dur_ns_q12 <= ph[i + 1].dur_ns_q12 >> 26 &&
            is_sliver(plan, ph[i].dur_ns_q12, ph[i - 1].acc, ph[i].acc))
            merge_on(plan, i--);
    plan->brake = smaller(plan->brake, plan->count);
    plan->turn = smaller(plan->turn, plan->count);
}

/* The longest phase whose corners may move takes what is missing from the
 * wanted total. */
static int exact_total(struct motion_otg_plan *plan, uint32_t fixed,
                       int64_t dur_ns_q12)
{
    int longest = -1;
    int64_t most = 0, missing = dur_ns_q12 - plan->dur_ns_q12;
    if (dur_ns_q12 == 0 || missing == 0)
        return MOTION_OK;
    if (dur_ns_q12 >= MOTION_TRACK_SEGMENT_MAX_NS_Q12)
        return MOTION_E_RANGE;
    for (int i = 0; i < plan->count; i++) {
        bool ends = (i == 0 && (fixed & 1)) ||
                    (i > 0 && i + 1 == plan->count && (fixed >> (i - 1) & 1));
        if (!ends && plan->phase[i].dur_ns_q12 > most) {
            most = plan->phase[i].dur_ns_q12;
            longest = i;
        }
    }
    if (most + missing <= 0 || longest < 0)
        return MOTION_E_RANGE;
    plan->phase[longest].dur_ns_q12 += missing;
    plan->dur_ns_q12 = dur_ns_q12;
    return MOTION_OK;
}

/* --- full jerk at the ends ------------------------------------------------
 *
 * A start that swings to its velocity limit (or beyond it, because it has to)
 * needs all the jerk there is in the phase that takes its acceleration through
 * zero; the search gave it the drawn-in one.  The same backwards from a goal. */

int64_t motion_otg_phase_jerk(const struct motion_otg_limit *lim,
                              const struct motion_otg_plan *plan, int i)
{
    int64_t jerk = lim->jerk_q16;
    int64_t down = lim->jerk_down_q16 ? lim->jerk_down_q16 : jerk;
    if (i < plan->brake)
        return jerk;
    return i >= plan->turn || down < jerk ? down : jerk;
}

/* Least time in which `step` is possible. */
static int64_t ticks_at_jerk(int64_t step, int64_t jerk_q16, int acc_bits)
{
    struct wide have = wide_mul_u64(motion_fixed_abs(step), OTG_FIVES);
    uint64_t n, rest;
    int shift = 37 - acc_bits;
    have = shift >= 0 ? wide_shl(have, (unsigned)shift)
                      : wide_neg(wide_shr(wide_neg(have), (unsigned)-shift));
    if (motion_fixed_div_u128((struct motion_u128){ have.hi, have.lo },
                              (uint64_t)jerk_q16, &n, &rest) < 0 ||
        n >= MOTION_TRACK_SEGMENT_MAX_NS_Q12)
        return MOTION_TRACK_SEGMENT_MAX_NS_Q12;
    return (int64_t)n + (rest != 0);
}

static bool crosses_zero(int64_t a, int64_t b)
{
    return (a > 0 && b < 0) || (a < 0 && b > 0);
}

static void phase_set_ticks(struct motion_otg_plan *plan, int i, int64_t n)
{
    plan->dur_ns_q12 += n - plan->phase[i].dur_ns_q12;
    plan->phase[i].dur_ns_q12 = n;
}

/* Largest step that is possible in n. */
static int64_t step_at_jerk(int64_t n, int64_t jerk_q16, int acc_bits)
{
    struct wide most = wide_mul_u64((uint64_t)jerk_q16, (uint64_t)n);
    uint64_t step;
    int shift = 37 - acc_bits;
    most = shift >= 0 ? wide_shr(most, (unsigned)shift)
                      : wide_shl(most, (unsigned)-shift);
    if (motion_fixed_div_u128((struct motion_u128){ most.hi, most.lo },
                              OTG_FIVES, &step, NULL) < 0)
        return INT64_MAX / 4;
    return (int64_t)step;
}

/* What two phases about a corner change the velocity by. */
static struct wide corner_worth(int64_t at, int64_t n, int64_t corner,
                                int64_t next_n, int64_t next)
{
    return wide_add(wide_mul_i64(at + corner, n),
                    wide_mul_i64(corner + next, next_n));
}

/* The phase from (to) an end's acceleration `at` to (from) a corner takes the
 * ticks that it needs, and the corner what these allow. */
static int64_t corner_at_jerk(int64_t at, int64_t *corner, int64_t jerk_q16,
                              int acc_bits)
{
    int64_t n = ticks_at_jerk(*corner - at, jerk_q16, acc_bits);
    int64_t step = step_at_jerk(n, jerk_q16, acc_bits);
    *corner = *corner < at ? at - step : at + step;
    return n;
}

/* The same, with the corner moved so that the velocity after the next phase
 * (before the one before) stays: with n = |c - at| / j it changes by
 * n + n' + (at + c) n / (c - at) per unit of c. */
static void phase_at_jerk(struct motion_otg_plan *plan, int i, int neighbour,
                          int64_t at, int64_t next, int64_t *corner,
                          int64_t jerk_q16)
{
    int64_t n = plan->phase[i].dur_ns_q12;
    int64_t next_n = plan->phase[neighbour].dur_ns_q12;
    struct wide want = corner_worth(at, n, *corner, next_n, next);
    for (int round = 0; round < 3; round++) {
        n = corner_at_jerk(at, corner, jerk_q16, plan->acc_bits);
        struct wide have = corner_worth(at, n, *corner, next_n, next);
        struct motion_real off =
            motion_otg_wider_real(wider_from(wide_sub(want, have)));
        struct motion_real per = motion_real_div(
            motion_real_mul(motion_real_int(at + *corner), motion_real_int(n)),
            motion_real_int(*corner - at));
        int64_t by = 0;
        per = motion_real_add(per, motion_real_int(n + next_n));
        if (round == 2 || motion_real_is_zero(per) ||
            motion_real_round(motion_real_div(off, per), 0, &by) < 0 ||
            !crosses_zero(at, *corner + by))
            break;
        *corner += by;
    }
    phase_set_ticks(plan, i, n);
}

/* Which ends. */
#define ENDS_START  1
#define ENDS_GOAL   2
#define ENDS_IF_ANY 4

/* Returns the corners that are then fixed. */
static uint32_t ends_at_jerk(const struct motion_otg_move *move, int which,
                             struct motion_otg_plan *plan)
{
    const struct motion_otg_limit *lim = &move->limit;
    int last = plan->count - 1;
    uint32_t fixed = 0;
    if (last < 1 || lim->jerk_q16 == 0)
        return 0;
    int64_t start = plan->start_acc, goal = plan->phase[last].acc;
    int64_t *after = &plan->phase[0].acc, *before = &plan->phase[last - 1].acc;
    if ((which & ENDS_START) && crosses_zero(start, *after)) {
        phase_at_jerk(plan, 0, 1, start, plan->phase[1].acc, after,
                      motion_otg_phase_jerk(lim, plan, 0));
        fixed |= 1;
    }
    if ((which & ENDS_GOAL) && crosses_zero(*before, goal)) {
        phase_at_jerk(plan, last, last - 1, goal,
                      last > 1 ? plan->phase[last - 2].acc : start, before,
                      motion_otg_phase_jerk(lim, plan, last));
        fixed |= 1u << (last - 1);
    }
    return fixed;
}

/* --- nothing to do for some time ------------------------------------------ */

static bool stands_still(const struct motion_otg_move *move)
{
    const struct motion_state *start = &move->start, *goal = &move->goal;
    return move->mode == MOTION_OTG_POSITION &&
           start->pos_q32 == goal->pos_q32 &&
           (start->vel_q32 | goal->vel_q32) == 0 &&
           (start->acc_q16 | goal->acc_q16) == 0;
}

static int exact_wait(int64_t dur_ns_q12, struct motion_otg_plan *plan)
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

static int exact_make(const struct motion_otg_move *move,
                      const struct otg_problem *problem,
                      const struct otg_shape *shape, int64_t dur_ns_q12,
                      int ends, struct motion_otg_plan *plan, uint32_t *fixed)
{
    int bits = exact_scale(move, shape);
    if (bits < EXACT_LEAST ||
        (bits < 16 && (move->start.acc_q16 | move->goal.acc_q16) != 0))
        return MOTION_E_RANGE;
    plan->acc_bits = bits;
    plan->start_pos_q32 = move->start.pos_q32;
    plan->start_vel_q32 = move->start.vel_q32;
    plan->goal_pos_q32 = move->goal.pos_q32;
    plan->goal_vel_q32 = move->goal.vel_q32;
    plan->start_acc = motion_otg_acc_image(move->start.acc_q16, bits);
    int64_t goal_acc = motion_otg_acc_image(move->goal.acc_q16, bits);
    struct otg_rates rates;
    exact_rates(problem, shape, bits, &rates);
    if (dur_ns_q12 != 0 && stands_still(move)) {
        *fixed = 0;
        return exact_wait(dur_ns_q12, plan);
    }
    int err = exact_phases(shape, &rates, goal_acc, plan);
    if (err < 0)
        return err;
    exact_polish(shape, &rates, dur_ns_q12, plan);
    exact_compact(shape, plan);
    exact_merge(plan);
    int64_t whole = plan->dur_ns_q12;
    *fixed = ends_at_jerk(move, ends, plan);
    if (*fixed != 0 && dur_ns_q12 == 0)
        dur_ns_q12 = whole; /* what the ends save is needed */
    if (*fixed == 0 && ends != 0 && !(ends & ENDS_IF_ANY))
        return MOTION_E_LIMIT; /* as without */
    err = exact_total(plan, *fixed, dur_ns_q12);
    return err < 0 ? err : motion_otg_trim(move->mode, *fixed, plan);
}

/* Trimming made some ramps steeper than they may be: give them time.  With a
 * wanted duration the longest phase gives it. */
static int exact_repair(const struct motion_otg_move *move, int64_t dur_ns_q12,
                        uint32_t fixed, struct motion_otg_plan *plan)
{
    int64_t acc = plan->start_acc;
    for (int i = 0; i < plan->count; i++) {
        int64_t step = plan->phase[i].acc - acc;
        int64_t jerk = motion_otg_phase_jerk(&move->limit, plan, i);
        int64_t least = ticks_at_jerk(step, jerk, plan->acc_bits);
        if (least > plan->phase[i].dur_ns_q12)
            phase_set_ticks(plan, i, least + (least >> 24) + 16);
        acc = plan->phase[i].acc;
    }
    int err = exact_total(plan, fixed, dur_ns_q12);
    return err < 0 ? err : motion_otg_trim(move->mode, fixed, plan);
}

/* Does letting off the acceleration bring the velocity to a drawn-in limit? */
static bool swings_out(int64_t vel, int64_t acc, int64_t jerk_q16,
                       const struct motion_otg_limit *lim)
{
    int64_t limit = acc > 0 ? lim->vel_max_q32 : lim->vel_min_q32;
    bool is_beyond = acc > 0 ? vel > limit : vel < limit;
    uint64_t room = acc > 0 ? (uint64_t)limit - (uint64_t)vel
                            : (uint64_t)vel - (uint64_t)limit;
    if (acc == 0)
        return false;
    return is_beyond ||
           !motion_otg_ramp_fits(acc, jerk_q16, room - (room >> 22));
}

static int swings(const struct motion_otg_move *move)
{
    const struct motion_otg_limit *lim = &move->limit;
    int64_t down = lim->jerk_down_q16 ? lim->jerk_down_q16 : lim->jerk_q16;
    if (move->mode != MOTION_OTG_POSITION || lim->jerk_q16 == 0)
        return 0;
    return (swings_out(move->start.vel_q32, move->start.acc_q16, lim->jerk_q16,
                       lim)
                ? ENDS_START
                : 0) |
           (swings_out(move->goal.vel_q32, -move->goal.acc_q16, down, lim)
                ? ENDS_GOAL
                : 0);
}

/* A velocity that is broken asks for more jerk at the ends, a jerk for more
 * time. */
int motion_otg_settle(const struct motion_otg_move *move,
                      const struct otg_problem *problem,
                      const struct otg_shape *shape, int64_t dur_ns_q12,
                      struct motion_otg_plan *plan,
                      enum motion_otg_field *field)
{
    int err = MOTION_OK, first = swings(move);
    for (int i = 0; i <= (ENDS_START | ENDS_GOAL); i++) {
        uint32_t fixed = 0;
        enum motion_otg_field now = MOTION_OTG_FIELD_GOAL_POS;
        int made =
            exact_make(move, problem, shape, dur_ns_q12,
                       i ? i ^ first : first | ENDS_IF_ANY, plan, &fixed);
        if (made == MOTION_OK)
            made = motion_otg_check(move, plan, &now);
        for (int k = 0; k < EXACT_REPAIRS && made == MOTION_E_LIMIT &&
                        now == MOTION_OTG_FIELD_JERK;
             k++) {
            now = MOTION_OTG_FIELD_GOAL_POS;
            made = exact_repair(move, dur_ns_q12, fixed, plan);
            if (made == MOTION_OK)
                made = motion_otg_check(move, plan, &now);
        }
        if (made == MOTION_OK || made == MOTION_E_RANGE || i == 0) {
            err = made;
            *field = now;
        }
        if (made == MOTION_OK || made == MOTION_E_RANGE ||
            (i == 0 && first == 0 && now != MOTION_OTG_FIELD_VEL_MAX))
            break;
    }
    return err;
}

int motion_otg_stretch(const struct motion_otg_move *move, int64_t dur_ns_q12,
                       struct motion_otg_plan *plan)
{
    int err = exact_total(plan, 0, dur_ns_q12);
    if (err == MOTION_OK)
        err = motion_otg_trim(move->mode, 0, plan);
    return err < 0 ? err : motion_otg_check(move, plan, NULL);
}
