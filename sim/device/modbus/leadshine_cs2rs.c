/* sim/device/modbus/leadshine_cs2rs.c - Leadshine CS2RS, iEM-RS, iCL-RS,
 * StepperOnline CL57RS: the stepper branch.
 *
 * Sources: Leadshine CS2RS and iEM-RS user manuals, parameter and status tables;
 * what bit 4 of a path does was measured on an iCL57-RS by others. */
#include "sim/device/modbus/makers.h"

enum {
    CS2RS_PULSES = 0x0000, /* 32 bits: pulses per revolution */
    CS2RS_ENABLE = 0x000F, /* 1: enabled by software */
    CS2RS_STATE = 0x1003,
    CS2RS_DEVIATION = 0x1010,
    CS2RS_DEMAND = 0x1012,
    CS2RS_ACTUAL = 0x1014,
    CS2RS_SPEED = 0x1046, /* r/min, of the motor */
    CS2RS_ALARM = 0x2203, /* a bit each */
};

/* 0x1003 */
enum {
    FAULT = 1,
    ENABLED = 2,
    RUNNING = 4,
    COMMAND_DONE = 0x10,
    PATH_DONE = 0x20,
    HOMED = 0x40,
};

static const struct sim_modbus_range cs2rs_ranges[] = {
    { .at = 0x0000, .count = 0x10 },
    { .at = 0x0177, .count = 1 }, /* Pr4.27 */
    { .at = 0x0191, .count = 1 }, /* peak current, 0.1 A */
    { .at = 0x01BD, .count = 3 }, /* baud, -, id */
    { .at = 0x01D3, .count = 1 }, /* standstill current, % */
    { .at = 0x01E1, .count = 1 },
    { .at = CS2RS_STATE, .count = 1, .read_only = true },
    { .at = CS2RS_DEVIATION, .count = 6, .read_only = true },
    { .at = 0x1044, .count = 4, .read_only = true },
    { .at = CS2RS_ALARM, .count = 1, .read_only = true },
    SIM_LEADSHINE_PR_RANGES,
    { .count = 0 },
};

static uint8_t cs2rs_set(struct sim_modbus_servo *self, uint16_t at,
                         uint16_t count)
{
    /* with bit 4 a path is ignored while one runs, without it takes over */
    sim_leadshine_pr_set(self, at, count, false);
    if (!sim_modbus_is_in(CS2RS_ENABLE, at, count))
        return 0;
    if (self->reg[CS2RS_ENABLE] == 1)
        sim_modbus_servo_enable(self);
    else
        sim_modbus_servo_torque_off(self);
    return 0;
}

static void cs2rs_say(struct sim_modbus_servo *self)
{
    const bool moves = sim_modbus_servo_moves(self);
    uint16_t state = self->fault ? FAULT : 0;

    if (self->enabled)
        state |= ENABLED;
    if (moves)
        state |= RUNNING;
    if (self->demand_q16 == self->target_q16)
        state |= COMMAND_DONE;
    if (sim_modbus_servo_arrived(self))
        state |= PATH_DONE;
    if (self->homed)
        state |= HOMED;
    self->reg[CS2RS_STATE] = state;
    self->reg[CS2RS_ALARM] = (uint16_t)sim_modbus_alarm(self);
    sim_modbus_put_pair(self, CS2RS_DEMAND, self->demand_q16 >> 16);
    sim_modbus_put_pair(self, CS2RS_ACTUAL, sim_modbus_servo_reported(self));
    sim_modbus_put_pair(self, CS2RS_DEVIATION,
                        (self->demand_q16 >> 16) -
                            sim_modbus_servo_reported(self));
    sim_modbus_put_pair(self, CS2RS_SPEED,
                        (self->plant.vel_q24 >> 24) * 60 /
                            self->config.maker->resolution);
    sim_leadshine_pr_say(self);
}

static void cs2rs_set_up(struct sim_modbus_servo *self)
{
    sim_modbus_put_pair(self, CS2RS_PULSES, self->config.maker->resolution);
    self->reg[0x0003] = 2; /* closed loop */
}

const struct sim_modbus_maker sim_modbus_leadshine_cs2rs = {
    .name = "leadshine-cs2rs",
    .title = "Leadshine CS2RS",
    .order = MODBUS_ABCD,
    .resolution = 10000, /* 0x0001, as the map's rigs have it set */
    .alarm = 0x001,      /* over-current */
    .functions = SIM_MODBUS_PLAIN,
    .registers_max = 16, /* unverified */
    .too_many = 0x03,
    .read_only = 0x02,
    .range = cs2rs_ranges,
    .set = cs2rs_set,
    .say = cs2rs_say,
    .behaviour = { .slave = &sim_modbus_maker_slave, .set_up = cs2rs_set_up },
};
