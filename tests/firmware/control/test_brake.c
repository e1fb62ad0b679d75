/* tests/firmware/control/test_brake.c - a fault at any time of a jog, of a stop of one
 * and of what is played like one: ideal drives, which never need their own quick stop.
 *
 * What must hold in every tick from the fault on: the set points of every axis keep the
 * limits of stopping (difference.h), no drive is asked for its quick stop, and every
 * axis is at rest, before torque is taken, as soon as the shortest motion to rest is.
 *
 *   N=100000 build/tests/firmware/control/test_brake      SEED=17 N=1 ... */
#include <stdlib.h>
#include <string.h>

#include "firmware/control/gear.h"
#include "firmware/control/homing.h"
#include "firmware/control/jog.h"
#include "firmware/control/playback.h"
#include "motion/core/err.h"
#include "motion/core/fixed.h"
#include "motion/curve/ease.h"
#include "tests/firmware/control/difference.h"
#include "tests/firmware/control/ideal_drive.h"

enum { MOVER, FOLLOWER, OTHER, AXES };

static struct ideal_drive drive[AXES];
static struct controller controller;
static struct controller_axis axes[AXES];
static struct controller_axis_config configs[AXES];
static struct controller_jog jog;
static struct homing homing;
static struct homing_config homing_configs[AXES];
static struct playback playback;
static struct playback_axis playback_axes[AXES];
static struct controller_cam cam;
static struct motion_segment cam_segment[CONTROLLER_GEAR_SEGMENTS];
static struct motion_track cam_track;
static struct motion_segment move_segment[16];
static struct motion_track move_track;
static struct difference past[AXES];
static struct hal_fieldbus_worst bus;
static struct {
    struct hal_gpio gpio;
    int level;
} estop;
static unsigned round_of;

static int estop_get(struct hal_gpio *line)
{
    (void)line;
    return estop.level;
}

static int estop_event(struct hal_gpio *line, struct hal_gpio_event *event)
{
    (void)line;
    (void)event;
    return 0;
}

static const struct hal_gpio_ops estop_ops = { .get = estop_get,
                                               .event = estop_event };

/* --- the rig ---------------------------------------------------------------- */

static int64_t q32(long double value)
{
    return llrintl(value * 0x1p32L);
}

static void tick(void)
{
    now_ns += ideal_period_ns;
    controller_step(&controller, now_ns, bus);
    controller_jog_step(&controller, &jog);
    homing_step(&homing);
    playback_step(&playback);
    for (int i = 0; i < AXES; i++)
        difference_push(&past[i], drive[i].given.pos_q32);
}

static long double draw_in(long double low, long double high)
{
    return low + (high - low) * draw_unit();
}

/* Of a rig of 10^-3 to 30,000 units/s; full speed takes 20 to 300 ms, full acceleration 5
 * to 50, or no time. */
static void draw_axis(struct controller_axis_config *config, long double scale)
{
    static const long double stops[] = { 1, 1.3L, 5 };
    const long double vel = scale * powl(10, draw_unit());
    const long double acc = vel / draw_in(0.02L, 0.3L);
    const long double jerk =
        draw_below(3) == 0 ? 0 : acc / draw_in(0.005L, 0.05L);
    const long double by = stops[draw_below(3)];
    *config = (struct controller_axis_config){
        .pos_min_q32 = -q32(20 * vel),
        .pos_max_q32 = q32(20 * vel),
        .limit = { q32(vel), q32(acc), q32(jerk) },
        .stop = { q32(vel), q32(acc * by), q32(jerk * by) },
        .following_floor_q32 = q32(vel),
        .following_k_ns = 1000 * MS,
    };
}

static void draw_rig(void)
{
    static const int64_t periods[] = { 62500, 250000, 1000000, 4000000 };
    struct hal_drive *drives[AXES];
    struct controller_config config = { .axis_count = AXES, .axis = configs };
    const struct controller_inputs inputs = { .estop = { &estop.gpio, NULL } };
    memset(drive, 0, sizeof drive);
    memset(&jog, 0, sizeof jog);
    memset(past, 0, sizeof past);
    bus = (struct hal_fieldbus_worst){ HAL_FIELDBUS_GOOD, 0 };
    estop.gpio.ops = &estop_ops;
    estop.level = 0;
    const long double scale = powl(10, draw_in(-3, 3.5L));
    ideal_period_ns = config.period_ns = periods[draw_below(4)];
    for (int i = 0; i < AXES; i++) {
        draw_axis(&configs[i], scale);
        drive[i].drive.ops = &ideal_drive_ops;
        drives[i] = &drive[i].drive;
        past[i].error = difference_error(NULL, 0);
        homing_configs[i] = (struct homing_config){
            .by = i == MOVER ? HOMING_SWITCH : HOMING_NONE,
            .direction = -1,
            .fast_q32 = configs[i].limit.vel_q32,
            .slow_q32 = configs[i].limit.vel_q32 / 10,
            .distance_q32 = configs[i].pos_max_q32,
            .timeout_ns = 600000 * MS,
        };
    }
    now_ns = 1000 * MS;
    assert_int_equal(
        controller_init(&controller, &config, axes, drives, &inputs),
        MOTION_OK);
    assert_int_equal(homing_init(&homing, &controller, &jog, homing_configs),
                     MOTION_OK);
    playback_init(&playback, &controller, &jog, playback_axes);
    tick();
    assert_int_equal(controller_enable(&controller), MOTION_OK);
    while (controller.state != CONTROLLER_READY)
        tick();
}

