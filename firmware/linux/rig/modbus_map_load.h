/* firmware/linux/rig/modbus_map_load.h - a drive's register map from a YAML
 * file (docs/MODBUS.md describes it). */
#ifndef FIRMWARE_LINUX_RIG_MODBUS_MAP_LOAD_H
#define FIRMWARE_LINUX_RIG_MODBUS_MAP_LOAD_H

#include "firmware/linux/rig/rig.h"
#include "hal/modbus_map.h"

#define MODBUS_MAP_PATH_MAX 512

/* 0, or -1 with one sentence in message; *map is then not to be used. */
int modbus_map_load(const char *path, struct modbus_map *map,
                    char message[RIG_MESSAGE_MAX]);

/* Where the map `name` is: a path when it ends in .yaml, else NAME.yaml in one
 * of slew's own (hal/maps); relative paths count from the directory of the file
 * `beside`.  0, or -1: no such file. */
int modbus_map_find(const char *name, const char *beside,
                    char path[MODBUS_MAP_PATH_MAX]);

#endif
