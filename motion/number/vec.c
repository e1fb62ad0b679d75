/* motion/number/vec.c - see vec.h. */
#include "motion/number/vec.h"

#include "motion/core/err.h"
#include "motion/core/fixed.h"

#define VEC_PARALLEL_Q62 ((int64_t)1 << 32)

struct motion_vec motion_vec_zero(void)
{
    return (struct motion_vec){ { motion_real_zero(), motion_real_zero(),
                                  motion_real_zero() } };
}

static struct motion_vec vec_from(const int64_t from[3], int32_t exponent)
{
    struct motion_vec v;

    for (int i = 0; i < 3; i++)
        v.x[i] = motion_real_from_q(from[i], -exponent);
    return v;
}

struct motion_vec motion_vec_from_q32(const int64_t point_q32[3])
{
    return vec_from(point_q32, -32);
}

struct motion_vec motion_vec_from_dir(struct motion_dir dir)
{
    return vec_from(dir.q62, -62);
}

struct motion_vec motion_vec_add(struct motion_vec a, struct motion_vec b)
{
    for (int i = 0; i < 3; i++)
        a.x[i] = motion_real_add(a.x[i], b.x[i]);
    return a;
}

struct motion_vec motion_vec_sub(struct motion_vec a, struct motion_vec b)
{
    for (int i = 0; i < 3; i++)
        a.x[i] = motion_real_sub(a.x[i], b.x[i]);
    return a;
}

struct motion_vec motion_vec_neg(struct motion_vec a)
{
    for (int i = 0; i < 3; i++)
        a.x[i] = motion_real_neg(a.x[i]);
    return a;
}

struct motion_vec motion_vec_scale(struct motion_vec a, struct motion_real k)
{
    for (int i = 0; i < 3; i++)
        a.x[i] = motion_real_mul(a.x[i], k);
    return a;
}

struct motion_vec motion_vec_shift(struct motion_vec a, int32_t bits)
{
    for (int i = 0; i < 3; i++)
        a.x[i] = motion_real_scale(a.x[i], bits);
    return a;
}

struct motion_real motion_vec_dot(struct motion_vec a, struct motion_vec b)
{
    struct motion_real sum = motion_real_zero();

    for (int i = 0; i < 3; i++)
        sum = motion_real_add(sum, motion_real_mul(a.x[i], b.x[i]));
    return sum;
}

struct motion_vec motion_vec_cross(struct motion_vec a, struct motion_vec b)
{
    struct motion_vec c;

    for (int i = 0; i < 3; i++) {
        const int j = (i + 1) % 3, k = (i + 2) % 3;
        c.x[i] = motion_real_sub(motion_real_mul(a.x[j], b.x[k]),
                                 motion_real_mul(a.x[k], b.x[j]));
    }
    return c;
}

struct motion_real motion_vec_length(struct motion_vec a)
{
    return motion_real_sqrt(motion_vec_dot(a, a));
}

/* a * 2^62 / length towards zero, length as Q.1. */
static int64_t vec_part(int64_t a, uint64_t length_q1)
{
    const uint64_t size = motion_fixed_abs(a);
    uint64_t part = 0;

    (void)motion_fixed_div_u128((struct motion_u128){ size >> 1, size << 63 },
                                length_q1, &part, 0);
    return a < 0 ? -(int64_t)part : (int64_t)part;
}

/* In whole numbers of up to 62 bits: a sum of three squares is below 2^126, so
 * the root has a bit to spare. */
int motion_vec_unit(struct motion_vec a, struct motion_dir *unit)
{
    struct motion_u128 sum = { 0, 0 };
    int32_t exponent = MOTION_REAL_ZERO_E;
    uint64_t length_q1;
    int64_t whole[3] = { 0, 0, 0 };

    for (int i = 0; i < 3; i++)
        exponent = a.x[i].e > exponent ? a.x[i].e : exponent;
    if (exponent == MOTION_REAL_ZERO_E)
        return MOTION_E_RANGE;
    (void)motion_vec_round(a, -exponent, whole);
    for (int i = 0; i < 3; i++) {
        const uint64_t size = motion_fixed_abs(whole[i]);
        sum = motion_fixed_add_u128(sum, motion_fixed_mul_u64(size, size));
    }
    length_q1 = motion_fixed_isqrt_u128(motion_fixed_shl_u128(sum, 2));
    for (int i = 0; i < 3; i++)
        unit->q62[i] = vec_part(whole[i], length_q1);
    return MOTION_OK;
}

