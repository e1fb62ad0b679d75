/* motion/otg_polish.c - one Newton step in exact integers.
 *
 * The search leaves a motion that misses its goal by 2^-27 or so.  Rounded to
 * whole ticks it is run in exact integers, so the miss is known to the last
 * bit, and a small change of two places where the motion is free makes it good
 * to the square of that: how long the highest and the lowest acceleration are
 * held or, where they are not, how high they are; and the cruise.
 *
 * Inserting a tick at time t, where speed and acceleration are v and a, changes
 * speed and position at the end by a and v + a (N - t).  A peak that is one
 * tick of ramp higher is a tick inserted on either side of it and an
 * acceleration higher by j between. */
#include <stddef.h>

#include "motion/otg_internal.h"

/* The part that is small enough for a Newton step. */
#define POLISH_BITS 10

/* What a tick more changes at the end: duration, speed, position. */
struct knob {
    struct num t, v, d;
    bool is_hold;
};

struct polish {
    struct motion_otg_plan *plan;
    const struct otg_knobs *knobs;
    const struct otg_rates *rates;
    struct knob hump[2], cruise;
};

static struct num from_wide(struct wide a)
{
    struct real r = wide_real(a, 0);
    return r.m ? num_make(r.m, r.e) : num_zero();
}

/* Three times. */
static struct num thrice(struct num a)
{
    return num_add(a, num_twice(a));
}

int64_t motion_otg_ramp_ticks(const struct otg_rates *rates, int i,
                              int64_t step)
{
    struct num per_j = rates->per_j;
    if (i >= rates->turn)
        per_j = rates->per_j2;
    else if (i >= rates->brake)
        per_j = num_max(rates->per_j, rates->per_j2);
    if (step == 0)
        return 0;
    struct wide n = wide_mul(wide_from(step < 0 ? -step : step), per_j.m);
    int down = -per_j.e;
    n = down > 0 ? wide_shr(n, down > 127 ? 127 : (unsigned)down)
                 : wide_shl(n, (unsigned)-down);
    return (int64_t)n.lo + 1;
}

/* The hump held in phase i, entered with v and left with v2 (steps per tick);
 * t2 ticks are left when it is left. */
static void knob_hump(const struct polish *p, int which, struct num v,
                      struct num v2, int64_t left, struct knob *k)
{
    int i = p->knobs->hump[which];
    int64_t hold = p->plan->phase[i].ticks;
    struct num a = num_mul(num_int(p->plan->phase[i].acc), num_int(6));
    k->is_hold = hold > p->plan->ticks >> POLISH_BITS;
    if (k->is_hold) {
        *k = (struct knob){ num_one(), a, v2, true };
        k->d = num_add(v2, num_mul(a, num_int(left)));
        return;
    }
    struct num j = p->rates->j;
    if (i >= p->rates->turn)
        j = p->rates->j2;
    else if (i >= p->rates->brake)
        j = num_min(j, p->rates->j2);
    struct num held = num_mul(num_mul(j, num_int(6)), num_int(hold));
    if (!p->knobs->is_peak[which])
        held = num_neg(held);
    k->t = num_int(2);
    k->v = num_add(num_twice(a), held);
    struct num middle = num_scale(num_int(2 * left + hold), -1);
    k->d = num_add(num_add(v, v2), num_mul(k->v, middle));
}

/* Run along the plan to where the knobs are. */
static void polish_walk(struct polish *p)
{
    const struct motion_otg_plan *plan = p->plan;
    struct wide vel = motion_otg_wide_in(plan->start_vel);
    int64_t a = plan->start_acc, left = plan->ticks;
    struct num v = num_zero(), v2;
    for (int i = 0; i < plan->count; i++) {
        int64_t n = plan->phase[i].ticks, to = plan->phase[i].acc;
        int which = i == p->knobs->hump[1];
        bool is_hump = i == p->knobs->hump[which];
        if (is_hump || i == p->knobs->cruise)
            v = thrice(from_wide(vel));
        vel = wide_add(vel, wide_mul(wide_from(a + to), n));
        left -= n;
        a = to;
        if (i == p->knobs->cruise)
            p->cruise = (struct knob){ num_one(), num_zero(), v, true };
        if (is_hump) {
            v2 = n ? thrice(from_wide(vel)) : v;
            knob_hump(p, which, v, v2, left, &p->hump[which]);
        }
    }
}

static int64_t whole(struct num x)
{
    return (motion_real_floor_clamped(num_real(x), 1) + 1) >> 1;
}

/* Too far for a Newton step, or nowhere. */
static bool is_far(const struct polish *p, struct num x)
{
    int64_t most = p->plan->ticks >> POLISH_BITS;
    return num_lt(num_int(most), num_abs(x));
}

