/* tests/sim/device/cia402/digital_inputs.h - wires to the digital inputs of a simulated
 * CiA 402 drive. */
#ifndef TESTS_SIM_DEVICE_CIA402_DIGITAL_INPUTS_H
#define TESTS_SIM_DEVICE_CIA402_DIGITAL_INPUTS_H

#include "sim/device/cia402/parts.h"

/* Digital inputs as 0x60FD shows them, beside the rail's: bit 0 negative limit,
 * 1 positive limit, 2 home, 16-31 maker; 16 is the touch probe. */
static inline void digital_inputs_set(struct sim_cia402 *self, uint32_t inputs)
{
    sim_servo_advance(&self->base);
    self->inputs = inputs;
    cia402_inputs_watch(self);
}

#endif
