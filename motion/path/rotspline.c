/* motion/path/rotspline.c - see rotspline.h.
 *
 * With x = |r|^2 and the entire functions c_k(x) = 1/k! - x/(k+2)! + x^2/(k+4)!
 * .. (c_0 = cos |r|, c_1 = sin |r| / |r|), the body's angular velocity is
 *
 *     w = r' - c2 r x r' + c3 r x (r x r')                              (1)
 *     r' = w + r x w / 2 + k r x (r x w),                               (2)
 *          k = (c2 - c3) / (4 c1) at x/4   [(1 - h cot h) / 4h^2, h = |r|/2]
 *
 * Differentiated, with d c_k / dx = (k c_{k+2} - c_{k+1}) / 2 and x' = 2 r.r':
 *
 *     w' = (1) with r'' for r', plus
 *          x' (c3' r x (r x r') - c2' r x r') + c3 r' x (r x r')         (3)
 *
 * No quotient there vanishes, so small angles are no special case.  In a span
 * of duration T from rate w0 (= r' at its start) to r' = e at its end,
 *
 *     T^2 r''(0) = 6 r - 4 T w0 - 2 T e,   T^2 r''(T) = -6 r + 2 T w0 + 4 T e
 *
 * and since r x r = 0, and (1) turns e back into the rate w1, the acceleration
 * is continuous at a key with rate w between spans p and n where
 *
 *     2/Tp M(rp) w_p + 4 (1/Tp + 1/Tn) w + 2/Tn N(rn) w_n
 *         = 6 (rp/Tp^2 + rn/Tn^2) - (3)p
 *
 * M being the matrix of (1) and N that of (2).  Only (3) is not linear. */
#include "motion/path/rotspline.h"

#include <stdbool.h>
#include <stddef.h>

#include "motion/core/err.h"
#include "motion/curve/interval.h"

#define ROTSPLINE_ROUNDS  200
#define ROTSPLINE_SETTLED (-44) /* of the largest rate */
#define ROTSPLINE_S_Q12   (INT64_C(1000000000) << 12)

/* --- (1), (2), (3) ------------------------------------------------------- */

/* Terms of the series: |r| < 8 takes 8^2n / (2n)! < 2^-64, n = 27; the terms
 * before grow to e^8, so 2^-50 is the error at most, 2^-57 up to pi. */
#define ROTSPLINE_TERMS 28

static struct motion_real rotspline_c(int k, struct motion_real x)
{
    const struct motion_real one = motion_real_int(1);
    struct motion_real sum = one;

    for (int j = ROTSPLINE_TERMS; j > 0; j--) {
        const uint64_t two = (uint64_t)(2 * j + k) * (uint64_t)(2 * j + k - 1);
        const struct motion_real inverse =
            motion_real_from_u64(UINT64_MAX / two, -64);
        sum = motion_real_mul(motion_real_mul(x, inverse), sum);
        sum = motion_real_sub(one, sum);
    }
    for (int i = 2; i <= k; i++)
        sum = motion_real_div(sum, motion_real_int(i));
    return sum;
}

/* v + factor[0] r x v + factor[1] r x (r x v) */
static struct motion_vec rotspline_bend(struct motion_vec r,
                                        struct motion_vec v,
                                        const struct motion_real factor[2])
{
    const struct motion_vec once = motion_vec_cross(r, v);
    const struct motion_vec twice = motion_vec_cross(r, once);

    return motion_vec_add(v,
                          motion_vec_add(motion_vec_scale(once, factor[0]),
                                         motion_vec_scale(twice, factor[1])));
}

/* c_2 .. c_5: two series, and c_k = 1/k! - x c_k+2. */
static void rotspline_c2_to_c5(struct motion_real x, struct motion_real c[6])
{
    const struct motion_real sixth =
        motion_real_div(motion_real_int(1), motion_real_int(6));

    c[4] = rotspline_c(4, x);
    c[5] = rotspline_c(5, x);
    c[2] = motion_real_sub(motion_real_from_q(1, 1), motion_real_mul(x, c[4]));
    c[3] = motion_real_sub(sixth, motion_real_mul(x, c[5]));
}

