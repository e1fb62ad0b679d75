/* motion/curve/fcurve_bezier_bake.c - a bezier span as quintics.  See
 * fcurve_internal.h.
 *
 * Segments are cut by u, of which a point of the curve follows at once; u is
 * then moved to the nearest whole tick of time by a step of Newton's method.
 * How far a segment is from the curve is known before it is made, so each is as
 * long as the tolerance allows.  Plan-time. */
#include "motion/core/err.h"
#include "motion/core/fixed.h"
#include "motion/curve/fcurve_internal.h"

#define BEZIER_SHORTEST (1000 * MOTION_FIXED_NS_Q12)

/* Changes of length, as logarithms to base 2 in Q16. */
#define BEZIER_LONGER  ((int64_t)131072) /* 4: at most */
#define BEZIER_SHORTER ((int64_t)-9962)  /* 0.9: at least, if it failed */
#define BEZIER_HALF    ((int64_t)-65536)
#define BEZIER_LEAST   ((int64_t)-196608) /* 1/8 */

/* --- places ---------------------------------------------------------------- */

/* A time that is u from the span's start, or `late`: from its end. */
struct bezier_place {
    bool late;
    struct motion_real u;
    int64_t t;
    struct motion_bake_point point;
};

struct bezier_bake {
    struct motion_track *track;
    const struct fcurve_piece *piece;
    const struct motion_bake_bound *within;
    struct motion_bake_bound *bound;
    struct fcurve_bezier leg[2]; /* in the order of time, and from the end */
    struct motion_real base[2];  /* the values where these begin */
    struct motion_real per_s;    /* 1 / the span's duration */
    int64_t dur;
};

static struct fcurve_bezier bezier_leg(const struct fcurve_piece *piece,
                                       bool late)
{
    const bool back = late != piece->is_back;
    struct fcurve_bezier leg = fcurve_bezier(piece->key, piece->key + 1, back);

    if (back) { /* from how much is missing to how much there is */
        leg.y.c1 = motion_real_neg(leg.y.c1);
        leg.y.c2 = motion_real_neg(leg.y.c2);
        leg.y.c3 = motion_real_neg(leg.y.c3);
    }
    return leg;
}

static struct motion_real bezier_u(const struct bezier_place *place, bool late)
{
    return place->late == late ? place->u
                               : motion_real_sub(fcurve_whole(1), place->u);
}

/* Which part of the span's duration lies between its end and t. */
static struct motion_real bezier_x(const struct bezier_bake *bake,
                                   const struct bezier_place *place)
{
    const int64_t past = place->t - bake->piece->span;

    return motion_real_div(fcurve_whole(place->late ? bake->dur - past : past),
                           fcurve_whole(bake->dur));
}

/* Its u, from one nearby. */
static void bezier_locate(const struct bezier_bake *bake,
                          struct bezier_place *place)
{
    place->u = fcurve_bezier_invert(&bake->leg[place->late].x,
                                    bezier_x(bake, place), place->u);
}

static int bezier_look(const struct bezier_bake *bake,
                       struct bezier_place *place)
{
    const struct fcurve_jet jet =
        fcurve_bezier_jet(&bake->leg[place->late], place->u);
    const struct motion_real slope =
        place->late ? motion_real_neg(jet.d) : jet.d;

    place->point = (struct motion_bake_point){
        motion_real_add(bake->base[place->late], jet.f),
        motion_real_mul(slope, bake->per_s),
        motion_real_mul(jet.dd, motion_real_sqr(bake->per_s)),
    };
    fcurve_add_residual(bake->piece, place->t, &place->point);
    return jet.steep ? MOTION_E_SINGULAR : MOTION_OK;
}

/* An end of the piece, which is of value `pos` there. */
static int bezier_open(struct bezier_bake *bake, int64_t t, bool late,
                       struct motion_real pos, struct bezier_place *place)
{
    const struct fcurve_bezier *leg = &bake->leg[late];

    *place = (struct bezier_place){ .late = late, .t = t };
    place->u = fcurve_bezier_near(&leg->x, bezier_x(bake, place));
    bezier_locate(bake, place);
    bake->base[late] = motion_real_sub(pos, fcurve_cubic_at(&leg->y, place->u));
    return bezier_look(bake, place);
}

