/* sim/identify/servo_model.h - a simulated servo and its load as a function of
 * their parameters: from the set points of a run to what its encoder would have
 * said.
 *
 * The plant is that of sim/physics/plant.h with mechanics.h on it, stepped as the
 * drives of this simulator step it: from set point to set point in a straight
 * line.  Between a set point and the answer to it is a delay, whole or not, that
 * stands for bus, drive and controller together. */
#ifndef SIM_IDENTIFY_SERVO_MODEL_H
#define SIM_IDENTIFY_SERVO_MODEL_H

#include <stdint.h>

#include "sim/physics/mechanics.h"
#include "sim/physics/plant.h"

enum sim_model_parameter {
    SIM_MODEL_BANDWIDTH,    /* of the position loop, Hz: 0.1 .. 200 */
    SIM_MODEL_LOOP_DAMPING, /* 0.1 .. 2; of a cascade its velocity loop, Hz,
                               and the one above its position loop: loops.h */
    SIM_MODEL_DELAY,        /* periods, 0 .. SIM_MODEL_DELAY_MAX */
    SIM_MODEL_RIGID,        /* so many has a motor alone; the others a load: */
    SIM_MODEL_INERTIA = SIM_MODEL_RIGID, /* load over motor, 0.01 .. 1000 */
    SIM_MODEL_FREQUENCY,                 /* the motor held, Hz: 0.1 .. 500 */
    SIM_MODEL_LOAD_DAMPING,              /* 0 .. 1 */
    SIM_MODEL_FRICTION,                  /* Coulomb, counts/s2, >= 0 */
    SIM_MODEL_VISCOUS,                   /* 1/s, 0 .. 1000 */
    SIM_MODEL_BACKLASH,                  /* counts, >= 0 */
    SIM_MODEL_PARAMETERS
};
#define SIM_MODEL_DELAY_MAX 20

/* A run of one axis: a row per period, from a stand on. */
struct sim_model_run {
    int64_t period_ns; /* 125 us .. 20 ms */
    int64_t loop_ns;   /* of the drive's inner loop, as sim/device/servo.h */
    uint32_t rows;
    const double *target;          /* counts, as they were sent, +-2^31 */
    const double *actual;          /* counts */
    struct sim_plant_config plant; /* what its motor can; its loop's two are not
                                      looked at */
    struct sim_mechanics_config load; /* what is no parameter: weight, static
                                         friction above Coulomb's, Stribeck's,
                                         transmission, second mass */
    bool has_loops; /* a cascade, whose current loop and integral are given */
    struct sim_loops_config loops;
    bool has_winding;
    struct sim_winding_config winding;
};

/* Where the encoder would have been in each row; with the first SIM_MODEL_RIGID
 * values alone when `loaded` is false.  `work`: rows doubles more.  MOTION_E_ARG
 * for a value outside its range, MOTION_E_RANGE when it cannot be computed. */
int sim_model_play(const struct sim_model_run *run, const double value[],
                   bool loaded, double *position, double *work);

#endif
