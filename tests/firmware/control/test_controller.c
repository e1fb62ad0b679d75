/* tests/firmware/control/test_controller.c - the controller on ideal drives:
 * every tick of every run is checked, the faults of docs/FAULTS.md one by
 * one. */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "firmware/control/controller.h"
#include "motion/core/err.h"
#include "motion/core/fixed.h"
#include "tests/support/check.h"

#define MS   INT64_C(1000000)
#define UNIT MOTION_FIXED_ONE_Q32
#define AXES 3

/* -- a drive that follows to the letter, two ticks late ------------------- */

struct fake_drive {
    struct hal_drive drive;
    enum hal_drive_state state;
    enum hal_drive_request request;
    struct hal_drive_target given[4]; /* newest first */
    uint64_t targets;
    int64_t offset_q32; /* a slipping encoder */
    int64_t vel_q32;    /* what it says that it does */
    int64_t frozen_ns;  /* feedback stops at this time; 0: it does not */
    bool limit_negative, limit_positive, refuse;
    bool awaited; /* it does not tell its code yet */
    const char *words;
    int enable_ticks;
};

static int64_t fake_now_ns;

static void fake_request(struct hal_drive *drive,
                         enum hal_drive_request request)
{
    struct fake_drive *self = (struct fake_drive *)drive;
    self->request = request;
    if ((request == HAL_DRIVE_REQUEST_OFF ||
         request == HAL_DRIVE_REQUEST_TORQUE_OFF) &&
        self->state != HAL_DRIVE_FAULT && self->state != HAL_DRIVE_OFFLINE)
        self->state = HAL_DRIVE_OFF;
    if (request == HAL_DRIVE_REQUEST_QUICK_STOP &&
        self->state == HAL_DRIVE_ENABLED)
        self->state = HAL_DRIVE_QUICK_STOP;
    if (request == HAL_DRIVE_REQUEST_RESET && self->state == HAL_DRIVE_FAULT)
        self->state = HAL_DRIVE_OFF;
}

static int fake_set_target(struct hal_drive *drive,
                           const struct hal_drive_target *target)
{
    struct fake_drive *self = (struct fake_drive *)drive;
    if (self->refuse)
        return MOTION_E_RANGE;
    if (self->state != HAL_DRIVE_ENABLED)
        return MOTION_OK; /* without torque it stays where it is */
    memmove(&self->given[1], &self->given[0], 3 * sizeof self->given[0]);
    self->given[0] = *target;
    self->targets++;
    return MOTION_OK;
}

static void fake_feedback(struct hal_drive *drive,
                          struct hal_drive_feedback *feedback)
{
    struct fake_drive *self = (struct fake_drive *)drive;
    if (self->request == HAL_DRIVE_REQUEST_ENABLE &&
        self->state == HAL_DRIVE_OFF && --self->enable_ticks <= 0)
        self->state = HAL_DRIVE_ENABLED;
    *feedback = (struct hal_drive_feedback){
        .state = self->state,
        .pos_q32 = self->given[2].pos_q32 + self->offset_q32,
        .vel_q32 = self->vel_q32,
        .t_ns = self->frozen_ns ? self->frozen_ns : fake_now_ns - MS,
        .demand_age_ns = 2 * MS,
        .limit_negative = self->limit_negative,
        .limit_positive = self->limit_positive,
        .following = true,
        .fault_code =
            self->state == HAL_DRIVE_FAULT && !self->awaited ? 0x2310 : 0,
        .fault_code_awaited = self->state == HAL_DRIVE_FAULT && self->awaited,
    };
    snprintf(feedback->fault_text, sizeof feedback->fault_text, "%s",
             self->words != NULL ? self->words : "");
}

static const struct hal_drive_ops fake_ops = {
    .request = fake_request,
    .set_target = fake_set_target,
    .feedback = fake_feedback,
};

struct fake_line {
    struct hal_gpio gpio;
    int level;
};

static int fake_line_get(struct hal_gpio *gpio)
{
    return ((struct fake_line *)gpio)->level;
}

static const struct hal_gpio_ops fake_line_ops = { .get = fake_line_get };

/* -- a bench: three axes on three curves of different lengths ------------- */

struct bench {
    struct controller controller;
    struct controller_axis_config config[AXES];
    struct controller_axis axis[AXES];
    struct fake_drive drive[AXES];
    struct fake_line estop, limit[2]; /* of axis 1 */
    struct motion_segment storage[AXES][16];
    struct motion_track track[AXES];
    const struct motion_track *tracks[AXES];
    struct hal_fieldbus_worst bus; /* what the fieldbuses say */
};

static struct motion_state bench_key(int64_t pos, int64_t vel)
{
    return (struct motion_state){ pos * UNIT, vel * UNIT, 0, 0 };
}

static void bench_tracks(struct bench *bench)
{
    static const struct {
        int ms, pos, vel;
    } key[AXES][4] = {
        { { 1500, 80, 50 },
          { 900, 140, 60 },
          { 700, 170, 0 },
          { 1200, 120, 0 } },
        { { 700, -20, 0 }, { 800, 30, 20 }, { 1300, 60, 30 }, { 1100, 80, 0 } },
        { { 400, 2, 3 }, { 1000, 4, 0 }, { 500, 4, 0 }, { 800, 0, 0 } },
    };
    for (int i = 0; i < AXES; i++) {
        motion_track_init(&bench->track[i], bench->storage[i], 16, 0);
        struct motion_state from = bench_key(0, 0);
        for (int k = 0; k < 4; k++) {
            const struct motion_state to =
                bench_key(key[i][k].pos, key[i][k].vel);
            assert_int_equal(motion_track_append_quintic(
                                 &bench->track[i],
                                 key[i][k].ms * MS * MOTION_FIXED_NS_Q12, &from,
                                 &to),
                             MOTION_OK);
            from = to;
        }
        bench->tracks[i] = &bench->track[i];
    }
}

