/* tests/firmware/linux/machine/test_goals.c - axes whose drives go from key to
 * key by themselves: their plan, the controller on the simulated servos of
 * examples/turntable, and what the program says. */
#define _XOPEN_SOURCE 700 /* mkdtemp, nftw */
#include "hal/drive/modbus/drive.h"
#include "sim/device/modbus/servo.h"
#include "tests/support/kind/drives.h"
#include "tests/support/run_slew.h"

#include <cjson/cJSON.h>
#include <math.h>

#include "firmware/control/jog.h"
#include "firmware/host/job/job.h"
#include "firmware/linux/commands/planning.h"
#include "firmware/linux/machine/machine.h"
#include "firmware/linux/machine/machine_sim.h"
#include "motion/core/clock_warp.h"
#include "motion/core/fixed.h"
#include "motion/plan/check.h"

#define MS      INT64_C(1000000)
#define ONE_Q32 ((int64_t)1 << 32)
#define EXAMPLE "examples/turntable"
#define TABLE   0
#define LIFT    1
#define COUNTS  (300000.0 / 360) /* of the table, per degree */

static double units(int64_t q32)
{
    return (double)q32 / 4294967296.0;
}

/* ---- the plan ---- */

#define LEGS_MAX 4

struct leg_row {
    const char *name;
    double displacement, dur_s, settle_s; /* from 0 */
    double vel, acc;                      /* limits */
    double want_vel, want_acc;
};

/* By hand: T = dur - settle; v = 3 d / 2 T, a = 3 v / T = 9 d / 2 T^2. */
static const struct leg_row leg_rows[] = {
    { "thirds", 6, 3, 0, 100, 100, 3, 3 },
    { "backwards", -6, 3, 0, 100, 100, 3, 3 },
    { "thirds and a rest", 6, 3.5, 0.5, 100, 100, 3, 3 },
    /* v is 2.5: t = 3 - 6 / 2.5 = 0.6, a = 2.5 / 0.6 */
    { "at the highest speed", 6, 3, 0, 2.5, 100, 2.5, 4.1667 },
    /* a triangle: v = 2 d / T = 4, a = 4 / 1.5 */
    { "the calmest ramps", 6, 3, 0, 100, 2.7, 4, 2.6667 },
    /* 3.5 lies between 3 and 4: t = 3 - 6 / 3.5, a = 3.5 / t */
    { "both", 6, 3, 0, 3.5, 2.8, 3.5, 2.7222 },
    /* not possible: the check is to say so */
    { "too far", 6, 3, 0, 1.9, 100, 3, 3 },
};

static void plan_leg(const struct leg_row *row, struct motion_track *track)
{
    struct plan_key key[2] = { { .key = { .pos_q32 = 0 } } };
    struct plan_axis axis = {
        .name = "a",
        .curve = PLAN_CURVE_QUINTIC, /* does not count */
        .key = key,
        .key_count = 2,
        .profile = { .vel_q32 = (int64_t)(row->vel * 4294967296.0),
                     .acc_q32 = (int64_t)(row->acc * 0x1p32),
                     .settle_ns_q12 = (int64_t)(row->settle_s * 4096e9) },
    };
    struct plan_error error;

    key[1].key.pos_q32 = (int64_t)(row->displacement * 4294967296.0);
    key[1].key.t_ns_q12 = (int64_t)(row->dur_s * 4096e9);
    if (plan_axis_track(&axis, track, &error) != MOTION_OK)
        fail_msg("%s: %s", row->name, error.text);
}

