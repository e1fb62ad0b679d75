/* tests/firmware/host/move/test_small_limits.c - axes in mm, m, deg, rad and
 * rev with limits from tiny to huge: what is executed keeps them and reaches
 * them.
 *
 * A limit is read as from a rig file.  What the drive gets, tick by tick, is
 * judged by its differences over some ticks: they are means of the velocity,
 * acceleration and jerk between, so inside the limits where these are, and at
 * them where these stay there long enough. */
#include <stdio.h>

#include "firmware/host/base/units.h"
#include "motion/curve/ease.h"
#include "tests/firmware/control/ramp_bench.h"

#define PHASE    8 /* differences in a ramp of the acceleration */
#define PART     1e-4
#define TICK_MAX (20 * MS)
#define PAST     4096 /* set points that are kept */

/* Of one axis: physical limits, and those that slew has of them. */
struct small {
    double limit[3]; /* velocity, acceleration, jerk */
    double ramp_s, displacement;
    int64_t period_ns;
    int stride; /* ticks of a difference */
    struct controller_axis_config config;
    const char *unit;
};

static struct ramp_bench bench;

/* --- limits --------------------------------------------------------------- */

/* In m and rad an axis is used without a rig file. */
static int64_t small_read(const char *unit, double value, unsigned order)
{
    static const char *const per[] = { "/s", "/s2", "/s3" };
    static const enum units_quantity quantity[] = { UNITS_VELOCITY,
                                                    UNITS_ACCELERATION,
                                                    UNITS_JERK };
    const bool is_rev = strcmp(unit, "rev") == 0;
    const bool is_deg = strcmp(unit, "deg") == 0;
    const struct units_context context = { .unit = is_rev   ? UNITS_AXIS_REV
                                                   : is_deg ? UNITS_AXIS_DEG
                                                            : UNITS_AXIS_MM };
    char text[64], sentence[UNITS_SENTENCE_MAX];
    int64_t result;
    snprintf(text, sizeof text, "%.15g %s%s", value,
             is_rev || is_deg ? unit : "mm", per[order]);
    if (units_parse(text, quantity[order], &context, &result, sentence) < 0)
        fail_msg("%s: %s", text, sentence);
    return result;
}

/* A jerk, and how long it takes to the limit of acceleration; the other limits
 * are such that each is held for a while.  false: a move so small that the
 * format of positions tells less of its jerk than is judged, or one so large
 * that it leaves it. */
static bool small_draw(struct small *small)
{
    static const char *const units[] = { "mm", "m", "deg", "rad", "rev" };
    const double jerk = pow(10, -4 + 10 * (double)draw_unit());
    const double ramp_s = pow(10, -2 + 3.4 * (double)draw_unit());
    const double acc = jerk * ramp_s, vel = 3 * acc * ramp_s;
    *small = (struct small){ .limit = { vel, acc, jerk },
                             .ramp_s = ramp_s,
                             .displacement = vel * 8 * ramp_s,
                             .unit = units[draw() % ARRAY_LEN(units)] };
    small->period_ns = (int64_t)(ramp_s * 1e6 / (8 * PHASE)) * 1000;
    if (small->period_ns > TICK_MAX)
        small->period_ns = TICK_MAX;
    small->stride = (int)(ramp_s * 1e9 / PHASE / (double)small->period_ns);
    const struct motion_clock_limit limit = {
        small_read(small->unit, vel, 0), small_read(small->unit, acc, 1),
        small_read(small->unit, jerk, 2)
    };
    small->config = (struct controller_axis_config){
        .pos_min_q32 = -MOTION_TRACK_POS_MAX_Q32,
        .pos_max_q32 = MOTION_TRACK_POS_MAX_Q32,
        .limit = limit,
        .stop = limit,
        .following_floor_q32 = MOTION_TRACK_POS_MAX_Q32,
    };
    return small->displacement > 1 && small->displacement < 1e8 && vel < 1e8 &&
           acc < 1e8 && jerk * pow(ramp_s, 3) > 0.05;
}

