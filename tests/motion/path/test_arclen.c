/* tests/motion/path/test_arclen.c - lengths and places on curves, judged by
 * closed forms and by midpoint sums in long double.  Takes long. */
#include <inttypes.h>
#include <math.h>
#include <stdint.h>

#include "motion/core/err.h"
#include "motion/path/arclen.h"
#include "tests/support/check.h"
#include "tests/support/real_double.h"

#define ROWS 4000

static struct motion_arclen_row row[ROWS];

/* Plane or space curves, one piece on 0 .. 1, as polynomials. */
struct sample_curve {
    const char *name;
    double coef[3][4];
    double length; /* 0: only the sum knows */
};

/* Bezier control points to powers: c0 = p0, c1 = 3 (p1 - p0), ... */
static const struct sample_curve curves[] = {
    { "line", { { 1, 3 }, { 2, -4 }, { 0.5, 12 } }, 13 },
    { "parabola", { { 0, 1 }, { 0, 0, 0.5 } }, 1.1477935746963332 },
    { "symmetric S", { { 0, 6, -12, 8 }, { 0, 9, -27, 18 } }, 0 },
    { "closed loop",
      { { 0, 9, -27, 18 }, { 0, 12, -12 }, { 0, 3, -9, 6 } },
      0 },
    { "cusp", { { 0, 3, -6, 4 }, { 0, 3, -3 } }, 1.8284271247461901 },
    { "near a cusp", { { 0, 3, -5.94, 3.94 }, { 0, 3, -3 } }, 0 },
    { "rest at both ends", { { 0, 0, 3, -2 }, { 0, 0, 6, -4 } }, 0 },
    { "tiny", { { 0, 1e-9 }, { 0, 0, 5e-10 } }, 1.1477935746963332e-9 },
    { "huge", { { 0, 1e9 }, { 0, 0, 5e8 } }, 1.1477935746963332e9 },
};

static struct motion_real coef[12], border[2];
static struct motion_arclen_poly poly = { coef, 3, 3 };
static struct motion_arclen_curve curve = { 3, 1, border, motion_arclen_poly_at,
                                            &poly };

static void take(size_t i)
{
    for (int k = 0; k < 12; k++)
        coef[k] = real_of((long double)curves[i].coef[k / 4][k % 4]);
    border[0] = motion_real_zero();
    border[1] = motion_real_int(1);
}

static long double speed_at(size_t i, long double u)
{
    long double sum = 0;

    for (int k = 0; k < 3; k++) {
        const double *c = curves[i].coef[k];
        const long double d = c[1] + u * (2 * c[2] + 3 * u * c[3]);
        sum += d * d;
    }
    return sqrtl(sum);
}

/* Midpoint sums with panels that get short at the middle and at the ends, where
 * these curves have their cusps: u = v - sin(4 pi v)/(4 pi). */
static long double oracle(size_t i, long double low, long double high)
{
    const long double pi = acosl(-1);
    const int n = 200000;
    long double sum = 0;

    for (int k = 0; k < n; k++) {
        const long double v = (k + 0.5L) / n,
                          u = v - sinl(4 * pi * v) / (4 * pi),
                          du = 1 - cosl(4 * pi * v);
        sum += speed_at(i, low + (high - low) * u) * du;
    }
    return sum * (high - low) / n;
}

static void build(size_t i, struct motion_arclen_table *table)
{
    take(i);
    assert_int_equal(
        motion_arclen_build(table, &curve, motion_real_zero(), row, ROWS),
        MOTION_OK);
}

static void near_to(const char *name, const char *what, long double got,
                    long double want, long double allowed)
{
    if (!(fabsl(got - want) <= allowed))
        fail_msg("%s: %s %.17Lg, should be %.17Lg", name, what, got, want);
}

static void lengths_match_closed_forms_and_sums(void **state)
{
    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(curves); i++) {
        struct motion_arclen_table table;
        build(i, &table);
        const long double got = real_value(table.length),
                          want = curves[i].length > 0 ? curves[i].length
                                                      : oracle(i, 0, 1);
        near_to(curves[i].name, "length", got, want, 1e-10L * want);
        near_to(curves[i].name, "stated error", real_value(table.error), 0,
                1e-11L * want);
        print_message("%-18s %4u rows %6u evaluations, error stated %.1Le\n",
                      curves[i].name, table.count, table.evaluations,
                      real_value(table.error) / got);
    }
}

