/* tests/motion/plan/path/test_plan_path_random.c - random paths of every curve, some of
 * which run back over themselves, come very near to a point again or have one twice,
 * at speeds of laws or as fast as limits, caps and stops allow.  Every path is
 * planned or refused with a reason that it has, and what is planned is judged by
 * plan_check_track.  SEED=n and N=2000 for more; that less is never slower is tried with
 * N alone. */
#include <math.h>
#include <string.h>

#include "motion/core/err.h"
#include "motion/plan/check.h"
#include "motion/plan/path/plan_path.h"
#include "tests/support/check.h"

#define POINTS_MAX 7
#define CAPS_MAX   4

/* A path and what it points to. */
struct drawn {
    struct plan_path path;
    struct plan_point point[POINTS_MAX];
    struct plan_part part[3];
    struct plan_fastest fastest;
    struct plan_fastest_cap cap[CAPS_MAX];
    bool has_twin; /* two neighbours are the same point */
};

static double even(uint64_t *seed, double low, double high)
{
    return low + (high - low) * (double)(check_random(seed) >> 11) / 0x1p53;
}

/* Evenly over the powers of ten. */
static double scaled(uint64_t *seed, double low, double high)
{
    return exp(even(seed, log(low), log(high)));
}

static bool one_of(uint64_t *seed, unsigned n)
{
    return check_random(seed) % n == 0;
}

static int64_t q32(double value)
{
    return llround(ldexp(value, 32));
}

/* --- random paths ------------------------------------------------------------- */

static bool is_same(const struct plan_point *a, const struct plan_point *b)
{
    return memcmp(a->q32, b->q32, sizeof a->q32) == 0;
}

/* Draw points on a coarse grid, so that paths run back over themselves; near to the last
 * one, or the last one again. */
static void draw_points(uint64_t *seed, struct drawn *drawn)
{
    struct plan_points *points = &drawn->path.points;
    const bool is_line = one_of(seed, 3);

    points->axes = 2 + (uint32_t)one_of(seed, 2);
    points->count = (uint32_t)check_random_in(seed, 2, POINTS_MAX);
    points->point = drawn->point;
    for (uint32_t i = 0; i < points->count; i++) {
        struct plan_point *point = &drawn->point[i];
        const bool is_near = i > 0 && one_of(seed, 8);
        const double reach = is_near ? scaled(seed, 1e-6, 1) : 0;
        if (is_near)
            *point = drawn->point[i - 1];
        for (uint32_t k = 0; k < points->axes; k++)
            if (is_near)
                point->q32[k] += q32(even(seed, -reach, reach));
            else if (!is_line || k == 0)
                point->q32[k] = q32(50. * (double)check_random_in(seed, -3, 3));
        if (is_near && one_of(seed, 8))
            *point = drawn->point[i - 1];
        else if (i > 0 && is_same(point, point - 1) && !one_of(seed, 4))
            point->q32[0] += q32(50);
    }
    for (uint32_t i = 1; i < points->count; i++)
        drawn->has_twin =
            drawn->has_twin || is_same(&drawn->point[i - 1], &drawn->point[i]);
}

static void draw_curve(uint64_t *seed, struct drawn *drawn)
{
    static const enum plan_curve curve[] = {
        PLAN_CURVE_LINEAR, PLAN_CURVE_ROUNDED, PLAN_CURVE_SMOOTHED,
        PLAN_CURVE_AKIMA,  PLAN_CURVE_QUINTIC, PLAN_CURVE_CATMULL_ROM,
        PLAN_CURVE_C2,     PLAN_CURVE_BSPLINE, PLAN_CURVE_C4,
    };
    struct plan_points *points = &drawn->path.points;

    points->curve = curve[check_random(seed) % ARRAY_LEN(curve)];
    points->spacing = MOTION_SPLINE_CENTRIPETAL;
    points->closed = plan_space_rules(points->curve).closed &&
                     points->count >= 3 && one_of(seed, 5);
    points->corner_q32 = q32(scaled(seed, 1e-3, 20));
    if (points->closed)
        drawn->has_twin =
            drawn->has_twin ||
            is_same(&drawn->point[0], &drawn->point[points->count - 1]);
}

