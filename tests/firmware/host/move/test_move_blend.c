/* tests/firmware/host/move/test_move_blend.c - poses, layers, fades and the
 * warp of move.yaml, from the file to the tracks. */
#include "tests/firmware/host/move/move_file.h"

#include "motion/curve/time_warp.h"
#include "motion/plan/plan_blend.h"
#include "motion/plan/plan_warp.h"

#define RIG "examples/dolly/rig.yaml"

static const char *const axes[] = { "dolly", "pan", "tilt", "focus" };

#define POSES                                                                  \
    "poses:\n"                                                                 \
    "  wide: {dolly: 600 mm, pan: -12 deg, tilt: -4 deg, focus: 210 deg}\n"    \
    "  close: {dolly: 1.15 m, pan: 18 deg, tilt: 3 deg}\n"                     \
    "  window: {pan: 0.1 rev, focus: 160 deg}\n"
#define BLEND                                                                  \
    POSES                                                                      \
    "blend:\n"                                                                 \
    "  base: wide\n"                                                           \
    "  weights:\n"                                                             \
    "    close: {curve: s-curve, keys: [[1 s, 0 %], [9 s, 100 %], [20 s, "     \
    "0.2]]}\n"                                                                 \
    "    window: {curve: c2, keys: [[0 s, 0 %], [3 s, 130 %], [11 s, "         \
    "-20 %], [18 s, 50 %]]}\n"

static double value(int64_t q32)
{
    return ldexp((double)q32, -32);
}

/* A weight, planned by itself. */
static struct motion_track weight_of(const struct plan_axis *curve)
{
    struct motion_track track;
    struct plan_error error;

    assert_int_equal(plan_axis_track(curve, &track, &error), 0);
    return track;
}

static double track_at(const struct motion_track *track, int64_t t)
{
    struct motion_state state;

    motion_track_state(track, t, &state);
    return value(state.pos_q32);
}

static void a_blend_is_the_weighted_sum_of_its_poses(void **state)
{
    static const double pose[3][4] = { { 600, -12, -4, 210 },
                                       { 1150, 18, 3, 210 },
                                       { 600, 36, -4, 160 } };
    static struct move_file file;
    struct motion_track weight[2];
    uint64_t seed = 5;
    double worst = 0, moved = 0;
    (void)state;
    move_file_need(&file, RIG, BLEND);
    for (int k = 0; k < 2; k++)
        weight[k] = weight_of(&file.move.blend->weight[k].curve);
    for (int i = 0; i < 20000; i++) {
        const int64_t t = check_random_in(&seed, 0, 21 * MOVE_FILE_S);
        for (int a = 0; a < 4; a++) {
            double want = pose[0][a];
            for (int k = 0; k < 2; k++)
                want += track_at(&weight[k], t) * (pose[k + 1][a] - pose[0][a]);
            const double got = value(move_file_at(&file, axes[a], t).pos_q32);
            worst = fmax(worst, fabs(got - want));
            moved = fmax(moved, fabs(got - pose[0][a]));
        }
    }
    print_message("within %.1e\n", worst);
    /* the oracle's weights are rounded to 2^-32, times 550 mm */
    assert_true(worst < 600 * ldexp(1, -32) && moved > 500);
    for (int k = 0; k < 2; k++)
        plan_track_free(&weight[k]);
    move_file_close(&file);
}

static void a_pose_without_weight_is_the_base(void **state)
{
    static struct move_file file;
    (void)state;
    move_file_need(&file, RIG,
                   POSES "blend:\n  base: wide\n  weights: {close: {keys: [[0 "
                         "s, 0 %], [2 s, 0 %]]}}\n");
    for (int i = 0; i < 20; i++)
        assert_true(move_file_at(&file, "dolly", i * MOVE_FILE_S / 5).pos_q32 ==
                    (int64_t)600 << 32);
    move_file_close(&file);
}

#define KEYS                                                                   \
    "axes:\n"                                                                  \
    "  dolly: {curve: quintic, keys: [[0 s, 100], [4 s, 700], [9 s, 400]]}\n"  \
    "  pan: {curve: c2, keys: [[1 s, -20], [5 s, 30], [8 s, 10]]}\n"

