/* tests/firmware/control/test_gate.c - the last gate lets pass what is legal, of any
 * unit, rate and ratio, and nothing that is beyond by more than rounding makes.
 *
 * Random moves use the whole of their limits, which are made of their own peaks, at
 * 100 % or at a rate up to 200 %; axes are of 10^-3 to 10^9 units/s, ticks of 62.5 us to
 * 20 ms, ratios up to 1000.
 *
 *   N=100000 build/tests/firmware/control/test_gate       SEED=17 N=1 ... */
#include <stdlib.h>
#include <string.h>

#include "firmware/control/gear.h"
#include "firmware/control/jog.h"
#include "firmware/control/parts.h"
#include "motion/core/err.h"
#include "motion/core/fixed.h"
#include "motion/curve/ease.h"
#include "motion/plan/move.h"
#include "tests/firmware/control/difference.h"
#include "tests/firmware/control/ideal_drive.h"

#define AXES 3
#define KEYS 6

static struct ideal_drive drive[AXES];
static struct controller controller;
static struct controller_axis axes[AXES];
static struct controller_axis_config configs[AXES];
static struct controller_jog jog;
static struct motion_track track[AXES];
static struct difference past[AXES];
static unsigned count, round_of;

static int64_t q32(long double value)
{
    return llrintl(value * 0x1p32L);
}

static long double draw_in(long double low, long double high)
{
    return low + (high - low) * draw_unit();
}

static bool draw_one_of(uint32_t many)
{
    return draw_below(many) == 0;
}

static void draw_period(void)
{
    static const int64_t periods[] = { 62500,   125000,  250000,
                                       1000000, 4000000, 20000000 };
    ideal_period_ns = periods[draw_below(ARRAY_LEN(periods))];
}

/* Every drive stands where its track begins. */
static void build(void)
{
    struct hal_drive *drives[AXES];
    const struct controller_config config = { .period_ns = ideal_period_ns,
                                              .axis_count = count,
                                              .axis = configs };
    memset(&jog, 0, sizeof jog);
    memset(drive, 0, sizeof drive);
    memset(past, 0, sizeof past);
    for (unsigned i = 0; i < count; i++) {
        drive[i].drive.ops = &ideal_drive_ops;
        if (track[i].count > 0)
            drive[i].given.pos_q32 = track[i].segment[0].pos_q32;
        drives[i] = &drive[i].drive;
        past[i].error = difference_error(
            &track[i], difference_units(configs[i].limit.vel_q32));
    }
    now_ns = 1000 * MS;
    assert_int_equal(controller_init(&controller, &config, axes, drives, NULL),
                     MOTION_OK);
    controller_step(&controller, now_ns,
                    (struct hal_fieldbus_worst){ HAL_FIELDBUS_GOOD, 0 });
    assert_int_equal(controller_enable(&controller), MOTION_OK);
    for (int n = 0; n < 4; n++) {
        now_ns += ideal_period_ns;
        controller_step(&controller, now_ns,
                        (struct hal_fieldbus_worst){ HAL_FIELDBUS_GOOD, 0 });
    }
    assert_int_equal(controller.state, CONTROLLER_READY);
}

static void no_gate(const char *what)
{
    const struct controller_fault_record *fault = &controller.fault;
    if (fault->fault == CONTROLLER_FAULT_GATE)
        fail_msg("round %u, %s: axis %d, period %" PRId64
                 " ns: %.12Lg over %.12Lg, by %" PRId64 " of 2^-32",
                 round_of, what, fault->axis, ideal_period_ns,
                 difference_units(fault->value), difference_units(fault->limit),
                 (int64_t)llabs(fault->value) - fault->limit);
}

/* What is let pass counts on that. */
static void ends_in_its_target(const char *what)
{
    const struct motion_clock_warp *warp = &controller.warp;
    if (warp->count == 0)
        return;
    const int64_t *k_q56 = warp->piece[warp->count - 1].k_q56;
    const int64_t end_q56 = k_q56[0] + 2 * k_q56[1] + 3 * k_q56[2];
    const long double off = fabsl((long double)end_q56 * 0x1p-56L -
                                  (long double)warp->rate1_q30 * 0x1p-30L);
    if (off > 0x1p-31L + 0x1p-50L)
        fail_msg("round %u, %s: a ramp ends %.3Lg beside its rate", round_of,
                 what, off);
}

