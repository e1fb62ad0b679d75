/* motion/plan/path/plan_fastest.c - see plan_fastest.h.
 *
 * A cap bounds the speed along the path, |q'| s'.  Its section is cut into
 * parts, and s' is bounded in each by the cap over the largest |q'| there: that
 * of nine even places and, as a parabola between three is at most an eighth of
 * its second difference above them, a quarter of the largest. */
#include "motion/plan/path/plan_fastest.h"

#include <math.h>
#include <stdlib.h>

#include "motion/core/err.h"
#include "motion/plan/path/plan_timing.h"
#include "motion/plan/plan_error.h"
#include "motion/plan/plan_track.h"

#define FASTEST_PARTS  16 /* of a section */
#define FASTEST_PLACES 9  /* of a part */

static double fastest_double(struct motion_real a)
{
    return ldexp((double)a.m, a.e);
}

/* The parameter at a length. */
static double fastest_place(const struct plan_space *space,
                            const struct plan_distance *distance)
{
    return plan_space_parameter(
        space, plan_speed_law_distance(distance, space->table.length));
}

static double fastest_slope(const struct plan_space *space, double u)
{
    const struct motion_arclen_curve *curve = &space->curve;
    uint32_t piece = 0;

    while (piece + 1 < curve->pieces &&
           fastest_double(curve->border[piece + 1]) <= u)
        piece++;
    const double x = fmax(u - fastest_double(curve->border[piece]), 0);
    return fastest_double(motion_arclen_speed(
        curve, piece, motion_real_from_q(llround(ldexp(x, 40)), 40)));
}

static double fastest_steepest(const struct plan_space *space, double from,
                               double to)
{
    double slope[FASTEST_PLACES], most = 0, bend = 0;

    for (int i = 0; i < FASTEST_PLACES; i++) {
        slope[i] =
            fastest_slope(space, from + (to - from) * i / (FASTEST_PLACES - 1));
        most = fmax(most, slope[i]);
        if (i >= 2)
            bend = fmax(bend, fabs(slope[i] - 2 * slope[i - 1] + slope[i - 2]));
    }
    return most + bend / 4;
}

/* Appends the caps of one section; returns how many. */
static uint32_t fastest_section(const struct plan_space *space,
                                const struct plan_fastest_cap *section,
                                struct plan_topp_cap cap[])
{
    const double from = fastest_place(space, &section->from);
    const double to = fastest_place(space, &section->to);
    const double speed = ldexp((double)section->speed_q32, -32);

    if (section->speed_q32 == 0) {
        cap[0] = (struct plan_topp_cap){ from, from, 0 };
        return 1;
    }
    for (int i = 0; i < FASTEST_PARTS; i++) {
        const double a = from + (to - from) * i / FASTEST_PARTS;
        const double b = from + (to - from) * (i + 1) / FASTEST_PARTS;
        cap[i] = (struct plan_topp_cap){
            a, b, speed / fmax(fastest_steepest(space, a, b), 1e-300)
        };
    }
    return FASTEST_PARTS;
}

static int fastest_refuse(const struct plan_path *path,
                          const struct plan_space *space, int code,
                          double failed, struct plan_error *error)
{
    if (code == MOTION_E_WORK)
        return plan_error_set(error, code, path->place,
                              "the path has too many points for the fastest "
                              "speed to be found");
    if (code != MOTION_E_LIMIT || isnan(failed))
        return plan_error_set(error, code, path->place,
                              "the fastest speed cannot be found (%s)",
                              motion_err_text(code));
    if (path->fastest->end_q32[0] != 0 || path->fastest->end_q32[1] != 0)
        return plan_error_set(error, code, path->place,
                              "the path does not allow the speed at its start "
                              "or its end");
    return plan_error_set(error, code, path->place,
                          "no speed is inside the limits after point %u",
                          (unsigned)plan_space_point(space, failed) + 1);
}

static int fastest_check(const struct plan_path *path,
                         const struct plan_space *space,
                         struct plan_error *error)
{
    const struct motion_real length = space->table.length;

