/* tests/motion/plan/topp/test_topp_jerk.c - paths as fast as limits of jerk allow.
 * SEED=n and N=2000 for more random paths.  Takes long. */
#include <math.h>
#include <string.h>

#include "motion/core/err.h"
#include "motion/core/fixed.h"
#include "motion/otg/otg.h"
#include "motion/plan/topp/topp_curve.h"
#include "motion/plan/topp/topp_jerk.h"
#include "motion/plan/topp/topp_line.h"
#include "tests/motion/plan/topp/topp_judge.h"
#include "tests/motion/plan/topp/topp_rig.h"
#include "tests/support/check.h"

/* The pool of what was solved last. */
static struct plan_pool pool;

#define EXCESS 1e-6

static void near(double got, double want, double rel)
{
    if (!(fabs(got - want) <= rel * fabs(want)))
        fail_msg("got %.12g, expected %.12g", got, want);
}

static double second_order(const struct topp_rig *rig)
{
    struct plan_topp_request request = rig->request;
    struct plan_topp topp;
    struct plan_pool own = { NULL };
    double failed, duration;

    request.intervals = 10000;
    assert_int_equal(plan_topp_solve(&request, &own, &topp, &failed),
                     MOTION_OK);
    duration = plan_topp_duration(&topp);
    plan_pool_free(&own);
    return duration;
}

/* Solve, judge, return the duration. */
static double duration_of(const struct topp_rig *rig)
{
    struct plan_topp_law law;
    double failed, duration;

    assert_int_equal(
        plan_topp_jerk_solve(&rig->request, rig->jerk, &pool, &law, &failed),
        MOTION_OK);
    assert_true(isnan(failed));
    const double excess = topp_judge_law(&rig->request, rig->jerk, &law, 20000);
    if (!(excess <= EXCESS))
        fail_msg("a limit is exceeded by %.3g of itself", excess);
    duration = law.duration;
    plan_pool_free(&pool);
    return duration;
}

/* Two axes on a curve. */
static void bend(struct topp_rig *rig)
{
    topp_rig_init(rig, 2, 1);
    memcpy(topp_rig_powers(rig, 0, 0), (double[4]){ 0, 1, -3, 2 }, 32);
    memcpy(topp_rig_powers(rig, 0, 1), (double[4]){ 0, 1, 2, -2.5 }, 32);
}

/* --- straight lines ------------------------------------------------------------ */

static void a_straight_line_takes_the_double_s_s_time(void **state)
{
    static const struct {
        double distance, vel, acc, jerk, want;
    } rows[] = {
        { 10, 1, 1, 2, 10 + 1 + 0.5 }, /* all seven phases */
        { 2, 10, 1, 1, 4 },            /* four: T = (32 d / j)^(1/3) */
        { 1, 10, 10, 32, 1 },          /* the same */
        { 2, 1, 10, 1, 2 + 2 },        /* no constant acceleration */
    };

    (void)state;
    for (size_t i = 0; i < sizeof rows / sizeof rows[0]; i++) {
        struct topp_rig rig;
        topp_rig_straight(&rig, rows[i].distance, 3);
        rig.limit[0] = (struct plan_topp_limit){ -rows[i].vel, rows[i].vel,
                                                 -rows[i].acc, rows[i].acc };
        rig.jerk[0] = rows[i].jerk;
        near(duration_of(&rig), rows[i].want, 1e-12);
    }
}

static int64_t q32(double value)
{
    return llround(ldexp(value, 32));
}

static double otg_duration(const struct topp_rig *rig, double distance,
                           double start, double end)
{
    const struct plan_topp_limit *limit = &rig->limit[0];
    const struct motion_otg_move move = {
        .start.vel_q32 = q32(start),
        .goal = { .pos_q32 = q32(distance), .vel_q32 = q32(end) },
        .limit = { .vel_max_q32 = q32(limit->vel_max),
                   .vel_min_q32 = q32(limit->vel_min),
                   .acc_max_q32 = q32(limit->acc_max),
                   .acc_min_q32 = q32(limit->acc_min),
                   .jerk_q32 = q32(rig->jerk[0]) },
    };
    struct motion_otg_plan plan;

    if (motion_otg_make(&move, &plan, NULL) != MOTION_OK)
        return NAN;
    return (double)plan.dur_ns_q12 / MOTION_FIXED_S_Q12;
}

