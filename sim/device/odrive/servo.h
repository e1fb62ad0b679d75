/* sim/device/odrive/servo.h - an ODrive axis as it looks from its CAN port.
 *
 * CANSimple of firmware 0.5.6 or 0.6: heartbeat and encoder estimates by
 * themselves and on remote frames, axis states, controller and input modes,
 * trapezoidal trajectory, limits, errors of axis and parts, e-stop, watchdog,
 * and for 0.6 version, errors with the reason of disarming, and two parameters
 * by RxSdo and TxSdo.  Written from ODrive's documentation, independently of
 * hal/; floats are the compiler's.
 *
 * One turn is SIM_ODRIVE_COUNTS of the plant's counts.
 *
 * Its torque is that of the loop, and of feed-forward.  Temperatures and supply
 * are as sim/device/readings.h has them, powers never change.
 *
 * What was chosen here: it has the states idle, closed loop and homing; any
 * other is refused with "invalid state".  Homing goes to its end stop at a
 * sixteenth of its top speed, and is there at position 0. */
#ifndef SIM_DEVICE_ODRIVE_SERVO_H
#define SIM_DEVICE_ODRIVE_SERVO_H

#include <stdbool.h>
#include <stdint.h>

#include "sim/device/servo.h"

#define SIM_ODRIVE_COUNTS 65536

struct sim_odrive_config {
    uint8_t node; /* 0..62 */
    bool is_05;   /* firmware 0.5.6; else 0.6 */
    struct sim_plant_config plant;
    int32_t start_counts;   /* its position when it is switched on, */
    int32_t home_counts;    /* and of its end stop, counted so */
    int64_t loop_ns;        /* as sim/device/servo.h */
    int64_t heartbeat_ns;   /* 0: 100 ms */
    int64_t estimates_ns;   /* 0: 10 ms; below 0: only when asked */
    int64_t boot_ns;        /* power-on to the first heartbeat */
    double torque_nm;       /* at its current limit; 0: 1 Nm */
    double torque_constant; /* Nm per A; 0: 0.4 */
    /* 0.6: where the two parameters are */
    uint16_t enable_watchdog, watchdog_timeout;
};

struct sim_odrive {
    struct sim_servo base;
    struct sim_odrive_config config;

    /* Private from here on. */
    int64_t loop_due_ns, heartbeat_due_ns, estimates_due_ns;

    uint8_t axis_state, result;
    uint32_t error, reason;
    uint8_t parts; /* 0.5: bit 0 motor, 1 encoder, 2 controller */
    uint32_t control_mode, input_mode;

    /* counts, 24 fraction bits, from where it was switched on */
    int64_t zero_q24; /* its position 0 */
    int64_t input_q24, input_vel_q24;
    int64_t demand_q24, demand_vel_q24; /* of the trajectory */
    float torque;                       /* feed-forward, Nm */
    float traj_vel, traj_acc, traj_dec; /* turns */
    bool traj_new, traj_done;

    bool watchdog_on;
    float watchdog_s;
    int64_t fed_ns;
    uint64_t orders; /* frames that told it something */
};

/* Adds the drive to the bus and the world.  MOTION_E_ARG. */
int sim_odrive_init(struct sim_odrive *self, struct sim_can_bus *bus,
                    const struct sim_odrive_config *config);

#endif
