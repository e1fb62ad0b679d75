/* motion/spline.c - see spline.h.
 *
 * With chords d0, d1 before and after a key and spans h0, h1, the parabola
 * through the three keys has at its middle key
 *     p'  = (d0 h1 + d1 h0) / (h0 + h1)
 *     p'' = 2 (d1 - d0) / (h0 + h1)
 * and at its first key p' = (d0 (2 h0 + h1) - d1 h0) / (h0 + h1), the last by
 * symmetry.  Chords are computed once, with 32 bits more than a velocity has;
 * everything else is one product and one division in 128 bits, two's
 * complement. */
#include "motion/spline.h"

#include "motion/err.h"
#include "motion/fixed.h"

/* Guard bits of a chord in a weighted sum: |chord| < 2^65, weights sum to at
 * most 2^62, so the sum stays below 2^127. */
#define SPLINE_GUARD 2

/* b - a, a < b, exactly. */
static uint64_t spline_distance(int64_t a, int64_t b)
{
    return (uint64_t)b - (uint64_t)a;
}

/* a * b modulo 2^128; exact when |a b| < 2^127. */
static struct motion_u128 spline_mul(struct motion_u128 a, uint64_t b)
{
    struct motion_u128 product = motion_fixed_mul_u64(a.lo, b);

    product.hi += a.hi * b;
    return product;
}

/* |n| / d to nearest with the sign put back; MOTION_E_RANGE beyond int64.
 * |n| < 2^127 and d < 2^63, so half of d can be added. */
static int spline_divide(struct motion_u128 n, bool negative, uint64_t d,
                         int64_t *result)
{
    const struct motion_u128 half = { 0, d / 2 };
    uint64_t quotient;

    n = motion_fixed_add_u128(n, half);
    if (motion_fixed_div_u128(n, d, &quotient, 0) || quotient > INT64_MAX)
        return MOTION_E_RANGE;
    *result = negative ? -(int64_t)quotient : (int64_t)quotient;
    return MOTION_OK;
}

/* n / (d 2^bits) for a signed n: dropping the bits first changes the result by
 * less than 1/d. */
static int spline_divide_shifted(struct motion_u128 n, unsigned bits,
                                 uint64_t d, int64_t *result)
{
    const bool negative = motion_fixed_is_neg_i128(n);

    n = motion_fixed_shr_u128(motion_fixed_abs_i128(n), bits);
    return spline_divide(n, negative, d, result);
}

/* One chord: velocity as Q64.64 and the span's duration. */
struct spline_chord {
    struct motion_u128 vel_q64;
    uint64_t dur;
};

/* (p1 - p0) / (t1 - t0): 64 bits times 42 for ns to s; the quotient and then
 * 32 bits of the rest. */
static int spline_chord(const struct motion_key *key,
                        struct spline_chord *chord)
{
    const bool down = key[1].pos_q32 < key[0].pos_q32;
    const uint64_t way = down ? spline_distance(key[1].pos_q32, key[0].pos_q32)
                              : spline_distance(key[0].pos_q32, key[1].pos_q32);
    const uint64_t dur = spline_distance(key[0].t_ns_q12, key[1].t_ns_q12);
    uint64_t whole, rest, part;

    if (motion_fixed_div_u128(
            motion_fixed_mul_u64(way, (uint64_t)MOTION_FIXED_S_Q12), dur,
            &whole, &rest) ||
        whole > INT64_MAX)
        return MOTION_E_RANGE;
    (void)motion_fixed_div_u128((struct motion_u128){ rest >> 32, rest << 32 },
                                dur, &part, 0);
    chord->dur = dur;
    chord->vel_q64 = (struct motion_u128){ whole >> 32, whole << 32 | part };
    if (down)
        chord->vel_q64 = motion_fixed_neg_i128(chord->vel_q64);
    return MOTION_OK;
}

static struct motion_u128 spline_guarded(const struct spline_chord *chord)
{
    return motion_fixed_round_i128(chord->vel_q64, 32 - SPLINE_GUARD);
}

/* Velocity at the key between the two chords. */
static int spline_parabola_inner(const struct spline_chord *before,
                                 const struct spline_chord *after,
                                 int64_t *vel_q32)
{
    return spline_divide_shifted(
        motion_fixed_add_u128(spline_mul(spline_guarded(before), after->dur),
                              spline_mul(spline_guarded(after), before->dur)),
        SPLINE_GUARD, before->dur + after->dur, vel_q32);
}

