/* tests/motion/otg/otg_many_far.c - is a move out of the formats?  See
 * otg_many.h.
 *
 * From an end of the move look in one direction, "up": the motion that goes up
 * as fast as it can, from the start or backwards in time from the goal, is
 * above every other one.  So is what both ends together allow: up with the
 * limits of one, down with those of the other.  A goal above the lowest of
 * these in all times up to three days is too far; it may have been below in the
 * beginning, when it is passed too early for the change of speed and
 * acceleration, before a given duration, or between two ticks: looked at in
 * both, a move that has no time to slow down passes its goal in a window that
 * need not hold a whole one. */
#include <math.h>
#include <stdbool.h>

#include "tests/motion/otg/otg_many.h"

#define TICKS_PER_S 4096e9L
#define MOST_S      (0x1p60L / TICKS_PER_S * (1 - 1e-6L))
#define ALL_S       0x1p60L
#define FIRST_S     1e-16L
#define STEP        1.02L
#define HALVINGS    70
#define MARGIN      0x1p-50L      /* of a time that was found */
#define FORMAT_MOST 2147483646.0L /* units */

/* An end, turned so that up is where is looked. */
struct far_end {
    long double v, a, top, up, down;  /* limits; down > 0 */
    long double jerk, brake, release; /* when it rises, brakes, ramps to zero */
    bool is_fine;                     /* look closely */
};

static long double q32(int64_t value)
{
    return ldexpl((long double)value, -32);
}

static long double larger(long double a, long double b)
{
    return a > b ? a : b;
}

static long double smaller(long double a, long double b)
{
    return a < b ? a : b;
}

/* --- one end -------------------------------------------------------------- */

struct far_walk {
    long double v, a, p, left;
};

static void walk(struct far_walk *w, long double t, long double j)
{
    t = smaller(larger(t, 0), w->left);
    w->p += t * (w->v + t * (w->a / 2 + t * j / 6));
    w->v += t * (w->a + t * j / 2);
    w->a += t * j;
    w->left -= t;
}

/* Being, or bound to come, above the top: it has to brake until it is there. */
static bool is_above(const struct far_end *e)
{
    if (e->a <= 0 || e->brake <= 0)
        return e->v > e->top && e->a >= 0;
    return e->v + e->a * e->a / (2 * e->brake) > e->top;
}

static void walk_brake(const struct far_end *e, struct far_walk *w)
{
    if (e->brake > 0) {
        long double square = w->a * w->a + 2 * e->brake * (w->v - e->top);
        long double to_top = (sqrtl(larger(square, 0)) + w->a) / e->brake;
        walk(w, smaller(to_top, (w->a + e->down) / e->brake), -e->brake);
    }
    if (e->down > 0)
        walk(w, (w->v - e->top) / e->down, 0);
}

/* Up to a peak of acceleration, hold it, and ramp to zero at the top. */
static void walk_rise(const struct far_end *e, struct far_walk *w)
{
    if (e->up <= 0)
        return; /* no limit of acceleration */
    if (e->jerk <= 0) {
        w->a = e->up;
        walk(w, (e->top - w->v) / w->a, 0);
        return;
    }
    walk(w, (w->a - e->up) / e->brake, -e->brake); /* beyond its limit */
    long double rise = e->top - w->v + w->a * w->a / (2 * e->jerk);
    long double ramps = (1 / e->jerk + 1 / e->release) / 2;
    long double most = larger(e->up, w->a), peak = most;
    if (rise < peak * peak * ramps)
        peak = sqrtl(larger(rise, 0) / ramps);
    walk(w, (peak - w->a) / e->jerk, e->jerk);
    if (peak == most)
        walk(w, rise / most - most * ramps, 0);
    walk(w, w->a / e->release, -e->release);
}

/* Leaves what is left of t at the top speed. */
static struct far_walk walked(const struct far_end *e, long double t)
{
    struct far_walk w = { e->v, e->a, 0, t };
    if (is_above(e)) {
        w.a = e->brake > 0 ? e->a : -e->down;
        walk_brake(e, &w);
    } else {
        walk_rise(e, &w);
    }
    return w;
}

/* --- a move --------------------------------------------------------------- */

