/* tests/firmware/studio/test_edit.c - edits of a move's text, as a page asks for
 * them (firmware/studio/wasm/edit.c, firmware/host/move/move_edit.c). */
#include <cjson/cJSON.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

#include "firmware/host/base/array.h"
#include "firmware/host/base/memory.h"
#include "firmware/studio/wasm/plan.h"

static const char rig[] =
    "buses: {can0: {kind: canopen, bit_rate: 1 Mbit/s}}\n"
    "axes:\n"
    "  x:\n"
    "    unit: mm\n"
    "    limits: {position: [-1000, 1000], velocity: 100, acceleration: 500}\n"
    "    following_error: {floor: 1 mm, time: 20 ms}\n"
    "    drive: {kind: cia402, bus: can0, node: 1, counts: 100 per mm}\n";

#define HEAD "# Ä\naxes:\n  x:\n    curve: bezier   # smooth\n    keys:\n"
#define ONE  "      - [0 s, 0 mm]      # one\n"
#define TWO  "      - {t: 2 s, p: 9}   # two\n"
#define FOUR "      # then\n      - t: 4\n        p: 5         # four\n"

static const char flow[] =
    "axes: {x: {curve: quintic, keys: [[0, 0], [1, 10, 3], [2 s, 5]]}}\n";
static const char block[] = HEAD ONE TWO FOUR;

#define POSED(weight, warp)                                                    \
    "poses: {a: {x: 0}, b: {x: 10}}\n"                                         \
    "blend: {base: a, weights: {b: {curve: quintic, keys: [" weight "]}}}\n"   \
    "warp: {curve: linear, keys: [" warp "]}\n"
static const char posed[] =
    POSED("[0, 0.5], [2 s, 50 %], [4, 0]", "[0, 0], [2 s, 1 s], [4, 4]");

static const struct {
    const char *name, *text, *operations, *want; /* "!...": is refused with */
} rows[] = {
    { "values get the unit that those before them had", block,
      "[{'op':'key','axis':'x','key':0,'p':-1.5},"
      "{'op':'key','axis':'x','key':1,'t':2.25,'p':8}]",
      HEAD "      - [0 s, -1.5 mm]      # one\n"
           "      - {t: 2.25 s, p: 8}   # two\n" FOUR },
    { "a text stands as it is", flow,
      "[{'op':'key','axis':'x','key':1,'p':'1.5 cm'}]",
      "axes: {x: {curve: quintic, keys: [[0, 0], [1, 1.5 cm, 3], [2 s, "
      "5]]}}\n" },
    { "a handle names what the short form does not", block,
      "[{'op':'key','axis':'x','key':0,'right':"
      "{'kind':'free','dt':0.3,'dp':5}}]",
      HEAD "      - {t: 0 s, p: 0 mm, right: [0.3 s, 5], "
           "handles: [auto-clamped, free]}      # one\n" TWO FOUR },
    { "an entry comes in a line of its own", block,
      "[{'op':'key','axis':'x','key':2,'left':{'kind':'vector'},"
      "'right':{'kind':'vector'}}]",
      HEAD ONE TWO FOUR "        handles: vector\n" },
    { "keys that pass each other are put in order, with their comments", block,
      "[{'op':'key','axis':'x','key':1,'t':5}]",
      HEAD ONE "      - t: 4\n        p: 5         # four\n      # then\n"
               "      - {t: 5 s, p: 9}   # two\n" },
    { "in brackets too", flow, "[{'op':'key','axis':'x','key':0,'t':1.5}]",
      "axes: {x: {curve: quintic, keys: [[1, 10, 3], [1.5, 0], [2 s, 5]]}}\n" },
    { "a new key comes where its time is", block,
      "[{'op':'add','axis':'x','t':1,'p':7},{'op':'add','axis':'x','t':9,"
      "'p':8}]",
      HEAD ONE "      - [1 s, 7 mm]\n" TWO FOUR "      - [9 s, 8 mm]\n" },
    { "and in brackets", flow, "[{'op':'add','axis':'x','t':0.5,'p':1}]",
      "axes: {x: {curve: quintic, keys: [[0, 0], [0.5, 1], [1, 10, 3], [2 s, "
      "5]]}}\n" },
    { "a copy of a key keeps its handles", block,
      "[{'op':'add','axis':'x','t':3,'p':1,'left':{'kind':'free','dt':-0.1,"
      "'dp':2},'right':{'kind':'auto'}}]",
      HEAD ONE TWO "      - {t: 3 s, p: 1 mm, left: [-0.1 s, 2], "
                   "handles: [free, auto]}\n" FOUR },
    { "keys go with their lines", block,
      "[{'op':'remove','axis':'x','key':0},{'op':'remove','axis':'x','key':2}]",
      HEAD TWO "      # then\n" },
    { "and the last with the comma before it", flow,
      "[{'op':'remove','axis':'x','key':2}]",
      "axes: {x: {curve: quintic, keys: [[0, 0], [1, 10, 3]]}}\n" },
    { "a value of the short form goes", flow,
      "[{'op':'key','axis':'x','key':1,'v':null}]",
      "axes: {x: {curve: quintic, keys: [[0, 0], [1, 10], [2 s, 5]]}}\n" },
    { "a value anywhere is replaced, or comes", flow,
      "[{'op':'curve','axis':'x','curve':'c4'},"
      "{'op':'set','path':['axes','x','ends'],'value':'rest'}]",
      "axes: {x: {curve: c4, keys: [[0, 0], [1, 10, 3], [2 s, 5]], ends: "
      "rest}}\n" },
    { "an axis that is not there", flow,
      "[{'op':'key','axis':'y','key':0,'t':1}]", "!has no keys of an axis" },
    { "a key that is not there", flow, "[{'op':'remove','axis':'x','key':3}]",
      "!has no number 4" },
    { "a text of two lines", flow,
      "[{'op':'key','axis':'x','key':0,'p':'1\\n2'}]", "!a text of one line" },
    { "no such operation", flow, "[{'op':'turn','axis':'x','key':0}]",
      "!is none of" },
    { "a path to nowhere", flow,
      "[{'op':'set','path':['warp','keys','0'],'value':'1'}]",
      "!has no \"warp\"" },
    { "no list", flow, "{}", "!no list" },
    { "keys of a weight and of the warp, with the units they have", posed,
      "[{'op':'key','axis':'pose b','key':1,'p':80},"
      "{'op':'key','axis':'pose b','key':0,'p':25},"
      "{'op':'key','axis':'the warp','key':1,'t':2.5,'p':1.5}]",
      POSED("[0, 0.25], [2 s, 80 %], [4, 0]",
            "[0, 0], [2.5 s, 1.5 s], [4, 4]") },
    { "they come and go", posed,
      "[{'op':'add','axis':'pose b','t':3,'p':10},"
      "{'op':'remove','axis':'the warp','key':1}]",
      POSED("[0, 0.5], [2 s, 50 %], [3, 0.1], [4, 0]", "[0, 0], [4, 4]") },
    { "a pose that has no weight", posed,
      "[{'op':'key','axis':'pose a','key':0,'p':1}]",
      "!has no keys of an axis" },
};

