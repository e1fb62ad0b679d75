/* tests/motion/otg/test_otg.c - the fastest motion between states; see
 * motion/otg/otg.h.  Judged by tests/motion/otg/otg_oracle.c and by durations
 * from tests/vectors. */
#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "firmware/host/exchange/otg_rows.h"
#include "motion/core/err.h"
#include "motion/core/fixed.h"
#include "motion/otg/otg.h"
#include "motion/otg/replan.h"
#include "motion/otg/sync.h"
#include "tests/motion/otg/otg_oracle.h"
#include "tests/support/check.h"

#define SEED UINT64_C(20240911)

static void fail_move(const char *what, const struct motion_otg_move *m)
{
    const struct motion_otg_limit *l = &m->limit;
    fail_msg("%s: start %" PRId64 " %" PRId64 " %" PRId64 " goal %" PRId64
             " %" PRId64 " %" PRId64 " vel %" PRId64 " %" PRId64 " acc %" PRId64
             " %" PRId64 " jerk %" PRId64 " %" PRId64,
             what, m->start.pos_q32, m->start.vel_q32, m->start.acc_q32,
             m->goal.pos_q32, m->goal.vel_q32, m->goal.acc_q32, l->vel_max_q32,
             l->vel_min_q32, l->acc_max_q32, l->acc_min_q32, l->jerk_q32,
             l->jerk_down_q32);
}

static struct motion_otg_plan plan_of(const struct motion_otg_move *move)
{
    struct motion_otg_plan plan;
    enum motion_otg_field field;
    int err = motion_otg_make(move, &plan, &field);
    if (err < 0) {
        char text[128];
        snprintf(text, sizeof text, "%s: %s", motion_err_text(err),
                 motion_otg_field_text(field));
        fail_move(text, move);
    }
    const char *wrong = otg_oracle_judge(move, &plan);
    if (wrong)
        fail_move(wrong, move);
    return plan;
}

/* --- durations of the reference vectors ---------------------------------- */

struct score {
    int rows, outside;
    double worst;
};

static void score_row(struct score *score, const struct otg_row *row,
                      double got, double factor)
{
    double want = row->duration * factor;
    double over = (got - want) / want;
    bool violates = strcmp(row->category, "start_violates") == 0;
    score->rows++;
    if (over > 1e-6 + 2e-9 / want || (over < -1e-9 && !violates))
        score->outside++;
    if (over > score->worst)
        score->worst = over;
}

/* The row in another unit of length and of time. */
static void row_in(struct otg_row *row, int axes, double length, double time)
{
    static const int per_time[OTG_VALUES] = {
        0, 1, 2, 0, 1, 2, 1, 1, 2, 2, 3, 3
    };
    for (int i = 0; i < axes; i++)
        for (int k = 0; k < OTG_VALUES; k++)
            row->value[i][k] *= length / pow(time, per_time[k]);
}

static double seconds_of(const struct motion_otg_plan *plan, int time)
{
    return (double)ldexpl((long double)plan->dur_ns_q12 / OTG_TICKS_PER_SECOND,
                          time);
}

static void run_row(const struct otg_header *header, struct otg_row *row,
                    double length, double time, struct score *score)
{
    struct otg_scaled scaled;
    struct motion_otg_plan plan[3];
    struct motion_sync_fault fault;
    row_in(row, header->axes, length, time);
    otg_rows_scale(header, row, 1, &scaled);
    int err = motion_sync_make(
        scaled.move, header->axes,
        header->axes > 1 ? MOTION_SYNC_TIME : MOTION_SYNC_NONE, plan, &fault);
    if (err < 0)
        fail_move(motion_otg_field_text(fault.field), &scaled.move[fault.axis]);
    for (int i = 0; i < header->axes; i++) {
        const char *wrong = otg_oracle_judge(&scaled.move[i], &plan[i]);
        if (wrong == NULL)
            wrong = otg_oracle_judge_track(&scaled.move[i], &plan[i]);
        if (wrong)
            fail_move(wrong, &scaled.move[i]);
        assert_true(plan[i].dur_ns_q12 == plan[0].dur_ns_q12);
    }
    score_row(score, row, seconds_of(&plan[0], scaled.time), time);
}

