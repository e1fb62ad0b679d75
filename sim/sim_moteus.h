/* sim/sim_moteus.h - a moteus servo as it looks from its CAN FD port.
 *
 * Register sub-frames in all four types, several per frame: modes stopped,
 * fault, position, timeout; position, velocity and torque commands, watchdog,
 * limits of velocity and acceleration, trajectory complete, voltage,
 * temperature, fault code, identity, set output exact; errors for what it does not know.  Written from
 * mjbots' protocol pages, independently of hal/; floats are the compiler's.
 *
 * One turn is SIM_MOTEUS_COUNTS of the plant's counts. */
#ifndef SIM_SIM_MOTEUS_H
#define SIM_SIM_MOTEUS_H

#include <stdbool.h>
#include <stdint.h>

#include "sim/plant.h"
#include "sim/sim_can.h"

#define SIM_MOTEUS_COUNTS   65536
#define SIM_MOTEUS_COMMANDS 0x10 /* registers 0x020 .. 0x02F */

struct sim_moteus_config {
    uint8_t id; /* 1..127 */
    struct sim_plant_config plant;
    int32_t start_counts;
    int64_t loop_ns; /* 62500 .. 1000000; 0: 125 us */
    int64_t boot_ns; /* power-on until it answers */
};

enum sim_moteus_fault {
    SIM_MOTEUS_ENCODER,      /* fault 35; lasting */
    SIM_MOTEUS_DRIVER,       /* fault 33; stop clears it */
    SIM_MOTEUS_REBOOT,       /* stopped, silent for a while */
    SIM_MOTEUS_SILENT,       /* off the bus */
    SIM_MOTEUS_DEAF,         /* loses every frame; its watchdog runs out */
    SIM_MOTEUS_STUBBORN,     /* does not leave its mode when told to */
    SIM_MOTEUS_NOT_A_NUMBER, /* its position is NaN */
    SIM_MOTEUS_BLOCKED,      /* the rotor does not move */
    SIM_MOTEUS_CLEAR,        /* every lasting one ends */
    SIM_MOTEUS_FAULTS,
};

struct sim_moteus {
    struct sim_member member;
    struct sim_can_port port;
    struct sim_world *world;
    struct sim_moteus_config config;
    struct sim_plant plant;

    /* Private from here on. */
    int64_t due_ns, boot_ns, plant_ns;
    bool deaf, stubborn, nan, blocked, encoder_lost;
    uint8_t mode, fault;
    float command[SIM_MOTEUS_COMMANDS];
    double demand, demand_vel; /* turns, from where it was switched on */
    double zero;               /* its position 0 */
    bool complete;
    int64_t heard_ns; /* the last command */
    uint64_t commands;
};

/* Adds the servo to the bus and the world.  MOTION_E_ARG, also when the bus has
 * no FD; MOTION_E_FULL. */
int sim_moteus_init(struct sim_moteus *self, struct sim_can_bus *bus,
                    const struct sim_moteus_config *config);
void sim_moteus_inject(struct sim_moteus *self, enum sim_moteus_fault fault);
int64_t sim_moteus_pos_q24(const struct sim_moteus *self);

#endif
