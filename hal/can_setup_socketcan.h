/* hal/can_setup_socketcan.h - private to can_*socketcan.c: making the socket. */
#ifndef HAL_CAN_SETUP_SOCKETCAN_H
#define HAL_CAN_SETUP_SOCKETCAN_H

#include "hal/can_socketcan.h"

extern const struct hal_can_ops can_socketcan_ops;

/* A socket on the interface of that index, with everything that the config
 * asks for; -1 with errno. */
int can_socketcan_socket(const struct can_socketcan *self, unsigned index);

#endif
