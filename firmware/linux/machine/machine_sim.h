/* firmware/linux/machine/machine_sim.h - simulated wires and servos for a rig.
 *
 * In virtual time the clock is the simulated world's: waiting runs it.  In real
 * time the world follows CLOCK_MONOTONIC: every wait runs it up to the time
 * that it has become. */
#ifndef FIRMWARE_LINUX_MACHINE_MACHINE_SIM_H
#define FIRMWARE_LINUX_MACHINE_MACHINE_SIM_H

#include "firmware/linux/machine/machine.h"
#include "hal/linux/clock.h"
#include "hal/modbus/master.h"
#include "sim/bus/can.h"
#include "sim/bus/gpio.h"
#include "sim/device/modbus/servo.h"
#include "sim/device/servo.h"
#include "sim/physics/mechanics.h"
#include "sim/physics/payload.h"
#include "sim/world.h"

struct machine_sim {
    struct memory_pool memory; /* of the arrays: one per bus, axis or line */
    struct sim_world world;
    struct sim_can_bus *wire;
    struct sim_can_port *port; /* of the master */
    void **servo; /* of each axis the simulated drive of its kind */
    /* on Modbus */
    struct sim_modbus_line *modbus_line;
    struct modbus_master *master;
    struct sim_modbus_seat *seat; /* of the master */
    /* Of each axis the servo on Modbus that others reach, where it is not the one
     * in `servo`; NULL: none is. */
    struct sim_modbus_servo **served;
    struct sim_modbus_line **served_line; /* of each bus, as `served` */
    struct sim_gpio *line;
    /* switches of the plant, machine_sim_switch.c */
    const struct rig *rig;
    struct sim_member switches;
    int64_t switches_due_ns;
    bool *pressed;
    bool *stuck; /* whatever presses it: machine_sim_stick */
    /* where an axis really is when its drive says 0: an axis that needs homing
     * is switched on with an encoder that counts from there */
    int64_t *zero_q32;
    struct sim_mechanics
        *mechanics;              /* one per axis; used where it has a load */
    struct sim_payload *payload; /* of the rig; machine_sim_payload.c */
    struct sim_member payloads;
    int64_t payloads_due_ns;
    uint64_t payload_failed;   /* steps that could not be computed */
    struct hal_clock follower; /* real time: waits, then runs the world */
    struct clock_linux real;
};

/* Fills in *ports.  The simulation is all zero, or was made before and is given
 * back.  On an error returns its code and writes a sentence.  machine_sim_free
 * in either case. */
int machine_sim_init(struct machine_sim *sim, const struct rig *rig,
                     bool realtime, struct machine_ports *ports,
                     char message[YAML_MESSAGE_MAX]);
void machine_sim_free(struct machine_sim *sim);

/* machine_sim_switch.c: what presses lines with `sim`; where the drive of an
 * axis says that it is. */
int machine_sim_switches(struct machine_sim *sim);
/* Input line i is at that level from now on, until it is let go. */
void machine_sim_stick(struct machine_sim *sim, unsigned i,
                       enum sim_gpio_level level);
void machine_sim_let_go(struct machine_sim *sim, unsigned i);
/* Of an axis that is not virtual, as are those below. */
int64_t machine_sim_pos_q32(const struct machine_sim *sim, unsigned i);

/* machine_sim_modbus.c: line and master of a bus. */
int machine_sim_modbus_line(struct machine_sim *sim, const struct rig *rig,
                            unsigned i);
/* The line of Modbus bus i. */
struct sim_modbus_line *machine_sim_modbus_wire(const struct machine_sim *sim,
                                                unsigned i);
/* The servo of Modbus axis i. */
struct sim_modbus_servo *machine_sim_modbus_servo(const struct machine_sim *sim,
                                                  unsigned i);
/* Whose drive Modbus axis i is simulated as: what its rig says, else the maker's
 * whose name the map's file has; NULL: it is made from the map. */
const struct sim_modbus_maker *machine_sim_maker(const struct rig *rig,
                                                 unsigned i);
/* What the simulated servo of Modbus axis i is like. */
int machine_sim_servo_config(const struct rig *rig, unsigned i,
                             struct sim_modbus_servo_config *config);
/* What the simulated plant of an axis is like, and where it stands. */
int machine_sim_plant(const struct rig_axis *axis,
                      struct sim_plant_config *plant, int32_t *start_counts);
/* machine_sim_load.c: in counts, what the rig says of its load, without stops, and
 * of its motor. */
void machine_sim_load_config(const struct rig_axis *axis,
                             struct sim_mechanics_config *config);
void machine_sim_winding_config(const struct rig_axis *axis,
                                struct sim_winding_config *config);
void machine_sim_loops_config(const struct rig_axis *axis,
                              struct sim_loops_config *config);
/* Its encoder, and what it turns, at the place where it
 * stays; number: of the axis in its rig; mechanics: NULL without a load.  loads:
 * of all axes of a simulation; *axis is the one that an error is about. */
int machine_sim_attach(const struct rig_axis *axis, unsigned number,
                       struct sim_plant *plant,
                       struct sim_mechanics *mechanics);
int machine_sim_loads(struct machine_sim *sim, unsigned *axis);
/* Of an axis that has a load: how far that is ahead of the motor, and how far it
 * would swing if the motor stood from now on. */
struct sim_plant *machine_sim_plant_of(struct machine_sim *sim, unsigned i);
int64_t machine_sim_twist_q32(struct machine_sim *sim, unsigned i);
int64_t machine_sim_swing_q32(struct machine_sim *sim, unsigned i);
/* machine_sim_payload.c: what the rig's axes carry, from where they stand on;
 * *axis is the one that an error is about. */
int machine_sim_payloads(struct machine_sim *sim, unsigned *axis);
void machine_sim_payload_config(const struct rig_payload *from,
                                struct sim_payload_config *config);
/* In whole counts. */
int machine_sim_counts(const struct rig_axis *axis, int64_t value_q32,
                       int64_t *counts);
/* A place along the axis in the counts that the drive has when it is switched
 * on. */
int machine_sim_place(const struct rig_axis *axis, int64_t pos_q32,
                      int32_t *counts);

#endif
