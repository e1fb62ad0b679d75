/* hal/can/bits.h - how long a CAN frame is on the wire. */
#ifndef HAL_CAN_BITS_H
#define HAL_CAN_BITS_H

#include "hal/can.h"

/* Bits of a frame on the wire, stuffing and the 3 bits of intermission
 * included: those of the bus's bit rate, and those of an FD frame's data.
 * Source: ISO 11898-1, 10.4. */
struct can_bits {
    unsigned slow, fast;
};
struct can_bits can_bits_of(const struct hal_can_frame *frame);

#endif
