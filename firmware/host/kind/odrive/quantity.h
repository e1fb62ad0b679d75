/* firmware/host/kind/odrive/quantity.h - what an ODrive says of itself: messages
 * of its CANSimple.
 *
 * Source: ODrive firmware 0.5.6 and ODrive documentation 0.6, "CANSimple
 * protocol". */
#ifndef FIRMWARE_HOST_KIND_ODRIVE_QUANTITY_H
#define FIRMWARE_HOST_KIND_ODRIVE_QUANTITY_H

#include "firmware/host/device/quantity.h"

/* What it has; is_05: of that firmware, and not 0.6. */
const struct quantity *quantity_of_odrive(bool is_05, unsigned *count);

#endif