static FILE *vectors(const char *name)
{
    char path[512];
    const char *directory = getenv("SLEW_VECTORS");
    snprintf(path, sizeof path, "%s/%s.csv",
             directory ? directory : "tests/vectors", name);
    FILE *file = fopen(path, "r");
    if (file == NULL)
        fail_msg("cannot open %s", path);
    return file;
}

static void check_vectors(const char *name, double length, double time)
{
    static char line[16384];
    struct otg_header header;
    struct otg_row row;
    struct score score = { 0, 0, 0 };
    int column;
    FILE *file = vectors(name);
    assert_non_null(fgets(line, sizeof line, file));
    assert_null(otg_header_parse(line, &header));
    while (fgets(line, sizeof line, file)) {
        assert_null(otg_row_parse(&header, line, &row, &column));
        run_row(&header, &row, length, time, &score);
    }
    fclose(file);
    if (score.outside * 1000 > score.rows || score.worst > 1e-3)
        fail_msg("%s x %g, %g: %d of %d rows outside, worst %g", name, length,
                 time, score.outside, score.rows, score.worst);
}

static void durations_match_in_any_unit(void **state)
{
    static const char *const name[] = { "otg_position", "otg_velocity",
                                        "otg_round", "otg_boundary",
                                        "otg_sync3" };
    static const struct {
        double length, time;
    } unit[] = { { 1, 1 },   { 1e3, 1 },  { 1e6, 1 },   { 1e-3, 1 },
                 { 1, 1e3 }, { 1, 1e-3 }, { 1e-9, 1e9 } };
    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(name); i++)
        for (size_t k = 0; k < ARRAY_LEN(unit); k++)
            check_vectors(name[i], unit[k].length, unit[k].time);
}

/* --- random problems ------------------------------------------------------ */

/* A positive number of up to `bits` bits, evenly over the powers of two. */
static int64_t some(uint64_t *seed, int low, int high)
{
    int bits = (int)check_random_in(seed, low, high);
    return (int64_t)(check_random(seed) >> 1 | (uint64_t)1 << 62) >>
           (62 - bits);
}

static int64_t between(uint64_t *seed, int64_t low, int64_t high)
{
    switch (check_random_in(seed, 0, 9)) {
    case 0:
        return low;
    case 1:
        return high;
    case 2:
    case 3:
        return 0;
    default:
        return check_random_in(seed, low, high);
    }
}

/* Draw a goal until a motion can end there. */
static void random_goal(uint64_t *seed, struct motion_otg_move *m)
{
    const struct motion_otg_limit *l = &m->limit;
    do {
        m->goal.vel_q32 = between(seed, l->vel_min_q32, l->vel_max_q32);
        m->goal.acc_q32 = between(seed, l->acc_min_q32, l->acc_max_q32);
        double ramp =
            (double)m->goal.acc_q32 * (double)m->goal.acc_q32 /
            (2.0 * (double)(l->jerk_down_q32 ? l->jerk_down_q32 : l->jerk_q32));
        double v = (double)m->goal.vel_q32;
        if (!(m->goal.acc_q32 < 0 && v + ramp > (double)l->vel_max_q32) &&
            !(m->goal.acc_q32 > 0 && v - ramp < (double)l->vel_min_q32))
            return;
    } while (true);
}

/* About 2^bits, from 2^least on and within what the format holds. */
static int64_t about(uint64_t *seed, int least, int bits, int spread)
{
    int low = bits - spread, high = bits + spread;
    low = low < least ? least : low > 60 ? 60 : low;
    high = high < low ? low : high > 61 ? 61 : high;
    return some(seed, low, high);
}

/* Lengths over twelve decades, times over eight; each limit over four decades
 * and its two sides over two; ends anywhere within, and a start now and then
 * outside. */
