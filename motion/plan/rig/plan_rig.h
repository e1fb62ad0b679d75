/* motion/plan/rig/plan_rig.h - a camera rig on the axes of a move: where the camera
 * is, with its velocity and acceleration.
 *
 * What the rig is made of is motion/kinematics/rig.h, whose geometry this is in
 * jets (jet.h); here it is told which axis is which.  Lengths in the unit of the
 * carrier's axes, angles in degrees on axes and in radian in jets. */
#ifndef MOTION_PLAN_RIG_PLAN_RIG_H
#define MOTION_PLAN_RIG_PLAN_RIG_H

#include "motion/kinematics/arm.h"
#include "motion/kinematics/rig.h"
#include "motion/plan/move.h"
#include "motion/plan/rig/jet.h"

/* Which axis, in what holds the rig: of the rig's file, or of the move. */
struct plan_rig_axis {
    bool is_given;
    uint32_t axis;
};

/* Motors of the lens: their positions are the distance of the subject from the
 * pupil, and the focal length, each in the axis's own unit. */
enum plan_lens { PLAN_LENS_FOCUS, PLAN_LENS_ZOOM, PLAN_LENSES };

/* A serial arm; its tool looks along the view of `tool`. */
struct plan_arm {
    struct motion_arm arm;   /* count 0: there is none */
    struct motion_pose base; /* of its table's first frame, in space */
    struct motion_arm_tool tool;
    struct plan_rig_axis axis[MOTION_ARM_JOINTS_MAX];
    struct motion_axis_map map[MOTION_ARM_JOINTS_MAX];
    /* radian, or unit of length, per unit of the axis */
    double unit[MOTION_ARM_JOINTS_MAX];
};

struct plan_rig {
    struct motion_rig rig;
    struct motion_dir forward, up; /* of the head at rest, as level is */
    struct plan_rig_axis carrier[MOTION_CARRIER_AXES_MAX];
    struct plan_rig_axis head[MOTION_HEAD_AXES]; /* pan: not given, no head */
    struct plan_rig_axis table;
    struct motion_axis_map table_map;
    int64_t centre_q32[3]; /* of the table */
    struct plan_rig_axis lens[PLAN_LENSES];
    struct plan_arm arm; /* with one, nothing of the above */
    struct plan_place place;
};

/* Directions that turn with what they are of. */
struct plan_rig_frame {
    struct plan_jet_vec forward, left, up;
};

double plan_rig_real(struct motion_real a);
struct motion_real plan_rig_from_double(double a); /* finite */

/* p, v, a of a track; at rest where it has ended. */
struct plan_jet plan_rig_track(const struct motion_track *track,
                               int64_t t_ns_q12, int side);

/* coordinate = +-axis + offset of motion_axis_map, and back. */
struct plan_jet plan_rig_coordinate(const struct motion_axis_map *map,
                                    struct plan_jet axis);
struct plan_jet plan_rig_position(const struct motion_axis_map *map,
                                  struct plan_jet coordinate);

/* Pivot and frame of the mount of the head (motion_mount) from the positions of
 * the carrier's axes. */
void plan_rig_mount(const struct motion_carrier *carrier,
                    const struct plan_jet axis[], struct plan_jet_vec *pivot,
                    struct plan_rig_frame *mount);

/* Pan, tilt (coordinates, radian, tilt between the verticals and pan in -pi ..
 * pi) with which the camera sees a subject that is at `off` from the pivot, and
 * its distance from the pupil; roll is a coordinate.  MOTION_E_UNREACHABLE when
 * the subject is nearer than the pupil goes round, MOTION_E_SINGULAR when it is
 * on the axis of pan or in the pupil. */
struct plan_rig_aim {
    struct plan_jet pan, tilt, distance;
};
int plan_rig_look(const struct motion_nodal *nodal,
                  const struct plan_rig_frame *mount, struct plan_jet_vec off,
                  struct plan_jet roll, struct plan_rig_aim *aim);

/* The camera: its frame and its entrance pupil. */
struct plan_rig_camera {
    struct plan_jet_vec pupil;
    struct plan_rig_frame frame;
};
/* At a time of the tracks of the move whose axes the rig names; an axis that is
 * not given is at coordinate 0. */
void plan_rig_camera_at(const struct plan_rig *rig,
                        const struct motion_track track[], int64_t t_ns_q12,
                        struct plan_rig_camera *camera);

/* A point in the frame of the turntable, in space. */
struct plan_jet_vec plan_rig_on_table(const struct plan_rig *rig,
                                      struct plan_jet table,
                                      struct plan_jet_vec point);

#endif
