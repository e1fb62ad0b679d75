/* tests/motion/otg/otg_oracle_open.c - what start and goal make unavoidable;
 * see otg_oracle.h. */
#include "tests/motion/otg/otg_oracle_parts.h"

#define NS_PER_S INT64_C(1000000000)

/* v + a^2 / 2 j in 2^-32 unit/s is v + a^2 2^15 / j. */
static void natural(struct oracle_bound *b, int64_t v, int64_t a, int64_t j)
{
    struct big ramp;
    big_set(&b->den, j > 0 ? j : 1);
    big_set(&b->num, v);
    big_mul(&b->num, &b->num, &b->den);
    if (a <= 0 || j <= 0)
        return;
    big_set(&ramp, a);
    big_mul_int(&ramp, &ramp, a);
    big_shl(&ramp, &ramp, 15);
    big_add(&b->num, &b->num, &ramp);
}

/* The peak when ramping a to zero lasts a tick longer, to be a whole number of
 * them: |a| / 2 times 2^-12 ns more. */
static void peak_of(struct oracle_bound *b, int64_t v, int64_t a, int64_t j)
{
    struct big more;
    natural(b, v, a, j);
    big_set(&more, a > 0 ? a : 0);
    big_mul(&more, &more, &b->den);
    big_shl(&more, &more, 16 - 13);
    big_mul_int(&b->num, &b->num, NS_PER_S);
    big_mul_int(&b->den, &b->den, NS_PER_S);
    big_add(&b->num, &b->num, &more);
}

static bool must_touch(const struct oracle_bound *b, int64_t limit)
{
    struct big other;
    big_mul_int(&other, &b->den, limit);
    return big_cmp(&b->num, &other) >= 0;
}

static bool is_less(const struct oracle_bound *a, const struct oracle_bound *b)
{
    struct big left, right;
    big_mul(&left, &a->num, &b->den);
    big_mul(&right, &b->num, &a->den);
    return big_cmp(&left, &right) < 0;
}

/* Phases until the acceleration, turned by `sign`, first is not above zero; at
 * least those of braking. */
static int phases_until_let_go(const struct motion_otg_plan *plan, int sign)
{
    int i = 0;
    if (plan->start_acc * sign > 0)
        while (i < plan->count && plan->phase[i++].acc * sign > 0)
            ;
    return i < plan->brake ? plan->brake : i;
}

int oracle_late(const struct motion_otg_plan *plan, int sign)
{
    int i = plan->count;
    if (plan->count == 0 || plan->phase[plan->count - 1].acc * sign >= 0)
        return i;
    while (i > 0) {
        i--;
        int64_t a = i > 0 ? plan->phase[i - 1].acc : plan->start_acc;
        if (a * sign >= 0)
            break;
    }
    return i;
}

/* Velocities turned by sign: +1 above, -1 below. */
static void open_velocity(struct oracle *g, int up)
{
    const struct motion_otg_move *m = g->move;
    const struct motion_otg_limit *l = &m->limit;
    int sign = up ? 1 : -1;
    int64_t limit = sign * (up ? l->vel_max_q32 : l->vel_min_q32);
    int64_t v0 = sign * m->start.vel_q32, a0 = sign * m->start.acc_q32;
    int64_t vf = sign * m->goal.vel_q32, af = -sign * m->goal.acc_q32;
    int64_t j = l->jerk_q32, j2 = oracle_closing_jerk(l);
    struct oracle_bound at;
    g->outside[up] = false;
    g->let_go[up] = 0;
    g->late[up] = g->plan->count;
    oracle_bound_of(&g->peak[up], limit);
    natural(&at, v0, a0, j);
    if (must_touch(&at, limit) && (v0 > limit || a0 > 0)) {
        g->outside[up] = true;
        g->let_go[up] = phases_until_let_go(g->plan, sign);
        peak_of(&g->peak[up], v0, a0, j);
    }
    natural(&at, vf, af, j2);
    if (must_touch(&at, limit) && af > 0) {
        g->late[up] = oracle_late(g->plan, sign);
        peak_of(&at, vf, af, j2);
        if (is_less(&g->peak[up], &at))
            g->peak[up] = at;
    }
    g->peak[up].num.sign *= sign;
}

void oracle_open(struct oracle *g)
{
    for (int up = 0; up < 2; up++)
        open_velocity(g, up);
}
