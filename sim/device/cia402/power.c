/* sim/device/cia402/power.c - the power state machine (CiA 402-2 6.3) and
 * faults.
 *
 *      start-up -0-> Not ready -1-> Switch on disabled <---------15--- Fault
 *                                      | 2     ^ 7                      ^ 14
 *                                   Ready to switch on            Fault reaction
 *                                      | 3     ^ 6                      ^ 13
 *                                   Switched on                     (any state)
 *                                      | 4     ^ 5
 *                                   Operation enabled -11-> Quick stop active
 *                                                     <-16-
 *
 * and to Switch on disabled from Switched on (10), Operation enabled (9) and
 * Quick stop active (12), from Operation enabled to Ready (8).  0 and 1 happen
 * with the boot-up message.  4 waits for the brake.  5 and 8 may ramp first,
 * 12 follows the quick stop ramp by itself for the options 0 to 4, 14 follows
 * the fault reaction ramp. */
#include "sim/device/cia402/parts.h"

enum cia402_command {
    CIA402_SHUTDOWN,
    CIA402_SWITCH_ON, /* and disable operation */
    CIA402_ENABLE,
    CIA402_DISABLE_VOLTAGE,
    CIA402_QUICK_STOP,
};

#define CIA402_CW_FAULT_RESET 0x0080
#define CIA402_CW_HALT        0x0100

static enum cia402_command cia402_power_decode(uint16_t controlword)
{
    if (!(controlword & 2))
        return CIA402_DISABLE_VOLTAGE;
    if (!(controlword & 4))
        return CIA402_QUICK_STOP;
    if (!(controlword & 1))
        return CIA402_SHUTDOWN;
    return controlword & 8 ? CIA402_ENABLE : CIA402_SWITCH_ON;
}

/* ---- ramps ------------------------------------------------------------- */

/* Options 1 to 4 of 0x605A, 0x605D, 0x605E: how fast. */
static void cia402_power_ramp(struct sim_cia402 *self, int64_t option)
{
    int64_t acc = self->config.plant.acc_max_counts_s2; /* current limit */

    if (option == 1)
        acc = self->value[CIA402_PROFILE_DECELERATION];
    if (option == 2)
        acc = self->value[CIA402_QUICK_STOP_DECELERATION];
    cia402_motion_ramp(self, acc);
}

static void cia402_power_enter(struct sim_cia402 *self, enum cia402_power state)
{
    self->power = (uint8_t)state;
    self->after_ramp = CIA402_POWER_NOT_READY;
    self->halted = false;
    cia402_timer_stop(self, SIM_CIA402_BRAKE);
    if (state != CIA402_POWER_ENABLED) {
        cia402_motion_off(self);
        return;
    }
    cia402_motion_follow(self);
    cia402_mode_begin(self);
}

/* Leave Operation enabled for `state`, with the profile ramp if option = 1. */
static void cia402_power_leave(struct sim_cia402 *self, enum cia402_power state,
                               int64_t option)
{
    if (self->after_ramp == state) /* on its way */
        return;
    if (option == 0) {
        cia402_power_enter(self, state);
        return;
    }
    self->after_ramp = (uint8_t)state;
    cia402_power_ramp(self, 1);
}

void cia402_power_at_rest(struct sim_cia402 *self)
{
    if (self->power == CIA402_POWER_REACTION)
        cia402_power_enter(self, CIA402_POWER_FAULT); /* 14 */
    else if (self->after_ramp != CIA402_POWER_NOT_READY)
        cia402_power_enter(self, (enum cia402_power)self->after_ramp);
}

/* ---- transitions ------------------------------------------------------- */

/* 2 and 3. */
static void cia402_power_up(struct sim_cia402 *self, enum cia402_power state)
{
    if (!self->no_power)
        cia402_power_enter(self, state);
}

static void cia402_power_halt(struct sim_cia402 *self)
{
    bool halt = (self->controlword & CIA402_CW_HALT) != 0;

    if (halt && !self->halted) {
        self->halted = true;
        cia402_power_ramp(self, cia402_od_signed(self, CIA402_HALT_OPTION));
    } else if (!halt && self->halted) {
        self->halted = false;
        cia402_motion_follow(self);
    }
}

void cia402_power_brake_released(struct sim_cia402 *self)
{
    cia402_power_enter(self, CIA402_POWER_ENABLED);
    cia402_power_halt(self);
}

