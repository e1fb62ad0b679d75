/* firmware/linux/base/interrupt.h - the operator's Ctrl-C, counted.
 *
 * Signals that mean stop only count; the loop looks at every tick: one stops
 * within the limits, two at once.
 *
 *   SIGINT, SIGTSTP     Ctrl-C, Ctrl-Z: one more.  What follows one that counts
 *                       within INTERRUPT_BOUNCE_NS is the same press
 *   SIGTERM, SIGHUP     one, however often: the system goes down, the terminal
 *                       was closed
 *   SIGQUIT             Ctrl-\: two at once, then one more
 *
 * Nothing else ends a program that listens, but SIGKILL and its own faults. */
#ifndef FIRMWARE_LINUX_BASE_INTERRUPT_H
#define FIRMWARE_LINUX_BASE_INTERRUPT_H

#include <signal.h>
#include <stdint.h>

#define INTERRUPT_BOUNCE_NS INT64_C(250000000)

/* From 0.  What is returned is the count. */
const volatile sig_atomic_t *interrupt_listen(void);
/* As before. */
void interrupt_listen_no_more(void);
/* As SIGTERM. */
void interrupt_end(void);

/* Signals are the main thread's: this thread sees none, nor those that it
 * starts.  `before`: what interrupt_unmask sets again; NULL: nothing will. */
void interrupt_mask(sigset_t *before);
void interrupt_unmask(const sigset_t *before);

#endif