static void draw_limits(uint64_t *seed, struct plan_fastest *fastest)
{
    const bool has_jerk = one_of(seed, 2);

    for (uint32_t k = 0; k < PLAN_SPACE_AXES; k++) {
        const double vel = scaled(seed, 50, 2000);
        const double acc = vel * scaled(seed, 1, 10);
        fastest->limit[k] = (struct plan_limit){
            .pos_min_q32 = q32(-1e6),
            .pos_max_q32 = q32(1e6),
            .vel_q32 = q32(vel),
            .acc_q32 = q32(acc),
            .jerk_q32 = has_jerk ? q32(acc * scaled(seed, 2, 50)) : 0,
            .period_ns = 1000000,
        };
    }
}

static struct plan_distance ratio(double part)
{
    return (struct plan_distance){ true, q32(part) };
}

static void draw_caps(uint64_t *seed, struct plan_fastest *fastest)
{
    for (uint32_t i = (uint32_t)check_random_in(seed, 0, CAPS_MAX); i > 0;
         i--) {
        const double from = even(seed, 0, 0.9), to = even(seed, from, 1);
        const bool is_stop = one_of(seed, 2);
        fastest->cap[fastest->caps++] = (struct plan_fastest_cap){
            .from = ratio(from),
            .to = ratio(is_stop ? from : to),
            .speed_q32 = is_stop ? 0 : q32(scaled(seed, 2, 500)),
        };
    }
}

/* Rest to rest at once, or from rest to a speed, on at it and back to rest. */
static void draw_law(uint64_t *seed, struct drawn *drawn)
{
    const enum plan_speed_law law =
        (enum plan_speed_law)check_random_in(seed, 0, PLAN_SPEED_LAW_RAMP);
    const double duration = scaled(seed, 0.5, 100);
    const struct plan_part whole = { .law = law,
                                     .extent = PLAN_EXTENT_REST,
                                     .dur_ns_q12 = llround(4096e9 * duration),
                                     .k1_q32 = q32(0.25),
                                     .k2_q32 = q32(0.75) };

    drawn->path.part = drawn->part;
    drawn->path.parts = 1;
    drawn->part[0] = whole;
    if (law != PLAN_SPEED_LAW_RAMP)
        return;
    drawn->path.parts = 3;
    drawn->part[0].shape = PLAN_RAMP_SCURVE;
    drawn->part[0].extent = PLAN_EXTENT_TIMED;
    drawn->part[0].to_q32 = q32(10 / duration);
    drawn->part[1] = (struct plan_part){ .law = PLAN_SPEED_LAW_CONSTANT,
                                         .extent = PLAN_EXTENT_REST };
    drawn->part[2] = drawn->part[0];
    drawn->part[2].shape = PLAN_RAMP_SINE;
    drawn->part[2].to_q32 = 0;
}

static void draw_path(uint64_t seed, struct drawn *drawn)
{
    seed = seed * 2 + 1;
    for (int i = 0; i < 8; i++)
        (void)check_random(&seed);
    *drawn = (struct drawn){ .path.axis = { 0, 1, 2 },
                             .path.tolerance_q32 = q32(1e-3) };
    draw_points(&seed, drawn);
    draw_curve(&seed, drawn);
    draw_limits(&seed, &drawn->fastest);
    drawn->fastest.cap = drawn->cap;
    if (one_of(&seed, 4)) {
        draw_law(&seed, drawn);
        return;
    }
    drawn->path.fastest = &drawn->fastest;
    draw_caps(&seed, &drawn->fastest);
}

/* --- what must hold ----------------------------------------------------------- */

/* A path is refused for two neighbours that are the same or too near for the
 * formats, a law for a corner that it does not stop at, or its ramps for a path that
 * is shorter. */
static void check_refused(uint64_t seed, const struct drawn *drawn, int err,
                          const struct plan_error *error)
{
    if (error->text[0] == 0 || error->code != err)
        fail_msg("path %" PRIu64 ": refused with code %d and no reason", seed,
                 err);
    if (drawn->has_twin && err == MOTION_E_ORDER)
        return;
    if (drawn->path.fastest == NULL &&
        (err == MOTION_E_TOLERANCE || drawn->path.parts > 1))
        return;
    fail_msg("path %" PRIu64 ": refused (%s): %s", seed, motion_err_text(err),
             error->text);
}

