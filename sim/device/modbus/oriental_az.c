/* sim/device/modbus/oriental_az.c - Oriental Motor AZ: direct data operation, and
 * inputs and outputs whose functions are parameters.  Every value is a pair of
 * registers, upper word first.
 *
 * Sources: HP-5142E (BLV-R, function edition, whose direct data operation is the
 * same), the public libraries arduino-OrientalAZ and orientalmotor_hardware, and
 * M2FS-Control, which cites HM-60262E.  The numbers of the functions C-ON (2) and
 * CRNT (142) are those of other drives of the maker (hal/maps/oriental-az.yaml). */
#include "sim/device/modbus/makers.h"

enum {
    AZ_DATA = 0x0058, /* operation data number, the first of a frame */
    AZ_TYPE = 0x005A,
    AZ_POSITION = 0x005C,
    AZ_VELOCITY = 0x005E, /* Hz: steps/s */
    AZ_RISE = 0x0060,     /* 0.001 kHz/s: steps/s2 (unverified) */
    AZ_FALL = 0x0062,
    AZ_TRIGGER = 0x0066, /* upper word: lifetime in ms */
    AZ_INPUTS = 0x007C,
    AZ_OUTPUTS = 0x007E,
    AZ_ALARM = 0x0080,
    AZ_DEMAND = 0x00C6,
    AZ_ACTUAL = 0x00CC,
    AZ_SPEED = 0x00D0, /* steps/s */
    AZ_ALARM_RESET = 0x0180,
    AZ_R_IN2 = 0x1204, /* function of input bit 2 */
    AZ_R_OUT2 = 0x1224,
};
enum { C_ON = 2, CRNT = 142 };
/* inputs, 0x007D: as shipped, but for bit 2 */
enum { IN_2 = 0x04, IN_ZHOME = 0x10, IN_STOP = 0x20, IN_FREE = 0x40 };
/* outputs, 0x007F */
enum {
    OUT_2 = 0x04,
    OUT_HOME_END = 0x10,
    OUT_READY = 0x20,
    OUT_ALARM = 0x80,
    OUT_MOVE = 0x2000,
    OUT_IN_POSITION = 0x4000,
};
#define ILLEGAL_VALUE 0x03
#define MS            INT64_C(1000000)
#define HOME_STEPS_S  INT64_C(10000) /* of a return to home; unverified */
#define FAR_STEPS     (INT64_C(1) << 32)

static const struct sim_modbus_range az_ranges[] = {
    { .at = AZ_DATA, .count = 18 },
    { .at = 0x0078, .count = 6 },
    { .at = AZ_OUTPUTS, .count = 4, .read_only = true },
    { .at = 0x00AC, .count = 2, .read_only = true },
    { .at = AZ_DEMAND, .count = 18, .read_only = true },
    { .at = AZ_ALARM_RESET, .count = 2 },
    { .at = 0x018A, .count = 4 },
    { .at = 0x0192, .count = 2 },
    { .at = 0x0220, .count = 2 },
    { .at = 0x0228, .count = 2 },
    { .at = 0x1200, .count = 64 }, /* functions of R-IN and R-OUT */
    { .at = 0x1382, .count = 16 }, /* of the line */
    { .count = 0 },
};

/* ---- direct data operation ---- */

/* Operation types: 1 absolute, 2 from the demand, 3 from the actual position, 4
 * from the target, 7 and 16 continuous, 0 and 31 slow down, 32 at once. */
static uint8_t az_operate(struct sim_modbus_servo *self)
{
    const int64_t speed = sim_modbus_pair(self, AZ_VELOCITY);
    int64_t to = sim_modbus_pair(self, AZ_POSITION);

    switch (sim_modbus_pair(self, AZ_TYPE)) {
    case 0:
    case 31:
        sim_modbus_servo_stop(self);
        return 0;
    case 32:
        sim_modbus_servo_stand(self);
        return 0;
    case 1:
        break;
    case 2:
        to += self->demand_q16 >> 16;
        break;
    case 3:
        to += sim_modbus_servo_reported(self);
        break;
    case 4:
        to += self->target_q16 >> 16;
        break;
    case 7:
    case 16:
        to = speed < 0 ? -FAR_STEPS : FAR_STEPS;
        break;
    default:
        return ILLEGAL_VALUE;
    }
    if (!self->stop_input)
        sim_modbus_servo_go_to(self, to, speed < 0 ? -speed : speed,
                               sim_modbus_pair(self, AZ_RISE),
                               sim_modbus_pair(self, AZ_FALL));
    return 0;
}

/* 1 .. 3 starts in the units that are set up; lifetime 1 .. 32767 ms counts from
 * each write.  Other triggers exist and are not modelled. */
