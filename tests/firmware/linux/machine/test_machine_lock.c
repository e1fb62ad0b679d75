/* tests/firmware/linux/machine/test_machine_lock.c - two programs, or two
 * buses, on one real thing.
 *
 * Another process holds the locks of one rig while this one asks for those of
 * another: refused with its number, or let in.  Nothing of a rig is opened.  All
 * of it happens in a network namespace of its own where that is allowed, so that
 * tests side by side do not see each other. */
#define _GNU_SOURCE /* unshare */
#include <fcntl.h>
#include <sched.h>
#include <signal.h>
#include <stdio.h>
#include <string.h>
#include <sys/prctl.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include "firmware/linux/base/disk.h"
#include "firmware/linux/machine/guardian.h"
#include "firmware/linux/machine/machine_lock.h"
#include "motion/core/err.h"
#include "tests/support/check.h"

#define NOBODY 65534

#define BUSES(text) "buses:\n" text "axes:\n"
#define AXIS(name, bus, node)                                                  \
    "  " name ": {unit: mm, limits: {position: [0, 900], velocity: 50, "       \
    "acceleration: 40}, following_error: {floor: 9, time: 200 ms}, drive: "    \
    "{kind: modbus, bus: " bus ", node: " node                                 \
    ", map: leadshine-cs2rs, counts: 2000 per mm, unsupervised: yes}}\n"
#define SERVER(host, port, node)                                               \
    BUSES("  net: {kind: modbus-tcp, host: '" host "', port: " port "}\n")     \
    AXIS("x", "net", node)
/* @ is the directory of the test: term and link are one terminal. */
#define PORT(device)                                                           \
    BUSES("  line: {kind: modbus-rtu, baud: 115200, device: '" device "'}\n")  \
    AXIS("x", "line", "1")
#define CARD(interface)                                                        \
    BUSES(                                                                     \
        "  can: {kind: canopen, bit_rate: 1 Mbit/s, interface: " interface "}" \
        "\n")                                                                  \
    "  x: {unit: mm, limits: {position: [0, 900], velocity: 50, "              \
    "acceleration: 40}, following_error: {floor: 9}, drive: {kind: cia402, "   \
    "bus: can, node: 1, counts: 2000 per mm}}\n"
#define TWO_SERVERS(first, second)                                             \
    BUSES("  a: {kind: modbus-tcp, host: '" first                              \
          "', port: 1502}\n  b: {kind: modbus-tcp, host: '" second             \
          "', port: 1502}\n")                                                  \
    AXIS("x", "a", "1") AXIS("y", "b", "2")

static char directory[] = "/tmp/test_machine_lock_XXXXXX";
static int terminal;

static void in_directory(char *path, const char *name)
{
    snprintf(path, 128, "%s/%s", directory, name);
}

/* ---- rigs from texts ---- */

static void load(struct rig *rig, const char *name, const char *text)
{
    char path[128], message[YAML_MESSAGE_MAX];
    in_directory(path, name);
    FILE *file = fopen(path, "w");

    assert_non_null(file);
    for (; *text != '\0'; text++)
        if (*text == '@')
            assert_true(fputs(directory, file) >= 0);
        else
            assert_true(fputc(*text, file) >= 0);
    assert_int_equal(fclose(file), 0);
    if (rig_load(&disk_files, path, rig, message) < 0)
        fail_msg("%s", message);
}

/* ---- the other process ---- */

struct other {
    pid_t pid;
    int out; /* says "!" once it holds them, or what it was refused with */
    char said[YAML_MESSAGE_MAX];
};

static void other_run(const struct rig *rig,
                      const struct machine_lock_config *config, uid_t uid,
                      int out)
{
    struct machine_lock lock;
    char message[YAML_MESSAGE_MAX] = "!";

    (void)prctl(PR_SET_PDEATHSIG, SIGKILL); /* ends with the test */
    if (uid != 0 && setuid(uid) < 0)
        snprintf(message, sizeof message, "no setuid");
    else
        (void)machine_lock_take(&lock, rig, config, message);
    (void)!write(out, message, strlen(message) + 1);
    for (;;)
        pause();
}

