/* tests/firmware/linux/service/test_service_fault.c - what a service says of a fault of a
 * drive whose code has to be asked for: one event, with the time at which the fault was
 * seen, once the code is there. */
#include <math.h>

#include "sim/device/cia402/servo.h"
#include "tests/support/kind/drives.h"
#include "tests/support/service_ask.h"

static const char rig_text[] =
    "tick: 5 ms\n"
    "buses: {can0: {kind: canopen, bit_rate: 1 Mbit/s}}\n"
    "axes:\n"
    "  a:\n    unit: mm\n"
    "    limits: {position: [-1000, 1000], velocity: 100, acceleration: 200}\n"
    "    following_error: {floor: 5, time: 100 ms}\n"
    "    drive: {kind: cia402, bus: can0, node: 5, counts: 100 per mm}\n"
    "  b:\n    unit: mm\n"
    "    limits: {position: [-1000, 1000], velocity: 100, acceleration: 200}\n"
    "    following_error: {floor: 5, time: 100 ms}\n"
    "    drive: {kind: cia402, bus: can0, node: 5, axis: 2, counts: 100 per "
    "mm,\n"
    "      pdo: {rx: 0x405, tx: 0x385}}\n";

static void tick(void)
{
    service_bench_tick(&bench);
}

/* Events of that name among the lines that have come; the last one's text and time. */
static unsigned events(int file, const char *name, char text[256], double *t_s)
{
    static char lines[65536];
    unsigned count = 0;
    const ssize_t got = recv(file, lines, sizeof lines - 1, 0);
    lines[got > 0 ? got : 0] = '\0';
    for (char *line = strtok(lines, "\n"); line; line = strtok(NULL, "\n")) {
        cJSON *object = cJSON_Parse(line);
        const cJSON *event = cJSON_GetObjectItem(object, "event");
        if (event != NULL && strcmp(event->valuestring, name) == 0) {
            count++;
            *t_s = cJSON_GetNumberValue(cJSON_GetObjectItem(object, "t_s"));
            snprintf(text, 256, "%s",
                     cJSON_GetStringValue(cJSON_GetObjectItem(object, "text")));
        }
        cJSON_Delete(object);
    }
    return count;
}

static void a_fault_is_said_once_with_its_code(void **state)
{
    (void)state;
    for (unsigned i = 0; i < 2; i++) {
        const struct controller_fault_record *fault =
            &bench.machine.controller.fault;
        char text[256] = "", want[128];
        double t_s = 0;
        assert_int_equal(service_bench_ready(&bench, rig_text), 0);
        const int file = service_bench_connect(&bench);
        done(file, "{\"command\":\"take\",\"lease\":60}");
        done(file, "{\"command\":\"enable\"}");
        for (int n = 0;
             n < 3000 && bench.machine.controller.state != CONTROLLER_READY;
             n++)
            tick();
        (void)events(file, "fault", text, &t_s);
        sim_cia402_inject(SERVO_OF(sim_cia402, &bench.sim, i),
                          SIM_CIA402_OVERCURRENT);
        for (int n = 0; n < 200 && fault->fault == CONTROLLER_FAULT_NONE; n++)
            tick();
        const int64_t seen_ns = bench.loop.now_ns;
        assert_int_equal(events(file, "fault", text, &t_s), 0);
        for (int n = 0; n < 100; n++)
            tick();
        assert_int_equal(events(file, "fault", text, &t_s), 1);
        snprintf(want, sizeof want,
                 "%c: the drive reports a fault, drive fault "
                 "0x2310: current, output side",
                 "ab"[i]);
        assert_string_equal(text, want);
        assert_true(fabs(t_s - (double)seen_ns / 1e9) < 1e-6);
        cJSON *status = service_ask(file, "{\"command\":\"status\"}");
        assert_string_equal(
            cJSON_GetStringValue(cJSON_GetObjectItem(status, "fault")), want);
        cJSON_Delete(status);
        close(file);
        service_bench_close(&bench);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_fault_is_said_once_with_its_code),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
