/* firmware/host/exchange/joint_limits.h - what a robot's files say of the limits of
 * its joints, and joint_limits.yaml of MoveIt.
 *
 * Numbers are kept as the file has them: radian and metres.  Source:
 * moveit.picknik.ai, URDF and SRDF, "joint_limits.yaml": a max counts where its
 * has_..._limits is true. */
#ifndef FIRMWARE_HOST_EXCHANGE_JOINT_LIMITS_H
#define FIRMWARE_HOST_EXCHANGE_JOINT_LIMITS_H

#include "firmware/host/base/files.h"
#include "firmware/host/yaml/yaml_report.h"

#define JOINT_LIMITS_MAX      256
#define JOINT_LIMITS_NAME_MAX 64
#define JOINT_LIMITS_TEXT_MAX 64
#define JOINT_LIMITS_LEFT_MAX 32

enum joint_limit {
    JOINT_LOWER,
    JOINT_UPPER,
    JOINT_VELOCITY,
    JOINT_ACCELERATION,
    JOINT_JERK,
    JOINT_LIMIT_COUNT
};

struct joint_limits {
    char name[JOINT_LIMITS_NAME_MAX];
    char text[JOINT_LIMIT_COUNT][JOINT_LIMITS_TEXT_MAX]; /* "": not given */
    struct plan_place place;
};

struct joint_limits_file {
    struct joint_limits joint[JOINT_LIMITS_MAX];
    uint32_t joints;
    /* keys that are not read, each once */
    struct {
        char word[JOINT_LIMITS_NAME_MAX];
        uint32_t line, count;
    } left[JOINT_LIMITS_LEFT_MAX];
    uint32_t lefts;
};

/* 0, or -1 with the sentence written. */
int joint_limits_read(const struct files *files, const char *path,
                      struct joint_limits_file *out,
                      char message[YAML_MESSAGE_MAX]);

#endif
