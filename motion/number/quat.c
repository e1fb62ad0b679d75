/* motion/number/quat.c - see quat.h. */
#include "motion/number/quat.h"

#include "motion/core/err.h"
#include "motion/core/fixed.h"
#include "motion/number/trig.h"

#define QUAT_ONE_Q62   ((int64_t)1 << 62)
#define QUAT_LOOSE_Q62 ((int64_t)1 << 42) /* 2^-20 */

/* --- arithmetic ---------------------------------------------------------- */

static void quat_add_product(struct motion_u128 *sum, int64_t a, int64_t b)
{
    struct motion_u128 p =
        motion_fixed_mul_u64(motion_fixed_abs(a), motion_fixed_abs(b));

    *sum = (a < 0) != (b < 0) ? motion_fixed_sub_u128(*sum, p)
                              : motion_fixed_add_u128(*sum, p);
}

/* a . b of four; unit vectors stay within 1, and so does every partial sum. */
static int64_t quat_dot4(const int64_t a[4], const int64_t b[4])
{
    struct motion_u128 sum = { 0, 0 };

    for (int i = 0; i < 4; i++)
        quat_add_product(&sum, a[i], b[i]);
    return (int64_t)motion_fixed_round_i128(sum, 62).lo;
}

int64_t motion_quat_dot_q62(struct motion_quat a, struct motion_quat b)
{
    return quat_dot4((const int64_t[]){ a.w, a.x, a.y, a.z },
                     (const int64_t[]){ b.w, b.x, b.y, b.z });
}

struct motion_quat motion_quat_inverse(struct motion_quat q)
{
    return (struct motion_quat){ q.w, -q.x, -q.y, -q.z };
}

struct motion_quat motion_quat_neg(struct motion_quat q)
{
    return (struct motion_quat){ -q.w, -q.x, -q.y, -q.z };
}

struct motion_quat motion_quat_mul(struct motion_quat a, struct motion_quat b)
{
    const int64_t left[4] = { a.w, a.x, a.y, a.z };

    return (struct motion_quat){
        .w = quat_dot4(left, (const int64_t[]){ b.w, -b.x, -b.y, -b.z }),
        .x = quat_dot4(left, (const int64_t[]){ b.x, b.w, b.z, -b.y }),
        .y = quat_dot4(left, (const int64_t[]){ b.y, -b.z, b.w, b.x }),
        .z = quat_dot4(left, (const int64_t[]){ b.z, b.y, -b.x, b.w }),
    };
}

int motion_quat_unit(const int64_t wxyz[4], struct motion_quat *q)
{
    struct motion_real square = motion_real_zero(), length;
    int64_t out[4];

    for (int i = 0; i < 4; i++) {
        const struct motion_real a = motion_real_int(wxyz[i]);
        square = motion_real_add(square, motion_real_mul(a, a));
    }
    if (motion_real_is_zero(square))
        return MOTION_E_RANGE;
    length = motion_real_sqrt(square);
    for (int i = 0; i < 4; i++) {
        const struct motion_real a = motion_real_int(wxyz[i]);
        (void)motion_real_round(motion_real_div(a, length), 62, &out[i]);
    }
    *q = (struct motion_quat){ out[0], out[1], out[2], out[3] };
    return MOTION_OK;
}

/* Products and angles leave a length of 1 + e, |e| < 2^-56; one Newton step to
 * 1 / |q| from 1, q (3 - |q|^2) / 2, leaves e^2. */
static struct motion_quat quat_tidy(struct motion_quat q)
{
    const int64_t off = QUAT_ONE_Q62 - motion_quat_dot_q62(q, q);
    int64_t *const part[4] = { &q.w, &q.x, &q.y, &q.z };

    for (int i = 0; i < 4; i++) {
        int64_t more = 0;
        (void)motion_fixed_mulshift(*part[i], off, 63, &more);
        *part[i] += more;
    }
    return q;
}

