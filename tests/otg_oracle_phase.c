/* tests/otg_oracle_phase.c - where a plan is, and its polynomials; see
 * otg_oracle_parts.h. */
#include "tests/otg_oracle_parts.h"

int oracle_scale(const struct motion_otg_plan *plan, enum oracle_order order)
{
    static const int less[] = { 0, 53, 58, 79 };
    return plan->pos_shift + (int)order * plan->tick_shift - less[order];
}

void oracle_wide(struct big *to, struct motion_otg_wide a)
{
    big_set_wide(to, a.hi, a.lo);
}

static int64_t choose(int n, int k)
{
    int64_t c = 1;
    for (int i = 1; i <= k; i++)
        c = c * (n - k + i) / i;
    return c;
}

/* f += factor * times * (t0 + n x)^power */
static void add_power(struct big_poly *f, const struct oracle *g,
                      const struct big *factor, int64_t times, int power)
{
    for (int k = 0; k <= power; k++) {
        struct big term;
        big_mul_int(&term, factor, times * choose(power, k));
        for (int i = 0; i < power; i++)
            big_mul_int(&term, &term, i < k ? g->n : g->t0);
        big_add(&f->c[k], &f->c[k], &term);
    }
}

/* f.c[k] += N^5 * value * times */
static void add_term(struct big_poly *f, const struct oracle *g, int k,
                     const struct big *value, int64_t times)
{
    struct big term;
    big_mul_int(&term, value, times);
    big_mul(&term, &term, &g->total[5]);
    big_add(&f->c[k], &f->c[k], &term);
}

/* A and A' - A are below 2^63 each, their difference may not be. */
static void phase_rise(const struct oracle *g, struct big *a, struct big *rise)
{
    big_set(a, g->a);
    big_set(rise, g->to);
    big_sub(rise, rise, a);
}

static void poly_pos(const struct oracle *g, struct big_poly *f)
{
    struct big v, a, rise;
    phase_rise(g, &a, &rise);
    big_mul_int(&v, &g->vel, g->n);
    for (int k = 0; k < 2; k++) {
        big_mul_int(&a, &a, g->n);
        big_mul_int(&rise, &rise, g->n);
    }
    add_term(f, g, 0, &g->pos, 1);
    add_term(f, g, 1, &v, 3);
    add_term(f, g, 2, &a, 3);
    add_term(f, g, 3, &rise, 1);
}

static void poly_vel(const struct oracle *g, struct big_poly *f)
{
    struct big a, rise;
    phase_rise(g, &a, &rise);
    big_mul_int(&a, &a, g->n);
    big_mul_int(&rise, &rise, g->n);
    add_term(f, g, 0, &g->vel, 3);
    add_term(f, g, 1, &a, 6);
    add_term(f, g, 2, &rise, 3);
}

static void poly_acc(const struct oracle *g, struct big_poly *f)
{
    struct big a, rise;
    phase_rise(g, &a, &rise);
    add_term(f, g, 0, &a, 6);
    add_term(f, g, 1, &rise, 6);
}

/* Times n. */
static void poly_jerk(const struct oracle *g, struct big_poly *f)
{
    struct big a, rise;
    phase_rise(g, &a, &rise);
    for (int k = 0; k <= f->degree; k++)
        big_mul_int(&f->c[k], &f->c[k], g->n);
    add_term(f, g, 0, &rise, 6);
}

/* e_k (k + 3)(k + 2).. y^(k + 3 - order), `order` factors. */
static void poly_bend(const struct oracle *g, enum oracle_order order,
                      struct big_poly *f)
{
    f->degree = 5 - (int)order;
    for (int i = 0; i <= f->degree; i++)
        big_set(&f->c[i], 0);
    for (int k = 0; k < 3; k++) {
        int64_t times = 1;
        for (int i = 0; i < (int)order; i++)
            times *= k + 3 - i;
        add_power(f, g, &g->bend[k], times, k + 3 - (int)order);
    }
}

void oracle_poly(const struct oracle *g, enum oracle_order order,
                 struct big_poly *f)
{
    static void (*const phases[])(const struct oracle *,
                                  struct big_poly *) = { poly_pos, poly_vel,
                                                         poly_acc, poly_jerk };
    poly_bend(g, order, f);
    phases[order](g, f);
}

/* --- the walk ------------------------------------------------------------- */

void oracle_init(struct oracle *g, const struct motion_otg_move *move,
                 const struct motion_otg_plan *plan)
{
    g->move = move;
    g->plan = plan;
    big_set(&g->total[0], 1);
    for (int k = 1; k < 6; k++)
        big_mul_int(&g->total[k], &g->total[k - 1], plan->ticks);
    for (int k = 0; k < 3; k++) {
        oracle_wide(&g->bend[k], plan->bend[k]);
        big_mul(&g->bend[k], &g->bend[k], &g->total[2 - k]);
    }
    big_set(&g->five[0], 1);
    for (int k = 1; k < 4; k++)
        big_mul_int(&g->five[k], &g->five[k - 1], 1953125);
    big_set(&g->pos, 0);
    oracle_wide(&g->vel, plan->start_vel);
    g->a = plan->start_acc;
    g->t0 = 0;
    g->i = 0;
    oracle_open(g);
}

/* Is the velocity, at the start of the phase, outside? */
static bool is_outside(const struct oracle *g, int up)
{
    const struct motion_otg_limit *l = &g->move->limit;
    int scale = oracle_scale(g->plan, ORACLE_VEL);
    struct big have, limit;
    big_mul_int(&have, &g->vel, 3);
    big_mul(&have, &have, &g->five[ORACLE_VEL]);
    big_set(&limit, up ? l->vel_max_q32 : l->vel_min_q32);
    if (scale > 0)
        big_shl(&limit, &limit, (unsigned)scale);
    else
        big_shl(&have, &have, (unsigned)-scale);
    return big_cmp(&have, &limit) == (up ? 1 : -1);
}

void oracle_phase(struct oracle *g)
{
    g->n = g->plan->phase[g->i].ticks;
    g->to = g->plan->phase[g->i].acc;
    for (int up = 0; up < 2; up++)
        g->outside[up] =
            g->outside[up] && (g->i < g->let_go[up] || is_outside(g, up));
}

/* P' = P + 3 V n + (2 A + A') n^2, V' = V + (A + A') n. */
void oracle_step(struct oracle *g)
{
    struct big term, a;
    big_mul_int(&term, &g->vel, 3);
    big_mul_int(&term, &term, g->n);
    big_add(&g->pos, &g->pos, &term);
    big_set(&term, g->to);
    big_set(&a, g->a);
    big_add(&term, &term, &a);
    big_add(&a, &term, &a);
    big_mul_int(&a, &a, g->n);
    big_mul_int(&term, &term, g->n);
    big_add(&g->vel, &g->vel, &term);
    big_mul_int(&a, &a, g->n);
    big_add(&g->pos, &g->pos, &a);
    g->a = g->to;
    g->t0 += g->n;
    g->i++;
}