static void tick(const char *what, bool jerk)
{
    now_ns += ideal_period_ns;
    controller_step(&controller, now_ns,
                    (struct hal_fieldbus_worst){ HAL_FIELDBUS_GOOD, 0 });
    controller_jog_step(&controller, &jog);
    no_gate(what);
    ends_in_its_target(what);
    for (unsigned i = 0; i < count; i++) {
        struct motion_clock_limit limit = configs[i].stop;
        difference_push(&past[i], drive[i].given.pos_q32);
        if (!jerk)
            limit.jerk_q32 = 0;
        const char *over = difference_judge(&past[i], &limit, ideal_period_ns);
        if (over != NULL && controller.reaction < CONTROLLER_REACT_QUICK)
            fail_msg("round %u, %s: axis %u, period %" PRId64
                     " ns: %s: %.12Lg, %.12Lg, %.12Lg of the limits",
                     round_of, what, i, ideal_period_ns, over, past[i].most[0],
                     past[i].most[1], past[i].most[2]);
    }
}

/* --- moves at their limits ------------------------------------------------------ */

enum kind { PARABOLIC, SINE, S_CURVE, QUINTIC, SPLINE, KINDS };

static int append(struct motion_track *to, enum kind kind, int64_t place_q32,
                  int64_t dur_ns_q12)
{
    const struct motion_state start = { 0 }, end = { .pos_q32 = place_q32 };
    static const enum motion_ease_law law[] = { MOTION_EASE_PARABOLIC,
                                                MOTION_EASE_SINE,
                                                MOTION_EASE_SCURVE };
    if (kind == QUINTIC)
        return motion_track_append_quintic(to, dur_ns_q12, &start, &end);
    return motion_ease_append(to, law[kind], place_q32, dur_ns_q12,
                              q32(draw_in(0.1L, 0.5L)),
                              q32(draw_in(0.5L, 0.9L)));
}

/* Through keys `far` apart at most, each `dur` from the one before. */
static bool draw_spline(struct motion_track *to, long double far,
                        long double dur_s)
{
    struct plan_key key[KEYS] = { { .place = { 0, 0 } } };
    struct plan_axis axis = { .curve = PLAN_CURVE_C2,
                              .key = key,
                              .key_count = KEYS };
    struct plan_error error;
    for (unsigned k = 0; k < KEYS; k++)
        key[k].key = (struct motion_key){
            .t_ns_q12 = llrintl(dur_s * k * (long double)MOTION_FIXED_S_Q12),
            .pos_q32 = k == 0 ? 0 : q32(draw_in(-far, far)),
        };
    return plan_axis_track(&axis, to, &error) >= 0;
}

/* Goes at up to 10^-3 .. 10^9 units/s, each leg in 10 to 3000 ticks. */
static bool draw_track(unsigned i, enum kind kind, long double period_s)
{
    const long double ticks = 10 * powl(300, draw_unit());
    const long double dur_s = ticks * period_s;
    const long double vel = powl(10, draw_in(-3, 9));
    const long double far = fminl(vel * dur_s / 2, 5e8L);
    int err = MOTION_OK;
    plan_track_free(&track[i]);
    if (kind == SPLINE)
        return draw_spline(&track[i], far, dur_s);
    track[i].segment = calloc(128, sizeof *track[i].segment);
    motion_track_init(&track[i], track[i].segment, 128,
                      q32(draw_in(-far, far)));
    for (unsigned legs = 1 + draw_below(3); legs > 0 && err == MOTION_OK;
         legs--)
        err = append(&track[i], kind, q32(draw_in(-far, far)),
                     llrintl(dur_s * (long double)MOTION_FIXED_S_Q12));
    return err == MOTION_OK;
}

