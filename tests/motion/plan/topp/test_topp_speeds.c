/* tests/motion/plan/topp/test_topp_speeds.c - speeds at both ends, caps, a wished
 * speed and stops on curves, with limits of jerk.  SEED=n and N=2000 for more
 * random paths. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "motion/core/err.h"
#include "motion/plan/topp/topp_jerk.h"
#include "tests/motion/plan/topp/topp_judge.h"
#include "tests/motion/plan/topp/topp_rig.h"

/* The pool of what was solved last. */
static struct plan_pool pool;

#define EXCESS 1e-6

static void near(double got, double want, double rel)
{
    if (!(fabs(got - want) <= rel * fabs(want)))
        fail_msg("got %.12g, expected %.12g", got, want);
}

/* Axis 0 is s, axis 1 a curve over it, so that the state of axis 0 is that of
 * s. */
static void arch(struct topp_rig *rig)
{
    topp_rig_init(rig, 2, 1);
    topp_rig_powers(rig, 0, 0)[1] = 1;
    memcpy(topp_rig_powers(rig, 0, 1), (double[4]){ 0, 1, 2, -2.5 }, 32);
    rig->limit[0] = rig->limit[1] = (struct plan_topp_limit){ -1, 1, -2, 2 };
    rig->jerk[0] = rig->jerk[1] = 20;
}

/* What s' is at least and at most while s is in a section. */
static void speeds(const struct plan_topp_law *law, double from, double to,
                   double *least, double *most)
{
    *least = INFINITY;
    *most = 0;
    for (int i = 0; i <= 20000; i++) {
        struct plan_topp_axis_state at[PLAN_TOPP_AXES_MAX];
        plan_topp_law_at(law, law->duration * i / 20000, at);
        if (at[0].pos < from || at[0].pos > to)
            continue;
        *least = fmin(*least, at[0].vel);
        *most = fmax(*most, at[0].vel);
    }
}

static void solve(const struct topp_rig *rig, struct plan_topp_law *law)
{
    double failed;

    assert_int_equal(
        plan_topp_jerk_solve(&rig->request, rig->jerk, &pool, law, &failed),
        MOTION_OK);
    const double excess = topp_judge_law(&rig->request, rig->jerk, law, 20000);
    if (!(excess <= EXCESS))
        fail_msg("a limit is exceeded by %.3g of itself", excess);
}

static double duration_of(const struct topp_rig *rig)
{
    struct plan_topp_law law;

    solve(rig, &law);
    const double duration = law.duration;
    plan_pool_free(&pool);
    return duration;
}

static double second_order(const struct topp_rig *rig)
{
    struct plan_topp topp;
    struct plan_pool own = { NULL };
    double failed;

    assert_int_equal(plan_topp_solve(&rig->request, &own, &topp, &failed),
                     MOTION_OK);
    const double duration = plan_topp_duration(&topp);
    plan_pool_free(&own);
    return duration;
}

static void a_curve_starts_and_ends_at_a_speed(void **state)
{
    struct topp_rig rig;
    struct plan_topp_axis_state at[2];
    struct plan_topp_law law;

    (void)state;
    arch(&rig);
    const double rest = duration_of(&rig);
    rig.request.start_speed = 0.3;
    const double one = duration_of(&rig);
    rig.request.end_speed = 0.2;
    const double both = duration_of(&rig);
    assert_true(both < one - 0.1 && one < rest - 0.1);
    solve(&rig, &law);
    plan_topp_law_at(&law, 0, at);
    near(at[0].vel, 0.3, 1e-12);
    near(at[1].acc, 4 * 0.3 * 0.3, 1e-12); /* that of a constant s' */
    assert_true(fabs(at[0].acc) < 1e-12);
    plan_topp_law_at(&law, law.duration, at);
    near(at[0].vel, 0.2, 1e-12);
    plan_pool_free(&pool);
    /* As without limits of jerk, when they are large. */
    rig.jerk[0] = rig.jerk[1] = 1e5;
    near(duration_of(&rig), second_order(&rig), 1e-3);
}

static void a_speed_that_the_limits_do_not_allow_is_refused(void **state)
{
    /* Above velocity; above acceleration, which is 4 s'^2; below both, but more
     * than is left after a cap. */
    static const double speed[] = { 1.01, 0.72, 0.5 };

    (void)state;
    for (size_t i = 0; i < sizeof speed / sizeof speed[0]; i++) {
        struct topp_rig rig;
        struct plan_topp_law law;
        double failed;
        arch(&rig);
        rig.request.start_speed = speed[i];
        if (i == 2) {
            rig.cap[0] = (struct plan_topp_cap){ 0.01, 0.5, 0.1 };
            rig.request.cap_count = 1;
        }
        assert_int_equal(
            plan_topp_jerk_solve(&rig.request, rig.jerk, &pool, &law, &failed),
            MOTION_E_LIMIT);
        assert_true(failed == 0);
        assert_null(law.run);
    }
}

