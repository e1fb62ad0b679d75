/* tests/firmware/host/move/test_move_camera.c - cameras of move.yaml, from the
 * file to the tracks.
 *
 * Judged by what the head sees: the axes x, y, z, pan, tilt, roll at a time
 * give a place and three directions, in doubles.  Takes long. */
#include "motion/path/path.h"
#include "motion/plan/camera/plan_view.h"
#include "tests/firmware/host/move/move_file.h"

#define RIG "examples/flyby/rig.yaml"
#define DEG (acos(-1) / 180)

struct seen {
    double pos[3], view[3], right[3], up[3];
};

static void turn(double v[3], const double axis[3], double angle)
{
    const double c = cos(angle), s = sin(angle);
    const double dot = v[0] * axis[0] + v[1] * axis[1] + v[2] * axis[2];
    const double cross[3] = { axis[1] * v[2] - axis[2] * v[1],
                              axis[2] * v[0] - axis[0] * v[2],
                              axis[0] * v[1] - axis[1] * v[0] };

    for (int i = 0; i < 3; i++)
        v[i] = v[i] * c + cross[i] * s + axis[i] * dot * (1 - c);
}

/* Pan about up, then tilt about right, then roll about the view. */
static struct seen look(const struct move_file *file, double t_s)
{
    static const double z[3] = { 0, 0, 1 };
    struct seen s = { .view = { 1, 0, 0 },
                      .right = { 0, -1, 0 },
                      .up = { 0, 0, 1 } };

    s.pos[0] = move_file_pos(file, "x", t_s);
    s.pos[1] = move_file_pos(file, "y", t_s);
    s.pos[2] = move_file_pos(file, "z", t_s);
    const double pan = move_file_pos(file, "pan", t_s) * DEG;
    turn(s.view, z, pan);
    turn(s.right, z, pan);
    const double tilt = move_file_pos(file, "tilt", t_s) * DEG;
    turn(s.view, s.right, tilt);
    turn(s.up, s.right, tilt);
    const double roll = move_file_pos(file, "roll", t_s) * DEG;
    turn(s.right, s.view, roll);
    turn(s.up, s.view, roll);
    return s;
}

/* The angle between the view and the way to a point, degrees. */
static double off(const struct seen *s, const double point[3])
{
    double displacement[3], cross = 0, dot = 0;

    for (int i = 0; i < 3; i++)
        displacement[i] = point[i] - s->pos[i];
    for (int i = 0; i < 3; i++) {
        const int j = (i + 1) % 3, k = (i + 2) % 3;
        const double c =
            s->view[j] * displacement[k] - s->view[k] * displacement[j];
        cross += c * c;
        dot += s->view[i] * displacement[i];
    }
    return atan2(sqrt(cross), dot) / DEG;
}

#define PATH                                                                   \
    "path:\n"                                                                  \
    "  axes: [x, y, z]\n"                                                      \
    "  points:\n"                                                              \
    "    - [200 mm, -900 mm, 300 mm]\n"                                        \
    "    - [900 mm, -1100 mm, 500 mm]\n"                                       \
    "    - [1900 mm, -600 mm, 900 mm]\n"                                       \
    "    - [2700 mm, 300 mm, 1200 mm]\n"                                       \
    "    - [3500 mm, 1000 mm, 1500 mm]\n"                                      \
    "  speed: {law: quintic, time: 10 s}\n"
#define CAMERA                                                                 \
    PATH "camera:\n"                                                           \
         "  axes: {pan: pan, tilt: tilt, roll: roll}\n"

static void expect_no_steps(const struct move_file *file)
{
    static const char *const axes[] = { "pan", "tilt", "roll" };

    for (int i = 0; i < 3; i++) {
        const struct motion_track *track = move_file_track(file, axes[i]);
        const struct plan_limit limit = { -((int64_t)1 << 60), (int64_t)1 << 60,
                                          (int64_t)1 << 60,    (int64_t)1 << 60,
                                          (int64_t)1 << 60,    0 };
        struct plan_violation found;
        if (plan_check_track(track, &limit, &found, 1) != 0)
            fail_msg("%s: %d at %g s", axes[i], found.kind,
                     (double)found.t_ns_q12 / (double)MOVE_FILE_S);
    }
}

