/* tests/hal/drive/cia402/test_drive_cia402_sim.c - driver and simulated drive,
 * end to end.
 *
 * The two were written apart from each other, from the same two standards: what
 * they agree on here is what both read there. */
#include <inttypes.h>
#include <string.h>

#include "tests/hal/canopen/canopen_bench.h"
#include "tests/sim/device/cia402/digital_inputs.h"

#include "hal/drive/cia402/drive.h"
#include "motion/core/fixed.h"
#include "sim/device/cia402/servo.h"

#define ONE   MOTION_FIXED_ONE_Q32
#define AXES  4
#define START 654321

struct bench {
    struct sim_world world;
    struct sim_can_bus bus;
    struct sim_can_port port, other;
    struct sim_cia402 servo[AXES];
    struct canopen master;
    struct drive_cia402 drive[AXES];
    struct hal_drive_feedback seen[AXES];
    unsigned axes;
    int64_t now_ns;
    enum hal_fieldbus_health bus_health;
};

static const struct canopen_config master_config = CANOPEN_BENCH_MASTER;

static const struct drive_cia402_config drive_config = {
    CANOPEN_BENCH_COUNTS,
    .following_error_counts = 5000,
    .quick_stop_counts_s2 = 2000000,
};

static const struct sim_cia402_config servo_config = {
    .plant = CANOPEN_BENCH_PLANT,
    .start_counts = START,
    .loop_ns = 250000,
    .brake_release_ns = 80 * MS,
    .boot_ns = 30 * MS,
};

static void bench_of(struct bench *b, unsigned axes)
{
    memset(b, 0, sizeof *b);
    b->axes = axes;
    b->now_ns = 1000 * MS;
    canopen_bench_wire(&b->world, &b->bus, &b->port);
    assert_int_equal(canopen_init(&b->master, &b->port.can, &master_config), 0);
    for (unsigned i = 0; i < axes; i++) {
        struct sim_cia402_config servo = servo_config;
        struct drive_cia402_config drive = drive_config;

        drive.node_id = servo.node_id = (uint8_t)(i + 1);
        assert_int_equal(sim_cia402_init(&b->servo[i], &b->bus, &servo), 0);
        assert_int_equal(drive_cia402_init(&b->drive[i], &b->master, &drive),
                         0);
    }
}

static int bench_setup(void **state)
{
    static struct bench bench;

    bench_of(&bench, 1);
    *state = &bench;
    return 0;
}

static void bench_begin(struct bench *b)
{
    sim_world_run(&b->world, b->now_ns);
    b->bus_health = hal_fieldbus_begin(&b->master.fieldbus, b->now_ns);
    for (unsigned i = 0; i < b->axes; i++)
        hal_drive_feedback(&b->drive[i].drive, &b->seen[i]);
}

static void bench_end(struct bench *b)
{
    hal_fieldbus_end(&b->master.fieldbus, b->now_ns);
    b->now_ns += 1 * MS;
}

static void tick(struct bench *b)
{
    bench_begin(b);
    bench_end(b);
}

static void ticks(struct bench *b, unsigned count)
{
    while (count-- > 0)
        tick(b);
}

static bool all_are(const struct bench *b, enum hal_drive_state state)
{
    for (unsigned i = 0; i < b->axes; i++)
        if (b->seen[i].state != state)
            return false;
    return true;
}

static unsigned until(struct bench *b, enum hal_drive_state state,
                      unsigned most)
{
    for (unsigned i = 1; i <= most; i++) {
        tick(b);
        if (all_are(b, state))
            return i;
    }
    fail_msg("still %s after %u ticks: %s",
             hal_drive_state_text(b->seen[0].state), most,
             b->seen[0].fault_text);
    return 0;
}

static void request(struct bench *b, enum hal_drive_request what)
{
    for (unsigned i = 0; i < b->axes; i++)
        hal_drive_request(&b->drive[i].drive, what);
}

