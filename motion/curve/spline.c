/* motion/curve/spline.c - parabola and cardinal tangents; see spline.h.
 *
 * With chords d0, d1 before and after a key and spans h0, h1, the parabola
 * through the three keys has at its middle key
 *     p'  = (d0 h1 + d1 h0) / (h0 + h1)
 *     p'' = 2 (d1 - d0) / (h0 + h1)
 * and at its first key p' = (d0 (2 h0 + h1) - d1 h0) / (h0 + h1), the last by
 * symmetry. */
#include "motion/curve/spline.h"

#include "motion/core/err.h"
#include "motion/curve/spline_internal.h"

/* b - a, a < b, exactly. */
static uint64_t spline_distance(int64_t a, int64_t b)
{
    return (uint64_t)b - (uint64_t)a;
}

struct motion_real spline_displacement(int64_t a_q32, int64_t b_q32)
{
    if (b_q32 >= a_q32)
        return motion_real_from_u64(spline_distance(a_q32, b_q32), -32);
    return motion_real_neg(
        motion_real_from_u64(spline_distance(b_q32, a_q32), -32));
}

struct motion_real spline_span(const struct motion_key *key)
{
    return motion_real_div(
        motion_real_from_u64(spline_distance(key[0].t_ns_q12, key[1].t_ns_q12),
                             0),
        motion_real_int(MOTION_FIXED_S_Q12));
}

struct spline_chord spline_chord(const struct motion_key *key)
{
    struct spline_chord chord = { .dur = spline_span(key) };

    chord.vel = motion_real_div(
        spline_displacement(key[0].pos_q32, key[1].pos_q32), chord.dur);
    return chord;
}

int spline_order(const struct motion_key *key, uint32_t count)
{
    if (count == 0)
        return MOTION_E_EMPTY;
    for (uint32_t i = 1; i < count; i++) {
        if (key[i].t_ns_q12 <= key[i - 1].t_ns_q12)
            return MOTION_E_ORDER;
        if (spline_distance(key[i - 1].t_ns_q12, key[i].t_ns_q12) >
            (uint64_t)MOTION_TRACK_SEGMENT_MAX_NS_Q12)
            return MOTION_E_RANGE;
    }
    return MOTION_OK;
}

int spline_within(struct motion_real a, int bits)
{
    return a.m == 0 || a.e + 62 <= bits ? MOTION_OK : MOTION_E_RANGE;
}

int spline_velocities_within(const struct motion_key *key, uint32_t count)
{
    for (uint32_t i = 0; i < count; i++)
        if (spline_within(key[i].vel, 31))
            return MOTION_E_RANGE;
    return MOTION_OK;
}

/* Velocity at the key between the two chords. */
static struct motion_real spline_parabola_inner(struct spline_chord before,
                                                struct spline_chord after)
{
    return motion_real_div(
        motion_real_add(motion_real_mul(before.vel, after.dur),
                        motion_real_mul(after.vel, before.dur)),
        motion_real_add(before.dur, after.dur));
}

struct motion_real spline_parabola_end(struct spline_chord outer,
                                       struct spline_chord inner)
{
    const struct motion_real both = motion_real_add(outer.dur, inner.dur);

    return motion_real_div(
        motion_real_sub(
            motion_real_mul(outer.vel, motion_real_add(outer.dur, both)),
            motion_real_mul(inner.vel, outer.dur)),
        both);
}

static int spline_check(const struct motion_key *key, uint32_t count,
                        enum motion_spline_end first,
                        enum motion_spline_end last)
{
    if ((unsigned)first > MOTION_SPLINE_NATURAL ||
        (unsigned)last > MOTION_SPLINE_NATURAL)
        return MOTION_E_ARG;
    return spline_order(key, count);
}

/* Which law gives the velocities, with its number. */
struct spline_law {
    bool cardinal;
    struct motion_real mu;
};

/* mu (p[b] - p[a]) / (t[b] - t[a]); both times within two spans. */
static struct motion_real spline_cardinal(const struct motion_key *a,
                                          const struct motion_key *b,
                                          const struct spline_law *law)
{
    const struct motion_key ends[2] = { *a, *b };

    return motion_real_mul(law->mu, spline_chord(ends).vel);
}

/* key[0] is the key, key[-1] and key[1] exist. */
static struct motion_real spline_inner(const struct motion_key *key,
                                       const struct spline_law *law)
{
    if (law->cardinal)
        return spline_cardinal(key - 1, key + 1, law);
    return spline_parabola_inner(spline_chord(key - 1), spline_chord(key));
}

/* One end of a list of two or more.  `span` is the first key of the outer span,
 * `next` of the one inside it (the same when there are only two keys). */
struct spline_edge {
    struct motion_key *key;
    const struct motion_key *span, *next, *neighbour;
    enum motion_spline_end rule;
};

