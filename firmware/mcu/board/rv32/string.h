/* firmware/mcu/board/rv32/string.h - for a compiler that comes without a C
 * library: what bytes.c has. */
#ifndef FIRMWARE_MCU_BOARD_RV32_STRING_H
#define FIRMWARE_MCU_BOARD_RV32_STRING_H

#include <stddef.h>

void *memcpy(void *to, const void *from, size_t size);
void *memmove(void *to, const void *from, size_t size);
void *memset(void *to, int value, size_t size);
int memcmp(const void *left, const void *right, size_t size);
size_t strlen(const char *text);

#endif
