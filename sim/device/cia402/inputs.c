/* sim/device/cia402/inputs.c - switches and index pulses along the axis, and
 * the touch probe.  Source: CiA 402-2 9.3 (0x60B8 to 0x60BB) and 0x60FD. */
#include "sim/device/cia402/parts.h"

#define CIA402_PROBE_ON      0x0001
#define CIA402_PROBE_AGAIN   0x0002 /* each edge, not the first alone */
#define CIA402_PROBE_INDEX   0x0004 /* the index pulse is the input */
#define CIA402_PROBE_RISES   0x0010
#define CIA402_PROBE_FALLS   0x0020
#define CIA402_PROBE_SW_ON   0x0001
#define CIA402_PROBE_SW_ROSE 0x0002
#define CIA402_PROBE_SW_FELL 0x0004

uint32_t cia402_inputs(const struct sim_cia402 *self)
{
    const struct sim_cia402_rail *rail = &self->config.rail;
    const int64_t at = cia402_motion_counts(self->base.plant.pos_q24);
    uint32_t inputs = self->inputs;

    if (rail->has_limits && at <= rail->limit_negative)
        inputs |= CIA402_INPUT_NEGATIVE;
    if (rail->has_limits && at >= rail->limit_positive)
        inputs |= CIA402_INPUT_POSITIVE;
    if (rail->has_home && at >= rail->home_from && at <= rail->home_to)
        inputs |= CIA402_INPUT_HOME;
    return inputs | (self->no_power ? CIA402_INPUT_NO_POWER : 0);
}

int64_t cia402_inputs_index(const struct sim_cia402 *self, int64_t pos_q24)
{
    const int64_t every_q24 = (int64_t)self->config.rail.index_every << 24;
    const int64_t number = every_q24 == 0 ? 0 : pos_q24 / every_q24;

    return every_q24 != 0 && pos_q24 < number * every_q24 ? number - 1 : number;
}

void cia402_inputs_probe(struct sim_cia402 *self)
{
    sim_servo_advance(&self->base);
    self->value[CIA402_PROBE_STATUS] =
        self->value[CIA402_PROBE_FUNCTION] & CIA402_PROBE_ON
            ? CIA402_PROBE_SW_ON
            : 0;
}

static void cia402_inputs_latch(struct sim_cia402 *self, uint32_t edge,
                                uint32_t stored, int row)
{
    const uint32_t function = self->value[CIA402_PROBE_FUNCTION];
    uint32_t *status = &self->value[CIA402_PROBE_STATUS];

    if (!(function & edge) ||
        ((*status & stored) && !(function & CIA402_PROBE_AGAIN)))
        return;
    *status |= stored;
    self->value[row] = cia402_motion_seen(self, cia402_motion_actual_q24(self));
}

static void cia402_inputs_probe_edges(struct sim_cia402 *self, uint32_t changed,
                                      bool index)
{
    const uint32_t function = self->value[CIA402_PROBE_FUNCTION];
    const bool by_index = (function & CIA402_PROBE_INDEX) != 0;
    const bool edge = by_index ? index : (changed & CIA402_INPUT_PROBE) != 0;

    if (!(function & CIA402_PROBE_ON) || !edge)
        return;
    if (by_index || (self->inputs & CIA402_INPUT_PROBE))
        cia402_inputs_latch(self, CIA402_PROBE_RISES, CIA402_PROBE_SW_ROSE,
                            CIA402_PROBE_RISING);
    else
        cia402_inputs_latch(self, CIA402_PROBE_FALLS, CIA402_PROBE_SW_FELL,
                            CIA402_PROBE_FALLING);
}

void cia402_inputs_watch(struct sim_cia402 *self)
{
    const uint32_t inputs = cia402_inputs(self);
    const int64_t index = cia402_inputs_index(self, self->base.plant.pos_q24);

    cia402_inputs_probe_edges(self, inputs ^ self->inputs_seen,
                              index != self->index_seen);
    self->inputs_seen = inputs;
    self->index_seen = index;
}