static void a_fixed_point_stays_in_the_middle_with_a_level_horizon(void **state)
{
    static const double point[3] = { 2000, 900, 900 };
    static struct move_file file;
    double worst = 0, level = 0;
    (void)state;
    move_file_need(&file, RIG, CAMERA "  look: {at: [2 m, 90 cm, 900 mm]}\n");
    for (int i = 0; i <= 4000; i++) {
        const struct seen s = look(&file, i / 400.0);
        worst = fmax(worst, off(&s, point));
        level = fmax(level, fabs(s.right[2]));
        assert_true(s.up[2] > 0.5);
    }
    print_message("within %.1e deg\n", worst);
    assert_true(worst < 2e-5 && level < 1e-6);
    expect_no_steps(&file);
    move_file_close(&file);
}

static void the_bound_of_each_angle_is_what_was_asked(void **state)
{
    static struct move_file file;
    (void)state;
    move_file_need(&file, RIG,
                   CAMERA "  look: {at: [2 m, 90 cm, 900 mm]}\n"
                          "  tolerance: 0.01 deg\n");
    const uint32_t count = move_file_track(&file, "pan")->count;
    for (int i = 0; i < 3; i++)
        assert_true(file.outcome.camera_bound_q32[i] <=
                    MOTION_FIXED_ONE_Q32 / 100);
    move_file_close(&file);
    move_file_need(&file, RIG,
                   CAMERA "  look: {at: [2 m, 90 cm, 900 mm]}\n"
                          "  tolerance: 0.0001 deg\n");
    assert_true(move_file_track(&file, "pan")->count > count);
    move_file_close(&file);
}

/* A straight line exactly above the target: tilt goes on over the top, pan and
 * roll stand. */
static void straight_above_the_target_does_not_flip(void **state)
{
    static struct move_file file;
    struct motion_extreme pan, tilt, roll;
    (void)state;
    move_file_need(&file, RIG,
                   "path:\n  axes: [x, y, z]\n"
                   "  points: [[0, 0, 1500], [1000, 0, 1500], [4000, 0, "
                   "1500]]\n"
                   "  speed: {law: quintic, time: 12 s}\n"
                   "camera:\n  axes: {pan: pan, tilt: tilt, roll: roll}\n"
                   "  look: {at: [2000, 0, 300]}\n");
    motion_track_extreme(move_file_track(&file, "pan"), MOTION_POS, &pan);
    motion_track_extreme(move_file_track(&file, "tilt"), MOTION_POS, &tilt);
    motion_track_extreme(move_file_track(&file, "roll"), MOTION_POS, &roll);
    assert_true(llabs(pan.max) < 1000 && llabs(pan.min) < 1000);
    assert_true(llabs(roll.max) < 1000 && llabs(roll.min) < 1000);
    assert_true(fabs(ldexp((double)tilt.max, -32) + atan2(1200, 2000) / DEG) <
                2e-5);
    assert_true(fabs(ldexp((double)tilt.min, -32) + 180 -
                     atan2(1200, 2000) / DEG) < 2e-5);
    motion_track_extreme(move_file_track(&file, "tilt"), MOTION_VEL, &tilt);
    assert_true(llabs(tilt.min) < (int64_t)40 << 32);
    expect_no_steps(&file);
    move_file_close(&file);
}

/* Once around (2000, 0). */
#define ROUND                                                                  \
    "path:\n  axes: [x, y]\n  curve: c2\n  closed: true\n"                     \
    "  points: [[3000, 0], [2000, 1000], [1000, 0], [2000, -1000]]\n"          \
    "  speed: {law: quintic, time: 20 s}\n"

/* Around the target and once more: pan counts on. */
static void pan_runs_on_over_half_turns(void **state)
{
    static struct move_file file;
    (void)state;
    move_file_need(&file, RIG,
                   ROUND "camera:\n  axes: {pan: pan, tilt: tilt}\n"
                         "  look: {at: [2000, 0, 0]}\n");
    assert_true(fabs(move_file_pos(&file, "pan", 20) -
                     move_file_pos(&file, "pan", 0) - 360) < 1e-6);
    move_file_close(&file);
}

#define MANY 2000

static double real(struct motion_real a)
{
    return ldexp((double)a.m, a.e);
}

