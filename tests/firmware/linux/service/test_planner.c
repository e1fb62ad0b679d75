/* tests/firmware/linux/service/test_planner.c - moves that a service plans one after
 * the other: what is taken over from the one before changes no bit. */
#include <stdio.h>
#include <string.h>
#include <time.h>

#include "firmware/host/base/array.h"
#include "firmware/linux/service/planner.h"
#include "firmware/studio/wasm/store.h"
#include "motion/core/clock_warp.h"
#include "tests/support/check.h"

#define KEYS     30
#define TEXT_MAX 4000

static const char rig[] =
    "buses: {can0: {kind: canopen, bit_rate: 1 Mbit/s}}\n"
    "axes:\n"
    "  x:\n"
    "    unit: mm\n"
    "    limits: {position: [-900, 900], velocity: 400, acceleration: 1900}\n"
    "    following_error: {floor: 1 mm, time: 20 ms}\n"
    "    drive: {kind: cia402, bus: can0, node: 1, counts: 100 per mm}\n";

static void write_move(char text[TEXT_MAX], const char *curve,
                       const int key[KEYS])
{
    int n = snprintf(text, TEXT_MAX, "axes:\n  x:\n    curve: %s\n    keys:\n",
                     curve);

    for (int i = 0; i < KEYS; i++)
        n += snprintf(text + n, (size_t)(TEXT_MAX - n), "      - [%d s, %d]\n",
                      i, key[i]);
}

static struct service_move *planned(struct service_planner *planner,
                                    const char *text)
{
    struct service_move *move = NULL;

    assert_true(service_planner_ask(planner, text));
    while (move == NULL) {
        (void)nanosleep(&(struct timespec){ .tv_nsec = 200000 }, NULL);
        move = service_planner_take(planner);
    }
    return move;
}

/* As a planner that has planned nothing before. */
static void same(const struct service_move *move, const char *text)
{
    static struct job fresh;
    struct store store = { .count = 0 }, files;

    store_put(&store, "rig.yaml", rig, strlen(rig));
    store_put(&store, "move.yaml", text, strlen(text));
    store_snapshot(&store, &files);
    assert_int_equal(
        job_open(&fresh, &files.files, "rig.yaml", "move.yaml", false, NULL),
        STATUS_OK);
    job_check(&fresh, MOTION_CLOCK_WARP_ONE_Q30);
    assert_int_equal(move->status,
                     fresh.violation_count > 0 ? STATUS_REFUSED : STATUS_OK);
    assert_int_equal(move->job.violation_count, fresh.violation_count);
    for (uint32_t i = 0; i < fresh.violation_count; i++)
        assert_memory_equal(&move->job.violation[i].value,
                            &fresh.violation[i].value, sizeof(int64_t));
    assert_int_equal(move->job.track[0].count, fresh.track[0].count);
    for (uint32_t i = 0; i < fresh.track[0].count; i++)
        if (!job_same_segment(&move->job.track[0].segment[i],
                              &fresh.track[0].segment[i]))
            fail_msg("segment %u differs after\n%s", (unsigned)i, text);
    job_free(&fresh);
    store_free(&files);
    store_free(&store);
}

static void a_move_takes_over_what_did_not_change(void **state)
{
    static const char *const curves[] = { "bezier", "quintic", "c2" };
    static struct service_planner planner;
    char text[TEXT_MAX];
    unsigned refused = 0;

    (void)state;
    seed_from("edits of keys");
    assert_int_equal(
        service_planner_start(&planner, "rig.yaml", rig, sizeof rig - 1), 0);
    for (size_t c = 0; c < ARRAY_LEN(curves); c++) {
        struct service_move *last = NULL;   /* is played meanwhile */
        const int most = c == 1 ? 30 : 300; /* slow and fast */
        int key[KEYS];
        for (int i = 0; i < KEYS; i++)
            key[i] = (int)draw_below((uint32_t)most);
        /* Curves are fitted to a part of the range, which is to stay. */
        key[0] = 0;
        key[1] = most;
        for (int round = 0; round < 20; round++) {
            write_move(text, curves[c], key);
            struct service_move *move = planned(&planner, text);
            same(move, text);
            assert_int_equal(move->planned, KEYS - 1);
            if (round > 0 && c < 2)
                assert_in_range(move->reused, KEYS - 10, KEYS - 2);
            refused += move->status == STATUS_REFUSED;
            service_move_free(last);
            last = move;
            int *const other = &key[2 + draw_below(KEYS - 3)];
            *other = (*other + 1 + (int)draw_below((uint32_t)most - 1)) % most;
        }
        service_move_free(last);
    }
    assert_in_range(refused, 1, 40);
    service_planner_end(&planner);
}

/* What cannot be read leaves what was planned before it. */
static void a_text_that_is_wrong_costs_nothing_later(void **state)
{
    static struct service_planner planner;
    char text[TEXT_MAX];
    int key[KEYS] = { 0 };

    (void)state;
    assert_int_equal(
        service_planner_start(&planner, "rig.yaml", rig, sizeof rig - 1), 0);
    write_move(text, "quintic", key);
    service_move_free(planned(&planner, text));
    struct service_move *wrong = planned(&planner, "axes: {x: 3}\n");
    assert_int_equal(wrong->status, STATUS_INPUT);
    assert_non_null(strstr(wrong->text, "move.yaml:1:"));
    service_move_free(wrong);
    key[9] = 5;
    write_move(text, "quintic", key);
    struct service_move *move = planned(&planner, text);
    same(move, text);
    assert_in_range(move->reused, KEYS - 8, KEYS - 2);
    service_move_free(move);
    service_planner_end(&planner);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_move_takes_over_what_did_not_change),
        cmocka_unit_test(a_text_that_is_wrong_costs_nothing_later),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
