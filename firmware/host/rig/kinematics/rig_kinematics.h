/* firmware/host/rig/kinematics/rig_kinematics.h - what the readers of kinematics: share.
 *
 *   rig_carrier.c  linear, arc, gantry, jib     rig_arm.c   arm
 *   rig_rail.c     rail                         rig_head.c  head, table, lens */
#ifndef FIRMWARE_HOST_RIG_KINEMATICS_RIG_KINEMATICS_H
#define FIRMWARE_HOST_RIG_KINEMATICS_RIG_KINEMATICS_H

#include "firmware/host/rig/rig_parts.h"

/* An axis and its map to a joint. */
struct rig_joint {
    enum units_axis unit; /* that it must have */
    struct plan_rig_axis axis;
    struct motion_axis_map map;
    struct motion_dir direction;
};

struct plan_rig *rig_kinematics_of(void *reader);

/* ---- values ---- */

/* A list of `count` of them. */
int rig_read_numbers(struct rig_reader *self, const struct yaml_value *value,
                     enum units_quantity quantity, uint32_t count,
                     int64_t q32[]);
/* Three lengths, as Q32 and as a vector. */
int rig_read_place(void *reader, const struct yaml_value *value, void *out);
int rig_read_point(void *reader, const struct yaml_value *value, void *out);
int rig_read_direction(void *reader, const struct yaml_value *value, void *out);
/* Above zero. */
int rig_read_length(void *reader, const struct yaml_value *value, void *out);

/* ---- axes ---- */

/* One that has no place yet. */
int rig_read_free_axis(const struct rig_reader *reader,
                       const struct yaml_value *value, unsigned *index);
/* The same into a struct rig_joint, in its unit. */
int rig_read_joint_axis(void *reader, const struct yaml_value *value,
                        void *out);
/* A map of rig_joint_shape or rig_slide_shape. */
int rig_read_joint(struct rig_reader *self, const struct yaml_value *value,
                   const struct yaml_shape *shape, enum units_axis unit,
                   struct rig_joint *joint);
/* The axis in a place of what carries the head. */
int rig_read_carrier_axis(void *reader, const struct yaml_value *value,
                          enum units_axis unit, int index,
                          struct motion_axis_map *map);

/* ---- maps ---- */

/* Into a struct motion_carrier. */
int rig_read_linear(void *reader, const struct yaml_value *value, void *out);
int rig_read_arc(void *reader, const struct yaml_value *value, void *out);
int rig_read_rail(void *reader, const struct yaml_value *value, void *out);
int rig_read_gantry(void *reader, const struct yaml_value *value, void *out);
int rig_read_jib(void *reader, const struct yaml_value *value, void *out);
/* Into a struct plan_arm. */
int rig_read_arm(void *reader, const struct yaml_value *value, void *out);
/* Into a struct plan_rig. */
int rig_read_head(void *reader, const struct yaml_value *value, void *out);
int rig_read_table(void *reader, const struct yaml_value *value, void *out);
int rig_read_lens(void *reader, const struct yaml_value *value, void *out);

#endif
