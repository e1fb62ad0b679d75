/* tests/motion/plan/shoot/test_plan_event.c - the events of a move as shots: times on
 * the path.  Every time is judged by looking at the track there. */
#include "motion/plan/shoot/plan_event.h"

#include "motion/core/err.h"
#include "tests/firmware/host/move/move_file.h"

#define RIG "tests/data/triggers/rig.yaml"

enum { CAMERA, LAMP, FLASH };

static struct move_file file;
static struct plan_shots shots;

static int close_all(void **state)
{
    (void)state;
    plan_shots_free(&shots);
    move_file_close(&file);
    return 0;
}

static void make(const char *text)
{
    struct plan_error error = { .text = "" };
    move_file_need(&file, RIG, text);
    if (plan_shots_make(&file.move, file.track, &file.outcome, CAMERA, &shots,
                        &error) < 0)
        fail_msg("%s", error.text);
}

static void expect_ms(uint32_t i, double t_ms)
{
    const double got = (double)shots.t_ns_q12[i] / 4096e6;
    if (fabs(got - t_ms) > 1e-6)
        fail_msg("shot %" PRIu32 " at %.9f ms, expected %.9f", i, got, t_ms);
}

#define LINE_X                                                                 \
    "axes: {x: {curve: linear, "                                               \
    "keys: [[0 s, 0], [2 s, 400]]}}\n"

static void by_time_once_and_again(void **state)
{
    (void)state;
    make(LINE_X "fps: 24\n"
                "events: [{line: camera, at: frame 36}, "
                "{line: camera, every: 400 ms, from: 100 ms, to: 900 ms}, "
                "{line: flash, at: 0}]\n");
    assert_int_equal(shots.count, 4);
    expect_ms(0, 100);
    expect_ms(1, 500);
    expect_ms(2, 900); /* `to` is included */
    expect_ms(3, 1500);
    assert_int_equal(shots.event[0], 1);
    assert_int_equal(shots.event[3], 0);
}

static void an_interval_begins_at_zero_and_ends_with_the_move(void **state)
{
    (void)state;
    make(LINE_X "events: [{line: camera, every: 500 ms}]\n");
    assert_int_equal(shots.count, 5);
    for (uint32_t i = 0; i < 5; i++)
        expect_ms(i, 500.0 * i);
}

static void where_an_axis_passes_both_ways(void **state)
{
    (void)state;
    make("axes: {x: {curve: linear, keys: [[0 s, 0], "
         "[1 s, 100], [2 s, 100], [3 s, -100]]}}\n"
         "events: [{line: camera, of: x, at: 50 mm}]\n");
    assert_int_equal(shots.count, 2);
    expect_ms(0, 500);
    expect_ms(1, 2250);
}

static void a_turn_at_the_position_is_one_shot(void **state)
{
    (void)state;
    make("axes: {x: {curve: s-curve, keys: [[0 s, 0], [1 s, 100], [3 s, 0]]}}\n"
         "events: [{line: camera, of: x, at: 100 mm}]\n");
    assert_int_equal(shots.count, 1);
    expect_ms(0, 1000);
}

static void standing_at_the_position_is_one_shot(void **state)
{
    (void)state;
    make("axes: {x: {curve: s-curve, keys: [[1 s, 7], [2 s, 100], [3 s, 100], "
         "[4 s, 7], [5 s, 7]]}}\n"
         "events: [{line: camera, of: x, at: 7 mm}]\n");
    assert_int_equal(shots.count, 2);
    expect_ms(0, 0); /* where it stands at first */
    /* it creeps the last 2^-33 mm */
    assert_true(llabs(shots.t_ns_q12[1] - 4 * MOVE_FILE_S) < 4096 * 100000);
}

static void every_so_far_on_an_axis_counts_from_where_it_is(void **state)
{
    (void)state;
    make("axes: {x: {curve: linear, keys: [[0 s, 10], "
         "[1 s, 110], [2 s, -90]]}}\n"
         "events: [{line: camera, of: x, every: 40 mm}]\n");
    /* up: 10 50 90; down: 90 50 10 -30 -70 */
    assert_int_equal(shots.count, 8);
    expect_ms(0, 0);
    expect_ms(1, 400);
    expect_ms(2, 800);
    expect_ms(3, 1100);
    expect_ms(7, 1900);
}

static void along_a_path_by_its_length(void **state)
{
    (void)state;
    make("path: {axes: [x, y], curve: linear, points: [[0, 0], [300, 400]], "
         "speed: {law: s-curve, time: 4 s}}\n"
         "events: [{line: camera, of: path, every: 100 mm, from: 50 mm, "
         "to: 350 mm}]\n");
    assert_int_equal(shots.count, 4);
    for (uint32_t i = 0; i < shots.count; i++) {
        const double t_s = (double)shots.t_ns_q12[i] / 4096e9;
        assert_true(
            fabs(move_file_pos(&file, "x", t_s) - 0.6 * (50 + 100 * i)) < 1e-4);
    }
}

/* On whatever track, with whatever grid: between two neighbours of the track's
 * samples there are as many shots as grid lines, and each shot is on one. */
