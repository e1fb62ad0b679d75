/* tests/bench/counter.h - instructions of a call, on the processor itself.
 *
 * QEMU with -icount advances its clock by a fixed time per instruction, so
 * SysTick (Cortex-M) or minstret (RISC-V) counts instructions.  bench_start
 * once; then what bench_count gives for bench_empty is the cost of counting.
 * SysTick has 24 bits and runs at 25 MHz: with -icount shift=6 up to 10 million
 * instructions to the last one, with shift=0 up to 600 million to the next
 * 40. */
#ifndef TESTS_BENCH_COUNTER_H
#define TESTS_BENCH_COUNTER_H

#include <stdint.h>

#ifdef __riscv

static inline void bench_start(void)
{
}

static inline uint32_t bench_now(void)
{
    uint32_t now;
    __asm__ volatile(".option push\n"
                     ".option arch, +zicsr\n"
                     "csrr %0, minstret\n"
                     ".option pop\n"
                     : "=r"(now));
    return now;
}

static inline uint32_t bench_since(uint32_t start)
{
    return bench_now() - start;
}

#else

#define BENCH_REGISTER(address) (*(volatile uint32_t *)(address))
#define BENCH_SYST_CSR          BENCH_REGISTER(0xE000E010)
#define BENCH_SYST_RVR          BENCH_REGISTER(0xE000E014)
#define BENCH_SYST_CVR          BENCH_REGISTER(0xE000E018)
#define BENCH_SYST_TOP          0xFFFFFFu

/* Two instructions a round, by whatever means the compiler would have. */
#define BENCH_ROUNDS            100000

static uint32_t bench_unit;

static inline uint32_t bench_now(void)
{
    return BENCH_SYST_TOP - BENCH_SYST_CVR;
}

static inline void bench_start(void)
{
    BENCH_SYST_RVR = BENCH_SYST_TOP;
    BENCH_SYST_CVR = 0;
    BENCH_SYST_CSR = 5; /* on, core clock, no interrupt */
    uint32_t left = BENCH_ROUNDS, start = bench_now();
    __asm__ volatile(".syntax unified\n1: subs %0, #1\n bne 1b" : "+l"(left));
    bench_unit = (bench_now() - start) & BENCH_SYST_TOP;
}

/* Ticks to instructions; the counter wraps at 2^24. */
static inline uint32_t bench_since(uint32_t start)
{
    uint64_t ticks = (bench_now() - start) & BENCH_SYST_TOP;
    return (uint32_t)((ticks * 2 * BENCH_ROUNDS + bench_unit / 2) / bench_unit);
}

#endif

typedef void bench_function(void);

__attribute__((noinline)) static void bench_empty(void)
{
    __asm__ volatile("" : : : "memory");
}

static inline uint32_t bench_count(bench_function *volatile function)
{
    bench_function *const call = function;
    uint32_t start = bench_now();
    call();
    return bench_since(start);
}

#endif
