/* tests/motion/plan/shoot/test_plan_shoot.c - a move frame by frame, against the plain
 * move at the times that the modes define. */
#include "motion/plan/shoot/plan_shoot.h"

#include "motion/core/err.h"
#include "motion/curve/time_warp.h"
#include "motion/plan/shoot/plan_event.h"
#include "tests/firmware/host/move/move_file.h"

#define RIG "tests/data/triggers/rig.yaml"
#define SEC ((double)MOVE_FILE_S)

static const char plain_text[] =
    "axes: {x: {keys: [[0 s, 0], [1 s, 40], [2.5 s, 90], [4 s, 60]]}, "
    "y: {curve: s-curve, keys: [[0 s, 10], [3 s, -20]]}}\n";

static struct move_file plain, shot;
static struct plan_shots shots;

static int close_all(void **state)
{
    (void)state;
    plan_shots_free(&shots);
    move_file_close(&shot);
    move_file_close(&plain);
    return 0;
}

static void make(const char *shoot)
{
    char text[1024];
    struct plan_error error = { .text = "" };

    move_file_need(&plain, RIG, plain_text);
    snprintf(text, sizeof text, "%sshoot: {line: camera, %s}\n", plain_text,
             shoot);
    move_file_need(&shot, RIG, text);
    if (plan_shots_make(&shot.move, shot.track, &shot.outcome, 0, &shots,
                        &error) < 0)
        fail_msg("%s", error.text);
}

static void near(const char *what, double t_s, double got, double want,
                 double most)
{
    if (!(fabs(got - want) <= most))
        fail_msg("%s at %.9f s: %.12g, expected %.12g", what, t_s, got, want);
}

/* Both axes at a time of the shoot are where the plain move is at w. */
static void is_at(double t_s, double w_s)
{
    near("x", t_s, move_file_pos(&shot, "x", t_s),
         move_file_pos(&plain, "x", w_s), 1e-6);
    near("y", t_s, move_file_pos(&shot, "y", t_s),
         move_file_pos(&plain, "y", w_s), 1e-6);
}

static double shot_s(uint32_t k)
{
    return (double)shots.t_ns_q12[k] / SEC;
}

static void stopped_it_rests_while_the_shutter_is_open(void **state)
{
    (void)state;
    make("mode: stop, frames: 9, exposure: 400 ms, settle: 0.3 s, move: 2 s");
    assert_int_equal(shots.count, 9);
    for (uint32_t k = 0; k < 9; k++) {
        near("shot", k, shot_s(k), 0.3 + k * 2.7, 1e-9);
        for (double u = -0.299; u < 0.4; u += 0.1) {
            is_at(shot_s(k) + u, 4.0 * k / 8);
            const int64_t t = (int64_t)((shot_s(k) + u) * SEC);
            assert_int_equal(move_file_at(&shot, "x", t).vel_q32, 0);
            assert_int_equal(move_file_at(&shot, "y", t).vel_q32, 0);
        }
    }
    /* both ends to the bit */
    assert_true(shot.track[0].end.pos_q32 == plain.track[0].end.pos_q32);
    assert_true(shot.track[1].end.pos_q32 == plain.track[1].end.pos_q32);
}

/* While it is open, at a constant rate over blur * 4 s / frames, the middle of
 * a frame's share in the middle of the exposure. */
static void judge_exposures(uint32_t frames, double exposure_s, double blur)
{
    const double share = 4.0 / frames;

    assert_int_equal(shots.count, frames);
    for (uint32_t k = 0; k < frames; k++)
        for (int i = 0; i <= 8; i++) {
            const double u = i / 8.0;
            is_at(shot_s(k) + u * exposure_s,
                  share * (k + 0.5 + blur * (u - 0.5)));
        }
}

static void go_motion_moves_while_the_shutter_is_open(void **state)
{
    (void)state;
    make("mode: go-motion, frames: 10, exposure: 500 ms, settle: 0.2 s, "
         "move: 0.8 s, blur: 50 %");
    judge_exposures(10, 0.5, 0.5);
    near("first shot", 0, shot_s(0), 0.2 + 0.5, 1e-9);
    near("period", 0, shot_s(1) - shot_s(0), 1.3, 1e-9);
    assert_true(shot.track[0].end.pos_q32 == plain.track[0].end.pos_q32);
}

