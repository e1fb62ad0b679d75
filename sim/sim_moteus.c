/* sim/sim_moteus.c - registers, modes, motion.  See sim_moteus.h. */
#include "sim/sim_moteus.h"

#include <math.h>
#include <string.h>

#include "sim/moteus_parts.h"
#include "sim/trapezoid.h"
#include "sim/util.h"

#define MOTEUS_LOOP_NS   INT64_C(125000)
#define MOTEUS_REBOOT_NS INT64_C(300000000)
#define MOTEUS_S         1e9
#define MOTEUS_TURN_Q24  (SIM_MOTEUS_COUNTS * 16777216.0)
/* As delivered: servo.default_timeout_s. */
#define MOTEUS_TIMEOUT_S 0.1f

static double moteus_turns(int64_t pos_q24)
{
    return (double)pos_q24 / MOTEUS_TURN_Q24;
}

static int64_t moteus_q24(double turns)
{
    return turns < 60000 && turns > -60000 ? (int64_t)(turns * MOTEUS_TURN_Q24)
                                           : 0;
}

/* ---- motion ---- */

static void moteus_advance(struct sim_moteus *self);

/* 0: as it is configured, which is not at all; also below 0. */
static double moteus_limit(float limit)
{
    return limit > 0 ? (double)limit : 1e6;
}

static bool moteus_has_ramps(const struct sim_moteus *self)
{
    return self->command[SIM_MOTEUS_COMMAND_VEL_LIMIT] > 0 ||
           self->command[SIM_MOTEUS_COMMAND_ACC_LIMIT] > 0;
}

static void moteus_step_demand(struct sim_moteus *self, double dt_s)
{
    const float *command = self->command;
    const double acc = moteus_limit(command[SIM_MOTEUS_COMMAND_ACC_LIMIT]);
    const struct sim_trapezoid shape = {
        .vel_max = moteus_limit(command[SIM_MOTEUS_COMMAND_VEL_LIMIT]),
        .acc = acc,
        .dec = acc,
    };
    const double to = (double)command[SIM_MOTEUS_COMMAND_POSITION] + self->zero;
    const double vel = (double)command[SIM_MOTEUS_COMMAND_VELOCITY];

    if (!moteus_has_ramps(self))
        self->demand += self->demand_vel * dt_s;
    else if (isnan(to))
        self->complete = sim_trapezoid_speed(&shape, vel, dt_s, &self->demand,
                                             &self->demand_vel);
    else
        self->complete = sim_trapezoid_step(&shape, to, dt_s, &self->demand,
                                            &self->demand_vel);
}

static void moteus_enter(struct sim_moteus *self, unsigned mode)
{
    moteus_advance(self);
    if (mode == SIM_MOTEUS_POSITION && self->mode != SIM_MOTEUS_POSITION) {
        self->demand = moteus_turns(self->plant.pos_q24);
        self->demand_vel = moteus_turns(self->plant.vel_q24);
    }
    self->mode = (uint8_t)mode;
}

static void moteus_trip(struct sim_moteus *self, unsigned fault)
{
    moteus_enter(self, SIM_MOTEUS_FAULT);
    self->fault = (uint8_t)fault;
}

static void moteus_step(struct sim_moteus *self, int64_t dt_ns)
{
    if (self->mode == SIM_MOTEUS_POSITION)
        moteus_step_demand(self, (double)dt_ns / MOTEUS_S);
    if (self->blocked)
        sim_plant_block(&self->plant);
    else if (self->mode == SIM_MOTEUS_POSITION)
        sim_plant_step(&self->plant, moteus_q24(self->demand),
                       moteus_q24(self->demand_vel), dt_ns);
    else
        sim_plant_coast(&self->plant, dt_ns);
    self->plant_ns += dt_ns;
}

static void moteus_advance(struct sim_moteus *self)
{
    while (self->plant_ns < self->world->now_ns) {
        int64_t dt_ns = self->world->now_ns - self->plant_ns;

        if (dt_ns > self->config.loop_ns)
            dt_ns = self->config.loop_ns;
        moteus_step(self, dt_ns);
    }
}

/* ---- registers ---- */

