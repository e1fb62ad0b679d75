/* tests/motion/otg/otg_many.c - drawing problems; see otg_many.h. */
#include "tests/motion/otg/otg_many.h"

#include <math.h>
#include <stdbool.h>

#include "tests/support/check.h"

const char *many_kind_text(enum many_kind kind)
{
    static const char *const text[MANY_KINDS] = {
#define MANY_KIND_TEXT(name, sentence) [name] = sentence,
        MANY_KIND_LIST(MANY_KIND_TEXT)
#undef MANY_KIND_TEXT
    };
    return text[kind];
}

/* --- numbers -------------------------------------------------------------- */

static int pick(uint64_t *seed, int low, int high)
{
    return (int)check_random_in(seed, low, high);
}

static int bits_of(int64_t value)
{
    int bits = 0;
    for (uint64_t v = (uint64_t)(value < 0 ? -value : value); v; v >>= 1)
        bits++;
    return bits;
}

/* 2^bits and more, below 2^(bits + 1). */
static int64_t of_bits(uint64_t *seed, int bits)
{
    return (int64_t)((check_random(seed) | (uint64_t)1 << 63) >> (63 - bits));
}

/* About 2^bits, from 2^least on and within what a format holds. */
static int64_t about_from(uint64_t *seed, int least, int bits, int spread)
{
    int low = bits - spread, high = bits + spread;
    low = low < least ? least : low > 60 ? 60 : low;
    high = high < low ? low : high > 60 ? 60 : high;
    return of_bits(seed, pick(seed, low, high));
}

/* A velocity. */
static int64_t about(uint64_t *seed, int bits, int spread)
{
    return about_from(seed, 4, bits, spread);
}

/* An acceleration or a jerk: with less moves take months. */
static int64_t about_rate(uint64_t *seed, int bits, int spread)
{
    return about_from(seed, 20, bits, spread);
}

/* A limit, zero, or anything between. */
static int64_t between(uint64_t *seed, int64_t low, int64_t high)
{
    switch (pick(seed, 0, 9)) {
    case 0:
        return low;
    case 1:
        return high;
    case 2:
    case 3:
        return 0;
    default:
        return check_random_in(seed, low, high);
    }
}

static int64_t signed_by(uint64_t *seed, int64_t size)
{
    return check_random(seed) & 1 ? -size : size;
}

/* --- limits --------------------------------------------------------------- */

/* Powers of two of a move: its length in 2^-32 unit, its time in s. */
struct measure {
    int length, time;
};

static void draw_limits(uint64_t *seed, struct measure at, int spread,
                        struct motion_otg_limit *l)
{
    l->vel_max_q32 = about(seed, at.length - at.time, spread);
    int vel = bits_of(l->vel_max_q32) - 1;
    l->acc_max_q32 = about_rate(seed, vel - at.time, spread);
    int acc = bits_of(l->acc_max_q32) - 1;
    l->jerk_q32 = about_rate(seed, acc - at.time, spread);
    l->vel_min_q32 = -l->vel_max_q32;
    l->acc_min_q32 = -l->acc_max_q32;
}

static void draw_asymmetry(uint64_t *seed, struct motion_otg_limit *l)
{
    l->vel_min_q32 = -about(seed, bits_of(l->vel_max_q32) - 1, 4);
    l->acc_min_q32 = -about_rate(seed, bits_of(l->acc_max_q32) - 1, 4);
}

/* --- states --------------------------------------------------------------- */

static void draw_state(uint64_t *seed, const struct motion_otg_limit *l,
                       struct motion_state *s)
{
    s->vel_q32 = between(seed, l->vel_min_q32, l->vel_max_q32);
    s->acc_q32 = between(seed, l->acc_min_q32, l->acc_max_q32);
}

/* a^2 / 2j in 2^-32 unit/s. */
static long double ramp_of(int64_t acc_q32, int64_t jerk_q32)
{
    long double a = (long double)acc_q32;
    return jerk_q32 > 0 ? ldexpl(a * a / (long double)jerk_q32, -1) : 0;
}

/* Draw a goal until one can have been reached; at rest if that takes long. */
static void draw_goal(uint64_t *seed, struct motion_otg_move *m)
{
    const struct motion_otg_limit *l = &m->limit;
    int64_t j = l->jerk_down_q32 ? l->jerk_down_q32 : l->jerk_q32;
    for (int i = 0; i < 20; i++) {
        draw_state(seed, l, &m->goal);
        long double ramp = ramp_of(m->goal.acc_q32, j);
        long double v = (long double)m->goal.vel_q32;
        if (!(m->goal.acc_q32 < 0 && v + ramp > (long double)l->vel_max_q32) &&
            !(m->goal.acc_q32 > 0 && v - ramp < (long double)l->vel_min_q32))
            return;
    }
    m->goal.vel_q32 = m->goal.acc_q32 = 0;
}

