/* firmware/linux/xml/urdf_arm.h - a chain of a robot description as the
 * Denavit-Hartenberg table of an arm (docs/CAMERA.md).
 *
 * Frames of a description stand anywhere on the axes of its joints; those of the
 * table lie on the common normals.  A description whose angles have few digits
 * (1.5708) is taken as the right angles that it means, within `snap`. */
#ifndef FIRMWARE_LINUX_XML_URDF_ARM_H
#define FIRMWARE_LINUX_XML_URDF_ARM_H

#include "firmware/host/rig/rig.h"
#include "firmware/linux/xml/urdf.h"
#include "motion/kinematics/arm.h"

#define URDF_WHY_MAX 256

/* From the root to the tip, fixed joints and those that are axes of the rig. */
struct urdf_chain {
    const struct urdf_joint *joint[URDF_JOINTS_MAX];
    uint32_t joints;
    const char *from, *to; /* links */
};

/* Lengths in mm, angles in radian. */
struct urdf_row {
    const struct urdf_joint *joint;
    double theta, d, a, alpha;
};

struct urdf_arm {
    bool has_base; /* else the table stands in the root's frame */
    double base[3], z[3], x[3];
    struct urdf_row row[MOTION_ARM_JOINTS_MAX];
    uint32_t rows;
    double tool[3], view[3], up[3]; /* of the tip, in the flange */
};

/* 0, or -1 and why the joints that are axes are no arm. */
int urdf_chain(const struct urdf *urdf, const struct rig *rig,
               struct urdf_chain *chain, char why[URDF_WHY_MAX]);
int urdf_arm(const struct urdf_chain *chain, double snap, struct urdf_arm *arm,
             char why[URDF_WHY_MAX]);

/* The tip in the root's frame, from the joints that move, in radian and mm: where
 * it is, where its z points, and its y; the y of a camera's optical frame is down. */
struct urdf_tip {
    double at[3], view[3], up[3];
};
void urdf_tip(const struct urdf_chain *chain, const double joint[],
              struct urdf_tip *tip);

#endif