static struct motion_real spline_one_sided(const struct spline_edge *edge,
                                           const struct spline_law *law)
{
    if (law->cardinal)
        return spline_cardinal(edge->span, edge->span + 1, law);
    return spline_parabola_end(spline_chord(edge->span),
                               spline_chord(edge->next));
}

/* v = (3 chord - v_neighbour) / 2, from the cubic's p''(0) = 0:
 *   6 (p1 - p0) = T (4 v0 + 2 v1) */
static struct motion_real spline_natural(const struct spline_edge *edge)
{
    return motion_real_half(
        motion_real_sub(curve_times(spline_chord(edge->span).vel, 3),
                        spline_read(edge->neighbour->vel)));
}

static void spline_edge(const struct spline_edge *edge,
                        const struct spline_law *law)
{
    if (edge->key->has_vel)
        return;
    if (edge->rule == MOTION_SPLINE_NATURAL)
        edge->key->vel = spline_natural(edge);
    else if (edge->rule == MOTION_SPLINE_ONE_SIDED)
        edge->key->vel = spline_one_sided(edge, law);
    else
        edge->key->vel = motion_real_zero();
}

static void spline_edges(struct motion_key *key, uint32_t count,
                         const struct spline_law *law,
                         enum motion_spline_end first,
                         enum motion_spline_end last)
{
    const uint32_t end = count - 1;
    struct spline_edge front = { &key[0], &key[0], &key[count > 2 ? 1 : 0],
                                 &key[1], first };
    struct spline_edge back = { &key[end], &key[end - 1],
                                &key[count > 2 ? end - 2 : 0], &key[end - 1],
                                last };

    /* Two natural ends of one span: the straight line. */
    if (count == 2 && first == MOTION_SPLINE_NATURAL &&
        last == MOTION_SPLINE_NATURAL && !key[0].has_vel && !key[1].has_vel) {
        key[0].vel = spline_chord(key).vel;
        spline_edge(&back, law);
        return;
    }
    /* A natural end needs its neighbour's velocity. */
    if (first == MOTION_SPLINE_NATURAL) {
        spline_edge(&back, law);
        spline_edge(&front, law);
        return;
    }
    spline_edge(&front, law);
    spline_edge(&back, law);
}

static int spline_tangents(struct motion_key *key, uint32_t count,
                           const struct spline_law *law,
                           enum motion_spline_end first,
                           enum motion_spline_end last)
{
    int rc = spline_check(key, count, first, last);

    if (rc != MOTION_OK)
        return rc;
    for (uint32_t i = 1; i + 1 < count; i++)
        if (!key[i].has_vel)
            key[i].vel = spline_inner(&key[i], law);
    if (count > 1)
        spline_edges(key, count, law, first, last);
    else if (!key[0].has_vel)
        key[0].vel = motion_real_zero();
    return spline_velocities_within(key, count);
}

int motion_spline_tangents_parabola(struct motion_key *key, uint32_t count,
                                    enum motion_spline_end first,
                                    enum motion_spline_end last)
{
    const struct spline_law law = { .cardinal = false };

    return spline_tangents(key, count, &law, first, last);
}

int motion_spline_tangents_cardinal(struct motion_key *key, uint32_t count,
                                    int64_t mu_q32,
                                    enum motion_spline_end first,
                                    enum motion_spline_end last)
{
    const struct spline_law law = { true, motion_real_from_q(mu_q32, 32) };

    if (mu_q32 < 0 || mu_q32 > 2 * MOTION_FIXED_ONE_Q32)
        return MOTION_E_ARG;
    return spline_tangents(key, count, &law, first, last);
}

/* Second derivative of the parabola through key[0], key[1], key[2]. */
static struct motion_real spline_acc(const struct motion_key *key)
{
    const struct spline_chord before = spline_chord(key);
    const struct spline_chord after = spline_chord(key + 1);

    return motion_real_twice(
        motion_real_div(motion_real_sub(after.vel, before.vel),
                        motion_real_add(before.dur, after.dur)));
}

int motion_spline_accelerations(struct motion_key *key, uint32_t count,
                                enum motion_spline_end first,
                                enum motion_spline_end last)
{
    int rc = spline_check(key, count, first, last);

    for (uint32_t i = 0; rc == MOTION_OK && i < count; i++) {
        uint32_t from = i == 0 ? 0 : i - 1;
        const bool zero = (i == 0 && first != MOTION_SPLINE_ONE_SIDED) ||
                          (i == count - 1 && last != MOTION_SPLINE_ONE_SIDED);
        if (key[i].has_acc)
            continue;
        key[i].acc = motion_real_zero();
        if (zero || count < 3)
            continue;
        if (i == count - 1)
            from = count - 3;
        key[i].acc = spline_acc(&key[from]);
        rc = spline_within(key[i].acc, 47);
    }
    return rc;
}
