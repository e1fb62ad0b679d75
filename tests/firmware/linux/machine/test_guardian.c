/* tests/firmware/linux/machine/test_guardian.c - when the guardian takes a loop
 * for hung, and how long it tries to switch drives off: the times of
 * docs/FAULTS.md, in injected and in virtual time. */
#include <string.h>

#include "firmware/linux/machine/off.h"
#include "tests/firmware/linux/machine/machine_bench.h"

#define MS INT64_C(1000000)

/* A loop that ticks every `period_ns` until `last_ns`, and a guardian that looks
 * at it every 20 ms from `phase_ns` on.  When it takes it for hung; -1: not
 * within 10 s. */
static int64_t hung_at(int64_t period_ns, int64_t last_ns, int64_t phase_ns)
{
    struct guardian_page page = { 0 };
    struct guardian_watch watch;

    guardian_watch_init(&watch, period_ns, phase_ns);
    for (int64_t at_ns = phase_ns + GUARDIAN_LOOK_NS; at_ns < 10000 * MS;
         at_ns += GUARDIAN_LOOK_NS) {
        const int64_t so_far_ns = at_ns < last_ns ? at_ns : last_ns;

        guardian_tick(&page, 1 + (uint64_t)(so_far_ns / period_ns));
        if (guardian_watch_hangs(&watch, &page, at_ns))
            return at_ns;
    }
    return -1;
}

static void expect_hung(int64_t period_ns, int64_t hung_ns)
{
    int64_t earliest_ns = INT64_MAX, latest_ns = 0;

    for (int64_t phase_ns = 0; phase_ns < GUARDIAN_LOOK_NS;
         phase_ns += MS / 8) {
        const int64_t last_ns = 1000 * MS / period_ns * period_ns;
        const int64_t after_ns =
            hung_at(period_ns, last_ns, phase_ns) - last_ns;

        if (after_ns < earliest_ns)
            earliest_ns = after_ns;
        if (after_ns > latest_ns)
            latest_ns = after_ns;
    }
    print_message("a tick of %lld us: hung %.3f to %.3f ms after the last\n",
                  (long long)(period_ns / 1000), (double)earliest_ns * 1e-6,
                  (double)latest_ns * 1e-6);
    assert_true(earliest_ns > hung_ns);
    assert_true(latest_ns <= hung_ns + 2 * GUARDIAN_LOOK_NS);
}

/* 250 ms, or 20 ticks, whichever is longer; seen within two looks. */
static void a_loop_hangs_after_its_time(void **state)
{
    (void)state;
    expect_hung(MS / 8, 250 * MS);
    expect_hung(1 * MS, 250 * MS);
    expect_hung(12 * MS + MS / 2, 250 * MS);
    expect_hung(13 * MS, 260 * MS);
    expect_hung(20 * MS, 400 * MS);
}

static void a_loop_that_ticks_hangs_never(void **state)
{
    (void)state;
    assert_int_equal(hung_at(MS, INT64_MAX, 0), -1);
    assert_int_equal(hung_at(20 * MS, INT64_MAX, 7 * MS), -1);
}

/* One tick just in time, again and again. */
static void a_tick_begins_its_time_anew(void **state)
{
    struct guardian_page page = { 0 };
    struct guardian_watch watch;
    int64_t at_ns = 0;

    (void)state;
    guardian_watch_init(&watch, MS, at_ns);
    for (uint64_t ticks = 1; ticks < 20; ticks++) {
        guardian_tick(&page, ticks);
        for (int look = 0; look < 13; look++) { /* 240 ms since the first */
            at_ns += GUARDIAN_LOOK_NS;
            assert_false(guardian_watch_hangs(&watch, &page, at_ns));
        }
    }
}

/* Before the first tick, and once all is off, ticks may stay away. */
static void there_is_nothing_to_guard(void **state)
{
    struct guardian_page page = { 0 };
    struct guardian_watch watch;
    int64_t at_ns = 0;

    (void)state;
    guardian_watch_init(&watch, MS, at_ns);
    for (int look = 0; look < 1000; look++)
        assert_false(
            guardian_watch_hangs(&watch, &page, at_ns += GUARDIAN_LOOK_NS));
    guardian_tick(&page, 1);
    assert_false(
        guardian_watch_hangs(&watch, &page, at_ns += GUARDIAN_LOOK_NS));
    guardian_done(&page);
    for (int look = 0; look < 1000; look++)
        assert_false(
            guardian_watch_hangs(&watch, &page, at_ns += GUARDIAN_LOOK_NS));
}

/* A look that is late counts as two, however late it is: as neither of the two
 * was run, that is no hang; seven of them in a row are. */
static void a_pause_of_the_computer_is_no_hang(void **state)
{
    struct guardian_page page = { 0 };
    struct guardian_watch watch;
    int64_t at_ns = 0;

    (void)state;
    guardian_watch_init(&watch, MS, at_ns);
    guardian_tick(&page, 1);
    assert_false(
        guardian_watch_hangs(&watch, &page, at_ns += GUARDIAN_LOOK_NS));
    for (int pause = 0; pause < 6; pause++)
        assert_false(
            guardian_watch_hangs(&watch, &page, at_ns += 3600000 * MS));
    assert_true(guardian_watch_hangs(&watch, &page, at_ns += 3600000 * MS));
}

/* ---- what it does then --------------------------------------------------- */

/* Its drive answers so long after the ports are open; is it off in the end? */
static bool is_off(int64_t boot_ns, char text[OFF_TEXT_MAX])
{
    struct off_config config = guardian_off;
    struct off_axis axis[RIG_AXES_MAX];
    struct rig rig = { 0 };
    bool all;

    config.real = false;
    bench_load("tests/data/cia402/rig.yaml", &rig);
    rig.axis_count = 1;
    rig.axis[0].sim.quirks.boot_ns = boot_ns;
    all = off_all(&rig, &config, axis, NULL);
    memcpy(text, axis[0].text, OFF_TEXT_MAX);
    rig_free(&rig);
    return all;
}

static void it_is_tried_for_thirty_seconds(void **state)
{
    char text[OFF_TEXT_MAX];

    (void)state;
    assert_true(is_off(0, text));
    assert_string_equal(text, "torque is off");
    if (!is_off(28000 * MS, text))
        fail_msg("not after 28 s: %s", text);
    assert_false(is_off(30001 * MS, text));
    assert_non_null(strstr(text, "not confirmed off"));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_loop_hangs_after_its_time),
        cmocka_unit_test(a_loop_that_ticks_hangs_never),
        cmocka_unit_test(a_tick_begins_its_time_anew),
        cmocka_unit_test(there_is_nothing_to_guard),
        cmocka_unit_test(a_pause_of_the_computer_is_no_hang),
        cmocka_unit_test(it_is_tried_for_thirty_seconds),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
