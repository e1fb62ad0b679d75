/* tests/hal/drive/cia402/test_drive_cia402_modes.c - the CiA 402 driver's other
 * modes on the simulated drive: profiles, homing, streamed velocity, probe, and
 * what start-up does with the options of the config. */
#include <inttypes.h>
#include <string.h>

#include "tests/hal/canopen/canopen_bench.h"
#include "tests/sim/device/cia402/digital_inputs.h"

#include "hal/drive/cia402/drive.h"
#include "motion/core/fixed.h"
#include "sim/device/cia402/servo.h"

#define S     (1000 * MS)
#define ONE   MOTION_FIXED_ONE_Q32
#define NODE  7
#define START 10000

struct bench {
    struct sim_world world;
    struct sim_can_bus bus;
    struct sim_can_port port, hand; /* the master's, and a test's */
    struct sim_cia402 servo;
    struct canopen master;
    struct drive_cia402 drive;
    struct hal_drive_feedback seen;
    int64_t now_ns, vel_max_q32;
    unsigned orders; /* RPDO2 heard */
};

static const struct canopen_config master_config = CANOPEN_BENCH_MASTER;

static const struct drive_cia402_config drive_config = {
    .node_id = NODE,
    CANOPEN_BENCH_COUNTS,
};

static const struct sim_cia402_config servo_config = {
    .node_id = NODE,
    .plant = CANOPEN_BENCH_PLANT,
    .start_counts = START,
    .loop_ns = 250000,
    .boot_ns = 10 * MS,
    .rail = { .has_limits = true,
              .has_home = true,
              .limit_negative = -50000,
              .limit_positive = 90000,
              .home_from = 20000,
              .home_to = 30000,
              .index_every = 4000 },
};

static struct bench *bench_of(const struct drive_cia402_config *drive,
                              const struct canopen_config *master,
                              const struct sim_cia402_config *servo)
{
    static struct bench bench;
    struct bench *b = &bench;

    memset(b, 0, sizeof *b);
    b->now_ns = 1 * S;
    canopen_bench_wire(&b->world, &b->bus, &b->port);
    sim_can_port_init(&b->hand, &b->bus);
    assert_int_equal(canopen_init(&b->master, &b->port.can, master), 0);
    assert_int_equal(sim_cia402_init(&b->servo, &b->bus, servo), 0);
    assert_int_equal(drive_cia402_init(&b->drive, &b->master, drive), 0);
    return b;
}

static struct bench *bench(void)
{
    return bench_of(&drive_config, &master_config, &servo_config);
}

static void listen(struct bench *b)
{
    struct hal_can_frame frame;

    while (hal_can_recv(&b->hand.can, &frame) == 1)
        b->orders += frame.id == 0x300u + NODE;
}

static void begin(struct bench *b)
{
    sim_world_run(&b->world, b->now_ns);
    (void)hal_fieldbus_begin(&b->master.fieldbus, b->now_ns);
    hal_drive_feedback(&b->drive.drive, &b->seen);
    listen(b);
}

static void end(struct bench *b)
{
    hal_fieldbus_end(&b->master.fieldbus, b->now_ns);
    b->now_ns += 1 * MS;
}

static void ticks(struct bench *b, unsigned count)
{
    while (count-- > 0) {
        begin(b);
        if (b->seen.vel_q32 > b->vel_max_q32)
            b->vel_max_q32 = b->seen.vel_q32;
        end(b);
    }
}

static void until(struct bench *b, enum hal_drive_state state, unsigned most)
{
    for (unsigned i = 0; i < most; i++) {
        ticks(b, 1);
        if (b->seen.state == state)
            return;
    }
    fail_msg("still %s: %s", hal_drive_state_text(b->seen.state),
             b->seen.fault_text);
}

static void enable(struct bench *b)
{
    until(b, HAL_DRIVE_OFF, 2000);
    hal_drive_request(&b->drive.drive, HAL_DRIVE_REQUEST_ENABLE);
    until(b, HAL_DRIVE_ENABLED, 500);
}

/* Settles first. */
static void into(struct bench *b, enum hal_drive_mode mode)
{
    ticks(b, 60);
    assert_int_equal(hal_drive_set_mode(&b->drive.drive, mode), MOTION_OK);
    for (int i = 0; i < 200 && b->seen.mode != mode; i++)
        ticks(b, 1);
    assert_int_equal(b->seen.mode, mode);
    assert_int_equal(b->seen.state, HAL_DRIVE_ENABLED);
}

static struct bench *enabled_in(enum hal_drive_mode mode)
{
    struct bench *b = bench();

    enable(b);
    into(b, mode);
    return b;
}

static int64_t units(int64_t counts)
{
    return counts * (ONE / 1000);
}

static int64_t counts(int64_t pos_q32)
{
    int64_t result = 0;

    motion_fixed_muldiv(pos_q32, 1000, ONE, &result);
    return result;
}

static int64_t servo_counts(const struct bench *b)
{
    return sim_servo_pos_q24(&b->servo.base) >> 24;
}

static int set(struct bench *b, int64_t pos_q32, int64_t vel_q32)
{
    const struct hal_drive_target target = { .pos_q32 = pos_q32,
                                             .vel_q32 = vel_q32 };

    return hal_drive_set_target(&b->drive.drive, &target);
}

