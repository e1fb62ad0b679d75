/* tests/conform/conform_drive.c - see conform_drive.h. */
#include "tests/conform/conform_drive.h"

#include <stdio.h>
#include <string.h>

#include "motion/core/fixed.h"

#define MS  INT64_C(1000000)
#define S   INT64_C(1000000000)
#define ONE MOTION_FIXED_ONE_Q32

#define SPEED 20 /* units/s of the ramps */

static struct conform_drive *bench_of(void **state)
{
    return *state;
}

/* ---- time -------------------------------------------------------------- */

static void cycle_begin(struct conform_drive *b)
{
    sim_world_run(b->world, b->now_ns);
    assert_int_equal(hal_fieldbus_begin(b->fieldbus, b->now_ns),
                     HAL_FIELDBUS_GOOD);
    hal_drive_feedback(b->drive, &b->seen);
}

static void cycle_end(struct conform_drive *b)
{
    hal_fieldbus_end(b->fieldbus, b->now_ns);
    b->now_ns += b->tick_ns;
}

static void cycle(struct conform_drive *b)
{
    cycle_begin(b);
    cycle_end(b);
}

/* With the set point where it was. */
static void cycle_at(struct conform_drive *b, int64_t pos_q32)
{
    cycle_begin(b);
    assert_int_equal(
        hal_drive_set_target(b->drive,
                             &(struct hal_drive_target){ pos_q32, 0, 0, 0 }),
        MOTION_OK);
    cycle_end(b);
}

static void pass(struct conform_drive *b, int64_t ns)
{
    for (const int64_t end_ns = b->now_ns + ns; b->now_ns < end_ns;)
        cycle(b);
}

/* How long it took. */
static int64_t until(struct conform_drive *b, enum hal_drive_state state,
                     int64_t most_ns)
{
    const int64_t since_ns = b->now_ns;

    while (b->now_ns - since_ns <= most_ns) {
        cycle(b);
        if (b->seen.state == state)
            return b->now_ns - since_ns;
    }
    fail_msg("%s: still %s after %" PRId64 " ms, not %s: %s", b->name,
             hal_drive_state_text(b->seen.state), most_ns / MS,
             hal_drive_state_text(state), b->seen.fault_text);
    return 0;
}

static void never(struct conform_drive *b, enum hal_drive_state state,
                  int64_t ns)
{
    for (const int64_t end_ns = b->now_ns + ns; b->now_ns < end_ns;) {
        cycle(b);
        if (b->seen.state == state)
            fail_msg("%s: is %s", b->name, hal_drive_state_text(state));
    }
}

static void query(struct conform_drive *b, enum hal_drive_request request)
{
    hal_drive_request(b->drive, request);
}

static int64_t magnitude(int64_t value)
{
    return value < 0 ? -value : value;
}

static void assert_near(const struct conform_drive *b, int64_t got_q32,
                        int64_t want_q32, int64_t most_q32, const char *what)
{
    if (magnitude(got_q32 - want_q32) > most_q32)
        fail_msg("%s: %s at %.5f, not within %.5f of %.5f", b->name, what,
                 (double)got_q32 / (double)ONE, (double)most_q32 / (double)ONE,
                 (double)want_q32 / (double)ONE);
}

/* ---- into a state ------------------------------------------------------ */

static int fresh(void **state)
{
    struct conform_drive *b = bench_of(state);

    b->now_ns = 1000 * MS;
    memset(&b->seen, 0, sizeof b->seen);
    b->drive = b->setup(b);
    return b->drive == NULL;
}

static void to_off(struct conform_drive *b)
{
    until(b, HAL_DRIVE_OFF, b->start_ns);
}

static int64_t to_enabled(struct conform_drive *b)
{
    to_off(b);
    query(b, HAL_DRIVE_REQUEST_ENABLE);
    until(b, HAL_DRIVE_ENABLED, b->enable_ns);
    return b->seen.pos_q32;
}

/* ---- a ramp, from rest to rest ------------------------------------------ */

#define ACC      100 /* units/s2 */
#define RAMP_NS  (S / ACC * SPEED)
#define PLAIN_NS (300 * MS)