static struct other other_begin(const struct rig *rig,
                                const struct machine_lock_config *config,
                                uid_t uid)
{
    struct other other = { .pid = 0 };
    int ends[2];

    assert_int_equal(pipe(ends), 0);
    other.pid = fork();
    if (other.pid == 0)
        other_run(rig, config, uid, ends[1]);
    close(ends[1]);
    other.out = ends[0];
    assert_true(read(ends[0], other.said, sizeof other.said) > 0);
    return other;
}

static void other_end(struct other *other)
{
    (void)kill(other->pid, SIGKILL);
    (void)waitpid(other->pid, NULL, 0);
    close(other->out);
}

/* ---- two programs ---- */

static const struct {
    const char *name, *first, *second;
    bool first_all, second_all, numeric;
    const char *what; /* NULL: both may */
} rows[] = {
    { "one unit of a server", SERVER("10.0.0.5", "1502", "1"),
      SERVER("10.0.0.5", "1502", "1"), 0, 0, 0,
      "unit 1 of bus net (10.0.0.5, port 1502) is in use by process " },
    { "two units of a gateway", SERVER("10.0.0.5", "1502", "1"),
      SERVER("10.0.0.5", "1502", "2"), 0, 0, 0, NULL },
    { "two ports of a computer", SERVER("10.0.0.5", "1502", "1"),
      SERVER("10.0.0.5", "1503", "1"), 0, 0, 0, NULL },
    { "a tool on a line that is in use", SERVER("10.0.0.5", "1502", "9"),
      SERVER("10.0.0.5", "1502", "1"), 0, 1, 0, "unit 9 of bus net (" },
    { "a move on a line that a tool has", SERVER("10.0.0.5", "1502", "1"),
      SERVER("10.0.0.5", "1502", "9"), 1, 0, 0, "bus net (10.0.0.5, " },
    { "two tools on a line", SERVER("10.0.0.5", "1502", "1"),
      SERVER("10.0.0.5", "1502", "9"), 1, 1, 0, "bus net (10.0.0.5, " },
    { "this computer by its name and its address",
      SERVER("localhost", "1502", "1"), SERVER("127.0.0.1", "1502", "1"), 0, 0,
      0, "unit 1 of bus net (localhost, port 1502) is in use by process " },
    { "this computer by its name and by IPv6", SERVER("localhost", "1502", "1"),
      SERVER("::1", "1502", "1"), 0, 0, 0, "unit 1 of bus net (" },
    { "this computer by another address", SERVER("127.0.0.1", "1502", "1"),
      SERVER("127.0.0.2", "1502", "1"), 0, 0, 0, "unit 1 of bus net (" },
    { "an address in two notations", SERVER("10.0.0.5", "1502", "1"),
      SERVER("::ffff:10.0.0.5", "1502", "1"), 0, 0, 0, "unit 1 of bus net (" },
    { "an address with fewer numbers", SERVER("10.0.0.5", "1502", "1"),
      SERVER("10.5", "1502", "1"), 0, 0, 0, "unit 1 of bus net (" },
    { "a name that is not looked up", SERVER("drives.invalid", "1502", "1"),
      SERVER("Drives.invalid.", "1502", "1"), 0, 0, 1, "unit 1 of bus net (" },
    { "localhost, not looked up", SERVER("127.0.0.1", "1502", "1"),
      SERVER("localhost", "1502", "1"), 0, 0, 1, "unit 1 of bus net (" },
    { "a serial port", PORT("@/term"), PORT("@/term"), 0, 0, 0,
      "bus line (/tmp/test_machine_lock_" },
    { "a serial port by a link", PORT("@/term"), PORT("@/link"), 0, 0, 0,
      "bus line (" },
    { "a serial port that is not there", PORT("@/none"), PORT("@/none"), 0, 0,
      0, NULL },
    { "a CAN interface", CARD("lo"), CARD("lo"), 0, 0, 0,
      "bus can (lo) is in use by process " },
    { "an interface that is not there", CARD("nocan7"), CARD("nocan7"), 0, 0, 0,
      NULL },
    { "a server and a serial port", SERVER("10.0.0.5", "1502", "1"),
      PORT("@/term"), 0, 0, 0, NULL },
};