static void layers_are_added(void **state)
{
    static struct move_file plain, file;
    struct motion_track sway;
    uint64_t seed = 6;
    (void)state;
    move_file_need(&plain, RIG, KEYS);
    move_file_need(&file, RIG,
                   KEYS "layers:\n"
                        "  - axes: {pan: {curve: quintic, keys: [[0 s, 0], [3 "
                        "s, 2 deg], [12 s, 1 deg]]}}\n"
                        "  - axes: {pan: {keys: [[0 s, 5 deg]]}}\n");
    sway = weight_of(&file.move.layer[0].move->axis[0]);
    for (int i = 0; i < 5000; i++) {
        const int64_t t = check_random_in(&seed, 0, 13 * MOVE_FILE_S);
        assert_true(move_file_at(&file, "dolly", t).pos_q32 ==
                    move_file_at(&plain, "dolly", t).pos_q32);
        assert_true(fabs(value(move_file_at(&file, "pan", t).pos_q32) -
                         value(move_file_at(&plain, "pan", t).pos_q32) -
                         track_at(&sway, t) - 5) < 4 * ldexp(1, -32));
    }
    plan_track_free(&sway);
    move_file_close(&plain);
    move_file_close(&file);
}

#define WEIGHT "  weight: {curve: s-curve, keys: [[2 s, 0 %], [6 s, 100 %]]}\n"
#define OTHER                                                                  \
    "  axes:\n"                                                                \
    "    pan: {curve: quintic, keys: [[0 s, 40], [5 s, -10], [10 s, 0]]}\n"

static void expect_faded(const struct move_file *plain,
                         const struct move_file *file)
{
    const struct plan_other *fade = file->move.fade;
    struct motion_track to = weight_of(&fade->move->axis[0]);
    struct motion_track weight = weight_of(&fade->weight);
    uint64_t seed = 7;

    for (int i = 0; i < 5000; i++) {
        const int64_t t = check_random_in(&seed, 0, 12 * MOVE_FILE_S);
        const double from = value(move_file_at(plain, "pan", t).pos_q32);
        const double w = track_at(&weight, t);
        assert_true(fabs(value(move_file_at(file, "pan", t).pos_q32) - from -
                         w * (track_at(&to, t) - from)) < 5e-8);
        assert_true(move_file_at(file, "dolly", t).pos_q32 ==
                    move_file_at(plain, "dolly", t).pos_q32);
    }
    assert_true(fabs(move_file_pos(file, "pan", 12)) < 1e-8);
    plan_track_free(&to);
    plan_track_free(&weight);
}

static void a_fade_goes_over_to_other_axes(void **state)
{
    static struct move_file plain, file;
    (void)state;
    move_file_need(&plain, RIG, KEYS);
    move_file_need(&file, RIG, KEYS "fade:\n" OTHER WEIGHT);
    expect_faded(&plain, &file);
    move_file_close(&plain);
    move_file_close(&file);
}

/* The other move stands beside the first one. */
static void a_fade_goes_over_to_a_move_in_another_file(void **state)
{
    static const char other[] =
        "axes:\n  pan: {curve: quintic, keys: [[0 s, 40], [5 s, -10], [10 s, "
        "0]]}\n";
    static struct move_file plain, file;
    char path[] = "/tmp/move_other_XXXXXX", text[1024];
    const int handle = mkstemp(path);
    (void)state;
    assert_true(handle >= 0);
    assert_int_equal(write(handle, other, sizeof other - 1), sizeof other - 1);
    close(handle);
    move_file_need(&plain, RIG, KEYS);
    for (int full = 0; full < 2; full++) {
        snprintf(text, sizeof text, "%sfade:\n  move: %s\n%s", KEYS,
                 full ? path : strrchr(path, '/') + 1, WEIGHT);
        move_file_need(&file, RIG, text);
        expect_faded(&plain, &file);
        move_file_close(&file);
    }
    remove(path);
    snprintf(text, sizeof text, "%sfade:\n  move: %s\n%s", KEYS, path, WEIGHT);
    assert_int_equal(move_file_open(&file, RIG, text), -1);
    move_file_close(&plain);
}

/* --- warp ----------------------------------------------------------------- */

static void expect_same_bits(const struct move_file *a,
                             const struct move_file *b)
{
    for (uint32_t i = 0; i < a->move.axis_count; i++) {
        const struct motion_track *x = &a->track[i], *y = &b->track[i];
        assert_int_equal(x->count, y->count);
        assert_memory_equal(x->segment, y->segment,
                            x->count * sizeof *x->segment);
        assert_memory_equal(&x->end, &y->end, sizeof x->end);
    }
}