static struct far_end end_of(const struct motion_otg_move *m, bool goal, int up)
{
    const struct motion_otg_limit *l = &m->limit;
    const struct motion_state *s = goal ? &m->goal : &m->start;
    long double j = q32(l->jerk_q32), jd = q32(l->jerk_down_q32);
    bool ax = goal == (up < 0); /* backwards in time a turns its sign */
    struct far_end e = {
        .v = up * q32(s->vel_q32),
        .a = (goal ? -up : up) * q32(s->acc_q32),
        .top = up > 0 ? q32(l->vel_max_q32) : -q32(l->vel_min_q32),
        .up = ax ? q32(l->acc_max_q32) : -q32(l->acc_min_q32),
        .down = ax ? -q32(l->acc_min_q32) : q32(l->acc_max_q32),
        .jerk = larger(j, jd),
        .brake = goal && jd > 0 ? jd : j,
        .release = larger(j, jd),
    };
    long double bottom = up > 0 ? q32(l->vel_min_q32) : -q32(l->vel_max_q32);
    if (j == 0)
        e.a = 0;
    if (e.up <= 0)
        e.v = 0;
    if (e.a < 0 && e.v - e.a * e.a / (2 * e.brake) < bottom)
        e.jerk = e.brake; /* bound to come out below: that is braking */
    return e;
}

/* The speeds of both ends and acceleration alone: up with one's limit, down
 * with the other's.  Nothing, in less than the change of speed takes. */
static long double covers(const struct far_end end[2], long double t)
{
    long double us = larger(end[0].up, end[0].a);
    long double ug = larger(end[1].up, end[1].a);
    long double s = (end[1].v - end[0].v + ug * t) / (us + ug), g = t - s;
    if (s < 0 || g < 0)
        return -HUGE_VALL;
    return s * (end[0].v + us * s / 2) + g * (end[1].v + ug * g / 2);
}

/* The speed in which an end comes to rest of its acceleration. */
static long double natural(const struct far_end *e)
{
    if (e->a <= 0)
        return e->v - e->a * e->a / (2 * e->jerk);
    long double in = smaller(e->a, e->up);
    return e->v + in * in / (2 * e->release) +
           (e->a * e->a - in * in) / (2 * e->brake);
}

/* Up to the speed in which both ends meet after t, and no further: what is most
 * up where neither comes to the top.  Nothing, where they do not meet so. */
static long double meets(const struct far_end end[2], long double t)
{
    struct far_end s = end[0], g = end[1];
    struct far_walk ws, wg;
    if (s.jerk <= 0 || is_above(&s) || is_above(&g))
        return HUGE_VALL;
    long double low = larger(natural(&s), natural(&g)), high = s.top;
    s.top = g.top = low;
    if (low >= high || walked(&s, t).left + walked(&g, t).left < t)
        return HUGE_VALL;
    for (int i = 0; i < HALVINGS; i++) {
        s.top = g.top = (low + high) / 2;
        ws = walked(&s, t);
        wg = walked(&g, t);
        if (ws.left + wg.left > t)
            low = s.top;
        else
            high = s.top;
    }
    s.top = g.top = low;
    ws = walked(&s, t);
    wg = walked(&g, t);
    long double sum = ws.p + wg.p + high * (ws.left + wg.left - t);
    return sum + MARGIN * (fabsl(ws.p) + fabsl(wg.p));
}

/* No motion from one end to the other is further up after t. */
static long double most_up(const struct far_end end[2], long double t)
{
    struct far_walk s = walked(&end[0], t), g = walked(&end[1], t);
    long double top = end[0].top, most;
    s.p += top * s.left;
    g.p += top * g.left;
    most = smaller(s.p, g.p);
    if (s.left + g.left > t) /* both are at the top in between */
        most = smaller(most, s.p + g.p - top * t);
    else if (end[0].is_fine)
        most = smaller(most, meets(end, t));
    if (end[0].up > 0)
        most = smaller(most, covers(end, t));
    return most;
}

/* No change of speed or acceleration from one end to the other in t or less:
 * what is there is less than limits allow, or no motion comes up to the other's
 * speed, as the fastest one first falls, then rises: from the moment at which
 * the acceleration can be the other's until t it is below. */