/* --- the judge ------------------------------------------------------------ */

static double past[PAST], peak[3];
static int ticks;

static void judge_begin(void)
{
    ticks = 0;
    memset(peak, 0, sizeof peak);
}

static void judge_tick(const struct small *small, const char *what)
{
    const int stride = small->stride;
    const double h = stride * (double)small->period_ns / 1e9;
    const double unit = 0x1p-31 / h; /* two units of 2^-32 per set point */
    past[ticks % PAST] = (double)bench.drive[0].given.pos_q32 / 0x1p32;
    if (ticks++ < 3 * stride)
        return;
    double p[4];
    for (int i = 0; i < 4; i++)
        p[i] = past[(ticks - 1 - i * stride) % PAST];
    const double d[3] = { (p[0] - p[1]) / h, (p[0] - 2 * p[1] + p[2]) / (h * h),
                          (p[0] - 3 * p[1] + 3 * p[2] - p[3]) / (h * h * h) };
    const double rounding[3] = { 2 * unit, 4 * unit / h, 8 * unit / (h * h) };
    for (int i = 0; i < 3; i++) {
        const double over = fabs(d[i]) - small->limit[i];
        peak[i] = fmax(peak[i], fabs(d[i]) + rounding[i]);
        if (over > small->limit[i] * PART + rounding[i])
            fail_msg("%s, %s: derivative %d is %.9g, limit %.9g (%.3g %% over)",
                     what, small->unit, i + 1, fabs(d[i]), small->limit[i],
                     100 * over / small->limit[i]);
    }
}

static void judge_reached(const struct small *small, const char *what)
{
    for (int i = 0; i < 3; i++)
        if (peak[i] < small->limit[i] * (1 - PART))
            fail_msg("%s, %s: derivative %d comes to %.9g of %.9g", what,
                     small->unit, i + 1, peak[i], small->limit[i]);
}

static void tick_judged(const struct small *small, const char *what)
{
    ramp_tick(&bench);
    controller_jog_step(&bench.controller, &bench.jog);
    if (bench.controller.state == CONTROLLER_FAULT)
        fail_msg("%s, %s: %s", what, small->unit,
                 controller_fault_text(bench.controller.fault.fault));
    judge_tick(small, what);
}

static void until_rest(const struct small *small, const char *what)
{
    int most = 64 * small->stride * PHASE;
    while (bench.controller.state != CONTROLLER_READY && most-- > 0)
        tick_judged(small, what);
    assert_int_equal(bench.controller.state, CONTROLLER_READY);
    for (int i = 0; i < 4 * small->stride; i++)
        tick_judged(small, what);
}

static void some_ticks(const struct small *small, const char *what, double part)
{
    const double all = part * small->stride * PHASE; /* of a ramp */
    for (int i = 0; i < (int)all; i++)
        tick_judged(small, what);
}

/* --- the motions ---------------------------------------------------------- */

static void jog_to(const struct small *small, double pos)
{
    const struct controller_jog_goal goal = {
        .pos_q32 = (int64_t)(pos * 0x1p32),
        .vel_q32 = small->config.limit.vel_q32,
    };
    assert_int_equal(controller_jog(&bench.controller, &bench.jog, &goal),
                     MOTION_OK);
}

static void small_begin(const struct small *small)
{
    ramp_init(&bench, small->period_ns, 1, &small->config);
    judge_begin();
}

static void run_goal(const struct small *small)
{
    small_begin(small);
    jog_to(small, small->displacement);
    until_rest(small, "goal");
    judge_reached(small, "goal");
}

static void run_stop_of_a_jog(const struct small *small)
{
    small_begin(small);
    jog_to(small, small->displacement);
    some_ticks(small, "jog", 5);
    controller_jog_stop(&bench.controller, &bench.jog, false);
    until_rest(small, "jog's stop");
    judge_reached(small, "jog's stop");
}

