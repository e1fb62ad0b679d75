/* tests/firmware/linux/commands/ports/test_doctor.c - slew doctor, shown machines of
 * our own making. */
#define _XOPEN_SOURCE 700 /* mkdtemp, nftw */
#include "tests/support/run_slew.h"

#include "firmware/linux/tools/doctor.h"

static struct doctor doctor;
static struct can_link fake_link;
static int fake_err;

static int link_of(const char *name, struct can_link *link)
{
    (void)name;
    *link = fake_link;
    return fake_err;
}

/* A machine on which nothing is to be done. */
static const struct {
    const char *file, *text;
} good[] = {
    { "proc/self/status", "Name:\tslew\nUid:\t1000\t1000\t1000\t1000\n"
                          "Gid:\t1000\t1000\nGroups:\t20 27 \nNStgid:\t1\n"
                          "CapEff:\t0000000000001000\n" },
    { "proc/self/limits",
      "Limit                     Soft Limit           Hard Limit    Units\n"
      "Max locked memory         8388608              8388608       bytes\n"
      "Max realtime priority     50                   50            \n" },
    { "proc/swaps", "Filename\tType\n" },
    { "proc/version", "Linux version 6.1.0 SMP PREEMPT_RT\n" },
    { "proc/sys/kernel/osrelease", "6.1.0-rt\n" },
    { "boot/config-6.1.0-rt",
      "CONFIG_CAN=m\nCONFIG_CAN_RAW=m\nCONFIG_CAN_DEV=m\n"
      "CONFIG_GPIO_CDEV=y\nCONFIG_USB_SERIAL=m\n"
      "CONFIG_HIGH_RES_TIMERS=y\n" },
    { "etc/group", "root:x:0:\ndialout:x:20:me\n" },
    { "sys/class/net/lo/type", "772\n" },
    { "sys/class/net/can0/type", "280\n" },
    { "sys/class/tty/ttyUSB0/dev", "188:0\n" },
    { "sys/class/tty/tty0/dev", "4:0\n" },
    { "sys/bus/usb-serial/devices/ttyUSB0/latency_timer", "1\n" },
    { "dev/ttyUSB0", "" },
    { "dev/gpiochip0", "" },
    { "sys/devices/system/cpu/cpu0/cpufreq/scaling_governor", "performance\n" },
    { "sys/devices/system/cpu/cpu0/cpuidle/state0/latency", "0\n" },
    { "sys/devices/system/cpu/cpu0/cpuidle/state0/name", "POLL\n" },
    { "sys/devices/system/cpu/cpu0/cpuidle/state1/latency", "900\n" },
    { "sys/devices/system/cpu/cpu0/cpuidle/state1/name", "C6\n" },
    { "sys/devices/system/cpu/cpu0/cpuidle/state1/disable", "1\n" },
    { "sys/devices/system/cpu/isolated", "\n" },
    { "sys/devices/system/clocksource/clocksource0/current_clocksource",
      "tsc\n" },
};

static int build(void **state)
{
    if (run_open(state) < 0)
        return -1;
    for (size_t i = 0; i < ARRAY_LEN(good); i++)
        run_put(good[i].file, good[i].text);
    chmod(run_path("dev/ttyUSB0"), 0666);
    chmod(run_path("dev/gpiochip0"), 0666);
    fake_err = 0;
    fake_link = (struct can_link){ .is_can = true,
                                   .kind = "can",
                                   .up = true,
                                   .running = true,
                                   .tx_queue = 128,
                                   .bit_rate = 1000000,
                                   .sample_permille = 875 };
    return 0;
}

static void examine(const struct rig *rig)
{
    const struct doctor_config config = { .root = run_slew()->directory,
                                          .rig = rig,
                                          .link = link_of };
    doctor_examine(&doctor, &config);
}

static void show(void)
{
    for (unsigned i = 0; i < doctor.count; i++)
        print_message(
            "%s %s: %s -> %s\n", doctor_verdict_text(doctor.line[i].verdict),
            doctor.line[i].topic, doctor.line[i].what, doctor.line[i].advice);
}

/* A line of that verdict with `what`, and `advice` beside it. */
static void expect_line(enum doctor_verdict verdict, const char *what,
                        const char *advice)
{
    for (unsigned i = 0; i < doctor.count; i++)
        if (doctor.line[i].verdict == verdict &&
            strstr(doctor.line[i].what, what) != NULL &&
            strstr(doctor.line[i].advice, advice) != NULL)
            return;
    show();
    fail_msg("no line %s \"%s\" -> \"%s\"", doctor_verdict_text(verdict), what,
             advice);
}

