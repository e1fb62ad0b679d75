/* tests/firmware/linux/machine/test_guardian.c - when the guardian takes a loop
 * for hung, and how long it tries to switch drives off: the times of
 * docs/FAULTS.md, in injected and in virtual time; and who replaces one that is
 * killed.  Reads the real clock. */
#include <dirent.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <time.h>

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

    guardian_watch_init(&watch, phase_ns);
    for (int64_t at_ns = phase_ns + GUARDIAN_LOOK_NS; at_ns < 10000 * MS;
         at_ns += GUARDIAN_LOOK_NS) {
        const int64_t so_far_ns = at_ns < last_ns ? at_ns : last_ns;

        guardian_tick(&page, 1 + (uint64_t)(so_far_ns / period_ns));
        if (guardian_sees_hang(&watch, &page, period_ns, at_ns))
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
    guardian_watch_init(&watch, at_ns);
    for (uint64_t ticks = 1; ticks < 20; ticks++) {
        guardian_tick(&page, ticks);
        for (int look = 0; look < 13; look++) { /* 240 ms since the first */
            at_ns += GUARDIAN_LOOK_NS;
            assert_false(guardian_sees_hang(&watch, &page, MS, at_ns));
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
    guardian_watch_init(&watch, at_ns);
    for (int look = 0; look < 1000; look++)
        assert_false(
            guardian_sees_hang(&watch, &page, MS, at_ns += GUARDIAN_LOOK_NS));
    guardian_tick(&page, 1);
    assert_false(
        guardian_sees_hang(&watch, &page, MS, at_ns += GUARDIAN_LOOK_NS));
    guardian_done(&page);
    for (int look = 0; look < 1000; look++)
        assert_false(
            guardian_sees_hang(&watch, &page, MS, at_ns += GUARDIAN_LOOK_NS));
}

/* A look that is late counts as two, however late it is: as neither of the two
 * was run, that is no hang; seven of them in a row are. */
static void a_pause_of_the_computer_is_no_hang(void **state)
{
    struct guardian_page page = { 0 };
    struct guardian_watch watch;
    int64_t at_ns = 0;

    (void)state;
    guardian_watch_init(&watch, at_ns);
    guardian_tick(&page, 1);
    assert_false(
        guardian_sees_hang(&watch, &page, MS, at_ns += GUARDIAN_LOOK_NS));
    for (int pause = 0; pause < 6; pause++)
        assert_false(
            guardian_sees_hang(&watch, &page, MS, at_ns += 3600000 * MS));
    assert_true(guardian_sees_hang(&watch, &page, MS, at_ns += 3600000 * MS));
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

/* ---- who looks after the guardian ----------------------------------------- */

/* A tick, and a guardian that looks every 20 ms until `last_ns`.  When the tick has
 * seen that it is lost; -1: not within 10 s. */
static int64_t lost_at(int64_t period_ns, int64_t last_ns)
{
    struct guardian_page page = { 0 };
    struct guardian_sight sight = { .lost = 0 };

    for (int64_t at_ns = period_ns; at_ns < 10000 * MS; at_ns += period_ns) {
        const int64_t so_far_ns = at_ns < last_ns ? at_ns : last_ns;

        atomic_store(&page.looks, (uint64_t)(so_far_ns / GUARDIAN_LOOK_NS));
        if (guardian_sight_step(&sight, &page, at_ns)) {
            assert_true(sight.is_gone);
            assert_int_equal(sight.lost, 1);
            return at_ns;
        }
    }
    return -1;
}

static void the_tick_sees_within_a_second_that_nobody_looks(void **state)
{
    static const int64_t period_ns[] = { MS / 8, MS, 5 * MS, 20 * MS };

    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(period_ns); i++) {
        const int64_t after_ns = lost_at(period_ns[i], 1000 * MS) - 1000 * MS;

        print_message("a tick of %lld us: %lld ms after its last look\n",
                      (long long)(period_ns[i] / 1000),
                      (long long)(after_ns / MS));
        assert_in_range(after_ns, 500 * MS, 1000 * MS);
        assert_int_equal(lost_at(period_ns[i], INT64_MAX), -1);
    }
    assert_false(guardian_sight_step(NULL, NULL, 0)); /* there is none */
}

static void one_that_was_replaced_is_seen_at_the_next_tick(void **state)
{
    struct guardian_page page = { 0 };
    struct guardian_sight sight = { .lost = 0 };

    (void)state;
    assert_false(guardian_sight_step(&sight, &page, MS));
    atomic_fetch_add(&page.lost, 1);
    assert_true(guardian_sight_step(&sight, &page, 2 * MS));
    assert_false(guardian_sight_step(&sight, &page, 3 * MS));
    assert_int_equal(sight.lost, 1);
    assert_false(sight.is_gone);
}

/* Neither was run; each tick after it is one look of 40 ms at most. */
static void a_pause_of_the_computer_is_no_loss(void **state)
{
    struct guardian_page page = { 0 };
    struct guardian_sight sight = { .lost = 0 };
    int64_t at_ns = MS;

    (void)state;
    assert_false(guardian_sight_step(&sight, &page, at_ns));
    for (int pause = 0; pause < 17; pause++)
        assert_false(guardian_sight_step(&sight, &page, at_ns += 3600000 * MS));
    assert_true(guardian_sight_step(&sight, &page, at_ns += 3600000 * MS));
}

/* The parent of a process; 0: there is none. */
static pid_t parent_of(pid_t pid)
{
    char path[64], line[512] = "";
    int parent = 0;

    snprintf(path, sizeof path, "/proc/%d/stat", (int)pid);
    FILE *file = fopen(path, "r");
    if (file == NULL)
        return 0;
    (void)!fgets(line, sizeof line, file);
    (void)fclose(file);
    const char *after = strrchr(line, ')');
    if (after == NULL || sscanf(after, ") %*c %d", &parent) != 1)
        return 0;
    return parent;
}

static pid_t child_of(pid_t parent)
{
    DIR *directory = opendir("/proc");
    pid_t found = 0;

    assert_non_null(directory);
    for (struct dirent *entry; (entry = readdir(directory)) != NULL;) {
        const pid_t pid = (pid_t)atoi(entry->d_name);

        if (pid > 0 && parent_of(pid) == parent)
            found = pid;
    }
    closedir(directory);
    return found;
}

static void moment(void)
{
    const struct timespec pause = { .tv_nsec = 10 * MS };

    nanosleep(&pause, NULL);
}

/* Half a minute is for a machine that does something else. */
#define WITHIN(what)                                                           \
    do {                                                                       \
        for (int n = 0; !(what); n++) {                                        \
            assert_true(n < 3000);                                             \
            moment();                                                          \
        }                                                                      \
    } while (0)

static bool looks_on(struct guardian_page *page)
{
    const uint64_t looks = atomic_load(&page->looks);

    for (int n = 0; n < 100; n++) {
        moment();
        if (atomic_load(&page->looks) != looks)
            return true;
    }
    return false;
}

/* Whoever of the two is killed, or stopped, is replaced, as often as that is. */
static void either_of_the_two_is_replaced(void **state)
{
    static const int how[] = { SIGKILL, SIGSTOP, SIGUSR2 };
    struct rig rig = { 0 };
    struct guardian guardian;
    uint32_t lost = 0;
    pid_t keeper;

    (void)state;
    bench_load("tests/data/cia402/rig.yaml", &rig);
    assert_int_equal(guardian_start(&guardian, &rig), 0);
    keeper = guardian.pid;
    for (size_t i = 0; i < 2 * ARRAY_LEN(how); i++) {
        const bool kills_keeper = i % 2 == 1;

        WITHIN(child_of(keeper) != 0);
        const pid_t other = child_of(keeper);
        if (kills_keeper && how[i / 2] == SIGSTOP)
            continue; /* it only waits, and the guardian goes on */
        assert_int_equal(kill(kills_keeper ? keeper : other, how[i / 2]), 0);
        lost++;
        WITHIN(atomic_load(&guardian.page->lost) == lost);
        assert_true(looks_on(guardian.page));
        if (kills_keeper)
            keeper = other;
        else
            WITHIN(parent_of(other) == 0); /* of two, none is left over */
    }
    guardian_done(guardian.page);
    guardian_end(&guardian);
    WITHIN(child_of(keeper) == 0 && parent_of(keeper) == 0);
    rig_free(&rig);
}

/* To a program that takes over from it: neither comes back, which is seen. */
static void one_that_gives_way_is_not_replaced(void **state)
{
    struct rig rig = { 0 };
    struct guardian guardian;

    (void)state;
    bench_load("tests/data/cia402/rig.yaml", &rig);
    assert_int_equal(guardian_start(&guardian, &rig), 0);
    WITHIN(child_of(guardian.pid) != 0);
    assert_int_equal(kill(child_of(guardian.pid), GUARDIAN_GIVE_WAY), 0);
    WITHIN(waitpid(guardian.pid, NULL, WNOHANG) == guardian.pid);
    assert_false(looks_on(guardian.page));
    assert_int_equal(atomic_load(&guardian.page->lost), 0);
    guardian_done(guardian.page);
    guardian_end(&guardian);
    rig_free(&rig);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_tick_sees_within_a_second_that_nobody_looks),
        cmocka_unit_test(one_that_was_replaced_is_seen_at_the_next_tick),
        cmocka_unit_test(a_pause_of_the_computer_is_no_loss),
        cmocka_unit_test(either_of_the_two_is_replaced),
        cmocka_unit_test(one_that_gives_way_is_not_replaced),
        cmocka_unit_test(a_loop_hangs_after_its_time),
        cmocka_unit_test(a_loop_that_ticks_hangs_never),
        cmocka_unit_test(a_tick_begins_its_time_anew),
        cmocka_unit_test(there_is_nothing_to_guard),
        cmocka_unit_test(a_pause_of_the_computer_is_no_hang),
        cmocka_unit_test(it_is_tried_for_thirty_seconds),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
