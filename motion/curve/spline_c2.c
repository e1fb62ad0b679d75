/* motion/curve/spline_c2.c - cubic splines with continuous acceleration; see
 * spline.h.
 *
 * The cubics of two neighbouring spans, written with the velocities v at their
 * keys, have the same acceleration at the key between them where
 *     h1 v[i-1] + 2 (h0 + h1) v[i] + h0 v[i+1] = 3 (h1 d0 + h0 d1)
 * with spans h and chords d before (0) and after (1) it: one equation per key,
 * solved by elimination without pivots (the diagonal dominates), in time and
 * space linear in the keys.  de Boor, A Practical Guide to Splines, IV. */
#include "motion/core/err.h"
#include "motion/curve/spline_internal.h"

struct c2_row {
    struct motion_real low, diag, up, rhs;
};

static struct c2_row c2_known(struct motion_real vel)
{
    return (struct c2_row){ motion_real_zero(), motion_real_int(1),
                            motion_real_zero(), vel };
}

static struct c2_row c2_join(struct spline_chord before,
                             struct spline_chord after)
{
    return (struct c2_row){
        after.dur,
        motion_real_twice(motion_real_add(before.dur, after.dur)),
        before.dur,
        curve_times(motion_real_add(motion_real_mul(after.dur, before.vel),
                                    motion_real_mul(before.dur, after.vel)),
                    3),
    };
}

static struct c2_row c2_inner(const struct motion_key *key)
{
    if (key->has_vel)
        return c2_known(spline_read(key->vel));
    return c2_join(spline_chord(key - 1), spline_chord(key));
}

/* No jump of jerk at the key after the end's: with h0, d0 the outer span,
 *   h1 v0 + (h0 + h1) v1 = ((3 h0 + 2 h1) h1 d0 + h0^2 d1) / (h0 + h1) */
static struct c2_row c2_not_a_knot(struct spline_chord outer,
                                   struct spline_chord inner)
{
    const struct motion_real both = motion_real_add(outer.dur, inner.dur);
    const struct motion_real weight = motion_real_mul(
        inner.dur, motion_real_add(motion_real_twice(both), outer.dur));
    const struct motion_real sum =
        motion_real_add(motion_real_mul(weight, outer.vel),
                        motion_real_mul(motion_real_sqr(outer.dur), inner.vel));

    return (struct c2_row){ both, inner.dur, both, motion_real_div(sum, both) };
}

/* One end; `displacement` is 1 at the first key and -1 at the last. */
struct c2_end {
    const struct motion_key *key;
    struct spline_chord outer, inner;
    enum motion_spline_end rule;
    int displacement;
};

static struct c2_end c2_first(const struct motion_key *key, uint32_t count,
                              enum motion_spline_end rule)
{
    const struct spline_chord outer = spline_chord(key);

    return (struct c2_end){ key, outer,
                            count > 2 ? spline_chord(key + 1) : outer, rule,
                            1 };
}

static struct c2_end c2_last(const struct motion_key *key, uint32_t count,
                             enum motion_spline_end rule)
{
    const struct spline_chord outer = spline_chord(&key[count - 2]);

    return (struct c2_end){ &key[count - 1], outer,
                            count > 2 ? spline_chord(&key[count - 3]) : outer,
                            rule, -1 };
}

/* Acceleration a at the end: 2 v0 + v1 = 3 d0 -+ a h0 / 2. */
static struct c2_row c2_bent(const struct c2_end *end, struct motion_real acc)
{
    const struct motion_real one = motion_real_int(1);
    const struct motion_real bend =
        motion_real_half(motion_real_mul(acc, end->outer.dur));

    return (struct c2_row){
        one,
        motion_real_int(2),
        one,
        motion_real_sub(curve_times(end->outer.vel, 3),
                        curve_times(bend, end->displacement)),
    };
}

/* `few`: with not-a-knot at both ends of three keys only the parabola is
 * left, of two the line (spline_parabola_end gives both). */