static void a_way_is_planned_by_thirds_or_as_the_limits_want(void **state)
{
    (void)state;
    for (unsigned i = 0; i < ARRAY_LEN(leg_rows); i++) {
        const struct leg_row *row = &leg_rows[i];
        struct controller_goal goal[LEGS_MAX];
        struct motion_track track;

        plan_leg(row, &track);
        assert_int_equal(controller_goals_of(&track, goal, LEGS_MAX), 1);
        const double end_s = (double)goal[0].end_ns_q12 / 4096e9;
        const double vel = units(goal[0].vel_q32);
        const double acc = (double)goal[0].acc_q32 / 0x1p32;
        if (fabs(vel - row->want_vel) > 1e-4 ||
            fabs(acc - row->want_acc) > 2e-4 ||
            fabs(end_s - (row->dur_s - row->settle_s)) > 1e-9 ||
            goal[0].start_ns_q12 != 0 ||
            goal[0].pos_q32 != (int64_t)(row->displacement * 4294967296.0))
            fail_msg("%s: v %g, a %g, ends at %g s", row->name, vel, acc,
                     end_s);
        const struct plan_limit limit = {
            .pos_min_q32 = -10 * ONE_Q32,
            .pos_max_q32 = 10 * ONE_Q32,
            .vel_q32 = (int64_t)(row->vel * 4294967296.0),
            .acc_q32 = (int64_t)(row->acc * 0x1p32),
        };
        const bool possible = strcmp(row->name, "too far") != 0;
        if ((plan_check_track(&track, &limit, NULL, 0) == 0) != possible)
            fail_msg("%s: the check is of another opinion", row->name);
        plan_track_free(&track);
    }
}

/* ---- the machine ---- */

static struct job job;
static struct machine machine;
static struct machine_sim sim;
static int64_t now_ns;

static void tick(void)
{
    now_ns += job.rig.period_ns;
    (void)hal_clock_wait_until(machine.ports.clock, now_ns);
    machine_tick(&machine, now_ns);
}

static void run_ms(int64_t ms)
{
    for (const int64_t end_ns = now_ns + ms * MS; now_ns < end_ns;)
        tick();
}

static void until(enum controller_state state)
{
    for (int i = 0; i < 6000 && machine.controller.state != state; i++)
        tick();
    if (machine.controller.state != state)
        fail_msg("%s: %s", controller_state_text(machine.controller.state),
                 controller_fault_text(machine.controller.fault.fault));
}

static double table_is_at(void)
{
    return (double)sim_modbus_servo_counts(
               SERVO_OF(sim_modbus_servo, &sim, TABLE)) /
           COUNTS;
}

static int setup(void **state)
{
    static const char *const path[] = { EXAMPLE };
    struct machine_ports ports;
    char message[YAML_MESSAGE_MAX];

    (void)state;
    assert_int_equal(planning_open(&job, path, 1, false), STATUS_OK);
    if (machine_sim_init(&sim, &job.rig, false, &ports, message) < 0 ||
        machine_init(&machine, &job.rig, &ports, message) < 0)
        fail_msg("%s", message);
    now_ns = hal_clock_now_ns(ports.clock);
    tick();
    assert_int_equal(controller_enable(&machine.controller), 0);
    until(CONTROLLER_READY);
    return 0;
}

static int teardown(void **state)
{
    (void)state;
    job_free(&job);
    return 0;
}

/* The table's part of the move; it stands at its first key already. */
static void start(void)
{
    const struct motion_track *track[CONTROLLER_AXES_MAX] = {
        &job.track[TABLE]
    };

    assert_int_equal(controller_set_goals(&machine.controller, TABLE,
                                          job.goal[TABLE],
                                          job.goal_count[TABLE]),
                     0);
    assert_int_equal(controller_start(&machine.controller, track, NULL), 0);
}

static void a_start_without_goals_is_refused(void **state)
{
    const struct motion_track *track[CONTROLLER_AXES_MAX] = {
        &job.track[TABLE]
    };
    int axis = -1;

    (void)state;
    assert_int_equal(controller_start(&machine.controller, track, &axis),
                     MOTION_E_ARG);
    assert_int_equal(axis, TABLE);
    assert_int_equal(machine.controller.state, CONTROLLER_READY);
}

