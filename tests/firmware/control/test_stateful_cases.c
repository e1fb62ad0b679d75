/* tests/firmware/control/test_stateful_cases.c - ways in which a machine once
 * moved, or did not stop, each told to the bench and the judge of
 * tests/firmware/control/stateful.h. */
#include <string.h>

#include "motion/core/err.h"
#include "motion/curve/ease.h"
#include "tests/firmware/control/stateful.h"

#define MS   INT64_C(1000000)
#define UNIT MOTION_FIXED_ONE_Q32

static struct stateful bench;

/* An axis from 0 to 2000 mm, 250 mm/s, with its home switch at 100 mm and below
 * and a limit switch at -20 mm. */
static void lay_axis(unsigned i, int64_t start_q32)
{
    struct controller_axis_config *config = &bench.axis_config[i];
    struct stateful_zone *zone = bench.axis[i].zone;
    *config = (struct controller_axis_config){
        .pos_max_q32 = 2000 * UNIT,
        .limit = { 250 * UNIT, 500 * UNIT, 5000 * UNIT },
        .stop = { 250 * UNIT, 1000 * UNIT, 20000 * UNIT },
        .following_floor_q32 = UNIT / 2,
        .following_k_ns = 5 * MS,
    };
    zone[STATEFUL_HOME] =
        (struct stateful_zone){ true, false, -1000 * UNIT, 100 * UNIT };
    zone[STATEFUL_NEGATIVE] =
        (struct stateful_zone){ true, false, -1000 * UNIT, -20 * UNIT };
    bench.home[i] = (struct homing_config){
        .by = HOMING_SWITCH,
        .direction = -1,
        .fast_q32 = 250 * UNIT,
        .slow_q32 = 10 * UNIT,
        .distance_q32 = 1800 * UNIT,
        .pos_q32 = 100 * UNIT,
        .timeout_ns = 45000 * MS,
    };
    bench.axis[i].pos_q32 = start_q32;
    bench.axis[i].brake = 2000;
    bench.axis[i].enable_ticks = 3;
}

static void lay(unsigned axes, int64_t start_q32)
{
    memset(&bench, 0, sizeof bench);
    bench.axes = axes;
    bench.config =
        (struct controller_config){ .period_ns = MS, .axis_count = axes };
    for (unsigned i = 0; i < axes; i++)
        lay_axis(i, start_q32);
}

static void judged(const char *what, int64_t n)
{
    if (bench.violation == STATEFUL_NONE)
        return;
    stateful_print(&bench);
    fail_msg("%s %" PRId64 ": %s", what, n,
             stateful_violation_text(bench.violation));
}

static void run(int ticks)
{
    stateful_ticks(&bench, ticks);
    judged("tick", (int64_t)bench.ticks);
}

static void in_state(enum controller_state state)
{
    if (bench.controller.state != state)
        fail_msg("%s, %s", controller_state_text(bench.controller.state),
                 controller_fault_text(bench.controller.fault.fault));
}

static void enable(void)
{
    stateful_begin(&bench);
    run(1);
    assert_int_equal(stateful_enable(&bench), MOTION_OK);
    run(20);
    in_state(CONTROLLER_READY);
}

static int64_t at_q32(void)
{
    return bench.judge.past[0].pos_q32[0];
}

static void stands_at(int64_t pos_q32, int64_t most_q32)
{
    if (llabs(at_q32() - pos_q32) > most_q32)
        fail_msg("at %.6f, not %.6f", stateful_unit(at_q32()),
                 stateful_unit(pos_q32));
}

static void start_ease(int64_t to_q32)
{
    const struct motion_clock_limit *most = &bench.axis_config[0].limit;
    const struct motion_ease_limit limit = { most->vel_q32, most->acc_q32,
                                             most->jerk_q32 };
    struct motion_track *track = &bench.track[bench.spare][0];
    motion_track_init(track, bench.storage[bench.spare][0], STATEFUL_SEGMENTS,
                      bench.controller.axis[0].target.pos_q32);
    assert_int_equal(motion_ease_append_limited(track, to_q32, &limit),
                     MOTION_OK);
    assert_int_equal(stateful_start(&bench, 1), MOTION_OK);
}

/* --- a stop in the tick in which something begins ------------------------- */

static void a_stop_in_the_tick_homing_begins_stops_it(void **state)
{
    (void)state;
    for (int64_t kind = 0; kind < 3; kind++) {
        lay(1, 1500 * UNIT);
        enable();
        assert_int_equal(stateful_homing(&bench, 1), MOTION_OK);
        if (kind == 0)
            stateful_stop(&bench);
        else
            stateful_jog_stop(&bench, kind == 2);
        run(10000);
        stands_at(1500 * UNIT, UNIT / 1000);
        assert_int_equal(bench.homing.state, HOMING_FAILED);
        in_state(CONTROLLER_READY);
    }
}

/* Run until homing has come to this state. */
static bool run_to(enum homing_state state)
{
    for (int n = 0; n < 30000 && homing_is_running(&bench.homing); n++) {
        if (bench.homing.state == state)
            return true;
        run(1);
    }
    return false;
}