/* At this rate it uses the whole of them.  False: beyond what there is. */
static bool limits_of(unsigned i, long double rate, bool jerk)
{
    static const long double stops[] = { 1, 1, 1.5L };
    struct controller_axis_config *config = &configs[i];
    const long double by = stops[draw_below(3)];
    struct motion_extreme pos;
    long double most[4];
    for (int k = 1; k < 4; k++)
        most[k] =
            (long double)controller_peak(&track[i], (enum motion_quantity)k) *
                powl(rate, k) +
            1;
    if (most[1] < 16 || most[2] < 16 || most[2] * by > 0x1p62L ||
        most[3] * by > 0x1p62L)
        return false;
    motion_track_extreme(&track[i], MOTION_POS, &pos);
    *config = (struct controller_axis_config){
        .pos_min_q32 = pos.min - (draw_one_of(2) ? 1 : UNIT),
        .pos_max_q32 = pos.max + (draw_one_of(2) ? 1 : UNIT),
        .limit = { (int64_t)most[1], (int64_t)most[2],
                   jerk ? (int64_t)most[3] : 0 },
        .following_floor_q32 = INT64_MAX / 4,
    };
    config->stop = (struct motion_clock_limit){
        config->limit.vel_q32,
        (int64_t)((long double)config->limit.acc_q32 * by),
        (int64_t)((long double)config->limit.jerk_q32 * by)
    };
    return true;
}

static bool draw_move(long double rate)
{
    const bool jerk = draw_one_of(2);
    draw_period();
    count = 1 + draw_below(AXES);
    for (unsigned i = 0; i < count; i++)
        if (!draw_track(i, (enum kind)draw_below(KINDS),
                        (long double)ideal_period_ns * 1e-9L) ||
            !limits_of(i, rate, jerk))
            return false;
    build();
    return true;
}

static void act(void)
{
    const int64_t most_q30 = controller.override_max_q30;
    switch (draw_below(8)) {
    case 0:
        (void)controller_hold(&controller);
        break;
    case 1:
        if (draw_one_of(4))
            controller_stop(&controller);
        break;
    case 2:
        (void)controller_override(&controller, most_q30);
        break;
    default:
        (void)controller_override(
            &controller, (int64_t)((long double)most_q30 * draw_unit()));
        break;
    }
}

/* Whatever an operator does with it: it is stopped, or comes to an end. */
static void play(unsigned tracks, bool jerk)
{
    const struct motion_track *of[AXES] = { NULL };
    unsigned acts = draw_below(6);
    for (unsigned i = 0; i < tracks; i++)
        of[i] = &track[i];
    (void)controller_override(&controller, MOTION_CLOCK_WARP_MAX_Q30);
    assert_int_equal(controller_start(&controller, of, NULL), MOTION_OK);
    for (unsigned n = 0; controller.state != CONTROLLER_READY &&
                         controller.state != CONTROLLER_FAULT;
         n++) {
        tick("a move", jerk);
        if (acts > 0 && draw_one_of(64)) {
            act();
            acts--;
        }
        if (controller.state == CONTROLLER_HOLDING &&
            controller.rate.rate_q30 == 0) {
            if (draw_one_of(3))
                (void)controller_reverse(&controller, !controller.is_reversed);
            (void)controller_resume(&controller);
        }
        if (controller.wanted_q30 < MOTION_CLOCK_WARP_ONE_Q30 / 4 &&
            controller.state == CONTROLLER_MOVING && draw_one_of(64))
            (void)controller_override(&controller, controller.override_max_q30);
        if (n > 60000)
            controller_stop(&controller);
    }
}

static unsigned rounds(unsigned all)
{
    const char *given = getenv("N");
    return given ? (unsigned)strtoul(given, NULL, 0) : all;
}

static void a_legal_move_never_trips_it(void **state)
{
    unsigned played = 0, quick = 0;
    long double most[3] = { 0 };
    (void)state;
    seed_from("moves");
    for (round_of = 0; played < rounds(300); round_of++) {
        const unsigned top = draw_below(3);
        if (!draw_move(top == 0 ? 1 : top == 1 ? draw_in(1, 2) : 2))
            continue;
        play(count, false);
        played++;
        quick += controller.reaction >= CONTROLLER_REACT_QUICK;
        for (unsigned i = 0; i < count; i++)
            for (int k = 0; k < 2; k++)
                most[k] = fmaxl(most[k], past[i].most[k]);
    }
    print_message("%u moves: %.12Lf of the speeds, %.12Lf of the "
                  "accelerations; %u quick stops\n",
                  played, most[0], most[1], quick);
    assert_true(most[0] > 0.999L && most[1] > 0.999L);
    for (unsigned i = 0; i < AXES; i++)
        plan_track_free(&track[i]);
}

