/* sim/device/moteus/servo.c - registers, modes, motion.  See servo.h. */
#include "sim/device/moteus/servo.h"

#include <math.h>
#include <string.h>

#include "sim/device/moteus/parts.h"
#include "sim/device/trapezoid.h"
#include "sim/util.h"

#define MOTEUS_REBOOT_NS INT64_C(300000000)
#define MOTEUS_S         1e9
#define MOTEUS_TURN_Q24  (SIM_MOTEUS_COUNTS * 16777216.0)
/* As delivered: servo.default_timeout_s. */
#define MOTEUS_TIMEOUT_S 0.1f
#define MOTEUS_NM_PER_A  0.1

static struct sim_moteus *moteus_of(struct sim_servo *base)
{
    return CONTAINER_OF(base, struct sim_moteus, base);
}

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
    sim_servo_advance(&self->base);
    if (mode == SIM_MOTEUS_POSITION && self->mode != SIM_MOTEUS_POSITION) {
        self->demand = moteus_turns(self->base.plant.pos_q24);
        self->demand_vel = moteus_turns(self->base.plant.vel_q24);
    }
    self->mode = (uint8_t)mode;
}

static void moteus_fail(struct sim_moteus *self, unsigned fault)
{
    moteus_enter(self, SIM_MOTEUS_FAULT);
    self->fault = (uint8_t)fault;
}

/* servo.timeout_mode as delivered, 12: to zero velocity by the damping alone. */
static void moteus_step_timeout(struct sim_moteus *self)
{
    self->demand = moteus_turns(self->base.plant.pos_q24);
    self->demand_vel = 0;
}

static void moteus_step(struct sim_servo *base, int64_t dt_ns)
{
    struct sim_moteus *self = moteus_of(base);
    const bool times_out = self->mode == SIM_MOTEUS_TIMEOUT;
    const bool torque = self->mode == SIM_MOTEUS_POSITION || times_out;

    if (times_out)
        moteus_step_timeout(self);
    else if (torque)
        moteus_step_demand(self, (double)dt_ns / MOTEUS_S);
    sim_servo_push(base, (double)self->command[SIM_MOTEUS_COMMAND_TORQUE] /
                             self->config.torque_nm);
    sim_servo_turn(base, torque, moteus_q24(self->demand),
                   moteus_q24(self->demand_vel), dt_ns);
}

/* ---- registers ---- */

static double moteus_position(struct sim_moteus *self)
{
    sim_servo_advance(&self->base);
    return self->base.nan
               ? (double)NAN
               : moteus_turns(sim_servo_reported_q24(&self->base)) - self->zero;
}

static double moteus_velocity(struct sim_moteus *self)
{
    sim_servo_advance(&self->base);
    return moteus_turns(self->base.plant.vel_q24);
}

static double moteus_torque_nm(struct sim_moteus *self)
{
    sim_servo_advance(&self->base);
    return sim_servo_torque(&self->base) * self->config.torque_nm;
}

/* Not a number where it has none. */
static bool moteus_reading(struct sim_moteus *self, unsigned reg, double *value)
{
    const struct sim_readings *readings = &self->base.readings;

    if (reg == 0x004)
        *value = moteus_torque_nm(self) / MOTEUS_NM_PER_A;
    else if (reg == 0x00D)
        *value = 24 + readings->more_v;
    else if (reg == 0x00E)
        *value = 31 + sim_readings_warmth_degc(readings, &self->base.plant);
    else
        return false;
    if (readings->missing)
        *value = (double)NAN;
    return true;
}

/* Model, firmware 0.3.4, version of the registers, id; serial number. */
static bool moteus_identity(const struct sim_moteus *self, unsigned reg,
                            double *value)
{
    const struct {
        unsigned reg;
        double value;
    } row[] = {
        { 0x100, 66 },         { 0x101, 0x000304 },
        { 0x102, 5 },          { 0x110, self->config.id },
        { 0x120, 0x12345678 }, { 0x121, 0x9ABC },
        { 0x122, 0x0DEF },
    };

    for (size_t i = 0; i < sizeof row / sizeof row[0]; i++)
        if (row[i].reg == reg) {
            *value = row[i].value;
            return true;
        }
    return false;
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
        *value = moteus_torque_nm(self);
    else if (reg == 0x00B)
        *value = self->complete;
    else if (moteus_reading(self, reg, value))
        return true;
    else if (reg == 0x00F)
        *value = self->fault;
    else if (reg >= 0x020 && reg < 0x020 + SIM_MOTEUS_COMMANDS)
        *value = (double)self->command[reg - 0x020];
    else if (reg < 0x010)
        *value = 0;
    else
        return moteus_identity(self, reg, value);
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
    if (self->base.ignores_state || (mode != SIM_MOTEUS_STOPPED && stuck))
        return;
    if (mode == SIM_MOTEUS_STOPPED && self->base.encoder_lost) {
        moteus_fail(self, SIM_MOTEUS_FAULT_ENCODER);
    } else if (mode == SIM_MOTEUS_STOPPED || mode == SIM_MOTEUS_POSITION) {
        self->fault = 0;
        moteus_enter(self, mode);
    }
}

