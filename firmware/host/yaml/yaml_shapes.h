/* firmware/host/yaml/yaml_shapes.h - the maps of rig.yaml, move.yaml, faults.yaml,
 * the register maps and quirks, as tables.
 *
 * For the readers themselves, and for whatever must agree with them:
 * tests/proofs/check_schema.py compares them with docs/schema. */
#ifndef FIRMWARE_HOST_YAML_YAML_SHAPES_H
#define FIRMWARE_HOST_YAML_YAML_SHAPES_H

#include "firmware/host/yaml/yaml_fields.h"

/* Ends with NULL. */
extern const struct yaml_shape *const rig_shapes[];
extern const struct yaml_shape *const move_shapes[];
extern const struct yaml_shape *const fault_shapes[];
extern const struct yaml_shape *const map_shapes[];
extern const struct yaml_shape *const quirk_shapes[];

/* A value that is one of a few words. */
struct yaml_words {
    const char *name; /* "axis.unit": shape and key */
    const char *const *spelling;
    unsigned count;
};

/* Ends with a name of NULL. */
extern const struct yaml_words rig_words[];
extern const struct yaml_words move_words[];
extern const struct yaml_words fault_words[];
extern const struct yaml_words map_words[];
extern const struct yaml_words quirk_words[];

#endif