static bool is_too_early(const struct far_end *e, const struct far_end *other,
                         long double t)
{
    long double change = fabsl(other->v - e->v);
    if (e->up > 0 && change > larger(e->up, e->down) * t)
        return true;
    if (e->release <= 0)
        return false;
    long double first = (-other->a - e->a) / e->release;
    return fabsl(e->a + other->a) > e->release * t ||
           (walked(e, larger(first, 0)).v < other->v &&
            walked(e, t).v < other->v);
}

/* When the goal may be reached, in s: not before `from` nor after `to`. */
struct window {
    long double from, to;
};

/* No whole tick is in it. */
static bool window_is_empty(const struct window *w)
{
    return w->to < w->from ||
           floorl(w->to * TICKS_PER_S) < ceill(w->from * TICKS_PER_S);
}

static bool is_above_goal(const struct far_end end[2], long double d,
                          long double t)
{
    return most_up(end, t) >= d;
}

/* Between t and t STEP, where the one changes into the other. */
static long double edge(const struct far_end end[2], long double d,
                        long double t)
{
    long double low = t, high = t * STEP;
    bool at_low = is_above_goal(end, d, t);
    for (int i = 0; i < HALVINGS; i++) {
        long double middle = (low + high) / 2;
        if (is_above_goal(end, d, middle) == at_low)
            low = middle;
        else
            high = middle;
    }
    return at_low ? high * (1 + MARGIN) : low * (1 - MARGIN);
}

static void window_narrow(const struct motion_otg_move *m, int up, bool is_fine,
                          struct window *w)
{
    struct far_end end[2] = { end_of(m, false, up), end_of(m, true, up) };
    long double d = up * (q32(m->goal.pos_q32) - q32(m->start.pos_q32));
    long double from = larger(w->from, FIRST_S), to = w->to;
    long double first = -1, last = -1;
    end[0].is_fine = end[1].is_fine = is_fine;
    for (long double t = from; t < to; t *= STEP)
        if (is_above_goal(end, d, t)) {
            first = first < 0 ? t : first;
            last = t;
        }
    bool is_late = !is_above_goal(end, d, to);
    if (first > from)
        w->from = edge(end, d, first / STEP);
    else if (first < 0 && !is_late)
        w->from = edge(end, d, to / STEP);
    if (is_late && last > 0)
        w->to = smaller(to, edge(end, d, last));
    if (is_late && (last < 0 || is_too_early(&end[0], &end[1], last * STEP) ||
                    is_too_early(&end[1], &end[0], last * STEP)))
        w->to = -1;
}

static struct window window_of(const struct motion_otg_move *m)
{
    struct window w = { (long double)m->dur_ns_q12 / TICKS_PER_S, MOST_S };
    for (int fine = 0; fine < 2; fine++)
        for (int up = 1; up >= -1; up -= 2)
            if (!window_is_empty(&w))
                window_narrow(m, up, fine, &w);
    return w;
}

/* --- where a change of speed ends ----------------------------------------- */

/* From w to speed v and acceleration a in the least time, |acc| up to the
 * limits: up to a peak of it, hold, and back, or the same downwards. */
static void walk_change(struct far_walk *w, long double v, long double a,
                        const struct far_end *e, long double j)
{
    long double dv = v - w->v, ends = (w->a * w->a + a * a) / 2;
    long double direct = (a * a - w->a * w->a) / (2 * j);
    int up = dv >= (a < w->a ? -direct : direct) ? 1 : -1;
    long double limit = up > 0 ? e->up : e->down;
    long double square = up * dv * j + ends, hold = 0;
    long double peak = square > 0 ? sqrtl(square) : 0;
    if (peak > limit) {
        hold = (square - limit * limit) / (limit * j);
        peak = limit;
    }
    walk(w, fabsl(up * peak - w->a) / j, up * peak < w->a ? -j : j);
    walk(w, hold, 0);
    walk(w, fabsl(a - up * peak) / j, a < up * peak ? -j : j);
}

