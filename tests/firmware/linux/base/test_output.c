/* tests/firmware/linux/base/test_output.c - files that are whole or not there,
 * and rows that outlive a kill. */
#define _XOPEN_SOURCE 700 /* mkdtemp */
#include <errno.h>
#include <signal.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include "firmware/linux/base/output.h"
#include "tests/support/check.h"

#define SECOND INT64_C(1000000000)
#define ROW    "0123456789abcdef0123456789abcdef0123456789abcdef\n"

static char directory[64];
static struct output output;

static int make_directory(void **state)
{
    (void)state;
    snprintf(directory, sizeof directory, "/tmp/slew-test-XXXXXX");
    return mkdtemp(directory) == NULL ? -1 : 0;
}

static const char *path_of(const char *name)
{
    static char path[4][128];
    static unsigned next;
    next = (next + 1) % 4;
    snprintf(path[next], sizeof path[next], "%s/%s", directory, name);
    return path[next];
}

/* Length of a file in bytes; -1: it is not there. */
static long length_of(const char *name)
{
    FILE *file = fopen(path_of(name), "rb");
    if (file == NULL)
        return -1;
    fseek(file, 0, SEEK_END);
    const long length = ftell(file);
    fclose(file);
    return length;
}

static int remove_directory(void **state)
{
    (void)state;
    unlink(path_of("a"));
    unlink(path_of("a.partial"));
    unlink(path_of("b"));
    return rmdir(directory);
}

static pid_t child_of(void (*run)(void))
{
    const pid_t child = fork();
    assert_true(child >= 0);
    if (child == 0) {
        run();
        _exit(0);
    }
    return child;
}

static int status_of(pid_t child)
{
    int status;
    assert_int_equal(waitpid(child, &status, 0), child);
    return status;
}

/* Rows of ten a second until t, as a recorder would. */
static void write_rows(int64_t until_ns)
{
    struct rows rows;
    rows_init(&rows, output.file);
    for (int64_t t_ns = 0; t_ns < until_ns; t_ns += SECOND / 10)
        rows_put(&rows, ROW, strlen(ROW), t_ns);
}

static void be_killed(void)
{
    if (output_open(&output, path_of("a")) < 0)
        _exit(1);
    write_rows(9 * SECOND + SECOND / 2);
    raise(SIGKILL);
}

static void be_killed_in_a_long_second(void)
{
    if (output_open(&output, path_of("a")) < 0)
        _exit(1);
    struct rows rows;
    rows_init(&rows, output.file);
    for (int i = 0; i < 100000; i++)
        rows_put(&rows, ROW, strlen(ROW), 0);
    raise(SIGKILL);
}

static void a_kill_leaves_whole_rows_to_the_last_second(void **state)
{
    const long row = (long)strlen(ROW);
    (void)state;
    assert_true(WIFSIGNALED(status_of(child_of(be_killed))));
    assert_int_equal(length_of("a"), -1);
    assert_in_range(length_of("a.partial"), 90 * row, 95 * row);
    assert_int_equal(length_of("a.partial") % row, 0);
    assert_true(WIFSIGNALED(status_of(child_of(be_killed_in_a_long_second))));
    assert_in_range(length_of("a.partial"), 100000 * row - ROWS_BUFFER,
                    100000 * row);
    assert_int_equal(length_of("a.partial") % row, 0);
    /* whoever writes the same file next takes its place */
    assert_int_equal(output_open(&output, path_of("a")), 0);
    write_rows(SECOND);
    assert_int_equal(output_commit(&output), 0);
    assert_int_equal(length_of("a"), 10 * row);
    assert_int_equal(length_of("a.partial"), -1);
}

static void try_to_write(void)
{
    _exit(output_open(&output, path_of("a")) == 0 ? 0 : 7);
}

static void what_is_being_written_is_left_alone(void **state)
{
    static struct output mine;
    (void)state;
    assert_int_equal(output_open(&mine, path_of("a")), 0);
    fputs("mine", mine.file);
    assert_int_equal(WEXITSTATUS(status_of(child_of(try_to_write))), 7);
    assert_int_equal(output_commit(&mine), 0);
    assert_int_equal(length_of("a"), 4);
    assert_int_equal(WEXITSTATUS(status_of(child_of(try_to_write))), 0);
}

/* Too large a file once; room again afterwards, when the reason is
 * forgotten. */
static void be_limited(bool keep)
{
    struct rlimit limit = { 5000, RLIM_INFINITY };
    signal(SIGXFSZ, SIG_IGN);
    if (output_open(&output, path_of("a")) < 0)
        _exit(1);
    output.keep = keep;
    setrlimit(RLIMIT_FSIZE, &limit);
    write_rows(20 * SECOND);
    limit.rlim_cur = RLIM_INFINITY;
    setrlimit(RLIMIT_FSIZE, &limit);
    errno = 0;
    if (output_commit(&output) == 0 || output.error != EFBIG)
        _exit(2);
}

static void be_limited_and_dropped(void)
{
    be_limited(false);
}

static void be_limited_and_kept(void)
{
    be_limited(true);
}

static void the_first_error_is_the_one_that_is_said(void **state)
{
    const long row = (long)strlen(ROW);
    (void)state;
    assert_int_equal(status_of(child_of(be_limited_and_dropped)), 0);
    assert_int_equal(length_of("a"), -1);
    assert_int_equal(length_of("a.partial"), -1);
    assert_int_equal(status_of(child_of(be_limited_and_kept)), 0);
    assert_int_equal(length_of("a"), -1);
    assert_in_range(length_of("a.partial"), 4000, 5000);
    assert_int_equal(length_of("a.partial") % row, 0);
}

static void a_link_in_the_place_of_the_partial_file_is_refused(void **state)
{
    (void)state;
    assert_int_equal(symlink(path_of("b"), path_of("a.partial")), 0);
    assert_int_equal(output_open(&output, path_of("a")), -1);
    assert_int_equal(length_of("b"), -1);
}

static void its_place_is_known_before_it_is_written(void **state)
{
    (void)state;
    assert_int_equal(output_open(&output, path_of("a")), 0);
    for (int i = 1; i <= 100000; i++) {
        fputc('x', output.file);
        if (i % 9973 == 0)
            assert_int_equal(ftell(output.file), i);
    }
    output_abandon(&output);
    assert_int_equal(length_of("a.partial"), -1);
}

#define RUN(test)                                                              \
    cmocka_unit_test_setup_teardown(test, make_directory, remove_directory)

int main(void)
{
    const struct CMUnitTest tests[] = {
        RUN(a_kill_leaves_whole_rows_to_the_last_second),
        RUN(what_is_being_written_is_left_alone),
        RUN(the_first_error_is_the_one_that_is_said),
        RUN(a_link_in_the_place_of_the_partial_file_is_refused),
        RUN(its_place_is_known_before_it_is_written),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