/* Up to five times as much. */
static int64_t draw_more(uint64_t *seed, int64_t value, int more)
{
    int64_t times = (int64_t)pick(seed, 0, 1) << more;
    return bits_of(value) < 60 ? value + value * times : value;
}

static void draw_outside(uint64_t *seed, struct motion_otg_move *m)
{
    int more = pick(seed, 0, 2);
    draw_state(seed, &m->limit, &m->start);
    m->start.vel_q32 = draw_more(seed, m->start.vel_q32, more);
    m->start.acc_q32 = draw_more(seed, m->start.acc_q32, more);
}

/* v0 + a0^2 / 2j = vmax to the last bit: a = 2^i k, j = 2^(i' ) divides a^2. */
static void draw_tie(uint64_t *seed, struct motion_otg_move *m)
{
    struct motion_otg_limit *l = &m->limit;
    int jerk = bits_of(l->jerk_q32) - 1, acc = bits_of(l->acc_max_q32) - 2;
    acc = acc < 4 ? 4 : acc;
    l->jerk_q32 = (int64_t)1 << jerk;
    int64_t a = of_bits(seed, pick(seed, 2, acc < 20 ? acc : 20));
    int up = acc - bits_of(a), to = 2 * up - 1 - jerk;
    if (up < 0 || to < 0 || to + 2 * bits_of(a) > 61)
        return; /* the ramp is no whole number, or none that fits */
    int64_t ramp = (a * a) << to;
    m->start.acc_q32 = a << up;
    if (l->acc_max_q32 < m->start.acc_q32)
        l->acc_max_q32 = m->start.acc_q32;
    m->start.vel_q32 = l->vel_max_q32 - ramp;
    if (check_random(seed) & 1) {
        l->vel_min_q32 = -l->vel_max_q32;
        l->acc_min_q32 = -l->acc_max_q32;
        m->start.vel_q32 = -m->start.vel_q32;
        m->start.acc_q32 = -m->start.acc_q32;
    }
}

static void draw_on_limit(uint64_t *seed, struct motion_otg_move *m)
{
    const struct motion_otg_limit *l = &m->limit;
    int64_t vel[] = { l->vel_min_q32, 0, l->vel_max_q32 };
    int64_t acc[] = { l->acc_min_q32, 0, l->acc_max_q32 };
    m->start.vel_q32 = vel[pick(seed, 0, 2)];
    m->start.acc_q32 = acc[pick(seed, 0, 2)];
    draw_goal(seed, m);
    if (pick(seed, 0, 1)) {
        m->goal.vel_q32 = vel[pick(seed, 0, 2)];
        m->goal.acc_q32 = 0;
    }
}

/* Whole units, and simple limits. */
static void draw_round(uint64_t *seed, struct motion_otg_move *m)
{
    struct motion_otg_limit *l = &m->limit;
    int up = pick(seed, 0, 20);
    int64_t q32 = (int64_t)1 << (22 + up);
    l->vel_max_q32 = q32 * pick(seed, 1, 8);
    l->acc_max_q32 = q32 * pick(seed, 1, 8);
    l->jerk_q32 = q32 * pick(seed, 1, 8);
    l->vel_min_q32 = -l->vel_max_q32;
    l->acc_min_q32 = -l->acc_max_q32;
    m->start = (struct motion_state){ 0 };
    m->goal = (struct motion_state){ .pos_q32 = q32 * pick(seed, -20, 20) };
    if (pick(seed, 0, 1))
        return;
    m->start.vel_q32 = q32 * pick(seed, -1, 1);
    m->start.acc_q32 = q32 * pick(seed, -1, 1);
    m->goal.vel_q32 = q32 * pick(seed, -1, 1);
}

/* --- one move ------------------------------------------------------------- */

static void draw_base(uint64_t *seed, enum many_kind kind, struct measure at,
                      struct motion_otg_move *m)
{
    *m = (struct motion_otg_move){ .mode = MOTION_OTG_POSITION };
    draw_limits(seed, at, kind == MANY_RATIO ? 12 : 6, &m->limit);
    m->start.pos_q32 =
        pick(seed, -1, 1) * of_bits(seed, pick(seed, 0, at.length));
    m->goal.pos_q32 =
        pick(seed, -1, 1) * of_bits(seed, pick(seed, 0, at.length));
    if (kind == MANY_ASYMMETRIC || pick(seed, 0, 2) == 0)
        draw_asymmetry(seed, &m->limit);
    if (kind == MANY_JERK_DOWN || pick(seed, 0, 9) == 0)
        m->limit.jerk_down_q32 =
            about_rate(seed, bits_of(m->limit.jerk_q32), 6);
    if (kind == MANY_REST)
        return;
    draw_state(seed, &m->limit, &m->start);
    if (kind != MANY_MOVING)
        draw_goal(seed, m);
}

