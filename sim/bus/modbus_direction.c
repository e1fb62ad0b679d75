/* sim/bus/modbus_direction.c - see modbus_direction.h. */
#include "sim/bus/modbus_direction.h"

#include <stddef.h>
#include <string.h>

/* Linux's shortest time before a segment is sent again, doubled each time. */
#define RESEND_NS     INT64_C(200000000)
#define RESEND_MAX_NS INT64_C(25600000000)

enum sim_modbus_fault
sim_modbus_direction_draw(struct sim_modbus_direction *self, uint64_t *seed)
{
    const enum sim_modbus_fault fault = self->fault;

    if (fault == SIM_MODBUS_GOOD ||
        (self->share_q32 > 0 && !sim_impairment_draws(seed, self->share_q32)))
        return SIM_MODBUS_GOOD;
    self->spoilt++;
    if (self->times > 0 && --self->times == 0)
        self->fault = SIM_MODBUS_GOOD;
    return fault;
}

/* The last of those that it stays behind: of its connection; NULL: none. */
static const struct sim_modbus_held *
direction_before(const struct sim_modbus_direction *self, uint32_t tag)
{
    for (unsigned i = self->count; i > 0; i--)
        if (self->held[i - 1].tag == tag)
            return &self->held[i - 1];
    return NULL;
}

static void direction_hold(struct sim_modbus_direction *self,
                           const struct sim_modbus_held *frame, int64_t due_ns)
{
    const struct sim_modbus_held *before = direction_before(self, frame->tag);

    if (self->count == SIM_MODBUS_DIRECTION_HELD) {
        self->lost++;
        return;
    }
    if (before != NULL && before->due_ns > due_ns)
        due_ns = before->due_ns;
    self->held[self->count] = *frame;
    self->held[self->count++].due_ns = due_ns;
}

/* How long until it has been sent often enough; -1: for ever. */
static int64_t direction_lose(struct sim_modbus_direction *self, uint64_t *seed)
{
    int64_t late_ns = 0, wait_ns = RESEND_NS;

    while (sim_impairment_draws(seed, self->impairment.loss_q32)) {
        self->lost++;
        if (!self->resends || wait_ns > RESEND_MAX_NS)
            return -1;
        late_ns += wait_ns;
        wait_ns *= 2;
    }
    return late_ns;
}

bool sim_modbus_direction_pass(struct sim_modbus_direction *self,
                               enum sim_modbus_fault fault, uint64_t *seed,
                               const struct sim_modbus_held *frame,
                               int64_t now_ns, int64_t again_ns)
{
    int64_t late_ns =
        fault == SIM_MODBUS_MUTE ? -1 : direction_lose(self, seed);

    if (late_ns < 0)
        return false;
    late_ns += sim_impairment_late_ns(&self->impairment, seed) +
               (fault == SIM_MODBUS_LATE ? self->late_ns : 0);
    const bool twice =
        sim_impairment_draws(seed, self->impairment.duplication_q32);
    const bool late = late_ns > 0 || direction_before(self, frame->tag) != NULL;
    self->doubled += twice;
    if (late)
        direction_hold(self, frame, now_ns + late_ns);
    if (twice)
        direction_hold(self, frame, now_ns + late_ns + again_ns);
    return !late;
}

/* The first that is due. */
static unsigned direction_next(const struct sim_modbus_direction *self)
{
    unsigned next = 0;

    for (unsigned i = 1; i < self->count; i++)
        if (self->held[i].due_ns < self->held[next].due_ns)
            next = i;
    return next;
}

int64_t sim_modbus_direction_due_ns(const struct sim_modbus_direction *self)
{
    return self->count > 0 ? self->held[direction_next(self)].due_ns
                           : INT64_MAX;
}

bool sim_modbus_direction_take(struct sim_modbus_direction *self,
                               int64_t now_ns, struct sim_modbus_held *frame)
{
    const unsigned next = direction_next(self);

    if (self->count == 0 || self->held[next].due_ns > now_ns)
        return false;
    *frame = self->held[next];
    self->count--;
    memmove(&self->held[next], &self->held[next + 1],
            (self->count - next) * sizeof self->held[0]);
    return true;
}

void sim_modbus_direction_forget(struct sim_modbus_direction *self)
{
    self->lost += self->count;
    self->count = 0;
}
