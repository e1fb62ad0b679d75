/* tests/otg_oracle.c - see otg_oracle.h. */
#include "tests/otg_oracle.h"

#include <stdbool.h>
#include <stddef.h>

#include "motion/err.h"
#include "motion/track.h"

__extension__ typedef __float128 quad;

struct judge {
    const struct motion_otg_plan *plan;
    quad h, unit;        /* tick in s; unit of acceleration */
    quad vx, vn, ax, an; /* allowed, in physical units */
    quad j, j2;
};

static quad power(int e)
{
    quad x = 1;
    for (; e > 0; e--)
        x *= 2;
    for (; e < 0; e++)
        x /= 2;
    return x;
}

static quad larger(quad a, quad b)
{
    return a > b ? a : b;
}

/* Peak that cannot be avoided, v + a^2/2j; what rounding makes of it is 2^-30 of
 * the ramp. */
static quad peak(quad v, quad a, quad j)
{
    if (a <= 0 || j <= 0)
        return v;
    return v + a * a / (2 * j) * (1 + power(-30));
}

/* A limit, or beyond it what start and goal make necessary. */
static quad highest(quad limit, quad v0, quad a0, quad j, quad vf, quad af,
                    quad j2)
{
    if (a0 > 0 && j > 0 && v0 + a0 * a0 / (2 * j) > limit)
        limit = peak(v0, a0, j);
    if (af > 0 && j > 0 && vf + af * af / (2 * j2) > limit)
        limit = larger(limit, peak(vf, af, j2));
    return larger(limit, larger(v0, vf));
}

/* What one unit of acceleration at the trimmed corners makes of the velocity,
 * and 2^-80 for the sums here. */
static quad last_unit(const struct judge *g)
{
    const struct motion_otg_plan *plan = g->plan;
    int64_t ticks = 1;
    for (int i = 0; i + 1 < plan->count; i++)
        if ((plan->trim[0] | plan->trim[1]) >> i & 1)
            ticks += plan->phase[i].dur_ns_q12 + plan->phase[i + 1].dur_ns_q12;
    return (quad)ticks * g->h * g->unit / 2;
}

static void judge_init(struct judge *g, const struct motion_otg_move *m,
                       const struct motion_otg_plan *plan)
{
    const quad q32 = power(-32), q16 = power(-16);
    const struct motion_otg_limit *l = &m->limit;
    quad j2 = (l->jerk_down_q16 ? l->jerk_down_q16 : l->jerk_q16) * q16;
    quad v0 = m->start.vel_q32 * q32, a0 = m->start.acc_q16 * q16;
    quad vf = m->goal.vel_q32 * q32, af = m->goal.acc_q16 * q16;
    *g = (struct judge){ .plan = plan };
    g->h = 1 / ((quad)1000000000 * 4096);
    g->unit = power(-plan->acc_bits);
    g->j = l->jerk_q16 * q16;
    g->j2 = j2;
    g->vx = highest(l->vel_max_q32 * q32, v0, a0, g->j, vf, -af, j2);
    g->vn = -highest(-l->vel_min_q32 * q32, -v0, -a0, g->j, -vf, af, j2);
    g->ax = larger(l->acc_max_q16 * q16, larger(a0, af));
    g->an = -larger(-l->acc_min_q16 * q16, larger(-a0, -af));
    quad more = 1 + power(-54), unit = last_unit(g);
    g->vx += unit;
    g->vn -= unit;
    g->ax += g->unit;
    g->an -= g->unit;
    g->j *= more;
    g->j2 *= more;
}

/* State in physical units. */
struct state {
    quad p, v, a, j;
};

/* t seconds into a phase of constant jerk. */
static struct state at(const struct state *from, quad t)
{
    return (struct state){
        from->p + t * (from->v + t * (from->a / 2 + t * from->j / 6)),
        from->v + t * (from->a + t * from->j / 2),
        from->a + t * from->j,
        from->j,
    };
}

static const char *judge_state(const struct judge *g,
                               const struct motion_otg_move *move,
                               const struct state *s, int i)
{
    quad j = i < g->plan->brake   ? g->j
             : i >= g->plan->turn ? g->j2
             : g->j < g->j2       ? g->j
                                  : g->j2;
    if (move->limit.jerk_q16 && (s->j > j || s->j < -j))
        return "jerk";
    if (move->limit.acc_max_q16 && (s->a > g->ax || s->a < g->an))
        return "acceleration";
    if (move->mode == MOTION_OTG_POSITION && (s->v > g->vx || s->v < g->vn))
        return "velocity";
    return NULL;
}

