/* firmware/linux/xml/urdf.h - joints and their limits from a robot description,
 * URDF.
 *
 * Of every joint that moves: type, <limit lower upper velocity>, as the file has
 * the numbers: radian and metres.  Source: wiki.ros.org/urdf/XML/joint.  XML is
 * read by expat. */
#ifndef FIRMWARE_LINUX_XML_URDF_H
#define FIRMWARE_LINUX_XML_URDF_H

#include <stdbool.h>
#include <stdint.h>

#include "firmware/host/base/files.h"
#include "firmware/host/yaml/yaml_report.h"

#define URDF_JOINTS_MAX 256
#define URDF_NAME_MAX   64
#define URDF_NUMBER_MAX 32

struct urdf_joint {
    char name[URDF_NAME_MAX];
    bool slides;  /* prismatic; else it turns */
    bool is_free; /* continuous: no position limits */
    /* empty: not given */
    char lower[URDF_NUMBER_MAX], upper[URDF_NUMBER_MAX],
        velocity[URDF_NUMBER_MAX];
    struct plan_place place;
};

struct urdf {
    struct urdf_joint joint[URDF_JOINTS_MAX];
    uint32_t joints; /* fixed ones and those of six or three axes left out */
};

/* 0, or -1 with the sentence written: FILE:LINE:COLUMN: what. */
int urdf_read(const struct files *files, const char *path, struct urdf *urdf,
              char message[YAML_MESSAGE_MAX]);

#endif