static void go_motion_rests_between_where_there_is_time(void **state)
{
    (void)state;
    make("mode: go-motion, frames: 5, exposure: 1 s, move: 4 s, blur: 40 %");
    judge_exposures(5, 1, 0.4);
    for (uint32_t k = 0; k < 4; k++) {
        /* R = 1.5 s: at rest from 1.5 s to 2.5 s after the exposure */
        is_at(shot_s(k) + 1 + 1.6, 0.8 * (k + 1));
        is_at(shot_s(k) + 1 + 2.4, 0.8 * (k + 1));
    }
}

static void continuous_is_one_rate_from_first_to_last(void **state)
{
    (void)state;
    make("mode: continuous, frames: 8, exposure: 0.5 s, move: 1.5 s");
    judge_exposures(8, 0.5, 0.25);
    for (double t = shot_s(0); t < shot_s(7); t += 0.0371)
        is_at(t, 0.25 + (t - shot_s(0) - 0.25) * 0.25);
}

/* The chain rule at many times bounds what a shoot may show; a quarter is added
 * for what is between them.  A piece that is cut off too short shows a thousand
 * times as much. */
static void no_picture_makes_it_jerk(void **state)
{
    (void)state;
    seed_from("shoots");
    for (int n = 0; n < 60; n++) {
        static const char *const mode[] = { "stop", "go-motion", "continuous" };
        char shoot[200];
        const int m = n % 3;
        int length = snprintf(
            shoot, sizeof shoot,
            "mode: %s, frames: %d, exposure: %.3f s, settle: %d ms, "
            "move: %.3f s",
            mode[m], 2 + (int)(draw_unit() * 40), 0.1 + 3 * (double)draw_unit(),
            (int)(draw_unit() * 3) * 250, 0.1 + 6 * (double)draw_unit());
        if (m == 1)
            snprintf(shoot + length, sizeof shoot - (size_t)length,
                     ", blur: %d %%", 5 + (int)(draw_unit() * 90));
        make(shoot);
        for (uint32_t a = 0; a < 2; a++) {
            const struct motion_track *track = &shot.track[a];
            struct plan_violation found;
            double vel = 0, acc = 0, jerk = 0;
            for (int i = 0; i < 20000; i++) {
                struct motion_state at;
                motion_time_warp_state(&plain.track[a], &shot.outcome.warp,
                                       track->end_ns_q12 / 20000 * i, &at);
                vel = fmax(vel, fabs((double)at.vel_q32));
                acc = fmax(acc, fabs((double)at.acc_q32));
                jerk = fmax(jerk, fabs((double)at.jerk_q32));
            }
            const struct plan_limit limit = {
                .pos_min_q32 = -100 * MOTION_FIXED_ONE_Q32,
                .pos_max_q32 = 200 * MOTION_FIXED_ONE_Q32,
                .vel_q32 = (int64_t)(1.25 * vel) + 1000,
                .acc_q32 = (int64_t)(1.25 * acc) + 1000000,
                .jerk_q32 = (int64_t)(1.25 * jerk) + 1000000,
                .period_ns = 1000000,
            };
            if (plan_check_track(track, &limit, &found, 1) > 0)
                fail_msg("%s\naxis %u, kind %d at %.9f s: %.6g, most %.6g",
                         shoot, a, (int)found.kind,
                         (double)found.t_ns_q12 / SEC,
                         ldexp((double)found.value, -32),
                         ldexp((double)found.limit, -32));
        }
        close_all(NULL);
    }
    make("mode: stop, frames: 2, exposure: 1 s, move: 1 s"); /* for teardown */
}

