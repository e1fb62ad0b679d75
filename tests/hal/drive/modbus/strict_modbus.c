/* tests/hal/drive/modbus/strict_modbus.c - see strict_modbus.h. */
#include "tests/hal/drive/modbus/strict_modbus.h"

#include <math.h>
#include <string.h>

#include "sim/util.h"

#define MS              INT64_C(1000000)
#define LOOP_S          0.001
#define ENABLE_NS       (80 * MS) /* the brake opens */
#define STANDING        500.0     /* counts/s */
#define FAR             400000    /* of a lie, counts */
#define HOME_AWAY       200000    /* from where homing begins */
#define ILLEGAL_ADDRESS 0x02
#define DEVICE_FAILURE  0x04

static struct strict_modbus *strict_of(struct modbus_slave *slave)
{
    return CONTAINER_OF(slave, struct strict_modbus, slave);
}

/* ---- registers ---- */

static uint32_t high_first(const struct strict_modbus *self, unsigned at)
{
    return (uint32_t)self->reg[at] << 16 | self->reg[at + 1];
}

static uint32_t low_first(const struct strict_modbus *self, unsigned at)
{
    return (uint32_t)self->reg[at + 1] << 16 | self->reg[at];
}

static void put_high_first(struct strict_modbus *self, unsigned at,
                           uint32_t value)
{
    self->reg[at] = (uint16_t)(value >> 16);
    self->reg[at + 1] = (uint16_t)value;
}

static void put_low_first(struct strict_modbus *self, unsigned at,
                          uint32_t value)
{
    self->reg[at] = (uint16_t)value;
    self->reg[at + 1] = (uint16_t)(value >> 16);
}

static uint32_t position_of(const struct strict_modbus *self)
{
    return (uint32_t)(int32_t)(lround(self->pos) + (self->lies ? FAR : 0));
}

/* ---- torque and motion ---- */

bool strict_modbus_moves(const struct strict_modbus *self)
{
    return fabs(self->vel) > STANDING;
}

static bool on_its_way(const struct strict_modbus *self)
{
    return strict_modbus_moves(self) || (self->torque && !self->braking &&
                                         fabs(self->target - self->pos) > 1);
}

static void stand(struct strict_modbus *self)
{
    self->target = self->pos;
    self->braking = false;
}

static void torque_on(struct strict_modbus *self)
{
    if (self->torque || self->enabling || self->alarm)
        return;
    self->enabling = true;
    self->enabled_ns = self->world->now_ns + ENABLE_NS;
    self->energised++;
}

static void torque_off(struct strict_modbus *self)
{
    if (self->torque && strict_modbus_moves(self))
        self->cuts++;
    self->torque = self->enabling = false;
}

static void brake(struct strict_modbus *self)
{
    self->braking = true;
    self->homing = false;
    self->home_ns = 0;
}

static void go_to(struct strict_modbus *self, uint32_t target, double speed,
                  double ramp)
{
    if (!self->torque)
        return;
    self->target = (int32_t)target;
    self->path_speed = speed;
    self->path_ramp = ramp;
    self->braking = self->homing = false;
    self->set_points++;
}

/* To its switch, by the speed and the ramp that it has been set to. */
static void home_begin(struct strict_modbus *self)
{
    self->home_ns = 0;
    if (!self->torque)
        return;
    if (self->homed)
        self->homed_until_ns = self->world->now_ns + self->homed_lingers_ns;
    self->target = self->pos - self->home_away;
    self->path_speed = self->speed;
    self->path_ramp = self->ramp;
    self->braking = self->homed = false;
    self->homing = true;
}

static void home(struct strict_modbus *self)
{
    if (self->torque && !self->homes_not)
        self->home_ns = self->world->now_ns + self->home_late_ns;
    if (self->home_ns != 0 && self->home_late_ns == 0)
        home_begin(self);
}

static void home_reached(struct strict_modbus *self)
{
    self->homing = false;
    self->homed = self->was_homed = true;
    self->pos = self->target = 0;
}