static void ticks_ns(int64_t ns)
{
    for (int64_t n = ns / ideal_period_ns;
         n > 0 && controller.state != CONTROLLER_FAULT; n--)
        tick();
}

/* --- what is under way when the fault comes -------------------------------------- */

static int64_t vel_of(int axis)
{
    return configs[axis].limit.vel_q32;
}

/* To a share of the range. */
static void go(long double to, int64_t until_ns)
{
    const struct controller_jog_goal goal = {
        .axis = MOVER,
        .pos_q32 = q32(difference_units(configs[MOVER].pos_max_q32) * to),
        .vel_q32 = q32(difference_units(vel_of(MOVER)) *
                       (draw_below(4) == 0 ? draw_unit() + 0.01L : 1)),
        .until_ns = until_ns,
    };
    (void)controller_jog(&controller, &jog, &goal);
}

static void some_time(void)
{
    ticks_ns((int64_t)draw_below(600) * MS);
}

static void a_jog(void)
{
    go(0.9L, 0);
    some_time();
}

static void a_stop(void)
{
    a_jog();
    controller_jog_stop(&controller, &jog, true);
}

static void a_stop_of_all(void)
{
    a_jog();
    controller_stop(&controller);
}

static void a_soft_stop(void)
{
    a_jog();
    controller_jog_stop(&controller, &jog, false);
}

static void two_stops(void)
{
    a_soft_stop();
    ticks_ns((int64_t)draw_below(60) * MS);
    controller_jog_stop(&controller, &jog, true);
}

static void a_dead_man(void)
{
    const int64_t for_ns = (1 + (int64_t)draw_below(400)) * MS;
    go(0.9L, now_ns + for_ns);
    ticks_ns(for_ns - (int64_t)draw_below(3) * ideal_period_ns);
}

static void a_hold(void)
{
    a_jog();
    (void)controller_hold(&controller);
}

static void a_hold_and_stop(void)
{
    a_hold();
    ticks_ns((int64_t)draw_below(60) * MS);
    controller_stop(&controller);
}

static void a_resume(void)
{
    a_hold();
    ticks_ns((int64_t)draw_below(400) * MS);
    (void)controller_resume(&controller);
}

static void another_goal(void)
{
    a_jog();
    go(draw_in(-0.9L, 0.9L), 0);
}

static void another_goal_while_it_brakes(void)
{
    a_soft_stop();
    ticks_ns((int64_t)draw_below(100) * MS);
    go(draw_in(-0.9L, 0.9L), 0);
}

/* In each tick one. */
static void many_goals(void)
{
    for (int n = 0; n < 40; n++) {
        go(draw_in(-1, 1), 0);
        tick();
    }
}

static void to_the_end_of_its_range(void)
{
    go(1, 0);
    ticks_ns(20 * INT64_C(1000000000) - (int64_t)draw_below(500) * MS);
    if (draw_below(2) != 0)
        go(-1, 0);
    ticks_ns((int64_t)draw_below(300) * MS);
}

static void a_leg_of_homing(void)
{
    assert_int_equal(homing_start(&homing, 1), MOTION_OK);
    some_time();
    if (draw_below(4) == 0)
        controller_stop(&controller);
}

static void a_gear(long double ratio, long double over)
{
    const int64_t far_q32 =
        q32(difference_units(configs[MOVER].pos_max_q32) * 0.99L);
    const struct controller_gear gear = {
        .ratio_q32 = q32(ratio),
        .place_q32 = axes[FOLLOWER].target.pos_q32,
        .begin_q32 = axes[MOVER].target.pos_q32 +
                     q32(difference_units(vel_of(MOVER)) * 0.02L),
        .over_q32 = q32(over),
        .low_q32 = -far_q32,
        .high_q32 = far_q32,
    };
    past[FOLLOWER].error += fabsl(ratio) * past[MOVER].error;
    motion_track_init(&cam_track, cam_segment, CONTROLLER_GEAR_SEGMENTS, 0);
    cam.master = MOVER;
    if (controller_gear_cam(&gear, &cam_track, &cam) == MOTION_OK)
        (void)controller_couple(&controller, FOLLOWER, &cam);
}

