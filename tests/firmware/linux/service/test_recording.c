/* tests/firmware/linux/service/test_recording.c - a service records its ticks, and
 * goes on when the file is complete. */
#include <dirent.h>

#include "firmware/host/recording/record_read.h"
#include "sim/device/cia402/servo.h"
#include "tests/support/check.h"
#include "tests/support/service_bench.h"

static const char rig_text[] =
    "buses: {can0: {kind: canopen, bit_rate: 1 Mbit/s}}\n"
    "axes:\n"
    "  pan:\n"
    "    unit: deg\n"
    "    limits: {position: [-90 deg, 90 deg], velocity: 60 deg/s,"
    " acceleration: 120 deg/s2}\n"
    "    following_error: {floor: 1 deg}\n"
    "    drive: {kind: cia402, bus: can0, node: 1, counts: 4096 per deg}\n";

static struct service_bench bench;
static struct service_recording recording;
static const struct service_recording_about about = {
    .rig_path = "rig.yaml",
    .rig_text = rig_text,
    .rig_length = sizeof rig_text - 1,
};

static int set_up(void **state)
{
    (void)state;
    memset(&bench, 0, sizeof bench);
    memset(&recording, 0, sizeof recording);
    if (service_bench_open(&bench, rig_text) < 0)
        return -1;
    service_recording_init(&recording, bench.directory, &bench.rig,
                           bench.machine.ports.clock);
    bench.loop.recording = &recording;
    bench.control.recording = &recording;
    return 0;
}

static int tear_down(void **state)
{
    DIR *directory = opendir(bench.directory);
    char path[400];
    (void)state;
    service_recording_free(&recording);
    for (const struct dirent *entry;
         directory != NULL && (entry = readdir(directory)) != NULL;)
        if (strstr(entry->d_name, ".mcap") || strstr(entry->d_name, ".csv")) {
            snprintf(path, sizeof path, "%s/%s", bench.directory,
                     entry->d_name);
            (void)unlink(path);
        }
    if (directory != NULL)
        closedir(directory);
    service_bench_close(&bench);
    return 0;
}

static void pause_a_little(void)
{
    nanosleep(&(struct timespec){ .tv_nsec = 2000000 }, NULL);
}

/* Virtual time is faster than a thread that writes: it is waited for. */
static void tick(unsigned ticks)
{
    for (unsigned i = 0; i < ticks; i++) {
        service_bench_tick(&bench);
        for (unsigned n = 0; n < 30000 && i % 500 == 499 &&
                             recorder_waiting(&recording.recorder) > 0;
             n++)
            pause_a_little();
    }
}

static int start(const char *name)
{
    char text[SERVICE_RECORDING_TEXT_MAX];
    return service_recording_start(&recording, name, &about, text);
}

static void stop(void)
{
    assert_int_equal(service_recording_stop(&recording), MOTION_OK);
    for (unsigned n = 0; n < 30000 && !service_recording_ended(&recording); n++)
        pause_a_little();
    assert_int_equal(recording.turn, SERVICE_RECORDING_OFF);
    assert_false(recording.failed);
    assert_int_equal(recording.rows_lost, 0);
}

static void read_back(const char *name, struct record_file *file)
{
    char path[128], message[YAML_MESSAGE_MAX];
    snprintf(path, sizeof path, "%s/%s", bench.directory, name);
    assert_int_equal(
        record_read(file, &disk_files, path, &bench.rig, NULL, message), 0);
}

static void every_tick_is_read_back(void **state)
{
    struct record_file file;
    (void)state;
    tick(10);
    for (unsigned i = 0; i < 2; i++) { /* the second counts anew */
        const char *name = i == 0 ? "one.mcap" : "two.mcap";
        assert_int_equal(start(name), MOTION_OK);
        tick(2500);
        stop();
        tick(10);
        read_back(name, &file);
        assert_true(file.ended);
        assert_int_equal(file.rows, 2500);
        assert_int_equal(file.rows_missing, 0);
        record_file_free(&file);
    }
}

static void csv_has_a_line_per_tick(void **state)
{
    char path[128], line[1024];
    unsigned lines = 0;
    (void)state;
    assert_int_equal(start("a.csv"), MOTION_OK);
    tick(700);
    stop();
    snprintf(path, sizeof path, "%s/a.csv", bench.directory);
    FILE *file = fopen(path, "r");
    assert_non_null(file);
    while (fgets(line, sizeof line, file) != NULL)
        lines++;
    fclose(file);
    assert_int_equal(lines, 701);
}