/* Velocity at the far end of the outer chord. */
static int spline_parabola_end(const struct spline_chord *outer,
                               const struct spline_chord *inner,
                               int64_t *vel_q32)
{
    return spline_divide_shifted(
        motion_fixed_sub_u128(
            spline_mul(spline_guarded(outer), 2 * outer->dur + inner->dur),
            spline_mul(spline_guarded(inner), outer->dur)),
        SPLINE_GUARD, outer->dur + inner->dur, vel_q32);
}

/* p'' as Q47.16.  2 * 10^9 * 2^12 = 5^9 * 2^22, so the difference of Q64.64
 * velocities is multiplied by 5^9 (21 bits) and shifted by 64 - 16 - 22. */
static int spline_parabola_acc(const struct spline_chord *before,
                               const struct spline_chord *after,
                               int64_t *acc_q16)
{
    return spline_divide_shifted(
        spline_mul(motion_fixed_sub_u128(after->vel_q64, before->vel_q64),
                   1953125),
        26, before->dur + after->dur, acc_q16);
}

static int spline_order(const struct motion_key *key, uint32_t count)
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
    uint64_t mu_q32;
};

/* mu (p[b] - p[a]) / (t[b] - t[a]).  mu <= 2^33, so mu 10^9 < 2^63; the shift
 * by 20 is 32 for mu less 12 for the times. */
static int spline_cardinal(const struct motion_key *a,
                           const struct motion_key *b, uint64_t mu_q32,
                           int64_t *vel_q32)
{
    const bool down = b->pos_q32 < a->pos_q32;
    const uint64_t way = down ? spline_distance(b->pos_q32, a->pos_q32)
                              : spline_distance(a->pos_q32, b->pos_q32);
    const struct motion_u128 n = motion_fixed_mul_u64(way, mu_q32 * 1000000000);

    return spline_divide(motion_fixed_shr_u128(n, 20), down,
                         spline_distance(a->t_ns_q12, b->t_ns_q12), vel_q32);
}

/* key[0] is the key, key[-1] and key[1] exist. */
static int spline_inner(struct motion_key *key, const struct spline_law *law)
{
    struct spline_chord before, after;

    if (law->cardinal)
        return spline_cardinal(key - 1, key + 1, law->mu_q32, &key->vel_q32);
    if (spline_chord(key - 1, &before) || spline_chord(key, &after))
        return MOTION_E_RANGE;
    return spline_parabola_inner(&before, &after, &key->vel_q32);
}

/* One end of a list of two or more.  `span` is the first key of the outer span,
 * `next` of the one inside it (the same when there are only two keys). */
struct spline_edge {
    struct motion_key *key;
    const struct motion_key *span, *next, *neighbour;
    enum motion_spline_end rule;
};

static int spline_one_sided(const struct spline_edge *edge,
                            const struct spline_law *law)
{
    struct spline_chord outer, inner;

    if (law->cardinal)
        return spline_cardinal(edge->span, edge->span + 1, law->mu_q32,
                               &edge->key->vel_q32);
    if (spline_chord(edge->span, &outer) || spline_chord(edge->next, &inner))
        return MOTION_E_RANGE;
    return spline_parabola_end(&outer, &inner, &edge->key->vel_q32);
}

/* v = (3 chord - v_neighbour) / 2, from the cubic's p''(0) = 0:
 *   6 (p1 - p0) = T (4 v0 + 2 v1) */
static int spline_natural(const struct spline_edge *edge)
{
    struct motion_u128 n = motion_fixed_from_i64(edge->neighbour->vel_q32);
    struct spline_chord outer;

    if (spline_chord(edge->span, &outer))
        return MOTION_E_RANGE;
    n = motion_fixed_shl_u128(n, 32);
    n = motion_fixed_sub_u128(spline_mul(outer.vel_q64, 3), n);
    return motion_fixed_to_i64(motion_fixed_round_i128(n, 33),
                               &edge->key->vel_q32);
}

static int spline_edge(const struct spline_edge *edge,
                       const struct spline_law *law)
{
    if (edge->key->has_vel)
        return MOTION_OK;
    if (edge->rule == MOTION_SPLINE_NATURAL)
        return spline_natural(edge);
    if (edge->rule == MOTION_SPLINE_ONE_SIDED)
        return spline_one_sided(edge, law);
    edge->key->vel_q32 = 0;
    return MOTION_OK;
}