/* Displacement and speed of the ramp at t. */
static double ramp_at(int64_t t_ns, double *vel)
{
    const double t = (double)t_ns / 1e9, up = (double)RAMP_NS / 1e9,
                 plain = (double)PLAIN_NS / 1e9, end = 2 * up + plain;
    const double whole = SPEED * (up + plain);

    if (t <= 0 || t >= end) {
        *vel = 0;
        return t <= 0 ? 0 : whole;
    }
    if (t < up) {
        *vel = ACC * t;
        return ACC * t * t / 2;
    }
    if (t < up + plain) {
        *vel = SPEED;
        return SPEED * (t - up / 2);
    }
    *vel = ACC * (end - t);
    return whole - ACC * (end - t) * (end - t) / 2;
}

#define FOLLOW_TICKS 20000

/* Everything that was given and measured, by tick. */
static struct {
    int64_t t_ns[FOLLOW_TICKS], given_q32[FOLLOW_TICKS],
        ruler_q32[FOLLOW_TICKS];
    unsigned count;
} record;

/* What the axis was told, as the drive itself dates it. */
static bool demand_of(const struct hal_drive_feedback *seen,
                      int64_t *demand_q32)
{
    const int64_t given_ns = seen->t_ns - seen->demand_age_ns;

    if (seen->demand_known) {
        *demand_q32 = seen->demand_q32;
        return true;
    }
    for (unsigned i = record.count; seen->demand_age_ns != 0 && i-- > 0;)
        if (record.t_ns[i] <= given_ns) {
            *demand_q32 = record.given_q32[i];
            return true;
        }
    return false;
}

/* The ruler at t, between two ticks. */
static bool ruler_at(int64_t t_ns, int64_t *pos_q32)
{
    for (unsigned i = record.count; i-- > 1;) {
        const int64_t before_ns = record.t_ns[i - 1];
        const double part =
            (double)(t_ns - before_ns) / (double)(record.t_ns[i] - before_ns);

        if (before_ns > t_ns)
            continue;
        *pos_q32 = record.ruler_q32[i - 1] +
                   (int64_t)(part * (double)(record.ruler_q32[i] -
                                             record.ruler_q32[i - 1]));
        return t_ns <= record.t_ns[i];
    }
    return false;
}

static void follow_judge(struct conform_drive *b, unsigned *judged)
{
    int64_t demand_q32, ruler_q32;

    assert_int_equal(b->seen.state, HAL_DRIVE_ENABLED);
    assert_true(b->seen.t_ns <= b->now_ns);
    if (demand_of(&b->seen, &demand_q32)) {
        assert_near(b, b->seen.pos_q32, demand_q32, b->follow_q32,
                    "the axis, by its set point,");
        ++*judged;
    }
    if (ruler_at(b->seen.t_ns, &ruler_q32))
        assert_near(b, b->seen.pos_q32, ruler_q32, b->report_q32,
                    "the position, by the ruler,");
}

static void follow_tick(struct conform_drive *b, int64_t from_q32, int64_t t_ns,
                        int64_t sign, unsigned *judged)
{
    double vel;
    const double displacement = ramp_at(t_ns, &vel);
    struct hal_drive_target target = {
        .pos_q32 = from_q32 + sign * (int64_t)(displacement * (double)ONE),
        .vel_q32 = sign * (int64_t)(vel * (double)ONE),
    };

    cycle_begin(b);
    assert_true(record.count < FOLLOW_TICKS);
    record.t_ns[record.count] = b->now_ns;
    record.ruler_q32[record.count] = b->ruler_q32(b);
    record.given_q32[record.count++] = target.pos_q32;
    follow_judge(b, judged);
    assert_int_equal(hal_drive_set_target(b->drive, &target), MOTION_OK);
    cycle_end(b);
}

static int64_t follow(struct conform_drive *b, int64_t from_q32, int64_t sign)
{
    unsigned judged = 0;
    double vel;
    const int64_t displacement_q32 = (int64_t)(ramp_at(S, &vel) * (double)ONE);

    record.count = 0;
    for (int64_t t_ns = 0; t_ns < S; t_ns += b->tick_ns)
        follow_tick(b, from_q32, t_ns, sign, &judged);
    assert_true(judged > 0);
    return from_q32 + sign * displacement_q32;
}

/* ---- claims ------------------------------------------------------------- */