static double moteus_position(struct sim_moteus *self)
{
    moteus_advance(self);
    return self->nan ? (double)NAN
                     : moteus_turns(self->plant.pos_q24) - self->zero;
}

static double moteus_velocity(struct sim_moteus *self)
{
    moteus_advance(self);
    return moteus_turns(self->plant.vel_q24);
}

/* Model, firmware 0.3.4, version of the registers; serial number. */
static double moteus_identity(unsigned reg)
{
    static const uint32_t model[] = { 0x42, 0x000304, 5 };
    static const uint32_t serial[] = { 0x12345678, 0x9ABC, 0x0DEF };

    return reg < 0x110 ? model[reg - 0x100] : serial[reg - 0x120];
}

bool sim_moteus_read(struct sim_moteus *self, unsigned reg, double *value)
{
    if (reg == 0x000)
        *value = self->mode;
    else if (reg == 0x001)
        *value = moteus_position(self);
    else if (reg == 0x002)
        *value = moteus_velocity(self);
    else if (reg == 0x003)
        *value = (double)self->command[SIM_MOTEUS_COMMAND_TORQUE];
    else if (reg == 0x00B)
        *value = self->complete;
    else if (reg == 0x00D)
        *value = 24;
    else if (reg == 0x00E)
        *value = 31;
    else if (reg == 0x00F)
        *value = self->fault;
    else if (reg >= 0x020 && reg < 0x020 + SIM_MOTEUS_COMMANDS)
        *value = (double)self->command[reg - 0x020];
    else if (reg < 0x010)
        *value = 0;
    else if (reg == 0x110)
        *value = self->config.id;
    else if ((reg >= 0x100 && reg < 0x103) || (reg >= 0x120 && reg < 0x123))
        *value = moteus_identity(reg);
    else
        return false;
    return true;
}

static void moteus_fresh_command(struct sim_moteus *self)
{
    memset(self->command, 0, sizeof self->command);
    self->command[0x3] = self->command[0x4] = 1;
    self->command[0x5] = self->command[0x6] = NAN;
    self->command[SIM_MOTEUS_COMMAND_VEL_LIMIT] = NAN;
    self->command[SIM_MOTEUS_COMMAND_ACC_LIMIT] = NAN;
}

/* Mode 0 clears a fault whose cause is gone; no other mode ends one, or a
 * time-out. */
static void moteus_set_mode(struct sim_moteus *self, unsigned mode)
{
    const bool stuck =
        self->mode == SIM_MOTEUS_FAULT || self->mode == SIM_MOTEUS_TIMEOUT;

    moteus_fresh_command(self);
    if (self->stubborn || (mode != SIM_MOTEUS_STOPPED && stuck))
        return;
    if (mode == SIM_MOTEUS_STOPPED && self->encoder_lost) {
        moteus_trip(self, SIM_MOTEUS_FAULT_ENCODER);
    } else if (mode == SIM_MOTEUS_STOPPED || mode == SIM_MOTEUS_POSITION) {
        self->fault = 0;
        moteus_enter(self, mode);
    }
}

bool sim_moteus_write(struct sim_moteus *self, unsigned reg, double value)
{
    moteus_advance(self);
    if (reg == 0x000)
        moteus_set_mode(self, value >= 0 && value < 16 ? (unsigned)value : 0);
    else if (reg >= 0x020 && reg < 0x020 + SIM_MOTEUS_COMMANDS)
        self->command[reg - 0x020] = (float)value;
    else if (reg == 0x131)
        self->zero = moteus_turns(self->plant.pos_q24) - value;
    else
        return false;
    return true;
}

/* Without limits the command is in force at once. */
void sim_moteus_commanded(struct sim_moteus *self)
{
    const float pos = self->command[SIM_MOTEUS_COMMAND_POSITION];
    const float vel = self->command[SIM_MOTEUS_COMMAND_VELOCITY];

    self->heard_ns = self->world->now_ns;
    self->commands++;
    self->complete = false;
    if (moteus_has_ramps(self))
        return;
    if (!isnan(pos))
        self->demand = (double)pos + self->zero;
    self->demand_vel = isnan(vel) ? 0 : (double)vel;
    self->complete = true;
}

/* ---- time ---- */

