/* firmware/host/rig/sim/rig_sim_motor.c - what the motor of a simulated axis can, and
 * the loops that its drive has: see sim/physics/winding.h and loops.h. */
#include "firmware/host/rig/rig_parts.h"

#define MOTOR_RATE_MAX 1000 /* stall over no_load_speed, 1/s */
#define LOOPS_SAMPLED  1e8  /* Hz ns: a tenth of a period */

static int motor_refuse_board(const struct rig_reader *self,
                              const struct yaml_value *value)
{
    if (rig_kinds[self->axis->kind]->samples)
        return yaml_value_refuse(value, "is not for an axis of a board");
    return 0;
}

/* ---- motor ---- */

static int motor_read_time(void *reader, const struct yaml_value *value,
                           void *out)
{
    return rig_read_time(reader, value, 100 * RIG_MS, 100000000 * RIG_MS,
                         RIG_MS, out);
}

static int motor_read_warning(void *reader, const struct yaml_value *value,
                              void *out)
{
    return rig_read_share(reader, value, 0.1, 1, out);
}

static const struct yaml_field rig_sim_motor_fields[] = {
    { "stall", YAML_OPTIONAL,
      "the acceleration that the whole voltage makes at rest",
      rig_read_acceleration, offsetof(struct rig_sim_motor, stall_q32) },
    { "no_load_speed", YAML_OPTIONAL,
      "the speed whose back-EMF is the whole voltage", rig_read_velocity,
      offsetof(struct rig_sim_motor, no_load_q32) },
    { "rated", YAML_OPTIONAL, "the acceleration that the rated current makes",
      rig_read_acceleration, offsetof(struct rig_sim_motor, rated_q32) },
    { "thermal_time", YAML_OPTIONAL,
      "its thermal time constant, 100 ms .. 100000 s in whole ms",
      motor_read_time, offsetof(struct rig_sim_motor, thermal_ns) },
    { "warning", YAML_OPTIONAL, "a part of the rated heat, 0.1 .. 1",
      motor_read_warning, offsetof(struct rig_sim_motor, warm_load) },
};
const struct yaml_shape rig_sim_motor_shape = {
    "motor", rig_sim_motor_fields, ARRAY_LEN(rig_sim_motor_fields)
};

int rig_read_sim_motor(void *reader, const struct yaml_value *value, void *out)
{
    struct rig_sim_motor *const motor = out;

    if (motor_refuse_board(reader, value) < 0)
        return -1;
    *motor = (struct rig_sim_motor){ .given = true, .warm_load = 0.9 };
    if (yaml_fields_read(value, &rig_sim_motor_shape, reader, motor) < 0)
        return -1;
    if ((motor->stall_q32 == 0) != (motor->no_load_q32 == 0))
        return yaml_value_refuse(value, "has one of stall and no_load_speed");
    if ((motor->rated_q32 == 0) != (motor->thermal_ns == 0))
        return yaml_value_refuse(value, "has one of rated and thermal_time");
    if (motor->stall_q32 == 0 && motor->rated_q32 == 0)
        return yaml_value_refuse(value, "has neither stall nor rated");
    if (motor->stall_q32 / MOTOR_RATE_MAX > motor->no_load_q32)
        return yaml_value_refuse(value,
                                 "has a stall above no_load_speed in 1 ms");
    return 0;
}

/* ---- loops ---- */

static int loops_read_position(void *reader, const struct yaml_value *value,
                               void *out)
{
    return rig_read_frequency(reader, value, 0.1, 200, out);
}

static int loops_read_velocity(void *reader, const struct yaml_value *value,
                               void *out)
{
    return rig_read_frequency(reader, value, 1, 1000, out);
}

static int loops_read_current(void *reader, const struct yaml_value *value,
                              void *out)
{
    return rig_read_frequency(reader, value, 10, 5000, out);
}

static int loops_read_reset(void *reader, const struct yaml_value *value,
                            void *out)
{
    struct rig_sim_loops *const loops = out;

    if (rig_read_time(reader, value, 0, 10000 * RIG_MS, RIG_US,
                      &loops->reset_ns) < 0)
        return -1;
    if (loops->reset_ns > 0 && loops->reset_ns < RIG_MS)
        return yaml_value_refuse(value, "is below 1 ms");
    return 0;
}

static int loops_read_period(void *reader, const struct yaml_value *value,
                             void *out)
{
    return rig_read_time(reader, value, 20 * RIG_US, 20 * RIG_MS, 1, out);
}

static const struct yaml_field rig_sim_loops_fields[] = {
    { "position", YAML_REQUIRED, "0.1 Hz .. 200 Hz, where its gain is 1",
      loops_read_position, offsetof(struct rig_sim_loops, position_hz) },
    { "velocity", YAML_REQUIRED, "1 Hz .. 1 kHz, where its gain is 1",
      loops_read_velocity, offsetof(struct rig_sim_loops, velocity_hz) },
    { "current", YAML_OPTIONAL, "10 Hz .. 5 kHz, where its gain is 1",
      loops_read_current, offsetof(struct rig_sim_loops, current_hz) },
    { "reset_time", YAML_OPTIONAL, "1 ms .. 10 s, or 0: no integral",
      loops_read_reset, 0 },
    { "position_period", YAML_OPTIONAL, "20 us .. 20 ms", loops_read_period,
      offsetof(struct rig_sim_loops, position_ns) },
    { "velocity_period", YAML_OPTIONAL, "20 us .. 20 ms", loops_read_period,
      offsetof(struct rig_sim_loops, velocity_ns) },
    { "current_period", YAML_OPTIONAL, "20 us .. 20 ms", loops_read_period,
      offsetof(struct rig_sim_loops, current_ns) },
};
const struct yaml_shape rig_sim_loops_shape = {
    "loops", rig_sim_loops_fields, ARRAY_LEN(rig_sim_loops_fields)
};

static bool loops_is_slow(double hz, int64_t period_ns)
{
    return hz * (double)period_ns > LOOPS_SAMPLED;
}

int rig_read_sim_loops(void *reader, const struct yaml_value *value, void *out)
{
    struct rig_sim_loops *const loops = out;

    if (motor_refuse_board(reader, value) < 0)
        return -1;
    *loops = (struct rig_sim_loops){ .given = true,
                                     .current_hz = 1000,
                                     .reset_ns = 20 * RIG_MS,
                                     .position_ns = RIG_MS,
                                     .velocity_ns = 250 * RIG_US,
                                     .current_ns = 62500 };
    if (yaml_fields_read(value, &rig_sim_loops_shape, reader, loops) < 0)
        return -1;
    if (loops->velocity_hz < loops->position_hz)
        return yaml_value_refuse(value, "has velocity below position");
    if (loops->current_hz < loops->velocity_hz)
        return yaml_value_refuse(value, "has current below velocity");
    if (loops->position_ns % loops->velocity_ns != 0)
        return yaml_value_refuse(
            value,
            "has a position_period that is no multiple of velocity_period");
    if (loops->velocity_ns % loops->current_ns != 0)
        return yaml_value_refuse(
            value,
            "has a velocity_period that is no multiple of current_period");
    if (loops_is_slow(loops->position_hz, loops->position_ns))
        return yaml_value_refuse(
            value, "has a position_period above a tenth of 1 / position");
    if (loops_is_slow(loops->velocity_hz, loops->velocity_ns))
        return yaml_value_refuse(
            value, "has a velocity_period above a tenth of 1 / velocity");
    return 0;
}