static void the_second_is_refused_with_the_number_of_the_first(void **state)
{
    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(rows); i++) {
        const struct machine_lock_config first = { .all_units =
                                                       rows[i].first_all,
                                                   .numeric = rows[i].numeric };
        const struct machine_lock_config second = {
            .all_units = rows[i].second_all, .numeric = rows[i].numeric
        };
        struct rig one = { .bus_count = 0 }, two = { .bus_count = 0 };
        struct machine_lock lock;
        char message[YAML_MESSAGE_MAX] = "", hint[64];

        load(&one, "one.yaml", rows[i].first);
        load(&two, "two.yaml", rows[i].second);
        struct other other = other_begin(&one, &first, 0);
        assert_string_equal(other.said, "!");
        snprintf(hint, sizeof hint, "expected it to have ended: kill -INT %ld",
                 (long)other.pid);
        const int err = machine_lock_take(&lock, &two, &second, message);
        if (rows[i].what == NULL && err < 0)
            fail_msg("%s: %s", rows[i].name, message);
        if (rows[i].what != NULL &&
            (err != MOTION_E_STATE ||
             strncmp(message, rows[i].what, strlen(rows[i].what)) != 0 ||
             strstr(message, "test_machine_lock\" in ") == NULL ||
             strstr(message, hint) == NULL))
            fail_msg("%s: %d %s", rows[i].name, err, message);
        machine_lock_release(&lock);
        other_end(&other);
        /* killed, and nothing of it is left */
        if (machine_lock_take(&lock, &two, &second, message) < 0)
            fail_msg("%s, after it: %s", rows[i].name, message);
        machine_lock_release(&lock);
        rig_free(&one);
        rig_free(&two);
    }
}

static void a_rig_file_is_locked_by_whatever_path(void **state)
{
    struct rig rig = { .bus_count = 0 };
    struct machine_lock lock;
    char path[128], other_path[128], message[YAML_MESSAGE_MAX];

    (void)state;
    load(&rig, "one.yaml",
         "axes:\n  x: {unit: mm, limits: {position: [0, 9], "
         "velocity: 5, acceleration: 4}, following_error: "
         "{floor: 1}, drive: {kind: virtual}}\n");
    in_directory(path, "one.yaml");
    in_directory(other_path, "alias.yaml");
    (void)unlink(other_path);
    assert_int_equal(symlink(path, other_path), 0);
    struct other other =
        other_begin(&rig, &(struct machine_lock_config){ .rig_path = path }, 0);
    const struct machine_lock_config config = { .rig_path = other_path };
    assert_int_equal(machine_lock_take(&lock, &rig, &config, message),
                     MOTION_E_STATE);
    assert_int_equal(strncmp(message, "the rig is in use by process ", 29), 0);
    other_end(&other);
    assert_int_equal(machine_lock_take(&lock, &rig, &config, message), 0);
    machine_lock_release(&lock);
    (void)unlink(other_path);
    rig_free(&rig);
}

/* A guardian that is forked while its parent has the locks gets them when that
 * is gone, and not one moment before. */
