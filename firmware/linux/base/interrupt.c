/* firmware/linux/base/interrupt.c - see interrupt.h. */
#include "firmware/linux/base/interrupt.h"

#include <stddef.h>

#include "firmware/linux/base/array.h"

static volatile sig_atomic_t interrupt_count;

static void interrupt_on_signal(int number)
{
    (void)number;
    if (interrupt_count < 2)
        interrupt_count = interrupt_count + 1;
}

/* The signals that mean stop, and who handled them before. */
static const int interrupt_signal[] = { SIGINT, SIGTERM, SIGHUP };
#define INTERRUPT_SIGNALS ARRAY_LEN(interrupt_signal)
static struct sigaction interrupt_before[INTERRUPT_SIGNALS];

const volatile sig_atomic_t *interrupt_listen(void)
{
    struct sigaction action = { .sa_handler = interrupt_on_signal };
    interrupt_count = 0;
    sigemptyset(&action.sa_mask);
    for (size_t i = 0; i < INTERRUPT_SIGNALS; i++)
        sigaction(interrupt_signal[i], &action, &interrupt_before[i]);
    return &interrupt_count;
}

void interrupt_listen_no_more(void)
{
    for (size_t i = 0; i < INTERRUPT_SIGNALS; i++)
        sigaction(interrupt_signal[i], &interrupt_before[i], NULL);
}
