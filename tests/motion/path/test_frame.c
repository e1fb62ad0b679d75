/* tests/motion/path/test_frame.c - frames along curves whose frames are known:
 * helix, circle, line, a figure of eight's inflection, a polynomial. */
#include <inttypes.h>
#include <math.h>

#include "motion/core/err.h"
#include "motion/number/trig.h"
#include "motion/path/frame.h"
#include "motion/path/polycurve.h"
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

static struct motion_curve helix_curve(const struct helix *helix)
{
    return (struct motion_curve){ helix_at, helix, 0, 4 * HELIX_TURN };
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
        const struct motion_curve curve = helix_curve(&rows[i]);

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

static struct motion_frame helix_start(const struct motion_curve *curve)
{
    const struct motion_dir inwards = { { -ONE, 0, 0 } };
    struct motion_curve_point point;
    struct motion_frame frame;
    struct motion_dir t;

    (void)curve->at(curve->context, 0, 3, &point);
    assert_int_equal(motion_frame_tangent(&point, MOTION_FRAME_AFTER, &t),
                     MOTION_OK);
    assert_int_equal(motion_frame_start(t, inwards, &frame), MOTION_OK);
    return frame;
}

static void double_reflection_is_of_fourth_order(void **state)
{
    static const struct helix helix = { 3, 1 };
    const struct motion_curve curve = helix_curve(&helix);
    long double error[3];
    (void)state;
    for (int k = 0; k < 3; k++) {
        static struct motion_frame frame[1025];
        static int64_t u[1025];
        const int steps = 64 << k;

        for (int i = 0; i <= steps; i++)
            u[i] = 4 * HELIX_TURN / steps * i;
        frame[0] = helix_start(&curve);
        assert_int_equal(
            motion_frame_table(&curve, u, (uint32_t)steps + 1, frame),
            MOTION_OK);
        error[k] = helix_frame_error(&helix, &frame[steps], 8 * PI);
    }
    assert_true(error[0] < 1e-4L);
    for (int k = 0; k < 2; k++) {
        if (error[k] / error[k + 1] < 14 || error[k] / error[k + 1] > 18)
            fail_msg("%Lg to %Lg", error[k], error[k + 1]);
    }
}

static void the_carried_frame_is_as_good_as_asked(void **state)
{
    static const struct helix rows[] = { { 3, 1 }, { 1, -2 }, { 5, 0 } };
    static const int bits[] = { 16, 24, 36 };
    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(rows); i++) {
        const struct motion_curve curve = helix_curve(&rows[i]);
        for (size_t k = 0; k < ARRAY_LEN(bits); k++) {
            struct motion_frame frame = helix_start(&curve);
            assert_int_equal(motion_frame_carry(&curve, 0, 4 * HELIX_TURN,
                                                ONE >> bits[k], &frame),
                             MOTION_OK);
            const long double off = helix_frame_error(&rows[i], &frame, 8 * PI);
            /* extrapolation leaves well under the tolerance of each step */
            if (off > 4 * ldexpl(1, -bits[k]) && off > 1e-13L)
                fail_msg("helix %zu, 2^-%d: off %Lg", i, bits[k], off);
        }
    }
}

static void a_frame_stays_right_handed_and_perpendicular(void **state)
{
    static const struct helix helix = { 2, 1 };
    const struct motion_curve curve = helix_curve(&helix);
    struct motion_frame frame = helix_start(&curve);
    (void)state;
    for (int i = 0; i < 32; i++) {
        assert_int_equal(motion_frame_carry(&curve, HELIX_TURN / 8 * i,
                                            HELIX_TURN / 8 * (i + 1), ONE >> 30,
                                            &frame),
                         MOTION_OK);
        const struct motion_dir s = motion_dir_cross(frame.t, frame.r);
        assert_true(motion_fixed_abs(motion_dir_dot_q62(frame.t, frame.r)) <
                    16);
        assert_true(
            motion_fixed_abs(motion_dir_dot_q62(frame.r, frame.r) - ONE) < 16);
        for (int k = 0; k < 3; k++)
            assert_int_equal(s.q62[k], frame.s.q62[k]);
    }
}

/* --- closed curves ------------------------------------------------------- */