/* No set point goes out, each key is reached before the next displacement begins. */
static void each_key_is_reached_by_a_motion_of_its_own(void **state)
{
    static const double keys[] = { 90, 180, 270 };
    unsigned reached = 0;

    (void)state;
    start();
    while (machine.controller.state == CONTROLLER_MOVING) {
        tick();
        const unsigned at = machine.controller.axis[TABLE].leg.at;
        if (at == reached || machine.controller.state != CONTROLLER_MOVING)
            continue;
        assert_int_equal(at, reached + 1);
        assert_true(fabs(table_is_at() - keys[reached]) < 0.2);
        reached = at;
    }
    assert_int_equal(machine.controller.state, CONTROLLER_READY);
    assert_int_equal(reached, 3);
    assert_int_equal(SERVO_OF(sim_modbus_servo, &sim, TABLE)->targets, 3);
    assert_int_equal(DRIVER_OF(drive_modbus, &machine, TABLE)->streams, 0);
    assert_true(fabs(table_is_at() - 270) < 0.01);
}

/* It stands on its way, then goes on to the same key, and leaves none out. */
static void hold_halts_the_drive_and_resume_sends_it_on(void **state)
{
    (void)state;
    start();
    run_ms(800);
    assert_int_equal(controller_hold(&machine.controller), 0);
    run_ms(1500);
    assert_int_equal(machine.controller.state, CONTROLLER_HOLDING);
    const double held = table_is_at();
    assert_true(held > 5 && held < 85);
    run_ms(2000);
    assert_true(fabs(table_is_at() - held) < 0.01);
    assert_int_equal(controller_resume(&machine.controller), 0);
    until(CONTROLLER_READY);
    assert_true(fabs(table_is_at() - 270) < 0.01);
    assert_int_equal(SERVO_OF(sim_modbus_servo, &sim, TABLE)->targets, 4);
}

/* The axis is where it is, and the next motion goes on from there. */
static void stop_ends_the_way_and_the_set_point_is_where_it_stands(void **state)
{
    struct controller_jog_goal goal = { .axis = TABLE,
                                        .pos_q32 = 10 * ONE_Q32,
                                        .vel_q32 = 60 * ONE_Q32 };

    (void)state;
    start();
    run_ms(800);
    controller_stop(&machine.controller);
    until(CONTROLLER_READY);
    run_ms(100);
    const double stood = table_is_at();
    assert_true(stood > 5 && stood < 85);
    assert_true(fabs(units(machine.controller.axis[TABLE].target.pos_q32) -
                     stood) < 0.01);
    assert_int_equal(machine.controller.axis[TABLE].feedback.state,
                     HAL_DRIVE_ENABLED);
    assert_int_equal(controller_jog(&machine.controller, &machine.jog, &goal),
                     0);
    until(CONTROLLER_READY);
    assert_true(fabs(table_is_at() - 10) < 0.01);
}

static void a_jog_is_a_goal_and_its_end_a_halt(void **state)
{
    struct controller_jog_goal goal = { .axis = TABLE,
                                        .pos_q32 = 200 * ONE_Q32,
                                        .vel_q32 = 20 * ONE_Q32 };

    (void)state;
    assert_int_equal(controller_jog(&machine.controller, &machine.jog, &goal),
                     0);
    run_ms(3000);
    goal.pos_q32 = -100 * ONE_Q32; /* from full motion */
    assert_int_equal(controller_jog(&machine.controller, &machine.jog, &goal),
                     0);
    run_ms(3000);
    const double turned = table_is_at();
    assert_true(turned > -10 && turned < 40);
    controller_jog_stop(&machine.controller, &machine.jog, false);
    until(CONTROLLER_READY);
    run_ms(100);
    const double stood = table_is_at();
    run_ms(1000);
    assert_true(fabs(table_is_at() - stood) < 0.01);
    assert_true(stood > turned - 10 && stood < turned);
}