static struct motion_otg_move random_move(uint64_t *seed)
{
    struct motion_otg_move m = { .mode = MOTION_OTG_POSITION };
    struct motion_otg_limit *l = &m.limit;
    int length = (int)check_random_in(seed, 20, 60);
    int time = (int)check_random_in(seed, -13, 13);
    l->vel_max_q32 = about(seed, 6, length - time, 6);
    int vel = 64 - __builtin_clzll((uint64_t)l->vel_max_q32);
    l->acc_max_q32 = about(seed, 22, vel - time, 6);
    int acc = 64 - __builtin_clzll((uint64_t)l->acc_max_q32);
    l->jerk_q32 = about(seed, 22, acc - time, 6);
    l->vel_min_q32 = -l->vel_max_q32;
    l->acc_min_q32 = -l->acc_max_q32;
    if (check_random_in(seed, 0, 1)) {
        l->vel_min_q32 = -about(seed, 6, vel, 3);
        l->acc_min_q32 = -about(seed, 22, acc, 3);
    }
    if (check_random_in(seed, 0, 3) == 0)
        l->jerk_down_q32 = about(seed, 22, acc - time, 6);
    m.start.pos_q32 = check_random_in(seed, -1, 1) * some(seed, 0, length);
    m.goal.pos_q32 = check_random_in(seed, -1, 1) * some(seed, 0, length);
    m.start.vel_q32 = between(seed, l->vel_min_q32, l->vel_max_q32);
    m.start.acc_q32 = between(seed, l->acc_min_q32, l->acc_max_q32);
    if (check_random_in(seed, 0, 15) == 0) {
        m.start.vel_q32 *= 2;
        m.start.acc_q32 *= 2;
    }
    random_goal(seed, &m);
    return m;
}

static long problem_count(long usual)
{
    const char *text = getenv("SLEW_OTG_PROBLEMS");
    return text ? strtol(text, NULL, 10) : usual;
}

static uint64_t problem_seed(void)
{
    const char *text = getenv("SLEW_OTG_SEED");
    return text ? strtoull(text, NULL, 10) : SEED;
}

static void random_problems_are_always_answered(void **state)
{
    uint64_t seed = problem_seed();
    long range = 0, count = problem_count(20000);
    (void)state;
    for (long i = 0; i < count; i++) {
        struct motion_otg_move m = random_move(&seed);
        struct motion_otg_plan plan;
        enum motion_otg_field field;
        int err = motion_otg_make(&m, &plan, &field);
        if (err == MOTION_E_RANGE) {
            range++;
            continue;
        }
        if (err < 0) {
            printf("seed %" PRIu64 ", problem %ld: %s %s\n", problem_seed(), i,
                   motion_err_text(err), motion_otg_field_text(field));
            fail_move("no answer", &m);
        }
        const char *wrong = otg_oracle_judge(&m, &plan);
        if (wrong)
            fail_move(wrong, &m);
        if (i % 16 == 0)
            (void)plan_of(&m);
    }
    printf("%ld problems, %ld beyond the formats\n", count, range);
}

/* --- requests that cannot be answered ------------------------------------- */

#define ONE    MOTION_FIXED_ONE_Q32
#define ACC    MOTION_FIXED_ONE_Q32
#define SECOND MOTION_FIXED_S_Q12

static const struct motion_otg_move usual = {
    .goal.pos_q32 = 100 * ONE,
    .limit = { 10 * ONE, -10 * ONE, 20 * ACC, -20 * ACC, 200 * ACC, 0 },
};

static void goal_that_needs_higher_speed_before_it_is_refused(void **state)
{
    struct motion_otg_move move = usual;
    struct motion_otg_plan plan;
    enum motion_otg_field field;
    (void)state;
    /* ramp 20^2 / (2 200) = 1: 9.5 while falling means 10.5 just before */
    move.goal.vel_q32 = 19 * ONE / 2;
    move.goal.acc_q32 = -20 * ACC;
    assert_int_equal(motion_otg_make(&move, &plan, &field), MOTION_E_LIMIT);
    assert_int_equal(field, MOTION_OTG_FIELD_GOAL_ACC);
    move.goal.vel_q32 = 9 * ONE;
    plan_of(&move);
}

/* --- hand values ---------------------------------------------------------- */

static double seconds(const struct motion_otg_plan *plan)
{
    return (double)plan->dur_ns_q12 / 4096e9;
}

static void assert_seconds(const struct motion_otg_plan *plan, double want)
{
    double over = seconds(plan) / want - 1;
    if (over < -1e-9 || over > 1e-6)
        fail_msg("%.12g s, expected %.12g", seconds(plan), want);
}