static uint8_t az_trigger(struct sim_modbus_servo *self)
{
    const int64_t both = sim_modbus_pair(self, AZ_TRIGGER);
    const int64_t trigger = (int16_t)(both & 0xFFFF);
    const int64_t lifetime_ms = (int16_t)(both >> 16 & 0xFFFF);

    if (trigger < 1 || trigger > 3 || lifetime_ms < -1)
        return ILLEGAL_VALUE;
    self->deadline_ns =
        lifetime_ms > 0 ? self->world->now_ns + lifetime_ms * MS : 0;
    return az_operate(self);
}

/* ---- inputs ---- */

static bool az_has_c_on(const struct sim_modbus_servo *self)
{
    return sim_modbus_pair(self, AZ_R_IN2) == C_ON;
}

/* Without an input C-ON the motor is excited from power-on (unverified). */
static void az_inputs(struct sim_modbus_servo *self)
{
    const uint32_t inputs = (uint32_t)sim_modbus_pair(self, AZ_INPUTS);
    const uint32_t rise = inputs & ~self->control;
    const bool on = (inputs & IN_2) != 0 || !az_has_c_on(self);

    self->control = inputs;
    self->stop_input = (inputs & IN_STOP) != 0;
    if (self->stop_input)
        sim_modbus_servo_stop(self);
    if (on && (inputs & IN_FREE) == 0)
        sim_modbus_servo_enable(self);
    else
        sim_modbus_servo_torque_off(self);
    /* an absolute encoder: home is 0, and it goes there */
    if ((rise & IN_ZHOME) != 0 && !self->stop_input && self->enabled) {
        self->homed = true;
        sim_modbus_servo_go_to(self, 0, HOME_STEPS_S, HOME_STEPS_S * 10,
                               HOME_STEPS_S * 10);
    }
}

static uint8_t az_set(struct sim_modbus_servo *self, uint16_t at,
                      uint16_t count)
{
    /* 0 -> 1 */
    const bool reset = sim_modbus_is_in(AZ_ALARM_RESET + 1, at, count);

    if (sim_modbus_is_in(AZ_TRIGGER + 1, at, count)) {
        const uint8_t exception = az_trigger(self);
        if (exception != 0)
            return exception;
    }
    if (reset && sim_modbus_pair(self, AZ_ALARM_RESET) == 1)
        self->fault = false;
    if (reset || sim_modbus_is_in(AZ_INPUTS + 1, at, count))
        az_inputs(self);
    return 0;
}

/* ---- what it says ---- */

static void az_say(struct sim_modbus_servo *self)
{
    const bool moves = sim_modbus_servo_moves(self);
    const bool crnt = sim_modbus_pair(self, AZ_R_OUT2) == CRNT;
    uint32_t outputs = self->fault ? OUT_ALARM : 0;

    if (crnt ? self->enabled : (self->control & IN_2) != 0)
        outputs |= OUT_2;
    if (self->homed && !moves)
        outputs |= OUT_HOME_END;
    if (self->enabled && !self->stop_input && !moves)
        outputs |= OUT_READY;
    if (moves)
        outputs |= OUT_MOVE;
    if (sim_modbus_servo_arrived(self))
        outputs |= OUT_IN_POSITION;
    sim_modbus_put_pair(self, AZ_OUTPUTS, outputs);
    sim_modbus_put_pair(self, AZ_ALARM, sim_modbus_alarm(self));
    sim_modbus_put_pair(self, AZ_DEMAND, self->demand_q16 >> 16);
    sim_modbus_put_pair(self, AZ_ACTUAL, sim_modbus_servo_reported(self));
    sim_modbus_put_pair(self, AZ_SPEED, self->plant.vel_q24 >> 24);
}

/* The lifetime of the last set point: when it runs out the drive alarms. */
static void az_loop(struct sim_modbus_servo *self, int64_t now_ns)
{
    if (self->deadline_ns == 0 || now_ns < self->deadline_ns)
        return;
    self->deadline_ns = 0;
    self->fault = true;
    sim_modbus_servo_torque_off(self);
}

/* As its owner set it up: C-ON and CRNT assigned. */
static void az_set_up(struct sim_modbus_servo *self)
{
    sim_modbus_put_pair(self, AZ_R_IN2, C_ON);
    sim_modbus_put_pair(self, AZ_R_OUT2, CRNT);
}

const struct sim_modbus_maker sim_modbus_oriental_az = {
    .name = "oriental-az",
    .title = "Oriental Motor AZ",
    .order = MODBUS_ABCD,
    .resolution = 1000,
    .alarm = 0x10, /* position deviation */
    .functions = SIM_MODBUS_PLAIN | SIM_MODBUS_WRITE_READ,
    .registers_max = 123,
    .too_many = 0x03,
    .read_only = 0x02,
    .range = az_ranges,
    .set = az_set,
    .say = az_say,
    .behaviour = { .slave = &sim_modbus_maker_slave,
                   .set_up = az_set_up,
                   .loop = az_loop },
};
