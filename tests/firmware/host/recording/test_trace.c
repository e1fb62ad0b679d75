/* tests/firmware/host/recording/test_trace.c - the rows of a run of any length,
 * thinned for a picture. */
#include "firmware/host/recording/trace.h"

#include "motion/core/fixed.h"
#include "tests/support/check.h"

/* Above max(5, 20 ms x speed) is a fault. */
static struct rig_axis axis_of_rig = { .following_floor_q32 = INT64_C(5) << 32,
                                       .following_k_ns = 20000000 };
static const struct rig rig = { .axis_count = 1, .axis = &axis_of_rig };

static void a_long_trace_stays_bounded_and_keeps_the_peaks(void **state)
{
    (void)state;
    static struct trace trace;
    struct telemetry_axis axis = { .following_q32 = 0 };
    struct telemetry_row row = { .phase = TELEMETRY_MOVE, .axis = &axis };
    const int rows = 10 * TRACE_POINTS + 17, peak = 54321;
    double most = 0, least = 0;
    trace_init(&trace, &rig);
    for (int i = 0; i < rows; i++) {
        row.t_ns = INT64_C(1000000) * i;
        row.rate.s_ns_q12 = row.t_ns * MOTION_FIXED_NS_Q12;
        row.axis[0].following_q32 = i == peak       ? INT64_C(7) << 32
                                    : i == peak + 1 ? -(INT64_C(5) << 32)
                                                    : 0;
        trace_take(&trace, &row);
    }
    assert_true(trace.count <= TRACE_POINTS);
    assert_true(trace.count > TRACE_POINTS / 2 - 1);
    for (size_t i = 0; i < trace.count; i++) {
        const struct trace_axis *at = trace_at(&trace, i, 0);
        most = at->following_max > most ? at->following_max : most;
        least = at->following_min < least ? at->following_min : least;
        assert_true(i == 0 || trace.t_s[i] > trace.t_s[i - 1]);
    }
    assert_true(most == 7);
    assert_true(least == -5);
    assert_true(trace.end_s == (rows - 1) / 1e3);
    assert_false(trace.warped);
    trace_free(&trace);
}

/* 11.5 at 600/s is less of its limit than 4.9 at rest. */
static void the_worst_following_error_is_judged_by_its_own_limit(void **state)
{
    (void)state;
    static struct trace trace;
    struct telemetry_axis axis = { .following_q32 = 0 };
    struct telemetry_row row = { .phase = TELEMETRY_MOVE, .axis = &axis };
    double worst = 0, allowed = 0, least = 0;
    trace_init(&trace, &rig);
    for (int i = 0; i < 3 * TRACE_POINTS; i++) {
        row.t_ns = INT64_C(1000000) * i;
        axis.following_q32 = i == 9000   ? -(INT64_C(23) << 31)
                             : i == 9002 ? (INT64_C(49) << 32) / 10
                                         : 0;
        axis.demand.vel_q32 = i < 9001 ? -(INT64_C(600) << 32) : 0;
        trace_take(&trace, &row);
    }
    for (size_t i = 0; i < trace.count; i++) {
        const struct trace_axis *at = trace_at(&trace, i, 0);
        if (at->worst * allowed >= worst * at->worst_allowed) {
            worst = at->worst;
            allowed = at->worst_allowed;
        }
        least = at->following_min < least ? at->following_min : least;
        assert_true(at->allowed == (trace.t_s[i] < 9 ? 12 : 5));
    }
    assert_true(worst > 4.8999 && worst < 4.9 && allowed == 5);
    assert_true(least == -11.5);
    trace_free(&trace);
}

static void a_trace_begins_with_the_move_and_knows_a_hold(void **state)
{
    (void)state;
    static struct trace trace;
    struct telemetry_axis axis = { .following_q32 = 0 };
    struct telemetry_row row = { .phase = TELEMETRY_ENABLE, .axis = &axis };
    trace_init(&trace, &rig);
    trace_take(&trace, &row);
    row.phase = TELEMETRY_APPROACH;
    row.t_ns = 4999000000;
    trace_take(&trace, &row);
    assert_int_equal(trace.count, 0);
    row.phase = TELEMETRY_MOVE;
    row.t_ns = 5000000000;
    row.rate.s_ns_q12 = MOTION_FIXED_NS_Q12 * 1000000;
    trace_take(&trace, &row);
    assert_int_equal(trace.count, 1);
    assert_true(trace.t_s[0] == 0.001);
    assert_false(trace.warped);
    row.t_ns += 1000000; /* and the path stood still */
    trace_take(&trace, &row);
    assert_true(trace.warped);
    trace_free(&trace);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_long_trace_stays_bounded_and_keeps_the_peaks),
        cmocka_unit_test(the_worst_following_error_is_judged_by_its_own_limit),
        cmocka_unit_test(a_trace_begins_with_the_move_and_knows_a_hold),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
