/* sim/sim_odrive.h - an ODrive axis as it looks from its CAN port.
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
 * Of the supply, temperatures and powers it says what never changes.
 *
 * What this one chose: it knows the states idle, closed loop and homing; any
 * other is refused with "invalid state".  Homing goes to its end stop at a
 * sixteenth of its top speed, and is there at position 0. */
#ifndef SIM_SIM_ODRIVE_H
#define SIM_SIM_ODRIVE_H

#include <stdbool.h>
#include <stdint.h>

#include "sim/plant.h"
#include "sim/sim_can.h"

#define SIM_ODRIVE_COUNTS 65536

struct sim_odrive_config {
    uint8_t node; /* 0..62 */
    bool is_05;   /* firmware 0.5.6; else 0.6 */
    struct sim_plant_config plant;
    int32_t start_counts; /* its position when it is switched on, */
    int32_t home_counts;  /* and of its end stop, counted so */
    int64_t loop_ns;      /* 62500 .. 1000000 */
    int64_t heartbeat_ns; /* 0: 100 ms */
    int64_t estimates_ns; /* 0: 10 ms; below 0: only when asked */
    int64_t boot_ns;      /* power-on to the first heartbeat */
    /* 0.6: where the two parameters are */
    uint16_t enable_watchdog, watchdog_timeout;
};

enum sim_odrive_fault {
    SIM_ODRIVE_ENCODER,     /* loses its encoder */
    SIM_ODRIVE_OVERCURRENT, /* 0.5: the motor's error, the axis's stays 0 */
    SIM_ODRIVE_REBOOT,   /* errors, modes, watchdog gone; silent, then idle */
    SIM_ODRIVE_SILENT,   /* off the bus */
    SIM_ODRIVE_DEAF,     /* loses every frame; its watchdog may expire */
    SIM_ODRIVE_STUBBORN, /* takes no order to change its state */
    SIM_ODRIVE_NOT_A_NUMBER, /* its estimates are NaN */
    SIM_ODRIVE_BLOCKED,      /* the rotor does not move */
    SIM_ODRIVE_CLEAR,        /* every lasting one ends */
    SIM_ODRIVE_FAULTS,
};

struct sim_odrive {
    struct sim_member member;
    struct sim_can_port port;
    struct sim_world *world;
    struct sim_odrive_config config;
    struct sim_plant plant;

    /* Private from here on. */
    int64_t loop_due_ns, heartbeat_due_ns, estimates_due_ns;
    int64_t boot_ns;  /* hears nothing before */
    int64_t plant_ns; /* up to where the plant has been integrated */
    bool deaf, stubborn, nan, blocked, encoder_lost;

    uint8_t axis_state, result;
    uint32_t error, reason;
    uint8_t parts; /* 0.5: bit 0 motor, 1 encoder, 2 controller */
    uint32_t control_mode, input_mode;

    /* counts, 24 fraction bits, from where it was switched on */
    int64_t zero_q24; /* its position 0 */
    int64_t input_q24, input_vel_q24;
    int64_t demand_q24, demand_vel_q24; /* of the trajectory */
    float torque;
    float traj_vel, traj_acc, traj_dec; /* turns */
    bool traj_new, traj_done;

    bool watchdog_on;
    float watchdog_s;
    int64_t fed_ns;
    uint64_t orders; /* frames that told it something */
};

/* Adds the drive to the bus and the world.  MOTION_E_ARG, MOTION_E_FULL. */
int sim_odrive_init(struct sim_odrive *self, struct sim_can_bus *bus,
                    const struct sim_odrive_config *config);
void sim_odrive_inject(struct sim_odrive *self, enum sim_odrive_fault fault);
int64_t sim_odrive_pos_q24(const struct sim_odrive *self);

#endif
