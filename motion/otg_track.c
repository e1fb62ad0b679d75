/* motion/otg_track.c - a plan as segments of a track.  See otg.h.
 *
 * Every phase is a cubic with rounded coefficients, and a segment's highest one
 * makes up what its ends say otherwise.  So places are summed from the very
 * coefficients, from the start up to the longest phase and back from the goal
 * down to it: what all the roundings leave falls on the longest segment, where
 * it changes the velocity least. */
#include "motion/err.h"
#include "motion/fixed.h"
#include "motion/otg_internal.h"
#include "motion/real.h"

#define TRACK_COEF_BITS 61 /* of the largest coefficient given */

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

/* One unit of P in units of position. */
static struct motion_real unit_of(int acc_bits)
{
    static const struct motion_real per_fives = { INT64_C(3544607988759775661),
                                                  -105 };
    return motion_real_scale(per_fives, -43 - acc_bits);
}

/* a n, whole until then, in units of position. */
static struct motion_real in_units(struct wide a, int64_t n, int acc_bits)
{
    return motion_real_mul(motion_otg_wider_real(wider_mul(a, n)),
                           unit_of(acc_bits));
}

static struct motion_real largest(struct motion_real a, struct motion_real b)
{
    return motion_real_max(motion_real_abs(a), motion_real_abs(b));
}

/* The phase from v, a: 3 V n, 3 A n^2, (A' - A) n^2 as fixed point, the finest
 * that the largest allows. */
static int cubic_of(struct wide v, int64_t a,
                    const struct motion_otg_phase *phase, int acc_bits,
                    struct cubic *cubic)
{
    int64_t n = phase->dur_ns_q12;
    struct motion_real c[3];
    struct wide an = wide_mul_i64(a, n);
    c[0] = in_units(wide_add(v, wide_add(v, v)), n, acc_bits);
    c[1] = in_units(wide_add(an, wide_add(an, an)), n, acc_bits);
    c[2] = in_units(wide_mul_i64(phase->acc - a, n), n, acc_bits);
    struct motion_real most = largest(largest(c[0], c[1]), c[2]);
    int frac = TRACK_COEF_BITS - 62 - most.e - 32;
    if (most.m == 0 || frac > 31)
        frac = 31;
    if (frac < 0)
        return MOTION_E_RANGE;
    cubic->frac = frac;
    cubic->degree = 1;
    for (int i = 0; i < 3; i++) {
        if (motion_real_round(c[i], 32 + frac, &cubic->coef[i]) < 0)
            return MOTION_E_RANGE;
        if (c[i].m != 0)
            cubic->degree = i + 1;
    }
    return MOTION_OK;
}

/* How far the cubic leads, 2^-(32 + frac), as Q32.64 added to (taken from)
 * `place`. */
static int place_move(struct place *place, const struct cubic *cubic, bool back)
{
    struct wide way = wide_from(cubic->coef[0]);
    way = wide_add(way, wide_from(cubic->coef[1]));
    way = wide_add(way, wide_from(cubic->coef[2]));
    if (back)
        way = wide_neg(way);
    way = wide_shl(way, (unsigned)(64 - cubic->frac));
    uint64_t frac = place->frac + way.lo;
    int64_t carry = frac < way.lo;
    place->frac = frac;
    int err =
        motion_fixed_add(place->pos_q32, (int64_t)way.hi, &place->pos_q32);
    return err < 0 ? err
                   : motion_fixed_add(place->pos_q32, carry, &place->pos_q32);
}

struct append {
    const struct motion_otg_plan *plan;
    struct motion_track *track;
    struct wide vel;  /* at the present phase */
    struct wide miss; /* of the velocity at the end */
    int longest;
    struct place end[MOTION_OTG_PHASES]; /* of phases, from the longest on */
};

static int64_t acc_before(const struct motion_otg_plan *plan, int i)
{
    return i > 0 ? plan->phase[i - 1].acc : plan->start_acc;
}

static struct wide vel_gain(const struct motion_otg_plan *plan, int i)
{
    const struct motion_otg_phase *phase = &plan->phase[i];
    return wide_mul_i64(acc_before(plan, i) + phase->acc, phase->dur_ns_q12);
}

/* Velocities to the end, and places back from there. */
static int append_init(struct append *a)
{
    const struct motion_otg_plan *plan = a->plan;
    struct place place = { plan->goal_pos_q32, 0 };
    struct wide start =
        motion_otg_vel_image(plan->start_vel_q32, plan->acc_bits);
    struct wide goal = motion_otg_vel_image(plan->goal_vel_q32, plan->acc_bits);
    struct wide vel = start;
    a->longest = 0;
    for (int i = 0; i < plan->count; i++) {
        vel = wide_add(vel, vel_gain(plan, i));
        if (plan->phase[i].dur_ns_q12 > plan->phase[a->longest].dur_ns_q12)
            a->longest = i;
    }
    a->vel = start;
    a->miss = wide_sub(goal, vel);
    vel = goal;
    for (int i = plan->count - 1; i >= a->longest; i--) {
        struct cubic cubic;
        a->end[i] = place;
        vel = wide_sub(vel, vel_gain(plan, i));
        int err = cubic_of(vel, acc_before(plan, i), &plan->phase[i],
                           plan->acc_bits, &cubic);
        if (err == MOTION_OK && i > a->longest)
            err = place_move(&place, &cubic, true);
        if (err < 0)
            return err;
    }
    return MOTION_OK;
}

static int append_phase(struct append *a, int i)
{
    const struct motion_otg_plan *plan = a->plan;
    const struct motion_otg_phase *phase = &plan->phase[i];
    struct place end = { a->track->end.pos_q32, a->track->end_frac };
    struct cubic cubic;
    int err =
        cubic_of(a->vel, acc_before(plan, i), phase, plan->acc_bits, &cubic);
    if (err == MOTION_OK && i < a->longest)
        err = place_move(&end, &cubic, false);
    if (err < 0)
        return err;
    if (i >= a->longest)
        end = a->end[i];
    a->vel = wide_add(a->vel, vel_gain(plan, i));
    if (i == a->longest)
        a->vel = wide_add(a->vel, a->miss);
    return motion_track_append_poly(a->track, phase->dur_ns_q12, cubic.degree,
                                    cubic.coef, (unsigned)cubic.frac,
                                    end.pos_q32, end.frac);
}

int motion_otg_append(const struct motion_otg_plan *plan,
                      struct motion_track *track)
{
    struct motion_track before = *track;
    struct append a;
    a.plan = plan;
    a.track = track;
    int err = append_init(&a);
    for (int i = 0; i < plan->count && err == MOTION_OK; i++)
        err = append_phase(&a, i);
    if (err < 0)
        *track = before;
    return err;
}
