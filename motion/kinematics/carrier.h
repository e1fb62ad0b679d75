/* motion/kinematics/carrier.h - what carries the head of a camera rig: linear
 * axes, a circular rail, a rail through points, a gantry, a jib.
 *
 * Each kind places the mount of the head from its axes, and finds its axes from
 * the place of the pivot.  Directions are those in space; `level` is the camera's
 * rotation with pan, tilt and roll at 0 (motion_mount_level), and of a rail or
 * boom that turns the head, with it at 0.
 * Errors: MOTION_E_ARG for a rig that makes no sense, MOTION_E_LIMIT for axes
 * outside a limit, MOTION_E_UNREACHABLE and MOTION_E_SINGULAR for a place,
 * MOTION_E_RANGE for axes beyond Q32.32.  Source: the geometry that is written
 * with each kind.  Plan-time. */
#ifndef MOTION_KINEMATICS_CARRIER_H
#define MOTION_KINEMATICS_CARRIER_H

#include "motion/kinematics/mount.h"
#include "motion/path/arclen.h"

#define MOTION_LINEAR_AXES_MAX  3
#define MOTION_CARRIER_AXES_MAX 4 /* a gantry's */

/* pivot = origin + the sum of coordinate * direction; directions that are not in
 * one plane or line.  No axis is a camera on a tripod, one a slider. */
struct motion_linear {
    struct motion_vec origin;
    uint32_t count; /* 0 .. 3 */
    struct motion_dir direction[MOTION_LINEAR_AXES_MAX];
    struct motion_axis_map axis[MOTION_LINEAR_AXES_MAX];
};

/* pivot = centre + radius (cos a start + sin a normal x start), a = coordinate /
 * radius in radian; the inverse takes the round nearest to the one before. */
struct motion_arc {
    struct motion_vec centre;
    struct motion_dir normal, start; /* at right angles: motion_arc_plane */
    int64_t radius_q32;              /* > 0 */
    bool is_turning; /* the carriage turns the mount by a about the normal */
    struct motion_axis_map axis;
};

/* `start` made perpendicular to `normal`, any lengths; MOTION_E_RANGE when one
 * is zero or they are parallel. */
int motion_arc_plane(struct motion_arc *arc, struct motion_vec normal,
                     struct motion_vec start);

/* pivot = the rail's curve at length = coordinate, which is 0 .. the length of
 * the table.  The carriage turns the mount about the vertical, by the rail's
 * heading less its heading at 0, so that a rail that climbs leaves the head
 * level.  A place is on the rail within MOTION_KINEMATICS_NEAR_Q32; where the rail
 * comes there more than once, the nearest to the coordinate before counts. */
struct motion_rail {
    /* of a motion_arclen_poly with 3 axes, nowhere vertical */
    const struct motion_arclen_table *table;
    bool is_turning;
    struct motion_axis_map axis;
};

/* Two rails along x at y = at_y, a bridge between them on which y counts, and z
 * up.  With the rails at x1 and x2 the bridge is turned about its joint on rail
 * 1, and the mount with it; the inverse puts both at the same x. */
struct motion_gantry {
    int64_t at_y_q32[2];            /* not equal */
    struct motion_axis_map axis[4]; /* x1, x2, y, z */
};

/* T = Rz(boom_pan) Ry(-boom_tilt), both zero along +x, pan to the left, tilt
 * upwards:  pivot = foot + T (length + extend, 0, 0) + F drop,
 * with F, which also turns the head, by `mount`. */
enum motion_jib_mount {
    MOTION_JIB_BOOM,  /* F = T: the head turns with the boom */
    MOTION_JIB_LEVEL, /* F = Rz(boom_pan): levelled */
    MOTION_JIB_SPACE, /* F = 1: counter-rotating */
};

struct motion_jib {
    struct motion_vec foot; /* where the boom's axes meet */
    int64_t length_q32;
    int64_t extend_min_q32, extend_max_q32;
    struct motion_vec drop; /* forward, left, up from the tip to the pivot */
    enum motion_jib_mount mount;
    struct motion_axis_map axis[3]; /* boom_pan, boom_tilt, extend */
};

struct motion_carrier {
    const struct motion_carrier_kind *kind; /* one of those below */
    struct motion_quat level;
    union {
        struct motion_linear linear;
        struct motion_arc arc;
        struct motion_rail rail;
        struct motion_gantry gantry;
        struct motion_jib jib;
    } as;
};

/* A kind: how many axes it has, where the mount is, and the axes for a pivot,
 * with those before or NULL. */
struct motion_carrier_kind {
    uint32_t (*axes)(const struct motion_carrier *carrier);
    int (*place)(const struct motion_carrier *carrier, const int64_t *axis_q32,
                 struct motion_mount *mount);
    int (*find)(const struct motion_carrier *carrier, struct motion_vec pivot,
                const int64_t *before_q32, int64_t *axis_q32);
};

extern const struct motion_carrier_kind motion_carrier_linear;
extern const struct motion_carrier_kind motion_carrier_arc;
extern const struct motion_carrier_kind motion_carrier_rail;
extern const struct motion_carrier_kind motion_carrier_gantry;
extern const struct motion_carrier_kind motion_carrier_jib;

#endif