/* Its flag: what the last homing left stays for a while. */
static bool says_homed(const struct strict_modbus *self)
{
    return self->homed || (self->was_homed && self->homed_stays) ||
           self->world->now_ns < self->homed_until_ns;
}

/* ---- Lexium 32 ---- */

enum { LX_EXCL = 282, LX_GUARD = 5644, LX_CONTROL = 6914, LX_STATUS = 6916 };
enum { LX_MODE = 6918, LX_TARGET = 6940, LX_SPEED = 6942, LX_ALARM = 7184 };
enum { LX_POSITION = 7706 };

/* IEC 61800-7-201: device control commands, one transition for each. */
static void lexium_power(struct strict_modbus *self, uint32_t control)
{
    const bool voltage = (control & 2) != 0, quick = (control & 4) == 0;
    const unsigned low = control & 0x0F;
    const bool had_torque = self->torque || self->enabling;

    if (self->power == STRICT_FAULT_REACTION || self->power == STRICT_FAULT)
        return;
    if (!voltage) { /* 7, 9, 10, 12 */
        self->power = STRICT_SWITCH_ON_DISABLED;
        if (had_torque)
            torque_off(self);
    } else if (self->power == STRICT_QUICK_STOP_ACTIVE) {
        return;                                                    /* stays */
    } else if (quick && self->power == STRICT_OPERATION_ENABLED) { /* 11 */
        self->power = STRICT_QUICK_STOP_ACTIVE;
        brake(self);
    } else if (quick) {
        self->power = STRICT_SWITCH_ON_DISABLED;
    } else if ((control & 1) == 0) { /* Shutdown: 2, 6, 8 */
        self->power = STRICT_READY_TO_SWITCH_ON;
        if (had_torque)
            torque_off(self);
    } else if (self->power == STRICT_READY_TO_SWITCH_ON) { /* 3 */
        self->power = STRICT_SWITCHED_ON;
    } else if (self->power == STRICT_SWITCHED_ON && low == 0x0F) { /* 4 */
        torque_on(self); /* in Operation enabled once the brake is open */
    } else if (self->power == STRICT_OPERATION_ENABLED && low == 0x07) { /* 5 */
        self->power = STRICT_SWITCHED_ON;
        torque_off(self);
    }
}

static void lexium_control(struct strict_modbus *self)
{
    const uint32_t control = high_first(self, LX_CONTROL);
    const bool bit4 = (control & 0x10) != 0, bit7 = (control & 0x80) != 0;

    if (bit7 && !self->reset_bit && self->power == STRICT_FAULT) { /* 15 */
        self->power = STRICT_SWITCH_ON_DISABLED;
        self->alarm = false;
    } else {
        lexium_power(self, control);
    }
    if (bit4 && !self->set_point_bit && high_first(self, LX_MODE) == 1 &&
        self->power == STRICT_OPERATION_ENABLED &&
        ((control & 0x20) != 0 || !on_its_way(self)))
        go_to(self, high_first(self, LX_TARGET),
              high_first(self, LX_SPEED) * 16384.0 / 60, self->ramp);
    if (bit4 && !self->set_point_bit && high_first(self, LX_MODE) == 6 &&
        self->power == STRICT_OPERATION_ENABLED)
        home(self);
    self->set_point_bit = bit4;
    self->reset_bit = bit7;
}

static uint8_t lexium_set(struct strict_modbus *self, uint16_t at)
{
    if (at != LX_EXCL && high_first(self, LX_EXCL) != 1)
        return DEVICE_FAILURE;
    if (self->refuses_motion && at == LX_TARGET)
        return DEVICE_FAILURE;
    if (self->refuses_off && at == LX_CONTROL && self->reg[LX_CONTROL + 1] == 0)
        return DEVICE_FAILURE;
    if (at == LX_CONTROL)
        lexium_control(self);
    else if (at == LX_MODE && high_first(self, LX_MODE) == 6)
        self->homed_hides = false;
    return 0;
}