/* The first displacement takes 1.74 s: an eighth more and 0.5 s later it is too late. */
static void a_drive_that_does_not_come_in_time_is_a_fault(void **state)
{
    (void)state;
    start();
    const int64_t since_ns = now_ns;
    run_ms(500);
    sim_modbus_servo_inject(SERVO_OF(sim_modbus_servo, &sim, TABLE),
                            SIM_MODBUS_SERVO_BLOCKED);
    until(CONTROLLER_FAULT);
    const struct controller_fault_record *fault = &machine.controller.fault;
    assert_int_equal(fault->fault, CONTROLLER_FAULT_ARRIVAL);
    assert_int_equal(fault->axis, TABLE);
    assert_int_equal(machine.controller.reaction, CONTROLLER_REACT_QUICK);
    assert_in_range(fault->t_ns - since_ns, 2400 * MS, 2550 * MS);
    assert_true(units(fault->value) > 50 && units(fault->value) < 90);
    run_ms(500);
    assert_false(SERVO_OF(sim_modbus_servo, &sim, TABLE)->enabled);
    assert_false(SERVO_OF(sim_modbus_servo, &sim, LIFT)->enabled);
}

/* By the stop sequences of the drives' maps: the other axis loses its torque
 * only once the table stands. */
static void a_fault_elsewhere_stops_the_way_by_the_drive(void **state)
{
    (void)state;
    start();
    run_ms(800);
    const double before = table_is_at();
    sim_modbus_servo_inject(SERVO_OF(sim_modbus_servo, &sim, LIFT),
                            SIM_MODBUS_SERVO_ALARM);
    until(CONTROLLER_FAULT);
    assert_int_equal(machine.controller.fault.axis, LIFT);
    assert_int_equal(machine.controller.reaction, CONTROLLER_REACT_QUICK);
    const double stood = table_is_at();
    assert_true(stood > before && stood < 80);
    run_ms(1000);
    assert_true(fabs(table_is_at() - stood) < 0.1);
    assert_false(SERVO_OF(sim_modbus_servo, &sim, TABLE)->enabled);
}

/* Half the speed, a quarter of the ramps: in the drive's own registers. */
static void the_override_is_in_what_the_drive_is_told(void **state)
{
    int64_t speed_q16[2], acc[2];

    (void)state;
    for (unsigned i = 0; i < 2; i++) {
        if (i == 1) {
            teardown(NULL);
            setup(NULL);
        }
        assert_int_equal(controller_override(&machine.controller,
                                             MOTION_CLOCK_WARP_ONE_Q30 >> i),
                         0);
        start();
        run_ms(500);
        speed_q16[i] = SERVO_OF(sim_modbus_servo, &sim, TABLE)->speed_q16;
        acc[i] = SERVO_OF(sim_modbus_servo, &sim, TABLE)->acc;
    }
    assert_true(fabs(2.0 * (double)speed_q16[1] / (double)speed_q16[0] - 1) <
                0.01);
    assert_true(fabs(4.0 * (double)acc[1] / (double)acc[0] - 1) < 0.01);
}

/* ---- the program ---- */

static cJSON *json_axis(cJSON *report, unsigned i)
{
    return cJSON_GetArrayItem(cJSON_GetObjectItem(report, "axes"), (int)i);
}

static void the_report_tells_when_each_key_was_reached(void **state)
{
    static const double times_s[] = { 2, 5, 8 };

    (void)state;
    run("run", "--json", EXAMPLE);
    run_expect(0);
    cJSON *report = cJSON_Parse(run_slew()->out);
    assert_non_null(report);
    cJSON *table = json_axis(report, TABLE);
    cJSON *keys = cJSON_GetObjectItem(table, "keys");
    assert_null(cJSON_GetObjectItem(table, "following_error"));
    assert_int_equal(cJSON_GetArraySize(keys), 3);
    for (int k = 0; k < 3; k++) {
        cJSON *key = cJSON_GetArrayItem(keys, k);
        const double there_s = cJSON_GetObjectItem(key, "there_s")->valuedouble;
        const double before_ms =
            cJSON_GetObjectItem(key, "before_ms")->valuedouble;

        assert_int_equal(cJSON_GetObjectItem(key, "key")->valueint, 2 * k + 2);
        assert_true(cJSON_IsTrue(cJSON_GetObjectItem(key, "reached")));
        assert_true(fabs(times_s[k] - there_s - before_ms / 1e3) < 1e-6);
        assert_true(before_ms > 0 && before_ms < 265); /* the settle time */
        assert_true(fabs(cJSON_GetObjectItem(key, "off")->valuedouble) < 0.2);
    }
    cJSON_Delete(report);
    run("run", EXAMPLE);
    run_expect(0);
    run_says("table: at 3 of 3 keys");
    run_says("lift: at 2 of 2 keys");
}

