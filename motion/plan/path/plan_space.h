/* motion/plan/path/plan_space.h - a curve through points in space, measured.
 *
 * The points get a parameter by their distances (motion/curve/spline.h), each
 * coordinate a curve of move.h over that parameter, and the whole its table of
 * arc lengths (motion/path/arclen.h).  What follows asks by length alone.
 * Off-line: uses the heap. */
#ifndef MOTION_PLAN_PATH_PLAN_SPACE_H
#define MOTION_PLAN_PATH_PLAN_SPACE_H

#include "motion/number/vec.h"
#include "motion/path/arclen.h"
#include "motion/plan/move.h"

#define PLAN_SPACE_AXES       3
#define PLAN_SPACE_POINTS_MAX 10000

struct plan_point {
    int64_t q32[PLAN_SPACE_AXES]; /* unused ones are 0 */
    struct plan_place place;
};

struct plan_points {
    uint32_t axes; /* 2 or 3 */
    enum plan_curve curve;
    enum motion_spline_spacing spacing;
    bool closed;        /* on from the last point to the first */
    int64_t corner_q32; /* rounded, smoothed: length of a corner, > 0 */
    struct plan_point *point;
    uint32_t count;
    struct plan_place place;
};

/* Curves that go through space, and what they take. */
struct plan_space_rules {
    bool is, closed, corner;
    int smooth; /* continuous at points: 0 the position alone, 1 its direction, too, 2
                   its curvature, too */
};
struct plan_space_rules plan_space_rules(enum plan_curve curve);

/* It points into itself: not to be moved. */
struct plan_space {
    struct motion_track track[PLAN_SPACE_AXES]; /* on the heap */
    struct motion_track part[PLAN_SPACE_AXES];  /* of them, what counts */
    const struct motion_track *list[PLAN_SPACE_AXES];
    struct motion_path_tracks *tracks;
    struct motion_real *border, *coef;
    struct motion_arclen_row *row;
    /* The parameter at each point, that at the end of a closed curve too, and at so
     * many in front of the first that are left out; on the heap. */
    int64_t *point_ns_q12;
    uint32_t wrap, points;
    struct motion_arclen_curve curve;
    struct motion_arclen_table table;
    int64_t length_q32;
    bool closed;
    int smooth; /* as its curve is */
};

/* MOTION_E_EMPTY below two points (closed: three), MOTION_E_ARG for a curve
 * that is none in space or cannot be closed, MOTION_E_ORDER where two
 * neighbours are the same, MOTION_E_RANGE beyond the formats, MOTION_E_FULL;
 * *error says it and nothing is left allocated. */
int plan_space_init(struct plan_space *space, const struct plan_points *points,
                    struct plan_error *error);
void plan_space_free(struct plan_space *space);

/* Point and unit tangent (may be NULL) at a distance from the start; the
 * context is a struct plan_space.  Fits struct motion_lookat_path. */
int plan_space_at(const void *context, int64_t distance_q32,
                  struct motion_vec *pos, struct motion_dir *tangent);

/* The parameter at a distance from the start, s, and the point at or before one, by its
 * number from 0; never the last. */
double plan_space_parameter(const struct plan_space *space,
                            struct motion_real distance);
uint32_t plan_space_point(const struct plan_space *space, double parameter);

/* The start. */
int64_t plan_space_start_q32(const struct plan_space *space, uint32_t axis);

#endif