static void it_is_found_and_stays_off(void **state)
{
    struct conform_drive *b = bench_of(state);

    cycle(b);
    assert_int_equal(b->seen.state, HAL_DRIVE_OFFLINE);
    assert_int_equal(hal_drive_modes(b->drive) & ~(unsigned)1, 0);
    to_off(b);
    assert_near(b, b->seen.pos_q32, b->ruler_q32(b), b->report_q32,
                "the position");
    assert_true(b->seen.t_ns > 0);
    assert_true(hal_drive_modes(b->drive) & 1u << HAL_DRIVE_STREAM_POSITION);
    assert_int_equal(b->seen.mode, HAL_DRIVE_STREAM_POSITION);
    assert_int_equal(b->seen.fault_code, 0);
    for (int i = 0; i < 200; i++) {
        cycle(b);
        assert_int_equal(b->seen.state, HAL_DRIVE_OFF);
    }
}

static void it_enables_without_a_jump(void **state)
{
    struct conform_drive *b = bench_of(state);
    int64_t from_q32, at_q32;

    to_off(b);
    from_q32 = b->ruler_q32(b);
    at_q32 = to_enabled(b);
    for (int i = 0; i < 200; i++) {
        cycle_at(b, at_q32);
        assert_int_equal(b->seen.state, HAL_DRIVE_ENABLED);
        assert_near(b, b->ruler_q32(b), from_q32, b->stand_q32, "the axis");
    }
    assert_true(b->seen.following);
    query(b, HAL_DRIVE_REQUEST_OFF);
    until(b, HAL_DRIVE_OFF, b->enable_ns);
}

static void a_request_waits_until_it_is_found(void **state)
{
    struct conform_drive *b = bench_of(state);

    cycle(b);
    query(b, HAL_DRIVE_REQUEST_ENABLE);
    until(b, HAL_DRIVE_ENABLED, b->start_ns + b->enable_ns);
}

static void it_follows_and_says_where_it_is(void **state)
{
    struct conform_drive *b = bench_of(state);
    int64_t at_q32 = to_enabled(b);

    at_q32 = follow(b, at_q32, 1);
    assert_near(b, b->ruler_q32(b), at_q32, b->stand_q32, "the end");
    at_q32 = follow(b, at_q32, -1);
    assert_near(b, b->ruler_q32(b), at_q32, b->stand_q32, "the start");
}

static void a_set_point_that_does_not_fit_is_refused(void **state)
{
    struct conform_drive *b = bench_of(state);
    const struct hal_drive_target beyond = { .pos_q32 = b->beyond_q32 };
    const int64_t at_q32 = to_enabled(b);

    for (int i = 0; i < 50; i++) {
        cycle_at(b, at_q32);
        assert_int_equal(hal_drive_set_target(b->drive, &beyond),
                         MOTION_E_RANGE);
    }
    assert_int_equal(b->seen.state, HAL_DRIVE_ENABLED);
    assert_near(b, b->ruler_q32(b), at_q32, b->stand_q32, "the axis");
}

static void a_first_set_point_far_away_is_a_fault(void **state)
{
    struct conform_drive *b = bench_of(state);
    const int64_t at_q32 = to_enabled(b);
    const struct hal_drive_target far = { .pos_q32 = at_q32 + 5 * ONE };

    cycle_begin(b);
    assert_int_equal(hal_drive_set_target(b->drive, &far), MOTION_E_AWAY);
    cycle_end(b);
    cycle(b);
    assert_int_equal(b->seen.state, HAL_DRIVE_FAULT);
    assert_true(b->seen.fault_text[0] != '\0');
    pass(b, 200 * MS);
    assert_near(b, b->ruler_q32(b), at_q32, ONE, "the axis");
}

/* 20 units/s, and the stop asked for in the middle of it. */
static void run_up(struct conform_drive *b)
{
    const int64_t from_q32 = to_enabled(b);
    unsigned judged = 0;

    record.count = 0;
    for (int64_t t_ns = 0; t_ns < RAMP_NS + 50 * MS; t_ns += b->tick_ns)
        follow_tick(b, from_q32, t_ns, 1, &judged);
}

/* Well inside what a second of 20 units/s would be, and then it stands. */
static void assert_stops(struct conform_drive *b)
{
    const int64_t from_q32 = b->ruler_q32(b);
    int64_t at_q32;

    pass(b, S);
    at_q32 = b->ruler_q32(b);
    assert_near(b, at_q32, from_q32, 10 * ONE, "the axis");
    pass(b, 100 * MS);
    assert_near(b, b->ruler_q32(b), at_q32, b->stand_q32, "the axis");
}