static void a_good_machine_needs_nothing(void **state)
{
    (void)state;
    examine(NULL);
    if (doctor_worst(&doctor) > DOCTOR_NOTE) {
        show();
        fail_msg("something is to be done");
    }
    expect_line(DOCTOR_OK, "can0 is up, 1000000 bit/s", "");
    expect_line(DOCTOR_OK, "/dev/ttyUSB0 may be opened", "");
    expect_line(DOCTOR_OK, "/dev/gpiochip0 may be opened", "");
    expect_line(DOCTOR_OK, "CAP_NET_ADMIN", "");
    expect_line(DOCTOR_OK, "SCHED_FIFO", "");
    expect_line(DOCTOR_OK, "(POLL) in 0 us", "");
    expect_line(DOCTOR_OK, "PREEMPT_RT", "");
    expect_line(DOCTOR_OK, "has CAN, GPIO", "");
    expect_line(DOCTOR_NOTE, "libmodbus 3", "");
}

static void what_a_service_has_met_is_said(void **state)
{
    cJSON *service = cJSON_Parse(
        "{\"buses\": [{\"name\": \"can0\"}, {\"name\": \"net\", \"says\": "
        "[\"3 stray bytes: x\", \"1 broken frame: y\", 7]}]}");
    const struct doctor_config config = { .root = run_slew()->directory,
                                          .link = link_of,
                                          .service = service };

    (void)state;
    doctor_examine(&doctor, &config);
    expect_line(DOCTOR_ADVICE, "net: 3 stray bytes: x", "");
    expect_line(DOCTOR_ADVICE, "net: 1 broken frame: y", "");
    cJSON_Delete(service);
}

static void what_is_wrong_is_found_with_its_remedy(void **state)
{
    static const struct {
        const char *file, *text;
        enum doctor_verdict verdict;
        const char *what, *advice;
    } row[] = {
        { "proc/self/limits", "Max realtime priority     0      0\n", DOCTOR_OK,
          "SCHED_FIFO", "" }, /* by CAP_SYS_NICE, below */
        { "proc/swaps", "Filename\tType\n/dev/sda2\tpartition\n", DOCTOR_ADVICE,
          "swap is on", "swapoff" },
        { "proc/version", "Linux version 6.1.0 SMP\n", DOCTOR_NOTE,
          "no PREEMPT_RT", "linux-image-rt" },
        { "sys/bus/usb-serial/devices/ttyUSB0/latency_timer", "16\n",
          DOCTOR_ADVICE, "ttyUSB0 keeps what it receives for up to 16 ms",
          "ttyUSB0/latency_timer" },
        { "sys/devices/system/cpu/cpu0/cpufreq/scaling_governor", "powersave\n",
          DOCTOR_ADVICE, "governor powersave", "performance" },
        { "sys/devices/system/cpu/cpu0/cpuidle/state1/disable", "0\n",
          DOCTOR_ADVICE, "(C6) in 900 us", "cpupower idle-set -D 100" },
        { "sys/devices/system/cpu/isolated", "2-3\n", DOCTOR_NOTE,
          "isolated processors: 2-3", "" },
        { "sys/devices/system/clocksource/clocksource0/current_clocksource",
          "hpet\n", DOCTOR_ADVICE, "hpet", "clocksource" },
        { "boot/config-6.1.0-rt", "CONFIG_CAN=m\n# CONFIG_CAN_RAW is not set\n",
          DOCTOR_NOTE, "CONFIG_CAN_RAW", "kernel" },
        { "proc/self/status", "Uid:\t1000\nGid:\t1000\nGroups:\t\nCapEff:\t0\n",
          DOCTOR_NOTE, "no CAP_NET_ADMIN", "sudo" },
        { "proc/self/status", "Uid: 1000\n", DOCTOR_NOTE,
          "does not say who we are", "" },
        { "proc/sys/kernel/osrelease", "5.0\n", DOCTOR_NOTE, "/boot/config-5.0",
          "" },
    };
    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(row); i++) {
        char before[4096];

        run_read(run_path(row[i].file), before, sizeof before);
        if (i == 0)
            run_put("proc/self/status", "Uid:\t1\nGid:\t1\nGroups:\t\n"
                                        "CapEff:\t0000000000801000\n");
        run_put(row[i].file, row[i].text);
        examine(NULL);
        expect_line(row[i].verdict, row[i].what, row[i].advice);
        run_put(row[i].file, before);
        run_put(good[0].file, good[0].text);
    }
    run_put("proc/self/limits", "Max realtime priority     0      0\n");
    examine(NULL);
    expect_line(DOCTOR_ADVICE, "priorities up to 0, slew takes 40",
                "rtprio 40");
}