static void every_rule_comes_to_the_same_and_says_its_cost(void **state)
{
    static const struct {
        const char *name;
        enum motion_arclen_rule rule;
        uint32_t panels, cost;
        double allowed; /* of the length of "symmetric S" */
    } rules[] = {
        { "rectangle", MOTION_ARCLEN_RECTANGLE, 4096, 4096, 1e-3 },
        { "trapezoid", MOTION_ARCLEN_TRAPEZOID, 1024, 1025, 1e-5 },
        { "simpson", MOTION_ARCLEN_SIMPSON, 64, 129, 1e-5 },
        { "gauss", MOTION_ARCLEN_GAUSS, 16, 192, 1e-10 },
        { "chords", MOTION_ARCLEN_CHORDS, 1024, 1025, 1e-5 },
        { "adaptive", MOTION_ARCLEN_ADAPTIVE, 0, 0, 1e-12 },
    };
    const long double want = oracle(2, 0, 1);

    (void)state;
    take(2);
    for (size_t i = 0; i < ARRAY_LEN(rules); i++) {
        struct motion_arclen_measure m;
        assert_int_equal(
            motion_arclen_measure(&curve, rules[i].rule, rules[i].panels, &m),
            MOTION_OK);
        const long double off = fabsl(real_value(m.length) - want);
        print_message("%-10s %5u evaluations, off %.1Le, says %.1Le\n",
                      rules[i].name, m.evaluations, off, real_value(m.error));
        if (off > rules[i].allowed * want + 1e-10L * want)
            fail_msg("%s: off by %Lg", rules[i].name, off);
        if (off > real_value(m.error) + 1e-10L * want)
            fail_msg("%s: off by %Lg, says %Lg", rules[i].name, off,
                     real_value(m.error));
        if (rules[i].cost)
            assert_int_equal(m.evaluations, rules[i].cost);
    }
}

static void symmetry_fools_two_chords_but_not_the_adaptive_rule(void **state)
{
    struct motion_arclen_measure two, all;

    (void)state;
    take(2);
    assert_int_equal(
        motion_arclen_measure(&curve, MOTION_ARCLEN_CHORDS, 2, &two),
        MOTION_OK);
    assert_int_equal(
        motion_arclen_measure(&curve, MOTION_ARCLEN_ADAPTIVE, 0, &all),
        MOTION_OK);
    assert_true(motion_real_is_zero(two.error)); /* it is so sure */
    assert_true(real_value(all.length) > 2 * real_value(two.length));
    near_to("S", "length", real_value(all.length), oracle(2, 0, 1), 1e-9L);
}

static void inverse_finds_the_length_it_was_given(void **state)
{
    uint64_t seed = 5;

    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(curves); i++) {
        struct motion_arclen_table table;
        build(i, &table);
        const long double length = real_value(table.length);
        for (int k = 0; k <= check_cases(24); k++) {
            const long double s =
                k < 4 ? length * powl(10, -3 * k - 1)
                      : length * check_random_in(&seed, 0, 1 << 30) / (1 << 30);
            struct motion_arclen_place place;
            motion_arclen_find(&table, real_of(s), &place);
            const long double x = real_value(place.x);
            const long double got =
                x > 0.5L ? length - oracle(i, x, 1) : oracle(i, 0, x);
            near_to(curves[i].name, "length at u(s)", got, s, 1e-9L * length);
            assert_true(real_value(place.error) <= 1e-11L * length);
            assert_true(place.evaluations < 300);
        }
    }
}

static void inverse_never_goes_back(void **state)
{
    const int places = check_cases(2000);
    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(curves); i++) {
        struct motion_arclen_table table;
        long double last = -1;
        build(i, &table);
        for (int k = -10; k <= places + 10; k++) {
            struct motion_arclen_place place;
            motion_arclen_find(
                &table, real_of(real_value(table.length) * k / places), &place);
            assert_true(real_value(place.x) >= last);
            last = real_value(place.x);
        }
        assert_true(last == 1);
    }
}

/* A camera's plan is made of such looks: one Gauss sum of 8 places each, where
 * the curve is smooth, and the ends of the panel. */
