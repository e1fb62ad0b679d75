/* tests/firmware/linux/service/test_service_couple.c - gears and cams of a service in
 * virtual time: what of a move they allow, and what is taken along with them. */
#include <math.h>

#include "motion/core/fixed.h"
#include "tests/support/service_ask.h"

static const char rig_text[] =
    "tick: 5 ms\n"
    "axes:\n"
    "  dolly:\n    unit: mm\n"
    "    limits: {position: [-100 mm, 2000 mm], velocity: 300 mm/s,"
    " acceleration: 200 mm/s2, jerk: 1000 mm/s3}\n"
    "    stop: {acceleration: 400 mm/s2, jerk: 4000 mm/s3}\n"
    "    following_error: {floor: 20 mm, time: 100 ms}\n"
    "    drive: {kind: virtual}\n"
    "  pan:\n    unit: deg\n"
    "    limits: {position: [-3600 deg, 3600 deg], velocity: 120 deg/s,"
    " acceleration: 60 deg/s2, jerk: 240 deg/s3}\n"
    "    following_error: {floor: 20 deg, time: 100 ms}\n"
    "    drive: {kind: virtual}\n"
    "  encoder:\n    unit: count\n"
    "    limits: {position: [-2000000, 2000000], velocity: 500000 count/s,"
    " acceleration: 400000 count/s2}\n"
    "    following_error: {floor: 40000 count, time: 50 ms}\n"
    "    drive: {kind: virtual}\n";

enum { DOLLY, PAN, ENCODER };

#define LOAD(text)  "{\"command\":\"load\",\"text\":\"" text "\"}"
#define CHECK(text) "{\"command\":\"check\",\"text\":\"" text "\"}"
#define START       "{\"command\":\"start\"}"
#define GEAR                                                                   \
    "{\"command\":\"gear\",\"axis\":\"pan\",\"to\":\"dolly\",\"ratio\":2}"
#define UNCOUPLE "{\"command\":\"uncouple\",\"axis\":\"pan\"}"
#define OUT      "axes:\\n  dolly: {curve: s-curve, keys: [[0, 20], [20, 300]]}\\n"
#define BACK                                                                   \
    "axes:\\n  dolly: {curve: s-curve, keys: [[0, 0], [8, 100], [16, 0]]}\\n"

static double ratio; /* 0: nothing is judged */
static double worst;

static double demand(int axis)
{
    return ldexp((double)bench.machine.controller.axis[axis].target.pos_q32,
                 -32);
}

static void tick(void)
{
    service_bench_tick(&bench);
    if (ratio != 0)
        worst = fmax(worst, fabs(demand(PAN) - ratio * demand(DOLLY)));
}

static void until(enum controller_state state)
{
    const struct controller *controller = &bench.machine.controller;
    for (int i = 0;
         controller->state != state ||
         (state == CONTROLLER_HOLDING && controller->rate.rate_q30 != 0);
         i++) {
        if (i > 100000 || controller->state == CONTROLLER_FAULT)
            fail_msg("%s: %s", controller_state_text(controller->state),
                     controller_fault_text(controller->fault.fault));
        tick();
    }
}

static int file;

static int up(void **state)
{
    (void)state;
    ratio = worst = 0;
    if (service_bench_ready(&bench, rig_text) < 0)
        return -1;
    file = service_bench_connect(&bench);
    done(file, "{\"command\":\"take\",\"lease\":60}");
    done(file, "{\"command\":\"enable\"}");
    until(CONTROLLER_READY);
    return 0;
}

static int down(void **state)
{
    (void)state;
    close(file);
    service_bench_close(&bench);
    return 0;
}

static void renew(void)
{
    done(file, "{\"command\":\"renew\"}");
}

/* Of dolly, while the key is held. */
static void jog_to(double to)
{
    char line[128];
    snprintf(
        line, sizeof line,
        "{\"command\":\"jog\",\"axis\":\"dolly\",\"speed\":300,\"to\":%.3f,"
        "\"for\":2}",
        to);
    for (int i = 0; i < 100 && fabs(demand(DOLLY) - to) > 1e-6; i++) {
        done(file, line);
        for (int k = 0;
             k < 300 && bench.machine.controller.state == CONTROLLER_MOVING;
             k++)
            tick();
    }
    until(CONTROLLER_READY);
}