static void enable(struct bench *b)
{
    until(b, HAL_DRIVE_OFF, 1000);
    request(b, HAL_DRIVE_REQUEST_ENABLE);
    until(b, HAL_DRIVE_ENABLED, 500);
}

static int64_t pos_of(int64_t counts)
{
    int64_t pos_q32 = 0;

    motion_fixed_muldiv(counts, ONE, 1000, &pos_q32);
    return pos_q32;
}

static int64_t counts_of(int64_t pos_q32)
{
    int64_t counts = 0;

    motion_fixed_muldiv(pos_q32, 1000, ONE, &counts);
    return counts;
}

static int64_t servo_counts(const struct bench *b, unsigned i)
{
    return sim_servo_pos_q24(&b->servo[i].base) >> 24;
}

#define assert_text(b, want)                                                   \
    do {                                                                       \
        if (strstr((b)->seen[0].fault_text, want) == NULL)                     \
            fail_msg("\"%s\" is not in \"%s\"", want,                          \
                     (b)->seen[0].fault_text);                                 \
    } while (0)

static void power_up_ends_enabled_without_a_jump(void **state)
{
    struct bench *b = *state;
    unsigned off, on;

    off = until(b, HAL_DRIVE_OFF, 500);
    assert_int_equal(counts_of(b->seen[0].pos_q32), START);
    request(b, HAL_DRIVE_REQUEST_ENABLE);
    on = until(b, HAL_DRIVE_ENABLED, 500);
    print_message("off after %u ms, enabled %u ms later\n", off, on);
    for (int i = 0; i < 200; i++) {
        tick(b);
        assert_in_range(servo_counts(b, 0) - START + 2, 0, 4);
    }
    assert_true(b->seen[0].following);
    assert_int_equal(b->bus_health, HAL_FIELDBUS_GOOD);
    assert_int_equal(b->master.stats.malformed, 0);
    assert_int_equal(b->master.stats.unexpected, 0);
    assert_int_equal(b->master.stats.foreign_master, 0);
    assert_int_equal(b->master.cycle.send_refused, 0);
}

/* Set points of an S with 1 unit/ms in its middle; following error from the
 * age that the drive reports. */
struct follower {
    int64_t given_ns[2000], given_counts[2000];
    unsigned count;
    int64_t worst;
};

static void follow_tick(struct bench *b, unsigned i, struct follower *f,
                        int64_t counts)
{
    const struct hal_drive_feedback *seen = &b->seen[i];
    const int64_t given_ns = seen->t_ns - seen->demand_age_ns;

    for (unsigned k = f->count; seen->demand_age_ns != 0 && k-- > 0;)
        if (f->given_ns[k] == given_ns) {
            int64_t off = f->given_counts[k] - counts_of(seen->pos_q32);

            off = off < 0 ? -off : off;
            f->worst = off > f->worst ? off : f->worst;
            break;
        }
    f->given_ns[f->count] = b->now_ns;
    f->given_counts[f->count++] = counts;
    assert_int_equal(hal_drive_set_target(&b->drive[i].drive,
                                          &(struct hal_drive_target){
                                              .pos_q32 = pos_of(counts) }),
                     MOTION_OK);
}

static int64_t ramp_counts(int64_t t_ms)
{
    /* 1000 counts/ms^2 / 200: up in 200 ms, on for 600, down in 200 */
    const int64_t acc = 2;

    if (t_ms < 200)
        return acc * t_ms * t_ms / 2;
    if (t_ms < 800)
        return acc * 200 * 100 + acc * 200 * (t_ms - 200);
    if (t_ms < 1000)
        return acc * 200 * 800 - acc * (1000 - t_ms) * (1000 - t_ms) / 2;
    return acc * 200 * 800;
}

