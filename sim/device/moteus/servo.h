/* sim/device/moteus/servo.h - a moteus servo as it looks from its CAN FD port.
 *
 * Register sub-frames in all four types, several per frame: modes stopped,
 * fault, position, timeout; position, velocity and torque commands, watchdog,
 * limits of velocity and acceleration, trajectory complete, voltage,
 * temperature, fault code, identity, set output exact; errors for what it does
 * not know.  Written from mjbots' protocol pages, independently of hal/; floats
 * are the compiler's.
 *
 * Its torque is that of the loop, and of feed-forward.
 *
 * One turn is SIM_MOTEUS_COUNTS of the plant's counts. */
#ifndef SIM_DEVICE_MOTEUS_SERVO_H
#define SIM_DEVICE_MOTEUS_SERVO_H

#include <stdbool.h>
#include <stdint.h>

#include "sim/device/servo.h"

#define SIM_MOTEUS_COUNTS   65536
#define SIM_MOTEUS_COMMANDS 0x10 /* registers 0x020 .. 0x02F */

struct sim_moteus_config {
    uint8_t id; /* 1..127 */
    struct sim_plant_config plant;
    int32_t start_counts;
    int64_t loop_ns;  /* as sim/device/servo.h */
    int64_t boot_ns;  /* power-on until it answers */
    double torque_nm; /* at its current limit; 0: 1 Nm */
};

struct sim_moteus {
    struct sim_servo base;
    struct sim_moteus_config config;

    /* Private from here on. */
    int64_t due_ns;
    uint8_t mode, fault;
    float command[SIM_MOTEUS_COMMANDS];
    double demand, demand_vel; /* turns, from where it was switched on */
    double zero;               /* its position 0 */
    bool complete;
    int64_t heard_ns; /* the last command */
    uint64_t commands;
};

/* Adds the servo to the bus and the world.  MOTION_E_ARG, also when the bus has
 * no FD. */
int sim_moteus_init(struct sim_moteus *self, struct sim_can_bus *bus,
                    const struct sim_moteus_config *config);

#endif