#define RING 257

/* A circle that also goes up and down twice: not plane, so it twists. */
static int ring_at(const void *context, int64_t u, int order,
                   struct motion_curve_point *point)
{
    static const struct helix circle = { 3, 0 };
    struct motion_vec *const d[4] = { &point->pos, &point->d1, &point->d2,
                                      &point->d3 };
    const int64_t rise = *(const int64_t *)context;
    int err = helix_at(&circle, u, order, point);

    for (int i = 0; i < 4; i++) {
        int64_t s, c;
        motion_trig_sincos((int64_t)(((uint64_t)u << 15) + ((uint64_t)i << 62)),
                           &s, &c);
        /* an eighth of a turn off: else it is its own mirror image */
        int64_t s2, c2;
        motion_trig_sincos((int64_t)(((uint64_t)u << 15) + ((uint64_t)i << 62) +
                                     ((uint64_t)1 << 61)),
                           &s2, &c2);
        d[i]->x[2] = motion_real_scale(
            motion_real_mul(whole(rise), motion_real_from_q(c2, 62)), i);
        d[i]->x[0] = motion_real_add(
            d[i]->x[0],
            motion_real_scale(
                motion_real_mul(whole(rise), motion_real_from_q(s, 62)), i));
    }
    return err;
}

static void ring_frames(const int64_t *rise, struct motion_frame *frame,
                        uint64_t *weight)
{
    const struct motion_curve curve = { ring_at, rise, 0, HELIX_TURN };
    const struct motion_dir up = { { 0, 0, ONE } };
    struct motion_curve_point point, before;
    struct motion_dir t;
    int64_t u[RING], chord;

    for (int i = 0; i < RING; i++)
        u[i] = HELIX_TURN / (RING - 1) * i;
    (void)ring_at(rise, 0, 3, &point);
    (void)motion_frame_tangent(&point, MOTION_FRAME_AFTER, &t);
    assert_int_equal(motion_frame_start(t, up, frame), MOTION_OK);
    assert_int_equal(motion_frame_table(&curve, u, RING, frame), MOTION_OK);
    weight[0] = 0;
    for (int i = 1; i < RING; i++) {
        before = point;
        (void)ring_at(rise, u[i], 3, &point);
        (void)motion_real_round(
            motion_vec_length(motion_vec_sub(point.pos, before.pos)), 32,
            &chord);
        weight[i] = weight[i - 1] + (uint64_t)chord;
    }
}

static void a_closed_curve_ends_as_it_began_twist_spread_evenly(void **state)
{
    static const int64_t rise[] = { 0, 1, 2 };
    (void)state;
    for (size_t k = 0; k < ARRAY_LEN(rise); k++) {
        static struct motion_frame frame[RING], was[RING];
        uint64_t weight[RING];
        int64_t twist;

        ring_frames(&rise[k], frame, weight);
        for (int i = 0; i < RING; i++)
            was[i] = frame[i];
        assert_int_equal(motion_frame_close(frame, weight, RING, &twist),
                         MOTION_OK);
        assert_true((rise[k] == 0) == (motion_fixed_abs(twist) < (1 << 20)));
        assert_true(motion_fixed_abs(
                        motion_frame_twist(&frame[0], &frame[RING - 1])) < 64);
        for (int i = 0; i < RING; i++) {
            const long double share =
                (long double)weight[i] / (long double)weight[RING - 1];
            const int64_t turned = motion_frame_twist(&was[i], &frame[i]);
            if (fabsl((long double)turned + share * (long double)twist) > 64)
                fail_msg("rise %zu frame %d", k, i);
        }
    }
}

static void what_is_not_closed_is_refused(void **state)
{
    static const struct helix helix = { 3, 1 };
    const struct motion_curve curve = helix_curve(&helix);
    const int64_t u[3] = { 0, HELIX_TURN / 8, HELIX_TURN / 4 };
    const uint64_t none[3] = { 0, 0, 0 }, falling[3] = { 0, 5, 3 };
    struct motion_frame frame[3];
    (void)state;
    frame[0] = helix_start(&curve);
    assert_int_equal(motion_frame_table(&curve, u, 3, frame), MOTION_OK);
    assert_int_equal(motion_frame_close(frame, NULL, 3, NULL), MOTION_E_ARG);
    assert_int_equal(motion_frame_close(frame, NULL, 1, NULL), MOTION_E_EMPTY);
    frame[1] = frame[2] = frame[0];
    assert_int_equal(motion_frame_close(frame, none, 3, NULL), MOTION_E_ARG);
    assert_int_equal(motion_frame_close(frame, falling, 3, NULL), MOTION_E_ARG);
    assert_int_equal(motion_frame_close(frame, NULL, 3, NULL), MOTION_OK);
}

