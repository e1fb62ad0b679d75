/* sim/device/modbus/servo.c - see servo.h. */
#include "sim/device/modbus/servo.h"

#include <string.h>

#include "motion/core/fixed.h"
#include "sim/device/modbus/parts.h"
#include "sim/util.h"

#define LOOP_NS      INT64_C(500000)
#define LOOPS_PER_S  2000
#define STEEP        100                 /* full speed in 10 ms */
#define STANDING_Q24 (INT64_C(20) << 24) /* counts/s */
#define ARRIVED_Q24  (INT64_C(8) << 24)  /* counts */

/* ---- what it says ---- */

bool sim_modbus_servo_moves(const struct sim_modbus_servo *self)
{
    return self->demand_q16 != self->target_q16 ||
           self->plant.vel_q24 > STANDING_Q24 ||
           self->plant.vel_q24 < -STANDING_Q24;
}

bool sim_modbus_servo_arrived(const struct sim_modbus_servo *self)
{
    const int64_t off = self->target_q16 * 256 - self->plant.pos_q24;

    return !sim_modbus_servo_moves(self) && off < ARRIVED_Q24 &&
           off > -ARRIVED_Q24;
}

int64_t sim_modbus_servo_reported(const struct sim_modbus_servo *self)
{
    const int64_t seen_q24 = sim_plant_measured_q24(&self->plant);

    return self->frozen ? self->frozen_counts
                        : ((seen_q24 + (1 << 23)) >> 24) + self->jump_counts;
}

/* ---- what it does ---- */

void sim_modbus_servo_stand(struct sim_modbus_servo *self)
{
    self->demand_q16 = self->plant.pos_q24 >> 8;
    self->target_q16 = self->demand_q16;
    self->vel_q16 = 0;
    self->armed = self->streaming = false;
}

void sim_modbus_servo_torque_off(struct sim_modbus_servo *self)
{
    self->enabled = self->enabling = false;
    sim_modbus_servo_stand(self);
}

void sim_modbus_servo_enable(struct sim_modbus_servo *self)
{
    if (self->fault || self->enabled)
        return;
    self->enabling = true;
    self->enabled_ns = self->world->now_ns + self->config.enable_ns;
}

/* At the ramp it has, from where it is. */
void sim_modbus_servo_stop(struct sim_modbus_servo *self)
{
    const sim_i128 square = (sim_i128)self->vel_q16 * self->vel_q16;
    const int64_t distance_q16 =
        (int64_t)(square / ((sim_i128)2 * self->dec) >> 16);

    self->target_q16 =
        self->demand_q16 + (self->vel_q16 < 0 ? -distance_q16 : distance_q16);
    self->armed = self->streaming = false;
}

void sim_modbus_servo_go_to(struct sim_modbus_servo *self, int64_t counts,
                            int64_t speed, int64_t acc, int64_t dec)
{
    if (!self->enabled)
        return;
    self->target_q16 = counts * 65536;
    self->speed_q16 = speed * 65536;
    self->acc = acc > 0 ? acc : 1;
    self->dec = dec > 0 ? dec : 1;
    self->targets++;
}

/* Its home is where it stands: it counts from 0 there. */
void sim_modbus_servo_home(struct sim_modbus_servo *self)
{
    self->homed = self->enabled;
    if (!self->enabled)
        return;
    self->plant.pos_q24 = 0;
    sim_modbus_servo_stand(self);
}

/* ---- motion ---- */

static int64_t servo_min(int64_t a, int64_t b)
{
    return a < b ? a : b;
}

/* The speed from which it can still stop at the target. */
static int64_t servo_stop_speed_q16(const struct sim_modbus_servo *self,
                                    int64_t distance_q16)
{
    const struct motion_u128 square = motion_fixed_shl_u128(
        motion_fixed_mul_u64((uint64_t)distance_q16, 2 * (uint64_t)self->dec),
        16);

    return (int64_t)motion_fixed_isqrt_u128(square);
}

static void servo_profile(struct sim_modbus_servo *self)
{
    const int64_t distance_q16 = self->target_q16 - self->demand_q16;
    const int64_t far_q16 = distance_q16 < 0 ? -distance_q16 : distance_q16;
    const int64_t up = (self->acc << 16) / LOOPS_PER_S;
    const int64_t down = (self->dec << 16) / LOOPS_PER_S;
    int64_t want =
        servo_min(self->speed_q16, servo_stop_speed_q16(self, far_q16));
    int64_t change, step;

    if (distance_q16 < 0)
        want = -want;
    change = want - self->vel_q16;
    step = (self->vel_q16 < 0) == (change < 0) ? up : down;
    if (change > step)
        change = step;
    if (change < -step)
        change = -step;
    self->vel_q16 += change;
    step = self->vel_q16 / LOOPS_PER_S;
    if (far_q16 <= (step < 0 ? -step : step) +
                       servo_min(down / LOOPS_PER_S + 1, 65536) &&
        self->vel_q16 <= 2 * down && self->vel_q16 >= -2 * down) {
        self->demand_q16 = self->target_q16;
        self->vel_q16 = 0;
    } else {
        self->demand_q16 += step;
    }
}