struct motion_dir motion_quat_turn(struct motion_quat q, struct motion_dir v)
{
    const struct motion_quat body = { 0, v.q62[0], v.q62[1], v.q62[2] };
    const struct motion_quat world =
        motion_quat_mul(motion_quat_mul(q, body), motion_quat_inverse(q));

    return (struct motion_dir){ { world.x, world.y, world.z } };
}

static int quat_check_axes(const struct motion_dir axis[3])
{
    const struct motion_dir z = motion_dir_cross(axis[0], axis[1]);

    if (!motion_dir_is_near(z, axis[2], QUAT_LOOSE_Q62) ||
        motion_fixed_abs(motion_dir_dot_q62(axis[0], axis[1])) > QUAT_LOOSE_Q62)
        return MOTION_E_ARG;
    return MOTION_OK;
}

/* Shepperd's method (J. Guidance and Control 1, 1978): of 4w^2 = 1 + trace and
 * 4x^2 = 1 + 2 m00 - trace, .. the largest one is at least 1.  All at a quarter
 * of their size, so that 1 + trace <= 4 fits. */
int motion_quat_from_axes(const struct motion_dir axis[3],
                          struct motion_quat *q)
{
    int64_t m[3][3], square[4], part[4];
    int best = 0;

    if (quat_check_axes(axis) < 0)
        return MOTION_E_ARG;
    for (int i = 0; i < 9; i++)
        m[i % 3][i / 3] = axis[i / 3].q62[i % 3] / 4;
    square[0] = QUAT_ONE_Q62 / 4 + m[0][0] + m[1][1] + m[2][2];
    for (int i = 0; i < 3; i++)
        square[i + 1] = QUAT_ONE_Q62 / 2 + 2 * m[i][i] - square[0];
    for (int i = 1; i < 4; i++)
        best = square[i] > square[best] ? i : best;
    /* Row `best` of 4 q q^T: parallel to q. */
    const int64_t wx = m[2][1] - m[1][2], wy = m[0][2] - m[2][0],
                  wz = m[1][0] - m[0][1], xy = m[1][0] + m[0][1],
                  xz = m[2][0] + m[0][2], yz = m[2][1] + m[1][2];
    const int64_t row[4][4] = {
        { square[0], wx, wy, wz },
        { wx, square[1], xy, xz },
        { wy, xy, square[2], yz },
        { wz, xz, yz, square[3] },
    };
    for (int i = 0; i < 4; i++)
        part[i] = row[best][0] < 0 ? -row[best][i] : row[best][i];
    return motion_quat_unit(part, q);
}

/* --- logarithm and exponential ------------------------------------------- */

/* q = (cos h, sin h axis): angle 2h, h = atan2(|v|, w) in 0 .. pi. */
int motion_quat_log(struct motion_quat q, struct motion_vec *rotation)
{
    const struct motion_vec v =
        motion_vec_from_dir((struct motion_dir){ { q.x, q.y, q.z } });
    const struct motion_real sine = motion_vec_length(v);

    if (motion_real_is_zero(sine)) {
        *rotation = motion_vec_zero();
        return q.w < 0 ? MOTION_E_RANGE : MOTION_OK;
    }
    const int64_t half =
        motion_trig_atan2_real(sine, motion_real_from_q(q.w, 62));
    const struct motion_real angle =
        motion_real_scale(motion_trig_rad(half), 1);
    *rotation = motion_vec_scale(v, motion_real_div(angle, sine));
    return MOTION_OK;
}

struct motion_quat motion_quat_about(struct motion_dir axis, int64_t angle_turn)
{
    /* half of the angle, towards zero; the lost bit is 2^-65 turn */
    const int64_t half = angle_turn / 2;
    struct motion_quat q;
    int64_t s;

