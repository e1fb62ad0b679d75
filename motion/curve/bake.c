/* motion/curve/bake.c - see bake.h. */
#include "motion/curve/bake.h"

#include "motion/core/err.h"
#include "motion/core/fixed.h"
#include "motion/curve/times.h"

#define BAKE_PLACES   5 /* both ends and three between them */
#define BAKE_SHORTEST (1000 * MOTION_FIXED_NS_Q12)

/* Where to look, of 2^16.  Uneven and without a common divisor, so that no
 * symmetry of the motion hides what is between. */
static const int64_t bake_place[BAKE_PLACES] = { 0, 15391, 31541, 48751,
                                                 65536 };

/* Motion, or difference from it, at one time. */
struct bake_place {
    int64_t t;
    struct motion_bake_point point[MOTION_BAKE_AXES];
};

struct bake {
    const struct motion_bake *job;
    struct motion_track **track;
    struct motion_bake_report *report;
    struct bake_place place[BAKE_PLACES]; /* of the present segment */
    int64_t shortest;
};

/* motion_real_add drops what is smaller by 2^62: this does not matter here. */
static struct motion_bake_point bake_minus(struct motion_bake_point a,
                                           struct motion_bake_point b)
{
    return (struct motion_bake_point){ motion_real_sub(a.pos, b.pos),
                                       motion_real_sub(a.vel, b.vel),
                                       motion_real_sub(a.acc, b.acc) };
}

static int bake_look(struct bake *bake, int64_t t, enum motion_bake_side side,
                     struct bake_place *place)
{
    const uint32_t most = bake->job->evaluations;

    place->t = t;
    if (most > 0 && bake->report->evaluations >= most)
        return MOTION_E_WORK;
    bake->report->evaluations++;
    return bake->job->source.at(bake->job->source.context, t, side,
                                place->point);
}

/* Bernstein ordinates of the quintic that has p, v, a of two places. */
static void bake_bernstein(const struct motion_bake_point *a,
                           const struct motion_bake_point *b,
                           struct motion_real h, struct motion_real o[6])
{
    const struct motion_real fifth = motion_real_div(h, motion_real_int(5));
    const struct motion_real twentieth =
        motion_real_div(motion_real_sqr(h), motion_real_int(20));
    const struct motion_real va = motion_real_mul(a->vel, fifth);
    const struct motion_real vb = motion_real_mul(b->vel, fifth);

    o[0] = a->pos;
    o[1] = motion_real_add(a->pos, va);
    o[2] = motion_real_add(motion_real_add(o[1], va),
                           motion_real_mul(a->acc, twentieth));
    o[5] = b->pos;
    o[4] = motion_real_sub(b->pos, vb);
    o[3] = motion_real_add(motion_real_sub(o[4], vb),
                           motion_real_mul(b->acc, twentieth));
}

static struct motion_real bake_larger(struct motion_real bound,
                                      struct motion_real a)
{
    return motion_real_max(bound, motion_real_abs(a));
}

/* Raise a bound to the control polygons of position, velocity, acceleration. */
static void bake_polygon(const struct motion_bake_point *a,
                         const struct motion_bake_point *b,
                         struct motion_real h, struct motion_bake_bound *bound)
{
    const struct motion_real per_h = motion_real_div(motion_real_int(5), h);
    const struct motion_real per_hh = motion_real_div(motion_real_int(4), h);
    struct motion_real o[6];

    bake_bernstein(a, b, h, o);
    for (int i = 0; i < 6; i++)
        bound->pos = bake_larger(bound->pos, o[i]);
    for (int i = 0; i < 5; i++) {
        o[i] = motion_real_mul(motion_real_sub(o[i + 1], o[i]), per_h);
        bound->vel = bake_larger(bound->vel, o[i]);
    }
    for (int i = 0; i < 4; i++)
        bound->acc = bake_larger(
            bound->acc,
            motion_real_mul(motion_real_sub(o[i + 1], o[i]), per_hh));
}

/* By how much the quintic from a to b misses `at`, t after a. */
static struct motion_bake_point
bake_residual(const struct motion_bake_point *a,
              const struct motion_bake_point *b,
              const struct motion_bake_point *at, struct motion_real t,
              struct motion_real h)
{
    static const int binomial[6] = { 1, 5, 10, 10, 5, 1 };
    struct motion_real o[6], c[6];

