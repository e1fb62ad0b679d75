/* sim/device/servo.h - what the simulated servos on a CAN bus are made of: a
 * port, a place in the world, a motor that is integrated up to now, and what
 * may happen to any of them.
 *
 * A device embeds one as `base` and brings what is its own: when it is due,
 * what it does with a frame, and one step of its inner loop. */
#ifndef SIM_DEVICE_SERVO_H
#define SIM_DEVICE_SERVO_H

#include <stdbool.h>
#include <stdint.h>

#include "sim/bus/can.h"
#include "sim/device/readings.h"
#include "sim/physics/plant.h"

enum sim_servo_fault {
    SIM_SERVO_ENCODER, /* loses its encoder; lasting */
    SIM_SERVO_TRIP,    /* its power stage switches off, once */
    SIM_SERVO_REBOOT,  /* all volatile gone; silent for a while, then off */
    SIM_SERVO_SILENT,  /* off the bus */
    SIM_SERVO_DEAF,    /* loses every frame; its watchdog may run out */
    SIM_SERVO_IGNORES_STATE, /* takes no order to change its state */
    SIM_SERVO_NOT_A_NUMBER,  /* says that its position is NaN */
    SIM_SERVO_BLOCKED,       /* the rotor does not move */
    SIM_SERVO_FROZEN,        /* reports one actual position for ever */
    SIM_SERVO_REVERSED,      /* a motor phase exchanged: it runs away */
    SIM_SERVO_POWER,         /* it has none: silent, no torque; rebooted by the
                                end of it */
    SIM_SERVO_CLEAR,         /* every lasting one ends */
    SIM_SERVO_FAULTS,
};

enum sim_servo_heat { SIM_SERVO_COOL, SIM_SERVO_WARM, SIM_SERVO_HOT };

struct sim_servo;

/* The last five may be NULL: such a thing does not happen to it, and it has no
 * heartbeat. */
struct sim_servo_ops {
    struct sim_member_ops member;
    /* Not called while it boots or is deaf. */
    void (*on_frame)(struct sim_servo *self, const struct hal_can_frame *frame);
    /* dt_ns of its inner loop, sim_servo_turn among it. */
    void (*step)(struct sim_servo *self, int64_t dt_ns);
    void (*lose_encoder)(struct sim_servo *self); /* encoder_lost is set */
    /* With this code of its own, 0: of an over-current. */
    void (*trip)(struct sim_servo *self, uint32_t code);
    void (*reboot)(struct sim_servo *self);
    /* By its I2t model its motor is warm, or not any more, or too hot: once, in a
     * step, and again when there is torque again. */
    void (*heat)(struct sim_servo *self, enum sim_servo_heat heat);
    uint32_t (*heartbeat_id)(const struct sim_servo *self); /* of the frames */
};

struct sim_servo {
    struct sim_member member;
    struct sim_can_port port;
    struct sim_world *world;
    struct sim_plant plant;
    struct sim_readings readings; /* its owner moves them off */

    /* Private to the devices from here on. */
    const struct sim_servo_ops *ops;
    int64_t loop_ns;
    int64_t plant_ns; /* up to where the plant has been integrated */
    int64_t boot_ns;  /* hears nothing before */
    bool deaf, ignores_state, nan, blocked, encoder_lost, frozen, unpowered;
    uint8_t heat; /* that has been told */
    int64_t frozen_q24;
    int64_t jump_q24; /* what its encoder reports too much */
};

/* Clears it and adds it to the bus and the world, standing at start_counts.
 * loop_ns: 62500 .. 1000000; 0: 125 us.  MOTION_E_ARG; nothing
 * has been added to the world then. */
int sim_servo_init(struct sim_servo *self, struct sim_can_bus *bus,
                   const struct sim_servo_ops *ops,
                   const struct sim_plant_config *plant, int64_t start_counts,
                   int64_t loop_ns);

/* Steps until the plant is at the world's now. */
void sim_servo_advance(struct sim_servo *self);
/* Of a step: the rotor goes to the demand under torque, coasts without, and
 * stands when something holds it.  q24: counts, counts/s.  The step counts as
 * taken then, so whatever looks at the plant after it may. */
void sim_servo_turn(struct sim_servo *self, bool torque, int64_t demand_q24,
                    int64_t demand_vel_q24, int64_t dt_ns);
/* Feed-forward from now on, a share of the torque at the current limit; +-16 at
 * most, and none where it is not a number. */
void sim_servo_push(struct sim_servo *self, double share);
/* As applied in the last step, a share of that at the current limit. */
double sim_servo_torque(const struct sim_servo *self);
/* Hears nothing for so long. */
void sim_servo_boot(struct sim_servo *self, int64_t boot_ns);

void sim_servo_inject(struct sim_servo *self, enum sim_servo_fault fault);
/* The end of one that lasts. */
void sim_servo_end(struct sim_servo *self, enum sim_servo_fault fault);
/* SIM_SERVO_TRIP with a code of the drive's own. */
void sim_servo_trip(struct sim_servo *self, uint32_t code);
/* Its encoder is off by so many counts more from now on. */
void sim_servo_jump(struct sim_servo *self, int64_t counts);
/* Friction in its bearings from now on, 0 .. 2^40 counts/s2; 0: as built. */
void sim_servo_rub(struct sim_servo *self, int64_t counts_s2);
/* Where it says that it is; the inner loop has the rotor's own place. */
int64_t sim_servo_reported_q24(const struct sim_servo *self);
/* What an outside measuring device would see, at the last inner step. */
int64_t sim_servo_pos_q24(const struct sim_servo *self);

#endif
