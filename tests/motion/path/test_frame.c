/* tests/motion/path/test_frame.c - frames along curves whose frames are known:
 * helix, circle, line, a figure of eight's inflection, a polynomial. */
#include <inttypes.h>
#include <math.h>

#include "motion/core/err.h"
#include "motion/number/trig.h"
#include "motion/path/frame.h"
#include "tests/motion/path/frame_walk.h"
#include "tests/support/check.h"
#include "tests/support/real_double.h"

#define SEED UINT64_C(20250313)
#define ONE  ((int64_t)1 << 62)
#define PI   3.141592653589793238462643383279502884L

static struct motion_real whole(int64_t a)
{
    return motion_real_int(a);
}

static long double apart(struct motion_dir a, const long double b[3])
{
    long double most = 0;

    for (int i = 0; i < 3; i++)
        most = fmaxl(most, fabsl(q62(a.q62[i]) - b[i]));
    return most;
}

/* --- a helix: (a cos, a sin, b u), u in 2^-50 turns; b = 0 a circle ------ */

struct helix {
    int64_t a, b; /* in units, rise per radian */
};

#define HELIX_TURN ((int64_t)1 << 50)

static int helix_at(const void *context, int64_t u, int order,
                    struct motion_curve_point *point)
{
    const struct helix *const h = context;
    struct motion_vec *const d[4] = { &point->pos, &point->d1, &point->d2,
                                      &point->d3 };
    (void)order;

    for (int i = 0; i < 4; i++) {
        int64_t s, c;
        motion_trig_sincos((int64_t)(((uint64_t)u << 14) + ((uint64_t)i << 62)),
                           &s, &c);
        *d[i] = motion_vec_zero();
        d[i]->x[0] = motion_real_mul(whole(h->a), motion_real_from_q(c, 62));
        d[i]->x[1] = motion_real_mul(whole(h->a), motion_real_from_q(s, 62));
    }
    /* u 2 pi / 2^50 = (u 2^13) rad(2^-64 turn) 2 */
    point->pos.x[2] = motion_real_mul(
        whole(h->b), motion_real_mul(motion_real_from_q(u, 49),
                                     motion_trig_rad((int64_t)1 << 62)));
    point->pos.x[2] = motion_real_scale(point->pos.x[2], 1);
    point->d1.x[2] = whole(h->b);
    return MOTION_OK;
}

static struct frame_curve helix_curve(const struct helix *helix)
{
    return (struct frame_curve){ helix_at, helix, 0, 4 * HELIX_TURN };
}

static void a_helix_has_constant_curvature_and_torsion(void **state)
{
    static const struct helix rows[] = {
        { 3, 1 }, { 1, -2 }, { 5, 0 }, { 1000000, 1 }
    };
    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(rows); i++) {
        const long double a = (long double)rows[i].a,
                          b = (long double)rows[i].b;
        const long double c = sqrtl(a * a + b * b);
        const struct frame_curve curve = helix_curve(&rows[i]);

        for (int k = 0; k < 64; k++) {
            const long double at = 2 * PI * k / 16;
            const long double t[3] = { -a * sinl(at) / c, a * cosl(at) / c,
                                       b / c };
            const long double n[3] = { -cosl(at), -sinl(at), 0 };
            const long double side[3] = { b * sinl(at) / c, -b * cosl(at) / c,
                                          a / c };
            struct motion_curve_point point;
            struct motion_frenet f;

            (void)curve.at(curve.context, HELIX_TURN / 16 * k, 3, &point);
            assert_int_equal(motion_frame_frenet(&point, &f), MOTION_FRENET_OK);
            assert_true(fabsl(real_value(f.curvature) * c * c / a - 1) <
                        1e-15L);
            assert_true(fabsl(real_value(f.torsion) - b / (c * c)) < 1e-15L);
            if (apart(f.t, t) > 1e-15L || apart(f.n, n) > 1e-15L ||
                apart(f.b, side) > 1e-15L)
                fail_msg("helix %zu at %d/16", i, k);
        }
    }
}

/* Along a helix Frenet's frame turns by the torsion, tau s; the rotation-
 * minimising frame does not, so it falls back by that angle. */
