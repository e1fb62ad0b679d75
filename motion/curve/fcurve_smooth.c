/* motion/curve/fcurve_smooth.c - automatic handles with continuous
 * acceleration.  See fcurve.h.
 *
 * Runs of keys whose handles are free to move lie between keys whose are not.
 * The unknowns of a run are the slopes m of its keys.  All handles reach a
 * third of their span T, so the span is a cubic of time, and with d the rise of
 * a span the acceleration is the same on both sides of key i where
 *
 *   m[i-1]/T[i] + 2 m[i] (1/T[i] + 1/T[i+1]) + m[i+1]/T[i+1]
 *       = 3 (d[i]/T[i]^2 + d[i+1]/T[i+1]^2)
 *
 * At the ends of a run the slope is that of a handle that stays, or the
 * acceleration is zero, or, in a cycle of free keys, the first key is the last.
 * A handle that stays and reaches x instead of T/3 adds 1 - 3 x/T to the factor
 * 2 at its neighbour's 1/T, m then being three times its rise over T.
 *
 * A clamped key keeps its slope between 0 and 3 d/T of both its spans: with
 * those slopes a cubic rises only (Fritsch & Carlson 1980).  Slopes beyond are
 * held at the limit, those that hit the steep one first; then the rest is
 * solved anew, and a slope that would move back inside is let go, at most twice. */
#include "motion/curve/fcurve_internal.h"

#include <stddef.h>

#include "motion/core/err.h"

#define FCURVE_RELEASES 2

struct fcurve_run {
    struct motion_fcurve *curve;
    struct motion_fcurve_work *work;
    uint32_t *failed;
    bool cyclic; /* the last key is the first */
    uint32_t start, count;
    bool round;                   /* a whole cycle without an end */
    bool solve_first, solve_last; /* no handle stays there */
    struct motion_real bend[2];   /* 1 - 3 x/T of handles that stay */
    uint32_t unknowns;
};

static struct motion_real fcurve_huge(int sign)
{
    return motion_real_make(sign, 20000);
}

static bool fcurve_is_auto_kind(uint8_t kind)
{
    return kind == MOTION_FCURVE_AUTO || kind == MOTION_FCURVE_CLAMPED;
}

static bool fcurve_is_free(const struct motion_fcurve_key *key)
{
    return fcurve_is_auto_kind(key->left_kind) &&
           fcurve_is_auto_kind(key->right_kind) && !key->settled;
}

/* Key number i of the run, as the left end of a span or as its right end:
 * across the seam of a cycle these are the first and the last key. */
static uint32_t fcurve_leaving(const struct fcurve_run *run, uint32_t i)
{
    const uint32_t at = run->start + i, seam = run->curve->count - 1;

    return run->cyclic && at >= seam ? at - seam : at;
}

static uint32_t fcurve_arriving(const struct fcurve_run *run, uint32_t i)
{
    const uint32_t at = run->start + i, seam = run->curve->count - 1;

    return run->cyclic && at > seam ? at - seam : at;
}

static void fcurve_limit(struct motion_fcurve_work *w,
                         struct motion_real steepest)
{
    w->low =
        motion_real_max(w->low, motion_real_min(steepest, motion_real_zero()));
    w->high =
        motion_real_min(w->high, motion_real_max(steepest, motion_real_zero()));
}

static bool fcurve_is_clamped(const struct fcurve_run *run, uint32_t i)
{
    const struct motion_fcurve_key *key = run->curve->key;
    const struct motion_fcurve_key *a = &key[fcurve_arriving(run, i)];
    const struct motion_fcurve_key *b = &key[fcurve_leaving(run, i)];

    return a->left_kind == MOTION_FCURVE_CLAMPED ||
           a->right_kind == MOTION_FCURVE_CLAMPED ||
           (i > 0 && (b->left_kind == MOTION_FCURVE_CLAMPED ||
                      b->right_kind == MOTION_FCURVE_CLAMPED));
}

