/* tests/firmware/linux/service/test_listen.c - many services that begin at one
 * moment at one path, where one was killed before or ends just then: one of them has
 * the socket, and whoever has it can be reached.
 *
 * Reads the real clock; asserts what happens, not how soon. */
#include <signal.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <sys/wait.h>
#include <unistd.h>

#include "firmware/linux/service/listen.h"
#include "tests/support/check.h"

#define RIVALS 6

static char folder[] = "/tmp/test_listen_XXXXXX";
static char path[64];

static int make_folder(void **state)
{
    (void)state;
    assert_non_null(mkdtemp(folder));
    snprintf(path, sizeof path, "%s/socket", folder);
    return 0;
}

static int remove_folder(void **state)
{
    (void)state;
    (void)unlink(path);
    return rmdir(folder);
}

static bool is_reached(void)
{
    struct sockaddr_un address = { .sun_family = AF_UNIX };
    const int file = socket(AF_UNIX, SOCK_STREAM, 0);
    snprintf(address.sun_path, sizeof address.sun_path, "%s", path);
    const bool reached =
        connect(file, (const struct sockaddr *)&address, sizeof address) == 0;
    close(file);
    return reached;
}

/* One that was left. */
static void leave_one(void)
{
    struct sockaddr_un address = { .sun_family = AF_UNIX };
    const int file = socket(AF_UNIX, SOCK_STREAM, 0);
    (void)unlink(path);
    snprintf(address.sun_path, sizeof address.sun_path, "%s", path);
    assert_int_equal(
        bind(file, (const struct sockaddr *)&address, sizeof address), 0);
    close(file);
}

/* Waits for the start, says whether it has the socket, and keeps it. */
static void rival(int start, int said)
{
    char byte;
    (void)!read(start, &byte, 1);
    if (freopen("/dev/null", "w", stderr) == NULL)
        _exit(1);
    byte = service_listen(path, 0600) >= 0 ? 'y' : 'n';
    (void)!write(said, &byte, 1);
    for (;;)
        pause();
}

/* How many have it. */
static unsigned contest(int ending)
{
    int start[2], said[2];
    pid_t child[RIVALS];
    unsigned have = 0;
    assert_true(pipe(start) == 0 && pipe(said) == 0);
    for (unsigned i = 0; i < RIVALS; i++) {
        child[i] = fork();
        if (child[i] == 0) {
            close(start[1]);
            rival(start[0], said[1]);
        }
    }
    close(start[0]);
    close(start[1]); /* all at once */
    if (ending >= 0)
        service_listen_end(ending, path);
    for (unsigned i = 0; i < RIVALS; i++) {
        char byte = 0;
        assert_int_equal(read(said[0], &byte, 1), 1);
        have += byte == 'y';
    }
    if (have > 0)
        assert_true(is_reached());
    for (unsigned i = 0; i < RIVALS; i++) {
        kill(child[i], SIGKILL);
        waitpid(child[i], NULL, 0);
    }
    close(said[0]);
    close(said[1]);
    return have;
}

static void one_of_many_has_the_socket(void **state)
{
    (void)state;
    for (int i = 0; i < check_cases(300); i++) {
        leave_one();
        assert_int_equal(contest(-1), 1);
    }
}

static void one_that_ends_takes_its_own_away(void **state)
{
    (void)state;
    for (int i = 0; i < check_cases(300); i++) {
        (void)unlink(path);
        const int ending = service_listen(path, 0600);
        assert_true(ending >= 0);
        assert_in_range(contest(ending), 0, 1);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(one_of_many_has_the_socket),
        cmocka_unit_test(one_that_ends_takes_its_own_away),
    };
    return cmocka_run_group_tests_name("listen", tests, make_folder,
                                       remove_folder);
}
