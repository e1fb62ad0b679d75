/* tests/support/kind/drives.h - the driver and the simulated drive of an axis, for
 * tests that look into them; the type is that of the axis's kind. */
#ifndef TESTS_SUPPORT_KIND_DRIVES_H
#define TESTS_SUPPORT_KIND_DRIVES_H

#include "firmware/linux/machine/machine_sim.h"

#define SERVO_OF(type, sim, axis)      ((struct type *)(sim)->servo[axis])
#define DRIVER_OF(type, machine, axis) ((struct type *)(machine)->drive[axis])

#endif
