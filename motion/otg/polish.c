/* motion/otg/polish.c - one Newton step in exact integers.
 *
 * The search leaves a motion that misses its goal by 2^-22 or less.  Rounded to
 * whole ticks it is run in exact integers, so the miss is known to the last
 * bit, and a small change of the places where the motion is free makes it good
 * to the square of that: how long the highest and the lowest acceleration are
 * held or, where they are not, how high they are; and the cruise. */
#include <stddef.h>

#include "motion/core/fixed.h"
#include "motion/otg/internal.h"

/* The part of the whole that is small enough for a Newton step, and where two
 * jerks lie between which the cruise's speed chooses. */
#define POLISH_BITS     6
#define POLISH_TWO_BITS 10
/* A pulse is an acceleration that leaves zero and returns to it (acceleration
 * pulse: Biagiotti & Melchiorri 3.4).  A new one lasts longer than this part. */
#define PULSE_BITS 20

#define TICKS_MOST ((uint64_t)1 << 60)
#define ACC_END    ((uint64_t)1 << 62) /* accelerations have 62 bits */

struct polish {
    struct motion_otg_plan *plan;
    const struct otg_shape *shape;
    const struct otg_rates *rates;
    struct num per_s;   /* ticks */
    struct num v, d, t; /* what is missing */
    /* Half a second more on either side of a pulse changes speed and position at
     * the end by these, a second more of the cruise the position by `speed`. */
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
        n = down < -60 || n >> (60 + down) ? TICKS_MOST : n << -down;
    else
        n >>= down > 63 ? 63 : down;
    return (int64_t)(n < TICKS_MOST ? n : TICKS_MOST) + 1;
}

static int64_t whole(struct num x)
{
    return (motion_real_floor_clamped(num_real(x), 1) + 1) >> 1;
}

/* Too far for a Newton step; x in ticks. */
static bool is_far(const struct polish *p, struct num x)
{
    const struct otg_rates *r = p->rates;
    bool is_one = r->j.m == r->j2.m && r->j.e == r->j2.e;
    int64_t most =
        p->plan->dur_ns_q12 >> (is_one ? POLISH_BITS : POLISH_TWO_BITS);
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
static bool is_no_pulse(const struct polish *p,
                        const struct motion_otg_phase *hold, struct num x)
{
    int64_t least = p->plan->dur_ns_q12 >> PULSE_BITS;
    return (hold[-1].dur_ns_q12 == 0 || hold[1].dur_ns_q12 == 0) &&
           num_lt(num_abs(x), num_int(least));
}

/* Half time x, in ticks, more on either side of a pulse. */
static void turn_pulse(struct polish *p, int which, struct num x)
{
    int i = p->shape->knobs.pulse[which];
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
    if (!p->shape->knobs.is_peak[which])
        by = -by;
    int64_t before = i > 1 ? hold[-2].acc : p->plan->start_acc;
    int64_t acc;
    if (motion_fixed_add(hold->acc, by, &acc) < 0 ||
        motion_fixed_abs(acc) >= ACC_END)
        return; /* no limit is as high */
    acc = no_less(p->shape->knobs.is_peak[which], acc, before);
    hold->acc = no_less(p->shape->knobs.is_peak[which], acc, hold[1].acc);
    hold[-1].acc = hold->acc;
    hold[-1].dur_ns_q12 =
        motion_otg_ramp_ticks(p->rates, i - 1, hold->acc - before);
    hold[1].dur_ns_q12 =
        motion_otg_ramp_ticks(p->rates, i + 1, hold[1].acc - hold->acc);
}

static void turn_cruise(struct polish *p, struct num x)
{
    int64_t *n = &p->plan->phase[p->shape->knobs.cruise].dur_ns_q12;
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
static int speed_pulse(const struct polish *p)
{
    if (p->rates->brake > 0 && !is_slight(p->pulse_v[0], p->pulse_v[1]))
        return 0;
    if (p->rates->lands && !is_slight(p->pulse_v[1], p->pulse_v[0]))
        return 1;
    return num_lt(num_abs(p->pulse_v[0]), num_abs(p->pulse_v[1]));
}

/* Speed with a pulse, the rest with the cruise. */
static void polish_cruise(struct polish *p)
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

/* Both pulses; where there is a cruise, it takes what they leave of a wanted
 * duration. */
static void polish_pulses(struct polish *p)
{
    bool is_timed = p->shape->knobs.cruise >= 0;
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

static void polish_speed(struct polish *p)
{
    struct num x = num_mul(num_div(p->v, p->pulse_v[0]), p->per_s);
    if (p->pulse_v[0].m && !is_far(p, x))
        turn_pulse(p, 0, x);
}

/* A pulse of acceleration a at the speed v, held 2 x longer: what comes after is
 * 2 x later and 2 a x faster. */
static void walk_pulse(struct polish *p, int k, struct num v, int64_t left)
{
    int64_t acc = p->plan->phase[p->shape->knobs.pulse[k]].acc;
    struct num a = num_make(acc, -p->plan->acc_bits);
    p->pulse_v[k] = num_twice(a);
    p->pulse_d[k] = num_twice(num_add(v, num_mul(a, motion_otg_seconds(left))));
}

/* The speeds at the knobs. */
static void polish_walk(struct polish *p)
{
    const struct otg_knobs *k = &p->shape->knobs;
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

void motion_otg_polish(struct motion_otg_plan *plan,
                       const struct otg_shape *shape,
                       const struct otg_rates *rates,
                       const struct otg_miss *miss)
{
    const struct otg_knobs *knobs = &shape->knobs;
    struct polish p = { .plan = plan, .shape = shape, .rates = rates };
    if (knobs->pulse[0] < 0 || plan->count == 0)
        return;
    p.per_s = motion_otg_per_second();
    p.v = miss->vel;
    p.d = miss->way;
    polish_walk(&p);
    if (knobs->pulse[1] < 0) {
        polish_speed(&p);
    } else if (knobs->cruise >= 0 && !miss->is_timed) {
        polish_cruise(&p);
    } else {
        if (knobs->cruise >= 0)
            p.t = num_div(num_make(miss->ticks, 0), p.per_s);
        polish_pulses(&p);
    }
    plan->dur_ns_q12 = 0;
    for (int i = 0; i < plan->count; i++)
        plan->dur_ns_q12 += plan->phase[i].dur_ns_q12;
}