static double between(uint64_t *seed, double low, double high)
{
    *seed = *seed * 6364136223846793005u + 1442695040888963407u;
    return low * pow(high / low, (double)(*seed >> 40) / (1 << 24));
}

static void one_axis_takes_the_time_of_the_generator(void **state)
{
    const uint32_t cases = (uint32_t)check_cases(1000);
    uint64_t seed = 7;
    uint32_t both = 0;

    (void)state;
    for (uint32_t i = 0; i < cases; i++) {
        const uint32_t pieces = 1 + i % 3;
        struct topp_rig rig;
        struct plan_topp_law law;
        double failed;
        const double distance = between(&seed, 0.01, 1000);
        topp_rig_straight(&rig, distance, pieces);
        rig.limit[0] = (struct plan_topp_limit){ -between(&seed, 0.1, 100),
                                                 between(&seed, 0.1, 100),
                                                 -between(&seed, 0.1, 100),
                                                 between(&seed, 0.1, 100) };
        rig.jerk[0] = between(&seed, 0.1, 1000);
        const double most = rig.limit[0].vel_max;
        const double start = i % 2 ? most * between(&seed, 1e-3, 1) : 0;
        const double end = i % 4 > 1 ? most * between(&seed, 1e-3, 1) : 0;
        rig.request.start_speed = start / distance * pieces;
        rig.request.end_speed = end / distance * pieces;
        if (plan_topp_jerk_solve(&rig.request, rig.jerk, &pool, &law,
                                 &failed) != MOTION_OK)
            continue; /* too short to change its speed going forward */
        const double want = otg_duration(&rig, distance, start, end);
        if (!(fabs(law.duration - want) <= 1e-6 * want + 4e-9))
            fail_msg("%u: %.12g s, %.12g expected", i, law.duration, want);
        plan_pool_free(&pool);
        both++;
    }
    if (both < cases / 2)
        fail_msg("only %u of %u", both, cases);
}

static void a_line_too_short_for_its_speeds_is_refused(void **state)
{
    struct topp_rig rig;
    struct plan_topp_law law;
    double failed;

    (void)state;
    topp_rig_straight(&rig, 0.1, 1);
    rig.request.start_speed = 9;
    assert_int_equal(
        plan_topp_jerk_solve(&rig.request, rig.jerk, &pool, &law, &failed),
        MOTION_E_LIMIT);
    assert_true(failed == 0);
    assert_null(law.run);
}

/* The method for curves, on a straight line: an independent answer. */
static void the_barrier_reaches_the_double_s(void **state)
{
    static const double jerk[] = { 0.3, 2, 20, 200 };

    (void)state;
    for (size_t i = 0; i < sizeof jerk / sizeof jerk[0]; i++) {
        const struct topp_line_limit limit = { 1, 1, 2, jerk[i] };
        struct topp_line line;
        struct topp_rig rig;
        struct topp_chain chain;
        struct plan_topp topp;
        topp_rig_straight(&rig, 5, 3);
        rig.limit[0] = (struct plan_topp_limit){ -1, 1, -2, 1 };
        rig.jerk[0] = jerk[i];
        assert_int_equal(topp_line_plan(&limit, 5, 0, 0, &line), MOTION_OK);
        topp_chain_init(&chain, &rig.request, 0, 2);
        assert_int_equal(
            topp_curve_solve(&chain, &rig.request, rig.jerk, &pool, &topp),
            MOTION_OK);
        const double over =
            plan_topp_duration(&topp) / topp_line_duration(&line) - 1;
        if (!(over > -1e-7 && over < 1e-3))
            fail_msg("jerk %g: %g over the optimum", jerk[i], over);
        plan_pool_free(&pool);
    }
}

/* --- curves --------------------------------------------------------------------- */

static void as_jerk_limits_grow_the_time_falls_to_that_without_any(void **state)
{
    struct topp_rig rig;
    double before = INFINITY;

    (void)state;
    bend(&rig);
    const double least = second_order(&rig);
    for (double jerk = 0.1; jerk < 1e6; jerk *= 8) {
        rig.jerk[0] = rig.jerk[1] = jerk;
        const double t = duration_of(&rig);
        if (!(t <= before * (1 + 2e-4) && t >= least * (1 - 1e-4)))
            fail_msg("jerk %g: %.9g s after %.9g, at least %.9g", jerk, t,
                     before, least);
        before = t;
    }
    near(before, least, 1e-3);
}