static long double helix_frame_error(const struct helix *helix,
                                     const struct motion_frame *frame,
                                     long double at)
{
    const long double a = (long double)helix->a, b = (long double)helix->b;
    const long double c = sqrtl(a * a + b * b), back = -b / c * at;
    const long double n[3] = { -cosl(at), -sinl(at), 0 };
    const long double side[3] = { b * sinl(at) / c, -b * cosl(at) / c, a / c };
    long double want[3];

    for (int i = 0; i < 3; i++)
        want[i] = cosl(back) * n[i] + sinl(back) * side[i];
    return apart(frame->r, want);
}

static struct motion_frame helix_start(const struct frame_curve *curve)
{
    const struct motion_dir inwards = { { -ONE, 0, 0 } };
    struct motion_curve_point point;
    struct motion_frame frame;
    struct motion_dir t;

    assert_int_equal(frame_tangent(curve, 0, &point, &t), MOTION_OK);
    assert_int_equal(motion_frame_start(t, inwards, &frame), MOTION_OK);
    return frame;
}

static void double_reflection_is_of_fourth_order(void **state)
{
    static const struct helix helix = { 3, 1 };
    const struct frame_curve curve = helix_curve(&helix);
    long double error[3];
    (void)state;
    for (int k = 0; k < 3; k++) {
        static struct motion_frame frame[1025];
        static int64_t u[1025];
        const int steps = 64 << k;

        for (int i = 0; i <= steps; i++)
            u[i] = 4 * HELIX_TURN / steps * i;
        frame[0] = helix_start(&curve);
        assert_int_equal(frame_table(&curve, u, (uint32_t)steps + 1, frame),
                         MOTION_OK);
        error[k] = helix_frame_error(&helix, &frame[steps], 8 * PI);
    }
    assert_true(error[0] < 1e-4L);
    for (int k = 0; k < 2; k++) {
        if (error[k] / error[k + 1] < 14 || error[k] / error[k + 1] > 18)
            fail_msg("%Lg to %Lg", error[k], error[k + 1]);
    }
}

static void a_frame_stays_right_handed_and_perpendicular(void **state)
{
    static const struct helix helix = { 2, 1 };
    const struct frame_curve curve = helix_curve(&helix);
    struct motion_frame frame = helix_start(&curve);
    (void)state;
    for (int i = 0; i < 32; i++) {
        assert_int_equal(frame_carry(&curve, HELIX_TURN / 8 * i,
                                     HELIX_TURN / 8 * (i + 1), &frame),
                         MOTION_OK);
        assert_true(helix_frame_error(&helix, &frame, PI / 4 * (i + 1)) <
                    1e-12L);
        const struct motion_dir s = motion_dir_cross(frame.t, frame.r);
        assert_true(motion_fixed_abs(motion_dir_dot_q62(frame.t, frame.r)) <
                    16);
        assert_true(
            motion_fixed_abs(motion_dir_dot_q62(frame.r, frame.r) - ONE) < 16);
        for (int k = 0; k < 3; k++)
            assert_int_equal(s.q62[k], frame.s.q62[k]);
    }
}

/* --- polynomials, and where there is no frame ---------------------------- */

static struct motion_vec vec(int64_t x, int64_t y, int64_t z)
{
    return (struct motion_vec){ { whole(x), whole(y), whole(z) } };
}

static void a_straight_stretch_is_flat_not_garbage(void **state)
{
    static const struct {
        const char *name;
        int64_t d2[3];
    } rows[] = {
        { "no second derivative", { 0, 0, 0 } },
        { "along the tangent", { 3, 6, 9 } },
        { "against it", { -1, -2, -3 } },
    };
    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(rows); i++) {
        const struct motion_curve_point point = {
            .pos = vec(0, 0, 0),
            .d1 = vec(1, 2, 3),
            .d2 = vec(rows[i].d2[0], rows[i].d2[1], rows[i].d2[2]),
            .d3 = vec(5, -7, 11),
        };
        struct motion_frenet f;
        assert_int_equal(motion_frame_frenet(&point, &f), MOTION_FRENET_FLAT);
        assert_true(motion_real_is_zero(f.curvature));
        assert_true(motion_real_is_zero(f.torsion));
        for (int k = 0; k < 3; k++) {
            assert_int_equal(f.n.q62[k], 0);
            assert_int_equal(f.b.q62[k], 0);
        }
        assert_true(f.t.q62[0] > 0);
    }
}

