/* sim/device/modbus/lexium_32.c - Schneider Lexium 32 over Modbus TCP: the CiA 402
 * state machine in registers, profile position and homing.  Every parameter is a
 * pair, upper word first.
 *
 * Sources: Schneider 0198441113843 (LXM32M, Modbus TCP), list of parameters;
 * IEC 61800-7-201 for the transitions; a public Python and a public C# driver. */
#include "sim/device/modbus/makers.h"

enum {
    LX_EXCLUSIVE = 282, /* AccessExcl: 1 before anything is written */
    LX_RAMP_UP = 1556,  /* RAMP_v_acc, r/min/s */
    LX_RAMP_DOWN = 1558,
    LX_GUARD = 5644,   /* MBnode_guard, ms; 0: none */
    LX_CONTROL = 6914, /* DCOMcontrol */
    LX_STATUS = 6916,  /* _DCOMstatus */
    LX_MODE = 6918,    /* DCOMopmode: 1 profile position, 6 homing */
    LX_MODE_ACTIVE = 6920,
    LX_TARGET = 6940, /* PPp_target */
    LX_SPEED = 6942,  /* PPv_target, r/min */
    LX_ERROR = 7184,
    LX_CURRENT = 7686,
    LX_POSITION = 7706, /* _p_act */
    LX_VELOCITY = 7744, /* _v_act, r/min */
    LX_CLEAR = 15112,   /* ERR_clear */
};
enum { PROFILE_POSITION = 1, HOMING = 6 };
/* _DCOMstatus beside the state */
enum { REACHED = 0x0400, TAKEN = 0x1000, X_END = 0x4000, REF_OK = 0x8000 };
#define ILLEGAL_VALUE  0x03
#define DEVICE_FAILURE 0x04
#define GUARD_MAX_MS   10000
#define MS             INT64_C(1000000)
#define STEEP          100 /* full speed in 10 ms */

static const struct sim_modbus_range lexium_ranges[] = {
    { .at = LX_EXCLUSIVE, .count = 2 },
    { .at = 1550, .count = 4 }, /* scale of the position */
    { .at = LX_RAMP_UP, .count = 4 },
    { .at = LX_GUARD, .count = 2 },
    { .at = LX_CONTROL, .count = 2 },
    { .at = LX_STATUS, .count = 2, .read_only = true },
    { .at = LX_MODE, .count = 2 },
    { .at = LX_MODE_ACTIVE, .count = 2, .read_only = true },
    { .at = 6936, .count = 2 }, /* HMmethod */
    { .at = LX_TARGET, .count = 4 },
    { .at = 6986, .count = 2, .read_only = true }, /* driveStat */
    { .at = LX_ERROR, .count = 2, .read_only = true },
    { .at = LX_CURRENT, .count = 2, .read_only = true },
    { .at = LX_POSITION, .count = 2, .read_only = true },
    { .at = LX_VELOCITY, .count = 2, .read_only = true },
    { .at = 10248, .count = 4 }, /* HMv, HMv_out */
    { .at = LX_CLEAR, .count = 2 },
    { .count = 0 },
};

/* ---- the state machine: one transition for each command ---- */

static void lexium_power(struct sim_modbus_servo *self, uint32_t control)
{
    const bool voltage = (control & 2) != 0, quick = (control & 4) == 0;
    const bool torque = self->enabled || self->enabling;

    if (self->power >= SIM_MODBUS_FAULT_REACTION)
        return;
    if (!voltage) { /* 7, 9, 10, 12 */
        self->power = SIM_MODBUS_SWITCH_ON_DISABLED;
    } else if (self->power == SIM_MODBUS_QUICK_STOP_ACTIVE) {
        return; /* only 12 leads on */
    } else if (quick && self->power == SIM_MODBUS_OPERATION_ENABLED) { /* 11 */
        self->power = SIM_MODBUS_QUICK_STOP_ACTIVE;
        sim_modbus_servo_stop(self);
        return;
    } else if (quick) {
        self->power = SIM_MODBUS_SWITCH_ON_DISABLED;
    } else if ((control & 1) == 0) { /* 2, 6, 8 */
        self->power = SIM_MODBUS_READY_TO_SWITCH_ON;
    } else if (self->power == SIM_MODBUS_READY_TO_SWITCH_ON) { /* 3 */
        self->power = SIM_MODBUS_SWITCHED_ON;
    } else if (self->power == SIM_MODBUS_SWITCHED_ON && (control & 8) != 0) {
        sim_modbus_servo_enable(self); /* 4, once the brake is open */
        return;
    } else if (self->power == SIM_MODBUS_OPERATION_ENABLED &&
               (control & 8) == 0) { /* 5 */
        self->power = SIM_MODBUS_SWITCHED_ON;
    } else {
        return;
    }
    if (torque)
        sim_modbus_servo_torque_off(self);
}

/* Bit 4, 0 -> 1: a set point, at once with bit 5, else when none runs. */
static void lexium_go(struct sim_modbus_servo *self, uint32_t control)
{
    const int64_t mode = sim_modbus_pair(self, LX_MODE);

    if (self->power != SIM_MODBUS_OPERATION_ENABLED)
        return;
    if (mode == HOMING)
        sim_modbus_servo_home(self);
    else if (mode == PROFILE_POSITION &&
             ((control & 0x20) != 0 || !sim_modbus_servo_moves(self)))
        sim_modbus_servo_go_to(
            self, sim_modbus_pair(self, LX_TARGET),
            sim_modbus_rpm(self, sim_modbus_pair(self, LX_SPEED)),
            sim_modbus_rpm(self, sim_modbus_pair(self, LX_RAMP_UP)),
            sim_modbus_rpm(self, sim_modbus_pair(self, LX_RAMP_DOWN)));
}

