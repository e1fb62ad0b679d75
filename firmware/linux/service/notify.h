/* firmware/linux/service/notify.h - words to the service manager (sd_notify(3),
 * "Standalone Implementations"): one datagram to $NOTIFY_SOCKET each.  Without
 * one nothing is done. */
#ifndef FIRMWARE_LINUX_SERVICE_NOTIFY_H
#define FIRMWARE_LINUX_SERVICE_NOTIFY_H

#include <stdint.h>

/* "READY=1", "WATCHDOG=1" ... */
void service_notify(const char *words);
/* How often WATCHDOG=1 is expected, from $WATCHDOG_USEC; 0: not. */
int64_t service_notify_watchdog_ns(void);

#endif