static void plan_check_and_run_say_whose_the_path_is(void **state)
{
    static const char *const commands[] = { "plan", "check", "run" };

    (void)state;
    for (unsigned i = 0; i < ARRAY_LEN(commands); i++) {
        run(commands[i], EXAMPLE);
        run_expect(0);
        run_says("table: between keys the path is its drive's own; a position "
                 "every 41.1 ms; streamed it would get a set point every "
                 "54.7 ms (18.3 per s)");
    }
}

#define RIG_HEAD                                                               \
    "buses:\n"                                                                 \
    "  l: {kind: modbus-rtu, device: /dev/x, baud: 115200}\n"                  \
    "axes:\n"
#define RIG_AXIS(name, limits, map, rest)                                      \
    "  " name ":\n"                                                            \
    "    unit: deg\n"                                                          \
    "    limits: {position: [-90, 90], velocity: 30, acceleration: 30" limits  \
    "}\n"                                                                      \
    "    following_error: {floor: 1}\n"                                        \
    "    drive: {kind: modbus, bus: l, node: 1, map: " map                     \
    ", counts: 1000, unsupervised: yes" rest "}\n"
#define MAP_REST                                                               \
    "  state: {at: 3, type: u16, poll: fast}\n"                                \
    "  go: {at: 4, type: u16}\n"                                               \
    "status: {moving: {item: state, mask: 1}}\n"                               \
    "sequences:\n"                                                             \
    "  enable: [{write: go, value: 1}]\n"                                      \
    "  disable: [{write: go, value: 0}]\n"                                     \
    "  stop: [{write: go, value: 2}]\n"
#define GROUP(name)                                                            \
    name ": {at: 16, fields: [{type: i32, value: position},"                   \
         " {type: u32, value: velocity, unit: counts},"                        \
         " {type: u32, value: acceleration, unit: counts}]}\n"
#define MAP                                                                    \
    "title: a\nresolution: 1000\n"                                             \
    "items:\n"                                                                 \
    "  position: {at: 1, type: i32, poll: fast}\n" MAP_REST
#define SHORT "move: {at: 16, fields: [{type: i16, value: position}]}\n"
#define READS                                                                  \
    "title: a\nresolution: 1000\n"                                             \
    "items:\n"                                                                 \
    "  position: {at: 1, type: i16, poll: fast}\n"
#define MOVE "axes: {a: {curve: parabolic, keys: [[0 s, 0], [2 s, 10]]}}\n"
#define P2P  ", mode: point-to-point"