static void only_new_files_of_its_directory_are_written(void **state)
{
    static const char *const wrong[] = {
        "",      "../a.mcap", "/tmp/a.mcap", "a/b.csv",
        ".mcap", "a.txt",     "a",           ".a.csv",
    };
    char longest[SERVICE_RECORDING_NAME_MAX + 8];
    (void)state;
    tick(10);
    for (size_t i = 0; i < ARRAY_LEN(wrong); i++)
        assert_int_equal(start(wrong[i]), MOTION_E_ARG);
    memset(longest, 'a', sizeof longest);
    memcpy(longest + sizeof longest - 5, ".csv", 5);
    assert_int_equal(start(longest), MOTION_E_ARG);
    assert_int_equal(start("a.csv"), MOTION_OK);
    assert_int_equal(start("b.csv"), MOTION_E_STATE);
    stop();
    assert_int_equal(start("a.csv"), MOTION_E_ARG); /* is there */
    assert_int_equal(service_recording_stop(&recording), MOTION_E_STATE);
    recording.directory = NULL;
    assert_int_equal(start("c.csv"), MOTION_E_STATE);
    recording.directory = "/nowhere";
    assert_int_equal(start("c.csv"), MOTION_E_IO);
    assert_int_equal(recording.turn, SERVICE_RECORDING_OFF);
}

/* What nobody takes out is lost, and said; the tick goes on. */
static void a_writer_that_hangs_costs_rows(void **state)
{
    struct record_file file;
    (void)state;
    assert_int_equal(start("one.mcap"), MOTION_OK);
    (void)pthread_mutex_lock(&recording.lock);
    for (unsigned i = 0; i < RECORDER_ROWS + 100; i++)
        service_bench_tick(&bench);
    (void)pthread_mutex_unlock(&recording.lock);
    assert_int_equal(service_recording_stop(&recording), MOTION_OK);
    for (unsigned n = 0; n < 30000 && !service_recording_ended(&recording); n++)
        pause_a_little();
    assert_true(recording.rows_lost >= 99);
    read_back("one.mcap", &file);
    assert_true(file.ended);
    record_file_free(&file);
}

static unsigned warnings_noted;
static char notes[16384];
static void take_warning(void *context, int64_t t_ns, enum record_level level,
                         const char *text)
{
    (void)context;
    (void)t_ns;
    if (level != RECORD_WARNING)
        return;
    warnings_noted++;
    assert_non_null(
        strstr(text, "pan: following error over half of its limit, "));
}

static void take_row(void *context, const struct telemetry_row *row)
{
    (void)context;
    (void)row;
}

/* Every line that a client was sent since the last look. */
static char said[262144];
static void look(int file)
{
    const ssize_t got = recv(file, said, sizeof said - 1, 0);
    said[got > 0 ? got : 0] = '\0';
}

static unsigned count_said(const char *part)
{
    unsigned count = 0;
    for (const char *at = said; (at = strstr(at, part)) != NULL; at++)
        count++;
    return count;
}

static unsigned count_events(int file, const char *part)
{
    look(file);
    return count_said(part);
}

/* Whatever the axis lags by in a jog is over half of the limit that is judged
 * for warnings here; the controller's own is not. */
static void a_warning_is_an_event_and_in_the_recording(void **state)
{
    struct controller *controller = &bench.machine.controller;
    const struct controller_jog_goal goal = { .axis = 0,
                                              .vel_q32 = (int64_t)30 << 32,
                                              .pos_q32 = (int64_t)60 << 32 };
    const struct record_taker taker = { take_row, take_warning, NULL };
    char path[128], message[YAML_MESSAGE_MAX];
    struct record_file file;
    (void)state;
    const int client = service_bench_connect(&bench);
    assert_true(client >= 0);
    tick(10);
    assert_int_equal(start("warned.mcap"), MOTION_OK);
    assert_int_equal(controller_enable(controller), MOTION_OK);
    tick(1000);
    assert_int_equal(controller->state, CONTROLLER_READY);
    bench.rig.axis[0].following_floor_q32 = 2;
    bench.rig.axis[0].following_k_ns = 0;
    assert_int_equal(controller_jog(controller, &bench.machine.jog, &goal),
                     MOTION_OK);
    tick(300);
    assert_int_equal(controller->state, CONTROLLER_MOVING);
    stop();
    const unsigned told = bench.machine.warnings[0].newest.number;
    assert_true(told > 0);
    assert_int_equal(count_events(client, "\"event\":\"warning\""), told);
    snprintf(path, sizeof path, "%s/warned.mcap", bench.directory);
    assert_int_equal(
        record_read(&file, &disk_files, path, &bench.rig, &taker, message), 0);
    assert_int_equal(warnings_noted, told);
    record_file_free(&file);
    close(client);
}

