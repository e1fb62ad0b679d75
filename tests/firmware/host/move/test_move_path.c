/* tests/firmware/host/move/test_move_path.c - paths of move.yaml, from the file
 * to the tracks. */
#include "tests/firmware/host/move/move_file.h"

#define RIG "examples/flyby/rig.yaml"

static const char *const axes[] = { "x", "y", "z" };

static double speed_at(const struct move_file *file, int64_t t)
{
    double sum = 0;

    for (int i = 0; i < 3; i++) {
        const double v =
            ldexp((double)move_file_at(file, axes[i], t).vel_q32, -32);
        sum += v * v;
    }
    return sqrt(sum);
}

/* Twisted enough that the parameter's speed varies by a factor of five. */
#define POINTS                                                                 \
    "  points:\n"                                                              \
    "    - [100 mm, -900 mm, 300 mm]\n"                                        \
    "    - [900 mm, -1100 mm, 500 mm]\n"                                       \
    "    - [1100 mm, -600 mm, 900 mm]\n"                                       \
    "    - [2700 mm, 300 mm, 700 mm]\n"                                        \
    "    - [3500 mm, 1000 mm, 1500 mm]\n"

static void constant_speed_is_constant_along_every_curve(void **state)
{
    static const char *const curve[] = {
        "c2",
        "c2\n  closed: true",
        "c2\n  spacing: uniform",
        "c2\n  tolerance: 1 mm", /* of place, not of speed */
        "quintic",
        "quintic\n  spacing: centripetal",
        "quintic\n  closed: true",
        "catmull-rom\n  spacing: chordal",
        "catmull-rom\n  closed: true",
        "akima",
        "akima\n  closed: true",
        "b-spline",
        "smoothed\n  corner: 300 mm",
        "rounded\n  corner: 300 mm",
    };
    static struct move_file file;
    (void)state;
    for (size_t k = 0; k < ARRAY_LEN(curve); k++) {
        uint64_t seed = 7 + k;
        double worst = 0;
        char text[1024];
        snprintf(text, sizeof text,
                 "path:\n  axes: [x, y, z]\n  curve: %s\n" POINTS "  speed:\n"
                 "    - {law: ramp, time: 2 s, to: 310 mm/s}\n"
                 "    - {law: constant}\n"
                 "    - {law: ramp, time: 1 s, to: 0}\n",
                 curve[k]);
        move_file_need(&file, RIG, text);
        const int64_t end = file.outcome.distance.end_ns_q12;
        for (int i = 0; i < 20000; i++) {
            const int64_t t =
                check_random_in(&seed, 2 * MOVE_FILE_S, end - MOVE_FILE_S);
            worst = fmax(worst, fabs(speed_at(&file, t) / 310 - 1));
        }
        print_message("%-32.32s %8.3f mm, speed within %.1e\n", curve[k],
                      ldexp((double)file.outcome.drive.space.length_q32, -32),
                      worst);
        if (worst > 1e-6)
            fail_msg("%s: %g", curve[k], worst);
        move_file_close(&file);
    }
}

/* Ramps and S-curves too: what the axes do together is what the law says. */
static void speed_along_the_path_is_that_of_the_law(void **state)
{
    static const char *const speed[] = {
        "{law: quintic, time: 12 s}",
        "{law: cubic, time: 12 s}",
        "{law: sine, time: 12 s, ease: [0.2, 0.7]}",
        "{law: parabolic, time: 12 s}",
        "{law: s-curve, time: 12 s, ease: [40 %, 60 %]}",
        "[{law: ramp, shape: sine, time: 3 s, to: 400 mm/s}, {law: constant, "
        "time: 1 s}, {law: velocity, points: [[0 s, 400 mm/s], [2 s, 400 "
        "mm/s], [4 s, 0 mm/s]]}, {law: pause, time: 1 s}, {law: quintic, time: "
        "6 s}]",
        "[{law: acceleration, length: 40 %, points: [[0 s, 0], [1 s, 1], [3 s, "
        "1], [4 s, 0], [4 s, -2], [5.5 s, -2]]}, {law: drawn, distance: "
        "{curve: s-curve, keys: [[0 s, 0 %], [6 s, 70 %], [9 s, 100 %]]}}]",
        "[{law: ramp, shape: cubic, time: 2 s, to: 300 mm/s}, {law: constant, "
        "length: 1 m}, {law: ramp, shape: linear, time: 1 s, to: 100 mm/s}, "
        "{law: constant}]",
    };
    static struct move_file file;
    (void)state;
    for (size_t k = 0; k < ARRAY_LEN(speed); k++) {
        uint64_t seed = 70 + k;
        double worst = 0, top = 0;
        char text[1024];
        snprintf(text, sizeof text,
                 "path:\n  axes: [x, y, z]\n" POINTS "  speed: %s\n", speed[k]);
        move_file_need(&file, RIG, text);
        const struct motion_track *law = &file.outcome.distance;
        for (int i = 0; i < 5000; i++) {
            const int64_t t = check_random_in(&seed, 0, law->end_ns_q12 - 1);
            struct motion_state at;
            motion_track_state(law, t, &at);
            const double want = ldexp((double)at.vel_q32, -32);
            top = fmax(top, want);
            worst = fmax(worst, fabs(speed_at(&file, t) - want));
        }
        assert_true(top > 100);
        if (worst > 1e-6 * top)
            fail_msg("%s: %g of %g", speed[k], worst, top);
        assert_true(fabs(ldexp((double)(law->end.pos_q32 -
                                        file.outcome.drive.space.length_q32),
                               -32)) < 1e-8);
        assert_true(fabs(move_file_pos(&file, "x", 100) - 3500) < 1e-8);
        move_file_close(&file);
    }
}

