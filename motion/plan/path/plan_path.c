/* motion/plan/path/plan_path.c - see plan_path.h. */
#include "motion/plan/path/plan_path.h"

#include <math.h>
#include <stdlib.h>

#include "motion/core/err.h"
#include "motion/double/double_math.h"
#include "motion/path/path.h"
#include "motion/plan/camera/plan_camera.h"
#include "motion/plan/path/plan_fastest.h"
#include "motion/plan/plan_error.h"
#include "motion/plan/plan_track.h"

/* Segments from one border to the next for which there is room at once. */
#define PATH_CAPACITY 8
/* Looks of the baker, at most: so many, and per border. */
#define PATH_LOOKS        100000
#define PATH_BORDER_LOOKS 64

/* A path turns at once where it turns by more than ten degrees, this cosine, from a
 * microsecond before a time to one after it: nothing shorter is baked. */
#define PATH_TURNS   0.9848
#define PATH_AT_ONCE (MOTION_FIXED_S_Q12 / 1000000)

/* Largest speed of the law, halved 25 times. */
static struct motion_real path_vel_tolerance(const struct motion_track *law)
{
    struct motion_extreme extreme;

    motion_track_extreme(law, MOTION_VEL, &extreme);
    return motion_real_max(
        motion_real_scale(motion_real_from_q(extreme.max, 32), -25),
        motion_real_from_q(1, 34));
}

/* All tracks twice as long. */
static int path_grow(struct motion_track *const list[], uint32_t axes)
{
    for (uint32_t i = 0; i < axes; i++)
        if (plan_track_grow(list[i]) < 0)
            return MOTION_E_FULL;
    return MOTION_OK;
}

/* Return when the law is first past a point. */
static double path_passes(const struct plan_drive *drive, uint32_t point)
{
    const struct plan_space *space = &drive->space;
    int64_t low = 0, high = drive->law.end_ns_q12;

    while (high - low > 1) {
        const int64_t middle = low + (high - low) / 2;
        const double parameter = plan_space_parameter(
            space,
            motion_bake_track(&drive->law, middle, MOTION_BAKE_RIGHT).pos);
        if (parameter * (double)MOTION_FIXED_S_Q12 <
            (double)space->point_ns_q12[space->wrap + point])
            low = middle;
        else
            high = middle;
    }
    return (double)high / (double)MOTION_FIXED_S_Q12;
}

/* Find the direction and the speed of the path at a time. */
static bool path_direction(const struct plan_drive *drive, int64_t t_ns_q12,
                           struct motion_dir *tangent, double *vel)
{
    const struct motion_bake_point at =
        motion_bake_track(&drive->law, t_ns_q12, MOTION_BAKE_RIGHT);
    struct motion_vec pos;
    int64_t distance_q32 = 0;

    *vel = plan_rig_real(at.vel);
    return motion_real_round(at.pos, 32, &distance_q32) == MOTION_OK &&
           plan_space_at(&drive->space, distance_q32, &pos, tangent) ==
               MOTION_OK;
}

/* No segment of a microsecond follows the path there: it has a corner or turns back,
 * which it does at once, or bends very much. */
static int path_refuse_turn(const struct plan_path *path,
                            const struct plan_drive *drive, int64_t t_ns_q12,
                            struct plan_error *error)
{
    const double s = plan_rig_real(
        motion_bake_track(&drive->law, t_ns_q12, MOTION_BAKE_RIGHT).pos);
    const uint32_t first = plan_space_point(
        &drive->space,
        plan_space_parameter(&drive->space, plan_rig_from_double(s)));
    const uint32_t second = (first + 1) % path->points.count;
    struct motion_dir before, after;
    double vel = 0, apart = 0, cosine = 0;

    for (uint32_t k = 0; k < path->points.axes; k++) {
        const double d = ldexp((double)path->points.point[second].q32[k] -
                                   (double)path->points.point[first].q32[k],
                               -32);
        apart += d * d;
    }
    if (path_direction(drive, t_ns_q12 - PATH_AT_ONCE, &before, &vel) &&
        path_direction(drive, t_ns_q12 + PATH_AT_ONCE, &after, &vel))
        cosine = plan_rig_real(motion_vec_dot(motion_vec_from_dir(before),
                                              motion_vec_from_dir(after)));
    if (cosine < PATH_TURNS)
        return plan_error_set(
            error, MOTION_E_TOLERANCE, path->points.point[first].place,
            "the path turns on the spot by %.4g deg, %.9g from its start and "
            "%.6g s after it, where the speed law does not rest",
            double_acos(fmax(cosine, -1)) / DOUBLE_RADIAN, s,
            (double)t_ns_q12 / (double)MOTION_FIXED_S_Q12);
    return plan_error_set(
        error, MOTION_E_TOLERANCE, path->points.point[first].place,
        "the path bends too sharply %.9g from its start to be followed at "
        "%.4g/s, between points %u and %u, which are %.4g apart and %.4g s "
        "after "
        "each other: go slower there, or leave one of them out",
        s, vel, (unsigned)first + 1, (unsigned)second + 1, sqrt(apart),
        path_passes(drive, first + 1) - path_passes(drive, first));
}