static void a_quick_stop_ends_standing(void **state)
{
    struct conform_drive *b = bench_of(state);

    run_up(b);
    query(b, HAL_DRIVE_REQUEST_QUICK_STOP);
    cycle(b);
    cycle(b);
    assert_int_not_equal(b->seen.state, HAL_DRIVE_ENABLED);
    assert_stops(b);
    assert_int_not_equal(b->seen.state, HAL_DRIVE_ENABLED);
    assert_int_not_equal(b->seen.state, HAL_DRIVE_FAULT);
    query(b, HAL_DRIVE_REQUEST_OFF);
    until(b, HAL_DRIVE_OFF, b->enable_ns);
    to_enabled(b);
}

static void a_fault_is_off_until_reset_and_enable(void **state)
{
    struct conform_drive *b = bench_of(state);

    run_up(b);
    b->trouble(b, CONFORM_DRIVE_TRIP);
    until(b, HAL_DRIVE_FAULT, b->trip_ns);
    pass(b, 200 * MS);
    assert_int_equal(b->seen.state, HAL_DRIVE_FAULT);
    assert_true(b->seen.fault_code != 0);
    assert_true(b->seen.fault_text[0] != '\0');
    assert_false(b->seen.following);
    query(b, HAL_DRIVE_REQUEST_ENABLE); /* is not heard */
    pass(b, 300 * MS);
    assert_int_equal(b->seen.state, HAL_DRIVE_FAULT);
    query(b, HAL_DRIVE_REQUEST_RESET);
    until(b, HAL_DRIVE_OFF, 2 * S);
    never(b, HAL_DRIVE_ENABLED, S);
    assert_int_equal(b->seen.state, HAL_DRIVE_OFF);
    assert_int_equal(b->seen.fault_code, 0);
    to_enabled(b);
}

static void a_fault_that_lasts_is_not_reset(void **state)
{
    struct conform_drive *b = bench_of(state);

    if (!b->lasts)
        skip();
    to_enabled(b);
    b->trouble(b, CONFORM_DRIVE_LASTING_TRIP);
    until(b, HAL_DRIVE_FAULT, b->trip_ns);
    query(b, HAL_DRIVE_REQUEST_RESET);
    never(b, HAL_DRIVE_ENABLED, 3 * S);
    assert_int_equal(b->seen.state, HAL_DRIVE_FAULT);
    assert_true(b->seen.fault_text[0] != '\0');
    b->trouble(b, CONFORM_DRIVE_HEAL);
    query(b, HAL_DRIVE_REQUEST_RESET);
    until(b, HAL_DRIVE_OFF, 2 * S);
}

/* Its own watchdog may have tripped in the meantime. */
static void found_again(struct conform_drive *b)
{
    const int64_t end_ns = b->now_ns + b->start_ns + 3 * S;

    do {
        cycle(b);
        assert_true(b->now_ns < end_ns);
        assert_int_not_equal(b->seen.state, HAL_DRIVE_ENABLED);
    } while (b->seen.state != HAL_DRIVE_OFF &&
             b->seen.state != HAL_DRIVE_FAULT);
    if (b->seen.state == HAL_DRIVE_OFF)
        return;
    assert_true(b->seen.fault_code != 0);
    assert_true(b->seen.fault_text[0] != '\0');
    query(b, HAL_DRIVE_REQUEST_RESET);
    until(b, HAL_DRIVE_OFF, 2 * S);
}

static void a_silent_drive_is_lost_and_not_found_by_itself(void **state)
{
    struct conform_drive *b = bench_of(state);

    run_up(b);
    b->trouble(b, CONFORM_DRIVE_SILENT);
    until(b, HAL_DRIVE_OFFLINE, b->silent_ns);
    assert_true(b->seen.fault_text[0] != '\0');
    query(b, HAL_DRIVE_REQUEST_ENABLE); /* is not heard */
    b->trouble(b, CONFORM_DRIVE_HEAL);
    pass(b, 2 * S);
    assert_int_equal(b->seen.state, HAL_DRIVE_OFFLINE);
    query(b, HAL_DRIVE_REQUEST_RESET);
    found_again(b);
    never(b, HAL_DRIVE_ENABLED, S);
    to_enabled(b);
}

static void reset_without_a_fault_is_nothing(void **state)
{
    struct conform_drive *b = bench_of(state);
    int64_t at_q32;

    to_off(b);
    query(b, HAL_DRIVE_REQUEST_RESET);
    never(b, HAL_DRIVE_OFFLINE, 100 * MS);
    assert_int_equal(b->seen.state, HAL_DRIVE_OFF);
    at_q32 = to_enabled(b);
    cycle_at(b, at_q32);
    query(b, HAL_DRIVE_REQUEST_RESET);
    for (int i = 0; i < 100; i++)
        cycle_at(b, at_q32);
    assert_int_equal(b->seen.state, HAL_DRIVE_ENABLED);
}