static void four_axes_follow_a_ramp_on_one_bus(void **state)
{
    static struct bench bench;
    static struct follower follower[AXES];
    struct bench *b = &bench;

    (void)state;
    bench_of(b, AXES);
    enable(b);
    memset(follower, 0, sizeof follower);
    for (int t = 0; t < 1300; t++) {
        bench_begin(b);
        for (unsigned i = 0; i < AXES; i++) {
            assert_int_equal(b->seen[i].state, HAL_DRIVE_ENABLED);
            follow_tick(b, i, &follower[i], START + ramp_counts(t));
            /* 400 counts/ms; a SYNC may wait for one frame, 0.13 ms */
            if (t > 500 && t < 700)
                assert_in_range(b->seen[i].vel_q32 / ONE, 348, 452);
            if (t > 10)
                assert_int_equal(b->seen[i].demand_age_ns, 2 * MS);
        }
        bench_end(b);
    }
    for (unsigned i = 0; i < AXES; i++) {
        print_message("axis %u: worst following error %" PRId64 " counts\n", i,
                      follower[i].worst);
        /* A second-order loop lags acc / omega^2 while it speeds up:
         * 2e6 counts/s2 / (200 rad/s)^2 = 50 counts, then not at all. */
        assert_in_range(follower[i].worst, 30, 70);
        assert_in_range(servo_counts(b, i) - START - ramp_counts(1000) + 1, 0,
                        2);
    }
    assert_int_equal(b->master.stats.unexpected, 0);
}

static void run_at_speed(struct bench *b)
{
    enable(b);
    for (int t = 0; t < 400; t++) {
        const struct hal_drive_target target = { .pos_q32 = pos_of(
                                                     START + ramp_counts(t)) };

        bench_begin(b);
        assert_int_equal(hal_drive_set_target(&b->drive[0].drive, &target), 0);
        bench_end(b);
    }
}

static void quick_stop_ramps_down_and_ends_off(void **state)
{
    struct bench *b = *state;
    int64_t from, displacement;

    run_at_speed(b);
    from = servo_counts(b, 0);
    request(b, HAL_DRIVE_REQUEST_QUICK_STOP);
    tick(b);
    assert_int_equal(b->seen[0].state, HAL_DRIVE_QUICK_STOP);
    until(b, HAL_DRIVE_OFF, 500);
    ticks(b, 20);
    displacement = servo_counts(b, 0) - from;
    /* 400000^2 / (2 x 2000000) = 40000, and three periods of reaction */
    assert_in_range(displacement, 39000, 42500);
    assert_int_equal(b->seen[0].vel_q32, 0);
    ticks(b, 100);
    assert_int_equal(b->seen[0].state, HAL_DRIVE_OFF);
    request(b, HAL_DRIVE_REQUEST_ENABLE);
    until(b, HAL_DRIVE_ENABLED, 300);
    ticks(b, 100);
    assert_in_range(servo_counts(b, 0) - from - displacement + 3, 0, 6);
}

static void a_drive_fault_latches_and_resets(void **state)
{
    struct bench *b = *state;

    for (int again = 0; again < 2; again++) {
        if (again == 0)
            run_at_speed(b);
        sim_cia402_inject(&b->servo[0], SIM_CIA402_OVERCURRENT);
        until(b, HAL_DRIVE_FAULT, 4);
        assert_int_equal(b->seen[0].fault_code, 0x2310);
        assert_text(b, "current, output side");
        ticks(b, 500);
        assert_int_equal(b->seen[0].state, HAL_DRIVE_FAULT);
        assert_int_equal(b->seen[0].vel_q32, 0);
        request(b, HAL_DRIVE_REQUEST_RESET);
        until(b, HAL_DRIVE_OFF, 20);
        ticks(b, 200);
        assert_int_equal(b->seen[0].state, HAL_DRIVE_OFF);
        request(b, HAL_DRIVE_REQUEST_ENABLE);
        until(b, HAL_DRIVE_ENABLED, 300);
    }
}

static void a_blocked_rotor_is_a_following_error(void **state)
{
    struct bench *b = *state;

    run_at_speed(b);
    sim_cia402_inject(&b->servo[0], SIM_CIA402_BLOCKED);
    for (int t = 400; t < 600 && b->seen[0].state == HAL_DRIVE_ENABLED; t++) {
        const struct hal_drive_target target = { .pos_q32 = pos_of(
                                                     START + ramp_counts(t)) };

        bench_begin(b);
        hal_drive_set_target(&b->drive[0].drive, &target);
        bench_end(b);
    }
    assert_int_equal(b->seen[0].state, HAL_DRIVE_FAULT);
    assert_int_equal(b->seen[0].fault_code, 0x8611);
    assert_text(b, "following error");
}