/* To a velocity goal; with another jerk behind the highest speed. */
static struct far_walk changed(const struct motion_otg_move *m, int up)
{
    const struct far_end s = end_of(m, false, up), g = end_of(m, true, up);
    long double j = q32(m->limit.jerk_q32), jd = q32(m->limit.jerk_down_q32);
    struct far_walk w = { s.v, s.a, 0, ALL_S };
    if (s.up <= 0)
        return w;
    if (j == 0) {
        w.a = g.v > s.v ? s.up : -s.down;
        walk(&w, (g.v - s.v) / w.a, 0);
        return w;
    }
    long double peak = fabsl(s.v + s.a * fabsl(s.a) / (2 * j));
    if (jd > 0 && peak > fabsl(s.v) && peak > fabsl(g.v))
        walk(&w, fabsl(s.a) / j, s.a > 0 ? -j : j);
    if (jd > 0 && fabsl(g.v) < fabsl(w.v))
        j = jd;
    walk(&w, (w.a - s.up) / j, -j);
    walk(&w, (-s.down - w.a) / j, j);
    walk_change(&w, g.v, -g.a, &s, j);
    return w;
}

static bool is_there(const struct motion_otg_move *m)
{
    return m->start.pos_q32 == m->goal.pos_q32 &&
           m->start.vel_q32 == m->goal.vel_q32 &&
           m->start.acc_q32 == m->goal.acc_q32;
}

static bool is_velocity_far(const struct motion_otg_move *m, int up)
{
    struct far_walk w = changed(m, up);
    return up * q32(m->start.pos_q32) + w.p > FORMAT_MOST ||
           ALL_S - w.left > MOST_S;
}

bool many_is_far(const struct motion_otg_move *move)
{
    bool to_velocity = move->mode == MOTION_OTG_VELOCITY;
    if (move->dur_ns_q12 >> 60 != 0)
        return true;
    if (to_velocity)
        return is_velocity_far(move, 1) || is_velocity_far(move, -1);
    struct window w = window_of(move);
    return !is_there(move) && window_is_empty(&w);
}

bool many_are_far(const struct motion_otg_move move[], int axes)
{
    struct window all = { 0, MOST_S };
    for (int i = 0; i < axes; i++) {
        struct window w = window_of(&move[i]);
        all.from = larger(all.from, w.from);
        all.to = smaller(all.to, w.to);
    }
    return window_is_empty(&all);
}

/* --- on a line ------------------------------------------------------------ */

/* value / r, further from zero. */
static int64_t over(int64_t value, long double r)
{
    long double most = (long double)value / r * (1 + MARGIN);
    most = most < 0 ? floorl(most) : ceill(most);
    return fabsl(most) < 0x1p62L ? (int64_t)most
           : most < 0            ? -((int64_t)1 << 62)
                                 : (int64_t)1 << 62;
}

static int64_t lower(int64_t a, int64_t b)
{
    return a < b ? a : b;
}

/* Upwards the lower of both. */
static void narrow(int64_t *most, int64_t *least, int64_t up, int64_t down,
                   long double r)
{
    *most = lower(*most, over(r > 0 ? up : down, r));
    *least = -lower(-*least, -over(r > 0 ? down : up, r));
}

bool many_is_line_far(const struct motion_otg_move move[], int axes)
{
    struct motion_otg_move lead = move[0];
    for (int i = 1; i < axes; i++) {
        const struct motion_otg_limit *l = &move[i].limit;
        long double d = q32(move[i].goal.pos_q32 - move[i].start.pos_q32);
        long double r = d / q32(lead.goal.pos_q32 - lead.start.pos_q32);
        if (d == 0)
            continue;
        narrow(&lead.limit.vel_max_q32, &lead.limit.vel_min_q32, l->vel_max_q32,
               l->vel_min_q32, r);
        narrow(&lead.limit.acc_max_q32, &lead.limit.acc_min_q32, l->acc_max_q32,
               l->acc_min_q32, r);
        /* the higher of two jerks bounds both */
        int64_t own =
            l->jerk_q32 > l->jerk_down_q32 ? l->jerk_q32 : l->jerk_down_q32;
        int64_t lead_jerk = lead.limit.jerk_q32 > lead.limit.jerk_down_q32
                                ? lead.limit.jerk_q32
                                : lead.limit.jerk_down_q32;
        lead.limit.jerk_q32 = lower(lead_jerk, over(own, fabsl(r)));
        lead.limit.jerk_down_q32 = 0;
    }
    return many_is_far(&lead);
}