static void a_stop_after_any_change_of_homing_stops_it(void **state)
{
    static const enum homing_state leg[] = {
        HOMING_SEARCH,   HOMING_SLOW_DOWN, HOMING_LEAVE, HOMING_TURN,
        HOMING_APPROACH, HOMING_SETTLE,    HOMING_GO,
    };
    (void)state;
    for (size_t k = 0; k < ARRAY_LEN(leg); k++)
        for (int later = 0; later < 4; later++) {
            lay(1, 400 * UNIT);
            bench.home[0].goes = true;
            bench.home[0].go_q32 = 300 * UNIT;
            enable();
            assert_int_equal(stateful_homing(&bench, 1), MOTION_OK);
            assert_true(run_to(leg[k]));
            run(later);
            stateful_stop(&bench);
            run(3000);
            assert_int_equal(bench.homing.state, HOMING_FAILED);
            in_state(CONTROLLER_READY);
        }
}

static void homing_under_an_override_heeds_switches_and_stops(void **state)
{
    (void)state;
    for (int64_t at = 1; at < 1500; at += 90) {
        lay(1, 400 * UNIT);
        enable();
        assert_int_equal(stateful_homing(&bench, 1), MOTION_OK);
        run((int)at);
        (void)stateful_override(&bench, MOTION_CLOCK_WARP_ONE_Q30 / 10 * 9);
        run(4000);
        stateful_stop(&bench);
        run(3000);
        in_state(CONTROLLER_READY);
    }
}

/* The switch comes while it slows down within the limits, and the stop limits
 * are twice as large. */
static void homing_that_is_held_heeds_switches(void **state)
{
    (void)state;
    for (int at = 1180; at < 1500; at += 4) {
        lay(1, 400 * UNIT);
        enable();
        assert_int_equal(stateful_homing(&bench, 1), MOTION_OK);
        run(at);
        (void)stateful_hold(&bench);
        run(2000);
        (void)stateful_resume(&bench);
        run(3000);
        stateful_stop(&bench);
        run(3000);
        in_state(CONTROLLER_READY);
    }
}

/* --- the dead man ---------------------------------------------------------- */

static void a_jog_ends_with_its_time_whatever_the_clock_does(void **state)
{
    (void)state;
    for (int64_t kind = 0; kind < 4; kind++)
        for (int at = 0; at < 250; at += 7) {
            lay(1, 100 * UNIT);
            bench.axis[0].zone[STATEFUL_HOME].there = false;
            enable();
            assert_int_equal(
                stateful_jog(&bench, 0, 2000 * UNIT, 50 * UNIT, 250 * MS),
                MOTION_OK);
            run(at);
            if (kind == 0)
                (void)stateful_override(&bench, MOTION_CLOCK_WARP_ONE_Q30 / 2);
            else
                (void)stateful_hold(&bench);
            run(kind == 1 ? 3 : kind == 2 ? 200 : 0);
            if (kind > 0)
                (void)stateful_resume(&bench);
            run(kind == 3 ? 300 : 3000);
            if (kind == 3)
                (void)stateful_resume(&bench);
            run(3000);
            assert_int_not_equal(bench.controller.state, CONTROLLER_MOVING);
        }
}

static void a_jog_and_a_stop_in_one_tick_are_a_stop(void **state)
{
    (void)state;
    for (int64_t kind = 0; kind < 3; kind++) {
        lay(1, 1500 * UNIT);
        enable();
        assert_int_equal(stateful_jog(&bench, 0, 2000 * UNIT, 250 * UNIT, 0),
                         MOTION_OK);
        if (kind == 0)
            stateful_stop(&bench);
        else
            stateful_jog_stop(&bench, kind == 2);
        run(5000);
        stands_at(1500 * UNIT, UNIT / 1000);
        in_state(CONTROLLER_READY);
    }
}

/* --- enabling --------------------------------------------------------------- */

static void an_axis_that_is_up_first_stays_where_it_is(void **state)
{
    static const double droop[] = { 0.01, 0.1, -0.1 };
    (void)state;
    for (size_t k = 0; k < ARRAY_LEN(droop); k++) {
        lay(2, 700 * UNIT);
        bench.axis[0].droop_q32 = stateful_q32(droop[k]);
        bench.axis[1].enable_ticks = 3000;
        stateful_begin(&bench);
        run(1);
        assert_int_equal(stateful_enable(&bench), MOTION_OK);
        run(3100);
        in_state(CONTROLLER_READY);
        stands_at(700 * UNIT, 0);
    }
}

/* Supervised as well: it is pushed away, and it is noticed. */
static void an_axis_that_is_up_first_is_watched(void **state)
{
    (void)state;
    lay(2, 700 * UNIT);
    bench.axis[1].enable_ticks = 3000;
    stateful_begin(&bench);
    run(1);
    assert_int_equal(stateful_enable(&bench), MOTION_OK);
    run(100);
    bench.judge.causes = UINT32_MAX;
    bench.axis[0].slip_q32 = 2 * UNIT;
    run(20);
    in_state(CONTROLLER_FAULT);
    assert_int_equal(bench.controller.fault.fault, CONTROLLER_FAULT_FOLLOWING);
}

/* The drive lost torque, and got it again, between two ticks: nobody saw it
 * without.  Off first, then on: its first set point is where the axis is. */
