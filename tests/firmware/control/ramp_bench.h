/* tests/firmware/control/ramp_bench.h - a controller on ideal drives, with
 * random axes and random moves inside their limits, for tests of what its clock
 * does. */
#ifndef TESTS_FIRMWARE_CONTROL_RAMP_BENCH_H
#define TESTS_FIRMWARE_CONTROL_RAMP_BENCH_H

#include <math.h>
#include <string.h>

#include "firmware/control/jog.h"
#include "firmware/control/parts.h"
#include "motion/core/err.h"
#include "motion/core/fixed.h"
#include "motion/otg/otg.h"
#include "tests/support/check.h"

#define MS   INT64_C(1000000)
#define UNIT MOTION_FIXED_ONE_Q32
#define ACC  MOTION_FIXED_ONE_Q32
#define ONE  MOTION_CLOCK_WARP_ONE_Q30

#define RAMP_AXES 3
#define RAMP_LEGS 5

struct ramp_drive {
    struct hal_drive drive;
    struct hal_drive_target given;
    const int64_t *now_ns;
    int64_t period_ns;
    enum hal_drive_state state;
};

struct ramp_bench {
    struct controller controller;
    struct controller_axis_config axis_config[RAMP_AXES];
    struct controller_axis axis[RAMP_AXES];
    struct controller_jog jog;
    struct ramp_drive drive[RAMP_AXES];
    struct motion_segment storage[RAMP_AXES]
                                 [(RAMP_LEGS + 1) * MOTION_OTG_PHASES];
    struct motion_track track[RAMP_AXES];
    int64_t now_ns;
};

static inline void ramp_drive_request(struct hal_drive *drive,
                                      enum hal_drive_request request)
{
    struct ramp_drive *self = (struct ramp_drive *)drive;
    self->state = request == HAL_DRIVE_REQUEST_ENABLE ? HAL_DRIVE_ENABLED
                  : request == HAL_DRIVE_REQUEST_QUICK_STOP
                      ? HAL_DRIVE_QUICK_STOP
                      : HAL_DRIVE_OFF;
}

static inline int ramp_drive_set(struct hal_drive *drive,
                                 const struct hal_drive_target *target)
{
    ((struct ramp_drive *)drive)->given = *target;
    return MOTION_OK;
}

static inline void ramp_drive_feedback(struct hal_drive *drive,
                                       struct hal_drive_feedback *feedback)
{
    const struct ramp_drive *self = (struct ramp_drive *)drive;
    *feedback = (struct hal_drive_feedback){
        .state = self->state,
        .pos_q32 = self->given.pos_q32,
        .t_ns = *self->now_ns - self->period_ns,
        .demand_age_ns = self->period_ns,
        .following = true,
    };
}

static const struct hal_drive_ops ramp_drive_ops = {
    .request = ramp_drive_request,
    .set_target = ramp_drive_set,
    .feedback = ramp_drive_feedback,
};

static inline void ramp_tick(struct ramp_bench *bench)
{
    bench->now_ns += bench->controller.config.period_ns;
    controller_step(&bench->controller, bench->now_ns,
                    (struct hal_fieldbus_worst){ HAL_FIELDBUS_GOOD, 0 });
}

/* Evenly over the octaves from low to high. */
static inline int64_t ramp_draw(double low, double high, int64_t unit)
{
    return (int64_t)(low * pow(high / low, (double)draw_unit()) * (double)unit);
}

static inline bool ramp_chance(unsigned percent)
{
    return draw() % 100 < percent;
}

/* Stop limits from equal to ten times the limits. */
static inline struct controller_axis_config ramp_axis(void)
{
    const struct motion_clock_limit limit = {
        ramp_draw(2, 500, UNIT),
        ramp_draw(20, 5000, ACC),
        ramp_chance(75) ? ramp_draw(200, 100000, ACC) : 0,
    };
    const int64_t acc = ramp_chance(50) ? 100 : ramp_draw(1, 10, 100);
    const int64_t jerk = ramp_chance(50) ? 100 : ramp_draw(1, 10, 100);
    return (struct controller_axis_config){
        .pos_min_q32 = -100000 * UNIT,
        .pos_max_q32 = 100000 * UNIT,
        .limit = limit,
        .stop = { limit.vel_q32, limit.acc_q32 / 100 * acc,
                  limit.jerk_q32 / 100 * jerk },
        .following_floor_q32 = 100000 * UNIT,
    };
}