static void a_move_that_leaves_a_gear_is_refused(void **state)
{
    (void)state;
    done(file, GEAR);
    refused(
        file, LOAD(BACK "  pan: {curve: s-curve, keys: [[0, 0], [16, 0]]}"),
        "STATE",
        "pan follows dolly, and this move takes it off that by 200 deg at ");
    refused(file, CHECK(OUT "  pan: {keys: [[0, 40], [0.001, 40]]}"), "STATE",
            "where dolly is at 300 mm");
    refused(file, LOAD("axes: {pan: {curve: s-curve, keys: [[0, 0], [9, 9]]}}"),
            "STATE", "which this move leaves where it is");
    refused(file,
            LOAD("axes: {dolly: {curve: s-curve, keys: [[0, 0], [4, 300]]}}"),
            "STATE",
            "pan cannot be taken along: dolly goes at up to 112.5 mm/s in this "
            "move, and may at 60 mm/s at most");
    refused(file,
            LOAD("axes: {dolly: {curve: s-curve, keys: [[0, 0], [90, 1900]]}}"),
            "STATE", "may go from -100 mm to 1800 mm");
    refused(file, START, "EMPTY", "no move");
}

/* Loaded before, it is seen at its start. */
static void a_gear_that_is_made_after_a_move_was_loaded_counts(void **state)
{
    (void)state;
    done(file, LOAD(BACK "  pan: {curve: s-curve, keys: [[0, 0], [16, 0]]}"));
    done(file, GEAR);
    refused(file, START, "STATE", "off that by 200 deg");
    refused(file, "{\"command\":\"approach\"}", "STATE", "off that by 200 deg");
    refused(file, "{\"command\":\"go\",\"to\":3}", "STATE",
            "off that by 200 deg");
    assert_int_equal(bench.machine.controller.state, CONTROLLER_READY);
    done(file, UNCOUPLE);
    done(file, START);
    until(CONTROLLER_READY);
    assert_true(demand(PAN) == 0);
}

/* Approached, played, sought and repeated. */
static void a_move_of_the_other_alone_takes_it_along(void **state)
{
    (void)state;
    done(file, GEAR);
    done(file, LOAD(OUT));
    ratio = 2;
    done(file, "{\"command\":\"approach\"}");
    until(CONTROLLER_READY);
    assert_true(fabs(demand(PAN) - 40) < 1e-6);
    done(file, "{\"command\":\"override\",\"percent\":150}");
    done(file, START);
    until(CONTROLLER_READY);
    assert_true(fabs(demand(PAN) - 600) < 1e-6);
    renew();
    done(file, "{\"command\":\"go\",\"to\":10}");
    until(CONTROLLER_HOLDING);
    assert_true(fabs(demand(PAN) - 320) < 1e-3);
    done(file, "{\"command\":\"reverse\",\"back\":true}");
    done(file, "{\"command\":\"resume\"}");
    for (int i = 0; i < 200; i++)
        tick();
    done(file, "{\"command\":\"stop\"}");
    until(CONTROLLER_READY);
    renew();
    done(file, LOAD(BACK));
    done(file, "{\"command\":\"approach\"}");
    until(CONTROLLER_READY);
    renew();
    done(file, "{\"command\":\"start\",\"times\":2}");
    until(CONTROLLER_READY);
    done(file, "{\"command\":\"start\",\"times\":2,\"ping_pong\":true}");
    until(CONTROLLER_READY);
    jog_to(700);
    assert_true(fabs(demand(PAN) - 1400) < 1e-6);
    if (worst > 1e-8)
        fail_msg("pan is off its gear by %.12f", worst);
}

/* The planner has made the same of it. */
static void a_move_with_the_same_coupling_is_played(void **state)
{
    (void)state;
    done(file, GEAR);
    jog_to(200);
    ratio = 2;
    done(file, LOAD(OUT "couplings: {pan: {master: dolly, numerator: 2,"
                        " denominator: 1}}"));
    done(file, "{\"command\":\"approach\"}");
    until(CONTROLLER_READY);
    done(file, START);
    until(CONTROLLER_READY);
    assert_true(fabs(demand(PAN) - 600) < 1e-6 && worst < 1e-6);
    refused(file,
            LOAD(OUT "couplings: {pan: {master: dolly, numerator: 201,"
                     " denominator: 100}}"),
            "STATE", "off that by 3 deg");
    jog_to(0);
    assert_true(worst < 1e-6);
}

static void gears_of_any_ratio_are_jogged(void **state)
{
    static const double ratios[] = { 8, -50, 1000, 0.001 };
    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(ratios); i++) {
        char line[128];
        const double far = fmin(3000 / fabs(ratios[i]), 1900) * 0.9;
        snprintf(line, sizeof line,
                 "{\"command\":\"gear\",\"axis\":\"pan\",\"to\":\"dolly\","
                 "\"ratio\":%g}",
                 ratios[i]);
        done(file, line);
        ratio = ratios[i];
        for (int k = 0; k < 4; k++)
            jog_to(k % 2 == 0 ? far : 0);
        assert_true(fabs(demand(PAN)) < 1e-5);
        done(file, UNCOUPLE);
        ratio = 0;
    }
}

