/* sim/bus/impairment.c - see impairment.h. */
#include "sim/bus/impairment.h"

#include "sim/util.h"

bool sim_impairment_draws(uint64_t *seed, uint64_t share_q32)
{
    return share_q32 > 0 && sim_random(seed) >> 32 < share_q32;
}

int64_t sim_impairment_late_ns(const struct sim_impairment *self,
                               uint64_t *seed)
{
    int64_t late_ns = self->delay_ns;

    if (self->jitter_ns > 0)
        late_ns += (int64_t)(sim_random(seed) % (uint64_t)self->jitter_ns);
    return late_ns;
}