static void the_points_are_on_the_path_and_the_bound_holds(void **state)
{
    static struct move_file file;
    (void)state;
    move_file_need(&file, RIG,
                   "path:\n  axes: [x, y, z]\n" POINTS
                   "  speed: {law: quintic, time: 9 s}\n");
    const struct plan_drive *drive = &file.outcome.drive;
    uint64_t seed = 3;
    double worst = 0, bound = 0;
    for (int k = 0; k < 3; k++)
        bound =
            fmax(bound, ldexp((double)drive->bound[k].m, drive->bound[k].e));
    for (int i = 0; i < 5000; i++) {
        const int64_t t = check_random_in(&seed, 0, 9 * MOVE_FILE_S - 1);
        struct motion_state at;
        struct motion_vec pos;
        int64_t want[3];
        motion_track_state(&file.outcome.distance, t, &at);
        assert_int_equal(plan_space_at(&drive->space, at.pos_q32, &pos, NULL),
                         0);
        assert_int_equal(motion_vec_round(pos, 32, want), 0);
        for (int k = 0; k < 3; k++)
            worst = fmax(
                worst,
                fabs(ldexp(
                    (double)(move_file_at(&file, axes[k], t).pos_q32 - want[k]),
                    -32)));
    }
    print_message("%.1e seen, %.1e promised\n", worst, bound);
    assert_true(worst <= bound + 1e-9 && bound <= 1.1e-6);
    for (uint32_t i = 0; i < file.move.path->points.count; i++) {
        const double s =
            ldexp((double)motion_arclen_border(&drive->space.table, i).m,
                  motion_arclen_border(&drive->space.table, i).e);
        struct motion_vec pos;
        int64_t got[3];
        assert_int_equal(
            plan_space_at(&drive->space, (int64_t)ldexp(s, 32), &pos, NULL), 0);
        assert_int_equal(motion_vec_round(pos, 32, got), 0);
        for (int k = 0; k < 3; k++)
            assert_true(
                fabs(ldexp(
                    (double)(got[k] - file.move.path->points.point[i].q32[k]),
                    -32)) < 1e-8);
    }
    move_file_close(&file);
}

/* A unit circle by c2, closed: no seam, and nearly 2 pi r. */
static void a_closed_path_has_no_seam(void **state)
{
    static const char *const curve[] = { "c2", "quintic", "catmull-rom",
                                         "akima" };
    (void)state;
    for (size_t k = 0; k < ARRAY_LEN(curve); k++) {
        static struct move_file file;
        char text[2048];
        size_t used = (size_t)snprintf(
            text, sizeof text,
            "path:\n  axes: [x, y]\n  curve: %s\n  closed: true\n  points:\n",
            curve[k]);
        for (int i = 0; i < 16; i++)
            used += (size_t)snprintf(text + used, sizeof text - used,
                                     "    - [%.6f, %.6f]\n",
                                     2000 + 1000 * cos(i * acos(-1) / 8),
                                     1000 * sin(i * acos(-1) / 8));
        snprintf(text + used, sizeof text - used,
                 "  speed: {law: constant, from: 500 mm/s}\n");
        move_file_need(&file, RIG, text);
        const struct motion_track *x = move_file_track(&file, "x");
        const struct motion_track *y = move_file_track(&file, "y");
        struct motion_state first, last;
        motion_segment_state(&y->segment[0], 0, &first);
        motion_segment_state(&y->segment[y->count - 1],
                             y->segment[y->count - 1].dur_ns_q12, &last);
        assert_true(x->end.pos_q32 == x->segment[0].pos_q32);
        assert_true(fabs(ldexp((double)(first.vel_q32 - last.vel_q32), -32)) <
                    1e-4);
        assert_true(
            fabs(ldexp((double)file.outcome.drive.space.length_q32, -32) -
                 2000 * acos(-1)) < 10);
        move_file_close(&file);
    }
}

