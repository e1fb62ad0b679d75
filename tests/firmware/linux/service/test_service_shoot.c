/* tests/firmware/linux/service/test_service_shoot.c - moves with events, played by
 * a service in virtual time: when its lines are fired, what is recorded of it, and
 * what else such a move allows. */
#include <dirent.h>

#include "motion/core/clock_warp.h"
#include "tests/support/service_ask.h"

#define PERIOD_NS INT64_C(5000000)
#define SHOTS_MAX 64

static const char rig_text[] =
    "tick: 5 ms\nbuses: {can: {kind: canopen, bit_rate: 1 Mbit/s}}\n"
    "axes:\n  pan:\n    unit: deg\n    limits: {position: [-90 deg, 90 deg],"
    " velocity: 40 deg/s, acceleration: 100 deg/s2}\n"
    "    following_error: {floor: 5 deg, time: 100 ms}\n"
    "    homing: {by: here}\n"
    "    drive: {kind: cia402, bus: can, node: 1, counts: 131072 per rev}\n"
    "gpio:\n"
    "  camera: {kind: trigger, line: GPIO5, width: 50 ms}\n"
    "  flash: {kind: trigger, line: GPIO6, width: 10 ms, lead: 100 ms}\n";

#define PAN    "axes: {pan: {curve: s-curve, keys: [[0, 0], [4, 20]]}}\\n"
#define CAMERA PAN "events:\\n  - {line: camera, every: 1 s, from: 500 ms}\\n"
#define FLASH                                                                  \
    CAMERA "  - {line: flash, at: 0 s}\\n  - {line: flash, at: 2 s}\\n"

static struct service_recording recording;

/* Of both lines: when the path was where, at each pulse. */
static struct {
    int64_t t_ns[SHOTS_MAX], path_ns[SHOTS_MAX];
    unsigned count;
} fired[2];
static int64_t start_ns; /* of the move: its first tick in motion */

static int up(void **state)
{
    const struct service_recording_about about = {
        .rig_path = "rig.yaml",
        .rig_text = rig_text,
        .rig_length = sizeof rig_text - 1,
    };
    char text[SERVICE_RECORDING_TEXT_MAX];
    (void)state;
    memset(&bench, 0, sizeof bench);
    memset(&recording, 0, sizeof recording);
    memset(fired, 0, sizeof fired);
    start_ns = -1;
    if (service_bench_open(&bench, rig_text) < 0)
        return -1;
    service_recording_init(&recording, bench.directory, &bench.rig,
                           bench.machine.ports.clock);
    bench.loop.recording = &recording;
    for (int i = 0; i < 100; i++)
        service_bench_tick(&bench);
    return service_recording_start(&recording, "shoot.csv", &about, text);
}

static int down(void **state)
{
    char path[100];
    (void)state;
    service_recording_free(&recording);
    snprintf(path, sizeof path, "%s/shoot.csv", bench.directory);
    (void)unlink(path);
    service_bench_close(&bench);
    return 0;
}

static void tick(void)
{
    const struct machine *machine = &bench.machine;
    service_bench_tick(&bench);
    while (recorder_waiting(&recording.recorder) > RECORDER_ROWS / 2)
        service_ask_pause(); /* virtual time is faster than who writes */
    if (start_ns < 0 && machine->controller.state == CONTROLLER_MOVING &&
        machine->controller.rate.s_ns_q12 > 0)
        start_ns = machine->controller.now_ns -
                   machine->controller.rate.s_ns_q12 / MOTION_FIXED_NS_Q12;
    for (unsigned i = 0; i < 2; i++)
        if (machine->trigger[i].shot > 0) {
            fired[i].t_ns[fired[i].count] = machine->controller.now_ns;
            fired[i].path_ns[fired[i].count++] =
                machine->controller.rate.s_ns_q12 / MOTION_FIXED_NS_Q12;
            assert_int_equal(machine->trigger[i].shot, fired[i].count);
        }
}

static void ticks(int64_t ms)
{
    for (int64_t i = 0; i < ms / 5; i++)
        tick();
}

static int at_start(const char *load)
{
    const int file = service_bench_connect(&bench);
    done(file, "{\"command\":\"take\",\"lease\":60}");
    done(file, load);
    done(file, "{\"command\":\"enable\"}");
    ticks(2000);
    done(file, "{\"command\":\"home\"}");
    ticks(2000);
    done(file, "{\"command\":\"approach\"}");
    ticks(3000);
    assert_int_equal(bench.machine.controller.state, CONTROLLER_READY);
    return file;
}

#define LOAD(text) "{\"command\":\"load\",\"text\":\"" text "\"}"

static void every_event_is_fired_once_and_in_its_tick(void **state)
{
    const int file = at_start(LOAD(CAMERA));
    (void)state;
    done(file, "{\"command\":\"start\"}");
    ticks(6000);
    assert_int_equal(bench.machine.controller.state, CONTROLLER_READY);
    assert_int_equal(fired[0].count, 4);
    assert_int_equal(fired[1].count, 0);
    for (int i = 0; i < 4; i++)
        assert_in_range(fired[0].path_ns[i],
                        500000000 + i * INT64_C(1000000000),
                        500000000 + i * INT64_C(1000000000) + PERIOD_NS - 1);
    assert_false(bench.loop.shoot.is_armed);
    close(file);
}