/* 4, once the brake is released. */
static void cia402_power_release_brake(struct sim_cia402 *self)
{
    bool releasing = self->timer_ns[SIM_CIA402_BRAKE] != SIM_WORLD_NEVER;

    if (releasing || self->value[CIA402_MODE] == 0)
        return;
    cia402_motion_stand(self);
    cia402_timer_set(self, SIM_CIA402_BRAKE,
                     cia402_now_ns(self) + self->config.brake_release_ns);
    if (self->config.brake_release_ns == 0)
        cia402_power_brake_released(self);
}

/* 11. */
static void cia402_power_quick_stop(struct sim_cia402 *self)
{
    int64_t option = cia402_od_signed(self, CIA402_QUICK_STOP_OPTION);

    if (option == 0) {
        cia402_power_enter(self, CIA402_POWER_DISABLED);
        return;
    }
    self->power = CIA402_POWER_QUICK_STOP;
    self->halted = false;
    self->after_ramp = CIA402_POWER_NOT_READY;
    if (option <= 4)
        self->after_ramp = CIA402_POWER_DISABLED;
    cia402_power_ramp(self, (option - 1) % 4 + 1);
}

static void cia402_power_command_disabled(struct sim_cia402 *self,
                                          enum cia402_command command)
{
    if (command == CIA402_SHUTDOWN)
        cia402_power_up(self, CIA402_POWER_READY); /* 2 */
}

static void cia402_power_command_ready(struct sim_cia402 *self,
                                       enum cia402_command command)
{
    if (command == CIA402_SWITCH_ON)
        cia402_power_up(self, CIA402_POWER_ON); /* 3 */
    else if (command == CIA402_DISABLE_VOLTAGE || command == CIA402_QUICK_STOP)
        cia402_power_enter(self, CIA402_POWER_DISABLED); /* 7 */
}

static void cia402_power_command_on(struct sim_cia402 *self,
                                    enum cia402_command command)
{
    if (command == CIA402_ENABLE)
        cia402_power_release_brake(self); /* 4 */
    else if (command == CIA402_SHUTDOWN)
        cia402_power_enter(self, CIA402_POWER_READY); /* 6 */
    else if (command == CIA402_SWITCH_ON)
        cia402_power_enter(self, CIA402_POWER_ON); /* brake closes again */
    else
        cia402_power_enter(self, CIA402_POWER_DISABLED); /* 10 */
}

static void cia402_power_command_enabled(struct sim_cia402 *self,
                                         enum cia402_command command)
{
    if (command == CIA402_SWITCH_ON) /* 5 */
        cia402_power_leave(self, CIA402_POWER_ON,
                           cia402_od_signed(self, CIA402_DISABLE_OPTION));
    else if (command == CIA402_SHUTDOWN) /* 8 */
        cia402_power_leave(self, CIA402_POWER_READY,
                           cia402_od_signed(self, CIA402_SHUTDOWN_OPTION));
    else if (command == CIA402_DISABLE_VOLTAGE)
        cia402_power_enter(self, CIA402_POWER_DISABLED); /* 9 */
    else if (command == CIA402_QUICK_STOP)
        cia402_power_quick_stop(self); /* 11 */
    else if (self->after_ramp != CIA402_POWER_NOT_READY)
        cia402_power_enter(self, CIA402_POWER_ENABLED); /* not leaving */
    else {
        cia402_power_halt(self);
        cia402_mode_control(self);
    }
}

static void cia402_power_command_quick_stop(struct sim_cia402 *self,
                                            enum cia402_command command)
{
    if (command == CIA402_DISABLE_VOLTAGE)
        cia402_power_enter(self, CIA402_POWER_DISABLED); /* 12 */
    else if (command == CIA402_ENABLE &&
             cia402_od_signed(self, CIA402_QUICK_STOP_OPTION) >= 5)
        cia402_power_enter(self, CIA402_POWER_ENABLED); /* 16 */
}

static void cia402_power_command_none(struct sim_cia402 *self,
                                      enum cia402_command command)
{
    (void)self;
    (void)command;
}

typedef void cia402_power_handler(struct sim_cia402 *, enum cia402_command);

static cia402_power_handler *const cia402_power_handlers[] = {
    [CIA402_POWER_NOT_READY] = cia402_power_command_none,
    [CIA402_POWER_DISABLED] = cia402_power_command_disabled,
    [CIA402_POWER_READY] = cia402_power_command_ready,
    [CIA402_POWER_ON] = cia402_power_command_on,
    [CIA402_POWER_ENABLED] = cia402_power_command_enabled,
    [CIA402_POWER_QUICK_STOP] = cia402_power_command_quick_stop,
    [CIA402_POWER_REACTION] = cia402_power_command_none,
    [CIA402_POWER_FAULT] = cia402_power_command_none,
};