static struct c2_row c2_end_row(const struct c2_end *end, bool few)
{
    if (end->key->has_vel)
        return c2_known(spline_read(end->key->vel));
    if (end->key->has_acc)
        return c2_bent(end, spline_read(end->key->acc));
    if (end->rule == MOTION_SPLINE_NATURAL)
        return c2_bent(end, motion_real_zero());
    if (end->rule == MOTION_SPLINE_REST)
        return c2_known(motion_real_zero());
    if (few)
        return c2_known(spline_parabola_end(end->outer, end->inner));
    return c2_not_a_knot(end->outer, end->inner);
}

/* Thomas's elimination: slot[0] holds the upper diagonal, slot[1] the right
 * side, slot[2] that of the second system where there is one. */
static void c2_eliminate(struct motion_spline_work *work, uint32_t i,
                         const struct c2_row *row)
{
    struct motion_real diag = row->diag, rhs = row->rhs;

    if (i > 0) {
        const struct motion_real *above = work[i - 1].slot;
        diag = motion_real_sub(diag, motion_real_mul(row->low, above[0]));
        rhs = motion_real_sub(rhs, motion_real_mul(row->low, above[1]));
    }
    work[i].slot[0] = motion_real_div(row->up, diag);
    work[i].slot[1] = motion_real_div(rhs, diag);
}

static int c2_open(struct motion_key *key, uint32_t count,
                   enum motion_spline_end first, enum motion_spline_end last,
                   struct motion_spline_work *work)
{
    const struct c2_end front = c2_first(key, count, first);
    const struct c2_end back = c2_last(key, count, last);
    const bool free_ends = first == MOTION_SPLINE_NOT_A_KNOT &&
                           last == MOTION_SPLINE_NOT_A_KNOT &&
                           !key[0].has_vel && !key[0].has_acc &&
                           !key[count - 1].has_vel && !key[count - 1].has_acc;
    const bool few = count == 2 || (count == 3 && free_ends);
    struct c2_row row = c2_end_row(&front, few);

    c2_eliminate(work, 0, &row);
    for (uint32_t i = 1; i + 1 < count; i++) {
        row = c2_inner(&key[i]);
        c2_eliminate(work, i, &row);
    }
    row = c2_end_row(&back, few);
    c2_eliminate(work, count - 1, &row);
    for (uint32_t i = count; i-- > 0;) {
        key[i].vel = work[i].slot[1];
        if (i + 1 < count)
            key[i].vel = motion_real_sub(
                key[i].vel, motion_real_mul(work[i].slot[0], key[i + 1].vel));
    }
    return MOTION_OK;
}

/* --- periodic ----------------------------------------------------------------
 *
 * The last key is the first again, so the n - 1 equations close to a ring.
 * Sherman & Morrison: with the corners a (first row) and b (last row) taken out
 * as a product of two vectors, (g, 0 .. b) and (1, 0 .. a/g), g = -diag[0],
 * two open systems are left. */
struct c2_ring {
    struct motion_real a, b, g;
    uint32_t count; /* of unknowns */
};

static struct c2_row c2_ring_row(const struct motion_key *key, uint32_t i,
                                 uint32_t count)
{
    if (i > 0)
        return c2_inner(&key[i]);
    if (key[0].has_vel)
        return c2_known(spline_read(key[0].vel));
    return c2_join(spline_chord(&key[count - 1]), spline_chord(key));
}

static struct c2_row c2_ring_open(const struct c2_ring *ring, struct c2_row row,
                                  uint32_t i)
{
    if (i == 0)
        row.diag = motion_real_sub(row.diag, ring->g);
    if (i == ring->count - 1)
        row.diag = motion_real_sub(
            row.diag,
            motion_real_div(motion_real_mul(ring->a, ring->b), ring->g));
    return row;
}

/* The second system has the same left side; its right side is (g, 0 .. b). */
static void c2_ring_second(struct motion_spline_work *work, uint32_t i,
                           const struct c2_ring *ring, const struct c2_row *row)
{
    struct motion_real rhs = i == 0                 ? ring->g
                             : i == ring->count - 1 ? ring->b
                                                    : motion_real_zero();
    struct motion_real diag = row->diag;

    if (i > 0) {
        const struct motion_real *above = work[i - 1].slot;
        diag = motion_real_sub(diag, motion_real_mul(row->low, above[0]));
        rhs = motion_real_sub(rhs, motion_real_mul(row->low, above[2]));
    }
    work[i].slot[2] = motion_real_div(rhs, diag);
}

