/* firmware/linux/xml/urdf.h - joints of a robot description, URDF: their limits, and
 * where they are.
 *
 * Source: wiki.ros.org/urdf/XML/joint.  Numbers of limits are kept as the file has
 * them: radian and metres. */
#ifndef FIRMWARE_LINUX_XML_URDF_H
#define FIRMWARE_LINUX_XML_URDF_H

#include "firmware/linux/xml/xml.h"

#define URDF_JOINTS_MAX 256
#define URDF_NAME_MAX   64
#define URDF_UNREAD_MAX 16

struct urdf_joint {
    char name[URDF_NAME_MAX], parent[URDF_NAME_MAX], child[URDF_NAME_MAX];
    bool moves;   /* else it is fixed, or of six or three axes (is_loose) */
    bool slides;  /* prismatic; else it turns */
    bool is_free; /* continuous: no position limits */
    bool is_loose;
    bool follows; /* mimic: another joint moves it */
    /* empty: not given */
    char lower[XML_NUMBER_MAX], upper[XML_NUMBER_MAX], velocity[XML_NUMBER_MAX];
    /* of its frame in that of the parent: metres, and radian about the parent's
     * x, y, z, in this order */
    double origin[3], rpy[3];
    double axis[3]; /* in its own frame; of any length but 0 */
    struct plan_place place;
};

struct urdf {
    struct urdf_joint joint[URDF_JOINTS_MAX];
    uint32_t joints;
    struct xml_unread unread[URDF_UNREAD_MAX]; /* one a word */
    uint32_t unreads;
};

/* 0, or -1 with the sentence written: FILE:LINE:COLUMN: what. */
int urdf_read(const struct files *files, const char *path, struct urdf *urdf,
              char message[YAML_MESSAGE_MAX]);

#endif