static void caps_on_a_curve_are_kept(void **state)
{
    struct topp_rig rig;
    struct plan_topp_law law;
    double least, most;

    (void)state;
    for (int i = 0; i < 2; i++) {
        arch(&rig);
        rig.cap[0] = (struct plan_topp_cap){ 0.3, 0.6, 0.15 };
        rig.cap[1] = (struct plan_topp_cap){ 0.5, 0.7, 0.1 };
        rig.request.cap_count = 2;
        rig.request.start_speed = rig.request.end_speed = 0.2 * i;
        solve(&rig, &law);
        speeds(&law, 0.3, 0.5, &least, &most);
        assert_true(most <= 0.15 * (1 + EXCESS) && most > 0.15 * 0.999);
        speeds(&law, 0.5, 0.7, &least, &most);
        assert_true(most <= 0.1 * (1 + EXCESS));
        speeds(&law, 0.53, 0.65, &least, &most);
        assert_true(least > 0.1 * 0.999);
        speeds(&law, 0.7, 1, &least, &most);
        assert_true(most > 0.25);
        plan_pool_free(&pool);
    }
}

/* A cap over the whole path. */
static void a_wished_speed_is_constant(void **state)
{
    struct topp_rig rig;
    struct plan_topp_law law;
    double least, most;

    (void)state;
    for (int i = 0; i < 2; i++) {
        arch(&rig);
        rig.cap[0] = (struct plan_topp_cap){ 0, 1, 0.1 };
        rig.request.cap_count = 1;
        rig.request.start_speed = rig.request.end_speed = 0.1 * i;
        solve(&rig, &law);
        speeds(&law, i ? 0 : 0.05, i ? 1 : 0.95, &least, &most);
        if (!(most <= 0.1 * (1 + EXCESS) && least > 0.1 * 0.998))
            fail_msg("%.9g to %.9g instead of 0.1", least, most);
        plan_pool_free(&pool);
    }
}

static void a_curve_stops_where_it_is_told(void **state)
{
    struct topp_rig rig;
    struct plan_topp_law law;
    double least, most;

    (void)state;
    arch(&rig);
    rig.request.start_speed = rig.request.end_speed = 0.3;
    rig.cap[0] = (struct plan_topp_cap){ 0.4, 0.4, 0 };
    rig.request.cap_count = 1;
    solve(&rig, &law);
    speeds(&law, 0.39999, 0.40001, &least, &most);
    assert_true(least < 0.01);
    assert_int_equal(law.runs, 2);
    plan_pool_free(&pool);
}

/* s' of a piece's end at which an axis is as fast as it may be. */
static double fastest_at(const struct topp_rig *rig, uint32_t piece, double x)
{
    const struct plan_topp_path *path = &rig->request.path;
    double most = INFINITY;

    for (unsigned k = 0; k < path->axes; k++) {
        const double *c = path->coef + ((size_t)piece * path->axes + k) * 4;
        const double slope = c[1] + x * (2 * c[2] + x * 3 * c[3]);
        const struct plan_topp_limit *limit = &rig->limit[k];
        most =
            fmin(most, (slope > 0 ? limit->vel_max : limit->vel_min) / slope);
    }
    return most;
}

/* From and to a share of the velocity limit: a law or MOTION_E_LIMIT, and mostly
 * a law, as accelerations are moderate there. */
static void random_speeds_at_the_ends_are_kept(void **state)
{
    const char *from = getenv("SEED"), *count = getenv("N");
    const unsigned n = count ? (unsigned)strtoul(count, NULL, 0) : 6;
    unsigned found = 0;

    (void)state;
    for (unsigned i = 0; i < n; i++) {
        const uint64_t which = (from ? strtoull(from, NULL, 0) : 1) + i;
        struct topp_rig rig;
        struct plan_topp_law law;
        double failed;
        topp_rig_random_smooth(&rig, which);
        const uint32_t last = rig.request.path.pieces - 1;
        const double share = (double)(which * 7919 % 100) / 100;
        const double h = rig.border[last + 1] - rig.border[last];
        rig.request.start_speed = share * fastest_at(&rig, 0, 0);
        rig.request.end_speed = (1 - share) * fastest_at(&rig, last, h);
        const int err =
            plan_topp_jerk_solve(&rig.request, rig.jerk, &pool, &law, &failed);
        if (err != MOTION_OK && err != MOTION_E_LIMIT)
            fail_msg("SEED=%llu: %s", (unsigned long long)which,
                     motion_err_text(err));
        if (err == MOTION_E_LIMIT)
            continue;
        found++;
        const double excess =
            topp_judge_law(&rig.request, rig.jerk, &law, 20000);
        plan_pool_free(&pool);
        if (!(excess <= EXCESS))
            fail_msg("SEED=%llu: %g over", (unsigned long long)which, excess);
    }
    if (found < n * 2 / 3)
        fail_msg("only %u of %u", found, n);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_curve_starts_and_ends_at_a_speed),
        cmocka_unit_test(a_speed_that_the_limits_do_not_allow_is_refused),
        cmocka_unit_test(caps_on_a_curve_are_kept),
        cmocka_unit_test(a_wished_speed_is_constant),
        cmocka_unit_test(a_curve_stops_where_it_is_told),
        cmocka_unit_test(random_speeds_at_the_ends_are_kept),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
