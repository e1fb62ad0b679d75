/* sim/device/servo.c - see servo.h. */
#include "sim/device/servo.h"

#include <math.h>
#include <stddef.h>

#define SERVO_LOOP_NS     125000
#define SERVO_LOOP_MIN_NS 62500
#define SERVO_LOOP_MAX_NS 1000000

static void sim_servo_on_frame(void *context, const struct hal_can_frame *frame)
{
    struct sim_servo *self = context;

    if (!self->deaf && self->world->now_ns >= self->boot_ns)
        self->ops->on_frame(self, frame);
}

int sim_servo_init(struct sim_servo *self, struct sim_can_bus *bus,
                   const struct sim_servo_ops *ops,
                   const struct sim_plant_config *plant, int64_t start_counts,
                   int64_t loop_ns)
{
    struct sim_world *world = bus->world;
    int err;

    *self =
        (struct sim_servo){ .member.ops = &ops->member,
                            .world = world,
                            .ops = ops,
                            .loop_ns = loop_ns != 0 ? loop_ns : SERVO_LOOP_NS,
                            .plant_ns = world->now_ns };
    if (self->loop_ns < SERVO_LOOP_MIN_NS || self->loop_ns > SERVO_LOOP_MAX_NS)
        return MOTION_E_ARG;
    err = sim_plant_init(&self->plant, plant, start_counts);
    if (err < 0)
        return err;
    sim_can_port_init(&self->port, bus);
    self->port.on_frame = sim_servo_on_frame;
    self->port.context = self;
    return sim_world_add_to(world, &bus->group, &self->member);
}

/* ---- time ---- */

void sim_servo_advance(struct sim_servo *self)
{
    while (self->plant_ns < self->world->now_ns) {
        int64_t dt_ns = self->world->now_ns - self->plant_ns;

        if (dt_ns > self->loop_ns)
            dt_ns = self->loop_ns;
        self->ops->step(self, dt_ns);
    }
}

static void sim_servo_feel(struct sim_servo *self, bool torque)
{
    const struct sim_winding *const winding = &self->plant.winding;
    const enum sim_servo_heat heat = winding->hot && torque ? SIM_SERVO_HOT
                                     : winding->warm        ? SIM_SERVO_WARM
                                                            : SIM_SERVO_COOL;

    if (heat == self->heat || self->ops->heat == NULL)
        return;
    self->heat = (uint8_t)heat;
    self->ops->heat(self, heat);
}

void sim_servo_turn(struct sim_servo *self, bool torque, int64_t demand_q24,
                    int64_t demand_vel_q24, int64_t dt_ns)
{
    if (self->blocked && torque && self->plant.winding.given)
        sim_plant_press(&self->plant, demand_q24, demand_vel_q24, dt_ns);
    else if (self->blocked)
        sim_plant_block(&self->plant);
    else if (torque)
        sim_plant_step(&self->plant, demand_q24, demand_vel_q24, dt_ns);
    else
        sim_plant_coast(&self->plant, dt_ns);
    self->plant_ns += dt_ns;
    if (self->plant.winding.given)
        sim_servo_feel(self, torque);
}

void sim_servo_push(struct sim_servo *self, double share)
{
    const double held = isnan(share) ? 0 : fmin(fmax(share, -16), 16);

    self->plant.push_q8 =
        llround(held * 256 * (double)self->plant.config.acc_max_counts_s2);
}

double sim_servo_torque(const struct sim_servo *self)
{
    return (double)self->plant.acc_q8 / 256 /
           (double)self->plant.config.acc_max_counts_s2;
}

void sim_servo_boot(struct sim_servo *self, int64_t boot_ns)
{
    sim_servo_advance(self);
    self->boot_ns = self->world->now_ns + boot_ns;
}

/* ---- what may happen to it ---- */

static void sim_servo_happen(struct sim_servo *self,
                             void (*happen)(struct sim_servo *self))
{
    if (happen != NULL)
        happen(self);
}