static void drives_are_enabled_from_off_alone(void **state)
{
    (void)state;
    for (int off = 0; off < 12; off++)
        for (int leaves = 0; leaves < 2; leaves++) {
            lay(1, 700 * UNIT);
            bench.axis[0].droop_q32 = stateful_q32(0.1);
            bench.axis[0].enable_ticks = 0;
            bench.axis[0].off_ticks = 8;
            enable();
            run(50);
            assert_int_equal(stateful_off(&bench), MOTION_OK);
            run(off);
            bench.axis[0].state = leaves ? HAL_DRIVE_OFF : bench.axis[0].state;
            assert_int_equal(stateful_enable(&bench), MOTION_OK);
            run(60);
            in_state(CONTROLLER_READY);
        }
}

/* --- lost ticks ------------------------------------------------------------- */

static void no_set_point_leaps_after_lost_ticks(void **state)
{
    (void)state;
    for (int lost = 1; lost <= 100; lost += lost < 12 ? 1 : 8) {
        lay(1, 200 * UNIT);
        enable();
        start_ease(1900 * UNIT);
        run(2000);
        bench.lost = lost;
        bench.judge.causes = (uint32_t)1 << CONTROLLER_FAULT_OVERRUN;
        run(4000);
    }
}

/* --- stops while the rate rises ---------------------------------------------- */

enum request { REQUEST_HOLD, REQUEST_STOP, REQUEST_ESTOP, ASKS };

static void request(enum request which)
{
    bench.judge.causes = (uint32_t)1 << CONTROLLER_FAULT_ESTOP;
    if (which == REQUEST_HOLD)
        (void)stateful_hold(&bench);
    else if (which == REQUEST_STOP)
        stateful_stop(&bench);
    else
        bench.estop.line[0].active = true;
}

/* Without a limit of jerk nothing but some ticks is unavoidable. */
static void no_stop_goes_faster_first(void **state)
{
    (void)state;
    for (enum request which = 0; which < ASKS; which++)
        for (int at = 1; at < 900; at += 23) {
            lay(1, 100 * UNIT);
            if (at % 2 == 0)
                bench.axis_config[0].limit.jerk_q32 =
                    bench.axis_config[0].stop.jerk_q32 = 0;
            enable();
            assert_int_equal(
                stateful_override(&bench, MOTION_CLOCK_WARP_ONE_Q30 / 10),
                MOTION_OK);
            start_ease(1900 * UNIT);
            run(3000);
            assert_int_equal(
                stateful_override(&bench, MOTION_CLOCK_WARP_ONE_Q30),
                MOTION_OK);
            run(at);
            request(which);
            run(4000);
        }
}

/* --- rest is due ------------------------------------------------------------- */

/* The bound of a request is over, whatever keeps the axes from resting. */
static void is_braked_by_its_drives(void)
{
    struct controller *c = &bench.controller;
    assert_int_not_equal(c->rest_by_ns, 0);
    c->rest_by_ns = c->clock_ns + 5 * MS;
    run(5);
    assert_int_equal(c->fault.fault, CONTROLLER_FAULT_NONE);
    /* for no reason of its own */
    bench.judge.reaction = CONTROLLER_REACT_QUICK;
    run(1);
    assert_int_equal(c->fault.fault, CONTROLLER_FAULT_REST);
    assert_int_equal(c->reaction, CONTROLLER_REACT_QUICK);
    assert_int_equal(bench.axis[0].request, HAL_DRIVE_REQUEST_QUICK_STOP);
    run(3000);
    in_state(CONTROLLER_FAULT);
    assert_false(stateful_axis_has_torque(&bench.axis[0]));
}

static void what_does_not_rest_in_time_is_braked_by_its_drives(void **state)
{
    (void)state;
    for (enum request which = REQUEST_HOLD; which < REQUEST_ESTOP; which++) {
        lay(1, 100 * UNIT);
        bench.config.stop_timeout_ns = 2000 * MS;
        enable();
        start_ease(1900 * UNIT);
        run(2000);
        request(which);
        is_braked_by_its_drives();
        lay(1, 1500 * UNIT);
        bench.config.stop_timeout_ns = 2000 * MS;
        enable();
        assert_int_equal(stateful_homing(&bench, 1), MOTION_OK);
        run(1000);
        request(which);
        is_braked_by_its_drives();
    }
}

/* --- outside the range -------------------------------------------------------- */

static void an_axis_just_outside_its_range_is_moved_back(void **state)
{
    static const double out[] = { 1e-6, 0.01, 0.3, 15 };
    (void)state;
    for (size_t k = 0; k < ARRAY_LEN(out); k++)
        for (int side = 0; side < 2; side++) {
            lay(1, side ? 2000 * UNIT + stateful_q32(out[k])
                        : -stateful_q32(out[k]));
            enable();
            run(100);
            (void)stateful_jog(&bench, 0, side ? 2100 * UNIT : -30 * UNIT,
                               50 * UNIT, 0);
            run(100);
            assert_int_equal(
                stateful_jog(&bench, 0, 1000 * UNIT, 250 * UNIT, 0), MOTION_OK);
            run(12000);
            in_state(CONTROLLER_READY);
            stands_at(1000 * UNIT, 0);
        }
}

/* --- a jog that turns round ----------------------------------------------------- */

