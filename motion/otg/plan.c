/* motion/otg/plan.c - a plan in exact integers: its units, where its phases
 * lead, and its track.
 *
 * In a track every phase is a cubic.  Places are counted from the start up to
 * the longest phase and, velocities too, back from the goal down to it, so that
 * what the last unit of the accelerations leaves falls on that one, where it
 * changes least. */
#include <stddef.h>

#include "motion/core/err.h"
#include "motion/core/fixed.h"
#include "motion/otg/internal.h"
#include "motion/otg/replan.h"

#define FIVES_BITS     42 /* 5^9 has 21 bits, its image a sign */
#define POS_FIVES_BITS 40 /* 3 5^9 has 23 */

int64_t motion_otg_acc_image(int64_t acc_q32, int acc_bits)
{
    int shift = acc_bits - 32;
    if (shift < 0)
        return acc_q32 >> (shift < -63 ? 63 : -shift);
    return (int64_t)((uint64_t)acc_q32 << shift);
}

/* 5^9 2^(acc_bits - 10) times as much; one product where the power fits in its
 * factors. */
struct motion_u128 motion_otg_vel_image(int64_t vel_q32, int acc_bits)
{
    int shift = acc_bits - 10, up = shift - FIVES_BITS;
    if (vel_q32 == 0)
        return (struct motion_u128){ 0, 0 };
    if (shift >= 0 && up < (int)motion_real_clz(motion_fixed_abs(vel_q32))) {
        int64_t fives = OTG_FIVES;
        fives <<= up > 0 ? FIVES_BITS : shift;
        vel_q32 = (int64_t)((uint64_t)vel_q32 << (up > 0 ? up : 0));
        return wide_mul_i64(vel_q32, fives);
    }
    struct motion_u128 v = wide_mul_i64(vel_q32, OTG_FIVES);
    return shift < 0 ? wide_shr(v, (unsigned)-shift)
                     : motion_fixed_shl_u128(v, (unsigned)shift);
}

/* 30 bits of (top 2^32 + next) 2^e, of a top whose upper half may be zero. */
static uint64_t top_word(uint64_t top, uint32_t next, int e)
{
    if (top >> 31 == 0) {
        top = top << 32 | next;
        e -= 32;
    }
    return num_pack(num_make((int64_t)(top >> 1), e + 33));
}

static uint64_t word_signed(uint64_t word, bool minus)
{
    return minus ? num_pack(num_neg(num_unpack(word))) : word;
}

static uint64_t low_word(struct motion_u128 m, int e)
{
    return m.hi != 0 ? top_word(m.hi, (uint32_t)(m.lo >> 32), e + 32)
                     : top_word(m.lo, 0, e - 32);
}

uint64_t motion_otg_wide_word(const struct motion_u128 *a, int e)
{
    return word_signed(low_word(wide_abs(*a), e), wide_is_negative(*a));
}

uint64_t motion_otg_wider_word(const struct wider *a, int e)
{
    bool minus = wider_is_negative(*a);
    struct wider m = minus ? wider_neg(*a) : *a;
    uint64_t word = m.hi != 0 ? top_word(m.hi, (uint32_t)(m.mid >> 32), e + 96)
                              : low_word(wider_low(m), e);
    return word_signed(word, minus);
}

struct num motion_otg_vel_num(const struct motion_u128 *vel, int acc_bits)
{
    static const struct num per_fives = { 576460752, -50 }; /* 5^-9 */
    return num_mul(motion_otg_wide_num(vel, -22 - acc_bits), per_fives);
}

struct num motion_otg_pos_num(const struct wider *pos, int acc_bits)
{
    static const struct num per_pos_fives = { 825293360, -73 }; /* 5^-18 / 3 */
    return num_mul(motion_otg_wider_num(pos, -43 - acc_bits), per_pos_fives);
}

int motion_otg_pos_public(struct wider p, int acc_bits, int64_t start_q32,
                          bool cuts, int64_t *pos_q32)
{
    uint64_t pos;
    struct wider m = wider_shr(wider_abs(p), (unsigned)(acc_bits + 10));
    struct motion_u128 n = { m.mid, m.lo };
    if (m.hi != 0 ||
        motion_fixed_div_u128(n, (uint64_t)OTG_POS_FIVES, &pos, NULL) < 0)
        return MOTION_E_RANGE;
    pos = (pos >> 1) + (pos & !cuts); /* from halves */
    if (pos > INT64_MAX)
        return MOTION_E_RANGE;
    return wider_is_negative(p)
               ? motion_fixed_sub(start_q32, (int64_t)pos, pos_q32)
               : motion_fixed_add(start_q32, (int64_t)pos, pos_q32);
}