/* Spans, rises and limits of all keys. */
static void fcurve_measure(struct fcurve_run *run)
{
    const struct motion_fcurve_key *key = run->curve->key;
    struct motion_fcurve_work *w = run->work;

    for (uint32_t i = 0; i < run->count; i++) {
        w[i] = (struct motion_fcurve_work){ .low = fcurve_huge(-1),
                                            .high = fcurve_huge(1) };
        if (i > 0) {
            const struct fcurve_offset chord =
                fcurve_get(&key[fcurve_arriving(run, i)].at,
                           &key[fcurve_leaving(run, i - 1)].at);

            w[i].span = chord.t;
            w[i].chord = motion_real_div(curve_times(chord.pos, 3), chord.t);
            if (fcurve_is_clamped(run, i - 1))
                fcurve_limit(&w[i - 1], w[i].chord);
            if (fcurve_is_clamped(run, i))
                fcurve_limit(&w[i], w[i].chord);
        }
    }
    if (!run->round)
        return;
    w[0].span = w[run->count - 1].span;
    w[0].chord = w[run->count - 1].chord;
    w[0].low = motion_real_max(w[0].low, w[run->count - 1].low);
    w[0].high = motion_real_min(w[0].high, w[run->count - 1].high);
}

/* What a handle that stays does to the run: its slope, and *bend.  `handle` is
 * from its key, or to it when it is a left one: it may be vertical, and then
 * its time does not tell. */
static struct motion_real fcurve_stay(struct fcurve_offset handle,
                                      struct motion_real span,
                                      struct motion_real *bend)
{
    struct motion_real x = motion_real_abs(handle.t);
    struct motion_real rise = handle.pos;
    const struct motion_real margin = fcurve_over(curve_times(span, 2), 3);

    if (motion_real_cmp(x, margin) > 0) {
        /* it and the neighbour's third do not fit: shortened towards that */
        const struct motion_real by =
            motion_real_div(span, motion_real_add(x, fcurve_over(span, 3)));

        x = motion_real_mul(x, by);
        rise = motion_real_mul(rise, by);
    }
    x = motion_real_div(curve_times(x, 3), span);
    *bend = motion_real_sub(fcurve_whole(1), x);
    return motion_real_div(curve_times(rise, 3), span);
}

static void fcurve_hold(struct motion_fcurve_work *w, struct motion_real slope)
{
    w->left = w->right = motion_real_zero();
    w->middle = fcurve_whole(1);
    w->want = slope;
}

/* One side's part of a key's equation. */
static void fcurve_side(struct motion_fcurve_work *w,
                        const struct motion_fcurve_work *span,
                        struct motion_real bend, struct motion_real *neighbour)
{
    const struct motion_real per = motion_real_div(fcurve_whole(1), span->span);
    const struct motion_real two = motion_real_add(fcurve_whole(2), bend);

    *neighbour = per;
    w->middle = motion_real_add(w->middle, motion_real_mul(two, per));
    w->want = motion_real_add(w->want, motion_real_mul(span->chord, per));
}

/* The equation of key i, whatever holds it. */
static void fcurve_equation(const struct fcurve_run *run, uint32_t i)
{
    struct motion_fcurve_work *w = &run->work[i];
    const struct motion_fcurve_key *key = run->curve->key;
    const bool first = i == 0 && !run->round;
    const bool last = i == run->count - 1;
    const struct motion_real none = motion_real_zero();
    struct motion_real unused;

    w->left = w->right = w->middle = w->want = none;
    if (first && !run->solve_first) {
        const struct motion_fcurve_key *k = &key[fcurve_leaving(run, 0)];
        fcurve_hold(
            w, fcurve_stay(fcurve_get(&k->right, &k->at), w[1].span, &unused));
        return;
    }
    if (last && !run->solve_last) {
        const struct motion_fcurve_key *k = &key[fcurve_arriving(run, i)];
        fcurve_hold(
            w, fcurve_stay(fcurve_get(&k->at, &k->left), w->span, &unused));
        return;
    }
    if (!first)
        fcurve_side(w, w, i == 1 ? run->bend[0] : none, &w->left);
    if (!last)
        fcurve_side(w, w + 1, i + 2 == run->count ? run->bend[1] : none,
                    &w->right);
}