static void a_device_of_another_group_is_refused_with_the_group(void **state)
{
    char group[64];
    struct stat about;

    (void)state;
    chmod(run_path("dev/ttyUSB0"), 0660);
    if (geteuid() == 0)
        assert_int_equal(chown(run_path("dev/ttyUSB0"), 0, 20), 0);
    assert_int_equal(stat(run_path("dev/ttyUSB0"), &about), 0);
    snprintf(group, sizeof group, "dialout:x:%u:\n", (unsigned)about.st_gid);
    run_put("etc/group", group);
    run_put("proc/self/status", "Uid:\t4242\nGid:\t4242\nGroups:\t27 \n"
                                "CapEff:\t0\n");
    examine(NULL);
    expect_line(DOCTOR_ADVICE, "/dev/ttyUSB0 may not be opened",
                "usermod -aG dialout");
    snprintf(group, sizeof group,
             "Uid:\t4242\nGid:\t4242\nGroups:\t27 %u \nCapEff:\t0\n",
             (unsigned)about.st_gid);
    run_put("proc/self/status", group);
    examine(NULL);
    expect_line(DOCTOR_OK, "/dev/ttyUSB0 may be opened", "");
}

static void every_state_of_an_interface_has_its_command(void **state)
{
    const struct can_link up = fake_link;
    struct can_link down = up, slow = up, restarts = up, small = up, off = up,
                    noisy = up, early = up, virtual = up;
    const struct {
        const struct can_link *link;
        enum doctor_verdict verdict;
        const char *what, *advice;
    } row[] = {
        { &down, DOCTOR_BAD, "can0 is down",
          "up txqueuelen 128 type can bitrate 1000000 restart-ms 0" },
        { &slow, DOCTOR_BAD, "can0 runs at 250000 bit/s, bus can0 of the rig",
          "bitrate 1000000" },
        { &restarts, DOCTOR_BAD, "restart-ms 100", "restart-ms 0" },
        { &small, DOCTOR_BAD, "queues 10 frames", "txqueuelen 128" },
        { &off, DOCTOR_BAD, "bus-off", "type can restart" },
        { &noisy, DOCTOR_ADVICE, "128 sending, 3 receiving", "termination" },
        { &early, DOCTOR_ADVICE, "50.0 %", "sample-point 0.875" },
        { &virtual, DOCTOR_OK, "can0 is up (vcan)", "" },
    };
    struct rig_bus bus = { .kind = RIG_CANOPEN,
                           .name = "can0",
                           .interface = "can0",
                           .bit_rate = 1000000 };
    const struct rig rig = { .bus = &bus, .bus_count = 1 };

    (void)state;
    down.up = false;
    slow.bit_rate = 250000;
    restarts.restart_ms = 100;
    small.tx_queue = 10;
    off.state = HAL_CAN_BUS_OFF;
    noisy.state = HAL_CAN_PASSIVE;
    noisy.tx_errors = 128;
    noisy.rx_errors = 3;
    early.sample_permille = 500;
    virtual.bit_rate = 0;
    virtual.sample_permille = 0;
    snprintf(virtual.kind, sizeof virtual.kind, "vcan");
    for (size_t i = 0; i < ARRAY_LEN(row); i++) {
        fake_link = *row[i].link;
        examine(&rig);
        expect_line(row[i].verdict, row[i].what, row[i].advice);
    }
    fake_link = up;
    bus.kind = RIG_CAN;
    bus.data_bit_rate = 5000000;
    examine(&rig);
    expect_line(DOCTOR_BAD, "can0 takes no FD frames",
                "dbitrate 5000000 fd on");
    fake_link.fd = true;
    examine(&rig);
    expect_line(DOCTOR_OK, "can0 is up, 1000000 bit/s, FD", "");
    rig.bus[0].kind = RIG_CANOPEN;
    fake_err = MOTION_E_IO;
    examine(&rig);
    expect_line(DOCTOR_NOTE, "the kernel was not queried", "");
    snprintf(rig.bus[0].interface, sizeof rig.bus[0].interface, "can7");
    examine(&rig);
    expect_line(DOCTOR_BAD, "no interface can7", "adapter");
}