static void a_hold_on_a_jog_that_turns_trips_nothing(void **state)
{
    (void)state;
    for (int jerk = 0; jerk < 2; jerk++)
        for (int at = 0; at < 500; at += 5) {
            lay(1, 500 * UNIT);
            struct controller_axis_config *config = &bench.axis_config[0];
            config->limit.jerk_q32 = jerk ? 5000 * UNIT : 0;
            config->stop = config->limit;
            bench.axis[0].zone[STATEFUL_HOME].there = false;
            enable();
            (void)stateful_jog(&bench, 0, 2000 * UNIT, 100 * UNIT, 0);
            run(700);
            (void)stateful_jog(&bench, 0, 100 * UNIT, 100 * UNIT, 0);
            run(at);
            (void)stateful_hold(&bench);
            run(3000);
            in_state(CONTROLLER_HOLDING);
        }
}

/* Its stop would rest at the very end of the range, and by rounding two steps
 * behind it: the axis turns round, and was on its way to full speed. */
static void a_stop_of_a_jog_that_turns_at_its_end_stops_it(void **state)
{
    const int64_t end_q32 = INT64_C(611349544030);
    (void)state;
    for (int64_t kind = 0; kind < 3; kind++)
        for (int back = 0; back < 45; back += 2)
            for (int later = 1; later < 40; later += 3) {
                lay(1, INT64_C(566930722806));
                struct controller_axis_config *config = &bench.axis_config[0];
                bench.config.period_ns = 2 * MS;
                config->pos_min_q32 = INT64_C(278062306433);
                config->pos_max_q32 = end_q32;
                config->limit =
                    (struct motion_clock_limit){ INT64_C(543167893123),
                                                 INT64_C(1392929561172),
                                                 INT64_C(7142026950740) };
                config->stop = config->limit;
                bench.axis[0].zone[STATEFUL_HOME].there = false;
                enable();
                (void)stateful_jog(&bench, 0, end_q32, 200 * UNIT, 0);
                run(162);
                stateful_jog_stop(&bench, false);
                run(2);
                (void)stateful_jog(&bench, 0, end_q32, 20 * UNIT, 0);
                run(2);
                (void)stateful_jog(&bench, 0, 85 * UNIT, 200 * UNIT, 0);
                run(back);
                (void)stateful_jog(&bench, 0, config->pos_min_q32, 200 * UNIT,
                                   0);
                run(later);
                if (kind == 0)
                    stateful_stop(&bench);
                else
                    stateful_jog_stop(&bench, kind == 2);
                run(800);
                in_state(CONTROLLER_READY);
            }
}

/* --- drives that go by their own profile ----------------------------------------- */

static void lay_goers(unsigned axes, int64_t start_q32)
{
    lay(axes, start_q32);
    bench.config.stop_timeout_ns = 2000 * MS;
    for (unsigned i = 0; i < axes; i++) {
        bench.axis_config[i].by_goals = true;
        bench.axis_config[i].late_ns = 20000 * MS;
        bench.axis[i].zone[STATEFUL_HOME].there = false;
        bench.axis[i].profile = (struct stateful_profile){
            .there = true,
            .halts = true,
            .delay_ticks = 2,
            .arrive_ticks = 5,
            .busy_ticks = 2,
            .share = 1,
        };
    }
}

static void rests_in(int ticks)
{
    run(ticks);
    in_state(CONTROLLER_READY);
    assert_true(bench.axis[0].vel == 0);
    assert_false(stateful_profile_is_on(&bench.axis[0].profile));
}

static void a_new_goal_and_a_stop_in_one_tick_halt_the_drive(void **state)
{
    (void)state;
    for (int64_t kind = 0; kind < 3; kind++)
        for (int at = 1; at < 1500; at += 111) {
            lay_goers(1, 100 * UNIT);
            enable();
            (void)stateful_jog(&bench, 0, 1900 * UNIT, 250 * UNIT, 0);
            run(at);
            (void)stateful_jog(&bench, 0, 1700 * UNIT, 200 * UNIT, 0);
            if (kind == 0)
                stateful_stop(&bench);
            else
                stateful_jog_stop(&bench, kind == 2);
            rests_in(1500);
        }
}

/* Its prediction is at rest at the goal, the drive is not. */
static void a_late_drive_is_under_way_to_the_same_goal(void **state)
{
    (void)state;
    lay_goers(1, 100 * UNIT);
    bench.axis[0].profile.share = 0.5;
    enable();
    (void)stateful_jog(&bench, 0, 1600 * UNIT, 250 * UNIT, 0);
    run(8000);
    assert_true(bench.axis[0].vel > 0);
    (void)stateful_jog(&bench, 0, 1600 * UNIT, 250 * UNIT, 0);
    run(1);
    in_state(CONTROLLER_MOVING);
    stateful_stop(&bench);
    rests_in(1500);
}

/* Without a halt it runs on in a hold, its prediction does not: sent back, it
 * has further to go than that. */
