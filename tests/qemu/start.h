/* tests/qemu/start.h - what a bare-metal test image gets from start_*.c: a
 * start-up that calls main, a way to print and a way to end.  The host that
 * runs the image in QEMU listens through semihosting. */
#ifndef TESTS_QEMU_START_H
#define TESTS_QEMU_START_H

#include <stdint.h>

int main(void);

void start_print(const char *text);
void start_print_u32(uint32_t value);
void start_print_hex(uint32_t value);
_Noreturn void start_exit(uint32_t status);

/* Semihosting: one call into the debugger.  Defined per processor. */
long start_host_call(long operation, const void *argument);

#endif