static void take_note(void *context, int64_t t_ns, enum record_level level,
                      const char *text)
{
    const size_t length = strlen(notes);
    (void)context;
    (void)t_ns;
    if (level == RECORD_WARNING)
        snprintf(notes + length, sizeof notes - length, "%s\n", text);
}

/* An emergency message each. */
static void heat(void)
{
    struct sim_cia402 *drive = bench.sim.servo[0];
    drive->base.ops->heat(&drive->base, SIM_SERVO_COOL);
    drive->base.ops->heat(&drive->base, SIM_SERVO_WARM);
}

/* The first at once; of what a drive goes on to say one event per second, with how
 * often. */
static void what_drives_and_buses_say_is_told_at_once(void **state)
{
    const struct record_taker taker = { take_row, take_note, NULL };
    char path[128], message[YAML_MESSAGE_MAX];
    struct record_file file;
    (void)state;
    const int client = service_bench_connect(&bench);
    assert_true(client >= 0);
    tick(500);
    look(client);
    assert_int_equal(start("told.mcap"), MOTION_OK);
    tick(3);
    heat();
    tick(3);
    look(client);
    assert_int_equal(count_said("\"event\":\"drive\""), 1);
    assert_non_null(strstr(said, "\"axis\":\"pan\""));
    assert_non_null(strstr(said, "\"emergency message\":1"));
    assert_non_null(strstr(said, "\"emergency_code\":9041"));
    assert_non_null(strstr(said, "emergency message 1 (0x2351)"));
    for (unsigned i = 0; i < 90; i++) {
        heat();
        tick(10);
    }
    assert_int_equal(count_events(client, "\"event\":\"drive\""), 0);
    tick(200);
    look(client);
    assert_int_equal(count_said("\"event\":\"drive\""), 1);
    assert_non_null(strstr(said, "\"emergency message\":90"));
    bench.sim.port[0].destroy = 12; /* 8 of the counter each */
    tick(3);
    look(client);
    assert_int_equal(count_said("\"event\":\"bus\""), 1);
    assert_non_null(strstr(said, "\"bus\":\"can0\""));
    assert_non_null(strstr(said, "\"code\":\"error_warning\",\"count\":1"));
    tick(100);
    bench.sim.port[0].destroy = 12;
    tick(100);
    assert_int_equal(count_events(client, "\"event\":\"bus\""), 0);
    tick(1000);
    look(client);
    assert_int_equal(count_said("\"event\":\"bus\""), 1);
    assert_non_null(strstr(said, "\"count\":2"));
    assert_int_equal(count_said("\"event\":\"fault\""), 0);
    stop();
    snprintf(path, sizeof path, "%s/told.mcap", bench.directory);
    notes[0] = '\0';
    assert_int_equal(
        record_read(&file, &disk_files, path, &bench.rig, &taker, message), 0);
    assert_non_null(strstr(notes, "pan: "));
    assert_non_null(strstr(notes, "emergency message 1 (0x2351)\n"));
    assert_non_null(strstr(notes, "bus can0: error-warning\n"));
    record_file_free(&file);
    close(client);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_setup_teardown(every_tick_is_read_back, set_up,
                                        tear_down),
        cmocka_unit_test_setup_teardown(csv_has_a_line_per_tick, set_up,
                                        tear_down),
        cmocka_unit_test_setup_teardown(
            only_new_files_of_its_directory_are_written, set_up, tear_down),
        cmocka_unit_test_setup_teardown(a_writer_that_hangs_costs_rows, set_up,
                                        tear_down),
        cmocka_unit_test_setup_teardown(
            a_warning_is_an_event_and_in_the_recording, set_up, tear_down),
        cmocka_unit_test_setup_teardown(
            what_drives_and_buses_say_is_told_at_once, set_up, tear_down),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
