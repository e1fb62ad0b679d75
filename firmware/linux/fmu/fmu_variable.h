/* firmware/linux/fmu/fmu_variable.h - the variables of a functional mock-up unit
 * that is made of a rig: what its description lists and its functions take.
 *
 * A value reference is FMU_TIME, FMU_ENABLE, or that of an axis and what of it:
 * FMU_AXIS_FIRST + axis * FMU_AXIS_STRIDE + enum fmu_of_axis.  Source: FMI 2.0.4
 * and 3.0.1, fmi-standard.org. */
#ifndef FIRMWARE_LINUX_FMU_FMU_VARIABLE_H
#define FIRMWARE_LINUX_FMU_FMU_VARIABLE_H

#include <stdbool.h>
#include <stdint.h>

#include "firmware/host/rig/rig.h"

#define FMU_TIME        0
#define FMU_ENABLE      1
#define FMU_AXIS_FIRST  16
#define FMU_AXIS_STRIDE 16

enum fmu_causality { FMU_PARAMETER, FMU_INPUT, FMU_OUTPUT };
enum fmu_unit { /* the axis's, and per s so many times */
                FMU_UNIT_POSITION,
                FMU_UNIT_VELOCITY,
                FMU_UNIT_ACCELERATION,
                FMU_UNIT_RATE, /* rad/s */
                FMU_UNIT_NONE, /* a number */
                FMU_UNIT_BOOLEAN
};

/* X(NAME, name after the axis's, causality, unit, description) */
#define FMU_AXIS_LIST(X)                                                       \
    X(DEMAND_POSITION, "demand.position", INPUT, POSITION,                     \
      "set point at the time of a communication point")                        \
    X(DEMAND_VELOCITY, "demand.velocity", INPUT, VELOCITY,                     \
      "its velocity: carries the set point on until the next one")             \
    X(DEMAND_ACCELERATION, "demand.acceleration", INPUT, ACCELERATION,         \
      "its acceleration, likewise")                                            \
    X(ACTUAL_POSITION, "actual.position", OUTPUT, POSITION,                    \
      "position that the drive reports")                                       \
    X(ACTUAL_VELOCITY, "actual.velocity", OUTPUT, VELOCITY,                    \
      "velocity that the drive reports")                                       \
    X(PLANT_POSITION, "plant.position", OUTPUT, POSITION,                      \
      "position of the motor, as a device beside it would measure it")         \
    X(ENABLED, "enabled", OUTPUT, BOOLEAN, "the drive follows set points")     \
    X(FAULT, "fault", OUTPUT, BOOLEAN, "the drive is in fault, or lost")       \
    X(START_POSITION, "start.position", PARAMETER, POSITION,                   \
      "position in which the simulation begins")                               \
    X(BANDWIDTH, "servo.bandwidth", PARAMETER, RATE,                           \
      "bandwidth of the position loop")                                        \
    X(DAMPING, "servo.damping", PARAMETER, NONE, "damping of the position loop")

enum fmu_of_axis {
#define FMU_AXIS_ENUM(name, text, causality, unit, description) FMU_##name,
    FMU_AXIS_LIST(FMU_AXIS_ENUM)
#undef FMU_AXIS_ENUM
        FMU_AXIS_VARIABLES
};

struct fmu_variable {
    const char *name; /* after the axis's */
    const char *description;
    enum fmu_causality causality;
    enum fmu_unit unit;
};
extern const struct fmu_variable fmu_of_axis[FMU_AXIS_VARIABLES];

static inline uint32_t fmu_reference(unsigned axis, enum fmu_of_axis of)
{
    return FMU_AXIS_FIRST + axis * FMU_AXIS_STRIDE + (uint32_t)of;
}

/* Which of the rig's axes, and what of it.  false: there is none. */
bool fmu_find(const struct rig *rig, uint32_t reference, unsigned *axis,
              enum fmu_of_axis *of);

#endif
