/* tests/conform_clock.c - see conform_clock.h. */
#include "tests/conform_clock.h"

#define MS INT64_C(1000000)

static struct conform_clock *bench_of(void **state)
{
    return *state;
}

static int64_t now_of(struct conform_clock *b)
{
    return hal_clock_now_ns(b->clock);
}

static void it_never_goes_back(void **state)
{
    struct conform_clock *b = bench_of(state);
    int64_t before_ns = now_of(b);

    for (int i = 0; i < 100000; i++) {
        const int64_t now_ns = now_of(b);

        assert_true(now_ns >= before_ns);
        before_ns = now_ns;
    }
    assert_true(before_ns > 0); /* 0 means "never" elsewhere */
}

static void it_waits_until_then_and_not_longer(void **state)
{
    struct conform_clock *b = bench_of(state);

    for (int64_t wait_ns = 1; wait_ns <= 20 * MS; wait_ns *= 10) {
        const int64_t until_ns = now_of(b) + wait_ns;
        int64_t late_ns;

        assert_int_equal(hal_clock_wait_until(b->clock, until_ns), MOTION_OK);
        late_ns = now_of(b) - until_ns;
        if (late_ns < 0 || late_ns > b->late_ns)
            fail_msg("%s: %" PRId64 " ns late after %" PRId64, b->name, late_ns,
                     wait_ns);
    }
}

static void a_time_that_has_passed_is_no_wait(void **state)
{
    struct conform_clock *b = bench_of(state);
    const int64_t since_ns = now_of(b);

    assert_int_equal(hal_clock_wait_until(b->clock, since_ns - MS), MOTION_OK);
    assert_int_equal(hal_clock_wait_until(b->clock, since_ns), MOTION_OK);
    assert_int_equal(hal_clock_wait_until(b->clock, 0), MOTION_OK);
    assert_in_range(now_of(b) - since_ns, 0, b->late_ns);
}

/* Each wait ends late by its own lateness: nothing adds up. */
static void absolute_waits_do_not_drift(void **state)
{
    struct conform_clock *b = bench_of(state);
    const int64_t from_ns = now_of(b);

    for (int64_t i = 1; i <= 50; i++) {
        assert_int_equal(hal_clock_wait_until(b->clock, from_ns + i * MS),
                         MOTION_OK);
        assert_in_range(now_of(b) - from_ns - i * MS, 0, b->late_ns);
    }
}

int conform_clock(struct conform_clock *bench)
{
    const struct CMUnitTest claims[] = {
        cmocka_unit_test_prestate(it_never_goes_back, bench),
        cmocka_unit_test_prestate(it_waits_until_then_and_not_longer, bench),
        cmocka_unit_test_prestate(a_time_that_has_passed_is_no_wait, bench),
        cmocka_unit_test_prestate(absolute_waits_do_not_drift, bench),
    };

    return cmocka_run_group_tests_name(bench->name, claims, NULL, NULL);
}
