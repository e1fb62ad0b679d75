/* sim/bus/impairment.h - what a bus does to frames in one direction, whatever they
 * are of: delay, jitter, loss and duplication, as of Linux's netem. */
#ifndef SIM_BUS_IMPAIRMENT_H
#define SIM_BUS_IMPAIRMENT_H

#include <stdbool.h>
#include <stdint.h>

struct sim_impairment {
    int64_t delay_ns;         /* every frame so much later, */
    int64_t jitter_ns;        /* and up to so much more, at random; in order */
    uint64_t loss_q32;        /* so many in 2^32 are lost, */
    uint64_t duplication_q32; /* come twice: 0 .. 2^32 */
};

/* True for so many in 2^32; draws nothing for none. */
bool sim_impairment_draws(uint64_t *seed, uint64_t share_q32);

/* How much later the next frame comes. */
int64_t sim_impairment_late_ns(const struct sim_impairment *self,
                               uint64_t *seed);

#endif