static void a_child_has_them_only_once_its_parent_is_gone(void **state)
{
    const struct machine_lock_config config = { .all_units = false };
    struct rig rig = { .bus_count = 0 };
    struct machine_lock lock;
    char message[YAML_MESSAGE_MAX], byte = 0;
    int said[2], go[2];

    (void)state;
    load(&rig, "one.yaml", SERVER("10.0.0.5", "1502", "1"));
    assert_int_equal(pipe(said), 0);
    assert_int_equal(pipe(go), 0);
    const pid_t parent = fork();
    if (parent == 0) {
        (void)machine_lock_take(&lock, &rig, &config, message);
        if (fork() == 0) { /* ends with our end of the pipe */
            close(go[1]);
            byte = machine_lock_take(&lock, &rig, &config, message) == 0;
            (void)!write(said[1], &byte, 1);
            (void)!read(go[0], &byte, 1);
            byte = machine_lock_take(&lock, &rig, &config, message) == 0;
            (void)!write(said[1], &byte, 1);
            (void)!read(go[0], &byte, 1);
            _exit(0);
        }
        for (;;)
            pause();
    }
    assert_int_equal(read(said[0], &byte, 1), 1);
    assert_int_equal(byte, 0);
    (void)kill(parent, SIGKILL);
    (void)waitpid(parent, NULL, 0);
    assert_int_equal(write(go[1], &byte, 1), 1);
    assert_int_equal(read(said[0], &byte, 1), 1);
    assert_int_equal(byte, 1);
    close(go[1]);
    close(go[0]);
    close(said[0]);
    close(said[1]);
    rig_free(&rig);
}

/* Its loop may hang, and its user be another. */
static void one_that_is_stopped_and_of_another_user_is_named(void **state)
{
    const struct machine_lock_config config = { .all_units = false };
    const bool is_root = geteuid() == 0;
    struct rig rig = { .bus_count = 0 };
    struct machine_lock lock;
    char message[YAML_MESSAGE_MAX], who[64];

    (void)state;
    load(&rig, "one.yaml", SERVER("10.0.0.5", "1502", "1"));
    struct other other = other_begin(&rig, &config, is_root ? NOBODY : 0);
    assert_string_equal(other.said, "!");
    (void)kill(other.pid, SIGSTOP);
    assert_int_equal(machine_lock_take(&lock, &rig, &config, message),
                     MOTION_E_STATE);
    snprintf(who, sizeof who, "in use by process %ld%s, \"", (long)other.pid,
             is_root ? " of nobody" : "");
    assert_non_null(strstr(message, who));
    other_end(&other);
    rig_free(&rig);
}

/* What takes torque off gets there whoever is in its way. */
static void a_holder_is_taken_over_from(void **state)
{
    const struct machine_lock_config config = { .takes_over = true };
    const struct machine_lock_config plain = { .takes_over = false };
    struct rig rig = { .bus_count = 0 };
    struct machine_lock lock;
    char message[YAML_MESSAGE_MAX];
    int status;

    (void)state;
    load(&rig, "one.yaml", SERVER("10.0.0.5", "1502", "1"));
    for (int ignores = 1; ignores >= 0; ignores--) {
        (void)signal(GUARDIAN_GIVE_WAY, ignores ? SIG_IGN : SIG_DFL);
        struct other other = other_begin(&rig, &plain, 0);
        assert_int_equal(machine_lock_take(&lock, &rig, &config, message), 0);
        assert_int_equal(waitpid(other.pid, &status, 0), other.pid);
        assert_true(WIFSIGNALED(status));
        assert_int_equal(WTERMSIG(status),
                         ignores ? SIGKILL : GUARDIAN_GIVE_WAY);
        close(other.out);
        if (ignores)
            machine_lock_release(&lock);
    }
    /* and has what the other had */
    struct other next = other_begin(&rig, &plain, 0);
    assert_non_null(strstr(next.said, " is in use by process "));
    other_end(&next);
    /* one that may not kill it goes on beside it */
    if (geteuid() == 0) {
        next = other_begin(&rig, &config, NOBODY);
        assert_string_equal(next.said, "!");
        other_end(&next);
    }
    machine_lock_release(&lock);
    rig_free(&rig);
}

/* ---- two buses of one rig ---- */