static void fcurve_bends(struct fcurve_run *run)
{
    const struct motion_fcurve_key *key = run->curve->key;
    const struct motion_fcurve_key *a = &key[fcurve_leaving(run, 0)];
    const struct motion_fcurve_key *b =
        &key[fcurve_arriving(run, run->count - 1)];

    run->bend[0] = run->bend[1] = motion_real_zero();
    if (run->round)
        return;
    if (!run->solve_first)
        (void)fcurve_stay(fcurve_get(&a->right, &a->at), run->work[1].span,
                          &run->bend[0]);
    if (!run->solve_last)
        (void)fcurve_stay(fcurve_get(&b->at, &b->left),
                          run->work[run->count - 1].span, &run->bend[1]);
}

/* --- the equations -------------------------------------------------------- */

/* One unknown's right side, eliminated downwards and filled in upwards.  The
 * diagonal dominates (2 against 1; bend is at least -1), so it never becomes
 * zero. */
static void fcurve_eliminate(struct motion_fcurve_work *w, uint32_t n)
{
    w[0].right = motion_real_div(w[0].right, w[0].middle);
    w[0].slope = motion_real_div(w[0].slope, w[0].middle);
    w[0].swap = motion_real_div(w[0].swap, w[0].middle);
    for (uint32_t i = 1; i < n; i++) {
        const struct motion_real left = w[i].left;
        const struct motion_real pivot =
            motion_real_sub(w[i].middle, motion_real_mul(left, w[i - 1].right));

        w[i].right = motion_real_div(w[i].right, pivot);
        w[i].slope = motion_real_div(
            motion_real_sub(w[i].slope, motion_real_mul(left, w[i - 1].slope)),
            pivot);
        w[i].swap = motion_real_div(
            motion_real_sub(w[i].swap, motion_real_mul(left, w[i - 1].swap)),
            pivot);
    }
    for (uint32_t i = n - 1; i-- > 0;) {
        w[i].slope = motion_real_sub(
            w[i].slope, motion_real_mul(w[i].right, w[i + 1].slope));
        w[i].swap = motion_real_sub(w[i].swap,
                                    motion_real_mul(w[i].right, w[i + 1].swap));
    }
}

/* In a cycle the first and the last equation hold a corner each: A = B + u v'
 * with v = (1, 0 .. 0, 1), u = (corner, 0 .. 0, corner) (Sherman & Morrison).
 * A single unknown is its own neighbour. */
static void fcurve_solve_round(struct motion_fcurve_work *w, uint32_t n)
{
    const struct motion_real corner[2] = { w[0].left, w[n - 1].right };
    struct motion_real by, below;

    if (n == 1) {
        below =
            motion_real_add(w[0].middle, motion_real_add(corner[0], corner[1]));
        w[0].slope = motion_real_div(w[0].slope, below);
        return;
    }
    w[0].middle = motion_real_sub(w[0].middle, corner[0]);
    w[n - 1].middle = motion_real_sub(w[n - 1].middle, corner[1]);
    w[0].swap = corner[0];
    w[n - 1].swap = corner[1];
    fcurve_eliminate(w, n);
    below = motion_real_add(fcurve_whole(1),
                            motion_real_add(w[0].swap, w[n - 1].swap));
    by = motion_real_div(motion_real_add(w[0].slope, w[n - 1].slope), below);
    for (uint32_t i = 0; i < n; i++)
        w[i].slope =
            motion_real_sub(w[i].slope, motion_real_mul(by, w[i].swap));
}

/* Slopes of all unknowns, those that are locked as they are. */
static void fcurve_solve(struct fcurve_run *run)
{
    struct motion_fcurve_work *w = run->work;

    for (uint32_t i = 0; i < run->unknowns; i++) {
        if (w[i].locked)
            fcurve_hold(&w[i], w[i].slope);
        else
            fcurve_equation(run, i);
        w[i].slope = w[i].want;
        w[i].swap = motion_real_zero();
    }
    if (run->round)
        fcurve_solve_round(w, run->unknowns);
    else
        fcurve_eliminate(w, run->unknowns);
}