static void a_warp_that_changes_nothing_changes_no_bit(void **state)
{
    static const char *const warp[] = {
        "{curve: linear, keys: [[0 s, 0 s], [9 s, 9 s]]}",
        "{curve: linear, keys: [[0 s, 0 s], [1.7 s, 1.7 s], [40 s, 40 s]]}",
        "{curve: c2, ends: natural, keys: [[0, 0], [4, 4 s], [9, 9 s]]}",
        "{curve: hermite, keys: [[0 s, 0 s, 100 %], [9 s, 9 s, 1]]}",
    };
    static struct move_file plain, file;
    (void)state;
    move_file_need(&plain, RIG, KEYS);
    for (size_t i = 0; i < ARRAY_LEN(warp); i++) {
        char text[1024];
        snprintf(text, sizeof text, KEYS "warp: %s\n", warp[i]);
        move_file_need(&file, RIG, text);
        expect_same_bits(&plain, &file);
        move_file_close(&file);
    }
    /* one that is over sooner is another move */
    move_file_need(&file, RIG,
                   KEYS "warp: {curve: linear, keys: [[0 s, 0 s], [8 s, 8 "
                        "s]]}\n");
    assert_true(file.track[0].end_ns_q12 == 8 * MOVE_FILE_S);
    move_file_close(&file);
    move_file_close(&plain);
}

/* p = f(w), v = f' w', a = f'' w'^2 + f' w''. */
static void a_warped_move_is_the_move_at_another_time(void **state)
{
    static struct move_file plain, file;
    uint64_t seed = 9;
    (void)state;
    move_file_need(&plain, RIG, KEYS);
    move_file_need(&file, RIG,
                   KEYS "warp: {curve: quintic, keys: [[0 s, 0 s], [4 s, 2 s], "
                        "[6 s, 5 s], [12 s, 9 s]]}\n");
    assert_true(plan_outcome_time(&file.outcome, 4 * MOVE_FILE_S) ==
                2 * MOVE_FILE_S);
    for (int i = 0; i < 5000; i++) {
        const int64_t t = check_random_in(&seed, 0, 12 * MOVE_FILE_S - 1);
        for (int a = 0; a < 2; a++) {
            const struct motion_state got = move_file_at(&file, axes[a], t);
            struct motion_state want;
            motion_time_warp_state(&plain.track[a], &file.outcome.warp, t,
                                   &want);
            if (fabs(value(got.pos_q32) - value(want.pos_q32)) > 1e-6 ||
                fabs(value(got.vel_q32) - value(want.vel_q32)) > 1e-4 ||
                fabs(ldexp((double)got.acc_q32, -32) -
                     ldexp((double)want.acc_q32, -32)) > 1e-2)
                fail_msg("%s at %g s", axes[a], value(t));
        }
    }
    move_file_close(&plain);
    move_file_close(&file);
}

/* 161 mm/s at most of 300; at twice the speed it is 321. */
static void limits_are_found_through_the_warp(void **state)
{
    static const char move[] =
        "axes:\n  dolly: {curve: s-curve, keys: [[0 s, 100 mm], [14 s, 1600 "
        "mm]]}\n";
    static struct move_file file;
    struct plan_violation found[8];
    struct motion_extreme vel;
    char text[1024];
    uint32_t count;
    (void)state;
    move_file_need(&file, RIG, move);
    assert_int_equal(
        plan_check_track(&file.track[0], &file.rig.axis[0].limit, found, 8), 0);
    motion_track_extreme(&file.track[0], MOTION_VEL, &vel);
    const double peak = value(vel.max);
    move_file_close(&file);
    snprintf(text, sizeof text,
             "%swarp: {curve: linear, keys: [[0 s, 0 s], [7 s, 14 s]]}\n",
             move);
    move_file_need(&file, RIG, text);
    motion_track_extreme(&file.track[0], MOTION_VEL, &vel);
    assert_true(fabs(value(vel.max) - 2 * peak) < 1e-6);
    count = plan_check_track(&file.track[0], &file.rig.axis[0].limit, found, 8);
    assert_true(count > 0);
    bool fast = false;
    for (uint32_t i = 0; i < count && i < 8; i++)
        fast = fast || (found[i].kind == PLAN_VEL &&
                        fabs(value(found[i].value) - 2 * peak) < 1e-6);
    assert_true(fast);
    move_file_close(&file);
}