/* Limits a little (percent) above what the tracks use. */
static void bench_limits(struct bench *bench, int percent)
{
    for (int i = 0; i < AXES; i++) {
        struct motion_extreme v, a, j;
        motion_track_extreme(&bench->track[i], MOTION_VEL, &v);
        motion_track_extreme(&bench->track[i], MOTION_ACC, &a);
        motion_track_extreme(&bench->track[i], MOTION_JERK, &j);
#define PEAK(e) (-(e).min > (e).max ? -(e).min : (e).max)
        const struct motion_clock_limit limit = { PEAK(v) / 100 * percent,
                                                  PEAK(a) / 100 * percent,
                                                  PEAK(j) / 100 * percent };
        bench->config[i] = (struct controller_axis_config){
            .pos_min_q32 = -300 * UNIT,
            .pos_max_q32 = 300 * UNIT,
            .limit = limit,
            .stop = { limit.vel_q32, 2 * limit.acc_q32, 4 * limit.jerk_q32 },
            .following_floor_q32 = UNIT / 2,
            .following_k_ns = 5 * MS,
        };
    }
}

static void bench_init(struct bench *bench, int percent)
{
    memset(bench, 0, sizeof *bench);
    bench_tracks(bench);
    const struct controller_config config = { .period_ns = MS,
                                              .axis_count = AXES,
                                              .axis = bench->config };
    bench_limits(bench, percent);
    struct hal_drive *drives[AXES];
    for (int i = 0; i < AXES; i++) {
        bench->drive[i] = (struct fake_drive){ .drive.ops = &fake_ops,
                                               .state = HAL_DRIVE_OFF,
                                               .enable_ticks = 5 * (i + 1) };
        drives[i] = &bench->drive[i].drive;
    }
    bench->estop.gpio.ops = &fake_line_ops;
    fake_now_ns = 1000 * MS;
    for (int i = 0; i < 2; i++)
        bench->limit[i].gpio.ops = &fake_line_ops;
    const struct controller_switches switches[AXES] = {
        [1] = { .limit_negative = &bench->limit[0].gpio,
                .limit_positive = &bench->limit[1].gpio },
    };
    const struct controller_inputs inputs = { .estop = { &bench->estop.gpio },
                                              .axis = switches };
    assert_int_equal(controller_init(&bench->controller, &config, bench->axis,
                                     drives, &inputs),
                     MOTION_OK);
}

static void bench_tick(struct bench *bench)
{
    fake_now_ns += MS;
    controller_step(&bench->controller, fake_now_ns, bench->bus);
}

static void bench_ticks(struct bench *bench, int ticks)
{
    while (ticks-- > 0)
        bench_tick(bench);
}

static void bench_ready(struct bench *bench, int percent)
{
    bench_init(bench, percent);
    bench_tick(bench);
    assert_int_equal(controller_enable(&bench->controller), MOTION_OK);
    bench_ticks(bench, 40);
    assert_int_equal(bench->controller.state, CONTROLLER_READY);
}

static void bench_moving(struct bench *bench, int percent, int ticks)
{
    bench_ready(bench, percent);
    assert_int_equal(controller_start(&bench->controller, bench->tracks, NULL),
                     MOTION_OK);
    bench_ticks(bench, ticks);
    assert_int_equal(bench->controller.state, CONTROLLER_MOVING);
}

/* -- an outside judge of every tick ---------------------------------------- */

struct judge {
    int64_t sent[AXES][4];
    int count;
};

static void judge_limit(const char *what, int axis, long double value,
                        int64_t limit, long double scale, long double slack)
{
    const long double most = (long double)limit / scale;
    if (fabsl(value) > most + slack)
        fail_msg("axis %d: %s %Lg over %Lg", axis, what, value, most);
}

/* Differences of the set points that the drives got, in long double; the
 * slack is the rounding of positions to 2^-32 (2 units, weights 2, 4, 8). */
static void judge_differences(struct judge *judge, const struct bench *bench)
{
    const long double t = 1e-3L, step = 2.0L / UNIT;
    for (int i = 0; i < AXES; i++) {
        int64_t *p = judge->sent[i];
        memmove(p + 1, p, 3 * sizeof *p);
        p[0] = bench->drive[i].given[0].pos_q32;
        const struct motion_clock_limit *limit =
            &bench->controller.config.axis[i].limit;
        if (judge->count < 4)
            continue;
        const long double d[4] = { (long double)p[0] / UNIT,
                                   (long double)p[1] / UNIT,
                                   (long double)p[2] / UNIT,
                                   (long double)p[3] / UNIT };
        judge_limit("speed", i, (d[0] - d[1]) / t, limit->vel_q32, UNIT,
                    2 * step / t);
        judge_limit("acceleration", i, (d[0] - 2 * d[1] + d[2]) / (t * t),
                    limit->acc_q32, 0x1p32, 4 * step / (t * t));
        judge_limit("jerk", i,
                    (d[0] - 3 * d[1] + 3 * d[2] - d[3]) / (t * t * t),
                    limit->jerk_q32, 0x1p32, 8 * step / (t * t * t));
    }
    judge->count++;
}

/* Every axis is on its own track at the one path time, to the bit. */
static void judge_path(const struct bench *bench)
{
    for (int i = 0; i < AXES; i++) {
        struct motion_sample sample;
        struct motion_cursor cursor = { 0 };
        motion_track_sample(&bench->track[i], &cursor,
                            bench->controller.rate.s_ns_q12, &sample);
        assert_int_equal(bench->drive[i].given[0].pos_q32, sample.pos_q32);
    }
}

static void judge_end(const struct bench *bench)
{
    assert_int_equal(bench->controller.state, CONTROLLER_READY);
    for (int i = 0; i < AXES; i++)
        assert_int_equal(bench->drive[i].given[0].pos_q32,
                         bench->track[i].end.pos_q32);
}

static void run_to_the_end(struct bench *bench, struct judge *judge)
{
    for (int n = 0; bench->controller.state != CONTROLLER_READY; n++) {
        assert_true(n < 60000);
        bench_tick(bench);
        if (bench->controller.fault.fault)
            fail_msg("fault: %s",
                     controller_fault_text(bench->controller.fault.fault));
        if (bench->controller.state == CONTROLLER_MOVING ||
            bench->controller.state == CONTROLLER_HOLDING)
            judge_path(bench);
        judge_differences(judge, bench);
    }
    judge_end(bench);
}

