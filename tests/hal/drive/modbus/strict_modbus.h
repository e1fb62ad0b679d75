/* tests/hal/drive/modbus/strict_modbus.h - Modbus servos as their makers'
 * manuals describe them, not as our maps use them: each does what a register
 * says, from the states in which it may, and nothing else.  The test sees what
 * no register tells: whether there is torque, and whether it was taken away in
 * motion.
 *
 * sim/device/modbus has drives of the same makers, on purpose: two that were
 * written by themselves, from the same manuals.  Those are what a user runs, with
 * the registers and the motor of a drive; these are witnesses of the way to no
 * torque, and have what those leave out: a fault reaction that still has torque,
 * a brake that holds or falls, what is worn in the EEPROM, a drive that refuses
 * to be switched off.  Neither uses the other, nor our maps. */
#ifndef TESTS_HAL_DRIVE_MODBUS_STRICT_MODBUS_H
#define TESTS_HAL_DRIVE_MODBUS_STRICT_MODBUS_H

#include <stdbool.h>

#include "hal/modbus/slave.h"
#include "sim/world.h"

enum strict_modbus_kind {
    /* CiA 402 in registers, Lexium 32: 6914 DCOMcontrol, 6916 _DCOMstatus ...;
     * from Quick stop active only Disable voltage leads on (transition 12), and
     * Fault reaction active has torque until it stands. */
    STRICT_LEXIUM,
    /* Leadshine PR: SRV-ON by the function of DI1, which is stored; path 0. */
    STRICT_EL7,
    /* Delta ASDA-A2: SON by the function of DI1; what is written to a parameter
     * wears the EEPROM while P2-30 is not 5, which power-off forgets. */
    STRICT_ASDA,
    /* Oriental AZ with R-IN2 = C-ON and R-OUT2 = CRNT: without C-ON the brake
     * holds, FREE releases it. */
    STRICT_AZ,
};

enum strict_modbus_power {
    STRICT_SWITCH_ON_DISABLED,
    STRICT_READY_TO_SWITCH_ON,
    STRICT_SWITCHED_ON,
    STRICT_OPERATION_ENABLED,
    STRICT_QUICK_STOP_ACTIVE,
    STRICT_FAULT_REACTION,
    STRICT_FAULT,
};

struct strict_modbus {
    struct sim_member member;
    struct modbus_slave slave;
    struct sim_world *world;
    enum strict_modbus_kind kind;

    /* what a test may set */
    double speed, ramp;       /* its own, counts/s, counts/s2 */
    bool refuses_motion;      /* exception 4 to every set point */
    bool refuses_off;         /* exception 4 to what would take its torque */
    bool lies;                /* a position far away */
    double home_away;         /* from where homing begins to home, counts */
    int64_t home_late_ns;     /* from the write that homes to its motion */
    int64_t homed_lingers_ns; /* from then until its flag is clear */
    bool homed_stays;         /* it is never cleared but by power-off */
    bool homes_not;           /* the write that homes does nothing */
    bool homed_hides; /* Lexium: its flag is clear until the mode is homing */

    /* what a test looks at */
    bool torque, fell;   /* fell: no torque and the brake open */
    bool homing, homed;  /* by itself */
    unsigned cuts;       /* times that torque went in motion */
    unsigned energised;  /* times that it came */
    unsigned set_points; /* taken */
    unsigned eeprom;     /* writes */
    double pos, vel;     /* counts, counts/s */

    /* private */
    uint16_t reg[65536];
    enum strict_modbus_power power;
    bool alarm, enabling, braking, stop_input, set_point_bit, reset_bit;
    bool home_input;
    bool was_homed;
    int64_t due_ns, enabled_ns, heard_ns, home_ns, homed_until_ns;
    double target, path_speed, path_ramp;
};

/* Standing at `counts`, without torque. */
void strict_modbus_init(struct strict_modbus *self, struct sim_world *world,
                        enum strict_modbus_kind kind, double counts);
void strict_modbus_alarm(struct strict_modbus *self);
/* Power off and on again: what is stored stays. */
void strict_modbus_reboot(struct strict_modbus *self);
bool strict_modbus_moves(const struct strict_modbus *self);

#endif