/* Both ends, and where the acceleration passes zero. */
static const char *judge_phase(const struct judge *g,
                               const struct motion_otg_move *move, int i,
                               const struct state *from, quad dt)
{
    struct state end = at(from, dt);
    const char *wrong = judge_state(g, move, from, i);
    if (wrong == NULL)
        wrong = judge_state(g, move, &end, i);
    if (wrong == NULL && (from->a > 0) != (end.a > 0) && from->j != 0) {
        struct state turn = at(from, -from->a / from->j);
        wrong = judge_state(g, move, &turn, i);
    }
    return wrong;
}

static bool is_near(quad a, quad b, quad size)
{
    quad off = a - b;
    return (off < 0 ? -off : off) <= size;
}

static const char *judge_end(const struct judge *g,
                             const struct motion_otg_move *m,
                             const struct state *end, const struct state *most)
{
    const quad q32 = power(-32), q16 = power(-16), part = power(-80);
    bool has_v = m->limit.acc_max_q16 != 0, has_a = m->limit.jerk_q16 != 0;
    quad off = last_unit(g), t = (quad)g->plan->dur_ns_q12 * g->h;
    if (has_a && !is_near(end->a, m->goal.acc_q16 * q16, g->unit))
        return "goal acceleration";
    if (has_v && !is_near(end->v, m->goal.vel_q32 * q32, off + most->v * part))
        return "goal velocity";
    if (m->mode == MOTION_OTG_POSITION &&
        !is_near(end->p, m->goal.pos_q32 * q32 - m->start.pos_q32 * q32,
                 off * t + most->p * part))
        return "goal position";
    return NULL;
}

static void note(struct state *most, const struct state *s)
{
    most->p = larger(most->p, s->p < 0 ? -s->p : s->p);
    most->v = larger(most->v, s->v < 0 ? -s->v : s->v);
    most->a = larger(most->a, s->a < 0 ? -s->a : s->a);
}

const char *otg_oracle_judge(const struct motion_otg_move *move,
                             const struct motion_otg_plan *plan)
{
    struct judge g;
    judge_init(&g, move, plan);
    struct state s = { 0, plan->start_vel_q32 * power(-32),
                       plan->start_acc * g.unit, 0 };
    struct state most = { 0, 0, 0, 0 };
    int64_t t = 0;
    if (move->limit.acc_max_q16 && plan->start_vel_q32 != move->start.vel_q32)
        return "start velocity";
    if (move->limit.jerk_q16 &&
        !is_near(s.a, move->start.acc_q16 * power(-16),
                 plan->acc_bits < 16 ? g.unit : 0))
        return "start acceleration";
    note(&most, &s);
    for (int i = 0; i < plan->count; i++) {
        quad dt = (quad)plan->phase[i].dur_ns_q12 * g.h;
        if (plan->phase[i].dur_ns_q12 <= 0)
            return "ticks";
        s.j = (plan->phase[i].acc * g.unit - s.a) / dt;
        const char *wrong = judge_phase(&g, move, i, &s, dt);
        if (wrong)
            return wrong;
        s = at(&s, dt);
        s.a = plan->phase[i].acc * g.unit;
        note(&most, &s);
        most.p = larger(most.p, most.v * dt);
        t += plan->phase[i].dur_ns_q12;
    }
    if (t != plan->dur_ns_q12)
        return "duration";
    if (plan->start_pos_q32 != move->start.pos_q32 ||
        (move->mode == MOTION_OTG_POSITION &&
         plan->goal_pos_q32 != move->goal.pos_q32))
        return "positions";
    return judge_end(&g, move, &s, &most);
}

const char *otg_oracle_judge_track(const struct motion_otg_move *move,
                                   const struct motion_otg_plan *plan)
{
    struct motion_segment room[MOTION_OTG_PHASES];
    struct motion_track track;
    struct motion_continuity step;
    struct motion_extreme v;
    motion_track_init(&track, room, MOTION_OTG_PHASES, move->start.pos_q32);
    int err = motion_otg_append(plan, &track);
    if (err == MOTION_E_RANGE)
        return NULL; /* overshoots what a position can be */
    if (err < 0)
        return motion_err_text(err);
    if (plan->count == 0)
        return NULL;
    if (move->mode == MOTION_OTG_POSITION &&
        (track.end.pos_q32 != move->goal.pos_q32 || track.end_frac != 0))
        return "track's end";
    motion_track_continuity(&track, &step);
    if (step.pos_step_q32 != 0)
        return "track's position steps";
    struct judge g;
    judge_init(&g, move, plan);
    motion_track_extreme(&track, MOTION_VEL, &v);
    quad off = 1 + larger(g.vx, -g.vn) * power(32 - 54);
    if (move->mode == MOTION_OTG_POSITION &&
        (v.max - off > g.vx * power(32) || v.min + off < g.vn * power(32)))
        return "track's velocity";
    return NULL;
}
