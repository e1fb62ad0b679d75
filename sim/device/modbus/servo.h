/* sim/device/modbus/servo.h - a simulated servo drive on Modbus.
 *
 * Its registers are those of a maker's drive, each written beside what the
 * maker's manual says of it (makers.h), or they are made from the map file of
 * its driver (mapped.c).
 *
 * Inside: a trapezoid from where it is to the target it was given last, at the
 * speed and ramps that came with it (or as it was set up: steeper than its
 * motor, which is what streaming needs), and the plant of plant.h behind it.  A
 * new target takes over at once. */
#ifndef SIM_DEVICE_MODBUS_SERVO_H
#define SIM_DEVICE_MODBUS_SERVO_H

#include "hal/modbus/map.h"
#include "hal/modbus/rtu_slave.h"
#include "sim/bus/modbus.h"
#include "sim/device/readings.h"
#include "sim/physics/plant.h"

struct sim_modbus_maker;
struct sim_modbus_behaviour;

/* CiA 402 in registers. */
enum sim_modbus_power {
    SIM_MODBUS_SWITCH_ON_DISABLED,
    SIM_MODBUS_READY_TO_SWITCH_ON,
    SIM_MODBUS_SWITCHED_ON,
    SIM_MODBUS_OPERATION_ENABLED,
    SIM_MODBUS_QUICK_STOP_ACTIVE,
    SIM_MODBUS_FAULT_REACTION,
    SIM_MODBUS_FAULT,
};

struct sim_modbus_servo_config {
    const struct sim_modbus_maker *maker; /* NULL: made from the map */
    const struct modbus_map *map; /* outlives the servo; NULL: a maker's */
    uint8_t unit;
    struct modbus_rtu_line line; /* baud 0: not on an RTU line */
    int64_t turnaround_ns;
    struct sim_plant_config plant;
    int32_t start_counts;
    int64_t enable_ns; /* until the brake is open */
};

enum sim_modbus_servo_fault {
    SIM_MODBUS_SERVO_ALARM,   /* the map's first alarm, torque off */
    SIM_MODBUS_SERVO_BLOCKED, /* the rotor does not move */
    SIM_MODBUS_SERVO_OFF,     /* no power: nothing is heard or said */
    SIM_MODBUS_SERVO_FROZEN,  /* reports one actual position for ever */
    SIM_MODBUS_SERVO_CLEAR,   /* every lasting one ends */
};

struct sim_modbus_servo {
    struct sim_member member;
    struct modbus_slave slave;
    struct modbus_rtu_slave rtu;
    struct sim_modbus_faulty
        faulty; /* in front of rtu, or of a server on TCP */
    struct sim_modbus_seat seat;
    struct sim_world *world;
    struct sim_modbus_servo_config config;
    struct sim_plant plant;
    struct sim_readings readings; /* its owner moves them off */

    /* Private from here on. */
    const struct sim_modbus_behaviour *behaviour;
    uint16_t reg[65536];
    uint16_t bit[65536]; /* coils and inputs, one each */
    uint8_t known[65536 / 8];
    uint8_t progress[MODBUS_SEQUENCE_COUNT]; /* writes seen, in order */
    int64_t due_ns;
    bool enabled, enabling, fault, homed, blocked, off, frozen;
    int64_t frozen_counts;
    int64_t jump_counts; /* what its encoder reports too much */
    uint32_t alarm;      /* that it is in; 0: the map's first */
    bool streaming;      /* stream_begin was seen */
    int64_t enabled_ns, heard_ns;
    /* the profile; counts with 16 fraction bits */
    bool armed; /* a target waits for its go */
    int64_t armed_q16, target_q16;
    int64_t speed_q16, acc, dec; /* counts/s, counts/s2 */
    int64_t demand_q16, vel_q16;
    uint64_t targets; /* taken */
    /* of a maker's drive */
    unsigned path;    /* that was started last */
    bool follows;     /* what is written into that path takes over */
    bool stop_input;  /* while it is on nothing starts */
    uint32_t control; /* as written last: for its edges */
    enum sim_modbus_power power;
    int64_t deadline_ns; /* of a set point that must come; 0: none */
};

/* MOTION_E_ARG.  With a line, the servo sits on it; without
 * (NULL), only &self->slave answers. */
int sim_modbus_servo_init(struct sim_modbus_servo *self,
                          struct sim_world *world, struct sim_modbus_line *line,
                          const struct sim_modbus_servo_config *config);
void sim_modbus_servo_inject(struct sim_modbus_servo *self,
                             enum sim_modbus_servo_fault fault);
/* The end of one that lasts. */
void sim_modbus_servo_end(struct sim_modbus_servo *self,
                          enum sim_modbus_servo_fault fault);
/* What an outside measuring device would see, counts. */
int64_t sim_modbus_servo_counts(const struct sim_modbus_servo *self);

#endif