/* -- the tests ------------------------------------------------------------ */

static void a_move_is_its_tracks_tick_by_tick(void **state)
{
    (void)state;
    struct bench bench;
    struct judge judge = { 0 };
    bench_ready(&bench, 101);
    assert_int_equal(controller_start(&bench.controller, bench.tracks, NULL),
                     MOTION_OK);
    const int64_t start_ns = fake_now_ns;
    for (int n = 1; n <= 4300; n++) {
        bench_tick(&bench);
        assert_int_equal(bench.controller.rate.s_ns_q12,
                         (fake_now_ns - start_ns) * MOTION_FIXED_NS_Q12);
        judge_path(&bench);
        judge_differences(&judge, &bench);
        if (n > 5)
            assert_int_equal(bench.controller.axis[0].following_q32, 0);
    }
    judge_end(&bench);
    assert_int_equal(bench.controller.fault.fault, CONTROLLER_FAULT_NONE);
}

static void
hold_and_resume_at_200_random_times_keep_path_and_limits(void **state)
{
    (void)state;
    uint64_t seed = 200;
    int worst_wait = 0;
    for (int n = 0; n < 200; n++) {
        struct bench bench;
        struct judge judge = { 0 };
        const int at = (int)check_random_in(&seed, 1, 4290);
        bench_moving(&bench, 110, at);
        assert_int_equal(controller_hold(&bench.controller), MOTION_OK);
        int waited = 0;
        while (bench.controller.state == CONTROLLER_HOLDING &&
               bench.controller.rate.rate_q30 != 0 && waited < 10000) {
            bench_tick(&bench);
            judge_path(&bench);
            judge_differences(&judge, &bench);
            waited++;
        }
        worst_wait = waited > worst_wait ? waited : worst_wait;
        if (bench.controller.state == CONTROLLER_READY)
            continue; /* held so late that the move ended first */
        for (int i = 0; i < 50; i++) {
            bench_tick(&bench);
            judge_differences(&judge, &bench);
            assert_int_equal(bench.controller.rate.rate_q30, 0);
        }
        assert_int_equal(controller_resume(&bench.controller), MOTION_OK);
        run_to_the_end(&bench, &judge);
    }
    print_message("longest way to standstill: %d ms\n", worst_wait);
    assert_true(worst_wait < 2500);
}

static void orders_given_in_the_middle_of_a_ramp_keep_the_limits(void **state)
{
    (void)state;
    uint64_t seed = 77;
    for (int n = 0; n < 60; n++) {
        struct bench bench;
        struct judge judge = { 0 };
        bench_moving(&bench, 130, (int)check_random_in(&seed, 1, 1500));
        for (int k = 0; k < 6; k++) {
            const int64_t ticks = check_random_in(&seed, 1, 300);
            for (int64_t i = 0;
                 i < ticks && bench.controller.state != CONTROLLER_READY; i++) {
                bench_tick(&bench);
                judge_differences(&judge, &bench);
            }
            if (bench.controller.state == CONTROLLER_MOVING && k % 3 == 0)
                controller_override(
                    &bench.controller,
                    check_random_in(&seed, 1 << 28,
                                    bench.controller.override_max_q30));
            else if (bench.controller.state == CONTROLLER_MOVING)
                controller_hold(&bench.controller);
            else
                controller_resume(&bench.controller);
        }
        if (bench.controller.state == CONTROLLER_HOLDING)
            controller_resume(&bench.controller);
        run_to_the_end(&bench, &judge);
    }
}

static void override_beyond_the_limits_is_refused(void **state)
{
    (void)state;
    struct bench bench;
    bench_moving(&bench, 133, 100);
    /* 1.33 in jerk: its cube root is 1.0997 */
    const int64_t most = bench.controller.override_max_q30;
    assert_true(most > MOTION_CLOCK_WARP_ONE_Q30 * 109 / 100);
    assert_true(most < MOTION_CLOCK_WARP_ONE_Q30 * 111 / 100);
    assert_int_equal(controller_override(&bench.controller, most + 1),
                     MOTION_E_LIMIT);
    assert_int_equal(controller_override(&bench.controller, most), MOTION_OK);
    assert_int_equal(controller_override(&bench.controller, -1), MOTION_E_ARG);
    struct judge judge = { 0 };
    run_to_the_end(&bench, &judge);
}

static void stop_ends_ready_on_the_path_and_keeps_torque(void **state)
{
    (void)state;
    struct bench bench;
    struct judge judge = { 0 };
    bench_moving(&bench, 120, 1200);
    controller_stop(&bench.controller);
    for (int n = 0; bench.controller.state == CONTROLLER_STOPPING; n++) {
        assert_true(n < 3000);
        bench_tick(&bench);
        judge_path(&bench);
        judge_differences(&judge, &bench);
    }
    assert_int_equal(bench.controller.state, CONTROLLER_READY);
    assert_int_equal(bench.drive[0].state, HAL_DRIVE_ENABLED);
    assert_int_equal(controller_resume(&bench.controller), MOTION_E_STATE);
    /* away from the start of the move: it cannot be started from here */
    int axis = -1;
    assert_int_equal(controller_start(&bench.controller, bench.tracks, &axis),
                     MOTION_E_AWAY);
    assert_int_equal(axis, 0);
}

static void commands_out_of_place_are_refused_and_change_nothing(void **state)
{
    (void)state;
    struct bench bench;
    bench_init(&bench, 101);
    bench_tick(&bench);
    struct controller *c = &bench.controller;
    assert_int_equal(controller_start(c, bench.tracks, NULL), MOTION_E_STATE);
    assert_int_equal(controller_hold(c), MOTION_E_STATE);
    assert_int_equal(controller_resume(c), MOTION_E_STATE);
    assert_int_equal(controller_reset(c), MOTION_E_STATE);
    assert_int_equal(c->state, CONTROLLER_OFF);
    controller_enable(c);
    assert_int_equal(controller_enable(c), MOTION_E_STATE);
    controller_stop(c); /* nothing is to come up any more */
    bench_ticks(&bench, 40);
    assert_int_equal(c->state, CONTROLLER_OFF);
    controller_enable(c);
    bench_ticks(&bench, 40);
    assert_int_equal(controller_enable(c), MOTION_E_STATE);
    assert_int_equal(controller_off(c), MOTION_OK);
    bench_ticks(&bench, 2);
    assert_int_equal(bench.drive[0].state, HAL_DRIVE_OFF);
}