static void a_path_that_is_too_fast_is_found(void **state)
{
    static struct move_file file;
    struct plan_violation found[4];
    uint32_t count;
    (void)state;
    move_file_need(&file, RIG,
                   "path:\n  axes: [x, y, z]\n" POINTS
                   "  speed: {law: quintic, time: 4 s}\n");
    count = plan_check_track(move_file_track(&file, "x"),
                             &file.rig.axis[0].limit, found, 4);
    assert_true(count > 0);
    move_file_close(&file);
}

#define HEAD "path:\n  axes: [x, y, z]\n"
#define GOOD "  speed: {law: quintic, time: 9 s}\n"

static const struct {
    const char *text, *message;
} refused[] = {
    { HEAD POINTS "  speed:\n    - {law: constant, from: 300 mm/s, time: 1 "
                  "s}\n",
      "10:7: the speed law covers 300 of the path's 4" },
    { HEAD POINTS "  speed:\n    - {law: quintic, time: 1 s, length: 9 "
                  "m}\n    - {law: quintic, time: 1 s}\n",
      "11:7: the other parts of the speed law cover 9000 already" },
    { HEAD POINTS "  speed:\n    - {law: ramp, time: 1 s, to: 300 mm/s}\n  "
                  "  - {law: quintic, time: 9 s}\n",
      "11:7: part 2 of the speed law starts at 0/s, but the part before it "
      "ends at 300/s" },
    { HEAD POINTS "  speed:\n    - {law: constant}\n",
      "10:7: part 1 of the speed law stands still" },
    { HEAD POINTS "  speed:\n    - {law: quintic, time: 1000000 s}\n",
      "10:7: part 1 of the speed law takes 1e+06 s, expected at most 281475 "
      "s" },
    { HEAD POINTS "  speed:\n    - {law: quintic, length: 300, time: 10 s}\n"
                  "    - {law: cubic, time: 300000 s}\n",
      "11:7: part 2 of the speed law takes 300000 s, expected at most 281475 "
      "s" },
    { HEAD POINTS "  speed:\n    - {law: quintic, time: 1 s}\n    - {law: "
                  "quintic, time: 1 s}\n",
      "11:7: parts 1 and 2 of the speed law both take the rest" },
    { HEAD POINTS "  speed:\n    - {law: drawn, distance: {curve: quintic, "
                  "keys: [[0 s, 0 %], [1 s, 60 %], [2 s, 20 %], [5 s, 100 "
                  "%]]}}\n",
      "10:7: part 1 of the speed law goes back somewhere" },
    { HEAD POINTS "  speed:\n    - {law: velocity, points: [[0 s, 1], [1 "
                  "s, -1], [3 s, 9]], length: rest}\n",
      "10:7: part 1 of the speed law goes back somewhere" },
    { HEAD POINTS "  speed: {law: quintic}\n",
      "9:10: part has no 'time', which speed law quintic needs" },
    { HEAD POINTS "  speed: {law: quintic, time: 3 s, to: 3}\n",
      "9:40: to is not used by speed law quintic" },
    { HEAD POINTS "  speed: {law: ramp, time: 3 s, to: -3}\n",
      "9:37: to '-3' goes backwards" },
    { HEAD POINTS "  speed: []\n", "9:10: speed has 0 items" },
    { HEAD POINTS "  speed: {law: fast, time: 3 s}\n",
      "9:16: unknown law 'fast'" },
    { HEAD POINTS "  speed: {law: pause, time: 0 s}\n",
      "9:29: time '0 s' is not above zero" },
    { HEAD POINTS "  speed: {law: constant, from: 1, length: 101 %}\n",
      "9:43: length '101 %' is not on the path" },
    { HEAD POINTS
      "  speed: {law: drawn, distance: {keys: [[0, 0], [1, 0.5]]}}\n",
      "9:33: distance does not go from [0 s, 0 %] to 100 %" },
    { HEAD POINTS
      "  speed: {law: acceleration, points: [[1 s, 0], [2 s, 0]]}\n",
      "9:40: point does not begin at 0 s" },
    { HEAD "  points: [[0, 0, 0]]\n" GOOD, "3:11: points has 1 item" },
    { HEAD "  points: [[0, 0, 0], [1, 2]]\n" GOOD, "3:23: point has 2 items" },
    { HEAD "  points: [[0, 0, 0], [1, 2, 3], [1, 2, 3]]\n" GOOD,
      "3:34: point is the same as the one before it (line 3)" },
    { HEAD "  closed: true\n  points: [[0, 0, 0], [1, 2, 3], [1, 2, 4], "
           "[0, 0, 0]]\n" GOOD,
      "4:45: point repeats the first one" },
    { HEAD "  closed: true\n  points: [[0, 0, 0], [1, 2, 3]]\n" GOOD,
      "4:11: points has 2 items" },
    { HEAD "  closed: true\n  curve: b-spline\n" POINTS GOOD,
      "3:11: closed is not possible with curve b-spline" },
    { HEAD "  curve: smoothed\n" POINTS GOOD,
      "5:5: points come without a corner" },
    { HEAD "  corner: 3 mm\n" POINTS GOOD,
      "3:11: corner is not used by curve c2" },
    { HEAD "  curve: hermite\n" POINTS GOOD, "3:10: unknown curve 'hermite'" },
    { "path:\n  axes: [x]\n" POINTS GOOD, "2:9: axes has 1 item" },
    { "path:\n  axes: [x, y, w]\n" POINTS GOOD, "2:16: unknown axis 'w'" },
    { "path:\n  axes: [x, y, y]\n" POINTS GOOD,
      "2:16: axes 'y' is driven by the path in line 2 already" },
    { "path:\n  axes: [x, y, pan]\n" POINTS GOOD,
      "2:16: axes has the axis 'pan' in deg beside one in mm" },
    { "axes: {z: {keys: [[0, 1]]}}\n" HEAD POINTS GOOD,
      "3:16: axes 'z' is driven by the keys in line 1 already" },
    { HEAD "  points: [[-1000, 0, 0], [0, 0, 0], [0.14, 0.14, 0], [700, 1000, "
           "0]]\n  speed: {law: quintic, time: 30 s}\n",
      "3:27: the path bends too sharply 1000.0" },
    { HEAD "  points: [[-1000, 0, 0], [0, 0, 0], [0.14, 0.14, 0], [700, 1000, "
           "0]]\n  speed: {law: quintic, time: 30 s}\n",
      " from its start to be followed at 138/s, between points 2 and 3, which "
      "are 0.198 apart and 0.001524 s after each other: go slower there" },
    { HEAD
      "  curve: quintic\n  points: [[0, 0, 0], [100, 0, 0], [50, 0, 0]]\n" GOOD,
      "4:23: the path turns on the spot by 180 deg, 100 from its start and " },
    { "title: a\n", "1:1: the move moves nothing, expected axes, a path" },
};

static void what_cannot_be_driven_is_said_at_its_place(void **state)
{
    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(refused); i++)
        move_file_refuse(RIG, refused[i].text, refused[i].message);
}

/* slew check says where its speed steps. */
static void a_path_may_turn_on_the_spot(void **state)
{
    static struct move_file file;
    (void)state;
    move_file_need(&file, RIG,
                   HEAD "  curve: linear\n  points: [[0, 0, 0], [9, 0, 0], [1, "
                        "0, 0]]\n" GOOD);
    assert_true(fabs(move_file_pos(&file, "x", 9) - 1) < 1e-9);
    move_file_close(&file);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(constant_speed_is_constant_along_every_curve),
        cmocka_unit_test(speed_along_the_path_is_that_of_the_law),
        cmocka_unit_test(the_points_are_on_the_path_and_the_bound_holds),
        cmocka_unit_test(a_closed_path_has_no_seam),
        cmocka_unit_test(a_path_that_is_too_fast_is_found),
        cmocka_unit_test(what_cannot_be_driven_is_said_at_its_place),
        cmocka_unit_test(a_path_may_turn_on_the_spot),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
