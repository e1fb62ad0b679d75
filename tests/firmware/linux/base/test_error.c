/* tests/firmware/linux/base/test_error.c - what is said while something ticks waits
 * for no reader, whatever stderr is: of a pipe, a socket and a terminal that nobody
 * reads it takes what finds room, and the rest is left out. */
#define _GNU_SOURCE /* posix_openpt, cfmakeraw */
#include <fcntl.h>
#include <poll.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <termios.h>
#include <unistd.h>

#include "firmware/linux/base/error.h"
#include "tests/support/check.h"

#define LINES   20000  /* more than any of them takes */
#define MOST_S  20     /* then it has waited */
#define STOPPED "\023" /* Ctrl-S */

static int stderr_before, reader, writer;

static int open_pipe(void **state)
{
    int ends[2];
    (void)state;
    assert_int_equal(pipe(ends), 0);
    reader = ends[0];
    writer = ends[1];
    return 0;
}

static int open_socket(void **state)
{
    int ends[2];
    (void)state;
    assert_int_equal(socketpair(AF_UNIX, SOCK_STREAM, 0, ends), 0);
    reader = ends[0];
    writer = ends[1];
    return 0;
}

static int open_terminal(void **state)
{
    (void)state;
    reader = posix_openpt(O_RDWR | O_NOCTTY);
    assert_true(reader >= 0 && grantpt(reader) == 0 && unlockpt(reader) == 0);
    writer = open(ptsname(reader), O_RDWR | O_NOCTTY);
    assert_true(writer >= 0);
    return 0;
}

static int shut(void **state)
{
    (void)state;
    (void)alarm(0);
    error_hasten(false);
    close(reader);
    close(writer);
    return 0;
}

static void divert(void)
{
    stderr_before = dup(STDERR_FILENO);
    assert_int_equal(dup2(writer, STDERR_FILENO), STDERR_FILENO);
    (void)alarm(MOST_S);
}

static void divert_back(void)
{
    (void)alarm(0);
    (void)dup2(stderr_before, STDERR_FILENO);
    close(stderr_before);
}

static size_t bytes_there(void)
{
    static char text[65536];
    struct pollfd look = { .fd = reader, .events = POLLIN };
    size_t all = 0;
    for (ssize_t got; poll(&look, 1, 100) > 0 &&
                      (got = read(reader, text, sizeof text)) > 0;)
        all += (size_t)got;
    return all;
}

static void what_nobody_reads_is_left_out(void **state)
{
    static char lines[3 * 4096];
    (void)state;
    memset(lines, 'x', sizeof lines - 1);
    divert();
    error_hasten(true);
    for (unsigned i = 0; i < LINES; i++)
        error_say("lift: a line of what is said, number %u", i);
    error_put(lines);
    divert_back();
    const size_t first = bytes_there();
    assert_in_range(first, 1, LINES * 30);
    divert();
    error_say("lift: there is room again");
    divert_back();
    assert_in_range(bytes_there(), 26, 27); /* a terminal adds a CR */
}

static void a_terminal_that_is_stopped_is_not_waited_for(void **state)
{
    (void)state;
    struct pollfd stopped = { .fd = writer, .events = POLLOUT };
    assert_int_equal(write(reader, STOPPED, 1), 1);
    for (int i = 0; i < 1000 && poll(&stopped, 1, 0) > 0; i++)
        (void)poll(NULL, 0, 10); /* the kernel does it a little later */
    divert();
    error_hasten(true);
    error_say("lift: nobody sees this");
    divert_back();
    assert_int_equal(bytes_there(), 0);
}

/* A pager that is scrolled later gets all of it. */
static void otherwise_it_is_waited_for(void **state)
{
    (void)state;
    divert();
    for (unsigned i = 0; i < 500; i++)
        error_say("lift: %u", i);
    divert_back();
    assert_int_equal(bytes_there(), 10 * 8 + 90 * 9 + 400 * 10);
}

int main(void)
{
#define ERROR_TEST(claim, open)                                                \
    cmocka_unit_test_setup_teardown(claim, open, shut)
    const struct CMUnitTest tests[] = {
        ERROR_TEST(what_nobody_reads_is_left_out, open_pipe),
        ERROR_TEST(what_nobody_reads_is_left_out, open_socket),
        ERROR_TEST(what_nobody_reads_is_left_out, open_terminal),
        ERROR_TEST(a_terminal_that_is_stopped_is_not_waited_for, open_terminal),
        ERROR_TEST(otherwise_it_is_waited_for, open_pipe),
    };
    return cmocka_run_group_tests_name("error", tests, NULL, NULL);
}