/* Each fault: how it is caused, and what must be latched. */
static void cause_drive_fault(struct bench *bench)
{
    bench->drive[1].state = HAL_DRIVE_FAULT;
}
static void cause_offline(struct bench *bench)
{
    bench->drive[1].state = HAL_DRIVE_OFFLINE;
}
static void cause_state(struct bench *bench)
{
    bench->drive[1].state = HAL_DRIVE_OFF;
    bench->drive[1].enable_ticks = 1 << 30;
}
static void cause_stale(struct bench *bench)
{
    bench->drive[1].frozen_ns = fake_now_ns;
}
static void cause_following(struct bench *bench)
{
    bench->drive[1].offset_q32 = 5 * UNIT;
}
static void cause_estop(struct bench *bench)
{
    bench->estop.level = 1;
}
static void cause_estop_broken(struct bench *bench)
{
    bench->estop.level = MOTION_E_IO;
}
static void cause_limit_switches(struct bench *bench)
{
    bench->drive[1].limit_negative = bench->drive[1].limit_positive = true;
}
static void cause_limit_lines(struct bench *bench)
{
    bench->limit[0].level = bench->limit[1].level = 1;
}
static void cause_limit_lines_broken(struct bench *bench)
{
    bench->limit[0].level = bench->limit[1].level = MOTION_E_IO;
}
static void cause_guardian(struct bench *bench)
{
    controller_trip(&bench->controller, CONTROLLER_FAULT_GUARDIAN);
}

static void cause_counter(struct bench *bench)
{
    bench->drive[1].refuse = true;
}

static const struct {
    const char *name;
    void (*cause)(struct bench *bench);
    enum controller_fault fault;
    int axis, bound_ticks;
    enum controller_reaction reaction;
} fault_rows[] = {
    { "drive fault", cause_drive_fault, CONTROLLER_FAULT_DRIVE, 1, 1,
      CONTROLLER_REACT_STOP },
    { "drive gone", cause_offline, CONTROLLER_FAULT_OFFLINE, 1, 1,
      CONTROLLER_REACT_STOP },
    { "drive let go", cause_state, CONTROLLER_FAULT_STATE, 1, 1,
      CONTROLLER_REACT_STOP },
    { "stale", cause_stale, CONTROLLER_FAULT_STALE, 1, 5,
      CONTROLLER_REACT_STOP },
    { "following", cause_following, CONTROLLER_FAULT_FOLLOWING, 1, 1,
      CONTROLLER_REACT_STOP },
    { "e-stop", cause_estop, CONTROLLER_FAULT_ESTOP, -1, 1,
      CONTROLLER_REACT_STOP },
    { "e-stop wire", cause_estop_broken, CONTROLLER_FAULT_INPUT, -1, 1,
      CONTROLLER_REACT_STOP },
    { "both switches", cause_limit_switches, CONTROLLER_FAULT_LIMIT_SWITCH, 1,
      1, CONTROLLER_REACT_STOP },
    { "both limit lines", cause_limit_lines, CONTROLLER_FAULT_LIMIT_SWITCH, 1,
      1, CONTROLLER_REACT_STOP },
    { "limit lines gone", cause_limit_lines_broken, CONTROLLER_FAULT_INPUT, 1,
      1, CONTROLLER_REACT_STOP },
    { "the guardian", cause_guardian, CONTROLLER_FAULT_GUARDIAN, -1, 1,
      CONTROLLER_REACT_STOP },
    { "counter", cause_counter, CONTROLLER_FAULT_COUNTER, 1, 1,
      CONTROLLER_REACT_QUICK },
};

static void cure(struct bench *bench)
{
    for (int i = 0; i < AXES; i++) {
        struct fake_drive *drive = &bench->drive[i];
        drive->offset_q32 = 0;
        drive->frozen_ns = 0;
        drive->limit_negative = drive->limit_positive = false;
        drive->refuse = false;
        drive->enable_ticks = 5;
        if (drive->state == HAL_DRIVE_OFFLINE)
            drive->state = HAL_DRIVE_FAULT;
    }
    bench->estop.level = 0;
    bench->limit[0].level = bench->limit[1].level = 0;
}

static void fault_in_motion(size_t row, int at)
{
    struct bench bench;
    bench_moving(&bench, 120, at);
    struct controller *c = &bench.controller;
    fault_rows[row].cause(&bench);
    bench_ticks(&bench, fault_rows[row].bound_ticks);
    if (c->fault.fault != fault_rows[row].fault ||
        c->fault.axis != fault_rows[row].axis)
        fail_msg("%s at %d: latched '%s' axis %d", fault_rows[row].name, at,
                 controller_fault_text(c->fault.fault), c->fault.axis);
    assert_int_equal(c->reaction, fault_rows[row].reaction);
    assert_int_equal(c->state, CONTROLLER_STOPPING);
    bench_ticks(&bench, 3000);
    assert_int_equal(c->state, CONTROLLER_FAULT);
    assert_int_equal(bench.drive[0].state, HAL_DRIVE_OFF);
    /* nothing starts by itself, and nothing starts when told to */
    const struct controller_fault_record first = c->fault;
    cure(&bench);
    bench_ticks(&bench, 500);
    assert_int_equal(c->state, CONTROLLER_FAULT);
    assert_memory_equal(&c->fault, &first, sizeof first);
    assert_int_equal(controller_enable(c), MOTION_E_STATE);
    assert_int_equal(controller_start(c, bench.tracks, NULL), MOTION_E_STATE);
    assert_int_equal(controller_reset(c), MOTION_OK);
    bench_ticks(&bench, 5);
    assert_int_equal(c->state, CONTROLLER_OFF);
    bench_ticks(&bench, 500);
    assert_int_equal(c->state, CONTROLLER_OFF);
    assert_int_equal(bench.drive[0].state, HAL_DRIVE_OFF);
    assert_int_equal(controller_enable(c), MOTION_OK);
    bench_ticks(&bench, 40);
    assert_int_equal(c->state, CONTROLLER_READY);
}