/* What (1) and (3) multiply with: -c2, c3; c3, 2 c2' = 2 c4 - c3 and
 * 2 c3' = 3 c5 - c4. */
static void rotspline_factors(struct motion_vec r,
                              struct motion_real to_rate[2],
                              struct motion_real extra[3])
{
    struct motion_real c[6];

    rotspline_c2_to_c5(motion_vec_dot(r, r), c);
    to_rate[0] = motion_real_neg(c[2]);
    to_rate[1] = c[3];
    extra[0] = c[3];
    extra[1] = motion_real_sub(motion_real_scale(c[4], 1), c[3]);
    extra[2] = motion_real_sub(motion_real_mul(c[5], motion_real_int(3)), c[4]);
}

/* What (2) does. */
static void rotspline_from_rate(struct motion_vec r,
                                struct motion_real from_rate[2])
{
    const struct motion_real y = motion_real_scale(motion_vec_dot(r, r), -2);
    struct motion_real c[6];

    rotspline_c2_to_c5(y, c);
    c[1] = motion_real_sub(motion_real_int(1), motion_real_mul(y, c[3]));
    from_rate[0] = motion_real_from_q(1, 1);
    from_rate[1] = motion_real_scale(
        motion_real_div(motion_real_sub(c[2], c[3]), c[1]), -2);
}

/* (3) */
static struct motion_vec rotspline_extra(struct motion_vec r,
                                         struct motion_vec rate,
                                         const struct motion_real factor[3])
{
    const struct motion_real grow = motion_vec_dot(r, rate); /* x'/2 */
    const struct motion_vec once = motion_vec_cross(r, rate);
    const struct motion_vec twice = motion_vec_cross(r, once);

    return motion_vec_add(
        motion_vec_scale(motion_vec_sub(motion_vec_scale(twice, factor[2]),
                                        motion_vec_scale(once, factor[1])),
                         grow),
        motion_vec_scale(motion_vec_cross(rate, once), factor[0]));
}

/* --- the system ---------------------------------------------------------- */

static struct motion_vec rotspline_unit(int i, struct motion_real size)
{
    struct motion_vec e = motion_vec_zero();

    e.x[i] = size;
    return e;
}

/* 3x3 matrices are lists of columns. */
static struct motion_vec rotspline_apply(const struct motion_vec column[3],
                                         struct motion_vec v)
{
    struct motion_vec sum = motion_vec_zero();

    for (int i = 0; i < 3; i++)
        sum = motion_vec_add(sum, motion_vec_scale(column[i], v.x[i]));
    return sum;
}

/* 2/T times the matrix of (1) or (2). */
static void rotspline_side(const struct motion_rotkey *span,
                           const struct motion_real factor[2],
                           struct motion_vec column[3])
{
    const struct motion_real size =
        motion_real_div(motion_real_int(2), span->dur_s);

    for (int i = 0; i < 3; i++)
        column[i] =
            rotspline_bend(span->chord, rotspline_unit(i, size), factor);
}

/* The inverse, by cross products of the columns: its rows are c1 x c2 / det, ..
 * The blocks are dominated by their diagonal, so det is not small. */
static void rotspline_invert(const struct motion_vec c[3],
                             struct motion_vec inverse[3])
{
    const struct motion_vec row[3] = { motion_vec_cross(c[1], c[2]),
                                       motion_vec_cross(c[2], c[0]),
                                       motion_vec_cross(c[0], c[1]) };
    const struct motion_real det = motion_vec_dot(c[0], row[0]);

    for (int i = 0; i < 9; i++)
        inverse[i / 3].x[i % 3] = motion_real_div(row[i % 3].x[i / 3], det);
}

/* Elimination downwards, w_i = right_i - row_i w_i+1, as far as it does not
 * depend on the right-hand side: that is done once. */