/* pan = atan2(y, x) of the way to the target, and its derivatives by distance,
 * from P, P', P'' of the curve; degrees. */
static void pan_by_hand(const struct plan_space *space, int64_t distance_q32,
                        const double target[2], double want[2])
{
    struct motion_arclen_place place;
    struct motion_arclen_point p;

    motion_arclen_find(&space->table, motion_real_from_q(distance_q32, 32),
                       &place);
    motion_arclen_by_length(&space->curve, place.piece, place.x, &p);
    const double x = target[0] - real(p.pos[0]), y = target[1] - real(p.pos[1]);
    const double x1 = -real(p.d1[0]), y1 = -real(p.d1[1]);
    const double x2 = -real(p.d2[0]), y2 = -real(p.d2[1]);
    const double square = x * x + y * y;
    const double turn = (x * y1 - y * x1) / square;
    want[0] = turn / DEG;
    want[1] =
        ((x * y2 - y * x2) / square - 2 * turn * (x * x1 + y * y1) / square) /
        DEG;
}

/* Derivatives are taken on a scale below that of the points, however many. */
static void a_view_and_its_derivatives_are_those_of_the_geometry(void **state)
{
    static struct plan_point point[MANY];
    const struct plan_points points = { .axes = 3,
                                        .curve = PLAN_CURVE_C2,
                                        .spacing = MOTION_SPLINE_CENTRIPETAL,
                                        .point = point,
                                        .count = MANY };
    const double target[2] = { 2000, 100 };
    const int64_t one = (int64_t)1 << 62;
    const struct plan_camera camera = {
        .look = PLAN_LOOK_AT,
        .point_q32 = { (int64_t)2000 << 32, (int64_t)100 << 32, 0 },
        .forward = { { one, 0, 0 } },
        .up = { { 0, 0, one } },
    };
    static struct plan_space space;
    static struct plan_view view;
    struct plan_error error;
    double worst[2] = { 0, 0 }, size[2] = { 0, 0 };
    uint64_t seed = 4;
    (void)state;
    for (int i = 0; i < MANY; i++) {
        const double a = i * 0.05;
        point[i] = (struct plan_point){
            .q32 = { (int64_t)ldexp(2000 + 1500 * cos(a), 32),
                     (int64_t)ldexp(1200 * sin(a + 0.1 * sin(6 * a)), 32),
                     (int64_t)ldexp(1000 + 800 * sin(0.013 * i), 32) }
        };
    }
    assert_int_equal(plan_space_init(&space, &points, &error), 0);
    assert_int_equal(plan_view_init(&view, &camera, &space, &error), 0);
    for (int i = 0; i < 500; i++) {
        int64_t s = check_random_in(&seed, 0, space.length_q32);
        struct motion_bake_point jet[MOTION_HEAD_AXES];
        double want[2];
        assert_int_equal(plan_view_jet(&view, 0, &s, jet), 0);
        pan_by_hand(&space, s, target, want);
        const double got[2] = { real(jet[0].vel), real(jet[0].acc) };
        for (int k = 0; k < 2; k++) {
            worst[k] = fmax(worst[k], fabs(got[k] - want[k]));
            size[k] = fmax(size[k], fabs(want[k]));
        }
    }
    print_message("within %.1e and %.1e of the largest\n", worst[0] / size[0],
                  worst[1] / size[1]);
    assert_true(worst[0] < 1e-7 * size[0] && worst[1] < 1e-3 * size[1]);
    plan_view_free(&view);
    plan_space_free(&space);
}

static void a_look_ahead_is_on_the_path_and_then_on_its_tangent(void **state)
{
    static struct move_file file;
    (void)state;
    move_file_need(&file, RIG, CAMERA "  look: {ahead: 400 mm}\n");
    const struct plan_space *space = &file.outcome.drive.space;
    for (int i = 0; i <= 1000; i++) {
        const double t_s = i / 100.0;
        const struct seen s = look(&file, t_s);
        struct motion_vec at;
        struct motion_dir along;
        struct motion_state here;
        double point[3];
        motion_track_state(&file.outcome.distance,
                           (int64_t)(t_s * (double)MOVE_FILE_S), &here);
        int64_t ahead = here.pos_q32 + ((int64_t)400 << 32);
        int64_t beyond = ahead - space->length_q32;
        assert_int_equal(plan_space_at(space,
                                       beyond > 0 ? space->length_q32 : ahead,
                                       &at, &along),
                         0);
        for (int k = 0; k < 3; k++)
            point[k] = ldexp((double)at.x[k].m, at.x[k].e) +
                       (beyond > 0 ? ldexp((double)beyond, -32) *
                                         ldexp((double)along.q62[k], -62)
                                   : 0);
        assert_true(off(&s, point) < 3e-5);
    }
    expect_no_steps(&file);
    move_file_close(&file);
}