int motion_vec_round(struct motion_vec a, int32_t bits, int64_t result[3])
{
    int64_t rounded[3];

    for (int i = 0; i < 3; i++) {
        if (motion_real_round(a.x[i], bits, &rounded[i]) < 0)
            return MOTION_E_RANGE;
    }
    for (int i = 0; i < 3; i++)
        result[i] = rounded[i];
    return MOTION_OK;
}

/* --- directions ---------------------------------------------------------- */

struct motion_dir motion_dir_neg(struct motion_dir a)
{
    for (int i = 0; i < 3; i++)
        a.q62[i] = -a.q62[i];
    return a;
}

/* Halves, so that opposite directions do not overflow. */
bool motion_dir_is_near(struct motion_dir a, struct motion_dir b,
                        int64_t off_q62)
{
    for (int i = 0; i < 3; i++) {
        if (motion_fixed_abs(a.q62[i] / 2 - b.q62[i] / 2) >
            (uint64_t)off_q62 / 2)
            return false;
    }
    return true;
}

/* Components are below 1 + 2^-60, so no product is above 2^124.1 and the sum of
 * three fits; what is rounded is at most 1 + 2^-59 (Cauchy-Schwarz). */
static struct motion_u128 vec_product(int64_t a, int64_t b)
{
    struct motion_u128 p =
        motion_fixed_mul_u64(motion_fixed_abs(a), motion_fixed_abs(b));

    return (a < 0) != (b < 0) ? motion_fixed_neg_i128(p) : p;
}

static int64_t vec_q62(struct motion_u128 sum)
{
    return (int64_t)motion_fixed_round_i128(sum, 62).lo;
}

int64_t motion_dir_dot_q62(struct motion_dir a, struct motion_dir b)
{
    struct motion_u128 sum = { 0, 0 };

    for (int i = 0; i < 3; i++)
        sum = motion_fixed_add_u128(sum, vec_product(a.q62[i], b.q62[i]));
    return vec_q62(sum);
}

struct motion_dir motion_dir_cross(struct motion_dir a, struct motion_dir b)
{
    struct motion_dir c;

    for (int i = 0; i < 3; i++) {
        const int j = (i + 1) % 3, k = (i + 2) % 3;
        c.q62[i] = vec_q62(motion_fixed_sub_u128(
            vec_product(a.q62[j], b.q62[k]), vec_product(a.q62[k], b.q62[j])));
    }
    return c;
}

struct motion_dir motion_dir_turn(struct motion_dir dir, struct motion_dir axis,
                                  int64_t sin_q62, int64_t cos_q62)
{
    const struct motion_dir side = motion_dir_cross(axis, dir);

    for (int i = 0; i < 3; i++)
        dir.q62[i] =
            vec_q62(motion_fixed_add_u128(vec_product(dir.q62[i], cos_q62),
                                          vec_product(side.q62[i], sin_q62)));
    return dir;
}

int motion_dir_perpendicular(struct motion_dir a, struct motion_dir axis,
                             struct motion_dir *unit)
{
    const struct motion_real along =
        motion_real_from_q(motion_dir_dot_q62(a, axis), 62);
    const struct motion_vec rest =
        motion_vec_sub(motion_vec_from_dir(a),
                       motion_vec_scale(motion_vec_from_dir(axis), along));

    if (motion_real_cmp(motion_vec_length(rest),
                        motion_real_from_q(VEC_PARALLEL_Q62, 62)) < 0)
        return MOTION_E_RANGE;
    return motion_vec_unit(rest, unit);
}