static struct studio_plan *planned(const char *text)
{
    struct store store = { .count = 0 };
    struct studio_plan *plan;

    store_put(&store, "rig.yaml", rig, strlen(rig));
    store_put(&store, "move.yaml", text, strlen(text));
    plan = studio_plan_new(&store, "rig.yaml", "move.yaml", NULL);
    store_free(&store);
    if (plan->status != STATUS_OK)
        fail_msg("%s", studio_plan_report(plan));
    return plan;
}

static void applied(const char *text, const cJSON *answer, char *out,
                    size_t size)
{
    const cJSON *edit;
    size_t at = 0, length = 0;

    cJSON_ArrayForEach(edit, cJSON_GetObjectItem(answer, "edits"))
    {
        const size_t from = (size_t)cJSON_GetObjectItem(edit, "from")->valueint;
        length += (size_t)snprintf(
            out + length, size - length, "%.*s%s", (int)(from - at), text + at,
            cJSON_GetObjectItem(edit, "insert")->valuestring);
        at = (size_t)cJSON_GetObjectItem(edit, "to")->valueint;
    }
    snprintf(out + length, size - length, "%s", text + at);
}

static void edits_change_the_text_where_they_are(void **state)
{
    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(rows); i++) {
        struct studio_plan *plan = planned(rows[i].text);
        char operations[512], got[1024];
        snprintf(operations, sizeof operations, "%s", rows[i].operations);
        for (char *c = operations; *c != 0; c++)
            *c = *c == '\'' ? '"' : *c;
        cJSON *answer = cJSON_Parse(studio_plan_edit(plan, operations));
        const cJSON *error = cJSON_GetObjectItem(answer, "error");
        if (rows[i].want[0] == '!') {
            if (error == NULL ||
                strstr(error->valuestring, rows[i].want + 1) == NULL)
                fail_msg("%s: %s", rows[i].name, plan->answer);
        } else {
            if (error != NULL)
                fail_msg("%s: %s", rows[i].name, plan->answer);
            applied(rows[i].text, answer, got, sizeof got);
            if (strcmp(got, rows[i].want) != 0)
                fail_msg("%s:\n%s", rows[i].name, got);
        }
        cJSON_Delete(answer);
        studio_plan_delete(plan);
    }
}

static void a_fit_is_edits_that_leave_no_violation(void **state)
{
    static const char fast[] =
        "axes: {x: {curve: s-curve, keys: [[0, 0], [1, 500]]}}  # fast\n";
    struct studio_plan *plan = planned(fast);
    char got[1024];

    (void)state;
    assert_int_not_equal(plan->job.violation_count, 0);
    cJSON *answer = cJSON_Parse(studio_plan_fit(plan, "local", ""));
    assert_null(cJSON_GetObjectItem(answer, "error"));
    applied(fast, answer, got, sizeof got);
    assert_non_null(strstr(got, "# fast"));
    struct studio_plan *again = planned(got);
    assert_int_equal(again->job.violation_count, 0);
    studio_plan_delete(again);
    cJSON_Delete(answer);
    assert_non_null(strstr(studio_plan_fit(plan, "faster", ""), "no such"));
    studio_plan_delete(plan);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(edits_change_the_text_where_they_are),
        cmocka_unit_test(a_fit_is_edits_that_leave_no_violation),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