static void a_camera_along_the_path_looks_where_it_goes(void **state)
{
    static const char *const along[] = { "level", "rotation-minimising" };
    (void)state;
    for (size_t k = 0; k < ARRAY_LEN(along); k++) {
        static struct move_file file;
        char text[1024];
        double turned = 0;
        snprintf(text, sizeof text, CAMERA "  look: {along: %s}\n", along[k]);
        move_file_need(&file, RIG, text);
        for (int i = 1; i < 999; i++) {
            const struct seen a = look(&file, i / 100.0 - 1e-3);
            const struct seen b = look(&file, i / 100.0 + 1e-3);
            double point[3];
            const struct seen s = look(&file, i / 100.0);
            if (i < 100 || i > 900)
                continue; /* the way is too short to be a direction */
            for (int n = 0; n < 3; n++)
                point[n] = s.pos[n] + 1e3 * (b.pos[n] - a.pos[n]);
            assert_true(off(&s, point) < 1e-3);
            if (k == 0)
                assert_true(fabs(s.right[2]) < 1e-6);
            /* the part of right's change that is about the view */
            double about = 0;
            for (int n = 0; n < 3; n++)
                about += (b.right[n] - a.right[n]) * s.up[n];
            turned += fabs(about) / 2e-3 * 1e-2;
        }
        print_message("%s: turned %.3g deg about the view\n", along[k],
                      turned / DEG);
        assert_true(k == 0 ? turned > 5 * DEG : turned < 0.01 * DEG);
        expect_no_steps(&file);
        move_file_close(&file);
    }
}

/* The frame of a loop comes back twisted; the twist is spread over the way, so
 * that the camera ends as it began. */
static void a_loop_in_space_ends_as_it_began(void **state)
{
    static const char *const axes[] = { "pan", "tilt", "roll" };
    static struct move_file file;
    (void)state;
    move_file_need(&file, RIG,
                   "path:\n  axes: [x, y, z]\n  closed: true\n"
                   "  points: [[3000, 0, 300], [2000, 1000, 400], [1000, 0, "
                   "900], [2000, -1000, 1500]]\n"
                   "  speed: {law: quintic, time: 20 s}\n"
                   "camera:\n  axes: {pan: pan, tilt: tilt, roll: roll}\n"
                   "  look: {along: rotation-minimising}\n");
    for (int i = 0; i < 3; i++)
        assert_true(fabs(remainder(move_file_pos(&file, axes[i], 20) -
                                       move_file_pos(&file, axes[i], 0),
                                   360)) < 1e-6);
    expect_no_steps(&file);
    move_file_close(&file);
}

/* A planar bow: the binormal is up all along. */
static void a_frenet_frame_that_exists_is_taken(void **state)
{
    static struct move_file file;
    (void)state;
    move_file_need(&file, RIG,
                   ROUND "camera:\n  axes: {pan: pan, tilt: tilt}\n"
                         "  look: {along: frenet}\n");
    assert_true(fabs(move_file_pos(&file, "pan", 20) -
                     move_file_pos(&file, "pan", 0) - 360) < 1e-6);
    move_file_close(&file);
}