static void a_power_cycle_is_noticed_and_never_enables(void **state)
{
    struct bench *b = *state;
    unsigned took;

    run_at_speed(b);
    sim_cia402_inject(&b->servo[0], SIM_CIA402_REBOOT);
    took = until(b, HAL_DRIVE_OFFLINE, 60);
    print_message("noticed after %u ms: %s\n", took, b->seen[0].fault_text);
    ticks(b, 500);
    assert_int_equal(b->seen[0].state, HAL_DRIVE_OFFLINE);
    assert_text(b, "restarted by itself");
    request(b, HAL_DRIVE_REQUEST_RESET);
    until(b, HAL_DRIVE_OFF, 500);
    ticks(b, 200);
    assert_int_equal(b->seen[0].state, HAL_DRIVE_OFF);
    request(b, HAL_DRIVE_REQUEST_ENABLE);
    until(b, HAL_DRIVE_ENABLED, 500);
}

static void a_silent_drive_is_offline_and_comes_back_by_reset(void **state)
{
    struct bench *b = *state;

    run_at_speed(b);
    sim_cia402_inject(&b->servo[0], SIM_CIA402_SILENT);
    assert_in_range(until(b, HAL_DRIVE_OFFLINE, 10), 3, 4);
    assert_text(b, "no position");
    ticks(b, 300);
    sim_cia402_inject(&b->servo[0], SIM_CIA402_CLEAR);
    ticks(b, 300);
    assert_int_equal(b->seen[0].state, HAL_DRIVE_OFFLINE);
    request(b, HAL_DRIVE_REQUEST_RESET);
    until(b, HAL_DRIVE_OFF, 500); /* it had missed our heartbeat, 6007 = 3 */
    request(b, HAL_DRIVE_REQUEST_ENABLE);
    until(b, HAL_DRIVE_ENABLED, 500);
}

/* The controller dies: the drive stops by itself within its watchdog. */
static void without_our_heartbeat_the_drive_stops_itself(void **state)
{
    struct bench *b = *state;
    int64_t from;

    run_at_speed(b);
    b->now_ns += 70 * MS; /* W = 50 ms, counted from our last heartbeat */
    sim_world_run(&b->world, b->now_ns);
    from = servo_counts(b, 0);
    b->now_ns += 500 * MS;
    sim_world_run(&b->world, b->now_ns);
    assert_true(servo_counts(b, 0) - from < 41000);
    from = servo_counts(b, 0);
    b->now_ns += 500 * MS;
    sim_world_run(&b->world, b->now_ns);
    assert_int_equal(servo_counts(b, 0), from);
    ticks(b, 300); /* the controller is back: nothing moves */
    assert_int_not_equal(b->seen[0].state, HAL_DRIVE_ENABLED);
    assert_in_range(servo_counts(b, 0) - from + 1, 0, 2);
}

static void safe_torque_off_is_told_as_such(void **state)
{
    struct bench *b = *state;

    sim_cia402_inject(&b->servo[0], SIM_CIA402_NO_POWER);
    until(b, HAL_DRIVE_OFF, 500);
    request(b, HAL_DRIVE_REQUEST_ENABLE);
    until(b, HAL_DRIVE_FAULT, 3200);
    assert_text(b, "no power (STO or mains)");
    sim_cia402_inject(&b->servo[0], SIM_CIA402_CLEAR);
    request(b, HAL_DRIVE_REQUEST_RESET);
    until(b, HAL_DRIVE_OFF, 20);
    request(b, HAL_DRIVE_REQUEST_ENABLE);
    until(b, HAL_DRIVE_ENABLED, 300);
    sim_cia402_inject(&b->servo[0], SIM_CIA402_NO_POWER);
    until(b, HAL_DRIVE_FAULT, 5);
    print_message("%s\n", b->seen[0].fault_text);
}

