/* firmware/host/device/modbus_map_parts.h - private to modbus_map_*.c: what the
 * readers of a register map share. */
#ifndef FIRMWARE_HOST_DEVICE_MODBUS_MAP_PARTS_H
#define FIRMWARE_HOST_DEVICE_MODBUS_MAP_PARTS_H

#include "firmware/host/base/array.h"
#include "firmware/host/yaml/yaml_fields.h"
#include "firmware/host/yaml/yaml_units.h"
#include "hal/modbus/map.h"

#define MAP_MS INT64_C(1000000)

struct map_reader {
    struct modbus_map *map;
    enum modbus_map_order order;  /* where none is given */
    struct modbus_map_item *item; /* being read */
    struct modbus_map_group *group;
    unsigned step_kinds;
};

/* 0 .. max_ns. */
int map_read_time(const struct yaml_value *value, int64_t max_ns, int64_t *out);
int map_read_item(const struct map_reader *reader,
                  const struct yaml_value *value, uint8_t *out);
int map_read_type(void *reader, const struct yaml_value *value, void *out);
int map_read_order(void *reader, const struct yaml_value *value, void *out);
int map_read_address(void *reader, const struct yaml_value *value, void *out);
/* Bits: 0 .. 2^32 - 1. */
int map_read_mask(void *reader, const struct yaml_value *value, void *out);

/* A section each; out: the map, of a group the group. */
int map_read_items(void *reader, const struct yaml_value *value, void *out);
int map_read_apart(void *reader, const struct yaml_value *value, void *out);
int map_read_status(void *reader, const struct yaml_value *value, void *out);
int map_read_identify(void *reader, const struct yaml_value *value, void *out);
int map_read_group(void *reader, const struct yaml_value *value, void *out);
int map_read_sequences(void *reader, const struct yaml_value *value, void *out);

extern const struct yaml_shape map_item_shape, map_status_shape,
    map_condition_shape, map_identify_shape, map_group_shape, map_field_shape,
    map_sequence_shape, map_step_shape;
extern const char *const map_orders[MODBUS_DCBA + 1];
extern const char *const map_polls[MODBUS_POLL_SLOW + 1];
extern const char *const map_statuses[MODBUS_STATUS_COUNT];
extern const char *const map_types[MODBUS_BIT + 1]; /* the bit is the last */
extern const char *const map_quantities[MODBUS_DECELERATION + 1];
extern const char *const map_units[MODBUS_MS_PER_1000_RPM + 1];

#endif