static void a_dwell_rests_on_its_points_and_eases_between(void **state)
{
    static const double first[3] = { 2000, 900, 900 },
                        second[3] = { 3900, -200, 300 };
    static struct move_file file;
    (void)state;
    move_file_need(&file, RIG,
                   CAMERA
                   "  look:\n    dwell:\n"
                   "      - {at: [2000, 900, 900], from: 0 mm, to: 40 %}\n"
                   "      - {at: [3900, -200, 300], from: 60 %, to: 100 %}\n");
    const double length =
        ldexp((double)file.outcome.drive.space.length_q32, -32);
    int rests[2] = { 0, 0 };
    for (int i = 0; i <= 1000; i++) {
        const struct seen s = look(&file, i / 100.0);
        struct motion_state at;
        double point[3];
        motion_track_state(&file.outcome.distance, i * (MOVE_FILE_S / 100),
                           &at);
        const double part = ldexp((double)at.pos_q32, -32) / length;
        const double x = fmin(fmax((part - 0.4) / 0.2, 0), 1);
        const double ease = x * x * x * (10 - 15 * x + 6 * x * x);
        for (int k = 0; k < 3; k++)
            point[k] = first[k] + ease * (second[k] - first[k]);
        assert_true(off(&s, point) < 3e-5);
        rests[0] += x == 0;
        rests[1] += x == 1;
    }
    assert_true(rests[0] > 300 && rests[1] > 300);
    expect_no_steps(&file);
    move_file_close(&file);
}

static void a_target_with_a_path_of_its_own_is_followed(void **state)
{
    static struct move_file file;
    (void)state;
    move_file_need(&file, RIG,
                   CAMERA "  look:\n    path:\n      curve: linear\n"
                          "      points: [[2000, 900, 900], [3000, 900, "
                          "900]]\n");
    const double length =
        ldexp((double)file.outcome.drive.space.length_q32, -32);
    for (int i = 0; i <= 1000; i++) {
        const struct seen s = look(&file, i / 100.0);
        struct motion_state at;
        motion_track_state(&file.outcome.distance, i * (MOVE_FILE_S / 100),
                           &at);
        const double point[3] = {
            2000 + 1000 * ldexp((double)at.pos_q32, -32) / length, 900, 900
        };
        assert_true(off(&s, point) < 3e-5);
    }
    move_file_close(&file);
}

static void a_keyed_roll_is_added_about_the_view(void **state)
{
    static struct move_file file;
    (void)state;
    move_file_need(&file, RIG,
                   CAMERA "  look: {at: [2 m, 90 cm, 900 mm]}\n"
                          "  roll: {keys: [[1 s, 0 deg], [4 s, 20 deg], [6 s, "
                          "-5 deg]]}\n");
    assert_true(fabs(move_file_pos(&file, "roll", 4) - 20) < 2e-5);
    assert_true(fabs(move_file_pos(&file, "roll", 10) + 5) < 2e-5);
    expect_no_steps(&file);
    move_file_close(&file);
}

/* pan 0 looks along y here, so every pan is a quarter turn less. */
static void the_mount_says_where_zero_is(void **state)
{
    static struct move_file a, b;
    (void)state;
    move_file_need(&a, RIG, CAMERA "  look: {at: [2 m, 90 cm, 900 mm]}\n");
    move_file_need(&b, RIG,
                   CAMERA "  look: {at: [2 m, 90 cm, 900 mm]}\n"
                          "  forward: [0, 1, 0.2]\n  up: [0, 0, 2]\n");
    for (int i = 0; i <= 100; i++) {
        assert_true(fabs(move_file_pos(&a, "pan", i / 10.0) - 90 -
                         move_file_pos(&b, "pan", i / 10.0)) < 2e-5);
        assert_true(fabs(move_file_pos(&a, "tilt", i / 10.0) -
                         move_file_pos(&b, "tilt", i / 10.0)) < 2e-5);
    }
    move_file_close(&a);
    move_file_close(&b);
}

/* The step of an axis's speed at a time, deg/s: planned. */
static double step_at(const struct motion_track *track, int64_t t_ns_q12)
{
    for (uint32_t i = 1; i < track->count; i++) {
        struct motion_state a, b;
        if (llabs(track->segment[i].start_ns_q12 - t_ns_q12) >
            MOVE_FILE_S / 1000000)
            continue;
        motion_segment_state(&track->segment[i - 1],
                             track->segment[i - 1].dur_ns_q12, &a);
        motion_segment_state(&track->segment[i], 0, &b);
        return ldexp((double)(b.vel_q32 - a.vel_q32), -32);
    }
    return 0;
}

/* Curvature is the speed of a tangent that turns: where it steps by so much, so
 * does pan, times the speed along the path.  By hand from P, P', P'' of the two
 * pieces. */
