/* sim/device/modbus/delta_asda.c - Delta ASDA-A2 and ASDA-B2 in PR mode: the
 * parameter Pa-bb is the pair of registers at a * 0x100 + 2 * bb, lower word
 * first.
 *
 * Sources: ASDA-A2 user manuals of 2011, 2012 and 2017, chapters 8 (parameters)
 * and 9 (communication), compared with two public programs; marked where neither
 * says. */
#include "sim/device/modbus/makers.h"

enum {
    P0_01 = 0x0002, /* alarm; 0 written resets it (unverified) */
    P0_46 = 0x005C, /* outputs */
    P1_44 = 0x0158, /* electronic gear, P1-45 its denominator */
    P2_10 = 0x0214, /* function of input 1 */
    P2_30 = 0x023C, /* 5: nothing is stored (unverified) */
    P5_07 = 0x050E, /* starts PR n */
    P5_16 = 0x0520, /* encoder, user units */
    P6_00 = 0x0600, /* definition of PR 0, P6-01 its data; four each */
    PR_MAX = 63,
};

#define ILLEGAL_VALUE 0x03

/* P0-46; the order is unverified */
enum { SRDY = 1, SON = 2, ZSPD = 4, TPOS = 0x10, ALRM = 0x40, HOME = 0x100 };

#define STEEP 100 /* full speed in 10 ms */

static const struct sim_modbus_range asda_ranges[] = {
    { .at = P0_01, .count = 4 },
    { .at = 0x0012, .count = 10, .read_only = true }, /* P0-09 ..: monitors */
    { .at = P0_46, .count = 2, .read_only = true },
    { .at = P1_44, .count = 4 },
    { .at = P2_10, .count = 16 },
    { .at = P2_30, .count = 2 },
    { .at = 0x0300, .count = 14 }, /* P3-00 .. P3-06 */
    { .at = 0x040E, .count = 2 },  /* P4-07 */
    { .at = P5_07, .count = 2 },
    { .at = P5_16, .count = 2 },
    { .at = 0x0528, .count = 32 }, /* P5-20 ..: times of ramps */
    { .at = 0x0578, .count = 32 }, /* P5-60 ..: speeds */
    { .at = P6_00, .count = 4 * (PR_MAX + 1) },
    { .count = 0 },
};

/* Absolute, at the speed and ramps that its definition names: set up for what
 * they are for, PR 5 to be overtaken, the others to run alone. */
static void asda_go(struct sim_modbus_servo *self, unsigned path)
{
    const struct sim_plant_config *motor = &self->config.plant;
    const int64_t ramp = path == 5 ? STEEP * motor->vel_max_counts_s
                                   : motor->acc_max_counts_s2 / 2 + 1;
    const int64_t speed =
        path == 5 ? motor->vel_max_counts_s : motor->vel_max_counts_s / 3 * 2;

    self->path = path;
    self->follows = true;
    sim_modbus_servo_go_to(
        self, sim_modbus_pair(self, (uint16_t)(P6_00 + 4 * path + 2)), speed,
        ramp, ramp);
}

/* P5-07: 0 homes, 1 .. 63 starts that PR, 1000 stops. */
static void asda_start(struct sim_modbus_servo *self)
{
    const int64_t number = sim_modbus_pair(self, P5_07);

    if (number >= 1 && number <= PR_MAX)
        asda_go(self, (unsigned)number);
    else
        self->follows = false;
    if (number == 0)
        sim_modbus_servo_home(self);
    if (number == 1000)
        sim_modbus_servo_stop(self);
}

/* P2-10: SON is 1; with 0x100 the input is normally open, so that it is off
 * with nothing wired. */
static void asda_input(struct sim_modbus_servo *self)
{
    if (sim_modbus_pair(self, P2_10) == 0x0001)
        sim_modbus_servo_enable(self);
    else
        sim_modbus_servo_torque_off(self);
}

static uint8_t asda_set(struct sim_modbus_servo *self, uint16_t at,
                        uint16_t count)
{
    const uint16_t data = (uint16_t)(P6_00 + 4 * self->path + 2);
    const int64_t storage = sim_modbus_pair(self, P2_30);

    /* 0 .. 8 (unverified: with which exception more is refused) */
    if (storage < 0 || storage > 8)
        return ILLEGAL_VALUE;
    if (sim_modbus_is_in(P2_10, at, count))
        asda_input(self);
    if (sim_modbus_is_in(P5_07, at, count))
        asda_start(self);
    /* a PR that was started goes to what is written into its data: a public
     * program streams so */
    else if (self->follows && sim_modbus_is_in(data, at, count))
        asda_go(self, self->path);
    if (sim_modbus_is_in(P0_01, at, count) && self->reg[P0_01] == 0 &&
        self->fault) {
        self->fault = false;
        asda_input(self);
    }
    return 0;
}

static void asda_say(struct sim_modbus_servo *self)
{
    const bool moves = sim_modbus_servo_moves(self);
    uint16_t outputs = self->fault ? ALRM : SRDY;

    if (self->enabled)
        outputs |= SON;
    if (!moves)
        outputs |= ZSPD;
    if (sim_modbus_servo_arrived(self))
        outputs |= TPOS;
    if (self->homed)
        outputs |= HOME;
    self->reg[P0_46] = outputs;
    sim_modbus_put_pair(self, P0_01, sim_modbus_alarm(self));
    sim_modbus_put_pair(self, P5_16, sim_modbus_servo_reported(self));
    /* P5-07 reads back as n + 10000 while PR n runs, n + 20000 when it is done
     * (unverified) */
    sim_modbus_put_pair(self, P5_07, self->path + (moves ? 10000 : 20000));
}

static void asda_set_up(struct sim_modbus_servo *self)
{
    sim_modbus_put_pair(self, P2_10, 0x0101);
    sim_modbus_put_pair(self, P1_44, 1);
    sim_modbus_put_pair(self, P1_44 + 2, 1);
}

const struct sim_modbus_maker sim_modbus_delta_asda = {
    .name = "delta-asda",
    .title = "Delta ASDA-A2",
    .order = MODBUS_CDAB,
    .resolution = 100000, /* user units, by the gear */
    .alarm = 0x001,       /* over-current */
    .functions = SIM_MODBUS_PLAIN,
    .registers_max = 9, /* 9 to 20 by version */
    .too_many = 0x04,
    .read_only = 0x06,
    .range = asda_ranges,
    .set = asda_set,
    .say = asda_say,
    .behaviour = { .slave = &sim_modbus_maker_slave, .set_up = asda_set_up },
};
