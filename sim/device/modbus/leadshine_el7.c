/* sim/device/modbus/leadshine_el7.c - Leadshine EL7-RS and iSV2-RS, StepperOnline
 * T6: the servo branch, whose Prx.yy is the register x * 0x100 + 2 * yy + 1.
 *
 * Sources: EL7-RS manual V2.0.1 and iSV2-RS manual, register tables, as public
 * drivers quote them; functions 03, 06 and 10 alone. */
#include "sim/device/modbus/makers.h"

enum {
    EL7_MODE = 0x0003,   /* Pr0.01: 0 position, 1 velocity, 6 PR */
    EL7_PULSES = 0x0011, /* Pr0.08: pulses per revolution */
    EL7_DI1 = 0x0401,    /* Pr4.00: function of input 1 */
    EL7_ALARM = 0x0B03,
    EL7_STATE = 0x0B05,
    EL7_SPEED = 0x0B06, /* r/min, raw; filtered at 0x0B09 */
    EL7_ENCODER = 0x0B1C,
};

/* 0x0B05 */
enum { READY = 1, RUN = 2, ERROR = 4, HOMED = 8, IN_POSITION = 16 };

static const struct sim_modbus_range el7_ranges[] = {
    { .at = 0x0002, .count = 2 },
    { .at = 0x0010, .count = 2 },
    { .at = 0x0300, .count = 0x20 },                 /* velocity mode */
    { .at = 0x0400, .count = 0x30 },                 /* inputs, outputs */
    { .at = 0x053A, .count = 6 },                    /* format, baud, id */
    { .at = 0x0608, .count = 2 },                    /* jog */
    { .at = 0x0B03, .count = 9, .read_only = true }, /* what it says */
    { .at = 0x0B1C, .count = 2, .read_only = true },
    SIM_LEADSHINE_PR_RANGES,
    { .count = 0 },
};

/* SRV-ON is 0x03; with 0x80 the input is normally closed, so that it is on with
 * nothing wired. */
static void el7_input(struct sim_modbus_servo *self)
{
    if (self->reg[EL7_DI1] == 0x83)
        sim_modbus_servo_enable(self);
    else
        sim_modbus_servo_torque_off(self);
}

static uint8_t el7_set(struct sim_modbus_servo *self, uint16_t at,
                       uint16_t count)
{
    const bool was_in_fault = self->fault;

    /* bit 4 of a path's mode: T6 takes over at once with 0x11 */
    sim_leadshine_pr_set(self, at, count, true);
    if (sim_modbus_is_in(EL7_DI1, at, count) || (was_in_fault && !self->fault))
        el7_input(self);
    return 0;
}

static void el7_say(struct sim_modbus_servo *self)
{
    uint16_t state = self->fault ? ERROR : READY;

    if (sim_modbus_servo_moves(self))
        state |= RUN;
    if (self->homed)
        state |= HOMED;
    if (sim_modbus_servo_arrived(self))
        state |= IN_POSITION;
    self->reg[EL7_STATE] = state;
    self->reg[EL7_ALARM] = (uint16_t)sim_modbus_alarm(self);
    self->reg[EL7_SPEED] = self->reg[EL7_SPEED + 3] =
        (uint16_t)((self->plant.vel_q24 >> 24) * 60 /
                   self->config.maker->resolution);
    sim_modbus_put_pair(self, EL7_ENCODER, sim_modbus_servo_reported(self));
    sim_leadshine_pr_say(self);
}

/* As its owner set it up: in PR mode, SRV-ON off. */
static void el7_set_up(struct sim_modbus_servo *self)
{
    self->reg[EL7_MODE] = 6;
    self->reg[EL7_PULSES] = (uint16_t)self->config.maker->resolution;
    self->reg[EL7_DI1] = 0x03;
}

const struct sim_modbus_maker sim_modbus_leadshine_el7 = {
    .name = "leadshine-el7",
    .title = "Leadshine EL7-RS",
    .order = MODBUS_ABCD,
    .resolution = 10000, /* Pr0.08 */
    .alarm = 0x0E0,      /* over-current */
    .functions = SIM_MODBUS_PLAIN,
    .registers_max = 16, /* unverified */
    .too_many = 0x03,
    .read_only = 0x02,
    .range = el7_ranges,
    .set = el7_set,
    .say = el7_say,
    .behaviour = { .slave = &sim_modbus_maker_slave, .set_up = el7_set_up },
};