int64_t motion_otg_vel_public(struct motion_u128 v, int acc_bits)
{
    struct motion_u128 m = wide_abs(v);
    int shift = acc_bits - 11; /* to halves */
    uint64_t vel;
    m = shift < 0 ? motion_fixed_shl_u128(m, (unsigned)-shift)
                  : wide_shr(m, (unsigned)shift);
    if (motion_fixed_div_u128((struct motion_u128){ m.hi, m.lo }, OTG_FIVES,
                              &vel, NULL) < 0 ||
        vel / 2 > INT64_MAX)
        vel = INT64_MAX;
    vel = (vel >> 1) + (vel & 1);
    return wide_is_negative(v) ? -(int64_t)vel : (int64_t)vel;
}

void motion_otg_plan_add(struct motion_otg_plan *plan, int64_t dur_ns_q12,
                         int64_t acc)
{
    if (dur_ns_q12 <= 0)
        return;
    plan->phase[plan->count++] = (struct motion_otg_phase){ dur_ns_q12, acc };
    plan->dur_ns_q12 += dur_ns_q12;
    plan->brake = plan->turn = plan->count;
}

struct otg_run motion_otg_run_start(const struct motion_otg_plan *plan)
{
    struct motion_u128 v =
        motion_otg_vel_image(plan->start_vel_q32, plan->acc_bits);
    return (struct otg_run){ { 0, 0, 0 }, v, plan->start_acc };
}

/* With S = (A + A') n, V' = V + S and P' = P + (3 V + S + A n) n.  A n costs a
 * product only where neither end is zero nor both the same. */
void motion_otg_run_phase(struct otg_run *run,
                          const struct motion_otg_phase *phase)
{
    int64_t n = phase->dur_ns_q12, a = run->a, to = phase->acc;
    struct motion_u128 sum = wide_add(run->v, wide_add(run->v, run->v));
    if (a != 0 || to != 0) {
        struct motion_u128 gain = wide_mul_i64(a + to, n);
        sum = wide_add(sum, gain);
        run->v = wide_add(run->v, gain);
        if (to == 0)
            sum = wide_add(sum, gain);
        else if (a != 0)
            sum = wide_add(sum, wide_mul_i64(a, n));
        run->a = to;
    }
    wider_add_mul(&run->p, n, &sum);
}

/* --- the end ------------------------------------------------------------- */

/* What the corners make at the end is the sum of what each makes, times before
 * and after it n and n', r left after it: A w to V, A x to P, with w = n + n'
 * and x = w (3 r + n - n').  Neighbours of one acceleration are summed first.
 * It is taken off. */
static void exact_take(const struct motion_otg_plan *plan,
                       struct motion_u128 *vel, struct wider *pos)
{
    const struct motion_otg_phase *ph = plan->phase, *end = ph + plan->count;
    int64_t rest = plan->dur_ns_q12, before = 0, acc = plan->start_acc, w = 0;
    struct motion_u128 x = { 0, 0 };
    for (;; ph++) {
        int64_t next = ph < end ? ph->dur_ns_q12 : 0;
        if (acc != 0) {
            w += before + next;
            wide_add_mul(&x, before + next, 3 * rest + before - next);
        }
        if (acc != 0 && (ph == end || ph->acc != acc)) {
            wide_add_mul(vel, -acc, w);
            wider_add_mul(pos, -acc, &x);
            w = 0;
            x.hi = x.lo = 0;
        }
        if (ph == end)
            return;
        acc = ph->acc;
        rest -= next;
        before = next;
    }
}

/* Both have the factor 3 5^9 2^(acc_bits - 10). */
struct wider motion_otg_pos_change(const struct motion_otg_plan *plan)
{
    struct motion_u128 pos =
        wide_sub(wide_from(plan->goal_pos_q32), wide_from(plan->start_pos_q32));
    bool minus = wide_is_negative(pos);
    pos = wide_mul_u64(wide_abs(pos).lo, (uint64_t)OTG_FIVES << 21);
    if (minus)
        pos = wide_neg(pos);
    if (plan->start_vel_q32 != 0)
        pos =
            wide_sub(pos, wide_mul_i64(plan->start_vel_q32, plan->dur_ns_q12));
    int shift = plan->acc_bits - 10;
    int up = shift < 0 ? 0 : shift < POS_FIVES_BITS ? shift : POS_FIVES_BITS;
    struct wider p = wider_mul(pos, INT64_C(3) * OTG_FIVES << up);
    if (shift < 0)
        return wider_shr(p, (unsigned)-shift);
    return shift > up ? wider_shl(p, (unsigned)(shift - up)) : p;
}

void motion_otg_plan_residual(const struct motion_otg_plan *plan,
                              struct motion_u128 *vel, struct wider *pos)
{
    *vel = wide_sub(motion_otg_vel_image(plan->goal_vel_q32, plan->acc_bits),
                    motion_otg_vel_image(plan->start_vel_q32, plan->acc_bits));
    *pos = motion_otg_pos_change(plan);
    exact_take(plan, vel, pos);
}