static void lexium_say(struct strict_modbus *self)
{
    static const uint32_t word[] = {
        [STRICT_SWITCH_ON_DISABLED] = 0x0250,
        [STRICT_READY_TO_SWITCH_ON] = 0x0231,
        [STRICT_SWITCHED_ON] = 0x0233,
        [STRICT_OPERATION_ENABLED] = 0x0237,
        [STRICT_QUICK_STOP_ACTIVE] = 0x0217,
        [STRICT_FAULT_REACTION] = 0x021F,
        [STRICT_FAULT] = 0x0218,
    };
    uint32_t status = word[self->power];

    if (!on_its_way(self))
        status |= 0x4000 | 0x0400; /* x_end, target reached */
    if (says_homed(self) && !self->homed_hides)
        status |= 0x8000; /* ref_ok */
    put_high_first(self, LX_STATUS, status);
    put_high_first(self, LX_POSITION, position_of(self));
    put_high_first(self, LX_ALARM, self->alarm ? 0x0001 : 0);
}

static void lexium_fault(struct strict_modbus *self)
{
    self->alarm = true;
    self->power =
        self->torque ? STRICT_FAULT_REACTION : STRICT_FAULT; /* 13, 14 */
    brake(self);
}

static void lexium_loop(struct strict_modbus *self)
{
    const int64_t guard_ns = high_first(self, LX_GUARD) * MS;

    if (self->torque && self->power == STRICT_SWITCHED_ON)
        self->power = STRICT_OPERATION_ENABLED;
    if (guard_ns > 0 && self->power == STRICT_OPERATION_ENABLED &&
        self->world->now_ns - self->heard_ns > guard_ns)
        lexium_fault(self);
    if (self->power == STRICT_FAULT_REACTION && !strict_modbus_moves(self)) {
        torque_off(self);
        self->power = STRICT_FAULT;
    }
}

/* ---- Leadshine EL7-RS ---- */

enum { EL_DI1 = 0x0401, EL_ALARM = 0x0B03, EL_STATE = 0x0B05 };
enum { EL_RESET = 0x1801, EL_TRIGGER = 0x6002, EL_POSITION = 0x602C };
enum { EL_PATH = 0x6200 };

static void el7_input(struct strict_modbus *self)
{
    if (self->reg[EL_DI1] == 0x83) /* normally closed: on with no wire */
        torque_on(self);
    else
        torque_off(self);
}

/* Without INS a path that runs is not broken off. */
static void el7_path(struct strict_modbus *self)
{
    const bool insert = (self->reg[EL_PATH] & 0x10) != 0;
    const double rpm = (int16_t)self->reg[EL_PATH + 3];
    const double ms = self->reg[EL_PATH + 4] > 0 ? self->reg[EL_PATH + 4] : 1;

    if (self->reg[EL_PATH + 7] != 0x10 || (!insert && on_its_way(self)))
        return;
    go_to(self, high_first(self, EL_PATH + 1), rpm * 10000 / 60,
          1000.0 * 10000 / 60 / (ms / 1000));
}

static uint8_t el7_set(struct strict_modbus *self, uint16_t at)
{
    const bool off = at == EL_DI1 && self->reg[at] != 0x83;

    if ((self->refuses_motion && at == EL_PATH) || (self->refuses_off && off))
        return DEVICE_FAILURE;
    if (at == EL_DI1)
        el7_input(self);
    else if (at == EL_PATH)
        el7_path(self);
    else if (at == EL_TRIGGER && self->reg[at] == 0x40)
        brake(self);
    else if (at == EL_TRIGGER && self->reg[at] == 0x20)
        home(self);
    else if (at == EL_RESET && self->reg[at] == 0x1111) {
        self->alarm = false;
        el7_input(self);
    }
    return 0;
}

static void el7_say(struct strict_modbus *self)
{
    self->reg[EL_ALARM] = self->alarm ? 0x0E0 : 0;
    self->reg[EL_STATE] = (uint16_t)((self->alarm ? 0x04 : 0x01) |
                                     (on_its_way(self) ? 0x02 : 0x10) |
                                     (says_homed(self) ? 0x08 : 0));
    put_high_first(self, EL_POSITION, position_of(self));
}

/* ---- Delta ASDA-A2 ---- */