    bake_bernstein(a, b, h, o);
    /* to powers: c_k = binomial_k * kth difference */
    for (int k = 0; k < 6; k++) {
        c[k] = curve_times(o[0], binomial[k]);
        for (int i = 0; i < 5 - k; i++)
            o[i] = motion_real_sub(o[i + 1], o[i]);
    }
    return bake_minus(*at, motion_bake_horner(c, 5, motion_real_div(t, h), h));
}

/* What a quintic over h that misses by `residual` may miss over half of h: the
 * largest of w = (u (1-u))^3 is 1/64, of w' 0.0537 / h, of w'' 3/8 / h^2; the
 * miss of v is zero where that of p is largest, so it follows from that. */
static void bake_raise(struct motion_bake_bound *rest,
                       const struct motion_bake_point *residual,
                       struct motion_real h)
{
    const struct motion_real p = motion_real_abs(residual->pos);
    const struct motion_real v = motion_real_div(motion_real_scale(p, 2), h);
    const struct motion_real a =
        motion_real_div(curve_times(p, 24), motion_real_sqr(h));

    rest->pos = motion_real_max(rest->pos, p);
    rest->vel = motion_real_max(rest->vel, bake_larger(v, residual->vel));
    rest->acc = motion_real_max(rest->acc, bake_larger(a, residual->acc));
}

/* The bound of one axis over the last segment of its track. */
static struct motion_bake_bound bake_judge(const struct bake *bake,
                                           uint32_t axis)
{
    const struct motion_track *track = bake->track[axis];
    const struct motion_segment *seg = &track->segment[track->count - 1];
    const struct bake_place *place = bake->place;
    struct motion_bake_bound bound = { motion_real_zero(), motion_real_zero(),
                                       motion_real_zero() };
    const struct motion_real dur = motion_real_int(seg->dur_ns_q12),
                             dur_s = motion_bake_seconds(seg->dur_ns_q12);
    struct motion_bake_bound rest = bound;
    struct motion_bake_point e[BAKE_PLACES];
    struct motion_real h[BAKE_PLACES], coef[MOTION_TRACK_DEGREE + 1];

    motion_bake_coefficients(seg, coef);
    for (int i = 0; i < BAKE_PLACES; i++) {
        const struct motion_real u =
            motion_real_div(motion_real_int(place[i].t - place[0].t), dur);
        e[i] =
            bake_minus(place[i].point[axis],
                       motion_bake_horner(coef, MOTION_TRACK_DEGREE, u, dur_s));
        if (i == 0)
            continue;
        h[i] = motion_bake_seconds(place[i].t - place[i - 1].t);
        bake_polygon(&e[i - 1], &e[i], h[i], &bound);
    }
    for (int i = 0; i + 2 < BAKE_PLACES; i++) {
        const struct motion_real both = motion_real_add(h[i + 1], h[i + 2]);
        const struct motion_bake_point residual =
            bake_residual(&e[i], &e[i + 2], &e[i + 1], h[i + 1], both);
        bake_raise(&rest, &residual, both);
    }
    bound.pos = motion_real_add(bound.pos, rest.pos);
    bound.vel = motion_real_add(bound.vel, rest.vel);
    bound.acc = motion_real_add(bound.acc, rest.acc);
    bound.pos = motion_real_add(
        bound.pos,
        motion_bake_rounding(seg, place[BAKE_PLACES - 1].point[axis].pos));
    return bound;
}

/* An error of order h^order, over a length of n 16ths, is within half of what
 * is allowed. */
static bool bake_fits(struct motion_real bound, struct motion_real allowed,
                      int order, int n)
{
    struct motion_real grown = motion_real_twice(bound);

    for (int i = 0; i < order; i++)
        grown = motion_real_scale(curve_times(grown, n), -4);
    return motion_real_cmp(grown, allowed) <= 0;
}

/* By what, in 16ths, to change the length of a segment so that an error of
 * order h^order comes to half of what is allowed: 2 .. 64, by halving. */