static void every_fault_latches_and_nothing_restarts(void **state)
{
    (void)state;
    static const int at[] = { 20, 400, 1000, 1500, 2200, 3600 };
    for (size_t row = 0; row < ARRAY_LEN(fault_rows); row++)
        for (size_t i = 0; i < ARRAY_LEN(at); i++)
            fault_in_motion(row, at[i]);
}

/* Move, until drive 1 is in fault and has not told why yet. */
static void bench_in_fault(struct bench *bench)
{
    bench_moving(bench, 120, 1200);
    bench->drive[1].state = HAL_DRIVE_FAULT;
    bench->drive[1].awaited = true;
    bench->drive[1].words = "drive fault";
    bench_tick(bench);
}

/* The drive tells why a while after its fault, or not at all; what it says later
 * is of something else. */
static void the_reason_of_a_drive_completes_the_record(void **state)
{
    (void)state;
    for (int after = 0; after < 1300; after += 100) {
        struct bench bench;
        const struct controller_fault_record *fault = &bench.controller.fault;
        bench_in_fault(&bench);
        const int64_t seen_ns = fault->t_ns;
        for (int n = 0; n < after; n++) {
            assert_false(fault->is_whole && n < 999);
            bench_tick(&bench);
        }
        assert_string_equal(fault->reason, "drive fault");
        assert_int_equal(fault->is_whole, after >= 1000);
        bench.drive[1].awaited = false;
        bench.drive[1].words = "drive fault 0x2310";
        bench_tick(&bench);
        bench.drive[1].words = "left";
        bench_tick(&bench);
        assert_true(fault->is_whole);
        assert_int_equal(fault->fault, CONTROLLER_FAULT_DRIVE);
        assert_int_equal(fault->t_ns, seen_ns);
        assert_int_equal(fault->drive_code, after >= 1000 ? 0 : 0x2310);
        assert_string_equal(fault->reason, after >= 1000
                                               ? "drive fault"
                                               : "drive fault 0x2310");
    }
}

/* Lost before it has answered: that is not why. */
static void a_drive_that_is_lost_completes_no_record(void **state)
{
    (void)state;
    struct bench bench;
    const struct controller_fault_record *fault = &bench.controller.fault;
    bench_in_fault(&bench);
    bench.drive[1].state = HAL_DRIVE_OFFLINE;
    bench.drive[1].words = "no heartbeat for three periods";
    bench_tick(&bench);
    assert_string_equal(fault->reason, "drive fault");
    assert_true(fault->is_whole);
}

static void a_fault_stops_the_group_along_the_path(void **state)
{
    (void)state;
    struct bench bench;
    bench_moving(&bench, 120, 1200);
    cause_estop(&bench);
    for (int n = 0; bench.controller.state != CONTROLLER_FAULT; n++) {
        assert_true(n < 1500);
        bench_tick(&bench);
        if (bench.controller.state == CONTROLLER_STOPPING)
            judge_path(&bench);
    }
}

/* Its loop drives it away from where it is told to be; or it stands; or it goes
 * on ahead of its set points, no faster than it was, as one that is slow to
 * brake. */
enum follows {
    RUNS_AGAINST,
    RUNS_TOO_FAST,
    RUNS_AHEAD,
    STANDS,
    BRAKES_TOO_LATE,
    FOLLOWS
};

static void follow_badly(struct fake_drive *drive, enum follows how)
{
    const int64_t told_q32 = drive->given[2].vel_q32;
    static const struct {
        int64_t beside, vel; /* of what it is told, in halves */
    } row[FOLLOWS] = { { -4, -2 }, { 4, 4 }, { 2, 2 }, { -2, 0 }, { 2, 1 } };
    drive->offset_q32 += told_q32 / 2000 * row[how].beside;
    if (how == RUNS_AHEAD) /* of what it is told, and faster and faster */
        drive->vel_q32 =
            (drive->vel_q32 > told_q32 ? drive->vel_q32 : told_q32) +
            told_q32 / 50;
    else
        drive->vel_q32 = told_q32 / 2 * row[how].vel;
}

/* The following error is a stop along the path; in the third tick of running
 * away torque is gone. */
static void an_axis_that_runs_away_has_no_torque_in_three_ticks(void **state)
{
    static struct bench bench;
    struct controller *c = &bench.controller;
    (void)state;
    for (enum follows how = RUNS_AGAINST; how < FOLLOWS; how++) {
        bench_moving(&bench, 110, 1000);
        bench.config[0].limit.vel_q32 = bench.drive[0].given[2].vel_q32;
        int ticks = 0;
        while (c->fault.fault == CONTROLLER_FAULT_NONE && ticks++ < 200) {
            follow_badly(&bench.drive[0], how);
            bench_tick(&bench);
        }
        assert_int_equal(c->fault.fault, CONTROLLER_FAULT_FOLLOWING);
        assert_int_equal(c->reaction, CONTROLLER_REACT_STOP);
        for (int n = 0; n < 2; n++) {
            assert_int_not_equal(c->reaction, CONTROLLER_REACT_OFF);
            follow_badly(&bench.drive[0], how);
            bench_tick(&bench);
        }
        const bool is_off = how < STANDS;
        assert_int_equal(c->reaction,
                         is_off ? CONTROLLER_REACT_OFF : CONTROLLER_REACT_STOP);
        for (unsigned i = 0; i < AXES; i++)
            assert_int_equal(bench.drive[i].request,
                             is_off ? HAL_DRIVE_REQUEST_TORQUE_OFF
                                    : HAL_DRIVE_REQUEST_ENABLE);
        assert_int_equal(c->fault.fault, CONTROLLER_FAULT_FOLLOWING);
    }
}

static void a_second_fault_is_not_recorded_and_does_not_soften(void **state)
{
    (void)state;
    struct bench bench;
    bench_moving(&bench, 120, 1000);
    cause_counter(&bench);
    bench_tick(&bench);
    assert_int_equal(bench.controller.reaction, CONTROLLER_REACT_QUICK);
    cause_estop(&bench);
    bench_ticks(&bench, 3);
    assert_int_equal(bench.controller.fault.fault, CONTROLLER_FAULT_COUNTER);
    assert_int_equal(bench.controller.reaction, CONTROLLER_REACT_QUICK);
}