static void a_drive_that_ran_on_in_a_hold_has_time_for_its_way_back(void **s)
{
    (void)s;
    lay_goers(1, 100 * UNIT);
    bench.axis_config[0].late_ns = 100 * MS;
    bench.axis[0].profile.halts = false;
    enable();
    (void)stateful_jog(&bench, 0, 1600 * UNIT, 250 * UNIT, 0);
    run(100);
    (void)stateful_hold(&bench);
    run(3000);
    (void)stateful_resume(&bench);
    assert_int_equal(stateful_jog(&bench, 0, 100 * UNIT, 250 * UNIT, 0),
                     MOTION_OK);
    for (int n = 0; bench.controller.state != CONTROLLER_READY; n++) {
        assert_true(n < 10000);
        run(1);
    }
    assert_int_equal(bench.controller.fault.fault, CONTROLLER_FAULT_NONE);
    assert_true(bench.axis[0].pos_q32 == 100 * UNIT);
}

/* A drive is ahead of its prediction, which has a limit of jerk.  Sent on to a
 * place that is outside its range, at full speed, and held, it came to rest
 * further in than that, and was sent out again when the hold was over. */
static void an_axis_outside_is_not_sent_out_again(void **state)
{
    (void)state;
    stateful_plain_episode(&bench, 0x6b0791fc, 4000);
    judged("soak", 0x6b0791fc);
}

/* 100 steps of 2^-32 unit at 1 %, less than one in a tick: the drive is there
 * in its time. */
static void a_goal_next_to_nothing_away_is_reached_at_one_percent(void **state)
{
    const struct motion_ease_limit calm = { UNIT, UNIT, 10 * UNIT };
    (void)state;
    lay_goers(1, 100 * UNIT);
    bench.config.period_ns = 4 * MS;
    bench.axis_config[0].late_ns = 250 * MS;
    enable();
    (void)stateful_override(&bench, MOTION_CLOCK_WARP_ONE_Q30 / 100);
    struct motion_track *track = &bench.track[bench.spare][0];
    motion_track_init(track, bench.storage[bench.spare][0], STATEFUL_SEGMENTS,
                      bench.controller.axis[0].target.pos_q32);
    assert_int_equal(motion_ease_append_limited(track, 100 * UNIT + 101, &calm),
                     MOTION_OK);
    assert_int_equal(stateful_start(&bench, 1), MOTION_OK);
    rests_in(400);
    assert_true(bench.axis[0].pos_q32 == 100 * UNIT + 101);
}

/* Episodes of a soak, by their seeds:
 *   - the rate was on its way to just 0 and up again, resumed, when it was held: it
 *     came to 0, went on up, and down again;
 *   - an override in reverse, while the rate rose: what the new ramp began with was
 *     not looked at;
 *   - axes slipped as they sped up or crept: they moved as they were told, and did
 *     not run away;
 *   - an axis that goes to goals ran away while its drive was enabled in the mode of
 *     set points, and nobody watched;
 *   - a second fault, with a drive in a mode of its own, led from a fault that held
 *     to stopping;
 *   - a move that is not in memory as a whole left the range, as its axis had begun
 *     outside;
 *   - a stop while r' rose and the track was at its limit of jerk: all looks went
 *     into ways to bring r' to 0 at once, of which none fitted, and r' rose as if
 *     nothing had been asked for;
 *   - a hold while r' < 0 was on its way up was to begin some ticks later: the rate
 *     went below 0 in these, and the path backwards;
 *   - an axis slipped while its drive homed by itself, and leapt by that when the
 *     drive took set points again: the bench's drive did not begin where it had
 *     measured that it was;
 *   - a fault ended the homing of a drive, and the next homing, of another axis, waited
 *     for that axis's drive to come back from a mode that it never was in;
 *   - an axis ran away, was enabled again and ran away again: the ticks that had been
 *     counted before were not forgotten, and its torque was taken a tick late;
 *   - a stop found nothing for r' > 0 by the time that a candidate was to begin, as it
 *     was not made sooner there: the rate rose further than it must;
 *   - a slow move that was not read further had its drives brake within two ticks at
 *     full rate, before what a stop takes at its rate was left. */
static void episodes_of_a_soak_are_as_they_should_be(void **state)
{
    static const uint64_t seed[] = {
        0x6b08ac16, 0x6b08c808, 0x6b07eb31, 0x6b07eef5, 0x6afd87dd, 0x6afd8885,
        0x6b07f4cd, 0x6b07f649, 0x6b080c9c, 0x6b0810e7, 0x6b082302, 0x6b08339b,
        0x6b08795b, 0x6b084a51, 0x6b08b328, 0x6b083227, 0x6b094c27, 0x6b09febd,
        0x6b0c30b5, 0x6b0ac8f8, 0x6b0fc877, 0x7d2b816e, 0x6b0dbb9f, 0x6b0ddcec,
        0x77368025, 0x7736ed9d, 0x1584,     0x896b10,
    };
    (void)state;
    for (size_t k = 0; k < ARRAY_LEN(seed); k++) {
        stateful_plain_episode(&bench, seed[k], 4000);
        judged("soak", (int64_t)seed[k]);
    }
}

/* Episodes with all that there may be beside drives that follow set points:
 *   - a jog began in the tick after a brake had ended: the judge took the set points
 *     of that for its acceleration;
 *   - a drive took longer to say that it was there than it was allowed;
 *   - torque was to go from a board that does not stop, while it did not;
 *   - a fault in a hold, three times: the search went on by what it had learned within
 *     the limits, and was not at rest in the time that a stop takes. */