/* And again; a line that leads is fired before the axes move, and the move begins
 * later by as much. */
static void what_leads_is_fired_before_the_start(void **state)
{
    const int file = at_start(LOAD(FLASH));
    (void)state;
    for (int take = 0; take < 2; take++) {
        memset(fired, 0, sizeof fired);
        start_ns = -1;
        if (take > 0) {
            done(file, "{\"command\":\"approach\"}");
            ticks(8000);
            memset(fired, 0, sizeof fired);
            start_ns = -1;
        }
        done(file, "{\"command\":\"start\"}");
        const bool starting = bench.loop.shoot.is_due;
        ticks(6000);
        assert_true(starting);
        assert_int_equal(fired[1].count, 2);
        assert_in_range(start_ns - fired[1].t_ns[0], 100000000 - PERIOD_NS,
                        100000000 + PERIOD_NS);
        assert_in_range(start_ns + INT64_C(2000000000) - fired[1].t_ns[1],
                        100000000 - PERIOD_NS, 100000000 + PERIOD_NS);
        assert_int_equal(fired[0].count, 4);
    }
    close(file);
}

static void after_a_stop_the_rest_is_not_fired(void **state)
{
    const int file = at_start(LOAD(CAMERA));
    (void)state;
    done(file, "{\"command\":\"start\"}");
    ticks(1800);
    done(file, "{\"command\":\"stop\"}");
    ticks(2000);
    assert_int_equal(fired[0].count, 2);
    done(file, "{\"command\":\"approach\"}");
    ticks(6000);
    assert_int_equal(fired[0].count, 2);
    assert_false(bench.loop.shoot.is_armed);
    close(file);
}

/* A jog, or torque off, within the lead. */
static void another_motion_within_the_lead_ends_it(void **state)
{
    const int file = at_start(LOAD(FLASH));
    (void)state;
    done(file, "{\"command\":\"start\"}");
    done(file, "{\"command\":\"off\"}");
    ticks(1000);
    assert_false(bench.loop.shoot.is_armed);
    assert_true(start_ns < 0);
    assert_int_equal(bench.machine.controller.state, CONTROLLER_OFF);
    close(file);
}

static void what_events_do_not_allow_is_refused(void **state)
{
    const int file =
        at_start(LOAD(PAN "events:\\n  - {line: camera, every: 70 ms}\\n"));
    (void)state;
    refused(file, "{\"command\":\"start\",\"times\":0}", "ARG",
            "the move has events, it is played once");
    refused(file, "{\"command\":\"start\",\"ping_pong\":true}", "ARG",
            "the move has events");
    refused(file, "{\"command\":\"go\",\"to\":1}", "ARG",
            "the move has events");
    refused(file, "{\"command\":\"loop\",\"times\":3}", "ARG",
            "the move has events");
    refused(file, "{\"command\":\"override\",\"percent\":150}", "LIMIT",
            "the shot of camera");
    done(file, "{\"command\":\"start\"}");
    ticks(500);
    refused(file, "{\"command\":\"reverse\"}", "ARG", "the move has events");
    done(file, "{\"command\":\"override\",\"percent\":50}");
    ticks(9000);
    assert_int_equal(fired[0].count, 58);
    refused(file, LOAD(PAN "events:\\n  - {line: camera, every: 20 ms}\\n"),
            "LIMIT", "the shot of camera");
    close(file);
}

static unsigned recorded(const char *column)
{
    char path[100], line[4096];
    unsigned at = 0, count = 0, shots = 0;
    (void)service_recording_stop(&recording);
    for (int i = 0; i < 5000 && !service_recording_ended(&recording); i++)
        service_ask_pause();
    snprintf(path, sizeof path, "%s/shoot.csv", bench.directory);
    FILE *file = fopen(path, "r");
    assert_non_null(file);
    assert_non_null(fgets(line, sizeof line, file));
    for (char *name = strtok(line, ",\n"); name != NULL;
         name = strtok(NULL, ",\n"), count++)
        if (strcmp(name, column) == 0)
            at = count;
    assert_true(at > 0);
    while (fgets(line, sizeof line, file) != NULL) {
        const char *cell = line;
        for (unsigned i = 0; i < at; i++)
            cell = strchr(cell, ',') + 1;
        if (atoi(cell) > 0)
            shots++;
    }
    fclose(file);
    return shots;
}

static void a_recording_has_them(void **state)
{
    const int file = at_start(LOAD(CAMERA));
    (void)state;
    done(file, "{\"command\":\"start\"}");
    ticks(6000);
    assert_int_equal(recorded("camera.shot"), 4);
    close(file);
}

#define SHOOT_TEST(claim) cmocka_unit_test_setup_teardown(claim, up, down)

int main(void)
{
    const struct CMUnitTest tests[] = {
        SHOOT_TEST(every_event_is_fired_once_and_in_its_tick),
        SHOOT_TEST(what_leads_is_fired_before_the_start),
        SHOOT_TEST(after_a_stop_the_rest_is_not_fired),
        SHOOT_TEST(another_motion_within_the_lead_ends_it),
        SHOOT_TEST(what_events_do_not_allow_is_refused),
        SHOOT_TEST(a_recording_has_them),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
