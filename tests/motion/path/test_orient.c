/* tests/motion/path/test_orient.c - a rotation through keys, at rest at both
 * ends, judged by formulas in long double and by its differences. */
#include "motion/path/orient.h"

#include <inttypes.h>
#include <math.h>

#include "motion/core/err.h"
#include "tests/motion/path/rotspline_at.h"
#include "tests/support/check.h"
#include "tests/support/quat_real.h"

#define SEED   UINT64_C(20260704)
#define S_Q12  (INT64_C(1000000000) << 12)
#define KEYS   7
#define ROUNDS 40

static const char *const curve_name[] = { "slerp", "squad", "c2" };

static struct motion_orient_key key[KEYS];
static struct motion_rotkey rotkey[KEYS];
static struct motion_orient orient;

static int plan(enum motion_orient_curve curve, uint32_t count)
{
    orient = (struct motion_orient){
        .curve = curve, .key = key, .count = count, .rotkey = rotkey
    };
    return motion_orient_plan(&orient);
}

/* At any times, 0.2 .. 2 s apart, or every second. */
static void any_keys(uint64_t *seed, bool even)
{
    int64_t t = check_random_in(seed, -S_Q12, S_Q12);

    for (int i = 0; i < KEYS; i++) {
        key[i] = (struct motion_orient_key){ .t = t, .q = any(seed) };
        t += even ? S_Q12 : check_random_in(seed, S_Q12 / 5, 2 * S_Q12);
    }
}

static struct motion_quat at(int64_t t)
{
    struct motion_quat q = MOTION_QUAT_ONE;

    assert_int_equal(motion_orient_at(&orient, t, &q), MOTION_OK);
    return q;
}

static struct quat mul(struct quat a, struct quat b)
{
    return (struct quat){ a.w * b.w - a.x * b.x - a.y * b.y - a.z * b.z,
                          a.w * b.x + a.x * b.w + a.y * b.z - a.z * b.y,
                          a.w * b.y - a.x * b.z + a.y * b.w + a.z * b.x,
                          a.w * b.z + a.x * b.y - a.y * b.x + a.z * b.w };
}

static struct quat scaled(struct quat q, long double by)
{
    return (struct quat){ by * q.w, by * q.x, by * q.y, by * q.z };
}

static struct quat near(struct quat q, struct quat to)
{
    return q.w * to.w + q.x * to.x + q.y * to.y + q.z * to.z < 0 ? scaled(q, -1)
                                                                 : q;
}

static struct quat conjugate(struct quat q)
{
    return (struct quat){ q.w, -q.x, -q.y, -q.z };
}

/* The rotation vector from a to b, as it is seen from a. */
static void turn(struct motion_quat from, struct motion_quat to,
                 long double vec[3])
{
    const struct quat one = { 1, 0, 0, 0 };
    const struct quat q = near(mul(conjugate(real(from)), real(to)), one);
    const long double sine = sqrtl(q.x * q.x + q.y * q.y + q.z * q.z);
    const long double by = sine > 0 ? 2 * atan2l(sine, q.w) / sine : 2;

    vec[0] = by * q.x, vec[1] = by * q.y, vec[2] = by * q.z;
}

static void rate(int64_t from, int64_t to, long double vec[3])
{
    turn(at(from), at(to), vec);
    for (int i = 0; i < 3; i++)
        vec[i] /= (long double)(to - from) / S_Q12;
}