/* --- polynomials, and where there is no frame ---------------------------- */

static struct motion_vec vec(int64_t x, int64_t y, int64_t z)
{
    return (struct motion_vec){ { whole(x), whole(y), whole(z) } };
}

static void a_polynomials_derivatives_are_its_own(void **state)
{
    /* (u, u^2, u^3) over u = 0 .. 1, then its mirror */
    const struct motion_vec coef[] = {
        vec(0, 0, 0), vec(1, 0, 0),  vec(0, 1, 0),  vec(0, 0, 1),
        vec(1, 1, 1), vec(-1, 0, 0), vec(0, -1, 0), vec(0, 0, -1),
    };
    static const int64_t border[] = { -1000, 1000, 5000 };
    const struct motion_polycurve poly = { border, coef, 2, 3 };
    struct motion_curve curve;
    struct motion_curve_point p;
    (void)state;
    assert_int_equal(motion_polycurve_init(&curve, &poly), MOTION_OK);
    assert_int_equal(curve.first, -1000);
    assert_int_equal(curve.last, 5000);
    assert_int_equal(curve.at(curve.context, 500, 3, &p), MOTION_OK);
    assert_true(fabsl(real_value(p.pos.x[2]) - 0.421875L) < 1e-18L);
    assert_true(fabsl(real_value(p.d1.x[2]) - 1.6875L) < 1e-18L);
    assert_true(fabsl(real_value(p.d2.x[2]) - 4.5L) < 1e-18L);
    assert_true(fabsl(real_value(p.d3.x[2]) - 6) < 1e-18L);
    assert_true(fabsl(real_value(p.d2.x[1]) - 2) < 1e-18L);
    /* a border is the later piece's, the last one the end */
    assert_int_equal(curve.at(curve.context, 1000, 1, &p), MOTION_OK);
    assert_true(real_value(p.d1.x[0]) == -1);
    assert_int_equal(curve.at(curve.context, 5000, 1, &p), MOTION_OK);
    assert_true(fabsl(real_value(p.pos.x[0])) < 1e-18L);
    assert_int_equal(curve.at(curve.context, 5001, 1, &p), MOTION_E_ARG);
    assert_int_equal(curve.at(curve.context, -1001, 1, &p), MOTION_E_ARG);
}

