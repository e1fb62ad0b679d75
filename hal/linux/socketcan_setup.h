/* hal/linux/socketcan_setup.h - private to can_*socketcan.c: making the
 * socket. */
#ifndef HAL_LINUX_SOCKETCAN_SETUP_H
#define HAL_LINUX_SOCKETCAN_SETUP_H

#include "hal/linux/socketcan.h"

extern const struct hal_can_ops can_socketcan_ops;

/* A socket on the interface of that index, with everything that the config
 * asks for; -1 with errno. */
int can_socketcan_socket(const struct can_socketcan *self, unsigned index);

#endif
