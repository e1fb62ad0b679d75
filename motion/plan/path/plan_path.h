/* motion/plan/path/plan_path.h - axes that are driven together along a curve in
 * space, at the speed of a law: P(U(S(t))), motion/path/path.h. */
#ifndef MOTION_PLAN_PATH_PLAN_PATH_H
#define MOTION_PLAN_PATH_PLAN_PATH_H

#include "motion/plan/path/plan_space.h"
#include "motion/plan/path/plan_speed_law.h"
#include "motion/plan/plan_pool.h"
#include "motion/plan/rig/plan_rig.h"

/* Not faster than `speed` along the path between two places; 0 where both are
 * one is a stop. */
struct plan_fastest_cap {
    struct plan_distance from, to;
    int64_t speed_q32; /* unit/s; 0: it stops at `from` */
    struct plan_place place;
};

/* As fast as these limits of the path's axes allow (plan_timing.h).  The limits
 * hold on the tracks. */
struct plan_fastest {
    struct plan_limit limit[PLAN_SPACE_AXES];
    struct plan_fastest_cap *cap; /* on the heap */
    uint32_t caps;
    int64_t end_q32[2]; /* unit/s along the path at its start and its end */
};

struct plan_camera;

/* How the tool of an arm is turned on the path (camera/plan_tool.h). */
struct plan_tool {
    struct plan_camera *look; /* what a camera there looks at, and its roll;
                                      NULL: as follows */
    struct motion_dir forward, up;           /* at right angles */
    int64_t near_q32[MOTION_ARM_JOINTS_MAX]; /* axes near which it starts */
};

struct plan_path {
    uint32_t axis[PLAN_SPACE_AXES]; /* of the move; as many as points.axes */
    struct plan_points points;
    struct plan_part *part;
    uint32_t parts;
    struct plan_fastest *fastest; /* NULL: the parts say how fast */
    int64_t tolerance_q32;        /* of position, unit; > 0 */
    struct plan_rig *carrier;     /* NULL: the axes are coordinates; else three
                                 coordinates of the head (plan_carry.h), or of
                                 the tool of an arm */
    struct plan_tool tool;
    struct plan_place place;
};

/* A path as it is driven, for the camera and for reports. */
struct plan_drive {
    struct plan_space space;
    struct motion_track law; /* distance over time; on the heap */
    struct plan_pool pool;   /* of the two that follow */
    int64_t *knot_ns_q12;    /* when it is at each point */
    int64_t *border_ns_q12;  /* where something changes */
    uint32_t borders;
    struct motion_real bound[PLAN_SPACE_AXES]; /* of position, law's and table's
                                                  errors included */
    uint32_t segments, evaluations;            /* of the baking */
};

/* Plan the path into track[path->axis[..]], which must be empty; they belong to
 * the caller.  *drive points into itself and is to be freed with
 * plan_drive_free; zero after an error, and so are the tracks.
 * The tolerance of velocity is 2^-25 of the largest speed of the law: constant
 * speed is constant. */
int plan_path_tracks(const struct plan_path *path, struct plan_drive *drive,
                     struct motion_track track[], struct plan_error *error);
/* The same for a path of a head or a tool: its coordinates into place[0 .. 2],
 * as if they were axes, whatever they hold. */
int plan_path_places(const struct plan_path *path, struct plan_drive *drive,
                     struct motion_track place[], struct plan_error *error);
void plan_drive_free(struct plan_drive *drive);

/* Everything that the path holds on the heap, and itself; NULL is nothing. */
void plan_path_free(struct plan_path *path);

#endif