static void borders_out_of_order_are_refused(void **state)
{
    const struct motion_vec coef[] = { vec(0, 0, 0), vec(1, 0, 0) };
    static const int64_t border[] = { 5, 5 };
    const struct motion_polycurve poly = { border, coef, 1, 1 };
    const struct motion_polycurve none = { border, coef, 0, 1 };
    struct motion_curve curve;
    (void)state;
    assert_int_equal(motion_polycurve_init(&curve, &poly), MOTION_E_ORDER);
    assert_int_equal(motion_polycurve_init(&curve, &none), MOTION_E_EMPTY);
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

static void at_rest_the_tangent_is_where_the_curve_goes(void **state)
{
    struct motion_curve_point point = { .pos = vec(0, 0, 0),
                                        .d1 = vec(0, 0, 0),
                                        .d2 = vec(0, 5, 0),
                                        .d3 = vec(0, 0, 2) };
    struct motion_frenet f;
    struct motion_dir t;
    (void)state;
    assert_int_equal(motion_frame_frenet(&point, &f), MOTION_E_RANGE);
    assert_int_equal(motion_frame_tangent(&point, MOTION_FRAME_AFTER, &t),
                     MOTION_OK);
    assert_int_equal(t.q62[1], ONE);
    assert_int_equal(motion_frame_tangent(&point, MOTION_FRAME_BEFORE, &t),
                     MOTION_OK);
    assert_int_equal(t.q62[1], -ONE);
    point.d2 = vec(0, 0, 0);
    assert_int_equal(motion_frame_tangent(&point, MOTION_FRAME_BEFORE, &t),
                     MOTION_OK);
    assert_int_equal(t.q62[2], ONE);
    point.d3 = vec(0, 0, 0);
    assert_int_equal(motion_frame_tangent(&point, MOTION_FRAME_AFTER, &t),
                     MOTION_E_RANGE);
}

static void through_an_inflection_the_frame_does_not_flip(void **state)
{
    /* (u, u^3, 0): N flips at 0, r does not */
    const struct motion_vec coef[] = { vec(-1, -1, 0), vec(2, 6, 0),
                                       vec(0, -12, 0), vec(0, 8, 0) };
    static const int64_t border[] = { -(1 << 20), 1 << 20 };
    const struct motion_polycurve poly = { border, coef, 1, 3 };
    const struct motion_dir up = { { 0, 0, ONE } };
    struct motion_curve curve;
    struct motion_curve_point p;
    struct motion_frenet before, after;
    struct motion_frame frame;
    struct motion_dir t;
    (void)state;
    (void)motion_polycurve_init(&curve, &poly);
    (void)curve.at(curve.context, -1000, 3, &p);
    assert_int_equal(motion_frame_frenet(&p, &before), MOTION_FRENET_OK);
    (void)curve.at(curve.context, 1000, 3, &p);
    assert_int_equal(motion_frame_frenet(&p, &after), MOTION_FRENET_OK);
    assert_true(motion_dir_dot_q62(before.n, after.n) < -ONE / 2);
    (void)curve.at(curve.context, 0, 3, &p);
    assert_int_equal(motion_frame_frenet(&p, &after), MOTION_FRENET_FLAT);
    (void)curve.at(curve.context, border[0], 3, &p);
    (void)motion_frame_tangent(&p, MOTION_FRAME_AFTER, &t);
    (void)motion_frame_start(t, up, &frame);
    assert_int_equal(
        motion_frame_carry(&curve, border[0], border[1], ONE >> 34, &frame),
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

static void bad_requests_are_refused_and_leave_the_frame(void **state)
{
    static const struct helix helix = { 3, 1 };
    const struct motion_curve curve = helix_curve(&helix);
    const struct motion_frame was = helix_start(&curve);
    struct motion_frame frame = was;
    (void)state;
    assert_int_equal(motion_frame_carry(&curve, 0, 10, 0, &frame),
                     MOTION_E_ARG);
    assert_int_equal(motion_frame_carry(&curve, 10, 0, ONE >> 20, &frame),
                     MOTION_E_ARG);
    assert_int_equal(motion_frame_carry(&curve, -1, 5, ONE >> 20, &frame),
                     MOTION_E_ARG);
    assert_int_equal(
        motion_frame_carry(&curve, 0, 4 * HELIX_TURN + 1, ONE >> 20, &frame),
        MOTION_E_ARG);
    assert_int_equal(motion_frame_table(&curve, NULL, 0, &frame),
                     MOTION_E_EMPTY);
    assert_memory_equal(&frame, &was, sizeof frame);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_helix_has_constant_curvature_and_torsion),
        cmocka_unit_test(double_reflection_is_of_fourth_order),
        cmocka_unit_test(the_carried_frame_is_as_good_as_asked),
        cmocka_unit_test(a_frame_stays_right_handed_and_perpendicular),
        cmocka_unit_test(a_closed_curve_ends_as_it_began_twist_spread_evenly),
        cmocka_unit_test(what_is_not_closed_is_refused),
        cmocka_unit_test(a_polynomials_derivatives_are_its_own),
        cmocka_unit_test(borders_out_of_order_are_refused),
        cmocka_unit_test(a_straight_stretch_is_flat_not_garbage),
        cmocka_unit_test(at_rest_the_tangent_is_where_the_curve_goes),
        cmocka_unit_test(through_an_inflection_the_frame_does_not_flip),
        cmocka_unit_test(a_step_without_a_chord_turns_the_shortest_way),
        cmocka_unit_test(bad_requests_are_refused_and_leave_the_frame),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