bool sim_moteus_write(struct sim_moteus *self, unsigned reg, double value)
{
    sim_servo_advance(&self->base);
    if (reg == 0x000)
        moteus_set_mode(self, value >= 0 && value < 16 ? (unsigned)value : 0);
    else if (reg >= 0x020 && reg < 0x020 + SIM_MOTEUS_COMMANDS)
        self->command[reg - 0x020] = (float)value;
    else if (reg == 0x131)
        self->zero = moteus_turns(self->base.plant.pos_q24) - value;
    else
        return false;
    return true;
}

/* Without limits the command is in force at once. */
void sim_moteus_commanded(struct sim_moteus *self)
{
    const float pos = self->command[SIM_MOTEUS_COMMAND_POSITION];
    const float vel = self->command[SIM_MOTEUS_COMMAND_VELOCITY];

    self->heard_ns = self->base.world->now_ns;
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
        (double)(self->base.world->now_ns - self->heard_ns) >
            (double)timeout_s * MOTEUS_S)
        moteus_enter(self, SIM_MOTEUS_TIMEOUT);
}

static int64_t moteus_due_ns(const struct sim_member *member)
{
    return CONTAINER_OF_CONST(member, struct sim_moteus, base.member)->due_ns;
}

static void moteus_run(struct sim_member *member, int64_t now_ns)
{
    struct sim_moteus *self =
        CONTAINER_OF(member, struct sim_moteus, base.member);

    self->due_ns = now_ns + self->base.loop_ns;
    sim_servo_advance(&self->base);
    moteus_watch(self);
}

/* ---- what may happen to it ---- */

static void moteus_power_on(struct sim_moteus *self, int64_t boot_ns)
{
    sim_servo_boot(&self->base, boot_ns);
    self->mode = SIM_MOTEUS_STOPPED;
    self->fault = 0;
    moteus_fresh_command(self);
}

static void moteus_reboot(struct sim_servo *base)
{
    moteus_power_on(moteus_of(base), MOTEUS_REBOOT_NS);
}

static void moteus_lose_encoder(struct sim_servo *base)
{
    moteus_fail(moteus_of(base), SIM_MOTEUS_FAULT_ENCODER);
}

static void moteus_trip(struct sim_servo *base, uint32_t code)
{
    moteus_fail(moteus_of(base), code != 0 ? code : SIM_MOTEUS_FAULT_DRIVER);
}

static void moteus_heat(struct sim_servo *base, enum sim_servo_heat heat)
{
    if (heat == SIM_SERVO_HOT)
        moteus_fail(moteus_of(base), SIM_MOTEUS_FAULT_HOT);
}

static const struct sim_servo_ops moteus_ops = {
    .member = { .due_ns = moteus_due_ns, .run = moteus_run },
    .on_frame = sim_moteus_on_frame,
    .step = moteus_step,
    .lose_encoder = moteus_lose_encoder,
    .trip = moteus_trip,
    .reboot = moteus_reboot,
    .heat = moteus_heat,
};

/* ---- init ---- */

int sim_moteus_init(struct sim_moteus *self, struct sim_can_bus *bus,
                    const struct sim_moteus_config *config)
{
    int err;

    *self = (struct sim_moteus){ .config = *config };
    if (config->torque_nm == 0)
        self->config.torque_nm = 1;
    if (config->id < 1 || config->id > 127 || config->boot_ns < 0 ||
        config->torque_nm < 0 || bus->fd_factor == 0)
        return MOTION_E_ARG;
    err = sim_servo_init(&self->base, bus, &moteus_ops, &config->plant,
                         config->start_counts, config->loop_ns);
    if (err < 0)
        return err;
    self->due_ns = self->base.world->now_ns + self->base.loop_ns;
    moteus_power_on(self, config->boot_ns);
    return MOTION_OK;
}