static const struct {
    const char *name, *rig, *move, *want;
} bad[] = {
    { "streamed without stream",
      RIG_HEAD RIG_AXIS("a", "", "moves.yaml", ", mode: streamed"), MOVE,
      "drive has a map without stream, which cannot follow set points: say "
      "mode: point-to-point" },
    { "no mode without stream", RIG_HEAD RIG_AXIS("a", "", "moves.yaml", ""),
      MOVE, "has a map without stream" },
    { "no profile", RIG_HEAD RIG_AXIS("a", "", "streams.yaml", P2P), MOVE,
      "has a map without move, whose drive has no profile of its own" },
    { "a jerk", RIG_HEAD RIG_AXIS("a", ", jerk: 100", "moves.yaml", P2P), MOVE,
      "the drive's own ramps have no limit of jerk" },
    { "settle of a streamed one",
      RIG_HEAD RIG_AXIS("a", "", "streams.yaml", ", settle: 1 s"), MOVE,
      "is streamed: settle and late are for mode: point-to-point" },
    { "another mode", RIG_HEAD RIG_AXIS("a", "", "moves.yaml", ", mode: pp"),
      MOVE, "unknown mode 'pp'" },
    { "a velocity", RIG_HEAD RIG_AXIS("a", "", "moves.yaml", P2P),
      "axes: {a: {curve: hermite, keys: [[0 s, 0, 0], [1 s, 1, 1], "
      "[2 s, 10, 0]]}}\n",
      "key 2 of axis a: is given a motion, but the axis goes from key to key "
      "by its drive's own profile" },
    { "keys too close", RIG_HEAD RIG_AXIS("a", "", "moves.yaml", P2P),
      "axes: {a: {curve: parabolic, keys: [[0 s, 0], [100 ms, 0.1]]}}\n",
      "key 2 of axis a: comes 0.100 s after the one before it, of which its "
      "drive needs 0.1" },
    { "a range beyond the field", RIG_HEAD RIG_AXIS("a", "", "short.yaml", P2P),
      MOVE,
      "rig.yaml:5:5: a needs -90000 .. 90000 for its range in the group move "
      "of its drive, which takes -32768 .. 32767, expected a smaller range or "
      "fewer counts" },
    { "a length beyond the field",
      RIG_HEAD RIG_AXIS("a", "", "short.yaml", P2P) "    homing: {by: here}\n",
      MOVE, "a needs -90000 .. 90000 for its range in the group move" },
    { "a range beyond what is read",
      RIG_HEAD RIG_AXIS("a", "", "reads.yaml", P2P), MOVE,
      "a needs -90000 .. 90000 for its range in the position that is read of "
      "its drive, which takes -32768 .. 32767" },
    { "a warp", RIG_HEAD RIG_AXIS("a", "", "moves.yaml", P2P),
      MOVE "warp: {curve: linear, keys: [[0 s, 0 s], [4 s, 2 s]]}\n",
      "axis a is moved by warp, expected keys alone" },
};

static void what_cannot_be_is_told(void **state)
{
    (void)state;
    run_put("moves.yaml", MAP GROUP("move"));
    run_put("streams.yaml", MAP GROUP("stream"));
    run_put("short.yaml", MAP SHORT);
    run_put("reads.yaml", READS MAP_REST GROUP("move"));
    for (unsigned i = 0; i < ARRAY_LEN(bad); i++) {
        run_put("rig.yaml", bad[i].rig);
        run_put("move.yaml", bad[i].move);
        run("plan", run_slew()->directory);
        if (run_slew()->status != STATUS_INPUT ||
            strstr(run_slew()->err, bad[i].want) == NULL)
            fail_msg("%s: %d: %s", bad[i].name, run_slew()->status,
                     run_slew()->err);
    }
    /* a map that can only move is taken, and says so */
    run_put("rig.yaml", RIG_HEAD RIG_AXIS("a", "", "moves.yaml", P2P));
    run_put("move.yaml", MOVE);
    run("run", run_slew()->directory);
    run_expect(0);
    run_says("its map cannot stream");
    run_says("a: at 1 of 1 keys");
}

#define HOMED_DRIVE(mode)                                                      \
    "buses:\n"                                                                 \
    "  l: {kind: modbus-rtu, device: /dev/x, baud: 115200}\n"                  \
    "axes:\n"                                                                  \
    "  a:\n"                                                                   \
    "    unit: deg\n"                                                          \
    "    limits: {position: [-90, 90], velocity: 30, acceleration: 30}\n"      \
    "    following_error: {floor: 3}\n"                                        \
    "    drive: {kind: modbus, bus: l, node: 1, map: %s, counts: 1000, "       \
    "unsupervised: yes, mode: " mode "}\n"                                     \
    "    homing: {by: drive, position: 12 deg%s}\n"                            \
    "    sim: {start: -40 deg}\n"