/* The whole tick nearest to a place that is `step` of u further on. */
static int bezier_advance(const struct bezier_bake *bake,
                          const struct bezier_place *from,
                          struct motion_real step, struct bezier_place *to)
{
    const struct motion_real u = motion_real_add(bezier_u(from, false), step);
    int64_t past;

    *to = (struct bezier_place){ .late = from->late || u.e > -63 };
    to->u = from->late ? motion_real_sub(from->u, step)
            : to->late ? motion_real_sub(fcurve_whole(1), u)
                       : u;
    (void)motion_real_round(
        motion_real_mul(fcurve_cubic_at(&bake->leg[to->late].x, to->u),
                        fcurve_whole(bake->dur)),
        0, &past);
    to->t = bake->piece->span + (to->late ? bake->dur - past : past);
    bezier_locate(bake, to);
    return bezier_look(bake, to);
}

/* --- segments -------------------------------------------------------------- */

/* To base 2 in Q16, within 0.01: log2(1 + f) is about f + 0.344 f (1 - f). */
static int64_t bezier_log2(struct motion_real a)
{
    const int64_t f = (a.m >> 45) - 65536;

    return (int64_t)(a.e + 61) * 65536 + f +
           ((f * (65536 - f) >> 16) * 22545 >> 16);
}

/* By what to change the length of a segment so that what it misses, of order
 * h^order, comes to three quarters of what is allowed. */
static int64_t bezier_change(struct motion_real bound,
                             struct motion_real allowed, int order)
{
    const int64_t three_quarters = -27200;

    if (motion_real_is_zero(bound) || motion_real_is_zero(allowed))
        return BEZIER_LONGER;
    const int64_t change =
        (bezier_log2(allowed) + three_quarters - bezier_log2(bound)) / order;
    return change < BEZIER_LEAST    ? BEZIER_LEAST
           : change > BEZIER_LONGER ? BEZIER_LONGER
                                    : change;
}

/* 2^g is about 1 + g - 0.344 g (1 - g). */
static struct motion_real bezier_changed(struct motion_real length,
                                         int64_t change)
{
    const int64_t whole = change >> 16, g = change & 65535;
    const int64_t power = 65536 + g - ((g * (65536 - g) >> 16) * 22545 >> 16);

    return motion_real_mul(length,
                           motion_real_make(power, (int32_t)whole - 16));
}

static bool bezier_is_in(struct motion_real bound, struct motion_real allowed)
{
    return motion_real_is_zero(allowed) || motion_real_cmp(bound, allowed) <= 0;
}

/* A segment of `step` from a place on: what it misses, whether that is allowed,
 * and how its length is best changed. */
struct bezier_segment {
    struct fcurve_bezier_bound bound;
    int64_t change;
    bool fits;
};

static void bezier_judge(const struct bezier_bake *bake,
                         const struct bezier_place *from,
                         struct motion_real step,
                         struct bezier_segment *segment)
{
    const struct motion_bake_bound *within = bake->within;
    const struct motion_bake_bound *miss = &segment->bound.miss;
    const struct motion_real half = motion_real_half(step);
    const struct motion_real middle = from->late
                                          ? motion_real_sub(from->u, half)
                                          : motion_real_add(from->u, half);

    segment->change = BEZIER_HALF;
    segment->fits = false;
    if (!fcurve_bezier_bound(&bake->leg[from->late], middle, half, bake->per_s,
                             &segment->bound))
        return;
    const int64_t change[3] = { bezier_change(miss->pos, within->pos, 6),
                                bezier_change(miss->vel, within->vel, 5),
                                bezier_change(miss->acc, within->acc, 4) };
    segment->change = change[0];
    for (int i = 1; i < 3; i++)
        if (change[i] < segment->change)
            segment->change = change[i];
    segment->fits = bezier_is_in(miss->pos, within->pos) &&
                    bezier_is_in(miss->vel, within->vel) &&
                    bezier_is_in(miss->acc, within->acc);
}

/* With what the track rounds when it is sampled, and of its coefficients
 * (motion/plan/check.c).  Whole ticks move an end by 2^-22 of the shortest
 * segment at most, which the bound has room for. */