/* --- jogs, and what follows them --------------------------------------------------- */

enum { MASTER, FIRST };

static struct controller_cam cam[AXES];
static struct motion_segment straight[AXES][CONTROLLER_GEAR_SEGMENTS];

/* Full speed takes 3 to 1000 ticks, full acceleration a tenth of that to as long, or
 * no time. */
static void draw_limits(struct controller_axis_config *config, long double vel,
                        long double period_s)
{
    static const long double stops[] = { 1, 1.5L, 5 };
    const long double takes_s = period_s * 3 * powl(300, draw_unit());
    const long double acc = fminl(fmaxl(vel / takes_s, 1e-8L), 4e8L);
    const long double jerk =
        draw_one_of(3)
            ? 0
            : fminl(fmaxl(acc / takes_s * powl(10, draw_unit()), 1e-8L), 4e8L);
    const long double by = stops[draw_below(3)];
    *config = (struct controller_axis_config){
        .pos_min_q32 = -q32(1e9L),
        .pos_max_q32 = q32(1e9L),
        .limit = { q32(vel), q32(acc), q32(jerk) },
        .stop = { q32(vel), q32(acc * by), q32(jerk * by) },
        .following_floor_q32 = INT64_MAX / 4,
    };
}

/* What its drive stands at, beside the curve by no more than may be. */
static void stands_beside(unsigned i)
{
    struct motion_cursor cursor = { 0 };
    struct motion_sample curve;
    const int64_t window_q32 = cam[i].window_q32;
    controller_cam_at(&cam[i], &cursor, axes[MASTER].target.pos_q32, &curve);
    drive[i].given.pos_q32 =
        curve.pos_q32 +
        check_random_in(check_stream(), -window_q32, window_q32);
    axes[i].sent_count = 0; /* it was pushed there */
    past[i].count = 0;
    tick("standing", false);
}

/* Over +-reach of the master; how long that is as time. */
static long double begin_cam(unsigned i, long double reach)
{
    cam[i] = (struct controller_cam){
        .master = MASTER,
        .track = &track[i],
        .low_q32 = -q32(reach),
        .high_q32 = q32(reach),
        .shift = controller_cam_shift(-q32(reach), q32(reach)),
    };
    return ldexpl(2 * reach, -cam[i].shift);
}

static bool draw_gear(unsigned i, long double ratio, long double reach)
{
    const long double long_s = begin_cam(i, reach);
    track[i].segment = calloc(1, sizeof *track[i].segment);
    motion_track_init(&track[i], track[i].segment, 1, -q32(ratio * reach));
    return motion_track_append_line(
               &track[i], llrintl(long_s * (long double)MOTION_FIXED_S_Q12),
               q32(ratio * reach)) == MOTION_OK;
}

static bool draw_cam(unsigned i, long double ratio, long double reach)
{
    const long double every_s = begin_cam(i, reach) / (KEYS - 1);
    if (!draw_spline(&track[i], ratio * 2 * reach / (KEYS - 1), every_s) ||
        motion_fixed_muldiv(track[i].end_ns_q12, UNIT << cam[i].shift,
                            MOTION_FIXED_S_Q12, &cam[i].high_q32) < 0)
        return false;
    cam[i].high_q32 += cam[i].low_q32;
    return true;
}

static bool draw_engaged(unsigned i, long double ratio, long double reach)
{
    const bool back = axes[MASTER].target.vel_q32 < 0;
    const long double sign = back ? -1 : 1;
    const int64_t ahead_q32 =
        q32(sign * fabsl(difference_units(axes[MASTER].target.vel_q32)) *
                (long double)ideal_period_ns * 1e-8L +
            sign * 1e-8L);
    const struct controller_gear gear = {
        .ratio_q32 = q32(ratio),
        .place_q32 = axes[i].target.pos_q32,
        .begin_q32 = axes[MASTER].target.pos_q32 + ahead_q32,
        .over_q32 = q32(reach * draw_in(0.001L, 0.3L)),
        .low_q32 = -q32(reach),
        .high_q32 = q32(reach),
        .is_backwards = back,
    };
    cam[i].master = MASTER;
    motion_track_init(&track[i], straight[i], CONTROLLER_GEAR_SEGMENTS, 0);
    return controller_gear_cam(&gear, &track[i], &cam[i]) == MOTION_OK;
}