static void a_place_takes_one_sum_on_average(void **state)
{
    const uint32_t parts = (uint32_t)check_cases(1000);
    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(curves); i++) {
        struct motion_arclen_table table;
        uint32_t sum = 0;
        build(i, &table);
        for (uint32_t k = 1; k < parts; k++) {
            struct motion_arclen_place place;
            motion_arclen_find(
                &table, real_of(real_value(table.length) * k / parts), &place);
            sum += place.evaluations;
        }
        print_message("%-18s %.1f evaluations a place\n", curves[i].name,
                      (double)sum / (parts - 1));
        assert_true(sum < 25 * (parts - 1));
    }
}

static void by_length_gives_unit_tangents_and_curvature(void **state)
{
    struct motion_arclen_point point;

    (void)state;
    take(1); /* y = x^2/2: curvature 1 / (1 + x^2)^1.5 */
    motion_arclen_by_length(&curve, 0, real_of(0.5L), &point);
    long double t = 0, k = 0;
    for (int i = 0; i < 3; i++) {
        t += powl(real_value(point.d1[i]), 2);
        k += powl(real_value(point.d2[i]), 2);
    }
    near_to("parabola", "|T|", t, 1, 1e-15L);
    near_to("parabola", "curvature", sqrtl(k), powl(1.25L, -1.5L), 1e-15L);

    take(6); /* at rest: the direction all the same */
    motion_arclen_by_length(&curve, 0, motion_real_zero(), &point);
    near_to("rest", "Tx", real_value(point.d1[0]), sqrtl(0.2L), 1e-15L);
    motion_arclen_by_length(&curve, 0, motion_real_int(1), &point);
    near_to("rest", "Tx", real_value(point.d1[0]), sqrtl(0.2L), 1e-15L);
}

static void bad_curves_and_rooms_are_refused(void **state)
{
    struct motion_arclen_table table;
    struct motion_arclen_measure m;
    struct motion_arclen_curve bad;

    (void)state;
    take(2);
#define BUILD(curve, tolerance, rows)                                          \
    motion_arclen_build(&table, curve, tolerance, row, rows)
    assert_int_equal(BUILD(&curve, motion_real_zero(), 3), MOTION_E_FULL);
    assert_int_equal(BUILD(&curve, motion_real_zero(), 0), MOTION_E_FULL);
    assert_int_equal(BUILD(&curve, motion_real_int(-1), ROWS), MOTION_E_ARG);
    bad = curve;
    bad.pieces = 0;
    assert_int_equal(BUILD(&bad, motion_real_zero(), ROWS), MOTION_E_EMPTY);
    bad = curve;
    bad.axes = 9;
    assert_int_equal(BUILD(&bad, motion_real_zero(), ROWS), MOTION_E_ARG);
    border[1] = border[0];
    assert_int_equal(BUILD(&curve, motion_real_zero(), ROWS), MOTION_E_ORDER);
    take(2);
    assert_int_equal(
        motion_arclen_measure(&curve, MOTION_ARCLEN_SIMPSON, 3, &m),
        MOTION_E_ARG);
    assert_int_equal(
        motion_arclen_measure(&curve, (enum motion_arclen_rule)9, 4, &m),
        MOTION_E_ARG);
}

static void a_point_has_no_length_and_one_place(void **state)
{
    struct motion_arclen_table table;
    struct motion_arclen_place place;

    (void)state;
    take(0);
    for (int k = 0; k < 12; k++)
        coef[k] = motion_real_zero();
    assert_int_equal(
        motion_arclen_build(&table, &curve, motion_real_zero(), row, ROWS),
        MOTION_OK);
    assert_true(motion_real_is_zero(table.length));
    motion_arclen_find(&table, motion_real_zero(), &place);
    assert_int_equal(place.piece, 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(lengths_match_closed_forms_and_sums),
        cmocka_unit_test(every_rule_comes_to_the_same_and_says_its_cost),
        cmocka_unit_test(symmetry_fools_two_chords_but_not_the_adaptive_rule),
        cmocka_unit_test(inverse_finds_the_length_it_was_given),
        cmocka_unit_test(inverse_never_goes_back),
        cmocka_unit_test(a_place_takes_one_sum_on_average),
        cmocka_unit_test(by_length_gives_unit_tangents_and_curvature),
        cmocka_unit_test(bad_curves_and_rooms_are_refused),
        cmocka_unit_test(a_point_has_no_length_and_one_place),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