/* ---- modes -------------------------------------------------------------- */

static void to_mode(struct conform_drive *b, enum hal_drive_mode mode)
{
    assert_int_equal(hal_drive_set_mode(b->drive, mode), MOTION_OK);
    for (int64_t ns = 0; ns < 2 * S; ns += b->tick_ns) {
        cycle(b);
        if (b->seen.mode == mode)
            return;
    }
    fail_msg("%s: still in %s, not %s", b->name,
             hal_drive_mode_text(b->seen.mode), hal_drive_mode_text(mode));
}

static void what_it_has_not_is_said(void **state)
{
    struct conform_drive *b = bench_of(state);
    const struct hal_drive_home home = { .timeout_ns = S };
    const struct hal_drive_go go = { .vel_q32 = ONE };
    unsigned modes;

    to_enabled(b);
    modes = hal_drive_modes(b->drive);
    for (int mode = 0; mode < HAL_DRIVE_MODES; mode++)
        if ((modes & 1u << mode) == 0)
            assert_int_equal(
                hal_drive_set_mode(b->drive, (enum hal_drive_mode)mode),
                MOTION_E_EMPTY);
    if ((modes & 1u << HAL_DRIVE_HOMING) == 0)
        assert_int_equal(hal_drive_home(b->drive, &home), MOTION_E_EMPTY);
    /* there, but not in this mode */
    if ((modes & 1u << HAL_DRIVE_PROFILE_POSITION) != 0)
        assert_int_equal(hal_drive_go(b->drive, &go), MOTION_E_STATE);
    else if ((modes & 1u << HAL_DRIVE_PROFILE_VELOCITY) == 0)
        assert_int_equal(hal_drive_go(b->drive, &go), MOTION_E_EMPTY);
}

static void until_arrived(struct conform_drive *b, int64_t most_ns)
{
    for (int64_t ns = 0; ns < most_ns; ns += b->tick_ns) {
        cycle(b);
        assert_int_equal(b->seen.state, HAL_DRIVE_ENABLED);
        if (b->seen.arrived)
            return;
    }
    fail_msg("%s: does not arrive", b->name);
}

static struct hal_drive_go go_to(int64_t pos_q32)
{
    return (struct hal_drive_go){ .pos_q32 = pos_q32,
                                  .vel_q32 = 10 * ONE,
                                  .acc_q32 = INT64_C(80) << 32,
                                  .dec_q32 = INT64_C(80) << 32 };
}

static bool has(struct conform_drive *b, enum hal_drive_mode mode)
{
    return (hal_drive_modes(b->drive) & 1u << mode) != 0;
}

static void it_goes_by_its_own_profile(void **state)
{
    struct conform_drive *b = bench_of(state);
    const int64_t from_q32 = to_enabled(b);
    const struct hal_drive_go there = go_to(from_q32 + 5 * ONE);
    const struct hal_drive_go back = go_to(from_q32);
    struct hal_drive_go wrong = there;
    int64_t at_q32;

    if (!has(b, HAL_DRIVE_PROFILE_POSITION))
        skip();
    to_mode(b, HAL_DRIVE_PROFILE_POSITION);
    wrong.vel_q32 = 0;
    assert_int_equal(hal_drive_go(b->drive, &wrong), MOTION_E_ARG);
    wrong = there;
    wrong.pos_q32 = b->beyond_q32;
    assert_int_equal(hal_drive_go(b->drive, &wrong), MOTION_E_RANGE);
    assert_int_equal(hal_drive_go(b->drive, &there), MOTION_OK);
    pass(b, 300 * MS);
    assert_false(b->seen.arrived); /* 5 units at 10 units/s */
    assert_int_equal(hal_drive_set_mode(b->drive, HAL_DRIVE_STREAM_POSITION),
                     MOTION_E_STATE);
    until_arrived(b, 3 * S);
    pass(b, 200 * MS);
    assert_near(b, b->ruler_q32(b), there.pos_q32, b->stand_q32, "the axis");
    /* turned round half way */
    assert_int_equal(hal_drive_go(b->drive, &back), MOTION_OK);
    pass(b, 300 * MS);
    assert_int_equal(hal_drive_go(b->drive, &there), MOTION_OK);
    until_arrived(b, 3 * S);
    pass(b, 200 * MS);
    assert_near(b, b->ruler_q32(b), there.pos_q32, b->stand_q32, "the axis");
    /* and back to set points, from where it stands */
    to_mode(b, HAL_DRIVE_STREAM_POSITION);
    at_q32 = b->seen.pos_q32;
    at_q32 = follow(b, at_q32, -1);
    assert_near(b, b->ruler_q32(b), at_q32, b->stand_q32, "the axis");
}