static void simple_moves_take_what_the_formula_says(void **state)
{
    struct motion_otg_move move = usual;
    struct motion_otg_plan plan = plan_of(&move);
    (void)state;
    /* d / v + v / a + a / j */
    assert_seconds(&plan, 100 / 10.0 + 10 / 20.0 + 20 / 200.0);
    move.limit.jerk_q32 = 0;
    plan = plan_of(&move);
    assert_seconds(&plan, 100 / 10.0 + 10 / 20.0);
    move.limit.acc_max_q32 = move.limit.acc_min_q32 = 0;
    plan = plan_of(&move);
    assert_seconds(&plan, 100 / 10.0);
    /* half as much jerk while slowing down: a / j of that half doubles */
    move = usual;
    move.limit.jerk_down_q32 = 100 * ACC;
    plan = plan_of(&move);
    assert_seconds(&plan, 100 / 10.0 + 10 / 20.0 + 1.5 * 20 / 200.0);
    move.goal.pos_q32 = 0;
    plan = plan_of(&move);
    assert_true(plan.dur_ns_q12 == 0 && plan.count == 0);
}

/* With accelerations of one sign at both ends a border may rise before it
 * falls: what it reaches there comes first. */
static void what_is_reached_early_is_not_missed(void **state)
{
    const struct motion_otg_move move = {
        .start = { 0, -329268279576, INT64_C(24330364) << 16, 0 },
        .goal = { 93528883558, 508856482962, INT64_C(10669474) << 16, 0 },
        .limit = { 1466066132957, -1466066132957, INT64_C(31730515) << 16,
                   -(INT64_C(31730515) << 16), INT64_C(32337379) << 16, 0 },
    };
    struct motion_otg_plan plan;
    (void)state;
    assert_int_equal(motion_otg_make(&move, &plan, NULL), MOTION_OK);
    assert_seconds(&plan, 0.63324642519);
}

static void a_wanted_duration_is_met_exactly(void **state)
{
    (void)state;
    for (int64_t ms = 10601; ms < 60000; ms += 977) {
        struct motion_otg_move move = usual;
        move.dur_ns_q12 = ms * 1000000 * 4096;
        struct motion_otg_plan plan = plan_of(&move);
        assert_true(plan.dur_ns_q12 == move.dur_ns_q12);
    }
}

/* --- while moving --------------------------------------------------------- */

static void replanning_does_not_come_late(void **state)
{
    uint64_t seed = SEED;
    int kept = 0, fresh = 0;
    (void)state;
    for (int n = 0; n < 100; n++) {
        const struct motion_otg_move first = random_move(&seed);
        struct motion_otg_trajectory old, next;
        if (motion_otg_begin(&first, &old, NULL) < 0 ||
            old.plan.dur_ns_q12 < 1000 * 4096)
            continue; /* over three days, or below 1 us */
        int64_t dur = old.plan.dur_ns_q12, since = 0;
        for (int i = 1; i < 100; i++) {
            int64_t now = dur / 100 * i;
            if (now - since >= old.plan.dur_ns_q12)
                break; /* arrived early */
            int outcome =
                motion_otg_replan(&old, now - since, &first, &next, NULL);
            assert_true(outcome != MOTION_OTG_STOP && outcome >= 0);
            if (outcome == MOTION_OTG_KEPT) {
                kept++;
                continue;
            }
            fresh++;
            const char *wrong = otg_oracle_judge(&next.move, &next.plan);
            if (wrong)
                fail_move(wrong, &next.move);
            old = next;
            since = now;
            /* a tick, 1 ms / 4096, per replan */
            if (since + old.plan.dur_ns_q12 > dur)
                fail_move("late", &first);
        }
    }
    printf("replanned %d times, kept the plan %d times\n", fresh, kept);
}

static void there_is_an_answer_while_moving(void **state)
{
    struct motion_otg_move wish = usual;
    struct motion_otg_trajectory old, next;
    (void)state;
    assert_int_equal(motion_otg_begin(&usual, &old, NULL), MOTION_OK);
    wish.goal.vel_q32 = 100 * ONE; /* impossible */
    assert_int_equal(motion_otg_replan(&old, SECOND, &wish, &next, NULL),
                     MOTION_OTG_KEPT);
    assert_int_equal(
        motion_otg_replan(&old, old.plan.dur_ns_q12, &wish, &next, NULL),
        MOTION_OTG_STOP);
    wish = usual;
    wish.goal.pos_q32 = -5 * ONE;
    assert_int_equal(motion_otg_replan(&old, SECOND, &wish, &next, NULL),
                     MOTION_OTG_NEW);
    assert_null(otg_oracle_judge(&next.move, &next.plan));
}