    motion_trig_sincos(half, &s, &q.w);
    (void)motion_fixed_mulshift(axis.q62[0], s, 62, &q.x);
    (void)motion_fixed_mulshift(axis.q62[1], s, 62, &q.y);
    (void)motion_fixed_mulshift(axis.q62[2], s, 62, &q.z);
    return quat_tidy(q);
}

struct motion_quat motion_quat_exp(struct motion_vec rotation)
{
    const struct motion_real angle = motion_vec_length(rotation);
    struct motion_quat q = MOTION_QUAT_ONE;
    struct motion_dir axis;
    int64_t s;

    if (motion_vec_unit(rotation, &axis) < 0)
        return q;
    motion_trig_sincos(motion_trig_from_rad(motion_real_scale(angle, -1)), &s,
                       &q.w);
    (void)motion_fixed_mulshift(axis.q62[0], s, 62, &q.x);
    (void)motion_fixed_mulshift(axis.q62[1], s, 62, &q.y);
    (void)motion_fixed_mulshift(axis.q62[2], s, 62, &q.z);
    return quat_tidy(q);
}

/* --- curves -------------------------------------------------------------- */

int motion_quat_slerp_signed(struct motion_quat a, struct motion_quat b,
                             int64_t x_q62, struct motion_quat *q)
{
    struct motion_vec turn;

    if (x_q62 < 0 || x_q62 > QUAT_ONE_Q62)
        return MOTION_E_ARG;
    if (motion_quat_log(motion_quat_mul(motion_quat_inverse(a), b), &turn) < 0)
        return MOTION_E_RANGE;
    turn = motion_vec_scale(turn, motion_real_from_q(x_q62, 62));
    *q = quat_tidy(motion_quat_mul(a, motion_quat_exp(turn)));
    return MOTION_OK;
}

int motion_quat_slerp(struct motion_quat a, struct motion_quat b, int64_t x_q62,
                      struct motion_quat *q)
{
    if (motion_quat_dot_q62(a, b) < 0)
        b = motion_quat_neg(b);
    return motion_quat_slerp_signed(a, b, x_q62, q);
}

/* The chord from key i to its neighbour, from the body at i. */
static int quat_turn(const struct motion_quat *key, uint32_t i, uint32_t to,
                     struct motion_vec *turn)
{
    return motion_quat_log(
        motion_quat_mul(motion_quat_inverse(key[i]), key[to]), turn);
}

int motion_quat_squad_inner(const struct motion_quat *key, uint32_t count,
                            struct motion_quat *inner)
{
    if (count == 0)
        return MOTION_E_EMPTY;
    inner[0] = key[0];
    for (uint32_t i = 1; i + 1 < count; i++) {
        struct motion_vec on, back, half;
        if (quat_turn(key, i, i + 1, &on) < 0 ||
            quat_turn(key, i, i - 1, &back) < 0)
            return MOTION_E_RANGE;
        half = motion_vec_shift(motion_vec_neg(motion_vec_add(on, back)), -2);
        inner[i] = quat_tidy(motion_quat_mul(key[i], motion_quat_exp(half)));
    }
    inner[count - 1] = key[count - 1];
    return MOTION_OK;
}

int motion_quat_squad(const struct motion_quat key[2],
                      const struct motion_quat inner[2], int64_t u_q62,
                      struct motion_quat *q)
{
    struct motion_quat outside, inside;
    int64_t blend = 0;
    int err;

    if (u_q62 < 0 || u_q62 > QUAT_ONE_Q62)
        return MOTION_E_ARG;
    (void)motion_fixed_mulshift(u_q62, QUAT_ONE_Q62 - u_q62, 61, &blend);
    err = motion_quat_slerp_signed(key[0], key[1], u_q62, &outside);
    if (err == MOTION_OK)
        err = motion_quat_slerp_signed(inner[0], inner[1], u_q62, &inside);
    if (err == MOTION_OK)
        err = motion_quat_slerp_signed(outside, inside, blend, q);
    return err;
}