static double pan_step_by_hand(const struct move_file *file, uint32_t piece,
                               int64_t *t_ns_q12)
{
    const struct plan_drive *drive = &file->outcome.drive;
    const struct motion_arclen_curve *curve = &drive->space.curve;
    const struct motion_real s =
        motion_arclen_border(&drive->space.table, piece);
    struct motion_state law;
    double bend[2];

    *t_ns_q12 = motion_path_when(&drive->law, s);
    motion_track_state(&drive->law, *t_ns_q12, &law);
    for (uint32_t k = 0; k < 2; k++) {
        struct motion_arclen_point p;
        motion_arclen_by_length(curve, piece - 1 + k,
                                k == 1
                                    ? motion_real_zero()
                                    : motion_real_sub(curve->border[piece],
                                                      curve->border[piece - 1]),
                                &p);
        const double x = real(p.d1[0]), y = real(p.d1[1]);
        bend[k] = (x * real(p.d2[1]) - y * real(p.d2[0])) / (x * x + y * y);
    }
    return (bend[1] - bend[0]) * ldexp((double)law.vel_q32, -32) / DEG;
}

/* Every curve, every way to look along it, fast and slow: planned, with the
 * step of speed that there is, for the check to find.  None where it rests. */
static void looking_along_a_curve_turns_as_the_curve_does(void **state)
{
    static const char *const curves[] = {
        "catmull-rom", "akima",    "rounded,  corner: 300 mm", "c2",
        "quintic",     "b-spline", "smoothed,  corner: 300 mm"
    };
    static const char *const along[] = { "level", "rotation-minimising" };
    static const char *const times[] = { "20 s", "60 s", "3600 s" };
    (void)state;
    for (int n = 0; n < 7 * 2 * 3; n++) {
        static struct move_file file;
        char text[1024], curve[64];
        double worst = 0, largest = 0;
        snprintf(curve, sizeof curve, "%s", curves[n / 6]);
        char *corner = strchr(curve, ',');
        if (corner != NULL)
            *corner = '\n';
        snprintf(
            text, sizeof text,
            "path:\n  axes: [x, y, z]\n  points: [[200, -900, 300], [900, "
            "-1100, 500], [1900, -600, 900], [2700, 300, 1200], [3500, "
            "1000, 1500]]\n  speed: {law: quintic, time: %s}\n  curve: %s\n"
            "camera:\n  axes: {pan: pan, tilt: tilt, roll: roll}\n"
            "  look: {along: %s}\n",
            times[n % 3], curve, along[n / 3 % 2]);
        move_file_need(&file, RIG, text);
        for (uint32_t i = 1; i < file.outcome.drive.space.curve.pieces; i++) {
            int64_t t;
            const double want = pan_step_by_hand(&file, i, &t);
            const double got = step_at(move_file_track(&file, "pan"), t);
            largest = fmax(largest, fabs(want));
            worst = fmax(worst, fabs(want - got));
        }
        if (worst > 1e-5 * largest + 1e-7)
            fail_msg("%s, %s: %g of %g deg/s", curve, times[n % 3], worst,
                     largest);
        assert_true((largest > 1e-3) == (n / 6 < 3));
        move_file_close(&file);
    }
}

/* Turning by more than any segment follows is refused, after no more looks than
 * that takes, whatever the time; one that is merely too fast is planned, for
 * the check to say how much. */
