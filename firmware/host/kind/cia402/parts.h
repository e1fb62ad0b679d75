/* firmware/host/kind/cia402/parts.h - what the files of this folder share: what
 * a rig says of a CiA 402 drive.
 *
 *   kind.c    the row, the fields of `drive:`  fields.c  kinds of value
 *   node.c    several axes behind one node     quirks.c  what its maker does
 *   parameters.c  data sheet, parameters */
#ifndef FIRMWARE_HOST_KIND_CIA402_PARTS_H
#define FIRMWARE_HOST_KIND_CIA402_PARTS_H

#include "firmware/host/rig/rig_parts.h"

/* ---- parameters.c ---- */

int rig_read_eds(void *reader, const struct yaml_value *value, void *out);
/* When all of the axis is read: has the drive what is used of it? */
int rig_judge_eds(const struct rig_reader *reader);
int rig_read_parameters(void *reader, const struct yaml_value *value,
                        void *out);
struct rig_objects {
    const struct eds *eds; /* NULL: none */
    struct drive_cia402_parameter *object;
    unsigned *count, most;
};
/* A map of objects and values, `most` of them. */
int rig_read_objects(const struct yaml_value *value, struct rig_objects *list);

/* ---- fields.c ---- */

int rig_read_cia402_mode(void *reader, const struct yaml_value *value,
                         void *out);
int rig_read_cia402_bandwidth(void *reader, const struct yaml_value *value,
                              void *out);
int rig_read_cia402_torque(void *reader, const struct yaml_value *value,
                           void *out);
/* Of a whole axis, its stop filled in. */
int rig_check_cia402_torque(const struct yaml_value *value,
                            const struct rig_axis *axis);
int rig_read_cia402_revolution(void *reader, const struct yaml_value *value,
                               void *out);
int rig_read_cia402_guarding(void *reader, const struct yaml_value *value,
                             void *out);
int rig_read_cia402_nmt_reset(void *reader, const struct yaml_value *value,
                              void *out);
int rig_read_times(void *reader, const struct yaml_value *value, void *out);
int rig_read_answer_time(void *reader, const struct yaml_value *value,
                         void *out);
int rig_read_wait_time(void *reader, const struct yaml_value *value, void *out);
int rig_read_scale(void *reader, const struct yaml_value *value, void *out);
int rig_read_options(void *reader, const struct yaml_value *value, void *out);
/* What can only be judged when all of the drive is read. */
int rig_check_cia402(const struct yaml_value *value,
                     const struct rig_axis *axis);
/* ---- node.c: several axes behind one node ---- */

int rig_read_cia402_axis(void *reader, const struct yaml_value *value,
                         void *out);
int rig_read_cia402_pdo(void *reader, const struct yaml_value *value,
                        void *out);
/* Of a whole drive: what it shares with those before it. */
int rig_check_node(const struct rig_reader *reader,
                   const struct yaml_value *value);

/* ---- quirks.c ---- */

int rig_read_quirks(void *reader, const struct yaml_value *value, void *out);
/* Those that come with slew, for a rig with a CiA 402 drive. */
int rig_know_quirks(struct rig_reader *reader, const struct yaml_value *value);

#endif