enum { DE_OUTPUTS = 0x005C, DE_ALARM = 0x0002, DE_DI1 = 0x0214 };
enum { DE_STORAGE = 0x023C, DE_START = 0x050E, DE_POSITION = 0x0520 };
enum { DE_PR1 = 0x0606, DE_PR5 = 0x0616 };

static void asda_input(struct strict_modbus *self)
{
    if (low_first(self, DE_DI1) == 0x0001)
        torque_on(self);
    else
        torque_off(self);
}

static void asda_start(struct strict_modbus *self)
{
    const uint32_t path = low_first(self, DE_START);

    if (path == 1000)
        brake(self);
    else if (path == 0)
        home(self);
    else if (path == 1 || path == 5)
        go_to(self, low_first(self, path == 1 ? DE_PR1 : DE_PR5), self->speed,
              self->ramp);
}

static uint8_t asda_set(struct strict_modbus *self, uint16_t at)
{
    const bool off = at == DE_DI1 && low_first(self, at) != 0x0001;
    const bool motion = at == DE_PR1 || at == DE_PR5;

    if ((self->refuses_motion && motion) || (self->refuses_off && off))
        return DEVICE_FAILURE;
    if (at != DE_STORAGE && at != DE_START && at != DE_ALARM &&
        low_first(self, DE_STORAGE) != 5)
        self->eeprom++;
    if (at == DE_DI1)
        asda_input(self);
    else if (at == DE_START)
        asda_start(self);
    else if (at == DE_ALARM && self->reg[at] == 0)
        self->alarm = false;
    else if (at == DE_PR5 && low_first(self, DE_START) == 5)
        go_to(self, low_first(self, DE_PR5), self->speed, self->ramp);
    return 0;
}

static void asda_say(struct strict_modbus *self)
{
    uint16_t outputs = 0;

    if (!self->alarm)
        outputs |= 0x001;
    if (self->torque)
        outputs |= 0x002;
    if (!strict_modbus_moves(self))
        outputs |= 0x004;
    if (!on_its_way(self))
        outputs |= 0x010;
    if (self->alarm)
        outputs |= 0x040;
    if (says_homed(self))
        outputs |= 0x100;
    self->reg[DE_OUTPUTS] = outputs;
    self->reg[DE_ALARM] = self->alarm ? 0x001 : 0;
    put_low_first(self, DE_POSITION, position_of(self));
}

/* ---- Oriental AZ ---- */

enum { AZ_DATA = 0x0058, AZ_INPUTS = 0x007C, AZ_OUTPUTS = 0x007E };
enum { AZ_ALARM = 0x0080, AZ_POSITION = 0x00CC, AZ_RESET = 0x0180 };
enum { AZ_R_IN2 = 0x1204, AZ_R_OUT2 = 0x1224 };

static void az_inputs(struct strict_modbus *self)
{
    const uint32_t inputs = high_first(self, AZ_INPUTS);
    const bool excited = (inputs & 0x04) != 0; /* C-ON */
    const bool home_input = (inputs & 0x10) != 0;

    self->stop_input = (inputs & 0x20) != 0;
    if (self->stop_input)
        brake(self);
    else if (home_input && !self->home_input)
        home(self);
    self->home_input = home_input;
    if ((inputs & 0x40) != 0) { /* FREE */
        torque_off(self);
        self->fell = true;
    } else if (excited) {
        torque_on(self);
    } else {
        torque_off(self);
    }
}

static void az_data(struct strict_modbus *self)
{
    if (high_first(self, AZ_DATA + 14) == 1 && !self->stop_input)
        go_to(self, high_first(self, AZ_DATA + 4),
              high_first(self, AZ_DATA + 6), high_first(self, AZ_DATA + 8));
}

static uint8_t az_set(struct strict_modbus *self, uint16_t at)
{
    const bool off = at == AZ_INPUTS && (self->reg[at + 1] & 0x04) == 0;

    if ((self->refuses_motion && at == AZ_DATA) || (self->refuses_off && off))
        return DEVICE_FAILURE;
    if (at == AZ_INPUTS)
        az_inputs(self);
    else if (at == AZ_DATA)
        az_data(self);
    else if (at == AZ_RESET && self->reg[at + 1] == 1)
        self->alarm = false;
    return 0;
}

