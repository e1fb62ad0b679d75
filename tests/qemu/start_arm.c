/* tests/qemu/start_arm.c - vectors and start-up of a Cortex-M. */
#include "tests/qemu/start.h"

/* From arm.ld. */
extern uint32_t image_stack_top[], image_data_start[], image_data_end[],
    image_data_load[], image_bss_start[], image_bss_end[];

void start_reset(void);
void start_fault(void);

long start_host_call(long operation, const void *argument)
{
    register long r0 __asm__("r0") = operation;
    register const void *r1 __asm__("r1") = argument;

    __asm__ volatile("bkpt 0xab" : "+r"(r0) : "r"(r1) : "memory");
    return r0;
}

void start_reset(void)
{
    const uint32_t *from = image_data_load;

    for (uint32_t *to = image_data_start; to < image_data_end; to++)
        *to = *from++;
    for (uint32_t *to = image_bss_start; to < image_bss_end; to++)
        *to = 0;
    start_exit((uint32_t)main());
}

void start_fault(void)
{
    start_print("fault\n");
    start_exit(99);
}

/* Stack, reset, NMI, hard fault; every other exception ends in the last too,
 * since it is not enabled. */
__attribute__((section(".vectors"), used)) static const struct {
    const void *stack;
    void (*handler[15])(void);
} start_vectors = {
    .stack = image_stack_top,
    .handler = { start_reset, start_fault, start_fault, start_fault,
                 start_fault, start_fault },
};