static void lexium_clear(struct sim_modbus_servo *self)
{
    if (self->power != SIM_MODBUS_FAULT)
        return;
    self->power = SIM_MODBUS_SWITCH_ON_DISABLED; /* 15 */
    self->fault = false;
}

static void lexium_control(struct sim_modbus_servo *self)
{
    const uint32_t control = (uint32_t)sim_modbus_pair(self, LX_CONTROL);
    const uint32_t rise = control & ~self->control;

    self->control = control;
    if ((rise & 0x80) != 0)
        lexium_clear(self);
    else
        lexium_power(self, control);
    if ((rise & 0x10) != 0)
        lexium_go(self, control);
}

static uint8_t lexium_set(struct sim_modbus_servo *self, uint16_t at,
                          uint16_t count)
{
    /* unverified: with which exception it refuses a master without access */
    if (sim_modbus_pair(self, LX_EXCLUSIVE) != 1)
        return DEVICE_FAILURE;
    if (sim_modbus_pair(self, LX_GUARD) < 0 ||
        sim_modbus_pair(self, LX_GUARD) > GUARD_MAX_MS)
        return ILLEGAL_VALUE;
    if (sim_modbus_is_in(LX_CONTROL + 1, at, count))
        lexium_control(self);
    if (sim_modbus_is_in(LX_CLEAR + 1, at, count))
        lexium_clear(self);
    return 0;
}

static void lexium_say(struct sim_modbus_servo *self)
{
    static const uint16_t word[] = {
        [SIM_MODBUS_SWITCH_ON_DISABLED] = 0x0250,
        [SIM_MODBUS_READY_TO_SWITCH_ON] = 0x0231,
        [SIM_MODBUS_SWITCHED_ON] = 0x0233,
        [SIM_MODBUS_OPERATION_ENABLED] = 0x0237,
        [SIM_MODBUS_QUICK_STOP_ACTIVE] = 0x0217,
        [SIM_MODBUS_FAULT_REACTION] = 0x021F,
        [SIM_MODBUS_FAULT] = 0x0218,
    };
    uint32_t status = word[self->power];

    if (!sim_modbus_servo_moves(self))
        status |= X_END;
    if (sim_modbus_servo_arrived(self))
        status |= REACHED;
    if ((self->control & 0x10) != 0)
        status |= TAKEN;
    if (self->homed)
        status |= REF_OK;
    sim_modbus_put_pair(self, LX_STATUS, status);
    sim_modbus_put_pair(self, LX_MODE_ACTIVE, sim_modbus_pair(self, LX_MODE));
    sim_modbus_put_pair(self, LX_ERROR, sim_modbus_alarm(self));
    sim_modbus_put_pair(self, LX_POSITION, sim_modbus_servo_reported(self));
    sim_modbus_put_pair(self, LX_VELOCITY,
                        (self->plant.vel_q24 >> 24) * 60 /
                            self->config.maker->resolution);
}

/* 13: it slows down with torque, then 14. */
static void lexium_fault(struct sim_modbus_servo *self)
{
    self->power = self->enabled ? SIM_MODBUS_FAULT_REACTION : SIM_MODBUS_FAULT;
    if (self->enabled)
        sim_modbus_servo_stop(self);
    else
        sim_modbus_servo_torque_off(self);
}

static void lexium_loop(struct sim_modbus_servo *self, int64_t now_ns)
{
    const int64_t guard_ns = sim_modbus_pair(self, LX_GUARD) * MS;

    if (self->enabled && self->power == SIM_MODBUS_SWITCHED_ON)
        self->power = SIM_MODBUS_OPERATION_ENABLED;
    if (guard_ns > 0 && self->power == SIM_MODBUS_OPERATION_ENABLED &&
        now_ns - self->heard_ns > guard_ns) {
        self->fault = true;
        lexium_fault(self);
    }
    if (self->power == SIM_MODBUS_FAULT_REACTION &&
        !sim_modbus_servo_moves(self)) {
        sim_modbus_servo_torque_off(self);
        self->power = SIM_MODBUS_FAULT;
    }
}

/* Its ramps as somebody has set them up who streams: steeper than the motor. */
static void lexium_set_up(struct sim_modbus_servo *self)
{
    const int64_t ramp = STEEP * self->config.plant.vel_max_counts_s * 60 /
                         self->config.maker->resolution;

    sim_modbus_put_pair(self, LX_RAMP_UP, ramp < INT32_MAX ? ramp : INT32_MAX);
    sim_modbus_put_pair(self, LX_RAMP_DOWN,
                        ramp < INT32_MAX ? ramp : INT32_MAX);
    sim_modbus_put_pair(self, 1550, self->config.maker->resolution);
    sim_modbus_put_pair(self, 1552, 1);
}

const struct sim_modbus_maker sim_modbus_lexium_32 = {
    .name = "lexium-32",
    .title = "Schneider Lexium 32",
    .order = MODBUS_ABCD,
    .resolution = 16384, /* 1550, 1552 as shipped */
    .alarm = 0x0001,     /* general error */
    .functions = SIM_MODBUS_PLAIN | SIM_MODBUS_WRITE_READ,
    .registers_max = 13,
    .too_many = 0x03,
    .read_only = 0x02,
    .range = lexium_ranges,
    .set = lexium_set,
    .say = lexium_say,
    .behaviour = { .slave = &sim_modbus_maker_slave,
                   .set_up = lexium_set_up,
                   .loop = lexium_loop,
                   .fault = lexium_fault },
};