static void episodes_of_every_kind_are_as_they_should_be(void **state)
{
    static const uint64_t seed[] = { 0x40001fed, 0x50001215, 0x50001bb7,
                                     0x4000006e, 0x40000797, 0x60000941 };
    (void)state;
    for (size_t k = 0; k < ARRAY_LEN(seed); k++) {
        stateful_episode(&bench, seed[k], 4000);
        judged("soak", (int64_t)seed[k]);
    }
}

static void goals_of_a_refused_start_are_forgotten(void **state)
{
    (void)state;
    lay_goers(2, 500 * UNIT);
    enable();
    const struct motion_ease_limit limit = { 100 * UNIT, 100 * UNIT, 0 };
    struct motion_track *track = &bench.track[bench.spare][1];
    motion_track_init(track, bench.storage[bench.spare][1], STATEFUL_SEGMENTS,
                      600 * UNIT);
    assert_int_equal(motion_ease_append_limited(track, 900 * UNIT, &limit),
                     MOTION_OK);
    assert_int_equal(stateful_start(&bench, 2), MOTION_E_AWAY);
    (void)stateful_jog(&bench, 0, 700 * UNIT, 100 * UNIT, 0);
    run(6000);
    in_state(CONTROLLER_READY);
    assert_true(bench.axis[1].pos_q32 == 500 * UNIT);
}

static void a_drive_that_stands_short_of_its_goal_is_stopped(void **state)
{
    (void)state;
    lay_goers(1, 100 * UNIT);
    bench.axis[0].profile.short_q32 = 2 * UNIT;
    enable();
    (void)stateful_jog(&bench, 0, 600 * UNIT, 250 * UNIT, 0);
    run(5000);
    in_state(CONTROLLER_MOVING);
    stateful_stop(&bench);
    rests_in(50);
}

/* v = 50, a = 2: as gently as it began, it would take 25 s. */
static void a_calm_way_is_halted_in_a_second(void **state)
{
    const struct motion_ease_limit calm = { 50 * UNIT, 2 * UNIT, 0 };
    (void)state;
    for (int share = 10; share <= 100; share += 45) {
        lay_goers(1, 10 * UNIT);
        enable();
        (void)stateful_override(&bench,
                                MOTION_CLOCK_WARP_ONE_Q30 / 100 * share);
        struct motion_track *track = &bench.track[bench.spare][0];
        motion_track_init(track, bench.storage[bench.spare][0],
                          STATEFUL_SEGMENTS,
                          bench.controller.axis[0].target.pos_q32);
        assert_int_equal(motion_ease_append_limited(track, 1900 * UNIT, &calm),
                         MOTION_OK);
        assert_int_equal(stateful_start(&bench, 1), MOTION_OK);
        run(20000);
        stateful_hold(&bench);
        run(1100);
        in_state(CONTROLLER_HOLDING);
        assert_true(bench.axis[0].vel == 0);
        (void)stateful_resume(&bench);
        run(5000);
        stateful_stop(&bench);
        run(28000); /* the clock has the track's ramps */
        in_state(CONTROLLER_READY);
    }
}

static void a_stop_quick_stops_a_drive_without_a_halt(void **state)
{
    (void)state;
    lay_goers(1, 100 * UNIT);
    bench.axis[0].profile.halts = false;
    enable();
    (void)stateful_jog(&bench, 0, 1900 * UNIT, 250 * UNIT, 0);
    run(2000);
    (void)stateful_hold(&bench); /* it runs on */
    run(500);
    assert_true(bench.axis[0].vel > 200);
    stateful_stop(&bench);
    run(300);
    in_state(CONTROLLER_FAULT);
    assert_int_equal(bench.controller.fault.fault, CONTROLLER_FAULT_REST);
    assert_true(bench.axis[0].vel == 0);
    assert_false(stateful_axis_has_torque(&bench.axis[0]));
}

static void a_halting_drive_stops_for_a_limit_switch(void **state)
{
    (void)state;
    lay_goers(1, 500 * UNIT);
    bench.axis[0].profile.delay_ticks = 100;
    bench.axis[0].zone[STATEFUL_NEGATIVE].high_q32 = 300 * UNIT;
    enable();
    (void)stateful_jog(&bench, 0, 100 * UNIT, 250 * UNIT, 0);
    while (bench.axis[0].pos_q32 > 305 * UNIT)
        run(1);
    bench.judge.causes = UINT32_MAX;
    stateful_stop(&bench);
    run(500);
    in_state(CONTROLLER_FAULT);
    assert_int_equal(bench.controller.fault.fault,
                     CONTROLLER_FAULT_LIMIT_SWITCH);
}

static void an_axis_by_goals_that_is_up_first_stays(void **state)
{
    (void)state;
    lay_goers(2, 700 * UNIT);
    bench.axis[0].droop_q32 = stateful_q32(0.1);
    bench.axis[1].enable_ticks = 3000;
    stateful_begin(&bench);
    run(1);
    assert_int_equal(stateful_enable(&bench), MOTION_OK);
    run(3200);
    in_state(CONTROLLER_READY);
    assert_true(llabs(bench.axis[0].pos_q32 - 700 * UNIT) < UNIT / 5);
}

/* The drive was sent at 100 %, and is at its goal long before the clock, which
 * is stopped on the way. */