static void a_bus_that_is_gone_is_off_at_once(void **state)
{
    (void)state;
    struct bench bench;
    bench_moving(&bench, 120, 1000);
    fake_now_ns += MS;
    bench.bus = (struct hal_fieldbus_worst){ HAL_FIELDBUS_BUS_OFF, 3 };
    controller_step(&bench.controller, fake_now_ns, bench.bus);
    assert_int_equal(bench.controller.fault.fault, CONTROLLER_FAULT_BUS);
    assert_int_equal(bench.controller.state, CONTROLLER_FAULT);
    /* the record keeps which bus it was, and what it said */
    fake_now_ns += MS;
    bench.bus = (struct hal_fieldbus_worst){ HAL_FIELDBUS_DOWN, 1 };
    controller_step(&bench.controller, fake_now_ns, bench.bus);
    assert_int_equal(bench.controller.fault.bus.health, HAL_FIELDBUS_BUS_OFF);
    assert_int_equal(bench.controller.fault.bus.bus, 3);
    assert_int_equal(bench.controller.bus.bus, 1);
}

/* At once, and then off. */
static void check_bus_stops(enum hal_fieldbus_health health,
                            enum controller_fault fault)
{
    struct bench bench;
    bench_moving(&bench, 120, 1000);
    bench.bus.health = health;
    for (int n = 0; bench.controller.state != CONTROLLER_FAULT; n++) {
        assert_true(n < 1500);
        bench_tick(&bench);
        assert_int_equal(bench.controller.fault.fault, fault);
        if (bench.controller.state != CONTROLLER_FAULT)
            assert_int_equal(bench.controller.state, CONTROLLER_STOPPING);
        judge_path(&bench);
    }
    bench_tick(&bench);
    for (int a = 0; a < AXES; a++)
        assert_int_equal(bench.drive[a].state, HAL_DRIVE_OFF);
}

static void another_master_stops_the_group_along_the_path(void **state)
{
    (void)state;
    check_bus_stops(HAL_FIELDBUS_FOREIGN, CONTROLLER_FAULT_MASTER);
}

static void a_bus_that_takes_no_frames_stops_the_group_along_the_path(void **s)
{
    (void)s;
    check_bus_stops(HAL_FIELDBUS_FULL, CONTROLLER_FAULT_BUS_FULL);
}

/* Runs a bench whose bus has become error-passive until it stands. */
static void bench_passive(struct bench *bench, int at)
{
    bench_moving(bench, 120, at);
    const int64_t since_ns = fake_now_ns;
    bench->bus.health = HAL_FIELDBUS_PASSIVE;
    for (int n = 0; bench->controller.state != CONTROLLER_FAULT; n++) {
        assert_true(n < 1500);
        bench_tick(bench);
        if (bench->controller.state == CONTROLLER_STOPPING)
            judge_path(bench);
    }
    assert_int_equal(bench->controller.fault.fault,
                     CONTROLLER_FAULT_BUS_PASSIVE);
    assert_true(bench->controller.fault.t_ns - since_ns <= 2 * MS);
}

static void
an_error_passive_bus_holds_with_torque_and_starts_nothing(void **state)
{
    (void)state;
    struct bench bench;
    bench_passive(&bench, 1000);
    struct controller *c = &bench.controller;
    const int64_t stood_q32 = bench.drive[0].given[0].pos_q32;
    bench_ticks(&bench, 200);
    for (int i = 0; i < AXES; i++)
        assert_int_equal(bench.drive[i].state, HAL_DRIVE_ENABLED);
    assert_int_equal(bench.drive[0].given[0].pos_q32, stood_q32);
    assert_int_equal(controller_start(c, bench.tracks, NULL), MOTION_E_STATE);
    bench.bus.health = HAL_FIELDBUS_GOOD;
    bench_ticks(&bench, 200);
    assert_int_equal(c->state, CONTROLLER_FAULT);
    assert_int_equal(controller_reset(c), MOTION_OK);
    bench_ticks(&bench, 5);
    assert_int_equal(c->state, CONTROLLER_OFF);
    assert_int_equal(c->fault.fault, CONTROLLER_FAULT_NONE);
    assert_int_equal(bench.drive[0].state, HAL_DRIVE_OFF);
}

static void a_second_fault_while_held_takes_the_torque(void **state)
{
    (void)state;
    static const enum hal_fieldbus_health worse[] = { HAL_FIELDBUS_DOWN,
                                                      HAL_FIELDBUS_FOREIGN };
    for (size_t i = 0; i < ARRAY_LEN(worse); i++) {
        struct bench bench;
        bench_passive(&bench, 1000);
        bench.bus.health = worse[i];
        bench_tick(&bench);
        assert_int_equal(bench.controller.state, CONTROLLER_FAULT);
        assert_int_equal(bench.controller.fault.fault,
                         CONTROLLER_FAULT_BUS_PASSIVE);
        for (int a = 0; a < AXES; a++)
            assert_int_equal(bench.drive[a].state, HAL_DRIVE_OFF);
    }
}

static void a_stop_during_the_hold_goes_on_along_the_path(void **state)
{
    (void)state;
    struct bench bench;
    bench_moving(&bench, 120, 1000);
    bench.bus.health = HAL_FIELDBUS_PASSIVE;
    bench_tick(&bench);
    assert_int_equal(bench.controller.state, CONTROLLER_STOPPING);
    cause_estop(&bench);
    for (int n = 0; bench.controller.state != CONTROLLER_FAULT; n++) {
        assert_true(n < 1500);
        bench_tick(&bench);
        assert_int_equal(bench.controller.reaction, CONTROLLER_REACT_STOP);
        if (bench.controller.state == CONTROLLER_STOPPING)
            judge_path(&bench);
    }
    assert_int_equal(bench.drive[0].state, HAL_DRIVE_OFF);
}

