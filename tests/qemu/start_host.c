/* tests/qemu/start_host.c - start.h on a PC, to compare images with. */
#include <stdio.h>
#include <stdlib.h>

#include "tests/qemu/start.h"

long start_host_call(long operation, const void *argument)
{
    (void)argument;
    return operation;
}

void start_print(const char *text)
{
    fputs(text, stdout);
}

void start_print_u32(uint32_t value)
{
    printf("%lu", (unsigned long)value);
}

void start_print_hex(uint32_t value)
{
    printf("%08lx", (unsigned long)value);
}

_Noreturn void start_exit(uint32_t status)
{
    exit((int)status);
}