static int spline_edges(struct motion_key *key, uint32_t count,
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
    int rc;

    /* Two natural ends of one span: the straight line. */
    if (count == 2 && first == MOTION_SPLINE_NATURAL &&
        last == MOTION_SPLINE_NATURAL && !key[0].has_vel && !key[1].has_vel) {
        rc = spline_cardinal(&key[0], &key[1], (uint64_t)MOTION_FIXED_ONE_Q32,
                             &key[0].vel_q32);
        return rc ? rc : spline_natural(&back);
    }
    /* A natural end needs its neighbour's velocity. */
    if (first == MOTION_SPLINE_NATURAL) {
        rc = spline_edge(&back, law);
        return rc ? rc : spline_edge(&front, law);
    }
    rc = spline_edge(&front, law);
    return rc ? rc : spline_edge(&back, law);
}

static int spline_tangents(struct motion_key *key, uint32_t count,
                           const struct spline_law *law,
                           enum motion_spline_end first,
                           enum motion_spline_end last)
{
    int rc = spline_check(key, count, first, last);

    for (uint32_t i = 1; rc == MOTION_OK && i + 1 < count; i++)
        if (!key[i].has_vel)
            rc = spline_inner(&key[i], law);
    if (rc != MOTION_OK)
        return rc;
    if (count > 1)
        return spline_edges(key, count, law, first, last);
    if (!key[0].has_vel)
        key[0].vel_q32 = 0;
    return MOTION_OK;
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
    const struct spline_law law = { true, (uint64_t)mu_q32 };

    if (mu_q32 < 0 || mu_q32 > 2 * MOTION_FIXED_ONE_Q32)
        return MOTION_E_ARG;
    return spline_tangents(key, count, &law, first, last);
}

/* Second derivative of the parabola through key[0], key[1], key[2]. */
static int spline_acc(const struct motion_key *key, int64_t *acc_q16)
{
    struct spline_chord before, after;

    if (spline_chord(key, &before) || spline_chord(key + 1, &after))
        return MOTION_E_RANGE;
    return spline_parabola_acc(&before, &after, acc_q16);
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
        key[i].acc_q16 = 0;
        if (zero || count < 3)
            continue;
        if (i == count - 1)
            from = count - 3;
        rc = spline_acc(&key[from], &key[i].acc_q16);
    }
    return rc;
}

enum spline_kind { SPLINE_LINEAR, SPLINE_CUBIC, SPLINE_QUINTIC };

static int spline_append_span(struct motion_track *track,
                              const struct motion_key *key,
                              enum spline_kind kind)
{
    const struct motion_state start = { .vel_q32 = key[0].vel_q32,
                                        .acc_q16 = key[0].acc_q16 };
    const struct motion_state end = { .pos_q32 = key[1].pos_q32,
                                      .vel_q32 = key[1].vel_q32,
                                      .acc_q16 = key[1].acc_q16 };
    const uint64_t dur = spline_distance(key[0].t_ns_q12, key[1].t_ns_q12);

    if (key[1].t_ns_q12 <= key[0].t_ns_q12 || dur > INT64_MAX)
        return MOTION_E_ARG;
    if (kind == SPLINE_LINEAR)
        return motion_track_append_line(track, (int64_t)dur, end.pos_q32);
    if (kind == SPLINE_CUBIC)
        return motion_track_append_cubic(track, (int64_t)dur, start.vel_q32,
                                         &end);
    return motion_track_append_quintic(track, (int64_t)dur, &start, &end);
}

static int spline_append(struct motion_track *track,
                         const struct motion_key *key, uint32_t count,
                         enum spline_kind kind, uint32_t *failed)
{
    const struct motion_track before = *track;

    if (failed)
        *failed = 0;
    if (count == 0)
        return MOTION_E_EMPTY;
    if (track->end.pos_q32 != key[0].pos_q32 || track->end_frac != 0)
        return MOTION_E_ARG;
    for (uint32_t i = 0; i + 1 < count; i++) {
        int rc = spline_append_span(track, &key[i], kind);
        if (rc == MOTION_OK)
            continue;
        *track = before;
        if (failed)
            *failed = i;
        return rc;
    }
    return MOTION_OK;
}

int motion_spline_append_linear(struct motion_track *track,
                                const struct motion_key *key, uint32_t count,
                                uint32_t *failed)
{
    return spline_append(track, key, count, SPLINE_LINEAR, failed);
}

int motion_spline_append_cubic(struct motion_track *track,
                               const struct motion_key *key, uint32_t count,
                               uint32_t *failed)
{
    return spline_append(track, key, count, SPLINE_CUBIC, failed);
}

int motion_spline_append_quintic(struct motion_track *track,
                                 const struct motion_key *key, uint32_t count,
                                 uint32_t *failed)
{
    return spline_append(track, key, count, SPLINE_QUINTIC, failed);
}