static int64_t off_q32(int64_t a, int64_t b)
{
    return a > b ? a - b : b - a;
}

/* Inside the limits with what rounding has added, as a plot shows it. */
static void check_peaks(uint64_t seed, const struct plan_limit *limit,
                        const struct motion_track *track)
{
    const int64_t most[] = { limit->vel_q32, limit->acc_q32, limit->jerk_q32 };

    for (int i = 0; i < 3; i++) {
        struct motion_extreme extreme;
        motion_track_extreme(track, (enum motion_quantity)(MOTION_VEL + i),
                             &extreme);
        if (most[i] != 0 && (extreme.max > most[i] || extreme.min < -most[i]))
            fail_msg("path %" PRIu64 ": derivative %d is %.9g of its limit",
                     seed, i + 1,
                     fmax((double)extreme.max, -(double)extreme.min) /
                         (double)most[i]);
    }
}

static void check_tracks(uint64_t seed, const struct drawn *drawn,
                         const struct motion_track track[])
{
    const struct plan_points *points = &drawn->path.points;
    const uint32_t last = points->closed ? 0 : points->count - 1;
    const int64_t within =
        drawn->path.fastest != NULL ? 0 : drawn->path.tolerance_q32;

    for (uint32_t k = 0; k < points->axes; k++) {
        struct plan_violation worst;
        if (track[k].end_ns_q12 != track[0].end_ns_q12)
            fail_msg("path %" PRIu64 ": axes end at two times", seed);
        if (off_q32(track[k].segment[0].pos_q32, points->point[0].q32[k]) > 0 ||
            off_q32(track[k].end.pos_q32, points->point[last].q32[k]) > within)
            fail_msg("path %" PRIu64 ": axis %u begins or ends elsewhere", seed,
                     k);
        if (drawn->path.fastest != NULL)
            check_peaks(seed, &drawn->fastest.limit[k], &track[k]);
        if (drawn->path.fastest != NULL &&
            plan_check_track(&track[k], &drawn->fastest.limit[k], &worst, 1))
            fail_msg("path %" PRIu64 ": axis %u breaks limit %d at %.6f s: "
                     "%.9g, limit %.9g",
                     seed, k, (int)worst.kind, (double)worst.t_ns_q12 / 4096e9,
                     (double)worst.value, (double)worst.limit);
    }
}

/* The duration in s; 0 where the path is refused. */
static double plan(uint64_t seed, const struct drawn *drawn)
{
    struct motion_track track[PLAN_SPACE_AXES] = { { .segment = NULL } };
    struct plan_error error = { .code = 0 };
    struct plan_drive drive;
    const int err = plan_path_tracks(&drawn->path, &drive, track, &error);
    double duration = 0;

    if (err < 0) {
        check_refused(seed, drawn, err, &error);
        return 0;
    }
    check_tracks(seed, drawn, track);
    duration = (double)track[0].end_ns_q12 / 4096e9;
    for (uint32_t k = 0; k < drawn->path.points.axes; k++)
        plan_track_free(&track[k]);
    plan_drive_free(&drive);
    return duration;
}

static uint64_t first_seed(void)
{
    const char *first = getenv("SEED");

    return first != NULL ? strtoull(first, NULL, 0) : 1;
}

static uint64_t count_of(int all)
{
    const char *given = getenv("N");

    return given != NULL ? strtoull(given, NULL, 0)
                         : (unsigned)check_cases(all);
}

static void paths_are_planned_or_refused_with_their_reason(void **state)
{
    const uint64_t first = first_seed(), count = count_of(40);
    uint64_t refused = 0;

    (void)state;
    for (uint64_t seed = first; seed < first + count; seed++) {
        struct drawn drawn;
        draw_path(seed, &drawn);
        refused += plan(seed, &drawn) == 0;
    }
    print_message("%" PRIu64 " paths, %" PRIu64 " refused\n", count, refused);
    assert_true(count < 20 || refused <= count / 2);
}

/* --- less is never slower ----------------------------------------------------- */