static void c2_ring_back(struct motion_spline_work *work, uint32_t i)
{
    for (int n = 1; n <= 2; n++)
        work[i].slot[n] = motion_real_sub(
            work[i].slot[n],
            motion_real_mul(work[i].slot[0], work[i + 1].slot[n]));
}

static void c2_ring_solve(struct motion_key *key, struct c2_ring *ring,
                          struct motion_spline_work *work)
{
    const uint32_t n = ring->count;
    struct motion_real ratio, y, q;

    for (uint32_t i = 0; i < n; i++) {
        const struct c2_row row = c2_ring_open(ring, c2_ring_row(key, i, n), i);
        c2_eliminate(work, i, &row);
        c2_ring_second(work, i, ring, &row);
    }
    for (uint32_t i = n - 1; i-- > 0;)
        c2_ring_back(work, i);
    ratio = motion_real_div(ring->a, ring->g);
    y = motion_real_add(work[0].slot[1],
                        motion_real_mul(ratio, work[n - 1].slot[1]));
    q = motion_real_add(work[0].slot[2],
                        motion_real_mul(ratio, work[n - 1].slot[2]));
    y = motion_real_div(y, motion_real_add(q, motion_real_int(1)));
    for (uint32_t i = 0; i < n; i++)
        key[i].vel = motion_real_sub(work[i].slot[1],
                                     motion_real_mul(y, work[i].slot[2]));
}

/* Two spans: both equations hold both keys twice. */
static void c2_ring_of_two(struct motion_key *key)
{
    const struct c2_row a = c2_ring_row(key, 0, 2), b = c2_ring_row(key, 1, 2);
    const struct motion_real up = motion_real_add(a.low, a.up);
    const struct motion_real low = motion_real_add(b.low, b.up);
    const struct motion_real det = motion_real_sub(
        motion_real_mul(a.diag, b.diag), motion_real_mul(up, low));

    key[0].vel = motion_real_div(motion_real_sub(motion_real_mul(a.rhs, b.diag),
                                                 motion_real_mul(up, b.rhs)),
                                 det);
    key[1].vel = motion_real_div(motion_real_sub(motion_real_mul(a.diag, b.rhs),
                                                 motion_real_mul(low, a.rhs)),
                                 det);
}

static int c2_periodic(struct motion_key *key, uint32_t count,
                       struct motion_spline_work *work)
{
    struct c2_ring ring = { .count = count - 1 };

    if (key[0].pos_q32 != key[count - 1].pos_q32)
        return MOTION_E_ARG;
    if (count == 2) {
        key[0].vel =
            key[0].has_vel ? spline_read(key[0].vel) : motion_real_zero();
    } else if (count == 3) {
        c2_ring_of_two(key);
    } else {
        const struct c2_row top = c2_ring_row(key, 0, ring.count);
        ring.a = top.low;
        ring.b = c2_ring_row(key, ring.count - 1, ring.count).up;
        ring.g = motion_real_neg(top.diag);
        c2_ring_solve(key, &ring, work);
    }
    key[count - 1].vel = key[0].vel;
    return MOTION_OK;
}

static bool c2_is_rule(enum motion_spline_end rule)
{
    return rule == MOTION_SPLINE_REST || rule == MOTION_SPLINE_NATURAL ||
           rule == MOTION_SPLINE_NOT_A_KNOT || rule == MOTION_SPLINE_PERIODIC;
}

int motion_spline_c2(struct motion_key *key, uint32_t count,
                     enum motion_spline_end first, enum motion_spline_end last,
                     struct motion_spline_work *work)
{
    int rc;

    if (!c2_is_rule(first) || !c2_is_rule(last) ||
        (first == MOTION_SPLINE_PERIODIC) != (last == MOTION_SPLINE_PERIODIC))
        return MOTION_E_ARG;
    rc = spline_order(key, count);
    if (rc != MOTION_OK)
        return rc;
    if (count == 1) {
        key[0].vel =
            key[0].has_vel ? spline_read(key[0].vel) : motion_real_zero();
        return spline_velocities_within(key, count);
    }
    if (first == MOTION_SPLINE_PERIODIC)
        rc = c2_periodic(key, count, work);
    else
        rc = c2_open(key, count, first, last, work);
    return rc ? rc : spline_velocities_within(key, count);
}