/* A track is three days long at most, and a unit of the master is a second of it. */
static void what_counts_its_way_is_a_master_too(void **state)
{
    (void)state;
    done(file, "{\"command\":\"gear\",\"axis\":\"pan\",\"to\":\"encoder\","
               "\"ratio\":0.0005}");
    for (int k = 0; k < 2; k++) {
        done(file, k == 0 ? "{\"command\":\"jog\",\"axis\":\"encoder\","
                            "\"speed\":500000,\"to\":1900000,\"for\":2}"
                          : "{\"command\":\"jog\",\"axis\":\"encoder\","
                            "\"speed\":500000,\"to\":-200000,\"for\":2}");
        for (int i = 0; i < 390; i++)
            tick();
        assert_true(fabs(demand(PAN) - 0.0005 * demand(ENCODER)) < 1e-6);
        assert_true(fabs(demand(PAN)) > 50);
        until(CONTROLLER_READY);
    }
    done(file, UNCOUPLE);
    refused(file,
            "{\"command\":\"cam\",\"axis\":\"pan\",\"to\":\"encoder\","
            "\"keys\":[[-2000000, 0], [0, 300], [2000000, 900]]}",
            "AWAY", "pan stands at ");
}

static void a_cam_says_where_its_curve_is(void **state)
{
    (void)state;
    refused(file,
            "{\"command\":\"cam\",\"axis\":\"pan\",\"to\":\"dolly\",\"keys\":"
            "[[-50, 0], [0, 30], [500, 90]]}",
            "AWAY",
            "pan stands at 0 deg and the curve is at 30 deg where dolly is");
    done(file,
         "{\"command\":\"cam\",\"axis\":\"pan\",\"to\":\"dolly\",\"keys\":"
         "[[-50, 20], [0, 0], [500, 90]]}");
    jog_to(400);
    assert_int_equal(bench.machine.controller.fault.fault,
                     CONTROLLER_FAULT_NONE);
}

/* At rates that use the whole of the limits, as at 200 % of what is asked for. */
static void moves_with_an_override_never_trip_the_gate(void **state)
{
    static const char *const curve[] = { "parabolic", "quintic", "s-curve" };
    static const int percent[] = { 200, 150, 130 };
    unsigned played = 0;
    (void)state;
    seed_from("overrides");
    for (int i = 0; i < 60; i++) {
        char line[320];
        const double dur = 0.6 + 2.4 * (double)draw_unit();
        const double far = (2 * (double)draw_unit() - 1) * 40000 * dur * dur;
        snprintf(line, sizeof line,
                 LOAD("axes: {encoder: {curve: %s, keys: [[0, 0], [%.3f, %.1f],"
                      " [%.3f, 0]]}}"),
                 curve[draw_below(3)], dur, far, 2 * dur);
        cJSON *answer = service_ask(file, line);
        const bool fits = cJSON_IsTrue(cJSON_GetObjectItem(answer, "ok"));
        cJSON_Delete(answer);
        if (!fits)
            continue;
        renew();
        done(file, "{\"command\":\"approach\"}");
        until(CONTROLLER_READY);
        snprintf(line, sizeof line, "{\"command\":\"override\",\"percent\":%d}",
                 percent[draw_below(3)]);
        done(file, line);
        done(file, START);
        until(CONTROLLER_READY);
        done(file, "{\"command\":\"override\",\"percent\":100}");
        played++;
    }
    assert_true(played > 30);
}

#define COUPLE_TEST(claim) cmocka_unit_test_setup_teardown(claim, up, down)

int main(void)
{
    const struct CMUnitTest tests[] = {
        COUPLE_TEST(a_move_that_leaves_a_gear_is_refused),
        COUPLE_TEST(a_gear_that_is_made_after_a_move_was_loaded_counts),
        COUPLE_TEST(a_move_of_the_other_alone_takes_it_along),
        COUPLE_TEST(a_move_with_the_same_coupling_is_played),
        COUPLE_TEST(gears_of_any_ratio_are_jogged),
        COUPLE_TEST(what_counts_its_way_is_a_master_too),
        COUPLE_TEST(a_cam_says_where_its_curve_is),
        COUPLE_TEST(moves_with_an_override_never_trip_the_gate),
    };
    return cmocka_run_group_tests_name("service_couple", tests, NULL, NULL);
}
