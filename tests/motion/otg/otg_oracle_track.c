/* tests/motion/otg/otg_oracle_track.c - is a track the plan it was made from?
 *
 * Read by the definition in motion/core/track.h, in units of 2^-68:
 *
 *   2^36 pos + sum c[k] 2^(36 - frac - k) u^k + 2^36 remainder u
 *
 * `coef` holds 2^k times the coefficient of u^k. */
#include <stddef.h>

#include "motion/core/err.h"
#include "motion/core/track.h"
#include "tests/motion/otg/otg_oracle_parts.h"

#define UNIT_BITS 36 /* of 2^-68 in 2^-32 unit */
#define NS_PER_S  INT64_C(1000000000)

/* A unit of the format or, where that is coarser, of the coefficients of any
 * segment: the next one starts where it ended. */
static unsigned coarse_bits(const struct motion_track *track)
{
    unsigned most = UNIT_BITS;
    for (uint32_t i = 0; i < track->count; i++) {
        unsigned bits = (unsigned)(UNIT_BITS - track->segment[i].frac);
        most = bits > most ? bits : most;
    }
    return most;
}

static void segment_poly(const struct motion_segment *s, struct big_poly *f)
{
    struct big term;
    f->degree = 5;
    for (int k = 0; k <= 5; k++) {
        big_set(&f->c[k], s->coef[k]);
        big_shl(&f->c[k], &f->c[k], (unsigned)(UNIT_BITS - s->frac - k));
    }
    big_set(&term, s->pos_q32);
    big_shl(&term, &term, UNIT_BITS);
    big_add(&f->c[0], &f->c[0], &term);
    big_set(&term, s->frac > 0 ? 0 : s->remainder);
    big_shl(&term, &term, UNIT_BITS);
    big_add(&f->c[1], &f->c[1], &term);
}

static void value_at_end(const struct big_poly *f, struct big *sum)
{
    big_set(sum, 0);
    for (int k = 0; k <= f->degree; k++)
        big_add(sum, sum, &f->c[k]);
}

static bool is_position(const struct big *value, int64_t pos_q32)
{
    struct big pos;
    big_set(&pos, pos_q32);
    big_shl(&pos, &pos, UNIT_BITS);
    return big_cmp(&pos, value) == 0;
}

static int coarser(int a, int b)
{
    int least = a < b ? a : b;
    return least > 0 ? least : 0;
}

/* Both sides of a border at the same 2^-32 of a unit; below that either is cut
 * to its own fraction. */
static bool is_joined(const struct big *end, const struct motion_segment *s)
{
    const struct motion_segment *next = s + 1;
    struct big_poly f;
    struct big pos, gap, most;
    segment_poly(next, &f);
    big_set(&pos, next->pos_q32);
    big_shl(&pos, &pos, UNIT_BITS);
    big_set(&most, 1);
    big_shl(&most, &most, UNIT_BITS);
    big_sub(&gap, end, &pos);
    if (gap.sign < 0 || big_cmp(&gap, &most) >= 0)
        return false;
    big_set(&most, 1);
    big_shl(&most, &most, (unsigned)(UNIT_BITS - coarser(s->frac, next->frac)));
    big_sub(&gap, end, &f.c[0]);
    gap.sign = gap.sign != 0;
    return big_cmp(&gap, &most) < 0;
}

/* |track - plan| <= two units and what the plan may leave, all along the
 * segment; the plan's unit is 2^-32 / unit[POS], so both times that and
 * 2^36. */