/* In raw numbers a^2 2^-64 / (2 j 2^-32) <= margin 2^-32: a^2 / 2, up, is at
 * most j margin, which is below 2^127. */
bool motion_otg_ramp_fits(int64_t acc_q32, int64_t jerk_q32,
                          uint64_t margin_q32)
{
    uint64_t a = motion_fixed_abs(acc_q32);
    struct motion_u128 half = wide_mul_u64(a, a);
    struct motion_u128 most = wide_mul_u64((uint64_t)jerk_q32, margin_q32);
    half = (struct motion_u128){ half.hi >> 1, half.hi << 63 | half.lo >> 1 };
    if (a & 1) /* a^2 is odd as well */
        half = wide_add(half, wide_from(1));
    return !wide_is_less(most, half);
}

/* --- as segments of a track ----------------------------------------------- */

#define TRACK_COEF_BITS 61 /* of the largest coefficient given */
#define TRACK_SHORT     10 /* 2^-10 of the longest phase */

/* Coefficients of u, u^2, u^3 in 2^-(32 + frac) unit. */
struct cubic {
    int64_t coef[3];
    int degree, frac;
};

/* A position with 64 bits below the public ones. */
struct place {
    int64_t pos_q32;
    uint64_t frac;
};

static unsigned bits_of(struct wider a)
{
    return 192 - wider_clz(wider_abs(a));
}

/* P's unit is 2^-(43 + acc_bits) / (3 5^18): a divided by that and cut to
 * 2^-(32 + frac), to nearest.  |result| < 2^62. */
static int64_t coefficient(struct wider a, const struct motion_divisor *fives,
                           int acc_bits, int frac)
{
    struct wider m = wider_abs(a);
    int down = 10 + acc_bits - frac - fives->up;
    m = down < 0 ? wider_shl(m, (unsigned)-down) : wider_shr(m, (unsigned)down);
    uint64_t twice =
        motion_divisor_apply(fives, (struct motion_u128){ m.mid, m.lo }, NULL);
    int64_t c = (int64_t)((twice >> 1) + (twice & 1));
    return wider_is_negative(a) ? -c : c;
}

/* The phase from v, a: 3 V n, 3 A n^2, (A' - A) n^2 as fixed point, the finest
 * that the largest allows. */
static int cubic_of(struct motion_u128 v, int64_t a,
                    const struct motion_otg_phase *phase,
                    const struct motion_divisor *fives, int acc_bits,
                    struct cubic *cubic)
{
    int64_t n = phase->dur_ns_q12;
    struct motion_u128 an = wide_mul_i64(a, n);
    const struct wider c[3] = {
        wider_mul(wide_add(v, wide_add(v, v)), n),
        wider_mul(wide_add(an, wide_add(an, an)), n),
        wider_mul(wide_mul_i64(phase->acc - a, n), n),
    };
    unsigned most = 0, bits;
    cubic->degree = 1;
    for (int i = 0; i < 3; i++) {
        bits = bits_of(c[i]);
        most = bits > most ? bits : most;
        if (bits != 0)
            cubic->degree = i + 1;
    }
    /* c 2^(frac - 11 - acc_bits) / 2^43 < 2^TRACK_COEF_BITS */
    int frac = TRACK_COEF_BITS + 54 + acc_bits - (int)most;
    frac = frac > 31 ? 31 : frac;
    if (frac < 0)
        return MOTION_E_RANGE;
    cubic->frac = frac;
    for (int i = 0; i < cubic->degree; i++)
        cubic->coef[i] = coefficient(c[i], fives, acc_bits, frac);
    return MOTION_OK;
}

/* from + pos, P's units, cut to 2^-96 unit. */
static int place_at(const struct place *from, struct wider pos,
                    const struct motion_divisor *fives, int acc_bits,
                    struct place *place)
{
    int down = acc_bits + 11 - 64;
    uint64_t rest;
    struct wider m = wider_abs(pos);
    m = down < 0 ? wider_shl(m, (unsigned)-down) : wider_shr(m, (unsigned)down);
    struct motion_u128 q;
    if (m.hi >= (uint64_t)OTG_POS_FIVES / 2)
        return MOTION_E_RANGE;
    m = wider_shl(m, fives->up);
    q.hi =
        motion_divisor_apply(fives, (struct motion_u128){ m.hi, m.mid }, &rest);
    q.lo =
        motion_divisor_apply(fives, (struct motion_u128){ rest, m.lo }, NULL);
    if (wider_is_negative(pos))
        q = wide_neg(q);
    place->frac = from->frac + q.lo;
    q.hi += place->frac < q.lo;
    return motion_fixed_add(from->pos_q32, (int64_t)q.hi, &place->pos_q32);
}