static bool couple(unsigned i, long double ratio, long double reach,
                   bool on_way)
{
    if (track[i].segment != straight[i])
        plan_track_free(&track[i]);
    const bool is_made = on_way           ? draw_engaged(i, ratio, reach)
                         : draw_one_of(2) ? draw_gear(i, ratio, reach)
                                          : draw_cam(i, ratio, reach);
    if (!is_made || controller_cam_init(&cam[i]) < 0)
        return false;
    if (!on_way)
        stands_beside(i);
    if (controller_couple(&controller, i, &cam[i]) < 0)
        return false;
    past[i].error = difference_error(&track[i], 0) +
                    difference_units(cam[i].slope_q32) * past[MASTER].error;
    return true;
}

static void jog_somewhere(long double reach)
{
    const struct controller_jog_goal goal = {
        .axis = MASTER,
        .pos_q32 = q32(draw_in(-reach, reach)),
        .vel_q32 = 1 + q32(difference_units(configs[MASTER].limit.vel_q32) *
                           (draw_one_of(2) ? 1 : draw_unit())),
    };
    (void)controller_jog(&controller, &jog, &goal);
}

static void act_on_jog(long double reach, bool stops)
{
    switch (stops ? draw_below(8) : 0) {
    case 1:
        controller_jog_stop(&controller, &jog, false);
        break;
    case 2:
        controller_jog_stop(&controller, &jog, true);
        break;
    case 3:
        (void)controller_hold(&controller);
        break;
    case 4:
        (void)controller_resume(&controller);
        break;
    default:
        jog_somewhere(reach);
        break;
    }
}

/* True: something followed. */
static bool play_jogs(void)
{
    const long double period_s = (long double)ideal_period_ns * 1e-9L;
    const long double vel = powl(10, draw_in(-3, 9));
    const long double reach =
        fminl(vel * period_s * 30 * powl(100, draw_unit()), 5e8L);
    const bool stops = draw_one_of(2), on_way = draw_one_of(3);
    bool any = false;
    long double ratio[AXES];
    count = 2 + draw_below(AXES - 1);
    for (unsigned i = 0; i < count; i++) {
        const long double most = fminl(1000, 4e8L / fmaxl(reach, vel));
        ratio[i] = most * powl(1e-6L, draw_unit()) * (draw_one_of(2) ? -1 : 1);
        draw_limits(&configs[i],
                    i == MASTER ? vel
                                : fmaxl(fminl(fabsl(ratio[i]) * vel *
                                                  powl(10, draw_in(-1, 1)),
                                              1e9L),
                                        1e-6L),
                    period_s);
        if (!stops)
            configs[i].stop = configs[i].limit;
        track[i].count = 0;
    }
    build();
    for (unsigned i = FIRST; i < count && !on_way; i++)
        any = couple(i, ratio[i], reach, false) || any;
    jog_somewhere(reach);
    for (unsigned n = 0, acts = 4; acts > 0 && n < 6000; n++) {
        tick("a jog", true);
        if (on_way && n > 4 && draw_one_of(32))
            for (unsigned i = FIRST; i < count; i++)
                any =
                    (axes[i].cam == NULL && couple(i, ratio[i], reach, true)) ||
                    any;
        if (draw_one_of(100) || controller.state == CONTROLLER_READY) {
            act_on_jog(reach, stops);
            acts--;
        }
        assert_int_equal(controller.fault.fault, CONTROLLER_FAULT_NONE);
    }
    return any;
}

static void a_legal_jog_and_what_follows_it_never_trip_it(void **state)
{
    unsigned played = 0;
    long double most[3] = { 0 };
    (void)state;
    seed_from("jogs");
    for (unsigned i = 0; i < AXES; i++)
        track[i] = (struct motion_track){ .segment = NULL };
    for (round_of = 0; played < rounds(300); round_of++) {
        draw_period();
        if (!play_jogs())
            continue;
        played++;
        for (unsigned i = FIRST; i < count; i++)
            for (int k = 0; k < 3; k++)
                most[k] = fmaxl(most[k], past[i].most[k]);
    }
    print_message("%u of %u: followers: %.9Lf of the speeds, %.9Lf of the "
                  "accelerations, %.9Lf of the jerks\n",
                  played, round_of, most[0], most[1], most[2]);
    assert_true(most[0] > 0.99L && most[1] > 0.99L && most[2] > 0.99L);
    for (unsigned i = 0; i < AXES; i++)
        if (track[i].segment != straight[i])
            plan_track_free(&track[i]);
}