static void passing_too_close_is_refused_at_any_speed(void **state)
{
    static const char *const times[] = { "5 s", "300 s", "2000 s", "80000 s" };
    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(times); i++) {
        char text[1024];
        snprintf(text, sizeof text,
                 "path:\n  axes: [x, y, z]\n  points: [[200, -900, 300], [900, "
                 "-1100, 500], [1900, -600, 900], [2700, 300, 1200], [3500, "
                 "1000, 1500]]\n  speed: {law: quintic, time: %s}\n"
                 "camera:\n  axes: {pan: pan, tilt: tilt, roll: roll}\n"
                 "  look: {at: [1900, -600, 899.999]}\n",
                 times[i]);
        move_file_refuse(RIG, text, "s the camera would have to ");
        move_file_refuse(RIG, text, ", and the limit of that axis is ");
    }
    /* Past what is straight above it the head pans, and has no roll. */
    move_file_refuse(
        RIG,
        "path:\n  axes: [x, y]\n  points: [[-1000, 0], [1000, 0]]\n"
        "  speed: {law: quintic, time: 10 s}\n"
        "camera:\n  axes: {pan: pan, tilt: tilt}\n"
        "  look: {at: [0, 0.001, 1500]}\n",
        "at 5.000 s the camera would have to pan at ");
    static struct move_file fast;
    move_file_need(&fast, RIG,
                   "path:\n  axes: [x, y]\n  points: [[0, 0], [4000, 0]]\n"
                   "  speed: {law: quintic, time: 1 s}\n"
                   "camera:\n  axes: {pan: pan, tilt: tilt}\n"
                   "  look: {at: [2000, 500, 0]}\n");
    move_file_close(&fast);
}

/* A tolerance that no number of segments would meet in any time: refused once
 * the evaluations that docs/FILES.md states are used up. */
static void planning_is_bounded(void **state)
{
    static const char points[] =
        "path:\n  axes: [x, y, z]\n  curve: c2\n  points: [[200, -900, 300], "
        "[900, -1100, 500], [1900, -600, 900], [2700, 300, 1200]]\n"
        "  speed: {law: quintic, time: 6000 s}\n";
    char text[1024];
    (void)state;
    (void)snprintf(text, sizeof text, "%s  tolerance: 1e-9 mm\n", points);
    move_file_refuse(RIG, text,
                     "2:3: the path takes too much work to plan: more than "
                     "100000 evaluations and 64 for every point");
    (void)snprintf(text, sizeof text,
                   "%scamera:\n  axes: {pan: pan, tilt: tilt}\n"
                   "  look: {at: [1500, 0, 100]}\n  tolerance: 1e-9 deg\n",
                   points);
    move_file_refuse(RIG, text, "7:3: the camera takes too much work to plan");
}

/* The third derivative of the way steps where a corner begins: too fast or not,
 * that is for the limits to say. */
static void corners_are_looked_along_at_any_speed(void **state)
{
    static const int corner_mm[] = { 60, 150, 300 }, time_s[] = { 2, 5, 20 };
    static struct move_file file;
    char text[640];
    (void)state;
    for (int i = 0; i < 9; i++) {
        (void)snprintf(
            text, sizeof text,
            "path:\n  axes: [x, y, z]\n  curve: smoothed\n  corner: %d mm\n"
            "  points: [[200, -900, 300], [900, -1100, 500], "
            "[1900, -600, 900], [2700, 300, 1200]]\n"
            "  speed: {law: quintic, time: %d s}\n"
            "camera:\n  axes: {pan: pan, tilt: tilt, roll: roll}\n"
            "  look: {along: level}\n",
            corner_mm[i % 3], time_s[i / 3]);
        move_file_need(&file, RIG, text);
        move_file_close(&file);
    }
}