static void az_say(struct strict_modbus *self)
{
    uint32_t outputs = 0;

    if (self->torque)
        outputs |= 0x0004; /* CRNT */
    if (self->torque && !self->stop_input && !on_its_way(self))
        outputs |= 0x0020; /* READY */
    if (self->alarm)
        outputs |= 0x0080;
    if (says_homed(self))
        outputs |= 0x0010;
    if (on_its_way(self))
        outputs |= 0x2000;
    else
        outputs |= 0x4000;
    put_high_first(self, AZ_OUTPUTS, outputs);
    put_high_first(self, AZ_ALARM, self->alarm ? 0x20 : 0);
    put_high_first(self, AZ_POSITION, position_of(self));
}

/* ---- what they have in common ---- */

static const struct {
    uint8_t (*set)(struct strict_modbus *self, uint16_t at);
    void (*say)(struct strict_modbus *self);
    struct {
        uint16_t at, count; /* that exist */
    } range[12];
} kinds[] = {
    [STRICT_LEXIUM] = { lexium_set,
                        lexium_say,
                        { { LX_EXCL, 2 },
                          { LX_GUARD, 2 },
                          { LX_CONTROL, 6 },
                          { LX_TARGET, 4 },
                          { LX_ALARM, 2 },
                          { LX_POSITION, 2 } } },
    [STRICT_EL7] = { el7_set,
                     el7_say,
                     { { 0x0003, 1 },
                       { EL_DI1, 1 },
                       { EL_ALARM, 3 },
                       { EL_RESET, 1 },
                       { EL_TRIGGER, 1 },
                       { EL_POSITION, 2 },
                       { EL_PATH, 8 } } },
    [STRICT_ASDA] = { asda_set,
                      asda_say,
                      { { DE_ALARM, 2 },
                        { DE_OUTPUTS, 2 },
                        { DE_DI1, 2 },
                        { DE_STORAGE, 2 },
                        { DE_START, 2 },
                        { DE_POSITION, 2 },
                        { DE_PR1, 2 },
                        { DE_PR5, 2 } } },
    [STRICT_AZ] = { az_set,
                    az_say,
                    { { AZ_DATA, 16 },
                      { AZ_INPUTS, 6 },
                      { AZ_POSITION, 2 },
                      { AZ_RESET, 2 },
                      { AZ_R_IN2, 2 },
                      { AZ_R_OUT2, 2 } } },
};

static bool exists(const struct strict_modbus *self, unsigned at,
                   unsigned count)
{
    for (unsigned i = 0; kinds[self->kind].range[i].count > 0; i++) {
        const unsigned first = kinds[self->kind].range[i].at;
        const unsigned end = first + kinds[self->kind].range[i].count;

        if (at >= first && at + count <= end)
            return true;
    }
    return false;
}

static uint8_t strict_get(struct modbus_slave *slave, enum modbus_space space,
                          uint16_t address, uint16_t count, uint16_t *value)
{
    struct strict_modbus *self = strict_of(slave);

    if (space != MODBUS_HOLDING || !exists(self, address, count))
        return ILLEGAL_ADDRESS;
    self->heard_ns = self->world->now_ns;
    kinds[self->kind].say(self);
    memcpy(value, &self->reg[address], count * sizeof *value);
    return 0;
}

/* Refused: nothing has changed. */
static uint8_t strict_set(struct modbus_slave *slave, enum modbus_space space,
                          uint16_t address, uint16_t count,
                          const uint16_t *value)
{
    struct strict_modbus *self = strict_of(slave);
    uint16_t before[HAL_MODBUS_WRITE_MAX];
    uint8_t exception;

    if (space != MODBUS_HOLDING || !exists(self, address, count))
        return ILLEGAL_ADDRESS;
    self->heard_ns = self->world->now_ns;
    memcpy(before, &self->reg[address], count * sizeof *value);
    memcpy(&self->reg[address], value, count * sizeof *value);
    exception = kinds[self->kind].set(self, address);
    if (exception != 0)
        memcpy(&self->reg[address], before, count * sizeof *value);
    return exception;
}