static bool is_on_plan(const struct oracle *g, const struct motion_track *made)
{
    struct big_poly plan, track, f;
    struct big start, margin, rest;
    oracle_poly(g, ORACLE_POS, &plan);
    segment_poly(&made->segment[g->i], &track);
    big_set(&start, g->plan->start_pos_q32);
    big_shl(&start, &start, UNIT_BITS);
    big_sub(&track.c[0], &track.c[0], &start);
    big_shl(&margin, &g->unit[ORACLE_POS], 1 + coarse_bits(made));
    oracle_trim(g, &rest);
    big_mul_int(&rest, &rest, 3);
    big_mul_int(&rest, &rest, g->plan->dur_ns_q12);
    big_shl(&rest, &rest, UNIT_BITS);
    big_add(&margin, &margin, &rest);
    for (int side = -1; side <= 1; side += 2) {
        f.degree = 5;
        for (int k = 0; k <= 5; k++) {
            struct big have;
            big_mul(&have, &track.c[k], &g->unit[ORACLE_POS]);
            big_set(&f.c[k], 0);
            if (k <= plan.degree)
                big_shl(&f.c[k], &plan.c[k], UNIT_BITS);
            big_sub(&f.c[k], &f.c[k], &have);
            f.c[k].sign *= side;
        }
        big_add(&f.c[0], &f.c[0], &margin);
        if (!big_poly_is_not_negative(&f))
            return false;
    }
    return true;
}

/* v = f' 2^-68 / dur, dur in 2^-12 / 10^9 s: f' 10^9 <= v_q32 dur 2^24, both
 * times the bound's denominator.  Half a unit in every coefficient, and the
 * last that takes the residue of all, make six of the slope: all that a
 * segment can show. */
static bool is_in_limits(const struct oracle *g, const struct motion_segment *s)
{
    struct big_poly pos, f;
    struct oracle_bound bound;
    struct big most, margin;
    segment_poly(s, &pos);
    for (int up = 0; up < 2; up++) {
        oracle_vel_bound(g, up, &bound);
        big_mul_int(&most, &bound.num, s->dur_ns_q12);
        big_shl(&most, &most, 24);
        big_mul_int(&margin, &bound.den, (up ? 6 : -6) * NS_PER_S);
        big_shl(&margin, &margin, (unsigned)(UNIT_BITS - s->frac));
        big_add(&most, &most, &margin);
        f.degree = 4;
        for (int k = 0; k <= 4; k++) {
            big_mul_int(&f.c[k], &pos.c[k + 1], -(k + 1) * NS_PER_S);
            big_mul(&f.c[k], &f.c[k], &bound.den);
        }
        big_add(&f.c[0], &f.c[0], &most);
        for (int k = 0; up == 0 && k <= 4; k++)
            f.c[k].sign = -f.c[k].sign;
        if (!big_poly_is_not_negative(&f))
            return false;
    }
    return true;
}

static const char *judge_segment(const struct oracle *g,
                                 const struct motion_track *track)
{
    const struct motion_segment *s = &track->segment[g->i];
    struct big_poly f;
    struct big end;
    bool last = g->i + 1 == g->plan->count;
    segment_poly(s, &f);
    value_at_end(&f, &end);
    if (s->dur_ns_q12 != g->n || s->start_ns_q12 != g->t0)
        return "track's time";
    if (g->i == 0 && !is_position(&f.c[0], g->move->start.pos_q32))
        return "track's start";
    if (last && g->move->mode == MOTION_OTG_POSITION &&
        !is_position(&end, g->plan->goal_pos_q32))
        return "track's end";
    if (!last && !is_joined(&end, s))
        return "track's gap";
    if (!is_on_plan(g, track))
        return "track's displacement";
    if (g->move->mode == MOTION_OTG_POSITION && !is_in_limits(g, s))
        return "track's velocity";
    return NULL;
}

const char *otg_oracle_judge_track(const struct motion_otg_move *move,
                                   const struct motion_otg_plan *plan)
{
    static struct oracle g;
    struct motion_segment segment[MOTION_OTG_PHASES];
    struct motion_track track;
    const char *wrong = NULL;
    motion_track_init(&track, segment, MOTION_OTG_PHASES, move->start.pos_q32);
    int err = motion_otg_append(plan, &track);
    if (err == MOTION_E_RANGE)
        return NULL; /* overshoots what a position can be */
    if (err < 0)
        return motion_err_text(err);
    if (plan->count == 0)
        return NULL;
    if (track.count != (uint32_t)plan->count ||
        track.end_ns_q12 != plan->dur_ns_q12)
        return "track's time";
    for (oracle_init(&g, move, plan); wrong == NULL && g.i < plan->count;
         oracle_step(&g)) {
        oracle_phase(&g);
        wrong = judge_segment(&g, &track);
    }
    return wrong;
}
