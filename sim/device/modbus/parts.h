/* sim/device/modbus/parts.h - what a simulated Modbus servo does whatever its
 * registers are, for those who give it registers: mapped.c and the makers'.
 *
 * Positions in counts, speeds in counts/s, ramps in counts/s2. */
#ifndef SIM_DEVICE_MODBUS_PARTS_H
#define SIM_DEVICE_MODBUS_PARTS_H

#include "sim/device/modbus/servo.h"

struct sim_modbus_behaviour {
    const struct modbus_slave_ops *slave;
    void (*set_up)(struct sim_modbus_servo *self); /* registers at power-on */
    /* Before every step of the motion, 0.5 ms; NULL: nothing. */
    void (*loop)(struct sim_modbus_servo *self, int64_t now_ns);
    /* `fault` has been set; NULL: torque goes at once. */
    void (*fault)(struct sim_modbus_servo *self);
};

extern const struct sim_modbus_behaviour sim_modbus_mapped;
const struct sim_modbus_behaviour *
sim_modbus_maker_behaviour(const struct sim_modbus_maker *maker);
uint32_t sim_modbus_maker_functions(const struct sim_modbus_maker *maker);

/* The brake opens, and then there is torque; not in a fault. */
void sim_modbus_servo_enable(struct sim_modbus_servo *self);
void sim_modbus_servo_torque_off(struct sim_modbus_servo *self);
/* The demand is where the rotor is. */
void sim_modbus_servo_stand(struct sim_modbus_servo *self);
/* At the ramp it has, from where it is. */
void sim_modbus_servo_stop(struct sim_modbus_servo *self);
/* Nothing without torque.  counts: +-2^46; the rest 0 .. 2^46. */
void sim_modbus_servo_go_to(struct sim_modbus_servo *self, int64_t counts,
                            int64_t speed, int64_t acc, int64_t dec);
/* Its home is where it stands: it counts from 0 there. */
void sim_modbus_servo_home(struct sim_modbus_servo *self);
bool sim_modbus_servo_moves(const struct sim_modbus_servo *self);
/* It stands at its target. */
bool sim_modbus_servo_arrived(const struct sim_modbus_servo *self);
/* Where its encoder says that it is. */
int64_t sim_modbus_servo_reported(const struct sim_modbus_servo *self);

#endif
