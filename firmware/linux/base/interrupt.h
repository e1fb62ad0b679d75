/* firmware/linux/base/interrupt.h - the operator's Ctrl-C, counted.
 *
 * Signals that mean stop (SIGINT, SIGTERM, SIGHUP) only count, up to two; the
 * loop looks at every tick: one stops within the limits, two at once. */
#ifndef FIRMWARE_LINUX_BASE_INTERRUPT_H
#define FIRMWARE_LINUX_BASE_INTERRUPT_H

#include <signal.h>

/* From 0.  What is returned is the count. */
const volatile sig_atomic_t *interrupt_listen(void);
/* As before. */
void interrupt_listen_no_more(void);

#endif