static void wake_ups_are_measured(void **state)
{
    const struct doctor_config config = { .root = run_slew()->directory,
                                          .measure_ns = INT64_C(50000000),
                                          .period_ns = INT64_C(1000000) };
    unsigned count = 0, usual_us = 0;
    long mean_us = -1, worst_us = -1;
    const struct doctor_line *line;
    const char *numbers;

    (void)state;
    doctor_examine(&doctor, &config);
    line = &doctor.line[doctor.count - 1];
    assert_string_equal(line->topic, "wake-ups");
    assert_int_equal(sscanf(line->what, "%u of every 1000 us", &count), 1);
    numbers = strstr(line->what, "in the mean");
    assert_non_null(numbers);
    assert_int_equal(sscanf(numbers,
                            "in the mean %ld us late, all but 1 in 1000 at "
                            "most %u us, the worst %ld us",
                            &mean_us, &usual_us, &worst_us),
                     3);
    assert_in_range(count, 1, 50);
    assert_true(mean_us >= 0 && mean_us <= worst_us);
    assert_true(usual_us <= (unsigned)worst_us + 1);
}

static void more_lines_than_there_is_room_for_end_with_a_note(void **state)
{
    char name[64];

    (void)state;
    for (unsigned i = 0; i < 60; i++) {
        snprintf(name, sizeof name, "sys/class/tty/ttyUSB%u/dev", i);
        run_put(name, "");
        snprintf(name, sizeof name,
                 "sys/bus/usb-serial/devices/ttyUSB%u/latency_timer", i);
        run_put(name, "16");
        snprintf(name, sizeof name, "dev/gpiochip%u", i);
        run_put(name, "");
    }
    examine(NULL);
    assert_int_equal(doctor.count, DOCTOR_LINES_MAX);
    assert_string_equal(doctor.line[DOCTOR_LINES_MAX - 1].what,
                        "more is not shown");
}

static void the_command_prints_every_line_and_its_status(void **state)
{
    (void)state;
    run("doctor", "--for", "0", "--root", run_slew()->directory);
    run_expect(STATUS_OK);
    run_says("can0 is there; the kernel was not queried");
    run_says("0 bad, 0 to improve");
    run("doctor", "--json", "--for", "0", "--root", run_slew()->directory);
    run_expect(STATUS_OK);
    run_says("\"verdict\":\t\"ok\"");
    run_put(
        "rig.yaml",
        "buses: {line: {kind: canopen, bit_rate: 1 Mbit/s, interface: "
        "can3}}\n"
        "axes:\n  a:\n    unit: mm\n    limits: {position: [0, 1], "
        "velocity: 1, acceleration: 1}\n    following_error: {floor: 1}\n"
        "    drive: {kind: cia402, bus: line, node: 1, counts: 1 per mm}\n");
    run("doctor", "--for", "0", "--root", run_slew()->directory,
        run_path("rig.yaml"));
    run_expect(STATUS_REFUSED);
    run_says("there is no interface can3 (bus line of the rig)");
    run("doctor", "--for", "0", "--root", run_slew()->directory, "--interface",
        "can0", run_path("rig.yaml"));
    run_expect(STATUS_OK);
    run("doctor", "/nowhere.yaml");
    run_expect(STATUS_INPUT);
}

#define doctor_test(name)                                                      \
    cmocka_unit_test_setup_teardown(name, build, run_close)

int main(void)
{
    const struct CMUnitTest tests[] = {
        doctor_test(a_good_machine_needs_nothing),
        doctor_test(what_a_service_has_met_is_said),
        doctor_test(what_is_wrong_is_found_with_its_remedy),
        doctor_test(a_device_of_another_group_is_refused_with_the_group),
        doctor_test(every_state_of_an_interface_has_its_command),
        doctor_test(wake_ups_are_measured),
        doctor_test(more_lines_than_there_is_room_for_end_with_a_note),
        doctor_test(the_command_prints_every_line_and_its_status),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
