/* motion/plan/camera/plan_camera.h - a camera head on a path: which way it looks.
 *
 * The space of the path is right-handed (x, y, z; a path of two axes has z =
 * 0).  The head stands on a mount: with pan, tilt and roll 0 it looks `forward`
 * with `up` on top; pan is positive to the left, tilt upwards, roll clockwise
 * as the camera sees it (motion/path/head.h).  What it looks at and how its
 * horizon lies is motion/path/lookat.h and frame.h. */
#ifndef MOTION_PLAN_CAMERA_PLAN_CAMERA_H
#define MOTION_PLAN_CAMERA_PLAN_CAMERA_H

#include "motion/path/head.h"
#include "motion/path/lookat.h"
#include "motion/path/orient.h"
#include "motion/plan/path/plan_path.h"
#include "motion/plan/plan_progress.h"
#include "motion/plan/rig/plan_rig.h"

#define PLAN_CAMERA_DWELLS_MAX 1000
#define PLAN_ORIENT_KEYS_MAX   10000

enum plan_look {
    PLAN_LOOK_AT,         /* a fixed point */
    PLAN_LOOK_AHEAD,      /* a point ahead on the path */
    PLAN_LOOK_PATH,       /* a point on another path, at the same part of it */
    PLAN_LOOK_DWELL,      /* points in turn, with eased transitions */
    PLAN_LOOK_LEVEL,      /* along the path, the horizon level */
    PLAN_LOOK_MINIMISING, /* along the path, turning about it as little as can */
    PLAN_LOOK_FRENET,     /* along the path, up is its binormal */
    PLAN_LOOK_KEYS,       /* nothing: it turns through keyed orientations */
    PLAN_LOOK_SUBJECT,    /* a point that moves by keys */
    PLAN_LOOK_TABLE,      /* a point on the turntable of the rig */
};

struct plan_dwell {
    int64_t point_q32[PLAN_SPACE_AXES];
    struct plan_distance from, to;
    struct plan_place place;
};

/* An orientation, and when or where on the path the head has it. */
struct plan_orient_key {
    int64_t t_ns_q12;
    struct plan_distance at;
    /* The rotation of right, up and backwards of the camera in the space, or
     * else the angles of the head, whole turns included. */
    struct motion_quat q;
    struct motion_head head;
    bool has_angles;
    struct plan_place place;
};

struct plan_orient {
    enum motion_orient_curve curve;
    bool is_along; /* keys are places on the path, not times */
    struct plan_orient_key *key;
    uint32_t count;
};

/* A rig's camera follows its subject by what its axes do, with or without a
 * path (plan_follow.h); each motor of the lens may follow, too. */
struct plan_following {
    struct plan_rig *rig; /* axes of the move; NULL: the path is the camera's */
    struct plan_axis *subject; /* SUBJECT: PLAN_SPACE_AXES of them, by time */
    bool has_lens[PLAN_LENSES];
    int64_t focal_q32; /* ZOOM: the focal length, > 0, at this time; in between
                          the subject keeps its size */
    int64_t focal_ns_q12;
    struct plan_place place[PLAN_LENSES];
};

struct plan_camera {
    uint32_t axis[MOTION_HEAD_AXES]; /* of the move */
    struct plan_limit
        limit[MOTION_HEAD_AXES]; /* for sentences; zero: unknown */
    bool has_roll;
    enum plan_look look;
    int64_t point_q32[PLAN_SPACE_AXES]; /* AT, TABLE */
    int64_t ahead_q32;                  /* AHEAD; > 0 */
    enum motion_ahead_end end;
    struct plan_points points; /* PATH */
    struct plan_dwell *dwell;  /* DWELL */
    uint32_t dwells;
    enum motion_dwell_ease ease;
    struct plan_orient orient; /* KEYS */
    struct plan_following following;
    struct motion_dir forward, up;
    struct plan_axis *roll;  /* keyed, degrees, on top of the above; NULL */
    int64_t tolerance_q32;   /* degrees, > 0 */
    struct plan_place place; /* of the camera */
    struct plan_place look_place;
};

/* Does it need a path?  Not where keys are times. */
bool plan_camera_is_on_path(const struct plan_camera *camera);

/* Plan the head's axes into track[camera->axis[..]], which must be empty; they
 * belong to the caller.  bound_q32[axis] is how far at most each is from the
 * angle meant.  `drive` is not looked at without a path.  On an error the code,
 * *error, and empty tracks. */
int plan_camera_tracks(const struct plan_camera *camera,
                       const struct plan_drive *drive,
                       struct motion_track track[],
                       int64_t bound_q32[MOTION_HEAD_AXES],
                       const struct plan_progress *progress,
                       struct plan_error *error);

/* The rotation of the head's base: its x, y, z axes are right, up and backwards
 * in the space of the path.  The camera's own is mount times that of its angles
 * (motion_head_quat).  MOTION_E_RANGE or MOTION_E_ARG when forward and up are
 * in one line. */
int plan_camera_mount(const struct plan_camera *camera,
                      struct motion_quat *mount);

void plan_camera_free(struct plan_camera *camera);

#endif