static void start_keyed(const struct small *small)
{
    const struct motion_track *track = &bench.track[0];
    const struct motion_ease_limit limit = { small->config.limit.vel_q32,
                                             small->config.limit.acc_q32,
                                             small->config.limit.jerk_q32 };
    small_begin(small);
    motion_track_init(&bench.track[0], bench.storage[0],
                      ARRAY_LEN(bench.storage[0]), 0);
    assert_int_equal(
        motion_ease_append_limited(
            &bench.track[0], (int64_t)(small->displacement * 0x1p32), &limit),
        MOTION_OK);
    assert_int_equal(controller_start(&bench.controller, &track, NULL),
                     MOTION_OK);
}

static void run_keyed(const struct small *small)
{
    start_keyed(small);
    until_rest(small, "keyed move");
    judge_reached(small, "keyed move");
}

/* The stop's and the override's ramps are looked for, so they need not reach
 * every limit. */
static void run_stop(const struct small *small)
{
    start_keyed(small);
    some_ticks(small, "keyed move", 5);
    controller_stop(&bench.controller);
    until_rest(small, "stop");
}

static void run_override(const struct small *small)
{
    start_keyed(small);
    some_ticks(small, "keyed move", 4.5);
    assert_int_equal(controller_override(&bench.controller, ONE / 2),
                     MOTION_OK);
    some_ticks(small, "override", 4);
    (void)controller_override(&bench.controller, ONE);
    until_rest(small, "override");
}

static void each(void (*run)(const struct small *small), int count)
{
    struct small small;
    int made = 0;
    seed_from("small limits");
    while (made < count) {
        if (!small_draw(&small))
            continue;
        run(&small);
        made++;
    }
}

/* A goal of a jog is planned by motion/otg, as are the legs of homing. */
static void a_goal_keeps_and_reaches_limits_of_any_size(void **state)
{
    (void)state;
    each(run_goal, 300);
}

static void a_jog_that_stops_does(void **state)
{
    (void)state;
    each(run_stop_of_a_jog, 200);
}

static void a_keyed_move_does(void **state)
{
    (void)state;
    each(run_keyed, 300);
}

static void a_stop_keeps_them(void **state)
{
    (void)state;
    each(run_stop, 200);
}

static void an_override_keeps_them(void **state)
{
    (void)state;
    each(run_override, 200);
}

/* The smallest that is sensible, and the largest that a format holds. */
static void limits_are_held_finely(void **state)
{
    static const struct {
        const char *text;
        enum units_axis unit;
        enum units_quantity quantity;
        double want, part;
    } rows[] = {
        { "1e-6 rev/s2", UNITS_AXIS_REV, UNITS_ACCELERATION, 1e-6, 1.2e-4 },
        { "1e-4 rev/s3", UNITS_AXIS_REV, UNITS_JERK, 1e-4, 1.2e-6 },
        { "1 deg/s2", UNITS_AXIS_REV, UNITS_ACCELERATION, 1.0 / 360, 5e-8 },
        { "0.1 um/s2", UNITS_AXIS_MM, UNITS_ACCELERATION, 1e-4, 1.2e-6 },
        { "2e9 mm/s3", UNITS_AXIS_MM, UNITS_JERK, 2e9, 1e-15 },
    };
    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(rows); i++) {
        const struct units_context context = { .unit = rows[i].unit };
        char sentence[UNITS_SENTENCE_MAX] = "";
        int64_t got = 0;
        const int err = units_parse(rows[i].text, rows[i].quantity, &context,
                                    &got, sentence);
        const double off = (double)got / 0x1p32 / rows[i].want - 1;
        if (err != 0 || fabs(off) > rows[i].part)
            fail_msg("%s: %s off by %g", rows[i].text, sentence, off);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(limits_are_held_finely),
        cmocka_unit_test(a_goal_keeps_and_reaches_limits_of_any_size),
        cmocka_unit_test(a_jog_that_stops_does),
        cmocka_unit_test(a_keyed_move_does),
        cmocka_unit_test(a_stop_keeps_them),
        cmocka_unit_test(an_override_keeps_them),
    };
    return cmocka_run_group_tests_name("small_limits", tests, NULL, NULL);
}
