/* motion/path/lookat.h - a camera on a path that looks at a centre of interest.
 *
 *   view   from the camera to the centre of interest, normalised
 *   right  view x up of the world, normalised: the horizon is level
 *   up     right x view
 *
 * Right, up, -view are the x, y, z axes of the camera and right-handed (right,
 * up, view as usually given are not).  Above or below the target there is no
 * level right vector, and past it the level one points the other way.  The
 * camera then keeps the right vector it has and goes on over the top, like a
 * tilt head would: the picture does not flip.
 *
 * What the camera looks at: a fixed point; a point on its own path some
 * distance ahead; a point on another path; or one of several points in turn, on
 * which it dwells.  Distances are lengths along the path, in Q32.32.
 * Source: R. Parent, Computer Animation (3rd ed.), 3.4.  Plan-time. */
#ifndef MOTION_PATH_LOOKAT_H
#define MOTION_PATH_LOOKAT_H

#include <stdbool.h>
#include <stdint.h>

#include "motion/number/quat.h"
#include "motion/number/vec.h"

/* A path by its length. */
struct motion_lookat_path {
    /* Point and unit tangent (which may be NULL) at distance 0 .. length_q32
     * from the start.  MOTION_OK or an error, which is handed on. */
    int (*at)(const void *context, int64_t distance_q32, struct motion_vec *pos,
              struct motion_dir *tangent);
    const void *context;
    int64_t length_q32; /* > 0 */
};

/* --- what is looked at --------------------------------------------------- */

/* Look-ahead past the end of the path. */
enum motion_ahead_end {
    MOTION_AHEAD_STRAIGHT, /* on along the end tangent */
    MOTION_AHEAD_HOLD,     /* the end point; in it, along the end tangent */
    MOTION_AHEAD_CLOSED,   /* on from the start: the path is a loop */
};

enum motion_dwell_ease { MOTION_DWELL_CUBIC, MOTION_DWELL_QUINTIC };

/* Rest on a point from one distance to another; between two rests the centre of
 * interest moves in a straight line, eased: 3x^2 - 2x^3, which steps in
 * acceleration, or 10x^3 - 15x^4 + 6x^5, which does not. */
struct motion_dwell {
    int64_t point_q32[3];
    int64_t from_q32, to_q32; /* from <= to < the next one's from */
};

enum motion_target_kind {
    MOTION_TARGET_FIXED,
    MOTION_TARGET_AHEAD,
    MOTION_TARGET_PATH,
    MOTION_TARGET_DWELL,
};

struct motion_target {
    enum motion_target_kind kind;
    int64_t point_q32[3];      /* FIXED */
    int64_t ahead_q32;         /* AHEAD: distance, > 0 */
    enum motion_ahead_end end; /* AHEAD */
    const struct motion_lookat_path
        *path; /* PATH: at the same fraction of its length */
    const struct motion_dwell
        *dwell;      /* DWELL; before the first and after the */
    uint32_t dwells; /* last it rests */
    enum motion_dwell_ease ease;
};

/* The centre of interest for a camera at `distance` on `path`.  MOTION_E_ARG
 * for a distance outside the path or a field that does not make sense,
 * MOTION_E_ORDER where the rest before the distance overlaps the next,
 * MOTION_E_EMPTY for no rest, or the path's own error. */
int motion_target_at(const struct motion_target *target,
                     const struct motion_lookat_path *path,
                     int64_t distance_q32, struct motion_vec *coi);

/* --- the frame ----------------------------------------------------------- */

struct motion_view {
    struct motion_dir right, up, view;
};

enum motion_pole {
    MOTION_POLE_CARRY,   /* the right vector goes on, as above */
    MOTION_POLE_UPRIGHT, /* always level and upright: flips past the pole */
};

struct motion_lookat {
    struct motion_dir up;    /* of the world */
    struct motion_dir ahead; /* which way is forward for a camera that starts
                                straight up or down; not parallel to up */
    enum motion_pole pole;
};

/* Zero-initialised it starts afresh. */
struct motion_lookat_state {
    struct motion_view last; /* without tilt */
    bool valid;
    bool inverted; /* it went over the pole */
};

/* The frame of a camera at a distance along the path that looks at the target,
 * turned about the view by `tilt` (clockwise as the camera sees it; trig.h).
 * Within 2^-20 rad of the vertical the right vector is the last one's.  Two frames
 * in a row whose views are on either side of the vertical, less than a quarter turn
 * apart and in one plane with it within 2^-20 rad, went over the pole.  Where an
 * AHEAD target is the camera's own place (HOLD, at the end), it looks along the
 * tangent.  MOTION_E_RANGE in the target, MOTION_E_ARG when `ahead` is needed and
 * parallel to up, or an error of motion_target_at; the state is unchanged then. */
int motion_lookat_at(const struct motion_lookat *lookat,
                     struct motion_lookat_state *state,
                     const struct motion_target *target,
                     const struct motion_lookat_path *path,
                     int64_t distance_q32, int64_t tilt_turn,
                     struct motion_view *view);

/* The rotation whose x, y, z axes are right, up, -view; w >= 0. */
struct motion_quat motion_view_quat(const struct motion_view *view);

#endif