static const struct modbus_slave_ops strict_slave_ops = { strict_get,
                                                          strict_set };

/* ---- time ---- */

static double clamp(double value, double most)
{
    return fmax(-most, fmin(most, value));
}

/* A trapezoid to its target, or to rest. */
static void profile(struct strict_modbus *self)
{
    const double displacement = self->target - self->pos;
    const double step = self->path_ramp * LOOP_S;
    double want = 0;

    if (!self->braking)
        want = copysign(fmin(self->path_speed,
                             sqrt(2 * self->path_ramp * fabs(displacement))),
                        displacement);
    self->vel += clamp(want - self->vel, step);
    self->pos += self->vel * LOOP_S;
    if (self->braking && fabs(self->vel) <= step) {
        self->vel = 0;
        self->target = self->pos;
    }
    if (!self->braking &&
        fabs(self->target - self->pos) <= 2 * step * LOOP_S + 1 &&
        fabs(self->vel) <= 2 * step + STANDING) {
        self->pos = self->target;
        self->vel = 0;
        if (self->homing)
            home_reached(self);
    }
}

static void strict_run(struct sim_member *member, int64_t now_ns)
{
    struct strict_modbus *self =
        CONTAINER_OF(member, struct strict_modbus, member);

    self->due_ns = now_ns + MS;
    if (self->enabling && now_ns >= self->enabled_ns) {
        self->enabling = false;
        self->torque = true;
        stand(self);
    }
    if (self->home_ns != 0 && now_ns >= self->home_ns)
        home_begin(self);
    if (self->kind == STRICT_LEXIUM)
        lexium_loop(self);
    if (self->torque) {
        profile(self);
    } else {
        self->vel *= 0.99; /* coasts */
        self->pos += self->vel * LOOP_S;
    }
}

static int64_t strict_due_ns(const struct sim_member *member)
{
    return CONTAINER_OF_CONST(member, struct strict_modbus, member)->due_ns;
}

static const struct sim_member_ops strict_member_ops = {
    .due_ns = strict_due_ns,
    .run = strict_run,
};

/* ---- what happens to it ---- */

void strict_modbus_alarm(struct strict_modbus *self)
{
    if (self->kind == STRICT_LEXIUM) {
        lexium_fault(self);
        return;
    }
    self->alarm = true;
    self->torque = self->enabling = false; /* by itself: no cut of ours */
}

static void set_up(struct strict_modbus *self)
{
    self->power = STRICT_SWITCH_ON_DISABLED;
    if (self->kind == STRICT_EL7)
        self->reg[0x0003] = 6;
    if (self->kind == STRICT_AZ) {
        put_high_first(self, AZ_R_IN2, 2);
        put_high_first(self, AZ_R_OUT2, 142);
    }
}

void strict_modbus_reboot(struct strict_modbus *self)
{
    const uint16_t di1 = self->reg[EL_DI1];

    memset(self->reg, 0, sizeof self->reg);
    self->torque = self->enabling = self->alarm = self->stop_input = false;
    self->homing = self->homed = self->was_homed = self->home_input = false;
    self->home_ns = self->homed_until_ns = 0;
    self->set_point_bit = self->reset_bit = false;
    self->vel = 0;
    set_up(self);
    if (self->kind == STRICT_EL7) { /* DI1 is stored: on with no wire */
        self->reg[EL_DI1] = di1;
        el7_input(self);
    }
}

void strict_modbus_init(struct strict_modbus *self, struct sim_world *world,
                        enum strict_modbus_kind kind, double counts)
{
    memset(self, 0, sizeof *self);
    self->member.ops = &strict_member_ops;
    self->slave.ops = &strict_slave_ops;
    self->world = world;
    self->kind = kind;
    self->due_ns = world->now_ns + MS;
    self->speed = 200000;
    self->ramp = 2e6;
    self->home_away = HOME_AWAY;
    self->path_ramp = self->ramp;
    self->pos = self->target = counts;
    set_up(self);
    (void)sim_world_add(world, &self->member);
}
