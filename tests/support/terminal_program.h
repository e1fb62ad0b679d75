/* tests/support/terminal_program.h - slew in a process of its own on a
 * pseudo-terminal or a pipe: what it writes is heard, keys are pressed.
 *
 * The program and its test may be paused by the machine at any time, together
 * or alone: what is awaited is what the program says.  Reads the real clock.
 * Needs _XOPEN_SOURCE 700 before the first header. */
#ifndef TESTS_SUPPORT_TERMINAL_PROGRAM_H
#define TESTS_SUPPORT_TERMINAL_PROGRAM_H

#include <fcntl.h>
#include <poll.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

#include "firmware/linux/commands/command.h"
#include "tests/support/check.h"

#define CAPACITY   65536
#define FOR_EVER_S 60.0 /* no pause of the machine is as long */

static char heard[CAPACITY];
static size_t heard_count;
static pid_t child;
static int line;

static inline void start(const char *const argv[], bool terminal)
{
    static char copy[16][64];
    char *word[17] = { NULL };
    int argc = 0, pipes[2] = { -1, -1 };
    for (; argv[argc] != NULL; argc++) {
        snprintf(copy[argc], sizeof copy[argc], "%s", argv[argc]);
        word[argc] = copy[argc];
    }
    heard_count = 0;
    line = terminal ? posix_openpt(O_RDWR | O_NOCTTY) : -1;
    if (terminal)
        assert_true(grantpt(line) == 0 && unlockpt(line) == 0);
    else
        assert_int_equal(pipe(pipes), 0);
    child = fork();
    assert_true(child >= 0);
    if (child > 0) {
        if (!terminal) {
            close(pipes[1]);
            line = pipes[0];
        }
        return;
    }
    setsid();
    const int in =
        terminal ? open(ptsname(line), O_RDWR) : open("/dev/null", O_RDONLY);
    const int out = terminal ? in : pipes[1];
    dup2(in, 0);
    dup2(out, 1);
    dup2(out, 2);
    close(line); /* only the parent holds the other end */
    exit((int)command_main(argc, word));
}

static inline double now_s(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec + (double)now.tv_nsec / 1e9;
}

/* Read for at most so long; false: the other side has gone. */
static inline bool hear(double seconds)
{
    struct pollfd ready = { .fd = line, .events = POLLIN };
    if (poll(&ready, 1, (int)(seconds * 1000)) <= 0)
        return true;
    const ssize_t count =
        read(line, heard + heard_count, CAPACITY - 1 - heard_count);
    if (count <= 0)
        return false;
    heard_count += (size_t)count;
    heard[heard_count] = 0;
    if (heard_count > CAPACITY / 2) { /* the end is what matters */
        memmove(heard, heard + CAPACITY / 4, heard_count - CAPACITY / 4 + 1);
        heard_count -= CAPACITY / 4;
    }
    return true;
}

static inline void forget(void)
{
    heard_count = 0;
    heard[0] = 0;
}

/* Hear so many of them from now on. */
static inline void expect_times(const char *text, unsigned times)
{
    const double end_s = now_s() + FOR_EVER_S;
    for (;;) {
        unsigned count = 0;
        for (const char *at = heard; (at = strstr(at, text)) != NULL; at++)
            count++;
        if (count >= times)
            return;
        if (now_s() > end_s)
            fail_msg("no %u '%s' in:\n%s", times, text, heard);
        hear(0.02);
    }
}

static inline void expect(const char *text)
{
    expect_times(text, 1);
}

static inline int finish(void)
{
    int status = -1;
    while (hear(FOR_EVER_S) && heard_count < CAPACITY - 1)
        if (waitpid(child, &status, WNOHANG) == child)
            break;
    if (status == -1)
        waitpid(child, &status, 0);
    for (int i = 0; i < 20 && hear(0.01); i++)
        ;
    close(line);
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

static inline void press(const char *key)
{
    assert_int_equal(write(line, key, strlen(key)), (ssize_t)strlen(key));
}

#endif
