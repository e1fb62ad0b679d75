/* firmware/host/yaml/yaml_units.h - a value of the file that has a unit.  The
 * sentence is that of units.h, after the value's place and name. */
#ifndef FIRMWARE_HOST_YAML_YAML_UNITS_H
#define FIRMWARE_HOST_YAML_YAML_UNITS_H

#include "firmware/host/base/units.h"
#include "firmware/host/yaml/yaml_fields.h"

int yaml_units_read(const struct yaml_value *value,
                    enum units_quantity quantity,
                    const struct units_context *context, int64_t *out);
/* A list of `count` of them, each `expected` (NULL: what the list is). */
int yaml_units_read_list(const struct yaml_value *value,
                         enum units_quantity quantity,
                         const struct units_context *context,
                         const char *expected, uint32_t count, int64_t out[]);
int yaml_units_read_fps(const struct yaml_value *value, struct units_fps *fps);
int yaml_units_read_counts(const struct yaml_value *value, enum units_axis unit,
                           int64_t *num, int64_t *den);

#endif