struct append {
    const struct motion_otg_plan *plan;
    struct motion_track *track;
    struct place start, goal;
    int acc_bits;                /* of the unit of P in public ones */
    struct motion_divisor fives; /* OTG_POS_FIVES */
    struct otg_run run;
    struct wider pos;        /* of all phases */
    struct motion_u128 rest; /* of the velocity at the goal */
    int64_t left;            /* ticks from the end of the phase on */
    int longest;
};

static int longest_of(const struct motion_otg_plan *plan, int i, int end)
{
    int longest = i;
    for (; i < end; i++)
        if (plan->phase[i].dur_ns_q12 > plan->phase[longest].dur_ns_q12)
            longest = i;
    return longest;
}

int motion_otg_carrier(const struct motion_otg_plan *plan)
{
    int longest = longest_of(plan, 0, plan->count);
    if (plan->count < 3)
        return longest;
    int inside = longest_of(plan, 1, plan->count - 1);
    return plan->phase[inside].dur_ns_q12 > plan->phase[longest].dur_ns_q12 >>
                   TRACK_SHORT
               ? inside
               : longest;
}

static void append_init(struct append *a)
{
    const struct motion_otg_plan *plan = a->plan;
    a->start = (struct place){ plan->start_pos_q32, 0 };
    a->goal = (struct place){ plan->goal_pos_q32, 0 };
    a->acc_bits = plan->acc_bits;
    motion_divisor_init(&a->fives, (uint64_t)OTG_POS_FIVES);
    a->longest = motion_otg_carrier(plan);
    a->left = plan->dur_ns_q12;
    a->run = motion_otg_run_start(plan);
    for (int i = 0; i < plan->count; i++)
        motion_otg_run_phase(&a->run, &plan->phase[i]);
    a->pos = a->run.p;
    a->rest = wide_sub(motion_otg_vel_image(plan->goal_vel_q32, plan->acc_bits),
                       a->run.v);
    a->run = motion_otg_run_start(plan);
}

/* Where phase i ends; the run is there. */
static int phase_end(const struct append *a, int i, struct place *end)
{
    if (i < a->longest)
        return place_at(&a->start, a->run.p, &a->fives, a->acc_bits, end);
    struct motion_u128 rest = wide_add(a->rest, wide_add(a->rest, a->rest));
    struct wider pos = wider_add(a->pos, wider_mul(rest, a->left));
    return place_at(&a->goal, wider_sub(a->run.p, pos), &a->fives, a->acc_bits,
                    end);
}

static int append_phase(struct append *a, int i)
{
    const struct motion_otg_phase *phase = &a->plan->phase[i];
    struct place end;
    struct cubic cubic;
    struct motion_u128 v = a->run.v;
    if (i > a->longest)
        v = wide_add(v, a->rest);
    int err = cubic_of(v, a->run.a, phase, &a->fives, a->acc_bits, &cubic);
    if (err < 0)
        return err;
    motion_otg_run_phase(&a->run, phase);
    a->left -= phase->dur_ns_q12;
    err = phase_end(a, i, &end);
    if (err < 0)
        return err;
    return motion_track_append_poly(a->track, phase->dur_ns_q12, cubic.degree,
                                    cubic.coef, (unsigned)cubic.frac,
                                    end.pos_q32, end.frac);
}

static int append_phases(struct append *a)
{
    struct motion_track before = *a->track;
    int err = MOTION_OK;
    for (int i = 0; i < a->plan->count && err == MOTION_OK; i++)
        err = append_phase(a, i);
    if (err < 0)
        *a->track = before;
    return err;
}

int motion_otg_append(const struct motion_otg_plan *plan,
                      struct motion_track *track)
{
    struct append a;
    a.plan = plan;
    a.track = track;
    append_init(&a);
    return append_phases(&a);
}

/* In 2^-(32 + bits) from an origin, 0 <= bits < 64. */
static struct place place_of(const struct motion_otg_trajectory *trajectory,
                             int64_t pos)
{
    const unsigned bits = (unsigned)trajectory->fine_bits;
    return (struct place){ trajectory->origin_q32 + (pos >> bits),
                           bits ? (uint64_t)pos << (64 - bits) : 0 };
}

int motion_otg_track(const struct motion_otg_trajectory *trajectory,
                     struct motion_segment *segment, uint32_t capacity,
                     struct motion_track *track)
{
    struct append a;
    a.plan = &trajectory->plan;
    a.track = track;
    append_init(&a);
    a.start = place_of(trajectory, a.plan->start_pos_q32);
    a.goal = place_of(trajectory, a.plan->goal_pos_q32);
    a.acc_bits = a.plan->acc_bits + trajectory->fine_bits;
    motion_track_init(track, segment, capacity, a.start.pos_q32);
    track->end_frac = a.start.frac;
    return append_phases(&a);
}