static void two_buses_that_are_one_are_refused_with_the_line(void **state)
{
    static const struct {
        const char *rig, *says;
    } twice[] = {
        { TWO_SERVERS("127.0.0.1", "127.0.0.2"),
          "bus b (127.0.0.2, port 1502) is the same as bus a (localhost, port "
          "1502) in line 2 of the rig file, expected one bus" },
        { TWO_SERVERS("10.5", "10.0.0.5"), "bus b (10.0.0.5, port 1502) is the "
                                           "same as bus a (10.5, port 1502)" },
        { BUSES("  a: {kind: modbus-rtu, baud: 115200, device: '@/term'}\n"
                "  b: {kind: modbus-rtu, baud: 115200, device: '@/link'}\n")
              AXIS("x", "a", "1") AXIS("y", "b", "1"),
          "/link) is the same as bus a (" },
        { TWO_SERVERS("10.0.0.5", "10.0.0.6"), NULL },
    };
    const struct machine_lock_config config = { .all_units = false };

    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(twice); i++) {
        struct rig rig = { .bus_count = 0 };
        struct machine_lock lock;
        char message[YAML_MESSAGE_MAX] = "";

        load(&rig, "one.yaml", twice[i].rig);
        const int err = machine_lock_take(&lock, &rig, &config, message);
        if (twice[i].says == NULL
                ? err < 0
                : err != MOTION_E_ARG || strstr(message, twice[i].says) == NULL)
            fail_msg("%zu: %d %s", i, err, message);
        machine_lock_release(&lock);
        rig_free(&rig);
    }
}

/* Of two that begin at the same time with all units and with one, never both
 * go on. */
static void all_units_and_one_of_them_never_both_begin(void **state)
{
    const struct machine_lock_config all = { .all_units = true };
    const struct machine_lock_config one = { .all_units = false };
    struct rig rig = { .bus_count = 0 };
    char message[YAML_MESSAGE_MAX];

    (void)state;
    load(&rig, "one.yaml", SERVER("10.0.0.5", "1502", "200"));
    for (int i = 0; i < check_cases(400); i++) {
        struct machine_lock lock;
        int ends[2];
        char other_has = 0;

        assert_int_equal(pipe(ends), 0);
        const pid_t pid = fork();
        if (pid == 0) {
            (void)prctl(PR_SET_PDEATHSIG, SIGKILL);
            other_has =
                machine_lock_take(&lock, &rig, &one, message) == 0 ? 1 : 2;
            (void)!write(ends[1], &other_has, 1);
            for (;;)
                pause();
        }
        const bool has = machine_lock_take(&lock, &rig, &all, message) == 0;
        assert_int_equal(read(ends[0], &other_has, 1), 1);
        assert_false(has && other_has == 1);
        (void)kill(pid, SIGKILL);
        (void)waitpid(pid, NULL, 0);
        close(ends[0]);
        close(ends[1]);
        machine_lock_release(&lock);
    }
    rig_free(&rig);
}

static int make(void **state)
{
    char path[128], link[128];

    (void)state;
    alarm(60); /* nothing here takes that long */
    (void)!unshare(CLONE_NEWNET);
    if (mkdtemp(directory) == NULL || chmod(directory, 0755) < 0)
        return -1;
    terminal = posix_openpt(O_RDWR | O_NOCTTY);
    if (terminal < 0 || grantpt(terminal) < 0 || unlockpt(terminal) < 0)
        return -1;
    in_directory(path, "term");
    in_directory(link, "link");
    return symlink(ptsname(terminal), path) < 0 || symlink(path, link) < 0 ? -1
                                                                           : 0;
}

static int clean(void **state)
{
    static const char *const names[] = { "term", "link", "one.yaml",
                                         "two.yaml" };
    char path[128];

    (void)state;
    close(terminal);
    for (size_t i = 0; i < ARRAY_LEN(names); i++) {
        in_directory(path, names[i]);
        (void)unlink(path);
    }
    return rmdir(directory);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_second_is_refused_with_the_number_of_the_first),
        cmocka_unit_test(a_rig_file_is_locked_by_whatever_path),
        cmocka_unit_test(a_child_has_them_only_once_its_parent_is_gone),
        cmocka_unit_test(one_that_is_stopped_and_of_another_user_is_named),
        cmocka_unit_test(a_holder_is_taken_over_from),
        cmocka_unit_test(two_buses_that_are_one_are_refused_with_the_line),
        cmocka_unit_test(all_units_and_one_of_them_never_both_begin),
    };

    return cmocka_run_group_tests(tests, make, clean);
}