static void halt_and_quick_stop_end_a_go(void **state)
{
    struct conform_drive *b = bench_of(state);
    const int64_t from_q32 = to_enabled(b);
    const struct hal_drive_go go = go_to(from_q32 + 15 * ONE);

    if (!has(b, HAL_DRIVE_PROFILE_POSITION))
        skip();
    to_mode(b, HAL_DRIVE_PROFILE_POSITION);
    assert_int_equal(hal_drive_halt(b->drive), MOTION_E_STATE);
    assert_int_equal(hal_drive_go(b->drive, &go), MOTION_OK);
    pass(b, 400 * MS);
    assert_int_equal(hal_drive_halt(b->drive), MOTION_OK);
    assert_stops(b);
    assert_int_equal(b->seen.state, HAL_DRIVE_ENABLED);
    assert_int_equal(hal_drive_go(b->drive, &go), MOTION_OK);
    pass(b, 400 * MS);
    query(b, HAL_DRIVE_REQUEST_QUICK_STOP);
    assert_stops(b);
    assert_true(magnitude(b->ruler_q32(b) - go.pos_q32) > ONE);
    query(b, HAL_DRIVE_REQUEST_OFF);
    until(b, HAL_DRIVE_OFF, b->enable_ns);
}

static void it_homes_by_itself(void **state)
{
    struct conform_drive *b = bench_of(state);
    const struct hal_drive_home home = { .method = b->homing_method,
                                         .pos_q32 = 3 * ONE,
                                         .timeout_ns = 20 * S };
    int64_t ns = 0;

    to_enabled(b);
    if (!has(b, HAL_DRIVE_HOMING))
        skip();
    assert_int_equal(b->seen.homing, HAL_DRIVE_HOMING_NONE);
    assert_int_equal(hal_drive_home(b->drive, &home), MOTION_E_STATE);
    to_mode(b, HAL_DRIVE_HOMING);
    assert_int_equal(hal_drive_home(b->drive, &home), MOTION_OK);
    do {
        cycle(b);
        ns += b->tick_ns;
        assert_int_equal(b->seen.state, HAL_DRIVE_ENABLED);
        assert_true(ns < home.timeout_ns);
    } while (b->seen.homing == HAL_DRIVE_HOMING_RUNNING || ns < 10 * MS);
    assert_int_equal(b->seen.homing, HAL_DRIVE_HOMING_DONE);
    pass(b, 200 * MS);
    assert_near(b, b->seen.pos_q32, home.pos_q32, b->stand_q32 + ONE / 10,
                "the home point");
    to_mode(b, HAL_DRIVE_STREAM_POSITION);
    for (int i = 0; i < 100; i++)
        cycle_at(b, home.pos_q32);
    assert_int_equal(b->seen.state, HAL_DRIVE_ENABLED);
}

#define CLAIM(function)                                                        \
    {                                                                          \
#function, function, fresh, NULL, bench                                \
    }

int conform_drive(struct conform_drive *bench)
{
    const struct CMUnitTest claims[] = {
        CLAIM(it_is_found_and_stays_off),
        CLAIM(it_enables_without_a_jump),
        CLAIM(a_request_waits_until_it_is_found),
        CLAIM(it_follows_and_says_where_it_is),
        CLAIM(a_set_point_that_does_not_fit_is_refused),
        CLAIM(a_first_set_point_far_away_is_a_fault),
        CLAIM(a_quick_stop_ends_standing),
        CLAIM(a_fault_is_off_until_reset_and_enable),
        CLAIM(a_fault_that_lasts_is_not_reset),
        CLAIM(a_silent_drive_is_lost_and_not_found_by_itself),
        CLAIM(reset_without_a_fault_is_nothing),
        CLAIM(what_it_has_not_is_said),
        CLAIM(it_goes_by_its_own_profile),
        CLAIM(halt_and_quick_stop_end_a_go),
        CLAIM(it_homes_by_itself),
    };

    print_message("%s\n", bench->name);
    return cmocka_run_group_tests_name(bench->name, claims, NULL, NULL);
}