static void corners_and_stops_are_stops(void **state)
{
    struct topp_rig rig;
    struct plan_topp_law law;
    double failed;

    (void)state;
    /* A right angle: two moves of 1, each 2 (1 + 1) s of jerk 1. */
    topp_rig_init(&rig, 2, 2);
    topp_rig_powers(&rig, 0, 0)[1] = 2;
    topp_rig_powers(&rig, 1, 0)[0] = 2;
    topp_rig_powers(&rig, 1, 1)[1] = 2;
    near(duration_of(&rig), 8, 1e-12);
    /* A stop in the middle of one piece. */
    topp_rig_straight(&rig, 4, 1);
    rig.cap[0] = (struct plan_topp_cap){ 0.5, 0.5, 0 };
    rig.request.cap_count = 1;
    near(duration_of(&rig), 8, 1e-12);
    assert_int_equal(
        plan_topp_jerk_solve(&rig.request, rig.jerk, &pool, &law, &failed),
        MOTION_OK);
    struct plan_topp_axis_state at;
    plan_topp_law_at(&law, 4, &at);
    near(at.pos, 2, 1e-12);
    assert_true(fabs(at.vel) < 1e-12 && fabs(at.acc) < 1e-12);
    plan_pool_free(&pool);
}

static void caps_of_speed_are_kept(void **state)
{
    struct topp_rig rig;

    (void)state;
    topp_rig_straight(&rig, 10, 10);
    const double free_time = duration_of(&rig);
    rig.cap[0] = (struct plan_topp_cap){ 2, 4, 0.05 };
    rig.request.cap_count = 1;
    const double t = duration_of(&rig);
    /* 2 / 0.05 s in it, and at most the changes of speed besides. */
    assert_true(t > 40 + free_time - 8 && t < 40 + free_time + 4);
}

/* The lower cap counts at each place: one inside another, in parts whose ends are those
 * of another up to rounding, take what caps side by side take. */
static void caps_may_overlap(void **state)
{
    enum { PARTS = 16 };
    struct topp_rig rig;

    (void)state;
    topp_rig_straight(&rig, 10, 1);
    rig.cap[0] = (struct plan_topp_cap){ 0.2, 0.3, 0.05 };
    rig.cap[1] = (struct plan_topp_cap){ 0.3, 0.4, 0.02 };
    rig.cap[2] = (struct plan_topp_cap){ 0.4, 0.5, 0.05 };
    rig.request.cap_count = 3;
    const double beside = duration_of(&rig);
    rig.request.cap_count = PARTS + 1;
    for (int i = 0; i < PARTS; i++)
        rig.cap[i] =
            (struct plan_topp_cap){ 0.2 + 0.3 * i / PARTS,
                                    0.2 + 0.3 * (i + 1) / PARTS, 0.05 };
    rig.cap[PARTS] = (struct plan_topp_cap){ 0.3 - 1e-10, 0.4 + 1e-10, 0.02 };
    near(duration_of(&rig), beside, 1e-3);
    rig.cap[PARTS] =
        (struct plan_topp_cap){ 0.2 + 0.3 * 5 / PARTS - 1e-10,
                                0.2 + 0.3 * 7 / PARTS + 1e-10, 0.02 };
    assert_true(duration_of(&rig) < beside);
}

/* Twice the velocities, four times the accelerations, eight times the jerks:
 * half the time. */
static void double_speed(struct topp_rig *rig)
{
    for (unsigned k = 0; k < rig->request.path.axes; k++) {
        rig->limit[k].vel_min *= 2;
        rig->limit[k].vel_max *= 2;
        rig->limit[k].acc_min *= 4;
        rig->limit[k].acc_max *= 4;
        rig->jerk[k] *= 8;
    }
}

static void time_scales(void **state)
{
    struct topp_rig rig;

    (void)state;
    topp_rig_random_smooth(&rig, 3);
    const double t = duration_of(&rig);
    double_speed(&rig);
    near(2 * duration_of(&rig), t, 1e-9);
}

