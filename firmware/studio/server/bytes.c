/* firmware/studio/server/bytes.c - see bytes.h. */
#include "firmware/studio/server/bytes.h"

#include <string.h>

#define BYTES_MAGIC 0x31574C53u /* "SLW1" */

struct bytes {
    uint8_t *at;
};

static void bytes_put(struct bytes *self, uint64_t value, unsigned size)
{
    for (unsigned i = 0; i < size; i++)
        *self->at++ = (uint8_t)(value >> 8 * i);
}

static unsigned bytes_bit(bool is, unsigned bit)
{
    return is ? bit : 0;
}

static void bytes_range(struct bytes *self, const struct service_range *range)
{
    bytes_put(self, (uint64_t)range->last, 8);
    bytes_put(self, (uint64_t)range->low, 8);
    bytes_put(self, (uint64_t)range->high, 8);
}

static void bytes_head(struct bytes *self, const struct rig *rig,
                       const struct service_frame *frame,
                       const struct bytes_count *count)
{
    const struct service_state *state = &frame->state;

    bytes_put(self, BYTES_MAGIC, 4);
    bytes_put(self, rig->axis_count, 2);
    bytes_put(self, rig->bus_count, 1);
    bytes_put(self, rig->line_count, 1);
    bytes_put(self, count->number, 4);
    bytes_put(self, frame->ticks, 4);
    bytes_put(self, state->ticks, 8);
    bytes_put(self, (uint64_t)state->now_ns, 8);
    bytes_put(self, (uint64_t)state->rate.s_ns_q12, 8);
    bytes_put(self, (uint64_t)state->move_end_ns_q12, 8);
    bytes_put(self, (uint64_t)state->rate.rate_q30, 8);
    bytes_put(self, (uint64_t)state->override_q30, 8);
    bytes_put(self, state->ticks_lost, 4);
    bytes_put(self, 0, 4);
    bytes_put(self, (uint64_t)frame->late_ns, 8);
    bytes_put(self, state->state, 1);
    bytes_put(self,
              bytes_bit(state->enabling, 1) | bytes_bit(state->homing, 2) |
                  bytes_bit(state->jogging, 4) | bytes_bit(state->reversed, 8) |
                  bytes_bit(state->off, 16) | bytes_bit(count->is_real, 32),
              1);
    bytes_put(self, 0, 2);
    bytes_put(self, count->joined, 4);
}

static void bytes_axis(struct bytes *self,
                       const struct service_frame_axis *axis,
                       const struct machine_view_axis *view)
{
    bytes_range(self, &axis->demand_q32);
    bytes_range(self, &axis->actual_q32);
    bytes_range(self, &axis->following_q32);
    bytes_put(self, (uint64_t)view->vel_q32, 8);
    bytes_put(self, (uint32_t)view->torque_permille, 4);
    bytes_put(self, view->statusword, 2);
    bytes_put(self, view->fault_code, 2);
    bytes_put(self, view->drive, 1);
    bytes_put(self,
              bytes_bit(view->known, 1) | bytes_bit(view->homed, 2) |
                  bytes_bit(view->torque_known, 4) |
                  bytes_bit(view->home_switch, 8) |
                  bytes_bit(view->limit_negative, 16) |
                  bytes_bit(view->limit_positive, 32) |
                  bytes_bit(view->probe_latched, 64) |
                  bytes_bit(view->has_statusword, 128),
              1);
    memset(self->at, 0, 14);
    self->at += 14;
}

static void bytes_bus(struct bytes *self, const struct machine_view_bus *bus)
{
    bytes_put(self, (uint64_t)bus->busy_ns, 8);
    bytes_put(self, bus->errors, 8);
    bytes_put(self, (uint32_t)bus->can_state, 4);
    bytes_put(self, 0, 4);
}

size_t bytes_of_frame(const struct rig *rig, const struct service_frame *frame,
                      const struct bytes_count *count, uint8_t to[BYTES_MAX])
{
    const struct machine_view *view = &frame->state.view;
    struct bytes self = { to };

    bytes_head(&self, rig, frame, count);
    for (unsigned i = 0; i < rig->axis_count; i++)
        bytes_axis(&self, &frame->axis[i], &view->axis[i]);
    for (unsigned i = 0; i < rig->bus_count; i++)
        bytes_bus(&self, &view->bus[i]);
    for (unsigned i = 0; i < rig->line_count; i++)
        bytes_put(&self, view->line[i] < 0 ? 0xFF : (uint64_t)view->line[i], 1);
    return (size_t)(self.at - to);
}
