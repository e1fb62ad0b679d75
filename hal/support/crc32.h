/* hal/support/crc32.h - the checksum of files: CRC-32 of IEEE 802.3
 * (polynomial 0x04C11DB7, reflected, all ones before and inverted after). */
#ifndef HAL_SUPPORT_CRC32_H
#define HAL_SUPPORT_CRC32_H

#include <stddef.h>
#include <stdint.h>

/* Of `size` bytes; `before` is the checksum of those before them, 0 when there
 * are none. */
uint32_t crc32_of(uint32_t before, const void *bytes, size_t size);

#endif