static void sim_servo_regain_power(struct sim_servo *self)
{
    if (self->unpowered)
        sim_servo_happen(self, self->ops->reboot);
    self->unpowered = false;
}

void sim_servo_end(struct sim_servo *self, enum sim_servo_fault fault)
{
    bool *const lasting[SIM_SERVO_FAULTS] = {
        [SIM_SERVO_ENCODER] = &self->encoder_lost,
        [SIM_SERVO_DEAF] = &self->deaf,
        [SIM_SERVO_IGNORES_STATE] = &self->ignores_state,
        [SIM_SERVO_NOT_A_NUMBER] = &self->nan,
        [SIM_SERVO_BLOCKED] = &self->blocked,
        [SIM_SERVO_FROZEN] = &self->frozen,
        [SIM_SERVO_REVERSED] = &self->plant.reversed,
    };

    sim_servo_advance(self);
    if (lasting[fault] != NULL)
        *lasting[fault] = false;
    if (fault == SIM_SERVO_SILENT || fault == SIM_SERVO_POWER)
        sim_can_port_set_off(&self->port, false);
    if (fault == SIM_SERVO_POWER)
        sim_servo_regain_power(self);
}

static void sim_servo_clear(struct sim_servo *self)
{
    self->jump_q24 = 0;
    self->plant.friction_q8 = 0;
    for (unsigned i = 0; i < SIM_SERVO_CLEAR; i++)
        sim_servo_end(self, (enum sim_servo_fault)i);
}

static void sim_servo_lose_power(struct sim_servo *self)
{
    self->unpowered = true;
    sim_can_port_set_off(&self->port, true);
    sim_servo_happen(self, self->ops->reboot);
}

void sim_servo_trip(struct sim_servo *self, uint32_t code)
{
    sim_servo_advance(self);
    if (self->ops->trip != NULL)
        self->ops->trip(self, code);
}

void sim_servo_rub(struct sim_servo *self, int64_t counts_s2)
{
    sim_servo_advance(self);
    self->plant.friction_q8 = counts_s2 * 256;
}

void sim_servo_jump(struct sim_servo *self, int64_t counts)
{
    sim_servo_advance(self);
    self->jump_q24 += counts * (INT64_C(1) << 24);
}

int64_t sim_servo_reported_q24(const struct sim_servo *self)
{
    return self->frozen ? self->frozen_q24
                        : sim_plant_measured_q24(&self->plant) + self->jump_q24;
}

void sim_servo_inject(struct sim_servo *self, enum sim_servo_fault fault)
{
    sim_servo_advance(self);
    switch (fault) {
    case SIM_SERVO_ENCODER:
        self->encoder_lost = true;
        sim_servo_happen(self, self->ops->lose_encoder);
        break;
    case SIM_SERVO_TRIP:
        sim_servo_trip(self, 0);
        break;
    case SIM_SERVO_REBOOT:
        sim_servo_happen(self, self->ops->reboot);
        break;
    case SIM_SERVO_SILENT:
        sim_can_port_set_off(&self->port, true);
        break;
    case SIM_SERVO_DEAF:
        self->deaf = true;
        break;
    case SIM_SERVO_IGNORES_STATE:
        self->ignores_state = true;
        break;
    case SIM_SERVO_NOT_A_NUMBER:
        self->nan = true;
        break;
    case SIM_SERVO_BLOCKED:
        self->blocked = true;
        break;
    case SIM_SERVO_FROZEN:
        self->frozen_q24 = sim_servo_reported_q24(self);
        self->frozen = true;
        break;
    case SIM_SERVO_REVERSED:
        self->plant.reversed = true;
        break;
    case SIM_SERVO_POWER:
        sim_servo_lose_power(self);
        break;
    case SIM_SERVO_CLEAR:
        sim_servo_clear(self);
        break;
    case SIM_SERVO_FAULTS:
        break;
    }
}

int64_t sim_servo_pos_q24(const struct sim_servo *self)
{
    return self->plant.pos_q24;
}