static int go(struct bench *b, int64_t pos_q32, int64_t vel_q32)
{
    const struct hal_drive_go order = {
        .pos_q32 = pos_q32,
        .vel_q32 = vel_q32,
        .acc_q32 = INT64_C(1000) << 32,
        .dec_q32 = INT64_C(1000) << 32,
        .timeout_ns = 20 * S,
    };

    return hal_drive_go(&b->drive.drive, &order);
}

static unsigned arrives(struct bench *b, unsigned most)
{
    for (unsigned i = 1; i <= most; i++) {
        ticks(b, 1);
        if (b->seen.arrived)
            return i;
    }
    fail_msg("not arrived after %u ms at %" PRId64 ": %s", most,
             counts(b->seen.pos_q32), b->seen.fault_text);
    return 0;
}

#define assert_near(got, want, most)                                           \
    do {                                                                       \
        const int64_t got_ = (got), want_ = (want);                            \
        if (got_ - want_ > (most) || want_ - got_ > (most))                    \
            fail_msg("%s is %" PRId64 ", not %" PRId64, #got, got_, want_);    \
    } while (0)

#define assert_text(b, want)                                                   \
    do {                                                                       \
        if (strstr((b)->seen.fault_text, want) == NULL)                        \
            fail_msg("\"%s\" is not in \"%s\"", want, (b)->seen.fault_text);   \
    } while (0)

/* ---- modes ------------------------------------------------------------- */

static void it_tells_its_modes_once_it_is_found(void **state)
{
    struct bench *b = bench();

    (void)state;
    assert_int_equal(hal_drive_modes(&b->drive.drive), 0);
    until(b, HAL_DRIVE_OFF, 2000);
    assert_int_equal(
        hal_drive_modes(&b->drive.drive),
        1u << HAL_DRIVE_STREAM_POSITION | 1u << HAL_DRIVE_PROFILE_POSITION |
            1u << HAL_DRIVE_PROFILE_VELOCITY | 1u << HAL_DRIVE_HOMING);
    assert_int_equal(b->seen.mode, HAL_DRIVE_STREAM_POSITION);
    assert_int_equal(
        hal_drive_set_mode(&b->drive.drive, HAL_DRIVE_STREAM_VELOCITY),
        MOTION_E_EMPTY);
    assert_int_equal(
        hal_drive_set_mode(&b->drive.drive, (enum hal_drive_mode)99),
        MOTION_E_ARG);
}

static void a_mode_changes_while_off_and_stays_so(void **state)
{
    struct bench *b = bench();

    (void)state;
    assert_int_equal(hal_drive_set_mode(&b->drive.drive, HAL_DRIVE_HOMING),
                     MOTION_E_STATE);
    until(b, HAL_DRIVE_OFF, 2000);
    assert_int_equal(
        hal_drive_set_mode(&b->drive.drive, HAL_DRIVE_PROFILE_POSITION), 0);
    ticks(b, 50);
    assert_int_equal(b->seen.mode, HAL_DRIVE_PROFILE_POSITION);
    assert_int_equal(b->seen.state, HAL_DRIVE_OFF);
    enable(b);
    assert_int_equal(b->seen.mode, HAL_DRIVE_PROFILE_POSITION);
    assert_int_equal(b->servo.mode, 1);
}

static void no_mode_changes_while_the_axis_moves(void **state)
{
    struct bench *b = bench();

    (void)state;
    enable(b);
    for (int i = 0; i < 100; i++) {
        begin(b);
        assert_int_equal(set(b, units(START + 20 * i), 0), 0);
        if (i > 50)
            assert_int_equal(
                hal_drive_set_mode(&b->drive.drive, HAL_DRIVE_HOMING),
                MOTION_E_STATE);
        end(b);
    }
    assert_int_equal(b->seen.mode, HAL_DRIVE_STREAM_POSITION);
}

/* Enabled, and `after` ticks into a change to homing. */
static struct bench *changing(unsigned after)
{
    struct bench *b = bench();

    enable(b);
    assert_int_equal(hal_drive_set_mode(&b->drive.drive, HAL_DRIVE_HOMING), 0);
    ticks(b, after);
    return b;
}

/* Switched off while it changes, the change is brought to its end. */
static void off_in_the_middle_of_a_change(void **state)
{
    (void)state;
    for (unsigned after = 0; after < 12; after++) {
        struct bench *b = changing(after);

        hal_drive_request(&b->drive.drive, HAL_DRIVE_REQUEST_OFF);
        until(b, HAL_DRIVE_OFF, 500);
        ticks(b, 100);
        assert_int_equal(b->seen.mode, HAL_DRIVE_HOMING);
        assert_int_equal(b->servo.mode, 6);
        enable(b);
        assert_near(servo_counts(b), START, 2);
    }
}

static void a_fault_in_the_middle_of_a_change(void **state)
{
    (void)state;
    for (unsigned after = 0; after < 12; after++) {
        struct bench *b = changing(after);

        sim_cia402_inject(&b->servo, SIM_CIA402_OVERCURRENT);
        until(b, HAL_DRIVE_FAULT, 100);
        ticks(b, 200);
        hal_drive_request(&b->drive.drive, HAL_DRIVE_REQUEST_RESET);
        until(b, HAL_DRIVE_OFF, 500);
        ticks(b, 100);
        assert_int_equal(b->seen.mode == HAL_DRIVE_HOMING ? 6 : 8,
                         b->servo.mode);
        enable(b);
    }
}

/* ---- profile position -------------------------------------------------- */

/* 0.1 s up, 0.1 s down, 100 units/s between: 40 units take 0.5 s. */
static void it_goes_to_a_position_by_its_own_ramps(void **state)
{
    struct bench *b = enabled_in(HAL_DRIVE_PROFILE_POSITION);
    unsigned took;

    (void)state;
    assert_int_equal(go(b, units(50000), INT64_C(100) << 32), 0);
    took = arrives(b, 2000);
    if (took < 490 || took > 540)
        fail_msg("took %u ms", took);
    ticks(b, 60);
    assert_near(servo_counts(b), 50000, 2);
    assert_near(b->vel_max_q32 >> 32, 100, 2);
    assert_false(b->seen.following);
    assert_int_equal(set(b, units(-40000), 0), 0); /* is not listened to */
    ticks(b, 100);
    assert_near(servo_counts(b), 50000, 2);
}

static void a_new_target_takes_the_place_of_the_old(void **state)
{
    (void)state;
    for (unsigned after = 0; after < 40; after += 3) {
        struct bench *b = enabled_in(HAL_DRIVE_PROFILE_POSITION);

        assert_int_equal(go(b, units(80000), INT64_C(100) << 32), 0);
        ticks(b, after);
        assert_false(b->seen.arrived);
        assert_int_equal(go(b, units(5000), INT64_C(50) << 32), 0);
        arrives(b, 3000);
        ticks(b, 60);
        assert_near(servo_counts(b), 5000, 2);
    }
}

static void a_halted_motion_is_never_resumed(void **state)
{
    struct bench *b = enabled_in(HAL_DRIVE_PROFILE_POSITION);
    int64_t at;

    (void)state;
    assert_int_equal(hal_drive_halt(&b->drive.drive), MOTION_E_STATE);
    assert_int_equal(go(b, units(80000), INT64_C(100) << 32), 0);
    ticks(b, 250);
    assert_int_equal(hal_drive_halt(&b->drive.drive), 0);
    ticks(b, 300);
    assert_false(b->seen.arrived);
    at = servo_counts(b);
    assert_in_range(at, 20000, 60000);
    into(b, HAL_DRIVE_STREAM_POSITION);
    ticks(b, 100);
    into(b, HAL_DRIVE_PROFILE_POSITION);
    ticks(b, 100);
    assert_near(servo_counts(b), at, 2);
    assert_int_equal(go(b, units(70000), INT64_C(100) << 32), 0);
    arrives(b, 3000);
    ticks(b, 300);
    assert_int_equal(hal_drive_halt(&b->drive.drive), MOTION_E_STATE);
    assert_near(servo_counts(b), 70000, 2);
}

static void off_ends_a_motion_for_good(void **state)
{
    struct bench *b = enabled_in(HAL_DRIVE_PROFILE_POSITION);
    int64_t at;

    (void)state;
    assert_int_equal(go(b, units(80000), INT64_C(100) << 32), 0);
    ticks(b, 250);
    hal_drive_request(&b->drive.drive, HAL_DRIVE_REQUEST_OFF);
    until(b, HAL_DRIVE_OFF, 2000);
    ticks(b, 500);
    at = servo_counts(b);
    enable(b);
    ticks(b, 200);
    assert_near(servo_counts(b), at, 2);
    assert_false(b->seen.arrived);
    assert_int_equal(go(b, units(START), INT64_C(100) << 32), 0);
    arrives(b, 3000);
}

static void what_cannot_be_is_refused(void **state)
{
    struct bench *b = bench();

    (void)state;
    enable(b);
    assert_int_equal(go(b, 0, ONE), MOTION_E_STATE); /* follows set points */
    into(b, HAL_DRIVE_PROFILE_POSITION);
    assert_int_equal(go(b, INT64_MAX, ONE), MOTION_E_RANGE);
    assert_int_equal(go(b, 0, 0), MOTION_E_ARG);
    assert_int_equal(go(b, 0, -ONE), MOTION_E_ARG);
    assert_int_equal(go(b, 0, INT64_MAX), MOTION_E_RANGE);
    hal_drive_request(&b->drive.drive, HAL_DRIVE_REQUEST_OFF);
    assert_int_equal(go(b, 0, ONE), MOTION_E_STATE);
}

static void a_motion_that_takes_too_long_is_a_fault(void **state)
{
    struct bench *b = enabled_in(HAL_DRIVE_PROFILE_POSITION);
    const struct hal_drive_go order = { .pos_q32 = units(80000),
                                        .vel_q32 = ONE,
                                        .timeout_ns = 300 * MS };

    (void)state;
    assert_int_equal(hal_drive_go(&b->drive.drive, &order), 0);
    ticks(b, 290);
    assert_int_equal(b->seen.state, HAL_DRIVE_ENABLED);
    until(b, HAL_DRIVE_FAULT, 50);
    assert_text(b, "took longer");
}

/* The drive hears nothing more: its own watch quick stops it. */
static void a_set_point_that_is_not_taken_is_a_fault(void **state)
{
    struct bench *b = enabled_in(HAL_DRIVE_PROFILE_POSITION);

    (void)state;
    assert_int_equal(go(b, units(80000), ONE), 0);
    for (int i = 0; i < 100 && b->drive.job != DRIVE_CIA402_NO_JOB; i++)
        ticks(b, 1);
    sim_cia402_inject(&b->servo, SIM_CIA402_DEAF);
    until(b, HAL_DRIVE_FAULT, 1200);
    assert_text(b, "set point not acknowledged");
    ticks(b, 500);
    assert_near(servo_counts(b), START, 10);
}

/* ---- profile velocity -------------------------------------------------- */

static void it_runs_at_a_velocity_and_stops_by_its_ramp(void **state)
{
    struct bench *b = enabled_in(HAL_DRIVE_PROFILE_VELOCITY);
    int64_t at;
    unsigned took;

    (void)state;
    assert_int_equal(go(b, 0, INT64_C(-50) * ONE), 0);
    took = arrives(b, 500);
    if (took < 45 || took > 70)
        fail_msg("took %u ms", took);
    ticks(b, 10);
    at = servo_counts(b);
    ticks(b, 100);
    assert_near(servo_counts(b) - at, -5000, 60);
    assert_int_equal(go(b, 0, 0), 0);
    ticks(b, 5);
    assert_false(b->seen.arrived);
    arrives(b, 500);
    ticks(b, 50);
    at = servo_counts(b);
    ticks(b, 50);
    assert_near(servo_counts(b), at, 1);
    into(b, HAL_DRIVE_STREAM_POSITION);
    ticks(b, 50);
    assert_near(servo_counts(b), at, 3);
}

static void a_fault_forgets_the_velocity(void **state)
{
    struct bench *b = enabled_in(HAL_DRIVE_PROFILE_VELOCITY);
    int64_t at;

    (void)state;
    assert_int_equal(go(b, 0, INT64_C(20) * ONE), 0);
    ticks(b, 100);
    sim_cia402_inject(&b->servo, SIM_CIA402_OVERCURRENT);
    until(b, HAL_DRIVE_FAULT, 100);
    ticks(b, 500);
    hal_drive_request(&b->drive.drive, HAL_DRIVE_REQUEST_RESET);
    until(b, HAL_DRIVE_OFF, 500);
    at = servo_counts(b);
    enable(b);
    ticks(b, 200);
    assert_near(servo_counts(b), at, 3);
}

/* ---- homing ------------------------------------------------------------ */

static int home_by(struct bench *b, int method, int64_t timeout_ns)
{
    const struct hal_drive_home home = {
        .method = method,
        .fast_q32 = INT64_C(100) << 32,
        .slow_q32 = INT64_C(5) << 32,
        .acc_q32 = INT64_C(2000) << 32,
        .pos_q32 = units(500),
        .timeout_ns = timeout_ns,
    };

    return hal_drive_home(&b->drive.drive, &home);
}

static void homes(struct bench *b, enum hal_drive_homing want, unsigned most)
{
    for (unsigned i = 0; i < most; i++) {
        ticks(b, 1);
        if (b->seen.homing == want)
            return;
    }
    fail_msg("homing is %d: %s", b->seen.homing, b->seen.fault_text);
}

/* Method 19: the left edge of the switch, at 20000; position there is 500. */
static void it_homes_and_counts_from_there(void **state)
{
    struct bench *b = enabled_in(HAL_DRIVE_HOMING);

    (void)state;
    assert_int_equal(b->seen.homing, HAL_DRIVE_HOMING_NONE);
    assert_int_equal(home_by(b, 19, 20 * S), 0);
    ticks(b, 1);
    assert_int_equal(b->seen.homing, HAL_DRIVE_HOMING_RUNNING);
    assert_int_equal(
        hal_drive_set_mode(&b->drive.drive, HAL_DRIVE_STREAM_POSITION),
        MOTION_E_STATE);
    homes(b, HAL_DRIVE_HOMING_DONE, 20000);
    assert_near(servo_counts(b) - counts(b->seen.pos_q32), 19500, 4);
    assert_int_equal(b->seen.state, HAL_DRIVE_ENABLED);
    into(b, HAL_DRIVE_STREAM_POSITION);
    assert_int_equal(b->seen.homing, HAL_DRIVE_HOMING_DONE);
    for (int i = 0; i < 100; i++) { /* and set points are in the new count */
        const int64_t at = servo_counts(b);

        begin(b);
        assert_int_equal(set(b, b->seen.pos_q32, 0), 0);
        end(b);
        assert_near(servo_counts(b), at, 3);
    }
}

static void it_can_be_homed_twice(void **state)
{
    struct bench *b = enabled_in(HAL_DRIVE_HOMING);

    (void)state;
    for (int i = 0; i < 2; i++) {
        ticks(b, 60);
        assert_int_equal(home_by(b, i == 0 ? 34 : 19, 20 * S), 0);
        ticks(b, 1);
        homes(b, HAL_DRIVE_HOMING_DONE, 20000);
    }
    assert_near(servo_counts(b) - counts(b->seen.pos_q32), 19500, 4);
}

static void homing_that_fails_says_so(void **state)
{
    struct sim_cia402_config servo = servo_config;
    struct bench *b;

    (void)state;
    servo.rail.has_home = false;
    b = bench_of(&drive_config, &master_config, &servo);
    enable(b);
    into(b, HAL_DRIVE_HOMING);
    assert_int_equal(home_by(b, 19, 20 * S), 0);
    homes(b, HAL_DRIVE_HOMING_FAILED, 5000);
    assert_int_equal(b->seen.state, HAL_DRIVE_ENABLED);
    into(b, HAL_DRIVE_STREAM_POSITION);
}

static void homing_has_a_time_out(void **state)
{
    struct bench *b = enabled_in(HAL_DRIVE_HOMING);

    (void)state;
    assert_int_equal(home_by(b, 18, 200 * MS), 0);
    until(b, HAL_DRIVE_FAULT, 300);
    assert_text(b, "homing took longer");
    assert_int_equal(b->seen.homing, HAL_DRIVE_HOMING_FAILED);
    ticks(b, 500);
    assert_true(servo_counts(b) < 60000);
}

static void a_method_it_has_not_is_told(void **state)
{
    struct bench *b = enabled_in(HAL_DRIVE_HOMING);

    (void)state;
    assert_int_equal(home_by(b, 1000, S), MOTION_E_ARG);
    assert_int_equal(home_by(b, 19, 0), MOTION_E_ARG);
    assert_int_equal(home_by(b, -1, 5 * S), 0);
    until(b, HAL_DRIVE_FAULT, 100);
    assert_text(b, "0x6098:00 refused");
}

static void halted_homing_stands_and_is_not_done(void **state)
{
    struct bench *b = enabled_in(HAL_DRIVE_HOMING);
    int64_t at;

    (void)state;
    assert_int_equal(home_by(b, 18, 20 * S), 0);
    ticks(b, 300);
    assert_int_equal(hal_drive_halt(&b->drive.drive), 0);
    homes(b, HAL_DRIVE_HOMING_NONE, 500);
    ticks(b, 60);
    at = servo_counts(b);
    ticks(b, 100);
    assert_near(servo_counts(b), at, 2);
    assert_int_equal(home_by(b, 37, S), 0);
    homes(b, HAL_DRIVE_HOMING_DONE, 100);
    assert_near(counts(b->seen.pos_q32), 500, 1);
}

/* ---- streamed: IP, CSV ------------------------------------------------- */

/* 20 counts more every tick. */
static void stream(struct bench *b, int n, int64_t *at)
{
    for (int i = 0; i < n; i++) {
        begin(b);
        *at += 20;
        assert_int_equal(set(b, units(*at), INT64_C(20) << 32), 0);
        end(b);
    }
}

/* Then a while at the last one. */
static void rest(struct bench *b, int n, int64_t at)
{
    for (int i = 0; i < n; i++) {
        begin(b);
        assert_int_equal(set(b, units(at), 0), 0);
        end(b);
    }
}

static void positions_are_streamed_in_every_way(void **state)
{
    static const int code[] = { 8, 7, 9 };

    (void)state;
    for (unsigned i = 0; i < 3; i++) {
        struct drive_cia402_config config = drive_config;
        struct bench *b;
        int64_t at = START;

        config.stream = (enum drive_cia402_stream)i;
        config.gain_q16 = INT64_C(30) << 16;
        b = bench_of(&config, &master_config, &servo_config);
        enable(b);
        assert_int_equal(b->servo.mode, code[i]);
        stream(b, 1000, &at);
        assert_true(b->seen.following);
        /* two ticks behind, as the demand says */
        assert_near(counts(b->seen.pos_q32), at - 60, 30);
        assert_int_equal(b->seen.demand_age_ns, 2 * MS);
        rest(b, 300, at);
        assert_near(servo_counts(b), at, 2);
        assert_int_equal(b->orders > 0, i == 2);
    }
}

static void a_velocity_is_streamed(void **state)
{
    struct drive_cia402_config config = drive_config;
    struct bench *b;
    int64_t at;

    (void)state;
    config.velocity = true;
    b = bench_of(&config, &master_config, &servo_config);
    enable(b);
    assert_int_equal(b->orders, 0);
    into(b, HAL_DRIVE_STREAM_VELOCITY);
    for (int i = 0; i < 200; i++) {
        begin(b);
        assert_int_equal(set(b, 0, INT64_C(-30) * ONE), 0);
        end(b);
    }
    assert_true(b->orders > 150);
    at = servo_counts(b);
    ticks(b, 100); /* the last one stays in force */
    assert_near(servo_counts(b) - at, -3000, 40);
    hal_drive_request(&b->drive.drive, HAL_DRIVE_REQUEST_OFF);
    until(b, HAL_DRIVE_OFF, 1000);
    ticks(b, 300);
    at = servo_counts(b);
    enable(b);
    ticks(b, 100);
    assert_near(servo_counts(b), at, 3);
}

/* Units of velocity of its own, as makers have them: 1/10 count/s. */
static void speeds_are_in_the_drives_units(void **state)
{
    struct drive_cia402_config config = drive_config;
    struct bench *b;

    (void)state;
    config.vel_num = 10;
    config.vel_den = 1;
    config.acc_num = 1;
    config.acc_den = 4;
    b = bench_of(&config, &master_config, &servo_config);
    /* 0x6096 is 1/1 there: with it, velocities are not spoken of */
    until(b, HAL_DRIVE_OFF, 2000);
    assert_int_equal(hal_drive_modes(&b->drive.drive),
                     1u << HAL_DRIVE_STREAM_POSITION);
    config.velocity = true;
    b = bench_of(&config, &master_config, &servo_config);
    until(b, HAL_DRIVE_FAULT, 2000);
    assert_text(b, "0x6096 has speeds at 1, we at 10");
}

/* ---- probe, torque ----------------------------------------------------- */

static void the_probe_tells_where_the_edge_was(void **state)
{
    struct bench *b = bench();
    int64_t at = START, edge;

    (void)state;
    assert_int_equal(hal_drive_probe(&b->drive.drive, HAL_DRIVE_PROBE_RISING),
                     MOTION_E_STATE);
    enable(b);
    assert_int_equal(hal_drive_probe(&b->drive.drive, HAL_DRIVE_PROBE_RISING),
                     0);
    stream(b, 100, &at);
    assert_false(b->seen.probe_latched);
    digital_inputs_set(&b->servo, 1u << 16);
    edge = servo_counts(b);
    stream(b, 100, &at);
    assert_true(b->seen.probe_latched);
    assert_near(counts(b->seen.probe_pos_q32), edge, 2);
    assert_int_equal(hal_drive_probe(&b->drive.drive, HAL_DRIVE_PROBE_FALLING),
                     0);
    stream(b, 50, &at);
    assert_false(b->seen.probe_latched);
    digital_inputs_set(&b->servo, 0);
    edge = servo_counts(b);
    stream(b, 50, &at);
    assert_true(b->seen.probe_latched);
    assert_near(counts(b->seen.probe_pos_q32), edge, 2);
}

static void torque_goes_both_ways(void **state)
{
    struct drive_cia402_config config = drive_config;
    struct bench *b;
    int64_t worst[2] = { 0, 0 };

    (void)state;
    config.torque = true;
    for (int32_t fed = 0; fed < 2; fed++) {
        int64_t past[4] = { START, START, START, START };

        b = bench_of(&config, &master_config, &servo_config);
        enable(b);
        for (int i = 0; i < 200; i++) {
            struct hal_drive_target target = { 0 };
            int64_t off;

            begin(b);
            memmove(&past[1], &past[0], 3 * sizeof past[0]);
            past[0] += 2 * i; /* 2e6 counts/s2 of 2e7 */
            target.pos_q32 = units(past[0]);
            target.torque_permille = 100 * fed;
            assert_int_equal(hal_drive_set_target(&b->drive.drive, &target), 0);
            off = past[3] - counts(b->seen.pos_q32);
            if (i > 100 && llabs(off) > worst[fed])
                worst[fed] = llabs(off);
            end(b);
        }
        assert_true(b->seen.torque_known);
        assert_near(b->seen.torque_permille, 100, 25); /* ripples */
    }
    if (worst[1] > worst[0] / 2)
        fail_msg("%" PRId64 " counts without, %" PRId64 " with", worst[0],
                 worst[1]);
}

static void torque_is_turned_with_a_reversed_axis(void **state)
{
    struct drive_cia402_config config = drive_config;
    struct hal_drive_target target = { .torque_permille = 300 };
    struct bench *b;

    (void)state;
    config.torque = true;
    config.counts_num = -1000;
    b = bench_of(&config, &master_config, &servo_config);
    enable(b);
    begin(b);
    target.pos_q32 = b->seen.pos_q32;
    assert_int_equal(hal_drive_set_target(&b->drive.drive, &target), 0);
    end(b);
    assert_int_equal(b->drive.target_torque, -300);
    begin(b);
    end(b);
    begin(b);
    end(b);
    assert_true(b->servo.base.plant.push_q8 < 0);
}

/* ---- start-up ---------------------------------------------------------- */

static uint32_t object(struct bench *b, uint16_t index, uint8_t sub)
{
    uint32_t value = 0;

    for (int i = 0; i < 50; i++) {
        ticks(b, 1);
        if (canopen_sdo_take(&b->drive.node, &value, NULL) == MOTION_OK)
            return value;
        (void)canopen_sdo_read(&b->drive.node, b->now_ns, index, sub);
    }
    fail_msg("0x%04X:%u is not answered", index, sub);
    return 0;
}

static void the_options_of_the_config_are_written(void **state)
{
    struct drive_cia402_config config = drive_config;
    struct bench *b;

    (void)state;
    config.pos_min_q32 = -20 * ONE;
    config.pos_max_q32 = 40 * ONE;
    config.following_error_counts = 777;
    config.following_error_ms = 12;
    config.option[DRIVE_CIA402_QUICK_STOP].given = true;
    config.option[DRIVE_CIA402_QUICK_STOP].value = 6;
    config.option[DRIVE_CIA402_FAULT].given = true;
    config.option[DRIVE_CIA402_FAULT].value = 0;
    b = bench_of(&config, &master_config, &servo_config);
    until(b, HAL_DRIVE_OFF, 2000);
    assert_int_equal((int32_t)object(b, 0x607D, 1), -20001);
    assert_int_equal((int32_t)object(b, 0x607D, 2), 40001);
    assert_int_equal(object(b, 0x6065, 0), 777);
    assert_int_equal(object(b, 0x6066, 0), 12);
    assert_int_equal(object(b, 0x605A, 0), 6);
    assert_int_equal(object(b, 0x605E, 0), 0);
    assert_int_equal(object(b, 0x605C, 0), 1); /* as it was */
    config.counts_num = -1000;
    b = bench_of(&config, &master_config, &servo_config);
    until(b, HAL_DRIVE_OFF, 2000);
    assert_int_equal((int32_t)object(b, 0x607D, 1), -40001);
    assert_int_equal((int32_t)object(b, 0x607D, 2), 20001);
    config.option[DRIVE_CIA402_SHUTDOWN].given = true;
    config.option[DRIVE_CIA402_SHUTDOWN].value = 9;
    b = bench_of(&config, &master_config, &servo_config);
    until(b, HAL_DRIVE_FAULT, 2000);
    assert_text(b, "0x605B:00 refused");
}

static void limits_can_wait_for_homing(void **state)
{
    struct drive_cia402_config config = drive_config;
    struct bench *b;

    (void)state;
    config.pos_min_q32 = -20 * ONE;
    config.pos_max_q32 = 40 * ONE;
    config.limits_when_homed = true;
    b = bench_of(&config, &master_config, &servo_config);
    enable(b);
    assert_int_equal(object(b, 0x607D, 2), 0);
    into(b, HAL_DRIVE_HOMING);
    assert_int_equal(home_by(b, 19, 20 * S), 0);
    homes(b, HAL_DRIVE_HOMING_DONE, 20000);
    /* counted from the home point, which is at half a unit */
    assert_int_equal((int32_t)object(b, 0x607D, 1), -20001 - 500);
    assert_int_equal((int32_t)object(b, 0x607D, 2), 40001 - 500);
    into(b, HAL_DRIVE_STREAM_POSITION);
}

/* Enabled outside its limits, a drive would leap to them: there they are wide,
 * by the first step that is allowed (1000 counts), until it is inside. */
static void outside_its_limits_it_stays_and_is_moved_inward(void **state)
{
    static const struct {
        bool reversed, by_hand; /* moved out while it was off; else found so */
        int32_t at;             /* counts of the drive */
        int32_t wide[2];
    } rows[] = {
        { false, true, 15010, { -20001, 16010 } },
        { false, true, 15002, { -20001, 16002 } },
        { false, true, -20500, { -21500, 15001 } },
        { true, true, 20900, { -15001, 21900 } },
        { false, false, 24000, { -20001, 25000 } },
        { false, false, -24000, { -25000, 15001 } },
        { true, false, -15003, { -16003, 20001 } },
    };

    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(rows); i++) {
        struct drive_cia402_config config = drive_config;
        struct sim_cia402_config servo = servo_config;
        const int sign = rows[i].reversed ? -1 : 1;
        struct bench *b;
        int64_t at = rows[i].at * sign;

        config.pos_min_q32 = -20 * ONE;
        config.pos_max_q32 = 15 * ONE;
        config.counts_num *= sign;
        servo.start_counts = rows[i].by_hand ? 0 : rows[i].at;
        b = bench_of(&config, &master_config, &servo);
        until(b, HAL_DRIVE_OFF, 2000);
        b->servo.base.plant.pos_q24 = (int64_t)rows[i].at * (1 << 24);
        enable(b);
        rest(b, 100, at);
        assert_near(servo_counts(b), rows[i].at, 2);
        assert_int_equal((int32_t)object(b, 0x607D, 1), rows[i].wide[0]);
        assert_int_equal((int32_t)object(b, 0x607D, 2), rows[i].wide[1]);
        for (; at != 0; at += at > 0 ? -1 : 1)
            if (at % 20 == 0)
                rest(b, 1, at);
        rest(b, 100, 0);
        assert_near(servo_counts(b), 0, 2);
        assert_int_equal(b->seen.state, HAL_DRIVE_ENABLED);
        assert_int_equal((int32_t)object(b, 0x607D, 1),
                         rows[i].reversed ? -15001 : -20001);
        assert_int_equal((int32_t)object(b, 0x607D, 2),
                         rows[i].reversed ? 20001 : 15001);
    }
}