static void a_stop_ends_at_rest(void **state)
{
    uint64_t seed = SEED + 1;
    (void)state;
    for (int i = 0; i < 1000; i++) {
        struct motion_otg_move m = random_move(&seed);
        struct motion_otg_plan plan;
        int err = motion_otg_stop(&m.start, &m.limit, &plan);
        if (err == MOTION_E_RANGE)
            continue; /* over three days */
        assert_int_equal(err, MOTION_OK);
        m.goal = (struct motion_state){ 0 };
        m.mode = MOTION_OTG_VELOCITY;
        const char *wrong = otg_oracle_judge(&m, &plan);
        if (wrong)
            fail_move(wrong, &m);
    }
}

/* --- several axes --------------------------------------------------------- */

static void straight_lines_are_straight(void **state)
{
    struct motion_otg_move move[3] = { usual, usual, usual };
    struct motion_otg_plan plan[3];
    (void)state;
    move[1].goal.pos_q32 = -37 * ONE;
    move[1].limit.vel_min_q32 = -ONE;
    move[2].goal.pos_q32 = 3 * ONE;
    move[2].limit.jerk_q32 = ACC;
    assert_int_equal(
        motion_sync_make(move, 3, MOTION_SYNC_STRAIGHT, plan, NULL), MOTION_OK);
    for (int k = 0; k < 3; k++) {
        assert_null(otg_oracle_judge(&move[k], &plan[k]));
        assert_true(plan[k].dur_ns_q12 == plan[0].dur_ns_q12);
    }
    for (int i = 0; i <= 1000; i++) {
        struct motion_state s[3];
        for (int k = 0; k < 3; k++)
            motion_otg_state_at(&plan[k], plan[0].dur_ns_q12 / 1000 * i, &s[k]);
        double p = (double)s[0].pos_q32;
        assert_true(fabs((double)s[1].pos_q32 + 0.37 * p) < 1e-8 * ONE);
        assert_true(fabs((double)s[2].pos_q32 - 0.03 * p) < 1e-8 * ONE);
    }
    move[1].start.vel_q32 = ONE / 2;
    assert_int_equal(
        motion_sync_make(move, 3, MOTION_SYNC_STRAIGHT, plan, NULL),
        MOTION_E_LIMIT);
    assert_int_equal(motion_sync_make(move, 3, MOTION_SYNC_PHASE, plan, NULL),
                     MOTION_OK);
}

static void points_are_passed_without_stopping(void **state)
{
    static struct motion_otg_plan plan[8 * 2];
    const struct motion_otg_limit limit[2] = { usual.limit, usual.limit };
    const struct motion_state start[2] = { { 0 }, { 0 } };
    struct motion_otg_point point[8 * 2];
    double stopping = 0, through = 0;
    (void)state;
    for (int i = 0; i < 8; i++) {
        point[2 * i] = (struct motion_otg_point){ (i + 1) * 5 * ONE, 0, false };
        point[2 * i + 1] =
            (struct motion_otg_point){ (i < 4 ? i : 7 - i) * ONE, 0, false };
        struct motion_otg_move move = usual;
        move.goal.pos_q32 = 5 * ONE;
        struct motion_otg_plan one = plan_of(&move);
        stopping += seconds(&one);
    }
    assert_int_equal(
        motion_otg_through(start, limit, 2, point, 8, plan, NULL, NULL),
        MOTION_OK);
    for (int i = 0; i < 8; i++)
        through += seconds(&plan[2 * i]);
    assert_true(point[2 * 3].vel_q32 > 0);
    assert_true(point[2 * 7].vel_q32 == 0);
    if (through > 0.8 * stopping)
        fail_msg("%g s against %g s with stops", through, stopping);
    printf("8 points in %g s, %g s with stops\n", through, stopping);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(durations_match_in_any_unit),
        cmocka_unit_test(random_problems_are_always_answered),
        cmocka_unit_test(goal_that_needs_higher_speed_before_it_is_refused),
        cmocka_unit_test(simple_moves_take_what_the_formula_says),
        cmocka_unit_test(what_is_reached_early_is_not_missed),
        cmocka_unit_test(a_wanted_duration_is_met_exactly),
        cmocka_unit_test(replanning_does_not_come_late),
        cmocka_unit_test(there_is_an_answer_while_moving),
        cmocka_unit_test(a_stop_ends_at_rest),
        cmocka_unit_test(straight_lines_are_straight),
        cmocka_unit_test(points_are_passed_without_stopping),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