/* Every map with such a sequence, from a rig file to the last key: at the home
 * point the drive counts 0, and the axis is at 12 deg. */
static void the_drive_finds_its_home_by_its_map(void **state)
{
    static const char *const maps[] = { "leadshine-el7", "leadshine-cs2rs",
                                        "oriental-az", "delta-asda",
                                        "lexium-32" };
    static const char *const modes[] = { HOMED_DRIVE("point-to-point"),
                                         HOMED_DRIVE("streamed") };
    char rig[1024];

    (void)state;
    run_put("move.yaml",
            "axes: {a: {curve: s-curve, keys: [[0 s, 20], [4 s, 30]]}}\n");
    for (unsigned i = 0; i < 2 * ARRAY_LEN(maps); i++) {
        if (i == 2 * 3 + 1)
            continue; /* delta-asda has no speed in its set points: it lags */
        snprintf(rig, sizeof rig, modes[i % 2], maps[i / 2], "");
        run_put("rig.yaml", rig);
        run("run", "--json", run_slew()->directory);
        if (run_slew()->status != 0)
            fail_msg("%s: %s %s", maps[i / 2], run_slew()->out,
                     run_slew()->err);
        cJSON *report = cJSON_Parse(run_slew()->out);
        const double off =
            cJSON_GetObjectItem(json_axis(report, 0), "end_error")->valuedouble;
        if (fabs(off) > 0.1)
            fail_msg("%s: %g deg off", maps[i / 2], off);
        cJSON_Delete(report);
    }
    snprintf(rig, sizeof rig, modes[0], maps[0], ", method: 17");
    run_put("rig.yaml", rig);
    run("run", run_slew()->directory);
    run_expect(STATUS_INPUT);
    run_complains("a drive with a register map homes as it was set up");
    run_put("moves.yaml", MAP GROUP("move"));
    snprintf(rig, sizeof rig, modes[0], "moves.yaml", "");
    run_put("rig.yaml", rig);
    run("run", run_slew()->directory);
    run_expect(STATUS_INPUT);
    run_complains("the map of the drive has no sequence home");
}

static void a_compiled_move_has_no_keys(void **state)
{
    (void)state;
    run("compile", "--out", run_path("t.slew"), EXAMPLE);
    run_expect(0);
    run("run", EXAMPLE "/rig.yaml", run_path("t.slew"));
    run_expect(STATUS_INPUT);
    run_complains("moves axis table, whose drive goes from key to key by "
                  "its own profile, expected the move file");
}

int main(void)
{
#define ON_MACHINE(name) cmocka_unit_test_setup_teardown(name, setup, teardown)
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_way_is_planned_by_thirds_or_as_the_limits_want),
        ON_MACHINE(a_start_without_goals_is_refused),
        ON_MACHINE(each_key_is_reached_by_a_motion_of_its_own),
        ON_MACHINE(hold_halts_the_drive_and_resume_sends_it_on),
        ON_MACHINE(stop_ends_the_way_and_the_set_point_is_where_it_stands),
        ON_MACHINE(a_jog_is_a_goal_and_its_end_a_halt),
        ON_MACHINE(a_drive_that_does_not_come_in_time_is_a_fault),
        ON_MACHINE(a_fault_elsewhere_stops_the_way_by_the_drive),
        ON_MACHINE(the_override_is_in_what_the_drive_is_told),
        cmocka_unit_test(the_report_tells_when_each_key_was_reached),
        cmocka_unit_test(plan_check_and_run_say_whose_the_path_is),
        cmocka_unit_test(what_cannot_be_is_told),
        cmocka_unit_test(the_drive_finds_its_home_by_its_map),
        cmocka_unit_test(a_compiled_move_has_no_keys),
    };
    return cmocka_run_group_tests(tests, run_open, run_close);
}