    for (uint32_t i = 0; i < path->fastest->caps; i++) {
        const struct plan_fastest_cap *cap = &path->fastest->cap[i];
        const struct motion_real from =
            plan_speed_law_distance(&cap->from, length);
        const struct motion_real to = plan_speed_law_distance(&cap->to, length);
        if (motion_real_lt(to, from))
            return plan_error_set(error, MOTION_E_ARG, cap->place,
                                  "cap ends at %.9g, before its start at %.9g",
                                  fastest_double(to), fastest_double(from));
        if (motion_real_cmp(to, length) > 0)
            return plan_error_set(error, MOTION_E_ARG, cap->place,
                                  "%s at %.9g is not on the path, which is "
                                  "%.9g long",
                                  cap->speed_q32 == 0 ? "stop" : "cap",
                                  fastest_double(to), fastest_double(length));
    }
    return MOTION_OK;
}

static int fastest_solve(const struct plan_path *path,
                         const struct plan_space *space,
                         struct plan_timing *timing, struct plan_error *error)
{
    const struct plan_fastest *fastest = path->fastest;
    const double last =
        fastest_double(space->curve.border[space->curve.pieces]);
    const double ends[2] = {
        ldexp((double)fastest->end_q32[0], -32) /
            fastest_slope(space, fastest_double(space->curve.border[0])),
        ldexp((double)fastest->end_q32[1], -32) / fastest_slope(space, last)
    };
    struct plan_pool scratch = { NULL };
    struct plan_topp_cap *cap;
    uint32_t caps = 0;
    double failed = NAN;
    int err = fastest_check(path, space, error);

    *timing = (struct plan_timing){ 0 };
    if (err < 0)
        return err;
    cap = plan_pool_take(&scratch, (size_t)fastest->caps * FASTEST_PARTS + 1,
                         sizeof *cap);
    if (cap == NULL)
        return plan_error_set(error, MOTION_E_FULL, path->place,
                              "no memory for the path");
    for (uint32_t i = 0; i < fastest->caps; i++)
        caps += fastest_section(space, &fastest->cap[i], cap + caps);
    err = plan_timing_solve(space->list, path->points.axes, fastest->limit, cap,
                            caps, ends, timing, &failed);
    plan_pool_free(&scratch);
    return err < 0 ? fastest_refuse(path, space, err, failed, error) : err;
}

int plan_fastest_tracks(const struct plan_path *path, struct plan_drive *drive,
                        struct motion_track track[], struct plan_error *error)
{
    const uint32_t axes = path->points.axes;
    struct motion_track own[PLAN_SPACE_AXES] = { 0 };
    int64_t start_q32[PLAN_SPACE_AXES], end_q32[PLAN_SPACE_AXES];
    struct motion_real law_error;
    struct plan_timing timing;
    double stretch = 1;
    int err = fastest_solve(path, &drive->space, &timing, error);

    if (err < 0)
        return err;
    for (uint32_t i = 0; i < axes; i++) {
        start_q32[i] = plan_space_start_q32(&drive->space, i);
        end_q32[i] = drive->space.closed ? start_q32[i]
                                         : drive->space.list[i]->end.pos_q32;
    }
    err = plan_timing_inside(
        &timing, &stretch, path->fastest->limit, start_q32, end_q32,
        motion_real_from_q(path->tolerance_q32, 32), own, drive->bound);
    if (err == MOTION_OK)
        err = plan_timing_distance(&timing, stretch, drive->space.table.length,
                                   motion_real_from_q(path->tolerance_q32, 34),
                                   &drive->law, &law_error);
    plan_timing_free(&timing);
    for (uint32_t i = 0; i < axes; i++) {
        if (err < 0)
            plan_track_free(&own[i]);
        else
            track[path->axis[i]] = own[i];
    }
    drive->segments = own[0].count;
    return err < 0 ? fastest_refuse(path, &drive->space, err, NAN, error) : err;
}

void plan_fastest_free(struct plan_fastest *fastest)
{
    if (fastest != NULL)
        free(fastest->cap);
    free(fastest);
}
