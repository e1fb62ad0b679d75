/* sim/device/modbus/leadshine_pr.c - path control (PR) of Leadshine's RS-485
 * drives, which the servos and the steppers share: Pr8.yy at 0x6000 + yy, Pr9.yy
 * at 0x6200 + yy, control word 0x1801.  32-bit values have the upper word first.
 *
 * Sources: Leadshine CS2RS and iEM-RS user manuals, chapter "PR mode"; the EL7-RS
 * manual V2.0.1 as public drivers quote it. */
#include "sim/device/modbus/makers.h"

enum {
    PR_CONTROL_WORD = 0x1801,
    PR_TRIGGER = 0x6002,  /* Pr8.02 */
    PR_DEMAND = 0x602A,   /* Pr8.42, 43: commanded position */
    PR_POSITION = 0x602C, /* Pr8.44, 45: position of the motor */
    PR_PATH = 0x6200,     /* Pr9.00: path 0, eight registers each */
    PR_PATHS = 16,
};

/* Of a path, from its first register on. */
enum { MODE, POSITION_HIGH, POSITION_LOW, VELOCITY, RISE, FALL, PAUSE, START };
enum { MODE_TYPE = 0x0F, MODE_INS = 0x10, MODE_RELATIVE = 0x40 };
enum { TYPE_POSITION = 1, TYPE_VELOCITY = 2, TYPE_HOMING = 3 };
#define FAR_COUNTS (INT64_C(1) << 32)

/* Position in pulses, velocity in r/min, ramps in ms per 1000 r/min. */
static void pr_start(struct sim_modbus_servo *self, unsigned path,
                     bool interrupts)
{
    const uint16_t at = (uint16_t)(PR_PATH + 8 * path);
    const uint16_t mode = self->reg[at + MODE];
    const int64_t rpm = (int16_t)self->reg[at + VELOCITY];
    int64_t to = sim_modbus_pair(self, (uint16_t)(at + POSITION_HIGH));

    if (((mode & MODE_INS) != 0) != interrupts && sim_modbus_servo_moves(self))
        return;
    self->path = path;
    if ((mode & MODE_TYPE) == TYPE_HOMING)
        sim_modbus_servo_home(self);
    if ((mode & MODE_TYPE) == TYPE_VELOCITY)
        to = rpm < 0 ? -FAR_COUNTS : FAR_COUNTS;
    else if ((mode & MODE_TYPE) != TYPE_POSITION)
        return;
    else if ((mode & MODE_RELATIVE) != 0)
        to += self->target_q16 >> 16;
    sim_modbus_servo_go_to(
        self, to, sim_modbus_rpm(self, rpm < 0 ? -rpm : rpm),
        sim_modbus_ms_per_1000_rpm(self, self->reg[at + RISE]),
        sim_modbus_ms_per_1000_rpm(self, self->reg[at + FALL]));
}

/* Pr8.02: 0x10 + P starts path P, 0x20 homes, 0x21 sets zero here, 0x40 stops. */
static void pr_trigger(struct sim_modbus_servo *self, bool interrupts)
{
    const uint16_t trigger = self->reg[PR_TRIGGER];

    if (trigger >= 0x10 && trigger < 0x10 + PR_PATHS)
        pr_start(self, trigger - 0x10u, interrupts);
    else if (trigger == 0x20 || trigger == 0x21)
        sim_modbus_servo_home(self);
    else if (trigger == 0x40)
        sim_modbus_servo_stop(self);
}

void sim_leadshine_pr_set(struct sim_modbus_servo *self, uint16_t at,
                          uint16_t count, bool interrupts)
{
    if (sim_modbus_is_in(PR_TRIGGER, at, count))
        pr_trigger(self, interrupts);
    /* the eighth register of a path: 0x10 starts it in the same request */
    for (unsigned path = 0; path < PR_PATHS; path++) {
        const uint16_t start = (uint16_t)(PR_PATH + 8 * path + START);
        if (sim_modbus_is_in(start, at, count) && self->reg[start] == 0x10)
            pr_start(self, path, interrupts);
    }
    if (sim_modbus_is_in(PR_CONTROL_WORD, at, count) &&
        self->reg[PR_CONTROL_WORD] == 0x1111)
        self->fault = false;
}

/* Pr8.02 reads back as 0x100 + P while path P runs, then as P. */
void sim_leadshine_pr_say(struct sim_modbus_servo *self)
{
    self->reg[PR_TRIGGER] =
        (uint16_t)(self->path + (sim_modbus_servo_moves(self) ? 0x100 : 0));
    sim_modbus_put_pair(self, PR_DEMAND, self->demand_q16 >> 16);
    sim_modbus_put_pair(self, PR_POSITION, sim_modbus_servo_reported(self));
}