/* --- limits --------------------------------------------------------------- */

/* Lock the slopes beyond a limit, at the steep one, or, if there are none, at
 * zero; whether there were any. */
static bool fcurve_lock(struct fcurve_run *run, bool steep)
{
    bool locked = false;

    for (uint32_t i = 0; i < run->unknowns; i++) {
        struct motion_fcurve_work *w = &run->work[i];
        struct motion_real limit = w->high;

        if (w->locked)
            continue;
        if (motion_real_lt(w->slope, w->low))
            limit = w->low;
        else if (motion_real_cmp(w->slope, w->high) <= 0)
            continue;
        if (steep && motion_real_is_zero(limit))
            continue;
        w->slope = limit;
        locked = w->locked = true;
    }
    return locked;
}

/* Let a slope go whose equation draws it inwards: left side less right side is
 * the other way round. */
static bool fcurve_release(struct fcurve_run *run)
{
    const uint32_t n = run->unknowns;
    bool released = false;

    for (uint32_t i = 0; i < n; i++) {
        struct motion_fcurve_work *w = &run->work[i];
        struct motion_real rest;

        if (!w->locked || w->releases >= FCURVE_RELEASES)
            continue;
        fcurve_equation(run, i);
        rest = motion_real_mul(w->left, run->work[i > 0 ? i - 1 : n - 1].slope);
        rest = motion_real_add(rest, motion_real_mul(w->middle, w->slope));
        rest = motion_real_add(
            rest,
            motion_real_mul(w->right, run->work[i + 1 < n ? i + 1 : 0].slope));
        rest = motion_real_sub(w->want, rest);
        if ((rest.m > 0 && motion_real_lt(w->slope, w->high)) ||
            (rest.m < 0 && motion_real_lt(w->low, w->slope))) {
            w->locked = false;
            w->releases++;
            released = true;
        }
    }
    return released;
}

/* Each pass locks one or lets one go, and each can be let go twice. */
static void fcurve_solve_limited(struct fcurve_run *run)
{
    do
        fcurve_solve(run);
    while (fcurve_lock(run, true) || fcurve_lock(run, false) ||
           fcurve_release(run));
}

/* --- runs ----------------------------------------------------------------- */

/* Put one handle at its slope; its time stays.  A free handle stays, and an
 * ALIGNED one on the other side follows; at an end of the curve the other one
 * is its mirror image. */
static int fcurve_turn(const struct fcurve_run *run, uint32_t at, bool right,
                       struct motion_real rise, bool end)
{
    struct motion_fcurve_key *key = &run->curve->key[at];
    struct motion_fcurve_point *own = right ? &key->right : &key->left;
    struct motion_fcurve_point *other = right ? &key->left : &key->right;
    const uint8_t kind = right ? key->right_kind : key->left_kind;
    const uint8_t other_kind = right ? key->left_kind : key->right_kind;
    struct fcurve_offset to = fcurve_get(own, &key->at);
    int rc;

    *run->failed = at;
    if (kind == MOTION_FCURVE_FREE || kind == MOTION_FCURVE_ALIGNED)
        return MOTION_OK;
    to.pos = right ? rise : motion_real_neg(rise);
    rc = fcurve_put(own, &key->at, to);
    if (rc != MOTION_OK || other_kind == MOTION_FCURVE_FREE)
        return rc;
    if (other_kind == MOTION_FCURVE_ALIGNED)
        return fcurve_put(
            other, &key->at,
            fcurve_align(run->curve, to, fcurve_get(other, &key->at)));
    if (!end)
        return MOTION_OK;
    to = (struct fcurve_offset){ motion_real_neg(to.t),
                                 motion_real_neg(to.pos) };
    return fcurve_put(other, &key->at, to);
}