static int bake_change(struct motion_real bound, struct motion_real allowed,
                       int order)
{
    int low = 2, high = 65;

    if (motion_real_is_zero(allowed) || motion_real_is_zero(bound))
        return 64;
    while (high - low > 1) {
        const int n = (low + high) / 2;
        if (bake_fits(bound, allowed, order, n))
            low = n;
        else
            high = n;
    }
    return low;
}

static bool bake_is_in(struct motion_real bound, struct motion_real allowed)
{
    return motion_real_is_zero(allowed) || motion_real_cmp(bound, allowed) <= 0;
}

/* Judge the segment just appended; its bounds into `bound`, the change of
 * length that is best into *change. */
static bool bake_accept(const struct bake *bake,
                        struct motion_bake_bound bound[], int *change)
{
    const struct motion_bake *job = bake->job;
    bool in = true;

    *change = 64;
    for (uint32_t i = 0; i < job->axes; i++) {
        bound[i] = bake_judge(bake, i);
        const int n[3] = { bake_change(bound[i].pos, job->pos, 6),
                           bake_change(bound[i].vel, job->vel, 5),
                           bake_change(bound[i].acc, job->acc, 4) };
        for (int k = 0; k < 3; k++)
            *change = n[k] < *change ? n[k] : *change;
        in = in && bake_is_in(bound[i].pos, job->pos) &&
             bake_is_in(bound[i].vel, job->vel) &&
             bake_is_in(bound[i].acc, job->acc);
    }
    return in;
}

static void bake_copy(uint32_t axes, struct motion_track to[],
                      struct motion_track *const from[])
{
    for (uint32_t i = 0; i < axes; i++)
        to[i] = *from[i];
}

static void bake_restore(uint32_t axes, struct motion_track *const to[],
                         const struct motion_track from[])
{
    for (uint32_t i = 0; i < axes; i++)
        *to[i] = from[i];
}

/* All places of a segment from place[0] over `dur`, and one quintic per
 * axis. */
static int bake_try(struct bake *bake, int64_t dur)
{
    struct bake_place *place = bake->place;
    int err = MOTION_OK;

    for (int i = 1; i < BAKE_PLACES && err == MOTION_OK; i++) {
        const int64_t dt = i == BAKE_PLACES - 1
                               ? dur
                               : (dur >> 16) * bake_place[i] +
                                     (((dur & 0xffff) * bake_place[i]) >> 16);
        err = bake_look(bake, place->t + dt, MOTION_BAKE_LEFT, &place[i]);
    }
    for (uint32_t i = 0; i < bake->job->axes && err == MOTION_OK; i++)
        err = motion_bake_append(bake->track[i], dur, &place[0].point[i],
                                 &place[BAKE_PLACES - 1].point[i]);
    return err;
}

static void bake_note(struct bake *bake, const struct motion_bake_bound bound[])
{
    struct motion_bake_report *report = bake->report;

    report->segments++;
    for (uint32_t i = 0; i < bake->job->axes; i++) {
        struct motion_bake_bound *all = &report->bound[i];
        all->pos = motion_real_max(all->pos, bound[i].pos);
        all->vel = motion_real_max(all->vel, bound[i].vel);
        all->acc = motion_real_max(all->acc, bound[i].acc);
    }
}

/* The next length to try, in what is left; no crumb stays behind.  Where the
 * motion gets worse, one good segment after the other is a little shorter: not
 * below the shortest, or there is no end of them. */
static int64_t bake_step(const struct bake *bake, int64_t step, int change,
                         int64_t left)
{
    const int64_t longest = bake->job->longest_ns_q12;

    step = step > INT64_MAX / 64 ? INT64_MAX / 64 : step;
    step = step * change / 16;
    if (step < bake->shortest)
        step = bake->shortest;
    if (longest > 0 && step > longest)
        step = longest;
    if (step >= left)
        return left;
    return step > left - left / 2 ? left - left / 2 : step;
}