static void a_switch_is_heard_while_enabled(void **state)
{
    struct bench *b = *state;

    enable(b);
    assert_false(b->seen[0].limit_positive);
    digital_inputs_set(&b->servo[0], 2);
    ticks(b, 8);
    assert_true(b->seen[0].limit_positive);
    assert_false(b->seen[0].limit_negative);
    digital_inputs_set(&b->servo[0], 0);
    ticks(b, 8);
    assert_false(b->seen[0].limit_positive);
}

/* A controller that is started again finds its drives still enabled. */
static void a_second_master_life_takes_over_safely(void **state)
{
    struct bench *b = *state;
    struct drive_cia402_config drive = drive_config;
    int64_t from;

    enable(b);
    drive.node_id = 1;
    from = servo_counts(b, 0);
    assert_int_equal(canopen_init(&b->master, &b->port.can, &master_config), 0);
    assert_int_equal(drive_cia402_init(&b->drive[0], &b->master, &drive), 0);
    until(b, HAL_DRIVE_OFF, 500);
    ticks(b, 50);
    assert_int_equal(b->seen[0].state, HAL_DRIVE_OFF);
    assert_in_range(servo_counts(b, 0) - from + 3, 0, 6);
    request(b, HAL_DRIVE_REQUEST_ENABLE);
    until(b, HAL_DRIVE_ENABLED, 300);
}

/* ---- the two ways to no torque (IEC 61800-5-2) -------------------------- */

#define SPEED      20000 /* counts/s */
#define REST_SPEED 200   /* two counts in 10 ms */
/* Where the drive itself says that it stands, and switches off by 0x605A = 2: a
 * 512th of its motor's speed. */
#define OWN_REST_SPEED 3906

static int64_t servo_speed(const struct bench *b)
{
    return llabs(b->servo[0].base.plant.vel_q24) >> 24;
}

/* How fast it is when its torque goes, which is so many ticks from now. */
static int64_t cut_speed(struct bench *b, unsigned *took)
{
    int64_t speed = 0;

    for (*took = 0; b->servo[0].motion != 0; ++*took) {
        assert_true(*took < 4000);
        speed = servo_speed(b);
        tick(b);
    }
    return speed;
}

/* For so long at SPEED. */
static void stream(struct bench *b, unsigned count)
{
    int64_t at = counts_of(b->seen[0].pos_q32);

    for (unsigned i = 0; i < count; i++) {
        bench_begin(b);
        at += SPEED / 1000;
        assert_int_equal(hal_drive_set_target(&b->drive[0].drive,
                                              &(struct hal_drive_target){
                                                  .pos_q32 = pos_of(at) }),
                         0);
        bench_end(b);
    }
}

static void go_far(struct bench *b)
{
    const struct hal_drive_go go = { .pos_q32 = pos_of(START + 1000000),
                                     .vel_q32 = pos_of(SPEED),
                                     .acc_q32 = pos_of(10 * SPEED),
                                     .dec_q32 = pos_of(10 * SPEED) };

    assert_int_equal(
        hal_drive_set_mode(&b->drive[0].drive, HAL_DRIVE_PROFILE_POSITION), 0);
    ticks(b, 50);
    assert_int_equal(hal_drive_go(&b->drive[0].drive, &go), 0);
    ticks(b, 300);
    assert_in_range(servo_speed(b), SPEED * 9 / 10, SPEED * 11 / 10);
}

/* By somebody else's SDO: 0x605A = 0 coasts, 6 keeps torque. */
static void set_quick_stop(struct bench *b, uint8_t option)
{
    const struct hal_can_frame frame = {
        .id = 0x601, .len = 8, .data = { 0x2B, 0x5A, 0x60, 0, option }
    };

    sim_can_port_init(&b->other, &b->bus);
    assert_int_equal(hal_can_send(&b->other.can, &frame), 0);
    ticks(b, 3);
}

