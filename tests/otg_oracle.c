/* tests/otg_oracle.c - see otg_oracle.h. */
#include "tests/otg_oracle.h"

#include <stdbool.h>
#include <stddef.h>

#include "motion/err.h"
#include "motion/track.h"

__extension__ typedef __float128 quad;
__extension__ typedef __int128 wide;

struct judge {
    const struct motion_otg_plan *plan;
    quad h, step;        /* tick in s, step in units */
    quad vx, vn, ax, an; /* allowed, in physical units */
    quad j, j2;
    quad e3, e4, e5;
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

static wide whole(struct motion_otg_wide a)
{
    __extension__ unsigned __int128 u = a.hi;
    return (wide)(u << 64 | a.lo);
}

static quad larger(quad a, quad b)
{
    return a > b ? a : b;
}

/* Peak that cannot be avoided: v + a^2/2j.  Braking may miss it by 2^19 ticks'
 * part of the ramp (2^-18 in long moves) and 2^-27 of the speed. */
static quad peak(quad v, quad a, quad j, quad ticks)
{
    if (a <= 0 || j <= 0)
        return v;
    quad miss = larger(power(19) / ticks, power(-18));
    return v + a * a / (2 * j) * (1 + miss) + (v < 0 ? -v : v) * power(-27);
}

/* What start and goal make necessary; the plan's own units carry 2^-55 of
 * rounding of the tick's length. */
static quad highest(quad v0, quad a0, quad j, quad vf, quad af, quad j2,
                    quad ticks)
{
    quad v = larger(peak(v0, a0, j, ticks), peak(vf, -af, j2, ticks));
    return v + (v < 0 ? -v : v) * power(-50);
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
    g->h = power(plan->tick_shift) / ((quad)1000000000 * 4096);
    g->step = power(-plan->pos_shift);
    g->j = l->jerk_q16 * q16;
    g->j2 = j2;
    quad ticks = (quad)plan->dur_ns_q12 + 1;
    g->vx =
        larger(l->vel_max_q32 * q32, highest(v0, a0, g->j, vf, af, j2, ticks));
    g->vn = -larger(-l->vel_min_q32 * q32,
                    highest(-v0, -a0, g->j, -vf, -af, j2, ticks));
    quad more = 1 + power(-50);
    g->ax = larger(l->acc_max_q16 * q16, larger(a0, af) * more);
    g->an = -larger(-l->acc_min_q16 * q16, larger(-a0, -af) * more);
    g->e3 = (quad)whole(plan->bend[0]);
    g->e4 = (quad)whole(plan->bend[1]);
    g->e5 = (quad)whole(plan->bend[2]);
}

/* State in physical units. */
struct state {
    quad p, v, a, j;
};

/* t ticks into a phase that starts at tick t0 with p, v, a in plan units. */
static struct state at(const struct judge *g, quad t0, quad t, quad p, quad v,
                       quad a, quad rate)
{
    quad n = (quad)g->plan->ticks, u = (t0 + t) / n;
    p += 3 * v * t + 3 * a * t * t + rate * t * t * t;
    v += 2 * a * t + rate * t * t;
    a += rate * t;
    p += u * u * u * (g->e3 + u * (g->e4 + u * g->e5));
    v += u * u * (3 * g->e3 + u * (4 * g->e4 + u * 5 * g->e5)) / (3 * n);
    a += u * (6 * g->e3 + u * (12 * g->e4 + u * 20 * g->e5)) / (6 * n * n);
    rate += (g->e3 + u * (4 * g->e4 + u * 10 * g->e5)) / (n * n * n);
    quad h = g->h;
    return (struct state){ p * g->step, 3 * v * g->step / h,
                           6 * a * g->step / (h * h),
                           6 * rate * g->step / (h * h * h) };
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

/* Nine times evenly, and where the acceleration passes zero. */
static const char *judge_phase(const struct judge *g,
                               const struct motion_otg_move *move, int i,
                               quad t0, wide p, wide v, int64_t a)
{
    const struct motion_otg_phase *ph = &g->plan->phase[i];
    quad n = (quad)ph->ticks, rate = (quad)(ph->acc - a) / n;
    for (int k = 0; k <= 9; k++) {
        quad t = k < 9 ? n * k / 8 : 0;
        if (k == 9 && (a > 0) != (ph->acc > 0) && rate != 0)
            t = -(quad)a / rate;
        struct state s = at(g, t0, t, (quad)p, (quad)v, (quad)a, rate);
        const char *wrong = judge_state(g, move, &s, i);
        if (wrong)
            return wrong;
    }
    return NULL;
}

/* The value of a start or goal in plan units, within one unit and 2^-50. */
static bool is_image(quad plan, quad physical)
{
    quad off = plan - physical, size = physical < 0 ? -physical : physical;
    off = off < 0 ? -off : off;
    return off <= 1 + size * power(-50);
}

static const char *judge_ends(const struct judge *g,
                              const struct motion_otg_move *m, wide p, wide v,
                              int64_t a)
{
    const struct motion_otg_plan *plan = g->plan;
    const quad q32 = power(-32), q16 = power(-16);
    quad vel = g->h / (3 * g->step), acc = g->h * g->h / (6 * g->step);
    bool has_v = m->limit.acc_max_q16 != 0, has_a = m->limit.jerk_q16 != 0;
    wide e3 = whole(plan->bend[0]), e4 = whole(plan->bend[1]);
    wide e5 = whole(plan->bend[2]);
    if (has_v &&
        !is_image((quad)whole(plan->start_vel), m->start.vel_q32 * q32 * vel))
        return "start velocity";
    if (has_a && !is_image((quad)plan->start_acc, m->start.acc_q16 * q16 * acc))
        return "start acceleration";
    if (has_a && !is_image((quad)a, m->goal.acc_q16 * q16 * acc))
        return "goal acceleration";
    if (6 * e3 + 12 * e4 + 20 * e5 != 0)
        return "goal acceleration of the quintic";
    quad end = (quad)v;
    if (plan->count)
        end =
            (quad)v + (quad)(3 * e3 + 4 * e4 + 5 * e5) / 3 / (quad)plan->ticks;
    if (has_v && !is_image(end, m->goal.vel_q32 * q32 * vel))
        return "goal velocity";
    if (p + e3 + e4 + e5 != whole(plan->way))
        return "way";
    wide way = (wide)m->goal.pos_q32 - m->start.pos_q32;
    if (m->mode == MOTION_OTG_POSITION &&
        whole(plan->way) != way * ((wide)1 << (plan->pos_shift - 32)))
        return "goal position";
    return NULL;
}

const char *otg_oracle_judge(const struct motion_otg_move *move,
                             const struct motion_otg_plan *plan)
{
    struct judge g;
    judge_init(&g, move, plan);
    wide p = 0, v = whole(plan->start_vel);
    int64_t a = plan->start_acc, t = 0;
    for (int i = 0; i < plan->count; i++) {
        wide n = plan->phase[i].ticks;
        int64_t to = plan->phase[i].acc;
        const char *wrong = judge_phase(&g, move, i, (quad)t, p, v, a);
        if (wrong)
            return wrong;
        if (n <= 0)
            return "ticks";
        p += 3 * v * n + (2 * (wide)a + to) * n * n;
        v += ((wide)a + to) * n;
        a = to;
        t += (int64_t)n;
    }
    if (t != plan->ticks || t << plan->tick_shift != plan->dur_ns_q12)
        return "duration";
    return judge_ends(&g, move, p, v, a);
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
    if (move->mode == MOTION_OTG_POSITION &&
        ((quad)(v.max - 1) > g.vx / power(-32) ||
         (quad)(v.min + 1) < g.vn / power(-32)))
        return "track's velocity";
    return NULL;
}
