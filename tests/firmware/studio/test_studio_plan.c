/* tests/firmware/studio/test_studio_plan.c - what the page is told of a plan. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
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

static const char space_rig[] =
    "buses: {can0: {kind: canopen, bit_rate: 1 Mbit/s}}\n"
    "axes:\n"
#define SPACE_AXIS(name, node)                                                 \
    "  " name ":\n    unit: mm\n"                                              \
    "    limits: {position: [-9000, 9000], velocity: 900, acceleration: "      \
    "900}\n"                                                                   \
    "    following_error: {floor: 1 mm, time: 20 ms}\n"                        \
    "    drive: {kind: cia402, bus: can0, node: " node                         \
    ", counts: 100 per mm}\n"
    SPACE_AXIS("x", "1") SPACE_AXIS("y", "2");

static const char space_move[] = "path:\n"
                                 "  axes: [x, y]\n"
                                 "  points:\n"
                                 "    - [0 mm, 100]   # the door\n"
                                 "    - [30 cm, 200 mm]\n"
                                 "    - [500, 0]\n"
                                 "  speed: {law: quintic, time: 9 s}\n";

static struct studio_plan *planned_in_space(void)
{
    struct store store = { .count = 0 };
    store_put(&store, "rig.yaml", space_rig, strlen(space_rig));
    store_put(&store, "move.yaml", space_move, strlen(space_move));
    struct studio_plan *plan =
        studio_plan_new(&store, "rig.yaml", "move.yaml", NULL);
    store_free(&store);
    return plan;
}

static void points_of_a_path_are_told(void **state)
{
    static const double want[3][2] = { { 0, 100 }, { 300, 200 }, { 500, 0 } };
    struct studio_plan *plan = planned_in_space();
    (void)state;
    cJSON *report = cJSON_Parse(studio_plan_report(plan));
    const cJSON *points = cJSON_GetObjectItem(report, "points");
    assert_int_equal(cJSON_GetArraySize(points), 3);
    for (int i = 0; i < 3; i++) {
        const cJSON *point = cJSON_GetArrayItem(points, i);
        const cJSON *at = cJSON_GetObjectItem(point, "at");
        const cJSON *path = cJSON_GetObjectItem(point, "path");
        assert_int_equal(cJSON_GetArraySize(at), 2);
        for (int k = 0; k < 2; k++)
            assert_true(cJSON_GetArrayItem(at, k)->valuedouble == want[i][k]);
        assert_int_equal(cJSON_GetObjectItem(point, "line")->valueint, 4 + i);
        assert_string_equal(cJSON_GetObjectItem(point, "unit")->valuestring,
                            "mm");
        assert_int_equal(cJSON_GetArraySize(path), 3);
        assert_null(cJSON_GetObjectItem(point, "t"));
    }
    cJSON_Delete(report);
    studio_plan_delete(plan);
}

/* With a unit where the value had one. */
static void a_coordinate_is_set(void **state)
{
    static const struct {
        const char *point, *coordinate, *insert;
    } rows[] = { { "0", "0", "\"insert\":\"7.5 mm\"" },
                 { "0", "1", "\"insert\":\"7.5\"" },
                 { "1", "0", "\"insert\":\"7.5 mm\"" } };
    struct studio_plan *plan = planned_in_space();
    (void)state;
    for (unsigned i = 0; i < 3; i++) {
        char operation[200];
        snprintf(operation, sizeof operation,
                 "[{\"op\":\"set\",\"path\":[\"path\",\"points\",\"%s\","
                 "\"%s\"],\"value\":7.5,\"unit\":\"mm\"}]",
                 rows[i].point, rows[i].coordinate);
        const char *answer = studio_plan_edit(plan, operation);
        if (strstr(answer, rows[i].insert) == NULL)
            fail_msg("%s: %s", operation, answer);
    }
    studio_plan_delete(plan);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(triggers_are_told_with_line_and_time),
        cmocka_unit_test(of_a_wrong_file_there_are_none),
        cmocka_unit_test(points_of_a_path_are_told),
        cmocka_unit_test(a_coordinate_is_set),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
