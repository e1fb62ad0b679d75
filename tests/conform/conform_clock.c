/* tests/conform/conform_clock.c - see conform_clock.h. */
#include "tests/conform/conform_clock.h"

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

/* How late a wait ends, which it may not do early. */
static int64_t late_after(struct conform_clock *b, int64_t until_ns)
{
    assert_int_equal(hal_clock_wait_until(b->clock, until_ns), MOTION_OK);
    const int64_t late_ns = now_of(b) - until_ns;

    if (late_ns < 0)
        fail_msg("%s: %" PRId64 " ns early", b->name, -late_ns);
    return late_ns;
}

/* A shared machine may pause us at any time and for any time: one of several
 * waits is to end in time.  A clock that is never late has one. */
#define WAITS 20

static void it_waits_until_then_and_not_longer(void **state)
{
    struct conform_clock *b = bench_of(state);
    const int waits = b->late_ns == 0 ? 1 : WAITS;

    for (int64_t wait_ns = 1; wait_ns <= 20 * MS; wait_ns *= 10) {
        int64_t least_ns = INT64_MAX;

        for (int i = 0; i < waits && least_ns > b->late_ns; i++) {
            const int64_t late_ns = late_after(b, now_of(b) + wait_ns);

            least_ns = late_ns < least_ns ? late_ns : least_ns;
        }
        if (least_ns > b->late_ns)
            fail_msg("%s: at least %" PRId64 " ns late after %" PRId64, b->name,
                     least_ns, wait_ns);
    }
}

static void a_time_that_has_passed_is_no_wait(void **state)
{
    struct conform_clock *b = bench_of(state);
    const int waits = b->late_ns == 0 ? 1 : WAITS;
    int64_t took_ns = INT64_MAX;

    for (int i = 0; i < waits && took_ns > b->late_ns; i++) {
        const int64_t since_ns = now_of(b);

        (void)late_after(b, since_ns - MS);
        (void)late_after(b, since_ns);
        (void)late_after(b, 0);
        took_ns = now_of(b) - since_ns;
    }
    assert_in_range(took_ns, 0, b->late_ns);
}

/* Each wait ends late by its own lateness: nothing adds up.  A clock that
 * waited from when the last wait ended would be late by all of them together;
 * one that was paused is in time again as soon as it has caught up. */
static void absolute_waits_do_not_drift(void **state)
{
    struct conform_clock *b = bench_of(state);
    const int waits = b->late_ns == 0 ? 1 : WAITS;
    int64_t late_ns = INT64_MAX;

    for (int round = 0; round < waits && late_ns > b->late_ns; round++) {
        const int64_t from_ns = now_of(b);

        for (int64_t i = 1; i <= 400; i++)
            late_ns = late_after(b, from_ns + i * MS / 4);
    }
    assert_in_range(late_ns, 0, b->late_ns);
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