static void what_cannot_be_shot_is_refused(void **state)
{
    static const struct {
        const char *text, *want;
    } row[] = {
        { "mode: bulb, frames: 9, exposure: 1 s, move: 1 s",
          "expected stop, go-motion or continuous" },
        { "mode: stop, frames: 1, exposure: 1 s, move: 1 s",
          "'1' is out of range" },
        { "mode: stop, frames: 2.5, exposure: 1 s, move: 1 s",
          "'2.5' is out of range" },
        { "mode: stop, frames: 100001, exposure: 1 s, move: 1 s",
          "out of range" },
        { "mode: stop, frames: 9, exposure: 0 s, move: 1 s", "out of range" },
        { "mode: stop, frames: 9, exposure: 1 s, move: 0 s", "out of range" },
        { "mode: stop, frames: 9, exposure: 1 s, settle: -1 s, move: 1 s",
          "out of range" },
        { "mode: stop, frames: 9, exposure: 1 s, move: 1 s, blur: 50 %",
          "blur is not used by mode stop" },
        { "mode: go-motion, frames: 9, exposure: 1 s, move: 1 s, blur: 0 %",
          "'0 %' is out of range" },
        { "mode: go-motion, frames: 9, exposure: 1 s, move: 1 s, blur: 100 %",
          "'100 %' is out of range" },
        { "mode: stop, frames: 99999, exposure: 24 h, move: 24 h",
          "longer than 19 days" },
        { "mode: stop, frames: 9, exposure: 1 s", "move" },
        { "mode: stop, frames: 9, exposure: 1 s, move: 1 s, step: camera",
          "expected operator" },
        { "mode: continuous, frames: 9, exposure: 1 s, move: 1 s, "
          "step: operator",
          "does not rest between its pictures" },
        { "mode: go-motion, frames: 9, exposure: 1 s, move: 1.9 s, "
          "step: operator",
          "a move of at least 2 s" },
    };
    char text[1024];

    (void)state;
    for (size_t i = 0; i < sizeof row / sizeof *row; i++) {
        snprintf(text, sizeof text, "%sshoot: {line: camera, %s}\n", plain_text,
                 row[i].text);
        move_file_refuse(RIG, text, row[i].want);
    }
    snprintf(text, sizeof text,
             "%swarp: {keys: [[0 s, 0 s], [4 s, 4 s]]}\n"
             "shoot: {line: camera, mode: stop, frames: 9, exposure: 1 s, "
             "move: 1 s}\n",
             plain_text);
    move_file_refuse(RIG, text, "is given beside a warp");
    move_file_refuse(RIG,
                     "axes: {x: {keys: [[0 s, 5]]}}\n"
                     "shoot: {line: camera, mode: stop, frames: 9, "
                     "exposure: 1 s, move: 1 s}\n",
                     "a move that takes time");
    snprintf(text, sizeof text,
             "%sshoot: {mode: stop, frames: 9, exposure: 1 s, move: 1 s}\n",
             plain_text);
    move_file_refuse(RIG, text, "has no line");
}

/* Both axes from there on, for as long as the clock may take to stand. */
static void is_at_rest(int64_t from)
{
    for (int j = 0; j <= 16; j++) {
        const int64_t t = from + shot.move.shoot->wait_ns_q12 * j / 16;
        for (uint32_t a = 0; a < 2; a++) {
            const struct motion_state at =
                move_file_at(&shot, a == 0 ? "x" : "y", t);
            if (at.vel_q32 != 0 || at.acc_q32 != 0)
                fail_msg("axis %u moves at %.6f s", a, (double)t / SEC);
        }
    }
}

static void rests_where_it_waits(const char *shoot)
{
    struct plan_shoot_times times;

    make(shoot);
    plan_shoot_times(shot.move.shoot, &times);
    near("wait", 0, (double)shot.move.shoot->wait_ns_q12 / SEC, 0.032, 1e-9);
    for (uint32_t k = 0; k < shots.count; k++) {
        const int64_t from = times.wait_ns_q12 + k * times.period_ns_q12;
        if (from + shot.move.shoot->wait_ns_q12 > shots.t_ns_q12[k])
            fail_msg("%s: it opens before it has waited", shoot);
        is_at_rest(from);
    }
    close_all(NULL);
}

static void where_a_step_waits_all_axes_rest(void **state)
{
    (void)state;
    rests_where_it_waits("mode: stop, frames: 7, exposure: 400 ms, "
                         "settle: 0.3 s, move: 2 s, step: operator");
    rests_where_it_waits("mode: stop, frames: 3, exposure: 1 ms, move: 1 s, "
                         "step: operator");
    rests_where_it_waits("mode: go-motion, frames: 7, exposure: 500 ms, "
                         "move: 1 s, step: operator");
    rests_where_it_waits("mode: go-motion, frames: 4, exposure: 200 ms, "
                         "settle: 1 s, move: 3 s, blur: 30 %, step: operator");
    make("mode: stop, frames: 2, exposure: 1 s, move: 1 s"); /* for teardown */
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_teardown(stopped_it_rests_while_the_shutter_is_open,
                                  close_all),
        cmocka_unit_test_teardown(go_motion_moves_while_the_shutter_is_open,
                                  close_all),
        cmocka_unit_test_teardown(go_motion_rests_between_where_there_is_time,
                                  close_all),
        cmocka_unit_test_teardown(where_a_step_waits_all_axes_rest, close_all),
        cmocka_unit_test_teardown(continuous_is_one_rate_from_first_to_last,
                                  close_all),
        cmocka_unit_test_teardown(no_picture_makes_it_jerk, close_all),
        cmocka_unit_test(what_cannot_be_shot_is_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