static void shots_are_where_the_grid_is_crossed(void **state)
{
    (void)state;
    seed_from("grid");
    for (int round = 0; round < 60; round++) {
        char text[600];
        int at = snprintf(text, sizeof text,
                          "axes: {x: {curve: %s, keys: [[0 s, 3.5]",
                          round % 2 ? "quintic" : "s-curve");
        for (int i = 1; i < 7; i++)
            at += snprintf(text + at, sizeof text - (size_t)at, ", [%d s, %d]",
                           i, (int)(draw() % 400) - 200);
        const double every = (double)(2000000 + draw() % 27000000) / 1e6;
        snprintf(text + at, sizeof text - (size_t)at,
                 "]}}\nevents: [{line: camera, of: x, from: 0.123456 mm, "
                 "every: %.6f mm}]\n",
                 every);
        make(text);
        uint32_t k = 0;
        double before = move_file_pos(&file, "x", 0);
        for (int i = 1; i <= 60000; i++) {
            const int64_t t = (int64_t)i * MOVE_FILE_S / 10000;
            const double now = move_file_pos(&file, "x", i / 10000.0);
            const int lines = abs((int)floor((now - 0.123456) / every) -
                                  (int)floor((before - 0.123456) / every));
            int found = 0;
            for (; k < shots.count && shots.t_ns_q12[k] <= t; k++)
                found++;
            /* a turn may cross a line and come back between two samples */
            if (found != lines && found != lines + 2)
                fail_msg("%s at %d: %d shots, %d lines", text, i, found, lines);
            before = now;
        }
        assert_int_equal(k, shots.count);
        for (uint32_t i = 0; i < shots.count; i++) {
            struct motion_state at_shot;
            motion_track_state(&file.track[0], shots.t_ns_q12[i], &at_shot);
            const double off =
                (ldexp((double)at_shot.pos_q32, -32) - 0.123456) / every;
            if (fabs(off - nearbyint(off)) * every > 1e-6)
                fail_msg("%s shot %" PRIu32 " at %.9f s is %.9f steps", text, i,
                         (double)shots.t_ns_q12[i] / 4096e9, off);
        }
        close_all(NULL);
    }
    make(LINE_X "events: [{line: camera, at: 0}]\n"); /* for the teardown */
}

static void what_never_fires_is_refused(void **state)
{
    static const struct {
        const char *event, *what;
    } rows[] = {
        { "{line: camera, at: 2.001 s}", "after the end of the move" },
        { "{line: camera, of: x, at: 401 mm}", "where the axis never comes" },
    };
    struct plan_error error;
    char text[400];
    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(rows); i++) {
        snprintf(text, sizeof text, LINE_X "events:\n  - %s\n", rows[i].event);
        move_file_need(&file, RIG, text);
        assert_int_equal(plan_shots_make(&file.move, file.track, &file.outcome,
                                         CAMERA, &shots, &error),
                         MOTION_E_RANGE);
        assert_non_null(strstr(error.text, rows[i].what));
        assert_int_equal(error.place.line, 3);
        assert_null(shots.t_ns_q12);
        move_file_close(&file);
    }
    make(LINE_X "events: [{line: camera, at: 2 s}]\n");
    assert_int_equal(shots.count, 1);
}

static void too_many_are_refused(void **state)
{
    struct plan_error error;
    (void)state;
    move_file_need(&file, RIG,
                   LINE_X "events: [{line: camera, every: 1 us}]\n");
    assert_int_equal(plan_shots_make(&file.move, file.track, &file.outcome,
                                     CAMERA, &shots, &error),
                     MOTION_E_FULL);
    assert_null(shots.t_ns_q12);
}

static void malformed_events_are_refused(void **state)
{
    static const struct {
        const char *event, *message;
    } rows[] = {
        { "{line: lamp, at: 1 s}", "2:17: unknown line 'lamp'" },
        { "{line: camera}", "the event has neither at nor every" },
        { "{at: 1 s}", "the event has no 'line'" },
        { "{line: camera, at: -1 s}", "at '-1 s' is before the start of the "
                                      "move" },
        { "{line: camera, at: 10 mm}", "at '10 mm' is a length" },
        { "{line: camera, of: x, at: 1 s}", "at '1 s' is a time" },
        { "{line: camera, of: y, at: 1}", "unknown of 'y'" },
        { "{line: camera, of: path, at: 1}", "of is path, and the move has "
                                             "none" },
        { "{line: camera, at: 1, every: 1}", "every is given beside at" },
        { "{line: camera, every: 0 s}", "every '0 s' is not above zero" },
        { "{line: camera, at: 1 s, from: 1 s}", "from is for events with "
                                                "every" },
        { "{line: camera, of: x, every: 1, to: 3}", "to is for events with "
                                                    "every of time or path" },
        { "{line: camera, every: 1 s, from: 1 s, to: 0 s}",
          "to '0 s' is before from" },
    };
    char text[400];
    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(rows); i++) {
        snprintf(text, sizeof text, LINE_X "events: [%s]\n", rows[i].event);
        move_file_refuse(RIG, text, rows[i].message);
    }
    make(LINE_X "events: [{line: camera, at: 0}]\n");
}

#define RUN(test) cmocka_unit_test_teardown(test, close_all)

int main(void)
{
    const struct CMUnitTest tests[] = {
        RUN(by_time_once_and_again),
        RUN(an_interval_begins_at_zero_and_ends_with_the_move),
        RUN(where_an_axis_passes_both_ways),
        RUN(a_turn_at_the_position_is_one_shot),
        RUN(standing_at_the_position_is_one_shot),
        RUN(every_so_far_on_an_axis_counts_from_where_it_is),
        RUN(along_a_path_by_its_length),
        RUN(shots_are_where_the_grid_is_crossed),
        RUN(what_never_fires_is_refused),
        RUN(too_many_are_refused),
        RUN(malformed_events_are_refused),
    };
    return cmocka_run_group_tests_name("plan_event", tests, NULL, NULL);
}