/* In the middle of writing them it is switched off, moved and switched on. */
static void limits_half_written_are_written_anew(void **state)
{
    (void)state;
    for (int after = 0; after < 16; after++) {
        struct drive_cia402_config config = drive_config;
        struct bench *b;

        config.pos_min_q32 = -20 * ONE;
        config.pos_max_q32 = 5 * ONE;
        b = bench_of(&config, &master_config, &servo_config);
        enable(b); /* at START, outside */
        for (int64_t at = START; at > 4900; at -= 20)
            rest(b, 1, at);
        rest(b, after, 4900);
        hal_drive_request(&b->drive.drive, HAL_DRIVE_REQUEST_OFF);
        until(b, HAL_DRIVE_OFF, 500);
        b->servo.base.plant.pos_q24 = (int64_t)START * (1 << 24);
        enable(b);
        rest(b, 100, START);
        assert_near(servo_counts(b), START, 2);
    }
}

/* 10000 counts per turn there, 1000 per unit here. */
static void the_factor_group_must_agree(void **state)
{
    static const struct {
        int64_t travel_q32;
        const char *text; /* NULL: agrees */
    } rows[] = {
        { 10 * ONE, NULL },
        { 0, NULL },
        { 20 * ONE, "the drive has 10000 counts per turn, we 20000" },
        { 10 * ONE + ONE / 1000, "the drive has 10000 counts per turn" },
    };

    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(rows); i++) {
        struct drive_cia402_config config = drive_config;
        struct bench *b;

        config.travel_q32 = rows[i].travel_q32;
        b = bench_of(&config, &master_config, &servo_config);
        until(b, rows[i].text == NULL ? HAL_DRIVE_OFF : HAL_DRIVE_FAULT, 2000);
        if (rows[i].text != NULL)
            assert_text(b, rows[i].text);
    }
}