/* The set points rest in the tick in which it is to be off; the motor does not. */
static void off_in_motion_is_a_quick_stop_first(void **state)
{
    struct bench *b = *state;
    unsigned took;

    for (unsigned i = 0; i < 4; i++) {
        const bool streams = i % 2 == 0, holds = i / 2 == 0;

        bench_of(b, 1);
        enable(b);
        if (holds) /* after its ramp, until we say more */
            set_quick_stop(b, 6);
        if (streams)
            stream(b, 300);
        else
            go_far(b);
        assert_true(servo_speed(b) > SPEED / 2);
        request(b, HAL_DRIVE_REQUEST_OFF);
        assert_in_range(cut_speed(b, &took), 0,
                        holds ? REST_SPEED : OWN_REST_SPEED);
        print_message("%s%s: off after %u ms\n",
                      streams ? "streamed" : "by its profile",
                      holds ? ", holds" : "", took);
        until(b, HAL_DRIVE_OFF, 20);
    }
}

static void torque_off_is_at_once_whatever_is_asked_for_then(void **state)
{
    struct bench *b = *state;
    unsigned took;

    enable(b);
    stream(b, 300);
    request(b, HAL_DRIVE_REQUEST_TORQUE_OFF);
    request(b, HAL_DRIVE_REQUEST_OFF);
    assert_true(cut_speed(b, &took) > SPEED / 2);
    assert_in_range(took, 1, 5);
    until(b, HAL_DRIVE_OFF, 20);
    ticks(b, 300); /* it rolls out */
    enable(b);
}

/* By whoever was there before. */
static void one_that_is_found_moving_is_stopped_first(void **state)
{
    struct bench *b = *state;
    struct drive_cia402_config drive = drive_config;
    const struct hal_drive_found *found = &b->drive[0].found;
    unsigned took;

    drive.node_id = 1;
    for (int32_t option = 0; option <= 6; option += 2) {
        bench_of(b, 1);
        enable(b);
        assert_int_equal(found->count, 0);
        go_far(b);
        set_quick_stop(b, (uint8_t)option);
        assert_int_equal(canopen_init(&b->master, &b->port.can, &master_config),
                         0);
        assert_int_equal(drive_cia402_init(&b->drive[0], &b->master, &drive),
                         0);
        assert_in_range(cut_speed(b, &took), 0, OWN_REST_SPEED);
        print_message("0x605A = %d: found at %.3f units/s, off after %u ms\n",
                      (int)option, (double)found->vel_q32 / (double)ONE, took);
        assert_int_equal(found->count, 1);
        assert_false(found->goes_on);
        assert_in_range(counts_of(found->vel_q32), SPEED * 8 / 10,
                        SPEED * 12 / 10);
        until(b, HAL_DRIVE_OFF, 500);
        enable(b);
        assert_int_equal(found->count, 1);
    }
}

#define BENCH(test) cmocka_unit_test_setup(test, bench_setup)

int main(void)
{
    const struct CMUnitTest tests[] = {
        BENCH(power_up_ends_enabled_without_a_jump),
        cmocka_unit_test(four_axes_follow_a_ramp_on_one_bus),
        BENCH(quick_stop_ramps_down_and_ends_off),
        BENCH(a_drive_fault_latches_and_resets),
        BENCH(a_blocked_rotor_is_a_following_error),
        BENCH(a_power_cycle_is_noticed_and_never_enables),
        BENCH(a_silent_drive_is_offline_and_comes_back_by_reset),
        BENCH(without_our_heartbeat_the_drive_stops_itself),
        BENCH(safe_torque_off_is_told_as_such),
        BENCH(a_switch_is_heard_while_enabled),
        BENCH(a_second_master_life_takes_over_safely),
        BENCH(off_in_motion_is_a_quick_stop_first),
        BENCH(torque_off_is_at_once_whatever_is_asked_for_then),
        BENCH(one_that_is_found_moving_is_stopped_first),
    };

    return cmocka_run_group_tests_name("drive_cia402_sim", tests, NULL, NULL);
}
