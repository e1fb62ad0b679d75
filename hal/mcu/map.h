/* hal/mcu/map.h - a register map (hal/modbus/map.h) as a row of values, so
 * that it can be sent in pieces.
 *
 * Names, title and alarm texts are left out: a board has nobody to read them.
 * The order of the values is that of mcu_map_section in map.c; docs/MCU.md has
 * it. */
#ifndef HAL_MCU_MAP_H
#define HAL_MCU_MAP_H

#include "hal/modbus/map.h"

#define MCU_MAP_VALUES 1090

/* index below MCU_MAP_VALUES. */
int64_t mcu_map_get(const struct modbus_map *map, unsigned index);
/* false, and nothing changed: its place cannot have such a value. */
bool mcu_map_set(struct modbus_map *map, unsigned index, int64_t value);
/* CRC-32 of all values, 8 bytes each, the lowest first. */
uint32_t mcu_map_crc(const struct modbus_map *map);
/* Could the loader of a PC have made it?  Every index in it has its place,
 * every request may be sent. */
bool mcu_map_is_sound(const struct modbus_map *map);

#endif