static long double length(const long double v[3])
{
    return sqrtl(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
}

static long double apart(const long double a[3], const long double b[3])
{
    const long double d[3] = { a[0] - b[0], a[1] - b[1], a[2] - b[2] };

    return length(d);
}

static void every_curve_goes_through_its_keys(void **state)
{
    uint64_t seed = SEED;
    (void)state;
    for (int n = 0; n < ROUNDS; n++) {
        any_keys(&seed, false);
        for (int curve = 0; curve <= MOTION_ORIENT_C2; curve++) {
            assert_int_equal(plan((enum motion_orient_curve)curve, KEYS),
                             MOTION_OK);
            for (int i = 0; i < KEYS; i++)
                for (int side = -1; side <= 1; side++)
                    if (rotation_between(at(key[i].t + side), key[i].q) >
                        1e-11L)
                        fail_msg("seed %" PRIu64 " round %d: %s at key %d",
                                 SEED, n, curve_name[curve], i);
            assert_true(rotation_between(at(INT64_MIN), key[0].q) == 0);
            assert_true(rotation_between(at(INT64_MAX), key[KEYS - 1].q) == 0);
        }
    }
}

/* Rates one millisecond before and after: the difference of a smooth curve is
 * the acceleration times the time between their middles, of a step it stays. */
static long double rate_step(int64_t t, int64_t h)
{
    long double before[3], after[3];

    rate(t - h, t, before);
    rate(t, t + h, after);
    return apart(before, after);
}

static void speed_continues_at_every_key_and_is_0_at_the_ends(void **state)
{
    const int64_t h = S_Q12 / 100000;
    uint64_t seed = SEED + 1;
    (void)state;
    for (int n = 0; n < ROUNDS; n++) {
        any_keys(&seed, false);
        for (int curve = 0; curve <= MOTION_ORIENT_C2; curve++) {
            assert_int_equal(plan((enum motion_orient_curve)curve, KEYS),
                             MOTION_OK);
            for (int i = 0; i < KEYS; i++)
                if (rate_step(key[i].t, h) > 0.01L)
                    fail_msg("seed %" PRIu64 " round %d: %s at key %d: %Lg",
                             SEED, n, curve_name[curve], i,
                             rate_step(key[i].t, h));
        }
    }
}

/* The step of acceleration at a time, from second differences on both sides. */
static long double acceleration_step(int64_t t)
{
    const int64_t h = S_Q12 / 100000;
    long double v[4][3], side[2][3];

    for (int k = 0; k < 4; k++)
        rate(t + (k - 2) * h, t + (k - 1) * h, v[k]);
    for (int k = 0; k < 3; k++) {
        side[0][k] = (v[1][k] - v[0][k]) * 100000;
        side[1][k] = (v[3][k] - v[2][k]) * 100000;
    }
    return apart(side[0], side[1]);
}

/* Of slerp and c2, at the ends, too.  What is left is the jerk's, over 20 us,
 * in spans of 0.2 s and more; squad shows that a step is seen. */
static void acceleration_continues_at_every_key(void **state)
{
    uint64_t seed = SEED + 2;
    (void)state;
    for (int n = 0; n < ROUNDS; n++) {
        any_keys(&seed, false);
        for (int curve = 0; curve <= MOTION_ORIENT_C2; curve++) {
            long double most = 0;
            assert_int_equal(plan((enum motion_orient_curve)curve, KEYS),
                             MOTION_OK);
            for (int i = 0; i < KEYS; i++)
                most = fmaxl(most, acceleration_step(key[i].t));
            if ((curve == MOTION_ORIENT_SQUAD) != (most > 2))
                fail_msg("seed %" PRIu64 " round %d: %s steps by %Lg", SEED, n,
                         curve_name[curve], most);
        }
    }
}

/* The angle from a key is s(x) times the whole, s = 6x^5 - 15x^4 + 10x^3. */
static void slerp_is_an_eased_great_arc(void **state)
{
    uint64_t seed = SEED + 3;
    (void)state;
    any_keys(&seed, false);
    assert_int_equal(plan(MOTION_ORIENT_SLERP, KEYS), MOTION_OK);
    for (int n = 0; n < 500; n++) {
        const int i = (int)check_random_in(&seed, 0, KEYS - 2);
        const int64_t t = check_random_in(&seed, key[i].t, key[i + 1].t);
        const long double x = (long double)(t - key[i].t) /
                              (long double)(key[i + 1].t - key[i].t);
        const long double s = x * x * x * (10 + x * (6 * x - 15));
        long double whole[3], part[3];

        turn(key[i].q, key[i + 1].q, whole);
        turn(key[i].q, at(t), part);
        for (int k = 0; k < 3; k++)
            if (fabsl(part[k] - s * whole[k]) > 1e-14L)
                fail_msg("seed %" PRIu64 " case %d: %Lg", SEED, n,
                         part[k] - s * whole[k]);
    }
}

/* --- squad, in long double ------------------------------------------------ */

static struct quat slerp(struct quat a, struct quat b, long double x)
{
    const long double cosine = a.w * b.w + a.x * b.x + a.y * b.y + a.z * b.z;
    const long double angle = acosl(fmaxl(-1, fminl(1, cosine)));

    if (angle < 1e-9L)
        return a;
    const struct quat p = scaled(a, sinl((1 - x) * angle) / sinl(angle));
    const struct quat q = scaled(b, sinl(x * angle) / sinl(angle));
    return (struct quat){ p.w + q.w, p.x + q.x, p.y + q.y, p.z + q.z };
}

static struct quat logarithm(struct quat q)
{
    const long double sine = sqrtl(q.x * q.x + q.y * q.y + q.z * q.z);
    const long double by = sine > 0 ? atan2l(sine, q.w) / sine : 1;

    return (struct quat){ 0, by * q.x, by * q.y, by * q.z };
}

static struct quat exponential(struct quat r)
{
    const long double angle = sqrtl(r.x * r.x + r.y * r.y + r.z * r.z);
    const long double by = angle > 0 ? sinl(angle) / angle : 1;

    return (struct quat){ cosl(angle), by * r.x, by * r.y, by * r.z };
}

static struct quat inner(struct quat before, struct quat q, struct quat after)
{
    const struct quat a = logarithm(mul(conjugate(q), before));
    const struct quat b = logarithm(mul(conjugate(q), after));
    const struct quat r = { 0, -(a.x + b.x) / 4, -(a.y + b.y) / 4,
                            -(a.z + b.z) / 4 };

    return mul(q, exponential(r));
}

/* At even times the parameter of an inner span is x itself. */
static void squad_between_even_keys_is_shoemakes(void **state)
{
    uint64_t seed = SEED + 4;
    (void)state;
    for (int n = 0; n < ROUNDS; n++) {
        struct quat q[KEYS];

        any_keys(&seed, true);
        assert_int_equal(plan(MOTION_ORIENT_SQUAD, KEYS), MOTION_OK);
        for (int i = 0; i < KEYS; i++)
            q[i] = i > 0 ? near(real(key[i].q), q[i - 1]) : real(key[i].q);
        for (int i = 1; i + 2 < KEYS; i++) {
            const int64_t t = check_random_in(&seed, key[i].t, key[i + 1].t);
            const long double x = (long double)(t - key[i].t) / S_Q12;
            const struct quat outside = slerp(q[i], q[i + 1], x);
            const struct quat inside =
                slerp(inner(q[i - 1], q[i], q[i + 1]),
                      inner(q[i], q[i + 1], q[i + 2]), x);
            const struct quat want = slerp(outside, inside, 2 * x * (1 - x));
            const struct quat got = near(real(at(t)), want);
            if (difference(got, want) > 1e-13L)
                fail_msg("seed %" PRIu64 " round %d span %d: %Lg", SEED, n, i,
                         difference(got, want));
        }
    }
}

/* Inner spans of c2 are the spline; the first runs through it from rest. */
static void c2_is_the_spline_run_from_rest(void **state)
{
    uint64_t seed = SEED + 5;
    (void)state;
    any_keys(&seed, false);
    assert_int_equal(plan(MOTION_ORIENT_C2, KEYS), MOTION_OK);
    for (int n = 0; n < 500; n++) {
        const int64_t t = check_random_in(&seed, key[0].t, key[KEYS - 2].t);
        const long double dur = (long double)(key[1].t - key[0].t);
        const long double x = (long double)(t - key[0].t) / dur;
        const long double u = x * x * x * (6 + x * (3 * x - 8));
        const int64_t tau = t < key[1].t ? key[0].t + llrintl(u * dur) : t;
        struct motion_vec rate, acc;
        struct motion_quat want;

        rotspline_at(&orient.spline, tau, &want, &rate, &acc);
        if (rotation_between(at(t), want) > 1e-11L)
            fail_msg("seed %" PRIu64 " case %d", SEED, n);
    }
}

static void few_keys_and_equal_ones_are_no_special_case(void **state)
{
    uint64_t seed = SEED + 6;
    (void)state;
    for (int curve = 0; curve <= MOTION_ORIENT_C2; curve++) {
        any_keys(&seed, false);
        assert_int_equal(plan((enum motion_orient_curve)curve, 1), MOTION_OK);
        assert_true(rotation_between(at(key[0].t + 5), key[0].q) == 0);
        assert_int_equal(plan((enum motion_orient_curve)curve, 2), MOTION_OK);
        const int64_t middle = key[0].t + (key[1].t - key[0].t) / 2;
        long double whole[3], half[3];
        turn(key[0].q, key[1].q, whole);
        turn(key[0].q, at(middle), half);
        for (int k = 0; k < 3; k++)
            assert_true(fabsl(half[k] - whole[k] / 2) < 1e-11L);
        for (int i = 1; i < KEYS; i++)
            key[i].q = i % 2 ? motion_quat_neg(key[0].q) : key[0].q;
        assert_int_equal(plan((enum motion_orient_curve)curve, KEYS),
                         MOTION_OK);
        for (int64_t t = key[0].t; t < key[KEYS - 1].t; t += S_Q12 / 10)
            assert_true(rotation_between(at(t), key[0].q) < 0x1p-56L);
    }
}

static void wrong_keys_are_refused(void **state)
{
    uint64_t seed = SEED + 7;
    (void)state;
    any_keys(&seed, false);
    assert_int_equal(plan(MOTION_ORIENT_C2, 0), MOTION_E_EMPTY);
    assert_int_equal(plan((enum motion_orient_curve)3, KEYS), MOTION_E_ARG);
    key[2].t = key[1].t;
    for (int curve = 0; curve <= MOTION_ORIENT_C2; curve++)
        assert_int_equal(plan((enum motion_orient_curve)curve, KEYS),
                         MOTION_E_ORDER);
    key[0].t = INT64_MIN;
    key[1].t = INT64_MAX;
    assert_int_equal(plan(MOTION_ORIENT_SLERP, 2), MOTION_E_RANGE);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_curve_goes_through_its_keys),
        cmocka_unit_test(speed_continues_at_every_key_and_is_0_at_the_ends),
        cmocka_unit_test(acceleration_continues_at_every_key),
        cmocka_unit_test(slerp_is_an_eased_great_arc),
        cmocka_unit_test(squad_between_even_keys_is_shoemakes),
        cmocka_unit_test(c2_is_the_spline_run_from_rest),
        cmocka_unit_test(few_keys_and_equal_ones_are_no_special_case),
        cmocka_unit_test(wrong_keys_are_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