static void draw_tiny(uint64_t *seed, struct motion_otg_move *m)
{
    m->goal.pos_q32 =
        m->start.pos_q32 + signed_by(seed, of_bits(seed, pick(seed, 0, 20)));
    if (pick(seed, 0, 1))
        m->start.vel_q32 = m->start.acc_q32 = 0;
    if (pick(seed, 0, 1))
        m->goal.vel_q32 = m->goal.acc_q32 = 0;
}

static void draw_equal(uint64_t *seed, struct motion_otg_move *m)
{
    m->start.vel_q32 = m->goal.vel_q32;
    m->start.acc_q32 = m->goal.acc_q32;
    if (pick(seed, 0, 3))
        m->start.pos_q32 = m->goal.pos_q32;
}

static void draw_move(uint64_t *seed, enum many_kind kind, struct measure at,
                      struct motion_otg_move *m)
{
    draw_base(seed, kind, at, m);
    switch (kind) {
    case MANY_OUTSIDE:
        draw_outside(seed, m);
        break;
    case MANY_TINY:
        draw_tiny(seed, m);
        break;
    case MANY_LONG:
        m->goal.pos_q32 =
            signed_by(seed, of_bits(seed, pick(seed, at.length, 61)));
        break;
    case MANY_ROUND:
        draw_round(seed, m);
        break;
    case MANY_ON_LIMIT:
        draw_on_limit(seed, m);
        break;
    case MANY_TIE:
        draw_tie(seed, m);
        draw_goal(seed, m);
        break;
    case MANY_ZERO:
        m->goal.pos_q32 = m->start.pos_q32;
        break;
    case MANY_EQUAL:
        draw_equal(seed, m);
        break;
    case MANY_VELOCITY:
        m->mode = MOTION_OTG_VELOCITY;
        break;
    case MANY_NO_ACC:
        m->limit.acc_max_q32 = m->limit.acc_min_q32 = 0;
        m->limit.jerk_q32 = m->limit.jerk_down_q32 = 0;
        break;
    case MANY_NO_JERK:
        m->limit.jerk_q32 = m->limit.jerk_down_q32 = 0;
        break;
    default:
        break;
    }
}

/* Every axis as the first, times a power of two or so. */
static void draw_line(uint64_t *seed, struct many_problem *p)
{
    struct motion_otg_move *lead = &p->move[0];
    lead->start.vel_q32 = lead->start.acc_q32 = 0;
    lead->goal.vel_q32 = lead->goal.acc_q32 = 0;
    for (int i = 1; i < p->axes; i++) {
        p->move[i].start = (struct motion_state){ 0 };
        p->move[i].start.pos_q32 = of_bits(seed, 20);
        p->move[i].goal = p->move[i].start;
        p->move[i].goal.pos_q32 +=
            (lead->goal.pos_q32 - lead->start.pos_q32) / 8 * pick(seed, -8, 8);
    }
}

static bool has_axes(enum many_kind kind)
{
    return kind == MANY_SYNC || kind == MANY_STRAIGHT || kind == MANY_THROUGH;
}

/* splitmix64 of both, so that neighbours have nothing in common. */
static uint64_t seed_of(uint64_t seed, uint64_t number)
{
    uint64_t z = seed + (number + 1) * UINT64_C(0x9E3779B97F4A7C15);
    z = (z ^ z >> 30) * UINT64_C(0xBF58476D1CE4E5B9);
    z = (z ^ z >> 27) * UINT64_C(0x94D049BB133111EB);
    z ^= z >> 31;
    return z ? z : 1;
}

void many_draw(uint64_t seed, uint64_t number, struct many_problem *p)
{
    uint64_t at = seed_of(seed, number);
    struct measure size = { .length = pick(&at, 20, 60) };
    size.time = pick(&at, -20, 20);
    *p = (struct many_problem){ .kind = (enum many_kind)(number % MANY_KINDS),
                                .axes = 1 };
    if (has_axes(p->kind))
        p->axes = pick(&at, 2, MANY_AXES);
    for (int i = 0; i < p->axes; i++)
        draw_move(&at, p->kind, size, &p->move[i]);
    if (p->kind == MANY_STRAIGHT)
        draw_line(&at, p);
    draw_move(&at, MANY_FULL, size, &p->later);
    if (pick(&at, 0, 1))
        p->later.limit = p->move[0].limit;
    draw_goal(&at, &p->later);
    p->share_q32 = (uint32_t)check_random(&at);
}