static void turn_hold(struct polish *p, int i, struct num x)
{
    int64_t *n = &p->plan->phase[i].ticks;
    *n += whole(x);
    if (*n < 0)
        *n = 0;
}

static void turn_hump(struct polish *p, int which, struct num x)
{
    int i = p->knobs->hump[which];
    struct motion_otg_phase *phase = p->plan->phase;
    if (p->hump[which].is_hold) {
        turn_hold(p, i, x);
        return;
    }
    struct num rise = num_mul(x, p->rates->j);
    if (i >= p->rates->turn)
        rise = num_mul(x, p->rates->j2);
    else if (i >= p->rates->brake)
        rise = num_mul(x, num_min(p->rates->j, p->rates->j2));
    int64_t by = whole(p->knobs->is_peak[which] ? rise : num_neg(rise));
    phase[i - 1].acc += by;
    phase[i].acc += by;
}

/* Ramps last as long as their jerk wants. */
static void turn_ramps(struct polish *p)
{
    struct motion_otg_phase *phase = p->plan->phase;
    for (int which = 0; which < 2; which++) {
        int i = p->knobs->hump[which];
        if (i < 0)
            continue;
        int64_t before = i > 1 ? phase[i - 2].acc : p->plan->start_acc;
        int64_t acc = phase[i].acc, after = phase[i + 1].acc;
        phase[i - 1].ticks =
            motion_otg_ramp_ticks(p->rates, i - 1, acc - before);
        phase[i + 1].ticks =
            motion_otg_ramp_ticks(p->rates, i + 1, after - acc);
    }
}

/* Speed alone. */
static void polish_speed(struct polish *p, struct num v)
{
    struct num x = num_div(v, p->hump[0].v);
    if (p->hump[0].v.m == 0 || is_far(p, x))
        return;
    turn_hump(p, 0, x);
    turn_ramps(p);
}

/* Speed with the hump that changes it more, the rest with the cruise. */
static void polish_cruise(struct polish *p, struct num v, struct num d)
{
    int which = num_lt(num_abs(p->hump[0].v), num_abs(p->hump[1].v));
    const struct knob *k = &p->hump[which];
    struct num x = num_zero();
    if (k->v.m)
        x = num_div(v, k->v);
    struct num c = num_sub(d, num_mul(k->d, x));
    c = num_div(c, p->cruise.d);
    if (p->cruise.d.m == 0 || is_far(p, x) || is_far(p, c))
        return;
    turn_hump(p, which, x);
    turn_hold(p, p->knobs->cruise, c);
    turn_ramps(p);
}

/* Both humps; with a wanted duration the cruise takes what they leave of it. */
static void polish_humps(struct polish *p, struct num v, struct num d,
                         struct num t, bool is_timed)
{
    const struct knob *k = &p->hump[0], *l = &p->hump[1];
    struct num kd = k->d, ld = l->d;
    if (is_timed) {
        kd = num_sub(kd, num_mul(p->cruise.d, k->t));
        ld = num_sub(ld, num_mul(p->cruise.d, l->t));
        d = num_sub(d, num_mul(p->cruise.d, t));
    }
    struct num det = num_sub(num_mul(k->v, ld), num_mul(l->v, kd));
    if (det.m == 0)
        return;
    struct num per = num_inv(det);
    struct num x = num_sub(num_mul(v, ld), num_mul(l->v, d));
    struct num y = num_sub(num_mul(k->v, d), num_mul(v, kd));
    x = num_mul(x, per);
    y = num_mul(y, per);
    if (is_far(p, x) || is_far(p, y))
        return;
    turn_hump(p, 0, x);
    turn_hump(p, 1, y);
    if (is_timed) {
        t = num_sub(t, num_mul(x, k->t));
        t = num_sub(t, num_mul(y, l->t));
        turn_hold(p, p->knobs->cruise, t);
    }
    turn_ramps(p);
}

void motion_otg_polish(struct motion_otg_plan *plan,
                       const struct otg_knobs *knobs,
                       const struct otg_rates *rates,
                       const struct otg_miss *miss)
{
    struct polish p = { .plan = plan, .knobs = knobs, .rates = rates };
    if (knobs->hump[0] < 0 || plan->count == 0)
        return;
    polish_walk(&p);
    struct num v = thrice(from_wide(miss->vel)), d = from_wide(miss->way);
    if (knobs->hump[1] < 0)
        polish_speed(&p, v);
    else if (knobs->cruise >= 0 && !miss->is_timed)
        polish_cruise(&p, v, d);
    else
        polish_humps(&p, v, d, num_int(miss->ticks), knobs->cruise >= 0);
}