static void moteus_watch(struct sim_moteus *self)
{
    float timeout_s = self->command[SIM_MOTEUS_COMMAND_TIMEOUT];

    if (timeout_s == 0)
        timeout_s = MOTEUS_TIMEOUT_S;
    if (self->mode == SIM_MOTEUS_POSITION &&
        (double)(self->world->now_ns - self->heard_ns) >
            (double)timeout_s * MOTEUS_S)
        moteus_enter(self, SIM_MOTEUS_TIMEOUT);
}

static int64_t moteus_due_ns(const struct sim_member *member)
{
    return CONTAINER_OF_CONST(member, struct sim_moteus, member)->due_ns;
}

static void moteus_run(struct sim_member *member, int64_t now_ns)
{
    struct sim_moteus *self = CONTAINER_OF(member, struct sim_moteus, member);

    self->due_ns = now_ns + self->config.loop_ns;
    moteus_advance(self);
    moteus_watch(self);
}

static const struct sim_member_ops moteus_member_ops = {
    .due_ns = moteus_due_ns,
    .run = moteus_run,
};

/* ---- injections ---- */

static void moteus_power_on(struct sim_moteus *self, int64_t boot_ns)
{
    moteus_advance(self);
    self->boot_ns = self->world->now_ns + boot_ns;
    self->mode = SIM_MOTEUS_STOPPED;
    self->fault = 0;
    moteus_fresh_command(self);
}

static void moteus_end_faults(struct sim_moteus *self)
{
    self->deaf = self->stubborn = self->nan = self->blocked = false;
    self->encoder_lost = false;
    sim_can_port_set_off(&self->port, false);
}

void sim_moteus_inject(struct sim_moteus *self, enum sim_moteus_fault fault)
{
    switch (fault) {
    case SIM_MOTEUS_ENCODER:
        self->encoder_lost = true;
        moteus_trip(self, SIM_MOTEUS_FAULT_ENCODER);
        break;
    case SIM_MOTEUS_DRIVER:
        moteus_trip(self, SIM_MOTEUS_FAULT_DRIVER);
        break;
    case SIM_MOTEUS_REBOOT:
        moteus_power_on(self, MOTEUS_REBOOT_NS);
        break;
    case SIM_MOTEUS_SILENT:
        sim_can_port_set_off(&self->port, true);
        break;
    case SIM_MOTEUS_DEAF:
        self->deaf = true;
        break;
    case SIM_MOTEUS_STUBBORN:
        self->stubborn = true;
        break;
    case SIM_MOTEUS_NOT_A_NUMBER:
        self->nan = true;
        break;
    case SIM_MOTEUS_BLOCKED:
        self->blocked = true;
        break;
    case SIM_MOTEUS_CLEAR:
        moteus_end_faults(self);
        break;
    case SIM_MOTEUS_FAULTS:
        break;
    }
}

int64_t sim_moteus_pos_q24(const struct sim_moteus *self)
{
    return self->plant.pos_q24;
}

/* ---- init ---- */

int sim_moteus_init(struct sim_moteus *self, struct sim_can_bus *bus,
                    const struct sim_moteus_config *config)
{
    struct sim_world *world = bus->world;
    int err;

    *self = (struct sim_moteus){ .member.ops = &moteus_member_ops,
                                 .world = world,
                                 .config = *config,
                                 .plant_ns = world->now_ns };
    if (config->loop_ns == 0)
        self->config.loop_ns = MOTEUS_LOOP_NS;
    if (config->id < 1 || config->id > 127 || config->boot_ns < 0 ||
        self->config.loop_ns < 62500 || self->config.loop_ns > 1000000 ||
        bus->fd_factor == 0)
        return MOTION_E_ARG;
    err = sim_plant_init(&self->plant, &config->plant, config->start_counts);
    if (err < 0)
        return err;
    if (world->member_count == SIM_WORLD_MEMBERS_MAX)
        return MOTION_E_FULL;
    err = sim_can_port_init(&self->port, bus);
    if (err < 0)
        return err;
    self->port.on_frame = sim_moteus_on_frame;
    self->port.context = self;
    self->due_ns = world->now_ns + self->config.loop_ns;
    moteus_power_on(self, self->config.boot_ns);
    return sim_world_add(world, &self->member);
}