/* --- moves of a master alone ------------------------------------------------------ */

/* As little as lets it be taken along at the master's limits.  What its slopes are
 * times the speed is rounded to 2^-32 too. */
static bool limits_to_follow(unsigned i)
{
    const struct motion_clock_limit *by = &configs[MASTER].limit;
    const bool bends = cam[i].second_q32 > 0;
    const long double vel = difference_units(by->vel_q32);
    const long double acc = difference_units(by->acc_q32);
    const long double jerk = difference_units(by->jerk_q32);
    const long double slope = difference_units(cam[i].slope_q32) * (1 + 1e-8L);
    const int shift = cam[i].shift;
    const long double bits =
        1 + ldexpl(0x1p-29L, shift) / vel; /* a speed's bits */
    const long double second =
        ldexpl(difference_units(cam[i].second_q32), -2 * shift) * bits +
        0x1p-31L / vel;
    const long double third =
        ldexpl(difference_units(cam[i].third_q32), -3 * shift) * bits +
        0x1p-31L / vel * (1 + 1 / vel);
    const long double most_acc =
        bends ? 2 * fmaxl(slope * acc, second * vel * vel) : slope * acc;
    const long double most_jerk =
        jerk == 0 ? 0
        : bends   ? 3 * fmaxl(slope * jerk, fmaxl(3 * second * vel * acc,
                                                  third * vel * vel * vel))
                  : slope * jerk;
    if (slope * vel > 1e9L || most_acc > 1e9L || most_jerk > 1e9L)
        return false;
    configs[i] = (struct controller_axis_config){
        .pos_min_q32 = -q32(2e9L),
        .pos_max_q32 = q32(2e9L),
        .limit = { 64 + q32(slope * vel), 64 + q32(most_acc),
                   jerk == 0 ? 0 : 64 + q32(most_jerk) },
        .following_floor_q32 = INT64_MAX / 4,
    };
    configs[i].stop = configs[i].limit;
    return true;
}

/* The master's track is drawn; false: beyond what there is. */
static bool draw_followers(long double reach)
{
    count = 2 + draw_below(AXES - 1);
    for (unsigned i = FIRST; i < count; i++) {
        const long double most = fminl(
            1000, 4e8L / fmaxl(reach, difference_units(
                                          configs[MASTER].limit.vel_q32)));
        const long double ratio =
            most * powl(1e-6L, draw_unit()) * (draw_one_of(2) ? -1 : 1);
        if (track[i].segment != straight[i])
            plan_track_free(&track[i]);
        if (!(draw_one_of(2) ? draw_gear(i, ratio, reach)
                             : draw_cam(i, ratio, reach)) ||
            controller_cam_init(&cam[i]) < 0 ||
            difference_units(cam[i].third_q32) > 1e9L)
            return false;
        if (!limits_to_follow(i))
            return false;
    }
    return true;
}

static bool play_followed(void)
{
    const enum kind kind = (enum kind)draw_below(KINDS);
    const bool jerk = kind == S_CURVE || kind == QUINTIC;
    struct motion_extreme pos;
    draw_period();
    if (!draw_track(MASTER, kind, (long double)ideal_period_ns * 1e-9L) ||
        !limits_of(MASTER, draw_in(1, 2), jerk))
        return false;
    motion_track_extreme(&track[MASTER], MOTION_POS, &pos);
    const long double reach = fmaxl(fabsl(difference_units(pos.min)),
                                    fabsl(difference_units(pos.max)));
    if (!draw_followers(reach * 1.01L + 1e-6L))
        return false;
    for (unsigned i = FIRST; i < count; i++)
        track[i].capacity = track[i].count;
    build();
    for (unsigned i = FIRST; i < count; i++) {
        past[i].error =
            difference_error(&track[i],
                             difference_units(configs[i].limit.vel_q32)) +
            difference_units(cam[i].slope_q32) *
                difference_error(&track[MASTER], 0);
        stands_beside(i);
        if (controller_couple(&controller, i, &cam[i]) < 0)
            return false;
    }
    play(1, jerk);
    return true;
}

