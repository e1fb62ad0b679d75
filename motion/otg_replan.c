/* motion/otg_replan.c - see otg_replan.h. */
#include "motion/otg_replan.h"

#include <stddef.h>

#include "motion/err.h"
#include "motion/otg_internal.h"

/* Phases up to the one that holds tick x, and the rest of x in it. */
struct place {
    struct wide p, v; /* at the start of the phase, without the quintic */
    int64_t a, to, n; /* of the phase */
    struct real x;    /* ticks into it */
};

static struct place place_at(const struct motion_otg_plan *plan,
                             int64_t t_ns_q12)
{
    struct place at = { .v = motion_otg_wide_in(plan->start_vel),
                        .a = plan->start_acc };
    for (int i = 0; i < plan->count; i++) {
        int64_t dur = plan->phase[i].ticks << plan->tick_shift;
        at.n = plan->phase[i].ticks;
        at.to = plan->phase[i].acc;
        if (t_ns_q12 <= dur || i + 1 == plan->count) {
            t_ns_q12 = t_ns_q12 < dur ? t_ns_q12 : dur;
            at.x = real_scale(real_int(t_ns_q12), -plan->tick_shift);
            break;
        }
        t_ns_q12 -= dur;
        struct wide bent = wide_mul(wide_from(2 * at.a + at.to), at.n);
        bent = wide_add(bent, wide_mul(at.v, 3));
        at.p = wide_add(at.p, wide_mul(bent, at.n));
        at.v = wide_add(at.v, wide_mul(wide_from(at.a + at.to), at.n));
        at.a = at.to;
    }
    return at;
}

/* The quintic and its derivatives, in steps, velocity and acceleration units */
struct bent {
    struct real p, v, a;
};

static struct bent bend_at(const struct motion_otg_plan *plan, int64_t t_ns_q12)
{
    static const struct real third = { INT64_C(0x2aaaaaaaaaaaaaaa), -63 };
    struct real per_n = real_inv(real_int(plan->ticks));
    struct real u =
        real_mul(real_scale(real_int(t_ns_q12), -plan->tick_shift), per_n);
    struct real e3 = wide_real(motion_otg_wide_in(plan->bend[0]), 0);
    struct real e4 = wide_real(motion_otg_wide_in(plan->bend[1]), 0);
    struct real e5 = wide_real(motion_otg_wide_in(plan->bend[2]), 0);
    struct real u2 = real_sqr(u), e5u = real_mul(e5, u);
    struct bent b;
    b.p = real_add(e3, real_mul(u, real_add(e4, e5u)));
    b.p = real_mul(b.p, real_mul(u, u2));
    /* u^2 (e3 + u (4 e4 + 5 e5 u) / 3) / n */
    struct real mid = real_add(real_scale(real_add(e4, e5u), 2), e5u);
    b.v = real_add(e3, real_mul(real_mul(u, mid), third));
    b.v = real_mul(real_mul(b.v, u2), per_n);
    /* u (e3 + u (2 e4 + 10/3 e5 u)) / n^2 */
    mid = real_mul(real_mul(e5u, real_int(10)), third);
    b.a = real_add(e3, real_mul(u, real_add(real_twice(e4), mid)));
    b.a = real_mul(real_mul(b.a, u), real_sqr(per_n));
    return b;
}

/* To nearest. */
static int64_t rounded(struct real x)
{
    return (real_floor(x, 1) + 1) >> 1;
}

void motion_otg_state_at(const struct motion_otg_plan *plan, int64_t t_ns_q12,
                         struct motion_state *state)
{
    struct otg_units units;
    struct wide half = wide_shl(wide_from(1), (unsigned)plan->pos_shift - 32);
    int64_t t = t_ns_q12 < 0 ? 0 : t_ns_q12;
    *state = (struct motion_state){ .pos_q32 = plan->start_pos_q32 };
    if (plan->count == 0)
        return;
    t = t < plan->dur_ns_q12 ? t : plan->dur_ns_q12;
    struct place at = place_at(plan, t);
    struct bent bent = bend_at(plan, t);
    struct real rate = real_div(real_int(at.to - at.a), real_int(at.n));
    struct real a = real_int(at.a), v = wide_real(at.v, 0);
    struct real rise = real_mul(rate, at.x);
    /* (3 v + (3 a + rate x) x) x */
    struct real p = real_add(real_add(real_twice(a), a), rise);
    p = real_add(real_add(real_twice(v), v), real_mul(p, at.x));
    p = real_mul(p, at.x);
    struct wide way = wide_add(at.p, wide_floor(real_add(p, bent.p)));
    way = wide_add(way, wide_shr(half, 1));
    state->pos_q32 += (int64_t)wide_shr(way, (unsigned)plan->pos_shift - 32).lo;
    v = real_add(v, real_mul(real_add(real_twice(a), rise), at.x));
    a = real_add(real_add(a, rise), bent.a);
    motion_otg_units(plan, &units);
    state->vel_q32 = rounded(real_div(real_add(v, bent.v), units.vel));
    state->acc_q16 = rounded(real_div(a, units.acc));
    state->jerk_q16 = rounded(real_div(rate, units.jerk));
}

int motion_otg_stop(const struct motion_state *start,
                    const struct motion_otg_limit *limit,
                    struct motion_otg_plan *plan)
{
    struct motion_otg_move move = { .start = *start,
                                    .limit = *limit,
                                    .mode = MOTION_OTG_VELOCITY };
    return motion_otg_make(&move, plan, NULL);
}

static bool is_same_limit(const struct motion_otg_limit *a,
                          const struct motion_otg_limit *b)
{
    return a->vel_max_q32 == b->vel_max_q32 &&
           a->vel_min_q32 == b->vel_min_q32 &&
           a->acc_max_q16 == b->acc_max_q16 &&
           a->acc_min_q16 == b->acc_min_q16 && a->jerk_q16 == b->jerk_q16 &&
           a->jerk_down_q16 == b->jerk_down_q16;
}

static bool is_same_goal(const struct motion_otg_move *a,
                         const struct motion_otg_move *b)
{
    return a->mode == b->mode && a->goal.pos_q32 == b->goal.pos_q32 &&
           a->goal.vel_q32 == b->goal.vel_q32 &&
           a->goal.acc_q16 == b->goal.acc_q16 &&
           is_same_limit(&a->limit, &b->limit);
}

int motion_otg_replan(const struct motion_otg_move *old_move,
                      const struct motion_otg_plan *old, int64_t t_ns_q12,
                      struct motion_otg_move *move,
                      struct motion_otg_plan *next,
                      enum motion_otg_field *field)
{
    struct motion_otg_plan made;
    int64_t left = old->dur_ns_q12 - t_ns_q12;
    motion_otg_state_at(old, t_ns_q12, &move->start);
    int err = motion_otg_make(move, &made, field);
    if (left > 0 &&
        (err < 0 || (made.dur_ns_q12 >= left && is_same_goal(old_move, move))))
        return MOTION_OTG_KEPT;
    if (err == MOTION_OK) {
        *next = made;
        return MOTION_OTG_NEW;
    }
    err = motion_otg_stop(&move->start, &move->limit, next);
    return err < 0 ? err : MOTION_OTG_STOP;
}
