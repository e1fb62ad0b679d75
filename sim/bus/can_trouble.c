/* sim/bus/can_trouble.c - see can_trouble.h. */
#include "sim/bus/can_trouble.h"

#include "sim/util.h"

static int64_t sim_can_trouble_due_ns(const struct sim_member *member)
{
    const struct sim_can_trouble *self =
        CONTAINER_OF_CONST(member, struct sim_can_trouble, member);

    return self->count > 0 ? self->held_ns[self->head] : SIM_WORLD_NEVER;
}

static void sim_can_trouble_hand(struct sim_can_trouble *self,
                                 const struct hal_can_frame *frame)
{
    if (!self->incoming)
        (void)sim_can_port_put(self->port, frame);
    else if (!self->port->off)
        sim_can_port_hand(self->port, frame);
}

/* A port that takes no frame loses it, as one that sends at once does. */
static void sim_can_trouble_run(struct sim_member *member, int64_t now_ns)
{
    struct sim_can_trouble *self =
        CONTAINER_OF(member, struct sim_can_trouble, member);

    while (self->count > 0 && self->held_ns[self->head] <= now_ns) {
        struct hal_can_frame *const frame = &self->held[self->head];
        if (self->incoming)
            frame->t_ns = self->held_ns[self->head];
        sim_can_trouble_hand(self, frame);
        self->head = (self->head + 1) % SIM_CAN_TROUBLE_HELD;
        self->count--;
    }
}

static const struct sim_member_ops sim_can_trouble_ops = {
    .due_ns = sim_can_trouble_due_ns,
    .run = sim_can_trouble_run,
};

int sim_can_trouble_init(struct sim_can_trouble *self,
                         struct sim_can_port *port, bool incoming,
                         uint64_t seed)
{
    *self = (struct sim_can_trouble){ .member.ops = &sim_can_trouble_ops,
                                      .port = port,
                                      .incoming = incoming,
                                      .seed = seed };
    if (incoming)
        port->trouble_in = self;
    else
        port->trouble = self;
    return sim_world_add(port->bus->world, &self->member);
}

/* One bit at least of one byte. */
static void sim_can_trouble_spoil(struct sim_can_trouble *self,
                                  struct hal_can_frame *frame)
{
    const uint64_t random = sim_random(&self->seed);
    const uint8_t flip = (uint8_t)(random >> 8 & 0xFF);

    frame->data[random % frame->len] ^= flip != 0 ? flip : 0x80;
    self->spoil--;
    self->spoilt++;
}

/* What is late stays behind what was late before it. */
static void sim_can_trouble_hold(struct sim_can_trouble *self,
                                 const struct hal_can_frame *frame)
{
    const unsigned at = (self->head + self->count) % SIM_CAN_TROUBLE_HELD;

    if (self->count == SIM_CAN_TROUBLE_HELD) {
        self->dropped++;
        return;
    }
    self->held[at] = *frame;
    self->held_ns[at] = self->port->bus->world->now_ns +
                        sim_impairment_late_ns(&self->impairment, &self->seed);
    if (self->count > 0) {
        const unsigned last =
            (at + SIM_CAN_TROUBLE_HELD - 1) % SIM_CAN_TROUBLE_HELD;

        if (self->held_ns[last] > self->held_ns[at])
            self->held_ns[at] = self->held_ns[last];
    }
    self->count++;
}

bool sim_can_trouble_pass(struct sim_can_trouble *self,
                          struct hal_can_frame *frame)
{
    const struct sim_impairment *const impairment = &self->impairment;

    if (sim_impairment_draws(&self->seed, impairment->loss_q32)) {
        self->dropped++;
        return false;
    }
    if (self->drops && frame->id == self->drop_id && !frame->remote) {
        self->dropped++;
        return false;
    }
    if (self->spoil > 0 && frame->len > 0 && !frame->remote)
        sim_can_trouble_spoil(self, frame);
    const bool twice =
        sim_impairment_draws(&self->seed, impairment->duplication_q32);
    const bool late = impairment->delay_ns > 0 || impairment->jitter_ns > 0 ||
                      self->count > 0;
    self->doubled += twice;
    if (late)
        sim_can_trouble_hold(self, frame);
    if (twice)
        sim_can_trouble_hold(self, frame);
    return !late;
}
