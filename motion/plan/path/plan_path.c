/* motion/plan/path/plan_path.c - see plan_path.h. */
#include "motion/plan/path/plan_path.h"

#include <stdlib.h>

#include "motion/core/err.h"
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

static int path_refuse(const struct plan_path *path, int code,
                       struct plan_error *error)
{
    if (code == MOTION_E_TOLERANCE)
        return plan_error_set(error, code, path->points.place,
                              "the path turns on the spot where the speed law "
                              "does not rest");
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