/* The handle towards the span after key i of the run, or before it. */
static int fcurve_turn_after(const struct fcurve_run *run, uint32_t i, bool end)
{
    const struct motion_fcurve_work *w = &run->work[i];

    return fcurve_turn(run, fcurve_leaving(run, i), true,
                       fcurve_over(motion_real_mul(w->slope, w[1].span), 3),
                       end);
}

static int fcurve_turn_before(const struct fcurve_run *run, uint32_t i,
                              bool end)
{
    const struct motion_fcurve_work *w = &run->work[i];

    return fcurve_turn(run, fcurve_arriving(run, i), false,
                       fcurve_over(motion_real_mul(w->slope, w->span), 3), end);
}

static int fcurve_write(const struct fcurve_run *run)
{
    const uint32_t last = run->count - 1, seam = run->curve->count - 1;
    int rc = MOTION_OK;

    for (uint32_t i = 1; i < last && rc == MOTION_OK; i++) {
        const bool end = fcurve_arriving(run, i) == seam;

        rc = fcurve_turn_before(run, i, end);
        if (rc == MOTION_OK)
            rc = fcurve_turn_after(run, i, end);
    }
    if (rc == MOTION_OK && run->solve_first)
        rc = fcurve_turn_after(run, 0, run->start == 0);
    if (rc == MOTION_OK && run->solve_last)
        rc = fcurve_turn_before(run, last, run->start + last == seam);
    return rc;
}

/* Whether a run's end is solved for: VECTOR handles turn, AUTO ones only at the
 * ends of the curve. */
static bool fcurve_turns(const struct motion_fcurve_key *key, uint8_t kind,
                         bool end)
{
    return kind == MOTION_FCURVE_VECTOR ||
           (end && fcurve_is_auto_kind(kind) && !key->settled);
}

static int fcurve_run(struct fcurve_run *run)
{
    const struct motion_fcurve_key *key = run->curve->key;
    const uint32_t last = run->count - 1, total = run->curve->count;
    const struct motion_fcurve_key *a = &key[fcurve_leaving(run, 0)];
    const struct motion_fcurve_key *b = &key[fcurve_arriving(run, last)];

    if (run->count < 2)
        return MOTION_OK;
    run->solve_first = fcurve_turns(a, a->right_kind, run->start == 0);
    run->solve_last =
        fcurve_turns(b, b->left_kind, run->start + run->count == total);
    if (run->count == 2 && !run->round && run->solve_first == run->solve_last)
        return MOTION_OK;
    if (run->round)
        run->solve_first = run->solve_last = true;
    run->unknowns = run->round ? last : run->count;
    fcurve_measure(run);
    fcurve_bends(run);
    fcurve_solve_limited(run);
    if (run->round)
        run->work[last].slope = run->work[0].slope;
    return fcurve_write(run);
}

/* A key inside a cycle whose handles do not move; 0 when all do. */
static uint32_t fcurve_break(const struct motion_fcurve *curve)
{
    for (uint32_t i = 1; i + 1 < curve->count; i++)
        if (!fcurve_is_free(&curve->key[i]))
            return i;
    return 0;
}

int fcurve_smooth(struct motion_fcurve *curve, bool cyclic,
                  struct motion_fcurve_work *work, uint32_t *failed)
{
    const uint32_t total = curve->count;
    struct fcurve_run run = { .curve = curve, .work = work, .failed = failed };
    int rc = MOTION_OK;

    run.cyclic =
        cyclic && !curve->key[0].settled && !curve->key[total - 1].settled;
    run.start = run.cyclic ? fcurve_break(curve) : 0;
    if (run.cyclic && run.start == 0) {
        run.round = true;
        run.count = total;
        return fcurve_run(&run);
    }
    run.count = 1;
    for (uint32_t i = 1, from = run.start; i < total && rc == MOTION_OK; i++) {
        uint32_t at = from + i;

        if (run.cyclic && at >= total - 1)
            at -= total - 1;
        run.count++;
        if (!fcurve_is_free(&curve->key[at])) {
            rc = fcurve_run(&run);
            run.start = at;
            run.count = 1;
        }
    }
    return rc == MOTION_OK && run.count > 1 ? fcurve_run(&run) : rc;
}