/* Of a ratio that takes up to five times the follower's speed. */
static long double draw_ratio(void)
{
    const long double most =
        difference_units(vel_of(FOLLOWER)) / difference_units(vel_of(MOVER));
    return most * powl(5, draw_in(-1, 1)) * (draw_below(2) == 0 ? -1 : 1);
}

/* The follower's range counts for nothing here. */
static void a_coupled_jog(void)
{
    const long double ratio = draw_ratio();
    configs[FOLLOWER].pos_max_q32 = q32(2e9L);
    configs[FOLLOWER].pos_min_q32 = -q32(2e9L);
    a_gear(ratio, difference_units(vel_of(MOVER)) * 0.5L);
    assert_ptr_equal(axes[FOLLOWER].cam, &cam);
    go(0.9L, 0);
    ticks_ns((int64_t)draw_below(1500) * MS);
}

static void a_gear_that_is_being_engaged(void)
{
    configs[FOLLOWER].pos_max_q32 = q32(2e9L);
    configs[FOLLOWER].pos_min_q32 = -q32(2e9L);
    go(0.9L, 0);
    ticks_ns((int64_t)draw_below(200) * MS);
    a_gear(draw_ratio() / 5, difference_units(vel_of(MOVER)) * 2);
    ticks_ns((int64_t)draw_below(400) * MS);
}

static void a_stop_of_a_coupled_jog(void)
{
    a_coupled_jog();
    controller_jog_stop(&controller, &jog, draw_below(2) == 0);
}

static void a_hold_of_a_coupled_jog(void)
{
    a_coupled_jog();
    (void)controller_hold(&controller);
}

static void an_approach(void)
{
    const struct motion_track *track[AXES] = { [MOVER] = &move_track };
    const struct motion_ease_limit limit = { configs[MOVER].limit.vel_q32,
                                             configs[MOVER].limit.acc_q32,
                                             configs[MOVER].limit.jerk_q32 };
    motion_track_init(&move_track, move_segment, 16,
                      configs[MOVER].pos_max_q32 / 2);
    assert_int_equal(motion_ease_append_limited(&move_track, 0, &limit),
                     MOTION_OK);
    assert_int_equal(playback_load(&playback, track), MOTION_OK);
    assert_int_equal(playback_go(&playback, 0, PLAYBACK_STAND), MOTION_OK);
    ticks_ns((int64_t)draw_below(2000) * MS);
    if (draw_below(4) == 0)
        controller_stop(&controller);
}

static const struct {
    const char *name;
    void (*begin)(void);
} way[] = {
    { "a jog", a_jog },
    { "a stop", a_stop },
    { "a stop of all", a_stop_of_all },
    { "a soft stop", a_soft_stop },
    { "two stops", two_stops },
    { "a dead man", a_dead_man },
    { "a hold", a_hold },
    { "a hold and a stop", a_hold_and_stop },
    { "a resume", a_resume },
    { "another goal", another_goal },
    { "another goal while it brakes", another_goal_while_it_brakes },
    { "many goals", many_goals },
    { "to the end of its range", to_the_end_of_its_range },
    { "a leg of homing", a_leg_of_homing },
    { "a coupled jog", a_coupled_jog },
    { "a gear that is being engaged", a_gear_that_is_being_engaged },
    { "a stop of a coupled jog", a_stop_of_a_coupled_jog },
    { "a hold of a coupled jog", a_hold_of_a_coupled_jog },
    { "an approach", an_approach },
};

/* --- the fault, and what follows ---------------------------------------------- */

static void fault(unsigned which)
{
    if (which == 0)
        estop.level = 1;
    else if (which == 1)
        drive[OTHER].faulty = true;
    else
        bus.health = HAL_FIELDBUS_PASSIVE; /* holds, with torque */
}

/* From this speed and acceleration to rest, no shorter motion is possible: the
 * acceleration is led to 0 first. */
static long double rest_s(int axis)
{
    const struct motion_clock_limit *stop = &configs[axis].stop;
    const long double a = difference_units(stop->acc_q32);
    const long double j = difference_units(stop->jerk_q32);
    const long double acc = fabsl(difference_units(axes[axis].target.acc_q32));
    long double vel = fabsl(difference_units(axes[axis].target.vel_q32));
    if (j <= 0)
        return vel / a;
    vel += acc * acc / (2 * j);
    return acc / j + (vel >= a * a / j ? vel / a + a / j : 2 * sqrtl(vel / j));
}