static void sync_with_a_counter(void **state)
{
    struct canopen_config master = master_config;
    struct bench *b;
    int64_t at = START;

    (void)state;
    master.sync_overflow = 10;
    b = bench_of(&drive_config, &master, &servo_config);
    enable(b);
    assert_int_equal(object(b, 0x1019, 0), 10);
    stream(b, 100, &at);
    rest(b, 100, at);
    assert_near(servo_counts(b), at, 2);
}

static void a_drive_without_heartbeat_is_guarded(void **state)
{
    struct drive_cia402_config config = drive_config;
    struct bench *b;
    int64_t at = START;

    (void)state;
    config.guard_period_ns = 20 * MS;
    b = bench_of(&config, &master_config, &servo_config);
    enable(b);
    stream(b, 300, &at);
    assert_int_equal(b->seen.state, HAL_DRIVE_ENABLED);
    assert_int_equal(object(b, 0x100C, 0), 20);
    assert_int_equal(object(b, 0x100D, 0), 2);
    assert_int_equal(object(b, 0x1017, 0), 0);
    assert_int_equal(object(b, 0x1016, 1), 0);
    b->drive.node.guard_period_ns = 0; /* we no longer ask: it stops */
    for (int i = 0; i < 200 && b->servo.power == 4; i++)
        ticks(b, 1);
    assert_int_not_equal(b->servo.power, 4);
    config.guard_period_ns = 26 * MS; /* not twice in 50 ms */
    assert_int_equal(drive_cia402_init(&b->drive, &b->master, &config),
                     MOTION_E_ARG);
}