static void
an_axis_that_arrived_before_its_track_stands_at_its_goal(void **state)
{
    (void)state;
    lay_goers(1, 100 * UNIT);
    enable();
    start_ease(1900 * UNIT);
    run(300);
    assert_int_equal(stateful_override(&bench, MOTION_CLOCK_WARP_ONE_Q30 / 10),
                     MOTION_OK);
    for (int n = 0; n < 20000; n++) {
        run(1);
        if (bench.controller.axis[0].leg.at == 1)
            break;
    }
    in_state(CONTROLLER_MOVING);
    assert_true(bench.controller.axis[0].target.pos_q32 != 1900 * UNIT);
    stateful_stop(&bench);
    rests_in(3000);
    assert_true(bench.controller.axis[0].target.pos_q32 == 1900 * UNIT);
    bench.axis_config[0].late_ns = 100 * MS;
    assert_int_equal(stateful_jog(&bench, 0, 100 * UNIT, 250 * UNIT, 0),
                     MOTION_OK);
    rests_in(12000);
    assert_true(bench.axis[0].pos_q32 == 100 * UNIT);
}

static void an_axis_by_goals_is_watched_where_it_stands(void **state)
{
    (void)state;
    lay_goers(1, 100 * UNIT);
    enable();
    assert_int_equal(stateful_jog(&bench, 0, 300 * UNIT, 250 * UNIT, 0),
                     MOTION_OK);
    rests_in(5000);
    bench.judge.causes = (uint32_t)1 << CONTROLLER_FAULT_FOLLOWING;
    bench.axis[0].slip_q32 = 2 * UNIT;
    run(20);
    in_state(CONTROLLER_FAULT);
    assert_int_equal(bench.controller.fault.fault, CONTROLLER_FAULT_FOLLOWING);
}

/* --- one command after another --------------------------------------------- */

/* The drive is asked for the mode of homing, and says so some ticks later. */
static void a_jog_after_homing_that_was_stopped_moves_the_axis(void **state)
{
    (void)state;
    for (int after = 1; after < 12; after++) {
        lay(1, 700 * UNIT);
        bench.axis[0].homes = true;
        bench.home[0].by = HOMING_DRIVE;
        enable();
        assert_int_equal(stateful_homing(&bench, 1), MOTION_OK);
        stateful_stop(&bench);
        run(after);
        for (int n = 0; n < 200; n++) {
            if (stateful_jog(&bench, 0, 800 * UNIT, 250 * UNIT, 0) == MOTION_OK)
                break;
            run(1);
        }
        run(3000);
        in_state(CONTROLLER_READY);
        stands_at(800 * UNIT, 0);
    }
}

/* The drive of the second axis refuses another mode while its axis, held back,
 * still comes up to its set point: it was in none, and there is nothing to wait
 * for. */
static void a_homing_that_a_fault_ended_leaves_nothing_to_the_next(void **state)
{
    (void)state;
    lay(2, 700 * UNIT);
    bench.axis[0].homes = true;
    bench.home[0].by = HOMING_DRIVE;
    bench.axis_config[1].following_floor_q32 = 1000 * UNIT;
    enable();
    assert_int_equal(stateful_homing(&bench, 1), MOTION_OK);
    assert_true(run_to(HOMING_RUN));
    bench.judge.causes = (uint32_t)1 << CONTROLLER_FAULT_DRIVE;
    bench.axis[0].state = HAL_DRIVE_FAULT;
    run(100);
    in_state(CONTROLLER_FAULT);
    assert_int_equal(stateful_reset(&bench), MOTION_OK);
    run(100);
    assert_int_equal(stateful_enable(&bench), MOTION_OK);
    run(20);
    in_state(CONTROLLER_READY);
    bench.axis[1].lag_s = 0.5;
    assert_int_equal(stateful_homing(&bench, 2), MOTION_OK);
    run(500);
    stateful_stop(&bench);
    for (int n = 0; n < 1000 && homing_is_running(&bench.homing); n++)
        run(1);
    assert_false(homing_is_running(&bench.homing));
    in_state(CONTROLLER_READY);
    assert_true(bench.axis[1].vel < -10);
}

/* The jog is on its way to rest already; the second stop goes on with that. */
static void a_stop_of_a_jog_that_is_held_ends_in_ready(void **state)
{
    (void)state;
    for (int n = 0; n < 200; n += 3) {
        lay(1, 700 * UNIT);
        enable();
        assert_int_equal(stateful_jog(&bench, 0, 1500 * UNIT, 250 * UNIT, 0),
                         MOTION_OK);
        run(5 + n);
        stateful_jog_stop(&bench, false);
        (void)stateful_hold(&bench);
        run(2);
        stateful_jog_stop(&bench, false);
        run(3000);
        in_state(CONTROLLER_READY);
    }
}

/* A master that counts, a follower in metres: what its curve bends by is 10^-12 of a
 * metre per count^2, and yet what it may be jogged by. */