static void axes_that_stand_take_no_time(void **state)
{
    struct topp_rig rig;
    struct plan_topp_law law;
    struct plan_topp_axis_state at[2];
    double failed;

    (void)state;
    topp_rig_init(&rig, 2, 3);
    for (uint32_t i = 0; i < 3; i++)
        topp_rig_powers(&rig, i, 1)[0] = 5;
    assert_int_equal(
        plan_topp_jerk_solve(&rig.request, rig.jerk, &pool, &law, &failed),
        MOTION_OK);
    assert_true(law.duration == 0);
    plan_topp_law_at(&law, 1, at);
    assert_true(at[1].pos == 5 && at[1].vel == 0);
    plan_pool_free(&pool);
    /* Still in the middle. */
    topp_rig_powers(&rig, 0, 0)[1] = 2;
    topp_rig_powers(&rig, 1, 0)[0] = 2;
    topp_rig_powers(&rig, 2, 0)[0] = 2;
    topp_rig_powers(&rig, 2, 0)[1] = 2;
    near(duration_of(&rig), 8, 1e-12);
}

static void bad_requests_are_refused(void **state)
{
    struct topp_rig rig;
    struct plan_topp_law law;
    double failed;

    (void)state;
#define REFUSED(change)                                                        \
    do {                                                                       \
        bend(&rig);                                                            \
        change;                                                                \
        assert_int_equal(plan_topp_jerk_solve(&rig.request, rig.jerk, &pool,   \
                                              &law, &failed),                  \
                         MOTION_E_ARG);                                        \
        assert_null(law.run);                                                  \
    } while (0)
    REFUSED(rig.jerk[1] = 0);
    REFUSED(rig.jerk[0] = NAN);
    REFUSED(rig.jerk[0] = INFINITY);
    REFUSED(rig.request.path.axes = 0);
    REFUSED(rig.border[1] = 0);
    REFUSED(rig.limit[0].vel_max = -1);
    REFUSED(topp_rig_powers(&rig, 0, 0)[2] = NAN);
    REFUSED((rig.request.cap_count = 1, rig.cap[0].to = 0.5)); /* at rest */
#undef REFUSED
}

/* --- random paths --------------------------------------------------------------- */

#define RANDOM_POINTS 100000

static void judge_random(const struct topp_rig *rig, unsigned long long which)
{
    struct plan_topp_law law;
    double failed;
    const int err =
        plan_topp_jerk_solve(&rig->request, rig->jerk, &pool, &law, &failed);

    if (err != MOTION_OK)
        fail_msg("SEED=%llu: %s at %g", which, motion_err_text(err), failed);
    const double excess =
        topp_judge_law(&rig->request, rig->jerk, &law, RANDOM_POINTS);
    /* Where q' steps or is 0 for all axes the two stop differently. */
    const double least = which % 2 ? 0 : second_order(rig);
    const double duration = law.duration;

    plan_pool_free(&pool);
    if (!(excess <= EXCESS))
        fail_msg("SEED=%llu: %g over", which, excess);
    if (!(duration >= least * (1 - 2e-4)))
        fail_msg("SEED=%llu: %.9g s, %.9g s without limits of jerk", which,
                 duration, least);
}

static void judge_seed(unsigned long long which)
{
    struct topp_rig rig;

    if (which % 2)
        topp_rig_random(&rig, which);
    else
        topp_rig_random_smooth(&rig, which);
    judge_random(&rig, which);
}

static void random_paths_are_inside_their_limits(void **state)
{
    const char *from = getenv("SEED"), *count = getenv("N");
    const unsigned n =
        count ? (unsigned)strtoul(count, NULL, 0) : (unsigned)check_cases(8);

    (void)state;
    for (unsigned i = 0; i < n; i++)
        judge_seed((from ? strtoull(from, NULL, 0) : 1) + i);
}

/* A peak of acceleration within a few ms, between eighths of an interval, that
 * the parabola through three of them is 5e-6 below. */
static void a_narrow_peak_is_inside_too(void **state)
{
    (void)state;
    judge_seed(968);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_straight_line_takes_the_double_s_s_time),
        cmocka_unit_test(one_axis_takes_the_time_of_the_generator),
        cmocka_unit_test(a_line_too_short_for_its_speeds_is_refused),
        cmocka_unit_test(the_barrier_reaches_the_double_s),
        cmocka_unit_test(
            as_jerk_limits_grow_the_time_falls_to_that_without_any),
        cmocka_unit_test(corners_and_stops_are_stops),
        cmocka_unit_test(caps_of_speed_are_kept),
        cmocka_unit_test(caps_may_overlap),
        cmocka_unit_test(time_scales),
        cmocka_unit_test(axes_that_stand_take_no_time),
        cmocka_unit_test(bad_requests_are_refused),
        cmocka_unit_test(a_narrow_peak_is_inside_too),
        cmocka_unit_test(random_paths_are_inside_their_limits),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
