/* tests/motion/otg/otg_oracle_phase.c - where a plan is, and its polynomials;
 * see otg_oracle_parts.h. */
#include "tests/motion/otg/otg_oracle_parts.h"

#define FIVE_9 1953125 /* 5^9 */

/* --- polynomials ---------------------------------------------------------- */

static void term(struct big *to, const struct big *value, int64_t times,
                 const struct oracle *g, int powers_of_n)
{
    big_mul_int(to, value, times);
    for (int i = 0; i < powers_of_n; i++)
        big_mul_int(to, to, g->n);
}

static void poly_pos(const struct oracle *g, const struct big *a,
                     const struct big *rise, struct big_poly *f)
{
    f->degree = 3;
    big_copy(&f->c[0], &g->pos);
    term(&f->c[1], &g->vel, 3, g, 1);
    term(&f->c[2], a, 3, g, 2);
    term(&f->c[3], rise, 1, g, 2);
}

static void poly_vel(const struct oracle *g, const struct big *a,
                     const struct big *rise, struct big_poly *f)
{
    f->degree = 2;
    big_copy(&f->c[0], &g->vel);
    term(&f->c[1], a, 2, g, 1);
    term(&f->c[2], rise, 1, g, 1);
}

static void poly_acc(const struct oracle *g, const struct big *a,
                     const struct big *rise, struct big_poly *f)
{
    (void)g;
    f->degree = 1;
    big_copy(&f->c[0], a);
    big_copy(&f->c[1], rise);
}

static void poly_jerk(const struct oracle *g, const struct big *a,
                      const struct big *rise, struct big_poly *f)
{
    (void)g;
    (void)a;
    f->degree = 0;
    big_mul_int(&f->c[0], rise, FIVE_9);
}

void oracle_acc(const struct oracle *g, struct big *to, int64_t acc)
{
    big_set(to, acc);
    big_shl(to, to, g->lift);
}

void oracle_poly(const struct oracle *g, enum oracle_order order,
                 struct big_poly *f)
{
    static void (*const polys[])(
        const struct oracle *, const struct big *, const struct big *,
        struct big_poly *) = { poly_pos, poly_vel, poly_acc, poly_jerk };
    struct big a, rise; /* A and A' fit, their difference may not */
    oracle_acc(g, &a, g->a);
    oracle_acc(g, &rise, g->to);
    big_sub(&rise, &rise, &a);
    polys[order](g, &a, &rise, f);
}

/* --- the walk ------------------------------------------------------------- */

static void unit_init(struct big *unit, int64_t factor, int bits)
{
    big_set(unit, factor);
    big_shl(unit, unit, (unsigned)bits);
}

static void oracle_start(struct oracle *g, const struct motion_otg_move *move,
                         const struct motion_otg_plan *plan)
{
    int bits = plan->acc_bits > 53 ? plan->acc_bits : 53;
    g->lift = (unsigned)(bits - plan->acc_bits);
    g->move = move;
    g->plan = plan;
    unit_init(&g->unit[ORACLE_POS], (int64_t)FIVE_9 * FIVE_9 * 3, bits + 11);
    unit_init(&g->unit[ORACLE_VEL], FIVE_9, bits - 10);
    unit_init(&g->unit[ORACLE_ACC], 1, bits - 32);
    unit_init(&g->unit[ORACLE_JERK], 1, bits - 53);
    big_set(&g->pos, 0);
    big_mul_int(&g->vel, &g->unit[ORACLE_VEL], plan->start_vel_q32);
    g->a = plan->start_acc;
    g->t0 = 0;
    g->i = 0;
}

/* Walk to the end to see what is left. */
static void find_rest(struct oracle *g)
{
    uint32_t trim = g->plan->trim[0] | g->plan->trim[1];
    struct big goal;
    g->first_trim = g->plan->count;
    g->last_trim = -1;
    while (g->i < g->plan->count) {
        if (trim >> g->i & 1)
            g->last_trim = g->i;
        if (trim >> g->i & 1 && g->first_trim > g->i)
            g->first_trim = g->i;
        g->n = g->plan->phase[g->i].dur_ns_q12;
        g->to = g->plan->phase[g->i].acc;
        oracle_step(g);
    }
    big_mul_int(&goal, &g->unit[ORACLE_VEL], g->plan->goal_vel_q32);
    big_sub(&g->rest, &g->vel, &goal);
}

void oracle_init(struct oracle *g, const struct motion_otg_move *move,
                 const struct motion_otg_plan *plan)
{
    oracle_start(g, move, plan);
    find_rest(g);
    oracle_start(g, move, plan);
    oracle_open(g);
}

/* Is the velocity, at the start of the phase, outside? */
static bool is_outside(const struct oracle *g, int up)
{
    const struct motion_otg_limit *l = &g->move->limit;
    struct big limit;
    big_mul_int(&limit, &g->unit[ORACLE_VEL],
                up ? l->vel_max_q32 : l->vel_min_q32);
    return big_cmp(&g->vel, &limit) == (up ? 1 : -1);
}

void oracle_phase(struct oracle *g)
{
    g->n = g->plan->phase[g->i].dur_ns_q12;
    g->to = g->plan->phase[g->i].acc;
    for (int up = 0; up < 2; up++)
        g->outside[up] =
            g->outside[up] && (g->i < g->let_go[up] || is_outside(g, up));
}

/* To the polynomials' values at x = 1. */
void oracle_step(struct oracle *g)
{
    struct big_poly pos, vel;
    oracle_poly(g, ORACLE_POS, &pos);
    oracle_poly(g, ORACLE_VEL, &vel);
    big_set(&g->pos, 0);
    big_set(&g->vel, 0);
    for (int k = 0; k <= pos.degree; k++)
        big_add(&g->pos, &g->pos, &pos.c[k]);
    for (int k = 0; k <= vel.degree; k++)
        big_add(&g->vel, &g->vel, &vel.c[k]);
    g->a = g->to;
    g->t0 += g->n;
    g->i++;
}

void oracle_trim(const struct oracle *g, struct big *weight)
{
    const struct motion_otg_plan *plan = g->plan;
    struct big one;
    big_set(weight, 0);
    for (int i = 0; i < plan->count; i++)
        for (int k = i; k <= i + 1 && k < plan->count; k++) {
            big_set(&one, plan->phase[k].dur_ns_q12);
            if ((plan->trim[0] | plan->trim[1]) >> i & 1)
                big_add(weight, weight, &one);
        }
    big_shl(weight, weight, g->lift);
}