/* The path's speed is that of the warped law. */
static void a_warp_slows_a_path_down(void **state)
{
    static struct move_file file;
    struct motion_extreme speed;
    (void)state;
    move_file_need(&file, "examples/flyby/rig.yaml",
                   "path:\n  axes: [x, y, z]\n"
                   "  points: [[0, 0, 0], [1000, 500, 300], [3000, 0, 500]]\n"
                   "  speed: [{law: ramp, time: 1 s, to: 400 mm/s}, {law: "
                   "constant}, {law: ramp, time: 1 s, to: 0}]\n"
                   "warp: {curve: linear, keys: [[0 s, 0 s], [30 s, 15 s]]}\n");
    motion_track_extreme(&file.outcome.distance, MOTION_VEL, &speed);
    assert_true(fabs(value(speed.max) - 200) < 1e-6);
    move_file_close(&file);
}

/* --- refused -------------------------------------------------------------- */

static void what_cannot_be_mixed_is_said(void **state)
{
    static const struct {
        const char *text, *message;
    } rows[] = {
        { POSES KEYS, "1:1: the move has poses, but no blend of them" },
        { KEYS "blend: {base: wide, weights: {}}\n",
          "4:8: blend has no poses" },
        { POSES "blend: {base: wiide, weights: {}}\n",
          "5:15: unknown base 'wiide'" },
        { POSES "blend: {base: wide, weights: {}}\n",
          "5:30: weights is empty" },
        { POSES "blend: {base: wide, weights: {cloze: {keys: [[0, 0]]}}}\n",
          "5:31: unknown pose 'cloze'" },
        { POSES "blend: {base: wide, weights: {wide: {keys: [[0, 0]]}}}\n",
          "5:31: pose 'wide' is the base itself" },
        { POSES "blend: {base: close, weights: {window: {keys: [[0, 0]]}}}\n",
          "5:32: pose has the axis 'focus', which the base 'close' has not" },
        { "axes: {pan: {keys: [[0, 0]]}}\n" BLEND,
          "3:25: axis 'pan' is driven by the keys in line 1 already" },
        { "poses: {a: {pan: 3 mm}}\n", "1:18: pan '3 mm' is a length" },
        { "poses: {a: {pen: 3}}\n", "1:13: unknown axis 'pen'" },
        { POSES
          "blend: {base: wide, weights: {close: {keys: [[0 s, 3 mm]]}}}\n",
          "5:52: p '3 mm'" },
        { KEYS "layers: [{axes: {focus: {keys: [[0, 0]]}}}]\n",
          "4:18: layer has the axis 'focus', which nothing else drives" },
        { KEYS "layers: [{}]\n", "4:10: layer moves nothing" },
        { KEYS "layers: []\n", "4:9: layers has 0 items" },
        { KEYS "fade: {axes: {pan: {keys: [[0, 0]]}}}\n",
          "4:7: fade has no 'weight'" },
        { KEYS "fade: {move: no/such/file, weight: {keys: [[0, 0]]}}\n",
          "the file cannot be read (No such file or directory)" },
        { KEYS "fade: {axes: {focus: {keys: [[0, 0]]}}, weight: {keys: [[0, "
               "0]]}}\n",
          "4:15: fade has the axis 'focus', which nothing else drives" },
        { KEYS "warp: {curve: linear, keys: [[0 s, 0 s], [3 s, 5 s], [6 s, 4 "
               "s]]}\n",
          "4:42: the warp goes backwards at 3.000 s" },
        { KEYS "warp: {curve: linear, keys: [[0 s, -1 s], [3 s, 5 s]]}\n",
          "4:36: p '-1 s' is before the start of the move" },
        { KEYS "warp: {curve: linear, keys: [[0 s, 1 mm], [3 s, 5 s]]}\n",
          "4:36: p '1 mm'" },
        { KEYS "warp: {keys: [[0 s, 1 s]]}\n", "the warp has one key" },
    };
    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(rows); i++)
        move_file_refuse(RIG, rows[i].text, rows[i].message);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_blend_is_the_weighted_sum_of_its_poses),
        cmocka_unit_test(a_pose_without_weight_is_the_base),
        cmocka_unit_test(layers_are_added),
        cmocka_unit_test(a_fade_goes_over_to_other_axes),
        cmocka_unit_test(a_fade_goes_over_to_a_move_in_another_file),
        cmocka_unit_test(a_warp_that_changes_nothing_changes_no_bit),
        cmocka_unit_test(a_warped_move_is_the_move_at_another_time),
        cmocka_unit_test(limits_are_found_through_the_warp),
        cmocka_unit_test(a_warp_slows_a_path_down),
        cmocka_unit_test(what_cannot_be_mixed_is_said),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