static void bezier_note(const struct bezier_bake *bake,
                        const struct motion_bake_bound *bound,
                        const struct bezier_place *to)
{
    const struct motion_segment *segment =
        &bake->track->segment[bake->track->count - 1];
    const struct motion_real per_s = motion_real_div(
        fcurve_whole(MOTION_FIXED_S_Q12), fcurve_whole(segment->dur_ns_q12));
    const struct motion_real vel =
        motion_real_mul(motion_real_make(16, -32 - segment->frac), per_s);
    const struct motion_real acc =
        motion_real_scale(motion_real_mul(vel, per_s), 2);
    struct motion_bake_bound *worst = bake->bound;

    worst->pos = motion_real_max(
        worst->pos, motion_real_add(bound->pos, motion_bake_rounding(
                                                    segment, to->point.pos)));
    worst->vel = motion_real_max(worst->vel, motion_real_add(bound->vel, vel));
    worst->acc = motion_real_max(worst->acc, motion_real_add(bound->acc, acc));
}

/* `to` is where the segment ends; the end of the piece when nothing is left. */
static int bezier_append(const struct bezier_bake *bake,
                         const struct bezier_place *from,
                         const struct bezier_place *to,
                         const struct motion_bake_bound *bound)
{
    const int64_t dur = to->t - from->t;
    int rc;

    if (dur < 1)
        return MOTION_E_TOLERANCE;
    if (dur > MOTION_TRACK_SEGMENT_MAX_NS_Q12)
        return MOTION_E_RANGE;
    rc = motion_bake_append(bake->track, dur, &from->point, &to->point);
    if (rc == MOTION_OK)
        bezier_note(bake, bound, to);
    return rc;
}

/* A rejected segment may be shortened while it lasts over two of the shortest. */
static bool bezier_is_short(const struct bezier_bake *bake,
                            const struct bezier_segment *segment)
{
    return motion_real_lt(
        motion_real_mul(segment->bound.half, fcurve_whole(bake->dur)),
        fcurve_whole(BEZIER_SHORTEST));
}

/* The next length, in what is left; no crumb stays behind. */
static struct motion_real bezier_step(struct motion_real step,
                                      struct motion_real left)
{
    return motion_real_cmp(step, left) >= 0
               ? left
               : motion_real_min(step, motion_real_half(left));
}

static int bezier_walk(const struct bezier_bake *bake,
                       const struct bezier_place *first,
                       const struct bezier_place *last)
{
    struct bezier_place from = *first;
    struct motion_real step = fcurve_whole(1);

    while (from.t != last->t) {
        const struct motion_real left =
            motion_real_abs(motion_real_sub(bezier_u(last, from.late), from.u));
        struct bezier_place to = *last;
        struct bezier_segment segment;
        int rc = MOTION_OK;

        step = bezier_step(step, left);
        bezier_judge(bake, &from, step, &segment);
        if (segment.fits && motion_real_lt(step, left))
            rc = bezier_advance(bake, &from, step, &to);
        if (segment.fits && rc == MOTION_OK)
            rc = bezier_append(bake, &from, &to, &segment.bound.miss);
        if (rc != MOTION_OK && rc != MOTION_E_RANGE)
            return rc;
        if (segment.fits && rc == MOTION_OK) {
            from = to;
        } else {
            if (bezier_is_short(bake, &segment))
                return rc < 0 ? rc : MOTION_E_TOLERANCE;
            if (segment.change > BEZIER_SHORTER)
                segment.change = rc < 0 ? BEZIER_HALF : BEZIER_SHORTER;
        }
        step = bezier_changed(step, segment.change);
    }
    return MOTION_OK;
}

int fcurve_bezier_bake(struct motion_track *track,
                       const struct fcurve_piece *piece,
                       const struct motion_bake_bound *within,
                       struct motion_bake_bound *bound)
{
    const struct motion_real zero = motion_real_zero();
    struct bezier_bake bake = {
        .track = track,
        .piece = piece,
        .within = within,
        .bound = bound,
        .leg = { bezier_leg(piece, false), bezier_leg(piece, true) },
        .dur = piece->key[1].at.t_ns_q12 - piece->key->at.t_ns_q12,
    };
    struct bezier_place first, last;
    int rc;

    *bound = (struct motion_bake_bound){ zero, zero, zero };
    bake.per_s = motion_real_div(fcurve_whole(MOTION_FIXED_S_Q12),
                                 fcurve_whole(bake.dur));
    rc = bezier_open(&bake, piece->from, false, piece->start.pos, &first);
    if (rc == MOTION_OK)
        rc = bezier_open(&bake, piece->to, true, piece->end.pos, &last);
    return rc == MOTION_OK ? bezier_walk(&bake, &first, &last) : rc;
}