static void servo_release(struct sim_modbus_servo *self, int64_t now_ns)
{
    if (!self->enabling || now_ns < self->enabled_ns)
        return;
    self->enabling = false;
    self->enabled = true;
    sim_modbus_servo_stand(self);
}

static void servo_run(struct sim_member *member, int64_t now_ns)
{
    struct sim_modbus_servo *self =
        CONTAINER_OF(member, struct sim_modbus_servo, member);

    self->due_ns = now_ns + LOOP_NS;
    servo_release(self, now_ns);
    if (self->behaviour->loop != NULL)
        self->behaviour->loop(self, now_ns);
    if (self->enabled)
        servo_profile(self);
    if (self->blocked && self->enabled && self->plant.winding.given)
        sim_plant_press(&self->plant, self->demand_q16 * 256,
                        self->vel_q16 * 256, LOOP_NS);
    else if (self->blocked)
        sim_plant_block(&self->plant);
    else if (self->enabled)
        sim_plant_step(&self->plant, self->demand_q16 * 256,
                       self->vel_q16 * 256, LOOP_NS);
    else
        sim_plant_coast(&self->plant, LOOP_NS);
    if (self->plant.winding.hot && self->enabled && !self->fault)
        sim_modbus_servo_inject(self, SIM_MODBUS_SERVO_ALARM);
}

static int64_t servo_due_ns(const struct sim_member *member)
{
    return CONTAINER_OF_CONST(member, struct sim_modbus_servo, member)->due_ns;
}

static const struct sim_member_ops servo_member_ops = {
    .due_ns = servo_due_ns,
    .run = servo_run,
};

int64_t sim_modbus_servo_counts(const struct sim_modbus_servo *self)
{
    return (self->plant.pos_q24 + (1 << 23)) >> 24;
}

void sim_modbus_servo_inject(struct sim_modbus_servo *self,
                             enum sim_modbus_servo_fault fault)
{
    switch (fault) {
    case SIM_MODBUS_SERVO_ALARM:
        self->fault = true;
        if (self->behaviour->fault != NULL)
            self->behaviour->fault(self);
        else
            sim_modbus_servo_torque_off(self);
        break;
    case SIM_MODBUS_SERVO_BLOCKED:
        self->blocked = true;
        break;
    case SIM_MODBUS_SERVO_OFF:
        sim_modbus_servo_torque_off(self);
        self->faulty.from.fault = SIM_MODBUS_MUTE;
        self->faulty.from.times = 0;
        break;
    case SIM_MODBUS_SERVO_FROZEN:
        self->frozen_counts = sim_modbus_servo_counts(self) + self->jump_counts;
        self->frozen = true;
        break;
    case SIM_MODBUS_SERVO_CLEAR:
        self->jump_counts = 0;
        sim_modbus_servo_end(self, SIM_MODBUS_SERVO_BLOCKED);
        sim_modbus_servo_end(self, SIM_MODBUS_SERVO_FROZEN);
        sim_modbus_servo_end(self, SIM_MODBUS_SERVO_OFF);
        break;
    }
}

void sim_modbus_servo_end(struct sim_modbus_servo *self,
                          enum sim_modbus_servo_fault fault)
{
    if (fault == SIM_MODBUS_SERVO_BLOCKED)
        self->blocked = false;
    if (fault == SIM_MODBUS_SERVO_FROZEN)
        self->frozen = false;
    if (fault == SIM_MODBUS_SERVO_OFF)
        self->faulty.from.fault = SIM_MODBUS_GOOD;
}

static int servo_sit(struct sim_modbus_servo *self,
                     struct sim_modbus_line *line)
{
    int err;

    sim_modbus_faulty_init(&self->faulty, &self->rtu.station,
                           UINT64_C(88172645463325252) + self->config.unit);
    if (line == NULL)
        return MOTION_OK;
    self->faulty.time = &line->time;
    err = modbus_rtu_slave_init(&self->rtu, &self->slave, self->config.unit,
                                &self->config.line, self->config.turnaround_ns);
    if (err < 0)
        return err;
    return sim_modbus_seat_init(&self->seat, line, &self->faulty.station);
}

int sim_modbus_servo_init(struct sim_modbus_servo *self,
                          struct sim_world *world, struct sim_modbus_line *line,
                          const struct sim_modbus_servo_config *config)
{
    int err;

    memset(self, 0, sizeof *self);
    self->config = *config;
    self->world = world;
    self->member.ops = &servo_member_ops;
    self->behaviour = config->maker == NULL
                          ? &sim_modbus_mapped
                          : sim_modbus_maker_behaviour(config->maker);
    self->slave.ops = self->behaviour->slave;
    if (config->maker != NULL)
        self->slave.functions = sim_modbus_maker_functions(config->maker);
    self->due_ns = world->now_ns + LOOP_NS;
    self->speed_q16 = config->plant.vel_max_counts_s * 65536;
    /* as the makers ship it: steeper than the motor */
    self->acc = self->dec = STEEP * config->plant.vel_max_counts_s;
    err = sim_plant_init(&self->plant, &config->plant, config->start_counts);
    if (err < 0)
        return err;
    sim_modbus_servo_stand(self);
    self->behaviour->set_up(self);
    err = servo_sit(self, line);
    return err < 0 ? err : sim_world_add(world, &self->member);
}
