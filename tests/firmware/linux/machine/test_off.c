/* tests/firmware/linux/machine/test_off.c - a port that is not there yet is opened
 * once it is, for as long as was said, whatever another bus is about meanwhile.
 *
 * Reads the real clock. */
#define _GNU_SOURCE /* posix_openpt, ptsname */
#include <fcntl.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

#include "firmware/host/job/job.h"
#include "firmware/linux/base/disk.h"
#include "firmware/linux/machine/off.h"
#include "tests/support/check.h"

#define SECOND INT64_C(1000000000)

static char folder[] = "/tmp/test_off_XXXXXX";
static char port[64], rig_path[64];
static int terminal;

static void *plug_in(void *unused)
{
    (void)unused;
    (void)nanosleep(&(struct timespec){ .tv_sec = 2 }, NULL);
    return symlink(ptsname(terminal), port) == 0 ? NULL : &terminal;
}

/* Nobody answers on either; the network one is open at once, and ticks. */
static void make_rig(struct rig *rig)
{
    struct messages messages = { .text = NULL };
    FILE *file = fopen(rig_path, "w");
    assert_non_null(file);
    fprintf(file,
            "tick: 1 ms\nbuses:\n"
            "  net: {kind: modbus-tcp, host: 127.0.0.1, port: 9}\n"
            "  line: {kind: modbus-rtu, device: %s, baud: 115200, parity: "
            "none}\naxes:\n",
            port);
    for (int i = 0; i < 2; i++)
        fprintf(file,
                "  %s:\n    unit: rev\n    limits: {position: [-9 rev, 9 rev], "
                "velocity: 60 rpm, acceleration: 1 rev/s2}\n"
                "    following_error: {floor: 2 rev, time: 1 s}\n"
                "    drive: {kind: modbus, bus: %s, node: 3, map: "
                "leadshine-el7, mode: point-to-point, unsupervised: yes, "
                "counts: 10000 per rev}\n",
                i == 0 ? "there" : "later", i == 0 ? "net" : "line");
    assert_int_equal(fclose(file), 0);
    assert_int_equal(job_read_rig(&disk_files, rig_path, rig, &messages),
                     STATUS_OK);
    messages_free(&messages);
}

static void a_port_is_waited_for_beside_a_bus_that_ticks(void **state)
{
    const struct off_config config = { .real = true,
                                       .open_ns = 5 * SECOND,
                                       .timeout_ns = 4 * SECOND };
    struct off_axis axis[2];
    struct rig rig = { 0 };
    pthread_t thread;
    void *failed;
    (void)state;
    assert_non_null(mkdtemp(folder));
    snprintf(port, sizeof port, "%s/port", folder);
    snprintf(rig_path, sizeof rig_path, "%s/rig.yaml", folder);
    terminal = posix_openpt(O_RDWR | O_NOCTTY);
    assert_true(terminal >= 0 && grantpt(terminal) == 0 &&
                unlockpt(terminal) == 0);
    make_rig(&rig);
    assert_int_equal(pthread_create(&thread, NULL, plug_in, NULL), 0);
    assert_false(off_all(&rig, &config, axis, NULL));
    assert_int_equal(pthread_join(thread, &failed), 0);
    assert_null(failed);
    print_message("there: %s\nlater: %s\n", axis[0].text, axis[1].text);
    /* it was opened, and does not answer */
    assert_null(strstr(axis[1].text, "serial port"));
    assert_non_null(strstr(axis[1].text, "does not answer"));
    rig_free(&rig);
    close(terminal);
    (void)unlink(port);
    (void)unlink(rig_path);
    (void)rmdir(folder);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_port_is_waited_for_beside_a_bus_that_ticks),
    };
    return cmocka_run_group_tests_name("off", tests, NULL, NULL);
}
