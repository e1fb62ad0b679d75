/* firmware/host/device/modbus_map_load.h - a drive's register map from a YAML
 * file (docs/MODBUS.md describes it). */
#ifndef FIRMWARE_HOST_DEVICE_MODBUS_MAP_LOAD_H
#define FIRMWARE_HOST_DEVICE_MODBUS_MAP_LOAD_H

#include "firmware/host/base/files.h"
#include "firmware/host/yaml/yaml_report.h"
#include "hal/modbus/map.h"

/* 0, or -1 with one sentence in message; *map is then not to be used. */
int modbus_map_load(const struct files *files, const char *path,
                    struct modbus_map *map, char message[YAML_MESSAGE_MAX]);

#endif