static inline void ramp_init(struct ramp_bench *bench, int64_t period_ns,
                             unsigned axes,
                             const struct controller_axis_config axis[])
{
    struct controller_config config = { .period_ns = period_ns,
                                        .axis_count = axes,
                                        .axis = bench->axis_config };
    struct hal_drive *drives[RAMP_AXES];
    memset(bench, 0, sizeof *bench);
    for (unsigned i = 0; i < axes; i++) {
        bench->axis_config[i] = axis[i];
        bench->drive[i] = (struct ramp_drive){ .drive.ops = &ramp_drive_ops,
                                               .now_ns = &bench->now_ns,
                                               .period_ns = period_ns };
        drives[i] = &bench->drive[i].drive;
    }
    assert_int_equal(
        controller_init(&bench->controller, &config, bench->axis, drives, NULL),
        MOTION_OK);
    bench->now_ns = 1000 * MS;
    ramp_tick(bench);
    assert_int_equal(controller_enable(&bench->controller), MOTION_OK);
    ramp_tick(bench);
    assert_int_equal(bench->controller.state, CONTROLLER_READY);
}

/* From key to key in the least time under `share` percent of the limits, the
 * last to rest, the others at a random speed; some legs are dwells. */
static inline void ramp_track(struct ramp_bench *bench, unsigned i,
                              int64_t share)
{
    const struct motion_clock_limit *limit =
        &bench->controller.config.axis[i].limit;
    struct motion_track *track = &bench->track[i];
    /* to the unit, planning may round to beyond what `share` leaves */
    const int64_t vel = limit->vel_q32 / 100 * share;
    const int64_t acc = limit->acc_q32 / 100 * share;
    const int64_t jerk = limit->jerk_q32 / 100 * share;
    struct motion_otg_move move = {
        .limit = { vel - vel / 100000, -(vel - vel / 100000),
                   acc - acc / 100000, -(acc - acc / 100000),
                   jerk - jerk / 100000, 0 },
    };
    motion_track_init(track, bench->storage[i],
                      (RAMP_LEGS + 1) * MOTION_OTG_PHASES, 0);
    for (int leg = 0; leg < RAMP_LEGS; leg++) {
        struct motion_otg_plan plan;
        const int64_t span = move.limit.vel_max_q32 / 100 *
                             check_random_in(check_stream(), 1, 400);
        if (move.start.vel_q32 == 0 && ramp_chance(15)) {
            motion_track_append_dwell(track, 200 * MS * MOTION_FIXED_NS_Q12);
            continue;
        }
        move.goal = (struct motion_state){
            .pos_q32 = move.start.pos_q32 + (ramp_chance(50) ? span : -span)
        };
        if (leg < RAMP_LEGS - 2 && ramp_chance(50))
            move.goal.vel_q32 = move.limit.vel_max_q32 / 100 *
                                check_random_in(check_stream(), -90, 90);
        if (motion_otg_make(&move, &plan, NULL) < 0)
            continue;
        assert_int_equal(motion_otg_append(&plan, track), MOTION_OK);
        move.start = move.goal;
    }
    if (move.start.vel_q32 != 0) { /* the last leg was none */
        struct motion_otg_plan plan;
        move.goal = (struct motion_state){ 0 };
        assert_int_equal(motion_otg_make(&move, &plan, NULL), MOTION_OK);
        assert_int_equal(motion_otg_append(&plan, track), MOTION_OK);
    }
}

/* Random axes, random tracks, under way at a random override; false: planning
 * rounded one beyond its limits. */
static inline bool ramp_start(struct ramp_bench *bench)
{
    static const int64_t periods[] = { 250000, MS, MS, MS, 2 * MS, 4 * MS };
    const unsigned axes = 1 + (unsigned)(draw() % RAMP_AXES);
    const struct motion_track *tracks[RAMP_AXES];
    struct controller_axis_config axis[RAMP_AXES];
    for (unsigned i = 0; i < axes; i++)
        axis[i] = ramp_axis();
    ramp_init(bench, periods[draw() % ARRAY_LEN(periods)], axes, axis);
    const int64_t share =
        ramp_chance(40) ? 100 : check_random_in(check_stream(), 20, 100);
    for (unsigned i = 0; i < axes; i++) {
        ramp_track(bench, i, share);
        tracks[i] = &bench->track[i];
    }
    controller_override(&bench->controller,
                        ONE / 100 * check_random_in(check_stream(), 10, 100));
    return controller_start(&bench->controller, tracks, NULL) == MOTION_OK;
}

/* Random axis, a jog that turns round on its way. */
static inline void ramp_jog(struct ramp_bench *bench)
{
    const struct controller_axis_config axis = ramp_axis();
    const int64_t span =
        axis.limit.vel_q32 / 100 * check_random_in(check_stream(), 10, 300);
    struct controller_jog_goal goal = { .pos_q32 = span,
                                        .vel_q32 = axis.limit.vel_q32 };
    ramp_init(bench, MS, 1, &axis);
    assert_int_equal(controller_jog(&bench->controller, &bench->jog, &goal),
                     MOTION_OK);
    for (int64_t n = check_random_in(check_stream(), 1, 600); n > 0; n--)
        ramp_tick(bench);
    goal.pos_q32 = -span;
    (void)controller_jog(&bench->controller, &bench->jog, &goal);
}

static inline bool ramp_is_moving(const struct ramp_bench *bench)
{
    return bench->controller.state == CONTROLLER_MOVING;
}

#endif