static void judge(const char *name)
{
    for (int i = 0; i < AXES; i++) {
        const struct motion_clock_limit *limit = &configs[i].stop;
        const char *over = difference_judge(&past[i], limit, ideal_period_ns);
        if (over != NULL)
            fail_msg("round %u, %s: axis %d, period %" PRId64 " ns: %s, "
                     "%.9Lg, %.9Lg, %.9Lg of its stop limits",
                     round_of, name, i, ideal_period_ns, over, past[i].most[0],
                     past[i].most[1], past[i].most[2]);
        if (drive[i].quick_stops > 0)
            fail_msg("round %u, %s: axis %d is asked for a quick stop: %s",
                     round_of, name, i,
                     controller_fault_text(controller.fault.fault));
    }
}

static void a_round(unsigned which)
{
    const char *name = way[which].name;
    const unsigned first = draw_below(3), second = draw_below(6);
    way[which].begin();
    ticks_ns((int64_t)draw_below(400) * MS);
    if (controller.state == CONTROLLER_FAULT)
        fail_msg("round %u, %s, axis %d: %s, %.9Lg of %.9Lg", round_of, name,
                 controller.fault.axis,
                 controller_fault_text(controller.fault.fault),
                 difference_units(controller.fault.value),
                 difference_units(controller.fault.limit));
    for (int i = 0; i < AXES; i++)
        memset(past[i].most, 0, sizeof past[i].most);
    const bool moves = controller.state != CONTROLLER_READY;
    /* a curve or a path takes of it what it needs */
    const bool alone = controller.jog != NULL && axes[FOLLOWER].cam == NULL;
    const long double most_s = alone ? rest_s(MOVER) : 100;
    fault(first);
    const int64_t second_ns = (int64_t)draw_below(200) * MS;
    int64_t ns = 0;
    for (; controller.state != CONTROLLER_FAULT; ns += ideal_period_ns) {
        if (second < 2 && ns >= second_ns)
            fault(second);
        tick();
        judge(name);
        if ((long double)(ns - 6 * ideal_period_ns) * 1e-9L > most_s && moves)
            fail_msg("round %u, %s, %s: not at rest after %.4Lf s", round_of,
                     name, controller_state_text(controller.state), most_s);
    }
    /* were torque taken in motion, it would stop dead */
    for (int n = 0; n < 4; n++) {
        tick();
        judge(name);
    }
    for (int i = 0; i < AXES; i++)
        assert_int_equal(past[i].pos_q32[0], past[i].pos_q32[2]);
    assert_int_equal(drive[MOVER].enabled,
                     controller.reaction == CONTROLLER_REACT_HOLD);
}

/* The operator's stop of a jog and the same with an e-stop at each tick of it: torque
 * is taken in the tick in which the stop alone is over. */
static void the_stop_itself_serves_a_fault(void **state)
{
    (void)state;
    seed_from("stops");
    for (int n = 0; n < 6; n++) {
        const uint64_t seed = *check_stream();
        unsigned rest = 0;
        draw_rig();
        a_stop();
        while (controller.state != CONTROLLER_READY) {
            tick();
            rest++;
        }
        for (unsigned at = 0; at < rest; at += 1 + rest / 150) {
            unsigned ticks = 0;
            *check_stream() = seed;
            draw_rig();
            a_stop();
            while (controller.state != CONTROLLER_FAULT) {
                if (ticks++ == at)
                    estop.level = 1;
                tick();
                judge("a stop");
            }
            assert_int_equal(ticks, rest);
        }
    }
}

static void a_fault_at_any_time_is_a_stop_within_the_stop_limits(void **state)
{
    const char *given = getenv("N");
    const unsigned rounds =
        given ? (unsigned)strtoul(given, NULL, 0) : ARRAY_LEN(way) * 12;
    long double most[3] = { 0 };
    (void)state;
    seed_from("faults");
    for (round_of = 0; round_of < rounds; round_of++) {
        draw_rig();
        a_round(round_of % ARRAY_LEN(way));
        for (int i = 0; i < AXES; i++)
            for (int k = 0; k < 3; k++)
                most[k] = fmaxl(most[k], past[i].most[k]);
    }
    print_message("%u rounds: %.9Lf of the speeds, %.9Lf of the stop limits of "
                  "acceleration, %.9Lf of jerk\n",
                  round_of, most[0], most[1], most[2]);
    assert_true(most[1] > 0.99L && most[2] > 0.99L);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_stop_itself_serves_a_fault),
        cmocka_unit_test(a_fault_at_any_time_is_a_stop_within_the_stop_limits),
    };
    return cmocka_run_group_tests_name("brake", tests, NULL, NULL);
}
