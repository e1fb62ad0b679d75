/* tests/qemu/start_riscv.c - start-up of an RV32 or RV64. */
#include "tests/qemu/start.h"

/* From riscv.ld; words, because the ends are on 8 bytes. */
extern uint32_t image_bss_start[], image_bss_end[];

void start_main(void);

/* The three instructions are the mark by which the debugger recognises the call. */
long start_host_call(long operation, const void *argument)
{
    register long a0 __asm__("a0") = operation;
    register const void *a1 __asm__("a1") = argument;

    __asm__ volatile(".balign 16\n"
                     ".option push\n"
                     ".option norvc\n"
                     "slli zero, zero, 0x1f\n"
                     "ebreak\n"
                     "srai zero, zero, 7\n"
                     ".option pop\n"
                     : "+r"(a0)
                     : "r"(a1)
                     : "memory");
    return a0;
}

void start_main(void)
{
    for (uint32_t *to = image_bss_start; to < image_bss_end; to++)
        *to = 0;
    start_exit((uint32_t)main());
}

__asm__(".section .text.start, \"ax\"\n"
        ".globl image_start\n"
        "image_start:\n"
        ".option push\n"
        ".option norelax\n"
        "la gp, __global_pointer$\n"
        ".option pop\n"
        "la sp, image_stack_top\n"
        "j start_main\n"
        ".text\n");