static void rotspline_factor_row(struct motion_rotkey *key, bool first)
{
    const struct motion_rotkey *const p = key - 1;
    struct motion_rotwork *const work = &key->work;
    const struct motion_real one = motion_real_int(1);
    const struct motion_real diagonal =
        motion_real_scale(motion_real_add(motion_real_div(one, p->dur_s),
                                          motion_real_div(one, key->dur_s)),
                          2);
    struct motion_vec middle[3], right[3];

    rotspline_side(p, p->work.to_rate, work->left);
    rotspline_side(key, work->from_rate, right);
    for (int i = 0; i < 3; i++) {
        middle[i] = rotspline_unit(i, diagonal);
        if (!first)
            middle[i] = motion_vec_sub(
                middle[i], rotspline_apply(work->left, p->work.row[i]));
    }
    rotspline_invert(middle, work->inverse);
    for (int i = 0; i < 3; i++)
        work->row[i] = rotspline_apply(work->inverse, right[i]);
}

/* 6 r / T^2 */
static struct motion_vec rotspline_pull(const struct motion_rotkey *key)
{
    const struct motion_real k = motion_real_div(
        motion_real_int(6), motion_real_mul(key->dur_s, key->dur_s));

    return motion_vec_scale(key->chord, k);
}

/* And as far as it does. */
static void rotspline_eliminate(struct motion_rotkey *key, uint32_t inner)
{
    for (uint32_t i = 1; i <= inner; i++) {
        const struct motion_rotkey *const p = &key[i - 1];
        struct motion_rotwork *const work = &key[i].work;
        struct motion_vec right =
            motion_vec_add(rotspline_pull(p), rotspline_pull(&key[i]));

        right = motion_vec_sub(
            right, rotspline_extra(p->chord, p->end_rate, p->work.extra));
        right = motion_vec_sub(
            right,
            rotspline_apply(work->left, i == 1 ? p->rate : p->work.right));
        work->right = rotspline_apply(work->inverse, right);
    }
}

/* And back up; returns the largest change, and the largest rate. */
static void rotspline_substitute(struct motion_rotkey *key, uint32_t inner,
                                 struct motion_real *change,
                                 struct motion_real *largest)
{
    *change = *largest = motion_real_zero();
    for (uint32_t i = inner; i > 0; i--) {
        const struct motion_vec rate =
            motion_vec_sub(key[i].work.right,
                           rotspline_apply(key[i].work.row, key[i + 1].rate));
        const struct motion_real moved =
            motion_vec_length(motion_vec_sub(rate, key[i].rate));
        const struct motion_real size = motion_vec_length(rate);

        if (motion_real_cmp(moved, *change) > 0)
            *change = moved;
        if (motion_real_cmp(size, *largest) > 0)
            *largest = size;
        key[i].rate = rate;
    }
}

static void rotspline_end_rates(struct motion_rotkey *key, uint32_t spans)
{
    for (uint32_t i = 0; i < spans; i++)
        key[i].end_rate = rotspline_bend(key[i].chord, key[i + 1].rate,
                                         key[i].work.from_rate);
}

static int rotspline_solve(struct motion_rotkey *key, uint32_t count,
                           uint32_t rounds)
{
    struct motion_real change, largest;

    rotspline_end_rates(key, count - 1);
    if (count == 2)
        return MOTION_OK;
    for (uint32_t i = 1; i + 1 < count; i++)
        rotspline_factor_row(&key[i], i == 1);
    for (uint32_t i = 0; i < (rounds > 0 ? rounds : ROTSPLINE_ROUNDS); i++) {
        rotspline_eliminate(key, count - 2);
        rotspline_substitute(key, count - 2, &change, &largest);
        rotspline_end_rates(key, count - 1);
        if (motion_real_cmp(change,
                            motion_real_scale(largest, ROTSPLINE_SETTLED)) <= 0)
            return MOTION_OK;
    }
    return rounds > 0 ? MOTION_OK : MOTION_E_DIVERGED;
}