static void a_move_of_a_master_takes_any_follower_along(void **state)
{
    unsigned played = 0;
    long double most[3] = { 0 };
    (void)state;
    seed_from("followed");
    for (unsigned i = 0; i < AXES; i++)
        track[i] = (struct motion_track){ .segment = NULL };
    for (round_of = 0; played < rounds(200); round_of++) {
        if (!play_followed())
            continue;
        played++;
        for (unsigned i = FIRST; i < count; i++)
            for (int k = 0; k < 3; k++)
                most[k] = fmaxl(most[k], past[i].most[k]);
    }
    print_message("%u of %u: followers: %.9Lf of the speeds, %.9Lf of the "
                  "accelerations, %.9Lf of the jerks\n",
                  played, round_of, most[0], most[1], most[2]);
    assert_true(most[0] > 0.9L && most[1] > 0.9L);
    for (unsigned i = 0; i < AXES; i++)
        plan_track_free(&track[i]);
}

/* --- where coefficients are coarse ----------------------------------------------- */

/* For hours, over so many units that set points are steps of 2^-27 and more. */
static void a_move_that_goes_far_for_hours_never_trips_it(void **state)
{
    const struct motion_track *of[AXES] = { &track[0] };
    int coarsest = 1;
    (void)state;
    seed_from("far");
    for (round_of = 0; round_of < (unsigned)check_many(8, 2); round_of++) {
        const int64_t far_q32 = q32(draw_in(4e8L, 9e8L));
        ideal_period_ns = 20 * MS;
        count = 1;
        plan_track_free(&track[0]);
        track[0].segment = calloc(2, sizeof *track[0].segment);
        motion_track_init(&track[0], track[0].segment, 2, -far_q32);
        assert_int_equal(append(&track[0], QUINTIC, far_q32,
                                llrintl(draw_in(3, 4) * 3600 *
                                        (long double)MOTION_FIXED_S_Q12)),
                         MOTION_OK);
        assert_true(limits_of(0, 1, true));
        build();
        coarsest = track[0].segment[0].frac < coarsest
                       ? track[0].segment[0].frac
                       : coarsest;
        assert_int_equal(controller_start(&controller, of, NULL), MOTION_OK);
        while (controller.state == CONTROLLER_MOVING)
            tick("a far move", false);
        assert_int_equal(controller.fault.fault, CONTROLLER_FAULT_NONE);
    }
    print_message("steps of 2^%d\n", -32 - coarsest);
    assert_true(coarsest <= -5);
    plan_track_free(&track[0]);
}

/* --- and nothing else --------------------------------------------------------------- */

/* What it lets pass, by halving: the first step, and how far the next may be from it;
 * of what is read from `far`, or from nothing. */
static int64_t lets_pass(bool second, const struct motion_track *far)
{
    struct controller_axis *axis = &axes[0];
    int64_t low = 0, high = INT64_MAX / 4, value, limit;
    while (low < high) {
        const int64_t step = low + (high - low + 1) / 2;
        axis->sent_count = second ? 3 : 2;
        axis->sent_q32[0] = axis->sent_q32[1] = 0;
        axis->track = far;
        axis->sent_far = 0;
        if (!second)
            axis->sent_q32[1] = -step; /* as fast before: no acceleration */
        if (controller_gate_pass(&controller, 0, step, &value, &limit))
            low = step;
        else
            high = step - 1;
    }
    return low;
}

/* Of any axis: more than the limits by less than twice what rounding makes, 2^-28 and
 * the steps of speed that a plan may have. */
