/* motion/otg/units.c - a plan's units, and where its phases lead. */
#include <stddef.h>

#include "motion/core/err.h"
#include "motion/core/fixed.h"
#include "motion/otg/internal.h"

#define EXACT_FIVES_ROOM 42 /* 5^9 has 21 bits, its image a sign */
#define WAY_FIVES_ROOM   40 /* 3 5^9 has 23 */

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
    int shift = acc_bits - 10, up = shift - EXACT_FIVES_ROOM;
    if (vel_q32 == 0)
        return (struct motion_u128){ 0, 0 };
    if (shift >= 0 && up < (int)motion_real_clz(motion_fixed_abs(vel_q32))) {
        int64_t fives = OTG_FIVES;
        fives <<= up > 0 ? EXACT_FIVES_ROOM : shift;
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

struct num motion_otg_way_num(const struct wider *way, int acc_bits)
{
    static const struct num per_way_fives = { 825293360, -73 }; /* 5^-18 / 3 */
    return num_mul(motion_otg_wider_num(way, -43 - acc_bits), per_way_fives);
}

int motion_otg_way_public(struct wider p, int acc_bits, int64_t start_q32,
                          bool cuts, int64_t *pos_q32)
{
    uint64_t way;
    struct wider m = wider_shr(wider_abs(p), (unsigned)(acc_bits + 10));
    struct motion_u128 n = { m.mid, m.lo };
    if (m.hi != 0 ||
        motion_fixed_div_u128(n, (uint64_t)OTG_WAY_FIVES, &way, NULL) < 0)
        return MOTION_E_RANGE;
    way = (way >> 1) + (way & !cuts); /* from halves */
    if (way > INT64_MAX)
        return MOTION_E_RANGE;
    return wider_is_negative(p)
               ? motion_fixed_sub(start_q32, (int64_t)way, pos_q32)
               : motion_fixed_add(start_q32, (int64_t)way, pos_q32);
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
                       struct motion_u128 *vel, struct wider *way)
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
            wider_add_mul(way, -acc, &x);
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
struct wider motion_otg_way_wanted(const struct motion_otg_plan *plan)
{
    struct motion_u128 way =
        wide_sub(wide_from(plan->goal_pos_q32), wide_from(plan->start_pos_q32));
    bool minus = wide_is_negative(way);
    way = wide_mul_u64(wide_abs(way).lo, (uint64_t)OTG_FIVES << 21);
    if (minus)
        way = wide_neg(way);
    if (plan->start_vel_q32 != 0)
        way =
            wide_sub(way, wide_mul_i64(plan->start_vel_q32, plan->dur_ns_q12));
    int shift = plan->acc_bits - 10;
    int up = shift < 0 ? 0 : shift < WAY_FIVES_ROOM ? shift : WAY_FIVES_ROOM;
    struct wider p = wider_mul(way, INT64_C(3) * OTG_FIVES << up);
    if (shift < 0)
        return wider_shr(p, (unsigned)-shift);
    return shift > up ? wider_shl(p, (unsigned)(shift - up)) : p;
}

void motion_otg_plan_miss(const struct motion_otg_plan *plan,
                          struct motion_u128 *vel, struct wider *way)
{
    *vel = wide_sub(motion_otg_vel_image(plan->goal_vel_q32, plan->acc_bits),
                    motion_otg_vel_image(plan->start_vel_q32, plan->acc_bits));
    *way = motion_otg_way_wanted(plan);
    exact_take(plan, vel, way);
}

/* In raw numbers a^2 2^-64 / (2 j 2^-32) <= room 2^-32: a^2 / 2, up, is at most
 * j room, which is below 2^127. */
bool motion_otg_ramp_fits(int64_t acc_q32, int64_t jerk_q32, uint64_t room_q32)
{
    uint64_t a = motion_fixed_abs(acc_q32);
    struct motion_u128 half = wide_mul_u64(a, a);
    struct motion_u128 most = wide_mul_u64((uint64_t)jerk_q32, room_q32);
    half = (struct motion_u128){ half.hi >> 1, half.hi << 63 | half.lo >> 1 };
    if (a & 1) /* a^2 is odd as well */
        half = wide_add(half, wide_from(1));
    return !wide_is_less(most, half);
}