static void lay_cam(int64_t every_q32)
{
    static const double place[] = { 0, 0.05, 0.01, 0.06, 0.02 };
    struct stateful_coupling *own = &bench.coupling[1];
    struct motion_state from = { .pos_q32 = 0 };
    lay(2, 0);
    for (unsigned i = 0; i < 2; i++) {
        bench.axis_config[i].pos_min_q32 = -bench.axis_config[i].pos_max_q32;
        bench.axis_config[i].following_floor_q32 = 1000000 * UNIT;
        for (int which = 0; which < STATEFUL_SWITCHES; which++)
            bench.axis[i].zone[which].there = false;
    }
    bench.axis_config[0].pos_max_q32 = 1000000 * UNIT;
    bench.axis_config[0].limit = bench.axis_config[0].stop =
        (struct motion_clock_limit){ 400000 * UNIT, 6000000 * UNIT,
                                     40000000 * UNIT };
    bench.axis_config[1].limit = bench.axis_config[1].stop =
        (struct motion_clock_limit){ UNIT / 5, 8 * UNIT / 5, 32 * UNIT };
    own->cam = (struct controller_cam){ .track = &own->track,
                                        .high_q32 = 4 * every_q32 };
    own->cam.shift = controller_cam_shift(0, 4 * every_q32);
    motion_track_init(&own->track, own->segment, STATEFUL_CURVE_SEGMENTS, 0);
    for (int k = 1; k < 5; k++) {
        const struct motion_state to = { .pos_q32 = stateful_q32(place[k]) };
        int64_t dur_ns_q12;
        assert_int_equal(motion_fixed_mulshift(every_q32, MOTION_FIXED_S_Q12,
                                               32u + own->cam.shift,
                                               &dur_ns_q12),
                         MOTION_OK);
        assert_int_equal(
            motion_track_append_quintic(&own->track, dur_ns_q12, &from, &to),
            MOTION_OK);
        from = to;
    }
    assert_int_equal(controller_cam_init(&own->cam), MOTION_OK);
}

static void a_master_that_counts_keeps_its_followers_limits(void **state)
{
    (void)state;
    for (int64_t every = 20000; every < 220000; every += 40000)
        for (int at = 0; at < 3000; at += 700) {
            lay_cam(every * UNIT);
            enable();
            assert_int_equal(stateful_couple(&bench, 1), MOTION_OK);
            assert_int_equal(
                stateful_jog(&bench, 0, 4 * every * UNIT, 400000 * UNIT, 0),
                MOTION_OK);
            run(at);
            stateful_jog_stop(&bench, false);
            run(4000);
            in_state(CONTROLLER_READY);
        }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_stop_in_the_tick_homing_begins_stops_it),
        cmocka_unit_test(a_stop_after_any_change_of_homing_stops_it),
        cmocka_unit_test(homing_under_an_override_heeds_switches_and_stops),
        cmocka_unit_test(homing_that_is_held_heeds_switches),
        cmocka_unit_test(a_jog_ends_with_its_time_whatever_the_clock_does),
        cmocka_unit_test(a_jog_and_a_stop_in_one_tick_are_a_stop),
        cmocka_unit_test(an_axis_that_is_up_first_stays_where_it_is),
        cmocka_unit_test(an_axis_that_is_up_first_is_watched),
        cmocka_unit_test(drives_are_enabled_from_off_alone),
        cmocka_unit_test(no_set_point_leaps_after_lost_ticks),
        cmocka_unit_test(no_stop_goes_faster_first),
        cmocka_unit_test(what_does_not_rest_in_time_is_braked_by_its_drives),
        cmocka_unit_test(an_axis_just_outside_its_range_is_moved_back),
        cmocka_unit_test(a_hold_on_a_jog_that_turns_trips_nothing),
        cmocka_unit_test(a_stop_of_a_jog_that_turns_at_its_end_stops_it),
        cmocka_unit_test(a_new_goal_and_a_stop_in_one_tick_halt_the_drive),
        cmocka_unit_test(a_late_drive_is_under_way_to_the_same_goal),
        cmocka_unit_test(
            a_drive_that_ran_on_in_a_hold_has_time_for_its_way_back),
        cmocka_unit_test(an_axis_outside_is_not_sent_out_again),
        cmocka_unit_test(a_goal_next_to_nothing_away_is_reached_at_one_percent),
        cmocka_unit_test(episodes_of_a_soak_are_as_they_should_be),
        cmocka_unit_test(episodes_of_every_kind_are_as_they_should_be),
        cmocka_unit_test(goals_of_a_refused_start_are_forgotten),
        cmocka_unit_test(a_drive_that_stands_short_of_its_goal_is_stopped),
        cmocka_unit_test(a_calm_way_is_halted_in_a_second),
        cmocka_unit_test(a_stop_quick_stops_a_drive_without_a_halt),
        cmocka_unit_test(a_halting_drive_stops_for_a_limit_switch),
        cmocka_unit_test(an_axis_by_goals_that_is_up_first_stays),
        cmocka_unit_test(
            an_axis_that_arrived_before_its_track_stands_at_its_goal),
        cmocka_unit_test(an_axis_by_goals_is_watched_where_it_stands),
        cmocka_unit_test(a_jog_after_homing_that_was_stopped_moves_the_axis),
        cmocka_unit_test(
            a_homing_that_a_fault_ended_leaves_nothing_to_the_next),
        cmocka_unit_test(a_stop_of_a_jog_that_is_held_ends_in_ready),
        cmocka_unit_test(a_master_that_counts_keeps_its_followers_limits),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