static int path_refuse(const struct plan_path *path, int code,
                       struct plan_error *error)
{
    if (code == MOTION_E_WORK)
        return plan_error_set(
            error, code, path->place,
            "the path takes too much work to plan: more than "
            "%u evaluations and %u for every point: give it a "
            "larger tolerance, or a curve that bends less",
            PATH_LOOKS, PATH_BORDER_LOOKS);
    return plan_error_set(error, code, path->place,
                          "the path cannot be driven like this (%s)",
                          motion_err_text(code));
}

static int path_bake(const struct plan_path *path, struct plan_drive *drive,
                     struct motion_path *line, struct motion_track track[],
                     struct plan_error *error)
{
    const struct motion_path_tolerance tolerance = {
        motion_real_from_q(path->tolerance_q32, 32),
        path_vel_tolerance(&drive->law),
        motion_real_zero(),
    };
    struct motion_track *list[PLAN_SPACE_AXES];
    struct motion_bake_report report;
    int err;

    for (uint32_t i = 0; i < path->points.axes; i++) {
        list[i] = &track[path->axis[i]];
        plan_track_init(list[i], plan_space_start_q32(&drive->space, i));
        plan_track_reserve(list[i], PATH_CAPACITY * (size_t)line->borders);
    }
    do
        err = motion_path_bake(line, &tolerance, list, &report);
    while (err == MOTION_E_FULL &&
           path_grow(list, path->points.axes) == MOTION_OK);
    for (uint32_t i = 0; i < path->points.axes; i++) {
        if (err < 0) {
            plan_track_free(list[i]);
            continue;
        }
        plan_track_trim(list[i]);
        drive->bound[i] = report.bound[i].pos;
    }
    drive->segments = report.segments;
    drive->evaluations = report.evaluations;
    if (err == MOTION_E_TOLERANCE || err == MOTION_E_RANGE)
        return path_refuse_turn(path, drive, line->last_ns_q12, error);
    return err < 0 ? path_refuse(path, err, error) : MOTION_OK;
}

/* The borders of the drive. */
static int path_open(const struct plan_path *path, struct plan_drive *drive,
                     struct motion_path *line, struct plan_error *error)
{
    const size_t knots = (size_t)drive->space.curve.pieces + 1;
    int err = MOTION_E_FULL;

    drive->knot_ns_q12 =
        plan_pool_take(&drive->pool, knots, sizeof *drive->knot_ns_q12);
    drive->border_ns_q12 = plan_pool_take(
        &drive->pool, knots + drive->law.count, sizeof *drive->border_ns_q12);
    if (drive->knot_ns_q12 != NULL && drive->border_ns_q12 != NULL)
        err = motion_path_init(line, &drive->space.table, &drive->law,
                               drive->knot_ns_q12, drive->border_ns_q12);
    if (err < 0)
        return path_refuse(path, err, error);
    drive->borders = line->borders;
    return MOTION_OK;
}

static int path_by_parts(const struct plan_path *path, struct plan_drive *drive,
                         struct motion_track track[], struct plan_error *error)
{
    struct motion_real law_error = motion_real_zero();
    struct motion_path line = { .borders = 0 };
    int err =
        plan_speed_law_track(path->part, path->parts, drive->space.table.length,
                             &drive->law, &law_error, error);

    if (err == MOTION_OK)
        err = path_open(path, drive, &line, error);
    if (err < 0)
        return err;
    line.law_error = law_error;
    line.evaluations = PATH_LOOKS + PATH_BORDER_LOOKS * line.borders;
    return path_bake(path, drive, &line, track, error);
}

/* As fast as the limits allow. */
static int path_by_limits(const struct plan_path *path,
                          struct plan_drive *drive, struct motion_track track[],
                          struct plan_error *error)
{
    struct motion_path line = { .borders = 0 };
    int err = plan_fastest_tracks(path, drive, track, error);

    if (err == MOTION_OK)
        err = path_open(path, drive, &line, error);
    for (uint32_t i = 0; i < path->points.axes && err < 0; i++)
        plan_track_free(&track[path->axis[i]]);
    return err;
}

int plan_path_tracks(const struct plan_path *path, struct plan_drive *drive,
                     struct motion_track track[], struct plan_error *error)
{
    int err;

    *drive = (struct plan_drive){ .borders = 0 };
    err = plan_space_init(&drive->space, &path->points, error);
    if (err == MOTION_OK)
        err = path->fastest != NULL ? path_by_limits(path, drive, track, error)
                                    : path_by_parts(path, drive, track, error);
    if (err < 0)
        plan_drive_free(drive);
    return err;
}

int plan_path_places(const struct plan_path *path, struct plan_drive *drive,
                     struct motion_track place[], struct plan_error *error)
{
    struct plan_path coordinates = *path;

    for (uint32_t i = 0; i < PLAN_SPACE_AXES; i++) {
        coordinates.axis[i] = i;
        plan_track_init(&place[i], 0);
    }
    return plan_path_tracks(&coordinates, drive, place, error);
}

void plan_drive_free(struct plan_drive *drive)
{
    plan_space_free(&drive->space);
    plan_track_free(&drive->law);
    plan_pool_free(&drive->pool);
    *drive = (struct plan_drive){ .borders = 0 };
}

void plan_path_free(struct plan_path *path)
{
    if (path == NULL)
        return;
    free(path->points.point);
    free(path->carrier);
    plan_camera_free(path->tool.look);
    plan_speed_law_free(path->part, path->parts);
    plan_fastest_free(path->fastest);
    free(path);
}