/* From one border to the next. */
static int bake_stretch(struct bake *bake, int64_t low, int64_t high)
{
    const uint32_t axes = bake->job->axes;
    int64_t step = bake_step(bake, high - low, 16, high - low);
    int err = bake_look(bake, low, MOTION_BAKE_RIGHT, &bake->place[0]);

    while (err == MOTION_OK && bake->place->t != high) {
        struct motion_track before[MOTION_BAKE_AXES];
        struct motion_bake_bound bound[MOTION_BAKE_AXES];
        int change = 8;

        bake_copy(axes, before, bake->track);
        err = bake_try(bake, step);
        if (err == MOTION_OK && bake_accept(bake, bound, &change)) {
            bake_note(bake, bound);
            bake->place[0] = bake->place[BAKE_PLACES - 1];
            step = bake_step(bake, step, change, high - bake->place->t);
            continue;
        }
        bake_restore(axes, bake->track, before);
        if (err != MOTION_OK && err != MOTION_E_RANGE)
            return err;
        change = change > 14 ? 14 : change;
        if (step * change / 16 < bake->shortest)
            return err < 0 ? err : MOTION_E_TOLERANCE;
        step = step * change / 16;
        err = MOTION_OK;
    }
    return err;
}

/* The first place must be where the tracks end. */
static int bake_check_start(struct bake *bake)
{
    const int64_t start = bake->job->border_ns_q12[0];
    int err = bake_look(bake, start, MOTION_BAKE_RIGHT, &bake->place[0]);

    for (uint32_t i = 0; i < bake->job->axes && err == MOTION_OK; i++) {
        const struct motion_real off = motion_real_sub(
            bake->place->point[i].pos, motion_bake_end(bake->track[i]));
        if (motion_real_lt(motion_real_from_q(1, 30), motion_real_abs(off)))
            err = MOTION_E_ARG;
    }
    return err;
}

int motion_bake_check_borders(const int64_t border_ns_q12[], uint32_t borders,
                              int64_t shortest_ns_q12)
{
    for (uint32_t i = 1; i < borders; i++) {
        int64_t dur;

        if (border_ns_q12[i] <= border_ns_q12[i - 1])
            return MOTION_E_ORDER;
        if (motion_fixed_sub(border_ns_q12[i], border_ns_q12[i - 1], &dur) <
                0 ||
            dur < shortest_ns_q12 || dur > MOTION_TRACK_MAX_NS_Q12)
            return MOTION_E_RANGE;
    }
    return MOTION_OK;
}

static int bake_check(const struct motion_bake *job)
{
    if (job->axes < 1 || job->axes > MOTION_BAKE_AXES || job->borders < 2 ||
        motion_real_sign(job->pos) <= 0 || motion_real_sign(job->vel) < 0 ||
        motion_real_sign(job->acc) < 0 || job->longest_ns_q12 < 0 ||
        job->shortest_ns_q12 < 0)
        return MOTION_E_ARG;
    return motion_bake_check_borders(job->border_ns_q12, job->borders, 1);
}

static void bake_clear(struct motion_bake_report *report, uint32_t axes)
{
    const struct motion_real zero = motion_real_zero();

    for (uint32_t i = 0; i < axes; i++)
        report->bound[i] = (struct motion_bake_bound){ zero, zero, zero };
}

static int bake_all(struct bake *bake)
{
    const int64_t *border = bake->job->border_ns_q12;
    int err = bake_check_start(bake);

    for (uint32_t i = 1; i < bake->job->borders && err == MOTION_OK; i++)
        err = bake_stretch(bake, border[i - 1], border[i]);
    return err;
}

int motion_bake(const struct motion_bake *job, struct motion_track *track[],
                struct motion_bake_report *report)
{
    struct motion_bake_report own = { .segments = 0 };
    struct motion_track before[MOTION_BAKE_AXES];
    struct bake bake = { .job = job, .track = track, .report = &own };
    int err = bake_check(job);

    if (err < 0)
        return err;
    bake_clear(&own, job->axes);
    bake.shortest =
        job->shortest_ns_q12 > 0 ? job->shortest_ns_q12 : BAKE_SHORTEST;
    bake_copy(job->axes, before, track);
    err = bake_all(&bake);
    if (err < 0) {
        bake_restore(job->axes, track, before);
        if (report)
            report->evaluations = own.evaluations;
        return err;
    }
    if (report)
        *report = own;
    return MOTION_OK;
}