/* 15; only the edge counts. */
static void cia402_power_reset_fault(struct sim_cia402 *self)
{
    cia402_power_enter(self, CIA402_POWER_DISABLED);
    self->following_error = false;
    cia402_com_error_gone(self, 0xFF);
}

void cia402_power_control(struct sim_cia402 *self)
{
    uint16_t controlword = (uint16_t)self->value[CIA402_CONTROLWORD];
    uint16_t rising = controlword & (uint16_t)~self->controlword;

    sim_servo_advance(&self->base);
    self->controlword_before = self->controlword;
    self->controlword = controlword;
    if (self->power == CIA402_POWER_FAULT && (rising & CIA402_CW_FAULT_RESET))
        cia402_power_reset_fault(self);
    else
        cia402_power_handlers[self->power](self,
                                           cia402_power_decode(controlword));
}

void cia402_power_reset(struct sim_cia402 *self)
{
    self->controlword = 0;
    self->mode = 0;
    self->zero_counts = 0;
    cia402_power_enter(self, CIA402_POWER_DISABLED); /* 0, 1 */
}

/* ---- faults ------------------------------------------------------------ */

/* 13, and 14 at once where there is nothing to ramp. */
static void cia402_power_trip(struct sim_cia402 *self)
{
    int64_t option = cia402_od_signed(self, CIA402_FAULT_OPTION);

    if (self->power == CIA402_POWER_REACTION ||
        self->power == CIA402_POWER_FAULT)
        return;
    if (self->motion == CIA402_MOTION_OFF || option == 0) {
        cia402_power_enter(self, CIA402_POWER_FAULT);
        return;
    }
    cia402_timer_stop(self, SIM_CIA402_BRAKE);
    self->power = CIA402_POWER_REACTION;
    self->after_ramp = CIA402_POWER_NOT_READY;
    self->halted = false;
    cia402_power_ramp(self, option);
}

void cia402_power_fault(struct sim_cia402 *self, uint16_t code, uint8_t bits)
{
    cia402_com_error(self, code, bits);
    cia402_power_trip(self);
}

void cia402_power_connection_lost(struct sim_cia402 *self)
{
    if (self->power != CIA402_POWER_ENABLED)
        return;
    sim_servo_advance(&self->base);
    switch (cia402_od_signed(self, CIA402_ABORT_OPTION)) {
    case 1:
        cia402_power_trip(self);
        break;
    case 2:
        cia402_power_enter(self, CIA402_POWER_DISABLED);
        break;
    case 3:
        cia402_power_quick_stop(self);
        break;
    default:
        break;
    }
}

void cia402_power_lost(struct sim_cia402 *self)
{
    if (self->power == CIA402_POWER_REACTION)
        cia402_power_enter(self, CIA402_POWER_FAULT);
    else if (self->power > CIA402_POWER_DISABLED &&
             self->power != CIA402_POWER_FAULT)
        cia402_power_enter(self, CIA402_POWER_DISABLED);
}

/* ---- statusword -------------------------------------------------------- */

static bool cia402_power_is_resting(const struct sim_cia402 *self)
{
    return self->halted && self->motion == CIA402_MOTION_STAND;
}

/* Bits 10, 12 and 13; a halt has its own bit 10. */
static unsigned cia402_power_mode_bits(const struct sim_cia402 *self)
{
    unsigned bits = self->following_error ? 1u << 13 : 0;

    if (self->power == CIA402_POWER_ENABLED)
        bits |= cia402_mode_status(self);
    if (self->halted)
        bits &= ~(1u << 10);
    return bits | (cia402_power_is_resting(self) ? 1u << 10 : 0);
}

uint16_t cia402_power_statusword(const struct sim_cia402 *self)
{
    static const uint8_t state[] = {
        [CIA402_POWER_NOT_READY] = 0x00, [CIA402_POWER_DISABLED] = 0x40,
        [CIA402_POWER_READY] = 0x21,     [CIA402_POWER_ON] = 0x23,
        [CIA402_POWER_ENABLED] = 0x27,   [CIA402_POWER_QUICK_STOP] = 0x07,
        [CIA402_POWER_REACTION] = 0x0F,  [CIA402_POWER_FAULT] = 0x08,
    };
    bool warning = self->value[CIA402_ERROR_REGISTER] != 0 &&
                   self->power < CIA402_POWER_REACTION;
    unsigned word = state[self->power] | 1u << 9; /* remote */

    word |= self->no_power ? 0 : 1u << 4;
    word |= warning ? 1u << 7 : 0;
    word |= self->limited ? 1u << 11 : 0;
    return (uint16_t)(word | cia402_power_mode_bits(self));
}
