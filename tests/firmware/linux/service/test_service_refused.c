/* tests/firmware/linux/service/test_service_refused.c - a move that cannot be gone to or
 * begun: the service says which axis, from where and to where. */
#include "tests/support/service_ask.h"

static const char rig_text[] =
    "axes:\n"
    "  near:\n    unit: mm\n"
    "    limits: {position: [0, 100], velocity: 10, acceleration: 100}\n"
    "    following_error: {floor: 5, time: 100 ms}\n"
    "    drive: {kind: virtual}\n"
    "  far:\n    unit: mm\n"
    "    limits: {position: [-1000 m, 1000 m], velocity: 1, acceleration: 20}\n"
    "    following_error: {floor: 5, time: 100 ms}\n"
    "    drive: {kind: virtual}\n"
    "    sim: {start: 900 m}\n";

#define LOAD                                                                   \
    "{\"command\":\"load\",\"text\":\"axes:\\n"                                \
    "  near: {curve: quintic, keys: [[0 s, 50], [30 s, 60]]}\\n"               \
    "  far: {curve: quintic, keys: [[0 s, 2], [30 s, 3]]}\\n\"}"
#define TOO_FAR                                                                \
    "far: from 900000 to 2 mm at a quarter of its limits takes longer than "   \
    "3.26 days"

static void tick(void)
{
    service_bench_tick(&bench);
}

static void a_refusal_names_the_axis_and_its_numbers(void **state)
{
    (void)state;
    assert_int_equal(service_bench_ready(&bench, rig_text), 0);
    const int file = service_bench_connect(&bench);
    done(file, "{\"command\":\"take\",\"lease\":60}");
    done(file, "{\"command\":\"enable\"}");
    for (int i = 0;
         i < 3000 && bench.machine.controller.state != CONTROLLER_READY; i++)
        tick();
    done(file, LOAD);
    refused(file, "{\"command\":\"approach\"}", "RANGE", TOO_FAR);
    refused(file, "{\"command\":\"go\",\"to\":0}", "RANGE", TOO_FAR);
    refused(file, "{\"command\":\"start\"}", "AWAY",
            "near, at 0 and to be at 50 mm: ");
    close(file);
    service_bench_close(&bench);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_refusal_names_the_axis_and_its_numbers),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
