/* tests/firmware/studio/test_studio_plan.c - what the page is told of a plan. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cjson/cJSON.h>
#include <cmocka.h>

#include "firmware/studio/wasm/plan.h"

static const char rig[] =
    "buses: {can0: {kind: canopen, bit_rate: 1 Mbit/s}}\n"
    "gpio:\n"
    "  camera: {kind: trigger, line: 4, width: 1 ms, rest: 1 ms}\n"
    "axes:\n"
    "  x:\n"
    "    unit: mm\n"
    "    limits: {position: [-1000, 1000], velocity: 100, acceleration: 500}\n"
    "    following_error: {floor: 1 mm, time: 20 ms}\n"
    "    drive: {kind: cia402, bus: can0, node: 1, counts: 100 per mm}\n";

static struct studio_plan *planned(const char *text)
{
    struct store store = { .count = 0 };
    store_put(&store, "rig.yaml", rig, strlen(rig));
    store_put(&store, "move.yaml", text, strlen(text));
    struct studio_plan *plan =
        studio_plan_new(&store, "rig.yaml", "move.yaml", NULL);
    store_free(&store);
    return plan;
}

static void triggers_are_told_with_line_and_time(void **state)
{
    struct studio_plan *plan =
        planned("axes: {x: {curve: s-curve, keys: [[0, 0], [4, 20]]}}\n"
                "events: [{line: camera, at: 1.5 s},"
                " {line: camera, every: 1 s, from: 2 s}]\n");
    static const double want[] = { 1.5, 2, 3, 4 };
    (void)state;
    cJSON *report = cJSON_Parse(studio_plan_report(plan));
    const cJSON *events = cJSON_GetObjectItem(report, "events");
    assert_int_equal(cJSON_GetArraySize(events), 4);
    for (int i = 0; i < 4; i++) {
        const cJSON *event = cJSON_GetArrayItem(events, i);
        assert_string_equal(cJSON_GetObjectItem(event, "line")->valuestring,
                            "camera");
        assert_true(cJSON_GetObjectItem(event, "time_s")->valuedouble ==
                    want[i]);
    }
    cJSON_Delete(report);
    studio_plan_delete(plan);
}

static void of_a_wrong_file_there_are_none(void **state)
{
    struct studio_plan *plan =
        planned("axes: {x: {curve: s-curve, keys: [[0, 0], [4, 20]]}}\n"
                "events: [{line: camera, at: 9 s}]\n");
    (void)state;
    cJSON *report = cJSON_Parse(studio_plan_report(plan));
    assert_string_equal(cJSON_GetObjectItem(report, "status")->valuestring,
                        "input");
    assert_int_equal(cJSON_GetArraySize(cJSON_GetObjectItem(report, "events")),
                     0);
    cJSON_Delete(report);
    studio_plan_delete(plan);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(triggers_are_told_with_line_and_time),
        cmocka_unit_test(of_a_wrong_file_there_are_none),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