static void a_guarded_drive_that_is_silent_is_lost(void **state)
{
    struct drive_cia402_config config = drive_config;
    struct bench *b;

    (void)state;
    config.guard_period_ns = 20 * MS;
    b = bench_of(&config, &master_config, &servo_config);
    enable(b);
    sim_cia402_inject(&b->servo, SIM_CIA402_SILENT);
    until(b, HAL_DRIVE_OFFLINE, 100);
}

static void configs_outside_their_ranges_are_refused(void **state)
{
    struct bench *b = bench();

    (void)state;
    for (int i = 0; i < 7; i++) {
        struct drive_cia402_config config = drive_config;

        config.node_id = NODE + 1;
        if (i == 0)
            config.stream = DRIVE_CIA402_CSV; /* no gain */
        if (i == 1)
            config.vel_num = -1;
        if (i == 2)
            config.acc_den = 1; /* no num */
        if (i == 3)
            config.pos_min_q32 = 1;
        if (i == 4)
            config.travel_q32 = -1;
        if (i == 5)
            config.guard_period_ns = MS / 2;
        if (i == 6)
            config.stream = (enum drive_cia402_stream)3;
        assert_int_equal(drive_cia402_init(&b->drive, &b->master, &config),
                         MOTION_E_ARG);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(it_tells_its_modes_once_it_is_found),
        cmocka_unit_test(a_mode_changes_while_off_and_stays_so),
        cmocka_unit_test(no_mode_changes_while_the_axis_moves),
        cmocka_unit_test(off_in_the_middle_of_a_change),
        cmocka_unit_test(a_fault_in_the_middle_of_a_change),
        cmocka_unit_test(it_goes_to_a_position_by_its_own_ramps),
        cmocka_unit_test(a_new_target_takes_the_place_of_the_old),
        cmocka_unit_test(a_halted_motion_is_never_resumed),
        cmocka_unit_test(off_ends_a_motion_for_good),
        cmocka_unit_test(what_cannot_be_is_refused),
        cmocka_unit_test(a_motion_that_takes_too_long_is_a_fault),
        cmocka_unit_test(a_set_point_that_is_not_taken_is_a_fault),
        cmocka_unit_test(it_runs_at_a_velocity_and_stops_by_its_ramp),
        cmocka_unit_test(a_fault_forgets_the_velocity),
        cmocka_unit_test(it_homes_and_counts_from_there),
        cmocka_unit_test(it_can_be_homed_twice),
        cmocka_unit_test(homing_that_fails_says_so),
        cmocka_unit_test(homing_has_a_time_out),
        cmocka_unit_test(a_method_it_has_not_is_told),
        cmocka_unit_test(halted_homing_stands_and_is_not_done),
        cmocka_unit_test(positions_are_streamed_in_every_way),
        cmocka_unit_test(a_velocity_is_streamed),
        cmocka_unit_test(speeds_are_in_the_drives_units),
        cmocka_unit_test(the_probe_tells_where_the_edge_was),
        cmocka_unit_test(torque_goes_both_ways),
        cmocka_unit_test(torque_is_turned_with_a_reversed_axis),
        cmocka_unit_test(the_options_of_the_config_are_written),
        cmocka_unit_test(limits_can_wait_for_homing),
        cmocka_unit_test(outside_its_limits_it_stays_and_is_moved_inward),
        cmocka_unit_test(limits_half_written_are_written_anew),
        cmocka_unit_test(the_factor_group_must_agree),
        cmocka_unit_test(sync_with_a_counter),
        cmocka_unit_test(a_drive_without_heartbeat_is_guarded),
        cmocka_unit_test(a_guarded_drive_that_is_silent_is_lost),
        cmocka_unit_test(configs_outside_their_ranges_are_refused),
    };

    return cmocka_run_group_tests(tests, NULL, NULL);
}