static void what_is_beyond_by_more_than_rounding_is_refused(void **state)
{
    long double widest[2] = { 0 };
    (void)state;
    seed_from("bounds");
    count = 1;
    for (round_of = 0; round_of < 2000; round_of++) {
        draw_period();
        const long double period_s = (long double)ideal_period_ns * 1e-9L;
        const long double vel = powl(10, draw_in(-3, 9));
        draw_limits(&configs[0], vel, period_s);
        track[0].count = 0;
        build();
        const struct motion_clock_limit *own = &configs[0].limit;
        const long double acc =
            difference_units(configs[0].stop.acc_q32) * period_s * period_s;
        const long double by_acc =
            difference_units(own->acc_q32) * period_s * period_s;
        const long double by_jerk =
            difference_units(own->jerk_q32) * period_s * period_s * period_s;
        const long double step =
            own->jerk_q32 > 0 ? fminl(by_acc, by_jerk) : by_acc;
        const long double rounding =
            12 * 0x1p-32L + vel * 2e-13L / 0.41L + vel * period_s * 0x1p-29L;
        const long double let[] = {
            difference_units(lets_pass(false, NULL)),
            fmaxl(0, fminl(difference_units(lets_pass(true, NULL)), 1e9L))
        };
        const long double exact[] = { vel * period_s, acc };
        const long double beyond[] = { rounding / 2,
                                       rounding + acc * 0x1p-28L + step / 50 };
        for (int k = 0; k < 2; k++) {
            /* the speed alone judges a first step that is less than both */
            const long double most = fmaxl(exact[k], 0);
            if (k == 1 && acc + beyond[1] > vel * period_s)
                continue;
            if (let[k] < most + beyond[k] - 4 * 0x1p-32L ||
                let[k] > most + 2 * beyond[k] + 8 * 0x1p-32L)
                fail_msg("round %u, period %" PRId64 " ns: %.12Lg is let pass "
                         "of %.12Lg, which may be %.6Lg more",
                         round_of, ideal_period_ns, let[k], most, beyond[k]);
            widest[k] = fmaxl(widest[k], (let[k] - most) / most -
                                             (k == 1 ? step / 50 / most : 0));
        }
    }
    print_message("at the most %.3Lg of a step, %.3Lg of its change beyond the "
                  "limits\n",
                  widest[0], widest[1]);
}

/* 20 q of a track whose steps q are more than 2^-32, for as long as one of the last
 * three set points is of it. */
static void what_is_read_in_coarse_steps_may_be_off_by_them(void **state)
{
    const struct motion_state start = { 0 }, end = { .pos_q32 = q32(1e9L) };
    const struct motion_track *far = &track[0];
    int64_t value, limit;
    (void)state;
    seed_from("steps");
    draw_period();
    draw_limits(&configs[0], 100, (long double)ideal_period_ns * 1e-9L);
    count = 1;
    track[0].count = 0;
    build();
    track[0].segment = calloc(1, sizeof *track[0].segment);
    motion_track_init(&track[0], track[0].segment, 1, -q32(1e9L));
    assert_int_equal(motion_track_append_quintic(
                         &track[0], 3600 * MOTION_FIXED_S_Q12, &start, &end),
                     MOTION_OK);
    const int64_t q = INT64_C(1) << -track[0].segment[0].frac;
    assert_in_range(track[0].segment[0].frac, -14, -5);
    const int64_t fine = lets_pass(true, NULL), coarse = lets_pass(true, far);
    assert_int_equal(coarse - fine, 20 * q - 12);
    for (int n = 0; n < 4; n++) {
        struct controller_axis *axis = &axes[0];
        axis->sent_count = 3;
        axis->sent_q32[0] = axis->sent_q32[1] = 0;
        axis->track = n == 0 ? far : NULL;
        assert_int_equal(controller_gate_pass(&controller, 0,
                                              n == 0 ? 0 : coarse, &value,
                                              &limit),
                         n < 3);
    }
    axes[0].track = NULL;
    plan_track_free(&track[0]);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_legal_move_never_trips_it),
        cmocka_unit_test(a_legal_jog_and_what_follows_it_never_trip_it),
        cmocka_unit_test(a_move_of_a_master_takes_any_follower_along),
        cmocka_unit_test(a_move_that_goes_far_for_hours_never_trips_it),
        cmocka_unit_test(what_is_beyond_by_more_than_rounding_is_refused),
        cmocka_unit_test(what_is_read_in_coarse_steps_may_be_off_by_them),
    };
    return cmocka_run_group_tests_name("gate", tests, NULL, NULL);
}