static void at_rest_there_is_no_frenet_frame(void **state)
{
    const struct motion_curve_point point = { .pos = vec(0, 0, 0),
                                              .d1 = vec(0, 0, 0),
                                              .d2 = vec(0, 5, 0),
                                              .d3 = vec(0, 0, 2) };
    struct motion_frenet f;
    (void)state;
    assert_int_equal(motion_frame_frenet(&point, &f), MOTION_E_RANGE);
}

/* (u, u^3, 0) for u in 2^-20 */
static int inflection_at(const void *context, int64_t u, int order,
                         struct motion_curve_point *point)
{
    const struct motion_real x = motion_real_from_q(u, 20);
    const struct motion_real zero = motion_real_zero();
    (void)context;
    (void)order;
    point->pos =
        (struct motion_vec){ { x, motion_real_mul(motion_real_sqr(x), x),
                               zero } };
    point->d1 = (struct motion_vec){
        { whole(1), motion_real_mul(whole(3), motion_real_sqr(x)), zero }
    };
    point->d2 =
        (struct motion_vec){ { zero, motion_real_mul(whole(6), x), zero } };
    point->d3 = vec(0, 6, 0);
    return MOTION_OK;
}

static void through_an_inflection_the_frame_does_not_flip(void **state)
{
    /* N flips at 0, r does not */
    const struct frame_curve curve = { inflection_at, NULL, -(1 << 20),
                                       1 << 20 };
    const struct motion_dir up = { { 0, 0, ONE } };
    struct motion_curve_point p;
    struct motion_frenet before, after;
    struct motion_frame frame;
    struct motion_dir t;
    (void)state;
    (void)curve.at(curve.context, -1000, 3, &p);
    assert_int_equal(motion_frame_frenet(&p, &before), MOTION_FRENET_OK);
    (void)curve.at(curve.context, 1000, 3, &p);
    assert_int_equal(motion_frame_frenet(&p, &after), MOTION_FRENET_OK);
    assert_true(motion_dir_dot_q62(before.n, after.n) < -ONE / 2);
    (void)curve.at(curve.context, 0, 3, &p);
    assert_int_equal(motion_frame_frenet(&p, &after), MOTION_FRENET_FLAT);
    assert_int_equal(frame_tangent(&curve, curve.first, &p, &t), MOTION_OK);
    (void)motion_frame_start(t, up, &frame);
    assert_int_equal(frame_carry(&curve, curve.first, curve.last, &frame),
                     MOTION_OK);
    assert_true(frame.r.q62[2] > ONE - 64);
}

static void a_step_without_a_chord_turns_the_shortest_way(void **state)
{
    const struct motion_dir x = { { ONE, 0, 0 } }, y = { { 0, ONE, 0 } };
    struct motion_frame from, to;
    (void)state;
    assert_int_equal(motion_frame_start(x, y, &from), MOTION_OK);
    assert_int_equal(motion_frame_step(&from, motion_vec_zero(), y, &to),
                     MOTION_OK);
    assert_true(to.r.q62[0] < -ONE + 64); /* x to y takes y to -x */
    assert_int_equal(
        motion_frame_step(&from, motion_vec_zero(), motion_dir_neg(x), &to),
        MOTION_E_RANGE);
    assert_int_equal(
        motion_frame_step(&from, vec(1, 0, 0), motion_dir_neg(x), &to),
        MOTION_E_RANGE);
    assert_int_equal(motion_frame_start(x, x, &to), MOTION_E_ARG);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_helix_has_constant_curvature_and_torsion),
        cmocka_unit_test(double_reflection_is_of_fourth_order),
        cmocka_unit_test(a_frame_stays_right_handed_and_perpendicular),
        cmocka_unit_test(a_straight_stretch_is_flat_not_garbage),
        cmocka_unit_test(at_rest_there_is_no_frenet_frame),
        cmocka_unit_test(through_an_inflection_the_frame_does_not_flip),
        cmocka_unit_test(a_step_without_a_chord_turns_the_shortest_way),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
