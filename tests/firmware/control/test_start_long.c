/* tests/firmware/control/test_start_long.c - what a command looks at of a move does
 * not grow with its length: pages of segments are counted, each as it is touched. */
#define _DEFAULT_SOURCE /* MAP_ANONYMOUS */
#include <signal.h>
#include <stdint.h>
#include <sys/mman.h>
#include <unistd.h>

#include "tests/firmware/control/playback_bench.h"

#define SHORT 10
#define LONG  10000
/* Two times are searched by halving, in 14 steps each, of 352 pages. */
#define SEARCHED 28

static struct {
    char *at;
    size_t size, page;
    volatile sig_atomic_t touched;
} guard;

static struct motion_track_summary summary[AXES];

static void guard_touch(int signal_number, siginfo_t *info, void *context)
{
    char *const at = info->si_addr;
    (void)context;
    if (at < guard.at || at >= guard.at + guard.size) {
        signal(signal_number, SIG_DFL);
        return;
    }
    guard.touched++;
    (void)mprotect(at - (size_t)(at - guard.at) % guard.page, guard.page,
                   PROT_READ | PROT_WRITE);
}

static void guard_shut(void)
{
    guard.touched = 0;
    assert_int_equal(mprotect(guard.at, guard.size, PROT_NONE), 0);
}

/* Make a track to and fro, the same for both axes. */
static void make_long(uint32_t count, bool is_summarised)
{
    guard.page = (size_t)sysconf(_SC_PAGESIZE);
    guard.size =
        (count * sizeof(struct motion_segment) / guard.page + 1) * guard.page;
    guard.at = mmap(NULL, guard.size, PROT_READ | PROT_WRITE,
                    MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    assert_ptr_not_equal(guard.at, MAP_FAILED);
    motion_track_init(&bench_track[0], (struct motion_segment *)guard.at, count,
                      0);
    const struct motion_state rest = { 0 };
    for (uint32_t i = 0; i < count; i++) {
        const struct motion_state to = { .pos_q32 = i % 2 == 0 ? UNIT : 0 };
        assert_int_equal(motion_track_append_quintic(&bench_track[0],
                                                     500 * MSQ12, &rest, &to),
                         MOTION_OK);
    }
    for (int i = 0; i < AXES; i++) {
        bench_track[i] = bench_track[0];
        if (is_summarised)
            motion_track_summarise(&bench_track[i], &summary[i]);
        bench_tracks[i] = &bench_track[i];
    }
    assert_int_equal(playback_load(&playback, bench_tracks), MOTION_OK);
    const struct sigaction action = { .sa_sigaction = guard_touch,
                                      .sa_flags = SA_SIGINFO };
    assert_int_equal(sigaction(SIGSEGV, &action, NULL), 0);
    guard_shut();
}

static int free_long(void **state)
{
    (void)state;
    signal(SIGSEGV, SIG_DFL);
    return munmap(guard.at, guard.size);
}

/* Its pages. */
static int told(enum mailbox_command command, int64_t value)
{
    guard_shut();
    const int err = tell(command, value);
    if (err != MOTION_OK)
        fail_msg("command %d: %d", (int)command, err);
    return guard.touched;
}

static void start_at_once(uint32_t count)
{
    make_long(count, true);
    assert_int_equal(controller_start(&controller, bench_tracks, NULL),
                     MOTION_OK);
    tick();
    assert_int_equal(guard.touched, 1); /* where it begins */
}

static void a_short_start_looks_at_one_page(void **state)
{
    (void)state;
    start_at_once(SHORT);
}

static void a_long_start_looks_at_one_page(void **state)
{
    (void)state;
    start_at_once(LONG);
}

/* The count counts: it is what a summary saves. */
static void without_a_summary_every_page_is_looked_at(void **state)
{
    (void)state;
    make_long(LONG, false);
    assert_int_equal(controller_start(&controller, bench_tracks, NULL),
                     MOTION_OK);
    assert_true((size_t)guard.touched >= guard.size / guard.page - 1);
}

/* Try all that an operator does in the course of a move. */
static void no_command_looks_at_all_of_a_long_move(void **state)
{
    (void)state;
    make_long(LONG, true);
    assert_in_range(told(MAILBOX_START, 0), 1, SEARCHED);
    until(CONTROLLER_MOVING);
    assert_in_range(guard.touched, 1, SEARCHED);
    for (int i = 0; i < 300; i++)
        tick();
    assert_in_range(told(MAILBOX_OVERRIDE, MOTION_CLOCK_WARP_ONE_Q30 / 2), 1,
                    SEARCHED);
    assert_in_range(told(MAILBOX_HOLD, 0), 1, SEARCHED);
    until_held();
    assert_in_range(told(MAILBOX_REVERSE, 1), 0, SEARCHED);
    assert_in_range(told(MAILBOX_RESUME, 0), 1, SEARCHED);
    assert_in_range(told(MAILBOX_HOLD, 0), 1, SEARCHED);
    until_held();
    assert_in_range(told(MAILBOX_GO, LONG / 2 * (500 * MSQ12)), 0, SEARCHED);
    until(CONTROLLER_HOLDING);
    assert_in_range(told(MAILBOX_RESUME, 0), 0, SEARCHED);
    assert_int_equal(controller.state, CONTROLLER_MOVING);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(a_short_start_looks_at_one_page,
                                        begin_ready, free_long),
        cmocka_unit_test_setup_teardown(a_long_start_looks_at_one_page,
                                        begin_ready, free_long),
        cmocka_unit_test_setup_teardown(
            without_a_summary_every_page_is_looked_at, begin_ready, free_long),
        cmocka_unit_test_setup_teardown(no_command_looks_at_all_of_a_long_move,
                                        begin_ready, free_long),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