static void what_a_camera_cannot_do_is_said(void **state)
{
    static const struct {
        const char *text, *message;
    } rows[] = {
        { "camera:\n  axes: {pan: pan, tilt: tilt}\n  look: {at: [1, 2, 3]}\n",
          "2:3: camera has no path to go on" },
        { CAMERA "  look: {at: [200 mm, -900 mm, 300 mm]}\n",
          "12:9: the camera comes to the point that it looks at" },
        { CAMERA "  look: {at: [900 mm, -1100 mm, 500 mm]}\n",
          "12:9: at 3.103 s the camera comes to the point that it looks at" },
        { "path:\n  axes: [x, y]\n  curve: linear\n"
          "  points: [[0, 0], [1000, 0], [1000, 1000]]\n"
          "  speed:\n    - {law: quintic, time: 4 s, length: 50 %}\n"
          "    - {law: quintic, time: 4 s}\n"
          "camera:\n  axes: {pan: pan, tilt: tilt}\n"
          "  look: {along: level}\n",
          "10:9: at 4.000 s the camera would have to pan by 90 deg at once, "
          "where the path has a corner" },
        { PATH "camera:\n  axes: {pan: pan, tilt: tilt}\n"
               "  look: {at: [2 m, 1 m, 1 m]}\n"
               "  roll: {keys: [[0 s, 0], [9 s, 7 deg]]}\n",
          "11:3: the camera rolls by 7 deg at 9.000 s, but has no roll axis" },
        { CAMERA "  look: {along: frenet}\n",
          "12:9: the camera has no Frenet frame where the path is straight" },
        { CAMERA "  look: {at: [1, 2, 3], ahead: 3}\n",
          "12:9: look names 2 things to look at" },
        { CAMERA "  look: {ease: cubic}\n", "12:16: ease is not used without" },
        { CAMERA "  look: {}\n", "12:9: look names nothing to look at" },
        { CAMERA "  look: {ahead: 0 mm}\n",
          "12:17: ahead '0 mm' is not above zero" },
        { CAMERA "  look: {ahead: 1 mm, end: closed}\n",
          "12:28: end 'closed' goes with a closed path only" },
        { CAMERA "  look: {at: [1, 2]}\n", "12:14: at has 2 items" },
        { CAMERA "  look:\n    dwell:\n"
                 "      - {at: [2000, 900, 900], from: 0 mm, to: 60 %}\n"
                 "      - {at: [3900, 200, 300], from: 40 %, to: 100 %}\n",
          "15:9: the camera begins a dwell before the one before it has "
          "ended" },
        { CAMERA "  look:\n    dwell:\n"
                 "      - {at: [2000, 900, 900], from: 70 %, to: 60 %}\n",
          "14:9: the camera ends a dwell before it begins" },
        { CAMERA "  look: {at: [1, 2, 3]}\n  forward: [0, 0, 3]\n",
          "11:3: camera has parallel forward and up" },
        { CAMERA "  look: {at: [1, 2, 3]}\n  up: [0, 0, 0]\n",
          "13:7: up is no direction" },
        { PATH "camera:\n  axes: {pan: pan, tilt: x}\n"
               "  look: {at: [1, 2, 3]}\n",
          "11:26: tilt 'x' is driven by the path in line 2 already" },
        { "path:\n  axes: [x, y]\n  points: [[0, 0], [1, 1]]\n"
          "  speed: {law: quintic, time: 1 s}\n"
          "camera:\n  axes: {pan: pan, tilt: z}\n  look: {at: [1, 2, 3]}\n",
          "6:26: tilt has the axis 'z' in mm" },
        { "path:\n  axes: [roll, tilt]\n  points: [[0, 0], [1, 1]]\n"
          "  speed: {law: quintic, time: 1 s}\n"
          "camera:\n  axes: {pan: pan, tilt: z}\n  look: {at: [1, 2, 3]}\n",
          "6:3: camera is on a path in deg" },
    };
    (void)state;
    for (size_t i = 0; i < ARRAY_LEN(rows); i++)
        move_file_refuse(RIG, rows[i].text, rows[i].message);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(
            a_fixed_point_stays_in_the_middle_with_a_level_horizon),
        cmocka_unit_test(the_bound_of_each_angle_is_what_was_asked),
        cmocka_unit_test(straight_above_the_target_does_not_flip),
        cmocka_unit_test(pan_runs_on_over_half_turns),
        cmocka_unit_test(a_view_and_its_derivatives_are_those_of_the_geometry),
        cmocka_unit_test(a_look_ahead_is_on_the_path_and_then_on_its_tangent),
        cmocka_unit_test(a_camera_along_the_path_looks_where_it_goes),
        cmocka_unit_test(a_loop_in_space_ends_as_it_began),
        cmocka_unit_test(a_frenet_frame_that_exists_is_taken),
        cmocka_unit_test(a_dwell_rests_on_its_points_and_eases_between),
        cmocka_unit_test(a_target_with_a_path_of_its_own_is_followed),
        cmocka_unit_test(a_keyed_roll_is_added_about_the_view),
        cmocka_unit_test(the_mount_says_where_zero_is),
        cmocka_unit_test(looking_along_a_curve_turns_as_the_curve_does),
        cmocka_unit_test(passing_too_close_is_refused_at_any_speed),
        cmocka_unit_test(planning_is_bounded),
        cmocka_unit_test(corners_are_looked_along_at_any_speed),
        cmocka_unit_test(what_a_camera_cannot_do_is_said),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