/* Allow what grids and local minima may take of a least time: 0.2 % and 2 ms. */
static double with_rounding(double duration)
{
    return duration * 1.002 + 0.002;
}

/* Each rate's limit as if time went so many times as fast. */
static void scale_limits(struct drawn *drawn, double by)
{
    for (uint32_t k = 0; k < PLAN_SPACE_AXES; k++) {
        struct plan_limit *limit = &drawn->fastest.limit[k];
        limit->vel_q32 = llround((double)limit->vel_q32 * by);
        limit->acc_q32 = llround((double)limit->acc_q32 * by * by);
        limit->jerk_q32 = llround((double)limit->jerk_q32 * by * by * by);
    }
    for (uint32_t i = 0; i < drawn->fastest.caps; i++)
        drawn->cap[i].speed_q32 = llround((double)drawn->cap[i].speed_q32 * by);
}

static void faster_than(uint64_t seed, const char *what, double least,
                        double other)
{
    if (least > with_rounding(other))
        fail_msg("path %" PRIu64 " %s takes %.6f s, and %.6f s otherwise", seed,
                 what, least, other);
}

static void fewer_limits_caps_and_stops_are_never_slower(void **state)
{
    const uint64_t first = first_seed(), count = count_of(0);

    (void)state;
    if (count == 0)
        skip();
    for (uint64_t seed = first; seed < first + count; seed++) {
        struct drawn drawn, less;
        draw_path(seed, &drawn);
        const double duration =
            drawn.path.fastest != NULL ? plan(seed, &drawn) : 0;
        if (duration == 0)
            continue;
#define LESS(what, change)                                                     \
    do {                                                                       \
        draw_path(seed, &less);                                                \
        change;                                                                \
        faster_than(seed, what, plan(seed, &less), duration);                  \
    } while (0)
        if (drawn.fastest.caps > 0)
            LESS("with a cap or stop less", less.fastest.caps--);
        if (drawn.fastest.limit[0].jerk_q32 > 0)
            LESS("without limits of jerk",
                 for (int k = 0; k < PLAN_SPACE_AXES; k++) less.fastest.limit[k]
                     .jerk_q32 = 0);
        LESS("with larger limits", scale_limits(&less, 1.25));
#undef LESS
        draw_path(seed, &less);
        scale_limits(&less, 0.5);
        faster_than(seed, "at full speed", duration, plan(seed, &less) / 2);
    }
}

/* A way to a point and back, far too short for any speed to be reached: four times as long as
 * its acceleration takes for half of the distance, or its jerk for a quarter. */
static void paths_of_every_size_take_their_least_time(void **state)
{
    (void)state;
    for (int power = -3; power <= 2; power++)
        for (int has_jerk = 0; has_jerk < 2; has_jerk++) {
            const double d = pow(10, power), acc = 1000, jerk = 2000;
            const double least =
                has_jerk ? 2 * cbrt(32 * d / jerk) : 4 * sqrt(d / acc);
            struct drawn drawn;
            draw_path(1, &drawn);
            drawn.path.points =
                (struct plan_points){ .axes = 2,
                                      .curve = PLAN_CURVE_LINEAR,
                                      .point = drawn.point,
                                      .count = 3 };
            memset(drawn.point, 0, sizeof drawn.point);
            drawn.point[1].q32[0] = q32(d);
            drawn.point[1].q32[1] = -q32(d);
            drawn.path.fastest = &drawn.fastest;
            drawn.fastest.caps = 0;
            for (int k = 0; k < 2; k++)
                drawn.fastest.limit[k] =
                    (struct plan_limit){ q32(-1e6),
                                         q32(1e6),
                                         q32(1e5),
                                         has_jerk ? q32(1e5) : q32(acc),
                                         has_jerk ? q32(jerk) : 0,
                                         1000000 };
            const double duration = plan(0, &drawn);
            if (!(fabs(duration / least - 1) < 0.002))
                fail_msg("%g there and back takes %.9f s, expected %.9f", d,
                         duration, least);
        }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(paths_are_planned_or_refused_with_their_reason),
        cmocka_unit_test(paths_of_every_size_take_their_least_time),
        cmocka_unit_test(fewer_limits_caps_and_stops_are_never_slower),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