static void the_torque_of_a_hold_can_be_taken_without_a_reset(void **state)
{
    (void)state;
    struct bench bench;
    bench_passive(&bench, 1000);
    assert_int_equal(controller_off(&bench.controller), MOTION_OK);
    bench_ticks(&bench, 5);
    assert_int_equal(bench.drive[0].state, HAL_DRIVE_OFF);
    assert_int_equal(bench.controller.state, CONTROLLER_FAULT);
    assert_int_equal(controller_off(&bench.controller), MOTION_E_STATE);
}

static void reset_is_refused_while_the_estop_is_active(void **state)
{
    (void)state;
    struct bench bench;
    bench_moving(&bench, 120, 300);
    cause_estop(&bench);
    bench_ticks(&bench, 3000);
    assert_int_equal(controller_reset(&bench.controller), MOTION_E_STATE);
    assert_int_equal(bench.controller.state, CONTROLLER_FAULT);
}

/* Pressed again while the drives are reset: OFF, where it may be enabled, is not
 * reached. */
static void a_reset_ends_where_the_estop_is_pressed_again(void **state)
{
    (void)state;
    struct bench bench;
    bench_moving(&bench, 120, 300);
    cause_estop(&bench);
    bench_ticks(&bench, 3000);
    cure(&bench);
    bench_tick(&bench);
    assert_int_equal(controller_reset(&bench.controller), MOTION_OK);
    cause_estop(&bench);
    for (int n = 0; n < 20; n++) {
        bench_tick(&bench);
        assert_int_equal(bench.controller.state, CONTROLLER_FAULT);
        assert_int_equal(controller_enable(&bench.controller), MOTION_E_STATE);
    }
    cure(&bench);
    bench_tick(&bench);
    assert_int_equal(controller_reset(&bench.controller), MOTION_OK);
    bench_ticks(&bench, 5);
    assert_int_equal(bench.controller.state, CONTROLLER_OFF);
}

static void a_drive_that_does_not_enable_is_a_fault_with_its_name(void **state)
{
    (void)state;
    struct bench bench;
    bench_init(&bench, 100);
    bench.drive[2].enable_ticks = 1 << 30;
    bench_tick(&bench);
    controller_enable(&bench.controller);
    bench_ticks(&bench, 5002);
    assert_int_equal(bench.controller.fault.fault, CONTROLLER_FAULT_ENABLE);
    assert_int_equal(bench.controller.fault.axis, 2);
    assert_int_equal(bench.drive[0].state, HAL_DRIVE_OFF);
}

/* The curve is put in the place of the one that start has checked. */
static void the_gate_stops_what_planning_should_have(void **state)
{
    (void)state;
    static const struct {
        const char *name;
        int64_t pos, most;
        int ms;
    } rows[] = {
        { "too far", 290, 210, 4000 },
        { "too fast", 200, 5, 400 },
        { "too sudden", 1, 1, 20 },
    };
    for (size_t n = 0; n < ARRAY_LEN(rows); n++) {
        struct bench bench;
        bench_moving(&bench, 150, 1);
        bench.config[0].pos_max_q32 = 210 * UNIT;
        struct motion_segment storage[1];
        struct motion_track track;
        motion_track_init(&track, storage, 1, 0);
        const struct motion_state rest = bench_key(0, 0);
        const struct motion_state to = bench_key(rows[n].pos, 0);
        motion_track_append_quintic(
            &track, rows[n].ms * MS * MOTION_FIXED_NS_Q12, &rest, &to);
        bench.controller.axis[0].track = &track;
        bench_ticks(&bench, 4200);
        if (bench.controller.fault.fault != CONTROLLER_FAULT_GATE)
            fail_msg("%s: '%s'", rows[n].name,
                     controller_fault_text(bench.controller.fault.fault));
        assert_true(bench.drive[0].given[0].pos_q32 <= rows[n].most * UNIT);
    }
}

static void a_move_beyond_the_limits_is_not_started(void **state)
{
    (void)state;
    struct bench bench;
    int axis = 0;
    bench_ready(&bench, 99);
    assert_int_equal(controller_start(&bench.controller, bench.tracks, &axis),
                     MOTION_E_LIMIT);
    assert_int_equal(axis, -1);
    bench_ready(&bench, 120);
    bench.config[1].pos_max_q32 = 79 * UNIT;
    assert_int_equal(controller_start(&bench.controller, bench.tracks, NULL),
                     MOTION_E_LIMIT);
    assert_int_equal(bench.controller.state, CONTROLLER_READY);
    bench_ticks(&bench, 100);
    assert_int_equal(bench.drive[1].given[0].pos_q32, 0);
}

/* A sample may be rounded to beyond the polynomial's end. */
static void a_move_may_touch_the_border_of_its_range(void **state)
{
    (void)state;
    struct bench bench;
    struct motion_extreme pos;
    bench_ready(&bench, 120);
    motion_track_extreme(&bench.track[1], MOTION_POS, &pos);
    int64_t *const border = &bench.config[1].pos_max_q32;
    *border = pos.max - MOTION_TRACK_POS_ROUNDING - 1;
    assert_int_equal(controller_start(&bench.controller, bench.tracks, NULL),
                     MOTION_E_LIMIT);
    *border = pos.max - MOTION_TRACK_POS_ROUNDING;
    assert_int_equal(controller_start(&bench.controller, bench.tracks, NULL),
                     MOTION_OK);
    bench_ticks(&bench,
                (int)((bench.controller.move_end_ns_q12 >> 12) / MS) + 100);
    assert_int_equal(bench.controller.fault.fault, CONTROLLER_FAULT_NONE);
    assert_int_equal(bench.controller.state, CONTROLLER_READY);
}

static void every_lost_tick_is_counted_however_many(void **state)
{
    static const int64_t lost[] = { 1,   2,   9,    99,      100,
                                    101, 102, 5000, 3600000, 86400000 };
    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(lost); i++)
        for (int64_t off = -2; off <= 2; off++) {
            struct bench bench;
            bench_moving(&bench, 120, 1000);
            const uint64_t before = bench.controller.ticks;
            fake_now_ns += lost[i] * MS + off * MS / 5;
            bench_tick(&bench);
            assert_int_equal(bench.controller.ticks_lost, lost[i]);
            assert_int_equal(bench.controller.ticks - before, lost[i] + 1);
        }
}

