/* sim/device/odrive/motion.c - set points, trajectory and the inner loop
 * of the simulated ODrive. */
#include "sim/device/odrive/parts.h"

#include <stdlib.h>

#include "sim/device/trapezoid.h"
#include "sim/util.h"

#define ODRIVE_S INT64_C(1000000000)

void odrive_motion_begin(struct sim_odrive *self)
{
    sim_servo_advance(&self->base);
    self->demand_q24 = self->base.plant.pos_q24;
    self->demand_vel_q24 = self->base.plant.vel_q24;
    self->traj_done = true;
}

/* The trajectory that Set_Traj_Vel_Limit and Set_Traj_Accel_Limits shape. */
static void odrive_motion_trapezoid(struct sim_odrive *self, int64_t dt_ns)
{
    const struct sim_trapezoid shape = { .vel_max = self->traj_vel,
                                         .acc = self->traj_acc,
                                         .dec = self->traj_dec };
    double pos = (double)self->demand_q24 / ODRIVE_TURN_Q24;
    double vel = (double)self->demand_vel_q24 / ODRIVE_TURN_Q24;

    self->traj_done =
        sim_trapezoid_step(&shape, (double)self->input_q24 / ODRIVE_TURN_Q24,
                           (double)dt_ns / (double)ODRIVE_S, &pos, &vel);
    self->demand_q24 = odrive_q24(pos);
    self->demand_vel_q24 = odrive_q24(vel);
}

/* Less than a thousandth of a turn away. */
#define ODRIVE_THERE_Q24 (ODRIVE_ONE_Q24 * SIM_ODRIVE_COUNTS / 1000)

/* To its end stop, slowly, until the rotor is there. */
static void odrive_motion_home(struct sim_odrive *self, int64_t dt_ns)
{
    const int64_t home_q24 = self->config.home_counts * ODRIVE_ONE_Q24;
    const int64_t vel_q24 = self->config.plant.vel_max_counts_s
                            << 20; /* a sixteenth */
    const int64_t distance_q24 =
        sim_plant_travel_q24(&self->base.plant, vel_q24, dt_ns);
    const int64_t left_q24 = home_q24 - self->demand_q24;

    if (left_q24 < -distance_q24) {
        self->demand_q24 -= distance_q24;
        self->demand_vel_q24 = -vel_q24;
    } else if (left_q24 > distance_q24) {
        self->demand_q24 += distance_q24;
        self->demand_vel_q24 = vel_q24;
    } else {
        self->demand_q24 = home_q24;
        self->demand_vel_q24 = 0;
        if (llabs(self->base.plant.pos_q24 - home_q24) < ODRIVE_THERE_Q24 &&
            llabs(self->base.plant.vel_q24) < vel_q24)
            odrive_motion_homed(self);
    }
}

/* ---- one inner step ---- */

static void odrive_motion_demand(struct sim_odrive *self, int64_t dt_ns)
{
    if (self->axis_state == SIM_ODRIVE_HOMING) {
        odrive_motion_home(self, dt_ns);
    } else if (self->control_mode == SIM_ODRIVE_CONTROL_VELOCITY) {
        self->demand_vel_q24 = self->input_vel_q24;
        self->demand_q24 +=
            sim_plant_travel_q24(&self->base.plant, self->input_vel_q24, dt_ns);
    } else if (self->input_mode == SIM_ODRIVE_TRAPEZOIDAL) {
        if (self->traj_new)
            self->traj_done = false;
        self->traj_new = false;
        if (!self->traj_done)
            odrive_motion_trapezoid(self, dt_ns);
    } else {
        self->demand_q24 = self->input_q24;
        self->demand_vel_q24 = self->input_vel_q24;
    }
}

void odrive_motion_step(struct sim_servo *base, int64_t dt_ns)
{
    struct sim_odrive *self = CONTAINER_OF(base, struct sim_odrive, base);
    const bool torque = self->axis_state == SIM_ODRIVE_CLOSED_LOOP ||
                        self->axis_state == SIM_ODRIVE_HOMING;

    if (torque)
        odrive_motion_demand(self, dt_ns);
    sim_servo_push(base, self->axis_state == SIM_ODRIVE_CLOSED_LOOP &&
                                 self->input_mode == SIM_ODRIVE_PASSTHROUGH
                             ? (double)self->torque / self->config.torque_nm
                             : 0);
    sim_servo_turn(base, torque, self->demand_q24, self->demand_vel_q24, dt_ns);
}
