/* firmware/linux/base/interrupt.c - see interrupt.h. */
#include "firmware/linux/base/interrupt.h"

#include <stddef.h>
#include <time.h>

#include "firmware/host/base/array.h"

static volatile sig_atomic_t interrupt_count;
static int64_t interrupt_last_ns; /* the handler's; signals wait for another */

static int64_t interrupt_now_ns(void)
{
    struct timespec now = { 0 };
    (void)clock_gettime(CLOCK_MONOTONIC, &now);
    return now.tv_sec * INT64_C(1000000000) + now.tv_nsec;
}

/* From the last one that counts on, not from the last one: whoever hammers at the
 * keys must come to the second. */
static void interrupt_on_press(int number)
{
    const int64_t now_ns = interrupt_now_ns();
    (void)number;
    if (interrupt_count > 0 && now_ns - interrupt_last_ns < INTERRUPT_BOUNCE_NS)
        return;
    interrupt_last_ns = now_ns;
    interrupt_count++;
}

void interrupt_end(void)
{
    if (interrupt_count > 0)
        return;
    interrupt_last_ns = interrupt_now_ns();
    interrupt_count = 1;
}

static void interrupt_on_end(int number)
{
    (void)number;
    interrupt_end();
}

static void interrupt_on_quit(int number)
{
    interrupt_on_press(number);
    if (interrupt_count < 2)
        interrupt_count = 2;
}

/* The signals that mean stop, and who handled them before. */
static const struct {
    int number;
    void (*handler)(int number);
} interrupt_signal[] = {
    { SIGINT, interrupt_on_press }, { SIGTSTP, interrupt_on_press },
    { SIGTERM, interrupt_on_end },  { SIGHUP, interrupt_on_end },
    { SIGQUIT, interrupt_on_quit },
};
#define INTERRUPT_SIGNALS ARRAY_LEN(interrupt_signal)
static struct sigaction interrupt_before[INTERRUPT_SIGNALS];

const volatile sig_atomic_t *interrupt_listen(void)
{
    struct sigaction action = { .sa_flags = 0 };
    interrupt_count = 0;
    sigemptyset(&action.sa_mask);
    for (size_t i = 0; i < INTERRUPT_SIGNALS; i++)
        sigaddset(&action.sa_mask, interrupt_signal[i].number);
    for (size_t i = 0; i < INTERRUPT_SIGNALS; i++) {
        action.sa_handler = interrupt_signal[i].handler;
        sigaction(interrupt_signal[i].number, &action, &interrupt_before[i]);
    }
    return &interrupt_count;
}

void interrupt_listen_no_more(void)
{
    for (size_t i = 0; i < INTERRUPT_SIGNALS; i++)
        sigaction(interrupt_signal[i].number, &interrupt_before[i], NULL);
}

void interrupt_mask(sigset_t *before)
{
    sigset_t all;
    sigfillset(&all);
    (void)pthread_sigmask(SIG_SETMASK, &all, before);
}

void interrupt_unmask(const sigset_t *before)
{
    (void)pthread_sigmask(SIG_SETMASK, before, NULL);
}
