/* motion/otg/track.c - a plan as segments of a track.  See otg.h.
 *
 * Every phase is a cubic.  Places are counted from the start up to the longest
 * phase and, velocities too, back from the goal down to it, so that what the
 * last unit of the accelerations leaves falls on that one, where it changes
 * least. */
#include <stddef.h>

#include "motion/core/err.h"
#include "motion/core/fixed.h"
#include "motion/otg/internal.h"
#include "motion/otg/replan.h"

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

/* from + way, P's units, cut to 2^-96 unit. */
static int place_at(const struct place *from, struct wider way,
                    const struct motion_divisor *fives, int acc_bits,
                    struct place *place)
{
    int down = acc_bits + 11 - 64;
    uint64_t rest;
    struct wider m = wider_abs(way);
    m = down < 0 ? wider_shl(m, (unsigned)-down) : wider_shr(m, (unsigned)down);
    struct motion_u128 q;
    if (m.hi >= (uint64_t)OTG_WAY_FIVES / 2)
        return MOTION_E_RANGE;
    m = wider_shl(m, fives->up);
    q.hi =
        motion_divisor_apply(fives, (struct motion_u128){ m.hi, m.mid }, &rest);
    q.lo =
        motion_divisor_apply(fives, (struct motion_u128){ rest, m.lo }, NULL);
    if (wider_is_negative(way))
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
    struct motion_divisor fives; /* OTG_WAY_FIVES */
    struct otg_run run;
    struct wider way;        /* of all phases */
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
    motion_divisor_init(&a->fives, (uint64_t)OTG_WAY_FIVES);
    a->longest = motion_otg_carrier(plan);
    a->left = plan->dur_ns_q12;
    a->run = motion_otg_run_start(plan);
    for (int i = 0; i < plan->count; i++)
        motion_otg_run_phase(&a->run, &plan->phase[i]);
    a->way = a->run.p;
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
    struct wider way = wider_add(a->way, wider_mul(rest, a->left));
    return place_at(&a->goal, wider_sub(a->run.p, way), &a->fives, a->acc_bits,
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
