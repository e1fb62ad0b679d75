/* firmware/mcu/board/cortex_m.c - start-up, tick and time of a Cortex-M4.
 * Source: Arm, ARMv7-M Architecture Reference Manual, B3.2 to B3.4. */
#include "firmware/mcu/board/cortex_m.h"

#include "firmware/mcu/board/board.h"

#define SYST_CSR       REGISTER(0xE000E010)
#define SYST_RVR       REGISTER(0xE000E014)
#define SYST_CVR       REGISTER(0xE000E018)
#define NVIC_ISER(n)   REGISTER(0xE000E100 + 4 * (n))
#define NVIC_IPR(irq)  (*(volatile uint8_t *)(0xE000E400 + (irq)))
#define SCB_ICSR       REGISTER(0xE000ED04)
#define SCB_AIRCR      REGISTER(0xE000ED0C)
#define SCB_SHPR3      REGISTER(0xE000ED20)
#define ICSR_PENDSTSET (1u << 26)
#define AIRCR_RESET    0x05FA0004u
#define STACK_PAINT    0x5AC7B10Bu

/* From the linker's script. */
extern uint32_t image_stack_top[], image_stack_end[], image_data_start[],
    image_data_end[], image_data_load[], image_bss_start[], image_bss_end[];

static volatile int64_t cortex_tick_ns;        /* time of the last tick */
static uint32_t cortex_ns_q24;                 /* 2^24 ns per cycle */
static uint32_t cortex_cycles, cortex_ppb_q32; /* of a tick; and 1e-9 of them */
/* What the counter began the present tick with, and will begin the next. */
static volatile uint32_t cortex_from, cortex_next;
static int64_t cortex_rest_q32; /* cycles that are owed */

/* --- start-up ------------------------------------------------------------- */

__attribute__((noinline)) static void board_paint(void)
{
    const uint32_t *const here = (const uint32_t *)__builtin_frame_address(0);

    for (uint32_t *at = image_stack_end; at < here - 16; at++)
        *at = STACK_PAINT;
}

uint32_t board_stack_free(void)
{
    const uint32_t *at = image_stack_end;

    while (at < image_stack_top && *at == STACK_PAINT)
        at++;
    return (uint32_t)(at - image_stack_end);
}

/* The counter gives the tick, and by its value the time between two. */
static void cortex_start_tick(uint32_t cycles_s)
{
    const uint32_t cycles = cycles_s / BOARD_TICKS_S;

    cortex_ns_q24 = (uint32_t)(((uint64_t)BOARD_PERIOD_NS << 24) / cycles);
    cortex_cycles = cycles;
    cortex_ppb_q32 =
        (uint32_t)(((uint64_t)cycles << 32) / UINT64_C(1000000000));
    cortex_from = cortex_next = cycles - 1;
    SCB_SHPR3 = (uint32_t)BOARD_IRQ_TICK << 24;
    SYST_RVR = cycles - 1;
    SYST_CVR = 0;
    SYST_CSR = 7;
}

void board_reset(void)
{
    const uint32_t *from = image_data_load;

    for (uint32_t *to = image_data_start; to < image_data_end; to++)
        *to = *from++;
    for (uint32_t *to = image_bss_start; to < image_bss_end; to++)
        *to = 0;
    board_paint();
    cortex_start_tick(board_init());
    main();
    board_fault_isr();
}

/* Drives stop by their own watchdogs, and nothing begins anew by itself: after
 * the reset all is off. */
void board_fault_isr(void)
{
    SCB_AIRCR = AIRCR_RESET;
    for (;;) {
    }
}

__attribute__((section(".vectors"), used)) static const struct {
    const void *stack;
    void (*handler[15])(void);
} cortex_vectors = {
    .stack = image_stack_top,
    .handler = { board_reset, board_nmi_isr, board_fault_isr, board_fault_isr,
                 board_fault_isr, board_fault_isr, [10] = board_fault_isr,
                 [13] = board_fault_isr, [14] = board_systick_isr },
};

/* --- tick and time -------------------------------------------------------- */

void board_systick_isr(void)
{
    cortex_tick_ns = cortex_tick_ns + BOARD_PERIOD_NS;
    cortex_from = cortex_next;
    board_tick_isr(cortex_tick_ns);
}

/* The counter takes what is written when it has run down.  Whole cycles, and
 * what is left over with those of the next tick. */
void board_steer(int32_t ppb)
{
    const int64_t all_q32 = cortex_rest_q32 + (int64_t)ppb * cortex_ppb_q32;
    const int32_t whole = (int32_t)(all_q32 >> 32);

    cortex_rest_q32 = (int64_t)(uint32_t)all_q32;
    cortex_next = cortex_cycles - 1 - (uint32_t)whole;
    SYST_RVR = cortex_next;
}

/* The counter runs down from one tick to the next; one that is due and has not
 * been counted yet, because this is called where it cannot come, is added. */
int64_t board_now_ns(void)
{
    int64_t tick_ns, since_ns;
    uint32_t cycles, due;

    do {
        tick_ns = cortex_tick_ns;
        due = SCB_ICSR & ICSR_PENDSTSET;
        cycles = (due != 0 ? cortex_next : cortex_from) - SYST_CVR;
    } while (tick_ns != cortex_tick_ns || due != (SCB_ICSR & ICSR_PENDSTSET));
    since_ns = (int64_t)((uint64_t)cycles * cortex_ns_q24 >> 24);
    if (since_ns >= BOARD_PERIOD_NS)
        since_ns = BOARD_PERIOD_NS - 1; /* a longer tick: time goes on by one */
    return tick_ns + (due != 0 ? BOARD_PERIOD_NS : 0) + since_ns;
}

void board_hold(void)
{
    __asm__ volatile("msr basepri, %0" : : "r"(BOARD_IRQ_TICK) : "memory");
}

void board_release(void)
{
    __asm__ volatile("msr basepri, %0" : : "r"(0) : "memory");
}

void board_wait(void)
{
    __asm__ volatile("wfi" : : : "memory");
}

void board_enable_irq(unsigned irq)
{
    NVIC_IPR(irq) = BOARD_IRQ_SERIAL;
    NVIC_ISER(irq / 32) = 1u << irq % 32;
}