static void lost_ticks_are_skipped(void **state)
{
    (void)state;
    struct bench bench;
    bench_moving(&bench, 120, 1000);
    const int64_t s_ns_q12 = bench.controller.rate.s_ns_q12;
    fake_now_ns += 2 * MS; /* two lost, no burst, no gate trip */
    bench_tick(&bench);
    assert_int_equal(bench.controller.ticks_lost, 2);
    assert_int_equal(bench.controller.fault.fault, CONTROLLER_FAULT_NONE);
    /* the path goes on from where it was left */
    assert_int_equal(bench.controller.rate.s_ns_q12 - s_ns_q12, MS << 12);
    judge_path(&bench);
}

/* So many ticks are lost after each of `executed`, for 1000 of these. */
static void lose_ticks(struct bench *bench, int executed, int lost)
{
    for (int n = 0; n < 1000; n++) {
        if (n % executed == 0)
            fake_now_ns += lost * MS;
        bench_tick(bench);
    }
}

static void ten_lost_in_a_row_or_one_in_ten_stop(void **state)
{
    static const struct {
        int executed, lost;
        bool is_stop;
    } rows[] = {
        { 300, 9, false },
        { 300, 10, true },
        { 11, 1, false },
        { 8, 1, true },
    };
    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(rows); i++)
        for (int enabling = 0; enabling < 2; enabling++) {
            struct bench bench;
            if (enabling) {
                bench_init(&bench, 120);
                bench.drive[2].enable_ticks = 4000;
                bench_tick(&bench);
                assert_int_equal(controller_enable(&bench.controller),
                                 MOTION_OK);
            } else {
                bench_moving(&bench, 120, 300);
            }
            lose_ticks(&bench, rows[i].executed, rows[i].lost);
            assert_int_equal(bench.controller.fault.fault,
                             rows[i].is_stop ? CONTROLLER_FAULT_OVERRUN
                                             : CONTROLLER_FAULT_NONE);
            if (rows[i].is_stop && !enabling)
                assert_int_equal(bench.controller.reaction,
                                 CONTROLLER_REACT_STOP);
            bench_ticks(&bench, 3000);
            assert_true(!rows[i].is_stop ||
                        bench.drive[0].state == HAL_DRIVE_OFF);
        }
}

static void bad_configurations_are_refused(void **state)
{
    (void)state;
    struct bench bench;
    bench_init(&bench, 100);
    struct hal_drive *drives[AXES] = { &bench.drive[0].drive,
                                       &bench.drive[1].drive,
                                       &bench.drive[2].drive };
    const struct controller_config good = bench.controller.config;
    struct controller_config bad[8];
    struct controller_axis_config axis[ARRAY_LEN(bad)][AXES];
    for (size_t i = 0; i < ARRAY_LEN(bad); i++) {
        memcpy(axis[i], bench.config, sizeof axis[i]);
        bad[i] = good;
        bad[i].axis = axis[i];
    }
    bad[0].period_ns = 0;
    bad[1].axis_count = 0;
    bad[2].axis_count = CONTROLLER_AXES_MAX + 1;
    axis[3][1].limit.vel_q32 = 0;
    axis[4][2].pos_min_q32 = axis[4][2].pos_max_q32;
    axis[5][0].stop.acc_q32 = -1;
    axis[6][0].pos_min_q32 = INT64_MIN + MOTION_TRACK_POS_ROUNDING - 1;
    axis[7][0].pos_max_q32 = INT64_MAX - MOTION_TRACK_POS_ROUNDING + 1;
    for (size_t i = 0; i < ARRAY_LEN(bad); i++)
        assert_int_equal(controller_init(&bench.controller, &bad[i], bench.axis,
                                         drives, NULL),
                         MOTION_E_ARG);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_move_is_its_tracks_tick_by_tick),
        cmocka_unit_test(
            hold_and_resume_at_200_random_times_keep_path_and_limits),
        cmocka_unit_test(orders_given_in_the_middle_of_a_ramp_keep_the_limits),
        cmocka_unit_test(override_beyond_the_limits_is_refused),
        cmocka_unit_test(stop_ends_ready_on_the_path_and_keeps_torque),
        cmocka_unit_test(commands_out_of_place_are_refused_and_change_nothing),
        cmocka_unit_test(every_fault_latches_and_nothing_restarts),
        cmocka_unit_test(the_reason_of_a_drive_completes_the_record),
        cmocka_unit_test(a_drive_that_is_lost_completes_no_record),
        cmocka_unit_test(a_fault_stops_the_group_along_the_path),
        cmocka_unit_test(a_second_fault_is_not_recorded_and_does_not_soften),
        cmocka_unit_test(an_axis_that_runs_away_has_no_torque_in_three_ticks),
        cmocka_unit_test(a_bus_that_is_gone_is_off_at_once),
        cmocka_unit_test(another_master_stops_the_group_along_the_path),
        cmocka_unit_test(
            a_bus_that_takes_no_frames_stops_the_group_along_the_path),
        cmocka_unit_test(
            an_error_passive_bus_holds_with_torque_and_starts_nothing),
        cmocka_unit_test(a_second_fault_while_held_takes_the_torque),
        cmocka_unit_test(a_stop_during_the_hold_goes_on_along_the_path),
        cmocka_unit_test(the_torque_of_a_hold_can_be_taken_without_a_reset),
        cmocka_unit_test(reset_is_refused_while_the_estop_is_active),
        cmocka_unit_test(a_reset_ends_where_the_estop_is_pressed_again),
        cmocka_unit_test(a_drive_that_does_not_enable_is_a_fault_with_its_name),
        cmocka_unit_test(the_gate_stops_what_planning_should_have),
        cmocka_unit_test(a_move_beyond_the_limits_is_not_started),
        cmocka_unit_test(a_move_may_touch_the_border_of_its_range),
        cmocka_unit_test(every_lost_tick_is_counted_however_many),
        cmocka_unit_test(lost_ticks_are_skipped),
        cmocka_unit_test(ten_lost_in_a_row_or_one_in_ten_stop),
        cmocka_unit_test(bad_configurations_are_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