/* --- public -------------------------------------------------------------- */

static struct motion_real rotspline_seconds(int64_t t_ns_q12)
{
    return motion_real_div(motion_real_int(t_ns_q12),
                           motion_real_int(ROTSPLINE_S_Q12));
}

/* Chords and durations; the first guess of every rate is that of the chord
 * before it. */
static int rotspline_spans(struct motion_rotkey *key, uint32_t count)
{
    for (uint32_t i = 0; i + 1 < count; i++) {
        struct motion_quat rotation =
            motion_quat_mul(motion_quat_inverse(key[i].q), key[i + 1].q);
        int64_t dur;

        if (key[i + 1].t_ns_q12 <= key[i].t_ns_q12)
            return MOTION_E_ORDER;
        if (motion_fixed_sub(key[i + 1].t_ns_q12, key[i].t_ns_q12, &dur) < 0)
            return MOTION_E_RANGE;
        if (rotation.w < 0)
            rotation = motion_quat_neg(rotation);
        (void)motion_quat_log(rotation, &key[i].chord); /* w >= 0 */
        key[i].dur_s = rotspline_seconds(dur);
        rotspline_factors(key[i].chord, key[i].work.to_rate, key[i].work.extra);
        rotspline_from_rate(key[i].chord, key[i].work.from_rate);
    }
    return MOTION_OK;
}

static struct motion_vec rotspline_chord_rate(const struct motion_rotkey *key)
{
    return motion_vec_scale(key->chord,
                            motion_real_div(motion_real_int(1), key->dur_s));
}

static void rotspline_end(struct motion_rotkey *end,
                          const struct motion_rotkey *span,
                          enum motion_rotspline_end rule)
{
    if (rule == MOTION_ROTSPLINE_CHORD)
        end->rate = rotspline_chord_rate(span);
    else if (rule == MOTION_ROTSPLINE_REST)
        end->rate = motion_vec_zero();
}

int motion_rotspline_plan(struct motion_rotspline *spline,
                          struct motion_rotkey *key, uint32_t count,
                          enum motion_rotspline_end first,
                          enum motion_rotspline_end last, uint32_t rounds)
{
    int err;

    if (count == 0)
        return MOTION_E_EMPTY;
    if (first > MOTION_ROTSPLINE_GIVEN || last > MOTION_ROTSPLINE_GIVEN)
        return MOTION_E_ARG;
    err = rotspline_spans(key, count);
    if (err == MOTION_OK && count > 1) {
        rotspline_end(&key[0], &key[0], first);
        rotspline_end(&key[count - 1], &key[count - 2], last);
        for (uint32_t i = 1; i + 1 < count; i++)
            key[i].rate = rotspline_chord_rate(&key[i - 1]);
        err = rotspline_solve(key, count, rounds);
    }
    if (err == MOTION_OK)
        *spline = (struct motion_rotspline){ key, count };
    return err;
}

/* With c = r at the end, d = T w0 and e = T r'(T),
 * r = d u + (3c - 2d - e) u^2 + (d + e - 2c) u^3. */
struct motion_quat motion_rotspline_within(const struct motion_rotkey *span,
                                           int64_t u_q62)
{
    const struct motion_real u = motion_real_from_q(u_q62, 62);
    const struct motion_vec c = span->chord;
    const struct motion_vec d = motion_vec_scale(span->rate, span->dur_s);
    const struct motion_vec e = motion_vec_scale(span->end_rate, span->dur_s);
    const struct motion_vec three =
        motion_vec_sub(motion_vec_add(d, e), motion_vec_shift(c, 1));
    const struct motion_vec two = motion_vec_sub(motion_vec_sub(c, d), three);
    const struct motion_vec r = motion_vec_scale(
        motion_vec_add(
            d, motion_vec_scale(motion_vec_add(two, motion_vec_scale(three, u)),
                                u)),
        u);

    return motion_quat_mul(span->q, motion_quat_exp(r));
}
